// The linear algebra of one kriging stencil.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace halfgrad {

/// What a patch of points gives: weights on the differences f(y_j) − f(0), in the coordinates of the patch.
struct KrigingFit {
  Eigen::MatrixXd gradient;            ///< dim × #points
  Eigen::MatrixXd hessian;             ///< num_symmetric(dim) × #points with cubic drift, else empty
  double smallest_singular_value = 0;  ///< over the drift's modes of degree two and three
  double absolute_sum = 0;             ///< A1 = Σ_j |g_j|
  double quadratic_response = 0;       ///< E2: Frobenius norm of the response to unit quadratics, 0 where exact
  double expected_error = 0;           ///< J = sqrt(E2² / 0.1² + kriging variance / a⁶)
};

/// Weights that take the gradient (dim × #points) and Hessian (any rows) of linear functions, from their differences
/// along `edges` (dim × #points), to the identity and zero as far as rounding lets them: steps of Newton's iteration
/// for an inverse (Schulz 1933) on Σ g_j e_jᵀ. Where the edges do not span the space it changes nothing but rounding.
void restore_affine(const Eigen::Ref<const Eigen::MatrixXd>& edges, Eigen::Ref<Eigen::MatrixXd> gradient,
                    Eigen::Ref<Eigen::MatrixXd> hessian);

/// Universal kriging of the gradient (and Hessian) at the origin from differences to it: a polynomial drift of degree
/// two or three, Matérn-7/2 covariance of what is left, and damping of the modes that the points barely determine.
/// Holds the workspace; one a thread.
class KrigingSystem {
 public:
  /// dim 1 to 4; degree of the drift 2 or 3.
  KrigingSystem(int dim, int degree);

  /// Points, dim × #points with #points ≥ 1, in units of the neighbours' distance. Overwrites `fit`.
  void solve(const Eigen::Ref<const Eigen::MatrixXd>& points, KrigingFit& fit);

 private:
  int dim_, degree_;
  std::vector<double> memory_;
};

}  // namespace halfgrad
