// Cells of unregistered elements as numbers: the same as a mesh of the registered ones, and four dimensions.
#include "framework/cell_blocks.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "elements/simplex.hpp"
#include "framework/interpolant.hpp"
#include "reconstruction/registry.hpp"
#include "support/message_of.hpp"
#include "tests/support/test_meshes.hpp"

namespace halfgrad {
namespace {

using testing::HasSubstr;

// The mixed mesh of the registry's elements, as blocks of their own.
CellBlocks<Hexahedron, Pyramid, Tetrahedron> own_blocks(const Mesh& mesh) {
  return {mesh.vertices(),
          {std::get<ElementBlock<Hexahedron>>(mesh.blocks()[0]), std::get<ElementBlock<Pyramid>>(mesh.blocks()[1]),
           std::get<ElementBlock<Tetrahedron>>(mesh.blocks()[2])}};
}

TEST(CellBlocks, GiveWhatAMeshGives) {
  const Mesh mesh = test::warped_mixed_mesh();
  const auto cells = own_blocks(mesh);
  const CellTable table = cell_table(cells);
  const CellGradients here(table), there(mesh);
  ASSERT_EQ(here.num_cells(), there.num_cells());
  for (Index c = 0; c < here.num_cells(); ++c) {
    EXPECT_EQ(here.gradient(c).weights, there.gradient(c).weights);
    EXPECT_EQ(here.gradient(c).volume, there.gradient(c).volume);
  }
  for (Index v = 0; v < here.num_vertices(); ++v) {
    EXPECT_TRUE(std::ranges::equal(here.cells_of(v), there.cells_of(v)));
    EXPECT_EQ(here.on_boundary(v), there.on_boundary(v));
  }

  const Points points = test::random_points_inside(mesh, 500, 1);
  const WeightedPoints weights = embed(cells, points);
  const Embedding embedding = embed(mesh, points);
  const Values<double> values = mesh.vertices().array().sin();
  for (const char* name : {"chandrashekar_garg", "kriging", "adaptive"})
    for (const char* rule : {"linear", "phong", "hermite"}) {
      const auto reconstructor = make_reconstructor(name).reconstructor;
      const Reconstruction a = reconstructor->reconstruct(here, active_vertices(weights));
      const Reconstruction b = reconstructor->reconstruct(there, active_vertices(mesh, embedding));
      const Interpolant<double> own(weights, named_rule(rule), &a), known(mesh, embedding, named_rule(rule), &b);
      EXPECT_LT((own.evaluate(values) - known.evaluate(values)).cwiseAbs().maxCoeff(), 1e-13) << name << rule;
      if (rule != std::string("linear")) {
        EXPECT_LT((own.smooth_gradient(values) - known.smooth_gradient(values)).cwiseAbs().maxCoeff(), 1e-12);
      }
      if (name == std::string("kriging")) {
        EXPECT_LT((own.matrix() * values - own.evaluate(values)).cwiseAbs().maxCoeff(), 1e-13);
      }
    }
}

// Kuhn's simplices of n⁴ cubes, vertices inside jittered.
CellBlocks<Simplex<4>> space_time(int n, double jitter) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-jitter / n, jitter / n);
  const int side = n + 1;
  CellBlocks<Simplex<4>> cells;
  cells.vertices.resize(side * side * side * side, 4);
  for (Index v = 0; v < cells.vertices.rows(); ++v)
    for (Index a = 0, rest = v; a < 4; ++a, rest /= side) {
      const int place = rest % side;
      cells.vertices(v, a) = double(place) / n + (place > 0 && place < n ? uniform(random) : 0);
    }
  std::vector<Index> nodes;
  const std::array<int, 4> stride = {1, side, side * side, side * side * side};
  for (int cube = 0; cube < n * n * n * n; ++cube) {
    Index corner = 0;
    for (int a = 0, rest = cube; a < 4; ++a, rest /= n) corner += (rest % n) * stride[a];
    std::array<int, 4> axes = {0, 1, 2, 3};
    do {
      Index at = corner;
      nodes.push_back(at);
      for (int a : axes) nodes.push_back(at += stride[a]);
    } while (std::next_permutation(axes.begin(), axes.end()));
  }
  auto& block = std::get<0>(cells.blocks);
  block.cells.resize(static_cast<Eigen::Index>(nodes.size()) / 5, 5);
  std::copy(nodes.begin(), nodes.end(), block.cells.data());
  return cells;
}

TEST(SpaceTime, KrigingAndPhongReproduceQuadraticsInFourDimensions) {
  const auto cells = space_time(3, 0.15);
  const CellTable table = cell_table(cells);
  double volume = 0;
  for (const CellGradient& cell : table.gradients) volume += cell.volume;
  EXPECT_NEAR(volume, 1, 1e-12);

  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(0, 1);
  const Points points = Points::NullaryExpr(200, 4, [&] { return uniform(random); });
  const WeightedPoints weights = embed(cells, points);
  const Reconstruction rows =
      make_reconstructor("kriging").reconstructor->reconstruct(CellGradients(table), active_vertices(weights));
  const auto value = [](const Eigen::RowVectorXd& x) {
    return 1 + x[0] * x[1] - 2 * x[2] * x[3] + 3 * x[3] * x[3] - x[0] * x[0] + x[1];
  };
  Values<double> values(cells.vertices.rows(), 1);
  for (Index v = 0; v < values.rows(); ++v) values(v, 0) = value(cells.vertices.row(v));
  const Interpolant<double> linear(weights, named_rule("linear"), nullptr), phong(weights, named_rule("phong"), &rows);
  const Values<double> straight = linear.evaluate(values), curved = phong.evaluate(values);
  double linear_error = 0, phong_error = 0;
  for (Index p = 0; p < points.rows(); ++p) {
    linear_error = std::max(linear_error, std::abs(straight(p, 0) - value(points.row(p))));
    phong_error = std::max(phong_error, std::abs(curved(p, 0) - value(points.row(p))));
  }
  EXPECT_GT(linear_error, 0.05);
  EXPECT_LT(phong_error, 1e-10);
}

TEST(WeightedPoints, AreCheckedAndMarked) {
  const Mesh mesh = test::warped_mixed_mesh();
  auto cells = own_blocks(mesh);
  Points points(2, 3);
  points << 0.5, 0.5, 0.5, 9, 9, 9;
  EXPECT_THAT(message_of([&] { embed(cells, points); }), HasSubstr("point 1 lies in no cell"));
  EXPECT_THAT(message_of([&] { embed(cells, points, {.outside = Outside::nearest}); }), HasSubstr("nearest"));
  WeightedPoints weights = embed(cells, points, {.outside = Outside::mark});
  const Interpolant<double> linear(weights, named_rule("linear"), nullptr);
  const Values<double> out = linear.evaluate(mesh.vertices());
  EXPECT_LT((out.row(0) - points.row(0)).norm(), 1e-14);
  EXPECT_TRUE(std::isnan(out(1, 0)));
  EXPECT_EQ(linear.report().num_not_found, 1);
  EXPECT_THAT(message_of([&] { linear.gradient(mesh.vertices()); }), HasSubstr("smooth_gradient"));
  EXPECT_THAT(message_of([&] { Interpolant<double>(weights, named_rule("quadratic10"), nullptr); }),
              HasSubstr("simplices"));
  const auto refused = [&](auto&& damage) {
    WeightedPoints damaged = weights;
    damage(damaged);
    return message_of([&] { Interpolant<double>(damaged, named_rule("linear"), nullptr); });
  };
  EXPECT_THAT(refused([](WeightedPoints& w) { w.gdim = 5; }), HasSubstr("dimension 5: expected 1 to 4"));
  EXPECT_THAT(refused([](WeightedPoints& w) { w.arms.pop_back(); }), HasSubstr("arms"));
  EXPECT_THAT(refused([](WeightedPoints& w) { w.vertices[1] = 77; }), HasSubstr("vertex 77"));
  auto planar = cells;
  planar.vertices.conservativeResize(Eigen::NoChange, 2);
  EXPECT_THAT(message_of([&] { cell_table(planar); }), HasSubstr("cells need vertices with 3 coordinates, found 2"));
  weights.weights[0] += 0.5;
  EXPECT_THAT(message_of([&] { Interpolant<double>(weights, named_rule("linear"), nullptr); }), HasSubstr("sum to"));
  std::get<0>(cells.blocks).cells(0, 0) = 99;
  EXPECT_THAT(message_of([&] { cell_table(cells); }), HasSubstr("names vertex 99"));
}

}  // namespace
}  // namespace halfgrad
