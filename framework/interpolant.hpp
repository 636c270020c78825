// Bind once, evaluate every frame.
#pragma once

#include <Eigen/SparseCore>
#include <memory>
#include <span>
#include <vector>

#include "framework/binding_order.hpp"
#include "framework/embedding.hpp"
#include "framework/gradient_stencils.hpp"
#include "framework/interpolation_rule.hpp"
#include "framework/kernels/cell_polynomial.hpp"

namespace halfgrad {

class Grid;
struct WeightedPoints;

/// What bind took in and left out.
struct BindReport {
  Index num_points = 0, num_inside = 0, num_boundary = 0, num_outside = 0, num_not_found = 0;
  double max_outside_distance = 0;  ///< length units
  Index num_cells = 0, num_active_cells = 0;
  Index num_vertices = 0, num_active_vertices = 0;
  Offset num_stencil_entries = 0;
  Offset bytes = 0;  ///< memory of the binding
};

/// Which code evaluates a frame; they agree to round-off.
enum class Kernel : std::uint8_t {
  fast,  ///< vectors, where the element and the rule have a fast path; else plain
  plain  ///< the formulas as they stand: the reference
};

struct EvaluateOptions {
  /// Length: simplices whose quadratic correction is bounded by it are evaluated linearly. 0 evaluates every cell in
  /// full, as other cells always are.
  double tolerance = 0;
  Kernel kernel = Kernel::fast;
};

/// Memory of a frame, kept between frames. One a thread that evaluates.
template <class Scalar>
struct Workspace {
  Values<Scalar> gradients, hessians;                ///< of the plain path
  std::vector<kernels::CacheLine> positions, lines;  ///< of the fast path
  std::vector<kernels::CacheLine> fitted;            ///< lines that a blend reads
  Values<Scalar> sorted;                             ///< results before they go to the caller's order

  std::vector<std::uint8_t> moved;  ///< of update_sorted: vertices whose values changed, then those whose lines did
  const void* holds = nullptr;      ///< the binding whose last update_sorted the buffers hold
  Eigen::Index held_columns = 0;
  double held_tolerance = 0;
};

/// The vertices that points have weights on, by first use.
std::vector<Index> active_vertices(const WeightedPoints& points);

/// Points bound to a mesh under a rule. Immutable; all members const and safe to call from several threads.
template <class Scalar = double>
class Interpolant {
 public:
  /// `reconstruction` has a row for every active vertex, or is null for rules that need none and for interpolants whose
  /// gradients the caller supplies. Throws Error where the rule lacks what it needs.
  Interpolant(const Mesh& mesh, const Embedding& embedding, const InterpolationRule& rule,
              const Reconstruction* reconstruction);
  /// The same where the order is at hand: that of this mesh and embedding.
  Interpolant(const Mesh& mesh, const Embedding& embedding, const BindingOrder& order, const InterpolationRule& rule,
              const Reconstruction* reconstruction);
  /// The same on a grid: an explicit mesh of the cells that hold points and no others is made meanwhile.
  Interpolant(const Grid& grid, const Embedding& embedding, const InterpolationRule& rule,
              const Reconstruction* reconstruction);
  /// Points by their weights, on the plain path: they are evaluated in full whatever the tolerance, and gradient()
  /// throws Error, since weights alone do not tell their own gradients.
  Interpolant(const WeightedPoints& points, const InterpolationRule& rule, const Reconstruction* reconstruction);
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
  /// The caller's point at each sorted position, #points: points of a cell stand together, points not found last.
  std::span<const Index> permutation() const;

  /// Values at the points, #points × #columns, from vertex values, #vertices × #columns; NaN rows for points not found.
  Values<Scalar> evaluate(const Values<Scalar>& values, const EvaluateOptions& options = {}) const;
  /// The same into the caller's memory, which is resized where it does not fit: no allocation from the second frame on.
  void evaluate(const Values<Scalar>& values, Values<Scalar>& out, Workspace<Scalar>& workspace,
                const EvaluateOptions& options = {}) const;
  /// Row s of `out` is the value at point permutation()[s]: cheaper than evaluate, which moves every row once more. A
  /// caller who numbers points by permutation() before bind gets this speed from evaluate.
  void evaluate_sorted(const Values<Scalar>& values, Values<Scalar>& out, Workspace<Scalar>& workspace,
                       const EvaluateOptions& options = {}) const;

  /// evaluate_sorted for a frame that differs little from the last one: cells none of whose vertices' values and
  /// stencils changed, bit for bit, keep their rows of `out`. `out` and `workspace` must be as the last call of
  /// update_sorted with the same options left them, or new. Returns the number of cells evaluated: all of them in the
  /// first call and where no fast path serves the mesh and the rule.
  Index update_sorted(const Values<Scalar>& values, Values<Scalar>& out, Workspace<Scalar>& workspace,
                      const EvaluateOptions& options = {}) const;

  /// The vertex stage alone: F of the active vertices in binding order, #active × (#columns · gdim), row = component,
  /// column = axis.
  Values<Scalar> vertex_gradients(const Values<Scalar>& values) const;
  /// The same with Q, #active × (#columns · num_symmetric(gdim)), where the rule needs it; else `hessians` is empty.
  void vertex_derivatives(const Values<Scalar>& values, Values<Scalar>& gradients, Values<Scalar>& hessians) const;

  /// The point stage alone, on gradients (and Hessians, or an empty matrix) given for the active vertices.
  void evaluate_given(const Values<Scalar>& values, const Values<Scalar>& gradients, const Values<Scalar>& hessians,
                      Values<Scalar>& out, const EvaluateOptions& options = {}) const;

  /// Gradient of the interpolated field at the points (James 2020, Eq. 15, for the rule at hand), #points × (#columns ·
  /// gdim): discontinuous across facets. Throws Error where the points were given by their weights.
  Values<Scalar> gradient(const Values<Scalar>& values) const;
  /// Σ β_i F_i: a continuous gradient, less accurate inside good cells, better on slivers.
  Values<Scalar> smooth_gradient(const Values<Scalar>& values) const;

  /// The map as one sparse matrix, #points × #vertices: evaluate(x) == S·x. Throws Error for data-dependent gradients.
  Eigen::SparseMatrix<double, Eigen::RowMajor> matrix() const;

  /// Number of active cells that options.tolerance lets evaluate linearly.
  Index num_linear_cells(const Values<Scalar>& values, const EvaluateOptions& options) const;

 private:
  struct Binding;
  // A mesh that is part of a larger one: `numbers` are its vertices' there.
  Interpolant(const Mesh& mesh, const Embedding& embedding, const BindingOrder& order, const InterpolationRule& rule,
              const Reconstruction* reconstruction, std::span<const Index> numbers, Index num_vertices,
              Index num_cells);
  std::unique_ptr<const Binding> binding_;
};

extern template class Interpolant<float>;
extern template class Interpolant<double>;

}  // namespace halfgrad
