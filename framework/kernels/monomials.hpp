// Which polynomial an interpolant is on a cell, and in which order a cell's coefficients are stored.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "elements/element.hpp"

namespace halfgrad::kernels {

/// Exponents of a monomial.
template <int d>
using Exponents = std::array<int, d>;

/// Monomials of total degree ≤ `max_degree`: what every rule is on a simplex, where β_k = ξ_k. Stored as
///   ξ1 … ξd | 1 | ξkξl with k ≤ l | ξkξlξm with k ≤ l ≤ m
template <int max_degree, int d>
struct SimplexMonomials {
  static constexpr int dim = d;
  static constexpr int num_quadratic = max_degree < 2 ? 0 : d * (d + 1) / 2;
  static constexpr int num_cubic = max_degree < 3 ? 0 : d * (d + 1) * (d + 2) / 6;
  /// Number of coefficients.
  static constexpr int size = d + 1 + num_quadratic + num_cubic;

  static constexpr int constant = d;
  static constexpr int linear(int k) { return k; }
  static constexpr int quadratic(int k, int l) { return table.quadratic[k][l]; }
  static constexpr int cubic(int k, int l, int m) { return table.cubic[k][l][m]; }

 private:
  // Places in any order of the factors. Tables of constants: what they are in an unrolled loop does not depend on the
  // optimisation level.
  struct Table {
    int quadratic[d][d] = {}, cubic[d][d][d] = {};
    constexpr Table() {
      int next = d + 1;
      for (int k = 0; k < d; ++k)
        for (int l = k; l < d; ++l, ++next) quadratic[k][l] = quadratic[l][k] = next;
      for (int k = 0; k < d; ++k)
        for (int l = k; l < d; ++l)
          for (int m = l; m < d; ++m, ++next)
            cubic[k][l][m] = cubic[k][m][l] = cubic[l][k][m] = cubic[l][m][k] = cubic[m][k][l] = cubic[m][l][k] = next;
    }
  };
  static constexpr Table table{};

 public:
  /// Place of a monomial, −1 where it is not in the set.
  static constexpr int place(const Exponents<d>& exponents) {
    std::array<int, 3> factor{};
    int degree = 0;
    for (int k = 0; k < d; ++k)
      for (int e = 0; e < exponents[static_cast<std::size_t>(k)]; ++e, ++degree) {
        if (degree == max_degree) return -1;
        factor[static_cast<std::size_t>(degree)] = k;
      }
    return degree == 0   ? constant
           : degree == 1 ? linear(factor[0])
           : degree == 2 ? quadratic(factor[0], factor[1])
                         : cubic(factor[0], factor[1], factor[2]);
  }
};

/// What the shape functions of a polynomial element are multiplied with.
enum class Factor : std::uint8_t {
  none,    ///< linear interpolation: Σ β_i x_i
  affine,  ///< a blend on a cell of a PolynomialElement whose x(ξ) is affine (a parallelepiped): so is X − X_i
  shape    ///< a blend on any cell: X − X_i is in the span of the shape functions
};

/// Monomials of the shape functions of E in its variables, multiplied as `factor` says; stored in ascending order of
/// their exponents.
template <MonomialElement E, Factor factor>
struct ProductMonomials {
  using element = E;
  static constexpr int dim = num_variables<E>;
  static constexpr int num_shape = static_cast<int>(E::shape_monomials.size());

  /// Whether the shape functions are multiplied with their monomial n.
  static constexpr bool multiplies(int n) {
    int degree = 0;
    for (int exponent : E::shape_monomials[static_cast<std::size_t>(n)]) degree += exponent;
    return factor == Factor::shape || degree <= (factor == Factor::affine ? 1 : 0);
  }

 private:
  struct List {
    std::array<Exponents<dim>, static_cast<std::size_t>(num_shape) * num_shape> items{};
    int size = 0;
  };
  static constexpr List make() {
    List list;
    for (const auto& m : E::shape_monomials)
      for (int n = 0; n < num_shape; ++n) {
        if (!multiplies(n)) continue;
        Exponents<dim> sum{};
        for (std::size_t k = 0; k < dim; ++k) sum[k] = m[k] + E::shape_monomials[static_cast<std::size_t>(n)][k];
        const auto end = list.items.begin() + list.size;
        if (std::find(list.items.begin(), end, sum) == end) list.items[static_cast<std::size_t>(list.size++)] = sum;
      }
    std::sort(list.items.begin(), list.items.begin() + list.size);
    return list;
  }
  static constexpr List list_ = make();

 public:
  /// Number of coefficients.
  static constexpr int size = list_.size;
  /// Place of a monomial, −1 where it is not in the set.
  static constexpr int place(const Exponents<dim>& exponents) {
    for (int i = 0; i < size; ++i)
      if (list_.items[static_cast<std::size_t>(i)] == exponents) return i;
    return -1;
  }
  /// The monomial of the shape functions at a place, −1 where there is none.
  static constexpr int shape_at(int place) {
    for (int m = 0; m < num_shape; ++m)
      if (product(m, 0) == place) return m;
    return -1;
  }
  /// Pairs of a monomial m of the shape functions and a factor n > 0 whose product is at a place.
  struct Pair {
    int m, n;
  };
  static constexpr int num_pairs(int place) {
    return pairs_.first[static_cast<std::size_t>(place) + 1] - pairs_.first[static_cast<std::size_t>(place)];
  }
  static constexpr Pair pair(int place, int index) {
    return pairs_.items[static_cast<std::size_t>(pairs_.first[static_cast<std::size_t>(place)] + index)];
  }

  /// Place of the product of two monomials of the shape functions.
  static constexpr int product(int m, int n) {
    Exponents<dim> sum{};
    for (std::size_t k = 0; k < dim; ++k)
      sum[k] = E::shape_monomials[static_cast<std::size_t>(m)][k] + E::shape_monomials[static_cast<std::size_t>(n)][k];
    return place(sum);
  }

 private:
  struct Pairs {
    std::array<Pair, static_cast<std::size_t>(num_shape) * num_shape> items{};
    std::array<int, static_cast<std::size_t>(size) + 1> first{};
  };
  static constexpr Pairs make_pairs() {
    // Once a pair: compilers bound the steps of a constant.
    std::array<int, static_cast<std::size_t>(num_shape) * num_shape> places{};
    for (int m = 0; m < num_shape; ++m)
      for (int n = 0; n < num_shape; ++n)
        places[static_cast<std::size_t>(m * num_shape + n)] = n > 0 && multiplies(n) ? product(m, n) : -1;
    Pairs result;
    int count = 0;
    for (int place = 0; place < size; ++place) {
      for (int i = 0; i < num_shape * num_shape; ++i)
        if (places[static_cast<std::size_t>(i)] == place)
          result.items[static_cast<std::size_t>(count++)] = {i / num_shape, i % num_shape};
      result.first[static_cast<std::size_t>(place) + 1] = count;
    }
    return result;
  }
  static constexpr Pairs pairs_ = make_pairs();
};

}  // namespace halfgrad::kernels
