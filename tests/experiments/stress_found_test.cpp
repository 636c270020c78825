// What the stress test found, each as the plainest case that shows it.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "framework/embedding.hpp"
#include "framework/interpolant.hpp"
#include "reconstruction/registry.hpp"
#include "tests/support/test_meshes.hpp"

namespace halfgrad {
namespace {

Mesh triangles(Points vertices, std::vector<std::array<Index, 3>> cells) {
  ElementBlock<Triangle> block;
  block.cells.resize(static_cast<Eigen::Index>(cells.size()), 3);
  for (std::size_t c = 0; c < cells.size(); ++c)
    for (int i = 0; i < 3; ++i) block.cells(static_cast<Eigen::Index>(c), i) = cells[c][i];
  return Mesh(std::move(vertices), {block});
}

Points unit_triangle() {
  Points vertices(3, 2);
  vertices << 0, 0, 1, 0, 0, 1;
  return vertices;
}

// Every facet belonged to two cells, so that there was no boundary for points outside.
TEST(StressFound, ACellAndItsDoubleHaveABoundary) {
  const Mesh mesh = triangles(unit_triangle(), {{0, 1, 2}, {1, 2, 0}});
  Points points(1, 2);
  points << -1, 0.25;
  const Embedding embedding = embed(mesh, points, {.outside = Outside::nearest});
  ASSERT_EQ(embedding.outside.size(), 1u);
  EXPECT_NEAR(embedding.outside[0].distance, 1, 1e-15);
}

// |F Σ e ⊗ g − I| was ε / height², with height² next to ε for a needle of 1e7 to 1 along the diagonal of space.
TEST(StressFound, ObliqueNeedlesKeepAffineValues) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (const double height : {1e-3, 1e-5, 1e-6}) {
    Eigen::Matrix<double, 4, 3> positions;
    positions << 0, 0, 0, 1, 0, 0, 0.3, height, 0, 0.4, 0, height;
    positions = (positions * turn.transpose()).eval();
    const CellGradient cell = cell_gradient<Tetrahedron>(positions);
    ASSERT_GT(cell.volume, 0) << height;
    const Eigen::Matrix3d product = positions.transpose() * cell.weights;
    EXPECT_LT((product - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-15 * 20 / height) << height;
  }
}

// Squares of float values of 1e-25 are zero, and 0/0 is NaN; those of 1e25 are infinite.
TEST(StressFound, AdaptiveBlendsFloatsOfAnySize) {
  for (const double scale : {1e-25, 1e25}) {
    const Mesh unit = test::lattice<Tetrahedron>(2, 0.2, 1);
    const Mesh mesh(unit.vertices() * scale, unit.blocks());
    const Points points = test::random_points_inside(unit, 20, 1) * scale;
    const Embedding embedding = embed(mesh, points);
    const Reconstruction rows = make_reconstructor("adaptive").reconstructor->reconstruct(
        CellGradients(mesh), active_vertices(mesh, embedding));
    const Interpolant<float> phong(mesh, embedding, named_rule("phong"), &rows);
    const Values<float> deformed =
        (scale * (unit.vertices().array() + unit.vertices().array().square())).cast<float>().matrix();
    EXPECT_TRUE(phong.evaluate(deformed).allFinite()) << scale;
  }
}

// The squared bound of a correction of 1e-25 was zero in float: every cell was linear, whatever the tolerance.
TEST(StressFound, TolerancesHoldForFloatsOfAnySize) {
  for (const double scale : {1.0, 1e-25}) {
    const Mesh unit = test::lattice<Tetrahedron>(2, 0.2, 1);
    const Mesh mesh(unit.vertices() * scale, unit.blocks());
    const Points points = test::random_points_inside(unit, 50, 1) * scale;
    const Embedding embedding = embed(mesh, points);
    const Reconstruction rows = make_reconstructor("kriging").reconstructor->reconstruct(
        CellGradients(mesh), active_vertices(mesh, embedding));
    const Interpolant<float> phong(mesh, embedding, named_rule("phong"), &rows);
    const Values<float> deformed = (scale * unit.vertices().array().square()).cast<float>().matrix();
    const double tolerance = 1e-3 * scale;
    const Values<float> exact = phong.evaluate(deformed), rough = phong.evaluate(deformed, {.tolerance = tolerance});
    for (Index p = 0; p < exact.rows(); ++p)
      EXPECT_LE((exact.row(p) - rough.row(p)).cast<double>().norm(), tolerance * (1 + 1e-4)) << scale;
  }
}

}  // namespace
}  // namespace halfgrad
