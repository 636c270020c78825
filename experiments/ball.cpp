#include "experiments/ball.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "experiments/delaunay.hpp"
#include "experiments/random.hpp"
#include "framework/error.hpp"

namespace halfgrad {
namespace {

/// Points around the origin, those of the boundary last.
template <int D>
class BallMesher {
 public:
  using Point = Eigen::Matrix<double, D, 1>;
  using Cell = std::array<Index, D + 1>;

  BallMesher(double radius, double spacing, std::uint64_t seed) : radius_(radius), spacing_(spacing), random_(seed, 3) {
    scatter();
    for (int round = 0; round < 8; ++round) {
      cells_ = delaunay<D>(points_);
      relax();
    }
    cells_ = delaunay<D>(points_);
    if constexpr (D == 3) lift_flat_cells();
  }

  Mesh mesh(const Point& center) const {
    Points vertices(static_cast<Eigen::Index>(points_.size()), D);
    for (std::size_t p = 0; p < points_.size(); ++p) vertices.row(p) = (points_[p] + center).transpose();
    ElementBlock<std::conditional_t<D == 3, Tetrahedron, Triangle>> block;
    block.cells.resize(static_cast<Eigen::Index>(cells_.size()), D + 1);
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      for (int i = 0; i <= D; ++i) block.cells(static_cast<Eigen::Index>(c), i) = cells_[c][i];
      if (volume(cells_[c]) < 0) std::swap(block.cells(c, 0), block.cells(c, 1));
    }
    return Mesh(std::move(vertices), {std::move(block)});
  }

 private:
  bool on_boundary(Index point) const { return point >= num_inner_; }

  // Random points no closer than a share of the spacing, on the sphere and then inside.
  void scatter() {
    const double least = 0.77 * spacing_;
    const int side = std::max(1, static_cast<int>(2 * radius_ / least));
    std::vector<std::vector<Index>> bins(static_cast<std::size_t>(std::pow(side, D)));
    const auto bin_range = [&](double x) {
      const int middle = static_cast<int>((x + radius_) / (2 * radius_) * side);
      return std::pair{std::clamp(middle - 1, 0, side - 1), std::clamp(middle + 1, 0, side - 1)};
    };
    const auto for_near_bins = [&](const Point& point, auto&& f) {
      std::array<std::pair<int, int>, 3> range;
      range[2] = {0, 0};
      for (int a = 0; a < D; ++a) range[a] = bin_range(point[a]);
      for (int k = range[2].first; k <= range[2].second; ++k)
        for (int j = range[1].first; j <= range[1].second; ++j)
          for (int i = range[0].first; i <= range[0].second; ++i) f(bins[i + side * (j + std::size_t(side) * k)]);
    };
    const auto try_add = [&](const Point& point) {
      bool is_free = true;
      for_near_bins(point, [&](const std::vector<Index>& bin) {
        for (const Index other : bin) is_free = is_free && (points_[other] - point).norm() >= least;
      });
      if (!is_free) return;
      std::array<int, 3> own{};
      for (int a = 0; a < D; ++a)
        own[a] = std::clamp(static_cast<int>((point[a] + radius_) / (2 * radius_) * side), 0, side - 1);
      bins[own[0] + side * (own[1] + std::size_t(side) * own[2])].push_back(static_cast<Index>(points_.size()));
      points_.push_back(point);
    };
    const auto random_point = [&] {
      Point point;
      do {
        for (int a = 0; a < D; ++a) point[a] = random_.uniform(-radius_, radius_);
      } while (point.norm() > radius_ || point.norm() < 1e-3 * radius_);
      return point;
    };
    const double relative = radius_ / spacing_;
    const auto tries = [&](int dim) { return static_cast<std::int64_t>(400 * std::pow(relative, dim)) + 1000; };
    for (std::int64_t n = tries(D - 1); n > 0; --n) try_add(radius_ * random_point().normalized());
    const std::size_t num_boundary = points_.size();
    for (std::int64_t n = tries(D); n > 0; --n) {
      const Point point = random_point();
      if (point.norm() < radius_ - 0.5 * spacing_) try_add(point);
    }
    // Points of one sphere are no general position: they are inserted when no sphere through them is empty any more.
    std::rotate(points_.begin(), points_.begin() + static_cast<std::ptrdiff_t>(num_boundary), points_.end());
    num_inner_ = static_cast<Index>(points_.size() - num_boundary);
  }

  double volume(const Cell& cell) const {
    Eigen::Matrix<double, D, D> edges;
    for (int i = 0; i < D; ++i) edges.col(i) = points_[cell[i + 1]] - points_[cell[0]];
    return edges.determinant();
  }

  // Inner points go to the mean of their cells' centroids by volume (Chen & Holst 2011), boundary points to the mean of
  // their neighbours along the boundary.
  void relax() {
    std::vector<Point> sum(points_.size(), Point::Zero());
    std::vector<double> weight(points_.size(), 0);
    for (const Cell& cell : cells_) {
      Point centroid = Point::Zero();
      for (const Index v : cell) centroid += points_[v] / (D + 1);
      const double share = std::abs(volume(cell));
      for (const Index v : cell) {
        if (!on_boundary(v)) {
          sum[v] += share * centroid;
          weight[v] += share;
        } else {
          for (const Index other : cell)
            if (other != v && on_boundary(other)) {
              sum[v] += points_[other];
              weight[v] += 1;
            }
        }
      }
    }
    for (std::size_t p = 0; p < points_.size(); ++p) {
      if (!(weight[p] > 0)) continue;
      const Point target = sum[p] / weight[p];
      points_[p] += 0.8 * (target - points_[p]);
      if (on_boundary(static_cast<Index>(p))) points_[p] *= radius_ / points_[p].norm();
    }
  }

  // 0 for a flat cell, 1 for a regular one.
  double quality(const Cell& cell) const {
    double squares = 0;
    for (int i = 0; i <= D; ++i)
      for (int j = 0; j < i; ++j) squares += (points_[cell[i]] - points_[cell[j]]).squaredNorm();
    return volume(cell) * std::sqrt(2.0) / std::pow(squares / 6, 1.5);
  }

  // Flat cells (slivers) survive relaxation: their vertices try random moves, and keep those that raise the least
  // quality around them. Connectivity stays.
  void lift_flat_cells() {
    for (Cell& cell : cells_)
      if (volume(cell) < 0) std::swap(cell[0], cell[1]);
    std::vector<std::vector<Index>> star(points_.size());
    for (std::size_t c = 0; c < cells_.size(); ++c)
      for (const Index v : cells_[c]) star[v].push_back(static_cast<Index>(c));
    const auto least_around = [&](Index v) {
      double least = 1;
      for (const Index c : star[v]) least = std::min(least, quality(cells_[c]));
      return least;
    };
    for (int round = 0; round < 20; ++round) {
      const double wanted = 0.35;
      for (const Cell& cell : cells_) {
        if (quality(cell) > wanted) continue;
        for (const Index v : cell) {
          double best = least_around(v);
          for (int attempt = 0; attempt < 12 && best < wanted; ++attempt) {
            const Point before = points_[v];
            Point step;
            for (int a = 0; a < D; ++a) step[a] = random_.uniform(-0.15, 0.15) * spacing_;
            points_[v] += step;
            if (on_boundary(v)) points_[v] *= radius_ / points_[v].norm();
            const double now = least_around(v);
            if (now > best)
              best = now;
            else
              points_[v] = before;
          }
        }
      }
    }
  }

  double radius_, spacing_;
  RandomStream random_;
  std::vector<Point> points_;
  Index num_inner_ = 0;
  std::vector<Cell> cells_;
};

template <int D>
Mesh make_ball_in(const BallOptions& options) {
  using Point = Eigen::Matrix<double, D, 1>;
  const Point center = options.center.size() == 0 ? Point::Zero().eval() : Point(options.center);
  return BallMesher<D>(options.radius, options.spacing, options.seed).mesh(center);
}

}  // namespace

Mesh make_ball(const BallOptions& options) {
  if (!(options.radius > 0)) raise("ball: found radius {}, expected a positive length", options.radius);
  if (!(options.spacing > 0 && options.spacing <= options.radius))
    raise("ball: found spacing {}, expected more than 0 and at most the radius {}", options.spacing, options.radius);
  if (options.center.size() != 0 && options.center.size() != options.gdim)
    raise("ball: a center of {} coordinates in {} dimensions", options.center.size(), options.gdim);
  return options.gdim == 3 ? make_ball_in<3>(options) : make_ball_in<2>(options);
}

}  // namespace halfgrad
