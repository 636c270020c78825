// Differences along the axes of a grid.
#pragma once

#include "framework/vertex_gradient_reconstructor.hpp"

namespace halfgrad {

/// Three-point differences along each axis of a grid of axis-aligned boxes, regular or graded: centered where a vertex
/// has neighbours on both sides, one-sided with the next two elsewhere. Exact for quadratics in both cases; where only
/// one neighbour exists along an axis (a single layer of cells) the difference to it, exact for affine values. A
/// neighbour is a vertex across an edge of a cell, so that gaps of a sparse grid are not jumped.
class CenteredDifference final : public VertexGradientReconstructor {
 public:
  /// Throws Error on a cell at a vertex, or at the neighbours its row reads, that is no axis-aligned box.
  Reconstruction reconstruct(const CellGradients& cells, std::span<const Index> vertices) const override;
  /// By arithmetic: no cell is listed.
  Reconstruction reconstruct_on_grid(const Grid& grid, std::span<const Index> vertices) const override;
};

}  // namespace halfgrad
