// The blend stage (blend_stage.hpp). A source file defines HALFGRAD_SCALAR and HWY_TARGET_INCLUDE, then includes this
// one; Highway includes that source once a target.
#include <hwy/foreach_target.h>
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

// Sum of the lanes, but not below zero. Lanes beyond the columns hold zeros.
template <class T>
HWY_INLINE T nonnegative_sum(const Four<T>& four) {
  alignas(32) T lane[4];
  four.store(lane);
  const T sum = (lane[0] + lane[1]) + (lane[2] + lane[3]);
  return sum < 0 ? 0 : sum;
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
    const T* const own = stage.probing + static_cast<Offset>(row) * length;
    const F position = F::load(own);
    F probe[d], moment[d], squares = F::zero(), quotients = F::zero();
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) {
      probe[a] = F::load(own + 4 * (1 + a));
      moment[a] = F::zero();
    }
    for (Offset e = stage.edge_offsets[row]; e < stage.edge_offsets[row + 1]; ++e) {
      const T* const other = stage.probing + static_cast<Offset>(stage.edge_rows[e]) * length;
      const T* const edge = stage.edges + e * (1 + d);
      F mismatch = (F::load(other) - position) * edge[0];
      quotients = plus_product(quotients, mismatch, mismatch);
      HALFGRAD_UNROLL
      for (int a = 0; a < d; ++a) mismatch = mismatch.minus(probe[a] + F::load(other + 4 * (1 + a)), edge[1 + a]);
      HALFGRAD_UNROLL
      for (int a = 0; a < d; ++a) moment[a] = moment[a].plus(mismatch, edge[1 + a]);
      squares = plus_product(squares, mismatch, mismatch);
    }

    const T* const metric = stage.metrics + static_cast<Offset>(row) * 2 * symmetric;
    T* const line = stage.lines + static_cast<Offset>(row) * length;
    const T* const average = stage.averaging + static_cast<Offset>(row) * length;
    F prediction[d], of_average[d], of_fit[d];  // what they differ from the probing gradient by
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) {
      prediction[a] = symmetric_product<d>(metric + symmetric, a, moment);
      of_average[a] = F::load(average + 4 * (1 + a)) - probe[a];
      of_fit[a] = F::load(line + 4 * (1 + a)) - probe[a];
    }
    // What a change of the gradient adds to the squares.
    const auto added = [&](const F* change) HWY_ATTR {
      F sum = F::zero();
      HALFGRAD_UNROLL
      for (int a = 0; a < d; ++a)
        sum = plus_product(sum, change[a], symmetric_product<d>(metric, a, change) - moment[a] * T(2));
      return sum;
    };
    const F common = squares * T(2) + added(prediction);
    const T weight = fitted_weight(nonnegative_sum(common.plus(added(of_fit), T(0.5))),
                                   nonnegative_sum(common + added(of_average)), nonnegative_sum(quotients));
    position.store(line);
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) {
      const F fit = of_fit[a].plus(prediction[a] - of_fit[a], stage.prediction_share);
      const F blend = probe[a] + of_average[a].plus(fit - of_average[a], weight);
      (blend * stage.scale[static_cast<std::size_t>(a)]).store(line + 4 * (1 + a));
    }
  }
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
