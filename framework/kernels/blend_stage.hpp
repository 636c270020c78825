// Lines of the active vertices under a blend (reconstructor `adaptive`), from lines of the gradients that it blends.
// All lines are as in cell_polynomial.hpp, without scale.
#pragma once

#include <array>

#include "framework/types.hpp"

namespace halfgrad::kernels {

/// The rule of blended_gradients() (framework/gradient_stencils.hpp), vertex by vertex.
template <class Scalar>
struct BlendStage {
  int dim;
  const Offset* edge_offsets;  ///< [row]
  const Index* edge_rows;      ///< [edge] row of `fitted`
  const Scalar* edges;         ///< [edge] 2 |ê| / |e|, −ê (WeightedEdge)
  const Scalar* metrics;       ///< [row] Σ êêᵀ and its damped inverse, num_symmetric(dim) numbers each
  const Scalar* caution;       ///< [row]
  const Scalar* fitted;        ///< lines of the rows and of their neighbours
  Scalar prediction_share;
  std::array<Scalar, 9> scale;  ///< of the result, as in VertexStage
  Scalar* lines;                ///< holds the averages' lines; the results take their place

  /// Rows [begin, end) by the fastest instructions of this machine.
  void run(Index begin, Index end) const;
};

}  // namespace halfgrad::kernels
