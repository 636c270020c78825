// Free-form deformation: a box of hexahedra around a model, whose corners are the handles. The model may be any points;
// the lattice needs no fit to them.
//
//   lattice_ffd [MODEL.obj OUT.obj]     without arguments a sphere, and nothing is written
#include <fmt/core.h>

#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "framework/interpolant.hpp"
#include "framework/io/frame_sink.hpp"
#include "framework/io/point_set.hpp"
#include "reconstruction/registry.hpp"

using namespace halfgrad;

namespace {

// A lattice of nx × ny × nz boxes over [low, high].
Mesh lattice(const Eigen::RowVector3d& low, const Eigen::RowVector3d& high, int nx, int ny, int nz) {
  const int mx = nx + 1, my = ny + 1;
  Points rest(mx * my * (nz + 1), 3);
  for (int v = 0; v < rest.rows(); ++v) {
    const Eigen::RowVector3d at(v % mx / double(nx), v / mx % my / double(ny), v / (mx * my) / double(nz));
    rest.row(v) = low + at.cwiseProduct(high - low);
  }
  ElementBlock<Hexahedron> boxes;
  boxes.cells.resize(nx * ny * nz, 8);
  for (int c = 0; c < boxes.cells.rows(); ++c) {
    const int v = c % nx + mx * (c / nx % ny + my * (c / (nx * ny))), up = mx * my;
    boxes.cells.row(c) << v, v + 1, v + mx + 1, v + mx, v + up, v + up + 1, v + up + mx + 1, v + up + mx;
  }
  return Mesh(rest, {boxes});
}

PointSet sphere() {
  PointSet result;
  result.points.resize(500, 3);
  for (int p = 0; p < 500; ++p) {
    const double z = 1 - (p + 0.5) / 250, radius = std::sqrt(1 - z * z), angle = 2.399963 * p;
    result.points.row(p) << radius * std::cos(angle), radius * std::sin(angle), z;
  }
  return result;
}

// Bends what stands upright (along z) to a quarter of a circle.
Values<double> bent(const Points& points, double low, double high) {
  const double radius = (high - low) / 1.5707963267948966;
  Values<double> result = points;
  for (Eigen::Index p = 0; p < points.rows(); ++p) {
    const double angle = (points(p, 2) - low) / radius;
    result(p, 0) = radius - (radius - points(p, 0)) * std::cos(angle);
    result(p, 2) = low + (radius - points(p, 0)) * std::sin(angle);
  }
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  const PointSet model = argc == 3 ? read_points(argv[1]) : sphere();
  const Eigen::RowVector3d low = model.points.colwise().minCoeff(), high = model.points.colwise().maxCoeff();
  const Eigen::RowVector3d margin = 0.01 * (high - low);
  const Mesh handles = lattice(low - margin, high + margin, 3, 3, 4);

  const Embedding embedding = embed(handles, model.points);
  const auto reconstructor = make_reconstructor("kriging").reconstructor;
  const Reconstruction gradients =
      reconstructor->reconstruct(CellGradients(handles), active_vertices(handles, embedding));
  const Interpolant<double> deform(handles, embedding, named_rule("phong"), &gradients);

  // The handles bend; here by a formula, in an editor by hand.
  const Values<double> moved = deform.evaluate(bent(handles.vertices(), low.z(), high.z()));
  const double error = (moved - bent(model.points, low.z(), high.z())).rowwise().norm().maxCoeff();
  const double size = (high - low).norm();
  fmt::print("{} points follow {} handles; farthest from the bend: {:.2f} % of the model's size\n", moved.rows(),
             handles.num_vertices(), 100 * error / size);

  if (argc == 3) {
    const auto out = create_frames(argv[2], model);
    out->write(moved);
    out->finish();
  }
  return error < 0.02 * size ? EXIT_SUCCESS : EXIT_FAILURE;
}
