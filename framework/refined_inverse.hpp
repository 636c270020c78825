// The inverse of a small matrix, to the digits that it has.
#pragma once

#include <Eigen/LU>

namespace halfgrad {

/// The inverse W of a matrix A with |A W − I| of the size of rounding in |A| |W|: the closed form loses the square of
/// the condition on a needle that is oblique to the axes, and Newton's iteration for the inverse (Schulz 1933) restores
/// it.
template <int Dim>
Eigen::Matrix<double, Dim, Dim> refined_inverse(const Eigen::Matrix<double, Dim, Dim>& matrix) {
  using Square = Eigen::Matrix<double, Dim, Dim>;
  Square inverse = matrix.inverse();
  double before = 1;
  for (int pass = 0; pass < 5; ++pass) {
    const Square residual = Square::Identity() - matrix * inverse;
    const double size = residual.cwiseAbs().maxCoeff();
    if (!(size > 1e-13) || !(size < before / 2)) break;
    inverse += (inverse * residual).eval();
    before = size;
  }
  return inverse;
}

}  // namespace halfgrad
