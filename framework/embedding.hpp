// Where each point lies in the rest mesh.
#pragma once

#include <string_view>
#include <vector>

#include "framework/mesh.hpp"

namespace halfgrad {

enum class PointStatus : std::uint8_t {
  inside,    ///< in its cell, faces, edges and vertices included, within the relative tolerance
  boundary,  ///< outside every cell, but within tolerance · mesh diagonal of its cell
  outside,   ///< farther out; served by the closest cell (policy nearest)
  not_found  ///< farther out and unserved (policy mark)
};

/// What to do with points outside the mesh.
enum class Outside {
  error,    ///< throw, naming the first point, the count and the greatest distance
  nearest,  ///< serve them by the closest cell, extrapolating
  mark      ///< leave them without a cell: their results are NaN
};

struct EmbedOptions {
  Outside outside = Outside::error;
  double tolerance = 1e-9;  ///< in reference lengths of the cell, and in diagonals of the mesh
};

/// A point outside the mesh.
struct OutsidePoint {
  Index point;
  double distance;  ///< to the closest point of the mesh, in length units
  Vector offset;    ///< J⁻¹(X − X*) at the closest point ξ*, in reference lengths; zero where unserved
};

/// Numbers only: a cell and reference coordinates a point. For a point outside, ξ is the closest point of its cell and
/// the weights extrapolate, β = shape(ξ) + shape_gradient(ξ) · offset: they sum to one and reproduce X on any element.
struct Embedding {
  int gdim = 0;
  std::vector<Index> cells;           ///< #points; −1 where not found
  Points local;                       ///< #points × gdim, ξ
  std::vector<PointStatus> status;    ///< #points
  std::vector<OutsidePoint> outside;  ///< points of status outside or not_found, ascending

  Index num_points() const { return static_cast<Index>(cells.size()); }
};

/// Finds the cell of each point (#points × gdim) and its ξ. A point on a shared facet goes to the cell where its margin
/// is greatest, ties to the lowest cell number: the same for any thread count. Degenerate cells hold no points. Throws
/// Error on non-finite points, on a gdim that is not the mesh's, and as the policy says.
Embedding embed(const Mesh& mesh, const Points& points, const EmbedOptions& options = {});

/// What every embedding checks of its input: finite points (#points × gdim) and a tolerance in range; throws Error.
void check_points(const Points& points, int gdim, const EmbedOptions& options);

/// Throws Error where points lie outside and the policy refuses them.
void apply_policy(const Embedding& embedding, const Points& points, const EmbedOptions& options);

/// Weights β of a point in its cell of type E (num_nodes × 1); offset is null for points that are not outside.
template <Element E>
NodeVector<E> cell_weights(const ReferencePoint<E>& local, const Vector* offset) {
  NodeVector<E> beta = E::shape(local);
  if (offset != nullptr) beta += E::shape_gradient(local) * *offset;
  return beta;
}

}  // namespace halfgrad
