#include "framework/gradient_stencils.hpp"

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

template <class Scalar>
Values<Scalar> blended_gradients(const Reconstruction& reconstruction, const Values<Scalar>& values) {
  const AdaptiveBlend& blend = reconstruction.blend.value();
  const GradientStencilTable& table = reconstruction.stencils;
  const Values<Scalar> sharp = apply_stencils(table, values), averaged = apply_stencils(blend.averaging, values);
  const int gdim = table.gdim;
  const auto roughness = [&](const Values<Scalar>& gradients, Index row) {
    double sum = 0;
    for (Offset e = blend.edge_offsets[row]; e < blend.edge_offsets[row + 1]; ++e) {
      const Index other = blend.edge_rows[e];
      double squared = 0, length = 0;
      for (int k = 0; k < gdim; ++k) length += blend.edges[e * gdim + k] * blend.edges[e * gdim + k];
      for (Eigen::Index c = 0; c < values.cols(); ++c) {
        double mismatch = -2 * static_cast<double>(values(table.vertices[other], c) - values(table.vertices[row], c));
        for (int k = 0; k < gdim; ++k)
          mismatch += static_cast<double>(gradients(row, c * gdim + k) + gradients(other, c * gdim + k)) *
                      blend.edges[e * gdim + k];
        squared += mismatch * mismatch;
      }
      sum += squared / length;
    }
    return sum;
  };
  Values<Scalar> result = averaged.topRows(blend.num_blended);
  parallel_for(blend.num_blended, 1024, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t r = begin; r < end; ++r) {
      const double smooth = roughness(averaged, static_cast<Index>(r)),
                   fitted = roughness(sharp, static_cast<Index>(r));
      // 1 − w falls with the sixth power of the ratio, which is O(h²) on smooth fields; the choice of 6 and 2 is
      // measured in docs/adaptive.md. Two fields without roughness agree on every edge: either serves.
      const double ratio = fitted > 0 ? fitted / smooth : 0;
      const Scalar weight = static_cast<Scalar>(1 / (1 + 2 * std::pow(ratio, 6)));
      result.row(r) += weight * (sharp.row(r) - averaged.row(r));
    }
  });
  return result;
}

Reconstruction select_rows(const Reconstruction& reconstruction, std::span<const Index> vertices) {
  const GradientStencilTable& from = reconstruction.stencils;
  if (reconstruction.blend) {
    if (reconstruction.blend->num_blended != static_cast<Index>(vertices.size()) ||
        !std::equal(vertices.begin(), vertices.end(), from.vertices.begin()))
      raise("a blended reconstruction must be made for exactly the active vertices, in binding order");
    return reconstruction;
  }
  Index largest = -1;
  for (Index v : from.vertices) largest = std::max(largest, v);
  std::vector<Index> row_of(static_cast<std::size_t>(largest) + 1, -1);
  for (Index r = 0; r < from.num_rows(); ++r) row_of[from.vertices[r]] = r;

  Reconstruction result;
  GradientStencilTable& to = result.stencils;
  to.gdim = from.gdim;
  to.vertices.assign(vertices.begin(), vertices.end());
  const int symmetric = num_symmetric(from.gdim);
  for (Index v : vertices) {
    if (v > largest || row_of[v] < 0) raise("no gradient stencil for vertex {}: reconstruct every active vertex", v);
    const Index r = row_of[v];
    const Offset begin = from.offsets[r], end = from.offsets[r + 1];
    to.neighbors.insert(to.neighbors.end(), from.neighbors.begin() + begin, from.neighbors.begin() + end);
    to.weights.insert(to.weights.end(), from.weights.begin() + begin * from.gdim,
                      from.weights.begin() + end * from.gdim);
    if (from.has_hessians())
      to.hessian_weights.insert(to.hessian_weights.end(), from.hessian_weights.begin() + begin * symmetric,
                                from.hessian_weights.begin() + end * symmetric);
    if (!from.diagnostics.empty()) to.diagnostics.push_back(from.diagnostics[r]);
    to.offsets.push_back(to.num_entries());
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
