#include "experiments/lattice.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "experiments/random.hpp"
#include "framework/cell_map.hpp"
#include "framework/error.hpp"
#include "framework/json_reader.hpp"

namespace halfgrad {
namespace {

/// Vertices and cells under construction; positions in the unit box, where a coordinate of exactly 0 or 1 is a side.
struct Builder {
  std::vector<std::array<double, 3>> positions;
  std::vector<std::vector<Index>> cells;

  Index add(double x, double y, double z = 0) {
    positions.push_back({x, y, z});
    return static_cast<Index>(positions.size() - 1);
  }
};

/// Corners of a grid of boxes, the first axis fastest.
class Corners {
 public:
  explicit Corners(std::array<int, 3> n) : n_(n) {}
  Corners(Builder& builder, std::array<int, 3> n, int dim) : n_(n) {
    for (int k = 0; k <= (dim == 3 ? n[2] : 0); ++k)
      for (int j = 0; j <= n[1]; ++j)
        for (int i = 0; i <= n[0]; ++i)
          builder.add(double(i) / n[0], double(j) / n[1], dim == 3 ? double(k) / n[2] : 0);
  }
  Index operator()(int i, int j, int k = 0) const { return i + (n_[0] + 1) * (j + (n_[1] + 1) * k); }

 private:
  std::array<int, 3> n_;
};

template <class Function>
void for_each_box(std::array<int, 3> n, int dim, Function&& f) {
  for (int k = 0; k < (dim == 3 ? n[2] : 1); ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) f(i, j, k);
}

void segments(Builder& builder, std::array<int, 3> n) {
  for (int i = 0; i <= n[0]; ++i) builder.add(double(i) / n[0], 0);
  for (int i = 0; i < n[0]; ++i) builder.cells.push_back({i, i + 1});
}

void quadrilaterals(Builder& builder, std::array<int, 3> n) {
  const Corners at(builder, n, 2);
  for_each_box(n, 2, [&](int i, int j, int) {
    builder.cells.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
  });
}

void hexahedra(Builder& builder, std::array<int, 3> n) {
  const Corners at(builder, n, 3);
  for_each_box(n, 3, [&](int i, int j, int k) {
    builder.cells.push_back({at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k), at(i, j, k + 1),
                             at(i + 1, j, k + 1), at(i + 1, j + 1, k + 1), at(i, j + 1, k + 1)});
  });
}

/// All squares cut along the same diagonal.
void kuhn_triangles(Builder& builder, std::array<int, 3> n) {
  const Corners at(builder, n, 2);
  for_each_box(n, 2, [&](int i, int j, int) {
    builder.cells.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
    builder.cells.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
  });
}

/// Diagonals that alternate like a chessboard.
void union_jack_triangles(Builder& builder, std::array<int, 3> n) {
  const Corners at(builder, n, 2);
  for_each_box(n, 2, [&](int i, int j, int) {
    const Index a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
    if ((i + j) % 2 == 0) {
      builder.cells.push_back({a, b, c});
      builder.cells.push_back({a, c, d});
    } else {
      builder.cells.push_back({a, b, d});
      builder.cells.push_back({b, c, d});
    }
  });
}

/// Rows shifted by half an edge, closed with half triangles: equilateral where the size of a row is sqrt(3)/2 edges.
void equilateral_triangles(Builder& builder, std::array<int, 3> n) {
  std::vector<std::vector<Index>> rows(n[1] + 1);
  for (int j = 0; j <= n[1]; ++j) {
    const double y = double(j) / n[1];
    if (j % 2 == 0) {
      for (int i = 0; i <= n[0]; ++i) rows[j].push_back(builder.add(double(i) / n[0], y));
    } else {
      rows[j].push_back(builder.add(0, y));
      for (int i = 0; i < n[0]; ++i) rows[j].push_back(builder.add((i + 0.5) / n[0], y));
      rows[j].push_back(builder.add(1, y));
    }
  }
  // Each strip has n + 1 vertices on the even row and n + 2 on the odd one, which are walked in order of x.
  for (int j = 0; j < n[1]; ++j) {
    const bool odd_above = j % 2 == 0;
    const std::vector<Index>& even = odd_above ? rows[j] : rows[j + 1];
    const std::vector<Index>& odd = odd_above ? rows[j + 1] : rows[j];
    for (int i = 0; i <= n[0]; ++i) {
      builder.cells.push_back({even[i], odd[i + 1], odd[i]});
      if (i < n[0]) builder.cells.push_back({even[i], even[i + 1], odd[i + 1]});
    }
  }
}

/// Six tetrahedra around the diagonal of each box: point-symmetric stars inside.
void kuhn_tetrahedra(Builder& builder, std::array<int, 3> n) {
  const Corners at(builder, n, 3);
  constexpr int orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  for_each_box(n, 3, [&](int i, int j, int k) {
    for (int p = 0; p < 6; ++p) {
      std::array<int, 3> corner{i, j, k};
      std::vector<Index> cell{at(i, j, k)};
      for (int axis : orders[p]) {
        ++corner[axis];
        cell.push_back(at(corner[0], corner[1], corner[2]));
      }
      builder.cells.push_back(std::move(cell));
    }
  });
}

/// Five tetrahedra a box, one in the middle; neighbouring boxes are mirror images.
void five_tetrahedra(Builder& builder, std::array<int, 3> n) {
  const Corners at(builder, n, 3);
  for_each_box(n, 3, [&](int i, int j, int k) {
    const Index v[8] = {at(i, j, k),     at(i + 1, j, k),     at(i, j + 1, k),     at(i + 1, j + 1, k),
                        at(i, j, k + 1), at(i + 1, j, k + 1), at(i, j + 1, k + 1), at(i + 1, j + 1, k + 1)};
    if ((i + j + k) % 2 == 0) {
      builder.cells.insert(builder.cells.end(), {{v[0], v[1], v[2], v[4]},
                                                 {v[3], v[2], v[1], v[7]},
                                                 {v[5], v[4], v[7], v[1]},
                                                 {v[6], v[7], v[4], v[2]},
                                                 {v[1], v[2], v[4], v[7]}});
    } else {
      builder.cells.insert(builder.cells.end(), {{v[1], v[3], v[0], v[5]},
                                                 {v[2], v[0], v[3], v[6]},
                                                 {v[4], v[5], v[6], v[0]},
                                                 {v[7], v[6], v[5], v[3]},
                                                 {v[0], v[3], v[5], v[6]}});
    }
  });
}

/// Body-centered: four tetrahedra around each line between neighbouring centers; half octahedra close the sides.
void bcc_tetrahedra(Builder& builder, std::array<int, 3> n) {
  const Corners at(builder, n, 3);
  const Index first_center = static_cast<Index>(builder.positions.size());
  for_each_box(n, 3, [&](int i, int j, int k) { builder.add((i + 0.5) / n[0], (j + 0.5) / n[1], (k + 0.5) / n[2]); });
  const auto center = [&](const std::array<int, 3>& box) {
    return first_center + box[0] + n[0] * (box[1] + n[1] * box[2]);
  };
  for_each_box(n, 3, [&](int i, int j, int k) {
    for (int axis = 0; axis < 3; ++axis) {
      for (int side = 0; side < 2; ++side) {
        const std::array<int, 3> box{i, j, k};
        // The square between this box and the next along the axis, counter-clockwise seen from the next.
        const int b = (axis + 1) % 3, c = (axis + 2) % 3;
        Index square[4];
        for (int corner = 0; corner < 4; ++corner) {
          std::array<int, 3> at_corner = box;
          at_corner[axis] += side;
          at_corner[b] += corner == 1 || corner == 2;
          at_corner[c] += corner >= 2;
          square[corner] = at(at_corner[0], at_corner[1], at_corner[2]);
        }
        std::array<int, 3> next = box;
        next[axis] += side == 1 ? 1 : -1;
        if (next[axis] >= 0 && next[axis] < n[axis]) {
          if (side == 0) continue;  // the neighbour makes these
          for (int corner = 0; corner < 4; ++corner)
            builder.cells.push_back({square[corner], square[(corner + 1) % 4], center(next), center(box)});
        } else {
          builder.cells.push_back({square[0], square[1], square[2], center(box)});
          builder.cells.push_back({square[0], square[2], square[3], center(box)});
        }
      }
    }
  });
}

/// Two wedges a box, upright on Kuhn's triangles.
void wedges(Builder& builder, std::array<int, 3> n) {
  const Corners at(builder, n, 3);
  for_each_box(n, 3, [&](int i, int j, int k) {
    builder.cells.push_back({at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j, k + 1), at(i + 1, j, k + 1),
                             at(i + 1, j + 1, k + 1)});
    builder.cells.push_back({at(i, j, k), at(i + 1, j + 1, k), at(i, j + 1, k), at(i, j, k + 1),
                             at(i + 1, j + 1, k + 1), at(i, j + 1, k + 1)});
  });
}

/// A side of a box, counter-clockwise seen from its center; the first and third corner are the least and the greatest.
std::array<Index, 4> box_side(const Corners& at, const std::array<int, 3>& box, int axis, int side) {
  const int b = (axis + 1 + side) % 3, c = (axis + 2 - side) % 3;
  std::array<Index, 4> square;
  for (int corner = 0; corner < 4; ++corner) {
    std::array<int, 3> place = box;
    place[axis] += side;
    place[b] += corner == 1 || corner == 2;
    place[c] += corner >= 2;
    square[corner] = at(place[0], place[1], place[2]);
  }
  return square;
}

/// Six pyramids around the center of each box.
void pyramids(Builder& builder, std::array<int, 3> n) {
  const Corners at(builder, n, 3);
  for_each_box(n, 3, [&](int i, int j, int k) {
    const Index center = builder.add((i + 0.5) / n[0], (j + 0.5) / n[1], (k + 0.5) / n[2]);
    for (int axis = 0; axis < 3; ++axis)
      for (int side = 0; side < 2; ++side) {
        const auto square = box_side(at, {i, j, k}, axis, side);
        builder.cells.push_back({square[0], square[1], square[2], square[3], center});
      }
  });
}

/// Like a chessboard: hexahedra, pairs of wedges and Kuhn's tetrahedra in turn on the white boxes; on the black ones a
/// pyramid or, where the white neighbour's side is cut, two tetrahedra between each side and the center.
void mixed_solid(Builder& builder, std::array<int, 3> n) {
  enum Kind { center, hexahedron, wedge, tetrahedron };
  const auto kind = [](const std::array<int, 3>& box) {
    if ((box[0] + box[1] + box[2]) % 2 == 0) return center;
    return static_cast<Kind>(hexahedron + (box[0] + 3 * box[1] + 5 * box[2]) / 2 % 3);
  };
  Builder whole;
  hexahedra(whole, n);
  builder.positions = whole.positions;
  Builder cut;
  wedges(cut, n);
  Builder simplices;
  kuhn_tetrahedra(simplices, n);
  const Corners at(n);
  std::size_t box = 0;
  for_each_box(n, 3, [&](int i, int j, int k) {
    switch (kind({i, j, k})) {
      case hexahedron:
        builder.cells.push_back(whole.cells[box]);
        break;
      case wedge:
        for (std::size_t c = 0; c < 2; ++c) builder.cells.push_back(cut.cells[2 * box + c]);
        break;
      case tetrahedron:
        for (std::size_t c = 0; c < 6; ++c) builder.cells.push_back(simplices.cells[6 * box + c]);
        break;
      case center: {
        const Index middle = builder.add((i + 0.5) / n[0], (j + 0.5) / n[1], (k + 0.5) / n[2]);
        for (int axis = 0; axis < 3; ++axis)
          for (int side = 0; side < 2; ++side) {
            const auto square = box_side(at, {i, j, k}, axis, side);
            std::array<int, 3> beside{i, j, k};
            beside[axis] += side == 0 ? -1 : 1;
            const bool outside = beside[axis] < 0 || beside[axis] >= n[axis];
            const Kind other = outside ? hexahedron : kind(beside);
            if (other == tetrahedron || (other == wedge && axis == 2)) {
              builder.cells.push_back({square[0], square[1], square[2], middle});
              builder.cells.push_back({square[0], square[2], square[3], middle});
            } else {
              builder.cells.push_back({square[0], square[1], square[2], square[3], middle});
            }
          }
      }
    }
    ++box;
  });
}

/// Quadrilaterals and pairs of triangles like a chessboard.
void mixed_plane(Builder& builder, std::array<int, 3> n) {
  const Corners at(builder, n, 2);
  for_each_box(n, 2, [&](int i, int j, int) {
    const Index a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
    if ((i + j) % 2 == 0) {
      builder.cells.push_back({a, b, c, d});
    } else {
      builder.cells.push_back({a, b, c});
      builder.cells.push_back({a, c, d});
    }
  });
}

/// One way to mesh a box. The elements of a mixed one are told by their number of nodes.
struct Pattern {
  std::string_view element, name;
  int dim;
  void (*build)(Builder&, std::array<int, 3>);
};

constexpr std::array patterns = {
    Pattern{"segment", "", 1, segments},
    Pattern{"triangle", "kuhn", 2, kuhn_triangles},
    Pattern{"triangle", "union_jack", 2, union_jack_triangles},
    Pattern{"triangle", "equilateral", 2, equilateral_triangles},
    Pattern{"quadrilateral", "", 2, quadrilaterals},
    Pattern{"tetrahedron", "kuhn", 3, kuhn_tetrahedra},
    Pattern{"tetrahedron", "five", 3, five_tetrahedra},
    Pattern{"tetrahedron", "bcc", 3, bcc_tetrahedra},
    Pattern{"hexahedron", "", 3, hexahedra},
    Pattern{"wedge", "", 3, wedges},
    Pattern{"pyramid", "", 3, pyramids},
    Pattern{"mixed", "solid", 3, mixed_solid},
    Pattern{"mixed", "plane", 2, mixed_plane},
};

const Pattern& find_pattern(const LatticeOptions& options) {
  const std::vector<std::string_view> elements = lattice_elements();
  if (std::find(elements.begin(), elements.end(), options.element) == elements.end())
    raise("lattice: no lattice of element \"{}\"; known: {}", options.element, join_names(elements));
  for (const Pattern& pattern : patterns)
    if (pattern.element == options.element && (options.pattern.empty() || options.pattern == pattern.name))
      return pattern;
  const std::vector<std::string_view> names = lattice_patterns(options.element);
  raise("lattice: no pattern \"{}\" of {}; known: {}", options.pattern, options.element,
        names.empty() ? "none to choose" : join_names(names));
}

}  // namespace

std::vector<std::string_view> lattice_elements() {
  std::vector<std::string_view> names;
  for (const Pattern& pattern : patterns)
    if (names.empty() || names.back() != pattern.element) names.push_back(pattern.element);
  return names;
}

std::vector<std::string_view> lattice_patterns(std::string_view element) {
  std::vector<std::string_view> names;
  for (const Pattern& pattern : patterns)
    if (pattern.element == element && !pattern.name.empty()) names.push_back(pattern.name);
  return names;
}

int lattice_dim(const LatticeOptions& options) { return find_pattern(options).dim; }

Mesh make_lattice(const LatticeOptions& options) {
  const Pattern& pattern = find_pattern(options);
  if (!(options.jitter >= 0 && options.jitter < 0.5))
    raise("lattice: found jitter {}, expected 0 to less than 0.5", options.jitter);
  const int dim = pattern.dim;
  double boxes = 1;
  for (int a = 0; a < dim; ++a) {
    if (options.cells[a] < 1) raise("lattice: found {} cells along axis {}, expected at least 1", options.cells[a], a);
    if (!(options.size[a] > 0)) raise("lattice: found size {} along axis {}, expected > 0", options.size[a], a);
    boxes *= options.cells[a];
  }
  if (boxes > 5e7) raise("lattice: {} boxes are more than the 50000000 that fit the numbering", boxes);

  Builder builder;
  pattern.build(builder, options.cells);
  RandomStream random(options.seed, 1);
  Points vertices(static_cast<Eigen::Index>(builder.positions.size()), dim);
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) {
    std::array<double, 3> unit = builder.positions[v];
    for (int a = 0; a < dim; ++a) {
      const double move = random.uniform(-1, 1) * options.jitter / options.cells[a];
      if (unit[a] > 0 && unit[a] < 1) unit[a] += move;
    }
    for (int a = 0; a < dim; ++a) {
      // Vanishes on the sides normal to axis a, so that they keep their plane.
      double shift = options.warp * std::sin(std::numbers::pi * unit[a]);
      for (int b = 0; b < dim; ++b)
        if (b != a) shift *= std::cos(std::numbers::pi * (unit[b] - 0.1));
      vertices(v, a) = options.origin[a] + options.size[a] * (unit[a] + shift);
    }
  }
  std::vector<AnyBlock> blocks;
  Elements::for_each([&]<class E>() {
    const bool mixed = pattern.element == "mixed";
    if (E::dim != dim || (!mixed && E::name != pattern.element)) return;
    ElementBlock<E> block;
    std::vector<Index> nodes;
    for (const std::vector<Index>& cell : builder.cells)
      if (cell.size() == static_cast<std::size_t>(E::num_nodes)) nodes.insert(nodes.end(), cell.begin(), cell.end());
    if (nodes.empty()) return;
    block.cells.resize(static_cast<Eigen::Index>(nodes.size()) / E::num_nodes, E::num_nodes);
    std::copy(nodes.begin(), nodes.end(), block.cells.data());
    // The patterns list the nodes of simplices in any order.
    if constexpr (E::affine)
      for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
        NodeMatrix<E> positions;
        for (int i = 0; i < E::num_nodes; ++i) positions.row(i) = vertices.row(block.cells(c, i));
        if (cell_jacobian<E>(positions, E::center()).determinant() < 0) std::swap(block.cells(c, 0), block.cells(c, 1));
      }
    blocks.push_back(std::move(block));
  });
  return Mesh(std::move(vertices), std::move(blocks));
}

}  // namespace halfgrad
