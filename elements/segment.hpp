//        0 ----- 1        --> ξ1
#pragma once

#include "elements/element.hpp"

namespace halfgrad {

/// The linear segment on [0, 1].
struct Segment {
  static constexpr std::string_view name = "segment";
  static constexpr int vtk_id = 3;
  static constexpr int dim = 1;
  static constexpr int num_nodes = 2;
  static constexpr bool affine = true;
  static constexpr double reference_volume = 1;
  static constexpr std::array<Facet, 2> facets = {{{1, {0}}, {1, {1}}}};

  static Eigen::Vector2d nodes() { return {0, 1}; }
  static Eigen::Matrix<double, 1, 1> center() { return Eigen::Matrix<double, 1, 1>(0.5); }
  static Eigen::Vector2d shape(const Eigen::Matrix<double, 1, 1>& xi) { return {1 - xi[0], xi[0]}; }
  static Eigen::Vector2d shape_gradient(const Eigen::Matrix<double, 1, 1>&) { return {-1, 1}; }
  static double margin(const Eigen::Matrix<double, 1, 1>& xi) { return std::min(xi[0], 1 - xi[0]); }
};

}  // namespace halfgrad
