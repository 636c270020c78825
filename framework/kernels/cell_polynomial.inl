// The kernels of cell_polynomial.hpp. Each scalar has a source file that defines HALFGRAD_SCALAR and
// HWY_TARGET_INCLUDE, then includes this one; Highway includes that source once a target.
#include "framework/kernels/cell_polynomial.hpp"

#include <algorithm>

// One target for each width of vectors; sizeless vectors (SVE, RVV) cannot be members, as `Four` has them.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// What does not depend on the target.
#ifndef HALFGRAD_CELL_POLYNOMIAL_LAYOUT
#define HALFGRAD_CELL_POLYNOMIAL_LAYOUT
// Places of coefficients are constants only in unrolled loops.
#define HALFGRAD_UNROLL _Pragma("GCC unroll 32")
namespace halfgrad::kernels {

// Coefficients of a polynomial of some degree in v variables, in Horner's order.
constexpr int num_coefficients(int degree, int num_variables) {
  int count = 1;
  if (degree > 0)
    for (int k = 0; k < num_variables; ++k) count += num_coefficients(degree - 1, num_variables - k);
  return count;
}

// Place of the monomial β_k, β_k β_l, β_k β_l β_m with k ≤ l ≤ m, in `degree` and `dim` variables.
constexpr int place(int degree, int dim, int k, int l = -1, int m = -1, int start = 0) {
  int result = 1;
  for (int j = start; j < k; ++j) result += num_coefficients(degree - 1, dim - j);
  return l < 0 ? result : result + place(degree - 1, dim, l, m, -1, k);
}

// All places, in any order of the factors.
template <int degree, int d>
struct PlaceTable {
  int linear[d] = {}, quadratic[d][d] = {}, cubic[d][d][d] = {};
  constexpr PlaceTable() {
    for (int k = 0; k < d; ++k) {
      linear[k] = place(degree, d, k);
      for (int l = 0; l < d; ++l) {
        if (degree >= 2) quadratic[k][l] = place(degree, d, std::min(k, l), std::max(k, l));
        for (int m = 0; m < d && degree >= 3; ++m) {
          const int low = std::min({k, l, m}), high = std::max({k, l, m});
          cubic[k][l][m] = place(degree, d, low, k + l + m - low - high, high);
        }
      }
    }
  }
};
template <int degree, int d>
inline constexpr PlaceTable<degree, d> places;

}  // namespace halfgrad::kernels
#endif

HWY_BEFORE_NAMESPACE();
namespace halfgrad::kernels::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// The columns of a vertex, in one vector where the target has vectors of four.
template <class T>
struct Four {
  using Tag = hn::CappedTag<T, 4>;
  using V = hn::Vec<Tag>;
  static constexpr int lanes = static_cast<int>(hn::MaxLanes(Tag()));
  static constexpr int num_parts = 4 / lanes;
  V part[num_parts];

  HWY_INLINE static Four zero() {
    Four r;
    HALFGRAD_UNROLL
    for (int p = 0; p < num_parts; ++p) r.part[p] = hn::Zero(Tag());
    return r;
  }
  HWY_INLINE static Four load(const T* from) {
    Four r;
    HALFGRAD_UNROLL
    for (int p = 0; p < num_parts; ++p) r.part[p] = hn::Load(Tag(), from + p * lanes);
    return r;
  }
  HWY_INLINE void store(T* to) const {
    HALFGRAD_UNROLL
    for (int p = 0; p < num_parts; ++p) hn::Store(part[p], Tag(), to + p * lanes);
  }
  // this + other · factor
  HWY_INLINE Four plus(const Four& other, T factor) const {
    Four r;
    HALFGRAD_UNROLL
    for (int p = 0; p < num_parts; ++p) r.part[p] = hn::MulAdd(other.part[p], hn::Set(Tag(), factor), part[p]);
    return r;
  }
  HWY_INLINE Four operator+(const Four& other) const {
    Four r;
    HALFGRAD_UNROLL
    for (int p = 0; p < num_parts; ++p) r.part[p] = hn::Add(part[p], other.part[p]);
    return r;
  }
  HWY_INLINE Four operator-(const Four& other) const {
    Four r;
    HALFGRAD_UNROLL
    for (int p = 0; p < num_parts; ++p) r.part[p] = hn::Sub(part[p], other.part[p]);
    return r;
  }
  HWY_INLINE Four operator*(T factor) const {
    Four r;
    HALFGRAD_UNROLL
    for (int p = 0; p < num_parts; ++p) r.part[p] = hn::Mul(part[p], hn::Set(Tag(), factor));
    return r;
  }
};

// ---- vertex stage

template <int width, class T>
void vertex_lines(const VertexStage<T>& stage, Index begin, Index end) {
  using F = Four<T>;
  for (Index row = begin; row < end; ++row) {
    const F own = F::load(stage.positions + 4 * static_cast<Offset>(row));
    F sum[width];
    HALFGRAD_UNROLL
    for (int k = 0; k < width; ++k) sum[k] = F::zero();
    // Positions are padded with zeros: no lane ever holds a denormal or a foreign number.
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

template <class T>
void run_vertex_stage(const VertexStage<T>& stage, Index begin, Index end) {
  switch (stage.num_weights) {
    case 1:
      return vertex_lines<1>(stage, begin, end);
    case 2:
      return vertex_lines<2>(stage, begin, end);
    case 3:
      return vertex_lines<3>(stage, begin, end);
    case 5:
      return vertex_lines<5>(stage, begin, end);
    case 9:
      return vertex_lines<9>(stage, begin, end);
  }
}

// ---- setup of a cell: coefficients from the lines of its nodes

template <int d, class T>
HWY_INLINE void set_up_linear(const T* const* line, T* coefficients) {
  using F = Four<T>;
  constexpr const auto& at = places<1, d>;
  const F x0 = F::load(line[0]);
  x0.store(coefficients);
  HALFGRAD_UNROLL
  for (int k = 0; k < d; ++k) (F::load(line[k + 1]) - x0).store(coefficients + 4 * at.linear[k]);
}

// Σ_a column_a · factor_a.
template <int d, class T>
HWY_INLINE Four<T> product(const Four<T>* column, const T* factor) {
  Four<T> sum = column[0] * factor[0];
  HALFGRAD_UNROLL
  for (int a = 1; a < d; ++a) sum = sum.plus(column[a], factor[a]);
  return sum;
}

// With R_kl = (H_k − H_0)(X_l − X_0):  f = x_0 + Σ_k β_k (x_k − x_0 − R_kk) + Σ_kl β_k β_l R_kl.
template <int d, class T>
HWY_INLINE void set_up_quadratic(const T* const* line, const T* rest, T* coefficients) {
  using F = Four<T>;
  constexpr const auto& at = places<2, d>;
  const F x0 = F::load(line[0]);
  x0.store(coefficients);
  F first[d], r[d][d];
  HALFGRAD_UNROLL
  for (int a = 0; a < d; ++a) first[a] = F::load(line[0] + 4 * (1 + a));
  HALFGRAD_UNROLL
  for (int k = 0; k < d; ++k) {
    F difference[d];
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) difference[a] = F::load(line[k + 1] + 4 * (1 + a)) - first[a];
    HALFGRAD_UNROLL
    for (int l = 0; l < d; ++l) r[k][l] = product<d>(difference, rest + (l + 1) * d);
    (F::load(line[k + 1]) - x0 - r[k][k]).store(coefficients + 4 * at.linear[k]);
    r[k][k].store(coefficients + 4 * at.quadratic[k][k]);
  }
  HALFGRAD_UNROLL
  for (int k = 0; k < d; ++k) {
    HALFGRAD_UNROLL
    for (int l = k + 1; l < d; ++l) (r[k][l] + r[l][k]).store(coefficients + 4 * at.quadratic[k][l]);
  }
}

// f = Σ β_i x_i + Σ_{i<j} β_i β_j (S_ij + (β_i − β_j) T_ij) with S_ij = (H_i − H_j)(X_j − X_i) and
// T_ij = x_i − x_j + (H_i + H_j)(X_j − X_i), and β_0 = 1 − Σ β_k put in.
template <int d, class T>
HWY_INLINE void set_up_hermite(const T* const* line, const T* rest, T* coefficients) {
  using F = Four<T>;
  constexpr const auto& at = places<3, d>;
  constexpr int size = num_coefficients(3, d);
  F c[size], x[d + 1], h[d + 1][d];
  HALFGRAD_UNROLL
  for (int i = 0; i < size; ++i) c[i] = F::zero();
  HALFGRAD_UNROLL
  for (int i = 0; i <= d; ++i) {
    x[i] = F::load(line[i]);
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) h[i][a] = F::load(line[i] + 4 * (1 + a));
  }
  c[0] = x[0];
  HALFGRAD_UNROLL
  for (int k = 0; k < d; ++k) {
    const F at_first = product<d>(h[0], rest + (k + 1) * d), at_second = product<d>(h[k + 1], rest + (k + 1) * d);
    const F s = at_first - at_second, t = x[0] - x[k + 1] + at_first + at_second, u = s + t, both = u + t;
    c[at.linear[k]] = c[at.linear[k]] + (x[k + 1] - x[0]) + u;
    c[at.quadratic[k][k]] = c[at.quadratic[k][k]] - t;
    HALFGRAD_UNROLL
    for (int l = 0; l < d; ++l) {
      c[at.quadratic[k][l]] = c[at.quadratic[k][l]] - both;
      c[at.cubic[k][k][l]] = c[at.cubic[k][k][l]] + t;
      HALFGRAD_UNROLL
      for (int m = 0; m < d; ++m) c[at.cubic[k][l][m]] = c[at.cubic[k][l][m]] + t;
    }
  }
  HALFGRAD_UNROLL
  for (int k = 0; k < d; ++k) {
    HALFGRAD_UNROLL
    for (int l = k + 1; l < d; ++l) {
      T edge[d];
      HALFGRAD_UNROLL
      for (int a = 0; a < d; ++a) edge[a] = rest[(l + 1) * d + a] - rest[(k + 1) * d + a];
      const F at_first = product<d>(h[k + 1], edge), at_second = product<d>(h[l + 1], edge);
      const F t = x[k + 1] - x[l + 1] + at_first + at_second;
      c[at.quadratic[k][l]] = c[at.quadratic[k][l]] + (at_first - at_second);
      c[at.cubic[k][k][l]] = c[at.cubic[k][k][l]] + t;
      c[at.cubic[k][l][l]] = c[at.cubic[k][l][l]] - t;
    }
  }
  HALFGRAD_UNROLL
  for (int i = 0; i < size; ++i) c[i].store(coefficients + 4 * i);
}

// f = b_0 + Σ_m β_m (b_m − b_0) with the vertices' Taylor polynomials b_i = x_i + H_i d_i + d_iᵀ Q_i d_i,
// d_i = Σ_k β_k E_k − E_i, E_k = X_k − X_0.
template <int d, class T>
HWY_INLINE void set_up_dual_taylor(const T* const* line, const T* rest, T* coefficients) {
  using F = Four<T>;
  constexpr const auto& at = places<3, d>;
  constexpr int size = num_coefficients(3, d), symmetric = num_symmetric(d);
  // Q : E_k E_lᵀ as coefficients of the entries of Q, of which those off the diagonal count twice already.
  T pair[d][d][symmetric];
  HALFGRAD_UNROLL
  for (int k = 0; k < d; ++k) {
    HALFGRAD_UNROLL
    for (int l = k; l < d; ++l) {
      const T* e = rest + (k + 1) * d;
      const T* f = rest + (l + 1) * d;
      int entry = 0;
      HALFGRAD_UNROLL
      for (int a = 0; a < d; ++a) {
        HALFGRAD_UNROLL
        for (int b = a; b < d; ++b) pair[k][l][entry++] = (e[a] * f[b] + e[b] * f[a]) / 2;
      }
    }
  }
  F c[size];
  HALFGRAD_UNROLL
  for (int i = 0; i < size; ++i) c[i] = F::zero();
  const F x0 = F::load(line[0]);
  F p0[d], w0[d][d];
  HALFGRAD_UNROLL
  for (int node = 0; node <= d; ++node) {
    F h[d], q[symmetric], p[d], w[d][d];
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) h[a] = F::load(line[node] + 4 * (1 + a));
    HALFGRAD_UNROLL
    for (int a = 0; a < symmetric; ++a) q[a] = F::load(line[node] + 4 * (1 + d + a));
    HALFGRAD_UNROLL
    for (int k = 0; k < d; ++k) {
      p[k] = product<d>(h, rest + (k + 1) * d);
      HALFGRAD_UNROLL
      for (int l = k; l < d; ++l) w[k][l] = w[l][k] = product<symmetric>(q, pair[k][l]);
    }
    if (node == 0) {
      c[0] = x0;
      HALFGRAD_UNROLL
      for (int k = 0; k < d; ++k) {
        p0[k] = p[k];
        c[at.linear[k]] = p[k] - x0;
        HALFGRAD_UNROLL
        for (int l = 0; l < d; ++l) {
          w0[k][l] = w[k][l];
          c[at.quadratic[k][l]] = c[at.quadratic[k][l]] + w[k][l];
        }
      }
      continue;
    }
    const int m = node - 1;
    c[at.linear[m]] = c[at.linear[m]] + (F::load(line[node]) - p[m] + w[m][m]);
    HALFGRAD_UNROLL
    for (int k = 0; k < d; ++k) {
      c[at.quadratic[m][k]] = c[at.quadratic[m][k]] + (p[k] - w[m][k] - w[m][k] - p0[k]);
      HALFGRAD_UNROLL
      for (int l = 0; l < d; ++l) c[at.cubic[m][k][l]] = c[at.cubic[m][k][l]] + (w[k][l] - w0[k][l]);
    }
  }
  HALFGRAD_UNROLL
  for (int i = 0; i < size; ++i) c[i].store(coefficients + 4 * i);
}

// Whether the quadratic part stays within `tolerance` in the cell: it is at most (1 − 1/n)/2 · |(H_i − H_j)(X_j − X_i)|
// for the edge where that is greatest. The coefficients hold −Q_kk for the edges at node 0, Q_kl − Q_kk − Q_ll for the
// others. A NaN is not bounded.
template <int d, class T>
HWY_NOINLINE bool is_within(T tolerance, const T* coefficients, int num_columns) {
  constexpr const auto& at = places<2, d>;
  const T longest = tolerance * 2 * (d + 1) / d;
  for (int k = 0; k < d; ++k)
    for (int l = k; l < d; ++l) {
      T squared = 0;
      for (int c = 0; c < num_columns; ++c) {
        T edge = coefficients[4 * at.quadratic[k][l] + c];
        if (l != k) edge -= coefficients[4 * at.quadratic[k][k] + c] + coefficients[4 * at.quadratic[l][l] + c];
        squared += edge * edge;
      }
      if (!(squared <= longest * longest)) return false;
    }
  return true;
}

// ---- evaluation of a run

// Σ_{l ≥ k} β_l p_l(β_l …) + constant, all coefficients in a row from `c`.
template <int degree, int d, int k, class D, class V>
HWY_INLINE V horner(D tag, const hn::TFromD<D>* c, const V* b);

template <int degree, int d, int l, class D, class V>
HWY_INLINE V horner_terms(D tag, const hn::TFromD<D>* c, const V* b, V sum) {
  if constexpr (l < d) {
    const V factor = horner<degree - 1, d, l>(tag, c, b);
    return horner_terms<degree, d, l + 1>(tag, c + 4 * num_coefficients(degree - 1, d - l), b,
                                          hn::MulAdd(b[l], factor, sum));
  } else {
    return sum;
  }
}

template <int degree, int d, int k, class D, class V>
HWY_INLINE V horner(D tag, const hn::TFromD<D>* c, const V* b) {
  const V constant = hn::Set(tag, *c);
  if constexpr (degree == 0)
    return constant;
  else
    return horner_terms<degree, d, k>(tag, c + 4, b, constant);
}

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

// Vectors are stored whole: what a run's last store writes too much, the next run overwrites; before `limit` ends the
// range of the caller, only the points are copied. `computed` ≥ columns of the values.
template <int degree, int d, int computed, class T>
HWY_INLINE void evaluate_run(const T* coefficients, const T* local, Index count, int columns, T* out, const T* limit) {
  const hn::ScalableTag<T> tag;
  using V = hn::Vec<decltype(tag)>;
  constexpr int lanes = static_cast<int>(hn::MaxLanes(tag));
  for (Index p = 0; p < count; p += lanes, out += lanes * columns) {
    V b[d], v[computed];
    HALFGRAD_UNROLL
    for (int k = 0; k < d; ++k) b[k] = hn::LoadU(tag, local + static_cast<Offset>(k) * count + p);
    for (int c = 0; c < computed; ++c) v[c] = horner<degree, d, 0>(tag, coefficients + c, b);
    if (HWY_LIKELY(limit - out >= lanes * columns)) {
      store_rows<computed>(tag, v, columns, out);
    } else {
      HWY_ALIGN T last[lanes * computed];
      store_rows<computed>(tag, v, columns, last);
      std::copy_n(last, std::min(count - p, lanes) * columns, out);
    }
  }
}

constexpr int batch_size = 16;

template <Recipe recipe, int d, int computed, class T>
void evaluate_runs(const PointStage<T>& stage, Index begin, Index end) {
  const int columns = polynomial_degree(recipe) < 3 ? computed : stage.num_columns;
  constexpr int degree = polynomial_degree(recipe);
  constexpr int stride = 4 * num_coefficients(degree, d);
  constexpr Offset line_length = 4 * (1 + num_weights(recipe, d));
  HWY_ALIGN T coefficients[batch_size * stride];
  bool is_linear[batch_size] = {};
  const T* const limit = stage.out + static_cast<Offset>(stage.first[end]) * columns;
  for (Index batch = begin; batch < end; batch += batch_size) {
    const Index batch_end = std::min(batch + batch_size, end);
    for (Index run = batch; run < batch_end; ++run) {
      const T* line[d + 1];
      HALFGRAD_UNROLL
      for (int i = 0; i <= d; ++i)
        line[i] = stage.lines + stage.nodes[static_cast<Offset>(run) * (d + 1) + i] * line_length;
      T* const target = coefficients + (run - batch) * stride;
      [[maybe_unused]] const T* rest = stage.rest + static_cast<Offset>(run) * (d + 1) * d;
      if constexpr (recipe == Recipe::linear) {
        set_up_linear<d>(line, target);
      } else if constexpr (recipe == Recipe::hermite) {
        set_up_hermite<d>(line, rest, target);
      } else if constexpr (recipe == Recipe::dual_taylor) {
        set_up_dual_taylor<d>(line, rest, target);
      } else {
        set_up_quadratic<d>(line, rest, target);
        if (stage.tolerance > 0) {
          const bool inside = stage.extrapolates == nullptr || stage.extrapolates[run] == 0;
          is_linear[run - batch] = inside && is_within<d>(stage.tolerance, target, columns);
          if (is_linear[run - batch]) set_up_linear<d>(line, target);
        }
      }
    }
    for (Index run = batch; run < batch_end; ++run) {
      const Index first = stage.first[run], count = stage.first[run + 1] - first;
      const T* const from = coefficients + (run - batch) * stride;
      const T* const local = stage.local + static_cast<Offset>(first) * d;
      T* const out = stage.out + static_cast<Offset>(first) * columns;
      if (recipe == Recipe::quadratic && is_linear[run - batch])
        evaluate_run<1, d, computed>(from, local, count, columns, out, limit);
      else
        evaluate_run<degree, d, computed>(from, local, count, columns, out, limit);
    }
  }
}

template <Recipe recipe, int d, class T>
void with_columns(const PointStage<T>& stage, Index begin, Index end) {
  // Cubics compute three columns always: the code of fewer is not worth its time to compile.
  if constexpr (polynomial_degree(recipe) == 3) {
    evaluate_runs<recipe, d, max_fast_columns>(stage, begin, end);
  } else {
    switch (stage.num_columns) {
      case 1:
        return evaluate_runs<recipe, d, 1>(stage, begin, end);
      case 2:
        return evaluate_runs<recipe, d, 2>(stage, begin, end);
      case 3:
        return evaluate_runs<recipe, d, 3>(stage, begin, end);
    }
  }
}

template <Recipe recipe, class T>
void with_dimension(const PointStage<T>& stage, Index begin, Index end) {
  switch (stage.dim) {
    case 1:
      return with_columns<recipe, 1>(stage, begin, end);
    case 2:
      return with_columns<recipe, 2>(stage, begin, end);
    case 3:
      return with_columns<recipe, 3>(stage, begin, end);
  }
}

template <class T>
void run_point_stage(const PointStage<T>& stage, Index begin, Index end) {
  switch (stage.recipe) {
    case Recipe::linear:
      return with_dimension<Recipe::linear>(stage, begin, end);
    case Recipe::quadratic:
      return with_dimension<Recipe::quadratic>(stage, begin, end);
    case Recipe::hermite:
      return with_dimension<Recipe::hermite>(stage, begin, end);
    case Recipe::dual_taylor:
      return with_dimension<Recipe::dual_taylor>(stage, begin, end);
  }
}

void vertex_stage(const VertexStage<HALFGRAD_SCALAR>& stage, Index begin, Index end) {
  run_vertex_stage(stage, begin, end);
}
void point_stage(const PointStage<HALFGRAD_SCALAR>& stage, Index begin, Index end) {
  run_point_stage(stage, begin, end);
}

}  // namespace halfgrad::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace halfgrad::kernels {
namespace {  // the tables of targets, one a scalar

HWY_EXPORT(vertex_stage);
HWY_EXPORT(point_stage);

}  // namespace

template <>
void VertexStage<HALFGRAD_SCALAR>::run(Index begin, Index end) const {
  HWY_DYNAMIC_DISPATCH(vertex_stage)(*this, begin, end);
}
template <>
void PointStage<HALFGRAD_SCALAR>::run(Index begin, Index end) const {
  HWY_DYNAMIC_DISPATCH(point_stage)(*this, begin, end);
}

}  // namespace halfgrad::kernels
#endif
