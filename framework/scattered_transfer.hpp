// Interpolants that know the vertices near a point but no cells: baselines to compare with.
#pragma once

#include <Eigen/SparseCore>
#include <optional>
#include <span>
#include <string_view>

#include "framework/vertex_gradient_reconstructor.hpp"

namespace halfgrad {

/// What a vertex hands to the points near it.
enum class Carried : std::uint8_t {
  displacement,  ///< f = X + Σ w_i (x_i − X_i): first order, as the attribute transfer of James 2020, Fig. 10
  gradient       ///< f = Σ w_i (x_i + F_i (X − X_i)): affine exact, second order
};

/// Weights on the vertices within a radius R of a point, from the metaball kernel (1 − r²/R²)³.
struct ScatteredRule {
  enum class Kind : std::uint8_t {
    attribute_transfer,   ///< normalised kernel weights, as in a Point Deform
    moving_least_squares  ///< value at the point of the quadratic that fits best under the kernel (Levin 1998)
  } kind = Kind::attribute_transfer;
  double radius = 1.5;  ///< in mean edge lengths of the mesh
  int neighbors = 4;    ///< R grows where fewer vertices lie within it, so that at least so many have a weight
  Carried carried = Carried::displacement;  ///< of attribute_transfer

  bool needs_gradients() const { return kind == Kind::attribute_transfer && carried == Carried::gradient; }
};

/// A named rule with its default parameters.
struct NamedScatteredRule {
  std::string_view name;
  ScatteredRule rule;
  std::string_view summary;  ///< one line
};

/// The named rules, in the order reports list them.
std::span<const NamedScatteredRule> scattered_rules();

/// The rule of a name, or none.
std::optional<ScatteredRule> find_scattered_rule(std::string_view name);

/// Points bound to the vertices of a mesh near them, whether inside it or not. Immutable, thread-safe.
class ScatteredTransfer {
 public:
  /// Points are #points × gdim. `reconstructor` is needed where the rule needs gradients. Throws Error on options out
  /// of range, non-finite points, a mesh without cells, and gradients that depend on the data.
  ScatteredTransfer(const Mesh& mesh, const Points& points, const ScatteredRule& rule,
                    const VertexGradientReconstructor* reconstructor = nullptr);
  /// With the weights of an earlier transfer, #points × #vertices. Throws Error where their size is another.
  static ScatteredTransfer from_weights(const Mesh& mesh, const Points& points,
                                        Eigen::SparseMatrix<double, Eigen::RowMajor> weights);

  /// Values at the points, #points × #columns, from deformed vertices, #vertices × #columns with #columns ≥ gdim: rest
  /// positions have zeros in the columns beyond gdim.
  template <class Scalar>
  Values<Scalar> evaluate(const Values<Scalar>& values) const;
  /// The same into the caller's memory.
  template <class Scalar>
  void evaluate(const Values<Scalar>& values, Values<Scalar>& out) const;
  /// M times any vertex data: what the rule makes of values that are no positions.
  template <class Scalar>
  void evaluate_field(const Values<Scalar>& values, Values<Scalar>& out) const;
  /// The weights M of evaluate(x) = X + M (x − rest), #points × #vertices.
  const Eigen::SparseMatrix<double, Eigen::RowMajor>& matrix() const { return matrix_; }

 private:
  ScatteredTransfer() = default;
  // M (values − rest) + points in the first columns, M values in the others.
  template <class Scalar>
  void apply(const Values<Scalar>& values, Eigen::Index num_positions, Values<Scalar>& out) const;

  Points rest_, points_;
  Eigen::SparseMatrix<double, Eigen::RowMajor> matrix_;
};

}  // namespace halfgrad
