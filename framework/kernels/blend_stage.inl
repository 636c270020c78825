// The blend stage (blend_stage.hpp). A source file defines HALFGRAD_SCALAR and HWY_TARGET_INCLUDE, then includes this
// one; Highway includes that source once a target.
#include <hwy/foreach_target.h>
#include <algorithm>

#include "framework/gradient_stencils.hpp"
#include "framework/kernels/blend_stage.hpp"
#include "framework/kernels/fours.inl"

HWY_BEFORE_NAMESPACE();
namespace halfgrad::kernels::HWY_NAMESPACE {

// Row a of a symmetric matrix, given as its upper triangle, times the columns.
template <int d, class T>
HWY_INLINE Four<T> symmetric_product(const T* matrix, int a, const Four<T>* column) {
  const auto entry = [&](int i, int j) { return matrix[i * d - i * (i - 1) / 2 + (j - i)]; };
  Four<T> sum = column[0] * entry(0, a);
  HALFGRAD_UNROLL
  for (int c = 1; c < d; ++c) sum = sum.plus(column[c], c < a ? entry(c, a) : entry(a, c));
  return sum;
}

// Σ m² and −Σ m ê_a over a row's edges with the mismatches m of its gradient, fours.
template <int d, class T>
HWY_INLINE void sum_edges(const BlendStage<T>& stage, Index row, T* sums) {
  using F = Four<T>;
  constexpr int length = 4 * (1 + d);
  const T* const own = stage.fitted + static_cast<Offset>(row) * length;
  const F position = F::load(own);
  F fit[d], moment[d], squares = F::zero();
  HALFGRAD_UNROLL
  for (int a = 0; a < d; ++a) {
    fit[a] = F::load(own + 4 * (1 + a));
    moment[a] = F::zero();
  }
  for (Offset e = stage.edge_offsets[row]; e < stage.edge_offsets[row + 1]; ++e) {
    const T* const other = stage.fitted + static_cast<Offset>(stage.edge_rows[e]) * length;
    const T* const edge = stage.edges + e * (1 + d);
    F mismatch = (F::load(other) - position) * edge[0];
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) mismatch = mismatch.plus(fit[a] + F::load(other + 4 * (1 + a)), edge[1 + a]);
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) moment[a] = moment[a].plus(mismatch, edge[1 + a]);
    squares = squares.plus(mismatch, mismatch);
  }
  squares.store(sums);
  HALFGRAD_UNROLL
  for (int a = 0; a < d; ++a) moment[a].store(sums + 4 * (1 + a));
}

#if HWY_TARGET == HWY_AVX3
// The same in three dimensions with a line, | x | F_1 | F_2 | F_3 |, in two vectors.
template <int d>
HWY_INLINE void sum_edges(const BlendStage<float>& stage, Index row, float* sums) requires(d == 3) {
  const __m256i each_four_low = _mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1),
                each_four_high = _mm256_setr_epi32(2, 2, 2, 2, 3, 3, 3, 3);
  const float* const own = stage.fitted + 16 * static_cast<Offset>(row);
  const __m256 own_low = _mm256_load_ps(own), own_high = _mm256_load_ps(own + 8);
  const __m256 signed_low = _mm256_mask_sub_ps(own_low, 0x0f, _mm256_setzero_ps(), own_low);
  __m256 low = _mm256_setzero_ps(), high = _mm256_setzero_ps();
  const Index* const last = stage.edge_rows + stage.edge_offsets[row + 1];
  const float* edge = stage.edges + 4 * stage.edge_offsets[row];
  for (const Index* other_row = stage.edge_rows + stage.edge_offsets[row]; other_row != last; ++other_row, edge += 4) {
    const float* const other = stage.fitted + 16 * static_cast<Offset>(*other_row);
    const __m256 factors = _mm256_castps128_ps256(_mm_loadu_ps(edge));
    const __m256 factors_low = _mm256_permutevar8x32_ps(factors, each_four_low),
                 factors_high = _mm256_permutevar8x32_ps(factors, each_four_high);
    const __m256 terms = _mm256_fmadd_ps(_mm256_add_ps(_mm256_load_ps(other + 8), own_high), factors_high,
                                         _mm256_mul_ps(_mm256_add_ps(_mm256_load_ps(other), signed_low), factors_low));
    const __m256 mismatch = _mm256_add_ps(terms, _mm256_permute2f128_ps(terms, terms, 1));
    low = _mm256_fmadd_ps(mismatch, _mm256_blend_ps(factors_low, mismatch, 0x0f), low);
    high = _mm256_fmadd_ps(mismatch, factors_high, high);
  }
  _mm256_store_ps(sums, low);
  _mm256_store_ps(sums + 8, high);
}
#endif

// Sums over the columns of four rows.
template <class T>
HWY_INLINE Four<T> lane_sums(const T (&rows)[4][4]) {
  if constexpr (Four<T>::num_parts == 1) {
    const typename Four<T>::Tag tag;
    typename Four<T>::V a, b, c, d;
    hn::LoadInterleaved4(tag, &rows[0][0], a, b, c, d);
    return {{hn::Add(hn::Add(a, b), hn::Add(c, d))}};
  } else {
    HWY_ALIGN T sums[4];
    for (int r = 0; r < 4; ++r) sums[r] = (rows[r][0] + rows[r][1]) + (rows[r][2] + rows[r][3]);
    return Four<T>::load(sums);
  }
}

// fitted_weight() of four rows.
template <class T>
HWY_INLINE Four<T> fitted_weights(const Four<T>& fitted, const Four<T>& predicted, const Four<T>& averaged,
                                  const Four<T>& squares, const Four<T>& caution) {
  const typename Four<T>::Tag tag;
  constexpr T epsilon = 1000 * std::numeric_limits<T>::epsilon();
  const auto zero = hn::Zero(tag), one = hn::Set(tag, T(1)), most = hn::Set(tag, std::numeric_limits<T>::max()),
             rounding = hn::Set(tag, epsilon * epsilon);
  Four<T> weight;
  HALFGRAD_UNROLL
  for (int p = 0; p < Four<T>::num_parts; ++p) {
    const auto f = fitted.part[p], g = predicted.part[p], c = caution.part[p];
    // Rounding may take a sum of squares below zero.
    const auto measure = hn::MulAdd(rounding, squares.part[p], hn::Max(averaged.part[p], zero));
    const auto squared = hn::Mul(hn::Mul(c, hn::Div(f, measure)), hn::Mul(c, hn::Div(g, measure)));
    const auto blended = hn::Div(one, hn::MulAdd(hn::Mul(squared, squared), squared, one));
    const auto differ = hn::And(hn::Gt(f, zero), hn::Gt(g, zero));
    const auto finite = hn::And(hn::And(hn::Le(f, most), hn::Le(g, most)), hn::Le(averaged.part[p], most));
    weight.part[p] = hn::IfThenElseZero(finite, hn::IfThenElse(differ, blended, one));
  }
  return weight;
}

// Rows [row, row + count), at most four.
template <int d, int count, class T>
HWY_INLINE void blend_rows(const BlendStage<T>& stage, Index row) {
  using F = Four<T>;
  constexpr int length = 4 * (1 + d), symmetric = num_symmetric(d);
  HWY_ALIGN T sums[count * length];
  for (int r = 0; r < count; ++r) sum_edges<d>(stage, row + r, sums + r * length);
  // [quantity][row][column] terms of E(F_k), E_P, E(F_c) and 4 Σ |ê|² |F_k|².
  HWY_ALIGN T terms[4][4][4] = {};
  F correction[count][d], change[count][d];
  HALFGRAD_UNROLL
  for (int r = 0; r < count; ++r) {
    const T* const metric = stage.metrics + static_cast<Offset>(row + r) * 2 * symmetric;
    const T* const own = stage.fitted + static_cast<Offset>(row + r) * length;
    const T* const line = stage.lines + static_cast<Offset>(row + r) * length;
    F fit[d], moment[d], sizes = F::zero();
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) {
      fit[a] = F::load(own + 4 * (1 + a));
      moment[a] = F::load(sums + r * length + 4 * (1 + a));
      change[r][a] = F::load(line + 4 * (1 + a)) - fit[a];
      sizes = sizes.plus(fit[a], fit[a]);
    }
    const F squares = F::load(sums + r * length);
    F predicted = squares, averaged = squares;
    T trace = 0;
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) {
      correction[r][a] = F::zero() - symmetric_product<d>(metric + symmetric, a, moment);
      predicted = predicted.plus(correction[r][a], moment[a]);
      averaged = averaged.plus(change[r][a], symmetric_product<d>(metric, a, change[r]) + moment[a] * T(2));
      trace += metric[a * d - a * (a - 1) / 2];
    }
    squares.store(terms[0][r]);
    predicted.store(terms[1][r]);
    averaged.store(terms[2][r]);
    (sizes * (4 * trace)).store(terms[3][r]);
  }
  HWY_ALIGN T caution[4] = {}, weight[4];
  for (int r = 0; r < count; ++r) caution[r] = stage.caution[row + r];
  fitted_weights(lane_sums<T>(terms[0]), lane_sums<T>(terms[1]), lane_sums<T>(terms[2]), lane_sums<T>(terms[3]),
                 F::load(caution))
      .store(weight);
  HALFGRAD_UNROLL
  for (int r = 0; r < count; ++r) {
    T* const line = stage.lines + static_cast<Offset>(row + r) * length;
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) {
      const F wanted = correction[r][a] * stage.prediction_share - change[r][a];
      (F::load(line + 4 * (1 + a)).plus(wanted, weight[r]) * stage.scale[static_cast<std::size_t>(a)])
          .store(line + 4 * (1 + a));
    }
  }
}

template <int d, class T>
void blend_lines(const BlendStage<T>& given, Index begin, Index end) {
  const BlendStage<T> stage = given;  // a copy, so that stores to the lines do not make it be read again
  // Four rows at a time: one row's chain of operations is longer than what the processor looks ahead.
  Index row = begin;
  for (; row + 4 <= end; row += 4) blend_rows<d, 4>(stage, row);
  for (; row < end; ++row) blend_rows<d, 1>(stage, row);
}

void blend_stage(const BlendStage<HALFGRAD_SCALAR>& stage, Index begin, Index end) {
  switch (stage.dim) {
    case 1:
      return blend_lines<1>(stage, begin, end);
    case 2:
      return blend_lines<2>(stage, begin, end);
    case 3:
      return blend_lines<3>(stage, begin, end);
  }
}

}  // namespace halfgrad::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace halfgrad::kernels {
namespace {  // the table of targets
HWY_EXPORT(blend_stage);
}  // namespace

template <>
void BlendStage<HALFGRAD_SCALAR>::run(Index begin, Index end) const {
  HWY_DYNAMIC_DISPATCH(blend_stage)(*this, begin, end);
}

}  // namespace halfgrad::kernels
#endif
