// What every reconstructor must satisfy, as a GoogleTest suite for reconstructors of this project and of others:
// include it, then
//
//   INSTANTIATE_TEST_SUITE_P(Mine, ReconstructorContract, testing::Values(std::make_shared<MyReconstructor>()));
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <memory>
#include <numeric>
#include <vector>

#include "framework/vertex_gradient_reconstructor.hpp"
#include "tests/support/test_meshes.hpp"

namespace halfgrad {

class ReconstructorContract : public testing::TestWithParam<std::shared_ptr<const VertexGradientReconstructor>> {
 protected:
  static std::vector<Mesh> meshes() {
    return {test::lattice<Triangle>(5, 0.2, 1), test::lattice<Quadrilateral>(5, 0.2, 2),
            test::lattice<Tetrahedron>(3, 0.2, 3), test::lattice<Hexahedron>(3, 0.2, 4), test::warped_mixed_mesh()};
  }
  static std::vector<Index> all_vertices(const Mesh& mesh) {
    std::vector<Index> vertices(mesh.num_vertices());
    std::iota(vertices.begin(), vertices.end(), 0);
    return vertices;
  }
  static Values<double> apply(const Reconstruction& rows, const Values<double>& values) {
    return rows.blend ? blended_gradients(rows, values) : apply_stencils(rows.stencils, values);
  }
  Values<double> gradients(const Mesh& mesh, const Values<double>& values) const {
    return apply(GetParam()->reconstruct(CellGradients(mesh), all_vertices(mesh)), values);
  }
  static Values<double> affine_values(const Mesh& mesh) {
    Values<double> values(mesh.num_vertices(), 1);
    for (Index v = 0; v < values.rows(); ++v) {
      values(v, 0) = 3;
      for (int a = 0; a < mesh.gdim(); ++a) values(v, 0) += (a + 1.5) * mesh.vertices()(v, a);
    }
    return values;
  }
  static Values<double> waves(const Mesh& mesh) {
    Values<double> values(mesh.num_vertices(), 1);
    for (Index v = 0; v < values.rows(); ++v)
      values(v, 0) = std::sin(3 * mesh.vertices().row(v).sum() + mesh.vertices()(v, 0));
    return values;
  }
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ReconstructorContract);

TEST_P(ReconstructorContract, AffineValuesHaveTheirGradientAtEveryVertex) {
  for (const Mesh& mesh : meshes()) {
    const Values<double> found = gradients(mesh, affine_values(mesh));
    for (Index v = 0; v < mesh.num_vertices(); ++v)
      for (int a = 0; a < mesh.gdim(); ++a) EXPECT_NEAR(found(v, a), a + 1.5, 1e-10);
  }
}

TEST_P(ReconstructorContract, SingleCellsAreServed) {
  for (const Mesh& mesh : {test::lattice<Quadrilateral>(1, 0, 1), test::lattice<Hexahedron>(1, 0, 1)}) {
    const Values<double> found = gradients(mesh, affine_values(mesh));
    for (Index v = 0; v < mesh.num_vertices(); ++v)
      for (int a = 0; a < mesh.gdim(); ++a) EXPECT_NEAR(found(v, a), a + 1.5, 1e-10);
  }
}

TEST_P(ReconstructorContract, RowsComeInTheOrderAskedForAndDoNotDependOnTheOthers) {
  for (const Mesh& mesh : meshes()) {
    const CellGradients cells(mesh);
    const Values<double> values = waves(mesh), all = gradients(mesh, values);
    const std::vector<Index> some = {7, 0, 3};
    const Reconstruction rows = GetParam()->reconstruct(cells, some);
    ASSERT_GE(rows.stencils.num_rows(), 3);
    const Values<double> found = apply(rows, values);
    for (int r = 0; r < 3; ++r) EXPECT_LT((found.row(r) - all.row(some[r])).norm(), 1e-12);
  }
}

TEST_P(ReconstructorContract, RigidMotionsAndScalesChangeNothing) {
  for (const Mesh& mesh : meshes()) {
    const int gdim = mesh.gdim();
    const Values<double> values = waves(mesh), before = gradients(mesh, values);
    Eigen::MatrixXd turn = Eigen::Rotation2Dd(0.7).toRotationMatrix();
    if (gdim == 3) turn = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
    constexpr double scale = 1e-3;
    const Mesh moved = test::transformed(mesh, scale * turn, Eigen::VectorXd::Constant(gdim, 0.02));
    const Values<double> after = gradients(moved, values);
    for (Index v = 0; v < mesh.num_vertices(); ++v)
      EXPECT_LT((scale * after.row(v) - before.row(v) * turn.transpose()).norm(), 1e-8 * (1 + before.row(v).norm()));
  }
}

TEST_P(ReconstructorContract, NumberingChangesNothing) {
  for (const Mesh& mesh : {test::lattice<Triangle>(5, 0.2, 1), test::lattice<Tetrahedron>(3, 0.2, 3)}) {
    const Index count = mesh.num_vertices();
    Points vertices(count, mesh.gdim());
    for (Index v = 0; v < count; ++v) vertices.row(count - 1 - v) = mesh.vertices().row(v);
    std::vector<AnyBlock> blocks = mesh.blocks();
    for (AnyBlock& any : blocks)
      std::visit([&](auto& block) { block.cells = (count - 1 - block.cells.array()).colwise().reverse().eval(); }, any);
    const Mesh reversed(std::move(vertices), std::move(blocks));
    const Values<double> before = gradients(mesh, waves(mesh)), after = gradients(reversed, waves(reversed));
    EXPECT_LT((before.colwise().reverse() - after).cwiseAbs().maxCoeff(), 1e-9);
  }
}

}  // namespace halfgrad
