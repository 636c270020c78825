// Points in a grid.
#include <algorithm>
#include <cmath>

#include "framework/error.hpp"
#include "framework/grid.hpp"
#include "framework/parallel.hpp"

namespace halfgrad {

namespace {

struct Claim {
  Index cell = -1;
  double margin = 0;
  std::array<double, 3> local{};
};

// The cell of greatest margin, ties to the lowest number, among those that hold a position within the tolerance: the
// one between whose planes it lies, and its neighbours where it is that close to a plane.
Claim claim(const Grid& grid, const double* position, double tolerance) {
  const int gdim = grid.gdim();
  std::array<int, 3> first{}, last{};
  for (int a = 0; a < gdim; ++a) {
    const int i = grid.interval(a, position[a]);
    const auto near = [&](int plane) {
      const double reach = 2 * tolerance * (grid.plane(a, i + 1) - grid.plane(a, i));
      return std::abs(position[a] - grid.plane(a, plane)) <= reach + 1e-15 * std::abs(position[a]);
    };
    first[a] = i > 0 && near(i) ? i - 1 : i;
    last[a] = i + 1 < grid.axis(a).num_cells && near(i + 1) ? i + 1 : i;
  }
  Claim best;
  GridPlace at{};
  for (at[2] = first[2]; at[2] <= last[2]; ++at[2])
    for (at[1] = first[1]; at[1] <= last[1]; ++at[1])
      for (at[0] = first[0]; at[0] <= last[0]; ++at[0]) {
        Claim here{grid.cell_at(at), 1, {}};
        if (here.cell < 0) continue;
        for (int a = 0; a < gdim; ++a) {
          const double low = grid.plane(a, at[a]), high = grid.plane(a, at[a] + 1);
          here.local[a] = (position[a] - low) / (high - low);
          here.margin = std::min({here.margin, here.local[a], (high - position[a]) / (high - low)});
        }
        if (here.margin >= -tolerance && (best.cell < 0 || here.margin > best.margin)) best = here;
      }
  return best;
}

// Cells that lack a neighbour across a side: a point outside is nearest to one of them.
std::vector<Index> outer_cells(const Grid& grid) {
  std::vector<Index> cells;
  for (Index cell = 0; cell < grid.num_cells(); ++cell) {
    const GridPlace at = grid.cell_place(cell);
    bool outer = false;
    for (int a = 0; a < grid.gdim() && !outer; ++a)
      for (const int step : {-1, 1}) {
        GridPlace beside = at;
        beside[a] += step;
        outer = outer || grid.cell_at(beside) < 0;
      }
    if (outer) cells.push_back(cell);
  }
  return cells;
}

}  // namespace

Embedding embed(const Grid& grid, const Points& points, const EmbedOptions& options) {
  check_points(points, grid.gdim(), options);
  Embedding result;
  result.gdim = grid.gdim();
  result.cells.assign(static_cast<std::size_t>(points.rows()), -1);
  result.local = Points::Zero(points.rows(), grid.gdim());
  result.status.assign(result.cells.size(), PointStatus::inside);
  parallel_for(points.rows(), 4096, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t p = begin; p < end; ++p) {
      const Claim found = claim(grid, points.row(p).data(), options.tolerance);
      result.cells[p] = found.cell;
      if (found.cell >= 0)
        for (int a = 0; a < grid.gdim(); ++a) result.local(p, a) = found.local[a];
    }
  });

  std::vector<Index> unclaimed;
  for (Index p = 0; p < result.num_points(); ++p)
    if (result.cells[p] < 0) unclaimed.push_back(p);
  if (unclaimed.empty()) return result;
  const std::vector<Index> cells = outer_cells(grid);
  std::vector<Index> vertices;
  const Mesh skin = grid.mesh_of(cells, vertices);
  Points far(static_cast<Eigen::Index>(unclaimed.size()), grid.gdim());
  for (std::size_t i = 0; i < unclaimed.size(); ++i) far.row(static_cast<Eigen::Index>(i)) = points.row(unclaimed[i]);
  EmbedOptions own = options;
  if (own.outside == Outside::error) own.outside = Outside::nearest;
  const Embedding nearest = embed(skin, far, own);
  for (std::size_t i = 0; i < unclaimed.size(); ++i) {
    const Index p = unclaimed[i];
    if (nearest.cells[i] >= 0) result.cells[p] = cells[nearest.cells[i]];
    result.local.row(p) = nearest.local.row(static_cast<Eigen::Index>(i));
    result.status[p] = nearest.status[i];
  }
  for (OutsidePoint outside : nearest.outside) {
    outside.point = unclaimed[outside.point];
    result.outside.push_back(outside);
  }
  apply_policy(result, points, options);
  return result;
}

GridPart active_part(const Grid& grid, const Embedding& embedding) {
  std::vector<Index> cells;
  for (Index cell : embedding.cells)
    if (cell >= 0) cells.push_back(cell);
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  GridPart part;
  part.mesh = grid.mesh_of(cells, part.vertices);
  part.embedding = embedding;
  for (Index& cell : part.embedding.cells)
    if (cell >= 0) cell = static_cast<Index>(std::lower_bound(cells.begin(), cells.end(), cell) - cells.begin());
  return part;
}

}  // namespace halfgrad
