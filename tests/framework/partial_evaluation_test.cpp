// What a frame may leave out: cells that did not change, points that nobody asks for.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "framework/error.hpp"
#include "framework/interpolant.hpp"
#include "framework/point_selection.hpp"
#include "reconstruction/cell_averages.hpp"
#include "support/test_meshes.hpp"

namespace halfgrad {
namespace {

template <Element E>
struct Scene {
  Mesh mesh = test::lattice<E>(6, 0.2, 5);
  Embedding embedding = scattered(mesh);
  Reconstruction reconstruction =
      ChandrashekarGarg().reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
  Values<float> values = mesh.vertices().array().sin().matrix().template cast<float>();

  static Embedding scattered(const Mesh& mesh) {
    std::mt19937 random(3);
    Embedding embedding;
    embedding.gdim = E::dim;
    constexpr Index num_points = 2000;
    embedding.local.resize(num_points, E::dim);
    for (Index p = 0; p < num_points; ++p) {
      embedding.local.row(p) = test::random_inside<E>(random).transpose();
      embedding.cells.push_back(static_cast<Index>(random() % static_cast<unsigned>(mesh.num_cells())));
      embedding.status.push_back(PointStatus::inside);
    }
    return embedding;
  }
  Interpolant<float> bind(const char* rule) const { return {mesh, embedding, named_rule(rule), &reconstruction}; }
};

template <Element E>
void expect_updates_equal_whole_frames(const char* rule) {
  SCOPED_TRACE(rule);
  Scene<E> scene;
  const Interpolant<float> interpolant = scene.bind(rule);
  Values<float> out, expected;
  Workspace<float> workspace, other;
  const Index all = interpolant.report().num_active_cells;
  EXPECT_EQ(interpolant.update_sorted(scene.values, out, workspace), all);
  EXPECT_EQ(interpolant.update_sorted(scene.values, out, workspace), 0);
  for (const Index vertex : {0, 40, 41}) {
    scene.values(vertex, E::dim - 1) += 0.25f;
    const Index num_evaluated = interpolant.update_sorted(scene.values, out, workspace);
    EXPECT_GT(num_evaluated, 0);
    EXPECT_LT(num_evaluated, all);
    interpolant.evaluate_sorted(scene.values, expected, other);
    EXPECT_TRUE(out == expected);
  }
  // Another use of the workspace is noticed.
  scene.bind("linear").evaluate_sorted(scene.values, expected, workspace);
  EXPECT_EQ(interpolant.update_sorted(scene.values, out, workspace), all);
}

TEST(PartialEvaluation, UpdatesEqualWholeFramesOnTetrahedra) {
  for (const char* rule : {"linear", "phong", "hermite"}) expect_updates_equal_whole_frames<Tetrahedron>(rule);
}
TEST(PartialEvaluation, UpdatesEqualWholeFramesOnQuadrilaterals) {
  for (const char* rule : {"linear", "phong", "hermite"}) expect_updates_equal_whole_frames<Quadrilateral>(rule);
}
TEST(PartialEvaluation, UpdatesEqualWholeFramesOnHexahedra) {
  for (const char* rule : {"linear", "phong", "hermite"}) expect_updates_equal_whole_frames<Hexahedron>(rule);
}
TEST(PartialEvaluation, UpdatesEqualWholeFramesOnPyramids) {
  for (const char* rule : {"linear", "phong", "hermite"}) expect_updates_equal_whole_frames<Pyramid>(rule);
}

// Cells whose map is affine are evaluated by fewer coefficients, whichever other cells are evaluated with them.
template <Element E>
void expect_updates_of_mixed_cells_equal_whole_frames() {
  Scene<E> scene;
  Points vertices = scene.mesh.vertices();
  const Mesh regular = test::lattice<E>(6, 0, 5);
  for (Index v = 0; v < regular.num_vertices(); ++v)
    if (regular.vertices()(v, 0) > 0.4) vertices.row(v) = regular.vertices().row(v);
  // Oblique, so that edges which are equal differ by rounding.
  Eigen::MatrixXd oblique = Eigen::MatrixXd::Constant(E::dim, E::dim, 0.137);
  for (int a = 0; a < E::dim; ++a) oblique(a, a) = 1 - 0.31 * a;
  scene.mesh = test::transformed(Mesh(vertices, scene.mesh.blocks()), oblique, Eigen::VectorXd::Constant(E::dim, 0.71));
  scene.values = scene.mesh.vertices().array().sin().matrix().template cast<float>();
  scene.reconstruction =
      ChandrashekarGarg().reconstruct(CellGradients(scene.mesh), active_vertices(scene.mesh, scene.embedding));
  const Interpolant<float> interpolant = scene.bind("phong");
  Values<float> out, expected;
  Workspace<float> workspace, other;
  interpolant.update_sorted(scene.values, out, workspace);
  for (Index vertex = 0; vertex < scene.mesh.num_vertices(); ++vertex) {
    scene.values(vertex, E::dim - 1) += 0.003f;
    interpolant.update_sorted(scene.values, out, workspace);
    interpolant.evaluate_sorted(scene.values, expected, other);
    ASSERT_TRUE(out == expected) << vertex;
  }
}
TEST(PartialEvaluation, UpdatesEqualWholeFramesOnQuadrilateralsOfTwoKinds) {
  expect_updates_of_mixed_cells_equal_whole_frames<Quadrilateral>();
}
TEST(PartialEvaluation, UpdatesEqualWholeFramesOnHexahedraOfTwoKinds) {
  expect_updates_of_mixed_cells_equal_whole_frames<Hexahedron>();
}

TEST(PartialEvaluation, UpdatesWithPointsOutsideHexahedraEvaluateAll) {
  Scene<Hexahedron> scene;
  scene.embedding.status[7] = PointStatus::outside;
  scene.embedding.outside.push_back({7, 0.1, Vector::Constant(3, 0.05)});
  const Interpolant<float> interpolant = scene.bind("phong");
  Values<float> out;
  Workspace<float> workspace;
  for (int frame = 0; frame < 2; ++frame) {
    scene.values(0, 0) += 1;
    EXPECT_EQ(interpolant.update_sorted(scene.values, out, workspace), interpolant.report().num_active_cells);
    Values<float> expected;
    Workspace<float> other;
    interpolant.evaluate_sorted(scene.values, expected, other);
    EXPECT_TRUE(out == expected);
  }
}

TEST(PartialEvaluation, ChosenPointsHaveTheValuesOfTheWhole) {
  Scene<Tetrahedron> scene;
  scene.embedding.status[7] = PointStatus::outside;
  scene.embedding.outside.push_back({7, 0.1, Vector::Constant(3, 0.05)});
  const Values<float> whole = scene.bind("phong").evaluate(scene.values);
  const std::vector<Index> chosen = {1999, 7, 3, 500};
  const Embedding part = select_points(scene.embedding, chosen);
  const Interpolant<float> interpolant(scene.mesh, part, named_rule("phong"), &scene.reconstruction);
  EXPECT_LE(interpolant.report().num_active_cells, 4);
  EXPECT_EQ(interpolant.report().num_outside, 1);
  const Values<float> result = interpolant.evaluate(scene.values);
  for (std::size_t i = 0; i < chosen.size(); ++i)
    EXPECT_TRUE(result.row(static_cast<Eigen::Index>(i)) == whole.row(chosen[i])) << chosen[i];
}

TEST(PartialEvaluation, ChoosingAPointThatDoesNotExistIsRefused) {
  const Scene<Triangle> scene;
  try {
    select_points(scene.embedding, std::vector<Index>{0, 2000});
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("2000"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("0 to 1999"), std::string::npos);
  }
}

}  // namespace
}  // namespace halfgrad
