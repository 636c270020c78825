// Eigenvalues of the small symmetric matrices of the space.
#pragma once

#include "framework/types.hpp"

namespace halfgrad {

/// Eigenvalues, ascending, and eigenvectors as columns.
struct SymmetricEigen {
  Vector values;
  SmallMatrix vectors;
};

/// Of a symmetric gdim × gdim matrix.
SymmetricEigen symmetric_eigen(const SmallMatrix& matrix);

}  // namespace halfgrad
