// The fast path: on a simplex every interpolant is one polynomial in the barycentric coordinates, set up a cell and a
// frame at a time and evaluated with as many points at once as the machine's vectors have lanes.
//
// Data, all in units of Scalar unless said; "four" is a vector of four that holds the 1 … 3 columns, padded with zeros:
//
//   positions  [vertex]            | x . . . |                          active vertices first, then those that stencils
//   read lines      [active vertex]     | x . . . | H e_1 . | … | H e_d . | (Q_11 . | Q_12 . | …) |
//              H = scale · F, Q likewise; one cache line for d = 3 in
//              float without Q
//   stencils   [entry]             weights g_1 … g_d (q_11, q_12, …) of x_j − x_v; neighbors j
//   nodes      [run][node]         number of the vertex; a run is the points of one cell
//   rest       [run][node][axis]   X_i − X_0
//   local      [run][axis][point]  β_1 … β_d of the run's points, at d · first[run]
//
// Coefficients of a cell come in the order in which Horner's scheme reads them, a four each: for d = 3 and degree 2
//   | 1 | β1 | β1β1 | β1β2 | β1β3 | β2 | β2β2 | β2β3 | β3 | β3β3 |
// They are written for a batch of cells into a buffer of the first cache level before the first of them is read: a
// coefficient read right after its store waits for the store.
#pragma once

#include <array>
#include <cstddef>

#include "framework/types.hpp"

namespace halfgrad::kernels {

/// How a cell's polynomial comes about.
enum class Recipe : std::uint8_t {
  linear,      ///< x
  quadratic,   ///< x, H = αF: the blend with any α ≠ 0
  hermite,     ///< x, H = ½F
  dual_taylor  ///< x, H = ⅔F, ⅙Q
};

constexpr int polynomial_degree(Recipe recipe) {
  return recipe == Recipe::linear ? 1 : recipe == Recipe::quadratic ? 2 : 3;
}

/// Number of weights of a stencil entry.
constexpr int num_weights(Recipe recipe, int dim) {
  if (recipe == Recipe::linear) return 0;
  return recipe == Recipe::dual_taylor ? dim + num_symmetric(dim) : dim;
}

/// Greatest number of columns of values that the fast path takes at once.
inline constexpr int max_fast_columns = 3;
/// Elements by which arrays of local coordinates are longer than their content: vectors are read whole.
inline constexpr int local_padding = 16;

/// Memory aligned to cache lines.
struct alignas(64) CacheLine {
  std::byte bytes[64];
};

/// Lines of the active vertices from stencils.
template <class Scalar>
struct VertexStage {
  int num_weights;  ///< of an entry; as many fours follow x in a line
  const Offset* offsets;
  const Index* neighbors;
  const Scalar* weights;
  std::array<Scalar, 9> scale;  ///< factor of each weight
  const Scalar* positions;
  Scalar* lines;

  /// Rows [begin, end) by the fastest instructions of this machine.
  void run(Index begin, Index end) const;
};

/// Values at points of simplices.
template <class Scalar>
struct PointStage {
  int dim, num_columns;
  Recipe recipe;
  const Index* nodes;
  const Scalar* rest;
  const Index* first;
  const Scalar* local;
  const std::uint8_t* extrapolates;  ///< [run] 1 where a point lies outside its cell; null where none does
  const Scalar* lines;
  Scalar tolerance;  ///< > 0: runs whose quadratic part is bounded by it are linear (recipe quadratic)
  Scalar* out;       ///< [point][column], of the first point of the first run

  /// Runs [begin, end) by the fastest instructions of this machine; writes their points and nothing else.
  void run(Index begin, Index end) const;
};

}  // namespace halfgrad::kernels
