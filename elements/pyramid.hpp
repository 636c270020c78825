//             4
//           / | \           ξ3
//          /  |  \          |  ξ2
//        3 ---|--- 2        | /
//       /     |   /         +-- ξ1
//      0 ------- 1
#pragma once

#include "elements/element.hpp"

namespace halfgrad {

/// The pyramid with rational shape functions on the unit square and the apex (½, ½, 1). With a, b the distances to two
/// sides of the square of width w = 1 − ξ3 at the point's height, the base nodes weigh
/// (w − a)(w − b)/w, a(w − b)/w, ab/w, (w − a)b/w: bilinear on the base, linear on every side, and with a limit at the
/// apex because the only rational term, ab/w, lies between 0 and w inside.
struct Pyramid {
  static constexpr std::string_view name = "pyramid";
  static constexpr int vtk_id = 14;
  static constexpr int dim = 3;
  static constexpr int num_nodes = 5;
  static constexpr bool affine = false;
  static constexpr double reference_volume = 1.0 / 3;
  static constexpr std::array<Facet, 5> facets = {
      {{4, {0, 3, 2, 1}}, {3, {0, 1, 4}}, {3, {1, 2, 4}}, {3, {2, 3, 4}}, {3, {3, 0, 4}}}};
  static constexpr std::array<int, 8> cube_nodes = {0, 1, 3, 2, 4, 4, 4, 4};

  static constexpr std::array<std::array<double, 4>, 3> rational = {{{0, 1, 0, -0.5}, {0, 0, 1, -0.5}, {1, 0, 0, -1}}};
  static constexpr double least_denominator = 1e-12;
  static constexpr std::array<std::array<int, 4>, 5> shape_monomials = {
      {{0, 0, 0, 0}, {1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
  static constexpr std::array<std::array<double, 5>, 5> shape_coefficients = {
      {{1, 0, 0, 0, 0}, {-1, 1, 0, 0, 0}, {-1, 0, 0, 1, 0}, {0, -0.5, 0, -0.5, 1}, {1, -1, 1, -1, 0}}};

  static Eigen::Matrix<double, 5, 3> nodes() {
    return (Eigen::Matrix<double, 5, 3>() << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0.5, 0.5, 1).finished();
  }
  static Eigen::Vector3d center() { return {0.5, 0.5, 0.25}; }
  static Eigen::Matrix<double, 5, 1> shape(const Eigen::Vector3d& xi) {
    const double w = 1 - xi[2], a = xi[0] - xi[2] / 2, b = xi[1] - xi[2] / 2;
    // Any value of the rational term keeps Σβ = 1 and Σβ_i node_i = ξ; at the apex it is zero.
    const double quotient = w > least_denominator ? a * b / w : 0;
    Eigen::Matrix<double, 5, 1> beta;
    beta << w - a - b + quotient, a - quotient, quotient, b - quotient, xi[2];
    return beta;
  }
  static Eigen::Matrix<double, 5, 3> shape_gradient(const Eigen::Vector3d& xi) {
    const double w = 1 - xi[2], a = xi[0] - xi[2] / 2, b = xi[1] - xi[2] / 2;
    // The gradient depends on the direction from which the apex is reached; there it is taken along the axis.
    const double p = w > least_denominator ? a / w : 0.5, q = w > least_denominator ? b / w : 0.5;
    const Eigen::RowVector3d slope(q, p, p * q - (p + q) / 2);
    Eigen::Matrix<double, 5, 3> gradient;
    gradient << -1, -1, 0, 1, 0, -0.5, 0, 0, 0, 0, 1, -0.5, 0, 0, 1;
    gradient.row(0) += slope;
    gradient.row(1) -= slope;
    gradient.row(2) += slope;
    gradient.row(3) -= slope;
    return gradient;
  }
  static double margin(const Eigen::Vector3d& xi) {
    const double w = 1 - xi[2], a = xi[0] - xi[2] / 2, b = xi[1] - xi[2] / 2;
    return std::min({xi[2], a, w - a, b, w - b});
  }
};

}  // namespace halfgrad
