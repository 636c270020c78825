// Legacy VTK files: what stands beside the cells is read or passed over, and damage is named with its line.
#include "framework/io/vtk_legacy.hpp"

#include "framework/io/geometry.hpp"
#include "framework/io/point_set.hpp"
#include "io/io_support.hpp"

namespace halfgrad {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* triangle =
    "# vtk DataFile Version 3.0\na title\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\n"
    "CELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n5\n";

class LegacyFiles : public FileTest {
 protected:
  std::string message(const std::string& contents) {
    return message_of([&] { read_vtk_legacy(file("a.vtk", contents)); });
  }
};

TEST_F(LegacyFiles, AttributesOfEveryKindAreRead) {
  const Geometry found = read_vtk_legacy(
      file("a.vtk", std::string(triangle) + "METADATA\nINFORMATION 0\n\n"
                                            "CELL_DATA 1\nSCALARS of_cell float 1\nLOOKUP_TABLE default\n8\n"
                                            "POINT_DATA 3\n"
                                            "SCALARS plain float\n1 2 3\n"
                                            "SCALARS pairs double 2\nLOOKUP_TABLE mine\n1 2 3 4 5 6\n"
                                            "LOOKUP_TABLE mine 1\n0 0 0 1\n"
                                            "COLOR_SCALARS color 2\n0 0 0 0 0 0\n"
                                            "VECTORS velocity float\n1 0 0 0 1 0 0 0 1\n"
                                            "NORMALS normal float\n0 0 1 0 0 1 0 0 1\n"
                                            "TENSORS stress float\n1 2 3 4 5 6 7 8 9 1 2 3 4 5 6 7 8 9 "
                                            "1 2 3 4 5 6 7 8 9\n"
                                            "TENSORS6 strain float\n1 2 3 4 5 6 1 2 3 4 5 6 1 2 3 4 5 6\n"
                                            "GLOBAL_IDS id vtkIdType\n7 8 9\n"
                                            "TEXTURE_COORDINATES uv 2 float\n0 0 1 0 0 1\n"
                                            "FIELD more 2\nMETADATA\nINFORMATION 0\n\na 1 3 int\n4 5 6\n"
                                            "b 2 2 int\n1 2 3 4\n"));
  std::vector<std::pair<std::string, Eigen::Index>> shapes;
  for (const auto& array : found.arrays) shapes.emplace_back(array.name, array.values.cols());
  // An array at cells, colors and one of another length are no arrays at points.
  EXPECT_THAT(shapes, ElementsAre(std::pair("plain", 1), std::pair("pairs", 2), std::pair("velocity", 3),
                                  std::pair("normal", 3), std::pair("stress", 9), std::pair("strain", 6),
                                  std::pair("id", 1), std::pair("uv", 2), std::pair("a", 1)));
  EXPECT_EQ(found.arrays[1].values(2, 1), 6);
  EXPECT_EQ(found.arrays[4].values(1, 8), 9);
  EXPECT_EQ(found.arrays[7].values(2, 1), 1);
}

TEST_F(LegacyFiles, PolygonsAreFacesAndLowerCellsAreNot) {
  const PointSet set = read_points(file("a.vtk",
                                        "# vtk DataFile Version 2.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n"
                                        "0 0 0 1 0 0 1 1 0 0 1 0\nVERTICES 1 2\n1 0\nLINES 1 3\n2 0 1\n"
                                        "POLYGONS 2 7\n3 0 1 2\n2 2 3\n"));
  EXPECT_EQ(set.points.rows(), 4);
  ASSERT_GE(set.faces.num_rows(), 1);
  EXPECT_THAT(set.faces[0], ElementsAre(0, 1, 2));
}

TEST_F(LegacyFiles, DamageIsNamedWithItsLine) {
  const std::string whole = triangle;
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string text = whole;
    return text.replace(text.find(from), from.size(), to);
  };
  EXPECT_EQ(message(whole), "no error");
  EXPECT_THAT(message(replaced("# vtk", "# VTK")), AllOf(HasSubstr("a.vtk:"), HasSubstr("# vtk DataFile Version")));
  EXPECT_THAT(message(replaced("3.0", "7.0")), HasSubstr("version 7"));
  EXPECT_THAT(message(replaced("ASCII", "TEXT")), HasSubstr("ASCII or BINARY"));
  EXPECT_THAT(message(replaced("UNSTRUCTURED_GRID", "STRUCTURED_GRID")), HasSubstr("STRUCTURED_GRID"));
  EXPECT_THAT(message(replaced("float", "quaternion")), AllOf(HasSubstr("a.vtk:5"), HasSubstr("\"quaternion\"")));
  EXPECT_THAT(message(replaced("3 0 1 2", "5 0 1 2")), HasSubstr("cell 0 has 5 nodes, 3 numbers are left"));
  EXPECT_THAT(message(replaced("CELLS 1", "CELLS 2")), HasSubstr("found 1 cells, expected 2"));
  EXPECT_THAT(message(replaced("CELL_TYPES 1\n5", "CELL_TYPES 2\n5 5")), HasSubstr("1 cells and 2 cell types"));
  EXPECT_THAT(message(whole + "POINT_DATA 3\nSCALARS a float 2000\n"), HasSubstr("2000 components"));
  EXPECT_THAT(message(whole + "POINT_DATA 3\nSPLINES a float\n"), AllOf(HasSubstr("a.vtk:12"), HasSubstr("SPLINES")));
}

TEST_F(LegacyFiles, OffsetsOfVersionFiveBeginAtZero) {
  const std::string head =
      "# vtk DataFile Version 5.1\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 float\n"
      "0 0 0 1 0 0 0 1 0\nCELLS 2 3\nOFFSETS vtktypeint64\n";
  const std::string tail = "\nCONNECTIVITY vtktypeint64\n0 1 2\nCELL_TYPES 1\n5\n";
  EXPECT_EQ(message(head + "0 3" + tail), "no error");
  EXPECT_THAT(message(head + "1 3" + tail), HasSubstr("first offset"));
}

}  // namespace
}  // namespace halfgrad
