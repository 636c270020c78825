// Elements that are no simplices, under the rules of degree three, a point a lane. A source file defines
// HALFGRAD_SCALAR and HWY_TARGET_INCLUDE, then includes this one; Highway includes that source once a target.
//
// With D_i = X − X_i both rules are f = Σ_i γ_i x_i + H_i V_i + Q_i : V_i D_iᵀ, where
//   hermite      γ_i = β_i (1 − Σ_j β_j² + β_i),  V_i = γ_i D_i + β_i Σ_j β_j² D_j   (H = ½F, no Q)
//   dual_taylor  γ_i = β_i,  V_i = β_i D_i
// which are those of formulas.hpp, reordered.
#include <hwy/foreach_target.h>
#include <utility>

#include "elements/registry.hpp"
#include "framework/kernels/points.inl"

HWY_BEFORE_NAMESPACE();
namespace halfgrad::kernels::HWY_NAMESPACE {

template <class T>
using LaneTag = hn::CappedTag<T, 16>;
template <class T>
using LaneVector = hn::Vec<LaneTag<T>>;

// ξ of as many points as there are lanes, one vector a coordinate.
template <int count, class T>
HWY_INLINE void load_points(const T* local, LaneVector<T>* xi) {
  const LaneTag<T> tag;
  static_assert(1 <= count && count <= 3);
  if constexpr (count == 1) xi[0] = hn::LoadU(tag, local);
  if constexpr (count == 2) hn::LoadInterleaved2(tag, local, xi[0], xi[1]);
  if constexpr (count == 3) hn::LoadInterleaved3(tag, local, xi[0], xi[1], xi[2]);
}

template <int columns, class T>
HWY_INLINE void store_points(const LaneVector<T>* f, T* out) {
  const LaneTag<T> tag;
  if constexpr (columns == 1) hn::StoreU(f[0], tag, out);
  if constexpr (columns == 2) hn::StoreInterleaved2(f[0], f[1], tag, out);
  if constexpr (columns == 3) hn::StoreInterleaved3(f[0], f[1], f[2], tag, out);
}

// β of the points, from the monomials of their variables.
template <class E, class T>
HWY_INLINE void weights(const LaneVector<T>* xi, LaneVector<T>* beta) {
  constexpr int n = E::num_nodes;
  const LaneTag<T> tag;
  LaneVector<T> eta[num_variables<E>];
  HALFGRAD_UNROLL
  for (int k = 0; k < E::dim; ++k) eta[k] = xi[k];
  if constexpr (RationalElement<E>) eta[E::dim] = rational_function<E>(xi);
  HALFGRAD_UNROLL
  for (int i = 0; i < n; ++i) beta[i] = hn::Zero(tag);
  unrolled<static_cast<int>(E::shape_monomials.size())>([&](auto m) HALFGRAD_LAMBDA {
    LaneVector<T> monomial = hn::Set(tag, T(1));
    unrolled<num_variables<E>>([&](auto k) HALFGRAD_LAMBDA {
      for (int power = 0; power < E::shape_monomials[m()][k()]; ++power) monomial = hn::Mul(monomial, eta[k()]);
    });
    unrolled<n>([&](auto i) HALFGRAD_LAMBDA {
      constexpr auto factor = static_cast<T>(E::shape_coefficients[m()][i()]);
      if constexpr (factor == 1)
        beta[i()] = hn::Add(beta[i()], monomial);
      else if constexpr (factor == -1)
        beta[i()] = hn::Sub(beta[i()], monomial);
      else if constexpr (factor != 0)
        beta[i()] = hn::MulAdd(hn::Set(tag, factor), monomial, beta[i()]);
    });
  });
}

// Results at a vector of points. `differences` are [node][4] x_i − x_0, `rest` [node][axis].
template <class E, Recipe recipe, int columns, class T>
HWY_INLINE void evaluate_rule(const T* const* line, const T* differences, const T* rest, const LaneVector<T>* xi,
                              LaneVector<T>* f) {
  constexpr int n = E::num_nodes, d = E::dim;
  using V = LaneVector<T>;
  const LaneTag<T> tag;
  V beta[n], position[d], squares = hn::Zero(tag), moment[d];
  weights<E, T>(xi, beta);
  HALFGRAD_UNROLL
  for (int k = 0; k < d; ++k) position[k] = moment[k] = hn::Zero(tag);
  for (int i = 1; i < n; ++i) {
    HALFGRAD_UNROLL
    for (int k = 0; k < d; ++k) position[k] = hn::MulAdd(beta[i], hn::Set(tag, rest[i * d + k]), position[k]);
  }
  if constexpr (recipe == Recipe::hermite)
    for (int i = 0; i < n; ++i) {
      const V square = hn::Mul(beta[i], beta[i]);
      squares = hn::Add(squares, square);
      HALFGRAD_UNROLL
      for (int k = 0; k < d; ++k)
        moment[k] = hn::MulAdd(square, hn::Sub(position[k], hn::Set(tag, rest[i * d + k])), moment[k]);
    }
  HALFGRAD_UNROLL
  for (int c = 0; c < columns; ++c) f[c] = hn::Zero(tag);
  for (int i = 0; i < n; ++i) {
    V offset[d], along[d], weight = beta[i];
    if constexpr (recipe == Recipe::hermite)
      weight = hn::Mul(beta[i], hn::Add(hn::Sub(hn::Set(tag, T(1)), squares), beta[i]));
    HALFGRAD_UNROLL
    for (int k = 0; k < d; ++k) {
      offset[k] = hn::Sub(position[k], hn::Set(tag, rest[i * d + k]));
      along[k] = hn::Mul(weight, offset[k]);
      if constexpr (recipe == Recipe::hermite) along[k] = hn::MulAdd(beta[i], moment[k], along[k]);
    }
    const auto add = [&](const V& factor, const T* four) HALFGRAD_LAMBDA {
      HALFGRAD_UNROLL
      for (int c = 0; c < columns; ++c) f[c] = hn::MulAdd(factor, hn::Set(tag, four[c]), f[c]);
    };
    add(weight, differences + 4 * i);
    const T* four = line[i] + 4;
    HALFGRAD_UNROLL
    for (int k = 0; k < d; ++k, four += 4) add(along[k], four);
    if constexpr (recipe == Recipe::dual_taylor) {
      HALFGRAD_UNROLL
      for (int k = 0; k < d; ++k)
        for (int l = k; l < d; ++l, four += 4) add(hn::Mul(along[k], offset[l]), four);
    }
  }
  HALFGRAD_UNROLL
  for (int c = 0; c < columns; ++c) f[c] = hn::Add(hn::Set(tag, line[0][c]), f[c]);
}

template <class E, Recipe recipe, int columns, class T>
HWY_NOINLINE void evaluate_lanes(const PointStage<T>& stage, Index begin, Index end) {
  constexpr int n = E::num_nodes, d = E::dim, lanes = static_cast<int>(hn::MaxLanes(LaneTag<T>()));
  const Index last = stage.first[end];
  HWY_ALIGN T some[d * lanes] = {}, results[columns * lanes];
  for (Index run = begin; run < end; ++run) {
    const T* line[n];
    find_lines<n, 4 * (1 + num_weights(recipe, d))>(stage, run, line);
    HWY_ALIGN T differences[4 * n];
    const auto first_node = Four<T>::load(line[0]);
    HALFGRAD_UNROLL
    for (int i = 0; i < n; ++i) (Four<T>::load(line[i]) - first_node).store(differences + 4 * i);
    const T* const rest = stage.rest + static_cast<Offset>(run) * n * d;
    for (Index p = stage.first[run]; p < stage.first[run + 1]; p += lanes) {
      const T* const local = stage.local + static_cast<Offset>(p) * d;
      T* const out = stage.out + static_cast<Offset>(p) * columns;
      // Vectors are read and stored whole: the next run overwrites what was stored too much, except at the range's end.
      const bool whole = p + lanes <= last;
      if (!whole) std::copy_n(local, (last - p) * d, some);
      LaneVector<T> xi[d], f[columns];
      load_points<d>(whole ? local : some, xi);
      evaluate_rule<E, recipe, columns>(line, differences, rest, xi, f);
      store_points<columns>(f, whole ? out : results);
      if (!whole) std::copy_n(results, std::min<Index>(stage.first[run + 1] - p, lanes) * columns, out);
    }
  }
}

template <class E, class T>
void evaluate_lanes(const PointStage<T>& stage, Index begin, Index end) {
  const auto with_columns = [&](auto columns) {
    if (stage.recipe == Recipe::hermite)
      evaluate_lanes<E, Recipe::hermite, columns()>(stage, begin, end);
    else
      evaluate_lanes<E, Recipe::dual_taylor, columns()>(stage, begin, end);
  };
  switch (stage.num_columns) {
    case 1:
      return with_columns(std::integral_constant<int, 1>());
    case 2:
      return with_columns(std::integral_constant<int, 2>());
    case 3:
      return with_columns(std::integral_constant<int, 3>());
  }
}

void lanes_points(const PointStage<HALFGRAD_SCALAR>& stage, int vtk_id, Index begin, Index end) {
  Elements::for_each([&]<class E>() {
    if constexpr (MonomialElement<E> && !E::affine)
      if (E::vtk_id == vtk_id) evaluate_lanes<E>(stage, begin, end);
  });
}

}  // namespace halfgrad::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace halfgrad::kernels {
namespace {  // the table of targets
HWY_EXPORT(lanes_points);
}  // namespace

template <>
void PointStage<HALFGRAD_SCALAR>::run_lanes(int vtk_id, Index begin, Index end) const {
  HWY_DYNAMIC_DISPATCH(lanes_points)(*this, vtk_id, begin, end);
}

}  // namespace halfgrad::kernels
#endif
