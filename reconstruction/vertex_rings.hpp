// The vertices around a vertex, ring by ring.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "framework/cell_gradients.hpp"

namespace halfgrad {

/// Distances that differ by less (relatively) tie, and patches take all that tie with their last member: on lattices
/// neither numbering nor the round-off of positions far from the origin chooses among equals.
inline constexpr double distance_tie = 1e-6;

/// Breadth-first search over vertices that share a cell: rings follow the mesh, so that they never jump a gap as plain
/// nearest neighbours would. Reusable; one a thread. The cells must outlive it.
class VertexRings {
 public:
  explicit VertexRings(const CellGradients& cells);

  /// Forgets everything and starts at a vertex.
  void start(Index vertex);
  /// The vertices within k ≥ 1 rings, the first one left out, in order of rings; valid until the next call.
  std::span<const Index> within(int k);

 private:
  const CellGradients* cells_;
  std::uint32_t stamp_ = 0;
  std::vector<std::uint32_t> vertex_stamps_, cell_stamps_;  // equal to stamp_ where found
  std::vector<Index> found_;                                // the start, then ring after ring
  std::vector<std::size_t> ring_ends_;                      // ring_ends_[k]: size of found_ with k rings
};

}  // namespace halfgrad
