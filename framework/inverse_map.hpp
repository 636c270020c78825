// The inverse map X → ξ of one cell: closed form where x(ξ) is affine, a safeguarded Newton iteration elsewhere.
// Plain loops for what cell_map.hpp says.
#pragma once

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <vector>

#include "framework/cell_extent.hpp"
#include "framework/cell_map.hpp"
#include "framework/types.hpp"

namespace halfgrad {

/// ξ of a position in a cell. Where converged is false no ξ maps to the position as far as was found: it lies outside,
/// beyond a fold of the map.
template <Element E>
struct InverseMapResult {
  ReferencePoint<E> xi;
  bool converged = false;  ///< |x(ξ) − X| ≤ 1e-12 of the cell's extent, axis by axis
};

/// A⁻¹ b by elimination with full pivoting and a step of refinement.
Vector solve_by_elimination(const SmallMatrix& matrix, const Vector& vector);

/// The inverse map of a cell by its node positions. Works relative to the first node and in units of the cell's extent
/// along each axis (powers of two, so that scaling is exact): neither offset, scale nor stretching along the axes costs
/// digits.
template <Element E>
class InverseMap {
 public:
  using Point = ReferencePoint<E>;
  using Jacobian = Eigen::Matrix<double, E::dim, E::dim>;

  /// `positions`: num_nodes × dim.
  explicit InverseMap(const NodeMatrix<E>& positions) {
    Point extent = cell_extent<E>(positions);
    for (int a = 0; a < E::dim; ++a) {
      origin_[a] = positions(0, a);
      scale_[a] = unit_scale(extent[a]);
      extent[a] *= scale_[a];
      for (int i = 0; i < E::num_nodes; ++i) nodes_(i, a) = (positions(i, a) - origin_[a]) * scale_[a];
    }
    const Jacobian jacobian = scaled_jacobian(E::center());
    determinant_ = jacobian.determinant();
    degenerate_ = is_degenerate<E>(extent, determinant_);
    if (degenerate_) return;
    inverse_ = jacobian.inverse();
    if constexpr (!E::affine) {
      affine_ = is_image(jacobian);
      if (!affine_) measure_distortion();
    }
  }

  /// is_degenerate of the cell: it has no inverse map, and no other member but this may be used.
  bool degenerate() const { return degenerate_; }
  /// Whether det J has one sign at all nodes; where not, the cell is folded and ξ need not be unique.
  bool one_signed() const { return one_signed_; }
  /// Whether x(ξ) is affine on this cell.
  bool affine() const { return affine_; }
  /// β = shape(ξ(X)) is linear in X: ∂β_i/∂X_a, num_nodes × dim, of the affine part at the center.
  NodeMatrix<E> weight_gradient() const {
    NodeMatrix<E> result = times_matrix<E>(E::shape_gradient(E::center()), inverse_);
    for (int a = 0; a < E::dim; ++a) result.col(a) *= scale_[a];
    return result;
  }
  /// ∂x/∂ξ in length units, dim × dim.
  Jacobian jacobian(const Point& xi) const {
    Jacobian result = scaled_jacobian(xi);
    for (int a = 0; a < E::dim; ++a)
      for (int k = 0; k < E::dim; ++k) result(a, k) /= scale_[a];
    return result;
  }
  /// X − x(ξ), dim × 1, in length units.
  Point difference(const Point& position, const Point& xi) const {
    const Point target = scaled(position), at = image(xi);
    Point result;
    for (int a = 0; a < E::dim; ++a) result[a] = (target[a] - at[a]) / scale_[a];
    return result;
  }

  /// True where the linear part alone shows that the position lies outside the cell grown by `eps`.
  bool surely_outside(const Point& position, double eps) const {
    const Point guess = affine_guess(scaled(position));
    return E::margin(guess) < -(eps + deviation_);
  }

  /// ξ of a position.
  InverseMapResult<E> operator()(const Point& position) const {
    const Point target = scaled(position);
    if constexpr (!E::affine) {
      if (!affine_) {
        const InverseMapResult<E> result = newton(target, clamped(affine_guess(target)));
        return settles(result) ? result : search(target, result);
      }
    }
    return solve_affine(target);
  }

 private:
  static constexpr double tolerance = 1e-12;
  static constexpr double hair = 1e-6;  // of the reference cell

  Point scaled(const Point& position) const {
    Point result;
    for (int a = 0; a < E::dim; ++a) result[a] = (position[a] - origin_[a]) * scale_[a];
    return result;
  }
  static Point product(const Jacobian& matrix, const Point& vector) {
    Point result;
    for (int a = 0; a < E::dim; ++a) {
      double sum = 0;
      for (int k = 0; k < E::dim; ++k) sum += matrix(a, k) * vector[k];
      result[a] = sum;
    }
    return result;
  }
  Point image(const Point& xi) const { return cell_position<E>(nodes_, xi); }
  Jacobian scaled_jacobian(const Point& xi) const { return cell_jacobian<E>(nodes_, xi); }
  Point affine_guess(const Point& target) const {
    const Point from_center = target - image(E::center());
    return E::center() + product(inverse_, from_center);
  }
  static Point clamped(Point xi) {
    const NodeMatrix<E> nodes = E::nodes();
    for (int a = 0; a < E::dim; ++a) xi[a] = std::clamp(xi[a], nodes.col(a).minCoeff(), nodes.col(a).maxCoeff());
    return xi;
  }

  // Whether the linear map from the first node takes the reference cell to the cell.
  bool is_image(const Jacobian& jacobian) const {
    const NodeMatrix<E> reference = E::nodes();
    double largest = 0;
    for (int i = 0; i < E::num_nodes; ++i)
      for (int a = 0; a < E::dim; ++a) {
        double sum = -nodes_(i, a);
        for (int k = 0; k < E::dim; ++k) sum += jacobian(a, k) * (reference(i, k) - reference(0, k));
        largest = std::max(largest, std::abs(sum));
      }
    return largest <= 1e-14;
  }

  // How far the map is from its linear part: the columns of J are mean values of the columns at the nodes, so their
  // greatest deviation there bounds |J_c⁻¹ J − I| in the cell, and with it the distance of ξ from the affine guess.
  void measure_distortion() {
    const NodeMatrix<E> reference = E::nodes();
    const Point center = E::center();
    Point deviation = Point::Zero();  // squared, a column of J each
    double radius = 0, lowest = determinant_, highest = determinant_;
    for (int i = 0; i < E::num_nodes; ++i) {
      Point near_node;
      double squared = 0;
      for (int k = 0; k < E::dim; ++k) {
        const double from_center = reference(i, k) - center[k];
        squared += from_center * from_center;
        // Just inside the node: rational shape functions may have no gradient at an apex.
        near_node[k] = center[k] + 0.999999 * from_center;
      }
      radius = std::max(radius, std::sqrt(squared));
      const Jacobian at_node = scaled_jacobian(near_node);
      const double determinant = at_node.determinant();
      lowest = std::min(lowest, determinant);
      highest = std::max(highest, determinant);
      for (int k = 0; k < E::dim; ++k) {
        Point column = product(inverse_, at_node.col(k));
        column[k] -= 1;
        deviation[k] = std::max(deviation[k], column.squaredNorm());
      }
    }
    distortion_ = std::sqrt(deviation.sum());
    // margin() measures along axes or barycentric directions: a factor of √dim covers both.
    deviation_ = std::sqrt(E::dim) * distortion_ * radius;
    one_signed_ = lowest > 0 || highest < 0;
  }

  InverseMapResult<E> solve_affine(const Point& target) const {
    const Jacobian jacobian = scaled_jacobian(E::center());
    const auto residual = [&](const Point& from_first) -> Point { return target - product(jacobian, from_first); };
    Point from_first = product(inverse_, target);
    // One step of refinement gives flat cells the residual that the inverse alone would not.
    from_first += product(inverse_, residual(from_first));
    // Where the inverse is worth nothing, on needles that are oblique to the axes, elimination with pivots is exact to
    // the rounding of the position.
    if (!(residual(from_first).cwiseAbs().maxCoeff() <= 1e-14 * std::max(1.0, target.norm())))
      from_first = solve_by_elimination(jacobian, target);
    const NodeMatrix<E> reference = E::nodes();
    for (int k = 0; k < E::dim; ++k) from_first[k] += reference(0, k);
    return {from_first, true};
  }

  // Newton with halved steps until the residual falls.
  InverseMapResult<E> newton(const Point& target, const Point& start) const {
    InverseMapResult<E> result{start, false};
    Point difference = target - image(result.xi);
    double residual = difference.norm();
    const double floor = 4e-16 * std::max(1.0, target.norm());
    for (int iteration = 0; iteration < 60 && residual > floor; ++iteration) {
      Point step = product(scaled_jacobian(result.xi).inverse(), difference);
      const double length = step.norm();
      if (!std::isfinite(length)) break;
      if (length > 1) step /= length;
      const bool polishing = residual < 1e-13;
      bool reduced = false;
      for (double damping = 1; damping > 1e-4 && !reduced; damping *= 0.5) {
        const Point trial = result.xi + damping * step;
        const Point trial_difference = target - image(trial);
        const double trial_residual = trial_difference.norm();
        if (trial_residual < (1 - 1e-3 * damping) * residual) {
          reduced = true;
          result.xi = trial;
          difference = trial_difference;
          residual = trial_residual;
        }
        if (polishing) break;  // what a full step does not gain here is rounding
      }
      if (!reduced) break;
    }
    result.converged = residual <= tolerance * std::max(1.0, target.norm());
    return result;
  }

  // Whether no other start need be tried: ξ is in the cell; or the map is one to one between it and the cell; or ξ is
  // outside by a hair, on the side of the fold det J = 0 on which the cell lies. For an element whose search is no
  // proof, the latter holds however far outside.
  bool settles(const InverseMapResult<E>& result) const {
    if (!result.converged) return false;
    const double margin = E::margin(result.xi);
    if (margin >= 0 || one_to_one(margin)) return true;
    if (CubeElement<E> && margin < -hair) return false;
    return one_signed_ && scaled_jacobian(result.xi).determinant() * determinant_ > 0;
  }

  // Whether |J_c⁻¹ J − I| < 1, so that the map is one to one, in the reference cell scaled about its center until it
  // reaches a margin. Scaled by s, the linear and the bilinear part of J − J_c grow by s and s², and neither is greater
  // than their sum's bound in the cell.
  bool one_to_one(double margin) const {
    if constexpr (CubeElement<E> && PolynomialElement<E> && E::dim <= 3) {
      const double scale = 1 - margin / E::margin(E::center());
      return (2 * scale * scale - scale) * distortion_ < 1;
    }
    return false;
  }

  // A part of the cell by its corners: ξ of each, and J_c⁻¹ (x(ξ) − X).
  static constexpr int num_corners = 1 << E::dim;
  struct Part {
    std::array<Point, num_corners> xi, image;
  };

  Part whole(const Point& target) const {
    const NodeMatrix<E> nodes = E::nodes();
    Part part{};
    for (int c = 0; c < num_corners; ++c) {
      if constexpr (CubeElement<E>) {
        const int node = E::cube_nodes[c];
        Point from_target;
        for (int a = 0; a < E::dim; ++a) {
          part.xi[c][a] = nodes(node, a);
          from_target[a] = nodes_(node, a) - target[a];
        }
        part.image[c] = product(inverse_, from_target);
      } else {
        for (int a = 0; a < E::dim; ++a) part.xi[c][a] = c >> a & 1 ? nodes.col(a).maxCoeff() : nodes.col(a).minCoeff();
      }
    }
    return part;
  }

  // Greatest sum of a row's absolute values: how much a matrix may enlarge a box.
  static double box_growth(const Jacobian& matrix) {
    double largest = 0;
    for (int a = 0; a < E::dim; ++a) {
      double sum = 0;
      for (int k = 0; k < E::dim; ++k) sum += std::abs(matrix(a, k));
      largest = std::max(largest, sum);
    }
    return largest;
  }

  // Whether a plane across an axis has the images of all corners on one side, and the position on the other.
  static bool excludes(const std::array<Point, num_corners>& image, double slack) {
    for (int a = 0; a < E::dim; ++a) {
      double low = image[0][a], high = low;
      for (const Point& corner : image) {
        low = std::min(low, corner[a]);
        high = std::max(high, corner[a]);
      }
      if (low > slack || high < -slack) return true;
    }
    return false;
  }

  // The same for planes along the part's own mean edges, which fit it the better the smaller it is.
  static bool excludes_along_edges(const std::array<Point, num_corners>& image, double slack) {
    Jacobian edges = Jacobian::Zero();
    for (int c = 0; c < num_corners; ++c)
      for (int a = 0; a < E::dim; ++a)
        for (int k = 0; k < E::dim; ++k) edges(k, a) += (c >> a & 1 ? 2.0 : -2.0) / num_corners * image[c][k];
    const Jacobian inverse = edges.inverse();
    std::array<Point, num_corners> own;
    bool finite = true;
    for (int c = 0; c < num_corners; ++c) {
      own[c] = product(inverse, image[c]);
      for (int k = 0; k < E::dim; ++k) finite &= std::isfinite(own[c][k]);
    }
    return finite && excludes(own, slack * box_growth(inverse));
  }

  // Halves the cell along one axis after the other, iterates from the middles of the parts, and drops parts that cannot
  // hold the position: a multilinear map has the image of a part in the hull of its corners' images. Where no part is
  // left the position is outside. Keeps the ξ of greatest margin.
  InverseMapResult<E> search(const Point& target, InverseMapResult<E> best) const {
    constexpr int max_halvings = (CubeElement<E> ? 16 : 3) * E::dim, max_starts = 1000;
    // Beside rounding, what the tolerances of callers let a position be outside.
    const double slack = hair + 1e-15 * box_growth(inverse_);
    const Part cell = whole(target);
    if (CubeElement<E> && excludes(cell.image, slack)) return best;
    std::vector<Part> parts{cell}, halves;
    int num_starts = 0;
    for (int halving = 0; halving < max_halvings && !parts.empty(); ++halving) {
      const int axis = halving % E::dim;
      for (const Part& part : parts) {
        if (CubeElement<E> &&
            (excludes(part.image, slack) || (halving >= E::dim && excludes_along_edges(part.image, slack))))
          continue;
        // Most parts are dropped before all axes are halved: an iteration costs more than a halving.
        if (axis == E::dim - 1) {
          Point middle = Point::Zero();
          for (const Point& corner : part.xi) middle += corner;
          const InverseMapResult<E> found = newton(target, middle / num_corners);
          if (found.converged && (!best.converged || E::margin(found.xi) > E::margin(best.xi))) best = found;
          if (settles(best) || ++num_starts == max_starts) return best;
        }
        Part low = part, high = part;
        for (int c = 0; c < num_corners; ++c) {
          Part& half = c >> axis & 1 ? low : high;
          const int across = c ^ 1 << axis;
          half.xi[c] = 0.5 * (part.xi[c] + part.xi[across]);
          half.image[c] = 0.5 * (part.image[c] + part.image[across]);
        }
        halves.push_back(low);
        halves.push_back(high);
      }
      parts.swap(halves);
      halves.clear();
    }
    return best;
  }

  Point origin_;
  Point scale_;
  NodeMatrix<E> nodes_;  // relative to the origin, scaled
  double determinant_ = 0;
  bool degenerate_ = false;
  Jacobian inverse_ = Jacobian::Zero();  // at the center, scaled
  double distortion_ = 0;                // at least |J_c⁻¹ J − I| in the cell
  double deviation_ = 0;                 // at least the distance of ξ from the affine guess
  bool affine_ = E::affine;
  bool one_signed_ = true;
};

}  // namespace halfgrad
