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
// The same in three dimensions with a line in one vector, | x | F_1 | F_2 | F_3 |, so that an edge takes one load and one
// product.
template <int d>
void blend_lines(const BlendStage<float>& given, Index begin, Index end)
  requires(d == 3)
{
  const BlendStage<float> stage = given;
  const __m512i each_four = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
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
  for (Index row = begin; row < end; ++row) {
    const __m512 own = _mm512_load_ps(stage.fitted + 16 * static_cast<Offset>(row));
    const __m512 fit = _mm512_maskz_mov_ps(rest, own);
    const __m512 signed_own = _mm512_mask_sub_ps(own, first, _mm512_setzero_ps(), own);
    // | Σ m² | −Σ m ê_1 | −Σ m ê_2 | −Σ m ê_3 |
    __m512 sums[2] = {_mm512_setzero_ps(), _mm512_setzero_ps()};
    const auto add_edge = [&](Offset e, __m512& sum) HWY_ATTR {
      const __m512 other = _mm512_load_ps(stage.fitted + 16 * static_cast<Offset>(stage.edge_rows[e]));
      const __m512 factors =
          _mm512_permutexvar_ps(each_four, _mm512_castps128_ps512(_mm_loadu_ps(stage.edges + 4 * e)));
      const __m512 terms = _mm512_mul_ps(_mm512_add_ps(other, signed_own), factors);
      const __m512 halves = _mm512_add_ps(terms, _mm512_shuffle_f32x4(terms, terms, 0x4e));
      const __m512 mismatch = _mm512_add_ps(halves, _mm512_shuffle_f32x4(halves, halves, 0xb1));
      sum = _mm512_fmadd_ps(mismatch, _mm512_mask_mov_ps(factors, first, mismatch), sum);
    };
    Offset e = stage.edge_offsets[row];
    const Offset edge_end = stage.edge_offsets[row + 1];
    for (; e + 1 < edge_end; e += 2) {
      add_edge(e, sums[0]);
      add_edge(e + 1, sums[1]);
    }
    if (e < edge_end) add_edge(e, sums[0]);
    const __m512 sum = _mm512_add_ps(sums[0], sums[1]);

    // Entries 0 … 5 of a vector are the sum Σ êêᵀ, then those of its damped inverse.
    const float* const metric = stage.metrics + 12 * static_cast<Offset>(row);
    const __m512 matrix = _mm512_maskz_loadu_ps(0x003f, metric), inverse = _mm512_maskz_loadu_ps(0x003f, metric + 6);
    float* const line = stage.lines + 16 * static_cast<Offset>(row);
    const __m512 average = _mm512_load_ps(line);
    const __m512 correction = _mm512_sub_ps(_mm512_setzero_ps(), product(inverse, sum));
    const __m512 change = _mm512_maskz_sub_ps(rest, average, own);
    const __m512 squares = _mm512_maskz_mov_ps(first, sum);
    const __m512 predicted = _mm512_maskz_mul_ps(rest, correction, sum);
    const __m512 averaged = _mm512_maskz_mul_ps(
        rest, change, _mm512_fmadd_ps(sum, _mm512_set1_ps(2), product(matrix, change)));
    const __m512 totals = transposed_sum(squares, predicted, averaged, _mm512_mul_ps(fit, fit));
    const __m512 pairs = _mm512_add_ps(totals, _mm512_permute_ps(totals, 0xb1));
    alignas(64) float total[16];
    _mm512_store_ps(total, _mm512_add_ps(pairs, _mm512_permute_ps(pairs, 0x4e)));
    const float weight =
        fitted_weight(total[0], total[0] + total[4], std::max(0.0f, total[0] + total[8]),
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
