// The interpolants once more in long double, each number with the bound of its rounding: what results are held against.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "framework/embedding.hpp"
#include "framework/gradient_stencils.hpp"
#include "framework/interpolation_rule.hpp"

namespace halfgrad {

/// A number and the sum of the absolute values of all that it was computed from. Arithmetic that rounds with relative
/// error ε in N operations in a row errs by at most N ε · magnitude, to first order, in whatever order it sums
/// (Higham 2002, §3.1): magnitude / |value| is the condition of the computation.
struct Measured {
  long double value = 0, magnitude = 0;

  Measured() = default;
  Measured(long double exact) : value(exact), magnitude(std::abs(exact)) {}  // NOLINT: constants mix freely
  Measured(long double v, long double m) : value(v), magnitude(m) {}

  friend Measured operator+(const Measured& x, const Measured& y) {
    return {x.value + y.value, x.magnitude + y.magnitude};
  }
  friend Measured operator-(const Measured& x, const Measured& y) {
    return {x.value - y.value, x.magnitude + y.magnitude};
  }
  friend Measured operator/(const Measured& x, int y) { return {x.value / y, x.magnitude / std::abs(y)}; }
  friend Measured operator*(const Measured& x, const Measured& y) {
    return {x.value * y.value, x.magnitude * y.magnitude};
  }
};

/// A point of an embedding: its cell's vertices and weights.
struct ReferenceWeights {
  int num_nodes = 0;
  bool is_simplex = false;
  std::array<Index, max_nodes> vertices{};
  std::array<Measured, max_nodes> beta{};
  /// X_i − X_0, zero beyond num_nodes. Cells that are no simplices count as affine where rounding of their coordinates
  /// would make them so: eight units of their last place are part of the magnitude.
  std::array<std::array<Measured, max_gdim>, max_nodes> rest{};
};

/// Weights of a point that has a cell.
ReferenceWeights reference_weights(const Mesh& mesh, const Embedding& embedding, Index point,
                                   const OutsidePoint* outside);

/// What a rule takes of each node: f = Σ a_i x_i + F_i c_i + Q_i : q_i.
struct ReferenceCoefficients {
  std::array<Measured, max_nodes> a{};
  std::array<std::array<Measured, max_gdim>, max_nodes> c{};
  std::array<std::array<Measured, num_symmetric(max_gdim)>, max_nodes> q{};
};

/// Coefficients of a rule in a space of gdim ≤ 3 dimensions.
ReferenceCoefficients reference_coefficients(const InterpolationRule& rule, const ReferenceWeights& weights, int gdim);

/// Vertex values and what is not certain of them: `rounding`, in units of ε, #vertices.
struct ReferenceValues {
  Values<double> values;         ///< #vertices × #columns
  std::vector<double> rounding;  ///< empty where the values are exact
};

/// The value of `vertex` less that of `from`.
Measured difference(const ReferenceValues& values, Index vertex, Index from, int column);

/// F (and Q) of each vertex that a table has a row for, [vertex][column · gdim + axis], empty for others.
struct ReferenceGradients {
  std::vector<std::vector<Measured>> gradient, hessian;
};

/// Applies a table. Magnitudes, one a weight, are what the weights were computed from; none: the weights are exact.
ReferenceGradients reference_gradients(const GradientStencilTable& table, const std::vector<double>& magnitudes,
                                       const ReferenceValues& values,
                                       const std::vector<double>& hessian_magnitudes = {});

/// A column of a rule's value at a point.
Measured reference_value(const InterpolationRule& rule, const ReferenceWeights& weights,
                         const ReferenceCoefficients& coefficients, const ReferenceGradients& gradients,
                         const ReferenceValues& values, int gdim, int column);

}  // namespace halfgrad
