#include "experiments/stress_reference.hpp"

#include "framework/kernels/formulas.hpp"

namespace halfgrad {

namespace {

template <Element E>
std::array<Measured, E::num_nodes> shape_of(const std::array<Measured, E::dim>& xi) {
  std::array<Measured, E::num_nodes> beta;
  if constexpr (PolynomialElement<E>) {
    for (std::size_t m = 0; m < E::shape_monomials.size(); ++m) {
      Measured monomial(1);
      for (int k = 0; k < E::dim; ++k)
        for (int power = 0; power < E::shape_monomials[m][k]; ++power) monomial = monomial * xi[k];
      for (int i = 0; i < E::num_nodes; ++i)
        if (E::shape_coefficients[m][i] != 0) beta[i] = beta[i] + Measured(E::shape_coefficients[m][i]) * monomial;
    }
  } else {
    // Affine, or rational with terms between −1 and 1: the element's own function of numbers that are exact in double.
    ReferencePoint<E> position;
    long double magnitude = 1;
    for (int k = 0; k < E::dim; ++k) {
      position[k] = static_cast<double>(xi[k].value);
      magnitude += xi[k].magnitude;
    }
    const NodeVector<E> plain = E::shape(position);
    for (int i = 0; i < E::num_nodes; ++i) beta[i] = {plain[i], std::abs(plain[i]) + magnitude};
    if constexpr (E::affine) {
      Measured first(1);
      for (int k = 0; k < E::dim; ++k) {
        first = first - xi[k];
        beta[k + 1] = xi[k];
      }
      beta[0] = first;
    }
  }
  return beta;
}

template <Element E>
void fill_beta(const Embedding& embedding, Index point, const OutsidePoint* outside,
               std::array<Measured, max_nodes>& beta) {
  std::array<Measured, E::dim> xi;
  ReferencePoint<E> position;
  for (int k = 0; k < E::dim; ++k) {
    position[k] = embedding.local(point, k);
    xi[k] = Measured(position[k]);
    // On a simplex the rest of the way to a point outside is part of ξ.
    if (E::affine && outside != nullptr) xi[k] = xi[k] + Measured(outside->offset[k]);
  }
  const auto inside = shape_of<E>(xi);
  std::copy(inside.begin(), inside.end(), beta.begin());
  if (E::affine || outside == nullptr) return;
  const NodeMatrix<E> gradient = E::shape_gradient(position);
  // The gradient's entries are sums of products of numbers between 0 and 1, at most 2^dim of them.
  for (int i = 0; i < E::num_nodes; ++i)
    for (int k = 0; k < E::dim; ++k)
      beta[i] = beta[i] + Measured(gradient(i, k), 1 << E::dim) * Measured(outside->offset[k]);
}

// On simplices the fast path goes edge by edge: X − X_i = Σ_j β_j (X_j − X_i), with the products of that sum. They are
// greater than those of X only outside, where weights have both signs.
template <int d>
void add_edges(const InterpolationRule& rule, const ReferenceWeights& weights, ReferenceCoefficients& result) {
  const bool hermite = rule.formula == Formula::hermite;
  if (rule.formula == Formula::dual_taylor || !rule.needs_gradients()) return;
  const double alpha = rule.formula == Formula::blend ? rule.alpha : 0.5;
  for (int i = 0; i < weights.num_nodes; ++i)
    for (int j = 0; j < weights.num_nodes; ++j) {
      const long double own = weights.beta[i].magnitude, other = weights.beta[j].magnitude;
      if (hermite) result.a[i].magnitude += own * other * (own + other);
      for (int k = 0; k < d; ++k)
        result.c[i][k].magnitude += alpha * own * other * (hermite ? 1 + own + other : 1) *
                                    std::abs(weights.rest[j][k].value - weights.rest[i][k].value);
    }
}

template <int d>
ReferenceCoefficients coefficients_in(const InterpolationRule& rule, const ReferenceWeights& weights) {
  std::array<std::array<Measured, d>, max_nodes> rest;
  for (int i = 0; i < max_nodes; ++i) std::copy_n(weights.rest[i].begin(), d, rest[i].begin());
  const auto found = kernels::point_coefficients<Measured, Measured, max_nodes, d>(rule, weights.beta, rest);
  ReferenceCoefficients result;
  for (int i = 0; i < weights.num_nodes; ++i) {
    result.a[i] = found.a[i];
    std::copy_n(found.c[i].begin(), d, result.c[i].begin());
    if (rule.needs_hessians()) std::copy_n(found.q[i].begin(), num_symmetric(d), result.q[i].begin());
  }
  if (weights.is_simplex) add_edges<d>(rule, weights, result);
  return result;
}

}  // namespace

Measured difference(const ReferenceValues& values, Index vertex, Index from, int column) {
  const long double x = values.values(vertex, column), origin = values.values(from, column);
  Measured result(x - origin);
  if (!values.rounding.empty())
    result.magnitude += static_cast<long double>(values.rounding[vertex]) + values.rounding[from];
  return result;
}

ReferenceWeights reference_weights(const Mesh& mesh, const Embedding& embedding, Index point,
                                   const OutsidePoint* outside) {
  ReferenceWeights result;
  const Index cell = embedding.cells[point];
  with_cell(mesh, cell, [&]<Element E>(const ElementBlock<E>& block, Eigen::Index row) {
    result.num_nodes = E::num_nodes;
    result.is_simplex = E::affine;
    double largest = 0;
    for (int i = 0; i < E::num_nodes; ++i)
      largest = std::max(largest, mesh.vertices().row(block.cells(row, i)).cwiseAbs().maxCoeff());
    for (int i = 0; i < E::num_nodes; ++i) {
      result.vertices[i] = block.cells(row, i);
      for (int k = 0; k < E::dim; ++k) {
        const long double from = mesh.vertices()(block.cells(row, 0), k);
        result.rest[i][k] = Measured(mesh.vertices()(block.cells(row, i), k) - from);
        if (!E::affine) result.rest[i][k].magnitude += 8 * largest;
      }
    }
    fill_beta<E>(embedding, point, outside, result.beta);
  });
  return result;
}

ReferenceCoefficients reference_coefficients(const InterpolationRule& rule, const ReferenceWeights& weights, int gdim) {
  if (gdim == 1) return coefficients_in<1>(rule, weights);
  return gdim == 2 ? coefficients_in<2>(rule, weights) : coefficients_in<3>(rule, weights);
}

ReferenceGradients reference_gradients(const GradientStencilTable& table, const std::vector<double>& magnitudes,
                                       const ReferenceValues& values, const std::vector<double>& hessian_magnitudes) {
  const int d = table.gdim, sym = num_symmetric(d);
  const auto columns = static_cast<int>(values.values.cols());
  ReferenceGradients result;
  result.gradient.resize(values.values.rows());
  if (table.has_hessians()) result.hessian.resize(values.values.rows());
  for (Index r = 0; r < table.num_rows(); ++r) {
    const Index v = table.vertices[r];
    std::vector<Measured>& gradient = result.gradient[v];
    gradient.assign(static_cast<std::size_t>(columns) * d, {});
    if (table.has_hessians()) result.hessian[v].assign(static_cast<std::size_t>(columns) * sym, {});
    for (Offset e = table.offsets[r]; e < table.offsets[r + 1]; ++e)
      for (int c = 0; c < columns; ++c) {
        const Measured x = difference(values, table.neighbors[e], v, c);
        const auto add = [&](Measured& to, const std::vector<double>& weights, const std::vector<double>& of_weights,
                             Offset at) {
          to = to + x * (of_weights.empty() ? Measured(weights[at]) : Measured(weights[at], of_weights[at]));
        };
        for (int k = 0; k < d; ++k) add(gradient[c * d + k], table.weights, magnitudes, e * d + k);
        for (int k = 0; k < sym && table.has_hessians(); ++k)
          add(result.hessian[v][c * sym + k], table.hessian_weights, hessian_magnitudes, e * sym + k);
      }
  }
  return result;
}

Measured reference_value(const InterpolationRule& rule, const ReferenceWeights& weights,
                         const ReferenceCoefficients& coefficients, const ReferenceGradients& gradients,
                         const ReferenceValues& values, int gdim, int column) {
  const Index first = weights.vertices[0];
  Measured result(values.values(first, column));
  if (!values.rounding.empty()) result.magnitude += values.rounding[first];
  const int sym = num_symmetric(gdim);
  for (int i = 0; i < weights.num_nodes; ++i) {
    const Index v = weights.vertices[i];
    if (i > 0) result = result + coefficients.a[i] * difference(values, v, first, column);
    if (rule.needs_gradients())
      for (int k = 0; k < gdim; ++k) result = result + coefficients.c[i][k] * gradients.gradient[v][column * gdim + k];
    if (rule.needs_hessians())
      for (int k = 0; k < sym; ++k) result = result + coefficients.q[i][k] * gradients.hessian[v][column * sym + k];
  }
  return result;
}

}  // namespace halfgrad
