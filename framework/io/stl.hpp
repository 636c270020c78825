// STL surfaces (.stl, ASCII and binary).
#pragma once

#include "framework/io/geometry.hpp"

namespace halfgrad {

/// Three points a facet, in file order, none merged.
Geometry read_stl(const std::filesystem::path& path);

}  // namespace halfgrad
