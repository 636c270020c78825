//        2
//        | \              ξ2
//        |   \            |
//        |     \          +-- ξ1
//        0 ----- 1
#pragma once

#include "elements/element.hpp"

namespace halfgrad {

/// The linear triangle: barycentric coordinates on (0,0), (1,0), (0,1).
struct Triangle {
  static constexpr std::string_view name = "triangle";
  static constexpr int vtk_id = 5;
  static constexpr int dim = 2;
  static constexpr int num_nodes = 3;
  static constexpr bool affine = true;
  static constexpr double reference_volume = 1.0 / 2;
  static constexpr std::array<Facet, 3> facets = {{{2, {0, 1}}, {2, {1, 2}}, {2, {2, 0}}}};

  static Eigen::Matrix<double, 3, 2> nodes() { return (Eigen::Matrix<double, 3, 2>() << 0, 0, 1, 0, 0, 1).finished(); }
  static Eigen::Vector2d center() { return Eigen::Vector2d::Constant(1.0 / 3.0); }
  static Eigen::Vector3d shape(const Eigen::Vector2d& xi) { return {1 - xi[0] - xi[1], xi[0], xi[1]}; }
  static Eigen::Matrix<double, 3, 2> shape_gradient(const Eigen::Vector2d&) {
    return (Eigen::Matrix<double, 3, 2>() << -1, -1, 1, 0, 0, 1).finished();
  }
  static double margin(const Eigen::Vector2d& xi) { return shape(xi).minCoeff(); }
};

}  // namespace halfgrad
