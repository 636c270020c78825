// Frames in and out.
#include <random>

#include "framework/io/field_source.hpp"
#include "framework/io/frame_sink.hpp"
#include "framework/io/frame_source.hpp"
#include "framework/io/npy.hpp"
#include "framework/io/vtk_output.hpp"
#include "io/io_support.hpp"
#include "support/shared_data.hpp"

namespace halfgrad {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

template <class Scalar>
Values<Scalar> frame_values(int frame, Eigen::Index rows = 4, Eigen::Index columns = 3) {
  std::mt19937 random(static_cast<unsigned>(frame));
  std::uniform_real_distribution<Scalar> uniform(-1, 1);
  return Values<Scalar>::NullaryExpr(rows, columns, [&] { return uniform(random); });
}

template <class Scalar>
Values<Scalar> read_frame(FrameSource& source, Index frame) {
  Values<Scalar> values;
  source.read(frame, values);
  return values;
}

class SharedFrames : public testing::TestWithParam<const char*> {};

// The collections store rest points and a displacement, both as doubles: their sum rounds once.
TEST_P(SharedFrames, CollectionsAgreeWithArrays) {
  const auto npy = shared_path(std::string("data/") + GetParam() + ".npy"),
             pvd = shared_path(std::string("data/") + GetParam() + ".pvd");
  if (!npy || !pvd) GTEST_SKIP() << "the shared data is absent";
  const auto a = open_frames(npy->string()), b = open_frames(pvd->string());
  ASSERT_EQ(a->num_frames(), b->num_frames());
  ASSERT_EQ(a->num_vertices(), b->num_vertices());
  EXPECT_EQ(b->num_columns(), 3);
  for (Index f = 0; f < a->num_frames(); ++f) {
    const auto x = read_frame<double>(*a, f), y = read_frame<double>(*b, f);
    EXPECT_LT((x - y.leftCols(x.cols())).cwiseAbs().maxCoeff(), 1e-14 * (1 + x.cwiseAbs().maxCoeff())) << f;
    EXPECT_EQ(read_frame<float>(*b, f), y.cast<float>().eval());
  }
}

INSTANTIATE_TEST_SUITE_P(Frames, SharedFrames,
                         testing::Values("spot_shake/tet_L0_sampled", "sheet_swirl/quad_L0_sampled",
                                         "hexbar_twist/mixed_L0_sampled"),
                         [](const auto& instance) { return std::to_string(instance.index); });

TEST(SharedPointCaches, PointCacheAgreesWithArray) {
  const auto npy = shared_path("data/sheet_swirl/surface_truth.npy"),
             pc2 = shared_path("data/sheet_swirl/surface_truth.pc2");
  if (!npy || !pc2) GTEST_SKIP() << "the shared data is absent";
  const auto a = open_frames(npy->string()), b = open_frames(pc2->string());
  ASSERT_EQ(a->num_frames(), b->num_frames());
  for (Index f = 0; f < a->num_frames(); ++f) {
    const auto y = read_frame<float>(*b, f);
    EXPECT_EQ(read_frame<float>(*a, f), y.leftCols(2).eval());
    EXPECT_TRUE((y.col(2).array() == 0).all());
  }
}

class Frames : public FileTest {
 protected:
  template <class Scalar>
  void write(const std::string& name, int count, const PointSet& shape = {}) {
    const auto sink = create_frames(file(name), shape);
    for (int f = 0; f < count; ++f) sink->write(frame_values<Scalar>(f));
    sink->finish();
  }
};

TEST_F(Frames, EveryWriterReadsBack) {
  for (const auto& [out, in] :
       {std::pair{"a.npy", "a.npy"}, {"b.%03d.obj", "b.%03d.obj"}, {"c.pvd", "c.pvd"}, {"d.obj", "d.obj"}}) {
    SCOPED_TRACE(out);
    const int count = std::string(out) == "d.obj" ? 1 : 12;
    write<double>(out, count);
    auto source = open_frames(file(in).string());
    ASSERT_EQ(source->num_frames(), count);
    for (int f = 0; f < count; ++f) EXPECT_EQ(read_frame<double>(*source, f), frame_values<double>(f));
    write<float>(out, count);
    source = open_frames(file(in).string());
    for (int f = 0; f < count; ++f) EXPECT_EQ(read_frame<float>(*source, f), frame_values<float>(f));
  }
  write<float>("e.pc2", 7);
  const auto source = open_frames(file("e.pc2").string());
  EXPECT_EQ(source->num_frames(), 7);
  for (int f = 0; f < 7; ++f) EXPECT_EQ(read_frame<float>(*source, f), frame_values<float>(f));
  for (const std::string& name : names()) EXPECT_NE(name.front(), '.') << name;
}

TEST_F(Frames, BytesAreTheFormats) {
  const auto sink = create_frames(file("a.pc2"));
  const Values<float> points = (Values<float>(1, 2) << 5, 6).finished();
  sink->write(points);
  sink->write(points);
  sink->finish();
  EXPECT_EQ(contents_of(file("a.pc2")), std::string("POINTCACHE2\0", 12) + bytes<std::int32_t>({1, 1}) +
                                            bytes<float>({0, 1}) + bytes<std::int32_t>({2}) +
                                            bytes<float>({5, 6, 0, 5, 6, 0}));
  const auto array = create_frames(file("a.npy"));
  array->write(points);
  array->finish();
  const std::string text = contents_of(file("a.npy"));
  EXPECT_EQ(text.substr(0, 10), std::string("\x93NUMPY\x01\x00\x76\x00", 10));
  EXPECT_EQ(text.substr(10, 61), "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 1, 2), ");
  EXPECT_EQ(text.substr(128), bytes<float>({5, 6}));
}

TEST_F(Frames, ObjPassesEverythingElseThrough) {
  const std::string text =
      "mtllib m.mtl\r\no thing\r\nv 1 2 3 # first\r\n  v 4 5 6 0.1 0.2 0.3\nvn 0 0 1\nusemtl red\nv 7 8 9\nf 1//1 2//1 "
      "3//1";
  const PointSet shape = read_points(file("in.obj", text));
  const auto sink = create_frames(file("out.obj"), shape);
  Values<double> points(3, 3);
  points << 0.1, -2, 1e-300, 1.0 / 3, 0, 1, 10, 11, 12;
  sink->write(points);
  sink->finish();
  EXPECT_EQ(contents_of(file("out.obj")),
            "mtllib m.mtl\r\no thing\r\nv 0.1 -2 1e-300 # first\r\n  v 0.3333333333333333 0 1 0.1 0.2 0.3\nvn 0 0 "
            "1\nusemtl red\nv 10 11 12\n"
            "f 1//1 2//1 3//1");
  const auto wrong = create_frames(file("wrong.obj"), shape);
  EXPECT_THAT(message_of([&] { wrong->write(Points(Points::Zero(2, 3))); }),
              AllOf(HasSubstr("wrong.obj"), HasSubstr("2 points")));
  EXPECT_THAT(message_of([&] { wrong->write(Points(Points::Zero(4, 3))); }), HasSubstr("4 points"));
}

TEST_F(Frames, NothingIncompleteAppears) {
  for (const char* name : {"a.npy", "a.pc2"}) {
    const auto sink = create_frames(file(name));
    for (int f = 0; f < 3; ++f) sink->write(frame_values<float>(f));
    for (const std::string& found : names()) EXPECT_EQ(found.front(), '.') << found;
  }
  EXPECT_THAT(names(), ElementsAre());
  // Files of a frame are complete one by one; the collection comes when all that it names is there.
  for (const char* name : {"a.%d.obj", "a.pvd", "b.%d.npy"}) {
    const auto sink = create_frames(file(name));
    for (int f = 0; f < 2; ++f) sink->write(frame_values<float>(f));
  }
  EXPECT_THAT(names(), ElementsAre("a.0.obj", "a.1.obj", "a_0000.vtp", "a_0001.vtp", "b.0.npy", "b.1.npy"));
  EXPECT_EQ(read_npy(file("b.1.npy")), frame_values<float>(1).cast<double>());
}

TEST_F(Frames, AnInterruptedRunGoesOn) {
  for (const char* name : {"a.npy", "a.pc2", "a.%d.obj", "a.%02d.npy", "a.pvd"}) {
    SCOPED_TRACE(name);
    FrameSinkOptions options{.first = 20, .step = 5, .run = "this run"};
    const auto write = [&](FrameSink& sink, int begin, int end) {
      for (int f = begin; f < end; ++f) sink.write(frame_values<float>(f));
    };
    const auto contents = [&] {
      std::string all;
      for (const std::string& found : names()) all += found + '\n' + contents_of(file(found)) + '\n';
      return all;
    };
    const auto whole = create_frames(file(name), {}, options);
    write(*whole, 0, 7);
    whole->finish();
    const std::string expected = contents();
    for (const std::string& found : names()) std::filesystem::remove(file(found));

    write(*create_frames(file(name), {}, options), 0, 4);
    // A kill in the middle of a frame leaves a piece of it.
    const std::filesystem::path unfinished = folder_ / ("." + std::string(name) + ".unfinished");
    if (std::filesystem::exists(unfinished)) std::ofstream(unfinished, std::ios::app) << "half a fr";
    options.unfinished = Unfinished::resume;
    options.run = "another run";
    EXPECT_EQ(create_frames(file(name), {}, options)->num_resumable(), 0);
    options.run = "this run";
    write(*create_frames(file(name), {}, {.first = 20, .step = 5, .run = "this run"}), 0, 4);
    const auto sink = create_frames(file(name), {}, options);
    ASSERT_EQ(sink->num_resumable(), 4);
    sink->resume(3);
    write(*sink, 3, 7);
    sink->finish();
    EXPECT_EQ(contents(), expected);
    for (const std::string& found : names()) std::filesystem::remove(file(found));
  }
}

TEST_F(Frames, OneProcessWritesAFile) {
  const FrameSinkOptions options{.run = "a run"};
  const auto sink = create_frames(file("a.npy"), {}, options);
  EXPECT_THAT(message_of([&] { create_frames(file("a.npy"), {}, options); }),
              AllOf(HasSubstr("a.npy"), HasSubstr("another process")));
}

TEST_F(Frames, FilesAndTimesAreNumberedAsTheCallerCounts) {
  for (const char* name : {"a.%03d.obj", "a.pvd", "a.pc2"}) {
    const auto sink = create_frames(file(name), {}, {.first = 7, .step = 4});
    for (int f = 0; f < 2; ++f) sink->write(frame_values<float>(f));
    sink->finish();
  }
  EXPECT_THAT(names(), ElementsAre("a.007.obj", "a.011.obj", "a.pc2", "a.pvd", "a_0007.vtp", "a_0011.vtp"));
  EXPECT_THAT(contents_of(file("a.pvd")), AllOf(HasSubstr("timestep=\"7\""), HasSubstr("timestep=\"11\"")));
  EXPECT_EQ(contents_of(file("a.pc2")).substr(20, 8), bytes<float>({7, 4}));
}

TEST_F(Frames, FieldsComeFromArraysFrameFilesOrTheRestMesh) {
  Values<double> heat(4, 1), stress(4, 6);
  heat << 1, 2, 3, 4;
  stress.setRandom();
  const Points points = frame_values<double>(0);
  write_vtp(file("rest.vtp"), points, {}, std::vector{PointArray{"heat", heat}});
  for (int f = 0; f < 3; ++f)
    write_vtp(file(fmt::format("x{}.vtp", f)), points, {}, std::vector{PointArray{"stress", (f + 1) * stress}});
  write_npy(file("k.npy"), heat);
  const auto frames = open_frames(file("x*.vtp").string());
  const auto values = [&](const std::string& spec, Index frame) {
    FieldSource field(spec, file("rest.vtp"), *frames);
    Values<double> result, positions;
    frames->read(frame, positions);
    field.read(frame, result);
    return result;
  };
  EXPECT_EQ(values("heat", 2), heat);
  EXPECT_EQ(values("stress", 2), 3 * stress);
  EXPECT_EQ(values("k=" + file("k.npy").string(), 1), heat);
  EXPECT_THAT(message_of([&] { values("strain", 0); }), AllOf(HasSubstr("stress"), HasSubstr("heat")));
  write_npy(file("short.npy"), Values<double>(heat.topRows(3)));
  EXPECT_THAT(message_of([&] { values("s=" + file("short.npy").string(), 0); }),
              AllOf(HasSubstr("3 vertices"), HasSubstr("of 4")));
  heat(2, 0) = std::numeric_limits<double>::quiet_NaN();
  write_vtp(file("rest.vtp"), points, {}, std::vector{PointArray{"heat", heat}});
  EXPECT_THAT(message_of([&] { values("heat", 0); }), AllOf(HasSubstr("vertex 2"), HasSubstr("not finite")));
}

TEST_F(Frames, SinksRefuseWhatTheyCannotHold) {
  EXPECT_THAT(message_of([&] { create_frames(file("a.vtk")); }),
              AllOf(HasSubstr(".vtk"), HasSubstr(".obj, .npy, .pc2, .pvd")));
  EXPECT_THAT(message_of([&] { create_frames(file("none") / "a.npy"); }), HasSubstr("No such file"));
  const auto npy = create_frames(file("a.npy"));
  npy->write(frame_values<float>(0));
  EXPECT_THAT(message_of([&] { npy->write(frame_values<float>(0, 5)); }),
              AllOf(HasSubstr("frame 1"), HasSubstr("5 × 3"), HasSubstr("4 × 3")));
  EXPECT_THAT(message_of([&] { npy->write(frame_values<double>(0)); }), HasSubstr("8 bytes"));
  EXPECT_THAT(message_of([&] {
                npy->write(frame_values<float>(0), std::vector{PointArray{"n", {}}});
              }),
              HasSubstr("\"n\""));
  const auto obj = create_frames(file("a.obj"));
  obj->write(frame_values<float>(0));
  EXPECT_THAT(message_of([&] { obj->write(frame_values<float>(0)); }), HasSubstr("a.%04d.obj"));
  const auto pc2 = create_frames(file("a.pc2"));
  EXPECT_THAT(message_of([&] { pc2->write(Points(Points::Constant(1, 3, 1e300))); }), HasSubstr("beyond the floats"));
  EXPECT_THAT(message_of([&] { pc2->write(Points(Points::Zero(2, 4))); }), HasSubstr("found 4 columns"));
  pc2->write(Points(Points::Zero(2, 3)));
  EXPECT_THAT(message_of([&] { pc2->write(Points(Points::Zero(3, 3))); }),
              AllOf(HasSubstr("frame 1 has 3 points"), HasSubstr("expected 2")));
  PointSet shape;
  shape.faces.entries = {0, 1, 2};
  shape.faces.offsets = {0, 3};
  const auto faces = create_frames(file("faces.obj"), shape);
  faces->write(Points(Points::Identity(3, 3)));
  faces->finish();
  EXPECT_EQ(content("faces.obj"), "v 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n");
  EXPECT_THAT(message_of([&] { create_frames(file("b.obj"))->write(Points(Points::Zero(2, 4))); }),
              HasSubstr("found 4 columns"));
  EXPECT_THAT(message_of([&] { create_frames(file("b.pvd"))->write(Points(Points::Zero(2, 4))); }),
              HasSubstr("found 4 columns"));
}

TEST_F(Frames, PatternsFindFilesInNaturalOrder) {
  const std::vector<int> numbers = {1, 2, 9, 10};
  for (int f : numbers) write_vtp(file(fmt::format("x{}.vtp", f)), Points::Constant(2, 3, f));
  auto source = open_frames(file("x*.vtp").string());
  ASSERT_EQ(source->num_frames(), 4);
  for (int f = 0; f < 4; ++f) EXPECT_EQ(read_frame<double>(*source, f)(0, 0), numbers[static_cast<std::size_t>(f)]);
  EXPECT_EQ(open_frames(file("x?.vtp").string())->num_frames(), 3);
  EXPECT_THAT(message_of([&] { open_frames(file("x%d.vtp").string()); }),
              AllOf(HasSubstr("x3.vtp is missing"), HasSubstr("between x2.vtp and x9.vtp")));
  EXPECT_THAT(message_of([&] { open_frames(file("y%d.vtp").string()); }), HasSubstr("found no file of this pattern"));
  EXPECT_THAT(message_of([&] { open_frames(file("y%s.vtp").string()); }), HasSubstr("%04d"));
  for (int f = 8; f < 12; ++f) write_vtp(file(fmt::format("z_{:04}.vtp", f)), Points::Constant(2, 3, f));
  EXPECT_EQ(open_frames(file("z_####.vtp").string())->num_frames(), 4);
  write_vtp(file("z_0010.vtp"), Points::Zero(3, 3));
  source = open_frames(file("z_%04d.vtp").string());
  EXPECT_THAT(message_of([&] { read_frame<double>(*source, 2); }),
              AllOf(HasSubstr("z_0010.vtp"), HasSubstr("frame 2"), HasSubstr("3 vertices"), HasSubstr("expected 2")));
  EXPECT_THAT(message_of([&] { read_frame<double>(*source, 4); }), HasSubstr("frame 4"));
}

TEST_F(Frames, DisplacementsAreAddedToRestPointsOnly) {
  const Points rest = frame_values<double>(0), shift = frame_values<double>(1);
  const auto write_series = [&](bool deformed) {
    for (int f = 0; f < 3; ++f)
      write_vtp(file(fmt::format("d{}.vtp", f)), deformed ? Points(rest + f * shift) : rest, {},
                std::vector{PointArray{"displacement", f * shift}});
    const auto source = open_frames(file("d%d.vtp").string());
    for (int f = 0; f < 3; ++f) EXPECT_EQ(read_frame<double>(*source, f), Points(rest + f * shift)) << f;
  };
  write_series(false);
  write_series(true);
}

TEST_F(Frames, NonFiniteValuesAreNamed) {
  Values<double> values = frame_values<double>(0);
  const auto sink = create_frames(file("a.npy"));
  sink->write(values);
  values(2, 1) = std::numeric_limits<double>::infinity();
  sink->write(values);
  sink->finish();
  const auto source = open_frames(file("a.npy").string());
  read_frame<double>(*source, 0);
  EXPECT_THAT(message_of([&] { read_frame<float>(*source, 1); }),
              AllOf(HasSubstr("a.npy"), HasSubstr("frame 1"), HasSubstr("vertex 2"), HasSubstr("inf")));
}

TEST_F(Frames, TruncatedSequencesAreRefused) {
  write<float>("a.npy", 3);
  write<float>("a.pc2", 3);
  write<float>("a.pvd", 3);
  for (const char* name : {"a.npy", "a.pc2", "a.pvd", "a_0001.vtp"}) {
    const std::string whole = contents_of(file(name)), extension = fs::path(name).extension().string();
    // The last tenth of a .vtp may be its closing tags, without which all values are there.
    for (std::size_t cut = 0; cut < 36; ++cut) {
      const std::string opened = file("cut" + extension, whole.substr(0, whole.size() * cut / 40)).string();
      EXPECT_NE(message_of([&] { read_frame<float>(*open_frames(opened), 0); }), "no error")
          << name << " cut to " << cut << "/40";
    }
  }
}

}  // namespace
}  // namespace halfgrad
