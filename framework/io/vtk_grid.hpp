// XML VTK image data (.vti) and rectilinear grids (.vtr).
#pragma once

#include "framework/grid.hpp"
#include "framework/io/geometry.hpp"

namespace halfgrad {

/// The grid of a serial file of one piece: regular or graded. Cells that the array vtkGhostType of the cell data hides
/// (VTK's HIDDENCELL, 32) are left out, which makes the grid sparse. Flat axes at the end are dropped.
Grid read_vtk_grid(const std::filesystem::path& path);

/// The same grid as vertices and cells.
Geometry read_vtk_grid_cells(const std::filesystem::path& path);

}  // namespace halfgrad
