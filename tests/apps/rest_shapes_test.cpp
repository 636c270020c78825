// The program on rest shapes that are no ordinary mesh: grids and surfaces in space.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "apps/run_program.hpp"
#include "framework/io/frame_sink.hpp"
#include "framework/io/frame_source.hpp"
#include "framework/io/mesh_file.hpp"
#include "framework/io/npy.hpp"
#include "support/file_test.hpp"

namespace halfgrad {
namespace {

using testing::HasSubstr;

class RestShapes : public FileTest {
 protected:
  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  void write_array(const std::string& name, const Points& points) const {
    const auto sink = create_frames(folder_ / name);
    sink->write(points);
    sink->finish();
  }
  void write_points(const std::string& name, const Points& points) const { write_npy(folder_ / name, points); }
  Values<double> read_array(const std::string& name) const {
    Values<double> values;
    open_frames(in(name))->read(0, values);
    return values;
  }
  /// What deform writes by a saved binding has the same bytes as without; other points are refused.
  void expect_same_bytes_when_bound(const std::string& rest, const std::string& options = "") {
    SCOPED_TRACE(rest + " " + options);
    const std::string shape = " --rest " + in(rest) + " --points " + in("points.npy") + " " + options;
    const std::string frames = " --frames " + in("frames.npy") + " --out ";
    ASSERT_EQ(run("deform" + shape + frames + in("plain.npy")), 0) << output;
    ASSERT_EQ(run("bind" + shape + " --out " + in("x.hgb")), 0) << output;
    ASSERT_EQ(run("deform --binding " + in("x.hgb") + frames + in("bound.npy")), 0) << output;
    EXPECT_EQ(content("bound.npy"), content("plain.npy"));
    Values<double> points = read_npy(in("points.npy"));
    points(0, 0) += 0.001;
    write_points("other.npy", points);
    EXPECT_EQ(run("deform --binding " + in("x.hgb") + " --points " + in("other.npy") + frames + in("no.npy")), 2);
    EXPECT_THAT(output, HasSubstr("bind again"));
  }
  int run(const std::string& arguments) {
    const Outcome outcome = run_program(arguments);
    output = outcome.output;
    return outcome.status;
  }

  std::string output;
};

Points parabola(const Points& points) {
  Points result = points;
  result.col(2) += 0.5 * points.col(0).cwiseAbs2() - points.col(0).cwiseProduct(points.col(1));
  return result;
}

TEST_F(RestShapes, GridsCarryPoints) {
  write("grid.vti",
        "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 3 0 2 0 2\" Origin=\"1 0 0\" Spacing=\"0.5 1 1\">"
        "<Piece Extent=\"0 3 0 2 0 2\"/></ImageData></VTKFile>");
  const Points rest = read_mesh(in("grid.vti")).vertices();
  ASSERT_EQ(rest.rows(), 36);
  write_array("frames.npy", parabola(rest));
  Points points(3, 3);
  points << 1.2, 0.3, 1.7, 2.5, 1, 0, 1.9, 1.4, 0.6;
  write_points("points.npy", points);
  const std::string arguments = "deform --rest " + in("grid.vti") + " --frames " + in("frames.npy") + " --points " +
                                in("points.npy") + " --out " + in("out.npy") + " --report " + in("report.json");
  ASSERT_EQ(run(arguments), 0) << output;
  EXPECT_THAT(output, HasSubstr("centered_difference"));
  // Quadratic fields are exact, boundary cells included.
  EXPECT_LT((read_array("out.npy") - parabola(points)).cwiseAbs().maxCoeff(), 1e-12);
  const nlohmann::json report = nlohmann::json::parse(std::ifstream(folder_ / "report.json"));
  EXPECT_EQ(report["counts"]["vertices"], 36);
  ASSERT_EQ(run(arguments + " --reconstructor adaptive"), 0) << output;
  ASSERT_EQ(run("info " + in("grid.vti")), 0) << output;
  EXPECT_THAT(output, HasSubstr("12 cells"));
  for (const char* options : {"", "--interpolant linear", "--reconstructor adaptive", "--outside nearest"})
    expect_same_bytes_when_bound("grid.vti", options);
}

TEST_F(RestShapes, SurfacesCarryPointsBesideThem) {
  // A roof of two slopes; a rigid turn of it turns points above and beside it alike.
  write("cloth.obj", "v 0 0 0\nv 1 0 0.3\nv 2 0 0\nv 0 1 0\nv 1 1 0.3\nv 2 1 0\nf 1 2 5 4\nf 2 3 6\nf 2 6 5\n");
  const Points rest = read_mesh(in("cloth.obj")).vertices();
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.2, Eigen::Vector3d(1, 1, 3).normalized()).toRotationMatrix();
  write_array("frames.npy", rest * turn.transpose());
  Points points(4, 3);
  points << 0.4, 0.5, 0.5, 1, 0.2, 0.31, 1.6, 0.9, -0.2, 2.5, 1.5, 0.1;
  write_points("points.npy", points);
  const std::string arguments =
      "deform --rest " + in("cloth.obj") + " --points " + in("points.npy") + " --out " + in("out.npy") + " --frames ";
  for (const char* options : {"", " --interpolant linear", " --reconstructor kriging --precision float --gradients"}) {
    ASSERT_EQ(run(arguments + in("frames.npy") + options), 0) << output;
    EXPECT_THAT(output, HasSubstr("from the surface"));
    EXPECT_LT((read_array("out.npy") - points * turn.transpose()).cwiseAbs().maxCoeff(), 1e-6) << options;
  }
  for (const char* options : {"", "--interpolant linear", "--reconstructor kriging"})
    expect_same_bytes_when_bound("cloth.obj", options);
  // A baseline asks for no cells, so it takes a surface as it takes a mesh.
  expect_same_bytes_when_bound("cloth.obj", "--interpolant attribute_transfer");
  write_array("flat.npy", rest.leftCols(2));
  EXPECT_EQ(run(arguments + in("flat.npy")), 2);
  EXPECT_THAT(output, HasSubstr("surface in space"));
  EXPECT_EQ(run(arguments + in("frames.npy") + " --interpolant dual_taylor"), 2);
  EXPECT_THAT(output, HasSubstr("hermite"));
  ASSERT_EQ(run("info " + in("cloth.obj")), 0) << output;
}

}  // namespace
}  // namespace halfgrad
