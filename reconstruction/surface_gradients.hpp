// Vertex gradients on surfaces in space, by any reconstructor in the tangent plane of each vertex.
#pragma once

#include "framework/vertex_gradient_reconstructor.hpp"

namespace halfgrad {

/// Rows for `vertices` of a surface mesh: F_v = Σ_j (x_j − x_v) ⊗ g_vj with g_vj ∈ R³ tangent to the surface at v, so
/// that F_v of the rest positions is the projection onto the tangent plane. The rings around a vertex, as far as they
/// face its side, are unrolled into its plane along lines from the vertex, lengths kept; the reconstructor's row there
/// is brought back by the tangents that it finds in the rest positions. So the plane is as accurate as the gradient,
/// and a reconstructor that is exact for quadratics in the plane gives second-order gradients on smooth surfaces. A
/// blend stays a blend. Hessians are dropped. A vertex of no cell with area gets an empty row.
Reconstruction surface_gradients(const VertexGradientReconstructor& reconstructor, const Mesh& surface,
                                 std::span<const Index> vertices);

}  // namespace halfgrad
