#include "reconstruction/kriging_system.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "framework/types.hpp"

namespace halfgrad {

namespace {

using Block = Eigen::Map<Eigen::MatrixXd>;
using Eigen::ArrayXd;
using Eigen::MatrixXd;

// Correlation length in units of the neighbours' distance.
constexpr double correlation_length = 6;
// Bounds the condition of the covariance and A1; the cubic drift leaves less for the covariance to explain.
constexpr double quadratic_nugget = 1e-5, cubic_nugget = 1e-6;
// Modes with smaller singular values are damped.
constexpr double full_inverse = 2;
constexpr int max_modes = 20;  // of the cubic stage in four dimensions
using SmallSquare = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, max_modes, max_modes>;

constexpr int num_cubic(int dim) { return dim * (dim + 1) * (dim + 2) / 6; }

// Hands out blocks of one allocation, so that a solve does not touch the heap once the memory is large enough.
class Arena {
 public:
  explicit Arena(std::vector<double>& memory) : next_(memory.data()), end_(next_ + memory.size()) {}
  Block take(Eigen::Index rows, Eigen::Index cols) {
    eigen_assert(next_ + rows * cols <= end_);
    Block block(next_, rows, cols);
    next_ += rows * cols;
    return block;
  }

 private:
  double *next_, *end_;
};

// k(r) = (1 + s + 2/5 s² + s³/15) e^−s, s = √7 r / ℓ, of squared distances, in place.
template <class Array>
void correlate(Array&& squared_distance, double rate) {
  squared_distance = rate * squared_distance.sqrt();
  squared_distance =
      (1 + squared_distance * (1 + squared_distance * (0.4 + squared_distance / 15))) * (-squared_distance).exp();
}

// Columns: monomials of degree one, two (and three), scaled so that the norm of a polynomial's coefficients is the
// Frobenius norm of its derivative tensor: sqrt(multinomial) / degree! times the product.
void fill_drift(const Eigen::Ref<const MatrixXd>& points, int degree, Eigen::Ref<MatrixXd> drift) {
  const Eigen::Index dim = points.rows();
  Eigen::Index column = 0;
  for (Eigen::Index a = 0; a < dim; ++a) drift.col(column++) = points.row(a).transpose();
  for (Eigen::Index a = 0; a < dim; ++a)
    for (Eigen::Index b = a; b < dim; ++b)
      drift.col(column++) = (a == b ? 0.5 : std::sqrt(0.5)) * points.row(a).cwiseProduct(points.row(b)).transpose();
  if (degree < 3) return;
  for (Eigen::Index a = 0; a < dim; ++a)
    for (Eigen::Index b = a; b < dim; ++b)
      for (Eigen::Index c = b; c < dim; ++c) {
        const double multinomial = a == b && b == c ? 1 : (a == b || b == c ? 3 : 6);
        drift.col(column++) = std::sqrt(multinomial) / 6 *
                              points.row(a).cwiseProduct(points.row(b)).cwiseProduct(points.row(c)).transpose();
      }
}

// One degree of the drift, fitted to what the degrees before it leave.
struct Stage {
  Block columns;    // its whitened drift columns, #points × size
  Block inverse;    // filtered pseudo-inverse of the columns' part outside the basis, size × #points
  Block operation;  // Z: from data to this degree's coefficients, size × #points
};

// A ← A V with orthogonal columns, by rotations of pairs (one-sided Jacobi: Hestenes 1958); V is accumulated. The norms
// of the columns are then the singular values, to high relative accuracy, and no zero column is divided by.
void orthogonalize_columns(SmallSquare& a, SmallSquare& v) {
  const Eigen::Index size = a.cols();
  v.setIdentity(size, size);
  const double negligible = 1e-24 * a.squaredNorm();
  for (int sweep = 0; sweep < 30; ++sweep) {
    bool rotated = false;
    for (Eigen::Index p = 0; p < size; ++p)
      for (Eigen::Index q = p + 1; q < size; ++q) {
        const double pp = a.col(p).squaredNorm(), qq = a.col(q).squaredNorm(), pq = a.col(p).dot(a.col(q));
        if (!(std::abs(pq) > 1e-14 * std::sqrt(pp * qq)) || std::min(pp, qq) <= negligible) continue;
        rotated = true;
        const double zeta = (qq - pp) / (2 * pq);
        const double t = (zeta < 0 ? -1 : 1) / (std::abs(zeta) + std::sqrt(1 + zeta * zeta));
        const double c = 1 / std::sqrt(1 + t * t), s = c * t;
        const auto rotate = [&](double* x, double* y, Eigen::Index count) {
          for (Eigen::Index i = 0; i < count; ++i) {
            const double old = x[i];
            x[i] = c * old - s * y[i];
            y[i] = s * old + c * y[i];
          }
        };
        rotate(a.col(p).data(), a.col(q).data(), a.rows());
        rotate(v.col(p).data(), v.col(q).data(), size);
      }
    if (!rotated) return;
  }
}

// Takes the part along the first `count` columns of `basis`, which are orthonormal or zero, out of a column; twice is
// enough for orthogonality to round-off. Adds the coefficients to the first entries of `coefficients`.
template <class Column, class Coefficients>
void project_out(const Block& basis, Eigen::Index count, Column&& column, Coefficients&& coefficients) {
  for (int pass = 0; pass < 2; ++pass)
    for (Eigen::Index k = 0; k < count; ++k) {
      const double along = basis.col(k).dot(column);
      column -= along * basis.col(k);
      coefficients[k] += along;
    }
}

// Projects the stage's columns on the complement of the basis, inverts what is left and extends the basis by the modes
// that are determined. Returns the smallest singular value.
double fit_stage(Stage& stage, bool damp, Block& basis, Eigen::Index& num_basis, Block& projected) {
  const Eigen::Index size = stage.columns.cols(), num_before = num_basis;
  projected = stage.columns;
  // projected = Q R with a small R, whose singular values are wanted.
  SmallSquare r = SmallSquare::Zero(size, size), v;
  Eigen::VectorXd ignored = Eigen::VectorXd::Zero(num_before);
  for (Eigen::Index c = 0; c < size; ++c) {
    auto column = projected.col(c);
    const double before = column.norm();
    project_out(basis, num_before, column, ignored);
    project_out(projected, c, column, r.col(c));
    const double norm = column.norm();
    if (norm > 1e-14 * before) {
      r(c, c) = norm;
      column /= norm;
    } else {
      column.setZero();
    }
  }
  orthogonalize_columns(r, v);
  const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, max_modes, 1> singular = r.colwise().norm().transpose();
  const double largest = singular.maxCoeff();
  SmallSquare filtered = SmallSquare::Zero(size, size);  // V f(S) Uᵀ of R
  for (Eigen::Index m = 0; m < size; ++m) {
    const double s = singular[m];
    if (!(s > 1e-10 * largest)) continue;
    r.col(m) /= s;
    filtered +=
        (damp && s < full_inverse ? s / (full_inverse * full_inverse) : 1 / s) * v.col(m) * r.col(m).transpose();
    if (!damp || s >= full_inverse) basis.col(num_basis++) = projected.lazyProduct(r.col(m));
  }
  stage.inverse = filtered.lazyProduct(projected.transpose());
  return singular.minCoeff();
}

}  // namespace

void restore_affine(const Eigen::Ref<const MatrixXd>& edges, Eigen::Ref<MatrixXd> gradient,
                    Eigen::Ref<MatrixXd> hessian) {
  constexpr double negligible = 1e-14;
  const Eigen::Index dim = edges.rows();
  // Across a needle the residual may have large entries, and yet its square is small.
  double before = std::numeric_limits<double>::infinity();
  for (int pass = 0; pass < 3; ++pass) {
    const SmallSquare residual = SmallSquare::Identity(dim, dim) - gradient.lazyProduct(edges.transpose());
    const double size = residual.cwiseAbs().maxCoeff();
    if (!(size > negligible) || !(size < before / 2)) break;
    gradient += residual.lazyProduct(gradient).eval();
    before = size;
  }
  if (hessian.rows() > 0) hessian -= SmallSquare(hessian.lazyProduct(edges.transpose())).lazyProduct(gradient);
}

KrigingSystem::KrigingSystem(int dim, int degree) : dim_(dim), degree_(degree) {}

void KrigingSystem::solve(const Eigen::Ref<const MatrixXd>& points, KrigingFit& fit) {
  const Eigen::Index n = points.cols(), dim = dim_, num_quadratic = num_symmetric(dim_);
  const Eigen::Index num_drift = dim + num_quadratic + (degree_ == 3 ? num_cubic(dim_) : 0);
  const Eigen::Index num_functionals = dim + (degree_ == 3 ? num_quadratic : 0);
  memory_.resize(std::max<std::size_t>(memory_.size(), n * (n + 2 + dim + 6 * num_drift + 3 * num_functionals)));
  Arena arena(memory_);
  const double rate = std::sqrt(7.0) / correlation_length, rate2 = rate * rate;

  // Covariance of the differences and its Cholesky factor.
  Block covariance = arena.take(n, n);
  Block single = arena.take(n, 1);
  Block distance2 = arena.take(n, 1);
  distance2 = points.colwise().squaredNorm().transpose();
  single = distance2;
  correlate(single.array(), rate);
  for (Eigen::Index l = 0; l < n; ++l) {
    auto column = covariance.col(l).tail(n - l);
    column = (points.rightCols(n - l).colwise() - points.col(l)).colwise().squaredNorm().transpose();
    correlate(column.array(), rate);
    column.array() += 1 - single(l, 0) - single.col(0).tail(n - l).array();
    column[0] += degree_ == 3 ? cubic_nugget : quadratic_nugget;
  }
  Eigen::LLT<Eigen::Ref<MatrixXd>> cholesky(covariance);

  // Right-hand sides: drift columns, then the covariances of the data with the derivatives wanted.
  Block whitened = arena.take(n, num_drift + num_functionals);
  fill_drift(points, degree_, whitened.leftCols(num_drift));
  Block quadratics = arena.take(n, num_quadratic);
  quadratics = whitened.block(0, dim, n, num_quadratic);
  for (Eigen::Index j = 0; j < n; ++j) {
    const double s = rate * std::sqrt(distance2(j, 0)), decay = std::exp(-s);
    const double first = -rate2 / 5 * (1 + s + s * s / 3) * decay;  // k'(r) / r
    whitened.row(j).segment(num_drift, dim) = -first * points.col(j).transpose();
    if (degree_ < 3) continue;
    const double second = rate2 * rate2 / 15 * (1 + s) * decay;  // (k'(r) / r)' / r
    Eigen::Index column = num_drift + dim;
    for (Eigen::Index a = 0; a < dim; ++a)
      for (Eigen::Index b = a; b < dim; ++b)
        whitened(j, column++) = second * points(a, j) * points(b, j) + (a == b ? first + rate2 / 5 : 0);
  }
  cholesky.matrixL().solveInPlace(whitened);

  // Staged fit, in order of importance: a lower degree never pays for a higher one.
  Block basis = arena.take(n, num_drift);
  Eigen::Index num_basis = 0, first_column = 0;
  fit.smallest_singular_value = std::numeric_limits<double>::infinity();
  std::vector<Stage> stages;
  stages.reserve(3);
  for (int degree = 1; degree <= degree_; ++degree) {
    const Eigen::Index size = degree == 1 ? dim : (degree == 2 ? num_quadratic : num_cubic(dim_));
    stages.push_back({Block(whitened.col(first_column).data(), n, size), arena.take(size, n), arena.take(size, n)});
    Block projected = arena.take(n, size);
    const double smallest = fit_stage(stages.back(), degree > 1, basis, num_basis, projected);
    if (degree > 1) fit.smallest_singular_value = std::min(fit.smallest_singular_value, smallest);
    first_column += size;
  }
  // Back-substitution, highest degree first: each degree fits what the higher ones leave.
  for (std::size_t t = stages.size(); t-- > 0;) {
    stages[t].operation = stages[t].inverse;
    for (std::size_t u = t + 1; u < stages.size(); ++u)
      stages[t].operation -=
          SmallSquare(stages[t].inverse.lazyProduct(stages[u].columns)).lazyProduct(stages[u].operation);
  }

  // A functional's row: its value on the drift plus its covariance with the residual of the drift.
  Block rows_out = arena.take(num_functionals, n);
  const auto covariances = whitened.rightCols(num_functionals);
  rows_out = covariances.transpose();
  for (const Stage& stage : stages)
    rows_out -= SmallSquare(covariances.transpose().lazyProduct(stage.columns)).lazyProduct(stage.operation);
  rows_out.topRows(dim) += stages[0].operation;
  if (degree_ == 3) {
    Eigen::Index row = 0;
    for (Eigen::Index a = 0; a < dim; ++a)
      for (Eigen::Index b = a; b < dim; ++b, ++row)
        rows_out.row(dim + row) += (a == b ? 1 : std::sqrt(0.5)) * stages[1].operation.row(row);
  }
  const auto gradient_whitened = rows_out.topLeftCorner(dim, n);
  const double variance = static_cast<double>(dim) * rate2 / 5 -
                          2 * gradient_whitened.cwiseProduct(covariances.topLeftCorner(n, dim).transpose()).sum() +
                          gradient_whitened.squaredNorm();
  Block weights = arena.take(num_functionals, n);
  weights = rows_out.leftCols(n);
  cholesky.matrixL().solveInPlace<Eigen::OnTheRight>(weights);

  fit.gradient = weights.topRows(dim);
  fit.hessian = weights.bottomRows(num_functionals - dim);
  // Where points lie at very different distances the higher degrees leave their rounding, relative to their squares and
  // cubes, in the linear constraint.
  restore_affine(points, fit.gradient, fit.hessian);
  fit.absolute_sum = fit.gradient.colwise().norm().sum();
  fit.quadratic_response = (fit.gradient * quadratics).norm();
  fit.expected_error = std::sqrt(100 * fit.quadratic_response * fit.quadratic_response +
                                 std::max(variance, 0.0) / (rate2 * rate2 * rate2));
}

}  // namespace halfgrad
