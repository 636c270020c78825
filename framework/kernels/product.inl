// Elements that are no simplices, under the linear rule and the blends. A source file defines HALFGRAD_SCALAR and
// HWY_TARGET_INCLUDE, then includes this one; Highway includes that source once a target.
//
// With shape functions β_i = Σ_m B_mi η^m of the element's variables η the cell's map is X(η) − X_0 = Σ_n Y_n η^n, and
//   f = Σ_i β_i (x_i + H_i (X − X_i)) = Σ_m η^m (w_m + Σ_n G_m Y_n η^n)
// with G_m = Σ_i B_mi H_i, w_m = Σ_i B_mi (x_i − H_i (X_i − X_0)), Y_n = Σ_i B_ni (X_i − X_0). Y_n vanishes for n of
// degree two and more where x(ξ) is affine: a hexahedron then has 20 coefficients instead of 27.
#include <hwy/foreach_target.h>
#include <utility>

#include "elements/registry.hpp"
#include "framework/kernels/points.inl"

HWY_BEFORE_NAMESPACE();
namespace halfgrad::kernels::HWY_NAMESPACE {

// sum + Σ_i B_mi items[i · stride]
template <class E, int m, int stride, class Item, std::size_t... i>
HWY_INLINE Item combination(const Item* items, Item sum, std::index_sequence<i...>) {
  const auto add = [&]<std::size_t node>() HALFGRAD_LAMBDA {
    constexpr auto factor = static_cast<HALFGRAD_SCALAR>(E::shape_coefficients[m][node]);
    if constexpr (factor == 1)
      sum = sum + items[node * stride];
    else if constexpr (factor == -1)
      sum = sum - items[node * stride];
    else if constexpr (factor != 0)
      sum = sum + items[node * stride] * factor;
  };
  (add.template operator()<i>(), ...);
  return sum;
}
template <class E, int m, int stride = 1, class Item>
HWY_INLINE Item combination(const Item* items, Item zero) {
  return combination<E, m, stride>(items, zero, std::make_index_sequence<E::num_nodes>());
}

template <class E, class T>
HWY_INLINE void set_up_shape(const Spread<T, E::dim>& spread, const T* const* line, T* coefficients) {
  using F = Four<T>;
  using M = ProductMonomials<E, Factor::none>;
  F x[E::num_nodes];
  HALFGRAD_UNROLL
  for (int i = 0; i < E::num_nodes; ++i) x[i] = F::load(line[i]);
  unrolled<M::num_shape>([&](auto m) HALFGRAD_LAMBDA {
    spread.columns_of(combination<E, m()>(x, F::zero())).store(coefficients + spread.size * M::product(m(), 0));
  });
}

template <class E, Factor factor, class T>
HWY_INLINE void set_up_blend(const Spread<T, E::dim>& spread, const T* const* line, const T* rest, T* coefficients) {
  using F = Four<T>;
  using M = ProductMonomials<E, factor>;
  constexpr int n = E::num_nodes, d = E::dim;
  F moved[n], h[d][n];
  HALFGRAD_UNROLL
  for (int i = 0; i < n; ++i) {
    moved[i] = F::load(line[i]);
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) {
      h[a][i] = F::load(line[i] + 4 * (1 + a));
      moved[i] = moved[i].minus(h[a][i], rest[i * d + a]);
    }
  }
  // Y of the monomial 1 is zero.
  T y[M::num_shape][d];
  F g[M::num_shape][d];
  unrolled<M::num_shape>([&](auto m) HALFGRAD_LAMBDA {
    HALFGRAD_UNROLL
    for (int a = 0; a < d; ++a) {
      g[m()][a] = combination<E, m()>(h[a], F::zero());
      if constexpr (m() > 0 && M::multiplies(m())) y[m()][a] = combination<E, m(), d>(rest + a, T(0));
    }
  });
  // A coefficient at a time, so that its sum stays in a register.
  unrolled<M::size>([&](auto place) HALFGRAD_LAMBDA {
    F sum = F::zero();
    if constexpr (constexpr int m = M::shape_at(place()); m >= 0) sum = combination<E, m>(moved, sum);
    unrolled<M::num_pairs(place())>([&](auto index) HALFGRAD_LAMBDA {
      constexpr auto pair = M::pair(place(), index());
      HALFGRAD_UNROLL
      for (int a = 0; a < d; ++a) sum = sum.plus(g[pair.m][a], y[pair.n][a]);
    });
    spread.columns_of(sum).store(coefficients + spread.size * place());
  });
}

// ---- runs

template <class E, Factor factor, class T>
HWY_NOINLINE void evaluate_blend_batch(const PointStage<T>& stage, const Spread<T, E::dim>& given, Index begin,
                                       Index end, Index num_whole) {
  using Monomials = ProductMonomials<E, factor>;
  const Spread<T, E::dim> spread = given;  // a copy, so that stores to the results do not make it be read again
  constexpr int stride = spread.size * Monomials::size;
  HWY_ALIGN T coefficients[batch_size * stride];
  T* target = coefficients;
  for (Index run = begin; run < end; ++run, target += stride) {
    const T* line[E::num_nodes];
    find_lines<E::num_nodes, 4 * (1 + E::dim)>(stage, run, line);
    set_up_blend<E, factor>(spread, line, stage.rest + static_cast<Offset>(run) * E::num_nodes * E::dim, target);
  }
  evaluate_polynomials<Monomials>(stage, spread, begin, end, coefficients, stride, num_whole);
}

template <class E, class T>
void evaluate_linear(const PointStage<T>& stage, Index begin, Index end) {
  using Monomials = ProductMonomials<E, Factor::none>;
  const Spread<T, E::dim> spread(stage.num_columns);
  constexpr int stride = spread.size * Monomials::size;
  HWY_ALIGN T coefficients[batch_size * stride];
  const Index num_whole = spread.num_whole(stage, end);
  for (Index batch = begin; batch < end; batch += batch_size) {
    const Index batch_end = std::min(batch + batch_size, end);
    T* target = coefficients;
    for (Index run = batch; run < batch_end; ++run, target += stride) {
      const T* line[E::num_nodes];
      find_lines<E::num_nodes, 4>(stage, run, line);
      set_up_shape<E>(spread, line, target);
    }
    evaluate_polynomials<Monomials>(stage, spread, batch, batch_end, coefficients, stride, num_whole);
  }
}

template <class E, class T>
HWY_NOINLINE void evaluate_blend(const PointStage<T>& stage, Index begin, Index end) {
  const Spread<T, E::dim> spread(stage.num_columns);
  const Index num_whole = spread.num_whole(stage, end);
  // Neighbours that are evaluated alike make a batch, so that no cell's result depends on which cells it is among.
  for (Index batch = begin, next; batch < end; batch = next) {
    next = std::min(batch + batch_size, end);
    if constexpr (PolynomialElement<E>) {
      const bool affine = stage.affine[batch] != 0;
      next = static_cast<Index>(
          std::find_if(stage.affine + batch, stage.affine + next, [&](auto other) { return (other != 0) != affine; }) -
          stage.affine);
      if (affine) {
        evaluate_blend_batch<E, Factor::affine>(stage, spread, batch, next, num_whole);
        continue;
      }
    }
    evaluate_blend_batch<E, Factor::shape>(stage, spread, batch, next, num_whole);
  }
}

void product_points(const PointStage<HALFGRAD_SCALAR>& stage, int vtk_id, Index begin, Index end) {
  Elements::for_each([&]<class E>() {
    if constexpr (MonomialElement<E> && !E::affine) {
      if (E::vtk_id != vtk_id) return;
      if (stage.recipe == Recipe::linear)
        evaluate_linear<E>(stage, begin, end);
      else
        evaluate_blend<E>(stage, begin, end);
    }
  });
}

}  // namespace halfgrad::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace halfgrad::kernels {
namespace {  // the table of targets
HWY_EXPORT(product_points);
}  // namespace

template <>
void PointStage<HALFGRAD_SCALAR>::run_product(int vtk_id, Index begin, Index end) const {
  HWY_DYNAMIC_DISPATCH(product_points)(*this, vtk_id, begin, end);
}

}  // namespace halfgrad::kernels
#endif
