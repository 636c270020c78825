// A blend, chosen by the data, of an averaging and a kriging gradient.
#pragma once

#include "framework/vertex_gradient_reconstructor.hpp"

namespace halfgrad {

/// Chandrashekar–Garg gradients, and wide kriging gradients with a share of what the neighbours predict, blended a
/// vertex and a frame at a time by how well each goes with the kriging gradients of the neighbours along the edges:
/// kriging where the mesh resolves the field, averaging where it does not (docs/adaptive.md). The blend takes place in
/// blended_gradients().
class Adaptive final : public VertexGradientReconstructor {
 public:
  Reconstruction reconstruct(const CellGradients& cells, std::span<const Index> vertices) const override;
};

}  // namespace halfgrad
