// Vertex gradients as weights on vertex values: what every reconstructor ends in.
#pragma once

#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "framework/types.hpp"

namespace halfgrad {

/// How a vertex's stencil came to be.
enum class StencilRule : std::uint8_t {
  average,      ///< a weighted mean of the adjacent cells' gradients
  full_fit,     ///< the first patch of the schedule determined every mode
  wider_patch,  ///< a later patch of the schedule did
  damped,       ///< no patch determined every mode; weak modes are damped
  cell_value,   ///< fallback to the volume-weighted mean of the adjacent cells' gradients
  none          ///< the vertex belongs to no usable cell: gradient zero
};

/// What a reconstructor tells of one row.
struct StencilDiagnostics {
  StencilRule rule = StencilRule::average;
  std::uint8_t schedule_entry = 0;    ///< which patch of the schedule served
  Index num_points = 0;               ///< vertices (or cells, for averages) in the patch
  float smallest_singular_value = 0;  ///< of the constrained system, dimensionless
  float absolute_sum = 0;             ///< A1 = Σ_j |g_vj| · h_v
  float expected_error = 0;           ///< J of the kriging, dimensionless
};

/// Compressed rows of difference stencils, F_v = Σ_j (x_j − x_v) ⊗ g_vj: rows sum to zero by construction, so a
/// translation of the values changes nothing, not even round-off relative to the offset.
struct GradientStencilTable {
  int gdim = 0;
  std::vector<Index> vertices;          ///< row r belongs to vertex vertices[r]
  std::vector<Offset> offsets{0};       ///< #rows + 1
  std::vector<Index> neighbors;         ///< vertex j of each entry, never the row's own vertex
  std::vector<double> weights;          ///< gdim an entry: g_vj, in 1/length
  std::vector<double> hessian_weights;  ///< empty, or num_symmetric(gdim) an entry: Q_v = Σ_j (x_j − x_v) ⊗ q_vj
  std::vector<StencilDiagnostics> diagnostics;  ///< empty, or one a row

  Index num_rows() const { return static_cast<Index>(vertices.size()); }
  Offset num_entries() const { return static_cast<Offset>(neighbors.size()); }
  bool has_hessians() const { return !hessian_weights.empty(); }
};

/// What blends the main table's gradients with those of an average, a vertex and a frame at a time (reconstructor
/// `adaptive`; the rule is that of blended_gradients()).
struct AdaptiveBlend {
  GradientStencilTable averaging;       ///< the rows of the main table, in its order
  GradientStencilTable beyond;          ///< rows of the main table's kind, of neighbours that it lacks
  double prediction_share = 0;          ///< 0 … 1, of the neighbours' prediction in the fitted gradient
  std::vector<double> caution;          ///< a row of the main table: what the mismatch ratio is multiplied by
  std::vector<Offset> edge_offsets{0};  ///< #rows of the main table + 1
  std::vector<Index> edge_rows;         ///< row of the edge's other vertex in the main table, or behind it in `beyond`
  std::vector<double> edges;            ///< gdim an edge: X_j − X_v, never zero
};

/// Leaves out the edges that are shorter than a length.
void drop_short_edges(AdaptiveBlend& blend, double shortest);

/// An edge as mismatches are measured along it: ê = e / |e| · sqrt(h / |e|) with the mean length h of the vertex's
/// edges.
struct WeightedEdge {
  Vector along;       ///< ê
  double per_length;  ///< |ê| / |e|
};
std::vector<WeightedEdge> weighted_edges(const AdaptiveBlend& blend, Index row, int gdim);

/// The edges of one vertex as a metric of gradients: Σ êêᵀ, and the inverse of that sum plus a tenth of its mean
/// eigenvalue, which stays bounded where the edges hardly span the space. Zero where the vertex has no edges.
struct EdgeMetric {
  SmallMatrix sum, damped_inverse;  ///< gdim × gdim
};
EdgeMetric edge_metric(std::span<const WeightedEdge> edges, int gdim);

/// The weight of the fitted gradient, 1 / (1 + r⁶) of r = caution · sqrt(fitted · predicted) / averaged, the mismatches
/// of the fitted gradient, of the best that its neighbours leave room for, and of the averaged one. `squares` are those
/// of what mismatches are differences of: mismatches below (1000 ε)² of them are rounding, as where the edges do not
/// see that the gradients differ, and the fitted one is taken. Mismatches beyond the numbers of the type tell nothing:
/// the average is taken, which is no steeper than the cells.
template <class Scalar>
Scalar fitted_weight(Scalar fitted, Scalar predicted, Scalar averaged, Scalar squares, Scalar caution) {
  constexpr Scalar most = std::numeric_limits<Scalar>::max();
  if (!(fitted <= most && predicted <= most && averaged <= most)) return 0;
  constexpr Scalar rounding = 1000 * std::numeric_limits<Scalar>::epsilon();
  if (!(fitted > 0) || !(predicted > 0)) return 1;
  const Scalar measure = averaged + rounding * rounding * squares;
  const Scalar squared = (caution * (fitted / measure)) * (caution * (predicted / measure));
  return 1 / (1 + squared * squared * squared);
}

/// What a reconstructor gives: one linear table, or two with a data-dependent blend.
struct Reconstruction {
  GradientStencilTable stencils;
  std::optional<AdaptiveBlend> blend;
};

/// The rows that edges are tested with: those of the main table, then those of `beyond`.
GradientStencilTable fitted_rows(const Reconstruction& reconstruction);

/// Applies a table: row r of the result is F_v (and Q_v), (row = component, column = axis) flattened row-major,
/// #rows × (#columns · gdim). Values are #vertices × #columns.
template <class Scalar>
Values<Scalar> apply_stencils(const GradientStencilTable& table, const Values<Scalar>& values);

/// Applies the Hessian weights: #rows × (#columns · num_symmetric(gdim)). Throws Error where the table has none.
template <class Scalar>
Values<Scalar> apply_hessian_stencils(const GradientStencilTable& table, const Values<Scalar>& values);

/// Gradients under a blend (reconstructor `adaptive`), #rows × (#columns · gdim). With F_c and F_k the gradients of
/// `averaging` and of the main table and the edges ê as WeightedEdge has them, the mismatch of a gradient F at v with
/// its neighbours is
///   E(F) = Σ over edges e of |2 (x_j − x_v) |ê| / |e| − (F + F_k,j) ê|²,
/// P = F_k + Σ m êᵀ · damped_inverse (m the mismatches of F_k) is the neighbours' prediction, and
///   F = F_c + w (F_s − F_c),  F_s = F_k + share (P − F_k),
///   w = fitted_weight(E(F_k), E(F_k) − Σ m êᵀ · (P − F_k), E(F_c), 4 Σ |ê|² |F_k|², caution).
template <class Scalar>
Values<Scalar> blended_gradients(const Reconstruction& reconstruction, const Values<Scalar>& values);

/// Appends a row of `from`, with its vertex and what is told of it, to a table of the same kind.
void append_row(const GradientStencilTable& from, Index row, GradientStencilTable& to);

/// Takes the rows from `first` on out of a table.
GradientStencilTable split_rows(GradientStencilTable& table, Index first);

/// The rows of `vertices`, in that order. A reconstruction with a blend must already have exactly these. Throws Error
/// where a vertex has no row.
Reconstruction select_rows(const Reconstruction& reconstruction, std::span<const Index> vertices);

}  // namespace halfgrad
