// Least squares over the patch around a vertex: the literature's yardsticks.
#pragma once

#include "framework/vertex_gradient_reconstructor.hpp"
#include "reconstruction/cell_averages.hpp"

namespace halfgrad {

struct SprOptions {
  int rings = 1;  ///< rings of cells around an interior vertex, ≥ 1; a boundary vertex takes one more
};

/// Superconvergent patch recovery: a linear fit of the cells' gradients at their centroids, taken at the vertex
/// (Zienkiewicz & Zhu 1992). Modes that the centroids do not determine are left out.
class Spr final : public CellAverage {
 public:
  explicit Spr(const SprOptions& options = {});

 private:
  void weigh(const CellGradients& cells, Index vertex, CellStar& star) const override;
  SprOptions options_;
};

struct PprOptions {
  int rings = 2;  ///< rings of vertices, ≥ 1
};

/// Polynomial-preserving recovery: the gradient at the vertex of a quadratic fitted to the values of the vertices
/// around it (Zhang & Naga 2005). Quadratic modes that the patch does not determine are left out; where it does not
/// determine the linear ones either, the volume-weighted mean of the adjacent cells serves.
class Ppr final : public VertexGradientReconstructor {
 public:
  explicit Ppr(const PprOptions& options = {});
  Reconstruction reconstruct(const CellGradients& cells, std::span<const Index> vertices) const override;

 private:
  PprOptions options_;
};

}  // namespace halfgrad
