// Cells of any element types, registered or not: turned into the numbers that reconstruction and interpolation read.
#pragma once

#include <numeric>
#include <tuple>

#include "framework/cell_gradients.hpp"
#include "framework/embedding.hpp"
#include "framework/error.hpp"
#include "framework/inverse_map.hpp"
#include "framework/weighted_points.hpp"

namespace halfgrad {

/// Rest vertices and blocks of cells of the element types Es, all of the same dim, which is that of the space. For
/// elements that the registry does not hold: a project's own, or simplices of four dimensions. Elements have at most
/// max_nodes nodes, facets of at most four, and dim at most max_gdim. Aggregate; cell_table() checks it.
template <Element... Es>
struct CellBlocks {
  Points vertices;  ///< #vertices × dim
  std::tuple<ElementBlock<Es>...> blocks;
};

/// Calls f(const ElementBlock<E>&, first cell) for each block in order.
template <Element... Es, class Function>
void for_each_block(const CellBlocks<Es...>& cells, Function&& f) {
  Index first = 0;
  const auto visit = [&](const auto& block) {
    f(block, first);
    first += static_cast<Index>(block.cells.rows());
  };
  std::apply([&](const auto&... block) { (visit(block), ...); }, cells.blocks);
}

/// Rest positions of a cell's nodes, num_nodes × dim.
template <Element E>
NodeMatrix<E> node_positions(const Points& vertices, const ElementBlock<E>& block, Eigen::Index row) {
  NodeMatrix<E> positions;
  for (int i = 0; i < E::num_nodes; ++i) positions.row(i) = vertices.row(block.cells(row, i));
  return positions;
}

/// What reconstructors read (CellGradients). Throws Error on vertex numbers out of range, a cell that repeats a vertex,
/// coordinates that are not finite and vertices whose number of coordinates is not the elements' dim.
template <Element... Es>
CellTable cell_table(const CellBlocks<Es...>& cells) {
  static_assert(((Es::dim <= max_gdim && Es::num_nodes <= max_nodes) && ...));
  CellTable table;
  table.vertices = cells.vertices;
  if (!table.vertices.allFinite()) raise("a vertex has a coordinate that is not finite");
  std::vector<FacetKey> facets;
  for_each_block(cells, [&]<Element E>(const ElementBlock<E>& block, Index first) {
    if (E::dim != cells.vertices.cols())
      raise("{} cells need vertices with {} coordinates, found {}", E::name, E::dim, cells.vertices.cols());
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
      for (int i = 0; i < E::num_nodes; ++i) {
        const Index vertex = block.cells(c, i);
        if (vertex < 0 || vertex >= cells.vertices.rows())
          raise("cell {} ({}) names vertex {}: expected 0 to {}", first + c, E::name, vertex,
                cells.vertices.rows() - 1);
        for (int j = 0; j < i; ++j)
          if (block.cells(c, j) == vertex) raise("cell {} ({}) names vertex {} twice", first + c, E::name, vertex);
        table.cells.entries.push_back(vertex);
      }
      table.cells.offsets.push_back(static_cast<Offset>(table.cells.entries.size()));
      table.gradients.push_back(cell_gradient<E>(node_positions(cells.vertices, block, c)));
    }
    append_facets(block, facets);
  });
  table.boundary = boundary_vertices(std::move(facets), static_cast<Index>(cells.vertices.rows()));
  return table;
}

/// The weights of points (#points × dim) in the cell of greatest margin, ties to the first. Policies `error` and `mark`
/// for points outside; `nearest` throws Error. Tests each cell against the points within its bounds, which are found by
/// their first coordinate alone: for up to some 100,000 cells.
template <Element... Es>
WeightedPoints embed(const CellBlocks<Es...>& cells, const Points& points, const EmbedOptions& options = {}) {
  constexpr int dim = std::max({Es::dim...});
  check_points(points, dim, options);
  if (options.outside == Outside::nearest)
    raise("points outside cells of unregistered elements: the policy nearest is not known; use error or mark");
  const Index num_points = static_cast<Index>(points.rows());
  std::vector<Index> order(num_points);
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](Index a, Index b) { return points(a, 0) < points(b, 0); });

  struct Claim {
    double margin = -std::numeric_limits<double>::infinity();
    int num_nodes = 0;
    std::array<Index, max_nodes> vertices{};
    std::array<double, max_nodes> weights{};
  };
  std::vector<Claim> claims(num_points);
  for_each_block(cells, [&]<Element E>(const ElementBlock<E>& block, Index) {
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
      const NodeMatrix<E> positions = node_positions(cells.vertices, block, c);
      const InverseMap<E> map(positions);
      if (map.degenerate()) continue;
      const ReferencePoint<E> growth = E::num_nodes * options.tolerance * cell_extent<E>(positions);
      ReferencePoint<E> low, high;
      for (int a = 0; a < E::dim; ++a) {
        low[a] = positions.col(a).minCoeff() - growth[a];
        high[a] = positions.col(a).maxCoeff() + growth[a];
      }
      auto at = std::lower_bound(order.begin(), order.end(), low[0],
                                 [&](Index p, double bound) { return points(p, 0) < bound; });
      for (; at != order.end() && points(*at, 0) <= high[0]; ++at) {
        const ReferencePoint<E> position = points.row(*at).transpose();
        bool near = true;
        for (int a = 0; a < E::dim; ++a) near &= position[a] >= low[a] && position[a] <= high[a];
        if (!near) continue;
        const InverseMapResult<E> result = map(position);
        if (!result.converged) continue;
        Claim& claim = claims[*at];
        const double margin = E::margin(result.xi);
        if (margin < -options.tolerance || margin <= claim.margin) continue;
        claim.margin = margin;
        claim.num_nodes = E::num_nodes;
        const NodeVector<E> beta = E::shape(result.xi);
        for (int i = 0; i < E::num_nodes; ++i) {
          claim.vertices[i] = block.cells(c, i);
          claim.weights[i] = beta[i];
        }
      }
    }
  });

  WeightedPoints result;
  result.gdim = dim;
  result.num_vertices = static_cast<Index>(cells.vertices.rows());
  for (Index p = 0; p < num_points; ++p) {
    const Claim& claim = claims[p];
    if (claim.num_nodes == 0 && options.outside == Outside::error)
      raise("point {} lies in no cell: expected points inside, or the policy mark (its result is NaN)", p);
    for (int i = 0; i < claim.num_nodes; ++i) {
      result.vertices.push_back(claim.vertices[i]);
      result.weights.push_back(claim.weights[i]);
      for (int a = 0; a < dim; ++a) result.arms.push_back(points(p, a) - cells.vertices(claim.vertices[i], a));
    }
    result.offsets.push_back(static_cast<Offset>(result.vertices.size()));
  }
  return result;
}

}  // namespace halfgrad
