#include "framework/embedding.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/QR>

#include "framework/error.hpp"
#include "framework/inverse_map.hpp"
#include "tests/support/test_meshes.hpp"

namespace halfgrad {
namespace {

using testing::HasSubstr;

// Greatest distance of Σβ_i X_i from X over the points with a cell, each in units of its cell's longest extent.
double reproduction_error(const Mesh& mesh, const Points& points, const Embedding& embedding) {
  double worst = 0;
  std::vector<const Vector*> offset(points.rows(), nullptr);
  for (const OutsidePoint& outside : embedding.outside) offset[outside.point] = &outside.offset;
  for (Index p = 0; p < embedding.num_points(); ++p) {
    if (embedding.cells[p] < 0) continue;
    with_cell(mesh, embedding.cells[p], [&]<Element E>(const ElementBlock<E>& block, Eigen::Index row) {
      const NodeMatrix<E> nodes = node_positions(mesh, block, row).rowwise() - points.row(p).template head<E::dim>();
      const ReferencePoint<E> xi = embedding.local.row(p).transpose().template head<E::dim>();
      const NodeVector<E> beta = cell_weights<E>(xi, offset[p]);
      const double extent = (nodes.colwise().maxCoeff() - nodes.colwise().minCoeff()).maxCoeff();
      worst = std::max(worst, (nodes.transpose() * beta).norm() / (extent * beta.cwiseAbs().sum()));
    });
  }
  return worst;
}

template <class Function>
std::string message_of(Function&& f) {
  try {
    f();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

// Points around the unit cube and up to `reach` outside it.
Points points_around(int gdim, Index count, double reach, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-reach, 1 + reach);
  Points points(count, gdim);
  for (Index p = 0; p < count; ++p)
    for (int a = 0; a < gdim; ++a) points(p, a) = uniform(random);
  return points;
}

template <class E>
class Embed : public testing::Test {};
using AllElements = Elements::apply<testing::Types, std::type_identity_t>;
TYPED_TEST_SUITE(Embed, AllElements);

TYPED_TEST(Embed, FindsEveryPointInsideStretchedMeshes) {
  for (const double factor : {1.0, 10.0, 33.0, 1000.0, 1e-3})
    for (const double jitter : {0.0, 0.2}) {
      const Mesh mesh = test::stretched(test::lattice<TypeParam>(4, jitter, 1), factor);
      const Points points = test::random_points_inside(mesh, 4000, 2);
      const Embedding embedding = embed(mesh, points);
      EXPECT_TRUE(embedding.outside.empty());
      EXPECT_EQ(std::count(embedding.status.begin(), embedding.status.end(), PointStatus::inside), 4000);
      EXPECT_LT(reproduction_error(mesh, points, embedding), 1e-12) << factor << " " << jitter;
    }
}

TYPED_TEST(Embed, FindsVerticesAndTheMiddlesOfFacets) {
  const Mesh mesh = test::lattice<TypeParam>(3, 0.2, 3);
  std::vector<Vector> middles;
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) {
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c)
      for (const Facet& facet : E::facets) {
        Vector middle = Vector::Zero(mesh.gdim());
        for (int i = 0; i < facet.num_nodes; ++i)
          middle += mesh.vertices().row(block.cells(c, facet.nodes[i])).transpose() / facet.num_nodes;
        middles.push_back(middle);
        const auto a = mesh.vertices().row(block.cells(c, facet.nodes[0]));
        const auto b = mesh.vertices().row(block.cells(c, facet.nodes[facet.num_nodes > 1 ? 1 : 0]));
        middles.push_back(0.5 * (a + b).transpose());
      }
  });
  Points points(mesh.num_vertices() + static_cast<Index>(middles.size()), mesh.gdim());
  points.topRows(mesh.num_vertices()) = mesh.vertices();
  for (std::size_t i = 0; i < middles.size(); ++i)
    points.row(mesh.num_vertices() + static_cast<Index>(i)) = middles[i].transpose();
  const Embedding embedding = embed(mesh, points);
  EXPECT_TRUE(embedding.outside.empty());
  EXPECT_LT(reproduction_error(mesh, points, embedding), 1e-12);
}

TYPED_TEST(Embed, ExtrapolatedWeightsReproducePointsOutside) {
  const Mesh mesh = test::lattice<TypeParam>(3, 0.2, 4);
  const Points points = points_around(mesh.gdim(), 2000, 1, 5);
  const Embedding embedding = embed(mesh, points, {.outside = Outside::nearest});
  EXPECT_FALSE(embedding.outside.empty());
  EXPECT_LT(reproduction_error(mesh, points, embedding), 1e-12);
  for (const OutsidePoint& outside : embedding.outside) {
    // The lattice fills the unit cube: the true distance is known.
    const Vector position = points.row(outside.point).transpose();
    const double distance = (position - position.cwiseMax(0.0).cwiseMin(1.0)).norm();
    EXPECT_NEAR(outside.distance, distance, 1e-12);
    EXPECT_EQ(embedding.status[outside.point], PointStatus::outside);
  }
}

TYPED_TEST(Embed, DoesNotDependOnOffsetAndScale) {
  const Mesh mesh = test::lattice<TypeParam>(3, 0.2, 6);
  const int gdim = mesh.gdim();
  for (const double scale : {1e-12, 1.0, 1e12})
    for (const double shift : {0.0, 1e8}) {
      const Mesh moved = test::transformed(mesh, scale * Eigen::MatrixXd::Identity(gdim, gdim),
                                           Eigen::VectorXd::Constant(gdim, shift * scale));
      const Points points = test::random_points_inside(moved, 2000, 7);
      // At an offset of 1e8 the given coordinates themselves carry 1.5e-8 of rounding.
      const Embedding embedding = embed(moved, points, {.outside = Outside::nearest, .tolerance = 1e-6});
      EXPECT_TRUE(embedding.outside.empty());
      EXPECT_LT(reproduction_error(moved, points, embedding), 1e-12);
    }
}

TEST(EmbedPolicies, ErrorNamesTheFirstPointAndTheWayOut) {
  const Mesh mesh = test::lattice<Tetrahedron>(2, 0.1, 1);
  Points points(3, 3);
  points << 0.5, 0.5, 0.5, 1.25, 0.5, 0.5, 0.5, 4, 0.5;
  const std::string message = message_of([&] { embed(mesh, points); });
  EXPECT_THAT(message, HasSubstr("2 of 3 points"));
  EXPECT_THAT(message, HasSubstr("point 1 at (1.25, 0.5, 0.5), at distance 0.25"));
  EXPECT_THAT(message, HasSubstr("point 2, at distance 3"));
  EXPECT_THAT(message, HasSubstr("nearest"));
  EXPECT_THAT(message, HasSubstr("mark"));

  const Embedding marked = embed(mesh, points, {.outside = Outside::mark});
  EXPECT_EQ(marked.cells[1], -1);
  EXPECT_EQ(marked.status[1], PointStatus::not_found);
  EXPECT_EQ(marked.status[0], PointStatus::inside);
  ASSERT_EQ(marked.outside.size(), 2U);
  EXPECT_EQ(marked.outside[0].point, 1);
  EXPECT_DOUBLE_EQ(marked.outside[1].distance, 3);
  EXPECT_EQ(marked.outside[1].offset.norm(), 0);
}

TEST(EmbedPolicies, RefusesWhatItCannotEmbed) {
  const Mesh mesh = test::lattice<Tetrahedron>(2, 0.1, 1);
  Points points = Points::Constant(3, 3, 0.5);
  points(2, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(message_of([&] { embed(mesh, points); }), HasSubstr("point 2 is (0.5, nan, 0.5)"));
  EXPECT_THAT(message_of([&] { embed(mesh, Points::Zero(2, 2)); }), HasSubstr("2 coordinates in a mesh of R^3"));
  EXPECT_THAT(message_of([&] { embed(Mesh(Points::Zero(1, 3), {}), Points::Zero(1, 3)); }), HasSubstr("no cells"));
}

}  // namespace
}  // namespace halfgrad
