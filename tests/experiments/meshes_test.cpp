// Generated meshes and points are what they claim to be.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <numbers>

#include "experiments/ball.hpp"
#include "experiments/lattice.hpp"
#include "experiments/point_source.hpp"
#include "framework/embedding.hpp"
#include "framework/error.hpp"

namespace halfgrad {
namespace {

void expect_valid(const Mesh& mesh) {
  const MeshReport report = inspect(mesh);
  EXPECT_TRUE(report.degenerate_cells.empty());
  EXPECT_TRUE(report.inverted_cells.empty());
  EXPECT_TRUE(report.folded_cells.empty());
  EXPECT_TRUE(report.unused_vertices.empty());
  EXPECT_EQ(report.num_nonmanifold_facets, 0);
}

TEST(Lattice, EveryPatternFillsTheBoxRegularOrNot) {
  for (const std::string_view element : lattice_elements()) {
    std::vector<std::string_view> patterns = lattice_patterns(element);
    if (patterns.empty()) patterns.push_back("");
    for (const std::string_view pattern : patterns)
      for (const bool irregular : {false, true}) {
        SCOPED_TRACE(fmt::format("{} {} {}", element, pattern, irregular ? "irregular" : "regular"));
        LatticeOptions options;
        options.element = element;
        options.pattern = pattern;
        options.cells = {4, 3, 5};
        options.size = {2, 1, 1};
        options.jitter = irregular ? 0.2 : 0;
        const Mesh mesh = make_lattice(options);
        expect_valid(mesh);
        const double volume = 2;
        // Quadrilateral faces are warped by jitter: the midpoint rule is off by the warp squared.
        const bool curved_sides =
            element == "hexahedron" || element == "wedge" || element == "pyramid" || pattern == "solid";
        EXPECT_NEAR(inspect(mesh).volume, volume, curved_sides && irregular ? 1e-2 : 1e-12);
        EXPECT_EQ(mesh.vertices().colwise().minCoeff().norm(), 0);
        EXPECT_EQ(mesh.vertices().col(0).maxCoeff(), 2);
      }
  }
}

TEST(Lattice, CountsAreTheKnownOnes) {
  LatticeOptions options;
  options.cells = {6, 6, 6};
  const Mesh kuhn = make_lattice(options);
  EXPECT_EQ(kuhn.num_vertices(), 343);
  EXPECT_EQ(kuhn.num_cells(), 1296);
  options.pattern = "bcc";
  options.cells = {5, 5, 5};
  const Mesh bcc = make_lattice(options);
  EXPECT_EQ(bcc.num_vertices(), 341);
  EXPECT_EQ(bcc.num_cells(), 1500);
}

TEST(Lattice, WarpKeepsSidesAndCells) {
  LatticeOptions options;
  options.element = "hexahedron";
  options.warp = 0.06;
  const Mesh mesh = make_lattice(options);
  expect_valid(mesh);
  EXPECT_EQ(mesh.vertices().minCoeff(), 0);
  EXPECT_EQ(mesh.vertices().maxCoeff(), 1);
}

TEST(Lattice, RefusesWhatItDoesNotKnow) {
  LatticeOptions options;
  options.element = "dodecahedron";
  EXPECT_THROW(make_lattice(options), Error);
  options = {};
  options.pattern = "equilateral";
  EXPECT_THROW(make_lattice(options), Error);
  options = {};
  options.jitter = 0.7;
  EXPECT_THROW(make_lattice(options), Error);
}

TEST(Ball, IsValidRoundAndWithoutSlivers) {
  for (const int gdim : {2, 3}) {
    SCOPED_TRACE(gdim);
    BallOptions options;
    options.gdim = gdim;
    options.spacing = 0.15;
    const Mesh mesh = make_ball(options);
    expect_valid(mesh);
    const MeshReport report = inspect(mesh);
    // The polytope lacks the caps beyond its facets, a share of about (h / R)² / 4.
    const double volume = gdim == 3 ? std::numbers::pi / 6 : std::numbers::pi / 4;
    EXPECT_LT(report.volume, volume);
    EXPECT_GT(report.volume, volume * (gdim == 3 ? 0.9 : 0.95));
    EXPECT_NEAR(report.mean_edge, options.spacing, 0.15 * options.spacing);
    EXPECT_GT(report.min_quality, gdim == 3 ? 0.08 : 0.35);
    const std::vector<char> boundary = boundary_vertices(mesh);
    for (Index v = 0; v < mesh.num_vertices(); ++v) {
      const double radius = mesh.vertices().row(v).norm();
      if (boundary[v])
        EXPECT_NEAR(radius, 0.5, 1e-12);
      else
        EXPECT_LT(radius, 0.5);
    }
  }
}

TEST(Ball, IsTheSameForTheSameSeedAndAnotherForAnother) {
  BallOptions options;
  options.spacing = 0.25;
  const Mesh first = make_ball(options), again = make_ball(options);
  EXPECT_EQ(first.vertices(), again.vertices());
  options.seed = 1;
  const Mesh other = make_ball(options);
  EXPECT_TRUE(other.num_vertices() != first.num_vertices() || other.vertices() != first.vertices());
}

TEST(RandomPoints, LieInsideAndFillTheMesh) {
  BallOptions options;
  options.gdim = 2;
  const Mesh mesh = make_ball(options);
  const Points points = random_points(mesh, 4000, 1);
  const Embedding embedding = embed(mesh, points);  // throws where one is outside
  EXPECT_EQ(embedding.num_points(), 4000);
  // The mean of a uniform density is the center; its deviation is R / 2 / sqrt(4000) ≈ 0.004 an axis.
  EXPECT_LT(points.colwise().mean().norm(), 0.02);
}

TEST(Surfaces, HaveTheirCountsAndClose) {
  const PointCloud sphere = geodesic_sphere(7, 0.45, Vector::Zero(3));
  EXPECT_EQ(sphere.positions.rows(), 10 * 49 + 2);
  EXPECT_EQ(sphere.faces.num_rows(), 20 * 49);
  EXPECT_LT((sphere.positions.rowwise().norm().array() - 0.45).abs().maxCoeff(), 1e-15);
  const PointCloud cylinder = cylinder_surface(0.3, 0.8, 12, 5, Vector::Zero(3));
  for (const PointCloud* surface : {&sphere, &cylinder}) {
    // Euler: V − E + F = 2 with E = 3F / 2.
    EXPECT_EQ(surface->positions.rows() - surface->faces.num_rows() / 2, 2);
    double volume = 0;
    for (Index f = 0; f < surface->faces.num_rows(); ++f) {
      const auto face = surface->faces[f];
      const Eigen::Vector3d a = surface->positions.row(face[0]), b = surface->positions.row(face[1]),
                            c = surface->positions.row(face[2]);
      volume += a.dot(b.cross(c)) / 6;
    }
    EXPECT_GT(volume, 0.15);  // outward faces: both hold more
  }
}

}  // namespace
}  // namespace halfgrad
