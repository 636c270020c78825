// What info, bind and deform say of faults in their input, and what they refuse.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "apps/run_program.hpp"
#include "framework/error.hpp"
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

// A box of tetrahedra to which faults are added one by one.
class Diagnosis : public FileTest {
 protected:
  void SetUp() override {
    FileTest::SetUp();
    write_npy(in("points.npy"), Values<double>(points));
  }

  json json_of(const std::string& name) const { return json::parse(std::ifstream(in(name))); }
  void write_rest(const Points& vertices, const Eigen::MatrixXi& further_cells) const {
    auto block = std::get<ElementBlock<Tetrahedron>>(box.blocks()[0]);
    const Eigen::Index before = block.cells.rows();
    block.cells.conservativeResize(before + further_cells.rows(), 4);
    block.cells.bottomRows(further_cells.rows()) = further_cells;
    write_vtu(in("rest.vtu"), Mesh(vertices, {block}));
    const auto sink = create_frames(in("frames.npy"));
    sink->write(vertices);
    sink->finish();
  }
  // The box, and behind its vertices those of the argument.
  Points with_vertices(const Points& further) const {
    Points all(box.num_vertices() + further.rows(), 3);
    all << box.vertices(), further;
    return all;
  }
  Outcome deform(const std::string& options) const {
    return run_program("deform --rest " + in("rest.vtu") + " --frames " + in("frames.npy") + " --points " +
                       in("points.npy") + " --out " + in("out.npy") + " " + options);
  }

  Mesh box = test::lattice<Tetrahedron>(2, 0, 1);
  Points points = test::random_points_inside(box, 20, 2);
};

TEST_F(Diagnosis, InfoNamesWhatIsWrong) {
  const Index n = box.num_vertices(), c = box.num_cells();
  // One vertex at the place of vertex 0, one that no cell uses, three on a line from vertex 0 on.
  Points further(5, 3);
  further << box.vertices().row(0), 9, 9, 9, -1, -2, -3, -2, -4, -6, -3, -6, -9;
  const auto first = box.cell_vertices(0);
  Eigen::MatrixXi cells(4, 4);
  cells << first[2], first[0], first[1], first[3],  // a cell again, turned
      first[0], first[1], first[2], n + 2,          // a third cell at a facet, and negative or not
      n, n + 2, n + 3, n + 4,                       // without volume
      first[1], first[0], first[2], n + 3;
  write_rest(with_vertices(further), cells);
  const Outcome shown = run_program("info --json " + in("rest.vtu"));
  ASSERT_EQ(shown.status, 0) << shown.output;
  const json facts = json::parse(shown.output);
  EXPECT_EQ(facts["duplicate_vertices"], (json{{"count", 1}, {"first", {n}}}));
  EXPECT_EQ(facts["unused_vertices"], (json{{"count", 1}, {"first", {n + 1}}}));
  EXPECT_EQ(facts["duplicate_cells"], (json{{"count", 1}, {"first", {c}}}));
  EXPECT_EQ(facts["degenerate_cells"], (json{{"count", 1}, {"first", {c + 2}}}));
  // The facets of cell 0 are those of its twin; each but that at the boundary, if any, has a third cell.
  std::vector<Index> facet = {first[0], first[1], first[2]};
  std::sort(facet.begin(), facet.end());
  const json listed = facts["nonmanifold_facets"]["first"];
  EXPECT_NE(std::find(listed.begin(), listed.end(), json(facet)), listed.end()) << listed;
  EXPECT_EQ(facts["nonmanifold_facets"]["count"], listed.size());
  // One of the two cells across the facet from each other's apex is negative, not both.
  EXPECT_EQ(facts["inverted_cells"]["count"], 1);

  const Outcome words = run_program("info " + in("rest.vtu"));
  EXPECT_THAT(words.output, AllOf(HasSubstr("duplicate cells"), HasSubstr("nonmanifold facets"),
                                  HasSubstr(fmt::format("{}-{}-{}", facet[0], facet[1], facet[2]))));
  EXPECT_THAT(words.output, Not(HasSubstr("folded cells")));
}

TEST_F(Diagnosis, LimitsRefuseByName) {
  Points further(1, 3);
  further << box.vertices().row(3);
  write_rest(with_vertices(further), Eigen::MatrixXi(0, 4));
  EXPECT_EQ(run_program("info --limit duplicate_vertices=1 " + in("rest.vtu")).status, 0);
  const Outcome refused = run_program("info --limit duplicate_vertices=0 " + in("rest.vtu"));
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.output, AllOf(HasSubstr("rest.vtu: found 1 duplicate vertices"),
                                    HasSubstr(fmt::format("the first is {}", box.num_vertices())),
                                    HasSubstr("--limit duplicate_vertices=NUMBER")));
  EXPECT_EQ(deform("").status, 0);
  EXPECT_EQ(deform("--limit duplicate_vertices=0").status, 2);
  EXPECT_THAT(deform("--limit duplicat_vertices=0").output, HasSubstr("did you mean duplicate_vertices?"));
  EXPECT_THAT(deform("--limit unused_vertices=few").output, HasSubstr("expected a number"));
  EXPECT_THAT(deform("--limit unused_vertices=-1").output, HasSubstr("expected a number"));
}

TEST_F(Diagnosis, CellsWithoutVolumeAreRefusedUnlessALimitAcceptsThem) {
  const Index n = box.num_vertices();
  Points further(3, 3);
  further << 2, 0, 0, 3, 0, 0, 4, 0, 0;
  write_rest(with_vertices(further), (Eigen::MatrixXi(1, 4) << 0, n, n + 1, n + 2).finished());
  const Outcome refused = deform("");
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.output, AllOf(HasSubstr("1 degenerate cells"), HasSubstr("without volume"),
                                    HasSubstr(fmt::format("the first is {}", box.num_cells()))));
  // The flat cell holds no points: the map is that of the box, and at rest the identity.
  for (const char* reconstructor : {"adaptive", "kriging", "chandrashekar_garg"}) {
    const Outcome accepted = deform(std::string("--limit degenerate_cells=1 --reconstructor ") + reconstructor);
    ASSERT_EQ(accepted.status, 0) << accepted.output;
    Values<double> out;
    open_frames(in("out.npy"))->read(0, out);
    EXPECT_LT((out - points).cwiseAbs().maxCoeff(), 1e-13) << reconstructor;
  }
}

TEST_F(Diagnosis, ReportsTellTheRuleOfEveryVertexAndThePointsOutside) {
  write_rest(box.vertices(), Eigen::MatrixXi(0, 4));
  points(4, 0) = 1.25;
  points(9, 1) = -0.5;
  write_npy(in("points.npy"), Values<double>(points));
  const std::string bind = "bind --rest " + in("rest.vtu") + " --points " + in("points.npy") + " --out " + in("x.hgb") +
                           " --outside nearest --report " + in("report.json");
  const Outcome bound = run_program(bind);
  ASSERT_EQ(bound.status, 0) << bound.output;
  EXPECT_THAT(bound.output, AllOf(HasSubstr("outside points"), HasSubstr("4, 9")));
  const json report = json_of("report.json");
  EXPECT_EQ(report["outside"]["count"], 2);
  EXPECT_NEAR(report["outside"]["max_distance"].get<double>(), 0.5, 1e-12);
  EXPECT_EQ(report["outside"]["points"][0]["point"], 4);
  EXPECT_NEAR(report["outside"]["points"][0]["distance"].get<double>(), 0.25, 1e-12);
  EXPECT_EQ(report["mesh"]["inverted_cells"]["count"], 0);
  // Every vertex with a row is counted under one rule, and listed where the rule is not the usual one.
  std::int64_t total = 0, usual = 0, listed = 0;
  for (const auto& [rule, count] : report["vertex_rules"].items()) {
    total += count.get<std::int64_t>();
    if (rule == "average" || rule == "full_fit") usual += count.get<std::int64_t>();
  }
  for (const auto& [rule, vertices] : report["vertices_by_rule"].items()) {
    listed += static_cast<std::int64_t>(vertices.size());
    EXPECT_EQ(report["vertex_rules"][rule], vertices.size());
    for (const json& vertex : vertices) EXPECT_LT(vertex, box.num_vertices());
  }
  EXPECT_GT(total, 0);
  EXPECT_EQ(usual + listed, total);

  // The same of deform, from the mesh and from the binding.
  for (const std::string& input : {"--rest " + in("rest.vtu") + " --points " + in("points.npy") + " --outside nearest",
                                   "--binding " + in("x.hgb")}) {
    const Outcome deformed = run_program("deform " + input + " --frames " + in("frames.npy") + " --out " +
                                         in("out.npy") + " --report " + in("deform.json"));
    ASSERT_EQ(deformed.status, 0) << deformed.output;
    for (const char* key : {"mesh", "vertex_rules", "vertices_by_rule", "outside"})
      EXPECT_EQ(json_of("deform.json")[key], report[key]) << key;
  }
  EXPECT_THAT(run_program(bind + " --limit outside_distance=0.3").output,
              AllOf(HasSubstr("points.npy: found 0.5 outside distance"), HasSubstr("the first is 9")));
  EXPECT_THAT(run_program(bind + " --limit outside_points=1").output, HasSubstr("found 2 outside points"));
}

// A single cell determines no quadratic: its vertices fall back, and a limit refuses that.
TEST_F(Diagnosis, AFallbackIsToldAndCanBeRefused) {
  box = Mesh(Tetrahedron::nodes(),
             {ElementBlock<Tetrahedron>{(decltype(ElementBlock<Tetrahedron>::cells)(1, 4) << 0, 1, 2, 3).finished()}});
  write_rest(box.vertices(), Eigen::MatrixXi(0, 4));
  write_npy(in("points.npy"), Values<double>(Values<double>::Constant(1, 3, 0.2)));
  ASSERT_EQ(deform("--reconstructor kriging --report " + in("r.json")).status, 0);
  const json report = json_of("r.json");
  std::int64_t fallen = 0;
  for (const char* rule : {"damped", "cell_value"})
    if (report["vertices_by_rule"].contains(rule))
      fallen += static_cast<std::int64_t>(report["vertices_by_rule"][rule].size());
  EXPECT_EQ(fallen, 4) << report["vertex_rules"];
  EXPECT_EQ(deform("--reconstructor kriging --limit damped_vertices=0 --limit cell_value_vertices=0").status, 2);
}

}  // namespace
}  // namespace halfgrad
