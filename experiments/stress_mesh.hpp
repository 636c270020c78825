// Meshes that nobody would hand in on purpose, made at random.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "experiments/random.hpp"
#include "framework/mesh.hpp"

namespace halfgrad {

/// A mesh and how it came to be.
struct StressMesh {
  Mesh mesh;
  std::string recipe;  ///< its shape, then what was done to it, in order
};

/// The registered elements and "mixed": what stress meshes are made of.
std::vector<std::string_view> stress_elements();

/// A small mesh of an element: a lattice, random Delaunay simplices, a fan around one edge or a string of cells that
/// touch at vertices, then some of: cells left out, inverted or doubled, vertices doubled or added, nodes moved next to
/// or onto others (slivers, needles, caps, down to dihedral angles of 1e-6 degrees and to no volume) or through their
/// cell, size graded over 1e6, space squeezed to 1e-6, turned, scaled by 1e-30 to 1e30 and moved by up to 1e12 sizes.
/// The same seed gives the same mesh, but for the last bits of the machine's powers and sines. Throws Error on an
/// unknown element.
StressMesh make_stress_mesh(std::string_view element, std::uint64_t seed);

/// A random orthogonal matrix, of either sign.
SmallMatrix random_rotation(RandomStream& random, int dim);

}  // namespace halfgrad
