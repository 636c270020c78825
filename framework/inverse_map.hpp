// The inverse map X → ξ of one cell: closed form where x(ξ) is affine, a safeguarded Newton iteration elsewhere.
#pragma once

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "framework/cell_extent.hpp"

namespace halfgrad {

/// ξ of a position in a cell. Where converged is false no ξ maps to the position as far as was found: it lies outside,
/// beyond a fold of the map.
template <Element E>
struct InverseMapResult {
  ReferencePoint<E> xi;
  bool converged = false;  ///< |x(ξ) − X| ≤ 1e-12 of the cell's extent, axis by axis
};

/// The inverse map of a cell by its node positions. Works relative to the first node and in units of the cell's extent
/// along each axis (powers of two, so that scaling is exact): neither offset, scale nor stretching along the axes costs
/// digits.
template <Element E>
class InverseMap {
 public:
  using Point = ReferencePoint<E>;
  using Jacobian = Eigen::Matrix<double, E::dim, E::dim>;

  /// `positions`: num_nodes × dim.
  explicit InverseMap(const NodeMatrix<E>& positions) : origin_(positions.row(0).transpose()) {
    nodes_ = positions.rowwise() - positions.row(0);
    Point extent = cell_extent<E>(nodes_);
    for (int a = 0; a < E::dim; ++a) {
      scale_[a] = unit_scale(extent[a]);
      extent[a] *= scale_[a];
      nodes_.col(a) *= scale_[a];
    }
    const Jacobian jacobian = nodes_.transpose() * E::shape_gradient(E::center());
    determinant_ = jacobian.determinant();
    degenerate_ = is_degenerate<E>(extent, determinant_);
    if (degenerate_) return;
    inverse_ = jacobian.inverse();
    const NodeMatrix<E> reference = E::nodes();
    if constexpr (!E::affine) {
      const NodeMatrix<E> image = (reference.rowwise() - reference.row(0)) * jacobian.transpose();
      affine_ = (image - nodes_).cwiseAbs().maxCoeff() <= 1e-14;
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
  NodeMatrix<E> weight_gradient() const { return E::shape_gradient(E::center()) * inverse_ * scale_.asDiagonal(); }
  /// ∂x/∂ξ in length units, dim × dim.
  Jacobian jacobian(const Point& xi) const { return scale_.cwiseInverse().asDiagonal() * scaled_jacobian(xi); }
  /// X − x(ξ), dim × 1, in length units.
  Point difference(const Point& position, const Point& xi) const {
    return (scaled(position) - image(xi)).cwiseQuotient(scale_);
  }

  /// True where the linear part alone shows that the position lies outside the cell grown by `eps`.
  bool surely_outside(const Point& position, double eps) const {
    const Point guess = affine_guess(scaled(position));
    return E::margin(guess) < -(eps + deviation_);
  }

  /// ξ of a position.
  InverseMapResult<E> operator()(const Point& position) const {
    const Point target = scaled(position);
    if (affine_) return solve_affine(target);
    const InverseMapResult<E> result = newton(target, clamped(affine_guess(target)));
    return settles(result) ? result : search(target, result);
  }

 private:
  static constexpr double tolerance = 1e-12;
  static constexpr double hair = 1e-6;  // of the reference cell

  Point scaled(const Point& position) const { return (position - origin_).cwiseProduct(scale_); }
  Point image(const Point& xi) const { return nodes_.transpose() * E::shape(xi); }
  Jacobian scaled_jacobian(const Point& xi) const { return nodes_.transpose() * E::shape_gradient(xi); }
  Point affine_guess(const Point& target) const { return E::center() + inverse_ * (target - image(E::center())); }
  static Point clamped(const Point& xi) {
    const NodeMatrix<E> nodes = E::nodes();
    return xi.cwiseMax(nodes.colwise().minCoeff().transpose()).cwiseMin(nodes.colwise().maxCoeff().transpose());
  }

  // How far the map is from its linear part: the columns of J are mean values of the columns at the nodes, so their
  // greatest deviation there bounds |J_c⁻¹ J − I| in the cell, and with it the distance of ξ from the affine guess.
  void measure_distortion() {
    const NodeMatrix<E> reference = E::nodes();
    Eigen::Array<double, E::dim, 1> deviation = Eigen::Array<double, E::dim, 1>::Zero();
    double radius = 0, lowest = determinant_, highest = determinant_;
    for (int i = 0; i < E::num_nodes; ++i) {
      const Point from_center = reference.row(i).transpose() - E::center();
      radius = std::max(radius, from_center.norm());
      // Just inside the node: rational shape functions may have no gradient at an apex.
      const Jacobian at_node = scaled_jacobian(E::center() + 0.999999 * from_center);
      const double determinant = at_node.determinant();
      lowest = std::min(lowest, determinant);
      highest = std::max(highest, determinant);
      deviation = deviation.max((inverse_ * at_node - Jacobian::Identity()).colwise().norm().transpose().array());
    }
    distortion_ = deviation.matrix().norm();
    // margin() measures along axes or barycentric directions: a factor of √dim covers both.
    deviation_ = std::sqrt(E::dim) * distortion_ * radius;
    one_signed_ = lowest > 0 || highest < 0;
  }

  InverseMapResult<E> solve_affine(const Point& target) const {
    const Point first = E::nodes().row(0).transpose();
    const Jacobian jacobian = scaled_jacobian(E::center());
    InverseMapResult<E> result;
    Point from_first = inverse_ * target;
    // One step of refinement gives flat cells the residual that the inverse alone would not.
    from_first += inverse_ * (target - jacobian * from_first);
    // Where the inverse is worth nothing, on needles that are oblique to the axes, elimination with pivots is exact to
    // the rounding of the position.
    if (!((target - jacobian * from_first).cwiseAbs().maxCoeff() <= 1e-14 * std::max(1.0, target.norm())))
      from_first = jacobian.fullPivLu().solve(target);
    result.xi = first + from_first;
    result.converged = true;
    return result;
  }

  // Newton with halved steps until the residual falls.
  InverseMapResult<E> newton(const Point& target, const Point& start) const {
    InverseMapResult<E> result{start, false};
    Point difference = target - image(result.xi);
    double residual = difference.norm();
    const double floor = 4e-16 * std::max(1.0, target.norm());
    for (int iteration = 0; iteration < 60 && residual > floor; ++iteration) {
      Point step = scaled_jacobian(result.xi).inverse() * difference;
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

  // A part of the cell by its corners, a row each: ξ, and J_c⁻¹ (x(ξ) − X).
  static constexpr int num_corners = 1 << E::dim;
  using Part = Eigen::Matrix<double, num_corners, 2 * E::dim>;

  Part whole(const Point& target) const {
    const NodeMatrix<E> nodes = E::nodes();
    Part part = Part::Zero();
    for (int c = 0; c < num_corners; ++c) {
      if constexpr (CubeElement<E>) {
        const int node = E::cube_nodes[c];
        part.row(c).template head<E::dim>() = nodes.row(node);
        part.row(c).template tail<E::dim>() = (inverse_ * (nodes_.row(node).transpose() - target)).transpose();
      } else {
        for (int a = 0; a < E::dim; ++a) part(c, a) = c >> a & 1 ? nodes.col(a).maxCoeff() : nodes.col(a).minCoeff();
      }
    }
    return part;
  }

  // Whether a plane across an axis has the images of all corners on one side, and the position on the other.
  static bool excludes(const Part& part, double slack) {
    for (int a = 0; a < E::dim; ++a) {
      double low = part(0, E::dim + a), high = low;
      for (int c = 1; c < num_corners; ++c) {
        low = std::min(low, part(c, E::dim + a));
        high = std::max(high, part(c, E::dim + a));
      }
      if (low > slack || high < -slack) return true;
    }
    return false;
  }

  // The same for planes along the part's own mean edges, which fit it the better the smaller it is.
  static bool excludes_along_edges(const Part& part, double slack) {
    const Eigen::Matrix<double, num_corners, E::dim> images = part.template rightCols<E::dim>();
    Jacobian edges = Jacobian::Zero();
    for (int c = 0; c < num_corners; ++c)
      for (int a = 0; a < E::dim; ++a)
        edges.col(a) += (c >> a & 1 ? 2.0 : -2.0) / num_corners * images.row(c).transpose();
    const Jacobian inverse = edges.inverse();
    Part own = part;
    own.template rightCols<E::dim>() = images * inverse.transpose();
    return own.allFinite() && excludes(own, slack * inverse.cwiseAbs().rowwise().sum().maxCoeff());
  }

  // Halves the cell along one axis after the other, iterates from the middles of the parts, and drops parts that cannot
  // hold the position: a multilinear map has the image of a part in the hull of its corners' images. Where no part is
  // left the position is outside. Keeps the ξ of greatest margin.
  InverseMapResult<E> search(const Point& target, InverseMapResult<E> best) const {
    constexpr int max_halvings = (CubeElement<E> ? 16 : 3) * E::dim, max_starts = 1000;
    // Beside rounding, what the tolerances of callers let a position be outside.
    const double slack = hair + 1e-15 * inverse_.cwiseAbs().rowwise().sum().maxCoeff();
    const Part cell = whole(target);
    if (CubeElement<E> && excludes(cell, slack)) return best;
    std::vector<Part> parts{cell}, halves;
    int num_starts = 0;
    for (int halving = 0; halving < max_halvings && !parts.empty(); ++halving) {
      const int axis = halving % E::dim;
      for (const Part& part : parts) {
        if (CubeElement<E> && (excludes(part, slack) || (halving >= E::dim && excludes_along_edges(part, slack))))
          continue;
        // Most parts are dropped before all axes are halved: an iteration costs more than a halving.
        if (axis == E::dim - 1) {
          const InverseMapResult<E> found =
              newton(target, part.template leftCols<E::dim>().colwise().mean().transpose());
          if (found.converged && (!best.converged || E::margin(found.xi) > E::margin(best.xi))) best = found;
          if (settles(best) || ++num_starts == max_starts) return best;
        }
        Part low = part, high = part;
        for (int c = 0; c < num_corners; ++c)
          (c >> axis & 1 ? low : high).row(c) = 0.5 * (part.row(c) + part.row(c ^ 1 << axis));
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
