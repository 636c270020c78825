// Which cell holds each point: all points against all cells at once.
#pragma once

#include <vector>

#include "framework/mesh.hpp"

namespace halfgrad {

/// Cell and reference coordinates of points.
struct CellLocations {
  std::vector<Index> cells;  ///< #points; −1 where no cell holds the point
  Points local;              ///< #points × gdim, ξ; zero where no cell holds the point
};

/// Finds for each point (#points × gdim, finite) the cell where its margin is greatest, ties to the lowest cell number,
/// among the cells that hold it: margin ≥ −tolerance, or as much farther out as rounding blurs a flat cell. Degenerate
/// cells hold no points. The same for any number of threads.
CellLocations locate(const Mesh& mesh, const Points& points, double tolerance);

}  // namespace halfgrad
