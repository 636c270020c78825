// A blend, chosen by the data, of an averaging and a kriging gradient.
#pragma once

#include "framework/vertex_gradient_reconstructor.hpp"

namespace halfgrad {

/// Chandrashekar–Garg and wide kriging gradients, blended a vertex and a frame at a time by how rough each leaves the
/// edges at the vertex: kriging where the mesh resolves the field, averaging where it does not (docs/adaptive.md). The
/// blend takes place in blended_gradients(); `stencils` are the kriging rows of the vertices asked for and, appended,
/// of their neighbours.
class Adaptive final : public VertexGradientReconstructor {
 public:
  Reconstruction reconstruct(const CellGradients& cells, std::span<const Index> vertices) const override;
};

}  // namespace halfgrad
