// Rest vertices and homogeneous blocks of cells.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "framework/types.hpp"

namespace halfgrad {

/// Cells of one element type, in the element's node order.
template <Element E>
struct ElementBlock {
  using element = E;
  Eigen::Matrix<Index, Eigen::Dynamic, E::num_nodes, Eigen::RowMajor> cells;  ///< #cells × num_nodes, vertex numbers
};

/// A block of any registered element.
using AnyBlock = Elements::apply<std::variant, ElementBlock>;

/// A rest mesh. Cells are numbered through the blocks in order. Immutable.
class Mesh {
 public:
  Mesh() = default;
  /// Takes vertices (#vertices × gdim) and blocks, whose elements all have dim = gdim, or dim = 2 in R³: a surface.
  /// Throws Error on non-finite coordinates, vertex numbers out of range, a cell that repeats a vertex, and elements of
  /// another dim.
  Mesh(Points vertices, std::vector<AnyBlock> blocks);

  int gdim() const { return static_cast<int>(vertices_.cols()); }
  /// Whether the cells are surfaces in R³: framework/surface.hpp serves these.
  bool is_surface() const { return is_surface_; }
  Index num_vertices() const { return static_cast<Index>(vertices_.rows()); }
  Index num_cells() const { return first_cell_.empty() ? 0 : first_cell_.back(); }
  const Points& vertices() const { return vertices_; }
  const std::vector<AnyBlock>& blocks() const { return blocks_; }
  /// Number of the first cell of a block; first_cell(blocks().size()) is num_cells().
  Index first_cell(std::size_t block) const { return first_cell_[block]; }
  /// The block that holds a cell.
  std::size_t block_of(Index cell) const;
  /// The vertices of a cell, in node order.
  std::span<const Index> cell_vertices(Index cell) const;

 private:
  Points vertices_;
  std::vector<AnyBlock> blocks_;
  std::vector<Index> first_cell_;  // #blocks + 1
  bool is_surface_ = false;
};

/// Calls f(const ElementBlock<E>& block, Index first_cell) for each block: the one place where element types resolve.
template <class Function>
void for_each_block(const Mesh& mesh, Function&& f) {
  for (std::size_t b = 0; b < mesh.blocks().size(); ++b)
    std::visit([&](const auto& block) { f(block, mesh.first_cell(b)); }, mesh.blocks()[b]);
}

/// Calls f(const ElementBlock<E>& block, Index row) for one cell.
template <class Function>
decltype(auto) with_cell(const Mesh& mesh, Index cell, Function&& f) {
  const std::size_t b = mesh.block_of(cell);
  return std::visit(
      [&](const auto& block) -> decltype(auto) {
        return f(block, static_cast<Eigen::Index>(cell - mesh.first_cell(b)));
      },
      mesh.blocks()[b]);
}

/// Rest positions of a cell's nodes, num_nodes × gdim, in a mesh that is no surface.
template <Element E>
Eigen::Matrix<double, E::num_nodes, E::dim> node_positions(const Mesh& mesh, const ElementBlock<E>& block,
                                                           Eigen::Index row) {
  Eigen::Matrix<double, E::num_nodes, E::dim> positions;
  for (int i = 0; i < E::num_nodes; ++i)
    positions.row(i) = mesh.vertices().row(block.cells(row, i)).template head<E::dim>();
  return positions;
}

/// Name of a cell's element type.
std::string_view element_name(const Mesh& mesh, Index cell);

/// A table of rows of Index: row i is entries[offsets[i] … offsets[i+1]).
struct IndexTable {
  std::vector<Offset> offsets{0};
  std::vector<Index> entries;
  Index num_rows() const { return static_cast<Index>(offsets.size() - 1); }
  std::span<const Index> operator[](Index row) const {
    return {entries.data() + offsets[row], static_cast<std::size_t>(offsets[row + 1] - offsets[row])};
  }
};

/// The rows that hold each number from 0 to num_numbers − 1, ascending.
IndexTable transposed(const IndexTable& table, Index num_numbers);

/// The cells at each vertex, ascending.
IndexTable vertex_cells(const Mesh& mesh);

/// A facet by its vertices in ascending order, the greatest Index where it has fewer than four.
using FacetKey = std::array<Index, 4>;

/// Appends the facets of a cell.
template <Element E>
void append_facets(const ElementBlock<E>& block, Eigen::Index row, std::vector<FacetKey>& facets) {
  for (const Facet& facet : E::facets) {
    FacetKey key;
    key.fill(std::numeric_limits<Index>::max());
    for (int i = 0; i < facet.num_nodes; ++i) key[i] = block.cells(row, facet.nodes[i]);
    std::sort(key.begin(), key.end());
    facets.push_back(key);
  }
}

/// Appends the facets of a block, one for each cell at it.
template <Element E>
void append_facets(const ElementBlock<E>& block, std::vector<FacetKey>& facets) {
  for (Eigen::Index c = 0; c < block.cells.rows(); ++c) append_facets(block, c, facets);
}

/// For each vertex 1 where it lies on a facet that is listed once only (or more than twice), else 0.
std::vector<char> boundary_vertices(std::vector<FacetKey> facets, Index num_vertices);

/// For each vertex 1 where it lies on a facet that belongs to one cell only (or on a non-manifold facet), else 0.
std::vector<char> boundary_vertices(const Mesh& mesh);

/// What is wrong or notable in a mesh, found without changing it.
struct MeshReport {
  std::vector<Index> degenerate_cells;  ///< is_degenerate (cell_extent.hpp): they have no gradient and hold no points
  std::vector<Index> inverted_cells;    ///< det J negative at some node (accepted; weights do not depend on the sign)
  std::vector<Index> folded_cells;      ///< det J changes sign within the cell: its inverse map is not unique
  std::vector<Index> unused_vertices;   ///< in no cell
  Index num_boundary_facets = 0;
  Index num_nonmanifold_facets = 0;  ///< shared by three cells or more
  double volume = 0;                 ///< Σ|det J(center)| · reference volume, in length^gdim
  double mean_edge = 0, min_edge = 0, max_edge = 0;
  double min_quality = 0, mean_quality = 0;  ///< least |det J| at a node over the product of its edge lengths, 0 … 1
};

/// Inspects every cell; O(mesh). Cells of a surface are seen in their own plane.
MeshReport inspect(const Mesh& mesh);

/// Mean length of the edges of the cells, the h of all convergence tables.
double mean_edge_length(const Mesh& mesh);

}  // namespace halfgrad
