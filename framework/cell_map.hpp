// The map ξ → x of a cell by its node positions. Plain loops: every expression of Eigen's would be a type of its own
// for each element, and take the compiler a tenth of a second.
#pragma once

#include "elements/element.hpp"

namespace halfgrad {

/// x(ξ) = Σ_i β_i x_i, dim × 1; `nodes` are the x_i, num_nodes × dim.
template <Element E>
ReferencePoint<E> cell_position(const NodeMatrix<E>& nodes, const ReferencePoint<E>& xi) {
  const NodeVector<E> beta = E::shape(xi);
  ReferencePoint<E> result;
  for (int a = 0; a < E::dim; ++a) {
    double sum = 0;
    for (int i = 0; i < E::num_nodes; ++i) sum += nodes(i, a) * beta[i];
    result[a] = sum;
  }
  return result;
}

/// ∂x/∂ξ = Σ_i x_i ⊗ ∂β_i, dim × dim.
template <Element E>
Eigen::Matrix<double, E::dim, E::dim> cell_jacobian(const NodeMatrix<E>& nodes, const ReferencePoint<E>& xi) {
  const NodeMatrix<E> gradient = E::shape_gradient(xi);
  Eigen::Matrix<double, E::dim, E::dim> result;
  for (int a = 0; a < E::dim; ++a)
    for (int k = 0; k < E::dim; ++k) {
      double sum = 0;
      for (int i = 0; i < E::num_nodes; ++i) sum += nodes(i, a) * gradient(i, k);
      result(a, k) = sum;
    }
  return result;
}

/// Rows of a node each times a matrix, num_nodes × dim.
template <Element E>
NodeMatrix<E> times_matrix(const NodeMatrix<E>& rows, const Eigen::Matrix<double, E::dim, E::dim>& matrix) {
  NodeMatrix<E> result;
  for (int i = 0; i < E::num_nodes; ++i)
    for (int a = 0; a < E::dim; ++a) {
      double sum = 0;
      for (int k = 0; k < E::dim; ++k) sum += rows(i, k) * matrix(k, a);
      result(i, a) = sum;
    }
  return result;
}

/// x_i − x_0, num_nodes × dim: what keeps its digits far from the origin.
template <Element E>
NodeMatrix<E> from_first_node(const NodeMatrix<E>& nodes) {
  NodeMatrix<E> result;
  for (int a = 0; a < E::dim; ++a)
    for (int i = 0; i < E::num_nodes; ++i) result(i, a) = nodes(i, a) - nodes(0, a);
  return result;
}

}  // namespace halfgrad
