// What a mesh or point file holds before it becomes a Mesh or a PointSet; format readers return it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "framework/io/point_set.hpp"
#include "framework/mesh.hpp"

namespace halfgrad {

/// A cell type of the VTK numbering.
struct CellType {
  int vtk_id;
  int dim;
  int num_nodes;  ///< 0 where it varies
  std::string_view name;
};

/// Facts of a VTK cell type; null for one that is not known. Elements of the registry are always known.
const CellType* find_cell_type(int vtk_id);

/// Vertices, and cells of any known type with VTK's node order.
struct Geometry {
  Points vertices;           ///< #vertices × 2 or 3
  std::vector<int> vtk_ids;  ///< #cells
  IndexTable cells;          ///< #cells rows of vertex numbers
  std::vector<PointArray> arrays;
  Points corner_uv = Points(0, 2);  ///< of each entry of `cells`, NaN where there is none; or no rows
  std::string obj_text;

  /// Appends a cell. Numbers out of range are left to check().
  void add_cell(int vtk_id, std::span<const std::int64_t> nodes);
};

/// Throws Error on non-finite coordinates, vertex numbers out of range and cells with a wrong number of nodes.
void check(const Geometry& geometry, const std::filesystem::path& path);

/// The mesh of the cells of highest dimension; see read_mesh.
Mesh build_mesh(Geometry geometry, const std::filesystem::path& path);

/// The points, with the two-dimensional cells as faces.
PointSet build_point_set(Geometry geometry);

}  // namespace halfgrad
