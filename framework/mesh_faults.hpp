// What is in a mesh twice, or joined as no body is: faults that make it wrong without making any cell wrong.
#pragma once

#include <vector>

#include "framework/mesh.hpp"

namespace halfgrad {

/// The vertices at the position, to the bit, of a vertex of lower number, ascending: cells on the two sides of such a
/// seam are not connected.
std::vector<Index> duplicate_vertices(const Mesh& mesh);

/// The cells of the same vertices, in any order, as a cell of lower number, ascending.
std::vector<Index> duplicate_cells(const Mesh& mesh);

/// The facets that three cells or more share, ascending.
std::vector<FacetKey> nonmanifold_facets(const Mesh& mesh);

}  // namespace halfgrad
