// Points near a surface in space follow it.
#include "framework/surface.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>
#include <random>

#include "framework/error.hpp"
#include "reconstruction/registry.hpp"
#include "reconstruction/surface_gradients.hpp"
#include "support/message_of.hpp"

namespace halfgrad {
namespace {

using testing::HasSubstr;
using Vector3 = Eigen::Vector3d;

// A smooth sheet over the unit square and its bent image, each with unit normals.
Vector3 rest_sheet(double u, double v) { return {u, v, 0.2 * std::sin(2 * u + 0.3) * std::cos(1.7 * v)}; }
Vector3 bent_sheet(double u, double v) {
  // The rest sheet bent about an axis along y, and twisted a little.
  const Vector3 s = rest_sheet(u, v);
  const double angle = 1.1 * s[0], radius = 0.8 - s[2], twist = 0.4 * s[1];
  const Vector3 bent(radius * std::sin(angle), s[1], 0.8 - radius * std::cos(angle));
  return Eigen::AngleAxisd(twist, Vector3::UnitY()) * bent;
}
template <class Sheet>
Vector3 normal_of(Sheet&& sheet, double u, double v) {
  constexpr double step = 1e-5;
  const Vector3 along_u = sheet(u + step, v) - sheet(u - step, v), along_v = sheet(u, v + step) - sheet(u, v - step);
  return along_u.cross(along_v).normalized();
}

struct Sheet {
  Mesh mesh;
  Values<double> deformed;
};

// n² jittered squares of the parameters, whole, cut, or one of two like a chessboard.
enum class Cells { triangles, quadrilaterals, mixed };
Sheet make_sheet(int n, Cells cells, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-0.2 / n, 0.2 / n);
  Points rest((n + 1) * (n + 1), 3);
  Sheet sheet;
  sheet.deformed.resize(rest.rows(), 3);
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const double u = double(i) / n + (i > 0 && i < n ? uniform(random) : 0),
                   v = double(j) / n + (j > 0 && j < n ? uniform(random) : 0);
      rest.row(i + (n + 1) * j) = rest_sheet(u, v).transpose();
      sheet.deformed.row(i + (n + 1) * j) = bent_sheet(u, v).transpose();
    }
  std::vector<Index> triangles, squares;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const Index a = i + (n + 1) * j, b = a + 1, c = b + n + 1, d = a + n + 1;
      if (cells == Cells::quadrilaterals || (cells == Cells::mixed && (i + j) % 2 == 0))
        squares.insert(squares.end(), {a, b, c, d});
      else
        triangles.insert(triangles.end(), {a, b, c, a, c, d});
    }
  std::vector<AnyBlock> blocks;
  if (!triangles.empty()) {
    ElementBlock<Triangle> block;
    block.cells = Eigen::Map<const decltype(block.cells)>(triangles.data(), triangles.size() / 3, 3);
    blocks.emplace_back(block);
  }
  if (!squares.empty()) {
    ElementBlock<Quadrilateral> block;
    block.cells = Eigen::Map<const decltype(block.cells)>(squares.data(), squares.size() / 4, 4);
    blocks.emplace_back(block);
  }
  sheet.mesh = Mesh(std::move(rest), std::move(blocks));
  return sheet;
}

// Points of the smooth sheet, moved along its normal; rest and true deformed positions.
struct Shell {
  Points rest, truth;
};
Shell make_shell(int count, double offset, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.02, 0.98);
  Shell shell{Points(count, 3), Points(count, 3)};
  for (int p = 0; p < count; ++p) {
    const double u = uniform(random), v = uniform(random);
    shell.rest.row(p) = (rest_sheet(u, v) + offset * normal_of(rest_sheet, u, v)).transpose();
    shell.truth.row(p) = (bent_sheet(u, v) + offset * normal_of(bent_sheet, u, v)).transpose();
  }
  return shell;
}

SurfaceInterpolant<double> bind(const Mesh& mesh, const Points& points, const char* rule, const char* reconstructor) {
  const SurfaceEmbedding embedding = embed_on_surface(mesh, points);
  const Reconstruction rows =
      surface_gradients(*make_reconstructor(reconstructor).reconstructor, mesh, active_vertices(embedding.feet));
  return {mesh, embedding, named_rule(rule), rows};
}

double rms(const Points& found, const Points& truth) {
  return std::sqrt((found - truth).squaredNorm() / static_cast<double>(found.rows()));
}

class SurfaceCells : public testing::TestWithParam<Cells> {};
INSTANTIATE_TEST_SUITE_P(All, SurfaceCells, testing::Values(Cells::triangles, Cells::quadrilaterals, Cells::mixed));

TEST_P(SurfaceCells, RestIsReproducedAndRigidMotionsAreFollowed) {
  const Sheet sheet = make_sheet(6, GetParam(), 1);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-0.1, 1.1);
  // Beyond the border too.
  const Points points = Points::NullaryExpr(300, 3, [&] { return uniform(random); });
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(2, Vector3(1, -2, 0.5).normalized()).toRotationMatrix();
  const Eigen::RowVector3d shift(10, -3, 2);
  Values<double> moved = sheet.mesh.vertices() * turn.transpose();
  moved.rowwise() += shift;
  Points expected = points * turn.transpose();
  expected.rowwise() += shift;
  for (const char* reconstructor : {"chandrashekar_garg", "kriging", "adaptive"})
    for (const char* rule : {"linear", "phong", "hermite"}) {
      const auto bound = bind(sheet.mesh, points, rule, reconstructor);
      EXPECT_LT((bound.evaluate(sheet.mesh.vertices()) - points).cwiseAbs().maxCoeff(), 1e-12);
      EXPECT_LT((bound.evaluate(moved) - expected).cwiseAbs().maxCoeff(), 1e-11) << rule << " " << reconstructor;
    }
}

TEST_P(SurfaceCells, PointsOfASmoothSheetAreThirdOrderWithKriging) {
  const Shell shell = make_shell(400, 0, 3);
  for (const auto& [rule, least, greatest] : {std::tuple("linear", 1.8, 2.3), std::tuple("phong", 2.7, 3.6)}) {
    std::array<double, 2> errors{};
    for (int level = 0; level < 2; ++level) {
      const Sheet sheet = make_sheet(10 << level, GetParam(), 4);
      errors[level] = rms(bind(sheet.mesh, shell.rest, rule, "kriging").evaluate(sheet.deformed), shell.truth);
    }
    const double order = std::log2(errors[0] / errors[1]);
    EXPECT_GT(order, least) << rule;
    EXPECT_LT(order, greatest) << rule;
    RecordProperty(std::string(rule) + "_order", std::to_string(order));
    RecordProperty(std::string(rule) + "_error", std::to_string(1e6 * errors[1]) + "e-6");
  }
}

TEST_P(SurfaceCells, OffsetsFollowTheNormal) {
  constexpr double offset = 0.05;
  const Shell shell = make_shell(400, offset, 5);
  const Sheet sheet = make_sheet(20, GetParam(), 6);
  const SurfaceEmbedding embedding = embed_on_surface(sheet.mesh, shell.rest);
  for (const double distance : embedding.distance) EXPECT_NEAR(distance, offset, 2e-3);
  const double linear = rms(bind(sheet.mesh, shell.rest, "linear", "kriging").evaluate(sheet.deformed), shell.truth);
  const double phong = rms(bind(sheet.mesh, shell.rest, "phong", "kriging").evaluate(sheet.deformed), shell.truth);
  const double averaged =
      rms(bind(sheet.mesh, shell.rest, "phong", "chandrashekar_garg").evaluate(sheet.deformed), shell.truth);
  RecordProperty("linear_error", std::to_string(1e6 * linear) + "e-6");
  RecordProperty("phong_error", std::to_string(1e6 * phong) + "e-6");
  RecordProperty("phong_chandrashekar_garg_error", std::to_string(1e6 * averaged) + "e-6");
  EXPECT_LT(phong, linear);
  EXPECT_LT(phong, 0.02 * offset);
}

TEST_P(SurfaceCells, IsContinuousAcrossEdges) {
  const Sheet sheet = make_sheet(5, GetParam(), 7);
  constexpr double step = 1e-8;
  std::vector<Vector3> positions;
  const Points& rest = sheet.mesh.vertices();
  for (int j = 1; j < 5; ++j)
    for (int i = 1; i < 5; ++i) {
      // The middle of an edge, a little to both of its sides and above it.
      const Index a = i + 6 * j, b = a + 1;
      const Vector3 middle = 0.5 * (rest.row(a) + rest.row(b)).transpose() + Vector3(0, 0, 0.03);
      positions.push_back(middle + Vector3(0, step, 0));
      positions.push_back(middle - Vector3(0, step, 0));
    }
  Points points(static_cast<Eigen::Index>(positions.size()), 3);
  for (std::size_t p = 0; p < positions.size(); ++p) points.row(p) = positions[p].transpose();
  const auto bound = bind(sheet.mesh, points, "phong", "kriging");
  const Values<double> out = bound.evaluate(sheet.deformed), normals = bound.normals(sheet.deformed);
  for (Eigen::Index p = 0; p < out.rows(); p += 2) {
    EXPECT_LT((out.row(p) - out.row(p + 1)).norm(), 100 * step);
    EXPECT_LT((normals.row(p) - normals.row(p + 1)).norm(), 1000 * step);
  }
}

TEST(Surface, VertexRowsProjectOntoTheTangentPlane) {
  const Sheet sheet = make_sheet(8, Cells::triangles, 8);
  std::vector<Index> vertices(sheet.mesh.num_vertices());
  std::iota(vertices.begin(), vertices.end(), 0);
  const Reconstruction rows = surface_gradients(*make_reconstructor("kriging").reconstructor, sheet.mesh, vertices);
  const Values<double> found = apply_stencils(rows.stencils, Values<double>(sheet.mesh.vertices()));
  for (Eigen::Index v = 0; v < found.rows(); ++v) {
    const Eigen::Matrix3d F = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(found.row(v).data());
    EXPECT_LT((F * F - F).norm(), 1e-12);
    EXPECT_LT((F - F.transpose()).norm(), 1e-12);
    EXPECT_NEAR(F.trace(), 2, 1e-12);
  }
}

TEST(Surface, RefusesWhatIsNone) {
  const Sheet sheet = make_sheet(2, Cells::triangles, 9);
  const Points point = Points::Constant(1, 3, 0.5);
  EXPECT_THAT(message_of([&] { embed(sheet.mesh, point); }), HasSubstr("embed_on_surface"));
  EXPECT_THAT(message_of([&] { CellGradients cells(sheet.mesh); }), HasSubstr("surface_gradients"));
  EXPECT_THAT(message_of([&] { embed_on_surface(Mesh(Points::Zero(1, 3), {}), point); }), HasSubstr("no surface"));
  const auto bound = bind(sheet.mesh, point, "phong", "kriging");
  EXPECT_THAT(message_of([&] { bound.evaluate(Values<double>::Zero(9, 2)); }), HasSubstr("2 columns"));
  EXPECT_THAT(message_of([&] { bind(sheet.mesh, point, "dual_taylor", "kriging"); }), HasSubstr("hermite"));
  EXPECT_GT(inspect(sheet.mesh).volume, 1);
}

}  // namespace
}  // namespace halfgrad
