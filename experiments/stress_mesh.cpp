#include "experiments/stress_mesh.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "experiments/lattice.hpp"
#include "experiments/random.hpp"
#include "experiments/random_delaunay.hpp"
#include "framework/error.hpp"
#include "framework/json_reader.hpp"

namespace halfgrad {

namespace {

// A mesh while it is being spoilt.
struct Draft {
  struct Cell {
    std::size_t type;  // place of the element in Elements
    std::vector<Index> nodes;
  };
  int dim = 0;
  std::vector<Vector> positions;
  std::vector<Cell> cells;
  std::string recipe;

  double size() const {
    Vector low = positions.front(), high = low;
    for (const Vector& position : positions) {
      low = low.cwiseMin(position);
      high = high.cwiseMax(position);
    }
    return (high - low).norm();
  }
  Index add(Vector position) {
    positions.push_back(std::move(position));
    return static_cast<Index>(positions.size() - 1);
  }
};

Draft draft_of(const Mesh& mesh) {
  Draft draft;
  draft.dim = mesh.gdim();
  for (Index v = 0; v < mesh.num_vertices(); ++v) draft.positions.push_back(mesh.vertices().row(v).transpose());
  for (Index c = 0; c < mesh.num_cells(); ++c) {
    const std::span<const Index> nodes = mesh.cell_vertices(c);
    draft.cells.push_back({mesh.blocks()[mesh.block_of(c)].index(), {nodes.begin(), nodes.end()}});
  }
  return draft;
}

Mesh mesh_of(const Draft& draft) {
  Points vertices(static_cast<Eigen::Index>(draft.positions.size()), draft.dim);
  for (std::size_t v = 0; v < draft.positions.size(); ++v)
    vertices.row(static_cast<Eigen::Index>(v)) = draft.positions[v].transpose();
  std::vector<AnyBlock> blocks;
  std::size_t type = 0;
  Elements::for_each([&]<class E>() {
    std::vector<Index> nodes;
    for (const Draft::Cell& cell : draft.cells)
      if (cell.type == type) nodes.insert(nodes.end(), cell.nodes.begin(), cell.nodes.end());
    ++type;
    if (nodes.empty()) return;
    ElementBlock<E> block;
    block.cells.resize(static_cast<Eigen::Index>(nodes.size()) / E::num_nodes, E::num_nodes);
    std::copy(nodes.begin(), nodes.end(), block.cells.data());
    blocks.push_back(std::move(block));
  });
  return Mesh(std::move(vertices), std::move(blocks));
}

int below(RandomStream& random, std::size_t count) {
  return static_cast<int>(random.uniform(0, static_cast<double>(count)));
}

bool chance(RandomStream& random, double probability) { return random.uniform() < probability; }

// 10^low … 10^high, every power as likely.
double power_of_ten(RandomStream& random, double low, double high) { return std::pow(10, random.uniform(low, high)); }

Vector random_direction(RandomStream& random, int dim) {
  Vector direction(dim);
  do
    for (int a = 0; a < dim; ++a) direction[a] = random.uniform(-1, 1);
  while (!(direction.norm() > 0.1));
  return direction.normalized();
}

// Shapes.

Draft lattice(std::string_view element, RandomStream& random) {
  LatticeOptions options;
  options.element = element;
  const std::vector<std::string_view> patterns = lattice_patterns(element);
  if (!patterns.empty()) options.pattern = patterns[below(random, patterns.size())];
  const int dim = lattice_dim(options), most = dim == 1 ? 9 : dim == 2 ? 5 : 3;
  int boxes = 1;
  for (int a = 0; a < dim; ++a) {
    options.cells[a] = 1 + below(random, most);
    // Few boxes keep a case short; now and then a mesh has an inside.
    if (boxes * options.cells[a] > (dim == 3 ? 4 : 16) && !chance(random, 0.03)) options.cells[a] = 1;
    boxes *= options.cells[a];
    options.size[a] = options.cells[a];
  }
  options.jitter = chance(random, 0.3) ? 0 : random.uniform(0, 0.49);
  options.warp = chance(random, 0.7) ? 0 : random.uniform(0, 0.3);
  options.seed = static_cast<std::uint64_t>(below(random, 1 << 30));
  Draft draft = draft_of(make_lattice(options));
  draft.recipe = fmt::format("lattice {}", fmt::join(options.cells.begin(), options.cells.begin() + dim, "x"));
  if (!options.pattern.empty()) draft.recipe += " " + options.pattern;
  return draft;
}

Draft delaunay(std::string_view element, RandomStream& random) {
  RandomDelaunayOptions options;
  options.gdim = element == "triangle" ? 2 : 3;
  for (int attempt = 0; attempt < 5; ++attempt) {
    options.num_points = options.gdim + 2 + below(random, 16);
    options.seed = static_cast<std::uint64_t>(below(random, 1 << 30));
    try {
      Draft draft = draft_of(make_random_delaunay(options));
      draft.recipe = fmt::format("Delaunay of {} points", options.num_points);
      if (!draft.cells.empty()) return draft;
    } catch (const Error&) {  // round-off met a special position: other points
    }
  }
  return lattice(element, random);
}

// Cells around one edge (a vertex in the plane): triangles or quadrilaterals around the origin, pulled up or out.
Draft fan(std::size_t type, std::string_view element, RandomStream& random) {
  Draft draft;
  const bool four = element == "quadrilateral" || element == "hexahedron" || element == "pyramid";
  const bool solid = element != "triangle" && element != "quadrilateral";
  const bool apex = element == "tetrahedron" || element == "pyramid";
  draft.dim = solid ? 3 : 2;
  const int num_cells = 2 + below(random, 9), num_ring = four ? 2 * num_cells : num_cells;
  const bool closed = num_cells > 2 && chance(random, 0.6);
  const double full = closed ? 2 * std::numbers::pi : random.uniform(0.2, 6);
  const int num_points = closed ? num_ring : num_ring + 1, num_layers = solid && !apex ? 2 : 1;
  for (int layer = 0; layer < num_layers; ++layer) {
    const auto place = [&](double radius, double angle) {
      Vector position = Vector::Zero(draft.dim);
      position[0] = radius * std::cos(angle);
      position[1] = radius * std::sin(angle);
      if (solid) position[2] = layer;
      draft.add(position);
    };
    place(0, 0);
    for (int k = 0; k < num_points; ++k) place(four && k % 2 == 1 ? 1.4 : 1, full * k / num_ring);
  }
  Index top = -1;
  if (apex) top = draft.add(Vector::Unit(3, 2));
  for (int c = 0; c < num_cells; ++c) {
    std::vector<Index> base{0};
    const int step = four ? 2 : 1;
    for (int k = step * c; k <= step * (c + 1); ++k) base.push_back(1 + k % num_points);
    std::vector<Index> nodes = base;
    if (apex)
      nodes.push_back(top);
    else if (solid)
      for (const Index v : base) nodes.push_back(v + num_points + 1);
    draft.cells.push_back({type, nodes});
  }
  draft.recipe = fmt::format("{} fan of {}", closed ? "closed" : "open", num_cells);
  return draft;
}

// Cells in a row, each touching the next at a vertex only.
Draft string_of_cells(std::string_view element, RandomStream& random) {
  LatticeOptions options;
  options.element = element;
  options.cells = {1, 1, 1};
  Draft one = draft_of(make_lattice(options)), draft;
  draft.dim = one.dim;
  const Draft::Cell cell = one.cells[below(random, one.cells.size())];
  const int num_cells = 2 + below(random, 5);
  Vector origin = Vector::Zero(one.dim);
  Index last = -1;
  for (int c = 0; c < num_cells; ++c) {
    Draft::Cell copy{cell.type, {}};
    for (std::size_t i = 0; i < cell.nodes.size(); ++i) {
      const Vector from_first = one.positions[cell.nodes[i]] - one.positions[cell.nodes.front()];
      copy.nodes.push_back(i == 0 && last >= 0 ? last : draft.add(origin + from_first));
    }
    last = copy.nodes.back();
    origin = draft.positions[last];
    draft.cells.push_back(copy);
  }
  draft.recipe = fmt::format("string of {}", num_cells);
  return draft;
}

Draft base_shape(std::string_view element, RandomStream& random) {
  std::size_t type = 0, found = 0;
  Elements::for_each([&]<class E>() {
    if (E::name == element) found = type;
    ++type;
  });
  const double choice = random.uniform();
  const bool mixed = element == "mixed", segment = element == "segment";
  if (choice < 0.15 && !mixed && !segment) return fan(found, element, random);
  if (choice < 0.25 && !mixed) return string_of_cells(element, random);
  if (choice < 0.5 && (element == "triangle" || element == "tetrahedron")) return delaunay(element, random);
  return lattice(element, random);
}

// What is done to them. Each says what it did in a few words.

std::string leave_cells_out(Draft& draft, RandomStream& random) {
  const double choice = random.uniform();
  const std::size_t most = choice < 0.25 ? 1 : choice < 0.5 ? 2 : draft.cells.size();
  std::vector<Draft::Cell> kept;
  const int first = below(random, draft.cells.size());
  for (std::size_t c = first; c < draft.cells.size() && kept.size() < most; ++c)
    if (most <= 2 || chance(random, 0.6)) kept.push_back(draft.cells[c]);
  if (!kept.empty()) draft.cells = kept;
  return fmt::format("{} cells kept", draft.cells.size());
}

std::string invert_cells(Draft& draft, RandomStream& random) {
  int count = 0;
  for (Draft::Cell& cell : draft.cells)
    if (chance(random, 0.3)) {
      std::swap(cell.nodes.front(), cell.nodes[1 + below(random, cell.nodes.size() - 1)]);
      ++count;
    }
  return fmt::format("{} cells inverted", count);
}

std::string double_cells(Draft& draft, RandomStream& random) {
  draft.cells.push_back(draft.cells[below(random, draft.cells.size())]);
  return "a cell doubled";
}

std::string double_vertices(Draft& draft, RandomStream& random) {
  const Index vertex = below(random, draft.positions.size()), copy = draft.add(draft.positions[vertex]);
  for (Draft::Cell& cell : draft.cells)
    for (Index& node : cell.nodes)
      if (node == vertex && chance(random, 0.5)) node = copy;
  return "a vertex doubled";
}

std::string add_vertices(Draft& draft, RandomStream& random) {
  const double distance = draft.size() * power_of_ten(random, -2, 3);
  draft.add(draft.positions.front() + distance * random_direction(random, draft.dim));
  return "a vertex of no cell";
}

// A node of a cell next to a point between some others of it, or onto it.
std::string pinch(Draft& draft, RandomStream& random) {
  const Draft::Cell& cell = draft.cells[below(random, draft.cells.size())];
  const int node = below(random, cell.nodes.size());
  const int num_others = 1 + below(random, std::min<std::size_t>(cell.nodes.size() - 1, draft.dim));
  Vector target = Vector::Zero(draft.dim);
  double sum = 0;
  for (int k = 1; k <= num_others; ++k) {
    const double weight = random.uniform(0.1, 1);
    target += weight * draft.positions[cell.nodes[(node + k) % cell.nodes.size()]];
    sum += weight;
  }
  target /= sum;
  const double rest = chance(random, 0.2) ? 0 : power_of_ten(random, -8, -1);
  Vector& position = draft.positions[cell.nodes[node]];
  position = target + rest * (position - target);
  return fmt::format("a node pinched to {:.0e} of {} others", rest, num_others);
}

// A node through its cell to the other side: the cell folds or turns inside out.
std::string fold(Draft& draft, RandomStream& random) {
  const Draft::Cell& cell = draft.cells[below(random, draft.cells.size())];
  Vector center = Vector::Zero(draft.dim);
  for (const Index v : cell.nodes) center += draft.positions[v] / static_cast<double>(cell.nodes.size());
  Vector& position = draft.positions[cell.nodes[below(random, cell.nodes.size())]];
  position += random.uniform(0.5, 2.5) * (center - position);
  return "a node pushed through";
}

// All nodes of a cell into a plane, exactly where the plane is normal to an axis.
std::string flatten_cell(Draft& draft, RandomStream& random) {
  const Draft::Cell& cell = draft.cells[below(random, draft.cells.size())];
  const int axis = below(random, draft.dim);
  const double plane = draft.positions[cell.nodes.front()][axis];
  for (const Index v : cell.nodes) draft.positions[v][axis] = plane;
  return "a cell flattened";
}

std::string grade(Draft& draft, RandomStream& random) {
  const double decades = random.uniform(1, 6), size = draft.size();
  if (!(size > 0)) return "all vertices in one place";
  const Vector center = draft.positions[below(random, draft.positions.size())];
  for (Vector& position : draft.positions) {
    const double distance = (position - center).norm() / size;
    position = center + (position - center) * std::pow(10, decades * (distance - 1));
  }
  return fmt::format("graded over {:.1f} decades", decades);
}

std::string squeeze(Draft& draft, RandomStream& random) {
  const double factor = power_of_ten(random, -6, 0);
  const Vector direction = chance(random, 0.5) ? Vector(Vector::Unit(draft.dim, below(random, draft.dim)))
                                               : random_direction(random, draft.dim);
  for (Vector& position : draft.positions) position -= (1 - factor) * direction.dot(position) * direction;
  return fmt::format("squeezed to {:.0e}", factor);
}

std::string turn(Draft& draft, RandomStream& random) {
  const SmallMatrix rotation = random_rotation(random, draft.dim);
  for (Vector& position : draft.positions) position = (rotation * position).eval();
  return "turned";
}

std::string rescale(Draft& draft, RandomStream& random) {
  const double scale = power_of_ten(random, -30, 30);
  for (Vector& position : draft.positions) position *= scale;
  return fmt::format("scaled by {:.0e}", scale);
}

std::string move_far(Draft& draft, RandomStream& random) {
  const double sizes = power_of_ten(random, 0, 12);
  const Vector offset = sizes * draft.size() * random_direction(random, draft.dim);
  for (Vector& position : draft.positions) position += offset;
  return fmt::format("moved by {:.0e} sizes", sizes);
}

std::string renumber(Draft& draft, RandomStream& random) {
  std::vector<Index> number(draft.positions.size());
  for (std::size_t v = 0; v < number.size(); ++v) number[v] = static_cast<Index>(v);
  for (std::size_t v = number.size(); v > 1; --v) std::swap(number[v - 1], number[below(random, v)]);
  std::vector<Vector> positions(number.size());
  for (std::size_t v = 0; v < number.size(); ++v) positions[number[v]] = draft.positions[v];
  draft.positions = positions;
  for (Draft::Cell& cell : draft.cells)
    for (Index& node : cell.nodes) node = number[node];
  for (std::size_t c = draft.cells.size(); c > 1; --c) std::swap(draft.cells[c - 1], draft.cells[below(random, c)]);
  return "renumbered";
}

struct Modifier {
  double probability;
  std::string (*apply)(Draft&, RandomStream&);
};

// In the order in which they are applied.
constexpr std::array modifiers = {Modifier{0.25, leave_cells_out}, Modifier{0.15, double_vertices},
                                  Modifier{0.1, double_cells},     Modifier{0.15, pinch},
                                  Modifier{0.15, pinch},           Modifier{0.1, fold},
                                  Modifier{0.05, flatten_cell},    Modifier{0.1, grade},
                                  Modifier{0.2, squeeze},          Modifier{0.1, invert_cells},
                                  Modifier{0.1, add_vertices},     Modifier{0.2, turn},
                                  Modifier{0.15, rescale},         Modifier{0.15, move_far},
                                  Modifier{0.15, renumber}};

}  // namespace

std::vector<std::string_view> stress_elements() {
  std::vector<std::string_view> names;
  Elements::for_each([&]<class E>() { names.push_back(E::name); });
  names.push_back("mixed");
  return names;
}

SmallMatrix random_rotation(RandomStream& random, int dim) {
  Eigen::MatrixXd matrix(dim, dim);
  for (int a = 0; a < dim; ++a)
    for (int b = 0; b < dim; ++b) matrix(a, b) = random.uniform(-1, 1);
  return Eigen::MatrixXd(Eigen::HouseholderQR<Eigen::MatrixXd>(matrix).householderQ());
}

StressMesh make_stress_mesh(std::string_view element, std::uint64_t seed) {
  const std::vector<std::string_view> known = stress_elements();
  const auto place = std::find(known.begin(), known.end(), element);
  if (place == known.end()) raise("stress: no element \"{}\"; known: {}", element, join_names(known));
  RandomStream random(seed, 100 + static_cast<std::uint64_t>(place - known.begin()));
  Draft draft = base_shape(element, random);
  for (const Modifier& modifier : modifiers)
    if (chance(random, modifier.probability)) draft.recipe += ", " + modifier.apply(draft, random);
  return {mesh_of(draft), draft.recipe};
}

}  // namespace halfgrad
