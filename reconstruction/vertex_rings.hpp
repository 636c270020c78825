// The vertices around a vertex, ring by ring.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "framework/cell_gradients.hpp"

namespace halfgrad {

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
