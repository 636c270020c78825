// The vertex stage: what a frame needs of the active vertices besides their values.
#include "framework/interpolant_binding.hpp"
#include "framework/kernels/blend_stage.hpp"

namespace halfgrad {

template <class Scalar>
Scalar* Interpolant<Scalar>::Binding::pack_positions(const Values<Scalar>& values, Offset count,
                                                     Workspace<Scalar>& workspace) const {
  Scalar* const positions = reserve<Scalar>(workspace.positions, 4 * count);
  with_columns(values.cols(), [&](auto fixed) {
    constexpr int columns = fixed();
    if constexpr (columns > 0)
      parallel_for(count, vertex_grain(count), [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t v = begin; v < end; ++v) {
          const Scalar* from = values.data() + static_cast<Offset>(vertices[v]) * columns;
          for (int c = 0; c < 4; ++c) positions[4 * v + c] = c < columns ? from[c] : Scalar(0);
        }
      });
  });
  return positions;
}

template <class Scalar>
void Interpolant<Scalar>::Binding::vertex_lines(const Scalar* positions, const std::array<Scalar, 9>& scale,
                                                Workspace<Scalar>& workspace, Scalar* lines) const {
  const auto run = [](Index num_rows, const auto& stage) {
    parallel_for(num_rows, vertex_grain(num_rows), [&](std::int64_t begin, std::int64_t end) {
      stage.run(static_cast<Index>(begin), static_cast<Index>(end));
    });
  };
  if (!blended) return run(num_active, vertex_stage(stencils, scale, positions, lines));
  std::array<Scalar, 9> one;
  one.fill(1);
  Scalar* const fitted = reserve<Scalar>(workspace.fitted, stencils.num_rows() * 4 * (1 + Offset{gdim}));
  run(num_active, vertex_stage(blend.averaging, one, positions, lines));
  run(stencils.num_rows(), vertex_stage(stencils, one, positions, fitted));
  const AdaptiveBlend& given = *blended->blend;
  run(num_active, kernels::BlendStage<Scalar>{.dim = gdim,
                                              .edge_offsets = given.edge_offsets.data(),
                                              .edge_rows = given.edge_rows.data(),
                                              .edges = blend.edges.data(),
                                              .metrics = blend.metrics.data(),
                                              .caution = blend.caution.data(),
                                              .fitted = fitted,
                                              .prediction_share = static_cast<Scalar>(given.prediction_share),
                                              .scale = scale,
                                              .lines = lines});
}

template <class Scalar>
void Interpolant<Scalar>::Binding::vertex_derivatives(const Values<Scalar>& values, Kernel kernel,
                                                      Workspace<Scalar>& workspace, Values<Scalar>& gradients,
                                                      Values<Scalar>& hessians) const {
  const Eigen::Index columns = values.cols();
  const int symmetric = rule.needs_hessians() ? num_symmetric(gdim) : 0;
  if (kernel == Kernel::plain || !is_fast_width(columns) || gdim > kernels::max_simplex_dim) {
    if (blended)
      gradients = blended_gradients(*blended, values);
    else
      plain_vertex_stage(values, 0, gdim, gradients);
    if (symmetric > 0) plain_vertex_stage(values, gdim, symmetric, hessians);
    return;
  }
  const Scalar* const positions = pack_positions(values, static_cast<Offset>(vertices.size()), workspace);
  const Offset length = 4 * (1 + gdim + symmetric);
  Scalar* const lines = reserve<Scalar>(workspace.lines, num_active * length);
  std::array<Scalar, 9> one;
  one.fill(1);
  vertex_lines(positions, one, workspace, lines);
  const auto unpack = [&](int first, int width, Values<Scalar>& out) {
    out.resize(num_active, columns * width);
    for (Offset v = 0; v < num_active; ++v)
      for (Eigen::Index c = 0; c < columns; ++c)
        for (int k = 0; k < width; ++k) out(v, c * width + k) = lines[v * length + 4 * (1 + first + k) + c];
  };
  unpack(0, gdim, gradients);
  if (symmetric > 0) unpack(gdim, symmetric, hessians);
}

template <class Scalar>
void Interpolant<Scalar>::Binding::plain_vertex_stage(const Values<Scalar>& values, int first_weight, int width,
                                                      Values<Scalar>& out) const {
  const Eigen::Index columns = values.cols();
  out.resize(num_active, columns * width);
  parallel_for(num_active, vertex_grain(num_active), [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t r = begin; r < end; ++r) {
      Scalar* row = out.data() + r * columns * width;
      std::fill(row, row + columns * width, Scalar(0));
      const Scalar* own = values.data() + static_cast<Offset>(vertices[r]) * columns;
      for (Offset e = stencils.begin(r); e < stencils.end(r); ++e) {
        const Scalar* other = values.data() + static_cast<Offset>(vertices[stencils.neighbors[e]]) * columns;
        for (Eigen::Index c = 0; c < columns; ++c) {
          const Scalar difference = other[c] - own[c];
          for (int k = 0; k < width; ++k) row[c * width + k] += difference * stencils.weight(e, first_weight + k);
        }
      }
    }
  });
}

template <class Scalar>
void Interpolant<Scalar>::vertex_derivatives(const Values<Scalar>& values, Values<Scalar>& gradients,
                                             Values<Scalar>& hessians) const {
  binding_->require_values(values);
  binding_->require_gradients();
  if (!binding_->rule.needs_hessians()) hessians.resize(0, 0);
  Workspace<Scalar> workspace;
  binding_->vertex_derivatives(values, Kernel::fast, workspace, gradients, hessians);
}

template <class Scalar>
Values<Scalar> Interpolant<Scalar>::vertex_gradients(const Values<Scalar>& values) const {
  Values<Scalar> gradients, hessians;
  vertex_derivatives(values, gradients, hessians);
  return gradients;
}

template float* Interpolant<float>::Binding::pack_positions(const Values<float>&, Offset, Workspace<float>&) const;
template void Interpolant<float>::Binding::vertex_lines(const float*, const std::array<float, 9>&, Workspace<float>&,
                                                        float*) const;
template void Interpolant<float>::Binding::vertex_derivatives(const Values<float>&, Kernel, Workspace<float>&,
                                                              Values<float>&, Values<float>&) const;
template Values<float> Interpolant<float>::vertex_gradients(const Values<float>&) const;
template void Interpolant<float>::vertex_derivatives(const Values<float>&, Values<float>&, Values<float>&) const;
template double* Interpolant<double>::Binding::pack_positions(const Values<double>&, Offset, Workspace<double>&) const;
template void Interpolant<double>::Binding::vertex_lines(const double*, const std::array<double, 9>&,
                                                         Workspace<double>&, double*) const;
template void Interpolant<double>::Binding::vertex_derivatives(const Values<double>&, Kernel, Workspace<double>&,
                                                               Values<double>&, Values<double>&) const;
template Values<double> Interpolant<double>::vertex_gradients(const Values<double>&) const;
template void Interpolant<double>::vertex_derivatives(const Values<double>&, Values<double>&, Values<double>&) const;

}  // namespace halfgrad
