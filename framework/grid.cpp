#include "framework/grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "framework/error.hpp"

namespace halfgrad {

namespace {

// Corners of a box in node order, as steps along the axes; f gets the element too.
template <class Function>
decltype(auto) with_box_element(int gdim, Function&& f) {
  if (gdim == 1) return f.template operator()<Segment>();
  if (gdim == 2) return f.template operator()<Quadrilateral>();
  return f.template operator()<Hexahedron>();
}

std::array<GridPlace, 8> make_corners(int gdim) {
  std::array<GridPlace, 8> corners{};
  with_box_element(gdim, [&]<Element E>() {
    const NodeMatrix<E> nodes = E::nodes();
    for (int i = 0; i < E::num_nodes; ++i)
      for (int a = 0; a < E::dim; ++a) corners[i][a] = static_cast<int>(std::lround(nodes(i, a)));
  });
  return corners;
}

const std::array<GridPlace, 8>& box_corners(int gdim) {
  static const std::array<std::array<GridPlace, 8>, 3> corners = {make_corners(1), make_corners(2), make_corners(3)};
  return corners[gdim - 1];
}

Index rank_of(const std::vector<std::int64_t>& keys, std::int64_t key) {
  const auto at = std::lower_bound(keys.begin(), keys.end(), key);
  return at != keys.end() && *at == key ? static_cast<Index>(at - keys.begin()) : -1;
}

std::string describe(const GridPlace& place, int gdim) {
  return fmt::format("({})", fmt::join(place.begin(), place.begin() + gdim, ", "));
}

}  // namespace

void Grid::check_axes() const {
  if (axes_.empty() || axes_.size() > 3) raise("a grid of {} axes: expected 1 to 3", axes_.size());
  double vertices = 1;
  for (int a = 0; a < gdim(); ++a) {
    const GridAxis& axis = axes_[a];
    if (axis.num_cells < 1) raise("grid: found {} cells along axis {}, expected at least 1", axis.num_cells, a);
    vertices *= axis.num_cells + 1.0;
    if (axis.planes.empty()) {
      if (!(axis.spacing > 0) || !std::isfinite(axis.spacing) || !std::isfinite(axis.origin))
        raise("grid: found origin {} and spacing {} along axis {}, expected finite ones and spacing > 0", axis.origin,
              axis.spacing, a);
      continue;
    }
    if (static_cast<int>(axis.planes.size()) != axis.num_cells + 1)
      raise("grid: found {} planes for {} cells along axis {}, expected one more than cells", axis.planes.size(),
            axis.num_cells, a);
    for (std::size_t i = 0; i < axis.planes.size(); ++i)
      if (!std::isfinite(axis.planes[i]) || (i > 0 && !(axis.planes[i] > axis.planes[i - 1])))
        raise("grid: plane {} of axis {} is at {}, expected finite coordinates that ascend", i, a, axis.planes[i]);
  }
  if (vertices > 9e18) raise("a grid of {} vertices: their places cannot be numbered", vertices);
}

Grid::Grid(std::vector<GridAxis> axes) : axes_(std::move(axes)) {
  check_axes();
  std::int64_t cells = 1, vertices = 1;
  for (const GridAxis& axis : axes_) {
    cells *= axis.num_cells;
    vertices *= axis.num_cells + std::int64_t{1};
  }
  if (vertices > std::numeric_limits<Index>::max())
    raise("a full grid of {} vertices: at most {} can be numbered; name the occupied cells", vertices,
          std::numeric_limits<Index>::max());
  num_cells_ = static_cast<Index>(cells);
  num_vertices_ = static_cast<Index>(vertices);
}

Grid::Grid(std::vector<GridAxis> axes, std::span<const GridPlace> occupied) : axes_(std::move(axes)), sparse_(true) {
  check_axes();
  if (occupied.empty()) raise("a grid without occupied cells");
  for (const GridPlace& at : occupied) {
    if (!inside(at, 0)) raise("grid: the occupied cell {} lies outside the axes", describe(at, gdim()));
    cell_keys_.push_back(key(at, 0));
    for (int i = 0; i < (1 << gdim()); ++i) {
      GridPlace corner = at;
      for (int a = 0; a < gdim(); ++a) corner[a] += box_corners(gdim())[i][a];
      vertex_keys_.push_back(key(corner, 1));
    }
  }
  std::sort(cell_keys_.begin(), cell_keys_.end());
  if (const auto twin = std::adjacent_find(cell_keys_.begin(), cell_keys_.end()); twin != cell_keys_.end())
    raise("grid: the occupied cell {} is named twice", describe(place(*twin, 0), gdim()));
  std::sort(vertex_keys_.begin(), vertex_keys_.end());
  vertex_keys_.erase(std::unique(vertex_keys_.begin(), vertex_keys_.end()), vertex_keys_.end());
  vertex_keys_.shrink_to_fit();
  cell_keys_.shrink_to_fit();
  if (vertex_keys_.size() > static_cast<std::size_t>(std::numeric_limits<Index>::max()))
    raise("a grid of {} vertices: at most {} can be numbered", vertex_keys_.size(), std::numeric_limits<Index>::max());
  num_cells_ = static_cast<Index>(cell_keys_.size());
  num_vertices_ = static_cast<Index>(vertex_keys_.size());
}

Offset Grid::bytes() const {
  Offset planes = 0;
  for (const GridAxis& axis : axes_) planes += static_cast<Offset>(axis.planes.capacity());
  return static_cast<Offset>(sizeof(Grid) + axes_.size() * sizeof(GridAxis)) +
         8 * (planes + static_cast<Offset>(cell_keys_.capacity() + vertex_keys_.capacity()));
}

// `further` is 0 for cells and 1 for vertices, of which an axis has one more.
std::int64_t Grid::key(const GridPlace& place, int further) const {
  std::int64_t result = 0;
  for (int a = gdim() - 1; a >= 0; --a) result = result * (axes_[a].num_cells + further) + place[a];
  return result;
}

GridPlace Grid::place(std::int64_t key, int further) const {
  GridPlace result{};
  for (int a = 0; a < gdim(); ++a) {
    const std::int64_t size = axes_[a].num_cells + further;
    result[a] = static_cast<int>(key % size);
    key /= size;
  }
  return result;
}

bool Grid::inside(const GridPlace& place, int further) const {
  for (int a = 0; a < gdim(); ++a)
    if (place[a] < 0 || place[a] >= axes_[a].num_cells + further) return false;
  return true;
}

Index Grid::cell_at(const GridPlace& place) const {
  if (!inside(place, 0)) return -1;
  return sparse_ ? rank_of(cell_keys_, key(place, 0)) : static_cast<Index>(key(place, 0));
}

Index Grid::vertex_at(const GridPlace& place) const {
  if (!inside(place, 1)) return -1;
  return sparse_ ? rank_of(vertex_keys_, key(place, 1)) : static_cast<Index>(key(place, 1));
}

GridPlace Grid::cell_place(Index cell) const { return place(sparse_ ? cell_keys_[cell] : cell, 0); }
GridPlace Grid::vertex_place(Index vertex) const { return place(sparse_ ? vertex_keys_[vertex] : vertex, 1); }

double Grid::plane(int axis, int i) const {
  const GridAxis& cut = axes_[axis];
  return cut.planes.empty() ? cut.origin + i * cut.spacing : cut.planes[i];
}

int Grid::interval(int axis, double coordinate) const {
  const GridAxis& cut = axes_[axis];
  const int last = cut.num_cells - 1;
  if (!cut.planes.empty()) {
    const auto above = std::upper_bound(cut.planes.begin(), cut.planes.end(), coordinate);
    return std::clamp(static_cast<int>(above - cut.planes.begin()) - 1, 0, last);
  }
  int i = static_cast<int>(std::clamp(std::floor((coordinate - cut.origin) / cut.spacing), 0.0, double(last)));
  // Rounding of the quotient must not contradict the planes.
  if (i > 0 && coordinate < plane(axis, i)) --i;
  if (i < last && coordinate >= plane(axis, i + 1)) ++i;
  return i;
}

Vector Grid::position(Index vertex) const {
  const GridPlace at = vertex_place(vertex);
  Vector result(gdim());
  for (int a = 0; a < gdim(); ++a) result[a] = plane(a, at[a]);
  return result;
}

std::array<Index, 8> Grid::cell_vertices(Index cell) const {
  const GridPlace at = cell_place(cell);
  std::array<Index, 8> vertices{};
  for (int i = 0; i < (1 << gdim()); ++i) {
    GridPlace corner = at;
    for (int a = 0; a < gdim(); ++a) corner[a] += box_corners(gdim())[i][a];
    vertices[i] = vertex_at(corner);
  }
  return vertices;
}

Index Grid::neighbor(Index vertex, int axis, int side) const {
  const GridPlace from = vertex_place(vertex);
  GridPlace to = from;
  to[axis] += side == 0 ? -1 : 1;
  if (!inside(to, 1)) return -1;
  if (sparse_) {
    // The cells around the edge, which begins at the lesser of the two.
    bool found = false;
    for (int corner = 0; corner < (1 << gdim()) && !found; ++corner) {
      if ((corner >> axis) & 1) continue;
      GridPlace cell = side == 0 ? to : from;
      for (int a = 0; a < gdim(); ++a) cell[a] -= (corner >> a) & 1;
      found = has_cell(cell);
    }
    if (!found) return -1;
  }
  return vertex_at(to);
}

Mesh Grid::mesh_of(std::span<const Index> cells, std::vector<Index>& vertices) const {
  const int num_nodes = 1 << gdim();
  std::vector<Index> corners(cells.size() * static_cast<std::size_t>(num_nodes));
  std::vector<Index> number(static_cast<std::size_t>(num_vertices_), -1);
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const std::array<Index, 8> found = cell_vertices(cells[c]);
    std::copy_n(found.data(), num_nodes, corners.data() + c * static_cast<std::size_t>(num_nodes));
    for (int i = 0; i < num_nodes; ++i) number[found[i]] = 0;
  }
  vertices.clear();
  for (Index v = 0; v < num_vertices_; ++v) {
    if (number[v] < 0) continue;
    number[v] = static_cast<Index>(vertices.size());
    vertices.push_back(v);
  }
  Points positions(static_cast<Eigen::Index>(vertices.size()), gdim());
  for (std::size_t v = 0; v < vertices.size(); ++v)
    positions.row(static_cast<Eigen::Index>(v)) = position(vertices[v]).transpose();
  AnyBlock any;
  with_box_element(gdim(), [&]<Element E>() {
    ElementBlock<E> block;
    block.cells.resize(static_cast<Eigen::Index>(cells.size()), E::num_nodes);
    for (std::size_t i = 0; i < corners.size(); ++i) block.cells.data()[i] = number[corners[i]];
    any = std::move(block);
  });
  return Mesh(std::move(positions), {std::move(any)});
}

Mesh Grid::mesh() const {
  std::vector<Index> cells(num_cells_), vertices;
  for (Index c = 0; c < num_cells_; ++c) cells[c] = c;
  return mesh_of(cells, vertices);
}

}  // namespace halfgrad
