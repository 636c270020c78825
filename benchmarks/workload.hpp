// Reads a workload: a tetrahedral mesh, points in it and one deformed frame.
#pragma once

#include <string>

#include "framework/mesh.hpp"

namespace halfgrad::benchmarks {

/// What a workload file holds: "TETPTS1\0", int64 numbers of vertices, tetrahedra and points, then rest positions
/// (double), tetrahedra (int32), points (double) and deformed positions (double), little-endian.
struct Workload {
  Mesh mesh;
  Points points;    ///< #points × 3, rest positions in the user's order
  Points deformed;  ///< #vertices × 3
};

/// Reads at most `max_points` points (all where negative). Throws Error on a file that is no workload.
Workload read_workload(const std::string& path, std::int64_t max_points);

}  // namespace halfgrad::benchmarks
