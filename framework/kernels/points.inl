// Evaluation of cells' polynomials at their points. Included once for every instruction set.
#if defined(HALFGRAD_POINTS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HALFGRAD_POINTS_INL
#undef HALFGRAD_POINTS_INL
#else
#define HALFGRAD_POINTS_INL
#endif

#include <algorithm>

#include "framework/kernels/fours.inl"
#include "framework/kernels/monomials.hpp"

HWY_BEFORE_NAMESPACE();
namespace halfgrad::kernels::HWY_NAMESPACE {

// ---- Horner's scheme over a set of monomials that holds all divisors of its members

// Whether the set goes on with exponent `power` of variable k after the exponents `before` of the variables before.
template <class Monomials, int k, int power, int... before>
constexpr bool has_power() {
  Exponents<Monomials::dim> exponents{before...};
  exponents[k] = power;
  return Monomials::place(exponents) >= 0;
}

template <class Monomials, int k, int power, int... before, class D, class V>
HWY_INLINE V horner_from(D tag, const hn::TFromD<D>* c, const V* b);

// The factor of ξ_0^before_0 ξ_1^before_1 …: a polynomial in ξ_k, ξ_(k+1) ….
template <class Monomials, int k, int... before, class D, class V>
HWY_INLINE V horner(D tag, const hn::TFromD<D>* c, const V* b) {
  if constexpr (k == Monomials::dim) {
    constexpr int place = Monomials::place({before...});
    return hn::Set(tag, c[4 * place]);
  } else {
    return horner_from<Monomials, k, 0, before...>(tag, c, b);
  }
}

// Σ_{e ≥ power} ξ_k^(e − power) · (factor of ξ_k^e)
template <class Monomials, int k, int power, int... before, class D, class V>
HWY_INLINE V horner_from(D tag, const hn::TFromD<D>* c, const V* b) {
  const V lowest = horner<Monomials, k + 1, before..., power>(tag, c, b);
  if constexpr (has_power<Monomials, k, power + 1, before...>())
    return hn::MulAdd(b[k], horner_from<Monomials, k, power + 1, before...>(tag, c, b), lowest);
  else
    return lowest;
}

// ---- results

// Lanes of x, y, z to packed rows x y z x y z …
template <class D, class V>
HWY_INLINE void store_three(D tag, const V* v, hn::TFromD<D>* out) {
#if HWY_TARGET == HWY_AVX3
  // Two permutations a vector; the general routine needs about three times as many.
  if constexpr (sizeof(hn::TFromD<D>) == 4) {
    const __m512i xy0 = _mm512_setr_epi32(0, 16, 0, 1, 17, 0, 2, 18, 0, 3, 19, 0, 4, 20, 0, 5);
    const __m512i xy1 = _mm512_setr_epi32(21, 0, 6, 22, 0, 7, 23, 0, 8, 24, 0, 9, 25, 0, 10, 26);
    const __m512i xy2 = _mm512_setr_epi32(0, 11, 27, 0, 12, 28, 0, 13, 29, 0, 14, 30, 0, 15, 31, 0);
    const __m512i z0 = _mm512_setr_epi32(0, 0, 0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0, 4, 0);
    const __m512i z1 = _mm512_setr_epi32(0, 5, 0, 0, 6, 0, 0, 7, 0, 0, 8, 0, 0, 9, 0, 0);
    const __m512i z2 = _mm512_setr_epi32(10, 0, 0, 11, 0, 0, 12, 0, 0, 13, 0, 0, 14, 0, 0, 15);
    const auto merge = [&](__m512i xy, __mmask16 mask, __m512i z) {
      return _mm512_mask_permutexvar_ps(_mm512_permutex2var_ps(v[0].raw, xy, v[1].raw), mask, z, v[2].raw);
    };
    _mm512_storeu_ps(out, merge(xy0, 0x4924, z0));
    _mm512_storeu_ps(out + 16, merge(xy1, 0x2492, z1));
    _mm512_storeu_ps(out + 32, merge(xy2, 0x9249, z2));
  } else {
    const __m512i xy0 = _mm512_setr_epi64(0, 8, 0, 1, 9, 0, 2, 10);
    const __m512i xy1 = _mm512_setr_epi64(0, 3, 11, 0, 4, 12, 0, 5);
    const __m512i xy2 = _mm512_setr_epi64(13, 0, 6, 14, 0, 7, 15, 0);
    const __m512i z0 = _mm512_setr_epi64(0, 0, 0, 0, 0, 1, 0, 0);
    const __m512i z1 = _mm512_setr_epi64(2, 0, 0, 3, 0, 0, 4, 0);
    const __m512i z2 = _mm512_setr_epi64(0, 5, 0, 0, 6, 0, 0, 7);
    const auto merge = [&](__m512i xy, __mmask8 mask, __m512i z) {
      return _mm512_mask_permutexvar_pd(_mm512_permutex2var_pd(v[0].raw, xy, v[1].raw), mask, z, v[2].raw);
    };
    _mm512_storeu_pd(out, merge(xy0, 0x24, z0));
    _mm512_storeu_pd(out + 8, merge(xy1, 0x49, z1));
    _mm512_storeu_pd(out + 16, merge(xy2, 0x92, z2));
  }
#else
  hn::StoreInterleaved3(v[0], v[1], v[2], tag, out);
#endif
}
template <int computed, class D, class V>
HWY_INLINE void store_rows(D tag, const V* v, int columns, hn::TFromD<D>* out) {
  if (computed == 1 || columns == 1) return hn::StoreU(v[0], tag, out);
  if constexpr (computed >= 2)
    if (computed == 2 || columns == 2) return hn::StoreInterleaved2(v[0], v[1], tag, out);
  if constexpr (computed == 3) store_three(tag, v, out);
}

// The points of a batch of runs, whose coefficients stand `stride` apart. Vectors are stored whole: what a chunk's last
// store writes too much, the next chunk overwrites; before `limit` ends the range of the caller, only the points are
// copied. `computed` ≥ columns of the values.
template <class Monomials, int computed, class T>
HWY_INLINE void evaluate_chunks(const PointStage<T>& stage, Index begin, Index end, const T* coefficients, int stride,
                                int columns, const T* limit) {
  constexpr int d = Monomials::dim;
  const hn::ScalableTag<T> tag;
  using V = hn::Vec<decltype(tag)>;
  constexpr int lanes = std::min<int>(chunk_size<T>, static_cast<int>(hn::MaxLanes(tag)));
  const std::uint8_t* const last = stage.chunks + stage.first_chunk[end];
  const T* local = stage.local + static_cast<Offset>(stage.first[begin]) * d;
  T* out = stage.out + static_cast<Offset>(stage.first[begin]) * columns;
  for (const std::uint8_t* chunk = stage.chunks + stage.first_chunk[begin]; chunk != last; ++chunk) {
    const int count = *chunk & (last_chunk - 1);
    for (int p = 0; p < count; p += lanes) {
      V b[d], v[computed];
      HALFGRAD_UNROLL
      for (int k = 0; k < d; ++k) b[k] = hn::LoadU(tag, local + k * count + p);
      HALFGRAD_UNROLL
      for (int c = 0; c < computed; ++c) v[c] = horner<Monomials, 0>(tag, coefficients + c, b);
      T* const row = out + p * columns;
      if (HWY_LIKELY(limit - row >= lanes * columns)) {
        store_rows<computed>(tag, v, columns, row);
      } else {
        HWY_ALIGN T rows[lanes * computed];
        store_rows<computed>(tag, v, columns, rows);
        std::copy_n(rows, std::min(count - p, lanes) * columns, row);
      }
      if constexpr (lanes == chunk_size<T>) break;
    }
    local += d * count;
    out += columns * count;
    coefficients += (*chunk & last_chunk) != 0 ? stride : 0;
  }
}

// ---- runs

constexpr int batch_size = 16;

// Lines of a run's nodes.
template <int num_nodes, int line_length, class T>
HWY_INLINE void find_lines(const PointStage<T>& stage, Index run, const T** line) {
  const Index* node = stage.nodes + static_cast<Offset>(run) * num_nodes;
  HALFGRAD_UNROLL
  for (int i = 0; i < num_nodes; ++i) line[i] = stage.lines + static_cast<Offset>(node[i]) * line_length;
}

// Whether a blend differs from linear interpolation by at most the tolerance everywhere in the cell: by at most
// (1 − 1/n)/2 · |(H_i − H_j)(X_j − X_i)| for the pair of nodes where that is greatest (Binding::correction_bound). A
// NaN is not bounded, nor is a cell with points outside.
template <int num_nodes, int d, class T>
HWY_NOINLINE bool is_within_tolerance(const PointStage<T>& stage, Index run, const T* const* line) {
  if (stage.extrapolates != nullptr && stage.extrapolates[run] != 0) return false;
  const T* rest = stage.rest + static_cast<Offset>(run) * num_nodes * d;
  // Relative to it, so that squares of short lengths do not vanish in float.
  const T per_longest = 1 / (stage.tolerance * 2 * num_nodes / (num_nodes - 1));
  for (int i = 0; i < num_nodes; ++i)
    for (int j = 0; j < i; ++j) {
      T squared = 0;
      for (int c = 0; c < stage.num_columns; ++c) {
        T component = 0;
        for (int k = 0; k < d; ++k)
          component += (line[i][4 * (1 + k) + c] - line[j][4 * (1 + k) + c]) * (rest[j * d + k] - rest[i * d + k]);
        component *= per_longest;
        squared += component * component;
      }
      if (!(squared <= 1)) return false;
    }
  return true;
}

}  // namespace halfgrad::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
