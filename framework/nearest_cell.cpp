#include "framework/nearest_cell.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace halfgrad {

namespace {

constexpr int max_facet_nodes = 4;
using FacetNodes = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, max_gdim, max_facet_nodes>;

// Positions of a facet's nodes relative to `origin`, gdim × #nodes.
FacetNodes facet_nodes(const Mesh& mesh, const CellFacet& side, const Vector& origin) {
  return with_cell(mesh, side.cell, [&]<Element E>(const ElementBlock<E>& block, Eigen::Index row) {
    const bool whole = side.facet == whole_cell;
    const int num_nodes = whole ? E::num_nodes : E::facets[side.facet].num_nodes;
    assert(num_nodes <= max_facet_nodes);
    FacetNodes nodes(mesh.gdim(), num_nodes);
    for (int i = 0; i < num_nodes; ++i) {
      const Index vertex = block.cells(row, whole ? i : E::facets[side.facet].nodes[i]);
      nodes.col(i) = mesh.vertices().row(vertex).transpose() - origin;
    }
    return nodes;
  });
}

// The point of the affine hull of the chosen nodes closest to the origin, as node weights; false where the nodes are
// affinely dependent or a weight is negative: then a smaller choice holds the closest point.
bool closest_in_hull(const FacetNodes& nodes, const std::array<int, max_facet_nodes>& chosen, int count,
                     std::array<double, max_facet_nodes>& weights) {
  // Edges orthogonalised one after the other, with their coefficients: E = Q R.
  const Vector first = nodes.col(chosen[0]);
  std::array<Vector, max_facet_nodes> basis;
  Eigen::Matrix<double, max_facet_nodes, max_facet_nodes> upper;
  std::array<double, max_facet_nodes> right;
  Vector rest = -first;
  for (int k = 0; k + 1 < count; ++k) {
    Vector edge = nodes.col(chosen[k + 1]) - first;
    const double length = edge.norm();
    for (int pass = 0; pass < 2; ++pass)
      for (int j = 0; j < k; ++j) {
        const double component = basis[j].dot(edge);
        upper(j, k) = (pass == 0 ? 0 : upper(j, k)) + component;
        edge -= component * basis[j];
      }
    upper(k, k) = edge.norm();
    if (!(upper(k, k) > 1e-14 * length)) return false;
    basis[k] = edge / upper(k, k);
    right[k] = basis[k].dot(rest);
    rest -= right[k] * basis[k];
  }
  double sum = 0;
  for (int k = count - 2; k >= 0; --k) {
    double value = right[k];
    for (int j = k + 1; j + 1 < count; ++j) value -= upper(k, j) * weights[chosen[j + 1]];
    weights[chosen[k + 1]] = value / upper(k, k);
    if (!(weights[chosen[k + 1]] >= 0)) return false;
    sum += weights[chosen[k + 1]];
  }
  weights[chosen[0]] = 1 - sum;
  return weights[chosen[0]] >= 0;
}

// Closest point to the origin of the simplex on the nodes in `members`: the best over its faces, each of which is
// solved in its own plane.
FacetPoint closest_in_simplex(const FacetNodes& nodes, unsigned members) {
  FacetPoint best;
  best.squared_distance = std::numeric_limits<double>::infinity();
  for (unsigned subset = members; subset != 0; subset = (subset - 1) & members) {
    std::array<int, max_facet_nodes> chosen{};
    int count = 0;
    for (int i = 0; i < max_facet_nodes; ++i)
      if ((subset >> i) & 1U) chosen[count++] = i;
    std::array<double, max_facet_nodes> weights{};
    if (!closest_in_hull(nodes, chosen, count, weights)) continue;
    Vector position = Vector::Zero(nodes.rows());
    for (int i = 0; i < count; ++i) position += weights[chosen[i]] * nodes.col(chosen[i]);
    const double squared = position.squaredNorm();
    if (squared < best.squared_distance) best = {squared, weights};
  }
  return best;
}

// Closest point to the origin of the bilinear patch on four cyclic nodes. The triangles of both diagonals and the
// patch's straight edges give starts; a projected Newton iteration on the squared distance refines each.
FacetPoint closest_in_patch(const FacetNodes& nodes) {
  const auto at = [&](double u, double v) {
    FacetPoint point;
    point.weights = {(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v};
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    for (int i = 0; i < 4; ++i) position += point.weights[i] * nodes.col(i).head<3>();
    point.squared_distance = position.squaredNorm();
    return point;
  };
  FacetPoint best;
  best.squared_distance = std::numeric_limits<double>::infinity();
  const auto refine = [&](double u, double v) {
    FacetPoint here = at(u, v);
    for (int iteration = 0; iteration < 40; ++iteration) {
      Eigen::Vector3d position = Eigen::Vector3d::Zero();
      for (int i = 0; i < 4; ++i) position += here.weights[i] * nodes.col(i).head<3>();
      const Eigen::Vector3d n0 = nodes.col(0).head<3>(), n1 = nodes.col(1).head<3>(), n2 = nodes.col(2).head<3>(),
                            n3 = nodes.col(3).head<3>();
      const Eigen::Vector3d along_u = (1 - v) * (n1 - n0) + v * (n2 - n3);
      const Eigen::Vector3d along_v = (1 - u) * (n3 - n0) + u * (n2 - n1);
      const double twist = position.dot(n0 - n1 + n2 - n3);
      const double gu = position.dot(along_u), gv = position.dot(along_v);
      const double huu = along_u.squaredNorm(), hvv = along_v.squaredNorm(), dot = along_u.dot(along_v);
      // A coordinate that presses against its bound stays there.
      const bool fix_u = (u <= 0 && gu > 0) || (u >= 1 && gu < 0), fix_v = (v <= 0 && gv > 0) || (v >= 1 && gv < 0);
      double du = 0, dv = 0;
      if (!fix_u && !fix_v) {
        // Newton's matrix where it is positive, Gauss-Newton's elsewhere.
        double huv = dot + twist;
        if (!(huu * hvv - huv * huv > 1e-12 * huu * hvv)) huv = dot;
        const double determinant = huu * hvv - huv * huv;
        if (determinant > 1e-14 * huu * hvv) {
          du = -(hvv * gu - huv * gv) / determinant;
          dv = -(huu * gv - huv * gu) / determinant;
        } else {
          du = huu > 0 ? -0.5 * gu / huu : 0;
          dv = hvv > 0 ? -0.5 * gv / hvv : 0;
        }
      } else if (!fix_u) {
        du = huu > 0 ? -gu / huu : 0;
      } else if (!fix_v) {
        dv = hvv > 0 ? -gv / hvv : 0;
      }
      bool reduced = false;
      for (double damping = 1; damping > 1e-6 && !reduced; damping *= 0.5) {
        const double next_u = std::clamp(u + damping * du, 0.0, 1.0), next_v = std::clamp(v + damping * dv, 0.0, 1.0);
        const FacetPoint next = at(next_u, next_v);
        if (next.squared_distance < here.squared_distance) {
          reduced = true;
          here = next;
          u = next_u;
          v = next_v;
        }
      }
      if (!reduced) break;
    }
    if (here.squared_distance < best.squared_distance) best = here;
  };
  for (const unsigned triangle : {0b0111U, 0b1101U, 0b1011U, 0b1110U}) {
    const auto weights = closest_in_simplex(nodes, triangle).weights;
    refine(std::clamp(weights[1] + weights[2], 0.0, 1.0), std::clamp(weights[2] + weights[3], 0.0, 1.0));
  }
  for (int i = 0; i < 4; ++i) {
    const FacetPoint edge = closest_in_simplex(nodes, (1U << i) | (1U << ((i + 1) % 4)));
    refine(std::clamp(edge.weights[1] + edge.weights[2], 0.0, 1.0),
           std::clamp(edge.weights[2] + edge.weights[3], 0.0, 1.0));
  }
  return best;
}

FacetPoint closest_in_facet(const FacetNodes& nodes) {
  // A facet of a cell of R^d is a simplex where it has d nodes, and so is a surface's cell in R³; the other kind is the
  // quadrilateral in R³.
  if (nodes.cols() == nodes.rows()) return closest_in_simplex(nodes, (1U << nodes.cols()) - 1);
  return closest_in_patch(nodes);
}

}  // namespace

NearestCell::NearestCell(const Mesh& mesh, std::vector<CellFacet> facets) : mesh_(&mesh), facets_(std::move(facets)) {
  boxes_.reserve(facets_.size());
  if (!facets_.empty()) build(0, static_cast<Index>(facets_.size()));
}

Index NearestCell::build(Index begin, Index end) {
  const int gdim = mesh_->gdim();
  const Vector origin = Vector::Zero(gdim);
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Box box{Vector::Constant(gdim, infinity), Vector::Constant(gdim, -infinity), begin, end, true};
  for (Index f = begin; f < end; ++f) {
    const FacetNodes nodes = facet_nodes(*mesh_, facets_[f], origin);
    box.low = box.low.cwiseMin(nodes.rowwise().minCoeff());
    box.high = box.high.cwiseMax(nodes.rowwise().maxCoeff());
  }
  const Index number = static_cast<Index>(boxes_.size());
  box.leaf = end - begin <= 4;
  boxes_.push_back(box);
  if (box.leaf) return number;
  Eigen::Index axis;
  (box.high - box.low).maxCoeff(&axis);
  const Index middle = begin + (end - begin) / 2;
  const auto key = [&](const CellFacet& side) { return facet_nodes(*mesh_, side, origin).row(axis).mean(); };
  std::nth_element(facets_.begin() + begin, facets_.begin() + middle, facets_.begin() + end,
                   [&](const CellFacet& a, const CellFacet& b) {
                     return std::tuple(key(a), a.cell, a.facet) < std::tuple(key(b), b.cell, b.facet);
                   });
  build(begin, middle);
  boxes_[number].end = build(middle, end);
  return number;
}

double NearestCell::squared_distance(const Box& box, const Vector& position) const {
  return (box.low - position).cwiseMax(position - box.high).cwiseMax(0.0).squaredNorm();
}

NearestCell::Result NearestCell::find(const Vector& position) const {
  Result best{};
  best.point.squared_distance = std::numeric_limits<double>::infinity();
  std::array<std::pair<double, Index>, 80> stack;  // depth of a halving tree over 2³¹ facets, two a level
  int depth = 0;
  stack[depth++] = {squared_distance(boxes_[0], position), 0};
  while (depth > 0) {
    const auto [distance, number] = stack[--depth];
    if (distance > best.point.squared_distance) continue;
    const Box& box = boxes_[number];
    if (box.leaf) {
      for (Index f = box.begin; f < box.end; ++f) {
        const FacetPoint point = closest_in_facet(facet_nodes(*mesh_, facets_[f], position));
        const bool closer = point.squared_distance < best.point.squared_distance;
        const bool tie = point.squared_distance == best.point.squared_distance && facets_[f].cell < best.side.cell;
        if (closer || tie) best = {facets_[f], point};
      }
      continue;
    }
    const Index left = number + 1, right = box.end;
    const double to_left = squared_distance(boxes_[left], position),
                 to_right = squared_distance(boxes_[right], position);
    if (to_left < to_right) {
      stack[depth++] = {to_right, right};
      stack[depth++] = {to_left, left};
    } else {
      stack[depth++] = {to_left, left};
      stack[depth++] = {to_right, right};
    }
  }
  return best;
}

}  // namespace halfgrad
