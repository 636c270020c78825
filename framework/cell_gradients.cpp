#include "framework/cell_gradients.hpp"

#include "framework/error.hpp"

namespace halfgrad {

CellGradients::CellGradients(const Mesh& mesh)
    : vertices_(&mesh.vertices()), mesh_(&mesh), vertex_cells_(vertex_cells(mesh)), boundary_(boundary_vertices(mesh)) {
  if (mesh.is_surface())
    raise("cell gradients of a surface in space: use surface_gradients, which fits tangent planes");
}

CellGradients::CellGradients(const CellTable& table)
    : vertices_(&table.vertices),
      table_(&table),
      vertex_cells_(transposed(table.cells, static_cast<Index>(table.vertices.rows()))),
      boundary_(table.boundary) {}

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
    return Vector(node_positions(*mesh_, block, row).transpose() * E::shape(E::center()));
  });
}

}  // namespace halfgrad
