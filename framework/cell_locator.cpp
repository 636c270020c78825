// The points are sorted into a grid and the cells stream past it, so that no index of the cells is built:
//
//   grid of boxes, the last axis fastest      x[0]: | box 0 | box 1 | box 2 | …      one array a coordinate,
//   first[box] … first[box + 1] are its       x[1]: | box 0 | box 1 | box 2 | …      and beside them per point the
//   points in the sorted arrays               x[2]: | box 0 | box 1 | box 2 | …      best margin and its cell
//
// The boxes that a cell's bounds meet along the last axis are one contiguous range of points: a row. A cell tests rows.
// ξ waits in this order too: written at the caller's places while cells are tested, it would miss the cache each time.
// The result is allocated when the coordinates are no longer needed. In R³ this takes 64 bytes a point (16 less a
// dimension less), at most 8 more for the boxes, and with several threads 4 bytes a cell and slab that it meets.
#include "framework/cell_locator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "framework/inverse_map.hpp"
#include "framework/parallel.hpp"
#include "framework/plane_margins.hpp"

namespace halfgrad {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

template <int D>
using Coordinates = Eigen::Matrix<double, D, 1>;

template <int D>
struct Bounds {
  Coordinates<D> low = Coordinates<D>::Constant(infinity), high = Coordinates<D>::Constant(-infinity);
  bool contains(const Coordinates<D>& x) const {
    bool inside = true;
    for (int a = 0; a < D; ++a) inside &= x[a] >= low[a] && x[a] <= high[a];
    return inside;
  }
  bool meets(const Bounds& other) const {
    bool met = true;
    for (int a = 0; a < D; ++a) met &= other.low[a] <= high[a] && other.high[a] >= low[a];
    return met;
  }
  void include(const Coordinates<D>& x) {
    for (int a = 0; a < D; ++a) {
      low[a] = std::min(low[a], x[a]);
      high[a] = std::max(high[a], x[a]);
    }
  }
};

// What a cell can hold: its nodes' bounds, grown by what the tolerance lets weights be negative.
template <Element E>
Bounds<E::dim> cell_bounds(const Mesh& mesh, const ElementBlock<E>& block, Eigen::Index row, double tolerance) {
  const double* vertices = mesh.vertices().data();
  const Index* nodes = block.cells.data() + row * E::num_nodes;
  Bounds<E::dim> bounds;
  for (int a = 0; a < E::dim; ++a) {
    double low = infinity, high = -infinity;
    for (int i = 0; i < E::num_nodes; ++i) {
      const double x = vertices[static_cast<Offset>(nodes[i]) * E::dim + a];
      low = std::min(low, x);
      high = std::max(high, x);
    }
    const double growth = E::num_nodes * tolerance * (high - low);
    bounds.low[a] = low - growth;
    bounds.high[a] = high + growth;
  }
  return bounds;
}

// Calls f(ElementBlock<E>, first cell) for the blocks whose elements have dimension D: all of them, in a mesh of R^D.
template <int D, class Function>
void for_each_block_of_dim(const Mesh& mesh, Function&& f) {
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index first) {
    if constexpr (E::dim == D) f(block, first);
  });
}

// What the cells say about the grid that suits them.
template <int D>
struct CellStatistics {
  Bounds<D> bounds;
  Coordinates<D> mean_extent = Coordinates<D>::Zero();
};

template <int D>
CellStatistics<D> cell_statistics(const Mesh& mesh, double tolerance) {
  CellStatistics<D> result;
  Index num_sampled = 0;
  for_each_block_of_dim<D>(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) {
    // Every cell could set the bounds of the mesh, but a few thousand tell the mean extent.
    const Eigen::Index stride = std::max<Eigen::Index>(1, block.cells.rows() / 4096);
    for (Eigen::Index c = 0; c < block.cells.rows(); c += stride) {
      const auto positions = node_positions(mesh, block, c);
      result.mean_extent += (positions.colwise().maxCoeff() - positions.colwise().minCoeff()).transpose();
      ++num_sampled;
    }
  });
  if (num_sampled > 0) result.mean_extent /= num_sampled;
  const auto vertices = mesh.vertices().template leftCols<D>();
  for (Index v = 0; v < mesh.num_vertices(); ++v) result.bounds.include(vertices.row(v).transpose());
  const double growth = 1e-9 + max_nodes * tolerance;
  const Coordinates<D> extent = result.bounds.high - result.bounds.low;
  result.bounds.low -= growth * extent;
  result.bounds.high += growth * extent;
  return result;
}

// The points within the mesh's bounds, sorted by boxes.
template <int D>
class PointGrid {
 public:
  PointGrid(const Points& points, const CellStatistics<D>& cells, Index num_cells);

  Index num_points() const { return static_cast<Index>(cell.size()); }
  int size(int axis) const { return size_[axis]; }
  // Boxes along an axis that hold a coordinate; monotone, so that no rounding separates a point from its cell.
  int box(int axis, double coordinate) const {
    const double scaled = (coordinate - bounds_.low[axis]) * per_length_[axis];
    return static_cast<int>(std::min(std::max(scaled, 0.0), size_[axis] - 1.0));
  }
  bool meets(const Bounds<D>& cell_bounds) const { return bounds_.meets(cell_bounds); }

  Coordinates<D> position(Index point) const {
    Coordinates<D> result;
    for (int a = 0; a < D; ++a) result[a] = x[a][point];
    return result;
  }

  // Calls f(begin, end) for each row of points that the bounds meet, between boxes first and last along axis 0.
  template <class Function>
  void for_each_row(const Bounds<D>& range, int first_slice, int last_slice, Function&& f) const {
    std::array<int, D> low, high, at;
    for (int a = 0; a < D; ++a) {
      low[a] = box(a, range.low[a]);
      high[a] = box(a, range.high[a]);
    }
    low[0] = std::max(low[0], first_slice);
    high[0] = std::min(high[0], last_slice);
    if (low[0] > high[0]) return;
    at = low;
    while (true) {
      std::int64_t row = 0;
      for (int a = 0; a < D - 1; ++a) row = (row + at[a]) * size_[a + 1];
      // In one dimension the slices are the row's own axis.
      const Index begin = first_[row + low[D - 1]], end = first_[row + high[D - 1] + 1];
      if (begin < end) f(begin, end);
      int a = D - 2;
      while (a >= 0 && at[a] == high[a]) at[a] = low[a], --a;
      if (a < 0) return;
      ++at[a];
    }
  }

  std::array<std::vector<double>, D> x;  // sorted coordinates, and max_lanes unused
  std::vector<double> margin;            // greatest so far, and max_lanes unused
  std::vector<Index> cell;               // of that margin; −1: none yet
  std::vector<Coordinates<D>> xi;        // in that cell
  std::vector<Index> place;              // of each of the caller's points; −1 outside the mesh's bounds

 private:
  Bounds<D> bounds_;  // of the points
  Coordinates<D> per_length_;
  std::array<int, D> size_{};
  std::vector<Index> first_;  // #boxes + 1
};

template <int D>
PointGrid<D>::PointGrid(const Points& points, const CellStatistics<D>& cells, Index num_cells) {
  const Index count = static_cast<Index>(points.rows());
  const auto coordinates = points.template leftCols<D>();
  place.assign(count, -1);
  Index num_kept = 0;
  for (Index p = 0; p < count; ++p) {
    const Coordinates<D> position = coordinates.row(p).transpose();
    if (!cells.bounds.contains(position)) continue;
    place[p] = 0;
    ++num_kept;
    bounds_.include(position);
  }
  // Boxes in proportion to the cells' extents, so that a stretched mesh looks as an isotropic one; about one box for
  // two cells, and no more than two a point.
  const Coordinates<D> extent = num_kept > 0 ? Coordinates<D>(bounds_.high - bounds_.low) : Coordinates<D>::Zero();
  const double target = std::max(1.0, std::min(0.5 * num_cells, 2.0 * num_kept));
  Coordinates<D> in_cells;
  for (int a = 0; a < D; ++a)
    in_cells[a] = extent[a] > 0 ? extent[a] / std::max(cells.mean_extent[a], 1e-9 * extent[a]) : 0;
  // An axis shorter than a box gets one; the others share the target.
  std::array<bool, D> flat{};
  double factor = 1;
  for (int pass = 0; pass <= D; ++pass) {
    double product = 1;
    int num_axes = 0;
    for (int a = 0; a < D; ++a)
      if (!flat[a] && in_cells[a] > 0) product *= in_cells[a], ++num_axes;
    if (num_axes == 0) break;
    factor = std::pow(target / product, 1.0 / num_axes);
    bool changed = false;
    for (int a = 0; a < D; ++a)
      if (!flat[a] && in_cells[a] * factor < 1) flat[a] = changed = true;
    if (!changed) break;
  }
  std::int64_t num_boxes = 1;
  for (int a = 0; a < D; ++a) {
    size_[a] = flat[a] || in_cells[a] == 0 ? 1 : static_cast<int>(std::max(1.0, std::floor(in_cells[a] * factor)));
    per_length_[a] = extent[a] > 0 ? size_[a] / extent[a] : 0;
    if (!std::isfinite(per_length_[a])) per_length_[a] = 0;
    num_boxes *= size_[a];
  }

  first_.assign(static_cast<std::size_t>(num_boxes) + 1, 0);
  for (Index p = 0; p < count; ++p) {
    if (place[p] < 0) continue;
    std::int64_t index = 0;
    for (int a = 0; a < D; ++a) index = index * size_[a] + box(a, coordinates(p, a));
    place[p] = static_cast<Index>(index);
    ++first_[index + 1];
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  // Rows are tested several points at a time and read beyond their ends.
  for (auto& axis : x) axis.resize(num_kept + max_lanes);
  margin.assign(num_kept + max_lanes, -infinity);
  cell.assign(num_kept, -1);
  xi.resize(num_kept);
  for (Index p = 0; p < count; ++p) {
    if (place[p] < 0) continue;
    place[p] = first_[place[p]]++;
    for (int a = 0; a < D; ++a) x[a][place[p]] = coordinates(p, a);
  }
  // The insertion advanced every box to the start of the next one.
  std::move_backward(first_.begin(), first_.end() - 1, first_.end());
  first_[0] = 0;
}

// The planes of an affine cell.
template <Element E>
WeightPlanes<E::dim> weight_planes(const NodeMatrix<E>& gradient, const NodeMatrix<E>& positions) {
  static_assert(E::num_nodes == E::dim + 1, "an affine element is a simplex");
  WeightPlanes<E::dim> planes;
  const NodeVector<E> at_first = E::shape(E::nodes().row(0).transpose());
  for (int i = 0; i < E::num_nodes; ++i) {
    planes.at_first[i] = at_first[i];
    for (int a = 0; a < E::dim; ++a) planes.gradient[i][a] = gradient(i, a);
  }
  for (int a = 0; a < E::dim; ++a) planes.first[a] = positions(0, a);
  return planes;
}

// How far rounding blurs the weights of an affine cell: that of their computation, and the last place of a position, in
// which a cell far from the origin may be thin.
template <Element E>
double weight_blur(const NodeMatrix<E>& gradient, const NodeMatrix<E>& positions) {
  const ReferencePoint<E> blur = 32 * cell_extent<E>(positions) + positions.cwiseAbs().colwise().maxCoeff().transpose();
  return std::numeric_limits<double>::epsilon() * (gradient.cwiseAbs() * blur).maxCoeff();
}

// An affine cell ready for tests. Flattened: small fixed-size products that are not inlined cost more than they
// compute.
template <Element E>
struct AffineCell {
  InverseMap<E> map;
  WeightPlanes<E::dim> planes;
  double least = infinity;

  [[gnu::flatten]] AffineCell(const NodeMatrix<E>& positions, double tolerance) : map(positions) {
    if (map.degenerate()) return;
    const NodeMatrix<E> gradient = map.weight_gradient();
    planes = weight_planes<E>(gradient, positions);
    least = -std::max(tolerance, weight_blur<E>(gradient, positions));
  }
  [[gnu::flatten]] ReferencePoint<E> xi(const ReferencePoint<E>& position) const { return map(position).xi; }
};

// What a thread needs from cell to cell.
struct ClaimBuffers {
  std::vector<PointRange> rows;
  std::vector<Index> claimed;
};

// Tests one cell against the points of its rows, in the slices of the grid from first_slice to last_slice. A claim sets
// ξ at once, while the cell's map is at hand: few points are claimed more than once.
template <Element E>
void claim(const Mesh& mesh, const ElementBlock<E>& block, Eigen::Index row, Index cell, double tolerance,
           PointGrid<E::dim>& grid, int first_slice, int last_slice, ClaimBuffers& buffers) {
  const Bounds<E::dim> bounds = cell_bounds(mesh, block, row, tolerance);
  if (!grid.meets(bounds)) return;
  if constexpr (E::affine) {
    buffers.rows.clear();
    Index num_points = 0;
    grid.for_each_row(bounds, first_slice, last_slice, [&](Index begin, Index end) {
      buffers.rows.push_back({begin, end});
      num_points += end - begin;
    });
    if (num_points == 0) return;
    const AffineCell<E> affine(node_positions(mesh, block, row), tolerance);
    if (affine.map.degenerate()) return;
    if (static_cast<Index>(buffers.claimed.size()) < num_points) buffers.claimed.resize(num_points);
    PlaneTest<E::dim> test{affine.planes, affine.least, {}, grid.margin.data()};
    for (int a = 0; a < E::dim; ++a) test.x[a] = grid.x[a].data();
    const Index num_claimed = raise_margins(test, buffers.rows, buffers.claimed.data());
    for (Index i = 0; i < num_claimed; ++i) {
      const Index p = buffers.claimed[i];
      grid.cell[p] = cell;
      grid.xi[p] = affine.xi(grid.position(p));
    }
  } else {
    std::optional<InverseMap<E>> map;
    grid.for_each_row(bounds, first_slice, last_slice, [&](Index begin, Index end) {
      for (Index p = begin; p < end; ++p) {
        const Coordinates<E::dim> position = grid.position(p);
        if (!bounds.contains(position)) continue;
        if (!map) map.emplace(node_positions(mesh, block, row));
        if (map->degenerate()) return;
        if (map->surely_outside(position, tolerance)) continue;
        const InverseMapResult<E> result = (*map)(position);
        if (!result.converged) continue;
        const double margin = E::margin(result.xi);
        if (margin < -tolerance || margin <= grid.margin[p]) continue;
        grid.margin[p] = margin;
        grid.cell[p] = cell;
        grid.xi[p] = result.xi;
      }
    });
  }
}

// A contiguous range of slices, and the cells of each block that meet it, ascending, as rows of the block; no lists
// where one slab has all cells.
struct Slab {
  int first_slice, last_slice;
  std::vector<std::vector<Index>> rows;
};

// Cuts the grid into slabs for threads. Each gets its own list of cells, so that no thread reads cells it does not
// need.
template <int D>
std::vector<Slab> make_slabs(const Mesh& mesh, const PointGrid<D>& grid, double tolerance) {
  const int num_slices = grid.size(0);
  const int num_slabs = D == 1 || num_threads() == 1 ? 1 : std::min(num_slices, 4 * num_threads());
  std::vector<Slab> slabs(num_slabs);
  std::vector<int> slab_of(num_slices);
  for (int s = 0; s < num_slabs; ++s) {
    slabs[s].first_slice = static_cast<int>(static_cast<std::int64_t>(s) * num_slices / num_slabs);
    slabs[s].last_slice = static_cast<int>(static_cast<std::int64_t>(s + 1) * num_slices / num_slabs) - 1;
    for (int slice = slabs[s].first_slice; slice <= slabs[s].last_slice; ++slice) slab_of[slice] = s;
  }
  if (num_slabs == 1) return slabs;
  for_each_block_of_dim<D>(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) {
    for (Slab& slab : slabs) slab.rows.emplace_back();
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
      const Bounds<D> bounds = cell_bounds(mesh, block, c, tolerance);
      if (!grid.meets(bounds)) continue;
      const int last = slab_of[grid.box(0, bounds.high[0])];
      for (int s = slab_of[grid.box(0, bounds.low[0])]; s <= last; ++s)
        slabs[s].rows.back().push_back(static_cast<Index>(c));
    }
  });
  return slabs;
}

template <int D>
CellLocations locate_in(const Mesh& mesh, const Points& points, double tolerance) {
  const Index count = static_cast<Index>(points.rows());
  PointGrid<D> grid(points, cell_statistics<D>(mesh, tolerance), mesh.num_cells());

  // Slabs own their points, so that threads share nothing. Every slab sees the cells in ascending order: a later cell
  // wins by a greater margin only, which leaves ties to the lowest number. In one dimension the only axis is the rows'.
  const std::vector<Slab> slabs = make_slabs<D>(mesh, grid, tolerance);
  parallel_for(static_cast<std::int64_t>(slabs.size()), 1, [&](std::int64_t begin, std::int64_t end) {
    ClaimBuffers buffers;
    for (std::int64_t s = begin; s < end; ++s) {
      std::size_t b = 0;
      for_each_block_of_dim<D>(mesh, [&]<Element E>(const ElementBlock<E>& block, Index first) {
        const bool whole = slabs.size() == 1;
        const Index num_rows =
            whole ? static_cast<Index>(block.cells.rows()) : static_cast<Index>(slabs[s].rows[b].size());
        for (Index i = 0; i < num_rows; ++i) {
          const Index row = whole ? i : slabs[s].rows[b][i];
          claim<E>(mesh, block, row, first + row, tolerance, grid, slabs[s].first_slice, slabs[s].last_slice, buffers);
        }
        ++b;
      });
    }
  });
  for (auto& axis : grid.x) std::vector<double>().swap(axis);
  std::vector<double>().swap(grid.margin);
  CellLocations result{std::vector<Index>(count, -1), Points(count, D)};
  parallel_for(count, 65536, [&](std::int64_t begin, std::int64_t end) {
    for (auto p = static_cast<Index>(begin); p < end; ++p) {
      const Index place = grid.place[p];
      if (place >= 0) result.cells[p] = grid.cell[place];
      for (int a = 0; a < D; ++a) result.local(p, a) = result.cells[p] >= 0 ? grid.xi[place][a] : 0;
    }
  });
  return result;
}

template <int D>
CellLocations locate_from(const Mesh& mesh, const Points& points, double tolerance) {
  if constexpr (D < Elements::max_dim)
    if (mesh.gdim() > D) return locate_from<D + 1>(mesh, points, tolerance);
  return locate_in<D>(mesh, points, tolerance);
}

}  // namespace

CellLocations locate(const Mesh& mesh, const Points& points, double tolerance) {
  return locate_from<1>(mesh, points, tolerance);
}

}  // namespace halfgrad
