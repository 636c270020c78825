// TetGen meshes (.node with .ele).
#pragma once

#include "framework/io/geometry.hpp"

namespace halfgrad {

/// Vertices of the .node file and tetrahedra of the .ele file, either of which may be named; numbered from 0 or 1.
Geometry read_tetgen(const std::filesystem::path& path);

}  // namespace halfgrad
