// The pyramid at its apex, where the shape functions are rational.
#include "elements/pyramid.hpp"

#include <gtest/gtest.h>

namespace halfgrad {
namespace {

TEST(Pyramid, WeightsReachTheApexFromEveryDirection) {
  const Eigen::Vector3d apex(0.5, 0.5, 1);
  for (const Eigen::Vector3d& base : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0.3, 0.9, 0),
                                      Eigen::Vector3d(0.5, 0.5, 0), Eigen::Vector3d(1, 0.5, 0)})
    for (double distance = 0.1; distance > 1e-17; distance /= 10) {
      const Eigen::Vector3d xi = apex + distance * (base - apex);
      const Eigen::Matrix<double, 5, 1> beta = Pyramid::shape(xi);
      EXPECT_NEAR(beta.sum(), 1, 1e-15);
      EXPECT_LE(beta.head<4>().cwiseAbs().maxCoeff(), distance + 1e-12);
      EXPECT_NEAR(beta[4], 1 - distance, 1e-15);
      EXPECT_TRUE(Pyramid::shape_gradient(xi).allFinite());
      EXPECT_LT(Pyramid::shape_gradient(xi).cwiseAbs().maxCoeff(), 3);
    }
}

TEST(Pyramid, WeightsAreLinearOnTheSidesAndBilinearOnTheBase) {
  // A side sees only its three nodes, so that a tetrahedron that shares it agrees.
  for (double s : {0.0, 0.2, 0.7})
    for (double t : {0.0, 0.1, 0.25}) {
      const Eigen::Vector3d on_side =
          s * Pyramid::nodes().row(1) + t * Pyramid::nodes().row(4) + (1 - s - t) * Pyramid::nodes().row(0);
      const Eigen::Matrix<double, 5, 1> beta = Pyramid::shape(on_side);
      EXPECT_NEAR(beta[0], 1 - s - t, 1e-15);
      EXPECT_NEAR(beta[1], s, 1e-15);
      EXPECT_NEAR(beta[2], 0, 1e-15);
      EXPECT_NEAR(beta[3], 0, 1e-15);
      const Eigen::Matrix<double, 5, 1> base = Pyramid::shape(Eigen::Vector3d(s, t, 0));
      EXPECT_NEAR(base[2], s * t, 1e-15);
      EXPECT_NEAR(base[0], (1 - s) * (1 - t), 1e-15);
    }
}

}  // namespace
}  // namespace halfgrad
