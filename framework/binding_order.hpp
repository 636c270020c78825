// The order in which a binding holds cells, points and vertices.
#pragma once

#include <vector>

#include "framework/embedding.hpp"

namespace halfgrad {

class Grid;

/// What points touch, sorted in space. Reconstruction and interpolant both go by it: whoever makes both makes it once.
struct BindingOrder {
  std::vector<Index> cells;        ///< those that hold points, along a space-filling curve
  std::vector<Index> first_point;  ///< #cells + 1, into points
  std::vector<Index> points;       ///< the points of each cell, ascending
  std::vector<Index> vertices;     ///< the active vertices: those of the cells, by first use
};

BindingOrder binding_order(const Mesh& mesh, const Embedding& embedding);

/// The active vertices alone.
std::vector<Index> active_vertices(const Mesh& mesh, const Embedding& embedding);
/// The same on a grid, by the grid's numbers.
std::vector<Index> active_vertices(const Grid& grid, const Embedding& embedding);

}  // namespace halfgrad
