#include "experiments/hold_out.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "experiments/random.hpp"

namespace halfgrad {
namespace {

/// gdim + 1 vertices, positively oriented; the rest is unused.
using Simplex = std::array<Index, max_gdim + 1>;

/// Volume over the cubed (squared, …) root mean square of the edges: 0 where flat, negative where inverted.
double quality(const Points& vertices, const Simplex& simplex) {
  const Eigen::Index dim = vertices.cols();
  SmallMatrix edges(dim, dim);
  double squares = 0;
  for (Eigen::Index i = 0; i < dim; ++i) {
    edges.row(i) = vertices.row(simplex[i + 1]) - vertices.row(simplex[0]);
    for (Eigen::Index j = 0; j <= i; ++j)
      squares += (vertices.row(simplex[i + 1]) - vertices.row(simplex[j])).squaredNorm();
  }
  const double mean = squares / (0.5 * static_cast<double>(dim * (dim + 1)));
  return edges.determinant() / std::pow(mean, 0.5 * static_cast<double>(dim));
}

constexpr double flat = 1e-9;

std::vector<Simplex> divide_into_simplices(const Mesh& mesh) {
  const int dim = mesh.gdim();
  std::vector<Simplex> simplices;
  const auto add = [&](Index apex, const std::vector<Index>& base) {
    Simplex simplex{apex};
    std::copy(base.begin(), base.end(), simplex.begin() + 1);
    const double shape = quality(mesh.vertices(), simplex);
    if (std::abs(shape) < flat) return;
    if (shape < 0) std::swap(simplex[0], simplex[1]);
    simplices.push_back(simplex);
  };
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) {
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
      const Index apex = block.cells.row(c).minCoeff();
      for (const Facet& facet : E::facets) {
        std::vector<Index> base;
        for (int i = 0; i < facet.num_nodes; ++i) base.push_back(block.cells(c, facet.nodes[i]));
        if (std::find(base.begin(), base.end(), apex) != base.end()) continue;
        if (facet.num_nodes <= dim) {
          add(apex, base);
        } else {
          std::rotate(base.begin(), std::min_element(base.begin(), base.end()), base.end());
          add(apex, {base[0], base[1], base[2]});
          add(apex, {base[0], base[2], base[3]});
        }
      }
    }
  });
  return simplices;
}

Mesh mesh_of(const Points& vertices, const std::vector<Simplex>& simplices, const std::vector<Index>& numbers) {
  std::vector<AnyBlock> blocks;
  Elements::for_each([&]<class E>() {
    if constexpr (E::affine) {
      if (E::dim != vertices.cols()) return;
      ElementBlock<E> block;
      block.cells.resize(static_cast<Eigen::Index>(simplices.size()), E::num_nodes);
      for (std::size_t c = 0; c < simplices.size(); ++c)
        for (int i = 0; i < E::num_nodes; ++i) block.cells(static_cast<Eigen::Index>(c), i) = numbers[simplices[c][i]];
      blocks.emplace_back(std::move(block));
    }
  });
  return {vertices, std::move(blocks)};
}

/// Joins the cells around `vertex` to the neighbour that leaves the best of worst qualities; empty where every choice
/// makes a cell much worse than those there are.
std::vector<Simplex> collapse(const Points& vertices, const std::vector<Simplex>& star, Index vertex,
                              const std::vector<Index>& neighbors) {
  constexpr double tolerated_loss = 0.3;
  const auto num_nodes = vertices.cols() + 1;
  double least = 1;
  for (const Simplex& simplex : star) least = std::min(least, quality(vertices, simplex));
  least *= tolerated_loss;
  std::vector<Simplex> best, joined;
  for (const Index target : neighbors) {
    joined.clear();
    double worst = 1;
    for (Simplex simplex : star) {
      const auto end = simplex.begin() + num_nodes;
      if (std::find(simplex.begin(), end, target) != end) continue;
      std::replace(simplex.begin(), end, vertex, target);
      worst = std::min(worst, quality(vertices, simplex));
      if (worst < least) break;
      joined.push_back(simplex);
    }
    if (joined.empty() || worst < std::max(least, flat)) continue;
    least = worst;
    best = joined;
  }
  return best;
}

}  // namespace

HeldOutMesh hold_out(const Mesh& mesh, std::uint64_t seed) {
  const Points& vertices = mesh.vertices();
  const auto num_nodes = vertices.cols() + 1;
  std::vector<Simplex> simplices = divide_into_simplices(mesh);
  std::vector<std::vector<std::size_t>> simplices_of(vertices.rows());
  for (std::size_t s = 0; s < simplices.size(); ++s)
    for (Eigen::Index i = 0; i < num_nodes; ++i) simplices_of[simplices[s][i]].push_back(s);

  std::vector<Index> order(vertices.rows());
  std::iota(order.begin(), order.end(), 0);
  RandomStream random(seed, 3);
  for (std::size_t i = order.size(); i > 1; --i)
    std::swap(order[i - 1], order[static_cast<std::size_t>(random.uniform() * static_cast<double>(i))]);

  // Boundary vertices and neighbours of those taken out stay. So the cells of a vertex whose turn comes are the
  // original ones: a collapse changes none but those of vertices that stay.
  std::vector<char> stays = boundary_vertices(mesh), is_out(vertices.rows(), 0), is_gone(simplices.size(), 0);
  std::vector<Simplex> star, joined;
  std::vector<Index> neighbors;
  for (const Index vertex : order) {
    if (stays[vertex] != 0 || simplices_of[vertex].empty()) continue;
    star.clear();
    neighbors.clear();
    for (const std::size_t s : simplices_of[vertex]) {
      star.push_back(simplices[s]);
      for (Eigen::Index i = 0; i < num_nodes; ++i)
        if (simplices[s][i] != vertex) neighbors.push_back(simplices[s][i]);
    }
    std::sort(neighbors.begin(), neighbors.end());
    neighbors.erase(std::unique(neighbors.begin(), neighbors.end()), neighbors.end());
    const std::vector<Simplex> replaced = collapse(vertices, star, vertex, neighbors);
    if (replaced.empty()) continue;
    for (const std::size_t s : simplices_of[vertex]) is_gone[s] = 1;
    joined.insert(joined.end(), replaced.begin(), replaced.end());
    is_out[vertex] = 1;
    for (const Index neighbor : neighbors) stays[neighbor] = 1;
  }

  std::vector<Simplex> left;
  for (std::size_t s = 0; s < simplices.size(); ++s)
    if (is_gone[s] == 0) left.push_back(simplices[s]);
  left.insert(left.end(), joined.begin(), joined.end());
  HeldOutMesh result;
  std::vector<Index> numbers(vertices.rows(), -1);
  for (Index v = 0; v < mesh.num_vertices(); ++v) {
    if (is_out[v] == 0) numbers[v] = static_cast<Index>(result.kept.size());
    (is_out[v] != 0 ? result.held_out : result.kept).push_back(v);
  }
  result.mesh = mesh_of(vertices(result.kept, Eigen::all), left, numbers);
  return result;
}

}  // namespace halfgrad
