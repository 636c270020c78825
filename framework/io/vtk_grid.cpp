#include "framework/io/vtk_grid.hpp"

#include <cmath>
#include <pugixml.hpp>

#include "framework/error.hpp"
#include "framework/io/cursor.hpp"
#include "framework/io/vtk_xml_data.hpp"

namespace halfgrad {

namespace {

// The numbers of an attribute, `count` of them.
std::vector<double> attribute_numbers(const VtkXmlFile& file, pugi::xml_node node, const char* name, int count) {
  std::vector<double> numbers;
  const std::string_view text = node.attribute(name).as_string();
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t begin = std::min(text.find_first_not_of(" \t\r\n", at), text.size());
    const std::size_t end = std::min(text.find_first_of(" \t\r\n", begin), text.size());
    at = end;
    if (begin == end) continue;
    double value = 0;
    if (!parse_number(text.substr(begin, end - begin), value))
      file.fail(node, fmt::format("found {}=\"{}\", expected {} numbers", name, shown(text), count));
    numbers.push_back(value);
  }
  if (static_cast<int>(numbers.size()) != count)
    file.fail(node, fmt::format("found {} numbers in {}, expected {}", numbers.size(), name, count));
  return numbers;
}

// First and last plane along each axis.
std::array<int, 6> extent_of(const VtkXmlFile& file, pugi::xml_node node, const char* name) {
  const std::vector<double> numbers = attribute_numbers(file, node, name, 6);
  std::array<int, 6> extent{};
  for (int i = 0; i < 6; ++i) {
    if (!(std::abs(numbers[i]) < 1e9) || numbers[i] != std::floor(numbers[i]))
      file.fail(node, fmt::format("found {} in {}, expected whole numbers", numbers[i], name));
    extent[i] = static_cast<int>(numbers[i]);
  }
  for (int a = 0; a < 3; ++a)
    if (extent[2 * a + 1] < extent[2 * a])
      file.fail(node, fmt::format("found {} planes along axis {} in {}, expected at least 1",
                                  extent[2 * a + 1] - extent[2 * a] + 1, a, name));
  return extent;
}

std::vector<GridAxis> image_axes(const VtkXmlFile& file, pugi::xml_node data, const std::array<int, 6>& extent) {
  std::vector<double> origin(3, 0), spacing(3, 1);
  if (data.attribute("Origin")) origin = attribute_numbers(file, data, "Origin", 3);
  if (data.attribute("Spacing")) spacing = attribute_numbers(file, data, "Spacing", 3);
  if (data.attribute("Direction")) {
    const std::vector<double> direction = attribute_numbers(file, data, "Direction", 9);
    for (int i = 0; i < 9; ++i)
      if (direction[i] != (i % 4 == 0 ? 1 : 0)) file.fail(data, "found a rotated image, expected axes along x, y, z");
  }
  std::vector<GridAxis> axes(3);
  for (int a = 0; a < 3; ++a)
    axes[a] = {extent[2 * a + 1] - extent[2 * a], origin[a] + extent[2 * a] * spacing[a], spacing[a], {}};
  return axes;
}

std::vector<GridAxis> rectilinear_axes(const VtkXmlFile& file, pugi::xml_node piece, const std::array<int, 6>& extent) {
  std::vector<GridAxis> axes(3);
  pugi::xml_node array = file.child(file.child(piece, "Coordinates"), "DataArray");
  for (int a = 0; a < 3; ++a) {
    if (!array) file.fail(piece, fmt::format("found {} arrays of coordinates, expected 3", a));
    axes[a].num_cells = extent[2 * a + 1] - extent[2 * a];
    axes[a].planes = file.numbers(array, axes[a].num_cells + std::int64_t{1});
    array = array.next_sibling("DataArray");
  }
  return axes;
}

}  // namespace

Grid read_vtk_grid(const std::filesystem::path& path) {
  const InputFile input(path);
  const VtkXmlFile file(input);
  const std::string_view type = file.root().attribute("type").as_string();
  const bool is_image = type == "ImageData";
  if (!is_image && type != "RectilinearGrid")
    file.fail(file.root(), fmt::format("found type \"{}\", expected ImageData or RectilinearGrid", shown(type)));
  const pugi::xml_node data = file.child(file.root(), is_image ? "ImageData" : "RectilinearGrid");
  const std::array<int, 6> extent = extent_of(file, data, "WholeExtent");
  const pugi::xml_node piece = file.child(data, "Piece");
  if (piece.attribute("Extent") && extent_of(file, piece, "Extent") != extent)
    file.fail(piece, "found a piece of the extent, expected one piece that is the whole");
  std::vector<GridAxis> axes = is_image ? image_axes(file, data, extent) : rectilinear_axes(file, piece, extent);
  while (!axes.empty() && axes.back().num_cells == 0) axes.pop_back();
  double num_cells = 1;
  for (const GridAxis& axis : axes) {
    if (axis.num_cells == 0) file.fail(data, "found an axis without cells before one with cells");
    num_cells *= axis.num_cells;
  }
  try {
    const pugi::xml_node hidden = file.find_array(piece.child("CellData"), "vtkGhostType");
    if (!hidden) return Grid(std::move(axes));
    if (num_cells > 2e9) file.fail(hidden, fmt::format("found flags of {} cells, at most 2e9 are read", num_cells));
    const std::vector<std::int64_t> flags = file.integers(hidden, static_cast<std::int64_t>(num_cells));
    constexpr std::int64_t hidden_cell = 32;
    std::vector<GridPlace> occupied;
    GridPlace place{};
    for (const std::int64_t flag : flags) {
      if ((flag & hidden_cell) == 0) occupied.push_back(place);
      for (std::size_t a = 0; a < axes.size() && ++place[a] == axes[a].num_cells; ++a) place[a] = 0;
    }
    if (occupied.size() == flags.size()) return Grid(std::move(axes));
    return Grid(std::move(axes), occupied);
  } catch (const Error& error) {
    // What the grid finds in the axes names no file.
    if (std::string_view(error.what()).starts_with(path.string())) throw;
    raise("{}: {}", path.string(), error.what());
  }
}

Geometry read_vtk_grid_cells(const std::filesystem::path& path) {
  const Grid grid = read_vtk_grid(path);
  // A file of a hundred bytes can name a grid of any size.
  constexpr Index most_listed = 100'000'000;
  if (grid.num_cells() > most_listed)
    raise("{}: a grid of {} cells: at most {} are listed one by one", path.string(), grid.num_cells(), most_listed);
  const Mesh mesh = grid.mesh();
  Geometry geometry;
  geometry.vertices = Points::Zero(mesh.num_vertices(), 3);
  geometry.vertices.leftCols(mesh.gdim()) = mesh.vertices();
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) {
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
      std::array<std::int64_t, E::num_nodes> nodes;
      for (int i = 0; i < E::num_nodes; ++i) nodes[i] = block.cells(c, i);
      geometry.add_cell(E::vtk_id, nodes);
    }
  });
  return geometry;
}

}  // namespace halfgrad
