// Simplices under the rules that take no Hessians. A source file defines HALFGRAD_SCALAR and HWY_TARGET_INCLUDE, then
// includes this one; Highway includes that source once a target.
#include <hwy/foreach_target.h>
#include "framework/kernels/points.inl"

HWY_BEFORE_NAMESPACE();
namespace halfgrad::kernels::HWY_NAMESPACE {

// With β_0 = 1 − Σ β_k and the bulge S_ij = (H_i − H_j)(X_j − X_i) of an edge, a blend is
//   f = Σ_i β_i (x_i + H_i (X − X_i)) = Σ_i β_i x_i + Σ_{i<j} β_i β_j S_ij
//     = x_0 + Σ_k β_k (x_k − x_0 + β_0 S_0k + Σ_{l>k} β_l S_kl).
// Hermite has S_ij + (β_i − β_j) T_ij in place of S_ij, T_ij = x_i − x_j + (H_i + H_j)(X_j − X_i).
// Both are computed once for all cells of a window that share the edge. S does not depend on the direction in which a
// cell runs along it, T changes its sign.

// Vectors of an edge.
template <Recipe recipe>
constexpr int num_edge_vectors = recipe == Recipe::linear    ? 0
                                 : recipe == Recipe::hermite ? 2
                                                             : 1;

// S, or S and T, of a window, spread over lanes.
template <Recipe recipe, int d, class T>
HWY_INLINE void set_up_edges(const PointStage<T>& stage, const Spread<T, d>& spread, Index window, T* vectors) {
  using F = Four<T>;
  constexpr int line_length = 4 * (1 + d);
  for (Offset e = stage.edges.first[window]; e < stage.edges.first[window + 1]; ++e) {
    const T* const a = stage.lines + line_length * static_cast<Offset>(stage.edges.ends[2 * e]);
    const T* const b = stage.lines + line_length * static_cast<Offset>(stage.edges.ends[2 * e + 1]);
    const T* const along = stage.edges.vectors + d * e;
    F s = (F::load(a + 4) - F::load(b + 4)) * along[0];
    HALFGRAD_UNROLL
    for (int k = 1; k < d; ++k) s = s.plus(F::load(a + 4 * (1 + k)) - F::load(b + 4 * (1 + k)), along[k]);
    spread.columns_of(s).store(vectors);
    vectors += spread.size;
    if constexpr (recipe == Recipe::hermite) {
      F t = F::load(a) - F::load(b);
      HALFGRAD_UNROLL
      for (int k = 0; k < d; ++k) t = t.plus(F::load(a + 4 * (1 + k)) + F::load(b + 4 * (1 + k)), along[k]);
      spread.columns_of(t).store(vectors);
      vectors += spread.size;
    }
  }
}

// The points of a run under a recipe whose lines are `line_length` long; recipe linear reads no edges.
template <Recipe recipe, int line_length, int d, class T>
HWY_INLINE void evaluate_run(const PointStage<T>& stage, const Spread<T, d>& spread, Index run, const T* vectors,
                             Index num_whole) {
  using W = Wide<T>;
  constexpr int edges = num_edges(d), stride = num_edge_vectors<recipe> * Spread<T, d>::size;
  const Index* const node = stage.nodes + static_cast<Offset>(run) * (d + 1);
  W x[d + 1], s[edges], t[edges];
  HALFGRAD_UNROLL
  for (int i = 0; i <= d; ++i)
    x[i] = spread.columns_of(Four<T>::load(stage.lines + static_cast<Offset>(node[i]) * line_length));
  HALFGRAD_UNROLL
  for (int k = 1; k <= d; ++k) x[k] = x[k] - x[0];
  if constexpr (recipe != Recipe::linear) {
    const std::uint16_t* const edge = stage.edges.of_run + static_cast<Offset>(run) * edges;
    HALFGRAD_UNROLL
    for (int e = 0; e < edges; ++e) {
      const T* const from = vectors + stride * edge[e];
      s[e] = W::load(from);
      if constexpr (recipe == Recipe::hermite)
        t[e] = W::load(from + spread.size) * ((stage.edges.reversed[run] >> e & 1) != 0 ? T(-1) : T(1));
    }
  }
  evaluate_points<d>(stage, spread, run, num_whole, [&](const W* xi) HALFGRAD_LAMBDA {
    W value = x[0], beta[d + 1];
    beta[0] = W::all(T(1)) - xi[0];
    HALFGRAD_UNROLL
    for (int k = 1; k <= d; ++k) beta[k] = xi[k - 1];
    if constexpr (d > 1) {
      W others = xi[1];
      HALFGRAD_UNROLL
      for (int k = 2; k < d; ++k) others = others + xi[k];
      beta[0] = beta[0] - others;
    }
    HALFGRAD_UNROLL
    for (int k = d; k >= 1; --k) {
      W slope = x[k];
      if constexpr (recipe != Recipe::linear) {
        HALFGRAD_UNROLL
        for (int step = 0; step < d - k + 1; ++step) {
          const int other = step < d - k ? d - step : 0;  // β_0 comes last: it is there last
          const int e = edge_number(d, std::min(k, other), std::max(k, other));
          W bulge = s[e];
          if constexpr (recipe == Recipe::hermite)
            bulge = bulge.plus(t[e], other == 0 ? beta[0] - beta[k] : beta[k] - beta[other]);
          slope = slope.plus(beta[other], bulge);
        }
      }
      value = value.plus(beta[k], slope);
    }
    return value;
  });
}

// Which of `count` edges have a bulge S within the tolerance: a blend differs from linear interpolation by at most
// (1 − 1/n)/2 of the greatest in a cell of n nodes (Binding::correction_bound).
template <int d, class T>
void find_flat_edges(const PointStage<T>& stage, const T* vectors, Offset count, std::uint8_t* flat) {
  // Relative to the tolerance, so that squares of short lengths do not vanish in float. Lanes beyond the columns repeat
  // them, and count for nothing.
  T factor[max_fast_columns];
  for (int c = 0; c < max_fast_columns; ++c)
    factor[c] = c < stage.num_columns ? 1 / (stage.tolerance * 2 * (d + 1) / d) : 0;
  for (Offset e = 0; e < count; ++e, vectors += Spread<T, d>::size) {
    T squared = 0;
    HALFGRAD_UNROLL
    for (int c = 0; c < max_fast_columns; ++c) squared += vectors[c] * factor[c] * (vectors[c] * factor[c]);
    flat[e] = squared <= 1;
  }
}

// Whether a run is linear within the tolerance. A NaN is not, nor is a cell with points outside.
template <int d, class T>
HWY_INLINE bool is_flat(const PointStage<T>& stage, Index run, const std::uint8_t* flat) {
  if (stage.extrapolates != nullptr && stage.extrapolates[run] != 0) return false;
  const std::uint16_t* const edge = stage.edges.of_run + static_cast<Offset>(run) * num_edges(d);
  std::uint8_t all = 1;
  for (int e = 0; e < num_edges(d); ++e) all &= flat[edge[e]];
  return all != 0;
}

template <Recipe recipe, int d, class T>
void evaluate_runs(const PointStage<T>& given, Index begin, Index end) {
  const PointStage<T> stage = given;  // a copy, so that stores to the results do not make its members be read again
  constexpr int line_length = 4 * (1 + num_weights(recipe, d));
  const Spread<T, d> spread(stage.num_columns);
  const Index num_whole = spread.num_whole(stage, end);
  const bool with_tolerance = recipe == Recipe::quadratic && stage.tolerance > 0;
  HWY_ALIGN T vectors[window_size * num_edges(d) * num_edge_vectors<recipe> * spread.size + 1];
  std::uint8_t flat[window_size * num_edges(d)];
  for (Index run = begin; run < end;) {
    const Index window = run / window_size, window_end = std::min(end, (window + 1) * window_size);
    if constexpr (recipe != Recipe::linear) set_up_edges<recipe, d>(stage, spread, window, vectors);
    if (with_tolerance)
      find_flat_edges<d>(stage, vectors, stage.edges.first[window + 1] - stage.edges.first[window], flat);
    for (; run < window_end; ++run) {
      if (HWY_UNLIKELY(with_tolerance) && is_flat<d>(stage, run, flat))
        evaluate_run<Recipe::linear, line_length>(stage, spread, run, vectors, num_whole);
      else
        evaluate_run<recipe, line_length>(stage, spread, run, vectors, num_whole);
    }
  }
}

template <Recipe recipe, class T>
void with_dimension(const PointStage<T>& stage, int dim, Index begin, Index end) {
  switch (dim) {
    case 1:
      return evaluate_runs<recipe, 1>(stage, begin, end);
    case 2:
      return evaluate_runs<recipe, 2>(stage, begin, end);
    case 3:
      return evaluate_runs<recipe, 3>(stage, begin, end);
  }
}

void simplex_points(const PointStage<HALFGRAD_SCALAR>& stage, int dim, Index begin, Index end) {
  switch (stage.recipe) {
    case Recipe::linear:
      return with_dimension<Recipe::linear>(stage, dim, begin, end);
    case Recipe::hermite:
      return with_dimension<Recipe::hermite>(stage, dim, begin, end);
    default:
      return with_dimension<Recipe::quadratic>(stage, dim, begin, end);
  }
}

}  // namespace halfgrad::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace halfgrad::kernels {
namespace {  // the table of targets
HWY_EXPORT(simplex_points);
}  // namespace

template <>
void PointStage<HALFGRAD_SCALAR>::run_simplex(int dim, Index begin, Index end) const {
  HWY_DYNAMIC_DISPATCH(simplex_points)(*this, dim, begin, end);
}

}  // namespace halfgrad::kernels
#endif
