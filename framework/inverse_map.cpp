#include "framework/inverse_map.hpp"

namespace halfgrad {

Vector solve_by_elimination(const SmallMatrix& matrix, const Vector& vector) {
  const Eigen::FullPivLU<SmallMatrix> solver(matrix);
  Vector result = solver.solve(vector);
  result += solver.solve(vector - matrix * result);
  return result;
}

}  // namespace halfgrad
