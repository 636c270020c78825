// Normals and tangents of a surface, and what a deformation makes of them.
#pragma once

#include "framework/mesh.hpp"

namespace halfgrad {

/// Unit normals at the points of a surface (#points × 3): the mean of the faces' by area, zero where a point has no
/// face.
Points point_normals(const Points& points, const IndexTable& faces);

/// Unit tangents with their handedness, #points × 4, (t, w) as glTF 2.0 has them: t points along growing u and is
/// orthogonal to the normal; the bitangent, along growing v, is w n × t with w = ±1. `corner_uv` are texture
/// coordinates of each entry of `faces`, #corners × 2, not finite where a corner has none; normals are #points × 3. A
/// point's tangent is the mean of its faces' by area, of those of the handedness that prevails there, so that the seam
/// of a mirrored texture does not cancel it; t is zero where no face gives one.
Points point_tangents(const Points& points, const IndexTable& faces, const Points& corner_uv, const Points& normals);

/// Given tangents, #points × 3 or 4, made unit and orthogonal to the normals: (t, w), #points × 4. Without a fourth
/// column w is that of `with_handedness` (#points × 4), or 1 where that is empty.
Points orthonormal_tangents(const Points& tangents, const Points& normals, const Points& with_handedness);

/// n ∝ F⁻ᵀN (James 2020, Eq. 15), as cof(F) N, which needs no inverse: #points × 3 unit rows from deformation
/// gradients, #points × 9 row-major, and rest normals. Zero stays zero.
template <class Scalar>
void carry_normals(const Values<Scalar>& gradients, const Points& normals, Values<Scalar>& out);

/// t ∝ F T with the handedness as it was: #points × 4 from rest tangents (T, w). Since N·T = 0, t is orthogonal to the
/// carried normal, and w n × t stays on the side of F B, whatever the sign of det F.
template <class Scalar>
void carry_tangents(const Values<Scalar>& gradients, const Points& tangents, Values<Scalar>& out);

/// Singular values of F, greatest first: #points × gdim from #points × (#columns · gdim).
template <class Scalar>
void principal_stretches(const Values<Scalar>& gradients, int gdim, Values<Scalar>& out);

}  // namespace halfgrad
