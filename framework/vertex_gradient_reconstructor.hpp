// The contract of a reconstructor: how vertex gradients are estimated.
#pragma once

#include <span>

#include "framework/cell_gradients.hpp"
#include "framework/gradient_stencils.hpp"

namespace halfgrad {

class Grid;

/// Turns rest geometry into gradient stencils for the vertices asked for. Implementations use rest positions only,
/// are deterministic for any number of threads, never fail on single cells or boundary vertices, are exact for affine
/// values, and are invariant to numbering, rigid motion and scale.
class VertexGradientReconstructor {
 public:
  virtual ~VertexGradientReconstructor() = default;
  /// Rows for `vertices` (distinct, any order), in that order.
  virtual Reconstruction reconstruct(const CellGradients& cells, std::span<const Index> vertices) const = 0;
  /// The same on a grid. Unless overridden it lists the grid's cells as an explicit mesh meanwhile.
  virtual Reconstruction reconstruct_on_grid(const Grid& grid, std::span<const Index> vertices) const;
};

}  // namespace halfgrad
