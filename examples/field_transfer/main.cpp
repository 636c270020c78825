// A finite-element field moves to another mesh: temperatures at the vertices of one are wanted at the vertices of the
// other. Any number of columns goes the same way: scalars, colours, displacements, stresses.
//
//   field_transfer [SOURCE_MESH TARGET_MESH]     any two mesh files whose volumes overlap
#include <fmt/core.h>

#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "framework/interpolant.hpp"
#include "framework/io/mesh_file.hpp"
#include "reconstruction/registry.hpp"

using namespace halfgrad;

namespace {

// n × n squares, each cut into two triangles, moved off the lattice by `jitter` cells inside.
Mesh unit_square(int n, double jitter) {
  Points rest((n + 1) * (n + 1), 2);
  for (int v = 0; v < rest.rows(); ++v) {
    const int i = v % (n + 1), j = v / (n + 1);
    const bool inside = i > 0 && i < n && j > 0 && j < n;
    rest.row(v) << i + (inside ? jitter * std::sin(12.9 * v) : 0), j + (inside ? jitter * std::sin(78.2 * v) : 0);
  }
  ElementBlock<Triangle> triangles;
  triangles.cells.resize(2 * n * n, 3);
  for (int c = 0; c < n * n; ++c) {
    const int v = c / n * (n + 1) + c % n;
    triangles.cells.row(2 * c) << v, v + 1, v + n + 2;
    triangles.cells.row(2 * c + 1) << v, v + n + 2, v + n + 1;
  }
  return Mesh(rest / n, {triangles});
}

// Stands for the solution of a solver: a column of values a vertex.
Values<double> temperature(const Points& at) {
  Values<double> result(at.rows(), 1);
  for (Eigen::Index v = 0; v < at.rows(); ++v) result(v, 0) = std::exp(at(v, 0)) * std::cos(2 * at(v, 1));
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  const Mesh source = argc == 3 ? read_mesh(argv[1]) : unit_square(8, 0.25);
  const Mesh target = argc == 3 ? read_mesh(argv[2]) : unit_square(21, 0.2);

  // The meshes of one body need not end at the same surface: points outside are served by the nearest cell.
  const Embedding embedding = embed(source, target.vertices(), {.outside = Outside::nearest});
  const auto reconstructor = make_reconstructor("kriging").reconstructor;
  const Reconstruction gradients =
      reconstructor->reconstruct(CellGradients(source), active_vertices(source, embedding));

  const Values<double> values = temperature(source.vertices()), truth = temperature(target.vertices());
  double linear_error = 0, phong_error = 0;
  for (const char* rule : {"linear", "phong"}) {
    const Interpolant<double> transfer(source, embedding, named_rule(rule), &gradients);
    const double error =
        std::sqrt((transfer.evaluate(values) - truth).squaredNorm() / static_cast<double>(truth.size()));
    fmt::print("{:<6} rms error at {} vertices: {:.2e}\n", rule, truth.rows(), error);
    (std::string_view(rule) == "linear" ? linear_error : phong_error) = error;
  }
  return phong_error < linear_error ? EXIT_SUCCESS : EXIT_FAILURE;
}
