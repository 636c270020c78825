#include "framework/cell_locator.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "framework/inverse_map.hpp"
#include "tests/support/test_meshes.hpp"

namespace halfgrad {
namespace {

constexpr double tolerance = 1e-9;

Points points_around(const Mesh& mesh, Index count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-0.1, 1.1);
  const Vector low = mesh.vertices().colwise().minCoeff(), high = mesh.vertices().colwise().maxCoeff();
  Points points(count, mesh.gdim());
  for (Index p = 0; p < count; ++p)
    for (int a = 0; a < mesh.gdim(); ++a) points(p, a) = low[a] + (high[a] - low[a]) * uniform(random);
  return points;
}

// Margin of a position in one cell; −∞ where it has no ξ.
double margin_in(const Mesh& mesh, Index cell, const Vector& position) {
  return with_cell(mesh, cell, [&]<Element E>(const ElementBlock<E>& block, Eigen::Index row) {
    const InverseMap<E> map(node_positions(mesh, block, row));
    if (map.degenerate()) return -std::numeric_limits<double>::infinity();
    const InverseMapResult<E> result = map(position.head<E::dim>());
    return result.converged ? E::margin(result.xi) : -std::numeric_limits<double>::infinity();
  });
}

// The located cell has the greatest margin over all cells of the mesh, and points are found where one holds them.
void expect_brute_force(const Mesh& mesh, const Points& points) {
  const CellLocations found = locate(mesh, points, tolerance);
  for (Index p = 0; p < points.rows(); ++p) {
    double best = -std::numeric_limits<double>::infinity();
    for (Index c = 0; c < mesh.num_cells(); ++c) best = std::max(best, margin_in(mesh, c, points.row(p).transpose()));
    // The margin itself is rounded: near the threshold and between cells of equal margin both answers are right.
    if (std::abs(best + tolerance) < 1e-12) continue;
    ASSERT_EQ(found.cells[p] >= 0, best > -tolerance) << "point " << p << ", margin " << best;
    if (found.cells[p] < 0) continue;
    EXPECT_NEAR(margin_in(mesh, found.cells[p], points.row(p).transpose()), best, 1e-11);
  }
}

// The same mesh with its off-boundary vertices far from where they were: cells overlap and fold.
template <Element E>
Mesh folded_mesh() {
  return test::lattice<E>(3, 1.2, 9);
}

template <class E>
class Locate : public testing::Test {};
using AllElements = Elements::apply<testing::Types, std::type_identity_t>;
TYPED_TEST_SUITE(Locate, AllElements);

TYPED_TEST(Locate, AgreesWithAllCellsTriedOneByOne) {
  for (const double factor : {1.0, 1e8}) {
    const Mesh mesh = test::stretched(test::lattice<TypeParam>(3, 0.25, 1), factor);
    expect_brute_force(mesh, points_around(mesh, 100, 2));
  }
}

TYPED_TEST(Locate, AgreesWithAllCellsWhereTheyFoldAndOverlap) {
  const Mesh mesh = folded_mesh<TypeParam>();
  expect_brute_force(mesh, points_around(mesh, 30, 3));
}

TYPED_TEST(Locate, FindsThePointsOfGoodCellsAmongFlatAndFoldedOnes) {
  using E = TypeParam;
  const Mesh folded = folded_mesh<E>();
  // Before them a flat cell, with its nodes on one line.
  const auto& block = std::get<ElementBlock<E>>(folded.blocks()[0]);
  Points vertices = folded.vertices();
  const Eigen::Index num_vertices = vertices.rows(), num_cells = block.cells.rows();
  vertices.conservativeResize(num_vertices + E::num_nodes, Eigen::NoChange);
  for (int i = 0; i < E::num_nodes; ++i) vertices.row(num_vertices + i).setConstant(E::dim == 1 ? 0.5 : 0.1 * i);
  ElementBlock<E> both;
  both.cells.resize(num_cells + 1, E::num_nodes);
  both.cells.bottomRows(num_cells) = block.cells;
  for (int i = 0; i < E::num_nodes; ++i) both.cells(0, i) = static_cast<Index>(num_vertices + i);
  const Mesh mesh(vertices, {both});

  std::mt19937 random(4);
  std::vector<Vector> positions;
  for (Eigen::Index c = 0; c < num_cells; ++c) {
    const NodeMatrix<E> nodes = node_positions(folded, block, c);
    const InverseMap<E> map(nodes);
    if (map.degenerate() || !map.one_signed()) continue;
    for (int i = 0; i < 4; ++i) positions.push_back(cell_position<E>(nodes, test::random_inside<E>(random)));
  }
  ASSERT_FALSE(positions.empty());
  Points points(static_cast<Index>(positions.size()), E::dim);
  for (Index p = 0; p < points.rows(); ++p) points.row(p) = positions[p].transpose();
  const CellLocations found = locate(mesh, points, tolerance);
  for (const Index cell : found.cells) EXPECT_GT(cell, 0);  // cell 0 is flat
}

TYPED_TEST(Locate, FindsPointsOnVerticesEdgesAndFacets) {
  using E = TypeParam;
  const Mesh mesh = test::lattice<E>(4, 0.25, 5);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Vector> positions;
  for_each_block(mesh, [&]<Element F>(const ElementBlock<F>& block, Index) {
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c)
      for (const Facet& facet : F::facets) {
        // On a vertex, on an edge and inside the facet, by weights of its first one, two and three nodes.
        const NodeMatrix<F> nodes = node_positions(mesh, block, c);
        for (int count = 1; count <= std::min(3, facet.num_nodes); ++count) {
          if (count == 3 && facet.num_nodes == 4) continue;  // not on a warped face
          Vector weights = Vector::NullaryExpr(count, [&] { return uniform(random); });
          weights /= weights.sum();
          Vector position = Vector::Zero(F::dim);
          for (int i = 0; i < count; ++i) position += weights[i] * nodes.row(facet.nodes[i]).transpose();
          positions.push_back(position);
        }
      }
  });
  Points points(static_cast<Index>(positions.size()), E::dim);
  for (Index p = 0; p < points.rows(); ++p) points.row(p) = positions[p].transpose();
  for (const Index cell : locate(mesh, points, tolerance).cells) EXPECT_GE(cell, 0);
}

TYPED_TEST(Locate, GivesTheSameBitsForAnyNumberOfThreadsAndAnyOrderOfPoints) {
  const Mesh mesh = folded_mesh<TypeParam>();
  Points points = points_around(mesh, 600, 7);
  points.topRows(mesh.num_vertices()) = mesh.vertices();  // ties
  const auto with_threads = [&](std::size_t count, const Points& where) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, count);
    return locate(mesh, where, tolerance);
  };
  const CellLocations one = with_threads(1, points), two = with_threads(2, points);
  EXPECT_EQ(one.cells, two.cells);
  EXPECT_EQ(one.local, two.local);
  const Points reversed = points.colwise().reverse();
  const CellLocations back = with_threads(2, reversed);
  for (Index p = 0; p < points.rows(); ++p) {
    const Index q = static_cast<Index>(points.rows()) - 1 - p;
    EXPECT_EQ(one.cells[p], back.cells[q]);
    EXPECT_EQ(one.local.row(p), back.local.row(q));
  }
}

TEST(LocateMixed, AgreesWithAllCellsTriedOneByOne) {
  expect_brute_force(test::warped_mixed_mesh(), points_around(test::warped_mixed_mesh(), 1000, 8));
}

TEST(LocateFew, FindsOnePointInManyCells) {
  const Mesh mesh = test::lattice<Tetrahedron>(20, 0.2, 9);
  const CellLocations found = locate(mesh, test::random_points_inside(mesh, 1, 10), tolerance);
  EXPECT_GE(found.cells[0], 0);
  EXPECT_EQ(locate(mesh, Points(0, 3), tolerance).cells.size(), 0U);
}

}  // namespace
}  // namespace halfgrad
