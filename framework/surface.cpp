#include "framework/surface.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "framework/error.hpp"
#include "framework/nearest_cell.hpp"
#include "framework/parallel.hpp"
#include "framework/tangent_plane.hpp"

namespace halfgrad {

namespace {

// Calls f(cell, area vector) for each cell of a surface.
template <class Function>
void for_each_face(const Mesh& surface, Function&& f) {
  if (!surface.is_surface()) raise("a mesh of R^{} whose cells fill it is no surface in space", surface.gdim());
  for_each_block(surface, [&]<Element E>(const ElementBlock<E>& block, Index first) {
    if constexpr (E::dim == 2)
      for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
        Eigen::Matrix<double, E::num_nodes, 3> nodes;
        for (int i = 0; i < E::num_nodes; ++i) nodes.row(i) = surface.vertices().row(block.cells(c, i));
        f(static_cast<Index>(first + c), area_vector<E::num_nodes>(nodes));
      }
  });
}

// F t₁ × F t₂ for N = t₁ × t₂ and F N = 0, normalised; N where it vanishes.
Eigen::Vector3d carried_normal(const Eigen::Matrix3d& F, const Eigen::Vector3d& N) {
  const Eigen::Vector3d r0 = F.row(0).transpose(), r1 = F.row(1).transpose(), r2 = F.row(2).transpose();
  const Eigen::Vector3d n(r1.cross(r2).dot(N), r2.cross(r0).dot(N), r0.cross(r1).dot(N));
  const double length = n.norm();
  return length > 0 ? Eigen::Vector3d(n / length) : N;
}

template <class Scalar>
Eigen::Matrix3d matrix_of(const Values<Scalar>& rows, Eigen::Index row) {
  Eigen::Matrix3d matrix;
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < 3; ++k) matrix(c, k) = static_cast<double>(rows(row, 3 * c + k));
  return matrix;
}

InterpolationRule checked(const InterpolationRule& rule) {
  if (rule.formula != Formula::blend && rule.formula != Formula::hermite)
    raise("surfaces in space have the interpolants linear, phong, vertex_blend and hermite");
  return rule;
}

}  // namespace

SurfaceEmbedding embed_on_surface(const Mesh& surface, const Points& points) {
  check_points(points, 3, {});
  const Index count = static_cast<Index>(points.rows());
  std::vector<Eigen::Vector3d> areas(surface.num_cells());
  double largest = 0;
  for_each_face(surface, [&](Index cell, const Eigen::Vector3d& area) {
    areas[cell] = area;
    largest = std::max(largest, area.norm());
  });
  std::vector<CellFacet> faces;
  for (Index cell = 0; cell < surface.num_cells(); ++cell)
    if (areas[cell].norm() > 1e-14 * largest) faces.push_back({cell, whole_cell});
  if (faces.empty()) raise("the surface has no cell with area: it carries no points");
  const NearestCell search(surface, std::move(faces));

  SurfaceEmbedding result;
  result.points = points;
  result.cells.resize(count);
  result.distance.resize(count);
  result.feet.gdim = 3;
  result.feet.num_vertices = surface.num_vertices();
  std::vector<std::array<double, 4>> weights(count);
  parallel_for(count, 64, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t p = begin; p < end; ++p) {
      const NearestCell::Result found = search.find(points.row(p).transpose());
      result.cells[p] = found.side.cell;
      weights[p] = found.point.weights;
    }
  });
  for (Index p = 0; p < count; ++p) {
    const std::span<const Index> nodes = surface.cell_vertices(result.cells[p]);
    Eigen::RowVector3d foot = Eigen::RowVector3d::Zero();
    for (std::size_t i = 0; i < nodes.size(); ++i) foot += weights[p][i] * surface.vertices().row(nodes[i]);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      result.feet.vertices.push_back(nodes[i]);
      result.feet.weights.push_back(weights[p][i]);
      for (int a = 0; a < 3; ++a) result.feet.arms.push_back(foot[a] - surface.vertices()(nodes[i], a));
    }
    result.feet.offsets.push_back(static_cast<Offset>(result.feet.vertices.size()));
    const Eigen::RowVector3d arm = points.row(p) - foot;
    result.distance[p] = std::copysign(arm.norm(), arm.dot(areas[result.cells[p]].transpose()));
  }
  return result;
}

Points vertex_area_vectors(const Mesh& surface) {
  Points result = Points::Zero(surface.num_vertices(), 3);
  for_each_face(surface, [&](Index cell, const Eigen::Vector3d& area) {
    for (Index v : surface.cell_vertices(cell)) result.row(v) += area.transpose();
  });
  return result;
}

template <class Scalar>
SurfaceInterpolant<Scalar>::SurfaceInterpolant(const Mesh& surface, const SurfaceEmbedding& embedding,
                                               const InterpolationRule& rule, const Reconstruction& reconstruction)
    : foot_(embedding.feet, checked(rule), &reconstruction),
      offsets_(embedding.feet.offsets),
      weights_(embedding.feet.weights.begin(), embedding.feet.weights.end()) {
  if (!rule.needs_gradients()) spare_.emplace(embedding.feet, InterpolationRule(), &reconstruction);
  const std::span<const Index> active = foot_.active();
  std::vector<Index> number(static_cast<std::size_t>(surface.num_vertices()), -1);
  for (std::size_t a = 0; a < active.size(); ++a) number[active[a]] = static_cast<Index>(a);
  for (Index v : embedding.feet.vertices) nodes_.push_back(number[v]);

  // The normal of the plane that the rows are tangent to; the cells' areas say which side is out.
  const Points areas = vertex_area_vectors(surface);
  const Values<Scalar> rest = surface.vertices().cast<Scalar>();
  Values<Scalar> gradients = gradient_source().vertex_gradients(rest);
  normals_.resize(static_cast<Eigen::Index>(active.size()), 3);
  for (std::size_t a = 0; a < active.size(); ++a) {
    const Eigen::Vector3d out = areas.row(active[a]).transpose().stableNormalized();
    normals_.row(static_cast<Eigen::Index>(a)) =
        carried_normal(matrix_of(gradients, static_cast<Eigen::Index>(a)), out).transpose().template cast<Scalar>();
  }

  arms_ = Values<Scalar>::Zero(embedding.points.rows(), 3);
  const Values<Scalar> feet = evaluate(rest), means = gradient(rest);
  for (Eigen::Index p = 0; p < arms_.rows(); ++p) {
    const Eigen::Vector3d way = (embedding.points.row(p) - feet.row(p).template cast<double>()).transpose();
    const Eigen::Matrix3d mean = matrix_of(means, p);
    // The identity, but for blends near it, and singular where a vertex has no gradient: there the way stays as it is.
    const Eigen::Vector3d arm = std::abs(mean.determinant()) > 0.05 ? Eigen::Vector3d(mean.inverse() * way) : way;
    arms_.row(p) = arm.transpose().template cast<Scalar>();
  }
}

template <class Scalar>
void SurfaceInterpolant<Scalar>::require(const Values<Scalar>& values) const {
  if (values.cols() != 3) raise("values with {} columns: a surface in space carries positions of 3", values.cols());
}

template <class Scalar>
void SurfaceInterpolant<Scalar>::complete(Values<Scalar>& gradients) const {
  parallel_for(gradients.rows(), 2048, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t v = begin; v < end; ++v) {
      const Eigen::Vector3d N = normals_.row(v).transpose().template cast<double>();
      const Eigen::Vector3d n = carried_normal(matrix_of(gradients, v), N);
      for (int c = 0; c < 3; ++c)
        for (int k = 0; k < 3; ++k) gradients(v, 3 * c + k) += static_cast<Scalar>(n[c] * N[k]);
    }
  });
}

template <class Scalar>
Values<Scalar> SurfaceInterpolant<Scalar>::frames(const Values<Scalar>& values) const {
  require(values);
  Values<Scalar> gradients = gradient_source().vertex_gradients(values);
  complete(gradients);
  return gradients;
}

template <class Scalar>
void SurfaceInterpolant<Scalar>::evaluate(const Values<Scalar>& values, Values<Scalar>& out,
                                          Workspace<Scalar>& workspace, const EvaluateOptions& options) const {
  require(values);
  workspace.gradients = gradient_source().vertex_gradients(values);
  if (!spare_)
    foot_.evaluate_given(values, workspace.gradients, {}, out, options);
  else
    foot_.evaluate(values, out, workspace, options);
  complete(workspace.gradients);
  const Values<Scalar>& frames = workspace.gradients;
  parallel_for(out.rows(), 4096, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t p = begin; p < end; ++p)
      for (Offset e = offsets_[p]; e < offsets_[p + 1]; ++e)
        for (int c = 0; c < 3; ++c) {
          Scalar carried = 0;
          for (int k = 0; k < 3; ++k) carried += frames(nodes_[e], 3 * c + k) * arms_(p, k);
          out(p, c) += weights_[e] * carried;
        }
  });
}

template <class Scalar>
Values<Scalar> SurfaceInterpolant<Scalar>::evaluate(const Values<Scalar>& values) const {
  Values<Scalar> out;
  Workspace<Scalar> workspace;
  evaluate(values, out, workspace);
  return out;
}

template <class Scalar>
Values<Scalar> SurfaceInterpolant<Scalar>::gradient(const Values<Scalar>& values) const {
  const Values<Scalar> own = frames(values);
  Values<Scalar> out = Values<Scalar>::Zero(static_cast<Eigen::Index>(offsets_.size()) - 1, 9);
  for (Eigen::Index p = 0; p < out.rows(); ++p)
    for (Offset e = offsets_[p]; e < offsets_[p + 1]; ++e) out.row(p) += weights_[e] * own.row(nodes_[e]);
  return out;
}

template <class Scalar>
Values<Scalar> SurfaceInterpolant<Scalar>::normals(const Values<Scalar>& values) const {
  const Values<Scalar> own = frames(values);
  Values<Scalar> out = Values<Scalar>::Zero(static_cast<Eigen::Index>(offsets_.size()) - 1, 3);
  for (Eigen::Index p = 0; p < out.rows(); ++p) {
    for (Offset e = offsets_[p]; e < offsets_[p + 1]; ++e) {
      const Index v = nodes_[e];
      // M N is n.
      for (int c = 0; c < 3; ++c)
        for (int k = 0; k < 3; ++k) out(p, c) += weights_[e] * own(v, 3 * c + k) * normals_(v, k);
    }
    if (const Scalar length = out.row(p).norm(); length > 0) out.row(p) /= length;
  }
  return out;
}

template class SurfaceInterpolant<float>;
template class SurfaceInterpolant<double>;

}  // namespace halfgrad
