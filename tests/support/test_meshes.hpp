// Small meshes for tests: lattices of any registered element, jittered, stretched, moved.
#pragma once

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "framework/cell_map.hpp"
#include "framework/mesh.hpp"
#include "tests/support/random_inside.hpp"

namespace halfgrad::test {

namespace detail {

// The cells that fill the unit cube, each a list of node positions (num_nodes × dim): cubes as they are, simplices by
// Kuhn's subdivision, two wedges, six pyramids around the middle.
template <Element E>
std::vector<NodeMatrix<E>> cube_subdivision() {
  constexpr int dim = E::dim;
  std::vector<NodeMatrix<E>> cells;
  if constexpr (E::num_nodes == (1 << dim)) {
    cells.push_back(E::nodes());
  } else if constexpr (E::num_nodes == dim + 1) {
    std::vector<int> axes(dim);
    std::iota(axes.begin(), axes.end(), 0);
    do {
      NodeMatrix<E> cell = NodeMatrix<E>::Zero();
      int inversions = 0;
      for (int i = 0; i < dim; ++i) {
        for (int j = 0; j < i; ++j) inversions += axes[j] > axes[i];
        cell.row(i + 1) = cell.row(i);
        cell(i + 1, axes[i]) = 1;
      }
      if (inversions % 2 == 1) cell.row(dim - 1).swap(cell.row(dim));
      cells.push_back(cell);
    } while (std::next_permutation(axes.begin(), axes.end()));
  } else if constexpr (dim == 3 && E::num_nodes == 6) {
    cells.push_back(E::nodes());
    NodeMatrix<E> turned = E::nodes();
    turned.leftCols(2) = (1 - turned.leftCols(2).array()).matrix();
    cells.push_back(turned);
  } else {
    static_assert(dim == 3 && E::num_nodes == 5, "no subdivision of the cube into this element");
    for (int axis = 0; axis < 3; ++axis)
      for (int side = 0; side < 2; ++side) {
        const int a = (axis + 1) % 3, b = (axis + 2) % 3;
        NodeMatrix<E> cell = NodeMatrix<E>::Constant(0.5);
        for (int i = 0; i < 4; ++i) {
          const int u = i == 1 || i == 2, v = i >= 2;
          cell(i, axis) = side;
          cell(i, side == 0 ? a : b) = u;
          cell(i, side == 0 ? b : a) = v;
        }
        cells.push_back(cell);
      }
  }
  return cells;
}

}  // namespace detail

/// The unit cube of E::dim dimensions as n cubes a side, each subdivided into cells of E. Vertices off the boundary
/// move by up to `jitter` / n in each coordinate.
template <Element E>
Mesh lattice(int n, double jitter, unsigned seed) {
  constexpr int dim = E::dim;
  const auto pattern = detail::cube_subdivision<E>();
  // Positions in units of half a cube number all vertices, cube centers included.
  const auto number = [&](const Eigen::Matrix<double, 1, dim>& position) {
    std::int64_t key = 0;
    for (int a = 0; a < dim; ++a) key = key * (2 * n + 1) + std::lround(2 * position[a]);
    return key;
  };
  std::int64_t num_keys = 1, num_cubes = 1;
  for (int a = 0; a < dim; ++a) num_keys *= 2 * n + 1, num_cubes *= n;
  std::vector<Index> vertex_of(static_cast<std::size_t>(num_keys), -1);
  std::vector<Eigen::Matrix<double, 1, dim>> positions;
  std::vector<Index> cells;
  for (std::int64_t cube = 0; cube < num_cubes; ++cube) {
    Eigen::Matrix<double, 1, dim> corner;
    std::int64_t rest = cube;
    for (int a = 0; a < dim; ++a) corner[a] = static_cast<double>(rest % n), rest /= n;
    for (const NodeMatrix<E>& cell : pattern)
      for (int i = 0; i < E::num_nodes; ++i) {
        const Eigen::Matrix<double, 1, dim> position = corner + cell.row(i);
        Index& vertex = vertex_of[static_cast<std::size_t>(number(position))];
        if (vertex < 0) {
          vertex = static_cast<Index>(positions.size());
          positions.push_back(position);
        }
        cells.push_back(vertex);
      }
  }
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-jitter, jitter);
  Points vertices(static_cast<Eigen::Index>(positions.size()), dim);
  for (std::size_t v = 0; v < positions.size(); ++v) {
    auto& position = positions[v];
    if (position.minCoeff() > 0.25 && position.maxCoeff() < n - 0.25)
      for (int a = 0; a < dim; ++a) position[a] += uniform(random);
    vertices.row(static_cast<Eigen::Index>(v)) = position / n;
  }
  ElementBlock<E> block;
  block.cells.resize(static_cast<Eigen::Index>(cells.size()) / E::num_nodes, E::num_nodes);
  std::copy(cells.begin(), cells.end(), block.cells.data());
  return Mesh(std::move(vertices), {block});
}

/// The mesh under X ↦ linear X + offset; linear is gdim × gdim.
inline Mesh transformed(const Mesh& mesh, const Eigen::MatrixXd& linear, const Eigen::VectorXd& offset) {
  Points vertices = mesh.vertices() * linear.transpose();
  vertices.rowwise() += offset.transpose();
  return Mesh(std::move(vertices), mesh.blocks());
}

/// The mesh with its first coordinate multiplied by `factor`.
inline Mesh stretched(const Mesh& mesh, double factor) {
  Points vertices = mesh.vertices();
  vertices.col(0) *= factor;
  return Mesh(std::move(vertices), mesh.blocks());
}

/// Points uniform in reference coordinates of uniformly chosen cells, count × gdim: inside the mesh by construction.
inline Points random_points_inside(const Mesh& mesh, Index count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<Index> cell_distribution(0, mesh.num_cells() - 1);
  Points points(count, mesh.gdim());
  for (Index p = 0; p < count; ++p)
    with_cell(mesh, cell_distribution(random), [&]<Element E>(const ElementBlock<E>& block, Eigen::Index row) {
      points.row(p) = cell_position<E>(node_positions(mesh, block, row), random_inside<E>(random)).transpose();
    });
  return points;
}

/// A hexahedron with warped faces, a pyramid on its right face, and a tetrahedron on each side of the pyramid.
inline Mesh warped_mixed_mesh() {
  Points vertices(13, 3);
  vertices << 0, 0, 0, 1, 0, 0, 1, 1, 0, -0.2, 1, 0.1, 0, 0.1, 1, 1, 0, 1, 1, 1, 1, 0.1, 1, 1.2,  // hexahedron
      1.5, 0.5, 0.5,                                                                              // apex
      1.6, 0.5, -0.2, 1.6, 0.5, 1.2, 1.6, -0.2, 0.5, 1.6, 1.2, 0.5;
  ElementBlock<Hexahedron> hexahedra;
  hexahedra.cells.resize(1, 8);
  hexahedra.cells << 0, 1, 2, 3, 4, 5, 6, 7;
  ElementBlock<Pyramid> pyramids;
  pyramids.cells.resize(1, 5);
  pyramids.cells << 1, 2, 6, 5, 8;
  ElementBlock<Tetrahedron> tetrahedra;
  tetrahedra.cells.resize(4, 4);
  tetrahedra.cells << 1, 2, 8, 9, 5, 6, 8, 10, 1, 5, 8, 11, 2, 6, 8, 12;
  return Mesh(vertices, {hexahedra, pyramids, tetrahedra});
}

}  // namespace halfgrad::test
