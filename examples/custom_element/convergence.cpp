// An experiment with an element of one's own: the order of linear and Phong interpolation on pentagons.
#include <fmt/core.h>

#include <Eigen/Geometry>
#include <framework/cell_blocks.hpp>
#include <framework/interpolant.hpp>
#include <nlohmann/json.hpp>
#include <random>
#include <reconstruction/registry.hpp>

#include "pentagon.hpp"

using namespace halfgrad;

// Cairo's tiling of n² squares of the unit square: every square is cut in two, upright where i + j is even and level
// elsewhere, and the ends of the cuts bulge, so that each half has five corners. Vertices inside are jittered.
CellBlocks<Pentagon> cairo_tiling(int n) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> jitter(-0.06, 0.06);
  std::vector<Eigen::RowVector2d> positions;
  const auto add = [&](double x, double y) {
    const bool inside = std::min(x, y) > 0.5 && std::max(x, y) < n - 0.5;
    positions.emplace_back((x + inside * jitter(random)) / n, (y + inside * jitter(random)) / n);
    return static_cast<Index>(positions.size() - 1);
  };
  constexpr double bulge = 0.15;
  const auto sign = [](int i, int j) { return (i + j) % 2 == 0 ? 1 : -1; };
  std::vector<std::vector<Index>> corner(n + 1), level(n + 1), upright(n + 1);  // [i][j]: middles of the squares' sides
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) {
      corner[i].push_back(add(i, j));
      level[i].push_back(i < n ? add(i + 0.5, j + bulge * sign(i, j)) : -1);
      upright[i].push_back(j < n ? add(i - bulge * sign(i, j), j + 0.5) : -1);
    }
  std::vector<std::array<Index, 5>> pentagons;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const Index a = corner[i][j], b = corner[i + 1][j], c = corner[i + 1][j + 1], d = corner[i][j + 1];
      const Index below = level[i][j], above = level[i][j + 1], left = upright[i][j], right = upright[i + 1][j];
      if ((i + j) % 2 == 0) {
        pentagons.push_back({a, below, above, d, left});
        pentagons.push_back({below, b, right, c, above});
      } else {
        pentagons.push_back({a, below, b, right, left});
        pentagons.push_back({left, right, c, above, d});
      }
    }
  CellBlocks<Pentagon> cells;
  cells.vertices.resize(static_cast<Eigen::Index>(positions.size()), 2);
  for (std::size_t v = 0; v < positions.size(); ++v) cells.vertices.row(static_cast<Eigen::Index>(v)) = positions[v];
  auto& block = std::get<0>(cells.blocks);
  block.cells.resize(static_cast<Eigen::Index>(pentagons.size()), 5);
  for (std::size_t c = 0; c < pentagons.size(); ++c)
    std::copy(pentagons[c].begin(), pentagons[c].end(), block.cells.row(static_cast<Eigen::Index>(c)).data());
  return cells;
}

// A turn about the middle that grows with the distance.
Points twisted(const Points& positions) {
  Points result(positions.rows(), 2);
  for (Eigen::Index p = 0; p < positions.rows(); ++p) {
    const Eigen::Vector2d X = positions.row(p).transpose() - Eigen::Vector2d(0.5, 0.5);
    const double angle = 2 * std::sqrt(X.squaredNorm() + 0.01);
    result.row(p) = (Eigen::Rotation2Dd(angle) * X).transpose();
  }
  return result;
}

int main() {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(0.05, 0.95);
  const Points points = Points::NullaryExpr(4000, 2, [&] { return uniform(random); });
  const Points truth = twisted(points);

  std::array<std::array<double, 2>, 3> errors{};
  fmt::print("{:>6}  {:>10}  {:>10}\n", "cells", "linear", "phong");
  for (int level = 0; level < 3; ++level) {
    const CellBlocks<Pentagon> cells = cairo_tiling(8 << level);
    // Cells as numbers, from where the library goes on without knowing their element.
    const CellTable table = cell_table(cells);
    const WeightedPoints weights = embed(cells, points);
    const Reconstruction gradients =
        make_reconstructor("kriging").reconstructor->reconstruct(CellGradients(table), active_vertices(weights));
    const Values<double> deformed = twisted(cells.vertices);
    for (const char* rule : {"linear", "phong"}) {
      const Interpolant<double> interpolant(weights, named_rule(rule), &gradients);
      const Points error = interpolant.evaluate(deformed) - truth;
      errors[level][rule == std::string("phong")] = std::sqrt(error.squaredNorm() / points.rows());
    }
    fmt::print("{:>6}  {:>10.3g}  {:>10.3g}\n", table.cells.num_rows(), errors[level][0], errors[level][1]);
  }
  const double linear_order = std::log2(errors[1][0] / errors[2][0]),
               phong_order = std::log2(errors[1][1] / errors[2][1]);
  fmt::print("{:>6}  {:>10.2f}  {:>10.2f}\n", "order", linear_order, phong_order);
  return linear_order > 1.8 && phong_order > 2.7 ? 0 : 1;
}
