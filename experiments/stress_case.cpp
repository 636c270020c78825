#include "experiments/stress_case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "experiments/stress_mesh.hpp"
#include "experiments/stress_runner.hpp"
#include "framework/error.hpp"

namespace halfgrad {

namespace stress {

std::array<long double, max_gdim> CaseRunner::vertex_position(Index vertex) const {
  std::array<long double, max_gdim> position{};
  for (int a = 0; a < mesh_.gdim(); ++a)
    position[a] = static_cast<long double>(mesh_.vertices()(vertex, a)) - mesh_.vertices()(origin_, a);
  return position;
}

std::array<long double, max_gdim> CaseRunner::point_position(Index point) const {
  const ReferenceWeights& weights = weights_[point];
  std::array<long double, max_gdim> position = vertex_position(weights.vertices[0]);
  for (int a = 0; a < mesh_.gdim(); ++a)
    for (int i = 1; i < weights.num_nodes; ++i) position[a] += weights.beta[i].value * weights.rest[i][a].value;
  return position;
}

void CaseRunner::measure_cells() {
  for (Index c = 0; c < mesh_.num_cells(); ++c) {
    with_cell(mesh_, c, [&]<Element E>(const ElementBlock<E>&, Eigen::Index) { all_simplices_ &= E::affine; });
    if (!usable_[c]) continue;
    const CellGradient gradient = cells_->gradient(c);
    const std::span<const Index> nodes = cells_->vertices_of(c);
    double longest = 0, steepest = 0;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      longest = std::max(longest, (mesh_.vertices().row(nodes[i]) - mesh_.vertices().row(nodes[0])).norm());
      steepest = std::max(steepest, gradient.weights.row(static_cast<Eigen::Index>(i)).norm());
    }
    aspect_ = std::max(aspect_, longest * steepest);
    steepest_cell_ = std::max(steepest_cell_, steepest);
  }
}

// Values around the size of the mesh, where deformed positions are, or far from it: float has to hold them.
void CaseRunner::make_values() {
  const int gdim = mesh_.gdim();
  for (const char usable : usable_) {
    if (usable) break;
    ++origin_;
  }
  origin_ = mesh_.cell_vertices(std::min(origin_, mesh_.num_cells() - 1))[0];
  const double unit = size_ * std::pow(10, random_.uniform(-3, 3));
  const Index count = mesh_.num_vertices();
  noise_.values.resize(count, columns);
  for (Index v = 0; v < count; ++v)
    for (int c = 0; c < columns; ++c) noise_.values(v, c) = static_cast<float>(unit * random_.uniform(-1, 1));
  // A constant far beyond the values' own size takes digits from them, and no more than those.
  if (random_.uniform() < 0.2) noise_.values.array() += static_cast<float>(unit * 1000 * random_.uniform(-1, 1));
  noise_.values = noise_.values.cast<float>().cast<double>();

  slope_.resize(columns, gdim);
  shift_.resize(columns);
  waves_.resize(columns);
  affine_.values.resize(count, columns);
  smooth_.values.resize(count, columns);
  affine_.rounding.assign(count, 0.0);
  smooth_.rounding.assign(count, 0.0);
  for (int c = 0; c < columns; ++c) {
    for (int a = 0; a < gdim; ++a) slope_(c, a) = static_cast<float>(unit / size_ * random_.uniform(-1, 1));
    shift_[c] = static_cast<float>(unit * random_.uniform(-1, 1));
    Wave& wave = waves_[c];
    wave.amplitude = unit;
    wave.phase = random_.uniform(0, 6);
    wave.number.resize(gdim);
    for (int a = 0; a < gdim; ++a) wave.number[a] = random_.uniform(-2, 2) / size_;
  }
  for (Index v = 0; v < count; ++v) {
    const auto position = vertex_position(v);
    double distance = 0;
    for (int a = 0; a < gdim; ++a) distance += static_cast<double>(std::abs(position[a]));
    for (int c = 0; c < columns; ++c) {
      affine_.values(v, c) = static_cast<double>(affine_value(position, c));
      smooth_.values(v, c) = static_cast<double>(waves_[c].at(position));
    }
    affine_.rounding[v] = unit / size_ * distance + unit;
    smooth_.rounding[v] = unit * (2 + 2 * distance / size_);
  }
}

void CaseRunner::prepare_points() {
  const Embedding& embedding = points_.embedding;
  for (Index p = 0; p < embedding.num_points(); ++p)
    weights_.push_back(reference_weights(mesh_, embedding, p, points_.outside(p)));
  for (const NamedRule& rule : named_rules()) {
    coefficients_.emplace_back();
    for (const ReferenceWeights& weights : weights_)
      coefficients_.back().push_back(reference_coefficients(rule.rule, weights, mesh_.gdim()));
  }
}

// The documented residuals of embed(): docs/locating.md.
void CaseRunner::check_located() {
  const Embedding& embedding = points_.embedding;
  const double tolerance = EmbedOptions().tolerance, epsilon = std::numeric_limits<double>::epsilon();
  for (Index p = points_.num_placed; p < embedding.num_points(); ++p) {
    const ReferenceWeights& weights = weights_[p];
    const auto position = points_.positions.row(p - points_.num_placed);
    const PointStatus status = embedding.status[p];
    for (int a = 0; a < mesh_.gdim(); ++a) {
      const long double wanted = static_cast<long double>(position[a]) - mesh_.vertices()(weights.vertices[0], a);
      Measured found;
      long double low = 0, high = 0;
      for (int i = 0; i < weights.num_nodes; ++i) {
        found = found + weights.beta[i] * Measured(weights.rest[i][a].value);
        low = std::min(low, weights.rest[i][a].value);
        high = std::max(high, weights.rest[i][a].value);
      }
      long double bound =
          1e-12L * std::max(high - low, std::abs(wanted)) + steps_of_a_point * epsilon * found.magnitude;
      if (status == PointStatus::boundary) bound += tolerance * size_;
      record(StressProperty::located, ratio_of(std::abs(found.value - wanted), bound),
             fmt::format("residual along axis {}, status {}", a, static_cast<int>(status)));
    }
    if (!points_.in_cell[p - points_.num_placed]) continue;
    const OutsidePoint* outside = points_.outside(p);
    const double rounding = 8 * epsilon * (position.cwiseAbs().maxCoeff() + size_);
    record(StressProperty::located, outside == nullptr ? 0 : ratio_of(outside->distance, tolerance * size_ + rounding),
           "a position inside a cell");
  }
}

// What the gradients of a blend are computed from: those of the averages and kriging at the vertex and at its
// neighbours, and difference quotients along the edges, taken together by a damped inverse that is at most ten times
// the dimension over their number.
void CaseRunner::bound_blend(Rows& rows) const {
  const int gdim = mesh_.gdim();
  const double factor = 10 * gdim;
  const auto bound = [&](ReferenceGradients Rows::*set, const ReferenceValues& values) {
    ReferenceGradients& gradients = rows.*set;
    for (Index v = 0; v < mesh_.num_vertices(); ++v)
      for (std::size_t k = 0; k < gradients.gradient[v].size(); ++k) {
        long double most = 0;
        for (const Index cell : cells_->cells_of(v))
          for (const Index neighbor : cells_->vertices_of(cell)) {
            for (const Rows& other : rows_)
              if (other.made->blended_in) most = std::max(most, (other.*set).gradient[neighbor][k].magnitude);
            const double length = (mesh_.vertices().row(neighbor) - mesh_.vertices().row(v)).norm();
            if (length > 0)
              most = std::max(most, 2 * difference(values, neighbor, v, static_cast<int>(k) / gdim).magnitude / length);
          }
        gradients.gradient[v][k].magnitude = factor * most;
      }
  };
  bound(&Rows::noise, noise_);
  bound(&Rows::affine, affine_);
}

Rows CaseRunner::make_rows(const StressReconstructor& made) {
  Rows rows;
  rows.made = &made;
  std::vector<Index> vertices(mesh_.num_vertices());
  std::iota(vertices.begin(), vertices.end(), 0);
  // A blend is made for the vertices that hold points and no others.
  if (made.name == "adaptive") vertices = active_vertices(mesh_, points_.embedding);
  rows.reconstruction = made.reconstructor->reconstruct(*cells_, vertices);
  const GradientStencilTable& table = rows.reconstruction.stencils;
  rows.magnitudes = weight_magnitudes(made, *cells_, table);
  const auto measure = [&](const GradientStencilTable& of) {
    for (Index r = 0; r < of.num_rows(); ++r)
      rows.longest = std::max(rows.longest, static_cast<double>(of.offsets[r + 1] - of.offsets[r]));
    for (const std::vector<double>* list : {&of.weights, &of.hessian_weights})
      for (const double weight : *list)
        rows.steepest = std::isfinite(weight) ? std::max(rows.steepest, std::abs(weight)) : infinity;
  };
  measure(table);
  if (rows.blended()) {
    measure(rows.reconstruction.blend->averaging);
    measure(rows.reconstruction.blend->beyond);
  }
  rows.noise = reference_gradients(table, {}, noise_);
  rows.affine = reference_gradients(table, rows.magnitudes, affine_);
  if (rows.blended())
    bound_blend(rows);
  else
    rows.smooth = reference_gradients(table, rows.magnitudes, smooth_);
  return rows;
}

void CaseRunner::check_rows(const Rows& rows) {
  const int gdim = mesh_.gdim();
  const StressReconstructor& made = *rows.made;
  const double epsilon = std::numeric_limits<double>::epsilon();
  const GradientStencilTable& table = rows.reconstruction.stencils;
  for (Index r = 0; r < table.num_rows(); ++r) {
    const Index v = table.vertices[r];
    if (!serves(v)) continue;
    long double residual = 0, magnitude = 1;
    for (int a = 0; a < gdim; ++a)
      for (int b = 0; b < gdim; ++b) {
        Measured sum(a == b ? -1 : 0);
        for (Offset e = table.offsets[r]; e < table.offsets[r + 1]; ++e) {
          const long double edge =
              static_cast<long double>(mesh_.vertices()(table.neighbors[e], a)) - mesh_.vertices()(v, a);
          sum = sum + Measured(edge) * Measured(table.weights[e * gdim + b], rows.magnitudes[e * gdim + b]);
        }
        residual = std::isnan(sum.value) ? sum.value : std::max(residual, std::abs(sum.value));
        magnitude += sum.magnitude;
      }
    const double steps = steps_of_a_point + static_cast<double>(table.offsets[r + 1] - table.offsets[r]);
    record(StressProperty::affine_rows, ratio_of(residual, steps * epsilon * made.residual_condition * magnitude),
           fmt::format("{}, vertex {}", made.name, v));
  }

  for (Index r = 0; r < table.num_rows(); ++r) {
    const StencilDiagnostics& row = table.diagnostics[r];
    if (made.accepted_sum > 0) {
      const bool accepted = row.rule == StencilRule::full_fit || row.rule == StencilRule::wider_patch;
      if (accepted)
        record(StressProperty::steepness, row.absolute_sum / made.accepted_sum, made.name);
      else if (row.rule == StencilRule::damped && serves(table.vertices[r]))
        result_.damped_norm.add(row.absolute_sum, result_.seed, made.name);
    }
    if (!made.is_mean) continue;
    double steepest = 0, sum = 0;
    for (const Index cell : cells_->cells_of(table.vertices[r]))
      steepest = std::max(steepest, cells_->gradient(cell).weights.rowwise().norm().sum());
    for (Offset e = table.offsets[r]; e < table.offsets[r + 1]; ++e)
      sum += Eigen::Map<const Eigen::VectorXd>(table.weights.data() + e * gdim, gdim).norm();
    record(StressProperty::steepness, ratio_of(sum, steepest * (1 + 1e-12)), made.name);
  }
}

void CaseRunner::run() {
  size_ = (mesh_.vertices().colwise().maxCoeff() - mesh_.vertices().colwise().minCoeff()).norm();
  if (std::none_of(usable_.begin(), usable_.end(), [](char usable) { return usable != 0; })) {
    result_.refused = true;
    try {
      make_stress_points(mesh_, usable_, random_);
    } catch (const Error&) {
      record(StressProperty::served, 0, "no cell with volume");
      return;
    }
    record(StressProperty::served, infinity, "no cell with volume: no error");
    return;
  }
  cells_ = std::make_unique<CellGradients>(mesh_);
  points_ = make_stress_points(mesh_, usable_, random_);
  result_.num_points = points_.embedding.num_points();
  measure_cells();
  make_values();
  prepare_points();
  check_located();
  check_rules(nullptr);
  for (const StressReconstructor& made : stress_reconstructors()) {
    try {
      rows_.push_back(make_rows(made));
    } catch (const Error& error) {
      // Grids are what centered_difference is for: it says so.
      record(StressProperty::served, made.grids_only ? 0 : infinity, fmt::format("{}: {}", made.name, error.what()));
      continue;
    }
    record(StressProperty::served, 0, made.name);
    check_rows(rows_.back());
    check_rules(&rows_.back());
  }
  check_transformed();
}

}  // namespace stress

std::span<const StressPropertyEntry> stress_properties() {
  static constexpr std::array<StressPropertyEntry, num_stress_properties> entries = {{
      {"served", "no exception but halfgrad::Error where no cell has volume or centered_difference meets no grid"},
      {"finite", "finite values give finite results, where the condition is below the greatest number of the type"},
      {"located", "weights reproduce the position: 1e-12 of the cell's extent, 1e-9 of the mesh's at its boundary"},
      {"affine_rows", "sum (X_j - X_v) g_vj = I within N eps c sum |X_j - X_v| |g_vj| at vertices of usable cells"},
      {"affine", "affine values are reproduced within N eps c M"},
      {"interpolation", "the value at a vertex is the vertex's within N eps M"},
      {"continuity", "two cells give one value on their shared facet within N eps (M + M')"},
      {"constants", "equal values at all vertices are kept bit for bit"},
      {"matrix", "matrix() times values is evaluate() within N eps times the sum of absolute products"},
      {"reference", "both paths agree with long double within N eps M"},
      {"paths", "the fast path agrees with the plain formulas within 2 N eps M"},
      {"precisions", "float agrees with double within 2 N eps(float) M"},
      {"tolerance", "skipped corrections move points by no more than the tolerance"},
      {"steepness", "accepted kriging rows have h sum |g| <= 20 (cubic 40); means are no steeper than their cells"},
      {"smooth", "the error is at most half the greatest second derivative times sum |S_j| |X_j - X|^2"},
      {"bad_vertex", "NaN or infinity at a vertex changes no bit of points whose cells and stencils do not read it"},
      {"renumbered", "another numbering changes nothing beyond N eps c' M"},
      {"turned", "turned axes change nothing beyond N eps c' M"},
      {"scaled", "a power of two as scale changes nothing beyond N eps c' M"},
  }};
  return entries;
}

void StressTally::add(double ratio, std::uint64_t of_seed, const std::string& place) {
  ++checks;
  if (checks > 1 && !(ratio > worst)) return;
  worst = ratio;
  seed = of_seed;
  where = place;
}

StressCase run_stress_case(std::string_view element, std::uint64_t seed) {
  StressCase result;
  result.element = element;
  result.seed = seed;
  const StressMesh made = make_stress_mesh(element, seed);
  result.recipe = made.recipe;
  result.num_vertices = made.mesh.num_vertices();
  result.num_cells = made.mesh.num_cells();
  RandomStream random(seed, 200);
  try {
    stress::CaseRunner(result, made.mesh, random).run();
  } catch (const std::exception& error) {
    result.tallies[static_cast<std::size_t>(StressProperty::served)].add(stress::infinity, seed, error.what());
  }
  for (std::size_t p = 0; p < num_stress_properties; ++p) {
    const StressTally& tally = result.tallies[p];
    if (tally.worst > 1 || std::isnan(tally.worst))
      result.failures.push_back(
          {result.element, seed, static_cast<StressProperty>(p), tally.worst, tally.where, made.recipe});
  }
  return result;
}

}  // namespace halfgrad
