// Skinning with affine bones is Phong deformation.
#include "framework/affine_bones.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "framework/error.hpp"
#include "framework/interpolant.hpp"
#include "support/test_meshes.hpp"

namespace halfgrad {
namespace {

// Σ_k w_k T_b [X; 1], as a skinning engine computes it.
Values<double> skinned(const AffineBones& bones, const Values<double>& transforms, const Points& points,
                       Eigen::Index columns) {
  Values<double> result = Values<double>::Zero(points.rows(), columns);
  const Eigen::Index width = points.cols() + 1;
  for (Eigen::Index p = 0; p < points.rows(); ++p)
    for (Eigen::Index k = 0; k < bones.indices.cols(); ++k)
      for (Eigen::Index c = 0; c < columns; ++c) {
        const auto row = transforms.row(bones.indices(p, k)).segment(c * width, width);
        result(p, c) += bones.weights(p, k) * (row.head(width - 1).dot(points.row(p)) + row[width - 1]);
      }
  return result;
}

template <Element E>
void expect_skinning_is_phong() {
  const Mesh mesh = test::lattice<E>(2, 0.15, 4);
  Points points = Points::Random(60, E::dim);
  points = (0.7 * points.array() + 0.5).matrix();  // some lie outside the unit cube
  const Embedding embedding = embed(mesh, points, {.outside = Outside::nearest});
  ASSERT_FALSE(embedding.outside.empty());
  const AffineBones bones = affine_bones(mesh, embedding);
  EXPECT_EQ(bones.vertices, active_vertices(mesh, embedding));
  EXPECT_EQ(bones.indices.cols(), E::num_nodes);
  EXPECT_LT((bones.weights.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-12);

  // Any gradients will do: the identity is algebra. Values have one column more than the space.
  const Values<double> values = Values<double>::Random(mesh.num_vertices(), E::dim + 1);
  const Values<double> gradients =
      Values<double>::Random(static_cast<Eigen::Index>(bones.vertices.size()), (E::dim + 1) * E::dim);
  for (const double alpha : {0.0, 0.5, 0.8}) {
    const Interpolant<double> interpolant(mesh, embedding, {Formula::blend, alpha}, nullptr);
    Values<double> expected;
    interpolant.evaluate_given(values, gradients, {}, expected);
    const Values<double> transforms = bone_transforms(bones.vertices, mesh.vertices(), values, gradients, alpha);
    // Round-off of some dozen products of numbers up to about ten.
    EXPECT_LT((skinned(bones, transforms, points, E::dim + 1) - expected).cwiseAbs().maxCoeff(), 1e-12)
        << E::name << " " << alpha;
  }
}

TEST(AffineBones, SkinningIsPhongOnEveryElement) {
  Elements::for_each([]<class E>() { expect_skinning_is_phong<E>(); });
}

TEST(AffineBones, PointsNotFoundHaveNoWeight) {
  const Mesh mesh = test::lattice<Triangle>(1, 0, 1);
  Points points(2, 2);
  points << 0.3, 0.3, 7, 7;
  const AffineBones bones = affine_bones(mesh, embed(mesh, points, {.outside = Outside::mark}));
  EXPECT_NEAR(bones.weights.row(0).sum(), 1, 1e-14);
  EXPECT_EQ(bones.weights.row(1).cwiseAbs().sum(), 0);
}

TEST(AffineBones, RefusesGradientsOfAnotherBinding) {
  const Mesh mesh = test::lattice<Triangle>(2, 0, 1);
  const std::vector<Index> bones = {0, 1};
  const Values<double> values = mesh.vertices(), three = Values<double>::Zero(3, 4);
  try {
    bone_transforms(bones, mesh.vertices(), values, three, 0.5);
    FAIL() << "expected Error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("expected 2 x 4"));
  }
}

}  // namespace
}  // namespace halfgrad
