// Averages of cell gradients where they are not determined, in any dimension, and what they fall back to.
#include "reconstruction/cell_averages.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <nlohmann/json.hpp>
#include <numeric>

#include "elements/simplex.hpp"
#include "framework/cell_blocks.hpp"
#include "reconstruction/patch_recovery.hpp"
#include "reconstruction/registry.hpp"
#include "support/message_of.hpp"
#include "tests/support/test_meshes.hpp"

namespace halfgrad {
namespace {

using testing::AllOf;
using testing::HasSubstr;

Mesh one_triangle(double height) {
  Points vertices(3, 2);
  vertices << 0, 0, 1, 0, 0.2, height;
  ElementBlock<Triangle> block;
  block.cells.resize(1, 3);
  block.cells << 0, 1, 2;
  return Mesh(vertices, {block});
}

TEST(ChandrashekarGarg, WithoutDampingRefusesWhatOneCellDoesNotDetermine) {
  const Mesh mesh = one_triangle(1);
  const CellGradients cells(mesh);
  EXPECT_THAT(message_of([&] { ChandrashekarGarg({.epsilon = 0}).weights(cells, 1); }),
              AllOf(HasSubstr("vertex 1"), HasSubstr("not determined"), HasSubstr("epsilon > 0")));
  EXPECT_EQ(ChandrashekarGarg().weights(cells, 1).weights, std::vector<double>{1});
}

TEST(ChandrashekarGarg, WeightsThatSumToZeroAreRefusedOrTakenByDistance) {
  // Two cells to one side of vertex 0: no weights but zero balance their centroids.
  Points vertices(4, 2);
  vertices << 0, 0, 1, 0, 1, 0.7, 0.3, 1;
  ElementBlock<Triangle> block;
  block.cells.resize(2, 3);
  block.cells << 0, 1, 2, 0, 2, 3;
  const Mesh mesh(vertices, {block});
  const CellGradients cells(mesh);
  const std::string without = message_of([&] { ChandrashekarGarg({.epsilon = 0}).weights(cells, 0); });
  EXPECT_THAT(without, AllOf(HasSubstr("vertex 0"), HasSubstr("sum to zero"), HasSubstr("epsilon > 0")));
  const CellWeights tiny = ChandrashekarGarg({.epsilon = 1e-14}).weights(cells, 0),
                    distance = InverseDistance().weights(cells, 0);
  ASSERT_EQ(tiny.weights.size(), 2U);
  for (int k = 0; k < 2; ++k) EXPECT_NEAR(tiny.weights[k], distance.weights[k], 1e-15);
}

TEST(Knn, WithNoFurtherCellIsChandrashekarGarg) {
  const Mesh mesh = test::lattice<Tetrahedron>(3, 0.2, 1);
  const CellGradients cells(mesh);
  for (const Index v : {0, 21, 40}) {
    const CellWeights knn = Knn({.k = 0}).weights(cells, v), own = ChandrashekarGarg().weights(cells, v);
    EXPECT_EQ(knn.cells, own.cells);
    EXPECT_EQ(knn.weights, own.weights);
  }
  EXPECT_THAT(message_of([] { Knn({.k = -1}); }), HasSubstr("k -1"));
  EXPECT_THAT(message_of([] { ChandrashekarGarg({.epsilon = -1}); }), HasSubstr("epsilon -1"));
}

// Two simplices of R⁴ that share a facet: any average of their gradients is exact for affine values.
TEST(CellAverages, AreAffineExactInFourDimensions) {
  Points vertices(6, 4);
  vertices << 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0.7, 0.8, 0.6, 0.9;
  CellBlocks<Simplex<4>> blocks{vertices, {}};
  auto& cells = std::get<0>(blocks.blocks).cells;
  cells.resize(2, 5);
  cells << 0, 1, 2, 3, 4, 5, 2, 1, 3, 4;
  const CellTable table = cell_table(blocks);
  const CellGradients geometry(table);
  EXPECT_LE((geometry.centroid(0) - Vector::Constant(4, 0.2)).norm(), 1e-15);
  Values<double> values(6, 1);
  for (int v = 0; v < 6; ++v) values(v, 0) = 2 + vertices.row(v).dot(Eigen::RowVector4d(1, -2, 3, 0.5));
  const std::vector<Index> all = {0, 1, 2, 3, 4, 5};
  for (const char* name : {"unweighted_average", "volume_average", "inverse_distance", "chandrashekar_garg", "knn"}) {
    const Reconstruction rows = make_reconstructor(name).reconstructor->reconstruct(geometry, all);
    const Values<double> gradients = apply_stencils(rows.stencils, values);
    for (int v = 0; v < 6; ++v)
      EXPECT_LE((gradients.row(v) - Eigen::RowVector4d(1, -2, 3, 0.5)).cwiseAbs().maxCoeff(), 1e-12) << name;
  }
}

// More rows than the first wave of the assembly, and more cells than an average remembers.
TEST(CellAverages, OfALargeMeshAreThoseOfItsVerticesOneByOne) {
  const Mesh mesh = test::lattice<Tetrahedron>(17, 0.2, 1);
  const CellGradients cells(mesh);
  ASSERT_GT(mesh.num_vertices(), 64 * 64);
  std::vector<Index> all(mesh.num_vertices());
  std::iota(all.begin(), all.end(), 0);
  const GradientStencilTable rows = ChandrashekarGarg().reconstruct(cells, all).stencils;
  for (Index v = 0; v < mesh.num_vertices(); v += 97) {
    const GradientStencilTable one = ChandrashekarGarg().reconstruct(cells, std::array{v}).stencils;
    const auto begin = rows.offsets[v], size = rows.offsets[v + 1] - begin;
    ASSERT_EQ(size, one.num_entries());
    EXPECT_TRUE(std::equal(one.neighbors.begin(), one.neighbors.end(), rows.neighbors.begin() + begin));
    EXPECT_TRUE(std::equal(one.weights.begin(), one.weights.end(), rows.weights.begin() + 3 * begin));
  }
}

TEST(PatchRecovery, AVertexWithoutAPlaneOfItsOwnHasNoGradient) {
  const Mesh mesh = one_triangle(0);
  const CellGradients cells(mesh);
  for (const char* name : {"spr", "ppr"}) {
    const GradientStencilTable rows =
        make_reconstructor(name).reconstructor->reconstruct(cells, std::array<Index, 3>{0, 1, 2}).stencils;
    EXPECT_EQ(rows.num_entries(), 0) << name;
    for (const StencilDiagnostics& row : rows.diagnostics) EXPECT_EQ(row.rule, StencilRule::none) << name;
  }
}

}  // namespace
}  // namespace halfgrad
