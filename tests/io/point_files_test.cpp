// Point files, and what is written by us and read back.
#include <random>

#include "framework/io/mesh_file.hpp"
#include "framework/io/npy.hpp"
#include "framework/io/point_set.hpp"
#include "framework/io/vtk_output.hpp"
#include "io/io_support.hpp"
#include "support/shared_data.hpp"

namespace halfgrad {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

Points random_points(Eigen::Index rows, Eigen::Index columns) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  Points points(rows, columns);
  for (Eigen::Index i = 0; i < points.size(); ++i)
    points.data()[i] = normal(random) * std::pow(10.0, static_cast<double>(i % 21) - 10);
  return points;
}

class PointFiles : public FileTest {};

TEST_F(PointFiles, ObjKeepsOrderAndUnusedVertices) {
  const PointSet set = read_points(file("a.obj",
                                        "# c\nv 1 2 3 0.5 0.5 0.5\r\nvt 0 0\nv +4e0 5 6\nv 7 8 9.25\nv 1 1 1\n"
                                        "f 1/1 2/1/1 3//1\nf -4 -3 -2 -1\n"));
  Points expected(4, 3);
  expected << 1, 2, 3, 4, 5, 6, 7, 8, 9.25, 1, 1, 1;
  EXPECT_EQ(set.points, expected);
  ASSERT_EQ(set.faces.num_rows(), 2);
  EXPECT_THAT(set.faces[0], ElementsAre(0, 1, 2));
  EXPECT_THAT(set.faces[1], ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(message_of([&] { read_points(file("b.obj", "v 1 2\n")); }), HasSubstr("b.obj:1"));
  EXPECT_THAT(message_of([&] { read_points(file("b.obj", "v 1 2 3\nf 1 2 3\n")); }), HasSubstr("names vertex 1"));
  EXPECT_THAT(message_of([&] { read_points(file("b.obj", "v 1 2 3\nf 1 -2 1\n")); }), HasSubstr("b.obj:2"));
  EXPECT_THAT(message_of([&] { read_points(file("b.obj", "v 1 2 1e999\n")); }), HasSubstr("inf"));
}

TEST_F(PointFiles, TextureCoordinatesStandAtTheCornersOfFaces) {
  const PointSet obj = read_points(
      file("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0.5 0.25\nvt 1 0 0\nf 1/1 2/2/7 3\nvt 0 1\nf 1/-1 2/9 3//2\n"));
  ASSERT_EQ(obj.corner_uv.rows(), 6);
  EXPECT_EQ(obj.corner_uv.row(0), Eigen::RowVector2d(0.5, 0.25));
  EXPECT_EQ(obj.corner_uv.row(1), Eigen::RowVector2d(1, 0));
  EXPECT_EQ(obj.corner_uv.row(3), Eigen::RowVector2d(0, 1));
  // None given, none that the file has, none but a normal.
  for (int corner : {2, 4, 5}) EXPECT_FALSE(obj.corner_uv.row(corner).allFinite()) << corner;
  EXPECT_EQ(read_points(file("b.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n")).corner_uv.rows(), 0);

  for (const char* names : {"s t", "u v", "texture_u texture_v"}) {
    const std::string u(names, std::string_view(names).find(' ')), v(names + u.size() + 1);
    const PointSet ply = read_points(
        file("a.ply",
             "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
             "property float " +
                 u + "\nproperty float " + v +
                 "\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
                 "0 0 0 0.5 0.25\n1 0 0 1 0\n1 1 0 1 1\n3 2 0 1\n"));
    Points expected(3, 2);
    expected << 1, 1, 0.5, 0.25, 1, 0;
    EXPECT_EQ(ply.corner_uv, expected) << names;
    ASSERT_NE(find_array(ply.arrays, "uv"), nullptr);
  }
}

TEST_F(PointFiles, PlyOfAllCodingsAgree) {
  const std::string header =
      "\ncomment x\nelement vertex 3\nproperty uchar red\nproperty double x\nproperty float y\nproperty short z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const PointSet ascii =
      read_points(file("a.ply", "ply\nformat ascii 1.0" + header + "1 0.5 1 2\n1 3.25 4 -5\n1 6 7 8\n3 2 1 0\n"));
  Points expected(3, 3);
  expected << 0.5, 1, 2, 3.25, 4, -5, 6, 7, 8;
  EXPECT_EQ(ascii.points, expected);
  ASSERT_EQ(ascii.faces.num_rows(), 1);
  EXPECT_THAT(ascii.faces[0], ElementsAre(2, 1, 0));
  for (const bool swap : {false, true}) {
    std::string body;
    const auto add = [&](auto value) {
      std::string part(reinterpret_cast<const char*>(&value), sizeof(value));
      if (swap) std::reverse(part.begin(), part.end());
      body += part;
    };
    for (int v = 0; v < 3; ++v) {
      add(std::uint8_t{1});
      add(expected(v, 0));
      add(static_cast<float>(expected(v, 1)));
      add(static_cast<std::int16_t>(expected(v, 2)));
    }
    add(std::uint8_t{3});
    for (int v : {2, 1, 0}) add(std::int32_t{v});
    const std::string text =
        std::string("ply\nformat binary_") + (swap ? "big" : "little") + "_endian 1.0" + header + body;
    const PointSet binary = read_points(file("b.ply", text));
    EXPECT_EQ(binary.points, expected);
    EXPECT_EQ(binary.faces.entries, ascii.faces.entries);
    EXPECT_THAT(message_of([&] { read_points(file("c.ply", text.substr(0, text.size() - 5))); }), HasSubstr("c.ply"));
  }
}

TEST_F(PointFiles, StlKeepsThreePointsAFacet) {
  const std::string ascii =
      "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
      "facet normal 0 0 1\nouter loop\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n";
  const PointSet text = read_points(file("a.stl", ascii));
  EXPECT_EQ(text.points.rows(), 6);
  EXPECT_EQ(text.faces.num_rows(), 2);
  // Binary files may begin with "solid".
  std::string binary = "solid" + std::string(75, ' ') + bytes<std::uint32_t>({2});
  for (int f = 0; f < 2; ++f) {
    binary += bytes<float>({0, 0, 1});
    for (int v = 0; v < 3; ++v)
      for (int a = 0; a < 3; ++a) binary += bytes<float>({static_cast<float>(text.points(3 * f + v, a))});
    binary += std::string(2, '\0');
  }
  EXPECT_EQ(read_points(file("b.stl", binary)).points, text.points);
  EXPECT_THAT(message_of([&] { read_points(file("c.stl", ascii.substr(0, 100))); }), HasSubstr("c.stl:"));
}

TEST_F(PointFiles, NpyOfAnyLayout) {
  const Points points = random_points(5, 3);
  write_npy(file("a.npy"), points);
  EXPECT_EQ(read_npy(file("a.npy")), points);
  EXPECT_EQ(read_points(file("a.npy")).points, points);
  const auto npy = [](const std::string& dictionary, const std::string& data) {
    return std::string("\x93NUMPY\x01\x00", 8) + bytes<std::uint16_t>({static_cast<std::uint16_t>(dictionary.size())}) +
           dictionary + data;
  };
  // Fortran order, big-endian floats, made by hand.
  std::string data;
  for (float value : {1.0F, 3.0F, 5.0F, 2.0F, 4.0F, 6.0F}) {
    std::string part = bytes({value});
    std::reverse(part.begin(), part.end());
    data += part;
  }
  Points expected(3, 2);
  expected << 1, 2, 3, 4, 5, 6;
  EXPECT_EQ(read_points(file("b.npy", npy("{'descr': '>f4', 'fortran_order': True, 'shape': (3, 2), }", data))).points,
            expected);
  EXPECT_THAT(message_of([&] {
                read_points(file("c.npy", npy("{'descr': '<i8', 'fortran_order': False, 'shape': (3, 2), }", data)));
              }),
              AllOf(HasSubstr("'<i8'"), HasSubstr("'<f4'")));
  EXPECT_THAT(
      message_of([&] {
        read_points(file(
            "c.npy", npy("{'descr': '<f4', 'fortran_order': False, 'shape': (4000000000, 4000000000, 3), }", data)));
      }),
      HasSubstr("24 bytes follow"));
  EXPECT_THAT(message_of([&] {
                read_points(file("c.npy", npy("{'descr': '<f4', 'fortran_order': False, 'shape': (6,), }", data)));
              }),
              AllOf(HasSubstr("shape (6)"), HasSubstr("#points × 2 or 3")));
}

TEST_F(PointFiles, InDimensionDropsOnlyAConstantCoordinate) {
  Points points(2, 3);
  points << 1, 2, 7, 3, 4, 7;
  EXPECT_EQ(in_dimension(points, 2, "p"), points.leftCols(2).eval());
  EXPECT_EQ(in_dimension(points, 3, "p"), points);
  points(1, 2) = 8;
  EXPECT_THAT(message_of([&] { in_dimension(points, 2, "p.obj"); }), AllOf(HasSubstr("p.obj"), HasSubstr("varying z")));
  EXPECT_THAT(message_of([&] { in_dimension(points.leftCols(2), 3, "p.obj"); }), HasSubstr("expected 3"));
}

TEST_F(PointFiles, VtuAndVtpReadBackBitForBit) {
  const auto source = shared_path("data/formats/mixed_meshio_41.msh")
                          .value_or(shared_path("data/formats/hex_meshio_41.msh").value_or(""));
  Points vertices = random_points(6, 3);
  ElementBlock<Tetrahedron> block;
  block.cells.resize(2, 4);
  block.cells << 0, 1, 2, 3, 1, 2, 3, 4;
  const Mesh mesh = source.empty() ? Mesh(vertices, {block}) : read_mesh(source);
  const PointArray displacement{"displacement", random_points(mesh.num_vertices(), 3)};
  const PointArray scalar{"a <b> & \"c\"", random_points(mesh.num_vertices(), 1)};
  write_vtu(file("a.vtu"), mesh, std::vector{scalar, displacement});
  const Mesh back = read_mesh(file("a.vtu"));
  EXPECT_EQ(back.vertices(), mesh.vertices());
  ASSERT_EQ(back.num_cells(), mesh.num_cells());
  for (Index c = 0; c < mesh.num_cells(); ++c)
    EXPECT_TRUE(std::ranges::equal(back.cell_vertices(c), mesh.cell_vertices(c)));
  const std::vector<PointArray> arrays = read_points(file("a.vtu")).arrays;
  ASSERT_EQ(arrays.size(), 2U);
  EXPECT_EQ(arrays[0].name, scalar.name);
  EXPECT_EQ(arrays[0].values, scalar.values);
  EXPECT_EQ(arrays[1].values, displacement.values);

  IndexTable faces;
  faces.offsets = {0, 3, 7};
  faces.entries = {0, 1, 2, 2, 3, 4, 5};
  write_vtp(file("a.vtp"), vertices, faces);
  const PointSet set = read_points(file("a.vtp"));
  EXPECT_EQ(set.points, vertices);
  EXPECT_EQ(set.faces.offsets, faces.offsets);
  EXPECT_EQ(set.faces.entries, faces.entries);
  write_vtp(file("b.vtp"), vertices.leftCols(2), {});
  EXPECT_EQ(read_points(file("b.vtp")).points.leftCols(2), vertices.leftCols(2));
  EXPECT_THAT(message_of([&] {
                write_vtp(file("c.vtp"), vertices, {}, std::vector{PointArray{"d", Points::Zero(2, 1)}});
              }),
              AllOf(HasSubstr("\"d\""), HasSubstr("2 rows"), HasSubstr("expected 6")));
  EXPECT_FALSE(fs::exists(file("c.vtp")));
}

class Atomicity : public FileTest {};

TEST_F(Atomicity, NothingIsLeftOfAFileThatWasNotCommitted) {
  write_text_atomically(file("a.txt"), "old");
  {
    OutputFile out(file("a.txt"));
    out.write("new");
    EXPECT_EQ(contents_of(file("a.txt")), "old");
  }
  EXPECT_EQ(contents_of(file("a.txt")), "old");
  EXPECT_THAT(names(), ElementsAre("a.txt"));
  OutputFile out(file("a.txt"));
  out.write("new");
  out.overwrite(0, "N");
  out.commit();
  EXPECT_EQ(contents_of(file("a.txt")), "New");
  EXPECT_THAT(names(), ElementsAre("a.txt"));
}

TEST_F(Atomicity, FailuresNamePathAndReason) {
  EXPECT_THAT(message_of([&] { write_text_atomically(file("none") / "a.txt", "x"); }),
              AllOf(HasSubstr("none/a.txt"), HasSubstr("No such file or directory")));
  fs::create_directory(file("folder"));
  EXPECT_THAT(message_of([&] { write_text_atomically(file("folder"), "x"); }), HasSubstr("found a folder"));
  EXPECT_THAT(message_of([&] { write_text_atomically(file("a.txt", "x") / "b.txt", "x"); }),
              HasSubstr("Not a directory"));
  EXPECT_THAT(message_of([&] { write_text_atomically("/proc/self/a.txt", "x"); }),
              HasSubstr("/proc/self/a.txt: cannot be written"));
}

}  // namespace
}  // namespace halfgrad
