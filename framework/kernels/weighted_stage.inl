// Points given by their weights (weighted_stage.hpp). A source file defines HALFGRAD_SCALAR and HWY_TARGET_INCLUDE,
// then includes this one; Highway includes that source once a target.
#include <hwy/foreach_target.h>
#include <algorithm>

#include "framework/kernels/fours.inl"
#include "framework/kernels/weighted_stage.hpp"

HWY_BEFORE_NAMESPACE();
namespace halfgrad::kernels::HWY_NAMESPACE {

template <int fours, class T>
void weighted_points(const WeightedStage<T>& given, Index begin, Index end) {
  using F = Four<T>;
  const WeightedStage<T> stage = given;  // a copy, so that stores to the results do not make it be read again
  const int columns = stage.num_columns;
  // Fours are stored whole, and the next overwrites what was stored too much, except at the range's end.
  const Index last_whole = end - (4 + columns - 1) / columns;
  for (Index p = begin; p < end; ++p) {
    const Offset first = stage.first[p], last = stage.first[p + 1];
    const auto line_of = [&](Offset e) { return stage.lines + static_cast<Offset>(stage.nodes[e]) * 4 * fours; };
    // Differences to the first vertex: the digits of values far from zero stay out of the sum.
    const F origin = F::load(line_of(first));
    F sum = F::zero();
    for (Offset e = first; e < last; ++e) {
      const T* const line = line_of(e);
      const T* const a = stage.coefficients + e * fours;
      sum = sum.plus(F::load(line) - origin, a[0]);
      HALFGRAD_UNROLL
      for (int k = 1; k < fours; ++k) sum = sum.plus(F::load(line + 4 * k), a[k]);
    }
    sum = origin + sum;
    T* const out = stage.out + static_cast<Offset>(p) * columns;
    if (HWY_LIKELY(p <= last_whole)) {
      sum.store_unaligned(out);
    } else {
      HWY_ALIGN T row[4];
      sum.store(row);
      std::copy_n(row, columns, out);
    }
  }
}

void weighted_stage(const WeightedStage<HALFGRAD_SCALAR>& stage, Index begin, Index end) {
  switch (stage.num_fours) {
    case 1:
      return weighted_points<1>(stage, begin, end);
    case 2:
      return weighted_points<2>(stage, begin, end);
    case 3:
      return weighted_points<3>(stage, begin, end);
    case 4:
      return weighted_points<4>(stage, begin, end);
    case 6:
      return weighted_points<6>(stage, begin, end);
    case 10:
      return weighted_points<10>(stage, begin, end);
  }
}

}  // namespace halfgrad::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace halfgrad::kernels {
namespace {  // the table of targets
HWY_EXPORT(weighted_stage);
}  // namespace

template <>
void WeightedStage<HALFGRAD_SCALAR>::run(Index begin, Index end) const {
  HWY_DYNAMIC_DISPATCH(weighted_stage)(*this, begin, end);
}

}  // namespace halfgrad::kernels
#endif
