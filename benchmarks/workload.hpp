// A workload: a mesh, points in it and one deformed frame, from a file or generated.
#pragma once

#include <string>

#include "framework/mesh.hpp"

namespace halfgrad::benchmarks {

/// What a frame works on. A file holds one of tetrahedra: "TETPTS1\0", int64 numbers of vertices, tetrahedra and
/// points, then rest positions (double), tetrahedra (int32), points (double) and deformed positions (double),
/// little-endian.
struct Workload {
  Mesh mesh;
  Points points;    ///< #points × gdim, rest positions in the user's order
  Points deformed;  ///< #vertices × gdim
};

/// Reads at most `max_points` points (all where negative). Throws Error on a file that is no workload.
Workload read_workload(const std::string& path, std::int64_t max_points);

/// Random points in a lattice: ELEMENT:CELLS, boxes along each axis ("hexahedron:24"). Throws Error on unknown names.
Workload lattice_workload(const std::string& name, std::int64_t num_points);

}  // namespace halfgrad::benchmarks
