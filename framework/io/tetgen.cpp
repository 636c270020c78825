#include "framework/io/tetgen.hpp"

#include "framework/io/cursor.hpp"

namespace halfgrad {

Geometry read_tetgen(const std::filesystem::path& path) {
  Geometry geometry;
  const InputFile node_file(std::filesystem::path(path).replace_extension(".node"));
  Cursor nodes(node_file, '#');
  std::int64_t num_vertices = nodes.integer("the number of vertices");
  const std::int64_t dim = nodes.integer("the dimension");
  if (dim != 2 && dim != 3) nodes.fail_at_line("found dimension {}, expected 2 or 3", dim);
  const std::int64_t num_attributes = nodes.integer("the number of attributes");
  const std::int64_t num_markers = nodes.integer("the number of boundary markers");
  if (num_attributes < 0 || (num_markers != 0 && num_markers != 1))
    nodes.fail_at_line("found {} attributes and {} boundary markers, expected a count and 0 or 1", num_attributes,
                       num_markers);
  num_vertices = nodes.count(num_vertices, 2 * static_cast<std::size_t>(dim) + 2, "vertices");
  geometry.vertices.resize(num_vertices, dim);
  std::int64_t base = 0;
  for (std::int64_t v = 0; v < num_vertices; ++v) {
    const std::int64_t number = nodes.integer("a vertex number");
    if (v == 0) base = number;
    if (base != 0 && base != 1) nodes.fail_at_line("found {} as the first vertex number, expected 0 or 1", base);
    if (number != base + v) nodes.fail_at_line("found vertex number {}, expected {}", number, base + v);
    for (std::int64_t a = 0; a < dim; ++a) geometry.vertices(v, a) = nodes.number("a coordinate");
    for (std::int64_t i = 0; i < num_attributes + num_markers; ++i) nodes.number("an attribute");
  }

  const InputFile ele_file(std::filesystem::path(path).replace_extension(".ele"));
  Cursor cells(ele_file, '#');
  std::int64_t num_cells = cells.integer("the number of tetrahedra");
  const std::int64_t num_nodes = cells.integer("the number of nodes of a cell");
  const std::int64_t expected = dim + 1;  // Triangle's files have triangles
  if (num_nodes != expected) cells.fail_at_line("found {} nodes a cell, expected {}", num_nodes, expected);
  const std::int64_t num_cell_attributes = cells.integer("the number of attributes");
  if (num_cell_attributes < 0) cells.fail_at_line("found {} attributes, expected a count", num_cell_attributes);
  num_cells = cells.count(num_cells, 2 * static_cast<std::size_t>(expected) + 2, "cells");
  for (std::int64_t c = 0; c < num_cells; ++c) {
    cells.integer("a cell number");
    std::int64_t cell[4];
    for (std::int64_t i = 0; i < expected; ++i) {
      const std::int64_t number = cells.integer("a vertex of a cell");
      if (number < base || number >= base + num_vertices)
        cells.fail_at_line("found vertex {}, expected {} to {}", number, base, base + num_vertices - 1);
      cell[i] = number - base;
    }
    for (std::int64_t i = 0; i < num_cell_attributes; ++i) cells.number("an attribute");
    geometry.add_cell(dim == 3 ? 10 : 5, {cell, static_cast<std::size_t>(expected)});
  }
  return geometry;
}

}  // namespace halfgrad
