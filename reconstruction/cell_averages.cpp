#include "reconstruction/cell_averages.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "framework/error.hpp"
#include "reconstruction/row_assembly.hpp"
#include "reconstruction/symmetric_eigen.hpp"
#include "reconstruction/vertex_rings.hpp"

namespace halfgrad {

namespace {

bool on_vertex(const Vector& offset) { return !(offset.squaredNorm() > 0); }

// Weights by inverse distance. Far from the origin rounding may put a centroid onto the vertex: in the limit the
// weights of all other cells are then zero.
void weigh_by_distance(CellStar& star) {
  const bool any_on_vertex = std::any_of(star.offsets.begin(), star.offsets.end(), on_vertex);
  star.weights.clear();
  for (const Vector& offset : star.offsets)
    star.weights.push_back(!any_on_vertex ? 1 / offset.norm() : on_vertex(offset) ? 1.0 : 0.0);
}

// James 2020, Eq. 24–27 over the cells of a star in D dimensions.
template <int D>
void weigh_consistently(double epsilon, Index vertex, CellStar& star) {
  using Direction = Eigen::Matrix<double, D, 1>;
  using Square = Eigen::Matrix<double, D, D>;
  // Roots and quotients apart, several at a time: they take longer than all else.
  star.weights.clear();
  for (const Vector& offset : star.offsets) star.weights.push_back(offset.template head<D>().squaredNorm());
  Eigen::Map<Eigen::ArrayXd> closenesses(star.weights.data(), static_cast<Eigen::Index>(star.weights.size()));
  if (!(closenesses > 0).all()) return weigh_by_distance(star);
  closenesses = closenesses.sqrt().inverse();
  // As numbers and a full square: parts of Eigen's vectors would go through memory for every cell.
  double moments[D][D] = {}, sums[D] = {};
  for (int a = 0; a < D; ++a) moments[a][a] = epsilon;
  for (std::size_t k = 0; k < star.weights.size(); ++k) {
    double direction[D];
    for (int a = 0; a < D; ++a) direction[a] = star.offsets[k][a] * star.weights[k];
    for (int a = 0; a < D; ++a) {
      for (int b = 0; b < D; ++b) moments[a][b] += direction[a] * direction[b];
      sums[a] += direction[a];
    }
  }
  const Square normal = Eigen::Map<const Square>(moments[0]);
  // The trace of the inverse is between one and D times that of the least eigenvalue.
  const Square inverse = normal.inverse();
  const double least = 1 / inverse.trace();
  if (!(least > 1e-12 * static_cast<double>(star.cells.size())))
    raise(
        "chandrashekar_garg: the weights of vertex {} are not determined with epsilon {} (least eigenvalue {:.3g}): "
        "use epsilon > 0",
        vertex, epsilon, symmetric_eigen(normal).values[0]);
  const Direction lambda = -(inverse * Eigen::Map<const Direction>(sums));
  double total = 0, magnitude = 0;
  for (std::size_t k = 0; k < star.weights.size(); ++k) {
    const double closeness = star.weights[k];
    star.weights[k] = (1 + lambda.dot(star.offsets[k].template head<D>()) * closeness) * closeness;
    total += star.weights[k];
    magnitude += std::abs(star.weights[k]) + closeness;
  }
  // On flat one-sided stars small ε drives all weights to zero and the quotient to 0/0.
  if (std::abs(total) > 1e-10 * magnitude) return;
  if (epsilon == 0)
    raise("chandrashekar_garg: the weights of vertex {} sum to zero with epsilon 0: use epsilon > 0", vertex);
  weigh_by_distance(star);
}

void weigh_consistently(int gdim, double epsilon, Index vertex, CellStar& star) {
  static_assert(max_gdim == 4);
  if (star.cells.empty()) return;
  if (gdim == 1) return weigh_consistently<1>(epsilon, vertex, star);
  if (gdim == 2) return weigh_consistently<2>(epsilon, vertex, star);
  if (gdim == 3) return weigh_consistently<3>(epsilon, vertex, star);
  weigh_consistently<4>(epsilon, vertex, star);
}

}  // namespace

void CellStar::clear() {
  cells.clear();
  offsets.clear();
  weights.clear();
  places_.clear();
  if (known_.size() < max_known) return;
  known_.clear();
  known_places_.clear();
}

Index CellStar::learn(Index cell) {
  const auto place = static_cast<Index>(known_.size());
  const CellGradient gradient = geometry_->gradient(cell);
  known_.push_back(gradient.volume);
  known_.insert(known_.end(), gradient.centroid.begin(), gradient.centroid.end());
  known_.insert(known_.end(), gradient.weights.data(), gradient.weights.data() + gradient.weights.size());
  return place;
}

void CellStar::add(Index vertex, std::span<const Index> more) {
  const Eigen::Index gdim = geometry_->gdim();
  const double* position = geometry_->vertices().data() + vertex * gdim;
  for (const Index cell : more) {
    Index& place = known_places_.of(cell);
    if (place < 0) place = learn(cell);
    const double volume = known_[place], *const centroid = &known_[place] + 1;
    if (!(volume > 0)) continue;
    cells.push_back(cell);
    places_.push_back(place);
    Vector& offset = offsets.emplace_back(gdim);
    for (Eigen::Index a = 0; a < gdim; ++a) offset[a] = centroid[a] - position[a];
  }
}

std::span<const double* const> CellStar::gradients() {
  gradients_.clear();
  for (const Index place : places_) gradients_.push_back(&known_[place] + 1 + geometry_->gdim());
  return gradients_;
}

void CellAverage::normalised_star(const CellGradients& cells, Index vertex, CellStar& star) const {
  star.clear();
  weigh(cells, vertex, star);
  const double sum = std::accumulate(star.weights.begin(), star.weights.end(), 0.0);
  for (double& weight : star.weights) weight /= sum;
}

CellWeights CellAverage::weights(const CellGradients& cells, Index vertex) const {
  CellStar star(cells);
  normalised_star(cells, vertex, star);
  return {std::move(star.cells), std::move(star.weights)};
}

Reconstruction CellAverage::reconstruct(const CellGradients& cells, std::span<const Index> vertices) const {
  Reconstruction result;
  result.stencils = assemble_rows_with_workers(cells.gdim(), vertices, [&]() -> RowMaker {
    return [this, &cells, star = CellStar(cells), composer = RowComposer()](Index vertex, StencilRow& row) mutable {
      normalised_star(cells, vertex, star);
      composer.compose(cells, vertex, star.cells, star.gradients(), star.weights, row);
      row.diagnostics.rule = star.cells.empty() ? StencilRule::none : StencilRule::average;
      row.diagnostics.num_points = static_cast<Index>(star.cells.size());
    };
  });
  return result;
}

void UnweightedAverage::weigh(const CellGradients& cells, Index vertex, CellStar& star) const {
  star.add(vertex, cells.cells_of(vertex));
  star.weights.assign(star.cells.size(), 1.0);
}

void InverseDistance::weigh(const CellGradients& cells, Index vertex, CellStar& star) const {
  star.add(vertex, cells.cells_of(vertex));
  weigh_by_distance(star);
}

void VolumeAverage::weigh(const CellGradients& cells, Index vertex, CellStar& star) const {
  star.add(vertex, cells.cells_of(vertex));
  for (std::size_t k = 0; k < star.cells.size(); ++k) star.weights.push_back(star.volume(k));
}

ChandrashekarGarg::ChandrashekarGarg(const ChandrashekarGargOptions& options) : options_(options) {
  if (!(options.epsilon >= 0)) raise("chandrashekar_garg: epsilon {}: expected a number >= 0", options.epsilon);
}

void ChandrashekarGarg::weigh(const CellGradients& cells, Index vertex, CellStar& star) const {
  star.add(vertex, cells.cells_of(vertex));
  weigh_consistently(cells.gdim(), options_.epsilon, vertex, star);
}

Knn::Knn(const KnnOptions& options) : options_(options) {
  if (options.k < 0) raise("knn: k {}: expected a whole number >= 0", options.k);
  if (!(options.epsilon >= 0)) raise("knn: epsilon {}: expected a number >= 0", options.epsilon);
}

void Knn::weigh(const CellGradients& cells, Index vertex, CellStar& star) const {
  star.add(vertex, cells.cells_of(vertex));
  // Rings of cells that share a vertex, so that the choice never jumps a gap of the mesh: grown until they hold k
  // further cells, then once more, so that a near cell of the next ring is not missed.
  const std::span<const Index> adjacent = cells.cells_of(vertex);
  std::vector<Index> found(adjacent.begin(), adjacent.end()), ring = found, next;
  CellStar further(cells);
  for (bool last = false; !last && !ring.empty();) {
    last = static_cast<int>(further.cells.size()) >= options_.k;
    next.clear();
    for (Index cell : ring)
      for (Index v : cells.vertices_of(cell))
        next.insert(next.end(), cells.cells_of(v).begin(), cells.cells_of(v).end());
    std::sort(next.begin(), next.end());
    next.erase(std::unique(next.begin(), next.end()), next.end());
    ring.clear();
    std::set_difference(next.begin(), next.end(), found.begin(), found.end(), std::back_inserter(ring));
    further.add(vertex, ring);
    const auto middle = static_cast<std::ptrdiff_t>(found.size());
    found.insert(found.end(), ring.begin(), ring.end());
    std::inplace_merge(found.begin(), found.begin() + middle, found.end());
  }
  // Cells that tie with the k-th one (lattices) are taken too: neither round-off nor numbering chooses among them.
  double cut = std::numeric_limits<double>::infinity();
  if (options_.k == 0) {
    cut = -1;
  } else if (static_cast<int>(further.cells.size()) > options_.k) {
    std::vector<double> distances;
    for (const Vector& offset : further.offsets) distances.push_back(offset.squaredNorm());
    std::nth_element(distances.begin(), distances.begin() + (options_.k - 1), distances.end());
    cut = distances[options_.k - 1] * (1 + 2 * distance_tie);
  }
  for (std::size_t i = 0; i < further.cells.size(); ++i)
    if (further.offsets[i].squaredNorm() <= cut) star.add(vertex, {&further.cells[i], 1});
  weigh_consistently(cells.gdim(), options_.epsilon, vertex, star);
}

}  // namespace halfgrad
