#include "framework/mesh.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "framework/cell_extent.hpp"
#include "framework/cell_map.hpp"
#include "framework/error.hpp"
#include "framework/large_array.hpp"
#include "framework/tangent_plane.hpp"

namespace halfgrad {

namespace {

std::vector<FacetKey> all_facets(const Mesh& mesh) {
  std::vector<FacetKey> facets;
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) { append_facets(block, facets); });
  return facets;
}

// Few facets share their lowest vertex: counting brings those together, and each such group is sorted.
std::vector<FacetKey> sorted(const std::vector<FacetKey>& facets, Index num_vertices) {
  std::vector<Offset> next(static_cast<std::size_t>(num_vertices) + 1, 0);
  for (const FacetKey& key : facets) ++next[key[0] + 1];
  std::partial_sum(next.begin(), next.end(), next.begin());
  std::vector<FacetKey> result(facets.size());
  for (const FacetKey& key : facets) result[next[key[0]]++] = key;
  // Each place has moved to the start of the next group.
  for (Offset begin = 0; const Offset end : next) {
    std::sort(result.begin() + begin, result.begin() + end);
    begin = end;
  }
  return result;
}

// Calls f(key, count) for each distinct facet.
template <class Function>
void for_each_facet(const std::vector<FacetKey>& sorted, Function&& f) {
  for (std::size_t i = 0; i < sorted.size();) {
    std::size_t j = i;
    while (j < sorted.size() && sorted[j] == sorted[i]) ++j;
    f(sorted[i], j - i);
    i = j;
  }
}

// Node positions as the inspection sees them: those of a surface's cell in the cell's own plane.
template <Element E>
NodeMatrix<E> inspected_positions(const Mesh& mesh, const ElementBlock<E>& block, Eigen::Index row) {
  if constexpr (E::dim == 2)
    if (mesh.is_surface()) {
      Eigen::Matrix<double, E::num_nodes, 3> nodes;
      for (int i = 0; i < E::num_nodes; ++i) nodes.row(i) = mesh.vertices().row(block.cells(row, i));
      return nodes * tangent_basis(area_vector<E::num_nodes>(nodes));
    }
  return node_positions(mesh, block, row);
}

// The edges of an element, read off its facets: consecutive nodes of a facet with two nodes or more.
template <Element E>
std::vector<std::pair<int, int>> local_edges() {
  std::vector<std::pair<int, int>> edges;
  for (const Facet& facet : E::facets)
    for (int i = 0; i < facet.num_nodes; ++i) {
      const int a = facet.nodes[i], b = facet.nodes[(i + 1) % facet.num_nodes];
      if (a != b) edges.emplace_back(std::min(a, b), std::max(a, b));
    }
  if constexpr (E::dim == 1) edges.emplace_back(0, 1);
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

}  // namespace

Mesh::Mesh(Points vertices, std::vector<AnyBlock> blocks) : vertices_(std::move(vertices)), blocks_(std::move(blocks)) {
  if (vertices_.rows() > std::numeric_limits<Index>::max())
    raise("a mesh of {} vertices: at most {} can be numbered", vertices_.rows(), std::numeric_limits<Index>::max());
  if (vertices_.cols() < 1 || vertices_.cols() > max_gdim)
    raise("vertices with {} coordinates: expected 1 to {}", vertices_.cols(), max_gdim);
  for (Eigen::Index v = 0; v < vertices_.rows(); ++v)
    if (!vertices_.row(v).allFinite()) raise("vertex {} has a coordinate that is not finite", v);
  first_cell_.push_back(0);
  for (const AnyBlock& any : blocks_)
    std::visit(
        [&]<Element E>(const ElementBlock<E>& block) {
          const bool surface = E::dim == 2 && vertices_.cols() == 3;
          if (E::dim != vertices_.cols() && !surface)
            raise("{} cells need vertices with {} coordinates, found {}", E::name, E::dim, vertices_.cols());
          if (first_cell_.size() > 1 && surface != is_surface_)
            raise("{} cells in a mesh of dimension {}", E::name, is_surface_ ? 2 : 3);
          is_surface_ = surface;
          if (block.cells.rows() > std::numeric_limits<Index>::max() - first_cell_.back())
            raise("more than {} cells", std::numeric_limits<Index>::max());
          for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
            const auto cell = block.cells.row(c);
            for (int i = 0; i < E::num_nodes; ++i) {
              if (cell[i] < 0 || cell[i] >= vertices_.rows())
                raise("cell {} ({}) names vertex {}: expected 0 to {}", first_cell_.back() + c, E::name, cell[i],
                      vertices_.rows() - 1);
              for (int j = 0; j < i; ++j)
                if (cell[i] == cell[j])
                  raise("cell {} ({}) names vertex {} twice", first_cell_.back() + c, E::name, cell[i]);
            }
          }
          first_cell_.push_back(first_cell_.back() + static_cast<Index>(block.cells.rows()));
        },
        any);
}

std::size_t Mesh::block_of(Index cell) const {
  if (blocks_.size() == 1) return 0;
  return static_cast<std::size_t>(std::upper_bound(first_cell_.begin(), first_cell_.end(), cell) - first_cell_.begin() -
                                  1);
}

std::span<const Index> Mesh::cell_vertices(Index cell) const {
  const std::size_t b = block_of(cell);
  return std::visit(
      [&]<Element E>(const ElementBlock<E>& block) {
        return std::span<const Index>(
            block.cells.data() + static_cast<Eigen::Index>(cell - first_cell_[b]) * E::num_nodes, E::num_nodes);
      },
      blocks_[b]);
}

std::string_view element_name(const Mesh& mesh, Index cell) {
  return with_cell(mesh, cell,
                   []<Element E>(const ElementBlock<E>&, Eigen::Index) { return std::string_view(E::name); });
}

IndexTable transposed(const IndexTable& table, Index num_numbers) {
  IndexTable result;
  result.offsets.assign(static_cast<std::size_t>(num_numbers) + 1, 0);
  for (Index number : table.entries) ++result.offsets[number + 1];
  std::partial_sum(result.offsets.begin(), result.offsets.end(), result.offsets.begin());
  result.entries.resize(result.offsets.back());
  std::vector<Offset> next(result.offsets.begin(), result.offsets.end() - 1);
  for (Index row = 0; row < table.num_rows(); ++row)
    for (Index number : table[row]) result.entries[next[number]++] = row;
  return result;
}

IndexTable vertex_cells(const Mesh& mesh) {
  IndexTable table;
  table.offsets.assign(static_cast<std::size_t>(mesh.num_vertices()) + 1, 0);
  const auto each_corner = [&](auto&& f) {
    for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index first) {
      for (Eigen::Index c = 0; c < block.cells.rows(); ++c)
        for (int i = 0; i < E::num_nodes; ++i) f(block.cells(c, i), static_cast<Index>(first + c));
    });
  };
  each_corner([&](Index v, Index) { ++table.offsets[v + 1]; });
  std::partial_sum(table.offsets.begin(), table.offsets.end(), table.offsets.begin());
  reserve_large(table.entries, table.offsets.back());
  table.entries.resize(table.offsets.back());
  std::vector<Offset> next(table.offsets.begin(), table.offsets.end() - 1);
  each_corner([&](Index v, Index c) { table.entries[next[v]++] = c; });
  return table;
}

std::vector<char> boundary_vertices(std::vector<FacetKey> facets, Index num_vertices) {
  std::vector<char> boundary(num_vertices, 0);
  for_each_facet(sorted(facets, num_vertices), [&](const FacetKey& key, std::size_t count) {
    if (count == 2) return;
    for (Index v : key)
      if (v != std::numeric_limits<Index>::max()) boundary[v] = 1;
  });
  return boundary;
}

std::vector<char> boundary_vertices(const Mesh& mesh) {
  return boundary_vertices(all_facets(mesh), mesh.num_vertices());
}

MeshReport inspect(const Mesh& mesh) {
  MeshReport report;
  report.min_edge = report.min_quality = std::numeric_limits<double>::infinity();
  double edge_sum = 0, quality_sum = 0;
  Offset num_edges = 0;
  std::vector<char> used(mesh.num_vertices(), 0);
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index first) {
    static const auto edges = local_edges<E>();
    const auto reference = E::nodes();
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
      const NodeMatrix<E> positions = inspected_positions(mesh, block, c);
      for (int i = 0; i < E::num_nodes; ++i) used[block.cells(c, i)] = 1;
      double longest = 0;
      for (const auto& [a, b] : edges) {
        const double length = (positions.row(a) - positions.row(b)).norm();
        longest = std::max(longest, length);
        report.min_edge = std::min(report.min_edge, length);
        edge_sum += length;
        ++num_edges;
      }
      report.max_edge = std::max(report.max_edge, longest);
      double lowest = std::numeric_limits<double>::infinity(), highest = -lowest, quality = 1;
      for (int i = 0; i < E::num_nodes; ++i) {
        const Eigen::Matrix<double, E::dim, E::dim> jacobian =
            cell_jacobian<E>(positions, reference.row(i).transpose());
        const double determinant = jacobian.determinant();
        lowest = std::min(lowest, determinant);
        highest = std::max(highest, determinant);
        const double edge_product = jacobian.colwise().norm().prod();
        quality = std::min(quality, edge_product > 0 ? std::abs(determinant) / edge_product : 0);
      }
      const Index cell = static_cast<Index>(first + c);
      if (lowest < 0) report.inverted_cells.push_back(cell);
      if (lowest < 0 && highest > 0) report.folded_cells.push_back(cell);
      // Differences to the first node, so that an offset of the mesh does not blur a flat cell's determinant.
      const NodeMatrix<E> edges_from_first = from_first_node<E>(positions);
      const double determinant = cell_jacobian<E>(edges_from_first, E::center()).determinant();
      if (is_degenerate<E>(cell_extent<E>(edges_from_first), determinant)) report.degenerate_cells.push_back(cell);
      report.volume += std::abs(determinant) * E::reference_volume;
      report.min_quality = std::min(report.min_quality, quality);
      quality_sum += quality;
    }
  });
  for_each_facet(sorted(all_facets(mesh), mesh.num_vertices()), [&](const FacetKey&, std::size_t count) {
    if (count == 1) ++report.num_boundary_facets;
    if (count > 2) ++report.num_nonmanifold_facets;
  });
  for (Index v = 0; v < mesh.num_vertices(); ++v)
    if (!used[v]) report.unused_vertices.push_back(v);
  if (mesh.num_cells() == 0) {
    report.min_edge = report.min_quality = 0;
    return report;
  }
  report.mean_edge = edge_sum / static_cast<double>(num_edges);
  report.mean_quality = quality_sum / mesh.num_cells();
  return report;
}

double mean_edge_length(const Mesh& mesh) {
  double sum = 0;
  Offset count = 0;
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) {
    static const auto edges = local_edges<E>();
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
      for (const auto& [a, b] : edges)
        sum += (mesh.vertices().row(block.cells(c, a)) - mesh.vertices().row(block.cells(c, b))).norm();
      count += static_cast<Offset>(edges.size());
    }
  });
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

}  // namespace halfgrad
