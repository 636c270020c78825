// Vertices held out of a mesh, and what is recommended from them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "experiments/hold_out.hpp"
#include "experiments/lattice.hpp"
#include "experiments/recommendation.hpp"
#include "framework/embedding.hpp"

namespace halfgrad {
namespace {

using testing::HasSubstr;

Mesh jittered(std::string_view element) {
  LatticeOptions options;
  options.element = element;
  options.cells = {5, 4, 4};
  options.jitter = 0.15;
  return make_lattice(options);
}

TEST(HoldOut, LeavesAValidMeshOfTheSameVolumeAroundTheVerticesTakenOut) {
  for (const std::string_view element : lattice_elements()) {
    SCOPED_TRACE(element);
    const Mesh mesh = jittered(element);
    const HeldOutMesh held_out = hold_out(mesh, 3);
    ASSERT_FALSE(held_out.held_out.empty());
    EXPECT_EQ(static_cast<Index>(held_out.kept.size() + held_out.held_out.size()), mesh.num_vertices());
    EXPECT_EQ(held_out.mesh.vertices(), mesh.vertices()(held_out.kept, Eigen::all));

    const MeshReport report = inspect(held_out.mesh);
    EXPECT_TRUE(report.degenerate_cells.empty());
    EXPECT_TRUE(report.inverted_cells.empty());
    EXPECT_TRUE(report.unused_vertices.empty());
    EXPECT_EQ(report.num_nonmanifold_facets, 0);
    // Where faces are warped, the volume of a mesh is the midpoint rule's, off by the warp squared.
    const bool simplices = element == "triangle" || element == "tetrahedron" || element == "segment";
    EXPECT_NEAR(report.volume, inspect(mesh).volume, simplices ? 1e-12 : 1e-2);

    const std::vector<char> boundary = boundary_vertices(mesh);
    for (const Index vertex : held_out.held_out) EXPECT_EQ(boundary[vertex], 0) << vertex;
    // No two of a simplex, and every one in the mesh: the default policy refuses points outside.
    std::vector<char> is_out(mesh.num_vertices(), 0);
    for (const Index vertex : held_out.held_out) is_out[vertex] = 1;
    for (Index cell = 0; simplices && cell < mesh.num_cells(); ++cell) {
      const auto vertices = mesh.cell_vertices(cell);
      EXPECT_LE(std::count_if(vertices.begin(), vertices.end(), [&](Index v) { return is_out[v] != 0; }), 1);
    }
    EXPECT_NO_THROW(embed(held_out.mesh, mesh.vertices()(held_out.held_out, Eigen::all)));
  }
}

TEST(HoldOut, OtherSeedsTakeOtherVerticesAndASingleLayerNone) {
  const Mesh mesh = jittered("tetrahedron");
  EXPECT_EQ(hold_out(mesh, 1).held_out, hold_out(mesh, 1).held_out);
  EXPECT_NE(hold_out(mesh, 1).held_out, hold_out(mesh, 2).held_out);
  LatticeOptions layer;
  layer.cells = {4, 4, 1};
  EXPECT_TRUE(hold_out(make_lattice(layer), 1).held_out.empty());
}

ResultRow row(const char* interpolant, const char* reconstructor, double gain, int frame = 0, Index points = 100) {
  ResultRow result;
  result.interpolant = interpolant;
  result.reconstructor = reconstructor;
  result.options = "{}";
  result.h = 1;
  result.frame = frame;
  result.error[0] = {1 / gain, 1 / gain, points};
  result.gain_over_linear[0] = gain;
  return result;
}

TEST(Recommend, TakesTheBestWhereItIsDecisiveAndElseTheSafeOne) {
  const ResultRow linear = row("linear", "", 1), safe = row("phong", "adaptive", 3);
  const auto choose = [&](double gain) { return recommend(std::vector{linear, safe, row("hermite", "spr", gain)}); };
  EXPECT_EQ(choose(3.7).chosen.reconstructor, "spr");
  EXPECT_EQ(choose(3.5).chosen.reconstructor, "adaptive");
  EXPECT_EQ(choose(3.5).best.reconstructor, "spr");
  EXPECT_EQ(choose(2).chosen.reconstructor, "adaptive");
  // Where no safe choice was measured, the best it is; linear too.
  EXPECT_EQ(recommend(std::vector{linear, row("phong", "spr", 0.9)}).chosen.interpolant, "linear");
}

TEST(Recommend, CountsFramesAlikeAndLeavesOutThoseWithoutError) {
  const std::vector<ResultRow> two = {row("phong", "adaptive", 2), row("phong", "spr", 8),
                                      row("phong", "adaptive", 8, 1), row("phong", "spr", 4, 1)};
  EXPECT_NEAR(recommend(two).safe->gain, 4, 1e-12);
  EXPECT_NEAR(recommend(two).best.gain, std::sqrt(32), 1e-12);
  ResultRow rigid = row("phong", "adaptive", 1e-3, 2);
  rigid.error[0].rms = 1e-12;
  std::vector<ResultRow> three = two;
  three.push_back(rigid);
  EXPECT_NEAR(recommend(three).safe->gain, 4, 1e-12);
  EXPECT_EQ(recommend(three).frames, 2);
}

TEST(Recommend, SaysThatFewPointsSayLittle) {
  const auto result = recommend(std::vector{row("phong", "adaptive", 2, 0, 29), row("phong", "spr", 9, 0, 29)});
  EXPECT_EQ(result.chosen.reconstructor, "adaptive");
  EXPECT_THAT(result.reason, HasSubstr("29 vertices"));
}

TEST(PoolFold, ErrorsAreThoseOfAllPointsTogether) {
  std::vector<ResultRow> rows = {row("phong", "spr", 1, 0, 3)};
  rows[0].error[0] = {5, 2, 3};
  std::vector<ResultRow> more = rows;
  more[0].error[0] = {4, 4, 1};
  pool_fold(rows, more);
  EXPECT_EQ(rows[0].error[0].points, 4);
  EXPECT_EQ(rows[0].error[0].max, 5);
  EXPECT_NEAR(rows[0].error[0].rms, std::sqrt((3 * 4 + 16) / 4.0), 1e-15);
}

}  // namespace
}  // namespace halfgrad
