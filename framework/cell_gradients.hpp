// What reconstructors see of a mesh: incidence, centroids and one linear gradient stencil a cell, no elements.
#pragma once

#include <Eigen/LU>
#include <cmath>
#include <span>
#include <vector>

#include "framework/cell_extent.hpp"
#include "framework/cell_map.hpp"
#include "framework/mesh.hpp"
#include "framework/refined_inverse.hpp"

namespace halfgrad {

/// Geometry of one cell for averaging.
struct CellGradient {
  Vector centroid;    ///< gdim, x(center)
  double volume = 0;  ///< |det J(center)| · reference volume; 0 marks a degenerate cell, whose weights are zero
  NodeRows weights;   ///< #nodes × gdim: F_C = Σ_i x_i ⊗ weights.row(i), rows sum to zero
};

/// Cells as numbers, of whatever elements: what reconstructors need of cells that no Mesh holds.
struct CellTable {
  Points vertices;                      ///< rest positions, #vertices × gdim
  IndexTable cells;                     ///< the vertices of each cell
  std::vector<CellGradient> gradients;  ///< one a cell
  std::vector<char> boundary;           ///< one a vertex, 1 on a facet of one cell only
};

/// Geometry of one cell of type E by its node positions.
template <Element E>
CellGradient cell_gradient(const NodeMatrix<E>& positions) {
  CellGradient result;
  const NodeMatrix<E> edges = from_first_node<E>(positions);
  ReferencePoint<E> centroid = cell_position<E>(edges, E::center());
  for (int a = 0; a < E::dim; ++a) centroid[a] += positions(0, a);
  result.centroid = centroid;
  const Eigen::Matrix<double, E::dim, E::dim> jacobian = cell_jacobian<E>(edges, E::center());
  const double determinant = jacobian.determinant();
  if (is_degenerate<E>(cell_extent<E>(edges), determinant)) {
    result.weights = NodeRows::Zero(E::num_nodes, E::dim);
    return result;
  }
  result.volume = std::abs(determinant) * E::reference_volume;
  result.weights = times_matrix<E>(E::shape_gradient(E::center()), refined_inverse<E::dim>(jacobian));
  return result;
}

/// Incidence of a rest mesh and its cells' gradients at their centers. Cell geometry and the boundary are computed on
/// demand, so that a scene pays for the cells its stencils touch and no others. The mesh must outlive it. Thread-safe.
class CellGradients {
 public:
  /// Throws Error on a surface, whose gradients are fitted in tangent planes (reconstruction/surface_gradients.hpp).
  explicit CellGradients(const Mesh& mesh);
  /// Cells whose geometry was computed elsewhere. The table must outlive it.
  explicit CellGradients(const CellTable& table);

  int gdim() const { return static_cast<int>(vertices_->cols()); }
  Index num_vertices() const { return static_cast<Index>(vertices_->rows()); }
  Index num_cells() const { return table_ != nullptr ? table_->cells.num_rows() : mesh_->num_cells(); }
  /// Rest positions, #vertices × gdim.
  const Points& vertices() const { return *vertices_; }
  std::span<const Index> cells_of(Index vertex) const { return vertex_cells_[vertex]; }
  std::span<const Index> vertices_of(Index cell) const {
    if (table_ != nullptr) return table_->cells[cell];
    const BlockNodes* block = blocks_.data();
    while (cell >= block->end) ++block;
    return {block->nodes + static_cast<Offset>(cell - block->first) * block->num_nodes, block->num_nodes};
  }
  /// Whether a vertex lies on a facet that belongs to one cell only, or to more than two.
  bool on_boundary(Index vertex) const;
  /// Centroid, volume and gradient stencil of a cell.
  CellGradient gradient(Index cell) const;
  /// Centroid of a cell, gdim.
  Vector centroid(Index cell) const;

 private:
  // The cells first … end − 1, without their element: its type costs a call to find, for every cell at every vertex.
  struct BlockNodes {
    Index first, end;
    std::size_t num_nodes;
    const Index* nodes;
  };

  const Points* vertices_;
  const Mesh* mesh_ = nullptr;
  const CellTable* table_ = nullptr;
  std::vector<BlockNodes> blocks_;  // of a mesh
  IndexTable vertex_cells_;
};

}  // namespace halfgrad
