// Grids without connectivity against the explicit mesh of the same cells.
#include "framework/grid.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "framework/error.hpp"
#include "framework/interpolant.hpp"
#include "reconstruction/centered_difference.hpp"
#include "reconstruction/registry.hpp"
#include "support/message_of.hpp"
#include "tests/support/test_meshes.hpp"

namespace halfgrad {
namespace {

using testing::HasSubstr;

GridAxis regular(int cells, double origin, double spacing) { return {cells, origin, spacing, {}}; }
GridAxis graded(std::vector<double> planes) { return {static_cast<int>(planes.size()) - 1, 0, 1, std::move(planes)}; }

// The cells of a 6³ grid whose middle lies in a ball: edges, corners and steps of every kind.
Grid ball_of_cells() {
  std::vector<GridPlace> places;
  for (int k = 0; k < 6; ++k)
    for (int j = 0; j < 6; ++j)
      for (int i = 0; i < 6; ++i)
        if (Eigen::Vector3d(i - 2.5, j - 2.5, k - 2.5).norm() < 2.9) places.push_back({i, j, k});
  return Grid({regular(6, -1, 0.4), regular(6, 0.1, 0.3), graded({0, 0.2, 0.5, 0.9, 1.1, 1.2, 1.7})}, places);
}

std::vector<Grid> grids() {
  return {Grid({regular(5, -0.3, 0.25)}),
          Grid({regular(4, 0, 0.5), graded({-1, -0.7, -0.5, 0, 0.9})}),
          Grid({regular(3, 0, 0.5), regular(4, 1e3, 0.1), regular(5, -2, 0.3)}),
          Grid({graded({0, 0.3, 0.35, 1}), graded({0, 1, 3, 7}), regular(4, 0, 0.25)}),
          Grid({regular(3, 0, 1), regular(3, 0, 1)}, std::vector<GridPlace>{{0, 0}, {1, 0}, {1, 1}, {2, 2}}),
          ball_of_cells()};
}

// Uniform in the bounds and a little around them, and exactly on planes.
Points points_around(const Grid& grid, Index count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-0.1, 1.1);
  Points points(count, grid.gdim());
  for (Index p = 0; p < count; ++p)
    for (int a = 0; a < grid.gdim(); ++a) {
      const int last = grid.axis(a).num_cells;
      const double low = grid.plane(a, 0), high = grid.plane(a, last);
      points(p, a) =
          p % 5 == a ? grid.plane(a, static_cast<int>(random() % (last + 1))) : low + (high - low) * uniform(random);
    }
  return points;
}

TEST(Grid, NumbersCellsAndVerticesAsItsExplicitMesh) {
  for (const Grid& grid : grids()) {
    const Mesh mesh = grid.mesh();
    ASSERT_EQ(mesh.num_cells(), grid.num_cells());
    ASSERT_EQ(mesh.num_vertices(), grid.num_vertices());
    EXPECT_TRUE(inspect(mesh).inverted_cells.empty());
    for (Index c = 0; c < grid.num_cells(); ++c) {
      EXPECT_EQ(grid.cell_at(grid.cell_place(c)), c);
      const auto expected = mesh.cell_vertices(c);
      const auto found = grid.cell_vertices(c);
      EXPECT_TRUE(std::equal(expected.begin(), expected.end(), found.begin()));
    }
    for (Index v = 0; v < grid.num_vertices(); ++v) {
      EXPECT_EQ(grid.vertex_at(grid.vertex_place(v)), v);
      EXPECT_EQ(grid.position(v), mesh.vertices().row(v).transpose());
    }
  }
}

TEST(Grid, EmbedsPointsAsItsExplicitMesh) {
  for (const Grid& grid : grids()) {
    const Mesh mesh = grid.mesh();
    const Points points = points_around(grid, 3000, 1);
    const EmbedOptions options{.outside = Outside::nearest};
    const Embedding here = embed(grid, points, options), there = embed(mesh, points, options);
    ASSERT_EQ(here.outside.size(), there.outside.size());
    for (std::size_t o = 0; o < here.outside.size(); ++o) {
      EXPECT_EQ(here.outside[o].point, there.outside[o].point);
      EXPECT_NEAR(here.outside[o].distance, there.outside[o].distance, 1e-12);
    }
    EXPECT_EQ(here.status, there.status);
    for (Index p = 0; p < here.num_points(); ++p) {
      // Cells that tie but for rounding may differ; where they agree so does ξ.
      if (here.cells[p] != there.cells[p]) continue;
      EXPECT_LT((here.local.row(p) - there.local.row(p)).norm(), 1e-10);
    }
  }
}

TEST(Grid, InterpolatesAsItsExplicitMesh) {
  for (const Grid& grid : grids()) {
    const Mesh mesh = grid.mesh();
    const Points points = points_around(grid, 1000, 2);
    const EmbedOptions options{.outside = Outside::nearest};
    const Embedding here = embed(grid, points, options), there = embed(mesh, points, options);
    Values<double> values(grid.num_vertices(), 3);
    for (Index v = 0; v < values.rows(); ++v) {
      const double s = grid.position(v).sum();
      values.row(v) << std::sin(s), std::cos(2 * s), s * grid.position(v)[0];
    }
    for (const char* name : {"centered_difference", "kriging", "adaptive"}) {
      const auto reconstructor = make_reconstructor(name).reconstructor;
      const Reconstruction on_grid = reconstructor->reconstruct_on_grid(grid, active_vertices(grid, here));
      const Reconstruction on_mesh = reconstructor->reconstruct(CellGradients(mesh), active_vertices(mesh, there));
      const Interpolant<double> a(grid, here, named_rule("phong"), &on_grid);
      const Interpolant<double> b(mesh, there, named_rule("phong"), &on_mesh);
      const Values<double> x = a.evaluate(values), y = b.evaluate(values);
      // Points outside extrapolate from cells that may differ where two are equally near.
      double worst = 0;
      for (Index p = 0; p < x.rows(); ++p)
        if (here.status[p] == PointStatus::inside) worst = std::max(worst, (x.row(p) - y.row(p)).cwiseAbs().maxCoeff());
      EXPECT_LT(worst, 1e-11 * values.cwiseAbs().maxCoeff()) << name;
      EXPECT_EQ(a.report().num_active_cells, b.report().num_active_cells);
      EXPECT_EQ(a.report().num_vertices, grid.num_vertices());
    }
  }
}

TEST(Grid, TakesNoMemoryForItsCells) {
  // A full grid is its axes; a sparse one 8 bytes a cell and 8 a vertex.
  EXPECT_LT(Grid({regular(1000, 0, 1), regular(1000, 0, 1), regular(1000, 0, 1)}).bytes(), 1000);
  const Grid sparse = ball_of_cells();
  EXPECT_LT(sparse.bytes(), 8 * (sparse.num_cells() + sparse.num_vertices()) + 1000);
}

TEST(Grid, RefusesWhatIsNoGrid) {
  EXPECT_THAT(message_of([] { Grid({regular(0, 0, 1)}); }), HasSubstr("0 cells along axis 0"));
  EXPECT_THAT(message_of([] { Grid({regular(2, 0, -1)}); }), HasSubstr("spacing -1"));
  EXPECT_THAT(message_of([] { Grid({graded({0, 1, 1})}); }), HasSubstr("plane 2 of axis 0"));
  EXPECT_THAT(message_of([] {
                GridAxis axis = graded({0, 1, 2});
                axis.num_cells = 3;
                Grid({axis});
              }),
              HasSubstr("3 planes for 3 cells along axis 0"));
  EXPECT_THAT(message_of([] {
                const Embedding flat = embed(Grid({regular(2, 0, 1), regular(2, 0, 1)}), Points::Constant(1, 2, 1));
                Interpolant<double>(Grid({regular(2, 0, 1)}), flat, named_rule("linear"), nullptr);
              }),
              HasSubstr("in 2 dimensions, but the grid has 1"));
  EXPECT_THAT(message_of([] { Grid({regular(2, 0, 1)}, std::vector<GridPlace>{{2}}); }), HasSubstr("cell (2)"));
  EXPECT_THAT(message_of([] { Grid({regular(2, 0, 1)}, std::vector<GridPlace>{{1}, {1}}); }), HasSubstr("twice"));
  EXPECT_THAT(message_of([] {
                Grid({regular(2000, 0, 1), regular(2000, 0, 1), regular(2000, 0, 1)});
              }),
              HasSubstr("name the occupied cells"));
  EXPECT_THAT(message_of([] { embed(Grid({regular(2, 0, 1)}), Points::Constant(1, 1, 3)); }), HasSubstr("distance 1"));
}

double quadratic(const Vector& x) {
  double value = 1;
  for (Eigen::Index a = 0; a < x.size(); ++a)
    for (Eigen::Index b = 0; b <= a; ++b) value += (1 + a + 2 * b) * x[a] * x[b];
  return value;
}
double slope(const Vector& x, int axis) {
  double value = 0;
  for (Eigen::Index b = 0; b < x.size(); ++b) {
    const Eigen::Index high = std::max<Eigen::Index>(axis, b), low = std::min<Eigen::Index>(axis, b);
    value += (b == axis ? 2 : 1) * static_cast<double>(1 + high + 2 * low) * x[b];
  }
  return value;
}

TEST(CenteredDifference, IsExactForQuadraticsInsideAndAtBoundariesOfFullGrids) {
  for (const Grid& grid : {Grid({regular(5, -0.3, 0.25)}), Grid({regular(4, 0, 0.5), graded({-1, -0.7, -0.5, 0, 0.9})}),
                           Grid({graded({0, 0.3, 0.35, 1}), graded({0, 1, 3, 4}), regular(4, 0, 0.25)})}) {
    std::vector<Index> vertices(grid.num_vertices());
    std::iota(vertices.begin(), vertices.end(), 0);
    const Reconstruction rows = CenteredDifference().reconstruct_on_grid(grid, vertices);
    Values<double> values(grid.num_vertices(), 1);
    for (Index v : vertices) values(v, 0) = quadratic(grid.position(v));
    const Values<double> found = apply_stencils(rows.stencils, values);
    for (Index v : vertices)
      for (int a = 0; a < grid.gdim(); ++a) EXPECT_NEAR(found(v, a), slope(grid.position(v), a), 1e-11);
    for (const StencilDiagnostics& row : rows.stencils.diagnostics) EXPECT_EQ(row.rule, StencilRule::full_fit);
  }
}

TEST(CenteredDifference, DoesNotReadAcrossAGap) {
  // Two pairs of cells with one missing between them; vertices 2 and 3 face each other across it.
  const Grid grid({regular(5, 0, 1)}, std::vector<GridPlace>{{0}, {1}, {3}, {4}});
  ASSERT_EQ(grid.num_vertices(), 6);
  EXPECT_EQ(grid.neighbor(2, 0, 1), -1);
  EXPECT_EQ(grid.neighbor(3, 0, 0), -1);
  const std::array<Index, 2> vertices = {2, 3};
  const Reconstruction rows = CenteredDifference().reconstruct_on_grid(grid, vertices);
  EXPECT_THAT(std::vector<Index>(rows.stencils.neighbors.begin(), rows.stencils.neighbors.begin() + 2),
              testing::UnorderedElementsAre(0, 1));
  EXPECT_THAT(std::vector<Index>(rows.stencils.neighbors.begin() + 2, rows.stencils.neighbors.end()),
              testing::UnorderedElementsAre(4, 5));
  const Mesh mesh = grid.mesh();
  const Reconstruction explicit_rows = CenteredDifference().reconstruct(CellGradients(mesh), vertices);
  EXPECT_EQ(explicit_rows.stencils.neighbors, rows.stencils.neighbors);
}

TEST(CenteredDifference, OneLayerOfCellsGetsTheDifferenceAcrossIt) {
  const Grid grid({regular(3, 0, 0.5), regular(1, 0, 0.25)});
  std::vector<Index> vertices(grid.num_vertices());
  std::iota(vertices.begin(), vertices.end(), 0);
  const Reconstruction rows = CenteredDifference().reconstruct_on_grid(grid, vertices);
  Values<double> values(grid.num_vertices(), 1);
  for (Index v : vertices) values(v, 0) = 2 * grid.position(v)[0] - 3 * grid.position(v)[1];
  const Values<double> found = apply_stencils(rows.stencils, values);
  for (Index v : vertices) {
    EXPECT_NEAR(found(v, 0), 2, 1e-12);
    EXPECT_NEAR(found(v, 1), -3, 1e-12);
    EXPECT_EQ(rows.stencils.diagnostics[v].rule, StencilRule::damped);
  }
}

TEST(CenteredDifference, RefusesMeshesThatAreNoGrids) {
  const std::array<Index, 1> vertices = {0};
  for (const Mesh& mesh : {test::lattice<Hexahedron>(2, 0.2, 1), test::lattice<Tetrahedron>(2, 0, 1),
                           test::transformed(test::lattice<Quadrilateral>(2, 0, 1),
                                             Eigen::Matrix2d{{0.8, -0.6}, {0.6, 0.8}}, Eigen::Vector2d::Zero())})
    EXPECT_THAT(message_of([&] { CenteredDifference().reconstruct(CellGradients(mesh), vertices); }),
                AllOf(HasSubstr("no axis-aligned box"), HasSubstr("kriging")));
}

}  // namespace
}  // namespace halfgrad
