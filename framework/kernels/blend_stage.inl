// The blend stage (blend_stage.hpp). A source file defines HALFGRAD_SCALAR and HWY_TARGET_INCLUDE, then includes this
// one; Highway includes that source once a target.
#include <hwy/foreach_target.h>
#include <algorithm>

#include "framework/gradient_stencils.hpp"
#include "framework/kernels/blend_stage.hpp"
#include "framework/kernels/fours.inl"

HWY_BEFORE_NAMESPACE();
namespace halfgrad::kernels::HWY_NAMESPACE {

// sum + a · b, lane by lane.
template <class T>
HWY_INLINE Four<T> plus_product(const Four<T>& sum, const Four<T>& a, const Four<T>& b) {
  Four<T> r;
  HALFGRAD_UNROLL
  for (int p = 0; p < Four<T>::num_parts; ++p) r.part[p] = hn::MulAdd(a.part[p], b.part[p], sum.part[p]);
  return r;
}

// Sum of the lanes. Lanes beyond the columns hold zeros.
template <class T>
HWY_INLINE T lane_sum(const Four<T>& four) {
  alignas(32) T lane[4];
  four.store(lane);
  return (lane[0] + lane[1]) + (lane[2] + lane[3]);
}

// Row a of a symmetric matrix, given as its upper triangle, times the columns.
template <int d, class T>
HWY_INLINE Four<T> symmetric_product(const T* matrix, int a, const Four<T>* column) {
  const auto entry = [&](int i, int j) { return matrix[i * d - i * (i - 1) / 2 + (j - i)]; };
  Four<T> sum = column[0] * entry(0, a);
  HALFGRAD_UNROLL
  for (int c = 1; c < d; ++c) sum = sum.plus(column[c], c < a ? entry(c, a) : entry(a, c));
  return sum;
}

template <int d, class T>
void blend_lines(const BlendStage<T>& stage, Index begin, Index end) {
  using F = Four<T>;
  constexpr int length = 4 * (1 + d), symmetric = num_symmetric(d);
  for (Index row = begin; row < end; ++row) {
    const T* const own = stage.fitted + static_cast<Offset>(row) * length;
    const F position = F::load(own);
    F fit[d], moment[d], squares = F::zero();  // moment is −Σ m êᵀ
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
      squares = plus_product(squares, mismatch, mismatch);
    }

    const T* const metric = stage.metrics + static_cast<Offset>(row) * 2 * symmetric;
    T* const line = stage.lines + static_cast<Offset>(row) * length;
    F correction[d], change[d], predicted = squares, averaged = squares, sizes = F::zero();
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) {
      correction[a] = F::zero() - symmetric_product<d>(metric + symmetric, a, moment);
      change[a] = F::load(line + 4 * (1 + a)) - fit[a];
      predicted = plus_product(predicted, correction[a], moment[a]);
      sizes = plus_product(sizes, fit[a], fit[a]);
    }
    T trace = 0;
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) {
      averaged = plus_product(averaged, change[a], symmetric_product<d>(metric, a, change) + moment[a] * T(2));
      trace += metric[a * d - a * (a - 1) / 2];
    }
    const T weight = fitted_weight(lane_sum(squares), lane_sum(predicted), std::max(T(0), lane_sum(averaged)),
                                   4 * trace * lane_sum(sizes), stage.caution[row]);
    position.store(line);
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) {
      const F wanted = correction[a] * stage.prediction_share - change[a];
      ((fit[a] + change[a]).plus(wanted, weight) * stage.scale[static_cast<std::size_t>(a)]).store(line + 4 * (1 + a));
    }
  }
}

#if HWY_TARGET == HWY_AVX3
// The same in three dimensions with a line in one vector, | x | F_1 | F_2 | F_3 |, or along the edges in two.
template <int d>
void blend_lines(const BlendStage<float>& given, Index begin, Index end) requires(d == 3) {
  const BlendStage<float> stage = given;
  constexpr __mmask16 first = 0x000f, rest = 0xfff0;
  // Columns of a matrix, given as its upper triangle, in the last three blocks.
  const __m512i column[3] = {_mm512_setr_epi32(0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2),
                             _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 3, 3, 3, 3, 4, 4, 4, 4),
                             _mm512_setr_epi32(0, 0, 0, 0, 2, 2, 2, 2, 4, 4, 4, 4, 5, 5, 5, 5)};
  const auto product = [&](__m512 matrix, __m512 gradient) HWY_ATTR {
    __m512 sum = _mm512_mul_ps(_mm512_maskz_permutexvar_ps(rest, column[0], matrix),
                               _mm512_shuffle_f32x4(gradient, gradient, 0x55));
    sum = _mm512_fmadd_ps(_mm512_maskz_permutexvar_ps(rest, column[1], matrix),
                          _mm512_shuffle_f32x4(gradient, gradient, 0xaa), sum);
    return _mm512_fmadd_ps(_mm512_maskz_permutexvar_ps(rest, column[2], matrix),
                           _mm512_shuffle_f32x4(gradient, gradient, 0xff), sum);
  };
  const __m512 scale = _mm512_setr_ps(1, 1, 1, 1, stage.scale[0], stage.scale[0], stage.scale[0], stage.scale[0],
                                      stage.scale[1], stage.scale[1], stage.scale[1], stage.scale[1], stage.scale[2],
                                      stage.scale[2], stage.scale[2], stage.scale[2]);
  const __m512 share = _mm512_set1_ps(stage.prediction_share);
  // | Σ m² | −Σ m ê_1 | −Σ m ê_2 | −Σ m ê_3 | of some rows, before what follows from them: a row's chain of operations
  // is longer than what the processor looks ahead.
  constexpr Index rows_ahead = 16;
  HWY_ALIGN float sums_of_rows[16 * rows_ahead];
  const __m256i each_four_low = _mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1),
                each_four_high = _mm256_setr_epi32(2, 2, 2, 2, 3, 3, 3, 3);
  const auto sum_edges = [&](Index row, float* to) HWY_ATTR {
    const float* const own = stage.fitted + 16 * static_cast<Offset>(row);
    const __m256 own_low = _mm256_load_ps(own), own_high = _mm256_load_ps(own + 8);
    const __m256 signed_low = _mm256_mask_sub_ps(own_low, 0x0f, _mm256_setzero_ps(), own_low);
    __m256 low = _mm256_setzero_ps(), high = _mm256_setzero_ps();
    const Index* const last = stage.edge_rows + stage.edge_offsets[row + 1];
    const float* edge = stage.edges + 4 * stage.edge_offsets[row];
    for (const Index* other_row = stage.edge_rows + stage.edge_offsets[row]; other_row != last;
         ++other_row, edge += 4) {
      const float* const other = stage.fitted + 16 * static_cast<Offset>(*other_row);
      const __m256 factors = _mm256_castps128_ps256(_mm_loadu_ps(edge));
      const __m256 factors_low = _mm256_permutevar8x32_ps(factors, each_four_low),
                   factors_high = _mm256_permutevar8x32_ps(factors, each_four_high);
      const __m256 terms =
          _mm256_fmadd_ps(_mm256_add_ps(_mm256_load_ps(other + 8), own_high), factors_high,
                          _mm256_mul_ps(_mm256_add_ps(_mm256_load_ps(other), signed_low), factors_low));
      const __m256 mismatch = _mm256_add_ps(terms, _mm256_permute2f128_ps(terms, terms, 1));
      low = _mm256_fmadd_ps(mismatch, _mm256_blend_ps(factors_low, mismatch, 0x0f), low);
      high = _mm256_fmadd_ps(mismatch, factors_high, high);
    }
    _mm256_store_ps(to, low);
    _mm256_store_ps(to + 8, high);
  };
  for (Index row = begin; row < end; ++row) {
    const Index place = (row - begin) % rows_ahead;
    if (place == 0)
      for (Index r = row; r < std::min(row + rows_ahead, end); ++r) sum_edges(r, sums_of_rows + 16 * (r - row));
    const __m512 sum = _mm512_load_ps(sums_of_rows + 16 * place);
    const __m512 own = _mm512_load_ps(stage.fitted + 16 * static_cast<Offset>(row));
    const __m512 fit = _mm512_maskz_mov_ps(rest, own);

    // Entries 0 … 5 of a vector are the sum Σ êêᵀ, then those of its damped inverse.
    const float* const metric = stage.metrics + 12 * static_cast<Offset>(row);
    const __m512 matrix = _mm512_maskz_loadu_ps(0x003f, metric), inverse = _mm512_maskz_loadu_ps(0x003f, metric + 6);
    float* const line = stage.lines + 16 * static_cast<Offset>(row);
    const __m512 average = _mm512_load_ps(line);
    const __m512 correction = _mm512_sub_ps(_mm512_setzero_ps(), product(inverse, sum));
    const __m512 change = _mm512_maskz_sub_ps(rest, average, own);
    const __m512 squares = _mm512_maskz_mov_ps(first, sum);
    const __m512 predicted = _mm512_maskz_mul_ps(rest, correction, sum);
    const __m512 averaged =
        _mm512_maskz_mul_ps(rest, change, _mm512_fmadd_ps(sum, _mm512_set1_ps(2), product(matrix, change)));
    const __m512 totals = transposed_sum(squares, predicted, averaged, _mm512_mul_ps(fit, fit));
    const __m512 pairs = _mm512_add_ps(totals, _mm512_permute_ps(totals, 0xb1));
    alignas(64) float total[16];
    _mm512_store_ps(total, _mm512_add_ps(pairs, _mm512_permute_ps(pairs, 0x4e)));
    const float weight = fitted_weight(total[0], total[0] + total[4], std::max(0.0f, total[0] + total[8]),
                                       4 * (metric[0] + metric[3] + metric[5]) * total[12], stage.caution[row]);
    const __m512 wanted = _mm512_fmsub_ps(share, correction, change);
    _mm512_store_ps(line, _mm512_mul_ps(_mm512_fmadd_ps(_mm512_set1_ps(weight), wanted, average), scale));
  }
}
#endif

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
