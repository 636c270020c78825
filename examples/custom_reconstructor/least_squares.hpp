#pragma once

#include <framework/vertex_gradient_reconstructor.hpp>
#include <reconstruction/registry.hpp>

struct LeastSquaresOptions {
  double power = 2;  ///< differences count with weight 1 / distance^power
};

/// The slope of the weighted least-squares plane through a vertex, fitted to the vertices that share a cell with it:
/// exact for affine values.
class LeastSquares final : public halfgrad::VertexGradientReconstructor {
 public:
  explicit LeastSquares(const LeastSquaresOptions& options = {}) : options_(options) {}
  halfgrad::Reconstruction reconstruct(const halfgrad::CellGradients& cells,
                                       std::span<const halfgrad::Index> vertices) const override;

 private:
  LeastSquaresOptions options_;
};

/// Its row for the registry: name, one line, and how options are read.
halfgrad::ReconstructorEntry least_squares_entry();
