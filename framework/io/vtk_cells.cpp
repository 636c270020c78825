#include "framework/io/vtk_cells.hpp"

#include "framework/error.hpp"

namespace halfgrad {

namespace {

// Types whose nodes the files number otherwise, and the order of the element they become: pixels and voxels along the
// axes; wedges with the first triangle seen from inside (as meshio and Gmsh write them).
struct OtherOrder {
  int vtk_id, element_id, num_nodes;
  int order[8];
};
constexpr OtherOrder other_orders[] = {
    {8, 9, 4, {0, 1, 3, 2}}, {11, 12, 8, {0, 1, 3, 2, 4, 5, 7, 6}}, {13, 13, 6, {0, 2, 1, 3, 5, 4}}};

// Lagrange and Bézier cells of degree one, which DOLFINx writes: the element with these nodes, in its own order.
struct FirstDegree {
  int lagrange_id, bezier_id, element_id;
  std::size_t num_nodes;
};
constexpr FirstDegree first_degrees[] = {{68, 75, 3, 2},  {69, 76, 5, 3},  {70, 77, 9, 4}, {71, 78, 10, 4},
                                         {72, 79, 12, 8}, {73, 80, 13, 6}, {74, 81, 14, 5}};

int usual_type(std::int64_t type, std::size_t num_nodes) {
  if (type == 7 && num_nodes == 3) return 5;
  if (type == 7 && num_nodes == 4) return 9;
  return type >= 0 && type < 256 ? static_cast<int>(type) : -1;
}

}  // namespace

void VtkCells::add_to(Geometry& geometry, const std::vector<std::int64_t>& types, std::int64_t first_vertex) const {
  const std::size_t count = offsets.empty() ? 0 : offsets.size() - 1;
  if (count != types.size())
    raise("{}: found {} cells and {} cell types, expected one each", name, count, types.size());
  if (count > 0 && offsets[0] != 0)
    raise("{}: found {} as the first offset of the cells, expected 0", name, offsets[0]);
  std::vector<std::int64_t> cell;
  for (std::size_t c = 0; c < count; ++c) {
    const std::int64_t begin = offsets[c], end = offsets[c + 1];
    if (begin > end || end > static_cast<std::int64_t>(nodes.size()))
      raise("{}: cell {} has nodes {} to {}, expected ascending offsets up to {}", name, c, begin, end, nodes.size());
    cell.assign(nodes.begin() + begin, nodes.begin() + end);
    int type = usual_type(types[c], cell.size());
    for (const OtherOrder& other : other_orders)
      if (type == other.vtk_id && cell.size() == static_cast<std::size_t>(other.num_nodes)) {
        for (int i = 0; i < other.num_nodes; ++i)
          cell[static_cast<std::size_t>(i)] = nodes[static_cast<std::size_t>(begin + other.order[i])];
        type = other.element_id;
        break;
      }
    for (const FirstDegree& cell_type : first_degrees)
      if ((type == cell_type.lagrange_id || type == cell_type.bezier_id) && cell.size() == cell_type.num_nodes)
        type = cell_type.element_id;
    // A negative number must not become valid by the shift.
    for (std::int64_t& node : cell)
      if (node >= 0 && node < (std::int64_t{1} << 40)) node += first_vertex;
    geometry.add_cell(type, cell);
  }
}

int file_node(int vtk_id, int node) {
  // A file's order that is its own inverse, as that of the wedge, serves both ways.
  for (const OtherOrder& other : other_orders)
    if (other.vtk_id == vtk_id) return other.order[node];
  return node;
}

void VtkCells::add_to(Geometry& geometry, int type, std::int64_t first_vertex) const {
  const std::size_t count = offsets.empty() ? 0 : offsets.size() - 1;
  add_to(geometry, std::vector<std::int64_t>(count, type), first_vertex);
}

}  // namespace halfgrad
