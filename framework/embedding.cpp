#include "framework/embedding.hpp"

#include <algorithm>
#include <cmath>

#include "framework/cell_locator.hpp"
#include "framework/error.hpp"
#include "framework/inverse_map.hpp"
#include "framework/nearest_cell.hpp"
#include "framework/parallel.hpp"

namespace halfgrad {

namespace {

std::string describe(const Points& points, Index point) {
  std::string text = "(";
  for (Eigen::Index a = 0; a < points.cols(); ++a) text += fmt::format("{}{}", a > 0 ? ", " : "", points(point, a));
  return text + ")";
}

// The facets to which the distance of an unclaimed point counts: those of one cell, where degenerate cells are absent,
// and all of folded cells. A position inside a folded cell whose ξ was not found is near that cell, not outside the
// mesh by the distance to its boundary.
std::vector<CellFacet> outer_facets(const Mesh& mesh) {
  std::vector<char> degenerate(mesh.num_cells(), 0);
  std::vector<CellFacet> folded;
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index first) {
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
      const InverseMap<E> map(node_positions(mesh, block, c));
      degenerate[first + c] = map.degenerate();
      if (map.degenerate() || map.one_signed()) continue;
      for (int side = 0; side < static_cast<int>(E::facets.size()); ++side)
        folded.push_back({static_cast<Index>(first + c), side});
    }
  });
  std::vector<CellFacet> facets = boundary_facets(mesh, degenerate);
  facets.insert(facets.end(), folded.begin(), folded.end());
  return facets;
}

// Where a point outside lies relative to its nearest cell.
template <Element E>
struct Extrapolation {
  ReferencePoint<E> xi;
  ReferencePoint<E> offset;
};

// The offset at the closest point, or, where J is singular there, at the first point on the way to the center where it
// is not: the weights reproduce X from any ξ. At a corner whose nodes coincide but for rounding a column of J is short
// beside that at the center, however well it is directed.
template <Element E>
Extrapolation<E> extrapolate(const InverseMap<E>& map, const ReferencePoint<E>& position,
                             const ReferencePoint<E>& closest) {
  const auto column_norms = map.jacobian(E::center()).colwise().norm().eval();
  for (const double inward : {0.0, 1e-6, 1e-3, 0.1, 1.0}) {
    const ReferencePoint<E> xi = closest + inward * (E::center() - closest);
    const auto jacobian = map.jacobian(xi);
    const double determinant = jacobian.determinant();
    if (inward < 1 && !(std::abs(determinant) > 1e-8 * jacobian.colwise().norm().cwiseMax(column_norms).prod()))
      continue;
    return {xi, solve_by_elimination(jacobian, map.difference(position, xi))};
  }
  return {closest, ReferencePoint<E>::Zero()};
}

struct Nearest {
  Index cell;
  double distance;
  Vector closest;     // ξ of the closest point
  Vector xi, offset;  // of extrapolate()
  bool affine;
};

Nearest nearest(const Mesh& mesh, const NearestCell& search, const Vector& position) {
  const NearestCell::Result found = search.find(position);
  Nearest result{found.side.cell, std::sqrt(found.point.squared_distance), {}, {}, {}, false};
  with_cell(mesh, result.cell, [&]<Element E>(const ElementBlock<E>& block, Eigen::Index row) {
    const Facet& facet = E::facets[found.side.facet];
    ReferencePoint<E> closest = ReferencePoint<E>::Zero();
    for (int i = 0; i < facet.num_nodes; ++i)
      closest += found.point.weights[i] * E::nodes().row(facet.nodes[i]).transpose();
    const InverseMap<E> map(node_positions(mesh, block, row));
    const Extrapolation<E> extrapolation = extrapolate<E>(map, position, closest);
    result.closest = closest;
    result.xi = extrapolation.xi;
    result.offset = extrapolation.offset;
    result.affine = map.affine();
  });
  return result;
}

}  // namespace

void check_points(const Points& points, int gdim, const EmbedOptions& options) {
  if (points.cols() != gdim)
    raise("points with {} coordinates in a mesh of R^{}: expected {} coordinates", points.cols(), gdim, gdim);
  if (points.rows() > std::numeric_limits<Index>::max())
    raise("{} points: at most {} can be numbered", points.rows(), std::numeric_limits<Index>::max());
  if (!(options.tolerance >= 0) || !(options.tolerance < 0.1))
    raise("an embedding tolerance of {}: expected a number from 0 to 0.1", options.tolerance);
  if (points.allFinite()) return;
  for (Index p = 0; p < points.rows(); ++p)
    if (!points.row(p).allFinite()) raise("point {} is {}: expected finite coordinates", p, describe(points, p));
}

void apply_policy(const Embedding& embedding, const Points& points, const EmbedOptions& options) {
  if (options.outside != Outside::error || embedding.outside.empty()) return;
  const auto farthest =
      std::max_element(embedding.outside.begin(), embedding.outside.end(),
                       [](const OutsidePoint& a, const OutsidePoint& b) { return a.distance < b.distance; });
  const OutsidePoint& first = embedding.outside.front();
  raise(
      "{} of {} points lie outside the mesh; the first is point {} at {}, at distance {:.6g}; the farthest is point "
      "{}, at distance {:.6g}: expected points inside, or the policy nearest (--outside nearest: the closest cell "
      "serves them) or mark (--outside mark: their results are NaN)",
      embedding.outside.size(), embedding.num_points(), first.point, describe(points, first.point), first.distance,
      farthest->point, farthest->distance);
}

Embedding embed(const Mesh& mesh, const Points& points, const EmbedOptions& options) {
  if (mesh.num_cells() == 0) raise("the mesh has no cells: no point can be embedded");
  if (mesh.is_surface()) raise("a surface in space holds no points: use embed_on_surface, which carries them with it");
  check_points(points, mesh.gdim(), options);
  CellLocations locations = locate(mesh, points, options.tolerance);
  Embedding result;
  result.gdim = mesh.gdim();
  result.cells = std::move(locations.cells);
  result.local = std::move(locations.local);
  result.status.assign(result.cells.size(), PointStatus::inside);

  std::vector<Index> unclaimed;
  for (Index p = 0; p < result.num_points(); ++p)
    if (result.cells[p] < 0) unclaimed.push_back(p);
  if (unclaimed.empty()) return result;

  std::vector<CellFacet> facets = outer_facets(mesh);
  if (facets.empty()) raise("all {} cells of the mesh are degenerate: no point can be embedded", mesh.num_cells());
  const NearestCell search(mesh, std::move(facets));
  const double diagonal = (mesh.vertices().colwise().maxCoeff() - mesh.vertices().colwise().minCoeff()).norm();
  std::vector<Nearest> found(unclaimed.size());
  parallel_for(static_cast<std::int64_t>(unclaimed.size()), 64, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < end; ++i) found[i] = nearest(mesh, search, points.row(unclaimed[i]).transpose());
  });

  for (std::size_t i = 0; i < unclaimed.size(); ++i) {
    const Index p = unclaimed[i];
    const Nearest& at = found[i];
    const bool on_boundary = at.distance <= options.tolerance * diagonal;
    if (on_boundary || options.outside != Outside::mark) {
      result.cells[p] = at.cell;
      // An affine cell takes the rest of the way in ξ itself; elsewhere the move to the closest point is below the
      // tolerance.
      result.local.row(p) = (!on_boundary ? at.xi : at.affine ? Vector(at.xi + at.offset) : at.closest).transpose();
    }
    if (on_boundary) {
      result.status[p] = PointStatus::boundary;
      continue;
    }
    const bool served = options.outside != Outside::mark;
    result.status[p] = served ? PointStatus::outside : PointStatus::not_found;
    result.outside.push_back({p, at.distance, served ? at.offset : Vector::Zero(mesh.gdim())});
  }
  apply_policy(result, points, options);
  return result;
}

}  // namespace halfgrad
