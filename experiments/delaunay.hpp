// Delaunay triangulation of points in general position, for generated meshes.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "framework/types.hpp"

namespace halfgrad {

/// Simplices (positively oriented, D + 1 point numbers) of the Delaunay triangulation of `points`, D = 2 or 3, by
/// incremental insertion in the order given (Bowyer 1981, Watson 1981) in plain double arithmetic: for random points,
/// not for lattices. Throws Error where round-off leaves a cavity that is not star-shaped.
template <int D>
std::vector<std::array<Index, D + 1>> delaunay(const std::vector<Eigen::Matrix<double, D, 1>>& points);

}  // namespace halfgrad
