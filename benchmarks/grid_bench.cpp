// A grid beside the explicit mesh of the same cells: memory, and seconds to bind. Medians of interleaved repetitions.
//
//   grid_bench [cells an axis = 128] [points = 200000] [repetitions = 5]
#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <random>

#include "framework/grid.hpp"
#include "framework/interpolant.hpp"
#include "reconstruction/centered_difference.hpp"

using namespace halfgrad;

namespace {

struct Times {
  std::vector<double> locate, reconstruct, bind;
};

double seconds_since(std::chrono::steady_clock::time_point& last) {
  const auto now = std::chrono::steady_clock::now();
  const double seconds = std::chrono::duration<double>(now - last).count();
  last = now;
  return seconds;
}

// The three stages of binding on a shape of either kind.
template <class Shape, class Reconstruct>
Values<double> bind(const Shape& shape, const Points& points, Reconstruct&& reconstruct, const Values<double>& values,
                    Times& times) {
  auto clock = std::chrono::steady_clock::now();
  const Embedding embedding = embed(shape, points);
  times.locate.push_back(seconds_since(clock));
  const Reconstruction rows = reconstruct(active_vertices(shape, embedding));
  times.reconstruct.push_back(seconds_since(clock));
  const Interpolant<double> interpolant(shape, embedding, named_rule("phong"), &rows);
  times.bind.push_back(seconds_since(clock));
  return interpolant.evaluate(values);
}

double median(std::vector<double> seconds) {
  std::nth_element(seconds.begin(), seconds.begin() + seconds.size() / 2, seconds.end());
  return seconds[seconds.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
  const int cells = argc > 1 ? std::atoi(argv[1]) : 128, num_points = argc > 2 ? std::atoi(argv[2]) : 200000,
            repetitions = argc > 3 ? std::atoi(argv[3]) : 5;
  const GridAxis axis{cells, 0, 1.0 / cells, {}};
  const Grid grid({axis, axis, axis});
  const Mesh mesh = grid.mesh();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0.3, 0.7);
  const Points points = Points::NullaryExpr(num_points, 3, [&] { return uniform(random); });
  const Values<double> values = mesh.vertices().array().sin();

  Times here, there;
  double difference = 0;
  for (int r = 0; r < repetitions; ++r) {
    const Values<double> a = bind(
        grid, points, [&](const std::vector<Index>& v) { return CenteredDifference().reconstruct_on_grid(grid, v); },
        values, here);
    const Values<double> b = bind(
        mesh, points,
        [&](const std::vector<Index>& v) { return CenteredDifference().reconstruct(CellGradients(mesh), v); }, values,
        there);
    difference = std::max(difference, (a - b).cwiseAbs().maxCoeff());
  }
  const double mesh_bytes = 24.0 * mesh.num_vertices() + 32.0 * mesh.num_cells();
  const double incidence_bytes = 8.0 * mesh.num_vertices() + 32.0 * mesh.num_cells() + mesh.num_vertices();
  fmt::print("{} cells, {} points; greatest difference of the results {:.1e}\n", grid.num_cells(), num_points,
             difference);
  fmt::print("{:<34} {:>12} {:>12}\n", "", "grid", "mesh");
  fmt::print("{:<34} {:>12} {:>12.0f}\n", "bytes of the rest shape", grid.bytes(), mesh_bytes);
  fmt::print("{:<34} {:>12} {:>12.0f}\n", "bytes of incidence while binding", 0, incidence_bytes);
  const auto line = [&](const char* stage, const std::vector<double>& a, const std::vector<double>& b) {
    fmt::print("{:<34} {:>12.4f} {:>12.4f}\n", stage, median(a), median(b));
  };
  line("seconds to locate", here.locate, there.locate);
  line("seconds to reconstruct", here.reconstruct, there.reconstruct);
  line("seconds to bind the interpolant", here.bind, there.bind);
  return 0;
}
