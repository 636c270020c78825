#include "framework/io/geometry.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>

#include "framework/error.hpp"
#include "framework/io/formats.hpp"
#include "framework/io/mesh_file.hpp"

namespace halfgrad {

namespace {

constexpr CellType known_types[] = {
    {1, 0, 1, "vertex"},
    {2, 0, 0, "poly-vertex"},
    {3, 1, 2, "segment"},
    {4, 1, 0, "poly-line"},
    {5, 2, 3, "triangle"},
    {6, 2, 0, "triangle strip"},
    {7, 2, 0, "polygon"},
    {9, 2, 4, "quadrilateral"},
    {10, 3, 4, "tetrahedron"},
    {12, 3, 8, "hexahedron"},
    {13, 3, 6, "wedge"},
    {14, 3, 5, "pyramid"},
    {21, 1, 3, "quadratic segment"},
    {22, 2, 6, "quadratic triangle"},
    {23, 2, 8, "quadratic quadrilateral"},
    {24, 3, 10, "quadratic tetrahedron"},
    {25, 3, 20, "quadratic hexahedron"},
    {26, 3, 15, "quadratic wedge"},
    {27, 3, 13, "quadratic pyramid"},
    {28, 2, 9, "biquadratic quadrilateral"},
    {29, 3, 27, "triquadratic hexahedron"},
    {42, 3, 0, "polyhedron"},
};

std::vector<CellType> cell_types() {
  std::vector<CellType> types;
  Elements::for_each([&]<class E>() { types.push_back({E::vtk_id, E::dim, E::num_nodes, E::name}); });
  types.insert(types.end(), std::begin(known_types), std::end(known_types));
  return types;
}

bool is_registered(int vtk_id) {
  bool found = false;
  Elements::for_each([&]<class E>() { found = found || E::vtk_id == vtk_id; });
  return found;
}

std::string registered_elements() {
  std::string names;
  Elements::for_each(
      [&]<class E>() { names += fmt::format("{}{} ({})", names.empty() ? "" : ", ", E::name, E::vtk_id); });
  return names;
}

// First column from `gdim` on that is not constant, or -1.
int varying_column(const Points& points, int gdim) {
  if (points.rows() == 0) return -1;
  const double tolerance = 1e-12 * points.cwiseAbs().maxCoeff();
  for (int column = gdim; column < points.cols(); ++column)
    if ((points.col(column).array() - points(0, column)).abs().maxCoeff() > tolerance) return column;
  return -1;
}

Points first_columns(const Points& points, int gdim) { return points.leftCols(gdim); }

// Gathers the cells of one registered type into its block.
AnyBlock build_block(const Geometry& geometry, int vtk_id, Index num_cells) {
  AnyBlock any;
  Elements::for_each([&]<class E>() {
    if (E::vtk_id != vtk_id) return;
    ElementBlock<E> block;
    block.cells.resize(num_cells, E::num_nodes);
    Eigen::Index row = 0;
    for (Index c = 0; c < geometry.cells.num_rows(); ++c)
      if (geometry.vtk_ids[c] == vtk_id)
        std::copy_n(geometry.cells[c].data(), E::num_nodes, block.cells.row(row++).data());
    any = std::move(block);
  });
  return any;
}

}  // namespace

const PointArray* find_array(std::span<const PointArray> arrays, std::string_view name) {
  const auto found =
      std::find_if(arrays.begin(), arrays.end(), [&](const PointArray& array) { return array.name == name; });
  return found == arrays.end() ? nullptr : &*found;
}

const PointArray* find_array_like(std::span<const PointArray> arrays, std::span<const std::string_view> names) {
  const auto plain = [](std::string_view name) {
    std::string letters;
    for (char c : name)
      if (c != ' ' && c != '_') letters += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return letters;
  };
  for (const PointArray& array : arrays)
    for (std::string_view name : names)
      if (plain(array.name) == plain(name)) return &array;
  return nullptr;
}

const CellType* find_cell_type(int vtk_id) {
  static const std::vector<CellType> types = cell_types();
  const auto found =
      std::find_if(types.begin(), types.end(), [&](const CellType& type) { return type.vtk_id == vtk_id; });
  return found == types.end() ? nullptr : &*found;
}

void Geometry::add_cell(int vtk_id, std::span<const std::int64_t> nodes) {
  constexpr std::int64_t least = std::numeric_limits<Index>::min(), greatest = std::numeric_limits<Index>::max();
  for (std::int64_t node : nodes) cells.entries.push_back(static_cast<Index>(std::clamp(node, least, greatest)));
  cells.offsets.push_back(static_cast<Offset>(cells.entries.size()));
  vtk_ids.push_back(vtk_id);
}

void check(const Geometry& geometry, const std::filesystem::path& path) {
  const Points& vertices = geometry.vertices;
  if (vertices.rows() == 0) raise("{}: found no vertices", path.string());
  if (vertices.rows() > std::numeric_limits<Index>::max())
    raise("{}: found {} vertices, at most {} can be numbered", path.string(), vertices.rows(),
          std::numeric_limits<Index>::max());
  for (Eigen::Index v = 0; v < vertices.rows(); ++v)
    for (Eigen::Index a = 0; a < vertices.cols(); ++a)
      if (!std::isfinite(vertices(v, a)))
        raise("{}: vertex {} (counted from 0) has coordinate {}, expected finite ones", path.string(), v,
              vertices(v, a));
  for (Index c = 0; c < geometry.cells.num_rows(); ++c) {
    const auto nodes = geometry.cells[c];
    const CellType* type = find_cell_type(geometry.vtk_ids[c]);
    if (type == nullptr)
      raise("{}: cell {} has VTK type {}, which is not known", path.string(), c, geometry.vtk_ids[c]);
    if (type->num_nodes != 0 && static_cast<std::size_t>(type->num_nodes) != nodes.size())
      raise("{}: cell {} is a {} with {} nodes, expected {}", path.string(), c, type->name, nodes.size(),
            type->num_nodes);
    for (Index node : nodes)
      if (node < 0 || node >= vertices.rows())
        raise("{}: cell {} ({}) names vertex {}, the file has 0 to {}", path.string(), c, type->name, node,
              vertices.rows() - 1);
  }
}

Mesh build_mesh(Geometry geometry, const std::filesystem::path& path) {
  // Polygons with the number of nodes of an element are that element.
  constexpr int polygon = 7, triangle = 5, quadrilateral = 9;
  for (Index c = 0; c < geometry.cells.num_rows(); ++c)
    if (geometry.vtk_ids[c] == polygon && geometry.cells[c].size() <= 4 && geometry.cells[c].size() >= 3)
      geometry.vtk_ids[c] = geometry.cells[c].size() == 3 ? triangle : quadrilateral;
  int dim = 0;
  for (int id : geometry.vtk_ids) dim = std::max(dim, find_cell_type(id)->dim);
  if (dim == 0) raise("{}: found no cells, expected a mesh", path.string());
  // Types of highest dimension with their counts, in the order they appear in.
  std::vector<std::pair<int, Index>> types;
  for (int id : geometry.vtk_ids) {
    if (find_cell_type(id)->dim != dim) continue;
    const auto known = std::find_if(types.begin(), types.end(), [&](const auto& type) { return type.first == id; });
    if (known == types.end())
      types.emplace_back(id, 1);
    else
      ++known->second;
  }
  for (const auto& [id, count] : types)
    if (!is_registered(id))
      raise("{}: found {} cells of type {} (VTK {}), which is not a registered element; registered: {}", path.string(),
            count, find_cell_type(id)->name, id, registered_elements());
  if (geometry.vertices.cols() < dim)
    raise("{}: cells of dimension {} on vertices with {} coordinates", path.string(), dim, geometry.vertices.cols());
  const int column = varying_column(geometry.vertices, dim);
  if (dim == 1 && column >= 0)
    raise("{}: cells of dimension 1 with varying {}: curves in the plane or in space are not supported", path.string(),
          column == 1 ? "y" : "z");
  const int gdim = column >= 0 ? 3 : dim;
  std::vector<AnyBlock> blocks;
  for (const auto& [id, count] : types) blocks.push_back(build_block(geometry, id, count));
  try {
    return Mesh(first_columns(geometry.vertices, gdim), std::move(blocks));
  } catch (const Error& error) {
    raise("{}: {}", path.string(), error.what());
  }
}

PointSet build_point_set(Geometry geometry) {
  PointSet set;
  const bool has_corner_uv = geometry.corner_uv.rows() > 0;
  std::vector<double> uv;
  for (Index c = 0; c < geometry.cells.num_rows(); ++c) {
    const int id = geometry.vtk_ids[c];
    if (find_cell_type(id)->dim != 2 || id == 6) continue;  // strips are no polygons
    const auto nodes = geometry.cells[c];
    set.faces.entries.insert(set.faces.entries.end(), nodes.begin(), nodes.end());
    if (has_corner_uv)
      for (Offset corner = geometry.cells.offsets[c]; corner < geometry.cells.offsets[c + 1]; ++corner)
        uv.insert(uv.end(), {geometry.corner_uv(corner, 0), geometry.corner_uv(corner, 1)});
    set.faces.offsets.push_back(static_cast<Offset>(set.faces.entries.size()));
  }
  set.points = std::move(geometry.vertices);
  set.arrays = std::move(geometry.arrays);
  constexpr std::array<std::string_view, 4> names = {"uv", "TCoords", "Texture Coordinates", "TEXCOORD_0"};
  if (has_corner_uv)
    set.corner_uv = Eigen::Map<const Points>(uv.data(), static_cast<Eigen::Index>(uv.size() / 2), 2);
  else if (const PointArray* array = find_array_like(set.arrays, names); array != nullptr && array->values.cols() >= 2)
    set.corner_uv = array->values(set.faces.entries, Eigen::seqN(0, 2));
  set.obj_text = std::move(geometry.obj_text);
  return set;
}

Mesh read_mesh(const std::filesystem::path& path) {
  Geometry geometry = find_format(path, FormatUse::read_mesh).read(path);
  check(geometry, path);
  return build_mesh(std::move(geometry), path);
}

RestShape read_rest_shape(const std::filesystem::path& path) {
  const Format& format = find_format(path, FormatUse::read_mesh);
  if (format.read_grid != nullptr) return format.read_grid(path);
  return read_mesh(path);
}

PointSet read_points(const std::filesystem::path& path) {
  Geometry geometry = find_format(path, FormatUse::read_points).read(path);
  check(geometry, path);
  return build_point_set(std::move(geometry));
}

Points in_dimension(const Points& points, int gdim, const std::string& name) {
  if (points.cols() < gdim) raise("{}: points with {} coordinates, expected {}", name, points.cols(), gdim);
  if (const int column = varying_column(points, gdim); column >= 0)
    raise("{}: points with varying {}, expected points of a {}-dimensional mesh", name, column == 1 ? "y" : "z", gdim);
  return first_columns(points, gdim);
}

}  // namespace halfgrad
