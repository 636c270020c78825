// Gradients and Hessians from stencils with cubic drift, and what dual_taylor makes of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "framework/cell_blocks.hpp"
#include "framework/interpolant.hpp"
#include "reconstruction/registry.hpp"
#include "support/message_of.hpp"
#include "tests/support/test_meshes.hpp"

namespace halfgrad {
namespace {

using testing::HasSubstr;

const nlohmann::json cubic_kriging = {{"kriging", {{"drift", "cubic"}}}};

// Two columns of cubic polynomials of any dimension: powers of linear functions.
class Cubics {
 public:
  explicit Cubics(int gdim) : directions_(2, gdim) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(0.3, 1.0);
    for (double& each : directions_.reshaped()) each = uniform(random);
  }
  Values<double> values(const Points& X) const { return (0.5 + (X * directions_.transpose()).array()).cube().matrix(); }
  // Of column c along axis a, and along a and b.
  double gradient(const Points& X, Eigen::Index row, int c, int a) const {
    return 3 * std::pow(argument(X, row, c), 2) * directions_(c, a);
  }
  double hessian(const Points& X, Eigen::Index row, int c, int a, int b) const {
    return 6 * argument(X, row, c) * directions_(c, a) * directions_(c, b);
  }

 private:
  double argument(const Points& X, Eigen::Index row, int c) const { return 0.5 + X.row(row).dot(directions_.row(c)); }
  Points directions_;
};

template <class E>
class CubicsOn : public testing::Test {};
using SomeElements = testing::Types<Triangle, Quadrilateral, Tetrahedron, Hexahedron>;
TYPED_TEST_SUITE(CubicsOn, SomeElements);

TYPED_TEST(CubicsOn, AreReproducedWithTheirDerivatives) {
  using E = TypeParam;
  constexpr int d = E::dim;
  const Mesh mesh = test::lattice<E>(d == 2 ? 6 : 4, 0.15, 5);
  const Points points = test::random_points_inside(mesh, 60, 6);
  const Embedding embedding = embed(mesh, points);
  const auto made = make_reconstructor(cubic_kriging);
  const Reconstruction rows = made.reconstructor->reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
  const Interpolant<double> interpolant(mesh, embedding, named_rule("dual_taylor"), &rows);
  const Cubics field(d);
  const Values<double> values = field.values(mesh.vertices());

  const Values<double> found = interpolant.evaluate(values), gradient = interpolant.gradient(values);
  EXPECT_LE((found - field.values(points)).cwiseAbs().maxCoeff(), 1e-11);
  EXPECT_LE((interpolant.matrix() * values - found).cwiseAbs().maxCoeff(), 1e-11);
  for (Eigen::Index p = 0; p < points.rows(); ++p)
    for (int c = 0; c < 2; ++c)
      for (int a = 0; a < d; ++a) EXPECT_NEAR(gradient(p, c * d + a), field.gradient(points, p, c, a), 1e-9);

  Values<double> at_vertices, curved;
  interpolant.vertex_derivatives(values, at_vertices, curved);
  EXPECT_EQ(interpolant.vertex_gradients(values), at_vertices);
  ASSERT_EQ(curved.cols(), 2 * num_symmetric(d));
  for (Eigen::Index v = 0; v < at_vertices.rows(); ++v) {
    const Index vertex = interpolant.active()[static_cast<std::size_t>(v)];
    for (int c = 0; c < 2; ++c)
      for (int a = 0, s = 0; a < d; ++a) {
        EXPECT_NEAR(at_vertices(v, c * d + a), field.gradient(mesh.vertices(), vertex, c, a), 1e-10);
        for (int b = a; b < d; ++b, ++s)
          EXPECT_NEAR(curved(v, c * num_symmetric(d) + s), field.hessian(mesh.vertices(), vertex, c, a, b), 1e-8);
      }
  }
}

TYPED_TEST(CubicsOn, AreReproducedByWeightsAlone) {
  using E = TypeParam;
  constexpr int d = E::dim;
  const Mesh mesh = test::lattice<E>(d == 2 ? 6 : 4, 0.15, 7);
  const Points points = test::random_points_inside(mesh, 20, 8);
  const CellBlocks<E> cells{mesh.vertices(), {std::get<ElementBlock<E>>(mesh.blocks()[0])}};
  const WeightedPoints weights = embed(cells, points);
  const auto made = make_reconstructor(cubic_kriging);
  const Reconstruction rows = made.reconstructor->reconstruct(CellGradients(mesh), active_vertices(weights));
  const Interpolant<double> interpolant(weights, named_rule("dual_taylor"), &rows);
  const Cubics field(d);
  EXPECT_LE((interpolant.evaluate(field.values(mesh.vertices())) - field.values(points)).cwiseAbs().maxCoeff(), 1e-11);
}

TEST(DualTaylor, HessiansAreKeptByItAlone) {
  const Mesh mesh = test::lattice<Triangle>(4, 0.1, 1);
  const Embedding embedding = embed(mesh, test::random_points_inside(mesh, 10, 2));
  const auto active = active_vertices(mesh, embedding);
  const Reconstruction cubic =
      make_reconstructor(cubic_kriging).reconstructor->reconstruct(CellGradients(mesh), active);
  const Reconstruction lean =
      make_reconstructor("volume_average").reconstructor->reconstruct(CellGradients(mesh), active);
  const Interpolant<double> phong(mesh, embedding, named_rule("phong"), &cubic);
  Values<double> gradients, hessians = Values<double>::Ones(3, 3);
  phong.vertex_derivatives(mesh.vertices(), gradients, hessians);
  EXPECT_EQ(gradients.rows(), phong.report().num_active_vertices);
  EXPECT_EQ(hessians.size(), 0);
  EXPECT_THAT(message_of([&] { Interpolant<double>(mesh, embedding, named_rule("dual_taylor"), &lean); }),
              HasSubstr("vertex Hessians"));
}

}  // namespace
}  // namespace halfgrad
