//        3 ----- 2        ξ2
//        |       |        |
//        |       |        +-- ξ1
//        0 ----- 1
#pragma once

#include "elements/element.hpp"

namespace halfgrad {

/// The bilinear quadrilateral on the unit square.
struct Quadrilateral {
  static constexpr std::string_view name = "quadrilateral";
  static constexpr int vtk_id = 9;
  static constexpr int dim = 2;
  static constexpr int num_nodes = 4;
  static constexpr bool affine = false;
  static constexpr double reference_volume = 1;
  static constexpr std::array<Facet, 4> facets = {{{2, {0, 1}}, {2, {1, 2}}, {2, {2, 3}}, {2, {3, 0}}}};
  static constexpr std::array<int, 4> cube_nodes = {0, 1, 3, 2};

  static constexpr std::array<std::array<int, 2>, 4> shape_monomials = {{{0, 0}, {1, 0}, {0, 1}, {1, 1}}};
  static constexpr std::array<std::array<int, 4>, 4> shape_coefficients = {
      {{1, 0, 0, 0}, {-1, 1, 0, 0}, {-1, 0, 0, 1}, {1, -1, 1, -1}}};

  static Eigen::Matrix<double, 4, 2> nodes() {
    return (Eigen::Matrix<double, 4, 2>() << 0, 0, 1, 0, 1, 1, 0, 1).finished();
  }
  static Eigen::Vector2d center() { return Eigen::Vector2d::Constant(0.5); }
  static Eigen::Vector4d shape(const Eigen::Vector2d& xi) {
    const double u = xi[0], v = xi[1];
    return {(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v};
  }
  static Eigen::Matrix<double, 4, 2> shape_gradient(const Eigen::Vector2d& xi) {
    const double u = xi[0], v = xi[1];
    return (Eigen::Matrix<double, 4, 2>() << v - 1, u - 1, 1 - v, -u, v, u, -v, 1 - u).finished();
  }
  static double margin(const Eigen::Vector2d& xi) { return std::min(xi.minCoeff(), (1 - xi.array()).minCoeff()); }
};

}  // namespace halfgrad
