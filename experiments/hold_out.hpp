// A mesh without some of its vertices: what rules make of data that they have not seen.
#pragma once

#include <cstdint>
#include <vector>

#include "framework/mesh.hpp"

namespace halfgrad {

/// A mesh with vertices taken out, and which of the original ones they are.
struct HeldOutMesh {
  Mesh mesh;                    ///< simplices; vertex v is original vertex kept[v]
  std::vector<Index> kept;      ///< ascending
  std::vector<Index> held_out;  ///< ascending; each lies inside `mesh`
};

/// Takes interior vertices out of a mesh, no two of a common cell, as many as a random order by `seed` yields. The
/// cells of a vertex are replaced by those that join the rest of them to one of its neighbours (an edge collapse),
/// where none becomes flat; cells that are no simplices are first divided into such, along facets from their vertex of
/// the lowest number. Boundary vertices stay: without them the mesh would have another shape, and they would lie
/// outside.
HeldOutMesh hold_out(const Mesh& mesh, std::uint64_t seed);

}  // namespace halfgrad
