// James 2020: the forms of the formula are one function, and the truncation errors are those of §5.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <functional>
#include <random>

#include "framework/interpolant.hpp"

namespace halfgrad {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A tetrahedron with vertex data that belong to no smooth field: what holds for them holds always.
struct ArbitraryCell {
  std::mt19937 engine{7};
  std::uniform_real_distribution<double> uniform{-1, 1};
  std::array<Vector3d, 4> X, x;
  std::array<Matrix3d, 4> F;
  std::array<double, 4> beta{0.1, 0.2, 0.3, 0.4};
  Vector3d point = Vector3d::Zero();

  ArbitraryCell() {
    const auto random_vector = [&] { return Vector3d(uniform(engine), uniform(engine), uniform(engine)); };
    X = {Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1)};
    for (int i = 0; i < 4; ++i) {
      X[i] += 0.2 * random_vector();
      x[i] = random_vector();
      for (int c = 0; c < 3; ++c) F[i].row(c) = random_vector().transpose();
      point += beta[i] * X[i];
    }
  }

  /// The library's value at the point, gradients given.
  Vector3d evaluated(const char* rule) const {
    Points rest(4, 3), values(4, 3), points(1, 3);
    for (int i = 0; i < 4; ++i) {
      rest.row(i) = X[i].transpose();
      values.row(i) = x[i].transpose();
    }
    points.row(0) = point.transpose();
    ElementBlock<Tetrahedron> block;
    block.cells.resize(1, 4);
    block.cells << 0, 1, 2, 3;
    const Mesh mesh(rest, {block});
    const Interpolant<double> interpolant(mesh, embed(mesh, points), named_rule(rule), nullptr);
    Points gradients(4, 9), out;
    for (int row = 0; row < 4; ++row)
      for (int c = 0; c < 3; ++c)
        for (int a = 0; a < 3; ++a) gradients(row, 3 * c + a) = F[interpolant.active()[row]](c, a);
    interpolant.evaluate_given(values, gradients, Points(), out);
    return out.row(0).transpose();
  }

  Vector3d sum(const std::function<Vector3d(int)>& term) const {
    Vector3d total = Vector3d::Zero();
    for (int i = 0; i < 4; ++i) total += beta[i] * term(i);
    return total;
  }
};

// Numbers of size one, a few dozen operations.
constexpr double round_off = 1e-14;

TEST(PaperEquations, TheFormsOfPhongAreOneFunction) {
  const ArbitraryCell cell;
  const auto& [X, x, F, beta] = std::tie(cell.X, cell.x, cell.F, cell.beta);
  const Vector3d linear = cell.sum([&](int i) { return x[i]; });
  const Vector3d vertex_model = cell.sum([&](int i) -> Vector3d { return x[i] + F[i] * (cell.point - X[i]); });
  Matrix3d V, v;  // Eq. 6 to 8
  for (int k = 0; k < 3; ++k) {
    V.col(k) = X[k + 1] - X[0];
    v.col(k) = x[k + 1] - x[0];
  }
  const Matrix3d F_C = v * V.inverse();

  const Vector3d eq13 = 0.5 * (linear + vertex_model);
  const Vector3d eq14 = linear + 0.5 * cell.sum([&](int i) -> Vector3d { return F[i] * (cell.point - X[i]); });
  const Vector3d eq16 =
      linear + 0.5 * cell.sum([&](int i) { return cell.sum([&](int j) -> Vector3d { return F[i] * (X[j] - X[i]); }); });
  const Vector3d eq18 = linear + 0.5 * cell.sum([&](int i) -> Vector3d { return (F[i] - F_C) * (cell.point - X[i]); });
  const Vector3d eq19 = cell.sum([&](int i) -> Vector3d { return x[i] + 0.5 * F[i] * (cell.point - X[i]); });
  const Vector3d ours = cell.evaluated("phong");
  for (const Vector3d& form : {eq13, eq14, eq16, eq18, eq19}) EXPECT_LT((form - ours).norm(), round_off);
  EXPECT_LT((cell.evaluated("linear") - linear).norm(), round_off);
  EXPECT_LT((cell.evaluated("vertex_blend") - vertex_model).norm(), round_off);
  // Eq. 20 to 23: the quadratic through vertices and Hermite midpoints.
  EXPECT_LT((cell.evaluated("quadratic10") - ours).norm(), round_off);
  EXPECT_GT((ours - linear).norm(), 1e-3) << "a correction that is there to be compared";
}

TEST(PaperEquations, EqualVertexGradientsGiveNoCorrection) {
  ArbitraryCell cell;
  cell.F.fill(cell.F[0]);  // Eq. 17: any constant, the cell's own gradient or not
  EXPECT_LT((cell.evaluated("phong") - cell.evaluated("linear")).norm(), round_off);
}

/// The error of a rule on the segment [0, h] at β h, for exp about 0, where all derivatives are one.
double error_on_segment(const char* rule, double h, double beta, bool is_exact) {
  Points rest(2, 1), values(2, 1), points(1, 1);
  rest << 0, h;
  values << 1, std::exp(h);
  points << beta * h;
  ElementBlock<Segment> block;
  block.cells.resize(1, 2);
  block.cells << 0, 1;
  const Mesh mesh(rest, {block});
  const Interpolant<double> interpolant(mesh, embed(mesh, points), named_rule(rule), nullptr);
  Points gradients(2, 1), out;
  for (int row = 0; row < 2; ++row) {
    const double X = rest(interpolant.active()[row], 0);
    // The mean of the two elements at a vertex of a uniform grid is the centered difference.
    gradients(row, 0) = is_exact ? std::exp(X) : (std::exp(X + h) - std::exp(X - h)) / (2 * h);
  }
  interpolant.evaluate_given(values, gradients, Points(), out);
  return out(0, 0) - std::exp(beta * h);
}

/// The coefficients of h² and h³, fitted by the cubic in h through error / h² at four sizes.
std::pair<double, double> fitted_coefficients(const char* rule, double beta, bool is_exact) {
  const Eigen::Vector4d sizes(0.04, 0.03, 0.02, 0.01);
  Eigen::Matrix4d powers;
  Eigen::Vector4d scaled;
  for (int k = 0; k < 4; ++k) {
    powers.row(k) << 1, sizes[k], sizes[k] * sizes[k], sizes[k] * sizes[k] * sizes[k];
    scaled[k] = error_on_segment(rule, sizes[k], beta, is_exact) / (sizes[k] * sizes[k]);
  }
  const Eigen::Vector4d coefficients = powers.partialPivLu().solve(scaled);
  return {coefficients[0], coefficients[1]};
}

TEST(PaperEquations, OneDimensionalTruncationErrors) {
  // The cubic leaves terms of h⁴/h² times Π h_k: below 1e-7 in the first coefficient, 1e-5 in the second.
  for (const bool is_exact : {true, false})
    for (double b = 0.1; b < 1; b += 0.1) {
      const auto linear = fitted_coefficients("linear", b, is_exact);  // Eq. 28
      EXPECT_NEAR(linear.first, -(b - 1) * b / 2, 1e-6);
      EXPECT_NEAR(linear.second, -b * (b * b - 1) / 6, 1e-4);
      const auto vertex = fitted_coefficients("vertex_blend", b, is_exact);  // Eq. 31
      EXPECT_NEAR(vertex.first, (b - 1) * b / 2, 1e-6);
      EXPECT_NEAR(vertex.second, -(b - 2) * (b - 1) * b / 6, 1e-4);
      const auto phong = fitted_coefficients("phong", b, is_exact);  // Eq. 32
      EXPECT_NEAR(phong.first, 0, 1e-6);
      EXPECT_NEAR(phong.second, -(b - 1) * b * (2 * b - 1) / 12, 1e-4);
    }
}

/// A cubic u with given derivatives at the origin.
struct Cubic {
  Vector3d first;
  Matrix3d second;                ///< ∂i∂j u
  std::array<Matrix3d, 3> third;  ///< ∂i∂j∂k u, symmetric in all

  double value(const Vector3d& X) const {
    double sum = first.dot(X) + 0.5 * X.dot(second * X);
    for (int i = 0; i < 3; ++i) sum += X[i] * X.dot(third[i] * X) / 6;
    return sum;
  }
  Vector3d gradient(const Vector3d& X) const {
    Vector3d sum = first + second * X;
    for (int i = 0; i < 3; ++i) sum[i] += 0.5 * X.dot(third[i] * X);
    return sum;
  }
};

Cubic random_cubic(std::mt19937& engine) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  Cubic u;
  for (int i = 0; i < 3; ++i) {
    u.first[i] = uniform(engine);
    for (int j = i; j < 3; ++j) {
      u.second(i, j) = u.second(j, i) = uniform(engine);
      for (int k = j; k < 3; ++k)
        for (const auto& [a, b, c] : {std::array{i, j, k}, {i, k, j}, {j, i, k}, {j, k, i}, {k, i, j}, {k, j, i}})
          u.third[a](b, c) = 0;
    }
  }
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j)
      for (int k = j; k < 3; ++k) {
        const double value = uniform(engine);
        for (const auto& [a, b, c] : {std::array{i, j, k}, {i, k, j}, {j, i, k}, {j, k, i}, {k, i, j}, {k, j, i}})
          u.third[a](b, c) = value;
      }
  return u;
}

double error_on_canonical_tetrahedron(const char* rule, const Cubic& u, const Vector3d& beta, double h) {
  Points rest(4, 3), values(4, 1), points(1, 3);
  rest << 0, 0, 0, h, 0, 0, 0, h, 0, 0, 0, h;
  for (int i = 0; i < 4; ++i) values(i, 0) = u.value(rest.row(i).transpose());
  points.row(0) = h * beta.transpose();
  ElementBlock<Tetrahedron> block;
  block.cells.resize(1, 4);
  block.cells << 0, 1, 2, 3;
  const Mesh mesh(rest, {block});
  const Interpolant<double> interpolant(mesh, embed(mesh, points), named_rule(rule), nullptr);
  Points gradients(4, 3), out;
  for (int row = 0; row < 4; ++row)
    gradients.row(row) = u.gradient(rest.row(interpolant.active()[row]).transpose()).transpose();
  interpolant.evaluate_given(values, gradients, Points(), out);
  return out(0, 0) - u.value(h * beta);
}

TEST(PaperEquations, TruncationErrorsOnTheCanonicalTetrahedron) {
  std::mt19937 engine(11);
  for (int repetition = 0; repetition < 20; ++repetition) {
    const Cubic u = random_cubic(engine);
    Vector3d beta;
    std::uniform_real_distribution<double> uniform(0, 1);
    do {
      for (int i = 0; i < 3; ++i) beta[i] = uniform(engine);
    } while (beta.sum() > 1);

    double linear = 0, phong = beta[0] * beta[1] * beta[2] * u.third[0](1, 2);  // §5.2
    for (int i = 0; i < 3; ++i) {
      linear += 0.5 * (beta[i] - 1) * beta[i] * u.second(i, i);
      phong += (beta[i] - 1) * beta[i] * (2 * beta[i] - 1) * u.third[i](i, i) / 12;
      for (int j = 0; j < 3; ++j) {
        if (i < j) linear += beta[i] * beta[j] * u.second(i, j);
        if (i != j) phong += 0.25 * beta[i] * (2 * beta[i] - 1) * beta[j] * u.third[i](i, j);
      }
    }
    // A cubic has no terms beyond h³: phong's error is its closed form, linear's h² term is what two sizes separate.
    EXPECT_NEAR(error_on_canonical_tetrahedron("phong", u, beta, 1), -phong, 1e-14);
    const double whole = error_on_canonical_tetrahedron("linear", u, beta, 1);
    const double half = error_on_canonical_tetrahedron("linear", u, beta, 0.5);
    EXPECT_NEAR(8 * half - whole, -linear, 1e-13);
    // The vertex model's h² term is the opposite one.
    const double whole_vertex = error_on_canonical_tetrahedron("vertex_blend", u, beta, 1);
    const double half_vertex = error_on_canonical_tetrahedron("vertex_blend", u, beta, 0.5);
    EXPECT_NEAR(8 * half_vertex - whole_vertex, linear, 1e-13);
  }
}

}  // namespace
}  // namespace halfgrad
