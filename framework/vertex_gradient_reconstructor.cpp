#include "framework/vertex_gradient_reconstructor.hpp"

#include "framework/grid.hpp"

namespace halfgrad {

Reconstruction VertexGradientReconstructor::reconstruct_on_grid(const Grid& grid,
                                                                std::span<const Index> vertices) const {
  const Mesh mesh = grid.mesh();
  return reconstruct(CellGradients(mesh), vertices);
}

}  // namespace halfgrad
