// Simplices under the rules of degree three. A source file defines HALFGRAD_SCALAR and HWY_TARGET_INCLUDE, then
// includes this one; Highway includes that source once a target.
#include <hwy/foreach_target.h>
#include "framework/kernels/points.inl"

HWY_BEFORE_NAMESPACE();
namespace halfgrad::kernels::HWY_NAMESPACE {

// f = Σ β_i x_i + Σ_{i<j} β_i β_j (S_ij + (β_i − β_j) T_ij) with S_ij = (H_i − H_j)(X_j − X_i) and
// T_ij = x_i − x_j + (H_i + H_j)(X_j − X_i), and β_0 = 1 − Σ β_k put in.
template <int d, class T>
HWY_INLINE void set_up_hermite(const Spread<T, d>& spread, const T* const* line, const T* rest, T* coefficients) {
  using F = Four<T>;
  using M = SimplexMonomials<3, d>;
  constexpr int size = M::size;
  F c[size], x[d + 1], h[d + 1][d];
  HALFGRAD_UNROLL
  for (int i = 0; i < size; ++i) c[i] = F::zero();
  HALFGRAD_UNROLL
  for (int i = 0; i <= d; ++i) {
    x[i] = F::load(line[i]);
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) h[i][a] = F::load(line[i] + 4 * (1 + a));
  }
  c[M::constant] = x[0];
  HALFGRAD_UNROLL
  for (int k = 0; k < d; ++k) {
    const F at_first = product<d>(h[0], rest + (k + 1) * d), at_second = product<d>(h[k + 1], rest + (k + 1) * d);
    const F s = at_first - at_second, t = x[0] - x[k + 1] + at_first + at_second, u = s + t, both = u + t;
    c[M::linear(k)] = c[M::linear(k)] + (x[k + 1] - x[0]) + u;
    c[M::quadratic(k, k)] = c[M::quadratic(k, k)] - t;
    HALFGRAD_UNROLL
    for (int l = 0; l < d; ++l) {
      c[M::quadratic(k, l)] = c[M::quadratic(k, l)] - both;
      c[M::cubic(k, k, l)] = c[M::cubic(k, k, l)] + t;
      HALFGRAD_UNROLL
      for (int m = 0; m < d; ++m) c[M::cubic(k, l, m)] = c[M::cubic(k, l, m)] + t;
    }
  }
  HALFGRAD_UNROLL
  for (int k = 0; k < d; ++k) {
    HALFGRAD_UNROLL
    for (int l = k + 1; l < d; ++l) {
      T edge[d];
      HALFGRAD_UNROLL
      for (int a = 0; a < d; ++a) edge[a] = rest[(l + 1) * d + a] - rest[(k + 1) * d + a];
      const F at_first = product<d>(h[k + 1], edge), at_second = product<d>(h[l + 1], edge);
      const F t = x[k + 1] - x[l + 1] + at_first + at_second;
      c[M::quadratic(k, l)] = c[M::quadratic(k, l)] + (at_first - at_second);
      c[M::cubic(k, k, l)] = c[M::cubic(k, k, l)] + t;
      c[M::cubic(k, l, l)] = c[M::cubic(k, l, l)] - t;
    }
  }
  HALFGRAD_UNROLL
  for (int i = 0; i < size; ++i) spread.columns_of(c[i]).store(coefficients + spread.size * i);
}

// f = b_0 + Σ_m β_m (b_m − b_0) with the vertices' Taylor polynomials b_i = x_i + H_i d_i + d_iᵀ Q_i d_i,
// d_i = Σ_k β_k E_k − E_i, E_k = X_k − X_0.
template <int d, class T>
HWY_INLINE void set_up_dual_taylor(const Spread<T, d>& spread, const T* const* line, const T* rest, T* coefficients) {
  using F = Four<T>;
  using M = SimplexMonomials<3, d>;
  constexpr int size = M::size, symmetric = num_symmetric(d);
  // Q : E_k E_lᵀ as coefficients of the entries of Q, of which those off the diagonal count twice already.
  T pair[d][d][symmetric];
  HALFGRAD_UNROLL
  for (int k = 0; k < d; ++k) {
    HALFGRAD_UNROLL
    for (int l = k; l < d; ++l) {
      const T* e = rest + (k + 1) * d;
      const T* f = rest + (l + 1) * d;
      int entry = 0;
      HALFGRAD_UNROLL
      for (int a = 0; a < d; ++a) {
        HALFGRAD_UNROLL
        for (int b = a; b < d; ++b) pair[k][l][entry++] = (e[a] * f[b] + e[b] * f[a]) / 2;
      }
    }
  }
  F c[size];
  HALFGRAD_UNROLL
  for (int i = 0; i < size; ++i) c[i] = F::zero();
  const F x0 = F::load(line[0]);
  F p0[d], w0[d][d];
  HALFGRAD_UNROLL
  for (int node = 0; node <= d; ++node) {
    F h[d], q[symmetric], p[d], w[d][d];
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) h[a] = F::load(line[node] + 4 * (1 + a));
    HALFGRAD_UNROLL
    for (int a = 0; a < symmetric; ++a) q[a] = F::load(line[node] + 4 * (1 + d + a));
    HALFGRAD_UNROLL
    for (int k = 0; k < d; ++k) {
      p[k] = product<d>(h, rest + (k + 1) * d);
      HALFGRAD_UNROLL
      for (int l = k; l < d; ++l) w[k][l] = w[l][k] = product<symmetric>(q, pair[k][l]);
    }
    if (node == 0) {
      c[M::constant] = x0;
      HALFGRAD_UNROLL
      for (int k = 0; k < d; ++k) {
        p0[k] = p[k];
        c[M::linear(k)] = p[k] - x0;
        HALFGRAD_UNROLL
        for (int l = 0; l < d; ++l) {
          w0[k][l] = w[k][l];
          c[M::quadratic(k, l)] = c[M::quadratic(k, l)] + w[k][l];
        }
      }
      continue;
    }
    const int m = node - 1;
    c[M::linear(m)] = c[M::linear(m)] + (F::load(line[node]) - p[m] + w[m][m]);
    HALFGRAD_UNROLL
    for (int k = 0; k < d; ++k) {
      c[M::quadratic(m, k)] = c[M::quadratic(m, k)] + (p[k] - w[m][k] - w[m][k] - p0[k]);
      HALFGRAD_UNROLL
      for (int l = 0; l < d; ++l) c[M::cubic(m, k, l)] = c[M::cubic(m, k, l)] + (w[k][l] - w0[k][l]);
    }
  }
  HALFGRAD_UNROLL
  for (int i = 0; i < size; ++i) spread.columns_of(c[i]).store(coefficients + spread.size * i);
}

template <Recipe recipe, int d, class T>
void evaluate_cubics(const PointStage<T>& stage, Index begin, Index end) {
  using Monomials = SimplexMonomials<3, d>;
  constexpr int line_length = 4 * (1 + num_weights(recipe, d));
  const Spread<T, d> spread(stage.num_columns);
  constexpr int stride = spread.size * Monomials::size;
  HWY_ALIGN T coefficients[batch_size * stride];
  const T* const limit = stage.out + static_cast<Offset>(stage.first[end]) * stage.num_columns;
  for (Index batch = begin; batch < end; batch += batch_size) {
    const Index batch_end = std::min(batch + batch_size, end);
    T* target = coefficients;
    for (Index run = batch; run < batch_end; ++run, target += stride) {
      const T* line[d + 1];
      find_lines<d + 1, line_length>(stage, run, line);
      const T* rest = stage.rest + static_cast<Offset>(run) * (d + 1) * d;
      if constexpr (recipe == Recipe::hermite)
        set_up_hermite<d>(spread, line, rest, target);
      else
        set_up_dual_taylor<d>(spread, line, rest, target);
    }
    evaluate_polynomials<Monomials>(stage, spread, batch, batch_end, coefficients, stride, limit);
  }
}

template <Recipe recipe, class T>
void with_dimension(const PointStage<T>& stage, int dim, Index begin, Index end) {
  switch (dim) {
    case 1:
      return evaluate_cubics<recipe, 1>(stage, begin, end);
    case 2:
      return evaluate_cubics<recipe, 2>(stage, begin, end);
    case 3:
      return evaluate_cubics<recipe, 3>(stage, begin, end);
  }
}

void cubic_points(const PointStage<HALFGRAD_SCALAR>& stage, int dim, Index begin, Index end) {
  if (stage.recipe == Recipe::hermite)
    with_dimension<Recipe::hermite>(stage, dim, begin, end);
  else
    with_dimension<Recipe::dual_taylor>(stage, dim, begin, end);
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
