//           5
//         / | \            ξ3
//        3 --|-- 4         |  ξ2
//        |  2   |          | /
//        | / \  |          +-- ξ1
//        0 ----- 1
#pragma once

#include "elements/element.hpp"

namespace halfgrad {

/// The triangular prism: a triangle's barycentric coordinates times a segment's. VTK lists both triangles the other way
/// round (0 2 1, 3 5 4), which would turn the cell inside out; the code of its files converts.
struct Wedge {
  static constexpr std::string_view name = "wedge";
  static constexpr int vtk_id = 13;
  static constexpr int dim = 3;
  static constexpr int num_nodes = 6;
  static constexpr bool affine = false;
  static constexpr double reference_volume = 1.0 / 2;
  static constexpr std::array<Facet, 5> facets = {
      {{3, {0, 2, 1}}, {3, {3, 4, 5}}, {4, {0, 1, 4, 3}}, {4, {1, 2, 5, 4}}, {4, {2, 0, 3, 5}}}};
  static constexpr std::array<int, 8> cube_nodes = {0, 1, 2, 2, 3, 4, 5, 5};

  static constexpr std::array<std::array<int, 3>, 6> shape_monomials = {
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}}};
  static constexpr std::array<std::array<int, 6>, 6> shape_coefficients = {{{1, 0, 0, 0, 0, 0},
                                                                            {-1, 1, 0, 0, 0, 0},
                                                                            {-1, 0, 1, 0, 0, 0},
                                                                            {-1, 0, 0, 1, 0, 0},
                                                                            {1, -1, 0, -1, 1, 0},
                                                                            {1, 0, -1, -1, 0, 1}}};

  static Eigen::Matrix<double, 6, 3> nodes() {
    return (Eigen::Matrix<double, 6, 3>() << 0, 0, 0, 1, 0, 0, 0, 1, 0,  //
            0, 0, 1, 1, 0, 1, 0, 1, 1)
        .finished();
  }
  static Eigen::Vector3d center() { return {1.0 / 3, 1.0 / 3, 0.5}; }
  static Eigen::Matrix<double, 6, 1> shape(const Eigen::Vector3d& xi) {
    const Eigen::Vector3d base(1 - xi[0] - xi[1], xi[0], xi[1]);
    Eigen::Matrix<double, 6, 1> beta;
    beta << base * (1 - xi[2]), base * xi[2];
    return beta;
  }
  static Eigen::Matrix<double, 6, 3> shape_gradient(const Eigen::Vector3d& xi) {
    const double w = xi[2], below = 1 - xi[2], rest = 1 - xi[0] - xi[1];
    Eigen::Matrix<double, 6, 3> gradient;
    gradient << -below, -below, -rest,  //
        below, 0, -xi[0],               //
        0, below, -xi[1],               //
        -w, -w, rest,                   //
        w, 0, xi[0],                    //
        0, w, xi[1];
    return gradient;
  }
  static double margin(const Eigen::Vector3d& xi) {
    return std::min({xi[0], xi[1], 1 - xi[0] - xi[1], xi[2], 1 - xi[2]});
  }
};

}  // namespace halfgrad
