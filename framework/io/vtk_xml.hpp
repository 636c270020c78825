// XML VTK files (.vtu, .vtp): ASCII, inline base64, appended raw or base64, raw or compressed by zlib.
#pragma once

#include "framework/io/geometry.hpp"

namespace halfgrad {

/// The points and cells of all pieces, and the data at their points.
Geometry read_vtk_xml(const std::filesystem::path& path);

}  // namespace halfgrad
