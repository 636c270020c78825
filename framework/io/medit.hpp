// MEDIT meshes (.mesh, ASCII).
#pragma once

#include "framework/io/geometry.hpp"

namespace halfgrad {

/// The vertices, and the cells of all linear types.
Geometry read_medit(const std::filesystem::path& path);

}  // namespace halfgrad
