// The facets that belong to one cell only.
#pragma once

#include <vector>

#include "framework/mesh.hpp"

namespace halfgrad {

/// A side of a cell.
struct CellFacet {
  Index cell;
  int facet;  ///< position in the element's facets, or whole_cell
};
/// As a side: the cell of a surface itself.
inline constexpr int whole_cell = -1;

/// The facets of exactly one cell, where cells marked in `skip` (#cells) count as absent and a cell and its doubles as
/// one; ascending by cell and facet.
std::vector<CellFacet> boundary_facets(const Mesh& mesh, const std::vector<char>& skip);

}  // namespace halfgrad
