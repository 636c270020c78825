//          1
//        /   \            ξ2
//      2       0          |
//       \     /           +-- ξ1
//        3---4
#pragma once

#include <elements/element.hpp>

/// The pentagon with Wachspress' rational shape functions on the regular pentagon of circumradius one: with l_j the
/// distance to side j, which joins nodes j and j + 1, β_i ∝ Π l_j over the three sides that do not end at node i
/// (Wachspress 1975). Linear on every side, so that any neighbour with straight sides fits.
struct Pentagon {
  static constexpr std::string_view name = "pentagon";
  static constexpr int vtk_id = 7;  // VTK's polygon
  static constexpr int dim = 2;
  static constexpr int num_nodes = 5;
  static constexpr bool affine = false;
  static constexpr double reference_volume = 2.3776412907378837;  // 5/2 sin 72°
  static constexpr std::array<halfgrad::Facet, 5> facets = {
      {{2, {0, 1}}, {2, {1, 2}}, {2, {2, 3}}, {2, {3, 4}}, {2, {4, 0}}}};

  using Point = Eigen::Vector2d;
  using Five = Eigen::Matrix<double, 5, 1>;

  static Eigen::Matrix<double, 5, 2> nodes() {
    Eigen::Matrix<double, 5, 2> result;
    for (int i = 0; i < 5; ++i) result.row(i) << std::cos(angle(i)), std::sin(angle(i));
    return result;
  }
  static Point center() { return Point::Zero(); }
  static Five shape(const Point& xi) {
    const Five products = side_products(distances(xi));
    return products / products.sum();
  }
  static Eigen::Matrix<double, 5, 2> shape_gradient(const Point& xi) {
    const Five l = distances(xi), products = side_products(l);
    Eigen::Matrix<double, 5, 2> slopes = Eigen::Matrix<double, 5, 2>::Zero();
    for (int i = 0; i < 5; ++i)
      for (int m = 1; m <= 3; ++m) {
        double others = 1;
        for (int k = 1; k <= 3; ++k)
          if (k != m) others *= l[(i + k) % 5];
        slopes.row(i) -= others * normal((i + m) % 5).transpose();
      }
    const Eigen::RowVector2d sum = slopes.colwise().sum();
    return (slopes - products / products.sum() * sum) / products.sum();
  }
  static double margin(const Point& xi) { return distances(xi).minCoeff(); }

 private:
  static double angle(double node) { return 0.31415926535897931 + 1.2566370614359172 * node; }  // 18° + 72° · node
  // Outward, of side j.
  static Point normal(int j) { return {std::cos(angle(j + 0.5)), std::sin(angle(j + 0.5))}; }
  static Five distances(const Point& xi) {
    constexpr double apothem = 0.80901699437494745;
    Five l;
    for (int j = 0; j < 5; ++j) l[j] = apothem - normal(j).dot(xi);
    return l;
  }
  // Node i ends sides i − 1 and i.
  static Five side_products(const Five& l) {
    Five products;
    for (int i = 0; i < 5; ++i) products[i] = l[(i + 1) % 5] * l[(i + 2) % 5] * l[(i + 3) % 5];
    return products;
  }
};
