// Weighted means of cell gradients: the paper's family of reconstructors.
#pragma once

#include "framework/vertex_gradient_reconstructor.hpp"

namespace halfgrad {

/// Weights of the cells at one vertex.
struct CellWeights {
  std::vector<Index> cells;
  std::vector<double> weights;  ///< w'_k, sum to one; empty where no cell is usable
};

/// A reconstructor of the form F_v = Σ_k w'_k F_k. Derived classes give the weights; composition with the cells'
/// gradients to a vertex stencil is shared. Degenerate cells (volume 0) carry no weight.
class CellAverage : public VertexGradientReconstructor {
 public:
  Reconstruction reconstruct(const CellGradients& cells, std::span<const Index> vertices) const final;
  /// Normalised weights of one vertex.
  virtual CellWeights weights(const CellGradients& cells, Index vertex) const = 0;
};

/// w_k = 1.
class UnweightedAverage final : public CellAverage {
 public:
  CellWeights weights(const CellGradients& cells, Index vertex) const override;
};

/// w_k = volume of cell k.
class VolumeAverage final : public CellAverage {
 public:
  CellWeights weights(const CellGradients& cells, Index vertex) const override;
};

/// w_k = 1 / |centroid of cell k − vertex|.
class InverseDistance final : public CellAverage {
 public:
  CellWeights weights(const CellGradients& cells, Index vertex) const override;
};

struct ChandrashekarGargOptions {
  double epsilon = 1;  ///< Tikhonov parameter, dimensionless, ≥ 0
};

/// Inverse-distance weights that reproduce linear functions where they can: James 2020, Eq. 24–27.
/// With ε = 0 a singular system throws Error that names the vertex.
class ChandrashekarGarg final : public CellAverage {
 public:
  explicit ChandrashekarGarg(const ChandrashekarGargOptions& options = {});
  CellWeights weights(const CellGradients& cells, Index vertex) const override;

 private:
  ChandrashekarGargOptions options_;
};

struct KnnOptions {
  int k = 8;           ///< cells to add to the adjacent ones: those whose centroids are nearest, ≥ 0
  double epsilon = 1;  ///< as in chandrashekar_garg
};

/// The same weights over the adjacent cells and the k further cells whose centroids are nearest, and those that
/// tie with the k-th (James 2020, §4).
class Knn final : public CellAverage {
 public:
  explicit Knn(const KnnOptions& options = {});
  CellWeights weights(const CellGradients& cells, Index vertex) const override;

 private:
  KnnOptions options_;
};

}  // namespace halfgrad
