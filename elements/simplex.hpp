#pragma once

#include "elements/element.hpp"

namespace halfgrad {

/// The linear simplex of D dimensions on the origin and the unit points, D from 1 to 4: beyond the registered ones the
/// cell of space-time and parameter meshes, which CellBlocks holds (framework/cell_blocks.hpp). VTK knows no such cell.
template <int D>
struct Simplex {
  static_assert(D >= 1 && D <= 4, "facets have at most four nodes");

  static constexpr std::string_view name = "simplex";
  static constexpr int vtk_id = 0;
  static constexpr int dim = D;
  static constexpr int num_nodes = D + 1;
  static constexpr bool affine = true;
  static constexpr double reference_volume = [] {
    double volume = 1;
    for (int k = 2; k <= D; ++k) volume /= k;
    return volume;
  }();
  /// Facet i lies opposite node i. In four dimensions its order says nothing about its side.
  static constexpr std::array<Facet, D + 1> facets = [] {
    std::array<Facet, D + 1> sides{};
    for (int opposite = 0; opposite <= D; ++opposite) {
      sides[opposite].num_nodes = D;
      for (int i = 0, node = 0; node <= D; ++node)
        if (node != opposite) sides[opposite].nodes[i++] = node;
    }
    return sides;
  }();

  using Point = Eigen::Matrix<double, D, 1>;

  static Eigen::Matrix<double, D + 1, D> nodes() {
    Eigen::Matrix<double, D + 1, D> result = Eigen::Matrix<double, D + 1, D>::Zero();
    result.template bottomRows<D>().setIdentity();
    return result;
  }
  static Point center() { return Point::Constant(1.0 / (D + 1)); }
  static Eigen::Matrix<double, D + 1, 1> shape(const Point& xi) {
    Eigen::Matrix<double, D + 1, 1> beta;
    beta << 1 - xi.sum(), xi;
    return beta;
  }
  static Eigen::Matrix<double, D + 1, D> shape_gradient(const Point&) {
    Eigen::Matrix<double, D + 1, D> gradient = nodes();
    gradient.row(0).setConstant(-1);
    return gradient;
  }
  static double margin(const Point& xi) { return shape(xi).minCoeff(); }
};

}  // namespace halfgrad
