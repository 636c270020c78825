// Evaluation of cells' polynomials at their points. Included once for every instruction set.
#if defined(HALFGRAD_POINTS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HALFGRAD_POINTS_INL
#undef HALFGRAD_POINTS_INL
#else
#define HALFGRAD_POINTS_INL
#endif

#include <algorithm>
#include <type_traits>

#include "framework/kernels/fours.inl"
#include "framework/kernels/monomials.hpp"

HWY_BEFORE_NAMESPACE();
namespace halfgrad::kernels::HWY_NAMESPACE {

// ---- columns and points on the lanes of a vector

// As many numbers as the target's vectors hold, four at least.
template <class T>
using Wide = Pack<T, std::max(4, static_cast<int>(hn::MaxLanes(hn::CappedTag<T, 16>())))>;

// Places points and columns on the lanes of a vector: lane p · columns + c holds column c of point p, so that a vector
// of results goes to memory as it stands. What lanes beyond the last point hold is not used.
template <class T, int d>
class Spread {
 public:
  using W = Wide<T>;
  static constexpr int size = 4 * (sizeof(W) / sizeof(Four<T>));
  // One point a vector where vectors are short: then coordinates are broadcast and coefficients stay as they are.
  static constexpr bool single = size == 4;

  HWY_INLINE explicit Spread(int columns) : num_points(single ? 1 : size / std::max(d, columns)) {
    if constexpr (!single) {
      HWY_ALIGN TI lane[size];
      for (int l = 0; l < size; ++l) lane[l] = static_cast<TI>(l % columns);
      column_ = hn::SetTableIndices(Tag(), lane);
      HALFGRAD_UNROLL
      for (int k = 0; k < d; ++k) {
        for (int l = 0; l < size; ++l) lane[l] = static_cast<TI>(std::min(l / columns, num_points - 1) * d + k);
        coordinate_[k] = hn::SetTableIndices(Tag(), lane);
      }
    }
  }

  // Columns of a vertex or coefficient on the lanes.
  HWY_INLINE W columns_of(const Four<T>& four) const {
#if HWY_TARGET != HWY_SCALAR
    if constexpr (!single) {
      W r;
      r.part[0] = hn::TableLookupLanes(widened<size>(four.part[0]), column_);
      return r;
    }
#endif
    if constexpr (single) return four;
  }

  // ξ_1 … ξ_d of num_points points, of which `local` is the first; reads a whole
  // vector.
  HWY_INLINE void coordinates(const T* local, W* xi) const {
    if constexpr (single) {
      HALFGRAD_UNROLL
      for (int k = 0; k < d; ++k) xi[k] = W::all(local[k]);
    } else {
      auto all = hn::LoadU(Tag(), local);
#if HWY_ARCH_X86 && HWY_COMPILER_GCC_ACTUAL
      // Keeps the compiler from loading once an axis: loads that cross cache lines are what a linear frame waits for.
      asm("" : "+x"(all.raw));
#endif
      HALFGRAD_UNROLL
      for (int k = 0; k < d; ++k) xi[k].part[0] = hn::TableLookupLanes(all, coordinate_[k]);
    }
  }

  // The number of points, counted from the first of stage.out, before which every vector of results that begins there
  // may be stored whole: what a store writes too much, the next overwrites.
  Index num_whole(const PointStage<T>& stage, Index end) const {
    return stage.first[end] - (size + stage.num_columns - 1) / stage.num_columns;
  }
  // Before the end of the caller's range only the points are copied.
  HWY_INLINE void store_bounded(const W& results, Index count, int columns, T* out) const {
    HWY_ALIGN T rows[size];
    results.store(rows);
    std::copy_n(rows, std::min<Index>(count, num_points) * columns, out);
  }

  const int num_points;  // of a vector

 private:
  using Tag = hn::CappedTag<T, size>;
  using TI = hn::TFromD<hn::RebindToSigned<Tag>>;
  using Indices = decltype(hn::SetTableIndices(Tag(), static_cast<const TI*>(nullptr)));

#if HWY_TARGET != HWY_SCALAR
  // The four in the first lanes of a longer vector.
  template <int to, class V>
  HWY_INLINE static auto widened(V v) {
    if constexpr (to == 4)
      return v;
    else
      return hn::ZeroExtendVector(hn::CappedTag<T, to>(), widened<to / 2>(v));
  }
#endif

  std::conditional_t<single, char, Indices> column_;
  std::conditional_t<single, char, Indices> coordinate_[d];
};

// ---- Horner's scheme over a set of monomials that holds all divisors of its members

// Whether the set goes on with exponent `power` of variable k after the exponents `before` of the variables before.
template <class Monomials, int k, int power, int... before>
constexpr bool has_power() {
  Exponents<Monomials::dim> exponents{before...};
  exponents[k] = power;
  return Monomials::place(exponents) >= 0;
}

template <class Monomials, int k, int power, int... before, class W>
HWY_INLINE W horner_from(const W* c, const W* xi);

// The factor of ξ_0^before_0 ξ_1^before_1 …: a polynomial in ξ_k, ξ_(k+1) ….
template <class Monomials, int k, int... before, class W>
HWY_INLINE W horner(const W* c, const W* xi) {
  if constexpr (k == Monomials::dim) {
    constexpr int place = Monomials::place({before...});
    return c[place];
  } else {
    return horner_from<Monomials, k, 0, before...>(c, xi);
  }
}

// Σ_{e ≥ power} ξ_k^(e − power) · (factor of ξ_k^e)
template <class Monomials, int k, int power, int... before, class W>
HWY_INLINE W horner_from(const W* c, const W* xi) {
  const W lowest = horner<Monomials, k + 1, before..., power>(c, xi);
  if constexpr (has_power<Monomials, k, power + 1, before...>())
    return lowest.plus(xi[k], horner_from<Monomials, k, power + 1, before...>(c, xi));
  else
    return lowest;
}

// Calls value(xi) for each vector of a run's points and stores what it returns.
template <int d, class T, class Value>
HWY_INLINE void evaluate_points(const PointStage<T>& stage, const Spread<T, d>& spread, Index run, Index num_whole,
                                Value&& value) {
  const int columns = stage.num_columns, step = spread.num_points;
  const T* local = stage.local + static_cast<Offset>(stage.first[run]) * d;
  T* out = stage.out + static_cast<Offset>(stage.first[run]) * columns;
  Index left = stage.first[run + 1] - stage.first[run];
  // Two loops: a test for the end of the range in the first costs a tenth of a frame.
  Index bounded = std::clamp(stage.first[run + 1] - num_whole, 0, left);
  for (; left > bounded; left -= step, local += step * d, out += step * columns) {
    Wide<T> xi[d];
    spread.coordinates(local, xi);
    value(xi).store_unaligned(out);
  }
  for (; HWY_UNLIKELY(left > 0); left -= step, local += step * d, out += step * columns) {
    Wide<T> xi[d];
    spread.coordinates(local, xi);
    spread.store_bounded(value(xi), left, columns, out);
  }
}

// The rational function of an element, lane by lane.
template <RationalElement E, class V>
HWY_INLINE V rational_function(const V* xi) {
  const hn::DFromV<V> tag;
  using T = hn::TFromD<hn::DFromV<V>>;
  V affine[3];
  unrolled<3>([&](auto i) HALFGRAD_LAMBDA {
    affine[i()] = hn::Set(tag, static_cast<T>(E::rational[i()][0]));
    unrolled<E::dim>([&](auto k) HALFGRAD_LAMBDA {
      constexpr auto factor = static_cast<T>(E::rational[i()][k() + 1]);
      if constexpr (factor != 0) affine[i()] = hn::MulAdd(hn::Set(tag, factor), xi[k()], affine[i()]);
    });
  });
  return hn::IfThenElseZero(hn::Gt(affine[2], hn::Set(tag, static_cast<T>(E::least_denominator))),
                            hn::Div(hn::Mul(affine[0], affine[1]), affine[2]));
}

template <class Monomials>
concept RationalMonomials = RationalElement<typename Monomials::element>;

// A polynomial at points by their ξ.
template <class Monomials, class T>
HWY_INLINE Wide<T> polynomial(const Wide<T>* c, const Wide<T>* xi) {
  if constexpr (!RationalMonomials<Monomials>) {
    return horner<Monomials, 0>(c, xi);
  } else {
    using E = typename Monomials::element;
    Wide<T> eta[E::dim + 1];
    HALFGRAD_UNROLL
    for (int k = 0; k < E::dim; ++k) eta[k] = xi[k];
    HALFGRAD_UNROLL
    for (int p = 0; p < Wide<T>::num_parts; ++p) {
      typename Wide<T>::V part[E::dim];
      HALFGRAD_UNROLL
      for (int k = 0; k < E::dim; ++k) part[k] = xi[k].part[p];
      eta[E::dim].part[p] = rational_function<E>(part);
    }
    return horner<Monomials, 0>(c, eta);
  }
}

// The points of runs whose coefficients, spread over lanes, stand `stride` apart.
template <class Monomials, int d, class T>
HWY_INLINE void evaluate_polynomials(const PointStage<T>& stage, const Spread<T, d>& spread, Index begin, Index end,
                                     const T* coefficients, int stride, Index num_whole) {
  for (Index run = begin; run < end; ++run, coefficients += stride) {
    // Loaded before the points, whose stores may be to any memory for all that the compiler knows.
    Wide<T> c[Monomials::size];
    HALFGRAD_UNROLL
    for (int i = 0; i < Monomials::size; ++i) c[i] = Wide<T>::load(coefficients + Spread<T, d>::size * i);
    evaluate_points<d>(stage, spread, run, num_whole,
                       [&](const Wide<T>* xi) HALFGRAD_LAMBDA { return polynomial<Monomials, T>(c, xi); });
  }
}

// ---- runs

// Runs whose coefficients are computed before the first of them is read.
constexpr int batch_size = 8;

// Lines of a run's nodes.
template <int num_nodes, int line_length, class T>
HWY_INLINE void find_lines(const PointStage<T>& stage, Index run, const T** line) {
  const Index* node = stage.nodes + static_cast<Offset>(run) * num_nodes;
  HALFGRAD_UNROLL
  for (int i = 0; i < num_nodes; ++i) line[i] = stage.lines + static_cast<Offset>(node[i]) * line_length;
}

}  // namespace halfgrad::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
