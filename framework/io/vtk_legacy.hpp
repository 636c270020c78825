// Legacy VTK files (.vtk, versions 2.0 to 5.1, ASCII and binary; The VTK User's Guide, "Simple Legacy Formats").
#pragma once

#include "framework/io/geometry.hpp"

namespace halfgrad {

/// The points and cells of an unstructured grid or of poly data, and the data at its points.
Geometry read_vtk_legacy(const std::filesystem::path& path);

}  // namespace halfgrad
