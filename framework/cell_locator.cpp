// The points are sorted into a grid and the cells stream past it, so that no index of the cells is built:
//
//   grid of boxes, the last axis fastest      x[0]: | box 0 | box 1 | box 2 | …      one array a coordinate,
//   first[box] … first[box + 1] are its       x[1]: | box 0 | box 1 | box 2 | …      and beside them per point the
//   points in the sorted arrays               x[2]: | box 0 | box 1 | box 2 | …      best margin and its cell
//
// The boxes that a cell's bounds meet along the last axis are one contiguous range of points: a row. A cell tests rows.
#include "framework/cell_locator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "framework/inverse_map.hpp"
#include "framework/parallel.hpp"

namespace halfgrad {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

template <int D>
using Coordinates = Eigen::Matrix<double, D, 1>;

template <int D>
struct Bounds {
  Coordinates<D> low = Coordinates<D>::Constant(infinity), high = Coordinates<D>::Constant(-infinity);
  bool contains(const Coordinates<D>& x) const {
    return (x.array() >= low.array()).all() && (x.array() <= high.array()).all();
  }
};

// What a cell can hold: its nodes' bounds, grown by what the tolerance lets weights be negative.
template <Element E>
Bounds<E::dim> cell_bounds(const NodeMatrix<E>& positions, double tolerance) {
  Bounds<E::dim> bounds{positions.colwise().minCoeff().transpose(), positions.colwise().maxCoeff().transpose()};
  const Coordinates<E::dim> growth = E::num_nodes * tolerance * (bounds.high - bounds.low);
  bounds.low -= growth;
  bounds.high += growth;
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
  for (Index v = 0; v < mesh.num_vertices(); ++v) {
    result.bounds.low = result.bounds.low.cwiseMin(vertices.row(v).transpose());
    result.bounds.high = result.bounds.high.cwiseMax(vertices.row(v).transpose());
  }
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

  Index num_points() const { return static_cast<Index>(id.size()); }
  int size(int axis) const { return size_[axis]; }
  // Boxes along an axis that hold a coordinate; monotone, so that no rounding separates a point from its cell.
  int box(int axis, double coordinate) const {
    const double scaled = (coordinate - bounds_.low[axis]) * per_length_[axis];
    return static_cast<int>(std::min(std::max(scaled, 0.0), size_[axis] - 1.0));
  }
  bool meets(const Bounds<D>& other) const {
    return (other.low.array() <= bounds_.high.array()).all() && (other.high.array() >= bounds_.low.array()).all();
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

  std::array<std::vector<double>, D> x;  // sorted coordinates
  std::vector<Index> id;                 // the caller's number of a sorted point
  std::vector<double> margin;            // greatest so far
  std::vector<Index> cell;               // of that margin; −1: none yet

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
  std::vector<Index> box_of(count, -1);
  Index num_kept = 0;
  for (Index p = 0; p < count; ++p) {
    const Coordinates<D> position = coordinates.row(p).transpose();
    if (!cells.bounds.contains(position)) continue;
    box_of[p] = 0;
    ++num_kept;
    bounds_.low = bounds_.low.cwiseMin(position);
    bounds_.high = bounds_.high.cwiseMax(position);
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
    if (box_of[p] < 0) continue;
    std::int64_t index = 0;
    for (int a = 0; a < D; ++a) index = index * size_[a] + box(a, coordinates(p, a));
    box_of[p] = static_cast<Index>(index);
    ++first_[index + 1];
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  for (auto& axis : x) axis.resize(num_kept);
  id.resize(num_kept);
  margin.assign(num_kept, -infinity);
  cell.assign(num_kept, -1);
  for (Index p = 0; p < count; ++p) {
    if (box_of[p] < 0) continue;
    const Index slot = first_[box_of[p]]++;
    for (int a = 0; a < D; ++a) x[a][slot] = coordinates(p, a);
    id[slot] = p;
  }
  // The insertion advanced every box to the start of the next one.
  std::move_backward(first_.begin(), first_.end() - 1, first_.end());
  first_[0] = 0;
}

// One cell of affine elements: β_i = shape_i + gradient_i · (X − first node), margin = min β.
template <Element E>
struct WeightPlanes {
  std::array<std::array<double, E::dim>, E::num_nodes> gradient;
  std::array<double, E::num_nodes> at_first;
  std::array<double, E::dim> first;
  double blur;  // rounding of β in this cell
};

template <Element E>
WeightPlanes<E> weight_planes(const InverseMap<E>& map, const NodeMatrix<E>& positions) {
  WeightPlanes<E> planes;
  const NodeMatrix<E> gradient = map.weight_gradient();
  const NodeVector<E> at_first = E::shape(E::nodes().row(0).transpose());
  const Eigen::Matrix<double, 1, E::dim> extent = positions.colwise().maxCoeff() - positions.colwise().minCoeff();
  planes.blur = 0;
  for (int i = 0; i < E::num_nodes; ++i) {
    planes.at_first[i] = at_first[i];
    for (int a = 0; a < E::dim; ++a) planes.gradient[i][a] = gradient(i, a);
    planes.blur = std::max(planes.blur, gradient.row(i).cwiseAbs().dot(extent));
  }
  planes.blur *= 32 * std::numeric_limits<double>::epsilon();
  for (int a = 0; a < E::dim; ++a) planes.first[a] = positions(0, a);
  return planes;
}

// The loop that takes the time: written for the compiler's vectors, without branches.
template <Element E>
void claim_row(PointGrid<E::dim>& grid, Index begin, Index end, const WeightPlanes<E>& planes, double least,
               Index cell) {
  std::array<const double*, E::dim> x;
  for (int a = 0; a < E::dim; ++a) x[a] = grid.x[a].data();
  double* __restrict margin = grid.margin.data();
  Index* __restrict cells = grid.cell.data();
  for (Index p = begin; p < end; ++p) {
    std::array<double, E::dim> d;
    for (int a = 0; a < E::dim; ++a) d[a] = x[a][p] - planes.first[a];
    double lowest = infinity;
    for (int i = 0; i < E::num_nodes; ++i) {
      double beta = planes.at_first[i];
      for (int a = 0; a < E::dim; ++a) beta += planes.gradient[i][a] * d[a];
      lowest = beta < lowest ? beta : lowest;
    }
    const double best = margin[p];
    const bool better = (lowest > best) & (lowest >= least);
    margin[p] = better ? lowest : best;
    cells[p] = better ? cell : cells[p];
  }
}

// Tests one cell against the points of its rows, in the slices of the grid from first_slice to last_slice.
template <Element E>
void claim(const Mesh& mesh, const ElementBlock<E>& block, Eigen::Index row, Index cell, double tolerance,
           PointGrid<E::dim>& grid, int first_slice, int last_slice) {
  const NodeMatrix<E> positions = node_positions(mesh, block, row);
  const Bounds<E::dim> bounds = cell_bounds<E>(positions, tolerance);
  if (!grid.meets(bounds)) return;
  if constexpr (E::affine) {
    WeightPlanes<E> planes;
    double least = infinity;
    bool ready = false, degenerate = false;
    grid.for_each_row(bounds, first_slice, last_slice, [&](Index begin, Index end) {
      if (!ready) {
        ready = true;
        const InverseMap<E> map(positions);
        degenerate = map.degenerate();
        if (!degenerate) {
          planes = weight_planes<E>(map, positions);
          least = -std::max(tolerance, planes.blur);
        }
      }
      if (!degenerate) claim_row<E>(grid, begin, end, planes, least, cell);
    });
  } else {
    std::optional<InverseMap<E>> map;
    grid.for_each_row(bounds, first_slice, last_slice, [&](Index begin, Index end) {
      for (Index p = begin; p < end; ++p) {
        Coordinates<E::dim> position;
        for (int a = 0; a < E::dim; ++a) position[a] = grid.x[a][p];
        if (!bounds.contains(position)) continue;
        if (!map) map.emplace(positions);
        if (map->degenerate()) return;
        if (map->surely_outside(position, tolerance)) continue;
        const InverseMapResult<E> result = (*map)(position);
        if (!result.converged) continue;
        const double margin = E::margin(result.xi);
        if (margin < -tolerance || margin <= grid.margin[p]) continue;
        grid.margin[p] = margin;
        grid.cell[p] = cell;
      }
    });
  }
}

template <int D>
CellLocations locate_in(const Mesh& mesh, const Points& points, double tolerance) {
  const Index count = static_cast<Index>(points.rows());
  CellLocations result{std::vector<Index>(count, -1), Points::Zero(count, D)};
  PointGrid<D> grid(points, cell_statistics<D>(mesh, tolerance), mesh.num_cells());
  if (grid.num_points() == 0) return result;

  // Slabs of slices along the first axis own their points, so that threads share nothing. Every slab sees the cells in
  // ascending order: a later cell wins by a greater margin only, which leaves ties to the lowest number.
  const int num_slices = D == 1 ? 1 : grid.size(0);
  const int num_slabs = std::min(num_slices, num_threads() == 1 ? 1 : 4 * num_threads());
  parallel_for(num_slabs, 1, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t slab = begin; slab < end; ++slab) {
      const int first_slice = static_cast<int>(slab * num_slices / num_slabs);
      const int last_slice = D == 1 ? grid.size(0) - 1 : static_cast<int>((slab + 1) * num_slices / num_slabs) - 1;
      for_each_block_of_dim<D>(mesh, [&]<Element E>(const ElementBlock<E>& block, Index first) {
        for (Eigen::Index c = 0; c < block.cells.rows(); ++c)
          claim<E>(mesh, block, c, static_cast<Index>(first + c), tolerance, grid, first_slice, last_slice);
      });
    }
  });

  parallel_for(grid.num_points(), 4096, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t p = begin; p < end; ++p) {
      const Index cell = grid.cell[p];
      if (cell < 0) continue;
      result.cells[grid.id[p]] = cell;
      with_cell(mesh, cell, [&]<Element E>(const ElementBlock<E>& block, Eigen::Index row) {
        if constexpr (E::dim == D) {
          Coordinates<D> position;
          for (int a = 0; a < D; ++a) position[a] = grid.x[a][p];
          const InverseMap<E> map(node_positions(mesh, block, row));
          result.local.row(grid.id[p]) = map(position).xi.transpose();
        }
      });
    }
  });
  return result;
}

template <int D>
CellLocations locate_from(const Mesh& mesh, const Points& points, double tolerance) {
  if constexpr (D < max_gdim)
    if (mesh.gdim() > D) return locate_from<D + 1>(mesh, points, tolerance);
  return locate_in<D>(mesh, points, tolerance);
}

}  // namespace

CellLocations locate(const Mesh& mesh, const Points& points, double tolerance) {
  return locate_from<1>(mesh, points, tolerance);
}

}  // namespace halfgrad
