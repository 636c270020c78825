// The baselines that know vertices only: what they reproduce, their orders, and what they refuse.
#include "framework/scattered_transfer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "framework/error.hpp"
#include "reconstruction/cell_averages.hpp"
#include "support/message_of.hpp"
#include "support/test_meshes.hpp"

namespace halfgrad {
namespace {

using testing::HasSubstr;

Mesh jittered(double size = 1) {
  const Mesh mesh = test::lattice<Tetrahedron>(5, 0.2, 3);
  return Mesh(mesh.vertices() * size, mesh.blocks());
}

ScatteredRule rule_named(const char* name) { return *find_scattered_rule(name); }

ScatteredRule carrying_gradients() {
  ScatteredRule rule;
  rule.carried = Carried::gradient;
  return rule;
}

/// x = X + a quadratic of the size `amount`, row by row.
Points bent(const Points& X, double amount) {
  Points x = X;
  x.col(0).array() += amount * X.col(1).array() * X.col(2).array();
  x.col(1).array() += amount * X.col(2).array().square();
  return x;
}

TEST(ScatteredTransfer, CarriesTranslationsWithAnyRuleAndAnyPoint) {
  const Mesh mesh = jittered();
  Points points(3, 3);
  points << 0.5, 0.5, 0.5, 0, 0, 0, 4, -3, 7;  // the last lies far outside, where weights of a fit are large
  const Points moved = (mesh.vertices().array() + 2.5).matrix();
  for (const NamedScatteredRule& named : scattered_rules()) {
    const ScatteredTransfer transfer(mesh, points, named.rule);
    EXPECT_LT((transfer.evaluate(moved) - (points.array() + 2.5).matrix()).norm(), 1e-10) << named.name;
    EXPECT_LT((transfer.matrix() * Eigen::VectorXd::Ones(mesh.num_vertices()) - Eigen::VectorXd::Ones(3)).norm(),
              1e-12);
  }
}

TEST(ScatteredTransfer, GradientsMakeItAffineExactAndTheFitExactForQuadratics) {
  const Mesh mesh = jittered();
  const Points points = test::random_points_inside(mesh, 200, 1);
  Eigen::Matrix3d A;
  A << 1.2, 0.3, -0.1, 0.2, 0.7, 0.4, -0.3, 0.1, 1.1;
  const Points turned = mesh.vertices() * A.transpose();
  const UnweightedAverage reconstructor;
  const ScatteredTransfer with_gradients(mesh, points, carrying_gradients(), &reconstructor);
  EXPECT_LT((with_gradients.evaluate(turned) - points * A.transpose()).cwiseAbs().maxCoeff(), 1e-12);
  const ScatteredTransfer displacement(mesh, points, rule_named("attribute_transfer"));
  EXPECT_GT((displacement.evaluate(turned) - points * A.transpose()).cwiseAbs().maxCoeff(), 1e-3);
  const ScatteredTransfer fit(mesh, points, rule_named("moving_least_squares"));
  EXPECT_LT((fit.evaluate(bent(mesh.vertices(), 0.5)) - bent(points, 0.5)).cwiseAbs().maxCoeff(), 1e-11);
}

TEST(ScatteredTransfer, ScalesWithTheMesh) {
  const Mesh mesh = jittered();
  const Mesh large(mesh.vertices() * 1000, mesh.blocks());
  const Points points = test::random_points_inside(mesh, 50, 2);
  for (const NamedScatteredRule& named : scattered_rules()) {
    const auto weights = ScatteredTransfer(mesh, points, named.rule).matrix();
    const auto scaled = ScatteredTransfer(large, points * 1000, named.rule).matrix();
    EXPECT_LT((weights - scaled).norm(), 1e-9 * weights.norm()) << named.name;
  }
}

/// The order between the one mesh at two small sizes, under a field that does not shrink with it.
double halving_order(const ScatteredRule& rule, const VertexGradientReconstructor* reconstructor) {
  std::vector<double> errors;
  for (const double size : {1.0 / 32, 1.0 / 64}) {
    const Mesh mesh = jittered(size);
    const Points points = test::random_points_inside(mesh, 500, 4);
    const auto field = [](const Points& X) {
      Points x = X;
      x.col(0) = (X.col(0).array() + 0.3 * (1 + 2 * X.col(1).array() + X.col(2).array()).sin()).matrix();
      return x;
    };
    const ScatteredTransfer transfer(mesh, points, rule, reconstructor);
    errors.push_back((transfer.evaluate(field(mesh.vertices())) - field(points)).norm());
  }
  return std::log2(errors[0] / errors[1]);
}

TEST(ScatteredTransfer, OrderIsOneForDisplacementsTwoWithGradientsThreeForTheFit) {
  EXPECT_NEAR(halving_order(rule_named("attribute_transfer"), nullptr), 1, 0.1);
  const UnweightedAverage reconstructor;
  EXPECT_NEAR(halving_order(carrying_gradients(), &reconstructor), 2, 0.15);
  EXPECT_NEAR(halving_order(rule_named("moving_least_squares"), nullptr), 3, 0.2);
}

TEST(ScatteredTransfer, RadiusGrowsUntilEnoughVerticesHaveWeight) {
  const Mesh mesh = jittered();
  const Points points = test::random_points_inside(mesh, 20, 5);
  ScatteredRule rule;
  rule.radius = 1e-6;
  rule.neighbors = 7;
  const auto weights = ScatteredTransfer(mesh, points, rule).matrix();
  for (Eigen::Index p = 0; p < points.rows(); ++p) EXPECT_EQ(weights.row(p).nonZeros(), 7);
  EXPECT_GE(Eigen::Map<const Eigen::VectorXd>(weights.valuePtr(), weights.nonZeros()).minCoeff(), 0);
}

TEST(ScatteredTransfer, IgnoresVerticesOfNoCell) {
  const Mesh mesh = jittered();
  Points more(mesh.num_vertices() + 1, 3);
  more << mesh.vertices(), 0.5, 0.5, 0.5;
  const Mesh with_loose(more, mesh.blocks());
  Points points(1, 3);
  points << 0.5, 0.5, 0.5;
  const ScatteredTransfer transfer(with_loose, points, {});
  EXPECT_EQ(transfer.matrix().coeff(0, mesh.num_vertices()), 0);
}

TEST(ScatteredTransfer, RefusesWhatItCannotDo) {
  const Mesh mesh = jittered();
  const Points points = test::random_points_inside(mesh, 5, 1);
  EXPECT_THAT(message_of([&] { ScatteredTransfer(mesh, points, carrying_gradients()); }), HasSubstr("reconstructor"));
  EXPECT_THAT(message_of([&] { ScatteredTransfer(mesh, points.leftCols(2), {}); }), HasSubstr("2 coordinates"));
  ScatteredRule rule;
  rule.radius = 0;
  EXPECT_THAT(message_of([&] { ScatteredTransfer(mesh, points, rule); }), HasSubstr("radius 0"));
  EXPECT_THAT(message_of([&] { ScatteredTransfer(mesh, points, {}).evaluate<double>(Points(3, 3)); }),
              HasSubstr("3 values"));
}

}  // namespace
}  // namespace halfgrad
