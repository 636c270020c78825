// Cells as VTK's files store them: offsets into one list of nodes.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "framework/io/geometry.hpp"

namespace halfgrad {

/// A stored value as a T. Floating values beyond the integers become the least one, which no check lets pass.
template <class T, class Stored>
T converted(Stored value) {
  if constexpr (std::is_integral_v<T> && std::is_floating_point_v<Stored>)
    return value > -9e18 && value < 9e18 ? static_cast<T>(value) : std::numeric_limits<T>::min();
  else
    return static_cast<T>(value);
}

/// Cells of a file `name`; offsets has #cells + 1 entries that start with 0.
struct VtkCells {
  std::string name;
  std::vector<std::int64_t> offsets, nodes;

  /// Appends them to a geometry, with node numbers raised by `first_vertex`. Pixels and voxels become quadrilaterals
  /// and hexahedra; polygons of three and four nodes triangles and quadrilaterals; Lagrange and Bezier cells of degree
  /// one the plain ones. Throws Error where offsets decrease or leave the list, or where types are not one a cell.
  void add_to(Geometry& geometry, const std::vector<std::int64_t>& types, std::int64_t first_vertex = 0) const;
  /// The same with one type for all.
  void add_to(Geometry& geometry, int type, std::int64_t first_vertex = 0) const;
};

/// The element's node that a file of this VTK type names at a place.
int file_node(int vtk_id, int node);

}  // namespace halfgrad
