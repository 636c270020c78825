// Where a stress case looks: points placed in cells by hand, and points that had to be found.
#pragma once

#include <utility>
#include <vector>

#include "experiments/random.hpp"
#include "framework/embedding.hpp"

namespace halfgrad {

/// Points of a case. The first `num_placed` have a cell and ξ by construction, the others were located.
struct StressPoints {
  Embedding embedding;
  Index num_placed = 0;
  std::vector<Index> vertex;                    ///< #placed: the vertex at the point, or −1
  std::vector<std::pair<Index, Index>> shared;  ///< placed points at one place of a facet, seen from two cells
  Points positions;                             ///< of the located ones
  std::vector<char> in_cell;  ///< of the located ones: 1 where it was taken from a cell whose map is affine

  /// The entry of embedding.outside of a point that its cell serves from outside, or null.
  const OutsidePoint* outside(Index point) const;
};

/// Cells of a mesh that have a volume (cell_extent.hpp), 1 or 0.
std::vector<char> usable_cells(const Mesh& mesh);

/// Places points in usable cells, on their vertices and on facets that two of them share, and locates positions inside,
/// on vertices and outside by embed() with the policy nearest. Throws Error where no cell is usable.
StressPoints make_stress_points(const Mesh& mesh, const std::vector<char>& usable, RandomStream& random);

}  // namespace halfgrad
