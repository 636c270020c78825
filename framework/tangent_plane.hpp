// The plane of a piece of surface in R³.
#pragma once

#include <Eigen/Geometry>

namespace halfgrad {

/// Area times normal of a polygon in R³ by its corners (n × 3) in order: the mean plane's where they do not lie in one.
template <int n>
Eigen::Vector3d area_vector(const Eigen::Matrix<double, n, 3>& corners) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int i = 1; i + 1 < n; ++i) {
    const Eigen::Vector3d a = corners.row(i) - corners.row(0), b = corners.row(i + 1) - corners.row(0);
    sum += 0.5 * a.cross(b);
  }
  return sum;
}

/// Two orthonormal columns orthogonal to `normal` (of any length > 0), in right-handed order with it; 3 × 2.
inline Eigen::Matrix<double, 3, 2> tangent_basis(const Eigen::Vector3d& normal) {
  Eigen::Index axis;
  normal.cwiseAbs().minCoeff(&axis);
  const Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis);
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = normal.cross(unit).stableNormalized();
  basis.col(1) = normal.cross(basis.col(0)).stableNormalized();
  return basis;
}

}  // namespace halfgrad
