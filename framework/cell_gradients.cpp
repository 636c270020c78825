#include "framework/cell_gradients.hpp"

#include <Eigen/LU>
#include <cmath>

#include "framework/cell_extent.hpp"

namespace halfgrad {

CellGradients::CellGradients(const Mesh& mesh)
    : mesh_(&mesh), vertex_cells_(vertex_cells(mesh)), boundary_(boundary_vertices(mesh)) {}

CellGradient CellGradients::gradient(Index cell) const {
  return with_cell(*mesh_, cell, [&]<Element E>(const ElementBlock<E>& block, Eigen::Index row) {
    const auto positions = node_positions(*mesh_, block, row);
    const NodeMatrix<E> derivative = E::shape_gradient(E::center());
    CellGradient result;
    // Differences to the first node keep the digits of cells far from the origin.
    const auto edges = (positions.rowwise() - positions.row(0)).eval();
    result.centroid = (edges.transpose() * E::shape(E::center())) + positions.row(0).transpose();
    const Eigen::Matrix<double, E::dim, E::dim> jacobian = edges.transpose() * derivative;
    const double determinant = jacobian.determinant();
    if (is_degenerate<E>(cell_extent<E>(edges), determinant)) {
      result.weights = NodeRows::Zero(E::num_nodes, E::dim);
      return result;
    }
    result.volume = std::abs(determinant) * E::reference_volume;
    result.weights = derivative * jacobian.inverse();
    return result;
  });
}

Vector CellGradients::centroid(Index cell) const {
  return with_cell(*mesh_, cell, [&]<Element E>(const ElementBlock<E>& block, Eigen::Index row) {
    return Vector(node_positions(*mesh_, block, row).transpose() * E::shape(E::center()));
  });
}

}  // namespace halfgrad
