// What reconstructors see of a mesh: incidence, centroids and one linear gradient stencil a cell, no elements.
#pragma once

#include <span>
#include <vector>

#include "framework/mesh.hpp"

namespace halfgrad {

/// Geometry of one cell for averaging.
struct CellGradient {
  Vector centroid;    ///< gdim, x(center)
  double volume = 0;  ///< |det J(center)| · reference volume; 0 marks a degenerate cell, whose weights are zero
  NodeRows weights;   ///< #nodes × gdim: F_C = Σ_i x_i ⊗ weights.row(i), rows sum to zero
};

/// Incidence of a rest mesh and its cells' gradients at their centers. Cell geometry is computed on demand, so that a
/// scene pays for the cells its stencils touch and no others. The mesh must outlive it. Thread-safe.
class CellGradients {
 public:
  explicit CellGradients(const Mesh& mesh);

  int gdim() const { return mesh_->gdim(); }
  Index num_vertices() const { return mesh_->num_vertices(); }
  Index num_cells() const { return mesh_->num_cells(); }
  /// Rest positions, #vertices × gdim.
  const Points& vertices() const { return mesh_->vertices(); }
  std::span<const Index> cells_of(Index vertex) const { return vertex_cells_[vertex]; }
  std::span<const Index> vertices_of(Index cell) const { return mesh_->cell_vertices(cell); }
  bool on_boundary(Index vertex) const { return boundary_[vertex] != 0; }
  /// Centroid, volume and gradient stencil of a cell.
  CellGradient gradient(Index cell) const;
  /// Centroid of a cell, gdim.
  Vector centroid(Index cell) const;

 private:
  const Mesh* mesh_;
  IndexTable vertex_cells_;
  std::vector<char> boundary_;
};

}  // namespace halfgrad
