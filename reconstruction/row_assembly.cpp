#include "reconstruction/row_assembly.hpp"

#include <algorithm>
#include <mutex>
#include <utility>

#include "framework/large_array.hpp"
#include "framework/parallel.hpp"

namespace halfgrad {

void StencilRow::clear() {
  neighbors.clear();
  weights.clear();
  hessian_weights.clear();
  diagnostics = {};
}

namespace {

// Workspaces in stock: a range of work takes one and gives it back.
class WorkerPool {
 public:
  explicit WorkerPool(const std::function<RowMaker()>& make_worker) : make_worker_(make_worker) {}

  RowMaker take() {
    {
      const std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        RowMaker worker = std::move(idle_.back());
        idle_.pop_back();
        return worker;
      }
    }
    return make_worker_();
  }

  void give_back(RowMaker worker) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(worker));
  }

 private:
  const std::function<RowMaker()>& make_worker_;
  std::mutex mutex_;
  std::vector<RowMaker> idle_;
};

// The rows of some vertices, in a table that keeps its storage.
void fill(std::span<const Index> vertices, const RowMaker& make_row, StencilRow& row, GradientStencilTable& chunk) {
  chunk.offsets.assign(1, 0);
  chunk.neighbors.clear();
  chunk.weights.clear();
  chunk.hessian_weights.clear();
  chunk.diagnostics.clear();
  for (const Index vertex : vertices) {
    row.clear();
    make_row(vertex, row);
    chunk.neighbors.insert(chunk.neighbors.end(), row.neighbors.begin(), row.neighbors.end());
    chunk.weights.insert(chunk.weights.end(), row.weights.begin(), row.weights.end());
    chunk.hessian_weights.insert(chunk.hessian_weights.end(), row.hessian_weights.begin(), row.hessian_weights.end());
    chunk.offsets.push_back(static_cast<Offset>(chunk.neighbors.size()));
    chunk.diagnostics.push_back(row.diagnostics);
  }
}

void append(const GradientStencilTable& chunk, GradientStencilTable& table) {
  const Offset base = table.num_entries();
  for (std::size_t r = 1; r < chunk.offsets.size(); ++r) table.offsets.push_back(base + chunk.offsets[r]);
  const auto join = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  join(table.neighbors, chunk.neighbors);
  join(table.weights, chunk.weights);
  join(table.hessian_weights, chunk.hessian_weights);
  join(table.diagnostics, chunk.diagnostics);
}

// Room for all rows if they are at most twice as long as the first ones, which may lie on a boundary. Room that is not
// used is never touched.
void reserve_for(std::int64_t num_rows, std::int64_t num_made, GradientStencilTable& table) {
  if (num_made >= num_rows) return;
  const double growth = 2 * static_cast<double>(num_rows) / static_cast<double>(num_made);
  for (auto* weights : {&table.weights, &table.hessian_weights})
    reserve_large(*weights, static_cast<std::size_t>(growth * static_cast<double>(weights->size())));
  reserve_large(table.neighbors, static_cast<std::size_t>(growth * static_cast<double>(table.neighbors.size())));
}

}  // namespace

GradientStencilTable assemble_rows(int gdim, std::span<const Index> vertices, const RowMaker& make_row) {
  return assemble_rows_with_workers(gdim, vertices, [&]() -> RowMaker { return std::cref(make_row); });
}

GradientStencilTable assemble_rows_with_workers(int gdim, std::span<const Index> vertices,
                                                const std::function<RowMaker()>& make_worker) {
  // Fixed chunks, each with its own table, joined in order: the same bits for any schedule. A wave of chunks at a time,
  // so that beside the result there is never more than a wave.
  constexpr std::int64_t chunk_size = 64, wave_size = 64;
  const std::int64_t num_vertices = static_cast<std::int64_t>(vertices.size());
  const std::int64_t num_chunks = (num_vertices + chunk_size - 1) / chunk_size;
  std::vector<GradientStencilTable> chunks(std::min(num_chunks, wave_size));
  WorkerPool workers(make_worker);
  GradientStencilTable table;
  table.gdim = gdim;
  table.vertices.assign(vertices.begin(), vertices.end());
  table.offsets.reserve(vertices.size() + 1);
  table.diagnostics.reserve(vertices.size());
  for (std::int64_t wave = 0; wave < num_chunks; wave += wave_size) {
    const std::int64_t num_in_wave = std::min(wave_size, num_chunks - wave);
    parallel_for(num_in_wave, 1, [&](std::int64_t begin, std::int64_t end) {
      RowMaker make_row = workers.take();
      StencilRow row;
      for (std::int64_t c = begin; c < end; ++c) {
        const std::int64_t first = (wave + c) * chunk_size;
        fill(vertices.subspan(first, std::min(chunk_size, num_vertices - first)), make_row, row, chunks[c]);
      }
      workers.give_back(std::move(make_row));
    });
    for (std::int64_t c = 0; c < num_in_wave; ++c) append(chunks[c], table);
    if (wave == 0) reserve_for(num_vertices, num_in_wave * chunk_size, table);
  }
  return table;
}

template <int D>
void RowComposer::compose_in(const CellGradients& cells, Index vertex, std::span<const Index> cell_numbers,
                             std::span<const double* const> gradients, std::span<const double> cell_weights,
                             StencilRow& row) {
  places_.clear();
  keys_.clear();
  sums_.clear();
  for (std::size_t k = 0; k < cell_numbers.size(); ++k) {
    const double* weight = gradients[k];
    for (const Index v : cells.vertices_of(cell_numbers[k])) {
      if (v != vertex) {
        Index& place = places_.of(v);
        if (place < 0) {
          place = static_cast<Index>(keys_.size());
          keys_.push_back(static_cast<std::uint64_t>(v) << 32 | static_cast<std::uint32_t>(place));
          for (int a = 0; a < D; ++a) sums_.push_back(0);
        }
        double* sum = sums_.data() + static_cast<std::size_t>(place) * D;
        for (int a = 0; a < D; ++a) sum[a] += cell_weights[k] * weight[a];
      }
      weight += D;
    }
  }
  std::sort(keys_.begin(), keys_.end());
  row.neighbors.resize(keys_.size());
  row.weights.resize(keys_.size() * D);
  for (std::size_t n = 0; n < keys_.size(); ++n) {
    row.neighbors[n] = static_cast<Index>(keys_[n] >> 32);
    const double* sum = sums_.data() + static_cast<std::uint32_t>(keys_[n]) * D;
    for (int a = 0; a < D; ++a) row.weights[n * D + static_cast<std::size_t>(a)] = sum[a];
  }
}

void RowComposer::compose(const CellGradients& cells, Index vertex, std::span<const Index> cell_numbers,
                          std::span<const double* const> gradients, std::span<const double> cell_weights,
                          StencilRow& row) {
  static_assert(max_gdim == 4);
  switch (cells.gdim()) {
    case 1:
      return compose_in<1>(cells, vertex, cell_numbers, gradients, cell_weights, row);
    case 2:
      return compose_in<2>(cells, vertex, cell_numbers, gradients, cell_weights, row);
    case 3:
      return compose_in<3>(cells, vertex, cell_numbers, gradients, cell_weights, row);
    default:
      return compose_in<4>(cells, vertex, cell_numbers, gradients, cell_weights, row);
  }
}

void compose_row(const CellGradients& cells, Index vertex, std::span<const Index> cell_numbers,
                 std::span<const double> cell_weights, StencilRow& row) {
  std::vector<CellGradient> gradients;
  std::vector<const double*> pointers;
  for (const Index cell : cell_numbers) gradients.push_back(cells.gradient(cell));
  for (const CellGradient& gradient : gradients) pointers.push_back(gradient.weights.data());
  RowComposer().compose(cells, vertex, cell_numbers, pointers, cell_weights, row);
}

}  // namespace halfgrad
