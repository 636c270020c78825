// Compiled with -ffp-contract=off: which cell wins a tie must not depend on the machine. Highway includes this file
// once for every instruction set.
#include "framework/plane_margins.hpp"

#include "framework/kernels/targets.hpp"
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "framework/plane_margins.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace halfgrad::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <int D>
Index raise(const PlaneTest<D>& test, std::span<const PointRange> ranges, Index* raised) {
  const hn::CappedTag<double, max_lanes> tag;
  using V = hn::Vec<decltype(tag)>;
  constexpr auto lanes = static_cast<Index>(hn::MaxLanes(tag));
  V gradient[D + 1][D], at_first[D + 1], first[D];
  for (int i = 0; i <= D; ++i) {
    at_first[i] = hn::Set(tag, test.planes.at_first[static_cast<std::size_t>(i)]);
    for (int a = 0; a < D; ++a)
      gradient[i][a] = hn::Set(tag, test.planes.gradient[static_cast<std::size_t>(i)][static_cast<std::size_t>(a)]);
  }
  for (int a = 0; a < D; ++a) first[a] = hn::Set(tag, test.planes.first[static_cast<std::size_t>(a)]);
  const V least = hn::Set(tag, test.least);
  Index num_raised = 0;
  for (const PointRange& range : ranges)
    for (Index p = range.begin; p < range.end; p += lanes) {
      V d[D];
      for (int a = 0; a < D; ++a) d[a] = hn::Sub(hn::LoadU(tag, test.x[static_cast<std::size_t>(a)] + p), first[a]);
      V lowest = at_first[0];
      for (int a = 0; a < D; ++a) lowest = hn::Add(lowest, hn::Mul(gradient[0][a], d[a]));
      for (int i = 1; i <= D; ++i) {
        V beta = at_first[i];
        for (int a = 0; a < D; ++a) beta = hn::Add(beta, hn::Mul(gradient[i][a], d[a]));
        lowest = hn::Min(beta, lowest);
      }
      const auto raises = hn::And(hn::Ge(lowest, least), hn::Gt(lowest, hn::LoadU(tag, test.margin + p)));
      if (HWY_LIKELY(hn::AllFalse(tag, raises))) continue;
      // Few points are raised; those past the range belong to others, perhaps to other threads.
      HWY_ALIGN double weights[lanes];
      HWY_ALIGN std::uint8_t bits[8] = {};
      hn::Store(lowest, tag, weights);
      hn::StoreMaskBits(tag, raises, bits);
      for (Index i = 0; i < lanes && p + i < range.end; ++i) {
        if ((bits[0] >> i & 1) == 0) continue;
        test.margin[p + i] = weights[i];
        raised[num_raised++] = p + i;
      }
    }
  return num_raised;
}

Index raise_1(const PlaneTest<1>& test, std::span<const PointRange> ranges, Index* raised) {
  return raise(test, ranges, raised);
}
Index raise_2(const PlaneTest<2>& test, std::span<const PointRange> ranges, Index* raised) {
  return raise(test, ranges, raised);
}
Index raise_3(const PlaneTest<3>& test, std::span<const PointRange> ranges, Index* raised) {
  return raise(test, ranges, raised);
}

}  // namespace halfgrad::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace halfgrad {
namespace {  // the tables of targets
HWY_EXPORT(raise_1);
HWY_EXPORT(raise_2);
HWY_EXPORT(raise_3);
}  // namespace

Index raise_margins(const PlaneTest<1>& test, std::span<const PointRange> ranges, Index* raised) {
  return HWY_DYNAMIC_DISPATCH(raise_1)(test, ranges, raised);
}
Index raise_margins(const PlaneTest<2>& test, std::span<const PointRange> ranges, Index* raised) {
  return HWY_DYNAMIC_DISPATCH(raise_2)(test, ranges, raised);
}
Index raise_margins(const PlaneTest<3>& test, std::span<const PointRange> ranges, Index* raised) {
  return HWY_DYNAMIC_DISPATCH(raise_3)(test, ranges, raised);
}

}  // namespace halfgrad
#endif
