// Unstructured meshes of a ball or disc: Delaunay, with a curved boundary and no symmetry anywhere.
#pragma once

#include <cstdint>

#include "framework/mesh.hpp"

namespace halfgrad {

struct BallOptions {
  int gdim = 3;          ///< 3 a ball of tetrahedra, 2 a disc of triangles
  double radius = 0.5;   ///< length units
  double spacing = 0.1;  ///< wanted edge length, length units
  Vector center;         ///< gdim; empty is the origin
  std::uint64_t seed = 0;
};

/// A mesh whose boundary vertices lie on the sphere (circle). Points are spread by the seed, relaxed, and triangulated
/// by Delaunay; flat tetrahedra are removed by moving their vertices. Throws Error where spacing > radius.
Mesh make_ball(const BallOptions& options);

}  // namespace halfgrad
