// Mesh files.
#pragma once

#include <filesystem>
#include <variant>

#include "framework/grid.hpp"
#include "framework/mesh.hpp"

namespace halfgrad {

/// Reads a mesh: Gmsh .msh (2.2, 4.1), legacy .vtk, .vtu, .vtp, .vti, .vtr, MEDIT .mesh, TetGen .node/.ele (either may
/// be named), .obj, .ply. Vertices keep the file's order (Gmsh: ascending node tag) and unused ones are kept. Cells of
/// lower dimension than the highest present are dropped. Where that is below three, coordinates beyond it that are
/// constant (relative to the largest coordinate, 1e-12) are dropped; cells of dimension two whose third coordinate
/// varies are a surface. Throws Error, naming the file and the line, byte, vertex or cell, on
/// anything unreadable, on non-finite coordinates and on cells of an element that is not registered.
Mesh read_mesh(const std::filesystem::path& path);

/// A rest shape: a mesh, or a grid where the file holds one.
using RestShape = std::variant<Mesh, Grid>;

/// The same, but grids keep their cells to themselves.
RestShape read_rest_shape(const std::filesystem::path& path);

}  // namespace halfgrad
