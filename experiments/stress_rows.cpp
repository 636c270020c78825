#include "experiments/stress_rows.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "reconstruction/cell_averages.hpp"
#include "reconstruction/registry.hpp"
#include "reconstruction/vertex_rings.hpp"

namespace halfgrad {

namespace {

using nlohmann::json;

StressReconstructor made(const json& specification) {
  StressReconstructor result;
  MadeReconstructor from = make_reconstructor(specification);
  result.name =
      specification.is_string() ? from.name : from.name + " " + specification.begin()->begin()->get<std::string>();
  result.reconstructor = std::move(from.reconstructor);
  const auto with_nugget = [&](double num_points, double nugget) {
    // The covariance of differences has entries of at most 4, and at least the nugget for eigenvalues: this bounds the
    // condition of the matrix. The constraint is met once more by itself, as well as rounding lets a sum.
    result.forward_condition = 4 * num_points / nugget;
    result.residual_condition = 1;
  };
  if (from.name == "kriging" || from.name == "adaptive") {
    const bool cubic = result.name == "kriging cubic";
    with_nugget(cubic ? 130 : 90, cubic ? 1e-6 : 1e-5);
    if (from.name == "kriging") result.accepted_sum = cubic ? 40 : 20;
  } else if (from.name == "ppr") {
    // Two pseudo-inverses in a row, each of singular values down to 1e-3 of the largest.
    result.residual_condition = 1e6;
    result.forward_condition = 1e12;
  } else if (from.name == "spr") {
    // ε |A| |A⁺|² is how A⁺ rounds, and weights may be as small as 1 / |A|.
    result.residual_condition = 1e3;
    result.forward_condition = 1e6;
  }
  result.grids_only = from.name == "centered_difference";
  result.blended_in = result.name == "chandrashekar_garg" || result.name == "kriging" || result.name == "kriging lean";
  result.is_mean =
      from.name == "unweighted_average" || from.name == "volume_average" || from.name == "inverse_distance";
  return result;
}

}  // namespace

const std::vector<StressReconstructor>& stress_reconstructors() {
  static const std::vector<StressReconstructor> all = [] {
    std::vector<StressReconstructor> list;
    for (const ReconstructorEntry& entry : reconstructor_registry()) {
      list.push_back(made(std::string(entry.name)));
      if (entry.name != "kriging") continue;
      list.push_back(made({{"kriging", {{"patch", "lean"}}}}));
      list.push_back(made({{"kriging", {{"drift", "cubic"}}}}));
    }
    return list;
  }();
  return all;
}

namespace {

// The cells that a row falls back on, by volume: ppr takes the adjacent ones, kriging those within two rings.
CellWeights fallback_weights(const StressReconstructor& made, const CellGradients& cells, VertexRings& rings,
                             Index vertex) {
  if (made.name == "ppr") return VolumeAverage().weights(cells, vertex);
  std::set<Index> found(cells.cells_of(vertex).begin(), cells.cells_of(vertex).end());
  rings.start(vertex);
  for (const Index v : rings.within(2)) found.insert(cells.cells_of(v).begin(), cells.cells_of(v).end());
  CellWeights result;
  double sum = 0;
  for (const Index cell : found) {
    result.cells.push_back(cell);
    result.weights.push_back(cells.gradient(cell).volume);
    sum += result.weights.back();
  }
  for (double& weight : result.weights) weight /= sum;
  return result;
}

}  // namespace

std::vector<double> weight_magnitudes(const StressReconstructor& made, const CellGradients& cells,
                                      const GradientStencilTable& table) {
  std::vector<double> result(table.weights.size());
  std::transform(table.weights.begin(), table.weights.end(), result.begin(), [](double w) { return std::abs(w); });
  const auto* average = dynamic_cast<const CellAverage*>(made.reconstructor.get());
  VertexRings rings(cells);
  for (Index r = 0; r < table.num_rows(); ++r) {
    const bool fallen_back = table.diagnostics[r].rule == StencilRule::cell_value;
    if (average == nullptr && !fallen_back) continue;
    const CellWeights weights = average != nullptr ? average->weights(cells, table.vertices[r])
                                                   : fallback_weights(made, cells, rings, table.vertices[r]);
    const auto begin = table.neighbors.begin() + table.offsets[r], end = table.neighbors.begin() + table.offsets[r + 1];
    std::fill(result.begin() + table.offsets[r] * table.gdim, result.begin() + table.offsets[r + 1] * table.gdim, 0.0);
    for (std::size_t k = 0; k < weights.cells.size(); ++k) {
      const CellGradient gradient = cells.gradient(weights.cells[k]);
      const std::span<const Index> nodes = cells.vertices_of(weights.cells[k]);
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        const auto entry = std::find(begin, end, nodes[i]);
        if (entry == end) continue;
        for (int a = 0; a < table.gdim; ++a)
          result[(entry - table.neighbors.begin()) * table.gdim + a] +=
              std::abs(weights.weights[k]) * gradient.weights.col(a).cwiseAbs().sum();
      }
    }
  }
  return result;
}

}  // namespace halfgrad
