#include "framework/io/vtk_xml.hpp"

#include <pugixml.hpp>

#include "framework/error.hpp"
#include "framework/io/cursor.hpp"
#include "framework/io/vtk_cells.hpp"
#include "framework/io/vtk_xml_data.hpp"

namespace halfgrad {

namespace {

VtkCells read_cells(const VtkXmlFile& file, const std::string& name, pugi::xml_node node, std::int64_t count) {
  VtkCells cells{name, {0}, {}};
  const pugi::xml_node offsets = file.find_array(node, "offsets"), nodes = file.find_array(node, "connectivity");
  if (!offsets || !nodes) file.fail(node, "has no DataArray of the names offsets and connectivity");
  const std::vector<std::int64_t> ends = file.integers(offsets, count);
  cells.offsets.insert(cells.offsets.end(), ends.begin(), ends.end());
  if (cells.offsets.back() < 0) file.fail(offsets, fmt::format("found {} as the last offset", cells.offsets.back()));
  cells.nodes = file.integers(nodes, cells.offsets.back());
  return cells;
}

// Appends the rows of one piece.
void append_rows(Points& rows, const std::vector<double>& more) {
  const Eigen::Index count = static_cast<Eigen::Index>(more.size()) / rows.cols(), before = rows.rows();
  rows.conservativeResize(before + count, rows.cols());
  rows.bottomRows(count) = Eigen::Map<const Points>(more.data(), count, rows.cols());
}

// The numeric point data of a piece; the first piece decides the names, and widths may not change.
void append_arrays(const VtkXmlFile& file, pugi::xml_node piece, std::int64_t num_points, Geometry& geometry) {
  const bool is_first = geometry.vertices.rows() == num_points;
  for (pugi::xml_node node : piece.child("PointData").children("DataArray")) {
    const std::string name = node.attribute("Name").as_string();
    const std::string_view type = node.attribute("type").as_string();
    if (name.empty() || type == "String" || type == "Bit") continue;
    const std::int64_t columns = node.attribute("NumberOfComponents") ? file.count(node, "NumberOfComponents") : 1;
    if (columns < 1 || columns > 1000) file.fail(node, fmt::format("found {} components", columns));
    if (is_first && find_array(geometry.arrays, name) == nullptr)
      geometry.arrays.push_back({name, Values<double>(0, columns)});
    for (PointArray& array : geometry.arrays)
      if (array.name == name && array.values.cols() == columns &&
          array.values.rows() + num_points == geometry.vertices.rows())
        append_rows(array.values, file.numbers(node, columns * num_points));
  }
}

// The file that a parallel one consists of, relative to it.
std::filesystem::path only_piece(const VtkXmlFile& file, pugi::xml_node data, const std::filesystem::path& path) {
  const auto pieces = data.children("Piece");
  const auto count = std::distance(pieces.begin(), pieces.end());
  if (count != 1)
    file.fail(data, fmt::format("found {} pieces, expected one: pieces repeat the vertices they share, so merge them "
                                "first (ParaView: Merge Blocks, or a run with one process)",
                                count));
  const std::filesystem::path piece = data.child("Piece").attribute("Source").as_string();
  if (piece.extension() != ".vtu" && piece.extension() != ".vtp")
    file.fail(data, fmt::format("found the piece \"{}\", expected a .vtu or .vtp file", shown(piece.string())));
  return path.parent_path() / piece;
}

Geometry read_serial(const InputFile& input, const VtkXmlFile& file) {
  const std::string name = input.path().string();
  const std::string_view type = file.root().attribute("type").as_string();
  const bool is_grid = type == "UnstructuredGrid";
  if (!is_grid && type != "PolyData")
    file.fail(file.root(), fmt::format("found type \"{}\", expected UnstructuredGrid or PolyData", shown(type)));
  const pugi::xml_node data = file.child(file.root(), is_grid ? "UnstructuredGrid" : "PolyData");

  Geometry geometry;
  geometry.vertices.resize(0, 3);
  for (pugi::xml_node piece : data.children("Piece")) {
    const std::int64_t first_vertex = geometry.vertices.rows(), num_points = file.count(piece, "NumberOfPoints");
    // Three numbers a point, at best compressed 1000-fold: whatever exceeds this is refused before it is multiplied.
    if (static_cast<std::uint64_t>(num_points) > 1000 * input.bytes().size())
      file.fail(piece, fmt::format("found {} points in a file of {} bytes", num_points, input.bytes().size()));
    if (num_points == 0) continue;
    const pugi::xml_node points = file.child(file.child(piece, "Points"), "DataArray");
    if (const std::int64_t width = file.count(points, "NumberOfComponents"); width != 3)
      file.fail(points, fmt::format("found {} components, expected 3", width));
    append_rows(geometry.vertices, file.numbers(points, 3 * num_points));
    append_arrays(file, piece, num_points, geometry);
    if (is_grid) {
      const std::int64_t num_cells = file.count(piece, "NumberOfCells");
      if (num_cells == 0) continue;
      const pugi::xml_node node = file.child(piece, "Cells");
      const VtkCells cells = read_cells(file, name, node, num_cells);
      const pugi::xml_node types = file.find_array(node, "types");
      if (!types) file.fail(node, "has no DataArray of the name types");
      cells.add_to(geometry, file.integers(types, num_cells), first_vertex);
    } else {
      constexpr std::tuple<const char*, const char*, int> kinds[] = {{"Verts", "NumberOfVerts", 2},
                                                                     {"Lines", "NumberOfLines", 4},
                                                                     {"Strips", "NumberOfStrips", 6},
                                                                     {"Polys", "NumberOfPolys", 7}};
      for (const auto& [tag, attribute, id] : kinds)
        if (piece.attribute(attribute) && file.count(piece, attribute) > 0)
          read_cells(file, name, file.child(piece, tag), file.count(piece, attribute))
              .add_to(geometry, id, first_vertex);
    }
  }
  // Data of some pieces only is data of no point set.
  std::erase_if(geometry.arrays,
                [&](const PointArray& array) { return array.values.rows() != geometry.vertices.rows(); });
  return geometry;
}

}  // namespace

Geometry read_vtk_xml(const std::filesystem::path& path) {
  const InputFile input(path);
  const VtkXmlFile file(input);
  const std::string type = file.root().attribute("type").as_string();
  if (type != "PUnstructuredGrid" && type != "PPolyData") return read_serial(input, file);
  const InputFile piece(only_piece(file, file.child(file.root(), type.c_str()), path));
  return read_serial(piece, VtkXmlFile(piece));
}

}  // namespace halfgrad
