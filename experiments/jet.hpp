// Second-order forward differentiation: a value with its gradient and Hessian, exact to round-off.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace halfgrad {

/// A number that depends on D variables, with its first and second derivatives.
template <int D>
struct Jet {
  double value = 0;
  Eigen::Matrix<double, D, 1> gradient = Eigen::Matrix<double, D, 1>::Zero();
  Eigen::Matrix<double, D, D> hessian = Eigen::Matrix<double, D, D>::Zero();

  Jet() = default;
  Jet(double constant) : value(constant) {}  // implicit: constants mix with jets in formulas
  /// The variable with this number.
  static Jet variable(double value, int axis) {
    Jet jet(value);
    jet.gradient[axis] = 1;
    return jet;
  }

  friend Jet operator+(const Jet& a, const Jet& b) { return combine(a, b, a.value + b.value, 1, 1); }
  friend Jet operator-(const Jet& a, const Jet& b) { return combine(a, b, a.value - b.value, 1, -1); }
  friend Jet operator-(const Jet& a) { return 0.0 - a; }
  friend Jet operator*(const Jet& a, const Jet& b) {
    Jet jet = combine(a, b, a.value * b.value, b.value, a.value);
    const Eigen::Matrix<double, D, D> mixed = a.gradient * b.gradient.transpose();
    jet.hessian += mixed + mixed.transpose();
    return jet;
  }
  friend Jet operator/(const Jet& a, const Jet& b) {
    return a * b.compose(1 / b.value, -1 / (b.value * b.value), 2 / (b.value * b.value * b.value));
  }
  Jet& operator+=(const Jet& other) { return *this = *this + other; }

  /// f(jet) from f and its first two derivatives at the jet's value.
  Jet compose(double f, double f1, double f2) const {
    Jet jet(f);
    jet.gradient = f1 * gradient;
    jet.hessian = f1 * hessian + f2 * gradient * gradient.transpose();
    return jet;
  }
  friend Jet sin(const Jet& a) { return a.compose(std::sin(a.value), std::cos(a.value), -std::sin(a.value)); }
  friend Jet cos(const Jet& a) { return a.compose(std::cos(a.value), -std::sin(a.value), -std::cos(a.value)); }
  friend Jet sqrt(const Jet& a) {
    const double root = std::sqrt(a.value);
    return a.compose(root, 0.5 / root, -0.25 / (root * a.value));
  }

 private:
  static Jet combine(const Jet& a, const Jet& b, double value, double da, double db) {
    Jet jet(value);
    jet.gradient = da * a.gradient + db * b.gradient;
    jet.hessian = da * a.hessian + db * b.hessian;
    return jet;
  }
};

}  // namespace halfgrad
