#include "experiments/delaunay.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <tuple>

#include "framework/error.hpp"

namespace halfgrad {
namespace {

template <int D>
class Triangulation {
 public:
  using Point = Eigen::Matrix<double, D, 1>;

  explicit Triangulation(const std::vector<Point>& points) : points_(points) {
    // A simplex so large that its circumspheres through hull facets are flat at the size of the points.
    Point low = points.front(), high = points.front();
    for (const Point& point : points) {
      low = low.cwiseMin(point);
      high = high.cwiseMax(point);
    }
    const double reach = 1e6 * (high - low).norm();
    const Point middle = (low + high) / 2;
    Simplex first;
    for (int i = 0; i <= D; ++i) {
      Point corner = middle - Point::Constant(reach);
      if (i < D) corner[i] += 2.0 * D * reach;
      first.vertices[i] = static_cast<Index>(points_.size());
      points_.push_back(corner);
    }
    first.neighbors.fill(-1);
    if (volume(first.vertices) < 0) std::swap(first.vertices[0], first.vertices[1]);
    simplices_.push_back(first);
    num_points_ = static_cast<Index>(points.size());
    for (Index p = 0; p < num_points_; ++p) insert(p);
  }

  std::vector<std::array<Index, D + 1>> result() const {
    std::vector<std::array<Index, D + 1>> kept;
    for (const Simplex& simplex : simplices_) {
      const bool real =
          std::all_of(simplex.vertices.begin(), simplex.vertices.end(), [&](Index v) { return v < num_points_; });
      if (simplex.alive && real) kept.push_back(simplex.vertices);
    }
    return kept;
  }

 private:
  struct Simplex {
    std::array<Index, D + 1> vertices;
    std::array<Index, D + 1> neighbors;  // across the facet opposite to each vertex
    bool alive = true;
  };

  double volume(const std::array<Index, D + 1>& v) const {
    Eigen::Matrix<double, D, D> edges;
    for (int i = 0; i < D; ++i) edges.col(i) = points_[v[i]] - points_[v[D]];
    return edges.determinant();
  }

  // Positive inside the circumsphere of a positively oriented simplex.
  bool in_sphere(const Simplex& simplex, const Point& point) const {
    Eigen::Matrix<double, D + 1, D + 1> lifted;
    for (int i = 0; i <= D; ++i) {
      const Point edge = points_[simplex.vertices[i]] - point;
      lifted.row(i) << edge.transpose(), edge.squaredNorm();
    }
    return lifted.determinant() > 0;
  }

  Index locate(const Point& point) const {
    Index at = last_;
    for (std::size_t step = 0; step < simplices_.size(); ++step) {
      const Simplex& simplex = simplices_[at];
      int exit = -1;
      double least = 0;
      for (int i = 0; i <= D; ++i) {
        Eigen::Matrix<double, D, D> edges;
        for (int j = 0, column = 0; j <= D; ++j)
          if (j != i) edges.col(column++) = points_[simplex.vertices[j]] - point;
        // Volume of the simplex with vertex i replaced by the point: negative beyond facet i.
        const double share = ((D - i) % 2 == 0 ? 1 : -1) * edges.determinant();
        if (share < least) {
          least = share;
          exit = i;
        }
      }
      if (exit < 0 || simplex.neighbors[exit] < 0) return at;
      at = simplex.neighbors[exit];
    }
    raise("Delaunay: the walk to a point does not end; points are too close or in special position");
  }

  void insert(Index p) {
    const Point& point = points_[p];
    std::vector<Index> cavity{locate(point)};
    simplices_[cavity[0]].alive = false;
    struct Wall {
      std::array<Index, D> facet;
      Index outside;
      Index inside;
    };
    std::vector<Wall> walls;
    for (std::size_t c = 0; c < cavity.size(); ++c) {
      for (int i = 0; i <= D; ++i) {
        const Index next = simplices_[cavity[c]].neighbors[i];
        if (next >= 0 && !simplices_[next].alive) continue;
        if (next >= 0 && in_sphere(simplices_[next], point)) {
          simplices_[next].alive = false;
          cavity.push_back(next);
        }
      }
    }
    for (const Index dead : cavity)
      for (int i = 0; i <= D; ++i) {
        const Index next = simplices_[dead].neighbors[i];
        if (next >= 0 && !simplices_[next].alive) continue;
        Wall wall{{}, next, dead};
        for (int j = 0, k = 0; j <= D; ++j)
          if (j != i) wall.facet[k++] = simplices_[dead].vertices[j];
        walls.push_back(wall);
      }
    // New simplices join the point to the cavity's walls; ridges tell which of them are neighbours.
    ridges_.clear();
    for (const Wall& wall : walls) {
      Simplex simplex;
      std::copy(wall.facet.begin(), wall.facet.end(), simplex.vertices.begin());
      simplex.vertices[D] = p;
      double size = volume(simplex.vertices);
      if (size < 0) std::swap(simplex.vertices[0], simplex.vertices[1]);
      if (size == 0) raise("Delaunay: points in special position");
      simplex.neighbors.fill(-1);
      simplex.neighbors[D] = wall.outside;
      const Index number = static_cast<Index>(simplices_.size());
      if (wall.outside >= 0)
        for (Index& back : simplices_[wall.outside].neighbors)
          if (back == wall.inside && shares(simplices_[wall.outside], wall.facet, back)) back = number;
      for (int i = 0; i < D; ++i) {
        std::array<Index, D - 1> ridge;
        for (int j = 0, k = 0; j < D; ++j)
          if (j != i) ridge[k++] = simplex.vertices[j];
        std::sort(ridge.begin(), ridge.end());
        ridges_.push_back({ridge, number, i});
      }
      simplices_.push_back(simplex);
    }
    std::sort(ridges_.begin(), ridges_.end());
    for (std::size_t r = 0; r + 1 < ridges_.size(); r += 2) {
      const auto& [ridge, a, i] = ridges_[r];
      const auto& [other_ridge, b, j] = ridges_[r + 1];
      if (ridge != other_ridge) raise("Delaunay: a cavity is not closed; points are in special position");
      simplices_[a].neighbors[i] = b;
      simplices_[b].neighbors[j] = a;
    }
    last_ = static_cast<Index>(simplices_.size() - 1);
  }

  // Whether the facet behind a neighbour slot is the wall's.
  bool shares(const Simplex& simplex, const std::array<Index, D>& facet, const Index& slot) const {
    const auto opposite = simplex.vertices[static_cast<std::size_t>(&slot - simplex.neighbors.data())];
    return std::find(facet.begin(), facet.end(), opposite) == facet.end();
  }

  std::vector<Point> points_;
  std::vector<Simplex> simplices_;
  std::vector<std::tuple<std::array<Index, D - 1>, Index, int>> ridges_;  // ridge, simplex, slot
  Index num_points_ = 0;
  Index last_ = 0;
};

}  // namespace

template <int D>
std::vector<std::array<Index, D + 1>> delaunay(const std::vector<Eigen::Matrix<double, D, 1>>& points) {
  if (points.size() <= D) raise("Delaunay: {} points in {} dimensions, expected more", points.size(), D);
  return Triangulation<D>(points).result();
}

template std::vector<std::array<Index, 3>> delaunay<2>(const std::vector<Eigen::Vector2d>&);
template std::vector<std::array<Index, 4>> delaunay<3>(const std::vector<Eigen::Vector3d>&);

}  // namespace halfgrad
