#include "framework/surface_directions.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>

#include "framework/error.hpp"
#include "framework/parallel.hpp"

namespace halfgrad {

namespace {

constexpr std::int64_t grain = 2048;

// Calls f(two edges from the first corner, corners as entries of the table) for each triangle of the faces' fans.
template <class Function>
void for_each_triangle(const Points& points, const IndexTable& faces, Function&& f) {
  for (Index face = 0; face < faces.num_rows(); ++face)
    for (Offset c = faces.offsets[face] + 1; c + 1 < faces.offsets[face + 1]; ++c) {
      const std::array<Offset, 3> corners = {faces.offsets[face], c, c + 1};
      const auto at = [&](int i) { return points.row(faces.entries[corners[i]]).template head<3>(); };
      const Eigen::RowVector3d a = at(1) - at(0), b = at(2) - at(0);
      f(a, b, corners);
    }
}

void check(const Points& points) {
  if (points.cols() != 3) raise("points with {} coordinates: normals and tangents need 3", points.cols());
}

// Row p of F as doubles.
template <class Scalar>
Eigen::Matrix3d gradient_at(const Values<Scalar>& gradients, Eigen::Index p) {
  return Eigen::Map<const Eigen::Matrix<Scalar, 3, 3, Eigen::RowMajor>>(gradients.row(p).data())
      .template cast<double>();
}

template <class Scalar>
void check(const Values<Scalar>& gradients, const Points& directions) {
  if (gradients.cols() != 9 || gradients.rows() != directions.rows())
    raise("gradients of {} x {}, expected {} x 9: directions are carried in three dimensions", gradients.rows(),
          gradients.cols(), directions.rows());
}

}  // namespace

Points point_normals(const Points& points, const IndexTable& faces) {
  check(points);
  Points normals = Points::Zero(points.rows(), 3);
  for_each_triangle(
      points, faces,
      [&](const Eigen::RowVector3d& a, const Eigen::RowVector3d& b, const std::array<Offset, 3>& corners) {
        const Eigen::RowVector3d area = a.cross(b);
        for (Offset corner : corners) normals.row(faces.entries[corner]) += area;
      });
  for (Eigen::Index p = 0; p < normals.rows(); ++p)
    if (const double length = normals.row(p).norm(); length > 0) normals.row(p) /= length;
  return normals;
}

Points point_tangents(const Points& points, const IndexTable& faces, const Points& corner_uv, const Points& normals) {
  check(points);
  if (corner_uv.rows() != static_cast<Eigen::Index>(faces.entries.size()) || corner_uv.cols() != 2)
    raise("texture coordinates of {} x {}, expected {} x 2, one a corner", corner_uv.rows(), corner_uv.cols(),
          faces.entries.size());
  // Sums of area · unit tangent and of the area, of either handedness.
  std::array<Points, 2> sums = {Points::Zero(points.rows(), 3), Points::Zero(points.rows(), 3)};
  Points areas = Points::Zero(points.rows(), 2);
  for_each_triangle(
      points, faces,
      [&](const Eigen::RowVector3d& a, const Eigen::RowVector3d& b, const std::array<Offset, 3>& corners) {
        const Eigen::RowVector2d first = corner_uv.row(corners[1]) - corner_uv.row(corners[0]),
                                 second = corner_uv.row(corners[2]) - corner_uv.row(corners[0]);
        const double determinant = first[0] * second[1] - first[1] * second[0];
        if (!std::isfinite(determinant) || determinant == 0) return;
        const std::size_t hand = determinant > 0 ? 0 : 1;
        const Eigen::RowVector3d along_u = (second[1] * a - first[1] * b) / determinant;
        const double length = along_u.norm(), area = a.cross(b).norm();
        if (!(length > 0)) return;
        for (Offset corner : corners) {
          sums[hand].row(faces.entries[corner]) += area / length * along_u;
          areas(faces.entries[corner], static_cast<Eigen::Index>(hand)) += area;
        }
      });
  Points tangents(points.rows(), 4);
  for (Eigen::Index p = 0; p < points.rows(); ++p) {
    const std::size_t hand = areas(p, 1) > areas(p, 0) ? 1 : 0;
    tangents.row(p) << sums[hand].row(p), hand == 0 ? 1.0 : -1.0;
  }
  return orthonormal_tangents(tangents, normals, {});
}

Points orthonormal_tangents(const Points& tangents, const Points& normals, const Points& with_handedness) {
  if (tangents.rows() != normals.rows() || (tangents.cols() != 3 && tangents.cols() != 4))
    raise("tangents of {} x {}, expected {} x 3 or 4", tangents.rows(), tangents.cols(), normals.rows());
  Points result(tangents.rows(), 4);
  for (Eigen::Index p = 0; p < tangents.rows(); ++p) {
    const Eigen::RowVector3d given = tangents.row(p).head<3>(), normal = normals.row(p);
    Eigen::RowVector3d tangent = given - given.dot(normal) * normal;
    const double length = tangent.norm();
    // Along the normal, or none at all: round-off has no direction.
    if (length > 1e-12 * given.norm() && normal.squaredNorm() > 0)
      tangent /= length;
    else
      tangent.setZero();
    double hand = 1;
    if (tangents.cols() == 4)
      hand = tangents(p, 3) < 0 ? -1 : 1;
    else if (with_handedness.rows() > 0)
      hand = with_handedness(p, 3);
    result.row(p) << tangent, hand;
  }
  return result;
}

template <class Scalar>
void carry_normals(const Values<Scalar>& gradients, const Points& normals, Values<Scalar>& out) {
  check(gradients, normals);
  out.resize(normals.rows(), 3);
  parallel_for(normals.rows(), grain, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t p = begin; p < end; ++p) {
      const Eigen::Matrix3d F = gradient_at(gradients, p);
      const Eigen::RowVector3d r0 = F.row(0), r1 = F.row(1), r2 = F.row(2), N = normals.row(p);
      Eigen::RowVector3d n(r1.cross(r2).dot(N), r2.cross(r0).dot(N), r0.cross(r1).dot(N));
      if (const double length = n.norm(); length > 0) n /= length;
      out.row(p) = n.template cast<Scalar>();
    }
  });
}

template <class Scalar>
void carry_tangents(const Values<Scalar>& gradients, const Points& tangents, Values<Scalar>& out) {
  check(gradients, tangents);
  if (tangents.cols() != 4) raise("tangents of {} columns, expected 4", tangents.cols());
  out.resize(tangents.rows(), 4);
  parallel_for(tangents.rows(), grain, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t p = begin; p < end; ++p) {
      Eigen::Vector3d t = gradient_at(gradients, p) * tangents.row(p).head<3>().transpose();
      if (const double length = t.norm(); length > 0) t /= length;
      out.row(p) << t.transpose().template cast<Scalar>(), static_cast<Scalar>(tangents(p, 3));
    }
  });
}

template <class Scalar>
void principal_stretches(const Values<Scalar>& gradients, int gdim, Values<Scalar>& out) {
  const Eigen::Index columns = gradients.cols() / gdim;
  out.resize(gradients.rows(), gdim);
  parallel_for(gradients.rows(), grain, [&](std::int64_t begin, std::int64_t end) {
    Eigen::MatrixXd right(gdim, gdim);
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gdim);
    for (std::int64_t p = begin; p < end; ++p) {
      const Values<double> F =
          Eigen::Map<const Values<Scalar>>(gradients.row(p).data(), columns, gdim).template cast<double>();
      right.noalias() = F.transpose() * F;
      solver.compute(right, Eigen::EigenvaluesOnly);
      out.row(p) = solver.eigenvalues().reverse().cwiseMax(0).cwiseSqrt().transpose().template cast<Scalar>();
    }
  });
}

template void carry_normals(const Values<float>&, const Points&, Values<float>&);
template void carry_normals(const Values<double>&, const Points&, Values<double>&);
template void carry_tangents(const Values<float>&, const Points&, Values<float>&);
template void carry_tangents(const Values<double>&, const Points&, Values<double>&);
template void principal_stretches(const Values<float>&, int, Values<float>&);
template void principal_stretches(const Values<double>&, int, Values<double>&);

}  // namespace halfgrad
