#include "framework/mesh.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "framework/error.hpp"
#include "framework/mesh_faults.hpp"
#include "support/message_of.hpp"

namespace halfgrad {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// Two triangles over the unit square and a vertex that no cell uses.
Mesh square_of_triangles() {
  Points vertices(5, 2);
  vertices << 0, 0, 1, 0, 1, 1, 0, 1, 2, 2;
  ElementBlock<Triangle> block;
  block.cells.resize(2, 3);
  block.cells << 0, 1, 2, 0, 2, 3;
  return Mesh(vertices, {block});
}

TEST(Mesh, CountsCellsThroughBlocks) {
  Points vertices(6, 2);
  vertices << 0, 0, 1, 0, 1, 1, 0, 1, 2, 0, 2, 1;
  ElementBlock<Triangle> triangles;
  triangles.cells.resize(2, 3);
  triangles.cells << 0, 1, 2, 0, 2, 3;
  ElementBlock<Quadrilateral> quads;
  quads.cells.resize(1, 4);
  quads.cells << 1, 4, 5, 2;
  const Mesh mesh(vertices, {triangles, quads});
  EXPECT_EQ(mesh.num_cells(), 3);
  EXPECT_EQ(mesh.first_cell(1), 2);
  EXPECT_EQ(element_name(mesh, 1), "triangle");
  EXPECT_EQ(element_name(mesh, 2), "quadrilateral");
  EXPECT_THAT(mesh.cell_vertices(2), ElementsAre(1, 4, 5, 2));
  EXPECT_THAT(vertex_cells(mesh)[2], ElementsAre(0, 1, 2));
}

TEST(Mesh, BoundaryIsFoundAcrossElementTypes) {
  Points vertices(9, 2);
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) vertices.row(3 * j + i) << i, j;
  ElementBlock<Quadrilateral> quads;
  quads.cells.resize(3, 4);
  quads.cells << 0, 1, 4, 3, 1, 2, 5, 4, 3, 4, 7, 6;
  ElementBlock<Triangle> triangles;
  triangles.cells.resize(2, 3);
  triangles.cells << 4, 5, 8, 4, 8, 7;
  EXPECT_THAT(boundary_vertices(Mesh(vertices, {quads, triangles})), ElementsAre(1, 1, 1, 1, 0, 1, 1, 1, 1));
}

TEST(Mesh, RefusesBadInputByName) {
  const Mesh good = square_of_triangles();
  auto block = std::get<ElementBlock<Triangle>>(good.blocks()[0]);
  Points vertices = good.vertices();
  vertices(3, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(message_of([&] { Mesh(vertices, {block}); }), HasSubstr("vertex 3"));
  block.cells(1, 2) = 7;
  EXPECT_THAT(message_of([&] { Mesh(good.vertices(), {block}); }), HasSubstr("cell 1 (triangle) names vertex 7"));
  block.cells(1, 2) = 0;
  EXPECT_THAT(message_of([&] { Mesh(good.vertices(), {block}); }), HasSubstr("names vertex 0 twice"));
  EXPECT_THAT(message_of([&] { Mesh(Points::Zero(5, 1), good.blocks()); }),
              HasSubstr("triangle cells need vertices with 2 coordinates, found 1"));
  EXPECT_THAT(message_of([&] { Mesh(Points::Zero(5, 5), good.blocks()); }),
              HasSubstr("5 coordinates: expected 1 to 4"));
  ElementBlock<Tetrahedron> tetrahedron;
  tetrahedron.cells.resize(1, 4);
  tetrahedron.cells << 0, 1, 2, 3;
  block = std::get<ElementBlock<Triangle>>(good.blocks()[0]);
  EXPECT_THAT(message_of([&] { Mesh(Points::Zero(5, 3), {block, tetrahedron}); }), HasSubstr("in a mesh of dimension"));
}

TEST(Mesh, InspectFindsWhatIsWrong) {
  const MeshReport good = inspect(square_of_triangles());
  EXPECT_THAT(good.unused_vertices, ElementsAre(4));
  EXPECT_TRUE(good.degenerate_cells.empty());
  EXPECT_TRUE(good.inverted_cells.empty());
  EXPECT_EQ(good.num_boundary_facets, 4);
  EXPECT_DOUBLE_EQ(good.volume, 1);
  EXPECT_DOUBLE_EQ(good.max_edge, std::sqrt(2));
  EXPECT_NEAR(good.mean_edge, (4 + 2 * std::sqrt(2)) / 6, 1e-15);
  EXPECT_NEAR(mean_edge_length(square_of_triangles()), good.mean_edge, 1e-15);

  Points vertices(4, 2);
  vertices << 0, 0, 1, 0, 2, 0, 0, 1;
  ElementBlock<Triangle> block;
  block.cells.resize(2, 3);
  block.cells << 0, 1, 2, 0, 3, 1;
  const MeshReport bad = inspect(Mesh(vertices, {block}));
  EXPECT_THAT(bad.degenerate_cells, ElementsAre(0));
  EXPECT_THAT(bad.inverted_cells, ElementsAre(1));
  EXPECT_TRUE(bad.folded_cells.empty());
}

TEST(Mesh, InspectFindsWhatIsThereTwice) {
  // Two squares whose common edge has vertices of its own on each side, one of which has a coordinate −0, and a cell
  // that is listed again from another node on.
  Points vertices(8, 2);
  vertices << -1, 0, 0, 0, 0, 1, -1, 1, -0.0, 0, 1, 0, 1, 1, 0, 1;
  ElementBlock<Quadrilateral> quads;
  quads.cells.resize(3, 4);
  quads.cells << 0, 1, 2, 3, 4, 5, 6, 7, 2, 3, 0, 1;
  const Mesh mesh(vertices, {quads});
  EXPECT_THAT(duplicate_vertices(mesh), ElementsAre(4, 7));
  EXPECT_THAT(duplicate_cells(mesh), ElementsAre(2));
  EXPECT_TRUE(nonmanifold_facets(mesh).empty());
  EXPECT_TRUE(duplicate_cells(square_of_triangles()).empty());
  EXPECT_TRUE(duplicate_vertices(square_of_triangles()).empty());

  // A triangle is no quadrilateral, whatever their first vertices.
  ElementBlock<Triangle> triangles;
  triangles.cells.resize(1, 3);
  triangles.cells << 0, 1, 2;
  EXPECT_THAT(duplicate_cells(Mesh(vertices, {triangles, quads})), ElementsAre(3));
}

TEST(Mesh, InspectNamesFacetsOfThreeCells) {
  Points vertices(5, 2);
  vertices << 0, 0, 1, 0, 0, 1, 1, 1, 0.5, -1;
  ElementBlock<Triangle> fan;
  fan.cells.resize(3, 3);
  fan.cells << 0, 1, 2, 1, 0, 4, 3, 0, 1;
  const Mesh mesh(vertices, {fan});
  constexpr Index none = std::numeric_limits<Index>::max();
  EXPECT_THAT(nonmanifold_facets(mesh), ElementsAre(FacetKey{0, 1, none, none}));
  EXPECT_EQ(inspect(mesh).num_nonmanifold_facets, 1);
}

TEST(Mesh, InspectFindsFoldedQuadrilaterals) {
  Points vertices(4, 2);
  vertices << 0, 0, 1, 0, 0.2, 0.2, 0, 1;  // concave at node 2
  ElementBlock<Quadrilateral> block;
  block.cells.resize(1, 4);
  block.cells << 0, 1, 2, 3;
  EXPECT_THAT(inspect(Mesh(vertices, {block})).folded_cells, ElementsAre(0));
}

}  // namespace
}  // namespace halfgrad
