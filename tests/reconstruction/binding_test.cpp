#include <gtest/gtest.h>

#include "framework/interpolant.hpp"
#include "reconstruction/cell_averages.hpp"
#include "tests/support/message_of.hpp"
#include "tests/support/test_meshes.hpp"

namespace halfgrad {
namespace {

template <class E>
class BindingOf : public testing::Test {};
using AllElements = Elements::apply<testing::Types, std::type_identity_t>;
TYPED_TEST_SUITE(BindingOf, AllElements);

// 20 bytes a point, 200 a cell that holds points and 24 a stencil entry, in float: with few and with many points a
// cell, and with points in a part of the mesh.
TYPED_TEST(BindingOf, TakesNoMoreThanItsPointsCellsAndStencilEntriesAccountFor) {
  using E = TypeParam;
  const Mesh mesh = test::lattice<E>(E::dim == 3 ? 5 : 20, 0.2, 1);
  for (const Index num_points : {30, 500, 50000}) {
    Points points = test::random_points_inside(mesh, num_points, 2);
    for (const bool part : {false, true}) {
      if (part) {
        const double low = mesh.vertices().minCoeff(), middle = 0.5 * (low + mesh.vertices().maxCoeff());
        points.array() = (points.array() - low) * 0.2 + middle;
      }
      const Embedding embedding = embed(mesh, points);
      const Reconstruction stencils =
          ChandrashekarGarg().reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
      const BindReport report = Interpolant<float>(mesh, embedding, named_rule("phong"), &stencils).report();
      EXPECT_LE(report.bytes, 20 * report.num_points + 200 * static_cast<Offset>(report.num_active_cells) +
                                  24 * report.num_stencil_entries)
          << E::name << ", " << num_points << " points, part " << part;
    }
  }
}

// Cells and vertices that hold no points leave the binding as it is.
TEST(Binding, OfAPartOfALargeMeshIsThatOfTheSmallMesh) {
  const auto bytes = [](int n) {
    const Mesh mesh = test::lattice<Tetrahedron>(n, 0, 1);
    const double length = 1.0 / n;
    const Points points = Points::Constant(100, 3, 0.5) + length * 0.4 * Points::Random(100, 3);
    const Embedding embedding = embed(mesh, points);
    const Reconstruction stencils =
        ChandrashekarGarg().reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
    return Interpolant<float>(mesh, embedding, named_rule("phong"), &stencils).report();
  };
  std::srand(1);
  const BindReport small = bytes(5);
  std::srand(1);
  const BindReport large = bytes(21);
  EXPECT_EQ(small.num_active_cells, large.num_active_cells);
  EXPECT_EQ(small.bytes, large.bytes);
}

TEST(Binding, WithTheOrderAtHandIsTheSame) {
  const Mesh mesh = test::lattice<Tetrahedron>(4, 0.2, 1);
  const Embedding embedding = embed(mesh, test::random_points_inside(mesh, 300, 2));
  const BindingOrder order = binding_order(mesh, embedding);
  EXPECT_EQ(order.vertices, active_vertices(mesh, embedding));
  ASSERT_EQ(order.first_point.size(), order.cells.size() + 1);
  ASSERT_EQ(order.points.size(), 300U);
  for (std::size_t c = 0; c < order.cells.size(); ++c)
    for (Index p = order.first_point[c]; p < order.first_point[c + 1]; ++p)
      EXPECT_EQ(embedding.cells[order.points[p]], order.cells[c]);
  const Reconstruction stencils = ChandrashekarGarg().reconstruct(CellGradients(mesh), order.vertices);
  const Interpolant<double> with(mesh, embedding, order, named_rule("phong"), &stencils),
      without(mesh, embedding, named_rule("phong"), &stencils);
  const Values<double> values = mesh.vertices().array().sin();
  EXPECT_EQ(with.evaluate(values), without.evaluate(values));
  EXPECT_EQ(with.report().bytes, without.report().bytes);
  BindingOrder other = order;
  other.points.pop_back();
  EXPECT_EQ(message_of([&] { Interpolant<double>(mesh, embedding, other, named_rule("phong"), &stencils); }),
            "a binding order of 299 points for an embedding that has 300 in cells");
}

}  // namespace
}  // namespace halfgrad
