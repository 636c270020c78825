// What goes wrong around the program: disks that are full, folders that cannot be written, frames that are missing or
// of another mesh. It says what and where, and leaves what is whole.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>

#include "apps/run_program.hpp"
#include "framework/error.hpp"
#include "framework/io/frame_sink.hpp"
#include "framework/io/frame_source.hpp"
#include "framework/io/vtk_output.hpp"
#include "support/file_test.hpp"
#include "support/test_meshes.hpp"

namespace halfgrad {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class Faults : public FileTest {
 protected:
  void SetUp() override {
    FileTest::SetUp();
    write_vtu(in("rest.vtu"), mesh);
    write_vtp(in("points.vtp"), test::random_points_inside(mesh, 200, 2));
  }

  Points frame(int number) const { return mesh.vertices() * (1 + 0.01 * number); }
  void write_frames(int count) const {
    const auto sink = create_frames(in("frames.npy"));
    for (int f = 0; f < count; ++f) sink->write(frame(f));
    sink->finish();
  }
  void write_frame_file(int number) const { write_vtp(in(fmt::format("sim_{:04}.vtp", number)), frame(number)); }
  std::string arguments(const std::string& frames, const std::string& out) const {
    return "deform --quiet --rest " + in("rest.vtu") + " --frames '" + in(frames) + "' --points " + in("points.vtp") +
           " --out " + in(out);
  }
  // With files of at most this many units of 512 bytes, as on a disk that has no more room; the signal that comes with
  // this limit and with no full disk is ignored.
  Outcome with_little_room(int units, const std::string& arguments) const {
    std::ofstream(in("limited.sh")) << "trap '' XFSZ\nulimit -f " << units << "\nexec " << HALFGRAD_PROGRAM << " "
                                    << arguments << "\n";
    return run_command("sh " + in("limited.sh"));
  }
  std::vector<std::string> outputs() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_))
      if (const std::string name = entry.path().filename().string(); name.find("out") != std::string::npos)
        names.push_back(name);
    std::sort(names.begin(), names.end());
    return names;
  }

  Mesh mesh = test::lattice<Tetrahedron>(3, 0.1, 1);
};

// 200 points are 4800 bytes a frame.
TEST_F(Faults, AFullDiskKeepsWholeFramesAndResumeEndsInTheSameBytes) {
  write_frames(20);
  ASSERT_EQ(run_program(arguments("frames.npy", "whole_out.npy")).status, 0);
  const std::string expected = content("whole_out.npy");
  std::filesystem::remove(in("whole_out.npy"));
  const Outcome full = with_little_room(100, arguments("frames.npy", "out.npy"));
  EXPECT_EQ(full.status, 2) << full.output;
  EXPECT_THAT(full.output, AllOf(HasSubstr("out.npy: cannot be written"), HasSubstr("10 of 20 frames are kept"),
                                 HasSubstr("--resume")));
  EXPECT_THAT(outputs(), ElementsAre(".out.npy.run", ".out.npy.unfinished"));
  const Outcome resumed = run_program(arguments("frames.npy", "out.npy") + " --resume");
  EXPECT_EQ(resumed.status, 0) << resumed.output;
  EXPECT_TRUE(content("out.npy") == expected);
  EXPECT_THAT(outputs(), ElementsAre("out.npy"));
}

TEST_F(Faults, AFullDiskLeavesNoHalfFileUnderAName) {
  write_frames(3);
  for (const std::string name : {"out.npy", "out.pc2", "out.%d.obj", "out.pvd"}) {
    SCOPED_TRACE(name);
    const Outcome full = with_little_room(4, arguments("frames.npy", name));
    EXPECT_EQ(full.status, 2) << full.output;
    EXPECT_THAT(full.output, HasSubstr("cannot be written"));
    for (const std::string& found : outputs()) EXPECT_EQ(found.front(), '.') << found;
    for (const std::string& found : outputs()) std::filesystem::remove(in(found));
  }
  const std::string bind = "bind --rest " + in("rest.vtu") + " --points " + in("points.vtp") + " --out ";
  EXPECT_THAT(with_little_room(4, bind + in("out.hgb")).output, HasSubstr("out.hgb: cannot be written"));
  EXPECT_THAT(outputs(), ElementsAre());
  EXPECT_THAT(with_little_room(
                  4, "export --rest " + in("rest.vtu") + " --points " + in("points.vtp") + " --out " + in("out.mtx"))
                  .output,
              HasSubstr("out.mtx: cannot be written"));
  EXPECT_THAT(outputs(), ElementsAre());
}

TEST_F(Faults, FoldersThatCannotBeWrittenAreNamed) {
  write_frames(2);
  const auto refused = [&](const std::string& out, const std::string& reason) {
    const Outcome outcome = run_program(arguments("frames.npy", out));
    EXPECT_EQ(outcome.status, 2);
    EXPECT_THAT(outcome.output, AllOf(HasSubstr(out.substr(out.find_last_of('/') + 1)), HasSubstr(reason)));
  };
  refused("absent/out.npy", "No such file");
  refused("rest.vtu/out.npy", "Not a directory");
  for (const char* name : {"out.npy", "out.%d.obj", "out.pvd"}) {
    std::filesystem::create_directory(in("locked"));
    std::filesystem::permissions(in("locked"), std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
    // The superuser may write everywhere.
    if (::geteuid() != 0) refused(std::string("locked/") + name, "Permission denied");
    std::filesystem::permissions(in("locked"), std::filesystem::perms::owner_all);
    std::filesystem::remove(in("locked"));
  }
  std::filesystem::create_directory(in("out.npy"));
  refused("out.npy", "found a folder");
}

TEST_F(Faults, FramesThatAreMissingShorterOrOfAnotherMeshAreNamed) {
  for (int f = 0; f < 6; ++f) write_frame_file(f);
  const auto run = [&](const std::string& frames) { return run_program(arguments(frames, "out.npy")); };
  const auto refused = [&](const std::string& frames, const auto& facts) {
    const Outcome outcome = run(frames);
    EXPECT_EQ(outcome.status, 2) << outcome.output;
    EXPECT_THAT(outcome.output, facts);
    EXPECT_FALSE(std::filesystem::exists(in("out.npy")));
  };
  ASSERT_EQ(run("sim_%04d.vtp").status, 0);
  std::filesystem::remove(in("out.npy"));

  std::filesystem::remove(in("sim_0003.vtp"));
  refused("sim_%04d.vtp", AllOf(HasSubstr("sim_0003.vtp is missing"), HasSubstr("between sim_0002.vtp")));
  // One that goes while the others are read: the collection names it.
  std::ofstream(in("sim.pvd")) << "<VTKFile type=\"Collection\"><Collection>"
                                  "<DataSet timestep=\"0\" file=\"sim_0002.vtp\"/>"
                                  "<DataSet timestep=\"1\" file=\"sim_0003.vtp\"/>"
                                  "<DataSet timestep=\"2\" file=\"sim_0004.vtp\"/></Collection></VTKFile>";
  refused("sim.pvd", AllOf(HasSubstr("sim_0003.vtp"), HasSubstr("No such file"), HasSubstr("1 of 3 frames")));

  write_vtp(in("sim_0003.vtp"), Points(frame(3).topRows(20)));
  refused("sim_%04d.vtp", AllOf(HasSubstr("sim_0003.vtp"), HasSubstr("frame 3"), HasSubstr("20 vertices"),
                                HasSubstr(fmt::format("expected {}", mesh.num_vertices()))));
  write_frame_file(3);
  const std::string whole = content("sim_0004.vtp");
  std::ofstream(in("sim_0004.vtp"), std::ios::binary) << whole.substr(0, whole.size() / 2);
  refused("sim_%04d.vtp", AllOf(HasSubstr("sim_0004.vtp"), HasSubstr("4 of 6 frames are kept")));

  write_frames(5);
  const std::string frames = content("frames.npy");
  std::ofstream(in("frames.npy"), std::ios::binary) << frames.substr(0, frames.size() - 100);
  refused("frames.npy", AllOf(HasSubstr("frames.npy"), HasSubstr("bytes follow")));
}

// Greatest resident memory of a run of the program, bytes.
std::int64_t peak_memory(const std::string& arguments) {
  const std::string command = std::string("exec ") + HALFGRAD_PROGRAM + " --threads 1 " + arguments;
  const pid_t child = ::fork();
  if (child == 0) {
    ::execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    ::_exit(127);
  }
  int status = 0;
  rusage usage{};
  ::wait4(child, &status, 0, &usage);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  return std::int64_t{1024} * usage.ru_maxrss;
}

TEST_F(Faults, MemoryDoesNotGrowWithTheNumberOfFrames) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers keep freed memory";
#endif
  mesh = test::lattice<Tetrahedron>(16, 0, 1);
  write_vtu(in("rest.vtu"), mesh);
  constexpr int few = 5, many = 200;
  // Hard links of one file are frames enough.
  write_frame_file(0);
  for (int f = 1; f < many; ++f)
    std::filesystem::create_hard_link(in("sim_0000.vtp"), in(fmt::format("sim_{:04}.vtp", f)));
  const std::string all = arguments("sim_%04d.vtp", "out.npy");
  const std::int64_t of_few = peak_memory(all + fmt::format(" --last {}", few - 1)), of_all = peak_memory(all);
  // Frames that were kept would take this much more; a tenth of it is what allocators may differ by.
  const std::int64_t kept = std::int64_t{many - few} * mesh.num_vertices() * 24;
  ASSERT_GT(kept, 20'000'000);
  EXPECT_LT(of_all - of_few, kept / 10) << of_few << " bytes with " << few << " frames";
}

}  // namespace
}  // namespace halfgrad
