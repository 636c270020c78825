// A render loop: bind once in the order that is cheapest to evaluate, then move points every frame without allocating.
#include <fmt/core.h>

#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <random>

#include "framework/interpolant.hpp"
#include "reconstruction/registry.hpp"

using namespace halfgrad;

namespace {

// n × n × n cubes that fill the unit cube.
Mesh unit_cube(int n) {
  const int m = n + 1;
  Points rest(m * m * m, 3);
  for (int v = 0; v < rest.rows(); ++v) rest.row(v) << v % m, v / m % m, v / (m * m);
  ElementBlock<Hexahedron> cubes;
  cubes.cells.resize(n * n * n, 8);
  for (int c = 0; c < cubes.cells.rows(); ++c) {
    const int v = c % n + m * (c / n % n + m * (c / (n * n)));
    cubes.cells.row(c) << v, v + 1, v + m + 1, v + m, v + m * m, v + m * m + 1, v + m * m + m + 1, v + m * m + m;
  }
  return Mesh(rest / n, {cubes});
}

// What a simulation would deliver: the cube twists and bends in `out`.
void simulate(const Points& rest, double time, Values<float>& out) {
  for (Eigen::Index v = 0; v < rest.rows(); ++v) {
    const double angle = 0.8 * std::sin(time) * rest(v, 2), c = std::cos(angle), s = std::sin(angle);
    const double x = rest(v, 0) - 0.5, y = rest(v, 1) - 0.5;
    out.row(v) << static_cast<float>(c * x - s * y), static_cast<float>(s * x + c * y), static_cast<float>(rest(v, 2));
  }
}

}  // namespace

int main() {
  const Mesh mesh = unit_cube(6);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  Points points(20000, 3);
  for (double& coordinate : points.reshaped()) coordinate = uniform(random);

  const Embedding embedding = embed(mesh, points);
  const auto reconstructor = make_reconstructor("kriging").reconstructor;
  const Reconstruction gradients = reconstructor->reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
  const Interpolant<float> phong(mesh, embedding, named_rule("phong"), &gradients);

  // Row s of every frame is point order[s]: upload the points' other attributes in this order, once.
  const std::span<const Index> order = phong.permutation();

  Values<float> vertices(mesh.num_vertices(), 3), moved;
  Workspace<float> workspace;
  const float* memory = nullptr;
  double farthest = 0;
  for (int frame = 0; frame < 60; ++frame) {
    simulate(mesh.vertices(), frame / 10.0, vertices);
    phong.evaluate_sorted(vertices, moved, workspace);  // here a renderer would take `moved`
    if (frame > 0 && moved.data() != memory) return EXIT_FAILURE;
    memory = moved.data();

    Values<float> truth(points.rows(), 3);
    simulate(points, frame / 10.0, truth);
    for (Eigen::Index s = 0; s < moved.rows(); ++s)
      farthest = std::max<double>(farthest, (moved.row(s) - truth.row(order[s])).norm());
  }
  fmt::print("60 frames of {} points in {} cells; farthest from the true motion: {:.4f} of the cube's edge\n",
             phong.num_points(), phong.report().num_active_cells, farthest);
  return farthest < 0.01 ? EXIT_SUCCESS : EXIT_FAILURE;
}
