#include "reconstruction/cell_averages.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "framework/error.hpp"
#include "reconstruction/row_assembly.hpp"
#include "reconstruction/symmetric_eigen.hpp"
#include "reconstruction/vertex_rings.hpp"

namespace halfgrad {

namespace {

struct UsableCell {
  Index cell;
  double volume;
  Vector offset;  // centroid − vertex
};

UsableCell usable_cell(const CellGradients& cells, Index vertex, Index cell) {
  const CellGradient gradient = cells.gradient(cell);
  return {cell, gradient.volume, gradient.centroid - cells.vertices().row(vertex).transpose()};
}

std::vector<UsableCell> adjacent_cells(const CellGradients& cells, Index vertex) {
  std::vector<UsableCell> usable;
  for (Index cell : cells.cells_of(vertex)) {
    UsableCell candidate = usable_cell(cells, vertex, cell);
    if (candidate.volume > 0) usable.push_back(candidate);
  }
  return usable;
}

CellWeights normalised(const std::vector<UsableCell>& usable, const std::vector<double>& raw) {
  CellWeights result;
  const double sum = std::accumulate(raw.begin(), raw.end(), 0.0);
  for (std::size_t k = 0; k < usable.size(); ++k) {
    result.cells.push_back(usable[k].cell);
    result.weights.push_back(raw[k] / sum);
  }
  return result;
}

// Whether a cell's centroid is not the vertex itself. Far from the origin it is, by rounding; in the limit weights by
// inverse distance are then zero for all other cells.
bool away_from_vertex(const UsableCell& cell) { return cell.offset.squaredNorm() > 0; }

// Weights by inverse distance.
CellWeights inverse_distance_weights(const std::vector<UsableCell>& usable) {
  const bool all_away = std::all_of(usable.begin(), usable.end(), away_from_vertex);
  std::vector<double> raw;
  for (const UsableCell& cell : usable)
    raw.push_back(all_away ? 1 / cell.offset.norm() : away_from_vertex(cell) ? 0.0 : 1.0);
  return normalised(usable, raw);
}

// James 2020, Eq. 24–27 over any set of cells.
CellWeights consistent_weights(const std::vector<UsableCell>& usable, double epsilon, Index vertex) {
  if (usable.empty()) return {};
  if (!std::all_of(usable.begin(), usable.end(), away_from_vertex)) return inverse_distance_weights(usable);
  const Eigen::Index gdim = usable.front().offset.size();
  SmallMatrix normal = SmallMatrix::Zero(gdim, gdim);
  Vector sum = Vector::Zero(gdim);
  for (const UsableCell& cell : usable) {
    const Vector direction = cell.offset.normalized();
    normal += direction * direction.transpose();
    sum += direction;
  }
  // The eigenbasis solves the small symmetric system and tells its rank.
  const SymmetricEigen eigen = symmetric_eigen(normal + epsilon * SmallMatrix::Identity(gdim, gdim));
  const double singular = 1e-12 * static_cast<double>(usable.size());
  if (!(eigen.values[0] > singular))
    raise(
        "chandrashekar_garg: the weights of vertex {} are not determined with epsilon {} (least eigenvalue {:.3g}): "
        "use epsilon > 0",
        vertex, epsilon, eigen.values[0]);
  const Vector lambda = -(eigen.vectors * eigen.values.cwiseInverse().asDiagonal() * eigen.vectors.transpose() * sum);
  std::vector<double> raw;
  double total = 0, magnitude = 0;
  for (const UsableCell& cell : usable) {
    const double distance = cell.offset.norm();
    raw.push_back((1 + lambda.dot(cell.offset) / distance) / distance);
    total += raw.back();
    magnitude += std::abs(raw.back()) + 1 / distance;
  }
  // On flat one-sided stars small ε drives all weights to zero and the quotient to 0/0.
  if (!(std::abs(total) > 1e-10 * magnitude)) {
    if (epsilon == 0)
      raise("chandrashekar_garg: the weights of vertex {} sum to zero with epsilon 0: use epsilon > 0", vertex);
    return inverse_distance_weights(usable);
  }
  return normalised(usable, raw);
}

}  // namespace

Reconstruction CellAverage::reconstruct(const CellGradients& cells, std::span<const Index> vertices) const {
  Reconstruction result;
  result.stencils = assemble_rows(cells.gdim(), vertices, [&](Index vertex, StencilRow& row) {
    const CellWeights average = weights(cells, vertex);
    compose_row(cells, vertex, average.cells, average.weights, row);
    row.diagnostics.rule = average.cells.empty() ? StencilRule::none : StencilRule::average;
    row.diagnostics.num_points = static_cast<Index>(average.cells.size());
  });
  return result;
}

CellWeights UnweightedAverage::weights(const CellGradients& cells, Index vertex) const {
  const std::vector<UsableCell> usable = adjacent_cells(cells, vertex);
  return normalised(usable, std::vector<double>(usable.size(), 1.0));
}

CellWeights InverseDistance::weights(const CellGradients& cells, Index vertex) const {
  return inverse_distance_weights(adjacent_cells(cells, vertex));
}

CellWeights VolumeAverage::weights(const CellGradients& cells, Index vertex) const {
  const std::vector<UsableCell> usable = adjacent_cells(cells, vertex);
  std::vector<double> raw;
  for (const UsableCell& cell : usable) raw.push_back(cell.volume);
  return normalised(usable, raw);
}

ChandrashekarGarg::ChandrashekarGarg(const ChandrashekarGargOptions& options) : options_(options) {
  if (!(options.epsilon >= 0)) raise("chandrashekar_garg: epsilon {}: expected a number >= 0", options.epsilon);
}

CellWeights ChandrashekarGarg::weights(const CellGradients& cells, Index vertex) const {
  return consistent_weights(adjacent_cells(cells, vertex), options_.epsilon, vertex);
}

Knn::Knn(const KnnOptions& options) : options_(options) {
  if (options.k < 0) raise("knn: k {}: expected a whole number >= 0", options.k);
  if (!(options.epsilon >= 0)) raise("knn: epsilon {}: expected a number >= 0", options.epsilon);
}

CellWeights Knn::weights(const CellGradients& cells, Index vertex) const {
  std::vector<UsableCell> usable = adjacent_cells(cells, vertex);
  // Rings of cells that share a vertex, so that the choice never jumps a gap of the mesh: grown until they hold k
  // further cells, then once more, so that a near cell of the next ring is not missed.
  const std::span<const Index> adjacent = cells.cells_of(vertex);
  std::vector<Index> found(adjacent.begin(), adjacent.end()), ring = found, next;
  std::vector<UsableCell> further;
  for (bool last = false; !last && !ring.empty();) {
    last = static_cast<int>(further.size()) >= options_.k;
    next.clear();
    for (Index cell : ring)
      for (Index v : cells.vertices_of(cell))
        next.insert(next.end(), cells.cells_of(v).begin(), cells.cells_of(v).end());
    std::sort(next.begin(), next.end());
    next.erase(std::unique(next.begin(), next.end()), next.end());
    ring.clear();
    std::set_difference(next.begin(), next.end(), found.begin(), found.end(), std::back_inserter(ring));
    for (Index cell : ring) {
      UsableCell candidate = usable_cell(cells, vertex, cell);
      if (candidate.volume > 0) further.push_back(candidate);
    }
    const auto middle = static_cast<std::ptrdiff_t>(found.size());
    found.insert(found.end(), ring.begin(), ring.end());
    std::inplace_merge(found.begin(), found.begin() + middle, found.end());
  }
  // Cells that tie with the k-th one (lattices) are taken too: neither round-off nor numbering chooses among them.
  double cut = std::numeric_limits<double>::infinity();
  if (options_.k == 0) {
    cut = -1;
  } else if (static_cast<int>(further.size()) > options_.k) {
    std::vector<double> distances;
    for (const UsableCell& cell : further) distances.push_back(cell.offset.squaredNorm());
    std::nth_element(distances.begin(), distances.begin() + (options_.k - 1), distances.end());
    cut = distances[options_.k - 1] * (1 + 2 * distance_tie);
  }
  for (const UsableCell& cell : further)
    if (cell.offset.squaredNorm() <= cut) usable.push_back(cell);
  return consistent_weights(usable, options_.epsilon, vertex);
}

}  // namespace halfgrad
