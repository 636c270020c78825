// Weighted means of cell gradients: the paper's family of reconstructors.
#pragma once

#include <vector>

#include "framework/vertex_gradient_reconstructor.hpp"
#include "reconstruction/places.hpp"

namespace halfgrad {

/// Weights of the cells at one vertex.
struct CellWeights {
  std::vector<Index> cells;
  std::vector<double> weights;  ///< w'_k, sum to one; empty where no cell is usable
};

/// The cells of which one vertex takes the mean. Serves vertex after vertex: it keeps its storage and the geometry of
/// the cells it met last, of which neighbouring vertices share most.
class CellStar {
 public:
  std::vector<Index> cells;
  std::vector<Vector> offsets;  ///< centroid − vertex
  std::vector<double> weights;  ///< one a cell

  explicit CellStar(const CellGradients& geometry) : geometry_(&geometry), known_places_(16) {}
  void clear();
  /// Adds cells, seen from the vertex, but for degenerate ones.
  void add(Index vertex, std::span<const Index> more);
  double volume(std::size_t k) const { return known_[places_[k]]; }
  /// The gradient stencils of the cells, #nodes × gdim each, valid until cells are added.
  std::span<const double* const> gradients();

 private:
  static constexpr std::size_t max_known = 80'000;  // 0.6 MB, 5,000 tetrahedra

  Index learn(Index cell);

  const CellGradients* geometry_;
  std::vector<double> known_;  // volume, centroid, gradient stencil of one cell after the other
  Places known_places_;        // where a cell's begin
  std::vector<Index> places_;  // the same, one a cell of the star
  std::vector<const double*> gradients_;
};

/// A reconstructor of the form F_v = Σ_k w'_k F_k. Derived classes choose and weigh the cells; composition with the
/// cells' gradients to a vertex stencil is shared. Degenerate cells (volume 0) carry no weight.
class CellAverage : public VertexGradientReconstructor {
 public:
  Reconstruction reconstruct(const CellGradients& cells, std::span<const Index> vertices) const final;
  /// Normalised weights of one vertex.
  CellWeights weights(const CellGradients& cells, Index vertex) const;

 private:
  /// Fills a cleared star; no cells where none is usable. Weights may have any sum but zero.
  virtual void weigh(const CellGradients& cells, Index vertex, CellStar& star) const = 0;

  void normalised_star(const CellGradients& cells, Index vertex, CellStar& star) const;
};

/// w_k = 1.
class UnweightedAverage final : public CellAverage {
 private:
  void weigh(const CellGradients& cells, Index vertex, CellStar& star) const override;
};

/// w_k = volume of cell k.
class VolumeAverage final : public CellAverage {
 private:
  void weigh(const CellGradients& cells, Index vertex, CellStar& star) const override;
};

/// w_k = 1 / |centroid of cell k − vertex|.
class InverseDistance final : public CellAverage {
 private:
  void weigh(const CellGradients& cells, Index vertex, CellStar& star) const override;
};

struct ChandrashekarGargOptions {
  double epsilon = 1;  ///< Tikhonov parameter, dimensionless, ≥ 0
};

/// Inverse-distance weights that reproduce linear functions where they can: James 2020, Eq. 24–27.
/// With ε = 0 a singular system throws Error that names the vertex.
class ChandrashekarGarg final : public CellAverage {
 public:
  explicit ChandrashekarGarg(const ChandrashekarGargOptions& options = {});

 private:
  void weigh(const CellGradients& cells, Index vertex, CellStar& star) const override;
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

 private:
  void weigh(const CellGradients& cells, Index vertex, CellStar& star) const override;
  KnnOptions options_;
};

}  // namespace halfgrad
