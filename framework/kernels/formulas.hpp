// The formulas of all interpolants, as coefficients on vertex data. Plain code: the reference that every fast path is
// tested against.
#pragma once

#include <array>
#include <cstddef>

#include "framework/interpolation_rule.hpp"
#include "framework/types.hpp"

namespace halfgrad::kernels {

/// A number with its derivatives along d directions: the formulas below give the gradient of the interpolant (James
/// 2020, Eq. 15) when fed the weights' gradients.
template <class Scalar, int d>
struct Dual {
  Scalar value{};
  std::array<Scalar, d> derivative{};

  Dual() = default;
  Dual(Scalar constant) : value(constant) {}  // NOLINT: constants mix freely with duals

  friend Dual operator+(Dual x, const Dual& y) {
    x.value += y.value;
    for (int k = 0; k < d; ++k) x.derivative[k] += y.derivative[k];
    return x;
  }
  friend Dual operator-(Dual x, const Dual& y) {
    x.value -= y.value;
    for (int k = 0; k < d; ++k) x.derivative[k] -= y.derivative[k];
    return x;
  }
  friend Dual operator*(const Dual& x, const Dual& y) {
    Dual product(x.value * y.value);
    for (int k = 0; k < d; ++k) product.derivative[k] = x.derivative[k] * y.value + x.value * y.derivative[k];
    return product;
  }
};

/// f = Σ_i a_i x_i + F_i c_i + Q_i : q_i at one point of a cell with n nodes in d dimensions. Σ a_i = 1. Off-diagonal
/// entries of q count both places of the symmetric Q_i.
template <class T, int n, int d>
struct Coefficients {
  std::array<T, n> a;
  std::array<std::array<T, d>, n> c;
  std::array<std::array<T, num_symmetric(d)>, n> q;
};

/// Coefficients from the weights β and the rest positions of the nodes (relative to any origin near the cell).
template <class T, class Scalar, int n, int d>
Coefficients<T, n, d> point_coefficients(const InterpolationRule& rule, const std::array<T, n>& beta,
                                         const std::array<std::array<Scalar, d>, n>& rest) {
  Coefficients<T, n, d> result;
  std::array<T, d> position;
  for (int k = 0; k < d; ++k) {
    position[k] = T(Scalar(0));
    for (int i = 0; i < n; ++i) position[k] = position[k] + beta[i] * T(rest[i][k]);
  }
  const auto offset = [&](int i, int k) { return position[k] - T(rest[i][k]); };

  switch (rule.formula) {
    case Formula::blend: {
      const T alpha(static_cast<Scalar>(rule.alpha));
      for (int i = 0; i < n; ++i) {
        result.a[i] = beta[i];
        for (int k = 0; k < d; ++k) result.c[i][k] = alpha * beta[i] * offset(i, k);
      }
      break;
    }
    case Formula::hermite: {
      // a_i = β_i(1 − s) + β_i²,  c_i = β_i/2 [(1 + β_i)(X − X_i) − (X̂ − s X_i)],  s = Σβ_j²,  X̂ = Σβ_j² X_j.
      const T one(Scalar(1)), half(Scalar(0.5));
      T s(Scalar(0));
      std::array<T, d> squared;
      squared.fill(T(Scalar(0)));
      for (int j = 0; j < n; ++j) {
        const T square = beta[j] * beta[j];
        s = s + square;
        for (int k = 0; k < d; ++k) squared[k] = squared[k] + square * T(rest[j][k]);
      }
      for (int i = 0; i < n; ++i) {
        result.a[i] = beta[i] * (one - s) + beta[i] * beta[i];
        for (int k = 0; k < d; ++k)
          result.c[i][k] = half * beta[i] * ((one + beta[i]) * offset(i, k) - (squared[k] - s * T(rest[i][k])));
      }
      break;
    }
    case Formula::dual_taylor: {
      const T two_thirds(Scalar(2) / 3);
      for (int i = 0; i < n; ++i) {
        result.a[i] = beta[i];
        for (int k = 0; k < d; ++k) result.c[i][k] = two_thirds * beta[i] * offset(i, k);
        for (int k = 0, entry = 0; k < d; ++k)
          for (int l = k; l < d; ++l, ++entry)
            result.q[i][entry] = T(Scalar(k == l ? 1 : 2) / 6) * beta[i] * offset(i, k) * offset(i, l);
      }
      break;
    }
    case Formula::quadratic10: {
      // Σ β_i(2β_i − 1) x_i + Σ_{i<j} 4 β_i β_j m_ij with m_ij of Eq. 21; reached through midpoints, not through phong.
      const T one(Scalar(1)), two(Scalar(2)), four(Scalar(4)), half(Scalar(0.5)), eighth(Scalar(0.125));
      for (int i = 0; i < n; ++i) {
        result.a[i] = beta[i] * (two * beta[i] - one);
        result.c[i].fill(T(Scalar(0)));
      }
      for (int i = 0; i < n; ++i)
        for (int j = i + 1; j < n; ++j) {
          const T bubble = four * beta[i] * beta[j];
          result.a[i] = result.a[i] + half * bubble;
          result.a[j] = result.a[j] + half * bubble;
          for (int k = 0; k < d; ++k) {
            const T edge = eighth * bubble * T(rest[j][k] - rest[i][k]);
            result.c[i][k] = result.c[i][k] + edge;
            result.c[j][k] = result.c[j][k] - edge;
          }
        }
      break;
    }
  }
  return result;
}

}  // namespace halfgrad::kernels
