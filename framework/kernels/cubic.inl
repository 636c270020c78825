// Simplices under dual_taylor. A source file defines HALFGRAD_SCALAR and HWY_TARGET_INCLUDE, then
// includes this one; Highway includes that source once a target.
#include <hwy/foreach_target.h>
#include "framework/kernels/points.inl"

HWY_BEFORE_NAMESPACE();
namespace halfgrad::kernels::HWY_NAMESPACE {

// f = b_0 + Σ_m β_m (b_m − b_0) with the vertices' Taylor polynomials b_i = x_i + H_i d_i + d_iᵀ Q_i d_i,
// d_i = Σ_k β_k E_k − E_i, E_k = X_k − X_0. With p_i,k = H_i E_k, u_i,kk = E_kᵀ Q_i E_k and u_i,kl = 2 E_kᵀ Q_i E_l the
// coefficients are
//   1        x_0
//   ξm       x_m − x_0 + p_0,m − p_m,m + u_m,mm
//   ξmξm     p_m,m − p_0,m + u_0,mm − 2 u_m,mm
//   ξmξk     (p_m,k − p_0,k) + (p_k,m − p_0,m) + u_0,mk − u_m,mk − u_k,mk
//   ξmξmξm   v_m,mm                        with v_m = u_m − u_0
//   ξmξmξk   v_m,mk + v_k,mm
//   ξ1ξ2ξ3   v_1,23 + v_2,13 + v_3,12
template <int d, class T>
HWY_INLINE void set_up_dual_taylor(const Spread<T, d>& spread, const T* const* line, const T* rest, T* coefficients) {
  using F = Four<T>;
  using M = SimplexMonomials<3, d>;
  constexpr int symmetric = num_symmetric(d);
  const auto store = [&](int place, const F& value)
                         HALFGRAD_LAMBDA { spread.columns_of(value).store(coefficients + spread.size * place); };
  // Factors of the entries of Q, of which those off the diagonal count twice already, in u_kl.
  HWY_ALIGN T factor[symmetric][symmetric];
  HALFGRAD_UNROLL
  for (int k = 0, pair = 0; k < d; ++k) {
    HALFGRAD_UNROLL
    for (int l = k; l < d; ++l, ++pair) {
      const T* e = rest + (k + 1) * d;
      const T* f = rest + (l + 1) * d;
      int entry = 0;
      HALFGRAD_UNROLL
      for (int a = 0; a < d; ++a) {
        HALFGRAD_UNROLL
        for (int b = a; b < d; ++b) factor[pair][entry++] = k == l ? e[a] * f[b] : e[a] * f[b] + e[b] * f[a];
      }
    }
  }
  // Place of the pair k ≤ l.
  const auto pair = [](int k, int l) { return k * (2 * d - 1 - k) / 2 + l; };
  F x0 = F::load(line[0]), p0[d], u0[symmetric], slope[d][d], v[d][symmetric], u_own[d][d];
  HALFGRAD_UNROLL
  for (int node = 0; node <= d; ++node) {
    F h[d], q[symmetric];
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) h[a] = F::load(line[node] + 4 * (1 + a));
    HALFGRAD_UNROLL
    for (int a = 0; a < symmetric; ++a) q[a] = F::load(line[node] + 4 * (1 + d + a));
    HALFGRAD_UNROLL
    for (int k = 0; k < d; ++k) {
      const F p = product<d>(h, rest + (k + 1) * d);
      if (node == 0)
        p0[k] = p;
      else
        slope[node - 1][k] = p - p0[k];
    }
    HALFGRAD_UNROLL
    for (int kl = 0; kl < symmetric; ++kl) {
      const F u = product<symmetric>(q, factor[kl]);
      if (node == 0)
        u0[kl] = u;
      else
        v[node - 1][kl] = u - u0[kl];
    }
  }
  store(M::constant, x0);
  HALFGRAD_UNROLL
  for (int m = 0; m < d; ++m) {
    HALFGRAD_UNROLL
    for (int k = 0; k < d; ++k) u_own[m][k] = v[m][pair(std::min(m, k), std::max(m, k))];
    const F u = u_own[m][m] + u0[pair(m, m)], rise = slope[m][m] - u;
    store(M::linear(m), F::load(line[m + 1]) - x0 - rise);
    store(M::quadratic(m, m), rise - u_own[m][m]);
    store(M::cubic(m, m, m), u_own[m][m]);
  }
  HALFGRAD_UNROLL
  for (int m = 0; m < d; ++m) {
    HALFGRAD_UNROLL
    for (int k = m + 1; k < d; ++k) {
      store(M::quadratic(m, k), slope[m][k] + slope[k][m] - u0[pair(m, k)] - u_own[m][k] - u_own[k][m]);
      store(M::cubic(m, m, k), u_own[m][k] + v[k][pair(m, m)]);
      store(M::cubic(m, k, k), u_own[k][m] + v[m][pair(k, k)]);
    }
  }
  if constexpr (d == 3) store(M::cubic(0, 1, 2), v[0][pair(1, 2)] + v[1][pair(0, 2)] + v[2][pair(0, 1)]);
}

template <int d, class T>
void evaluate_cubics(const PointStage<T>& stage, Index begin, Index end) {
  using Monomials = SimplexMonomials<3, d>;
  constexpr int line_length = 4 * (1 + num_weights(Recipe::dual_taylor, d));
  const Spread<T, d> spread(stage.num_columns);
  constexpr int stride = spread.size * Monomials::size;
  HWY_ALIGN T coefficients[batch_size * stride];
  const Index num_whole = spread.num_whole(stage, end);
  for (Index batch = begin; batch < end; batch += batch_size) {
    const Index batch_end = std::min(batch + batch_size, end);
    T* target = coefficients;
    for (Index run = batch; run < batch_end; ++run, target += stride) {
      const T* line[d + 1];
      find_lines<d + 1, line_length>(stage, run, line);
      set_up_dual_taylor<d>(spread, line, stage.rest + static_cast<Offset>(run) * (d + 1) * d, target);
    }
    evaluate_polynomials<Monomials>(stage, spread, batch, batch_end, coefficients, stride, num_whole);
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
