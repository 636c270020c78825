#include "reconstruction/vertex_rings.hpp"

#include <algorithm>

namespace halfgrad {

VertexRings::VertexRings(const CellGradients& cells)
    : cells_(&cells), vertex_stamps_(cells.num_vertices(), 0), cell_stamps_(cells.num_cells(), 0) {}

void VertexRings::start(Index vertex) {
  if (++stamp_ == 0) {
    std::fill(vertex_stamps_.begin(), vertex_stamps_.end(), 0);
    std::fill(cell_stamps_.begin(), cell_stamps_.end(), 0);
    stamp_ = 1;
  }
  found_.assign(1, vertex);
  ring_ends_.assign(1, 1);
  vertex_stamps_[vertex] = stamp_;
}

std::span<const Index> VertexRings::within(int k) {
  while (static_cast<int>(ring_ends_.size()) <= k) {
    const std::size_t first = ring_ends_.size() == 1 ? 0 : ring_ends_[ring_ends_.size() - 2];
    const std::size_t last = ring_ends_.back();
    for (std::size_t i = first; i < last; ++i)
      for (Index cell : cells_->cells_of(found_[i])) {
        if (cell_stamps_[cell] == stamp_) continue;
        cell_stamps_[cell] = stamp_;
        for (Index v : cells_->vertices_of(cell)) {
          if (vertex_stamps_[v] == stamp_) continue;
          vertex_stamps_[v] = stamp_;
          found_.push_back(v);
        }
      }
    ring_ends_.push_back(found_.size());
  }
  return {found_.data() + 1, ring_ends_[k] - 1};
}

}  // namespace halfgrad
