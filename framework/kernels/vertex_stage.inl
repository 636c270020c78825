// Lines of the active vertices (cell_polynomial.hpp). A source file defines HALFGRAD_SCALAR and HWY_TARGET_INCLUDE,
// then includes this one; Highway includes that source once a target.
#include <hwy/foreach_target.h>
#include <algorithm>

#include "framework/kernels/fours.inl"

HWY_BEFORE_NAMESPACE();
namespace halfgrad::kernels::HWY_NAMESPACE {

// Positions are padded with zeros: no lane ever holds a denormal or a foreign number.
template <int width, class T>
void vertex_lines(const VertexStage<T>& stage, Index begin, Index end) {
  using F = Four<T>;
  for (Index row = begin; row < end; ++row) {
    const F own = F::load(stage.positions + 4 * static_cast<Offset>(row));
    F sum[width];
    HALFGRAD_UNROLL
    for (int k = 0; k < width; ++k) sum[k] = F::zero();
    for (Offset group = stage.first_group[row]; group < stage.first_group[row + 1]; ++group) {
      const Index* const neighbor = stage.neighbors + 4 * group;
      const T* const weight = stage.weights + 4 * width * group;
      HALFGRAD_UNROLL
      for (int e = 0; e < 4; ++e) {
        const F difference = F::load(stage.positions + 4 * static_cast<Offset>(neighbor[e])) - own;
        HALFGRAD_UNROLL
        for (int k = 0; k < width; ++k) sum[k] = sum[k].plus(difference, weight[4 * k + e]);
      }
    }
    T* line = stage.lines + static_cast<Offset>(row) * 4 * (1 + width);
    own.store(line);
    HALFGRAD_UNROLL
    for (int k = 0; k < width; ++k) (sum[k] * stage.scale[static_cast<std::size_t>(k)]).store(line + 4 * (1 + k));
  }
}

#if HWY_TARGET == HWY_AVX3
// The same with a group's entries in the four blocks of a vector,
//   | x_a − x_v | x_b − x_v | x_c − x_v | x_d − x_v |
// times their weights k, so that an entry takes half the permutations of one vector an entry. The blocks of the sums
// are added at the end of a row.
template <int width>
void vertex_lines_in_blocks(const VertexStage<float>& given, Index begin, Index end) {
  constexpr int num_fours = 1 + width, num_vectors = (num_fours + 3) / 4,
                last_fours = num_fours - 4 * (num_vectors - 1);
  const VertexStage<float> stage = given;
  HWY_ALIGN float factors[16 * num_vectors] = {1, 1, 1, 1};
  for (int k = 0; k < width; ++k) std::fill_n(factors + 4 * (1 + k), 4, stage.scale[static_cast<std::size_t>(k)]);
  const __m512i each_four = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
  const auto position = [&](Index vertex)
                            HWY_ATTR { return _mm_load_ps(stage.positions + 4 * static_cast<Offset>(vertex)); };
  for (Index row = begin; row < end; ++row) {
    const __m512 own = _mm512_broadcast_f32x4(position(row));
    // sum[0] is the position, which stands in one block.
    __m512 sum[4 * num_vectors];
    HALFGRAD_UNROLL
    for (int k = 1; k < 4 * num_vectors; ++k) sum[k] = _mm512_setzero_ps();
    sum[0] = _mm512_maskz_mov_ps(0xf, own);
    for (Offset group = stage.first_group[row]; group < stage.first_group[row + 1]; ++group) {
      const Index* const neighbor = stage.neighbors + 4 * group;
      const float* const weight = stage.weights + 4 * width * group;
      const __m256 low = _mm256_insertf128_ps(_mm256_castps128_ps256(position(neighbor[0])), position(neighbor[1]), 1);
      const __m256 high = _mm256_insertf128_ps(_mm256_castps128_ps256(position(neighbor[2])), position(neighbor[3]), 1);
      const __m512 difference = _mm512_sub_ps(_mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1), own);
      HALFGRAD_UNROLL
      for (int k = 0; k < width; ++k) {
        const __m512 weights = _mm512_castps128_ps512(_mm_loadu_ps(weight + 4 * k));
        sum[1 + k] = _mm512_fmadd_ps(difference, _mm512_permutexvar_ps(each_four, weights), sum[1 + k]);
      }
    }
    float* const line = stage.lines + static_cast<Offset>(row) * 4 * num_fours;
    HALFGRAD_UNROLL
    for (int v = 0; v < num_vectors; ++v) {
      const __m512 fours = _mm512_mul_ps(transposed_sum(sum[4 * v], sum[4 * v + 1], sum[4 * v + 2], sum[4 * v + 3]),
                                         _mm512_load_ps(factors + 16 * v));
      constexpr auto lanes = [](int fours_stored) { return static_cast<__mmask16>((1u << 4 * fours_stored) - 1); };
      if (v + 1 < num_vectors || last_fours == 4)
        _mm512_storeu_ps(line + 16 * v, fours);
      else
        _mm512_mask_storeu_ps(line + 16 * v, lanes(last_fours), fours);
    }
  }
}
template <int width>
void vertex_lines_in_blocks(const VertexStage<double>& stage, Index begin, Index end) {
  vertex_lines<width>(stage, begin, end);
}
#else
template <int width, class T>
void vertex_lines_in_blocks(const VertexStage<T>& stage, Index begin, Index end) {
  vertex_lines<width>(stage, begin, end);
}
#endif

template <class T>
void run_vertex_stage(const VertexStage<T>& stage, Index begin, Index end) {
  switch (stage.num_weights) {
    case 1:
      return vertex_lines<1>(stage, begin, end);
    case 2:
      return vertex_lines_in_blocks<2>(stage, begin, end);
    case 3:
      return vertex_lines_in_blocks<3>(stage, begin, end);
    case 5:
      return vertex_lines<5>(stage, begin, end);
    case 9:
      return vertex_lines_in_blocks<9>(stage, begin, end);
  }
}

void vertex_stage(const VertexStage<HALFGRAD_SCALAR>& stage, Index begin, Index end) {
  run_vertex_stage(stage, begin, end);
}

}  // namespace halfgrad::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace halfgrad::kernels {
namespace {  // the table of targets
HWY_EXPORT(vertex_stage);
}  // namespace

template <>
void VertexStage<HALFGRAD_SCALAR>::run(Index begin, Index end) const {
  HWY_DYNAMIC_DISPATCH(vertex_stage)(*this, begin, end);
}

}  // namespace halfgrad::kernels
#endif
