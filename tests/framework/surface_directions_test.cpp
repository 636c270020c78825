// Normals and tangents: what a surface gives, and what deformation gradients make of them.
#include "framework/surface_directions.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <limits>

#include "support/message_of.hpp"

namespace halfgrad {
namespace {

using testing::HasSubstr;

constexpr double round_off = 1e-14;

// Random rows of unit normals and tangents orthogonal to them, and random gradients of either orientation.
struct Directions {
  explicit Directions(int count) : normals(count, 3), tangents(count, 4), gradients(count, 9) {
    std::srand(7);
    for (int p = 0; p < count; ++p) {
      const Eigen::Quaterniond turn = Eigen::Quaterniond::UnitRandom();
      normals.row(p) = (turn * Eigen::Vector3d::UnitZ()).transpose();
      tangents.row(p) << (turn * Eigen::Vector3d::UnitX()).transpose(), p % 2 == 0 ? 1 : -1;
      gradients.row(p).setRandom();
    }
  }
  Eigen::Matrix3d gradient(Eigen::Index p) const {
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(gradients.row(p).data());
  }
  // B = w N × T, of the rest state.
  Eigen::Vector3d bitangent(Eigen::Index p) const {
    const Eigen::RowVector3d N = normals.row(p), T = tangents.row(p).head<3>();
    return tangents(p, 3) * N.cross(T).transpose();
  }
  Points normals, tangents;
  Values<double> gradients;
};

TEST(SurfaceDirections, CarriedFramesAreOrthogonalAndKeepTheirHandedness) {
  const Directions given(500);
  Values<double> normals, tangents;
  carry_normals(given.gradients, given.normals, normals);
  carry_tangents(given.gradients, given.tangents, tangents);
  for (Eigen::Index p = 0; p < 500; ++p) {
    const Eigen::RowVector3d n = normals.row(p), t = tangents.row(p).head<3>();
    const Eigen::Matrix3d F = given.gradient(p);
    // cof(F) N, up to the conditioning of the random F.
    const Eigen::Vector3d expected = F.determinant() * F.inverse().transpose() * given.normals.row(p).transpose();
    EXPECT_LT((n.transpose() - expected.normalized()).norm(), 1e-10);
    EXPECT_NEAR(t.norm(), 1, round_off);
    EXPECT_NEAR(n.dot(t), 0, 1e-11);
    const Eigen::Vector3d FT = F * given.tangents.row(p).head<3>().transpose();
    EXPECT_LT((t.transpose() - FT.normalized()).norm(), round_off);
    EXPECT_EQ(tangents(p, 3), given.tangents(p, 3));
    // The deformed bitangent lies on the side that the handedness says, mirrored cells included.
    EXPECT_GT(tangents(p, 3) * n.cross(t).dot((F * given.bitangent(p)).transpose()), 0);
  }
}

TEST(SurfaceDirections, RotationsTurnTheWholeFrameAndSinglePrecisionAgrees) {
  Directions given(100);
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> turn =
      Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, -2, 3).normalized()).toRotationMatrix();
  for (Eigen::Index p = 0; p < 100; ++p)
    given.gradients.row(p) = Eigen::Map<const Eigen::Matrix<double, 1, 9>>(turn.data());
  Values<double> normals, tangents;
  carry_normals(given.gradients, given.normals, normals);
  carry_tangents(given.gradients, given.tangents, tangents);
  EXPECT_LT((normals - given.normals * turn.transpose()).norm(), 1e-13);
  EXPECT_LT((tangents.leftCols(3) - given.tangents.leftCols(3) * turn.transpose()).norm(), 1e-13);
  Values<float> in_float;
  carry_tangents(Values<float>(given.gradients.cast<float>()), given.tangents, in_float);
  EXPECT_LT((in_float.cast<double>() - tangents).cwiseAbs().maxCoeff(), 1e-6);
  Values<double> stretches;
  principal_stretches(given.gradients, 3, stretches);
  EXPECT_LT((stretches.array() - 1).abs().maxCoeff(), round_off);
}

// Two triangles of a unit square in the plane z = 0.
struct Square {
  Points points = (Points(4, 3) << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0).finished();
  IndexTable faces{{0, 3, 6}, {0, 1, 2, 0, 2, 3}};
  Points normals = point_normals(points, faces);
  // Texture coordinates A x of each corner.
  Points uv(const Eigen::Matrix2d& map) const {
    Points result(6, 2);
    for (std::size_t c = 0; c < 6; ++c) result.row(c) = points.row(faces.entries[c]).head<2>() * map.transpose();
    return result;
  }
};

TEST(SurfaceDirections, TangentsFollowGrowingU) {
  const Square square;
  EXPECT_EQ(square.normals, Points(Eigen::RowVector3d(0, 0, 1).replicate(4, 1)));
  const auto tangents = [&](double a, double b, double c, double d) {
    return point_tangents(square.points, square.faces, square.uv((Eigen::Matrix2d() << a, b, c, d).finished()),
                          square.normals);
  };
  const auto expect = [&](const Points& found, double x, double y, double w) {
    const Eigen::RowVector4d row(x, y, 0, w);
    EXPECT_LT((found - row.replicate(4, 1)).norm(), round_off) << found;
  };
  expect(tangents(1, 0, 0, 1), 1, 0, 1);
  expect(tangents(5, 0, 0, 0.1), 1, 0, 1);
  expect(tangents(0, 1, -1, 0), 0, 1, 1);    // u along y, v along −x
  expect(tangents(-1, 0, 0, 1), -1, 0, -1);  // mirrored
  // Where v is sheared, u grows along the line of equal v.
  expect(tangents(1, 0, 1, 1), std::sqrt(0.5), -std::sqrt(0.5), 1);
}

TEST(SurfaceDirections, MirroredSeamsKeepTheSideThatPrevails) {
  // Three triangles around an edge at x = 0; texture mirrored beyond it.
  Points points(5, 3);
  points << 0, 0, 0, 0, 1, 0, -1, 0, 0, 2, 0, 0, 2, 1, 0;
  const IndexTable faces{{0, 3, 6, 9}, {0, 1, 2, 0, 3, 1, 3, 4, 1}};
  Points uv(9, 2);
  for (Eigen::Index c = 0; c < 9; ++c) {
    const Eigen::RowVector3d at = points.row(faces.entries[static_cast<std::size_t>(c)]);
    uv.row(c) << std::abs(at[0]), at[1];
  }
  const Points tangents = point_tangents(points, faces, uv, point_normals(points, faces));
  for (Eigen::Index p : {0, 1, 3, 4}) EXPECT_LT((tangents.row(p) - Eigen::RowVector4d(1, 0, 0, 1)).norm(), round_off);
  EXPECT_LT((tangents.row(2) - Eigen::RowVector4d(-1, 0, 0, -1)).norm(), round_off);
}

TEST(SurfaceDirections, NothingIsMadeUpWhereTheTextureGivesNone) {
  Square square;
  Points uv = square.uv(Eigen::Matrix2d::Identity());
  uv.bottomRows(3).setConstant(std::numeric_limits<double>::quiet_NaN());
  Points tangents = point_tangents(square.points, square.faces, uv, square.normals);
  EXPECT_TRUE(tangents.allFinite());
  EXPECT_EQ(tangents.row(3).head<3>().norm(), 0);
  EXPECT_EQ(tangents(1, 0), 1);
  // All corners at one place of the texture.
  tangents = point_tangents(square.points, square.faces, Points::Zero(6, 2), square.normals);
  EXPECT_EQ(tangents.leftCols(3).norm(), 0);
  EXPECT_THAT(message_of([&] { point_tangents(square.points, square.faces, Points(4, 2), square.normals); }),
              HasSubstr("expected 6 x 2"));
}

TEST(SurfaceDirections, GivenTangentsBecomeOrthonormal) {
  const Square square;
  Points given = Points::Zero(4, 3);
  given.col(0).setConstant(3);
  given.col(2) << 0, 1, -5, 0;
  given.row(3) << 0, 0, 2;  // along the normal: none
  const Points made = orthonormal_tangents(given, square.normals, {});
  for (Eigen::Index p = 0; p < 3; ++p) EXPECT_LT((made.row(p) - Eigen::RowVector4d(1, 0, 0, 1)).norm(), round_off);
  EXPECT_EQ(made.row(3).head<3>().norm(), 0);
  Points handed(4, 4);
  handed << given, Eigen::Vector4d(-1, 1, -1, 1);
  EXPECT_EQ(orthonormal_tangents(handed, square.normals, {}).col(3), Eigen::Vector4d(-1, 1, -1, 1));
  EXPECT_EQ(orthonormal_tangents(given, square.normals, handed).col(3), Eigen::Vector4d(-1, 1, -1, 1));
}

}  // namespace
}  // namespace halfgrad
