// Phong deformation as linear blend skinning with affine bones, for programs that have only that.
#pragma once

#include <span>
#include <vector>

#include "framework/embedding.hpp"

namespace halfgrad {

/// Which vertices move each point and by how much: f(X) = Σ_k weights(p, k) T_b [X; 1] with b = indices(p, k). One bone
/// a vertex of a cell that holds points. Weights sum to one; those of points inside are not negative.
struct AffineBones {
  std::vector<Index> vertices;  ///< #bones: the mesh vertex of each bone, in the order of active_vertices
  Eigen::Matrix<Index, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>
      indices;     ///< #points × most nodes of a cell: numbers of bones; 0 behind the nodes of smaller cells
  Points weights;  ///< #points × most nodes of a cell: β_i(X); 0 behind the nodes of smaller cells
};

/// The bones of a binding. Points that were not found have no weight at all. O(#points).
AffineBones affine_bones(const Mesh& mesh, const Embedding& embedding);

/// T_i = [αF_i | x_i − αF_i X_i], from James 2020, Eq. 11: #bones × (#columns · (gdim + 1)), each row a #columns ×
/// (gdim
/// + 1) matrix in row-major order. `rest` are the vertices of the mesh and `values` the deformed ones, #vertices ×
/// #columns; `gradients` are Interpolant::vertex_gradients of the same binding, or empty for α = 0. The last column
/// cancels digits of meshes whose distance from the origin is large beside their cells.
template <class Scalar>
Values<Scalar> bone_transforms(std::span<const Index> bones, const Points& rest, const Values<Scalar>& values,
                               const Values<Scalar>& gradients, double alpha);

}  // namespace halfgrad
