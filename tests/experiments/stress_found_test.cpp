// What the stress test found, each as the plainest case that shows it.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <random>

#include "framework/cell_locator.hpp"
#include "framework/embedding.hpp"
#include "framework/interpolant.hpp"
#include "reconstruction/kriging_system.hpp"
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
    const Reconstruction rows = make_reconstructor("adaptive")
                                    .reconstructor->reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
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
    const Reconstruction rows =
        make_reconstructor("kriging").reconstructor->reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
    const Interpolant<float> phong(mesh, embedding, named_rule("phong"), &rows);
    const Values<float> deformed = (scale * unit.vertices().array().square()).cast<float>().matrix();
    const double tolerance = 1e-3 * scale;
    const Values<float> exact = phong.evaluate(deformed), rough = phong.evaluate(deformed, {.tolerance = tolerance});
    for (Index p = 0; p < exact.rows(); ++p)
      EXPECT_LE((exact.row(p) - rough.row(p)).cast<double>().norm(), tolerance * (1 + 1e-4)) << scale;
  }
}

// Beyond 2^53 a centroid rounds to its cell's first vertex: 1 / distance was infinite and its quotient NaN.
TEST(StressFound, CentroidsThatRoundToAVertexGiveFiniteWeights) {
  const Points vertices = (2 * unit_triangle()).array() + 1e16;
  const Mesh mesh = triangles(vertices, {{0, 1, 2}});
  for (const char* name : {"inverse_distance", "chandrashekar_garg", "knn"}) {
    const Reconstruction rows = make_reconstructor(name).reconstructor->reconstruct(CellGradients(mesh), std::array{0});
    ASSERT_EQ(rows.stencils.num_entries(), 2) << name;
    for (const double weight : rows.stencils.weights) EXPECT_TRUE(std::isfinite(weight)) << name;
  }
}

// Where J is singular at the closest point, weights start farther inside and go the rest of the way by their gradient.
// A point within the tolerance of the boundary lost that rest.
TEST(StressFound, PointsAtACollapsedCornerStayThere) {
  Points vertices(4, 2);
  vertices << 0, 0, 1, 0, 1, 1, 1, 1;
  ElementBlock<Quadrilateral> block;
  block.cells.resize(1, 4);
  block.cells << 0, 1, 2, 3;
  const Mesh mesh(vertices, {block});
  Points points(1, 2);
  points << 1 + 1e-10, 1 + 1e-10;
  const Embedding embedding = embed(mesh, points);
  ASSERT_TRUE(embedding.outside.empty());
  const Eigen::RowVector2d found =
      Quadrilateral::shape(embedding.local.row(0).transpose()).transpose() * vertices.leftCols<2>();
  EXPECT_LT((found - points.row(0)).norm(), 1e-9);
}

// Vertices of flat cells alone had stencils of 1e12 and more, made of the rounding across their plane.
TEST(StressFound, VerticesWithoutVolumeHaveNoGradient) {
  Points vertices(6, 2);
  vertices << unit_triangle(), 5.1, 5.3, 6.1, 6.3, 7.1, 7.3;
  const Mesh mesh = triangles(vertices, {{0, 1, 2}, {3, 4, 5}});
  for (const char* const drift : {"quadratic", "cubic"}) {
    const Reconstruction rows = make_reconstructor({{"kriging", {{"drift", drift}}}})
                                    .reconstructor->reconstruct(CellGradients(mesh), std::array{0, 4});
    EXPECT_EQ(rows.stencils.diagnostics[0].rule, StencilRule::cell_value);
    EXPECT_EQ(rows.stencils.diagnostics[1].rule, StencilRule::none);
    EXPECT_EQ(rows.stencils.offsets[2], rows.stencils.offsets[1]);
  }
}

// A short edge away from the first node had the digits of a difference in float. On one cell hermite is linear.
TEST(StressFound, ShortEdgesKeepTheirDigitsInFloat) {
  Points vertices(3, 2);
  vertices << 0, 0, 1, 0.3, 1, 0.3 + 5e-8;
  const Mesh mesh = triangles(vertices, {{0, 1, 2}});
  Points points(1, 2);
  points << 0.25 * vertices.row(1) + 0.75 * vertices.row(2);
  const Embedding embedding = embed(mesh, points);
  const Reconstruction rows = make_reconstructor("chandrashekar_garg")
                                  .reconstructor->reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
  Values<float> values(3, 2);
  values << 0, 0, 1, -1, -1, 1;
  const Values<float> linear = Interpolant<float>(mesh, embedding, named_rule("linear"), nullptr).evaluate(values);
  const Values<float> hermite = Interpolant<float>(mesh, embedding, named_rule("hermite"), &rows).evaluate(values);
  EXPECT_LT((hermite - linear).cwiseAbs().maxCoeff(), 1e-5f);
}

// Near points and others 1e5 times as far: the quadratic and cubic modes, of 1e10 and 1e15, left 1e-7 in the linear
// ones, and Hessians of affine values.
TEST(StressFound, FitsOverUnequalDistancesKeepAffineValues) {
  Eigen::MatrixXd points(2, 24);
  for (int j = 0; j < 24; ++j) {
    const double radius = std::pow(10, 5 * (j / 23.0)), angle = 2.4 * j;
    points.col(j) << radius * std::cos(angle), radius * std::sin(angle);
  }
  KrigingFit fit;
  KrigingSystem(2, 3).solve(points, fit);
  const Eigen::Matrix2d gradient = fit.gradient * points.transpose();
  EXPECT_LT((gradient - Eigen::Matrix2d::Identity()).norm(), 1e-12 * (1 + fit.absolute_sum));
  const double magnitude = (fit.hessian.cwiseAbs() * points.cwiseAbs().transpose()).maxCoeff();
  EXPECT_LT((fit.hessian * points.transpose()).cwiseAbs().maxCoeff(), 1e-12 * (1 + magnitude));
}

// Twenty cubic modes of four dimensions overran the memory for ten.
TEST(StressFound, CubicFitsInFourDimensions) {
  Eigen::MatrixXd points(4, 160);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-2, 2);
  for (Eigen::Index k = 0; k < points.size(); ++k) points.data()[k] = uniform(random);
  KrigingFit fit;
  KrigingSystem(4, 3).solve(points, fit);
  EXPECT_LT((fit.gradient * points.transpose() - Eigen::Matrix4d::Identity()).norm(), 1e-10);
  EXPECT_LT(fit.quadratic_response, 1e-8);
}

// A sliver of 1e-9, and a needle of 1e-6 oblique to the axes: the first must hold its centroid, and weights in the
// second must reproduce positions.
TEST(StressFound, SliversHoldTheirPointsAndNeedlesReproduceThem) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  Eigen::Matrix<double, 4, 3> sliver, needle;
  sliver << 0, 0, 0, 1, 0, 1e-9, 0, 1, 1e-9, 1, 1, 0;
  needle << 0, 0, 0, 1, 0, 0, 0.3, 1e-6, 0, 0.4, 0, 1e-6;
  ElementBlock<Tetrahedron> block;
  block.cells.resize(1, 4);
  block.cells << 0, 1, 2, 3;
  for (const auto& shape : {sliver, needle}) {
    const Eigen::Matrix<double, 4, 3> turned = shape * turn.transpose();
    const Mesh mesh(Points(turned), {block});
    Points points(20, 3);
    std::mt19937 random(2);
    std::uniform_real_distribution<double> uniform(0.1, 1);
    for (Index p = 0; p < 20; ++p) {
      Eigen::RowVector4d beta;
      for (int i = 0; i < 4; ++i) beta[i] = uniform(random);
      points.row(p) = beta / beta.sum() * turned;
    }
    const CellLocations found = locate(mesh, points, 1e-9);
    for (Index p = 0; p < 20; ++p) {
      ASSERT_EQ(found.cells[p], 0);
      const Eigen::Vector4d beta = Tetrahedron::shape(found.local.row(p).transpose());
      EXPECT_LT((beta.transpose() * turned - points.row(p)).norm(), 1e-12);
    }
  }
}

// |Σ_j (X_j − X_v) ⊗ g_vj − I| over Σ_j |X_j − X_v| |g_vj|.
double affine_residual(const Mesh& mesh, const GradientStencilTable& table, Index row) {
  const int gdim = mesh.gdim();
  SmallMatrix product = -SmallMatrix::Identity(gdim, gdim);
  double magnitude = 1;
  for (Offset e = table.offsets[row]; e < table.offsets[row + 1]; ++e) {
    const Vector edge =
        (mesh.vertices().row(table.neighbors[e]) - mesh.vertices().row(table.vertices[row])).transpose();
    const Eigen::Map<const Eigen::VectorXd> weight(table.weights.data() + e * gdim, gdim);
    product += edge * weight.transpose();
    magnitude += edge.norm() * weight.norm();
  }
  return product.cwiseAbs().maxCoeff() / magnitude;
}

// The nearest vertices were all in the same place, beyond flat cells, and gave a unit of length of zero: no gradient.
TEST(StressFound, VerticesInOnePlaceDoNotHideTheOthers) {
  Points vertices(4, 1);
  vertices << 0, 1, 1, 1;
  ElementBlock<Segment> block;
  block.cells.resize(3, 2);
  block.cells << 0, 1, 1, 2, 2, 3;
  const Mesh mesh(vertices, {block});
  for (const nlohmann::json& options :
       {nlohmann::json::object(), nlohmann::json{{"patch", "lean"}}, nlohmann::json{{"drift", "cubic"}}}) {
    const Reconstruction rows =
        make_reconstructor({{"kriging", options}}).reconstructor->reconstruct(CellGradients(mesh), std::array{1});
    EXPECT_LT(affine_residual(mesh, rows.stencils, 0), 1e-14) << options;
  }
}

// The metric of a needle of 1e6 to 1 left its rounding, times a million, in the rows.
TEST(StressFound, RowsOfObliqueNeedlesKeepAffineValues) {
  const Mesh unit = test::lattice<Triangle>(4, 0.2, 1);
  Points vertices = unit.vertices();
  vertices.col(1) *= 3e-7;
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(0.7).toRotationMatrix();
  const Mesh mesh(Points(vertices * turn.transpose()), unit.blocks());
  std::vector<Index> all(mesh.num_vertices());
  std::iota(all.begin(), all.end(), 0);
  for (const char* const drift : {"quadratic", "cubic"}) {
    const Reconstruction rows =
        make_reconstructor({{"kriging", {{"drift", drift}}}}).reconstructor->reconstruct(CellGradients(mesh), all);
    for (const Index v : all) EXPECT_LT(affine_residual(mesh, rows.stencils, v), 1e-14) << drift << v;
  }
}

// Where two nodes of a quadrilateral coincide but for rounding, J at the corner has a column of that rounding, well
// directed: the solver took it for zero and lost a coordinate.
TEST(StressFound, WeightsBesideANearlyCollapsedCornerReproducePositions) {
  Points vertices(4, 2);
  vertices << 0, 0, -1.8e-16, 0, 1, -1, 1, 0;
  ElementBlock<Quadrilateral> block;
  block.cells.resize(1, 4);
  block.cells << 0, 1, 2, 3;
  const Mesh mesh(vertices, {block});
  Points points(1, 2);
  points << -200, -100;
  const Embedding embedding = embed(mesh, points, {.outside = Outside::nearest});
  ASSERT_EQ(embedding.outside.size(), 1u);
  const Eigen::Vector2d xi = embedding.local.row(0).transpose(), offset = embedding.outside[0].offset;
  const Eigen::Vector4d beta = Quadrilateral::shape(xi) + Quadrilateral::shape_gradient(xi) * offset;
  EXPECT_LT((beta.transpose() * vertices - points.row(0)).norm(), 1e-8);
}

// An edge of 1e-25, of a flat cell, has difference quotients whose squares, and one of 1e-39 even whose factor 2 / |e|,
// are no floats.
TEST(StressFound, AdaptiveBlendsFloatsBesideShortEdges) {
  for (const double scale : {1.0, 1e-25}) {
    for (const double length : {1e-14, 1e-25}) {
      Points vertices(7, 2);
      vertices << 0, 0, 1, 0, 0, 1, 1, 1, 0, -length, -1, 0, 0, -1;
      const Mesh mesh = triangles(scale * vertices, {{0, 1, 2}, {1, 3, 2}, {4, 0, 2}, {4, 5, 6}});
      Points points(2, 2);
      points << 0.25, 0.25, 0.75, 0.75;
      const Embedding embedding = embed(mesh, scale * points);
      const Reconstruction rows =
          make_reconstructor("adaptive")
              .reconstructor->reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
      const Interpolant<float> phong(mesh, embedding, named_rule("phong"), &rows);
      Values<float> values(7, 2);
      values << 0.1f, 0, 1, 0.2f, 0.3f, 1, 1, 2, 0.7f, -0.4f, -1, 0, 0.1f, -1;
      values *= static_cast<float>(scale);
      for (const Kernel kernel : {Kernel::fast, Kernel::plain})
        EXPECT_TRUE(phong.evaluate(values, {.kernel = kernel}).allFinite()) << scale << " " << length;
      values.rowwise() = values.row(1).eval();
      EXPECT_EQ(phong.evaluate(values).row(0), values.row(0)) << scale << " " << length;
    }
  }
}

// A triangle as thick as four last places of its coordinates, far from the origin: its own centroid, rounded, lay
// outside of it.
TEST(StressFound, SliversFarAwayHoldTheirRoundedCentroids) {
  const double place = 0x1p-19;  // of the last digit at 2^33
  Points vertices(3, 2);
  vertices << 0, 0, 1, 0.25 + 4 * place, 0.5, 0.125;
  vertices.array() += 0x1p33;
  const Mesh mesh = triangles(vertices, {{0, 1, 2}});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0.01, 1);
  Points points(200, 2);
  for (Index p = 0; p < points.rows(); ++p) {
    Eigen::RowVector3d beta(uniform(random), uniform(random), uniform(random));
    points.row(p) = beta / beta.sum() * vertices;
  }
  const CellLocations found = locate(mesh, points, 1e-9);
  for (Index p = 0; p < points.rows(); ++p) EXPECT_EQ(found.cells[p], 0) << p;
}

// The centroids of a cell and its double differ by rounding, which counted as a direction in which they lie. The row is
// that of the cell.
TEST(StressFound, DoubledCellsHaveOneGradient) {
  ElementBlock<Tetrahedron> block;
  block.cells.resize(2, 4);
  block.cells << 0, 1, 2, 3, 2, 1, 0, 3;
  Points corners(4, 3);
  corners << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1;
  for (int k = 0; k < 50; ++k) {
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.1 * k, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    const Mesh mesh(Points(corners * turn.transpose()), {block});
    const Reconstruction rows =
        make_reconstructor("spr").reconstructor->reconstruct(CellGradients(mesh), std::array{0});
    double sum = 0;
    for (Offset e = 0; e < rows.stencils.num_entries(); ++e)
      sum += Eigen::Map<const Eigen::Vector3d>(rows.stencils.weights.data() + 3 * e).norm();
    EXPECT_NEAR(sum, 3, 1e-13) << k;
  }
}

}  // namespace
}  // namespace halfgrad
