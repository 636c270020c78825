//          7 ------- 6
//         /|        /|      ξ3
//        4 ------- 5 |      |  ξ2
//        | |       | |      | /
//        | 3 ------| 2      +-- ξ1
//        |/        |/
//        0 ------- 1
#pragma once

#include "elements/element.hpp"

namespace halfgrad {

/// The trilinear hexahedron on the unit cube.
struct Hexahedron {
  static constexpr std::string_view name = "hexahedron";
  static constexpr int vtk_id = 12;
  static constexpr int dim = 3;
  static constexpr int num_nodes = 8;
  static constexpr bool affine = false;
  static constexpr double reference_volume = 1;
  static constexpr std::array<Facet, 6> facets = {{{4, {0, 4, 7, 3}},
                                                   {4, {1, 2, 6, 5}},
                                                   {4, {0, 1, 5, 4}},
                                                   {4, {3, 7, 6, 2}},
                                                   {4, {0, 3, 2, 1}},
                                                   {4, {4, 5, 6, 7}}}};
  static constexpr std::array<int, 8> cube_nodes = {0, 1, 3, 2, 4, 5, 7, 6};

  static constexpr std::array<std::array<int, 3>, 8> shape_monomials = {
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 0}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}}};
  static constexpr std::array<std::array<int, 8>, 8> shape_coefficients = {{{1, 0, 0, 0, 0, 0, 0, 0},
                                                                            {-1, 1, 0, 0, 0, 0, 0, 0},
                                                                            {-1, 0, 0, 1, 0, 0, 0, 0},
                                                                            {-1, 0, 0, 0, 1, 0, 0, 0},
                                                                            {1, -1, 1, -1, 0, 0, 0, 0},
                                                                            {1, -1, 0, 0, -1, 1, 0, 0},
                                                                            {1, 0, 0, -1, -1, 0, 0, 1},
                                                                            {-1, 1, -1, 1, 1, -1, 1, -1}}};

  static Eigen::Matrix<double, 8, 3> nodes() {
    return (Eigen::Matrix<double, 8, 3>() << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0,  //
            0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1)
        .finished();
  }
  static Eigen::Vector3d center() { return Eigen::Vector3d::Constant(0.5); }
  static Eigen::Matrix<double, 8, 1> shape(const Eigen::Vector3d& xi) {
    const double u = xi[0], v = xi[1], w = xi[2];
    Eigen::Matrix<double, 8, 1> beta;
    beta << (1 - u) * (1 - v) * (1 - w), u * (1 - v) * (1 - w), u * v * (1 - w), (1 - u) * v * (1 - w),
        (1 - u) * (1 - v) * w, u * (1 - v) * w, u * v * w, (1 - u) * v * w;
    return beta;
  }
  static Eigen::Matrix<double, 8, 3> shape_gradient(const Eigen::Vector3d& xi) {
    const double u = xi[0], v = xi[1], w = xi[2];
    Eigen::Matrix<double, 8, 3> gradient;
    gradient << -(1 - v) * (1 - w), -(1 - u) * (1 - w), -(1 - u) * (1 - v),  //
        (1 - v) * (1 - w), -u * (1 - w), -u * (1 - v),                       //
        v * (1 - w), u * (1 - w), -u * v,                                    //
        -v * (1 - w), (1 - u) * (1 - w), -(1 - u) * v,                       //
        -(1 - v) * w, -(1 - u) * w, (1 - u) * (1 - v),                       //
        (1 - v) * w, -u * w, u * (1 - v),                                    //
        v * w, u * w, u * v,                                                 //
        -v * w, (1 - u) * w, (1 - u) * v;
    return gradient;
  }
  static double margin(const Eigen::Vector3d& xi) { return std::min(xi.minCoeff(), (1 - xi.array()).minCoeff()); }
};

}  // namespace halfgrad
