// What the configurations of the paper's figures stand on: tessellations, moving parts, sequences, σ, scenes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "experiments/experiment.hpp"
#include "experiments/fields.hpp"
#include "experiments/lattice.hpp"
#include "experiments/scene.hpp"
#include "experiments/tessellation.hpp"
#include "framework/embedding.hpp"
#include "framework/error.hpp"
#include "framework/io/mesh_file.hpp"
#include "reconstruction/registry.hpp"
#include "support/file_test.hpp"

namespace halfgrad {
namespace {

using nlohmann::json;
using testing::HasSubstr;

double total_area(const PointCloud& cloud) {
  double sum = 0;
  for (Index f = 0; f < cloud.faces.num_rows(); ++f) {
    Eigen::Matrix3d corners = Eigen::Matrix3d::Zero();
    for (int i = 0; i < 3; ++i) corners.row(i).head(cloud.positions.cols()) = cloud.positions.row(cloud.faces[f][i]);
    const Eigen::Vector3d a = corners.row(1) - corners.row(0), b = corners.row(2) - corners.row(0);
    sum += a.cross(b).norm() / 2;
  }
  return sum;
}

TEST(Tessellation, CoversThePlaneMeshOrTheSurfaceOfTheBodyOnce) {
  for (const char* element : {"triangle", "quadrilateral", "tetrahedron", "hexahedron", "wedge"}) {
    LatticeOptions options;
    options.element = element;
    options.cells.fill(2);
    const Mesh mesh = make_lattice(options);
    const PointCloud cloud = tessellation(mesh, 3);
    EXPECT_NEAR(total_area(cloud), mesh.gdim() == 2 ? 1 : 6, 1e-12) << element;  // the unit square, the unit cube
    EXPECT_NO_THROW(embed(mesh, cloud.positions)) << element;
  }
}

TEST(RigidParts, TurnsOneSideAndLeavesTheOther) {
  const auto field =
      make_field(json::parse(R"({"rigid_parts": {"angle": 0.5, "center": [1, 0, 0]}})"), "/field", {3, 1});
  const Eigen::Vector3d below(2, 3, -1), above(2, 0, 1);
  EXPECT_EQ(field->value(below), below);
  EXPECT_TRUE(field->value(above).isApprox(Eigen::Vector3d(1 + std::cos(0.5), std::sin(0.5), 1), 1e-14));
  EXPECT_TRUE(field->jet(above).gradient.isApprox(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()).toRotationMatrix()));
}

// James 2020, §4: "a single adjacent tetrahedron where the reconstructed vertex gradient is simply the element's
// value".
TEST(TwoTetrahedra, VerticesOfOneCellHaveItsGradient) {
  const Mesh mesh = read_mesh(fs::path(HALFGRAD_CONFIGS) / "meshes/two_tetrahedra.vtk");
  ASSERT_EQ(mesh.num_cells(), 2);
  const auto field = make_field(json::parse(R"({"rigid_parts": {"angle": 1.5}})"), "/field", {3, 1});
  const Values<double> values = field_values(*field, mesh.vertices());
  const std::vector<Index> alone = {1, 2, 3, 4, 5, 6};
  Eigen::Matrix3d turned = Eigen::AngleAxisd(1.5, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  for (const json& specification :
       {json("unweighted_average"), json("volume_average"), json("inverse_distance"), json("chandrashekar_garg")}) {
    const auto reconstruction =
        make_reconstructor(specification).reconstructor->reconstruct(CellGradients(mesh), alone);
    const Values<double> F = apply_stencils(reconstruction.stencils, values);
    for (int row = 0; row < 6; ++row) {
      const Eigen::Matrix3d own = alone[row] < 4 ? Eigen::Matrix3d::Identity() : turned;
      EXPECT_LT((Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(F.row(row).data()) - own).norm(), 1e-14)
          << specification << ", vertex " << alone[row];
    }
  }
}

class FigureRun : public FileTest {
 protected:
  ExperimentResult run(const char* text, bool check_only = false) const {
    std::ofstream(folder_ / "c.json") << text;
    return run_experiment(folder_ / "c.json", {.check_only = check_only});
  }
  std::string refusal(const char* text) const {
    try {
      run(text, true);
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  }
};

TEST_F(FigureRun, ASequenceEndsWithTheFieldItself) {
  const char* still = R"({"mesh": {"lattice": {"element": "triangle"}}, "field": {"radial_twist": {"angle": 2}}})";
  const char* moving = R"({"mesh": {"lattice": {"element": "triangle"}}, "field": {"radial_twist": {"angle": 2}},
                           "sequence": {"frames": 4, "parameter": "angle"}})";
  const ExperimentResult one = run(still), four = run(moving);
  ASSERT_EQ(one.rows.size(), 2u);
  ASSERT_EQ(four.rows.size(), 8u);
  EXPECT_EQ(four.rows[6].frame, 3);
  EXPECT_EQ(four.rows[7].error[0].rms, one.rows[1].error[0].rms);
  EXPECT_THAT(refusal(R"({"mesh": {"lattice": {}}, "field": "waves", "sequence": {"parameter": "amplitud"}})"),
              HasSubstr("\"amplitud\" is no number of the field waves"));
  EXPECT_THAT(refusal(R"({"mesh": {"lattice": {}}, "field": "waves", "sequence": {"frames": 3}})"),
              HasSubstr("/sequence/parameter"));
}

TEST_F(FigureRun, SigmaIsThePapersDeviationFromOne) {
  // One cell a vertex: every weight is 1. Eight cubes around the middle vertex of a 2³ grid, one at each corner, …: the
  // 27 vertices have 8 weights of 1/8, 6 × 4 of ¼, 12 × 2 of ½, 8 × 1 of 1.
  const char* text = R"({"mesh": {"lattice": {"element": "hexahedron", "cells": 1}}, "field": "waves",
                         "reconstructors": ["unweighted_average", "kriging"]})";
  EXPECT_EQ(*run(text).rows[1].sigma, 0);
  EXPECT_FALSE(run(text).rows[2].sigma);
  std::string finer = text;
  finer.replace(finer.find("\"cells\": 1"), 10, "\"cells\": 2");
  const double squares = 8 * std::pow(7. / 8, 2) + 24 * std::pow(3. / 4, 2) + 24 * std::pow(1. / 2, 2);
  EXPECT_NEAR(*run(finer.c_str()).rows[1].sigma, std::sqrt(squares / 64), 1e-14);
}

TEST(RegionMean, IsTheMeanOfTheErrors) {
  Points measured(2, 1), truth = Points::Zero(2, 1);
  measured << 3, -1;
  const auto errors = region_errors(measured, truth, std::vector<PointPlace>(2, PointPlace::interior));
  EXPECT_EQ(errors[1].mean, 2);
  EXPECT_EQ(errors[2].mean, 0);
}

TEST(SceneRecorder, ThinsWhatWouldNotFit) {
  LatticeOptions options;
  options.element = "triangle";
  const Mesh mesh = make_lattice(options);
  PointCloud cloud{Points::Constant(50000, 2, 0.25), {}};
  SceneRecorder many(mesh, cloud, 1000, 20);
  int wanted = 0;
  for (int f = 0; f < 1000; ++f) wanted += many.wants(f);
  EXPECT_GT(wanted, 0);
  EXPECT_LT(wanted, 1000);
  EXPECT_TRUE(many.wants(999)) << "the last frame is always there";
  EXPECT_THAT(many.text(), HasSubstr("of the 1000 frames"));
  // Points without faces are thinned too, those of a surface cannot be.
  cloud.positions = Points::Constant(1000000, 2, 0.25);
  SceneRecorder thinned(mesh, cloud, 1, 50);
  EXPECT_TRUE(thinned.wants(0));
  EXPECT_THAT(thinned.text(), HasSubstr("th point"));
  cloud.faces.offsets = {0, 3};
  cloud.faces.entries = {0, 1, 2};
  const SceneRecorder omitted(mesh, cloud, 1, 50);
  EXPECT_FALSE(omitted.wants(0));
  EXPECT_THAT(omitted.text(), HasSubstr("\"omitted\""));
}

}  // namespace
}  // namespace halfgrad
