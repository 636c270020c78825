// A drawing in a cage: 16 triangles around an outline; who moves the cage's vertices bends the outline, without the
// corners that linear interpolation shows where it crosses the triangles' edges.
#include <fmt/core.h>

#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "framework/interpolant.hpp"
#include "reconstruction/registry.hpp"

using namespace halfgrad;

namespace {

constexpr double two_pi = 6.283185307179586;

// A center and two rings of vertices, joined to triangles.
Mesh disc(int num_sides) {
  Points rest(1 + 2 * num_sides, 2);
  rest.row(0).setZero();
  ElementBlock<Triangle> triangles;
  triangles.cells.resize(3 * num_sides, 3);
  for (int i = 0; i < num_sides; ++i) {
    const int inner = 1 + i, next = 1 + (i + 1) % num_sides, outer = inner + num_sides, corner = next + num_sides;
    const double angle = two_pi * i / num_sides;
    rest.row(inner) << 0.6 * std::cos(angle), 0.6 * std::sin(angle);
    rest.row(outer) << 1.2 * std::cos(angle), 1.2 * std::sin(angle);
    triangles.cells.row(3 * i) << 0, inner, next;
    triangles.cells.row(3 * i + 1) << inner, outer, corner;
    triangles.cells.row(3 * i + 2) << inner, corner, next;
  }
  return Mesh(rest, {triangles});
}

// The sharpest corner of a closed outline, in degrees.
double sharpest_corner(const Values<double>& outline) {
  double sharpest = 0;
  for (Eigen::Index p = 0; p < outline.rows(); ++p) {
    const Eigen::Vector2d before = outline.row(p) - outline.row((p + outline.rows() - 1) % outline.rows());
    const Eigen::Vector2d after = outline.row((p + 1) % outline.rows()) - outline.row(p);
    sharpest =
        std::max(sharpest, std::abs(std::atan2(before.x() * after.y() - before.y() * after.x(), before.dot(after))));
  }
  return sharpest * 360 / two_pi;
}

}  // namespace

int main() {
  const Mesh cage = disc(8);
  Points outline(720, 2);
  for (int p = 0; p < outline.rows(); ++p) {
    const double angle = two_pi * p / static_cast<double>(outline.rows());
    outline.row(p) << std::cos(angle), std::sin(angle);
  }

  const Embedding embedding = embed(cage, outline);
  const auto reconstructor = make_reconstructor("chandrashekar_garg").reconstructor;
  const Reconstruction gradients = reconstructor->reconstruct(CellGradients(cage), active_vertices(cage, embedding));

  // An artist pulls the cage to the right and twists it about its center.
  Values<double> moved = cage.vertices();
  for (Eigen::Index v = 0; v < moved.rows(); ++v) {
    const double angle = 0.5 * cage.vertices().row(v).norm(), x = moved(v, 0), y = moved(v, 1);
    moved.row(v) << std::cos(angle) * x - std::sin(angle) * y + 0.4 * x * x, std::sin(angle) * x + std::cos(angle) * y;
  }

  double corners[2];
  const char* names[] = {"linear", "phong"};
  for (int rule = 0; rule < 2; ++rule) {
    const Interpolant<double> interpolant(cage, embedding, named_rule(names[rule]), &gradients);
    corners[rule] = sharpest_corner(interpolant.evaluate(moved));
    fmt::print("{:<6} sharpest corner of the outline: {:.1f} degrees\n", names[rule], corners[rule]);
  }
  return corners[1] < corners[0] ? EXIT_SUCCESS : EXIT_FAILURE;
}
