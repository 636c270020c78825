#include "reconstruction/symmetric_eigen.hpp"

#include <Eigen/Eigenvalues>

namespace halfgrad {

namespace {

template <int Dim>
SymmetricEigen solve(const SmallMatrix& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, Dim, Dim>> solver(
      Eigen::Matrix<double, Dim, Dim>(matrix.topLeftCorner<Dim, Dim>()));
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace

SymmetricEigen symmetric_eigen(const SmallMatrix& matrix) {
  if (matrix.rows() == 1) return {Vector::Constant(1, matrix(0, 0)), SmallMatrix::Identity(1, 1)};
  if (matrix.rows() == 2) return solve<2>(matrix);
  return matrix.rows() == 3 ? solve<3>(matrix) : solve<4>(matrix);
}

}  // namespace halfgrad
