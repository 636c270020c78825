#include "experiments/random_delaunay.hpp"

#include <Eigen/LU>
#include <cmath>

#include "experiments/delaunay.hpp"
#include "experiments/random.hpp"
#include "framework/error.hpp"

namespace halfgrad {
namespace {

template <int D>
Mesh make_in(const RandomDelaunayOptions& options) {
  using Point = Eigen::Matrix<double, D, 1>;
  RandomStream random(options.seed, 5);
  std::vector<Point> points(options.num_points);
  for (Point& point : points)
    for (int a = 0; a < D; ++a) point[a] = random.uniform(-0.5, 0.5);
  const auto cells = delaunay<D>(points);
  ElementBlock<std::conditional_t<D == 3, Tetrahedron, Triangle>> block;
  block.cells.resize(static_cast<Eigen::Index>(cells.size()), D + 1);
  Eigen::Index kept = 0;
  for (const auto& cell : cells) {
    Eigen::Matrix<double, D, D> edges;
    for (int i = 0; i < D; ++i) edges.col(i) = points[cell[i + 1]] - points[cell[0]];
    if (!(std::abs(edges.determinant()) > 1e-14)) continue;
    for (int i = 0; i <= D; ++i) block.cells(kept, i) = cell[i];
    if (edges.determinant() < 0) std::swap(block.cells(kept, 0), block.cells(kept, 1));
    ++kept;
  }
  block.cells.conservativeResize(kept, Eigen::NoChange);
  Points vertices(static_cast<Eigen::Index>(points.size()), D);
  for (std::size_t p = 0; p < points.size(); ++p) vertices.row(static_cast<Eigen::Index>(p)) = points[p].transpose();
  return Mesh(std::move(vertices), {std::move(block)});
}

}  // namespace

Mesh make_random_delaunay(const RandomDelaunayOptions& options) {
  if (options.num_points < options.gdim + 2)
    raise("random_delaunay: found {} points, expected at least {}", options.num_points, options.gdim + 2);
  return options.gdim == 3 ? make_in<3>(options) : make_in<2>(options);
}

}  // namespace halfgrad
