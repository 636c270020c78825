#include "framework/gradient_stencils.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "framework/error.hpp"
#include "framework/parallel.hpp"

namespace halfgrad {

namespace {

// Row r of out is Σ_j (x_j − x_v) ⊗ w_vj with `width` weights an entry, flattened component-major.
template <class Scalar>
Values<Scalar> apply_weights(const GradientStencilTable& table, const std::vector<double>& weights, int width,
                             const Values<Scalar>& values) {
  Values<Scalar> out = Values<Scalar>::Zero(table.num_rows(), values.cols() * width);
  parallel_for(table.num_rows(), 1024, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t r = begin; r < end; ++r) {
      const Index v = table.vertices[r];
      for (Offset e = table.offsets[r]; e < table.offsets[r + 1]; ++e)
        for (Eigen::Index k = 0; k < values.cols(); ++k) {
          const Scalar difference = values(table.neighbors[e], k) - values(v, k);
          for (int a = 0; a < width; ++a)
            out(r, k * width + a) += difference * static_cast<Scalar>(weights[e * width + a]);
        }
    }
  });
  return out;
}

}  // namespace

template <class Scalar>
Values<Scalar> apply_stencils(const GradientStencilTable& table, const Values<Scalar>& values) {
  return apply_weights(table, table.weights, table.gdim, values);
}

template <class Scalar>
Values<Scalar> apply_hessian_stencils(const GradientStencilTable& table, const Values<Scalar>& values) {
  if (!table.has_hessians()) raise("the reconstructor gives no vertex Hessians: use kriging with \"drift\": \"cubic\"");
  return apply_weights(table, table.hessian_weights, num_symmetric(table.gdim), values);
}

std::vector<WeightedEdge> weighted_edges(const AdaptiveBlend& blend, Index row, int gdim) {
  std::vector<WeightedEdge> result;
  double mean = 0;
  for (Offset e = blend.edge_offsets[row]; e < blend.edge_offsets[row + 1]; ++e) {
    // A copy: how Eigen sums what a Map shows depends on its address.
    const Vector edge = Eigen::Map<const Eigen::VectorXd>(blend.edges.data() + e * gdim, gdim);
    const double length = edge.stableNorm();
    result.push_back({edge / length, 1 / length});
    mean += length;
  }
  mean /= static_cast<double>(std::max<std::size_t>(1, result.size()));
  for (WeightedEdge& edge : result) {
    const double weight = std::sqrt(mean * edge.per_length);
    edge.along *= weight;
    edge.per_length *= weight;
  }
  return result;
}

EdgeMetric edge_metric(std::span<const WeightedEdge> edges, int gdim) {
  EdgeMetric result{SmallMatrix::Zero(gdim, gdim), SmallMatrix::Zero(gdim, gdim)};
  for (const WeightedEdge& edge : edges) result.sum += edge.along * edge.along.transpose();
  const double mean = result.sum.trace() / gdim;
  if (mean > 0) result.damped_inverse = (result.sum + 0.1 * mean * SmallMatrix::Identity(gdim, gdim)).inverse();
  return result;
}

GradientStencilTable fitted_rows(const Reconstruction& reconstruction) {
  GradientStencilTable rows = reconstruction.stencils;
  const GradientStencilTable& beyond = reconstruction.blend.value().beyond;
  for (Index r = 0; r < beyond.num_rows(); ++r) append_row(beyond, r, rows);
  return rows;
}

template <class Scalar>
Values<Scalar> blended_gradients(const Reconstruction& reconstruction, const Values<Scalar>& values) {
  const AdaptiveBlend& blend = reconstruction.blend.value();
  const GradientStencilTable& table = reconstruction.stencils;
  const int gdim = table.gdim;
  const Eigen::Index columns = values.cols();
  Values<Scalar> result = apply_stencils(blend.averaging, values);
  const GradientStencilTable rows = fitted_rows(reconstruction);
  const Values<Scalar> fitted = apply_stencils(rows, values);
  parallel_for(table.num_rows(), 256, [&](std::int64_t begin, std::int64_t end) {
    Eigen::MatrixXd average, fit, other, moment;  // #columns × gdim
    Eigen::VectorXd mismatch;
    const auto load = [&](const Values<Scalar>& gradients, Index r, Eigen::MatrixXd& into) {
      into = Eigen::Map<const Values<Scalar>>(gradients.data() + r * columns * gdim, columns, gdim)
                 .template cast<double>();
    };
    for (Index r = static_cast<Index>(begin); r < end; ++r) {
      load(result, r, average);
      load(fitted, r, fit);
      // The mismatches m of the fitted gradient: their squares and Σ m êᵀ tell those of every other gradient.
      double squares = 0;
      moment = Eigen::MatrixXd::Zero(columns, gdim);
      const std::vector<WeightedEdge> edges = weighted_edges(blend, r, gdim);
      const Index* edge_row = blend.edge_rows.data() + blend.edge_offsets[r];
      for (const WeightedEdge& edge : edges) {
        load(fitted, *edge_row, other);
        mismatch =
            2 * edge.per_length *
            (values.row(rows.vertices[*edge_row]) - values.row(table.vertices[r])).transpose().template cast<double>();
        mismatch -= (fit + other) * edge.along;
        squares += mismatch.squaredNorm();
        moment += mismatch * edge.along.transpose();
        ++edge_row;
      }
      const EdgeMetric metric = edge_metric(edges, gdim);
      const Eigen::MatrixXd correction = moment * metric.damped_inverse, change = average - fit;
      const double predicted = squares - correction.cwiseProduct(moment).sum();
      const double averaged = squares + (change * metric.sum - 2 * moment).cwiseProduct(change).sum();
      const auto weight = static_cast<double>(fitted_weight(
          static_cast<Scalar>(squares), static_cast<Scalar>(predicted), static_cast<Scalar>(std::max(0.0, averaged)),
          static_cast<Scalar>(4 * metric.sum.trace() * fit.squaredNorm()), static_cast<Scalar>(blend.caution[r])));
      fit += blend.prediction_share * correction;
      Eigen::Map<Values<Scalar>>(result.data() + r * columns * gdim, columns, gdim) =
          (average + weight * (fit - average)).template cast<Scalar>();
    }
  });
  return result;
}

void drop_short_edges(AdaptiveBlend& blend, double shortest) {
  const auto gdim = static_cast<Offset>(blend.averaging.gdim);
  Offset kept = 0, begin = 0;
  for (std::size_t r = 1; r < blend.edge_offsets.size(); ++r) {
    const Offset end = blend.edge_offsets[r];
    for (Offset e = begin; e < end; ++e) {
      const double* const edge = blend.edges.data() + e * gdim;
      if (Eigen::Map<const Eigen::VectorXd>(edge, gdim).stableNorm() < shortest) continue;
      blend.edge_rows[kept] = blend.edge_rows[e];
      std::copy_n(edge, gdim, blend.edges.begin() + kept++ * gdim);
    }
    begin = end;
    blend.edge_offsets[r] = kept;
  }
  blend.edge_rows.resize(kept);
  blend.edges.resize(kept * gdim);
}

void append_row(const GradientStencilTable& from, Index row, GradientStencilTable& to) {
  const Offset begin = from.offsets[row], end = from.offsets[row + 1];
  const auto append = [&](const auto& source, auto& target, int width) {
    target.insert(target.end(), source.begin() + begin * width, source.begin() + end * width);
  };
  to.vertices.push_back(from.vertices[row]);
  append(from.neighbors, to.neighbors, 1);
  append(from.weights, to.weights, from.gdim);
  if (from.has_hessians()) append(from.hessian_weights, to.hessian_weights, num_symmetric(from.gdim));
  if (!from.diagnostics.empty()) to.diagnostics.push_back(from.diagnostics[row]);
  to.offsets.push_back(to.num_entries());
}

GradientStencilTable split_rows(GradientStencilTable& table, Index first) {
  GradientStencilTable head, tail;
  head.gdim = tail.gdim = table.gdim;
  for (Index r = 0; r < table.num_rows(); ++r) append_row(table, r, r < first ? head : tail);
  table = std::move(head);
  return tail;
}

Reconstruction select_rows(const Reconstruction& reconstruction, std::span<const Index> vertices) {
  const GradientStencilTable& from = reconstruction.stencils;
  if (reconstruction.blend) {
    if (!std::equal(vertices.begin(), vertices.end(), from.vertices.begin(), from.vertices.end()))
      raise("a blended reconstruction must be made for exactly the active vertices, in binding order");
    return reconstruction;
  }
  Index largest = -1;
  for (Index v : from.vertices) largest = std::max(largest, v);
  std::vector<Index> row_of(static_cast<std::size_t>(largest) + 1, -1);
  for (Index r = 0; r < from.num_rows(); ++r) row_of[from.vertices[r]] = r;

  Reconstruction result;
  result.stencils.gdim = from.gdim;
  for (Index v : vertices) {
    if (v > largest || row_of[v] < 0) raise("no gradient stencil for vertex {}: reconstruct every active vertex", v);
    append_row(from, row_of[v], result.stencils);
  }
  return result;
}

template Values<float> blended_gradients(const Reconstruction&, const Values<float>&);
template Values<double> blended_gradients(const Reconstruction&, const Values<double>&);
template Values<float> apply_stencils(const GradientStencilTable&, const Values<float>&);
template Values<double> apply_stencils(const GradientStencilTable&, const Values<double>&);
template Values<float> apply_hessian_stencils(const GradientStencilTable&, const Values<float>&);
template Values<double> apply_hessian_stencils(const GradientStencilTable&, const Values<double>&);

}  // namespace halfgrad
