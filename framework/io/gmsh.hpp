// Gmsh meshes (.msh, versions 2.2 and 4.1, ASCII and binary; https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format).
#pragma once

#include "framework/io/geometry.hpp"

namespace halfgrad {

/// Vertices in ascending order of their tags, and all cells.
Geometry read_gmsh(const std::filesystem::path& path);

}  // namespace halfgrad
