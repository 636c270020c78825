// The columns of a vertex or of a coefficient as vectors. Included once for every instruction set.
#if defined(HALFGRAD_FOURS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HALFGRAD_FOURS_INL
#undef HALFGRAD_FOURS_INL
#else
#define HALFGRAD_FOURS_INL
#endif

#include <hwy/highway.h>

#include <utility>

#include "framework/kernels/cell_polynomial.hpp"

#ifndef HALFGRAD_UNROLL
// Places of coefficients are constants only in unrolled loops.
#define HALFGRAD_UNROLL _Pragma("GCC unroll 32")
#endif

#ifndef HALFGRAD_LAMBDA
// Left alone, a lambda that two functions share is called, with its vectors in memory.
#define HALFGRAD_LAMBDA HWY_ATTR __attribute__((always_inline))
#endif

HWY_BEFORE_NAMESPACE();
namespace halfgrad::kernels::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Calls f with std::integral_constant 0 … count − 1.
template <int count, class Function>
HWY_INLINE void unrolled(Function&& f) {
  [&]<int... i>(std::integer_sequence<int, i...>) HALFGRAD_LAMBDA { (f(std::integral_constant<int, i>()), ...); }
  (std::make_integer_sequence<int, count>());
}

// `size` numbers in one vector, or in several where the target's vectors are shorter.
template <class T, int size>
struct Pack {
  using Tag = hn::CappedTag<T, size>;
  using V = hn::Vec<Tag>;
  static constexpr int lanes = static_cast<int>(hn::MaxLanes(Tag()));
  static constexpr int num_parts = size / lanes;
  V part[num_parts];

  HWY_INLINE static Pack zero() { return all(T(0)); }
  HWY_INLINE static Pack all(T value) {
    Pack r;
    HALFGRAD_UNROLL
    for (int p = 0; p < num_parts; ++p) r.part[p] = hn::Set(Tag(), value);
    return r;
  }
  HWY_INLINE static Pack load(const T* from) {
    Pack r;
    HALFGRAD_UNROLL
    for (int p = 0; p < num_parts; ++p) r.part[p] = hn::Load(Tag(), from + p * lanes);
    return r;
  }
  HWY_INLINE void store(T* to) const {
    HALFGRAD_UNROLL
    for (int p = 0; p < num_parts; ++p) hn::Store(part[p], Tag(), to + p * lanes);
  }
  HWY_INLINE void store_unaligned(T* to) const {
    HALFGRAD_UNROLL
    for (int p = 0; p < num_parts; ++p) hn::StoreU(part[p], Tag(), to + p * lanes);
  }
  // this + other · factor
  HWY_INLINE Pack plus(const Pack& other, const Pack& factor) const {
    Pack r;
    HALFGRAD_UNROLL
    for (int p = 0; p < num_parts; ++p) r.part[p] = hn::MulAdd(other.part[p], factor.part[p], part[p]);
    return r;
  }
  HWY_INLINE Pack plus(const Pack& other, T factor) const { return plus(other, all(factor)); }
  // this − other · factor
  HWY_INLINE Pack minus(const Pack& other, T factor) const {
    Pack r;
    HALFGRAD_UNROLL
    for (int p = 0; p < num_parts; ++p) r.part[p] = hn::NegMulAdd(other.part[p], hn::Set(Tag(), factor), part[p]);
    return r;
  }
  HWY_INLINE Pack operator+(const Pack& other) const {
    Pack r;
    HALFGRAD_UNROLL
    for (int p = 0; p < num_parts; ++p) r.part[p] = hn::Add(part[p], other.part[p]);
    return r;
  }
  HWY_INLINE Pack operator-(const Pack& other) const {
    Pack r;
    HALFGRAD_UNROLL
    for (int p = 0; p < num_parts; ++p) r.part[p] = hn::Sub(part[p], other.part[p]);
    return r;
  }
  HWY_INLINE Pack operator*(T factor) const {
    Pack r;
    HALFGRAD_UNROLL
    for (int p = 0; p < num_parts; ++p) r.part[p] = hn::Mul(part[p], hn::Set(Tag(), factor));
    return r;
  }
};

// The columns of a vertex, padded.
template <class T>
using Four = Pack<T, 4>;

// Σ_a column_a · factor_a.
template <int d, class T>
HWY_INLINE Four<T> product(const Four<T>* column, const T* factor) {
  Four<T> sum = column[0] * factor[0];
  HALFGRAD_UNROLL
  for (int a = 1; a < d; ++a) sum = sum.plus(column[a], factor[a]);
  return sum;
}

#if HWY_TARGET == HWY_AVX3
// The sums of the four blocks of a, b, c and d, in one block each.
HWY_INLINE __m512 transposed_sum(__m512 a, __m512 b, __m512 c, __m512 d) {
  const __m512 ab = _mm512_add_ps(_mm512_shuffle_f32x4(a, b, 0x44), _mm512_shuffle_f32x4(a, b, 0xee));
  const __m512 cd = _mm512_add_ps(_mm512_shuffle_f32x4(c, d, 0x44), _mm512_shuffle_f32x4(c, d, 0xee));
  return _mm512_add_ps(_mm512_shuffle_f32x4(ab, cd, 0x88), _mm512_shuffle_f32x4(ab, cd, 0xdd));
}
#endif

}  // namespace halfgrad::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
