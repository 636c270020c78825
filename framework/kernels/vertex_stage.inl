// Lines of the active vertices (cell_polynomial.hpp). A source file defines HALFGRAD_SCALAR and HWY_TARGET_INCLUDE,
// then includes this one; Highway includes that source once a target.
#include <hwy/foreach_target.h>
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
    for (Offset e = stage.offsets[row]; e < stage.offsets[row + 1]; ++e) {
      const F difference = F::load(stage.positions + 4 * static_cast<Offset>(stage.neighbors[e])) - own;
      const T* weight = stage.weights + e * width;
      HALFGRAD_UNROLL
      for (int k = 0; k < width; ++k) sum[k] = sum[k].plus(difference, weight[k]);
    }
    T* line = stage.lines + static_cast<Offset>(row) * 4 * (1 + width);
    own.store(line);
    HALFGRAD_UNROLL
    for (int k = 0; k < width; ++k) (sum[k] * stage.scale[static_cast<std::size_t>(k)]).store(line + 4 * (1 + k));
  }
}

// The same for three weights in vectors of four blocks: a line is one vector, and so is what an entry adds to it,
//   | 0 | g_1 (x_j − x_v) | g_2 (x_j − x_v) | g_3 (x_j − x_v) |
template <class T>
void vertex_lines_in_blocks(const VertexStage<T>& stage, Index begin, Index end) {
  using B = Blocks<T>;
  const typename B::Tag tag;
  const auto scale = hn::Set(tag, stage.scale[0]);
  const auto add = [&](Offset e, auto own, auto sum) HWY_ATTR {
    const auto difference = hn::Sub(B::duplicate(stage.positions + 4 * static_cast<Offset>(stage.neighbors[e])), own);
    const auto weight = B::template spread<0, 0, 1, 2>(B::duplicate(stage.weights + 3 * e));
    return hn::MulAdd(difference, weight, sum);
  };
  for (Index row = begin; row < end; ++row) {
    const auto own = B::duplicate(stage.positions + 4 * static_cast<Offset>(row));
    auto even = hn::Zero(tag), odd = hn::Zero(tag);
    Offset e = stage.offsets[row];
    const Offset last = stage.offsets[row + 1];
    for (; e + 1 < last; e += 2) {
      even = add(e, own, even);
      odd = add(e + 1, own, odd);
    }
    if (e < last) even = add(e, own, even);
    const auto line = B::template select<1>(own, hn::Mul(hn::Add(even, odd), scale));
    hn::Store(line, tag, stage.lines + 16 * static_cast<Offset>(row));
  }
}

template <class T>
void run_vertex_stage(const VertexStage<T>& stage, Index begin, Index end) {
  switch (stage.num_weights) {
    case 1:
      return vertex_lines<1>(stage, begin, end);
    case 2:
      return vertex_lines<2>(stage, begin, end);
    case 3:
      if constexpr (has_four_blocks<T>)
        return vertex_lines_in_blocks(stage, begin, end);
      else
        return vertex_lines<3>(stage, begin, end);
    case 5:
      return vertex_lines<5>(stage, begin, end);
    case 9:
      return vertex_lines<9>(stage, begin, end);
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
