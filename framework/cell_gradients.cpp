#include "framework/cell_gradients.hpp"

#include <algorithm>

#include "framework/error.hpp"

namespace halfgrad {

CellGradients::CellGradients(const Mesh& mesh)
    : vertices_(&mesh.vertices()), mesh_(&mesh), vertex_cells_(vertex_cells(mesh)) {
  if (mesh.is_surface())
    raise("cell gradients of a surface in space: use surface_gradients, which fits tangent planes");
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index first) {
    blocks_.push_back({first, first + static_cast<Index>(block.cells.rows()), E::num_nodes, block.cells.data()});
  });
}

CellGradients::CellGradients(const CellTable& table)
    : vertices_(&table.vertices),
      table_(&table),
      vertex_cells_(transposed(table.cells, static_cast<Index>(table.vertices.rows()))) {}

bool CellGradients::on_boundary(Index vertex) const {
  if (table_ != nullptr) return table_->boundary[vertex] != 0;
  // The cells that share a facet with the vertex are among those at the vertex.
  std::vector<FacetKey> facets;
  for (const Index cell : cells_of(vertex))
    with_cell(*mesh_, cell,
              [&]<Element E>(const ElementBlock<E>& block, Eigen::Index row) { append_facets(block, row, facets); });
  std::erase_if(facets, [vertex](const FacetKey& key) { return std::ranges::find(key, vertex) == key.end(); });
  std::ranges::sort(facets);
  for (auto facet = facets.begin(); facet != facets.end();) {
    const auto next = std::upper_bound(facet, facets.end(), *facet);
    if (next - facet != 2) return true;
    facet = next;
  }
  return false;
}

// Flattened: small fixed-size products that are not inlined cost more than they compute.
[[gnu::flatten]] CellGradient CellGradients::gradient(Index cell) const {
  if (table_ != nullptr) return table_->gradients[cell];
  return with_cell(*mesh_, cell, [&]<Element E>(const ElementBlock<E>& block, Eigen::Index row) {
    return cell_gradient<E>(node_positions(*mesh_, block, row));
  });
}

Vector CellGradients::centroid(Index cell) const {
  if (table_ != nullptr) return table_->gradients[cell].centroid;
  return with_cell(*mesh_, cell, [&]<Element E>(const ElementBlock<E>& block, Eigen::Index row) {
    return Vector(cell_position<E>(node_positions(*mesh_, block, row), E::center()));
  });
}

}  // namespace halfgrad
