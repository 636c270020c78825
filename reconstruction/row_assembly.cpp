#include "reconstruction/row_assembly.hpp"

#include <algorithm>
#include <mutex>
#include <utility>

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

}  // namespace

GradientStencilTable assemble_rows(int gdim, std::span<const Index> vertices, const RowMaker& make_row) {
  return assemble_rows_with_workers(gdim, vertices, [&]() -> RowMaker { return std::cref(make_row); });
}

GradientStencilTable assemble_rows_with_workers(int gdim, std::span<const Index> vertices,
                                                const std::function<RowMaker()>& make_worker) {
  // Fixed chunks, each with its own table, joined in order: the same bits for any schedule.
  constexpr std::int64_t chunk_size = 64;
  const std::int64_t num_vertices = static_cast<std::int64_t>(vertices.size());
  const std::int64_t num_chunks = (num_vertices + chunk_size - 1) / chunk_size;
  std::vector<GradientStencilTable> chunks(num_chunks);
  WorkerPool workers(make_worker);
  parallel_for(num_chunks, 1, [&](std::int64_t begin, std::int64_t end) {
    RowMaker make_row = workers.take();
    StencilRow row;
    for (std::int64_t c = begin; c < end; ++c) {
      GradientStencilTable& chunk = chunks[c];
      for (std::int64_t r = c * chunk_size; r < std::min((c + 1) * chunk_size, num_vertices); ++r) {
        row.clear();
        make_row(vertices[r], row);
        chunk.neighbors.insert(chunk.neighbors.end(), row.neighbors.begin(), row.neighbors.end());
        chunk.weights.insert(chunk.weights.end(), row.weights.begin(), row.weights.end());
        chunk.hessian_weights.insert(chunk.hessian_weights.end(), row.hessian_weights.begin(),
                                     row.hessian_weights.end());
        chunk.offsets.push_back(static_cast<Offset>(chunk.neighbors.size()));
        chunk.diagnostics.push_back(row.diagnostics);
      }
    }
    workers.give_back(std::move(make_row));
  });
  GradientStencilTable table;
  table.gdim = gdim;
  table.vertices.assign(vertices.begin(), vertices.end());
  for (GradientStencilTable& chunk : chunks) {
    const Offset base = table.num_entries();
    for (std::size_t r = 1; r < chunk.offsets.size(); ++r) table.offsets.push_back(base + chunk.offsets[r]);
    const auto append = [](auto& to, auto& from) {
      to.insert(to.end(), from.begin(), from.end());
      from = {};
    };
    append(table.neighbors, chunk.neighbors);
    append(table.weights, chunk.weights);
    append(table.hessian_weights, chunk.hessian_weights);
    append(table.diagnostics, chunk.diagnostics);
  }
  return table;
}

void compose_row(const CellGradients& cells, Index vertex, std::span<const Index> cell_numbers,
                 std::span<const double> cell_weights, StencilRow& row) {
  const int gdim = cells.gdim();
  for (Index cell : cell_numbers)
    for (Index v : cells.vertices_of(cell))
      if (v != vertex) row.neighbors.push_back(v);
  std::sort(row.neighbors.begin(), row.neighbors.end());
  row.neighbors.erase(std::unique(row.neighbors.begin(), row.neighbors.end()), row.neighbors.end());
  row.weights.assign(row.neighbors.size() * gdim, 0.0);
  for (std::size_t k = 0; k < cell_numbers.size(); ++k) {
    const CellGradient cell = cells.gradient(cell_numbers[k]);
    const std::span<const Index> nodes = cells.vertices_of(cell_numbers[k]);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      if (nodes[i] == vertex) continue;
      const auto entry = std::lower_bound(row.neighbors.begin(), row.neighbors.end(), nodes[i]) - row.neighbors.begin();
      for (int a = 0; a < gdim; ++a) row.weights[entry * gdim + a] += cell_weights[k] * cell.weights(i, a);
    }
  }
}

}  // namespace halfgrad
