#include "framework/gradient_stencils.hpp"

#include <algorithm>
#include <array>

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

namespace {

// 1 − w falls with the sixth power of the ratio of roughnesses, which is O(h²) on smooth fields; the choice of 6 and 2
// is measured in docs/adaptive.md. Two fields without roughness agree on every edge: either serves.
double sharp_weight(double fitted, double smooth) {
  const double ratio = fitted > 0 ? fitted / smooth : 0, cubed = ratio * ratio * ratio;
  return 1 / (1 + 2 * cubed * cubed);
}

// The blend for values of `columns` components in a space of `gdim` dimensions, both fixed: a vector instruction serves
// the components, padded to four.
template <class Scalar, int gdim, int columns>
class FixedBlend {
 public:
  FixedBlend(const Reconstruction& reconstruction, const Values<Scalar>& values)
      : table_(reconstruction.stencils), blend_(*reconstruction.blend), values_(values) {}

  Values<Scalar> evaluate() const {
    std::vector<Gradient> sharp(table_.num_rows()), averaged(table_.num_rows());
    parallel_for(table_.num_rows(), 1024, [&](std::int64_t begin, std::int64_t end) {
      for (std::int64_t r = begin; r < end; ++r) {
        sharp[r] = gradient(table_, r);
        averaged[r] = gradient(blend_.averaging, r);
      }
    });
    Values<Scalar> result(blend_.num_blended, columns * gdim);
    parallel_for(blend_.num_blended, 1024, [&](std::int64_t begin, std::int64_t end) {
      for (std::int64_t r = begin; r < end; ++r) {
        const auto weight = static_cast<Scalar>(weight_of(sharp, averaged, r));
        for (int a = 0; a < gdim; ++a) {
          const Four blended = averaged[r][a] + weight * (sharp[r][a] - averaged[r][a]);
          for (int c = 0; c < columns; ++c) result(r, c * gdim + a) = blended[c];
        }
      }
    });
    return result;
  }

 private:
  using Four = Eigen::Array<Scalar, 4, 1>;
  using Gradient = std::array<Four, gdim>;  // a column of F an axis

  // The components, and in the lanes that are left what follows in memory: a copy lane by lane would stall the load.
  Four value(Index vertex) const {
    const Offset begin = static_cast<Offset>(vertex) * columns;
    if (begin + 4 <= values_.size()) return Eigen::Map<const Four>(values_.data() + begin);
    Four four = Four::Zero();
    for (int c = 0; c < columns; ++c) four[c] = values_.data()[begin + c];
    return four;
  }

  // In double: squares of what float holds, 1e-25 or 1e25, are beyond float's numbers.
  static double squared_norm(const Four& four) {
    double sum = 0;
    for (int c = 0; c < columns; ++c) sum += static_cast<double>(four[c]) * static_cast<double>(four[c]);
    return sum;
  }

  Gradient gradient(const GradientStencilTable& table, std::int64_t row) const {
    Gradient sum;
    sum.fill(Four::Zero());
    const Four own = value(table.vertices[row]);
    for (Offset e = table.offsets[row]; e < table.offsets[row + 1]; ++e) {
      const Four difference = value(table.neighbors[e]) - own;
#pragma GCC unroll 3  // keeps the sums in registers at -O2 too
      for (int a = 0; a < gdim; ++a) sum[a] += difference * static_cast<Scalar>(table.weights[e * gdim + a]);
    }
    return sum;
  }

  double weight_of(const std::vector<Gradient>& sharp, const std::vector<Gradient>& averaged, std::int64_t row) const {
    double fitted = 0, smooth = 0;
    const Four own = value(table_.vertices[row]);
    for (Offset e = blend_.edge_offsets[row]; e < blend_.edge_offsets[row + 1]; ++e) {
      const Index other = blend_.edge_rows[e];
      const double* edge = blend_.edges.data() + e * gdim;
      double squared_length = 0;
      Four of_sharp = Scalar(-2) * (value(table_.vertices[other]) - own), of_averaged = of_sharp;
#pragma GCC unroll 3
      for (int a = 0; a < gdim; ++a) {
        squared_length += edge[a] * edge[a];
        const auto component = static_cast<Scalar>(edge[a]);
        of_sharp += (sharp[row][a] + sharp[other][a]) * component;
        of_averaged += (averaged[row][a] + averaged[other][a]) * component;
      }
      fitted += squared_norm(of_sharp) / squared_length;
      smooth += squared_norm(of_averaged) / squared_length;
    }
    return sharp_weight(fitted, smooth);
  }

  const GradientStencilTable& table_;
  const AdaptiveBlend& blend_;
  const Values<Scalar>& values_;
};

// The same for any number of columns.
template <class Scalar>
Values<Scalar> blend_any(const Reconstruction& reconstruction, const Values<Scalar>& values) {
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
      result.row(r) += static_cast<Scalar>(sharp_weight(fitted, smooth)) * (sharp.row(r) - averaged.row(r));
    }
  });
  return result;
}

}  // namespace

template <class Scalar>
Values<Scalar> blended_gradients(const Reconstruction& reconstruction, const Values<Scalar>& values) {
  const int gdim = reconstruction.stencils.gdim;
  if (gdim == 3 && values.cols() == 3) return FixedBlend<Scalar, 3, 3>(reconstruction, values).evaluate();
  if (gdim == 2 && values.cols() == 2) return FixedBlend<Scalar, 2, 2>(reconstruction, values).evaluate();
  if (gdim == 2 && values.cols() == 3) return FixedBlend<Scalar, 2, 3>(reconstruction, values).evaluate();
  return blend_any(reconstruction, values);
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
