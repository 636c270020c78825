// Points as weighted means of vertices: numbers only, whatever the cells that the weights come from.
#pragma once

#include <vector>

#include "framework/types.hpp"

namespace halfgrad {

/// Weights with Σβ_i = 1 for each point. Of elements that no Mesh holds, of surfaces, of any other source of weights.
struct WeightedPoints {
  int gdim = 0;
  Index num_vertices = 0;          ///< of the mesh: values have as many rows
  std::vector<Offset> offsets{0};  ///< #points + 1; a point without entries was not found
  std::vector<Index> vertices;     ///< of each entry
  std::vector<double> weights;     ///< β of each entry
  std::vector<double> arms;        ///< gdim an entry: Σ_j β_j X_j − X_i, length units

  Index num_points() const { return static_cast<Index>(offsets.size() - 1); }
};

}  // namespace halfgrad
