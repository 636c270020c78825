#include "framework/io/medit.hpp"

#include <cctype>

#include "framework/io/cursor.hpp"

namespace halfgrad {

namespace {

// Sections of cells; the node order is VTK's.
struct MeditType {
  std::string_view keyword;
  int vtk_id;
  int num_nodes;
};
constexpr MeditType medit_types[] = {{"Edges", 3, 2},       {"Triangles", 5, 3},  {"Quadrilaterals", 9, 4},
                                     {"Tetrahedra", 10, 4}, {"Hexahedra", 12, 8}, {"Hexaedra", 12, 8},
                                     {"Prisms", 13, 6},     {"Wedges", 13, 6},    {"Pyramids", 14, 5}};

bool is_keyword(std::string_view word) { return !word.empty() && std::isalpha(static_cast<unsigned char>(word[0])); }

}  // namespace

Geometry read_medit(const std::filesystem::path& path) {
  const InputFile file(path);
  Cursor in(file, '#');
  if (in.peek() != "MeshVersionFormatted") in.expect("MeshVersionFormatted");
  Geometry geometry;
  std::int64_t dim = 0, num_vertices = -1;
  while (!in.at_end()) {
    const std::string keyword(in.word("a keyword"));
    if (!is_keyword(keyword)) in.fail_at_line("found \"{}\", expected a keyword such as Vertices", shown(keyword));
    if (keyword == "End") break;
    if (keyword == "Dimension") {
      dim = in.integer("the dimension");
      if (dim != 2 && dim != 3) in.fail_at_line("found dimension {}, expected 2 or 3", dim);
    } else if (keyword == "Vertices") {
      if (dim == 0) in.fail_at_line("found Vertices, expected Dimension before");
      num_vertices = in.count(in.integer("the number of vertices"), 2 * static_cast<std::size_t>(dim) + 2, "vertices");
      geometry.vertices.resize(num_vertices, dim);
      for (std::int64_t v = 0; v < num_vertices; ++v) {
        for (std::int64_t a = 0; a < dim; ++a) geometry.vertices(v, a) = in.number("a coordinate");
        in.integer("a reference");
      }
    } else if (const auto* type = std::find_if(std::begin(medit_types), std::end(medit_types),
                                               [&](const MeditType& known) { return known.keyword == keyword; });
               type != std::end(medit_types)) {
      const std::int64_t count = in.count(in.integer("the number of cells"), 4, keyword);
      if (num_vertices < 0) in.fail_at_line("found {}, expected Vertices before", keyword);
      for (std::int64_t c = 0; c < count; ++c) {
        std::int64_t nodes[8];
        for (int i = 0; i < type->num_nodes; ++i) {
          const std::int64_t number = in.integer("a vertex of a cell");
          if (number < 1 || number > num_vertices)
            in.fail_at_line("cell {} of {} names vertex {}, expected 1 to {}", c + 1, keyword, number, num_vertices);
          nodes[i] = number - 1;
        }
        in.integer("a reference");
        geometry.add_cell(type->vtk_id, {nodes, static_cast<std::size_t>(type->num_nodes)});
      }
    } else {  // corners, normals and the like: numbers up to the next keyword
      while (!in.at_end() && !is_keyword(in.peek())) in.word("a number");
    }
  }
  if (num_vertices < 0) in.fail_at_line("the file ends, expected Vertices");
  return geometry;
}

}  // namespace halfgrad
