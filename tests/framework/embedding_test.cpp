#include "framework/embedding.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/QR>

#include "framework/error.hpp"
#include "framework/inverse_map.hpp"
#include "support/message_of.hpp"
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

// Distance to a facet by sampling its parameters, ever closer around the best sample.
double sampled_distance(const Eigen::MatrixXd& nodes, const Vector& position) {
  const Eigen::Index n = nodes.rows();
  const auto at = [&](double u, double v) {
    Eigen::VectorXd weights(n);
    if (n == 4) weights << (1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v;
    if (n == 3) weights << 1 - u, u * (1 - v), u * v;
    if (n == 2) weights << 1 - u, u;
    if (n == 1) weights << 1;
    return (nodes.transpose() * weights - position).norm();
  };
  double best = std::numeric_limits<double>::infinity(), best_u = 0.5, best_v = 0.5;
  for (double reach = 0.5; reach > 1e-9; reach *= 0.25) {
    const double middle_u = best_u, middle_v = best_v;
    for (int i = -10; i <= 10; ++i)
      for (int j = -10; j <= 10; ++j) {
        const double u = std::clamp(middle_u + reach * i / 10, 0.0, 1.0),
                     v = std::clamp(middle_v + reach * j / 10, 0.0, 1.0);
        if (const double distance = at(u, v); distance < best) best = distance, best_u = u, best_v = v;
      }
  }
  return best;
}

void expect_sampled_distances(const Mesh& mesh, const Points& points) {
  const Embedding embedding = embed(mesh, points, {.outside = Outside::nearest});
  EXPECT_FALSE(embedding.outside.empty());
  EXPECT_LT(reproduction_error(mesh, points, embedding), 1e-12);
  for (const OutsidePoint& outside : embedding.outside) {
    const Vector position = points.row(outside.point).transpose();
    // Outside the mesh the nearest of all facets is one of the boundary.
    double best = std::numeric_limits<double>::infinity();
    for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) {
      for (Eigen::Index c = 0; c < block.cells.rows(); ++c)
        for (const Facet& facet : E::facets) {
          Eigen::MatrixXd nodes(facet.num_nodes, E::dim);
          for (int i = 0; i < facet.num_nodes; ++i) nodes.row(i) = mesh.vertices().row(block.cells(c, facet.nodes[i]));
          best = std::min(best, sampled_distance(nodes, position));
        }
    });
    // Sampling can only miss the minimum upwards; it ends at steps of 1e-10 along the facet.
    EXPECT_LE(outside.distance, best + 1e-13);
    EXPECT_NEAR(outside.distance, best, 1e-6);
  }
}

TYPED_TEST(Embed, DistanceOutsideIsTheLeastOverAllFacets) {
  // Sheared, so that no facet lies along the axes, and with every vertex moved, so that faces are warped.
  const int gdim = TypeParam::dim;
  Mesh mesh = test::lattice<TypeParam>(1, 0, 1);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> uniform(-0.15, 0.15);
  Points vertices = mesh.vertices();
  for (double& x : vertices.reshaped()) x += uniform(random);
  mesh = Mesh(vertices, mesh.blocks());
  expect_sampled_distances(mesh, points_around(gdim, 12, 1, 9));
}

TEST(EmbedMixed, DistanceOutsideIsTheLeastOverAllFacets) {
  expect_sampled_distances(test::warped_mixed_mesh(), points_around(3, 20, 1, 10));
}

TYPED_TEST(Embed, WeightsAreContinuousAcrossTheBoundary) {
  using E = TypeParam;
  const Mesh mesh = test::lattice<E>(1, 0, 1);
  const Vector middle = Vector::Constant(E::dim, 0.5);
  std::mt19937 random(11);
  for (int i = 0; i < 200; ++i) {
    // A point on the surface of the unit cube off the edges, seen from both sides.
    Vector surface = points_around(E::dim, 1, -0.05, random()).row(0).transpose();
    surface[i % E::dim] = i % 2;
    Points points(2, E::dim);
    points.row(0) = (surface + 1e-8 * (middle - surface)).transpose();
    points.row(1) = (surface - 1e-8 * (middle - surface)).transpose();
    const Embedding embedding = embed(mesh, points, {.outside = Outside::nearest, .tolerance = 1e-12});
    ASSERT_EQ(embedding.outside.size(), 1U);
    Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(2, mesh.num_vertices());
    for (int p = 0; p < 2; ++p)
      with_cell(mesh, embedding.cells[p], [&]<Element F>(const ElementBlock<F>& block, Eigen::Index row) {
        const NodeVector<F> beta = cell_weights<F>(embedding.local.row(p).transpose().template head<F::dim>(),
                                                   p == 0 ? nullptr : &embedding.outside[0].offset);
        for (int n = 0; n < F::num_nodes; ++n) weights(p, block.cells(row, n)) = beta[n];
      });
    EXPECT_LT((weights.row(0) - weights.row(1)).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TYPED_TEST(Embed, PointsHiddenByFoldsAreNotFarOutside) {
  // Vertices off the boundary move by more than a cell: cells fold and overlap, but they still fill the unit cube.
  using E = TypeParam;
  const Mesh mesh = test::lattice<E>(4, 1.2, 12);
  const Points points = points_around(E::dim, 4000, -1e-6, 13);
  const Embedding embedding = embed(mesh, points, {.outside = Outside::nearest});
  // An inverse map that stops at a fold may miss its cell; simplices cannot.
  EXPECT_LE(embedding.outside.size(), E::affine ? 0U : 40U);
  for (const OutsidePoint& outside : embedding.outside) EXPECT_LT(outside.distance, 0.25);
  EXPECT_LT(reproduction_error(mesh, points, embedding), 1e-10);
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
  points(2, 1) = 0.5;
  for (const double tolerance : {-1e-9, 0.1, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THAT(message_of([&] { embed(mesh, points, {.tolerance = tolerance}); }), HasSubstr("from 0 to 0.1"));
  Points flat = mesh.vertices();
  flat.col(2).setZero();
  EXPECT_THAT(message_of([&] { embed(Mesh(flat, mesh.blocks()), points); }),
              HasSubstr("cells of the mesh are degenerate"));
}

TEST(EmbedPolicies, PointsOutsideByARoundingAreOnTheBoundary) {
  const Mesh mesh = test::lattice<Hexahedron>(2, 0, 1);
  Points points(2, 3);
  points << 1 + 1e-8, 0.5, 0.5, 0.25, -1e-8, 1;
  const Embedding embedding = embed(mesh, points, {.tolerance = 1e-7});
  for (int p = 0; p < 2; ++p) EXPECT_NE(embedding.status[p], PointStatus::outside);
  // What locating takes in reference lengths of a cell, the boundary takes in diagonals of the mesh.
  points(0, 0) = 1 + 1.5e-7;
  const Embedding farther = embed(mesh, points, {.tolerance = 1e-7});
  EXPECT_EQ(farther.status[0], PointStatus::boundary);
  EXPECT_TRUE(farther.outside.empty());
}

}  // namespace
}  // namespace halfgrad
