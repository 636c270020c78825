// PLY surfaces (.ply, ASCII and binary of either byte order).
#pragma once

#include "framework/io/geometry.hpp"

namespace halfgrad {

/// The properties x, y, z of the element vertex, and the polygons of the element face.
Geometry read_ply(const std::filesystem::path& path);

}  // namespace halfgrad
