// Simplices under dual_taylor. A source file defines HALFGRAD_SCALAR and HWY_TARGET_INCLUDE, then
// includes this one; Highway includes that source once a target.
#include <hwy/foreach_target.h>
#include "framework/kernels/points.inl"

HWY_BEFORE_NAMESPACE();
namespace halfgrad::kernels::HWY_NAMESPACE {

// With the vertices' Taylor polynomials and E_ik = X_k − X_i
//   f = Σ_i β_i (x_i + Σ_k β_k H_i E_ik + Σ_kl β_k β_l E_ikᵀ Q_i E_il)
//     = Σ_i β_i x_i + Σ_{i<k} β_i β_k (S_ik + β_k q_ik + β_i q_ki) + Σ_{i<k<l} β_i β_k β_l R_ikl
// with S_ik = (H_i − H_k) E_ik and q_ik = E_ikᵀ Q_i E_ik of an edge, both computed once for all cells of a window that
// share it, and, as 2 E_ikᵀ Q_i E_il = q_ik + q_il − E_klᵀ Q_i E_kl,
//   R_ikl = Σ over the edges of the face of (q_ik + q_ki) − Σ over its corners of E_klᵀ Q_i E_kl.

// Vectors of an edge: S, then q of its first and of its second end.
constexpr int num_cubic_vectors = 3;

// Number of the face between nodes i < k < l of a simplex of d ≤ 3 dimensions.
constexpr int face_number(int i, int k, int l) { return i + k + l - 3; }
constexpr int num_faces(int d) { return d == 3 ? 4 : d == 2 ? 1 : 0; }

// Σ_a entry_a · factor_a + sum.
template <int count, class T>
HWY_INLINE Four<T> plus_entries(Four<T> sum, const T* entries, const T* factors) {
  HALFGRAD_UNROLL
  for (int a = 0; a < count; ++a) sum = sum.plus(Four<T>::load(entries + 4 * a), factors[a]);
  return sum;
}

// The vectors of a window's edges, spread over lanes, and the factors e_a e_b of Q's entries in eᵀ Q e.
template <int d, class T>
HWY_INLINE void set_up_cubic_edges(const PointStage<T>& stage, const Spread<T, d>& spread, Index window, T* vectors,
                                   T* factors) {
  using F = Four<T>;
  constexpr int line_length = 4 * (1 + num_weights(Recipe::dual_taylor, d)), symmetric = num_symmetric(d);
  const auto store = [&](const F& value) HWY_ATTR {
    spread.columns_of(value).store(vectors);
    vectors += spread.size;
  };
  for (Offset e = stage.edges.first[window]; e < stage.edges.first[window + 1]; ++e, factors += symmetric) {
    const T* const a = stage.lines + line_length * static_cast<Offset>(stage.edges.ends[2 * e]);
    const T* const b = stage.lines + line_length * static_cast<Offset>(stage.edges.ends[2 * e + 1]);
    const T* const along = stage.edges.vectors + d * e;
    int entry = 0;
    HALFGRAD_UNROLL
    for (int k = 0; k < d; ++k) {
      HALFGRAD_UNROLL
      for (int l = k; l < d; ++l) factors[entry++] = along[k] * along[l];
    }
    F s = (F::load(a + 4) - F::load(b + 4)) * along[0];
    HALFGRAD_UNROLL
    for (int k = 1; k < d; ++k) s = s.plus(F::load(a + 4 * (1 + k)) - F::load(b + 4 * (1 + k)), along[k]);
    store(s);
    store(plus_entries<symmetric>(F::zero(), a + 4 * (1 + d), factors));
    store(plus_entries<symmetric>(F::zero(), b + 4 * (1 + d), factors));
  }
}

template <int d, class T>
HWY_INLINE void evaluate_cubic(const PointStage<T>& stage, const Spread<T, d>& spread, Index run, const T* vectors,
                               const T* factors, Index num_whole) {
  using F = Four<T>;
  using W = Wide<T>;
  constexpr int edges = num_edges(d), faces = num_faces(d), symmetric = num_symmetric(d);
  constexpr int line_length = 4 * (1 + num_weights(Recipe::dual_taylor, d));
  const T* line[d + 1];
  find_lines<d + 1, line_length>(stage, run, line);
  const std::uint16_t* const edge = stage.edges.of_run + static_cast<Offset>(run) * edges;
  W x[d + 1], s[edges], q[edges][2], r[faces + 1];
  HALFGRAD_UNROLL
  for (int i = 0; i <= d; ++i) x[i] = spread.columns_of(F::load(line[i]));
  HALFGRAD_UNROLL
  for (int k = 1; k <= d; ++k) x[k] = x[k] - x[0];
  HALFGRAD_UNROLL
  for (int e = 0; e < edges; ++e) {
    const T* const from = vectors + num_cubic_vectors * spread.size * edge[e];
    const int reversed = stage.edges.reversed[run] >> e & 1;
    s[e] = W::load(from);
    q[e][0] = W::load(from + spread.size * (1 + reversed));
    q[e][1] = W::load(from + spread.size * (2 - reversed));
  }
  HALFGRAD_UNROLL
  for (int i = 0; i <= d; ++i) {
    HALFGRAD_UNROLL
    for (int k = i + 1; k <= d; ++k) {
      HALFGRAD_UNROLL
      for (int l = k + 1; l <= d; ++l) {
        const int kl = edge_number(d, k, l), il = edge_number(d, i, l), ik = edge_number(d, i, k);
        F corners = plus_entries<symmetric>(F::zero(), line[i] + 4 * (1 + d), factors + symmetric * edge[kl]);
        corners = plus_entries<symmetric>(corners, line[k] + 4 * (1 + d), factors + symmetric * edge[il]);
        corners = plus_entries<symmetric>(corners, line[l] + 4 * (1 + d), factors + symmetric * edge[ik]);
        r[face_number(i, k, l)] = (q[kl][0] + q[kl][1]) + (q[il][0] + q[il][1]) + (q[ik][0] + q[ik][1]) -
                                  spread.columns_of(corners);
      }
    }
  }
  evaluate_points<d>(stage, spread, run, num_whole, [&](const W* xi) HWY_ATTR {
    W value = x[0], beta[d + 1];
    beta[0] = W::all(T(1)) - xi[0];
    HALFGRAD_UNROLL
    for (int k = 1; k <= d; ++k) beta[k] = xi[k - 1];
    HALFGRAD_UNROLL
    for (int k = 2; k <= d; ++k) beta[0] = beta[0] - beta[k];
    HALFGRAD_UNROLL
    for (int k = d; k >= 1; --k) {
      W slope = x[k];
      HALFGRAD_UNROLL
      for (int i = k - 1; i >= 0; --i) {
        const int e = edge_number(d, i, k);
        W bulge = s[e].plus(q[e][0], beta[k]).plus(q[e][1], beta[i]);
        HALFGRAD_UNROLL
        for (int l = 0; l < i; ++l) bulge = bulge.plus(r[face_number(l, i, k)], beta[l]);
        slope = slope.plus(beta[i], bulge);
      }
      value = value.plus(beta[k], slope);
    }
    return value;
  });
}

template <int d, class T>
void evaluate_cubics(const PointStage<T>& given, Index begin, Index end) {
  const PointStage<T> stage = given;  // a copy, so that stores to the results do not make its members be read again
  const Spread<T, d> spread(stage.num_columns);
  const Index num_whole = spread.num_whole(stage, end);
  HWY_ALIGN T vectors[window_size * num_edges(d) * num_cubic_vectors * spread.size];
  HWY_ALIGN T factors[window_size * num_edges(d) * num_symmetric(d)];
  for (Index run = begin; run < end;) {
    const Index window = run / window_size, window_end = std::min(end, (window + 1) * window_size);
    set_up_cubic_edges<d>(stage, spread, window, vectors, factors);
    for (; run < window_end; ++run) evaluate_cubic<d>(stage, spread, run, vectors, factors, num_whole);
  }
}

void cubic_points(const PointStage<HALFGRAD_SCALAR>& stage, int dim, Index begin, Index end) {
  switch (dim) {
    case 1:
      return evaluate_cubics<1>(stage, begin, end);
    case 2:
      return evaluate_cubics<2>(stage, begin, end);
    case 3:
      return evaluate_cubics<3>(stage, begin, end);
  }
}

}  // namespace halfgrad::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace halfgrad::kernels {
namespace {  // the table of targets
HWY_EXPORT(cubic_points);
}  // namespace

template <>
void PointStage<HALFGRAD_SCALAR>::run_cubic(int dim, Index begin, Index end) const {
  HWY_DYNAMIC_DISPATCH(cubic_points)(*this, dim, begin, end);
}

}  // namespace halfgrad::kernels
#endif
