#include "reconstruction/adaptive.hpp"

#include <algorithm>

#include "framework/error.hpp"
#include "reconstruction/cell_averages.hpp"
#include "reconstruction/kriging.hpp"

namespace halfgrad {

namespace {

// Vertices that share a cell with a vertex, ascending: its edges, on simplices.
void find_neighbors(const CellGradients& cells, Index vertex, std::vector<Index>& neighbors) {
  neighbors.clear();
  for (Index cell : cells.cells_of(vertex))
    for (Index v : cells.vertices_of(cell))
      if (v != vertex) neighbors.push_back(v);
  std::sort(neighbors.begin(), neighbors.end());
  neighbors.erase(std::unique(neighbors.begin(), neighbors.end()), neighbors.end());
}

}  // namespace

Reconstruction Adaptive::reconstruct(const CellGradients& cells, std::span<const Index> vertices) const {
  const int gdim = cells.gdim();
  constexpr Index unseen = -1;
  std::vector<Index> rows(vertices.begin(), vertices.end()), row_of(cells.num_vertices(), unseen), neighbors;
  for (std::size_t r = 0; r < vertices.size(); ++r) row_of[vertices[r]] = static_cast<Index>(r);

  AdaptiveBlend blend;
  blend.prediction_share = 0.25;
  for (Index vertex : vertices) {
    find_neighbors(cells, vertex, neighbors);
    for (Index v : neighbors) {
      const Vector edge = (cells.vertices().row(v) - cells.vertices().row(vertex)).transpose();
      if (!(edge.squaredNorm() > 0)) continue;
      if (row_of[v] == unseen) {
        row_of[v] = static_cast<Index>(rows.size());
        rows.push_back(v);
      }
      blend.edge_rows.push_back(row_of[v]);
      blend.edges.insert(blend.edges.end(), edge.data(), edge.data() + gdim);
    }
    blend.edge_offsets.push_back(static_cast<Offset>(blend.edge_rows.size()));
  }
  blend.probing = Kriging({.patch = KrigingPatch::lean}).reconstruct(cells, rows).stencils;
  blend.averaging = ChandrashekarGarg().reconstruct(cells, vertices).stencils;
  Reconstruction result = Kriging().reconstruct(cells, vertices);
  result.blend = std::move(blend);
  return result;
}

}  // namespace halfgrad
