#include "framework/gradient_stencils.hpp"

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

template Values<float> apply_stencils(const GradientStencilTable&, const Values<float>&);
template Values<double> apply_stencils(const GradientStencilTable&, const Values<double>&);
template Values<float> apply_hessian_stencils(const GradientStencilTable&, const Values<float>&);
template Values<double> apply_hessian_stencils(const GradientStencilTable&, const Values<double>&);

}  // namespace halfgrad
