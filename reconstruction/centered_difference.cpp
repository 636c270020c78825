#include "reconstruction/centered_difference.hpp"

#include <cmath>

#include "framework/error.hpp"
#include "framework/grid.hpp"
#include "reconstruction/row_assembly.hpp"

namespace halfgrad {

namespace {

// Lengths along an axis that differ by less, relative to the cell, are the same: positions carry rounding.
constexpr double flat = 1e-9;

// A mesh seen as a grid.
class MeshAxes {
 public:
  explicit MeshAxes(const CellGradients& cells) : cells_(&cells) {}
  int gdim() const { return cells_->gdim(); }
  double coordinate(Index vertex, int axis) const { return cells_->vertices()(vertex, axis); }

  Index neighbor(Index vertex, int axis, int side) const {
    for (Index cell : cells_->cells_of(vertex)) {
      const Vector extent = box_extent(cell);
      for (Index other : cells_->vertices_of(cell)) {
        const Vector step = (cells_->vertices().row(other) - cells_->vertices().row(vertex)).transpose();
        bool along = (side == 0 ? -step[axis] : step[axis]) > flat * extent[axis];
        for (int a = 0; a < gdim(); ++a) along = along && (a == axis || std::abs(step[a]) <= flat * extent[a]);
        if (along) return other;
      }
    }
    return -1;
  }

 private:
  Vector box_extent(Index cell) const {
    const std::span<const Index> nodes = cells_->vertices_of(cell);
    Vector low = cells_->vertices().row(nodes[0]).transpose(), high = low;
    for (Index v : nodes) {
      low = low.cwiseMin(cells_->vertices().row(v).transpose());
      high = high.cwiseMax(cells_->vertices().row(v).transpose());
    }
    const Vector extent = high - low;
    bool box = nodes.size() == std::size_t{1} << gdim() && extent.minCoeff() > 0;
    for (Index v : nodes)
      for (int a = 0; a < gdim(); ++a) {
        const double from_low = cells_->vertices()(v, a) - low[a], from_high = high[a] - cells_->vertices()(v, a);
        box = box && std::min(from_low, from_high) <= flat * extent[a];
      }
    if (!box)
      raise(
          "centered_difference: cell {} ({} vertices) is no axis-aligned box: it needs a grid, regular or graded; "
          "kriging serves any mesh",
          cell, nodes.size());
    return extent;
  }

  const CellGradients* cells_;
};

class GridAxes {
 public:
  explicit GridAxes(const Grid& grid) : grid_(&grid) {}
  int gdim() const { return grid_->gdim(); }
  double coordinate(Index vertex, int axis) const { return grid_->plane(axis, grid_->vertex_place(vertex)[axis]); }
  Index neighbor(Index vertex, int axis, int side) const { return grid_->neighbor(vertex, axis, side); }

 private:
  const Grid* grid_;
};

// The two entries of a row along an axis: vertices at signed distances p and q, of which q may be missing.
template <class Axes>
void add_axis(const Axes& axes, Index vertex, int axis, StencilRow& row, double& absolute_sum, bool& complete) {
  const auto distance = [&](Index other) { return axes.coordinate(other, axis) - axes.coordinate(vertex, axis); };
  const auto add = [&](Index other, double weight) {
    row.neighbors.push_back(other);
    for (int a = 0; a < axes.gdim(); ++a) row.weights.push_back(a == axis ? weight : 0);
    absolute_sum += std::abs(weight);
  };
  Index near = axes.neighbor(vertex, axis, 0), far = axes.neighbor(vertex, axis, 1);
  if (near < 0 || far < 0) {
    const int side = near < 0 ? 1 : 0;
    near = side == 1 ? far : near;
    if (near < 0) raise("centered_difference: vertex {} has no neighbour along axis {}", vertex, axis);
    far = axes.neighbor(near, axis, side);
  }
  const double p = distance(near);
  if (far < 0) {
    complete = false;
    add(near, 1 / p);
    return;
  }
  // The derivative at 0 of the parabola through 0, p and q.
  const double q = distance(far);
  add(near, q / (p * (q - p)));
  add(far, p / (q * (p - q)));
}

template <class Axes>
Reconstruction difference_rows(const Axes& axes, std::span<const Index> vertices) {
  Reconstruction result;
  result.stencils = assemble_rows(axes.gdim(), vertices, [&](Index vertex, StencilRow& row) {
    double absolute_sum = 0, length = 0;
    bool complete = true;
    for (int axis = 0; axis < axes.gdim(); ++axis) {
      add_axis(axes, vertex, axis, row, absolute_sum, complete);
      length += std::abs(axes.coordinate(row.neighbors.back(), axis) - axes.coordinate(vertex, axis)) / axes.gdim();
    }
    row.diagnostics.rule = complete ? StencilRule::full_fit : StencilRule::damped;
    row.diagnostics.num_points = static_cast<Index>(row.neighbors.size());
    row.diagnostics.absolute_sum = static_cast<float>(absolute_sum * length);
  });
  return result;
}

}  // namespace

Reconstruction CenteredDifference::reconstruct(const CellGradients& cells, std::span<const Index> vertices) const {
  return difference_rows(MeshAxes(cells), vertices);
}

Reconstruction CenteredDifference::reconstruct_on_grid(const Grid& grid, std::span<const Index> vertices) const {
  return difference_rows(GridAxes(grid), vertices);
}

}  // namespace halfgrad
