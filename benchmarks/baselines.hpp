// What a frame is compared with: plain single-threaded loops as one would write them first, in the user's order.
#pragma once

#include <vector>

#include "framework/embedding.hpp"
#include "reconstruction/cell_averages.hpp"

namespace halfgrad::benchmarks {

/// Four vertices and four weights a point.
struct ScalarLinear {
  std::vector<Index> vertices;  ///< 4 a point
  std::vector<float> weights;   ///< 4 a point

  ScalarLinear(const Mesh& mesh, const Embedding& embedding);
  /// values: 3 a vertex; out: 3 a point.
  void evaluate(const float* values, float* out) const;
};

/// James 2020 as written, every frame over the whole mesh: gradients of all cells, weighted averages at all vertices,
/// then the blend of four affine maps at each point.
class PaperStyle {
 public:
  PaperStyle(const Mesh& mesh, const Embedding& embedding, const Points& points);
  /// values: 3 a vertex; out: 3 a point.
  void evaluate(const float* values, float* out);

 private:
  Index num_vertices_;
  std::vector<Index> tetrahedra_;      // 4 a cell
  std::vector<float> inverse_edges_;   // 9 a cell
  std::vector<float> rest_;            // 3 a vertex
  std::vector<Offset> cell_offsets_;   // #vertices + 1
  std::vector<Index> cells_;           // of each vertex
  std::vector<float> cell_weights_;    // of each vertex's cells
  std::vector<Index> point_cells_;     // 1 a point
  std::vector<float> barycentrics_;    // 4 a point
  std::vector<float> points_;          // 3 a point
  std::vector<float> cell_gradients_;  // 9 a cell, of the frame
  std::vector<float> gradients_;       // 9 a vertex, of the frame
};

}  // namespace halfgrad::benchmarks
