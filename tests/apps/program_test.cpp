// The program as a user meets it: exit status, messages, files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <array>
#include <csignal>
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
#include "support/shared_data.hpp"
#include "support/test_meshes.hpp"

namespace halfgrad {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// A jittered box of tetrahedra, a small surface inside it, and three frames: rest, a rotation, a quadratic map.
class Program : public FileTest {
 protected:
  void SetUp() override {
    FileTest::SetUp();
    write_vtu(folder_ / "rest.vtu", mesh);
    surface.points.resize(4, 3);
    surface.points << 0.3, 0.3, 0.4, 0.7, 0.3, 0.4, 0.7, 0.7, 0.4, 0.3, 0.7, 0.5;
    surface.faces.offsets = {0, 3, 6};
    surface.faces.entries = {0, 1, 2, 0, 2, 3};
    write_vtp(folder_ / "points.vtp", surface.points, surface.faces);
    write_frames({mesh.vertices(), rotated(mesh.vertices()), bent(mesh.vertices())});
  }

  static Points rotated(const Points& points) {
    const Eigen::Matrix3d rotation = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
    return points * rotation.transpose();
  }
  static Points bent(const Points& points) {
    Points result = points;
    result.col(2) += 0.3 * points.col(0).cwiseAbs2() - 0.2 * points.col(0).cwiseProduct(points.col(1));
    return result;
  }
  void write_frames(const std::vector<Points>& frames) const {
    const auto sink = create_frames(folder_ / "frames.npy");
    for (const Points& frame : frames) sink->write(frame);
    sink->finish();
  }
  Outcome deform(const std::string& options, const std::string& out = "out.npy") const {
    return run_program("deform --rest " + in("rest.vtu") + " --frames " + in("frames.npy") + " --points " +
                       in("points.vtp") + " --out " + in(out) + " " + options);
  }
  Values<double> frame(const std::string& name, Index number) const {
    Values<double> values;
    open_frames(in(name))->read(number, values);
    return values;
  }
  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_))
      names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }

  Mesh mesh = test::lattice<Tetrahedron>(4, 0.2, 3);
  PointSet surface;
};

TEST_F(Program, TellsANewUserWhatItDoes) {
  const Outcome bare = run_program("");
  EXPECT_EQ(bare.status, 0);
  EXPECT_THAT(bare.output,
              AllOf(HasSubstr("halfgrad deform"), HasSubstr("halfgrad export"), HasSubstr("halfgrad run")));
  EXPECT_EQ(run_program("--help").status, 0);
  for (const char* command : {"run", "deform", "check", "export", "list", "info", "describe"}) {
    const Outcome help = run_program(std::string(command) + " --help");
    EXPECT_EQ(help.status, 0);
    EXPECT_THAT(help.output, HasSubstr("Example: halfgrad ")) << command;
  }
  EXPECT_THAT(run_program("--version").output, HasSubstr("halfgrad "));
}

TEST_F(Program, UsageErrorsExitWith2) {
  EXPECT_EQ(run_program("dance").status, 2);
  EXPECT_EQ(run_program("deform").status, 2);
  EXPECT_EQ(run_program("info").status, 2);
  EXPECT_EQ(run_program("list shoes").status, 2);
  EXPECT_EQ(run_program("--threads 0 list").status, 2);
}

TEST_F(Program, UsageErrorsSayWhatToTypeNext) {
  EXPECT_THAT(run_program("dfeorm").output, AllOf(HasSubstr("did you mean deform?"), HasSubstr("halfgrad --help")));
  EXPECT_THAT(run_program("dance").output,
              AllOf(HasSubstr("dance"), HasSubstr("deform, bind, report, stress, export")));
  EXPECT_THAT(deform("--intepolant linear").output,
              AllOf(HasSubstr("did you mean --interpolant?"), HasSubstr("halfgrad deform --help")));
  EXPECT_THAT(run_program("--outside nearest").output,
              AllOf(HasSubstr("halfgrad deform, halfgrad bind"), HasSubstr("halfgrad --help")));
  EXPECT_THAT(run_program(in("rest.vtu")).output, HasSubstr("halfgrad info " + in("rest.vtu")));
  EXPECT_THAT(run_program("info " + in("rset.vtu")).output, HasSubstr("did you mean " + in("rest.vtu")));
  EXPECT_THAT(deform("", "none/out.%d.obj").output, AllOf(HasSubstr("out.%d.obj"), HasSubstr("make the folder")));
  write_npy(in("points.npy"), Values<double>(surface.points));
  EXPECT_THAT(run_program("deform --rest " + in("rest.vtu") + " --frames " + in("points.npy") + " --points " +
                          in("points.vtp") + " --out " + in("out.npy"))
                  .output,
              HasSubstr("--points exchanged?"));
  EXPECT_THAT(run_program("deform --rest").output, AllOf(HasSubstr("--rest"), HasSubstr("halfgrad deform --help")));
}

TEST_F(Program, DescribesEveryCommandForShellsAndManuals) {
  for (const char* format : {"bash", "zsh", "fish", "man", "markdown"}) {
    const Outcome described = run_program(std::string("describe ") + format);
    EXPECT_EQ(described.status, 0);
    for (const char* word : {"deform", "export", "interpolant", "threads"})
      EXPECT_THAT(described.output, HasSubstr(word)) << format;
  }
  EXPECT_THAT(run_program("describe docx").output, HasSubstr("markdown"));
}

TEST_F(Program, ListsWhatTheRegistriesHold) {
  const Outcome listed = run_program("list --json");
  EXPECT_EQ(listed.status, 0);
  const json all = json::parse(listed.output);
  EXPECT_EQ(all["elements"].size(), Elements::size);
  for (const char* group : {"elements", "reconstructors", "interpolants", "fields"}) {
    EXPECT_GT(all[group].size(), 3u);
    EXPECT_EQ(json::parse(run_program(std::string("list --json ") + group).output)[group], all[group]);
  }
}

TEST_F(Program, InfoCountsTheMesh) {
  const Outcome shown = run_program("info --json " + in("rest.vtu"));
  ASSERT_EQ(shown.status, 0) << shown.output;
  const json facts = json::parse(shown.output);
  EXPECT_EQ(facts["vertices"], 125);
  EXPECT_EQ(facts["cells"], 384);
  EXPECT_NEAR(facts["volume"].get<double>(), 1, 1e-12);
  EXPECT_EQ(facts["boundary_facets"], 6 * 16 * 2);
  EXPECT_EQ(facts["degenerate_cells"]["count"], 0);
}

TEST_F(Program, DeformFollowsRigidMotionsExactlyAndQuadraticsToTheOrderOfItsGradients) {
  for (const char* interpolant : {"linear", "phong", "vertex_blend", "hermite"}) {
    const Outcome outcome = deform(std::string("--interpolant ") + interpolant);
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    EXPECT_LT((frame("out.npy", 0) - surface.points).norm(), 1e-14) << interpolant;
    EXPECT_LT((frame("out.npy", 1) - rotated(surface.points)).norm(), 1e-14) << interpolant;
    EXPECT_LT((frame("out.npy", 2) - bent(surface.points)).norm(), 0.05) << interpolant;
  }
  // kriging is exact for quadratics, and so is phong then.
  ASSERT_EQ(deform("--reconstructor kriging").status, 0);
  EXPECT_LT((frame("out.npy", 2) - bent(surface.points)).norm(), 1e-12);
  ASSERT_EQ(deform("--interpolant linear").status, 0);
  EXPECT_GT((frame("out.npy", 2) - bent(surface.points)).norm(), 1e-4);
  ASSERT_EQ(deform("--interpolant dual_taylor").status, 0);
  EXPECT_LT((frame("out.npy", 2) - bent(surface.points)).norm(), 1e-11);
}

TEST_F(Program, AlphaBlends) {
  const auto result = [&](const std::string& options) {
    EXPECT_EQ(deform(options).status, 0);
    return frame("out.npy", 2);
  };
  const Values<double> linear = result("--interpolant linear"), blend = result("--alpha 1");
  EXPECT_LT((result("--alpha 0.25") - (0.75 * linear + 0.25 * blend)).norm(), 1e-14);
  EXPECT_TRUE(result("--interpolant phong") == result("--alpha 0.5"));
  EXPECT_THAT(deform("--interpolant phong --alpha 0.3").output, HasSubstr("only vertex_blend takes it"));
}

TEST_F(Program, FramesCanBeChosen) {
  ASSERT_EQ(deform("--first 1 --last 2").status, 0);
  const auto chosen = open_frames(in("out.npy"));
  EXPECT_EQ(chosen->num_frames(), 2);
  EXPECT_LT((frame("out.npy", 0) - rotated(surface.points)).norm(), 1e-14);
  ASSERT_EQ(deform("--step 2", "every_other.npy").status, 0);
  EXPECT_EQ(open_frames(in("every_other.npy"))->num_frames(), 2);
  EXPECT_THAT(deform("--first 3").output, HasSubstr("has frames 0 to 2"));
}

TEST_F(Program, PrecisionsAndFormatsAgree) {
  ASSERT_EQ(deform("--precision double").status, 0);
  const Values<double> exact = frame("out.npy", 2);
  ASSERT_EQ(deform("--precision float", "out32.npy").status, 0);
  EXPECT_LT((frame("out32.npy", 2) - exact).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT(std::filesystem::file_size(in("out32.npy")), std::filesystem::file_size(in("out.npy")));
  for (const char* name : {"out.pc2", "out.pvd", "out.%04d.obj"}) {
    ASSERT_EQ(deform("", name).status, 0) << name;
    EXPECT_EQ(open_frames(in(name))->num_frames(), 3) << name;
    EXPECT_LT((frame(name, 2) - exact).cwiseAbs().maxCoeff(), 1e-6) << name;
  }
}

TEST_F(Program, NormalsTurnWithTheSurface) {
  ASSERT_EQ(deform("--normals --gradients").status, 0);
  const Values<double> before = frame("out.normals.npy", 0);
  EXPECT_LT((before.rowwise().norm().array() - 1).abs().maxCoeff(), 1e-14);
  EXPECT_LT((frame("out.normals.npy", 1) - rotated(before)).norm(), 1e-13);
  // The first frame is the rest state: F = I. Frames of nine columns are no positions, so the numbers are read plainly.
  constexpr std::size_t num_numbers = 3 * 4 * 9;
  const std::filesystem::path path = folder_ / "out.gradients.npy";
  ASSERT_GT(std::filesystem::file_size(path), num_numbers * sizeof(double));
  std::ifstream file(path, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(std::filesystem::file_size(path) - num_numbers * sizeof(double)));
  std::array<double, 4 * 9> gradients;
  file.read(reinterpret_cast<char*>(gradients.data()), sizeof gradients);
  for (int p = 0; p < 4; ++p)
    EXPECT_LT((Eigen::Map<const Eigen::Matrix3d>(gradients.data() + 9 * p) - Eigen::Matrix3d::Identity()).norm(),
              1e-12);
  ASSERT_EQ(deform("--normals", "with.pvd").status, 0);
  EXPECT_FALSE(std::filesystem::exists(in("with.normals.npy")));
}

TEST_F(Program, TangentsComeFromTheTextureAndTurnWithTheSurface) {
  // Texture coordinates of an OBJ by corner: u along x, v along y.
  std::ofstream(in("points.obj"))
      << "v 0.3 0.3 0.4\nv 0.7 0.3 0.4\nv 0.7 0.7 0.4\nv 0.3 0.7 0.5\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
         "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
  const auto carry = [&](const std::string& points, const std::string& options, const std::string& out) {
    return run_program("deform --rest " + in("rest.vtu") + " --frames " + in("frames.npy") + " --points " + in(points) +
                       " --out " + in(out) + " --tangents " + options);
  };
  const auto tangents_of = [&](const std::string& name, Index number) {
    Values<double> values;
    open_npy_values(in(name))->read(number, values);
    return values;
  };
  for (const char* options : {"", "--normals smooth", "--precision float"}) {
    SCOPED_TRACE(options);
    const Outcome outcome = carry("points.obj", options, "out.npy");
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    const Values<double> rest = tangents_of("out.tangents.npy", 0), turned = tangents_of("out.tangents.npy", 1);
    ASSERT_EQ(rest.cols(), 4);
    EXPECT_LT((turned.leftCols(3) - rotated(rest.leftCols(3))).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_EQ(rest.col(3), Eigen::Vector4d::Ones());
    for (Index f = 0; f < 3; ++f) {
      const Values<double> t = tangents_of("out.tangents.npy", f), n = tangents_of("out.normals.npy", f);
      for (int p = 0; p < 4; ++p) {
        EXPECT_NEAR(t.row(p).head<3>().norm(), 1, 1e-6);
        EXPECT_NEAR(t.row(p).head<3>().dot(n.row(p)), 0, 1e-6);
      }
    }
    EXPECT_GT(rest.col(0).minCoeff(), 0.9);  // u grows along x
  }
  // Of a VTK file, its own tangents come first, and the array that was read is not left beside the carried one.
  Values<double> uv(4, 2), own(4, 4);
  uv << 0, 0, 1, 0, 1, 1, 0, 1;
  own << Eigen::RowVector4d(0, 1, 0, -1).replicate(4, 1);
  write_vtp(folder_ / "both.vtp", surface.points, surface.faces,
            std::vector{PointArray{"uv", uv}, PointArray{"Tangents", own}});
  ASSERT_EQ(carry("both.vtp", "", "out.pvd").status, 0);
  const PointSet result = read_points(in("out_0000.vtp"));
  EXPECT_EQ(find_array(result.arrays, "Tangents"), nullptr);
  ASSERT_NE(find_array(result.arrays, "tangents"), nullptr);
  EXPECT_EQ(find_array(result.arrays, "tangents")->values.col(3), Eigen::Vector4d::Constant(-1));
  EXPECT_GT(find_array(result.arrays, "tangents")->values.col(1).minCoeff(), 0.9);
  ASSERT_NE(find_array(result.arrays, "uv"), nullptr);
  EXPECT_THAT(carry("points.vtp", "", "none.npy").output, AllOf(HasSubstr("texture coordinates"), HasSubstr("vt")));
}

TEST_F(Program, ReportCountsAndTimes) {
  ASSERT_EQ(deform("--report " + in("report.json")).status, 0);
  const json report = json::parse(std::ifstream(in("report.json")));
  EXPECT_EQ(report["counts"]["frames"], 3);
  EXPECT_EQ(report["counts"]["points"], 4);
  EXPECT_EQ(report["counts"]["cells"], 384);
  EXPECT_LE(report["counts"]["active_cells"], 4);
  EXPECT_EQ(report["skipped"]["cells"].get<int>(), 384 - report["counts"]["active_cells"].get<int>());
  EXPECT_EQ(report["outside"]["count"], 0);
  for (const char* stage : {"read", "locate", "reconstruct", "bind", "evaluate", "write"})
    EXPECT_GE(report["seconds"][stage].get<double>(), 0) << stage;
  EXPECT_EQ(report["reconstructor"], "adaptive");
}

TEST_F(Program, TranslatedFramesGiveTranslatedPoints) {
  // The weights never see deformed positions. 2⁻¹⁰ multiples make the translation itself exact.
  Points quantised = bent(mesh.vertices());
  quantised = (quantised * 1024).array().round() / 1024;
  write_frames({quantised, Points(quantised.array() + 4)});
  ASSERT_EQ(deform("").status, 0);
  EXPECT_LT((frame("out.npy", 1) - (frame("out.npy", 0).array() + 4).matrix()).cwiseAbs().maxCoeff(), 2e-15);
}

TEST_F(Program, AMeshFarFromTheOriginGivesTheSameAnswer) {
  ASSERT_EQ(deform("").status, 0);
  const Values<double> near = frame("out.npy", 2);
  constexpr double offset = 1e8;
  const auto moved = [&](const Points& points) { return Points(points.array() + offset); };
  write_vtu(folder_ / "rest.vtu", Mesh(moved(mesh.vertices()), mesh.blocks()));
  write_vtp(folder_ / "points.vtp", moved(surface.points), surface.faces);
  write_frames({moved(mesh.vertices()), moved(rotated(mesh.vertices())), moved(bent(mesh.vertices()))});
  const Outcome outcome = deform("");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_LT((frame("out.npy", 2).array() - offset - near.array()).abs().maxCoeff(), 1e-7);
}

TEST_F(Program, PointsOutsideFollowThePolicy) {
  surface.points(2, 0) = 1.5;
  write_vtp(folder_ / "points.vtp", surface.points, surface.faces);
  const Outcome refused = deform("");
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.output, AllOf(HasSubstr("1 of 4 points"), HasSubstr("nearest"), HasSubstr("mark")));
  EXPECT_FALSE(std::filesystem::exists(in("out.npy")));

  ASSERT_EQ(deform("--outside nearest --report " + in("report.json")).status, 0);
  EXPECT_LT((frame("out.npy", 1) - rotated(surface.points)).norm(), 1e-13);
  const json report = json::parse(std::ifstream(in("report.json")));
  EXPECT_EQ(report["outside"]["count"], 1);
  EXPECT_NEAR(report["outside"]["max_distance"].get<double>(), 0.5, 1e-12);
  EXPECT_EQ(report["outside"]["points"][0]["point"], 2);

  ASSERT_EQ(deform("--outside mark").status, 0);
  // The reader refuses NaN on purpose; the raw array shows the mark.
  EXPECT_THAT(run_program("info " + in("out.npy")).status, 2);
  EXPECT_THROW(frame("out.npy", 1), Error);
}

TEST_F(Program, BadInputIsRefusedByNameAndLeavesNothingBehind) {
  const std::vector<std::string> before = files();
  const auto refused = [&](const Outcome& outcome, const std::string& fact) {
    EXPECT_EQ(outcome.status, 2) << outcome.output;
    EXPECT_THAT(outcome.output, HasSubstr(fact));
    EXPECT_EQ(files(), before);
  };
  refused(deform("--reconstructor krigging"), "did you mean \"kriging\"");
  refused(deform("--reconstructor '{\"chandrashekar_garg\": {\"epsilom\": 1}}'"), "did you mean \"epsilon\"");
  refused(deform("--reconstructor '{\"knn\": '"), "--reconstructor");
  refused(deform("--interpolant phnog"), "did you mean \"phong\"");
  refused(deform("--interpolant dual_taylor --reconstructor adaptive"), "Hessians");
  refused(deform("--outside maybe"), "expected error, nearest or mark");
  refused(deform("--precision half"), "expected float or double");
  refused(deform("--tolerance -1"), "--tolerance");
  refused(deform("", "out.docx"), ".docx");
  refused(deform("", "missing/out.npy"), "missing");
  refused(deform("", "rest.vtu"), "also an input");
  refused(run_program("deform --rest " + in("absent.msh") + " --frames a --points b --out " + in("o.npy")),
          "absent.msh");

  const auto overwrite = [&](const std::string& name, const std::string& bytes) {
    std::ofstream(in(name), std::ios::binary) << bytes;
  };
  const std::string rest = content("rest.vtu");
  overwrite("rest.vtu", rest.substr(0, rest.size() / 2));
  refused(deform(""), "rest.vtu");
  overwrite("rest.vtu", rest);

  write_frames({Points(mesh.vertices().topRows(100))});
  refused(deform(""), "frames of 100 vertices");
  Points broken = mesh.vertices();
  broken(7, 1) = std::numeric_limits<double>::quiet_NaN();
  write_frames({broken, mesh.vertices()});
  refused(deform(""), "vertex 7");
}

TEST_F(Program, FramesBeforeABadOneAreKeptAndResumed) {
  const std::string frames = " --rest " + in("rest.vtu") + " --points " + in("points.vtp") + " --frames '" +
                             in("sim_*.vtp") + "' --normals --stretch --out " + in("out.npy");
  std::vector<Points> positions;
  for (int f = 0; f < 5; ++f) {
    positions.push_back(mesh.vertices() + f / 4.0 * (bent(mesh.vertices()) - mesh.vertices()));
    write_vtp(in(fmt::format("sim_{}.vtp", f)), positions[static_cast<std::size_t>(f)]);
  }
  ASSERT_EQ(run_program("deform" + frames).status, 0);
  const auto contents = [&] {
    std::string all;
    for (const char* name : {"out.npy", "out.normals.npy", "out.stretch.npy"}) {
      std::ifstream file(in(name), std::ios::binary);
      all.append(std::istreambuf_iterator<char>(file), {});
      std::filesystem::remove(in(name));
    }
    return all;
  };
  const std::string expected = contents();

  Points broken = positions[3];
  broken(7, 1) = std::numeric_limits<double>::quiet_NaN();
  write_vtp(in("sim_3.vtp"), broken);
  const Outcome failed = run_program("deform" + frames);
  EXPECT_EQ(failed.status, 2);
  EXPECT_THAT(failed.output, AllOf(HasSubstr("sim_3.vtp"), HasSubstr("3 of 5 frames"), HasSubstr("--resume")));
  EXPECT_FALSE(std::filesystem::exists(in("out.npy")));
  write_vtp(in("sim_3.vtp"), positions[3]);
  const Outcome resumed = run_program("deform --resume" + frames);
  EXPECT_EQ(resumed.status, 0) << resumed.output;
  EXPECT_THAT(resumed.output, HasSubstr("3 frames before them were there already"));
  EXPECT_EQ(contents(), expected);
  for (const std::string& name : files()) EXPECT_NE(name.front(), '.') << name;

  // A frame that changed after the interrupted run began is carried again, and so are those behind it.
  write_vtp(in("sim_3.vtp"), broken);
  EXPECT_EQ(run_program("deform" + frames).status, 2);
  write_vtp(in("sim_1.vtp"), positions[2]);
  write_vtp(in("sim_3.vtp"), positions[3]);
  EXPECT_THAT(run_program("deform --resume" + frames).output, HasSubstr("1 frames before them"));
  // Other options make another run.
  write_vtp(in("sim_3.vtp"), broken);
  EXPECT_EQ(run_program("deform" + frames).status, 2);
  write_vtp(in("sim_3.vtp"), positions[3]);
  EXPECT_THAT(run_program("deform --resume --interpolant hermite" + frames).output,
              AllOf(HasSubstr("5 frames"), Not(HasSubstr("there already"))));
}

TEST_F(Program, AKilledRunGoesOnToTheSameBytes) {
  write_frames(std::vector<Points>(3000, bent(mesh.vertices())));
  ASSERT_EQ(deform("", "whole.npy").status, 0);
  const std::string expected = content("whole.npy");
  const std::string command = " deform --rest " + in("rest.vtu") + " --frames " + in("frames.npy") + " --points " +
                              in("points.vtp") + " --out " + in("out.npy");
  for (const int signal : {SIGINT, SIGKILL}) {
    SCOPED_TRACE(signal);
    // Where the program ends before the signal comes, once more.
    for (int tries = 0; tries < 20 && !std::filesystem::exists(in(".out.npy.run")); ++tries) {
      std::filesystem::remove(in("out.npy"));
      const pid_t program = fork();
      if (program == 0) {
        execl("/bin/sh", "sh", "-c", ("exec " HALFGRAD_PROGRAM + command + " > /dev/null 2>&1").c_str(), nullptr);
        _exit(127);
      }
      pid_t ended = 0;
      while (!std::filesystem::exists(in(".out.npy.run")) && ended == 0) {
        usleep(200);
        ended = waitpid(program, nullptr, WNOHANG);
      }
      if (ended != 0) continue;
      kill(program, signal);
      waitpid(program, nullptr, 0);
    }
    ASSERT_FALSE(std::filesystem::exists(in("out.npy"))) << "the program was never met while it wrote";
    EXPECT_EQ(deform("--resume").status, 0);
    EXPECT_EQ(content("out.npy"), expected);
    std::filesystem::remove(in("out.npy"));
  }
}

TEST_F(Program, ASavedBindingGivesTheSameBytes) {
  for (const char* options : {"", "--interpolant dual_taylor", "--interpolant linear", "--outside nearest"}) {
    SCOPED_TRACE(options);
    ASSERT_EQ(deform(options).status, 0);
    const Outcome bound = run_program("bind --rest " + in("rest.vtu") + " --points " + in("points.vtp") + " --out " +
                                      in("x.hgb") + " " + options);
    ASSERT_EQ(bound.status, 0) << bound.output;
    const std::string command = "deform --binding " + in("x.hgb") + " --frames " + in("frames.npy") + " --out ";
    const Outcome deformed = run_program(command + in("bound.npy"));
    ASSERT_EQ(deformed.status, 0) << deformed.output;
    for (Index f = 0; f < 3; ++f) EXPECT_EQ(frame("bound.npy", f), frame("out.npy", f));
  }
  const std::string command = "deform --binding " + in("x.hgb") + " --frames " + in("frames.npy") + " --out ";
  const auto refused = [&](const std::string& more, const std::string& fact) {
    const Outcome outcome = run_program(command + in("no.npy") + more);
    EXPECT_EQ(outcome.status, 2);
    EXPECT_THAT(outcome.output, AllOf(HasSubstr(fact), HasSubstr("x.hgb"))) << more;
  };
  refused(" --interpolant hermite", "bind again");
  refused(" --reconstructor kriging", "bind again");
  refused(" --outside mark", "bind again");
  surface.points(0, 0) += 0.01;
  write_vtp(folder_ / "points.vtp", surface.points, surface.faces);
  refused("", "other points");
  surface.points(0, 0) -= 0.01;
  write_vtp(folder_ / "points.vtp", surface.points, surface.faces);
  write_vtu(folder_ / "rest.vtu", test::lattice<Tetrahedron>(4, 0.2, 4));
  refused("", "another rest mesh");
  std::filesystem::resize_file(in("x.hgb"), std::filesystem::file_size(in("x.hgb")) / 2);
  refused("", "no binding");
  std::ofstream(in("x.hgb")) << "v 1 2 3\n";
  refused("", "no binding");
}

TEST_F(Program, FieldsAndSmoothNormalsAreCarried) {
  // A linear field is carried exactly whatever the deformation; a surface's own data goes through.
  Values<double> field(mesh.num_vertices(), 2);
  field.col(0) = mesh.vertices().col(0) * 3 - mesh.vertices().col(1);
  field.col(1).setConstant(7);
  write_npy(in("stress.npy"), field);
  write_vtu(folder_ / "rest.vtu", mesh, std::vector{PointArray{"heat", field}});
  Values<double> uv(4, 2);
  uv << 0, 0, 1, 0, 1, 1, 0, 1;
  write_vtp(folder_ / "points.vtp", surface.points, surface.faces, std::vector{PointArray{"uv", uv}});
  const Outcome outcome =
      deform("--field heat --field stress=" + in("stress.npy") + " --normals smooth --stretch", "out.pvd");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  Values<double> expected(4, 2);
  expected.col(0) = surface.points.col(0) * 3 - surface.points.col(1);
  expected.col(1).setConstant(7);
  for (int f = 0; f < 3; ++f) {
    const PointSet result = read_points(in(fmt::format("out_{:04}.vtp", f)));
    const auto array = [&](const char* name) {
      const PointArray* found = find_array(result.arrays, name);
      return found == nullptr ? Values<double>() : found->values;
    };
    EXPECT_EQ(array("uv"), uv);
    for (const char* name : {"heat", "stress"}) {
      ASSERT_EQ(array(name).rows(), 4) << name;
      EXPECT_LT((array(name) - expected).cwiseAbs().maxCoeff(), 1e-12);
    }
    ASSERT_EQ(array("normals").rows(), 4);
    EXPECT_LT((array("normals").rowwise().norm().array() - 1).abs().maxCoeff(), 1e-14);
    if (f < 2) {
      EXPECT_LT((array("stretch").array() - 1).abs().maxCoeff(), 1e-12);
    }
  }
  EXPECT_THAT(deform("--field pressure").output, AllOf(HasSubstr("pressure"), HasSubstr("heat")));
  EXPECT_THAT(deform("--normals fancy").output, HasSubstr("expected gradient or smooth"));
}

TEST_F(Program, RunExitsWith3WhereAnExpectationFails) {
  json config = {{"name", "small"},
                 {"mesh", {{"lattice", {{"element", "triangle"}, {"cells", 4}}}, {"refinements", 2}}},
                 {"points", {{"random", {{"count", 200}}}}},
                 {"field", {{"waves", json::object()}}},
                 {"interpolants", {"linear"}},
                 {"expect", {{{"interpolant", "linear"}, {"order_at_least", 1.5}}}},
                 {"outputs", {"json"}}};
  const auto write = [&] { std::ofstream(in("config.json")) << config.dump(); };
  write();
  const std::string command = "run " + in("config.json") + " --out " + in("results");
  const Outcome good = run_program(command);
  ASSERT_EQ(good.status, 0) << good.output;
  EXPECT_TRUE(std::filesystem::exists(folder_ / "results" / "results.json"));
  EXPECT_EQ(run_program("check " + in("config.json")).status, 0);

  const Outcome failed = run_program(command + " --set /expect/0/order_at_least=2.9");
  EXPECT_EQ(failed.status, 3) << failed.output;

  config["mesh"]["lattice"]["jiter"] = 0.1;
  write();
  for (const std::string& verb : {command, "check " + in("config.json")}) {
    const Outcome misspelt = run_program(verb);
    EXPECT_EQ(misspelt.status, 2);
    EXPECT_THAT(misspelt.output, AllOf(HasSubstr("/mesh/lattice/jiter"), HasSubstr("jitter")));
  }
}

// Independent figures for the paper's weights (ε = 1) on nonlinear FEM data, rms over the last frame.
struct FemSet {
  const char* set;
  const char* mesh;
  double linear_rms;  // 0 where no independent figure exists
  double gain;
};

TEST(ProgramOnFemData, PhongGainsOverLinearWhatOthersMeasured) {
  const std::array sets = {
      FemSet{"cylinder_stretch", "tet_L0", 0, 1.39},     FemSet{"cylinder_stretch", "tet_L1", 0, 1.51},
      FemSet{"cylinder_twist", "tet_L0", 0.01111, 3.21}, FemSet{"cylinder_twist", "tet_L1", 0.006517, 3.18},
      FemSet{"bunny_shake", "tet_L0", 0.002481, 1.56},   FemSet{"bunny_shake", "tet_L1", 0.0008788, 2.02},
      FemSet{"hexbar_twist", "tet_L0", 0.01421, 3.28},   FemSet{"sheet_swirl", "tri_L0", 0.006084, 1.30},
      FemSet{"sheet_swirl", "tri_L1", 0.001903, 1.93}};
  const std::filesystem::path out =
      std::filesystem::temp_directory_path() / ("halfgrad_fem_" + std::to_string(getpid()) + ".npy");
  for (const FemSet& fem : sets) {
    const std::string folder = std::string("data/") + fem.set;
    const auto surface = shared_path(folder + "/surface.obj");
    if (!surface) GTEST_SKIP() << "needs the FEM sequences of HALFGRAD_SHARED";
    const std::filesystem::path directory = surface->parent_path();
    const auto error = [&](const std::string& interpolant) {
      const std::string stem = (directory / fem.mesh).string();
      const Outcome outcome =
          run_program("deform --rest " + stem + ".msh --frames " + stem + "_sampled.npy --points " + surface->string() +
                      " --out " + out.string() + " --reconstructor chandrashekar_garg --interpolant " + interpolant);
      EXPECT_EQ(outcome.status, 0) << outcome.output;
      const auto truth = open_frames((directory / "surface_truth.npy").string());
      const auto result = open_frames(out.string());
      Values<double> expected, measured;
      truth->read(truth->num_frames() - 1, expected);
      result->read(result->num_frames() - 1, measured);
      return std::sqrt((measured - expected).rowwise().squaredNorm().mean());
    };
    const double linear = error("linear"), phong = error("phong");
    if (fem.linear_rms > 0) {
      EXPECT_NEAR(linear / fem.linear_rms, 1, 1e-3) << fem.set << " " << fem.mesh;
    }
    EXPECT_NEAR(linear / phong / fem.gain, 1, 0.02) << fem.set << " " << fem.mesh;
  }
  std::filesystem::remove(out);
}

}  // namespace
}  // namespace halfgrad
