// What follows from a binding besides the values: gradients at the points, and the map as a matrix.
#include <Eigen/LU>

#include "framework/interpolant_binding.hpp"
#include "framework/kernels/formulas.hpp"

namespace halfgrad {

template <class Scalar>
Values<Scalar> Interpolant<Scalar>::gradient(const Values<Scalar>& values) const {
  const Binding& binding = *binding_;
  binding.require_values(values);
  if (binding.weighted.num_points() > 0)
    raise("the gradient of the interpolant at points given by their weights is not known: use smooth_gradient");
  const bool with_gradients = binding.rule.needs_gradients();
  const bool with_hessians = binding.rule.needs_hessians();
  Workspace<Scalar> workspace;
  const Values<Scalar>&gradients = workspace.gradients, &hessians = workspace.hessians;
  if (with_gradients) {
    binding.require_gradients();
    binding.vertex_derivatives(values, Kernel::fast, workspace, workspace.gradients, workspace.hessians);
  }
  const Eigen::Index columns = values.cols();
  Values<Scalar> out =
      Values<Scalar>::Constant(num_points(), columns * binding.gdim, std::numeric_limits<Scalar>::quiet_NaN());
  binding.for_each_range([&]<class AnyElementRuns>(const AnyElementRuns& runs, Index begin, Index end) {
    using E = typename AnyElementRuns::element;
    constexpr int n = E::num_nodes, d = E::dim, sym = num_symmetric(d);
    for (Index run = begin; run < end; ++run)
      for (Index p = runs.first[run]; p < runs.first[run + 1]; ++p) {
        const NodeMatrix<E> reference = E::shape_gradient(runs.xi(p));
        Eigen::Matrix<double, d, d> jacobian = Eigen::Matrix<double, d, d>::Zero();
        for (int i = 0; i < n; ++i)
          for (int k = 0; k < d; ++k) jacobian.row(k) += static_cast<double>(runs.rest[run][i][k]) * reference.row(i);
        const NodeVector<E> weights = runs.beta(p);
        Scalar* result = out.data() + static_cast<Offset>(binding.permutation[runs.base + p]) * columns * d;
        // Where the map of the cell folds to a point or a line (a hexahedron's collapsed corner) no gradient of the
        // weights exists; the continuous one does.
        double scale = 0;
        for (int i = 1; i < n; ++i) {
          double squared = 0;
          for (int k = 0; k < d; ++k) squared += static_cast<double>(runs.rest[run][i][k]) * runs.rest[run][i][k];
          scale = std::max(scale, std::sqrt(squared));
        }
        const bool singular = !(std::abs(jacobian.determinant()) > 1e-14 * std::pow(scale, d));
        if (singular) {
          for (Eigen::Index c = 0; c < columns * d; ++c) {
            Scalar sum = 0;
            if (with_gradients)
              for (int i = 0; i < n; ++i) sum += static_cast<Scalar>(weights[i]) * gradients(runs.nodes[run][i], c);
            result[c] = sum;
          }
          continue;
        }
        const NodeMatrix<E> spatial = reference * jacobian.inverse();
        std::array<kernels::Dual<Scalar, d>, n> beta;
        for (int i = 0; i < n; ++i) {
          beta[i].value = static_cast<Scalar>(weights[i]);
          for (int k = 0; k < d; ++k) beta[i].derivative[k] = static_cast<Scalar>(spatial(i, k));
        }
        const auto coefficients =
            kernels::point_coefficients<kernels::Dual<Scalar, d>, Scalar, n, d>(binding.rule, beta, runs.rest[run]);
        const auto& nodes = runs.nodes[run];
        for (Eigen::Index c = 0; c < columns; ++c)
          for (int k = 0; k < d; ++k) {
            Scalar sum = 0;
            for (int i = 1; i < n; ++i)
              sum += coefficients.a[i].derivative[k] *
                     (values(binding.vertices[nodes[i]], c) - values(binding.vertices[nodes[0]], c));
            if (with_gradients)
              for (int i = 0; i < n; ++i)
                for (int l = 0; l < d; ++l) sum += gradients(nodes[i], c * d + l) * coefficients.c[i][l].derivative[k];
            if (with_hessians)
              for (int i = 0; i < n; ++i)
                for (int l = 0; l < sym; ++l)
                  sum += hessians(nodes[i], c * sym + l) * coefficients.q[i][l].derivative[k];
            result[c * d + k] = sum;
          }
      }
  });
  return out;
}

template <class Scalar>
Values<Scalar> Interpolant<Scalar>::smooth_gradient(const Values<Scalar>& values) const {
  const Binding& binding = *binding_;
  const Values<Scalar> gradients = vertex_gradients(values);
  Values<Scalar> out =
      Values<Scalar>::Constant(num_points(), gradients.cols(), std::numeric_limits<Scalar>::quiet_NaN());
  binding.for_each_range([&]<class AnyElementRuns>(const AnyElementRuns& runs, Index begin, Index end) {
    using E = typename AnyElementRuns::element;
    for (Index run = begin; run < end; ++run)
      for (Index p = runs.first[run]; p < runs.first[run + 1]; ++p) {
        const NodeVector<E> weights = runs.beta(p);
        auto row = out.row(binding.permutation[runs.base + p]);
        row.setZero();
        for (int i = 0; i < E::num_nodes; ++i)
          row += static_cast<Scalar>(weights[i]) * gradients.row(runs.nodes[run][i]);
      }
  });
  if (binding.weighted.num_points() > 0) binding.add_weighted_means(gradients, out);
  return out;
}

template <class Scalar>
void Interpolant<Scalar>::Binding::add_entries(Index point, Index node, double a, const double* c, const double* q,
                                               Entries& entries) const {
  double own = a;
  if (rule.needs_gradients())
    for (Offset e = stencils.begin(node); e < stencils.end(node); ++e) {
      double weight = 0;
      for (int k = 0; k < gdim; ++k) weight += c[k] * static_cast<double>(stencils.weight(e, k));
      if (rule.needs_hessians())
        for (int k = 0; k < num_symmetric(gdim); ++k)
          weight += q[k] * static_cast<double>(stencils.weight(e, gdim + k));
      entries.emplace_back(point, vertices[stencils.neighbors[e]], weight);
      own -= weight;
    }
  entries.emplace_back(point, vertices[node], own);
}

template <class Scalar>
Eigen::SparseMatrix<double, Eigen::RowMajor> Interpolant<Scalar>::matrix() const {
  const Binding& binding = *binding_;
  if (binding.rule.needs_gradients()) binding.require_gradients();
  if (binding.blended) raise("adaptive gradients depend on the data: there is no matrix of the map");
  typename Binding::Entries entries;
  for (const auto& any : binding.blocks)
    std::visit(
        [&]<class AnyElementRuns>(const AnyElementRuns& runs) {
          using E = typename AnyElementRuns::element;
          constexpr int n = E::num_nodes, d = E::dim;
          for (Index run = 0; run < runs.num_runs(); ++run)
            for (Index p = runs.first[run]; p < runs.first[run + 1]; ++p) {
              const NodeVector<E> weights = runs.beta(p);
              std::array<double, n> beta;
              std::array<std::array<double, d>, n> rest;
              for (int i = 0; i < n; ++i) {
                beta[i] = weights[i];
                for (int k = 0; k < d; ++k) rest[i][k] = runs.rest[run][i][k];
              }
              const auto coefficients = kernels::point_coefficients<double, double, n, d>(binding.rule, beta, rest);
              for (int i = 0; i < n; ++i)
                binding.add_entries(binding.permutation[runs.base + p], runs.nodes[run][i], coefficients.a[i],
                                    coefficients.c[i].data(), coefficients.q[i].data(), entries);
            }
        },
        any);
  binding.add_weighted_entries(entries);
  Eigen::SparseMatrix<double, Eigen::RowMajor> matrix(num_points(), num_vertices());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

template void Interpolant<float>::Binding::add_entries(Index, Index, double, const double*, const double*,
                                                       Entries&) const;
template void Interpolant<double>::Binding::add_entries(Index, Index, double, const double*, const double*,
                                                        Entries&) const;
template Values<float> Interpolant<float>::gradient(const Values<float>&) const;
template Values<double> Interpolant<double>::gradient(const Values<double>&) const;
template Values<float> Interpolant<float>::smooth_gradient(const Values<float>&) const;
template Values<double> Interpolant<double>::smooth_gradient(const Values<double>&) const;
template Eigen::SparseMatrix<double, Eigen::RowMajor> Interpolant<float>::matrix() const;
template Eigen::SparseMatrix<double, Eigen::RowMajor> Interpolant<double>::matrix() const;

}  // namespace halfgrad
