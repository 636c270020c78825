// Simplices under the rules of degree one and two. A source file defines HALFGRAD_SCALAR and HWY_TARGET_INCLUDE, then
// includes this one; Highway includes that source once a target.
#include <hwy/foreach_target.h>
#include "framework/kernels/points.inl"

HWY_BEFORE_NAMESPACE();
namespace halfgrad::kernels::HWY_NAMESPACE {

// With β_0 = 1 − Σ β_k and the bulge S_ij = (H_i − H_j)(X_j − X_i) of an edge,
//   f = Σ_i β_i (x_i + H_i (X − X_i)) = Σ_i β_i x_i + Σ_{i<j} β_i β_j S_ij
//     = x_0 + Σ_k β_k (x_k − x_0 + β_0 S_0k + Σ_{l>k} β_l S_kl).
// A bulge is computed once for all cells of a window that share the edge, and it does not depend on the direction in
// which they run along it.

// The bulges of a window, spread over lanes.
template <int d, class T>
HWY_INLINE void set_up_bulges(const PointStage<T>& stage, const Spread<T, d>& spread, Index window, T* bulges) {
  using F = Four<T>;
  constexpr int line_length = 4 * (1 + d);
  for (Index e = stage.edges.first[window]; e < stage.edges.first[window + 1]; ++e, bulges += spread.size) {
    const Offset edge = e;
    const T* const a = stage.lines + line_length * static_cast<Offset>(stage.edges.ends[2 * edge]) + 4;
    const T* const b = stage.lines + line_length * static_cast<Offset>(stage.edges.ends[2 * edge + 1]) + 4;
    const T* const along = stage.edges.vectors + d * edge;
    F bulge = (F::load(a) - F::load(b)) * along[0];
    HALFGRAD_UNROLL
    for (int k = 1; k < d; ++k) bulge = bulge.plus(F::load(a + 4 * k) - F::load(b + 4 * k), along[k]);
    spread.columns_of(bulge).store(bulges);
  }
}

// The points of a run; without bulges, linear interpolation.
template <int degree, int d, class T>
HWY_INLINE void evaluate_run(const PointStage<T>& stage, const Spread<T, d>& spread, Index run, const T* const* line,
                             const T* bulges, const T* limit) {
  using W = Wide<T>;
  const int columns = stage.num_columns;
  W x[d + 1], bulge[num_edges(d)];
  HALFGRAD_UNROLL
  for (int i = 0; i <= d; ++i) x[i] = spread.columns_of(Four<T>::load(line[i]));
  HALFGRAD_UNROLL
  for (int k = 1; k <= d; ++k) x[k] = x[k] - x[0];
  if constexpr (degree == 2) {
    const std::uint16_t* const edge = stage.edges.of_run + static_cast<Offset>(run) * num_edges(d);
    HALFGRAD_UNROLL
    for (int e = 0; e < num_edges(d); ++e) bulge[e] = W::load(bulges + spread.size * edge[e]);
  }
  const T* local = stage.local + static_cast<Offset>(stage.first[run]) * d;
  T* out = stage.out + static_cast<Offset>(stage.first[run]) * columns;
  for (Index left = stage.first[run + 1] - stage.first[run]; left > 0; left -= spread.num_points) {
    W xi[d], rest = W::all(T(1)), value = x[0];
    spread.coordinates(local, xi);
    HALFGRAD_UNROLL
    for (int k = 0; k < d; ++k) rest = rest - xi[k];
    HALFGRAD_UNROLL
    for (int k = d; k >= 1; --k) {
      W slope = x[k];
      if constexpr (degree == 2) {
        HALFGRAD_UNROLL
        for (int l = k + 1; l <= d; ++l) slope = slope.plus(xi[l - 1], bulge[edge_number(d, k, l)]);
        slope = slope.plus(rest, bulge[edge_number(d, 0, k)]);
      }
      value = value.plus(xi[k - 1], slope);
    }
    spread.store(value, left, columns, out, limit);
    local += spread.num_points * d;
    out += spread.num_points * columns;
  }
}

template <Recipe recipe, int d, class T>
void evaluate_runs(const PointStage<T>& stage, Index begin, Index end) {
  constexpr int line_length = 4 * (1 + num_weights(recipe, d));
  const Spread<T, d> spread(stage.num_columns);
  const T* const limit = stage.out + static_cast<Offset>(stage.first[end]) * stage.num_columns;
  constexpr int max_bulges = recipe == Recipe::linear ? 0 : window_size * num_edges(d);
  HWY_ALIGN T bulges[max_bulges * spread.size + 1];
  for (Index run = begin; run < end;) {
    const Index window = run / window_size, window_end = std::min(end, (window + 1) * window_size);
    if constexpr (recipe == Recipe::quadratic) set_up_bulges<d>(stage, spread, window, bulges);
    for (; run < window_end; ++run) {
      const T* line[d + 1];
      find_lines<d + 1, line_length>(stage, run, line);
      if constexpr (recipe == Recipe::quadratic) {
        if (HWY_LIKELY(!(stage.tolerance > 0)) || !is_within_tolerance<d + 1, d>(stage, run, line)) {
          evaluate_run<2>(stage, spread, run, line, bulges, limit);
          continue;
        }
      }
      evaluate_run<1>(stage, spread, run, line, bulges, limit);
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
  if (stage.recipe == Recipe::linear)
    with_dimension<Recipe::linear>(stage, dim, begin, end);
  else
    with_dimension<Recipe::quadratic>(stage, dim, begin, end);
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
