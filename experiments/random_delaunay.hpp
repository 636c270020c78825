// Delaunay meshes of random points: slivers inside, flat cells along the hull. The hardest honest input.
#pragma once

#include <cstdint>

#include "framework/mesh.hpp"

namespace halfgrad {

struct RandomDelaunayOptions {
  int gdim = 3;            ///< 3 tetrahedra, 2 triangles
  Index num_points = 250;  ///< uniform in the box from -0.5 to 0.5
  std::uint64_t seed = 0;
};

/// All simplices of the Delaunay triangulation but those without volume to round-off. Throws Error on fewer than
/// gdim + 2 points.
Mesh make_random_delaunay(const RandomDelaunayOptions& options);

}  // namespace halfgrad
