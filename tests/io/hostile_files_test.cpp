// Files that a fuzzer or an enemy makes: refused in words, in time and memory that the file's size bounds.
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "framework/io/binding_file.hpp"
#include "framework/io/frame_source.hpp"
#include "framework/io/mesh_file.hpp"
#include "framework/io/npy.hpp"
#include "framework/io/point_set.hpp"
#include "framework/json_values.hpp"
#include "io/io_support.hpp"

namespace halfgrad {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class HostileFiles : public FileTest {};

// Of two triangles that make a square.
constexpr BindingSizes square{.gdim = 2, .num_vertices = 4, .num_cells = 2, .num_points = 4};

// Four points in it, one of them outside and one not found, with a stencil for every vertex.
SavedBinding whole_binding() {
  SavedBinding binding{"{}", "print", {}, Reconstruction{}};
  Embedding& embedding = std::get<Embedding>(binding.places);
  embedding.gdim = 2;
  embedding.cells = {0, 1, 1, -1};
  embedding.local = Points::Constant(4, 2, 0.25);
  embedding.status = {PointStatus::inside, PointStatus::boundary, PointStatus::outside, PointStatus::not_found};
  embedding.outside = {{2, 0.5, Vector::Zero(2)}, {3, 1.5, Vector::Zero(2)}};
  GradientStencilTable& table = binding.reconstruction->stencils;
  table.gdim = 2;
  table.vertices = {0, 1, 2, 3};
  table.offsets = {0, 1, 2, 3, 4};
  table.neighbors = {1, 2, 3, 0};
  table.weights.assign(8, 1.0);
  table.diagnostics.assign(4, {StencilRule::full_fit});
  return binding;
}

TEST_F(HostileFiles, BindingsWhoseTablesContradictEachOtherAreRefused) {
  const auto message = [&](auto&& damage) {
    SavedBinding binding = whole_binding();
    damage(binding);
    write_binding(file("a.hgb"), binding);
    return message_of([&] { read_binding(file("a.hgb"), square, "print"); });
  };
  EXPECT_EQ(message([](SavedBinding&) {}), "no error");
  using S = SavedBinding;
  const auto places = [](S& b) -> Embedding& { return std::get<Embedding>(b.places); };
  EXPECT_THAT(message([&](S& b) { places(b).cells[0] = -1; }), AllOf(HasSubstr("a.hgb"), HasSubstr("point 0")));
  EXPECT_THAT(message([&](S& b) { places(b).cells[3] = 0; }), HasSubstr("point 3"));
  EXPECT_THAT(message([&](S& b) { places(b).cells[1] = 2; }), HasSubstr("\"cells\" holds 2"));
  EXPECT_THAT(message([&](S& b) { places(b).local(1, 0) = std::nan(""); }), HasSubstr("\"local\""));
  EXPECT_THAT(message([&](S& b) { places(b).outside[0].distance = std::nan(""); }), HasSubstr("distances"));
  EXPECT_THAT(message([&](S& b) { places(b).outside[0].point = 1; }), HasSubstr("\"outside_points\""));
  EXPECT_THAT(message([&](S& b) { std::swap(places(b).outside[0], places(b).outside[1]); }),
              HasSubstr("\"outside_points\""));
  EXPECT_THAT(message([&](S& b) { places(b).outside.pop_back(); }), HasSubstr("\"outside_points\""));
  EXPECT_THAT(message([](S& b) { b.reconstruction->stencils.diagnostics.pop_back(); }),
              AllOf(HasSubstr("\"rules\""), HasSubstr("3 entries")));
  EXPECT_THAT(message([](S& b) { b.reconstruction->stencils.weights.pop_back(); }), HasSubstr("\"weights\""));
  EXPECT_THAT(message([](S& b) { b.reconstruction->stencils.offsets[1] = 3; }), HasSubstr("\"offsets\""));
  EXPECT_THAT(message([](S& b) { b.reconstruction->stencils.neighbors[0] = 4; }), HasSubstr("\"neighbors\" holds 4"));
}

TEST_F(HostileFiles, FeetAndWeightsThatContradictTheirSizesAreRefused) {
  // Every point by the three vertices of a cell.
  SurfaceEmbedding feet;
  feet.feet.gdim = 2;
  feet.feet.num_vertices = 4;
  feet.feet.offsets = {0, 3, 6, 9, 12};
  feet.feet.vertices = {0, 1, 2, 0, 1, 2, 0, 2, 3, 0, 2, 3};
  feet.feet.weights.assign(12, 1.0 / 3);
  feet.feet.arms.assign(24, 0.25);
  feet.cells = {0, 0, 1, 1};
  feet.distance = {0, 0.5, -0.5, 0};
  const auto of_feet = [&](auto&& damage) {
    SurfaceEmbedding damaged = feet;
    damage(damaged);
    write_binding(file("a.hgb"), {"{}", "print", damaged, {}});
    return message_of([&] { read_binding(file("a.hgb"), square, "print"); });
  };
  using F = SurfaceEmbedding;
  EXPECT_EQ(of_feet([](F&) {}), "no error");
  const SavedBinding read = read_binding(file("a.hgb"), square, "print");
  EXPECT_EQ(std::get<F>(read.places).feet.arms, feet.feet.arms);
  EXPECT_EQ(std::get<F>(read.places).distance, feet.distance);
  EXPECT_THAT(of_feet([](F& f) { f.cells[1] = 2; }), HasSubstr("\"cells\" holds 2"));
  EXPECT_THAT(of_feet([](F& f) { f.cells[1] = -1; }), HasSubstr("\"cells\" holds -1"));
  EXPECT_THAT(of_feet([](F& f) { f.feet.vertices[0] = 4; }), HasSubstr("\"vertices\" holds 4"));
  EXPECT_THAT(of_feet([](F& f) { f.feet.offsets[1] = 13; }), HasSubstr("\"offsets\""));
  EXPECT_THAT(of_feet([](F& f) { f.feet.arms.pop_back(); }), HasSubstr("\"arms\""));
  EXPECT_THAT(of_feet([](F& f) { f.feet.weights[3] = std::nan(""); }), HasSubstr("\"weights\""));
  EXPECT_THAT(of_feet([](F& f) { f.distance.pop_back(); }), HasSubstr("\"distance\""));

  using Weights = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  const auto of_weights = [&](Weights weights) {
    weights.makeCompressed();
    write_binding(file("a.hgb"), {"{}", "print", weights, {}});
    return message_of([&] { read_binding(file("a.hgb"), square, "print"); });
  };
  Weights weights(4, 4);
  for (int p = 0; p < 4; ++p) weights.insert(p, p) = 1;
  EXPECT_EQ(of_weights(weights), "no error");
  EXPECT_EQ(std::get<Weights>(read_binding(file("a.hgb"), square, "print").places).toDense(), weights.toDense());
  Weights wider(4, 5);
  wider.insert(0, 4) = 1;
  EXPECT_THAT(of_weights(wider), HasSubstr("\"vertices\" holds 4"));
  EXPECT_THAT(of_weights(Weights(3, 4)), HasSubstr("\"offsets\""));
}

TEST_F(HostileFiles, BindingsAreWhatTheWriterWritesAndNothingElse) {
  const auto message = [&](const std::string& bytes) {
    file("b.hgb", bytes);
    return message_of([&] { read_binding(file("b.hgb"), square, "print"); });
  };
  // CBOR: an array of 2^62 entries, a hundred thousand nested arrays, as many nested objects.
  EXPECT_THAT(message("\x9b\x40" + std::string(7, '\0')), AllOf(HasSubstr("b.hgb"), HasSubstr("no binding")));
  EXPECT_THAT(message(std::string(100'000, '\x81')), HasSubstr("no binding"));
  std::string objects;
  for (int i = 0; i < 100'000; ++i) objects += "\xa1\x61x";
  EXPECT_THAT(message(objects), HasSubstr("no binding"));
  EXPECT_THAT(message("\x01"), HasSubstr("no binding"));
  // A version that is a text and no UTF-8.
  EXPECT_THAT(message("\xa1\x70halfgrad_binding\x61\xff"), HasSubstr("version"));
}

// A fuzzer that starts from bindings of an older version gets no farther than the version.
TEST_F(HostileFiles, BindingsOfTheFuzzersCorpusAreReadWhole) {
  for (const char* name : {"linear", "plain", "adaptive", "weights", "feet"})
    EXPECT_EQ(message_of([&] {
                read_binding(std::string(PROJECT_SOURCE_DIR "/tests/fuzz/corpus/binding/") + name, square, "print");
              }),
              "no error")
        << name;
}

TEST_F(HostileFiles, ElementsBeforeTheirNodesAreRefused) {
  EXPECT_THAT(
      message_of([&] {
        read_mesh(file("a.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Elements\n1\n1 15 0 1\n$EndElements\n"));
      }),
      AllOf(HasSubstr("a.msh:6"), HasSubstr("$Nodes before")));
}

TEST_F(HostileFiles, ArraysWithoutColumnsHaveNoRows) {
  std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000000000, 0), }";
  header.resize(118, ' ');
  file("a.npy", std::string("\x93NUMPY\x01\x00\x76\x00", 10) + header);
  EXPECT_THAT(message_of([&] { read_npy(file("a.npy")); }),
              AllOf(HasSubstr("a.npy"), HasSubstr("(1000000000000000000, 0)")));
}

// NumPy arrays of version 1 and 2 by their header.
std::string npy(std::string header, int version = 1) {
  header.resize(118, ' ');
  const std::string size = version == 1 ? std::string("\x76\x00", 2) : std::string("\x76\x00\x00\x00", 4);
  return "\x93NUMPY" + std::string(1, static_cast<char>(version)) + '\0' + size + header;
}

TEST_F(HostileFiles, NumpyHeadersAreCheckedPartByPart) {
  const auto message = [&](const std::string& header) {
    return message_of([&] { read_npy(file("a.npy", npy(header))); });
  };
  EXPECT_THAT(message("{'descr': '<i4', 'fortran_order': False, 'shape': (1, 2), }"),
              AllOf(HasSubstr("a.npy"), HasSubstr("'<i4'")));
  EXPECT_THAT(message("{'descr': '<f8', 'fortran_order': Maybe, 'shape': (1, 2), }"), HasSubstr("Maybe"));
  EXPECT_THAT(message("{'descr': '<f8', 'fortran_order': False, 'shape': 7, }"), HasSubstr("a tuple"));
  EXPECT_THAT(message("{'descr': '<f8', 'fortran_order': False, 'shape': (-1, 2), }"), HasSubstr("\"-1\""));
  EXPECT_THAT(message("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 2), }"), HasSubstr("16 bytes"));
  const std::string eight(8, '\0');
  EXPECT_THAT(message_of([&] {
                read_npy(file("a.npy", npy("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 1, 1), }") + eight));
              }),
              HasSubstr("(1, 1, 1)"));
  const Values<double> read =
      read_npy(file("a.npy", npy("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 1), }", 2) + eight));
  EXPECT_EQ(read, Values<double>::Zero(1, 1));
  EXPECT_THAT(message_of([&] { read_npy(file("a.npy", npy("", 4))); }), HasSubstr("version 4"));
}

TEST_F(HostileFiles, FilesOfPointsAreRefusedWithTheirLineOrByte) {
  const std::string ply = "ply\nformat ascii 1.0\n", vertices = "element vertex 1\nproperty float x\n";
  const std::vector<std::array<std::string, 3>> cases = {
      {"a.ply", "ply\nformat text 1.0\n", "binary_little_endian"},
      {"a.ply", ply + "element vertex 1\nproperty complex x\nend_header\n", "\"complex\""},
      {"a.ply", ply + vertices + "element vertex 1\n", "a second element"},
      {"a.ply", ply + "elements vertex 1\n", "property or end_header"},
      {"a.ply",
       ply + vertices + "property float y\nproperty float z\nelement face 1\nproperty list int int vertex_indices\n" +
           "end_header\n0 0 0\n-3 0 0 0\n",
       "found -3"},
      {"a.obj", "v 0 0 0\nf x/1 1 1\n", "\"x/1\""},
      {"a.stl", std::string(80, ' ') + std::string("\x02\0\0\0", 4) + std::string(50, '\0'), "found 2 facets"},
      {"a.vtp", "<VTKFile type=\"PolyData\" header_type=\"UInt8\"><PolyData/></VTKFile>", "header_type \"UInt8\""},
      {"a.vtp",
       "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"1\"><Points><DataArray type=\"Float32\" "
       "NumberOfComponents=\"2\"> 0 0 </DataArray></Points></Piece></PolyData></VTKFile>",
       "found 2 components, expected 3"},
      {"a.vtp",
       "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"9\"><Points><DataArray type=\"Float32\" "
       "NumberOfComponents=\"3\"> 0 0 </DataArray></Points></Piece></PolyData></VTKFile>",
       "expected 27 values"},
      {"a.vti", "<VTKFile type=\"StructuredGrid\"><StructuredGrid/></VTKFile>", "ImageData or RectilinearGrid"},
      {"a.vti", "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 1\"/></VTKFile>", "found 2 numbers"},
      {"a.vti", "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 1 0 1 0 0.5\"/></VTKFile>", "whole numbers"},
      {"a.vti", "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 1 0 1 1 0\"/></VTKFile>", "axis 2"},
      {"a.vti",
       "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 1 0 1 0 1\" Direction=\"0 1 0 1 0 0 0 0 1\"><Piece/>"
       "</ImageData></VTKFile>",
       "rotated"},
  };
  for (const auto& [name, contents, words] : cases)
    EXPECT_THAT(message_of([&] { read_points(file(name, contents)); }), AllOf(HasSubstr(name), HasSubstr(words)))
        << contents;
}

// One block of 8 bytes, compressed; the header's words are set by the caller.
TEST_F(HostileFiles, CompressedBlocksStayWithinTheArray) {
  const auto message = [&](std::uint32_t num_blocks, std::uint32_t block_size, std::uint32_t last_size) {
    const std::string words = bytes<std::uint32_t>({num_blocks, block_size, last_size, 4}) + "abcd";
    return message_of([&] {
      read_points(file("a.vtp",
                       "<VTKFile type=\"PolyData\" compressor=\"vtkZLibDataCompressor\"><PolyData><Piece "
                       "NumberOfPoints=\"1\"><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" "
                       "format=\"appended\" offset=\"0\"/></Points></Piece></PolyData><AppendedData "
                       "encoding=\"raw\">_" +
                           words + "</AppendedData></VTKFile>"));
    });
  };
  EXPECT_THAT(message(1, 24, 0), HasSubstr("compressed block 0 is damaged"));
  EXPECT_THAT(message(1, 25, 0), HasSubstr("block 0 of 25 bytes exceeds the 24 expected"));
  EXPECT_THAT(message(1, 24, 99), HasSubstr("block 0 of 99 bytes"));
  EXPECT_THAT(message(1'000'000, 24, 0), HasSubstr("1000000 compressed blocks"));
}

TEST_F(HostileFiles, SequencesAreRefusedWithWhatIsWrong) {
  const auto message = [&](const std::string& name, const std::string& contents) {
    return message_of([&] { open_frames(file(name, contents).string()); });
  };
  const std::string cache = std::string("POINTCACHE2\0", 12) + bytes<std::int32_t>({1, 0, 0, 0, 1});
  EXPECT_THAT(message("a.pc2", cache), AllOf(HasSubstr("a.pc2"), HasSubstr("0 points in 1 frames")));
  const auto collection = [](const std::string& steps) {
    return "<VTKFile type=\"Collection\"><Collection>" + steps + "</Collection></VTKFile>";
  };
  EXPECT_THAT(message("a.pvd", collection("<DataSet timestep=\"soon\" file=\"a.vtp\"/>")), HasSubstr("\"soon\""));
  EXPECT_THAT(message("a.pvd", collection("<DataSet timestep=\"1\" file=\"a.vtp\"/>\n"
                                          "<DataSet timestep=\"1\" file=\"b.vtp\"/>")),
              AllOf(HasSubstr("b.vtp"), HasSubstr("one file a timestep")));
  EXPECT_THAT(message_of([&] { open_frames(file("%d/a.obj").string()); }), HasSubstr("found it in the folder"));
  EXPECT_THAT(message_of([&] { open_frames(file("%d_%d.obj").string()); }), HasSubstr("found two"));
  EXPECT_THAT(message_of([&] { open_frames(folder_.string()); }),
              AllOf(HasSubstr("found a folder"), HasSubstr("*.vtu")));
  EXPECT_THAT(message_of([&] { read_points(folder_); }), HasSubstr("found a folder, expected a file"));
}

TEST_F(HostileFiles, BindingsKeepBlendsAndSettingsAndBelongToTheirShape) {
  SavedBinding binding = whole_binding();
  binding.settings = "{\"points\": 3}";
  AdaptiveBlend& blend = binding.reconstruction->blend.emplace();
  blend.averaging = binding.reconstruction->stencils;
  blend.beyond.gdim = 2;
  blend.prediction_share = 0.25;
  blend.caution = {1, 2, 3, 0.1};
  blend.edge_offsets = {0, 1, 2, 3, 4};
  blend.edge_rows = {1, 2, 3, 0};
  blend.edges = {1, 0, 0, 1, -1, 0, 0, -1};
  write_binding(file("a.hgb"), binding);
  const SavedBinding read = read_binding(file("a.hgb"), square, "print");
  ASSERT_TRUE(read.reconstruction && read.reconstruction->blend);
  EXPECT_EQ(read.reconstruction->blend->caution, blend.caution);
  EXPECT_EQ(read.reconstruction->blend->edges, blend.edges);
  EXPECT_EQ(read.reconstruction->blend->edge_rows, blend.edge_rows);
  EXPECT_EQ(read.reconstruction->blend->prediction_share, 0.25);
  EXPECT_EQ(read.reconstruction->blend->averaging.neighbors, blend.averaging.neighbors);
  EXPECT_EQ(read_binding_settings(file("a.hgb")), binding.settings);
  EXPECT_THAT(message_of([&] { read_binding(file("a.hgb"), square, "other"); }),
              AllOf(HasSubstr("another rest mesh or other points"), HasSubstr("print"), HasSubstr("other")));
}

TEST_F(HostileFiles, DeeplyNestedJsonIsRefused) {
  EXPECT_THAT(message_of([] { parse_json(std::string(100'000, '['), "x.json"); }),
              AllOf(HasSubstr("x.json"), HasSubstr("nested deeper than 100")));
  EXPECT_THAT(message_of([] { parse_json("{\"a\": }", "x.json"); }), AllOf(HasSubstr("x.json"), HasSubstr("not JSON")));
  EXPECT_EQ(parse_json("[[1]]", "x.json")[0][0], 1);
}

TEST_F(HostileFiles, NumbersBeyondTheirTypeAreNamed) {
  const nlohmann::json object = {{"big", 5'000'000'000}, {"million", 1e6}, {"half", 0.5}, {"huge", 1e300}};
  JsonReader reader(object, "/x");
  EXPECT_EQ(small_integer(reader, "million", 0), 1'000'000);
  EXPECT_EQ(small_integer(reader, "absent", 7), 7);
  EXPECT_THAT(message_of([&] { small_integer(reader, "big", 0); }),
              AllOf(HasSubstr("/x/big"), HasSubstr("5000000000")));
  EXPECT_THAT(message_of([&] { small_integer(reader, "half", 0); }), HasSubstr("whole number"));
  EXPECT_THAT(message_of([&] { small_integer(reader, "huge", 0); }), HasSubstr("whole number"));
}

// A grid that nobody stored: its cells are listed only where that is bounded.
TEST_F(HostileFiles, GridsOfAThousandMillionCellsAreNotListed) {
  file("a.vti",
       "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 1000 0 1000 0 1000\" Origin=\"0 0 0\" "
       "Spacing=\"1 1 1\"><Piece Extent=\"0 1000 0 1000 0 1000\"/></ImageData></VTKFile>");
  EXPECT_EQ(std::get<Grid>(read_rest_shape(file("a.vti"))).num_cells(), 1'000'000'000);
  for (const std::string& message :
       {message_of([&] { read_mesh(file("a.vti")); }), message_of([&] { read_points(file("a.vti")); })})
    EXPECT_THAT(message, AllOf(HasSubstr("a.vti"), HasSubstr("1000000000 cells")));
}

}  // namespace
}  // namespace halfgrad
