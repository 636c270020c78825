// The fast path against the plain formulas, on every instruction set that this machine has.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <hwy/highway.h>
#include <tbb/global_control.h>

#include <numeric>

#include "framework/interpolant.hpp"
#include "framework/weighted_points.hpp"
#include "reconstruction/adaptive.hpp"
#include "reconstruction/cell_averages.hpp"
#include "support/test_meshes.hpp"

namespace halfgrad {
namespace {

// Runs body once with each instruction set that the library and the machine have, the widest first.
template <class Body>
void on_every_target(Body&& body) {
  constexpr std::int64_t generated = HWY_AVX3 | HWY_AVX2 | HWY_SSE4 | HWY_NEON | HWY_STATIC_TARGET;
  const std::int64_t available = (hwy::SupportedTargets() | HWY_STATIC_TARGET) & generated;
  for (std::int64_t target = 1; target > 0 && target <= available; target <<= 1) {
    if ((available & target) == 0) continue;
    SCOPED_TRACE(hwy::TargetName(target));
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    body();
    if (testing::Test::HasFailure()) break;
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

Values<double> random_values(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  return Values<double>::NullaryExpr(rows, columns, [&] { return uniform(random); });
}

// Points of all kinds: a crowd in one cell, so that a run takes several vectors; single points; points outside and not
// found.
template <Element E>
Embedding mixed_points(const Mesh& mesh) {
  std::mt19937 random(3);
  std::uniform_int_distribution<Index> any_cell(0, mesh.num_cells() - 1);
  std::uniform_real_distribution<double> shift(-0.3, 0.3);
  constexpr Index num_points = 500;
  Embedding embedding;
  embedding.gdim = E::dim;
  embedding.local.resize(num_points, E::dim);
  for (Index p = 0; p < num_points; ++p) {
    embedding.local.row(p) = test::random_inside<E>(random).transpose();
    embedding.cells.push_back(p % 3 == 0 ? 1 : any_cell(random));
    embedding.status.push_back(PointStatus::inside);
    if (p % 41 == 7) {
      embedding.status[p] = PointStatus::outside;
      embedding.outside.push_back({p, 0.1, Vector::NullaryExpr(E::dim, [&] { return shift(random); })});
    } else if (p % 59 == 11) {
      embedding.status[p] = PointStatus::not_found;
      embedding.cells[p] = -1;
      embedding.outside.push_back({p, 0.1, Vector::Zero(E::dim)});
    }
  }
  return embedding;
}

template <class Scalar>
constexpr double tolerated = std::is_same_v<Scalar, float> ? 3e-7 : 1e-13;

// Greatest difference over rows that are numbers; rows must be numbers in both or in neither.
template <class Scalar>
double largest_difference(const Values<Scalar>& result, const Values<double>& expected) {
  double largest = 0;
  for (Eigen::Index p = 0; p < result.rows(); ++p)
    for (Eigen::Index c = 0; c < result.cols(); ++c) {
      if (std::isnan(expected(p, c)) != std::isnan(result(p, c))) return std::numeric_limits<double>::infinity();
      if (!std::isnan(expected(p, c)))
        largest = std::max(largest, std::abs(static_cast<double>(result(p, c)) - expected(p, c)));
    }
  return largest;
}

template <class Scalar>
Values<double> plain_result(const Interpolant<double>& reference, const Values<Scalar>& values,
                            const Values<Scalar>& gradients, const Values<Scalar>& hessians) {
  Values<double> result;
  reference.evaluate_given(values.template cast<double>(), gradients.template cast<double>(),
                           hessians.template cast<double>(), result, {.kernel = Kernel::plain});
  return result;
}

template <Element E, class Scalar>
void expect_fast_equals_plain(double jitter = 0.2, int cells = 3) {
  const Mesh mesh = test::lattice<E>(cells, jitter, 5);
  const Embedding embedding = mixed_points<E>(mesh);
  const Reconstruction reconstruction =
      ChandrashekarGarg().reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
  for (const NamedRule& named : named_rules()) {
    if (!E::affine && named.rule.formula == Formula::quadratic10) continue;
    for (Eigen::Index columns = 1; columns <= 3; ++columns) {
      SCOPED_TRACE(fmt::format("{} with {} columns", named.name, columns));
      // Positions like those of a deformed mesh, gradients and Hessians of the size that such positions have.
      const Values<Scalar> values = random_values(mesh.num_vertices(), columns, 1).template cast<Scalar>();
      const bool from_stencils = !named.rule.needs_hessians();
      const Interpolant<double> reference(mesh, embedding, named.rule, from_stencils ? &reconstruction : nullptr);
      const Interpolant<Scalar> fast(mesh, embedding, named.rule, from_stencils ? &reconstruction : nullptr);
      const Eigen::Index num_active = reference.report().num_active_vertices;
      const Values<Scalar> gradients = random_values(num_active, columns * E::dim, 2).template cast<Scalar>();
      const Values<Scalar> hessians =
          random_values(num_active, columns * num_symmetric(E::dim), 3).template cast<Scalar>();
      // Rounding grows with the number of terms, most on simplices 40 (dual_taylor in tetrahedra).
      const int terms = E::num_nodes * (1 + E::dim + (from_stencils ? 0 : num_symmetric(E::dim)));
      const double rounding = 2 * std::max(1.0, terms / 40.0);
      // Polynomials in a rational function have its rounding besides, times a sum of four values.
      const double of_variables = RationalElement<E> ? 1.5 : 1;
      Values<double> expected = plain_result(reference, values, gradients, hessians);
      on_every_target([&] {
        Values<Scalar> result;
        fast.evaluate_given(values, gradients, hessians, result);
        EXPECT_LT(largest_difference(result, expected), tolerated<Scalar> * rounding);
      });
      if (!from_stencils) continue;
      expected = reference.evaluate(values.template cast<double>(), {.kernel = Kernel::plain});
      // The gradients of random values on a mesh of this width are as large as their greatest sum of weights.
      const double extent = std::max(2.0, expected.array().isNaN().select(0, expected).cwiseAbs().maxCoeff());
      on_every_target([&] {
        EXPECT_LT(largest_difference(fast.evaluate(values), expected), tolerated<Scalar> * extent * of_variables);
      });
    }
  }
}

// The blend's weight is a smooth function of a ratio of mismatches, which are small differences of large numbers:
// round-off grows by the ratio of their sizes.
template <Element E, class Scalar>
void expect_blend_equals_plain() {
  const Mesh mesh = test::lattice<E>(3, 0.2, 5);
  const Embedding embedding = mixed_points<E>(mesh);
  const Reconstruction reconstruction = Adaptive().reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
  const Points waves = (3 * mesh.vertices() * random_values(E::dim, 3, 6)).array().sin();
  for (Eigen::Index columns = 1; columns <= 3; ++columns) {
    const Values<double> values = waves.leftCols(columns).cast<Scalar>().template cast<double>();
    for (const char* rule : {"phong", "hermite"}) {
      SCOPED_TRACE(fmt::format("{} with {} columns", rule, columns));
      const Interpolant<Scalar> fast(mesh, embedding, named_rule(rule), &reconstruction);
      const Values<double> expected = Interpolant<double>(mesh, embedding, named_rule(rule), &reconstruction)
                                          .evaluate(values, {.kernel = Kernel::plain});
      on_every_target([&] {
        EXPECT_LT(largest_difference(fast.evaluate(values.template cast<Scalar>()), expected), 30 * tolerated<Scalar>);
      });
    }
  }
}

TEST(CellPolynomial, BlendEqualsThePlainFormulas) {
  expect_blend_equals_plain<Segment, float>();
  expect_blend_equals_plain<Segment, double>();
  expect_blend_equals_plain<Triangle, float>();
  expect_blend_equals_plain<Triangle, double>();
  expect_blend_equals_plain<Tetrahedron, float>();
  expect_blend_equals_plain<Tetrahedron, double>();
}

TEST(CellPolynomial, EqualsThePlainFormulasOnSegments) {
  expect_fast_equals_plain<Segment, float>();
  expect_fast_equals_plain<Segment, double>();
}
TEST(CellPolynomial, EqualsThePlainFormulasOnTriangles) {
  expect_fast_equals_plain<Triangle, float>();
  expect_fast_equals_plain<Triangle, double>();
}
TEST(CellPolynomial, EqualsThePlainFormulasOnTetrahedra) {
  expect_fast_equals_plain<Tetrahedron, float>();
  expect_fast_equals_plain<Tetrahedron, double>();
}
// Edges are shared within windows of cells: several windows, the last of them not full.
TEST(CellPolynomial, EqualsThePlainFormulasInManyWindows) {
  expect_fast_equals_plain<Tetrahedron, float>(0.2, 6);
  expect_fast_equals_plain<Triangle, float>(0.2, 16);
}

// Without jitter the cells' maps are affine, and fewer coefficients serve.
TEST(CellPolynomial, EqualsThePlainFormulasOnQuadrilaterals) {
  for (double jitter : {0.2, 0.0}) {
    expect_fast_equals_plain<Quadrilateral, float>(jitter);
    expect_fast_equals_plain<Quadrilateral, double>(jitter);
  }
}
TEST(CellPolynomial, EqualsThePlainFormulasOnWedges) {
  for (double jitter : {0.2, 0.0}) {
    expect_fast_equals_plain<Wedge, float>(jitter);
    expect_fast_equals_plain<Wedge, double>(jitter);
  }
}
TEST(CellPolynomial, EqualsThePlainFormulasOnHexahedra) {
  for (double jitter : {0.2, 0.0}) {
    expect_fast_equals_plain<Hexahedron, float>(jitter);
    expect_fast_equals_plain<Hexahedron, double>(jitter);
  }
}

TEST(CellPolynomial, EqualsThePlainFormulasOnPyramids) {
  expect_fast_equals_plain<Pyramid, float>();
  expect_fast_equals_plain<Pyramid, double>();
}

// Points with weights on one to eight vertices, and some not found.
template <class Scalar>
void expect_weighted_equals_plain(int gdim) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  WeightedPoints points;
  points.gdim = gdim;
  points.num_vertices = 50;
  for (int p = 0; p < 200; ++p) {
    const int count = p % 17 == 5 ? 0 : 1 + p % max_nodes;
    std::vector<double> weights(static_cast<std::size_t>(count));
    for (double& weight : weights) weight = 0.1 + uniform(random);
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    for (double weight : weights) {
      points.vertices.push_back(static_cast<Index>(random() % 50));
      points.weights.push_back(weight / sum);
      for (int k = 0; k < gdim; ++k) points.arms.push_back(0.3 * (uniform(random) - 0.5));
    }
    points.offsets.push_back(static_cast<Offset>(points.vertices.size()));
  }
  for (const NamedRule& named : named_rules()) {
    if (named.rule.formula == Formula::quadratic10) continue;
    const Interpolant<Scalar> interpolant(points, named.rule, nullptr);
    const Interpolant<double> reference(points, named.rule, nullptr);
    const Eigen::Index num_active = interpolant.report().num_active_vertices;
    for (Eigen::Index columns = 1; columns <= 3; ++columns) {
      SCOPED_TRACE(fmt::format("{} with {} columns in {} dimensions", named.name, columns, gdim));
      const Values<Scalar> values = random_values(50, columns, 1).template cast<Scalar>();
      const Values<Scalar> gradients = random_values(num_active, columns * gdim, 2).template cast<Scalar>();
      const Values<Scalar> hessians =
          random_values(num_active, columns * num_symmetric(gdim), 3).template cast<Scalar>();
      const Values<double> expected = plain_result(reference, values, gradients, hessians);
      on_every_target([&] {
        Values<Scalar> result;
        interpolant.evaluate_given(values, gradients, hessians, result);
        EXPECT_LT(largest_difference(result, expected), 2 * tolerated<Scalar>);
      });
    }
  }
}
TEST(CellPolynomial, PointsByTheirWeightsEqualThePlainFormulas) {
  for (int gdim = 1; gdim <= 3; ++gdim) {
    expect_weighted_equals_plain<float>(gdim);
    expect_weighted_equals_plain<double>(gdim);
  }
}

// Past the number of points from which a frame takes several threads: ranges of windows meet where threads do.
TEST(CellPolynomial, OneAndTwoThreadsGiveTheSameBitsOnEveryTarget) {
  const Mesh mesh = test::lattice<Tetrahedron>(8, 0.2, 5);
  std::mt19937 random(4);
  std::uniform_int_distribution<Index> any_cell(0, mesh.num_cells() - 1);
  constexpr Index num_points = 250'000;
  Embedding embedding;
  embedding.gdim = 3;
  embedding.local.resize(num_points, 3);
  embedding.status.assign(num_points, PointStatus::inside);
  for (Index p = 0; p < num_points; ++p) {
    embedding.local.row(p) = test::random_inside<Tetrahedron>(random).transpose();
    embedding.cells.push_back(any_cell(random));
  }
  const Reconstruction reconstruction =
      ChandrashekarGarg().reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
  const Values<float> values = random_values(mesh.num_vertices(), 3, 1).cast<float>();
  for (const char* rule : {"linear", "phong", "hermite"}) {
    SCOPED_TRACE(rule);
    const Interpolant<float> interpolant(mesh, embedding, named_rule(rule), &reconstruction);
    on_every_target([&] {
      Values<float> results[2];
      for (std::size_t threads : {1, 2}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        results[threads - 1] = interpolant.evaluate(values);
      }
      EXPECT_TRUE(results[0] == results[1]);
    });
  }
}

class TetrahedraWithMixedPoints : public testing::Test {
 protected:
  Mesh mesh = test::lattice<Tetrahedron>(3, 0.2, 5);
  Embedding embedding = mixed_points<Tetrahedron>(mesh);
  Reconstruction reconstruction =
      ChandrashekarGarg().reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
  Interpolant<float> phong{mesh, embedding, named_rule("phong"), &reconstruction};
  Values<float> values = random_values(mesh.num_vertices(), 3, 1).cast<float>();
};

TEST_F(TetrahedraWithMixedPoints, SortedOutputIsThePermutedOutput) {
  const Values<float> user = phong.evaluate(values);
  Values<float> sorted;
  Workspace<float> workspace;
  phong.evaluate_sorted(values, sorted, workspace);
  ASSERT_EQ(phong.permutation().size(), embedding.cells.size());
  std::vector<char> seen(embedding.cells.size(), 0);
  Eigen::Index s = 0;
  for (Index p : phong.permutation()) {
    EXPECT_FALSE(std::exchange(seen[p], 1));
    EXPECT_TRUE(sorted.row(s) == user.row(p) || embedding.cells[p] < 0);
    ++s;
  }
  const Index not_found = phong.report().num_not_found;
  ASSERT_GT(not_found, 0);
  EXPECT_TRUE(sorted.bottomRows(not_found).array().isNaN().all());
  EXPECT_FALSE(sorted.topRows(sorted.rows() - not_found).array().isNaN().any());
}

TEST_F(TetrahedraWithMixedPoints, PointsInSortedOrderKeepTheirOrder) {
  Embedding renumbered = embedding;
  std::vector<Index> place(embedding.cells.size());
  for (std::size_t s = 0; s < place.size(); ++s) {
    const Index p = phong.permutation()[s];
    place[p] = static_cast<Index>(s);
    renumbered.cells[s] = embedding.cells[p];
    renumbered.status[s] = embedding.status[p];
    renumbered.local.row(static_cast<Eigen::Index>(s)) = embedding.local.row(p);
  }
  for (OutsidePoint& outside : renumbered.outside) outside.point = place[outside.point];
  std::sort(renumbered.outside.begin(), renumbered.outside.end(),
            [](const OutsidePoint& a, const OutsidePoint& b) { return a.point < b.point; });
  const Interpolant<float> again(mesh, renumbered, named_rule("phong"), &reconstruction);
  EXPECT_TRUE(std::is_sorted(again.permutation().begin(), again.permutation().end()));
  Values<float> sorted;
  Workspace<float> workspace;
  phong.evaluate_sorted(values, sorted, workspace);
  const Values<float> result = again.evaluate(values);
  const Index served = phong.num_points() - phong.report().num_not_found;
  EXPECT_TRUE(result.topRows(served) == sorted.topRows(served));
}

TEST_F(TetrahedraWithMixedPoints, ANaNSpoilsOnlyTheCellsThatSeeIt) {
  values(0, 1) = std::numeric_limits<float>::quiet_NaN();
  const Values<double> expected = phong.evaluate(values, {.kernel = Kernel::plain}).cast<double>();
  ASSERT_TRUE(expected.array().isNaN().any());
  ASSERT_FALSE(expected.col(1).array().isNaN().all());
  on_every_target([&] { EXPECT_LT(largest_difference(phong.evaluate(values), expected), 1e-5); });
}

TEST_F(TetrahedraWithMixedPoints, NoToleranceBoundsANaN) {
  // The gradients of the vertices around are NaN, their own values are not: their cells must not become linear.
  values(0, 1) = std::numeric_limits<float>::quiet_NaN();
  const Values<double> expected = phong.evaluate(values).cast<double>();
  for (Kernel kernel : {Kernel::fast, Kernel::plain}) {
    const Values<float> result = phong.evaluate(values, {.tolerance = 100, .kernel = kernel});
    EXPECT_LT(largest_difference(result, expected), 100);
  }
}

TEST_F(TetrahedraWithMixedPoints, ToleranceKeepsItsBoundOnEveryTarget) {
  const Values<double> full = phong.evaluate(values).cast<double>();
  for (float tolerance : {1e-3f, 0.05f, 0.1f, 0.3f}) {
    const Values<double> plain =
        phong.evaluate(values, {.tolerance = tolerance, .kernel = Kernel::plain}).cast<double>();
    on_every_target([&] {
      const Values<float> result = phong.evaluate(values, {.tolerance = tolerance});
      EXPECT_LE(largest_difference(result, full), tolerance + 1e-6);
      // Both paths drop the same cells, but for cells at the bound itself.
      EXPECT_LT(largest_difference(result, plain), 2e-6);
    });
  }
  EXPECT_GT(phong.num_linear_cells(values, {.tolerance = 0.3}), 0);
}

}  // namespace
}  // namespace halfgrad
