#include "experiments/stress_points.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <map>

#include "framework/cell_extent.hpp"
#include "framework/cell_map.hpp"
#include "framework/error.hpp"
#include "framework/inverse_map.hpp"

namespace halfgrad {

namespace {

Index pick(RandomStream& random, std::size_t count) {
  return static_cast<Index>(random.uniform(0, static_cast<double>(count)));
}

// A random ξ of the reference cell: a mean of its nodes with random weights.
template <Element E>
Vector random_local(RandomStream& random) {
  NodeVector<E> weights;
  for (int i = 0; i < E::num_nodes; ++i) weights[i] = random.uniform(0, 1) * random.uniform(0, 1);
  return E::nodes().transpose() * weights / weights.sum();
}

struct Side {
  Index cell;
  std::vector<Index> vertices;  // of the facet, in cyclic order
  std::vector<int> nodes;
};

std::map<FacetKey, std::vector<Side>> sides_of(const Mesh& mesh, const std::vector<char>& usable) {
  std::map<FacetKey, std::vector<Side>> sides;
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index first) {
    std::vector<FacetKey> keys;
    append_facets(block, keys);
    for (std::size_t f = 0; f < keys.size(); ++f) {
      const auto row = static_cast<Eigen::Index>(f / E::facets.size());
      const Index cell = first + static_cast<Index>(row);
      if (!usable[cell]) continue;
      const Facet& facet = E::facets[f % E::facets.size()];
      Side side{cell, {}, {}};
      for (int i = 0; i < facet.num_nodes; ++i) {
        side.nodes.push_back(facet.nodes[i]);
        side.vertices.push_back(block.cells(row, facet.nodes[i]));
      }
      sides[keys[f]].push_back(side);
    }
  });
  return sides;
}

// Weights of a random point of a facet: linear, or bilinear over its cyclic order.
std::vector<double> facet_weights(RandomStream& random, std::size_t num_nodes) {
  if (num_nodes == 1) return {1};
  const double s = random.uniform(), t = random.uniform();
  if (num_nodes == 2) return {1 - s, s};
  if (num_nodes == 4) return {(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t};
  return {1 - s, s * (1 - t), s * t};
}

class PointMaker {
 public:
  PointMaker(const Mesh& mesh, RandomStream& random) : mesh_(mesh), random_(random) {}

  void place(Index cell, const Vector& local, Index vertex) {
    cells_.push_back(cell);
    local_.push_back(local);
    result_.vertex.push_back(vertex);
  }

  void place_inside(Index cell) {
    with_cell(mesh_, cell,
              [&]<Element E>(const ElementBlock<E>&, Eigen::Index) { place(cell, random_local<E>(random_), -1); });
  }

  void place_on_vertices(Index cell) {
    with_cell(mesh_, cell, [&]<Element E>(const ElementBlock<E>& block, Eigen::Index row) {
      for (int i = 0; i < E::num_nodes; ++i) place(cell, E::nodes().row(i).transpose(), block.cells(row, i));
    });
  }

  void place_on_shared_facet(const Side& a, const Side& b) {
    const std::vector<double> weights = facet_weights(random_, a.nodes.size());
    if (a.nodes.size() == 4) {  // twisted against each other: the bilinear patches differ
      const auto at = std::find(b.vertices.begin(), b.vertices.end(), a.vertices[0]) - b.vertices.begin();
      if (b.vertices[(at + 2) % 4] != a.vertices[2]) return;
    }
    result_.shared.emplace_back(static_cast<Index>(cells_.size()), static_cast<Index>(cells_.size() + 1));
    for (const Side* side : {&a, &b})
      with_cell(mesh_, side->cell, [&]<Element E>(const ElementBlock<E>&, Eigen::Index) {
        ReferencePoint<E> xi = ReferencePoint<E>::Zero();
        for (std::size_t i = 0; i < a.nodes.size(); ++i) {
          const auto at = std::find(side->vertices.begin(), side->vertices.end(), a.vertices[i]);
          xi += weights[i] * E::nodes().row(side->nodes[at - side->vertices.begin()]).transpose();
        }
        place(side->cell, xi, -1);
      });
  }

  // A position of a cell, for embed() to find: surely where the cell is a simplex or a parallelepiped.
  void seek_inside(Index cell, bool at_vertex) {
    with_cell(mesh_, cell, [&]<Element E>(const ElementBlock<E>& block, Eigen::Index row) {
      const NodeMatrix<E> positions = node_positions(mesh_, block, row);
      const NodeMatrix<E> edges = from_first_node<E>(positions);
      ReferencePoint<E> inside = cell_position<E>(edges, random_local<E>(random_));
      for (int a = 0; a < E::dim; ++a) inside[a] += positions(0, a);
      const InverseMap<E> map(positions);
      positions_.push_back(at_vertex ? Vector(positions.row(E::num_nodes - 1).transpose()) : Vector(inside));
      result_.in_cell.push_back(!map.degenerate() && map.affine());
    });
  }

  void seek(const Vector& position) {
    positions_.push_back(position);
    result_.in_cell.push_back(0);
  }

  StressPoints finish() {
    result_.num_placed = static_cast<Index>(cells_.size());
    result_.positions.resize(static_cast<Eigen::Index>(positions_.size()), mesh_.gdim());
    for (std::size_t p = 0; p < positions_.size(); ++p)
      result_.positions.row(static_cast<Eigen::Index>(p)) = positions_[p].transpose();
    Embedding found = embed(mesh_, result_.positions, {.outside = Outside::nearest});
    Embedding& all = result_.embedding;
    all.gdim = mesh_.gdim();
    all.cells = cells_;
    all.cells.insert(all.cells.end(), found.cells.begin(), found.cells.end());
    all.status.assign(cells_.size(), PointStatus::inside);
    all.status.insert(all.status.end(), found.status.begin(), found.status.end());
    all.local.resize(static_cast<Eigen::Index>(all.cells.size()), mesh_.gdim());
    for (std::size_t p = 0; p < local_.size(); ++p) all.local.row(static_cast<Eigen::Index>(p)) = local_[p].transpose();
    all.local.bottomRows(found.local.rows()) = found.local;
    for (OutsidePoint outside : found.outside) {
      outside.point += result_.num_placed;
      all.outside.push_back(outside);
    }
    return std::move(result_);
  }

 private:
  const Mesh& mesh_;
  RandomStream& random_;
  StressPoints result_;
  std::vector<Index> cells_;
  std::vector<Vector> local_, positions_;
};

}  // namespace

const OutsidePoint* StressPoints::outside(Index point) const {
  if (embedding.status[point] != PointStatus::outside) return nullptr;
  for (const OutsidePoint& entry : embedding.outside)
    if (entry.point == point) return &entry;
  return nullptr;
}

std::vector<char> usable_cells(const Mesh& mesh) {
  std::vector<char> usable;
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) {
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
      const NodeMatrix<E> positions = node_positions(mesh, block, c);
      const NodeMatrix<E> edges = from_first_node<E>(positions);
      usable.push_back(!is_degenerate<E>(cell_extent<E>(edges), cell_jacobian<E>(edges, E::center()).determinant()));
    }
  });
  return usable;
}

StressPoints make_stress_points(const Mesh& mesh, const std::vector<char>& usable, RandomStream& random) {
  std::vector<Index> cells;
  for (Index c = 0; c < mesh.num_cells(); ++c)
    if (usable[c]) cells.push_back(c);
  PointMaker maker(mesh, random);
  if (cells.empty()) {
    maker.seek(mesh.vertices().row(0).transpose());
    return maker.finish();
  }
  constexpr int num_visited = 4;
  for (int k = 0; k < num_visited; ++k) {
    const Index cell = cells[pick(random, cells.size())];
    maker.place_inside(cell);
    maker.seek_inside(cell, false);
    if (k == 0) maker.place_on_vertices(cell);
    if (k == 1) maker.seek_inside(cell, true);
  }
  std::vector<std::pair<Side, Side>> shared;
  for (const auto& [key, sides] : sides_of(mesh, usable))
    for (std::size_t s = 1; s < sides.size(); ++s) shared.emplace_back(sides[0], sides[s]);
  for (int k = 0; k < num_visited && !shared.empty(); ++k) {
    const auto& [a, b] = shared[pick(random, shared.size())];
    maker.place_on_shared_facet(a, b);
  }
  const Vector low = mesh.vertices().colwise().minCoeff().transpose(),
               high = mesh.vertices().colwise().maxCoeff().transpose();
  for (const double reach : {0.7, 0.7, 100.0}) {
    Vector position = (low + high) / 2;
    for (int a = 0; a < mesh.gdim(); ++a) position[a] += random.uniform(-reach, reach) * (high[a] - low[a]);
    maker.seek(position);
  }
  return maker.finish();
}

}  // namespace halfgrad
