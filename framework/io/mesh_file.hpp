// Mesh files.
#pragma once

#include <filesystem>

#include "framework/mesh.hpp"

namespace halfgrad {

/// Reads a mesh: Gmsh .msh (2.2, 4.1), legacy .vtk, .vtu, .vtp, MEDIT .mesh, TetGen .node/.ele (either may be named).
/// Vertices keep the file's order (Gmsh: ascending node tag) and unused ones are kept. Cells of lower dimension than
/// the highest present are dropped. Where that is below three, the coordinates beyond it must be constant (relative to
/// the largest coordinate, 1e-12) and are dropped. Throws Error, naming the file and the line, byte, vertex or cell, on
/// anything unreadable, on non-finite coordinates and on cells of an element that is not registered.
Mesh read_mesh(const std::filesystem::path& path);

}  // namespace halfgrad
