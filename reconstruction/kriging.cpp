#include "reconstruction/kriging.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include "framework/error.hpp"
#include "reconstruction/kriging_system.hpp"
#include "reconstruction/row_assembly.hpp"
#include "reconstruction/symmetric_eigen.hpp"
#include "reconstruction/vertex_rings.hpp"

namespace halfgrad {

namespace {

// The nearest num_points vertices within some rings.
struct PatchRule {
  int rings;
  int num_points;
};
constexpr int all = std::numeric_limits<int>::max();
using Schedule = std::span<const PatchRule>;

constexpr std::array<PatchRule, 3> wide1 = {{{2, 4}, {3, 6}, {4, 8}}};
constexpr std::array<PatchRule, 4> wide2 = {{{2, 16}, {3, 20}, {3, 28}, {4, 36}}};
constexpr std::array<PatchRule, 4> wide3 = {{{2, 32}, {3, 45}, {3, 60}, {4, 90}}};
constexpr std::array<PatchRule, 4> lean1 = {{{1, all}, {2, 4}, {3, 6}, {4, 8}}};
constexpr std::array<PatchRule, 4> lean2 = {{{1, all}, {2, 12}, {3, 20}, {4, 28}}};
constexpr std::array<PatchRule, 5> lean3 = {{{1, all}, {2, 32}, {3, 45}, {3, 60}, {4, 90}}};
// Of four dimensions, with 14 linear and quadratic and 20 cubic modes: on one ring as many as in three dimensions a
// mode. Not tuned.
constexpr std::array<PatchRule, 3> wide4 = {{{2, 64}, {3, 90}, {4, 130}}};
constexpr std::array<PatchRule, 4> lean4 = {{{1, all}, {2, 64}, {3, 90}, {4, 130}}};
constexpr std::array<PatchRule, 2> cubic4 = {{{3, 160}, {4, 240}}};
constexpr std::array<PatchRule, 3> cubic1 = {{{2, 4}, {3, 6}, {4, 8}}};
constexpr std::array<PatchRule, 3> cubic2 = {{{3, 24}, {4, 32}, {4, 45}}};
constexpr std::array<PatchRule, 3> cubic3 = {{{3, 60}, {4, 90}, {4, 130}}};

Schedule schedule_of(const KrigingOptions& options, int gdim) {
  static constexpr std::array<Schedule, 4> wide = {wide1, wide2, wide3, wide4}, lean = {lean1, lean2, lean3, lean4},
                                           cubic = {cubic1, cubic2, cubic3, cubic4};
  if (options.drift == KrigingDrift::cubic) return cubic[gdim - 1];
  return options.patch == KrigingPatch::lean ? lean[gdim - 1] : wide[gdim - 1];
}

constexpr double accepted_singular_value = 5;
// E2 / √gdim beyond which the squares along every axis are missing: 0.5 on one simplex, 0.42 to 0.44 on the cells of
// one cube or square, 0.35 and less on strips, bars and slabs, which keep the modes along them.
constexpr double missing_modes = 0.4;
// Squared ratio of the longest to the shortest axis of the edge tensor beyond which space is rescaled.
constexpr double stretched = 16;

// Makes rows with its own workspace.
class KrigingRow {
 public:
  KrigingRow(const CellGradients& cells, const KrigingOptions& options)
      : cells_(&cells),
        schedule_(schedule_of(options, cells.gdim())),
        accepted_sum_(options.drift == KrigingDrift::cubic ? 40 : 20),
        rings_(cells),
        system_(cells.gdim(), options.drift == KrigingDrift::cubic ? 3 : 2) {}

  void operator()(Index vertex, StencilRow& row) {
    row.diagnostics.rule = StencilRule::none;
    // Cells without volume hold no points, and what a flat patch makes of the direction across it is rounding.
    const auto has_volume = [&](Index cell) { return cells_->gradient(cell).volume > 0; };
    if (std::ranges::none_of(cells_->cells_of(vertex), has_volume)) return;
    rings_.start(vertex);
    if (!find_metric(vertex)) return;
    const std::size_t last = schedule_.size() - 1;
    const std::size_t first = cells_->on_boundary(vertex) ? std::min<std::size_t>(1, last) : 0;
    bool accepted = false;
    for (std::size_t entry = first; entry <= last && !accepted; ++entry) {
      select(vertex, schedule_[entry]);
      if (entry > first && patch_ == previous_patch_) continue;
      system_.solve(points_, fit_);
      accepted = fit_.smallest_singular_value >= accepted_singular_value && fit_.absolute_sum <= accepted_sum_;
      if (accepted || entry == first || fit_.expected_error < best_.expected_error) {
        std::swap(best_, fit_);
        best_patch_ = patch_;
        best_entry_ = entry;
      }
      previous_patch_ = patch_;
    }
    row.diagnostics.schedule_entry = static_cast<std::uint8_t>(best_entry_);
    row.diagnostics.smallest_singular_value = static_cast<float>(best_.smallest_singular_value);
    row.diagnostics.expected_error = static_cast<float>(best_.expected_error);
    if (best_.quadratic_response > missing_modes * std::sqrt(cells_->gdim())) return fall_back(vertex, row);
    write(vertex, row);
    row.diagnostics.rule =
        !accepted ? StencilRule::damped : (best_entry_ == first ? StencilRule::full_fit : StencilRule::wider_patch);
  }

 private:
  // The local unit of length and the coordinates in which patches are chosen and fitted: y = T (X − X_v). False where
  // the vertex has no neighbour at a distance; those in the same place, but for rounding, tell nothing of lengths.
  bool find_metric(Index vertex) {
    const int gdim = cells_->gdim();
    const auto origin = cells_->vertices().row(vertex);
    const std::span<const Index> near = rings_.within(2);
    distances_.clear();
    double farthest = 0;
    for (Index v : near) {
      distances_.push_back((cells_->vertices().row(v) - origin).squaredNorm());
      farthest = std::max(farthest, distances_.back());
    }
    std::erase_if(distances_, [farthest](double squared) { return !(squared > 1e-24 * farthest); });
    const std::size_t count = std::min<std::size_t>(2 * gdim, distances_.size());
    if (count == 0) return false;
    std::nth_element(distances_.begin(), distances_.begin() + (count - 1), distances_.end());
    // The sum must not depend on the order in which the vertices were found.
    std::sort(distances_.begin(), distances_.begin() + count);
    scale_ = 0;
    for (std::size_t k = 0; k < count; ++k) scale_ += std::sqrt(distances_[k]) / static_cast<double>(count);
    if (!(scale_ > 0)) return false;
    metric_ = SmallMatrix::Identity(gdim, gdim) / scale_;
    // The mean of e eᵀ over all pairs of vertices of the adjacent cells: their edges, on simplices.
    SmallMatrix tensor = SmallMatrix::Zero(gdim, gdim);
    double num_pairs = 0;
    for (Index cell : cells_->cells_of(vertex)) {
      const std::span<const Index> nodes = cells_->vertices_of(cell);
      for (std::size_t i = 0; i < nodes.size(); ++i)
        for (std::size_t j = 0; j < i; ++j, ++num_pairs) {
          const Vector edge =
              (cells_->vertices().row(nodes[i]) - cells_->vertices().row(nodes[j])).transpose() / scale_;
          tensor += edge * edge.transpose();
        }
    }
    const SymmetricEigen eigen = symmetric_eigen(tensor * (gdim / num_pairs));
    const double longest = eigen.values[gdim - 1];
    if (longest > stretched * eigen.values[0])
      metric_ = eigen.vectors * eigen.values.cwiseMax(1e-12 * longest).cwiseSqrt().cwiseInverse().asDiagonal() *
                eigen.vectors.transpose() / scale_;
    return true;
  }

  // Fills patch_ (ascending) and points_ with the nearest vertices of the rings. Where the distance of the last one
  // ties with further ones, as on lattices, all of them are taken, so that numbering plays no part.
  void select(Index vertex, const PatchRule& rule) {
    const auto origin = cells_->vertices().row(vertex);
    candidates_.clear();
    for (Index v : rings_.within(rule.rings)) {
      const Vector y = metric_ * (cells_->vertices().row(v) - origin).transpose();
      candidates_.push_back({y.squaredNorm(), v});
    }
    patch_.clear();
    double cut = std::numeric_limits<double>::infinity();
    if (static_cast<std::size_t>(rule.num_points) < candidates_.size()) {
      std::nth_element(candidates_.begin(), candidates_.begin() + (rule.num_points - 1), candidates_.end());
      cut = candidates_[rule.num_points - 1].first * (1 + 2 * distance_tie);
    }
    for (const auto& [squared_distance, v] : candidates_)
      if (squared_distance <= cut) patch_.push_back(v);
    std::sort(patch_.begin(), patch_.end());
    points_.resize(cells_->gdim(), static_cast<Eigen::Index>(patch_.size()));
    for (std::size_t j = 0; j < patch_.size(); ++j)
      points_.col(static_cast<Eigen::Index>(j)) = metric_ * (cells_->vertices().row(patch_[j]) - origin).transpose();
  }

  // The volume-weighted mean of the gradients of the cells within two rings. Where modes are missing these are as a
  // rule all cells of a part of the mesh: its vertices then agree, and no curvature is made up that no value tells.
  void fall_back(Index vertex, StencilRow& row) {
    std::vector<Index> cells(cells_->cells_of(vertex).begin(), cells_->cells_of(vertex).end());
    for (Index v : rings_.within(2)) cells.insert(cells.end(), cells_->cells_of(v).begin(), cells_->cells_of(v).end());
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    std::vector<double> weights;
    for (Index cell : cells) weights.push_back(cells_->gradient(cell).volume);
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    for (double& weight : weights) weight /= sum;
    compose_row(*cells_, vertex, cells, weights, row);
    const Eigen::Index gdim = cells_->gdim(), count = static_cast<Eigen::Index>(row.neighbors.size());
    const Eigen::Map<const Eigen::MatrixXd> stencil(row.weights.data(), gdim, count);
    row.diagnostics.absolute_sum = static_cast<float>(stencil.colwise().norm().sum() * scale_);
    row.diagnostics.rule = StencilRule::cell_value;
    row.diagnostics.num_points = static_cast<Index>(count);
    row.hessian_weights.assign(best_.hessian.rows() * count, 0.0);
  }

  // Back from the metric: ∂/∂X = T ∂/∂y. Its rounding, times its condition, is taken out of the linear constraint.
  void write(Index vertex, StencilRow& row) {
    const int gdim = cells_->gdim();
    const Eigen::Index count = best_.gradient.cols(), symmetric = best_.hessian.rows();
    row.neighbors = best_patch_;
    row.diagnostics.num_points = static_cast<Index>(count);
    row.diagnostics.absolute_sum = static_cast<float>(best_.absolute_sum);
    row.weights.resize(best_.gradient.size());
    row.hessian_weights.resize(best_.hessian.size());
    Eigen::Map<Eigen::MatrixXd> gradient(row.weights.data(), gdim, count),
        hessians(row.hessian_weights.data(), symmetric, count);
    gradient.noalias() = metric_ * best_.gradient;
    for (Eigen::Index j = 0; j < count && symmetric > 0; ++j) {
      SmallMatrix hessian(gdim, gdim);
      for (int a = 0, s = 0; a < gdim; ++a)
        for (int b = a; b < gdim; ++b, ++s) hessian(a, b) = hessian(b, a) = best_.hessian(s, j);
      hessian = (metric_ * hessian * metric_).eval();
      for (int a = 0, s = 0; a < gdim; ++a)
        for (int b = a; b < gdim; ++b, ++s) hessians(s, j) = hessian(a, b);
    }
    points_.resize(gdim, count);
    for (Eigen::Index j = 0; j < count; ++j)
      points_.col(j) = (cells_->vertices().row(best_patch_[j]) - cells_->vertices().row(vertex)).transpose();
    restore_affine(points_, gradient, hessians);
  }

  const CellGradients* cells_;
  Schedule schedule_;
  double accepted_sum_;
  VertexRings rings_;
  KrigingSystem system_;
  double scale_ = 0;
  SmallMatrix metric_;
  std::vector<double> distances_;
  std::vector<std::pair<double, Index>> candidates_;
  std::vector<Index> patch_, previous_patch_, best_patch_;
  Eigen::MatrixXd points_;
  KrigingFit fit_, best_;
  std::size_t best_entry_ = 0;
};

}  // namespace

Kriging::Kriging(const KrigingOptions& options) : options_(options) {
  if (options.drift == KrigingDrift::cubic && options.patch == KrigingPatch::lean)
    raise(
        "kriging: \"patch\": \"lean\" with \"drift\": \"cubic\": the cubic drift has one patch schedule; leave out "
        "\"patch\"");
}

Reconstruction Kriging::reconstruct(const CellGradients& cells, std::span<const Index> vertices) const {
  Reconstruction result;
  result.stencils = assemble_rows_with_workers(cells.gdim(), vertices, [&]() -> RowMaker {
    // A std::function copies what it holds; the workspace stays in place.
    return
        [row = std::make_shared<KrigingRow>(cells, options_)](Index vertex, StencilRow& out) { (*row)(vertex, out); };
  });
  return result;
}

}  // namespace halfgrad
