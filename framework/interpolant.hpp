// Bind once, evaluate every frame.
#pragma once

#include <Eigen/SparseCore>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "framework/embedding.hpp"
#include "framework/gradient_stencils.hpp"

namespace halfgrad {

/// How vertex data become the value at a point. All but dual_taylor have the form f = Σ_i a_i x_i + F_i c_i.
enum class Formula : std::uint8_t {
  blend,  ///< Σ β_i (x_i + α F_i (X − X_i)): linear (α = 0), Phong (½), vertex blend (1); James 2020, Eq. 11–13, 19
  hermite,      ///< cubic along edges from the same data
  dual_taylor,  ///< Σ β_i (x_i + ⅔ F_i d_i + ⅙ d_iᵀ Q_i d_i): order four; Kraaijpoel & van Leeuwen 2010
  quadratic10   ///< quadratic with Hermite midpoints, James 2020, Eq. 20–23: equals Phong; simplices only
};

/// An interpolant: a formula and its parameter.
struct InterpolationRule {
  Formula formula = Formula::blend;
  double alpha = 0.5;  ///< of blend

  bool needs_gradients() const { return formula != Formula::blend || alpha != 0; }
  bool needs_hessians() const { return formula == Formula::dual_taylor; }
};

/// The named interpolants with their default parameter, in the order reports list them.
struct NamedRule {
  std::string_view name;
  InterpolationRule rule;
  std::string_view summary;
};
std::span<const NamedRule> named_rules();
/// The rule of a name; throws Error that lists the known names.
InterpolationRule named_rule(std::string_view name);

/// What bind took in and left out.
struct BindReport {
  Index num_points = 0, num_inside = 0, num_boundary = 0, num_outside = 0, num_not_found = 0;
  double max_outside_distance = 0;  ///< length units
  Index num_cells = 0, num_active_cells = 0;
  Index num_vertices = 0, num_active_vertices = 0;
  Offset num_stencil_entries = 0;
  Offset bytes = 0;  ///< memory of the binding
};

struct EvaluateOptions {
  /// Length: cells whose quadratic correction is bounded by it are evaluated linearly. 0 evaluates every cell in full.
  double tolerance = 0;
};

/// The vertices of the cells that hold points, in the order in which an interpolant numbers them: by first use along
/// the cells sorted in space.
std::vector<Index> active_vertices(const Mesh& mesh, const Embedding& embedding);

/// Points bound to a mesh under a rule. Immutable; all members const and safe to call from several threads.
template <class Scalar = double>
class Interpolant {
 public:
  /// `reconstruction` has a row for every active vertex, or is null for rules that need none and for interpolants whose
  /// gradients the caller supplies. Throws Error where the rule lacks what it needs.
  Interpolant(const Mesh& mesh, const Embedding& embedding, const InterpolationRule& rule,
              const Reconstruction* reconstruction);
  ~Interpolant();
  Interpolant(Interpolant&&) noexcept;
  Interpolant& operator=(Interpolant&&) noexcept;

  Index num_points() const;
  Index num_vertices() const;
  int gdim() const;
  const InterpolationRule& rule() const;
  const BindReport& report() const;
  /// Active vertices in binding order.
  std::span<const Index> active() const;

  /// Values at the points, #points × #columns, from vertex values, #vertices × #columns; NaN rows for points not found.
  Values<Scalar> evaluate(const Values<Scalar>& values, const EvaluateOptions& options = {}) const;
  void evaluate(const Values<Scalar>& values, Values<Scalar>& out, const EvaluateOptions& options = {}) const;

  /// The vertex stage alone: F (and Q) of the active vertices in binding order, #active × (#columns · gdim), row =
  /// component, column = axis.
  Values<Scalar> vertex_gradients(const Values<Scalar>& values) const;
  Values<Scalar> vertex_hessians(const Values<Scalar>& values) const;

  /// The point stage alone, on gradients (and Hessians, or an empty matrix) given for the active vertices.
  void evaluate_given(const Values<Scalar>& values, const Values<Scalar>& gradients, const Values<Scalar>& hessians,
                      Values<Scalar>& out, const EvaluateOptions& options = {}) const;

  /// Gradient of the interpolated field at the points (James 2020, Eq. 15, for the rule at hand), #points × (#columns ·
  /// gdim): discontinuous across facets.
  Values<Scalar> gradient(const Values<Scalar>& values) const;
  /// Σ β_i F_i: a continuous gradient, less accurate inside good cells, better on slivers.
  Values<Scalar> smooth_gradient(const Values<Scalar>& values) const;

  /// The map as one sparse matrix, #points × #vertices: evaluate(x) == S·x. Throws Error for data-dependent gradients.
  Eigen::SparseMatrix<double, Eigen::RowMajor> matrix() const;

  /// Cells that the last argument's tolerance lets evaluate linearly: the count a report shows.
  Index num_linear_cells(const Values<Scalar>& values, const EvaluateOptions& options) const;

 private:
  struct Binding;
  std::unique_ptr<const Binding> binding_;
};

extern template class Interpolant<float>;
extern template class Interpolant<double>;

}  // namespace halfgrad
