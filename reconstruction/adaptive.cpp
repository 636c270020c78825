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

// Whether a gradient is one to test others with: rows of no usable cell are zero, and damped ones beside slivers may be
// of any size. Rows above twenty, the bound of accepted patches, still serve (docs/adaptive.md).
bool is_sound(const StencilDiagnostics& row) { return row.rule != StencilRule::none && row.absolute_sum <= 1000; }

}  // namespace

Reconstruction Adaptive::reconstruct(const CellGradients& cells, std::span<const Index> vertices) const {
  const int gdim = cells.gdim();
  constexpr Index unseen = -1;
  std::vector<Index> rows(vertices.begin(), vertices.end()), row_of(cells.num_vertices(), unseen), neighbors;
  for (std::size_t r = 0; r < vertices.size(); ++r) row_of[vertices[r]] = static_cast<Index>(r);

  // Every pair of neighbours, then those of sound gradients.
  std::vector<Offset> first_pair{0};
  std::vector<Index> pairs;
  for (Index vertex : vertices) {
    find_neighbors(cells, vertex, neighbors);
    for (Index v : neighbors) {
      if (row_of[v] == unseen) {
        row_of[v] = static_cast<Index>(rows.size());
        rows.push_back(v);
      }
      pairs.push_back(row_of[v]);
    }
    first_pair.push_back(static_cast<Offset>(pairs.size()));
  }

  Reconstruction result = Kriging().reconstruct(cells, rows);
  const std::vector<StencilDiagnostics> diagnostics = result.stencils.diagnostics;
  AdaptiveBlend blend;
  blend.prediction_share = 1.0 / 3;
  blend.averaging = ChandrashekarGarg().reconstruct(cells, vertices).stencils;
  blend.beyond = split_rows(result.stencils, static_cast<Index>(vertices.size()));
  for (std::size_t r = 0; r < vertices.size(); ++r) {
    blend.caution.push_back(static_cast<double>(diagnostics[r].absolute_sum) / 5.5);
    const auto edge_to = [&](Index other) {
      return Vector((cells.vertices().row(rows[other]) - cells.vertices().row(vertices[r])).transpose());
    };
    // A vertex in the same place but for rounding has difference quotients that outweigh all others.
    double longest = 0;
    for (Offset pair = first_pair[r]; pair < first_pair[r + 1]; ++pair)
      longest = std::max(longest, edge_to(pairs[pair]).stableNorm());
    for (Offset pair = first_pair[r]; pair < first_pair[r + 1]; ++pair) {
      const Index other = pairs[pair];
      const Vector edge = edge_to(other);
      if (!(edge.stableNorm() > 1e-12 * longest) || !is_sound(diagnostics[other]) || !is_sound(diagnostics[r]))
        continue;
      blend.edge_rows.push_back(other);
      blend.edges.insert(blend.edges.end(), edge.data(), edge.data() + gdim);
    }
    blend.edge_offsets.push_back(static_cast<Offset>(blend.edge_rows.size()));
  }
  result.blend = std::move(blend);
  return result;
}

}  // namespace halfgrad
