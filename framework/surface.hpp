// Points carried by a surface in space: a detailed shell that follows a coarse cloth.
#pragma once

#include <optional>

#include "framework/interpolant.hpp"
#include "framework/weighted_points.hpp"

namespace halfgrad {

/// Points near a surface, each by its foot: the closest point of the surface.
struct SurfaceEmbedding {
  Points points;                 ///< #points × 3
  WeightedPoints feet;           ///< weights of the feet in their cells
  std::vector<Index> cells;      ///< #points: the cell of each foot
  std::vector<double> distance;  ///< #points: from the foot to the point, negative behind the cell's normal; length
};

/// Finds the foot of each point (#points × 3) in a surface mesh, ties to the lowest cell. Cells without area hold no
/// feet. Throws Error on a mesh that is no surface, has no cell with area, and on points that are not finite.
SurfaceEmbedding embed_on_surface(const Mesh& surface, const Points& points);

/// Sum of the area vectors of the cells at each vertex, #vertices × 3: the direction of the vertex normal.
Points vertex_area_vectors(const Mesh& surface);

/// Points bound to a surface. With the foot P of X, M_i = F_i + n_i N_iᵀ, F_i the gradient in the tangent plane of
/// vertex i and n_i, N_i its deformed and rest unit normals,
///
///     f(X) = S(P) + Σ_i β_i M_i r,    S(P) = Σ_i β_i (x_i + ½ F_i (P − X_i))
///
/// for Phong; S is the rule's own formula in general. r makes f reproduce the rest positions: it is the way from the
/// interpolated rest surface S(P) to X, whose normal part keeps its length and whose tangential part stretches with the
/// surface. On flat cells with exact normals S of the rest surface is Phong tessellation (Boubekeur & Alexa 2008).
/// Rigid motions are reproduced. Immutable; all members const and safe to call from several threads.
template <class Scalar = double>
class SurfaceInterpolant {
 public:
  /// `reconstruction` comes from surface_gradients and has a row for every active vertex, which linear needs too: its
  /// offsets follow the normals. Throws Error on dual_taylor and quadratic10, which surfaces do not have.
  SurfaceInterpolant(const Mesh& surface, const SurfaceEmbedding& embedding, const InterpolationRule& rule,
                     const Reconstruction& reconstruction);

  const BindReport& report() const { return foot_.report(); }
  /// Positions of the points, #points × 3, from those of the vertices, #vertices × 3.
  Values<Scalar> evaluate(const Values<Scalar>& values) const;
  void evaluate(const Values<Scalar>& values, Values<Scalar>& out, Workspace<Scalar>& workspace,
                const EvaluateOptions& options = {}) const;
  /// Any vertex data, #vertices × #columns, at the feet by the rule: #points × #columns.
  Values<Scalar> evaluate_field(const Values<Scalar>& values) const { return foot_.evaluate(values); }
  /// Unit normals of the deformed surface at the feet, continuous over it, #points × 3.
  Values<Scalar> normals(const Values<Scalar>& values) const;
  /// Σ β_i M_i at the feet, #points × 9: what takes a small step at rest to its deformed image.
  Values<Scalar> gradient(const Values<Scalar>& values) const;

 private:
  // M_i of the active vertices, #active × 9 row-major, from F_i.
  void complete(Values<Scalar>& gradients) const;
  Values<Scalar> frames(const Values<Scalar>& values) const;
  void require(const Values<Scalar>& values) const;

  // Where F comes from.
  const Interpolant<Scalar>& gradient_source() const { return spare_ ? *spare_ : foot_; }

  Interpolant<Scalar> foot_;                  // S under the rule
  std::optional<Interpolant<Scalar>> spare_;  // the same feet with gradients, where the rule has none
  Values<Scalar> normals_;                    // N_i of the active vertices, #active × 3
  Values<Scalar> arms_;                       // r, #points × 3
  std::vector<Offset> offsets_;
  std::vector<Index> nodes_;  // active vertices of each foot
  std::vector<Scalar> weights_;
};

extern template class SurfaceInterpolant<float>;
extern template class SurfaceInterpolant<double>;

}  // namespace halfgrad
