// `halfgrad report` and `deform` with the baselines, as a user meets them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/run_program.hpp"
#include "framework/io/frame_sink.hpp"
#include "framework/io/frame_source.hpp"
#include "framework/io/npy.hpp"
#include "framework/io/vtk_output.hpp"
#include "support/file_test.hpp"
#include "support/test_meshes.hpp"

namespace halfgrad {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class ReportProgram : public FileTest {
 protected:
  /// Runs a small configuration under a name.
  void run(const std::string& name) const {
    std::ofstream(in(name + ".json")) << json{{"name", name},
                                              {"description", "</script> & <b>"},
                                              {"mesh", {{"lattice", {{"element", "triangle"}, {"cells", 3}}}}},
                                              {"points", {{"tessellation", {{"subdivisions", 2}}}}},
                                              {"field", "radial_twist"},
                                              {"outputs", {"json", "html"}}};
    EXPECT_EQ(run_program("run --quiet " + in(name + ".json") + " --out " + in(name)).status, 0);
  }
};

TEST_F(ReportProgram, MergesRunsIntoOnePageThatNeedsNothingElse) {
  run("first");
  run("second");
  const Outcome outcome = run_program("report " + in("first") + " " + in("second") + " --out " + in("both.html"));
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr("both.html"));
  const std::string page = content("both.html");
  EXPECT_THAT(page,
              AllOf(HasSubstr("first"), HasSubstr("second"), Not(HasSubstr("<script src")), Not(HasSubstr("<link"))));
  // What users write stays text, in the page's data too: nothing but the page itself ends a script.
  const bool is_interactive = page.find("halfgrad-data") != std::string::npos;
  std::size_t ends = 0;
  for (std::size_t at = page.find("</script"); at != std::string::npos; at = page.find("</script", at + 1)) ++ends;
  EXPECT_EQ(ends, is_interactive ? 2u : 0u);
  if (is_interactive) {
    const std::size_t begin = page.find('>', page.find("halfgrad-data")) + 1;
    const json data = json::parse(page.substr(begin, page.find("</script", begin) - begin));
    ASSERT_EQ(data["runs"].size(), 2u);
    EXPECT_EQ(data["runs"][0]["results"], json::parse(content("first/results.json")));
    EXPECT_EQ(data["runs"][1]["scene"], json::parse(content("second/scene.json")));
    EXPECT_EQ(data["runs"][1]["results"]["config"]["description"], "</script> & <b>");
    // 18 triangles of six points and four faces each; three edges a face, 33 edges of the lattice.
    const json& scene = data["runs"][0]["scene"];
    EXPECT_EQ(scene["faces"]["data"].get<std::string>().size(), 18u * 4 * 3 * 4 / 3 * 4);
    EXPECT_EQ(scene["edges"]["data"].get<std::string>().size(), 33u * 2 * 4 / 3 * 4);
    EXPECT_EQ(scene["rules"].size(), 2u);
  }
}

TEST_F(ReportProgram, RefusesFoldersWithoutResultsByName) {
  run("good");
  std::filesystem::create_directories(folder_ / "empty");
  const Outcome missing = run_program("report " + in("good") + " " + in("empty") + " --out " + in("page.html"));
  EXPECT_EQ(missing.status, 2);
  EXPECT_THAT(missing.output, AllOf(HasSubstr("empty"), HasSubstr("results.json")));
  std::ofstream(in("empty/results.json")) << "{\"name\": 3}";
  const Outcome wrong = run_program("report " + in("empty") + " --out " + in("page.html"));
  EXPECT_EQ(wrong.status, 2);
  EXPECT_THAT(wrong.output, HasSubstr("not the results of a run"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "page.html"));
  EXPECT_EQ(run_program("report").status, 2);
}

TEST_F(ReportProgram, SequencesOfEveryRuleAreWritten) {
  std::ofstream(in("c.json")) << json{{"mesh", {{"lattice", {{"element", "triangle"}, {"cells", 2}}}}},
                                      {"points", {{"tessellation", {{"subdivisions", 2}}}}},
                                      {"field", {{"radial_twist", {{"angle", 1}}}}},
                                      {"sequence", {{"frames", 3}, {"parameter", "angle"}}},
                                      {"interpolants", {"linear", "attribute_transfer"}},
                                      {"outputs", {"json", "sequence"}}};
  const Outcome outcome = run_program("run " + in("c.json") + " --out " + in("out"));
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  const auto truth = open_frames(in("out/sequence/truth.pvd")), linear = open_frames(in("out/sequence/linear.pvd"));
  EXPECT_EQ(truth->num_frames(), 3);
  EXPECT_EQ(linear->num_vertices(), truth->num_vertices());
  // What programs that are to be compared need.
  EXPECT_EQ(open_frames(in("out/sequence/rest_vertices.npy"))->num_vertices(), 9);
  EXPECT_EQ(open_frames(in("out/sequence/vertices.npy"))->num_frames(), 3);
  Values<double> first, second;
  truth->read(2, first);
  open_frames(in("out/sequence/truth.npy"))->read(2, second);
  EXPECT_LT((first.leftCols(2) - second).norm(), 1e-12);
  const json results = json::parse(content("out/results.json"));
  EXPECT_EQ(results["rows"].size(), 6u);
  EXPECT_EQ(results["rows"][1]["options"]["carry"], "displacement");
  // Equal steps of the angle: the error grows with it.
  EXPECT_LT(results["rows"][0]["error"]["all"]["rms"], results["rows"][4]["error"]["all"]["rms"]);
}

TEST_F(ReportProgram, DeformCarriesByTheBaselines) {
  const Mesh mesh = test::lattice<Tetrahedron>(3, 0.1, 3);
  Points points(2, 3);
  points << 0.4, 0.5, 0.6, 1.5, 0.5, 0.5;  // the second lies outside: vertices carry it all the same
  write_vtu(in("rest.vtu"), mesh);
  write_vtp(in("points.vtp"), points, IndexTable());
  const auto sink = create_frames(in("frames.npy"));
  Points moved = mesh.vertices();
  moved.col(1).array() += 2;
  sink->write(moved);
  sink->finish();
  const auto deform = [&](const std::string& options) {
    return run_program("deform --rest " + in("rest.vtu") + " --frames " + in("frames.npy") + " --points " +
                       in("points.vtp") + " --out " + in("out.npy") + " " + options);
  };
  for (const char* rule : {"attribute_transfer", "moving_least_squares",
                           R"('{"attribute_transfer": {"carry": "gradient", "radius": 2}}')"}) {
    const Outcome outcome = deform(std::string("--interpolant ") + rule + " --report " + in("report.json"));
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    Values<double> result;
    open_frames(in("out.npy"))->read(0, result);
    points.col(1).array() += 2;
    EXPECT_LT((result - points).norm(), 1e-12) << rule;
    points.col(1).array() -= 2;
    const json report = json::parse(content("report.json"));
    EXPECT_EQ(report["counts"]["frames"], 1);
    EXPECT_EQ(report["counts"]["points"], 2);
    EXPECT_GT(report["counts"]["weights"], 2);

    // A saved binding gives the same bytes, and refuses another rule.
    const std::string plain = content("out.npy");
    const Outcome bound = run_program("bind --rest " + in("rest.vtu") + " --points " + in("points.vtp") + " --out " +
                                      in("x.hgb") + " --interpolant " + rule);
    ASSERT_EQ(bound.status, 0) << bound.output;
    const std::string again = "deform --binding " + in("x.hgb") + " --frames " + in("frames.npy") + " --out ";
    ASSERT_EQ(run_program(again + in("bound.npy")).status, 0);
    EXPECT_EQ(content("bound.npy"), plain);
    EXPECT_EQ(run_program(again + in("bound.npy") + " --interpolant " + rule).status, 0);
    EXPECT_THAT(run_program(again + in("no.npy") + " --interpolant phong").output, HasSubstr("bind again"));
  }
  // Fields are weighted means, constants exact.
  write_npy(in("heat.npy"), Values<double>(Values<double>::Constant(mesh.num_vertices(), 1, 7)));
  ASSERT_EQ(deform("--interpolant moving_least_squares --field heat=" + in("heat.npy")).status, 0);
  Values<double> heat;
  open_npy_values(in("out.heat.npy"))->read(0, heat);
  EXPECT_LT((heat.array() - 7).abs().maxCoeff(), 1e-12);
  EXPECT_EQ(deform("--interpolant attribute_transfer --gradients").status, 2);
  EXPECT_THAT(deform("--interpolant attribute_transfer --tolerance 1").output, HasSubstr("--tolerance"));
  EXPECT_THAT(deform(R"(--interpolant '{"attribute_transfer": {"radus": 1}}')").output, HasSubstr("radius"));
  EXPECT_THAT(deform("--interpolant attribute_transfr").output, HasSubstr("no interpolant"));
}

}  // namespace
}  // namespace halfgrad
