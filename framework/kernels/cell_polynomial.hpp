// The fast path: on a cell every interpolant is one polynomial in the element's variables (ξ; on a simplex these are
// barycentric coordinates), set up a cell and a frame at a time and evaluated with as many points at once as the
// machine's vectors have lanes. Under the rules of degree three, cells that are no simplices have more coefficients
// than pay (64 on a hexahedron): there each lane is a point, at which the formula is evaluated.
//
// Data, all in units of Scalar unless said; "four" is a vector of four that holds the 1 … 3 columns, padded with zeros:
//
//   positions  [vertex]         | x . . . |        active vertices first, then those that only stencils read
//   lines      [active vertex]  | x . . . | H e_1 . | … | H e_d . | (Q_11 . | Q_12 . | …) |
//                               H = scale · F, Q likewise; a cache line for d = 3 in float without Q
//   stencils   [row][group]     a vertex's entries in groups of four: neighbors j [4]; weights [g_1 … g_d (q_11 …)][4]
//                               of x_j − x_v; the vertex itself with weights of zero fills the last group
//   nodes      [run][node]      number of the vertex; a run is the points of one cell
//   rest       [run][node][axis] X_i − X_0
//   local      [point][axis]    ξ_1 … ξ_d
//   edges      of simplices: each edge once a window of window_size runs
//     first    [window]         its first edge
//     ends     [edge][2]        numbers of the vertices i, j
//     vectors  [edge][axis]     X_j − X_i
//     of_run   [run][pair]      number of the edge in its window, for the pairs of nodes as edge_number counts them
//     reversed [run]            a bit a pair, set where the edge runs from the second node to the first
//
// A vector of results holds the columns of as many points as it has room for, in the order of memory (float, three
// columns, sixteen lanes):   x y z x y z x y z x y z x y z .   It is stored whole, and the next overwrites what it
// wrote too much. Coefficients are spread over lanes the same way once a cell; coordinates are spread once a vector of
// points, by one permutation an axis from one load.
//
// Coefficients of cells that are not evaluated edge by edge stand in the order that monomials.hpp gives, a vector each,
// for a batch of cells in a buffer of the first cache level.
//
// Sources: vertex_stage.inl, simplex.inl, cubic.inl (simplices with Hessians), product.inl and lanes.inl (elements that
// are no simplices), each compiled for float and double by a file of its own and, in it, once for every instruction
// set; fours.inl and points.inl are what they share.
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

/// Number of weights of a stencil entry.
constexpr int num_weights(Recipe recipe, int dim) {
  if (recipe == Recipe::linear) return 0;
  return recipe == Recipe::dual_taylor ? dim + num_symmetric(dim) : dim;
}

/// Greatest number of columns of values that the fast path takes at once.
inline constexpr int max_fast_columns = 3;
/// Greatest dimension of simplices on the fast path.
inline constexpr int max_simplex_dim = 3;
/// Numbers by which arrays that are read a whole vector at a time are longer than their content.
inline constexpr int vector_padding = 16;
/// Number of runs that share the list of their edges.
inline constexpr Index window_size = 128;

/// Number of edges of a simplex.
constexpr int num_edges(int dim) { return dim * (dim + 1) / 2; }
/// Number of the edge between nodes i < j: 01 02 … 0d 12 ….
constexpr int edge_number(int dim, int i, int j) { return i * (2 * dim + 1 - i) / 2 + j - i - 1; }

/// The edges of simplices, a window of runs at a time.
template <class Scalar>
struct Edges {
  const Index* first;
  const Index* ends;
  const Scalar* vectors;
  const std::uint16_t* of_run;
  const std::uint8_t* reversed;
};

/// Memory aligned to cache lines.
struct alignas(64) CacheLine {
  std::byte bytes[64];
};

/// Lines of the active vertices from stencils.
template <class Scalar>
struct VertexStage {
  int num_weights;            ///< of an entry; as many fours follow x in a line
  const Offset* first_group;  ///< [row]
  const Index* neighbors;
  const Scalar* weights;
  std::array<Scalar, 9> scale;  ///< factor of each weight
  const Scalar* positions;
  Scalar* lines;

  /// Rows [begin, end) by the fastest instructions of this machine.
  void run(Index begin, Index end) const;
};

/// Values at points of cells of one element type.
template <class Scalar>
struct PointStage {
  int num_columns;
  Recipe recipe;
  const Index* nodes;
  const Scalar* rest;
  const Index* first;  ///< [run] its first point
  const Scalar* local;
  Edges<Scalar> edges;               ///< of simplices under the recipes quadratic and hermite
  const std::uint8_t* extrapolates;  ///< [run] 1 where a point lies outside its cell; null where none does
  const std::uint8_t* affine;        ///< [run] 1 where x(ξ) is affine; of polynomial elements but simplices
  const Scalar* lines;
  Scalar tolerance;  ///< > 0: simplices whose correction is bounded by it are linear (recipe quadratic)
  Scalar* out;       ///< [point][column], of the first point of the first run

  /// Runs [begin, end) by the fastest instructions of this machine; writes their points and nothing else. E must be
  /// an element for which has_fast_path holds.
  template <Element E>
  void run(Index begin, Index end) const {
    if constexpr (!E::affine) {
      if (recipe == Recipe::linear || recipe == Recipe::quadratic)
        run_product(E::vtk_id, begin, end);
      else
        run_lanes(E::vtk_id, begin, end);
    } else if (recipe == Recipe::dual_taylor)
      run_cubic(E::dim, begin, end);
    else
      run_simplex(E::dim, begin, end);
  }

 private:
  void run_simplex(int dim, Index begin, Index end) const;
  void run_cubic(int dim, Index begin, Index end) const;
  void run_product(int vtk_id, Index begin, Index end) const;
  void run_lanes(int vtk_id, Index begin, Index end) const;
};

/// Whether the fast path serves an element.
template <Element E>
inline constexpr bool has_fast_path = E::affine ? E::dim <= max_simplex_dim : MonomialElement<E>;

}  // namespace halfgrad::kernels
