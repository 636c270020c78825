// Grids of axis-aligned boxes: cells and vertices by arithmetic, without connectivity.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "framework/embedding.hpp"
#include "framework/mesh.hpp"

namespace halfgrad {

/// The planes that cut one axis.
struct GridAxis {
  int num_cells = 1;
  double origin = 0, spacing = 1;  ///< regular: plane i is at origin + i · spacing, length units
  std::vector<double> planes;      ///< graded: num_cells + 1 ascending coordinates instead; empty where regular
};

/// Place of a cell, or of its least vertex, along the axes; zero beyond gdim.
using GridPlace = std::array<int, 3>;

/// A regular or graded grid in R¹, R² or R³, full or of occupied cells only. Cells are segments, quadrilaterals or
/// hexahedra. Cells and vertices are numbered with the first axis fastest, as in VTK, those that are occupied or belong
/// to an occupied cell alone. A full grid holds its axes and no more; a sparse one 8 bytes a cell and 8 a vertex.
class Grid {
 public:
  /// A full grid. Throws Error on less than one cell along an axis, planes that do not ascend or are not finite, more
  /// cells or vertices than can be numbered.
  explicit Grid(std::vector<GridAxis> axes);
  /// The occupied cells only (distinct, any order). Throws Error also on none, a place outside and one named twice.
  Grid(std::vector<GridAxis> axes, std::span<const GridPlace> occupied);

  int gdim() const { return static_cast<int>(axes_.size()); }
  Index num_vertices() const { return num_vertices_; }
  Index num_cells() const { return num_cells_; }
  bool is_sparse() const { return sparse_; }
  const GridAxis& axis(int a) const { return axes_[a]; }
  /// Memory of the grid, bytes.
  Offset bytes() const;

  /// Number of a cell or vertex; −1 where there is none.
  Index cell_at(const GridPlace& place) const;
  Index vertex_at(const GridPlace& place) const;
  GridPlace cell_place(Index cell) const;
  GridPlace vertex_place(Index vertex) const;
  /// Coordinate of plane i of an axis, 0 ≤ i ≤ num_cells.
  double plane(int axis, int i) const;
  /// The interval between planes that holds a coordinate; the first or last one for coordinates beyond.
  int interval(int axis, double coordinate) const;
  /// Position of a vertex, gdim.
  Vector position(Index vertex) const;
  /// Vertices of a cell in the node order of its element; the first 2^gdim entries.
  std::array<Index, 8> cell_vertices(Index cell) const;
  /// The vertex across an edge along an axis, on the side of lesser (0) or greater (1) coordinates; −1 where no cell
  /// has that edge.
  Index neighbor(Index vertex, int axis, int side) const;

  /// The grid as an explicit mesh with the same numbers.
  Mesh mesh() const;
  /// Some cells as an explicit mesh, in the order given; `vertices` receives the grid's number of each of its vertices,
  /// ascending.
  Mesh mesh_of(std::span<const Index> cells, std::vector<Index>& vertices) const;

 private:
  void check_axes() const;
  std::int64_t key(const GridPlace& place, int further) const;
  GridPlace place(std::int64_t key, int further) const;
  bool inside(const GridPlace& place, int further) const;
  bool has_cell(const GridPlace& place) const { return cell_at(place) >= 0; }

  std::vector<GridAxis> axes_;
  bool sparse_ = false;
  Index num_cells_ = 0, num_vertices_ = 0;
  std::vector<std::int64_t> cell_keys_, vertex_keys_;  // ascending; of sparse grids
};

/// Finds the cell of each point by arithmetic; what the statuses mean is as for a mesh.
Embedding embed(const Grid& grid, const Points& points, const EmbedOptions& options = {});

/// The cells of a grid that hold points.
struct GridPart {
  Mesh mesh;
  Embedding embedding;          ///< of the same points, by the cells of `mesh`
  std::vector<Index> vertices;  ///< the grid's number of each vertex of `mesh`
};
GridPart active_part(const Grid& grid, const Embedding& embedding);

}  // namespace halfgrad
