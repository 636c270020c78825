// Simplices under the rules of degree one and two. A source file defines HALFGRAD_SCALAR and HWY_TARGET_INCLUDE, then
// includes this one; Highway includes that source once a target.
#include <hwy/foreach_target.h>
#include "framework/kernels/points.inl"

HWY_BEFORE_NAMESPACE();
namespace halfgrad::kernels::HWY_NAMESPACE {

// ---- setup of a cell: coefficients from the lines of its nodes

template <int d, class T>
HWY_INLINE void set_up_linear(const T* const* line, T* coefficients) {
  using M = SimplexMonomials<1, d>;
  if constexpr (has_four_blocks<T> && d == 3) {
    // | x_1 | x_2 | x_3 | x_0 | − | x_0 | x_0 | x_0 | 0 |
    using B = Blocks<T>;
    const auto x0 = B::duplicate(line[0]);
    auto x = B::template select<2>(B::duplicate(line[2]), B::duplicate(line[1]));
    x = B::template select<4>(B::duplicate(line[3]), x);
    hn::Store(B::template select<8>(x0, hn::Sub(x, x0)), typename B::Tag(), coefficients);
  } else {
    using F = Four<T>;
    const F x0 = F::load(line[0]);
    x0.store(coefficients + 4 * M::constant);
    HALFGRAD_UNROLL
    for (int k = 0; k < d; ++k) (F::load(line[k + 1]) - x0).store(coefficients + 4 * M::linear(k));
  }
}

// With R_kl = (H_k − H_0)(X_l − X_0):  f = x_0 + Σ_k β_k (x_k − x_0 − R_kk) + Σ_kl β_k β_l R_kl.
template <int d, class T>
HWY_INLINE void set_up_quadratic(const T* const* line, const T* rest, T* coefficients) {
  using F = Four<T>;
  using M = SimplexMonomials<2, d>;
  const F x0 = F::load(line[0]);
  x0.store(coefficients + 4 * M::constant);
  F first[d], r[d][d];
  HALFGRAD_UNROLL
  for (int a = 0; a < d; ++a) first[a] = F::load(line[0] + 4 * (1 + a));
  HALFGRAD_UNROLL
  for (int k = 0; k < d; ++k) {
    F difference[d];
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) difference[a] = F::load(line[k + 1] + 4 * (1 + a)) - first[a];
    HALFGRAD_UNROLL
    for (int l = 0; l < d; ++l) r[k][l] = product<d>(difference, rest + (l + 1) * d);
    (F::load(line[k + 1]) - x0 - r[k][k]).store(coefficients + 4 * M::linear(k));
    r[k][k].store(coefficients + 4 * M::quadratic(k, k));
  }
  HALFGRAD_UNROLL
  for (int k = 0; k < d; ++k) {
    HALFGRAD_UNROLL
    for (int l = k + 1; l < d; ++l) (r[k][l] + r[l][k]).store(coefficients + 4 * M::quadratic(k, l));
  }
}

// The same for tetrahedra in vectors of four blocks. With P_i = | H_i E_1 | H_i E_2 | H_i E_3 | 0 | and R_k = P_k −
// P_0:
//   | x_1 − x_0 − R_11 | x_2 − x_0 − R_22 | x_3 − x_0 − R_33 | x_0         |
//   | R_11             | R_12 + R_21      | R_13 + R_31      | R_23 + R_32 |
//   | R_11             | R_22             | R_33             | 0           |
template <class T>
HWY_INLINE void set_up_quadratic_in_blocks(const T* const* line, const T* rest, T* coefficients) {
  using B = Blocks<T>;
  using V = typename B::V;
  const typename B::Tag tag;
  const V edges = hn::LoadU(tag, rest);
  const V e0 = B::template spread<3, 6, 9, 0>(edges), e1 = B::template spread<4, 7, 10, 1>(edges),
          e2 = B::template spread<5, 8, 11, 2>(edges);
  V p0 = hn::Mul(B::duplicate(line[0] + 4), e0);
  p0 = hn::MulAdd(B::duplicate(line[0] + 8), e1, p0);
  p0 = hn::MulAdd(B::duplicate(line[0] + 12), e2, p0);
  V r[4];
  HALFGRAD_UNROLL
  for (int k = 1; k < 4; ++k) {
    r[k] = hn::MulSub(B::duplicate(line[k] + 4), e0, p0);
    r[k] = hn::MulAdd(B::duplicate(line[k] + 8), e1, r[k]);
    r[k] = hn::MulAdd(B::duplicate(line[k] + 12), e2, r[k]);
  }
  const V diagonal = B::template select<4>(r[3], B::template select<2>(r[2], r[1]));
  const V x0 = B::duplicate(line[0]);
  V x = B::template select<2>(B::duplicate(line[2]), B::duplicate(line[1]));
  x = B::template select<4>(B::duplicate(line[3]), x);
  const V upper = B::template select<8>(B::template permute<0, 0, 0, 2>(r[2]), r[1]);
  const V lower = B::template select<12>(B::template permute<0, 0, 0, 1>(r[3]), B::template permute<0, 0, 0, 0>(r[2]));
  hn::Store(B::template select<8>(x0, hn::Sub(hn::Sub(x, x0), diagonal)), tag, coefficients);
  hn::Store(hn::IfThenElse(B::template mask<14>(), hn::Add(upper, lower), upper), tag, coefficients + 16);
  hn::Store(diagonal, tag, coefficients + 32);
}

// ---- runs

template <Recipe recipe, int d, int columns, class T>
void evaluate_runs(const PointStage<T>& stage, Index begin, Index end) {
  using Linear = SimplexMonomials<1, d>;
  using Monomials = SimplexMonomials<polynomial_degree(recipe), d>;
  constexpr int stride = 4 * Monomials::size;
  constexpr int line_length = 4 * (1 + num_weights(recipe, d));
  HWY_ALIGN T coefficients[batch_size * stride];
  const T* const limit = stage.out + static_cast<Offset>(stage.first[end]) * columns;
  for (Index batch = begin; batch < end; batch += batch_size) {
    const Index batch_end = std::min(batch + batch_size, end);
    bool all_linear = recipe == Recipe::quadratic && stage.tolerance > 0;
    T* target = coefficients;
    for (Index run = batch; run < batch_end; ++run, target += stride) {
      const T* line[d + 1];
      find_lines<d + 1, line_length>(stage, run, line);
      if constexpr (recipe == Recipe::linear) {
        set_up_linear<d>(line, target);
      } else {
        const T* rest = stage.rest + static_cast<Offset>(run) * (d + 1) * d;
        if constexpr (has_four_blocks<T> && d == 3)
          set_up_quadratic_in_blocks(line, rest, target);
        else
          set_up_quadratic<d>(line, rest, target);
        if (HWY_UNLIKELY(stage.tolerance > 0)) {
          if (is_within_tolerance<d + 1, d>(stage, run, line)) {
            set_up_linear<d>(line, target);
            std::fill(target + 4 * Linear::size, target + stride, T(0));
          } else {
            all_linear = false;
          }
        }
      }
    }
    if (recipe == Recipe::quadratic && all_linear)
      evaluate_chunks<Linear, columns>(stage, batch, batch_end, coefficients, stride, columns, limit);
    else
      evaluate_chunks<Monomials, columns>(stage, batch, batch_end, coefficients, stride, columns, limit);
  }
}

template <Recipe recipe, int d, class T>
void with_columns(const PointStage<T>& stage, Index begin, Index end) {
  switch (stage.num_columns) {
    case 1:
      return evaluate_runs<recipe, d, 1>(stage, begin, end);
    case 2:
      return evaluate_runs<recipe, d, 2>(stage, begin, end);
    case 3:
      return evaluate_runs<recipe, d, 3>(stage, begin, end);
  }
}

template <Recipe recipe, class T>
void with_dimension(const PointStage<T>& stage, int dim, Index begin, Index end) {
  switch (dim) {
    case 1:
      return with_columns<recipe, 1>(stage, begin, end);
    case 2:
      return with_columns<recipe, 2>(stage, begin, end);
    case 3:
      return with_columns<recipe, 3>(stage, begin, end);
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
