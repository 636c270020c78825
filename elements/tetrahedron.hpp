//            3
//           /|\            ξ3
//          / | \           |  ξ2
//         /  |  \          | /
//        0 --|-- 2         +-- ξ1
//         \  |  /
//          \ | /
//            1
#pragma once

#include "elements/element.hpp"

namespace halfgrad {

/// The linear tetrahedron: barycentric coordinates on the origin and the three unit points.
struct Tetrahedron {
  static constexpr std::string_view name = "tetrahedron";
  static constexpr int vtk_id = 10;
  static constexpr int dim = 3;
  static constexpr int num_nodes = 4;
  static constexpr bool affine = true;
  static constexpr double reference_volume = 1.0 / 6;
  static constexpr std::array<Facet, 4> facets = {{{3, {1, 2, 3}}, {3, {0, 3, 2}}, {3, {0, 1, 3}}, {3, {0, 2, 1}}}};

  static Eigen::Matrix<double, 4, 3> nodes() {
    return (Eigen::Matrix<double, 4, 3>() << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1).finished();
  }
  static Eigen::Vector3d center() { return Eigen::Vector3d::Constant(0.25); }
  static Eigen::Vector4d shape(const Eigen::Vector3d& xi) { return {1 - xi[0] - xi[1] - xi[2], xi[0], xi[1], xi[2]}; }
  static Eigen::Matrix<double, 4, 3> shape_gradient(const Eigen::Vector3d&) {
    return (Eigen::Matrix<double, 4, 3>() << -1, -1, -1, 1, 0, 0, 0, 1, 0, 0, 0, 1).finished();
  }
  static double margin(const Eigen::Vector3d& xi) { return shape(xi).minCoeff(); }
};

}  // namespace halfgrad
