// Mesh files by independent writers describe the same mesh, and damaged ones are refused in words.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <map>
#include <random>

#include "framework/io/formats.hpp"
#include "framework/io/geometry.hpp"
#include "framework/io/mesh_file.hpp"
#include "framework/io/point_set.hpp"
#include "io/io_support.hpp"
#include "support/shared_data.hpp"

namespace halfgrad {
namespace {

using testing::AllOf;
using testing::HasSubstr;

// The files of a prefix in formats that meshes are read from.
std::vector<fs::path> fixtures(const std::string& prefix) {
  std::vector<fs::path> files;
  const auto folder = shared_path("data/formats");
  if (!folder) return files;
  for (const auto& entry : fs::directory_iterator(*folder)) {
    const std::string name = entry.path().filename().string(), extension = entry.path().extension().string();
    if (!name.starts_with(prefix + "_")) continue;
    for (const Format& format : formats())
      if (format.has_cells &&
          std::find(format.extensions.begin(), format.extensions.end(), extension) != format.extensions.end())
        files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// Gmsh leaves prisms and pyramids out of the MEDIT files that it writes.
bool lacks_cells(const fs::path& path) {
  const std::string name = path.filename().string();
  return name == "wedge_gmsh.mesh" || name == "mixed_gmsh.mesh";
}

struct Prefix {
  std::string name;
  std::size_t num_files;
  Index num_vertices;
  std::map<int, Index> num_cells;  // by VTK id
  int gdim;
};

class Fixtures : public testing::TestWithParam<Prefix> {};

TEST_P(Fixtures, AllDescribeOneMesh) {
  const Prefix& prefix = GetParam();
  const std::vector<fs::path> files = fixtures(prefix.name);
  if (files.empty()) GTEST_SKIP() << "the shared data is absent";
  EXPECT_EQ(files.size(), prefix.num_files);
  bool registered = true;
  Index total = 0;
  for (const auto& [id, count] : prefix.num_cells) {
    bool known = false;
    Elements::for_each([&]<class E>() { known = known || E::vtk_id == id; });
    registered = registered && known;
    total += count;
  }
  std::map<int, std::vector<std::vector<Index>>> first_cells;
  Points first_vertices;
  for (const fs::path& path : files) {
    SCOPED_TRACE(path.filename());
    if (lacks_cells(path)) continue;
    if (!registered) {
      EXPECT_THAT(message_of([&] { read_mesh(path); }),
                  AllOf(HasSubstr("not a registered element"), HasSubstr("hexahedron (12)")));
      continue;
    }
    const Mesh mesh = read_mesh(path);
    EXPECT_EQ(mesh.gdim(), prefix.gdim);
    ASSERT_EQ(mesh.num_vertices(), prefix.num_vertices);
    ASSERT_EQ(mesh.num_cells(), total);
    std::map<int, std::vector<std::vector<Index>>> cells;
    for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) {
      EXPECT_EQ(block.cells.rows(), prefix.num_cells.at(E::vtk_id));
      for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
        cells[E::vtk_id].emplace_back(block.cells.row(c).begin(), block.cells.row(c).end());
        // VTK's node order makes every one of these cells positive at its center.
        const auto positions = node_positions(mesh, block, c);
        EXPECT_GT((positions.transpose() * E::shape_gradient(E::center())).determinant(), 0) << "cell " << c;
      }
    });
    if (first_cells.empty()) {
      first_cells = cells;
      first_vertices = mesh.vertices();
    }
    EXPECT_EQ(cells, first_cells);
    // meshio keeps 12 digits in ASCII .vtu and .vtk files, gmsh 14 in MEDIT files.
    EXPECT_LT((mesh.vertices() - first_vertices).cwiseAbs().maxCoeff(), 1e-11);
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, Fixtures,
                         testing::Values(Prefix{"tet", 17, 435, {{10, 1415}}, 3},
                                         Prefix{"hex", 15, 330, {{12, 200}}, 3},
                                         Prefix{"wedge", 15, 330, {{13, 420}}, 3},
                                         Prefix{"mixed", 13, 262, {{12, 54}, {14, 9}, {10, 630}}, 3},
                                         Prefix{"tri", 15, 330, {{5, 596}}, 2}, Prefix{"quad", 15, 594, {{9, 554}}, 2}),
                         [](const auto& instance) { return instance.param.name; });

class DamagedFiles : public FileTest {
 protected:
  // Reading a file either works or throws Error; anything else ends the test.
  void try_reading(const fs::path& path) {
    try {
      read_mesh(path);
      ++num_read_;
    } catch (const Error&) {
      ++num_refused_;
    }
  }
  int num_read_ = 0, num_refused_ = 0;
};

TEST_F(DamagedFiles, TruncatedFilesAreReadOrRefused) {
  std::vector<fs::path> files = fixtures("tri");
  for (const fs::path& path : fixtures("tet"))
    if (path.extension() == ".node" || path.extension() == ".ele") files.push_back(path);
  if (files.empty()) GTEST_SKIP() << "the shared data is absent";
  for (const fs::path& path : files) {
    const std::string whole = contents_of(path);
    // TetGen's other half must be there for the named one to be read.
    if (path.extension() == ".ele") fs::copy_file(fs::path(path).replace_extension(".node"), file("cut.node"));
    if (path.extension() == ".node") fs::copy_file(fs::path(path).replace_extension(".ele"), file("cut.ele"));
    for (std::size_t cut = 0; cut < 40; ++cut) {
      const std::size_t size = cut < 10 ? 12 * cut : whole.size() * cut / 40;
      try_reading(file("cut" + path.extension().string(), whole.substr(0, size)));
    }
    for (const std::string& name : names()) fs::remove(file(name));
  }
  EXPECT_GT(num_refused_, 20 * num_read_);
}

TEST_F(DamagedFiles, FilesWithWrongBytesAreReadOrRefused) {
  const std::vector<fs::path> files = fixtures("tri");
  if (files.empty()) GTEST_SKIP() << "the shared data is absent";
  std::mt19937 random(5);
  for (const fs::path& path : files) {
    const std::string whole = contents_of(path);
    for (int trial = 0; trial < 60; ++trial) {
      std::string damaged = whole;
      // Headers hold the counts, so half of the changes are made there.
      const std::size_t range = trial % 2 == 0 ? std::min<std::size_t>(400, whole.size()) : whole.size();
      for (int i = 0; i < 1 + trial % 4; ++i)
        damaged[random() % range] =
            trial % 3 == 0 ? static_cast<char>('0' + random() % 10) : static_cast<char>(random());
      try_reading(file("damaged" + path.extension().string(), damaged));
    }
  }
  EXPECT_GT(num_read_, 0);
  EXPECT_GT(num_refused_, 0);
}

class MeshFileErrors : public FileTest {};

TEST_F(MeshFileErrors, SayWhatIsWrongWithTheFile) {
  EXPECT_THAT(message_of([&] { read_mesh(file("none.msh")); }),
              AllOf(HasSubstr("none.msh"), HasSubstr("No such file")));
  EXPECT_THAT(message_of([&] { read_mesh(file("empty.msh", "")); }), HasSubstr("empty"));
  fs::create_directory(file("folder.vtu"));
  EXPECT_THAT(message_of([&] { read_mesh(file("folder.vtu")); }), HasSubstr("found a folder"));
  EXPECT_THAT(message_of([&] { read_mesh("a.vtj"); }),
              AllOf(HasSubstr(".vtj"), HasSubstr(".msh, .vtk, .vtu"), HasSubstr("did you mean")));
  EXPECT_THAT(message_of([&] { read_mesh("a.npy"); }), AllOf(HasSubstr("NumPy"), HasSubstr("meshes are read from")));
}

constexpr const char* small_msh =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n30 0 1 5\n10 0 0 5\n20 1 0 5\n40 7 7 5\n$EndNodes\n"
    "$Elements\n2\n1 1 2 0 1 10 20\n2 2 2 0 1 10 20 30\n$EndElements\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST_F(MeshFileErrors, GmshTagsOrderTheVerticesAndLowerCellsGo) {
  const Mesh mesh = read_mesh(file("a.msh", small_msh));
  EXPECT_EQ(mesh.gdim(), 2);
  EXPECT_EQ(mesh.num_cells(), 1);
  EXPECT_THAT(mesh.cell_vertices(0), testing::ElementsAre(0, 1, 2));
  Points expected(4, 2);
  expected << 0, 0, 1, 0, 0, 1, 7, 7;  // the unused vertex stays
  EXPECT_EQ(mesh.vertices(), expected);
}

TEST_F(MeshFileErrors, SayWhatIsWrongInTheFile) {
  const auto message = [&](const std::string& from, const std::string& to) {
    return message_of([&] { read_mesh(file("a.msh", replaced(small_msh, from, to))); });
  };
  EXPECT_THAT(message("20 1 0 5", "20 1 nan 5"), AllOf(HasSubstr("vertex 1"), HasSubstr("nan")));
  EXPECT_THAT(message("20 1 0 5", "20 1 x 5"), AllOf(HasSubstr("a.msh:8"), HasSubstr("\"x\"")));
  EXPECT_THAT(message("20 1 0 5", "10 1 0 5"), HasSubstr("node tag 10 is used twice"));
  EXPECT_THAT(message("10 20 30\n$End", "10 20 31\n$End"), AllOf(HasSubstr("node tag 31"), HasSubstr("a.msh:14")));
  EXPECT_THAT(message("10 20 30\n$End", "10 20 20\n$End"), HasSubstr("twice"));
  EXPECT_THAT(message("$Nodes\n4", "$Nodes\n1000000000000000000"), HasSubstr("1000000000000000000 nodes"));
  EXPECT_THAT(message("2.2 0", "3.0 0"), AllOf(HasSubstr("version 3"), HasSubstr("2.2 or 4.1")));
  EXPECT_THAT(message("2 2 2 0 1", "2 9 2 0 1"), AllOf(HasSubstr("type 9"), HasSubstr("a.msh:14")));
  EXPECT_THAT(message("2\n1 1 2 0 1 10 20\n2 2 2 0 1 10 20 30\n", "1\n1 1 2 0 1 10 30\n"),
              AllOf(HasSubstr("dimension 1 with varying y"), HasSubstr("curves")));
}

TEST_F(MeshFileErrors, TrianglesWhoseHeightVariesAreASurface) {
  const Mesh mesh = read_mesh(file("a.msh", replaced(small_msh, "30 0 1 5", "30 0 1 6")));
  EXPECT_TRUE(mesh.is_surface());
  EXPECT_EQ(mesh.gdim(), 3);
  EXPECT_EQ(mesh.vertices()(2, 2), 6);
  const Mesh faces = read_mesh(file("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 0\nf 1 2 3 4\nf 1//1 2//1 3//1\n"));
  EXPECT_TRUE(faces.is_surface());
  ASSERT_EQ(faces.num_cells(), 2);
  EXPECT_EQ(element_name(faces, 0), "quadrilateral");
  EXPECT_EQ(element_name(faces, 1), "triangle");
  EXPECT_THAT(
      message_of([&] { read_mesh(file("b.obj", "v 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 2 1\nv 0 1 0\nf 1 2 3 4 5\n")); }),
      AllOf(HasSubstr("polygon"), HasSubstr("not a registered element")));
}

constexpr const char* image_file =
    "<VTKFile type=\"ImageData\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
    "<ImageData WholeExtent=\"1 3 0 2 0 0\" Origin=\"10 0 5\" Spacing=\"0.5 2 1\">\n"
    "<Piece Extent=\"1 3 0 2 0 0\"><PointData/><CellData>"
    "<DataArray type=\"UInt8\" Name=\"vtkGhostType\" format=\"ascii\">0 32 0 0</DataArray>"
    "</CellData></Piece></ImageData></VTKFile>\n";

TEST_F(MeshFileErrors, ImagesAreGridsAndHiddenCellsAreMissing) {
  const RestShape shape = read_rest_shape(file("a.vti", image_file));
  const Grid& grid = std::get<Grid>(shape);
  EXPECT_EQ(grid.gdim(), 2);
  EXPECT_EQ(grid.num_cells(), 3);
  EXPECT_EQ(grid.num_vertices(), 8);  // all nine but the corner of the hidden cell
  EXPECT_EQ(grid.cell_at({1, 0}), -1);
  EXPECT_EQ(grid.position(0), Eigen::Vector2d(10.5, 0));
  const Mesh mesh = read_mesh(file("a.vti"));
  EXPECT_EQ(mesh.num_cells(), 3);
  EXPECT_EQ(mesh.vertices().row(7), Eigen::RowVector2d(11.5, 4));
  const auto message = [&](const std::string& from, const std::string& to) {
    return message_of([&] { read_rest_shape(file("b.vti", replaced(image_file, from, to))); });
  };
  EXPECT_THAT(message("WholeExtent=\"1 3", "WholeExtent=\"1 4"), HasSubstr("one piece"));
  EXPECT_THAT(message("0 32 0 0", "0 32 0"), HasSubstr("expected 4"));
  EXPECT_THAT(message("Spacing=\"0.5 2 1\"", "Spacing=\"0 2 1\""), AllOf(HasSubstr("b.vti"), HasSubstr("spacing 0")));
  EXPECT_THAT(message("0 2 0 0\" Origin", "0 x 0 0\" Origin"), HasSubstr("6 numbers"));
  EXPECT_THAT(message("0 32 0 0", "32 32 32 32"), HasSubstr("without occupied cells"));
}

TEST_F(MeshFileErrors, RectilinearGridsAreGraded) {
  const RestShape shape = read_rest_shape(
      file("a.vtr",
           "<VTKFile type=\"RectilinearGrid\" version=\"0.1\"><RectilinearGrid WholeExtent=\"0 2 0 1 0 1\">"
           "<Piece Extent=\"0 2 0 1 0 1\"><Coordinates>"
           "<DataArray type=\"Float64\" format=\"ascii\">0 0.5 2</DataArray>"
           "<DataArray type=\"Float64\" format=\"ascii\">-1 1</DataArray>"
           "<DataArray type=\"Float64\" format=\"ascii\">3 4</DataArray>"
           "</Coordinates></Piece></RectilinearGrid></VTKFile>"));
  const Grid& grid = std::get<Grid>(shape);
  EXPECT_EQ(grid.num_cells(), 2);
  EXPECT_EQ(grid.position(11), Eigen::Vector3d(2, 1, 4));
}

TEST_F(MeshFileErrors, CountsBeyondTheFileFailFast) {
  EXPECT_THAT(message_of([&] {
                read_mesh(file("a.vtk",
                               "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\n"
                               "POINTS 1000000000000000000 double\n"));
              }),
              HasSubstr("only"));
  EXPECT_THAT(
      message_of([&] { read_mesh(file("a.mesh", "MeshVersionFormatted 2\nDimension 3\nVertices\n99999999999\n")); }),
      AllOf(HasSubstr("a.mesh:4"), HasSubstr("99999999999")));
  EXPECT_THAT(message_of([&] {
                read_mesh(file("a.vtu",
                               "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece "
                               "NumberOfPoints=\"9000000000000\" NumberOfCells=\"1\"/>"
                               "</UnstructuredGrid></VTKFile>"));
              }),
              AllOf(HasSubstr("a.vtu:1"), HasSubstr("9000000000000")));
  file("a.ele", "1 4 0\n1 1 2 3 4\n");
  EXPECT_THAT(message_of([&] { read_mesh(file("a.node", "8888888888 3 0 0\n1 0 0 0\n")); }), HasSubstr("8888888888"));
}

// One tetrahedron as DOLFINx writes it: a Lagrange cell of degree one in the only piece of a parallel file.
TEST_F(MeshFileErrors, LagrangeCellsOfDegreeOneAndFilesOfOnePieceAreRead) {
  const auto grid = [](int type, int num_nodes) {
    return fmt::format(
        "<VTKFile type='UnstructuredGrid' version='1.0'><UnstructuredGrid><Piece NumberOfPoints='4' NumberOfCells='1'>"
        "<Points><DataArray type='Float64' NumberOfComponents='3' format='ascii'>0 0 0 1 0 0 0 1 0 0 0 1</DataArray>"
        "</Points><Cells><DataArray type='Int32' Name='connectivity' format='ascii'>0 1 2 3</DataArray>"
        "<DataArray type='Int32' Name='offsets' format='ascii'>{}</DataArray>"
        "<DataArray type='UInt8' Name='types' format='ascii'>{}</DataArray></Cells></Piece></UnstructuredGrid>"
        "</VTKFile>",
        num_nodes, type);
  };
  const auto pieces = [](std::string_view list) {
    return fmt::format("<VTKFile type='PUnstructuredGrid'><PUnstructuredGrid>{}</PUnstructuredGrid></VTKFile>", list);
  };
  file("a.vtu", grid(71, 4));
  for (const fs::path& path : {file("a.vtu"), file("a.pvtu", pieces("<Piece Source='a.vtu'/>"))}) {
    const Mesh mesh = read_mesh(path);
    EXPECT_EQ(mesh.num_cells(), 1);
    EXPECT_EQ(element_name(mesh, 0), "tetrahedron");
    EXPECT_NEAR(inspect(mesh).volume, 1.0 / 6, 1e-15);
  }

  EXPECT_THAT(
      message_of([&] { read_mesh(file("two.pvtu", pieces("<Piece Source='a.vtu'/><Piece Source='a.vtu'/>"))); }),
      AllOf(HasSubstr("two.pvtu"), HasSubstr("2 pieces"), HasSubstr("merge")));
  EXPECT_THAT(message_of([&] { read_mesh(file("self.pvtu", pieces("<Piece Source='self.pvtu'/>"))); }),
              HasSubstr("expected a .vtu"));
  file("loop.vtu", pieces("<Piece Source='loop.vtu'/>"));
  EXPECT_THAT(message_of([&] { read_mesh(file("loop.vtu")); }), HasSubstr("PUnstructuredGrid"));
}

TEST_F(MeshFileErrors, UnregisteredTypesAreNamedWithTheirCount) {
  const std::string text =
      "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 float\n0 0 0 1 0 0 2 0 0\n"
      "CELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n21\n";
  EXPECT_THAT(message_of([&] { read_mesh(file("a.vtk", text)); }),
              AllOf(HasSubstr("1 cells of type quadratic segment"), HasSubstr("tetrahedron (10)")));
}

TEST_F(MeshFileErrors, TetGenNumbersFromZeroOrOne) {
  file("a.node", "# comment\n4 3 1 1\n1 0 0 0 9 9\n2 1 0 0 9 9\n3 0 1 0 9 9\n4 0 0 1 9 9\n");
  const Mesh mesh = read_mesh(file("a.ele", "1 4 0 # more\n1 1 2 3 4\n"));
  EXPECT_THAT(mesh.cell_vertices(0), testing::ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(message_of([&] { read_mesh(file("a.ele", "1 4 0\n1 0 2 3 4\n")); }),
              AllOf(HasSubstr("a.ele:2"), HasSubstr("vertex 0"), HasSubstr("1 to 4")));
}

}  // namespace
}  // namespace halfgrad
