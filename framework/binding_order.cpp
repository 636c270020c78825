#include "framework/binding_order.hpp"

#include <array>
#include <numeric>

#include "framework/error.hpp"
#include "framework/grid.hpp"
#include "framework/large_array.hpp"

namespace halfgrad {

namespace {

// Interleaves the bits of quantised coordinates, 32 in all: cells near in space get near numbers.
class MortonCode {
 public:
  explicit MortonCode(const Points& vertices) : gdim_(static_cast<int>(vertices.cols())) {
    const Eigen::RowVectorXd low = vertices.colwise().minCoeff(), high = vertices.colwise().maxCoeff();
    const double extent = (high - low).maxCoeff();
    low_.assign(low.begin(), low.end());
    const double steps = static_cast<double>((std::int64_t{1} << 32 / gdim_) - 1);
    scale_ = extent > 0 ? steps / extent : 0;
    for (std::uint32_t byte = 0; byte < 256; ++byte)
      for (int b = 0; b < 8; ++b) spread_[byte] |= static_cast<std::uint64_t>(byte >> b & 1) << b * gdim_;
  }

  std::uint32_t operator()(const double* position) const {
    std::uint64_t code = 0;
    for (int k = 0; k < gdim_; ++k) {
      const auto step = static_cast<std::uint32_t>((position[k] - low_[k]) * scale_);
      for (int byte = 0; 8 * byte < 32 / gdim_; ++byte)
        code |= spread_[step >> 8 * byte & 255] << (8 * byte * gdim_ + gdim_ - 1 - k);
    }
    return static_cast<std::uint32_t>(code);
  }

 private:
  int gdim_;
  std::vector<double> low_;
  double scale_;
  std::array<std::uint64_t, 256> spread_{};
};

struct CodedCell {
  std::uint32_t code;
  Index cell;
};

// Sorts by code; cells of one code keep their order.
void sort_by_code(std::vector<CodedCell>& cells) {
  constexpr int bits = 11, mask = (1 << bits) - 1;
  std::vector<CodedCell> sorted;
  reserve_large(sorted, cells.size());
  sorted.resize(cells.size());
  for (int shift = 0; shift < 32; shift += bits) {
    std::array<Index, mask + 2> next{};
    for (const CodedCell& cell : cells) ++next[(cell.code >> shift & mask) + 1];
    std::partial_sum(next.begin(), next.end(), next.begin());
    for (const CodedCell& cell : cells) sorted[next[cell.code >> shift & mask]++] = cell;
    cells.swap(sorted);
  }
}

// How many points each cell holds.
std::vector<Index> points_a_cell(const Mesh& mesh, const Embedding& embedding) {
  std::vector<Index> count(static_cast<std::size_t>(mesh.num_cells()), 0);
  for (Index cell : embedding.cells)
    if (cell >= 0) ++count[cell];
  return count;
}

// The cells that hold points, sorted along a space-filling curve.
std::vector<Index> cells_along_curve(const Mesh& mesh, std::span<const Index> count) {
  std::vector<CodedCell> coded;
  reserve_large(coded, count.size() - static_cast<std::size_t>(std::ranges::count(count, 0)));
  if (mesh.num_cells() > 0) {
    const MortonCode code(mesh.vertices());
    for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index first) {
      for (Eigen::Index c = 0; c < block.cells.rows(); ++c)
        if (const auto cell = static_cast<Index>(first + c); count[cell] > 0)
          coded.push_back({code(mesh.vertices().data() + block.cells(c, 0) * mesh.vertices().cols()), cell});
    });
  }
  sort_by_code(coded);
  std::vector<Index> cells;
  cells.reserve(coded.size());
  for (const CodedCell& each : coded) cells.push_back(each.cell);
  return cells;
}

std::vector<Index> vertices_by_first_use(const Mesh& mesh, std::span<const Index> cells) {
  std::vector<char> seen(static_cast<std::size_t>(mesh.num_vertices()), 0);
  std::vector<Index> active;
  for (Index cell : cells)
    for (Index v : mesh.cell_vertices(cell))
      if (!seen[v]) {
        seen[v] = 1;
        active.push_back(v);
      }
  return active;
}

}  // namespace

BindingOrder binding_order(const Mesh& mesh, const Embedding& embedding) {
  if (embedding.gdim != mesh.gdim())
    raise("points embedded in {} dimensions, but the mesh has {}", embedding.gdim, mesh.gdim());
  std::vector<Index> count = points_a_cell(mesh, embedding);
  BindingOrder order;
  order.cells = cells_along_curve(mesh, count);
  order.first_point.reserve(order.cells.size() + 1);
  order.first_point.push_back(0);
  for (const Index cell : order.cells) {
    const Index begin = order.first_point.back();
    order.first_point.push_back(begin + count[cell]);
    count[cell] = begin;  // now where the cell's next point goes
  }
  order.points.resize(static_cast<std::size_t>(order.first_point.back()));
  for (Index p = 0; p < embedding.num_points(); ++p)
    if (embedding.cells[p] >= 0) order.points[count[embedding.cells[p]]++] = p;
  order.vertices = vertices_by_first_use(mesh, order.cells);
  return order;
}

std::vector<Index> active_vertices(const Mesh& mesh, const Embedding& embedding) {
  return vertices_by_first_use(mesh, cells_along_curve(mesh, points_a_cell(mesh, embedding)));
}

std::vector<Index> active_vertices(const Grid& grid, const Embedding& embedding) {
  const GridPart part = active_part(grid, embedding);
  std::vector<Index> active = active_vertices(part.mesh, part.embedding);
  for (Index& vertex : active) vertex = part.vertices[vertex];
  return active;
}

}  // namespace halfgrad
