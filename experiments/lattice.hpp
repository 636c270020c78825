// Structured meshes of a box, from perfectly regular to thoroughly irregular.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "framework/mesh.hpp"

namespace halfgrad {

struct LatticeOptions {
  std::string element = "tetrahedron";  ///< a name of lattice_elements()
  /// How boxes are cut into simplices; empty takes the element's first. Triangles: kuhn, union_jack, equilateral.
  /// Tetrahedra: kuhn (6 a box), five (5 a box, mirrored from box to box), bcc (centered boxes). Element "mixed": solid
  /// (tetrahedra, pyramids, wedges and hexahedra), plane (triangles and quadrilaterals).
  std::string pattern;
  std::array<int, 3> cells{4, 4, 4};      ///< boxes along each axis
  std::array<double, 3> size{1, 1, 1};    ///< of the whole box, length units
  std::array<double, 3> origin{0, 0, 0};  ///< its least corner
  /// Each vertex moves at random by up to this fraction of the box's edge along each axis, except along the normal of a
  /// side of the whole box that it lies on: corners stay, sides stay flat.
  double jitter = 0;
  /// Amplitude of a smooth map of the box onto itself, in sizes of the box: 0 is none, 0.06 is marked, injective < 0.3.
  double warp = 0;
  std::uint64_t seed = 0;  ///< of the jitter
};

/// Names of the elements that lattices are made of, and "mixed".
std::vector<std::string_view> lattice_elements();
/// Patterns of an element, the default first; empty where it has none to choose.
std::vector<std::string_view> lattice_patterns(std::string_view element);

/// Dimension of the lattice; throws Error on unknown names.
int lattice_dim(const LatticeOptions& options);

/// A mesh of a box. Throws Error on unknown names, fewer than one cell, jitter outside [0, 0.5).
Mesh make_lattice(const LatticeOptions& options);

}  // namespace halfgrad
