#include "experiments/stress_case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "experiments/random.hpp"
#include "experiments/stress_mesh.hpp"
#include "experiments/stress_points.hpp"
#include "experiments/stress_reference.hpp"
#include "experiments/stress_rows.hpp"
#include "framework/error.hpp"
#include "framework/interpolant.hpp"

namespace halfgrad {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int columns = 3;

// Every chain of operations is as long as its row and a few steps a node.
constexpr double steps_of_a_point = 64;

double ratio_of(long double error, long double bound) {
  if (error == 0) return 0;
  if (!(bound > 0) || std::isnan(error)) return infinity;
  return static_cast<double>(error / bound);
}

// A smooth field with a bound on its second derivatives: a wave a column.
struct Wave {
  Vector number;
  double amplitude = 0, phase = 0;

  long double at(const std::array<long double, max_gdim>& position) const {
    long double angle = phase;
    for (Eigen::Index a = 0; a < number.size(); ++a) angle += number[a] * position[a];
    return amplitude * std::sin(angle);
  }
  double second_derivative() const { return amplitude * number.squaredNorm(); }
};

// Rows of one reconstructor and what they make of the three sets of values.
struct Rows {
  const StressReconstructor* made = nullptr;
  Reconstruction reconstruction;
  std::vector<double> magnitudes, blended_magnitudes;
  ReferenceGradients noise, affine, smooth;
  double longest = 0;   // entries of a row
  double steepest = 0;  // greatest weight

  bool blended() const { return reconstruction.blend.has_value(); }
};

class CaseRunner {
 public:
  CaseRunner(StressCase& result, const Mesh& mesh, RandomStream& random)
      : result_(result), mesh_(mesh), random_(random), usable_(usable_cells(mesh)) {}

  void run();

 private:
  void record(StressProperty property, double ratio, const std::string& place) {
    result_.tallies[static_cast<std::size_t>(property)].add(ratio, result_.seed, place);
  }
  void make_values();
  void measure_cells();
  void prepare_points();
  void check_located();
  void check_rows(const Rows& rows);
  Rows make_rows(const StressReconstructor& made);
  // Where magnitudes are empty those of the weights count.
  ReferenceGradients gradients_of(const Rows& rows, const ReferenceValues& values,
                                  const std::vector<double>& magnitudes,
                                  const std::vector<double>& blended_magnitudes) const;
  void check_rules(const Rows* rows);
  template <class Scalar>
  void check_rule(std::size_t rule, const Rows* rows);
  template <class Scalar>
  void check_bad_vertex(const Interpolant<Scalar>& interpolant, const Rows* rows, const Values<Scalar>& values,
                        const Values<Scalar>& before, const std::string& place);
  template <class Scalar>
  bool fits(const Rows& rows, const InterpolationRule& rule) const;
  void check_smooth(std::size_t rule, const Rows* rows, const Interpolant<double>& interpolant,
                    const std::string& place);
  void check_matrix(std::size_t rule, const Interpolant<double>& interpolant, const Rows* rows,
                    const Values<double>& found, const std::vector<std::array<Measured, columns>>& reference,
                    const std::string& place);
  void check_transformed();
  // Σ_j |S_pj| weight(j), from the sums of the rule's parts before they meet in S.
  template <class Weight>
  long double absolute_sum(std::size_t rule, const Rows* rows, Index point, Weight&& weight) const;

  // Σ of the absolute values of all parts of the entries of a row of S.
  long double magnitude_sum(std::size_t rule, const Rows* rows, Index point) const;

  // Position of a vertex or a placed point relative to the origin of the values.
  std::array<long double, max_gdim> vertex_position(Index vertex) const;
  std::array<long double, max_gdim> point_position(Index point) const;
  long double affine_value(const std::array<long double, max_gdim>& position, int column) const {
    long double value = shift_[column];
    for (int a = 0; a < mesh_.gdim(); ++a) value += slope_(column, a) * position[a];
    return value;
  }

  StressCase& result_;
  const Mesh& mesh_;
  RandomStream& random_;
  std::vector<char> usable_;
  std::unique_ptr<CellGradients> cells_;
  StressPoints points_;
  std::vector<ReferenceWeights> weights_;
  std::vector<std::vector<ReferenceCoefficients>> coefficients_;  // [rule][point]
  std::vector<Rows> rows_;
  Index origin_ = 0;
  double size_ = 0;    // of the mesh, a length
  double aspect_ = 1;  // greatest |e||g| of a usable cell
  bool all_simplices_ = true;
  Eigen::MatrixXd slope_;  // of the affine values, columns × gdim
  Eigen::VectorXd shift_;
  std::vector<Wave> waves_;
  ReferenceValues noise_, affine_, smooth_;
  Values<double> linear_smooth_;  // what linear interpolation makes of smooth_
};

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
    for (int i = 1; i < weights.num_nodes; ++i) position[a] += weights.beta[i].value * weights.rest[i][a];
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
        found = found + weights.beta[i] * Measured(weights.rest[i][a]);
        low = std::min(low, weights.rest[i][a]);
        high = std::max(high, weights.rest[i][a]);
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

ReferenceGradients CaseRunner::gradients_of(const Rows& rows, const ReferenceValues& values,
                                            const std::vector<double>& magnitudes,
                                            const std::vector<double>& blended_magnitudes) const {
  ReferenceGradients result = reference_gradients(rows.reconstruction.stencils, magnitudes, values);
  if (!rows.blended()) return result;
  const ReferenceGradients other =
      reference_gradients(rows.reconstruction.blend->averaging, blended_magnitudes, values);
  for (std::size_t v = 0; v < result.gradient.size(); ++v)
    for (std::size_t k = 0; k < result.gradient[v].size(); ++k)
      result.gradient[v][k].magnitude += other.gradient[v][k].magnitude;
  return result;
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
    const GradientStencilTable& averaging = rows.reconstruction.blend->averaging;
    const auto& all = stress_reconstructors();
    const auto paper =
        std::find_if(all.begin(), all.end(), [](const auto& other) { return other.name == "chandrashekar_garg"; });
    rows.blended_magnitudes = weight_magnitudes(*paper, *cells_, averaging);
    measure(averaging);
  }
  rows.noise = gradients_of(rows, noise_, {}, {});
  rows.affine = gradients_of(rows, affine_, rows.magnitudes, rows.blended_magnitudes);
  rows.smooth = gradients_of(rows, smooth_, rows.magnitudes, rows.blended_magnitudes);
  return rows;
}

void CaseRunner::check_rows(const Rows& rows) {
  const int gdim = mesh_.gdim();
  const StressReconstructor& made = *rows.made;
  const double epsilon = std::numeric_limits<double>::epsilon();
  const auto check_affine = [&](const GradientStencilTable& table, const std::vector<double>& magnitudes,
                                const std::string& name) {
    for (Index r = 0; r < table.num_rows(); ++r) {
      const Index v = table.vertices[r];
      const std::span<const Index> adjacent = cells_->cells_of(v);
      if (std::none_of(adjacent.begin(), adjacent.end(), [&](Index c) { return usable_[c] != 0; })) continue;
      long double residual = 0, magnitude = 1;
      for (int a = 0; a < gdim; ++a)
        for (int b = 0; b < gdim; ++b) {
          Measured sum(a == b ? -1 : 0);
          for (Offset e = table.offsets[r]; e < table.offsets[r + 1]; ++e) {
            const long double edge =
                static_cast<long double>(mesh_.vertices()(table.neighbors[e], a)) - mesh_.vertices()(v, a);
            sum = sum + Measured(edge) * Measured(table.weights[e * gdim + b], magnitudes[e * gdim + b]);
          }
          residual = std::isnan(sum.value) ? sum.value : std::max(residual, std::abs(sum.value));
          magnitude += sum.magnitude;
        }
      const double steps = steps_of_a_point + static_cast<double>(table.offsets[r + 1] - table.offsets[r]);
      record(StressProperty::affine_rows, ratio_of(residual, steps * epsilon * made.residual_condition * magnitude),
             fmt::format("{}, vertex {}", name, v));
    }
  };
  check_affine(rows.reconstruction.stencils, rows.magnitudes, made.name);
  if (rows.blended())
    check_affine(rows.reconstruction.blend->averaging, rows.blended_magnitudes, made.name + " averaging");

  const GradientStencilTable& table = rows.reconstruction.stencils;
  for (Index r = 0; r < table.num_rows(); ++r) {
    const StencilDiagnostics& row = table.diagnostics[r];
    if (made.accepted_sum > 0) {
      const bool accepted = row.rule == StencilRule::full_fit || row.rule == StencilRule::wider_patch;
      if (accepted)
        record(StressProperty::steepness, row.absolute_sum / made.accepted_sum, made.name);
      else if (row.rule == StencilRule::damped)
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

template <class Scalar>
bool CaseRunner::fits(const Rows& rows, const InterpolationRule& rule) const {
  // What a row multiplies must be numbers of the type with room for sums: lengths, and their squares with Hessians.
  const double most = std::sqrt(static_cast<double>(std::numeric_limits<Scalar>::max())) * 1e17;
  const double length = rule.needs_hessians() ? size_ * size_ : size_;
  const double tiny = static_cast<double>(std::numeric_limits<Scalar>::min()) * 1e3;
  return rows.steepest < most && length < most && length > tiny;
}

template <class Scalar>
void CaseRunner::check_bad_vertex(const Interpolant<Scalar>& interpolant, const Rows* rows,
                                  const Values<Scalar>& values, const Values<Scalar>& before,
                                  const std::string& place) {
  const Index bad =
      interpolant
          .active()[static_cast<std::size_t>(random_.uniform(0, static_cast<double>(interpolant.active().size())))];
  Values<Scalar> spoilt = values;
  spoilt.row(bad).setConstant(random_.uniform() < 0.5 ? std::numeric_limits<Scalar>::quiet_NaN()
                                                      : std::numeric_limits<Scalar>::infinity());
  // The vertices whose gradients read it.
  std::vector<char> reads(mesh_.num_vertices(), 0);
  if (rows != nullptr && interpolant.rule().needs_gradients()) {
    const auto mark = [&](const GradientStencilTable& table) {
      for (Index r = 0; r < table.num_rows(); ++r) {
        const auto begin = table.neighbors.begin() + table.offsets[r],
                   end = table.neighbors.begin() + table.offsets[r + 1];
        if (table.vertices[r] == bad || std::find(begin, end, bad) != end) reads[table.vertices[r]] = 1;
      }
    };
    mark(rows->reconstruction.stencils);
    if (rows->blended()) {
      const AdaptiveBlend& blend = *rows->reconstruction.blend;
      mark(blend.averaging);
      const std::vector<char> own = reads;
      for (Index r = 0; r < blend.num_blended; ++r)
        for (Offset e = blend.edge_offsets[r]; e < blend.edge_offsets[r + 1]; ++e)
          if (own[blend.averaging.vertices[blend.edge_rows[e]]]) reads[blend.averaging.vertices[r]] = 1;
    }
  }
  const Values<Scalar> after = interpolant.evaluate(spoilt);
  for (Index p = 0; p < after.rows(); ++p) {
    const ReferenceWeights& weights = weights_[p];
    bool touched = false;
    for (int i = 0; i < weights.num_nodes; ++i)
      touched |= weights.vertices[i] == bad || reads[weights.vertices[i]] != 0;
    if (touched) continue;
    record(StressProperty::bad_vertex, after.row(p) == before.row(p) ? 0 : infinity, place);
  }
}

long double CaseRunner::magnitude_sum(std::size_t rule, const Rows* rows, Index point) const {
  const ReferenceWeights& weights = weights_[point];
  const ReferenceCoefficients& coefficients = coefficients_[rule][point];
  const int gdim = mesh_.gdim(), sym = num_symmetric(gdim);
  long double sum = 1;
  for (int i = 0; i < weights.num_nodes; ++i) {
    sum += coefficients.a[i].magnitude;
    if (rows == nullptr) continue;
    const GradientStencilTable& table = rows->reconstruction.stencils;
    const auto r =
        std::find(table.vertices.begin(), table.vertices.end(), weights.vertices[i]) - table.vertices.begin();
    for (Offset e = table.offsets[r]; e < table.offsets[r + 1]; ++e) {
      for (int k = 0; k < gdim; ++k) sum += 2 * coefficients.c[i][k].magnitude * std::abs(table.weights[e * gdim + k]);
      for (int k = 0; k < sym && table.has_hessians(); ++k)
        sum += 2 * coefficients.q[i][k].magnitude * std::abs(table.hessian_weights[e * sym + k]);
    }
  }
  return sum;
}

template <class Weight>
long double CaseRunner::absolute_sum(std::size_t rule, const Rows* rows, Index point, Weight&& weight) const {
  const ReferenceWeights& weights = weights_[point];
  const ReferenceCoefficients& coefficients = coefficients_[rule][point];
  const int gdim = mesh_.gdim(), sym = num_symmetric(gdim);
  const bool with_gradients = rows != nullptr && named_rules()[rule].rule.needs_gradients();
  const bool with_hessians = named_rules()[rule].rule.needs_hessians();
  long double sum = 0;
  for (int i = 0; i < weights.num_nodes; ++i) {
    const Index v = weights.vertices[i];
    sum += std::abs(coefficients.a[i].value) * weight(v);
    if (!with_gradients) continue;
    const auto add = [&](const GradientStencilTable& table) {
      const auto r = std::find(table.vertices.begin(), table.vertices.end(), v) - table.vertices.begin();
      for (Offset e = table.offsets[r]; e < table.offsets[r + 1]; ++e) {
        long double entry = 0;
        for (int k = 0; k < gdim; ++k) entry += coefficients.c[i][k].value * table.weights[e * gdim + k];
        for (int k = 0; k < sym && with_hessians; ++k)
          entry += coefficients.q[i][k].value * table.hessian_weights[e * sym + k];
        sum += std::abs(entry) * (weight(table.neighbors[e]) + weight(v));
      }
    };
    add(rows->reconstruction.stencils);
    // A blend lies between two gradients: the sum of both bounds bounds it.
    if (rows->blended()) add(rows->reconstruction.blend->averaging);
  }
  return sum;
}

void CaseRunner::check_smooth(std::size_t rule, const Rows* rows, const Interpolant<double>& interpolant,
                              const std::string& place) {
  const Values<double> found = interpolant.evaluate(smooth_.values);
  if (rows == nullptr) linear_smooth_ = found;
  const ReferenceGradients none;
  const double epsilon = std::numeric_limits<double>::epsilon();
  const double condition = rows != nullptr ? rows->made->residual_condition : 1;
  const double steps = steps_of_a_point + (rows != nullptr ? rows->longest : 0);
  double error_of_rule = 0, error_of_linear = 0, rounding_of_rule = 0;
  for (Index p = 0; p < found.rows(); ++p) {
    const auto position = point_position(p);
    const long double moment = absolute_sum(rule, rows, p, [&](Index vertex) {
      const auto at = vertex_position(vertex);
      long double squared = 0;
      for (int a = 0; a < mesh_.gdim(); ++a) squared += (at[a] - position[a]) * (at[a] - position[a]);
      return squared;
    });
    for (int c = 0; c < columns; ++c) {
      const Measured reference = reference_value(named_rules()[rule].rule, weights_[p], coefficients_[rule][p],
                                                 rows != nullptr ? rows->smooth : none, smooth_, mesh_.gdim(), c);
      const long double truth = waves_[c].at(position), error = std::abs(found(p, c) - truth);
      const long double rounding = steps * epsilon * condition * (reference.magnitude + std::abs(truth));
      record(StressProperty::smooth, ratio_of(error, moment * waves_[c].second_derivative() / 2 + rounding), place);
      if (points_.embedding.status[p] != PointStatus::inside) continue;
      error_of_rule = std::max(error_of_rule, static_cast<double>(error));
      error_of_linear = std::max(error_of_linear, std::abs(static_cast<double>(linear_smooth_(p, c) - truth)));
      rounding_of_rule = std::max(rounding_of_rule, static_cast<double>(rounding));
    }
  }
  if (rows != nullptr && rows->made->accepted_sum > 0 && error_of_linear > 100 * rounding_of_rule)
    result_.linear_ratio.add(error_of_rule / error_of_linear, result_.seed, place);
}

void CaseRunner::check_matrix(std::size_t rule, const Interpolant<double>& interpolant, const Rows* rows,
                              const Values<double>& found, const std::vector<std::array<Measured, columns>>& reference,
                              const std::string& place) {
  const auto matrix = interpolant.matrix();
  const Values<double> product = matrix * noise_.values;
  const double epsilon = std::numeric_limits<double>::epsilon();
  const double steps = 2 * (steps_of_a_point + (rows != nullptr ? rows->longest : 0));
  // The parts of an entry are products of the measured coefficients with weights: their magnitude over their value.
  for (Index p = 0; p < matrix.rows(); ++p) {
    long double sum = -1;
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(matrix, p); entry; ++entry)
      sum += entry.value();
    const long double parts = magnitude_sum(rule, rows, p);
    record(StressProperty::matrix, ratio_of(std::abs(sum), steps * epsilon * parts), place + ", row sum");
    for (int c = 0; c < columns; ++c) {
      // The matrix multiplies values, not differences: their own size counts in each entry.
      const long double of_values = parts * noise_.values.col(c).cwiseAbs().maxCoeff();
      record(StressProperty::matrix,
             ratio_of(std::abs(product(p, c) - found(p, c)), steps * epsilon * (reference[p][c].magnitude + of_values)),
             place + ", S x");
    }
  }
}

template <class Scalar>
void CaseRunner::check_rule(std::size_t rule_number, const Rows* rows) {
  const NamedRule& named = named_rules()[rule_number];
  const InterpolationRule& rule = named.rule;
  constexpr bool is_double = std::is_same_v<Scalar, double>;
  const std::string place = fmt::format("{}, {}, {}", named.name, rows != nullptr ? rows->made->name : "none",
                                        is_double ? "double" : "float");
  if (rows != nullptr && !fits<Scalar>(*rows, rule)) return;
  const Interpolant<Scalar> interpolant(mesh_, points_.embedding, rule,
                                        rows != nullptr ? &rows->reconstruction : nullptr);
  const double epsilon = std::numeric_limits<Scalar>::epsilon(), least = std::numeric_limits<Scalar>::min();
  const double steps = steps_of_a_point + (rows != nullptr ? rows->longest : 0);
  const double condition = rows != nullptr ? rows->made->residual_condition : 1;
  const Values<Scalar> values = noise_.values.cast<Scalar>();
  const Values<Scalar> found = interpolant.evaluate(values);
  const Values<Scalar> plain = interpolant.evaluate(values, {.tolerance = 0, .kernel = Kernel::plain});
  const Index num_points = interpolant.num_points();
  const ReferenceGradients none;

  // The blend's own gradients stand for the reference's: that they lie between the two tables' is checked here.
  ReferenceGradients noise_gradients = rows != nullptr ? rows->noise : none;
  if (rows != nullptr && rows->blended()) {
    const ReferenceGradients averaging = reference_gradients(rows->reconstruction.blend->averaging, {}, noise_);
    const Values<Scalar> blended = interpolant.vertex_gradients(values);
    for (std::size_t r = 0; r < interpolant.active().size(); ++r) {
      const Index v = interpolant.active()[r];
      for (std::size_t k = 0; k < noise_gradients.gradient[v].size(); ++k) {
        Measured& entry = noise_gradients.gradient[v][k];
        const long double low = std::min(entry.value, averaging.gradient[v][k].value),
                          high = std::max(entry.value, averaging.gradient[v][k].value),
                          value = blended(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(k));
        const long double beyond = std::isnan(value) ? value : std::max({low - value, value - high, 0.0L});
        record(StressProperty::reference, ratio_of(beyond, steps * epsilon * entry.magnitude + least),
               place + ", blend");
        entry.value = value;
      }
    }
  }

  std::vector<std::array<Measured, columns>> reference(num_points);
  for (Index p = 0; p < num_points; ++p)
    for (int c = 0; c < columns; ++c) {
      const Measured value =
          reference_value(rule, weights_[p], coefficients_[rule_number][p], noise_gradients, noise_, mesh_.gdim(), c);
      reference[p][c] = value;
      // Beyond the greatest number of the type nothing is promised.
      if (!(value.magnitude < std::numeric_limits<Scalar>::max() / 1000)) continue;
      const bool finite = std::isfinite(found(p, c)) && std::isfinite(plain(p, c));
      record(StressProperty::finite, finite ? 0 : infinity, place);
      const long double bound = steps * (epsilon * value.magnitude + least);
      record(StressProperty::reference, ratio_of(std::abs(found(p, c) - value.value), bound), place + ", fast");
      record(StressProperty::reference, ratio_of(std::abs(plain(p, c) - value.value), bound), place + ", plain");
      record(StressProperty::paths, ratio_of(std::abs(found(p, c) - plain(p, c)), 2 * bound), place);
      const Index vertex = p < points_.num_placed ? points_.vertex[p] : -1;
      if (vertex >= 0)
        record(StressProperty::interpolation, ratio_of(std::abs(found(p, c) - values(vertex, c)), bound), place);
    }
  for (const auto& [a, b] : points_.shared)
    for (int c = 0; c < columns; ++c) {
      const long double magnitude = reference[a][c].magnitude + reference[b][c].magnitude;
      if (!(magnitude < std::numeric_limits<Scalar>::max() / 1000)) continue;
      record(StressProperty::continuity,
             ratio_of(std::abs(static_cast<long double>(found(a, c)) - found(b, c)),
                      steps * (epsilon * magnitude + least)),
             place);
    }

  const Values<Scalar> affine = interpolant.evaluate(affine_.values.cast<Scalar>());
  for (Index p = 0; p < num_points; ++p) {
    const auto position = point_position(p);
    for (int c = 0; c < columns; ++c) {
      const Measured value = reference_value(rule, weights_[p], coefficients_[rule_number][p],
                                             rows != nullptr ? rows->affine : none, affine_, mesh_.gdim(), c);
      if (!(value.magnitude < std::numeric_limits<Scalar>::max() / 1000)) continue;
      // The rows' own rounding is double's, whatever the frame's.
      const double solved = std::max(epsilon, condition * std::numeric_limits<double>::epsilon());
      record(StressProperty::affine,
             ratio_of(std::abs(affine(p, c) - affine_value(position, c)), steps * (solved * value.magnitude + least)),
             place);
    }
  }

  Values<Scalar> constant(mesh_.num_vertices(), columns);
  constant.rowwise() = values.row(mesh_.num_vertices() / 2);
  const Values<Scalar> kept = interpolant.evaluate(constant);
  for (Index p = 0; p < num_points; ++p)
    record(StressProperty::constants, kept.row(p) == constant.row(0) ? 0 : infinity, place);

  check_bad_vertex(interpolant, rows, values, found, place);
  if (rule.formula == Formula::blend && rule.needs_gradients()) {
    const double tolerance = std::pow(10, random_.uniform(-4, 0)) * noise_.values.cwiseAbs().maxCoeff();
    const Values<Scalar> rough = interpolant.evaluate(values, {.tolerance = tolerance, .kernel = Kernel::fast});
    for (Index p = 0; p < num_points; ++p) {
      if (points_.embedding.status[p] != PointStatus::inside) continue;
      long double squared = 0, magnitude = 0;
      for (int c = 0; c < columns; ++c) {
        squared += std::pow(static_cast<long double>(rough(p, c)) - found(p, c), 2);
        magnitude += reference[p][c].magnitude;
      }
      if (!(magnitude < std::sqrt(std::numeric_limits<Scalar>::max()))) continue;
      record(StressProperty::tolerance, ratio_of(std::sqrt(squared), tolerance + steps * (epsilon * magnitude + least)),
             place);
    }
  }
  if constexpr (is_double) {
    check_smooth(rule_number, rows, interpolant, place);
    if (rows == nullptr || !rows->blended()) check_matrix(rule_number, interpolant, rows, found, reference, place);
    // The same frame in float: each is as near to the reference as its type allows, so are they to each other.
    if (rows != nullptr && !fits<float>(*rows, rule)) return;
    if (rows != nullptr && rows->blended()) return;  // two frames of different precision may blend differently
    const Values<float> single =
        Interpolant<float>(mesh_, points_.embedding, rule, rows != nullptr ? &rows->reconstruction : nullptr)
            .evaluate(noise_.values.cast<float>());
    for (Index p = 0; p < num_points; ++p)
      for (int c = 0; c < columns; ++c) {
        if (!(reference[p][c].magnitude < std::numeric_limits<float>::max() / 1000)) continue;
        const long double bound =
            2 * steps *
            (std::numeric_limits<float>::epsilon() * reference[p][c].magnitude + std::numeric_limits<float>::min());
        record(StressProperty::precisions, ratio_of(std::abs(found(p, c) - single(p, c)), bound), place);
      }
  }
}

void CaseRunner::check_rules(const Rows* rows) {
  for (std::size_t r = 0; r < named_rules().size(); ++r) {
    const InterpolationRule& rule = named_rules()[r].rule;
    if (rule.needs_gradients() != (rows != nullptr)) continue;
    if (rule.formula == Formula::quadratic10 && !all_simplices_) continue;
    if (rule.needs_hessians() && (rows->blended() || !rows->reconstruction.stencils.has_hessians())) continue;
    check_rule<double>(r, rows);
    check_rule<float>(r, rows);
  }
}

// A case is renumbered, turned by a permutation of the axes with signs, or scaled by a power of two: each leaves every
// coordinate exact, so that results differ by the order of roundings alone.
void CaseRunner::check_transformed() {
  const int gdim = mesh_.gdim();
  const int choice = static_cast<int>(random_.uniform(0, 3));
  Points vertices = mesh_.vertices();
  std::vector<Index> number(mesh_.num_vertices()), cell_number(mesh_.num_cells());
  std::iota(number.begin(), number.end(), 0);
  std::iota(cell_number.begin(), cell_number.end(), 0);
  std::vector<AnyBlock> blocks = mesh_.blocks();
  StressProperty property = StressProperty::scaled;
  if (choice == 0) {
    property = StressProperty::renumbered;
    std::reverse(number.begin(), number.end());
    for (std::size_t v = number.size(); v > 1; --v)
      std::swap(number[v - 1], number[static_cast<std::size_t>(random_.uniform(0, static_cast<double>(v)))]);
    for (Index v = 0; v < mesh_.num_vertices(); ++v) vertices.row(number[v]) = mesh_.vertices().row(v);
    for (std::size_t b = 0; b < blocks.size(); ++b)
      std::visit(
          [&](auto& block) {
            block.cells = block.cells.unaryExpr([&](Index v) { return number[v]; }).colwise().reverse().eval();
            const Index first = mesh_.first_cell(b), last = mesh_.first_cell(b + 1) - 1;
            for (Index c = first; c <= last; ++c) cell_number[c] = first + last - c;
          },
          blocks[b]);
  } else if (choice == 1) {
    property = StressProperty::turned;
    const int shift = static_cast<int>(random_.uniform(0, gdim));
    for (int a = 0; a < gdim; ++a)
      vertices.col((a + shift) % gdim) = (random_.uniform() < 0.5 ? -1 : 1) * mesh_.vertices().col(a);
  } else {
    vertices *= std::exp2(std::floor(random_.uniform(-60, 60)));
  }
  const Mesh moved(std::move(vertices), std::move(blocks));
  Embedding embedding = points_.embedding;
  for (Index& cell : embedding.cells) cell = cell_number[cell];
  Values<double> values(noise_.values.rows(), columns);
  for (Index v = 0; v < mesh_.num_vertices(); ++v) values.row(number[v]) = noise_.values.row(v);

  const CellGradients moved_cells(moved);
  std::vector<Index> vertices_of_moved(moved.num_vertices());
  std::iota(vertices_of_moved.begin(), vertices_of_moved.end(), 0);
  const double epsilon = std::numeric_limits<double>::epsilon();
  for (const Rows& rows : rows_) {
    if (rows.blended()) continue;  // its tables are those of two others; the blend depends on their roundings
    const StressReconstructor& made = *rows.made;
    // Cells turn with a rounding of their own, and a metric is rounded to the square of the cells' aspect.
    const double condition = made.forward_condition * (made.accepted_sum > 0 ? aspect_ * aspect_
                                                       : choice == 1         ? aspect_
                                                                             : 1);
    if (!((steps_of_a_point + rows.longest) * epsilon * condition < 1e-3)) continue;
    // Where vertices coincide a grid has two neighbours in one place, and numbering chooses.
    if (made.grids_only && choice == 0) continue;
    const Reconstruction again = made.reconstructor->reconstruct(moved_cells, vertices_of_moved);
    const ReferenceGradients gradients = gradients_of(rows, noise_, rows.magnitudes, rows.blended_magnitudes);
    for (std::size_t r = 0; r < named_rules().size(); ++r) {
      const InterpolationRule& rule = named_rules()[r].rule;
      if (!rule.needs_gradients() || rule.formula == Formula::quadratic10) continue;
      if (rule.needs_hessians() && !rows.reconstruction.stencils.has_hessians()) continue;
      const Values<double> before =
          Interpolant<double>(mesh_, points_.embedding, rule, &rows.reconstruction).evaluate(noise_.values);
      const Values<double> after = Interpolant<double>(moved, embedding, rule, &again).evaluate(values);
      for (Index p = 0; p < before.rows(); ++p)
        for (int c = 0; c < columns; ++c) {
          const Measured value = reference_value(rule, weights_[p], coefficients_[r][p], gradients, noise_, gdim, c);
          record(property,
                 ratio_of(std::abs(after(p, c) - before(p, c)),
                          2 * (steps_of_a_point + rows.longest) * epsilon * condition * value.magnitude),
                 fmt::format("{}, {}", named_rules()[r].name, made.name));
        }
    }
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

}  // namespace

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
      {"reference", "both paths agree with long double within N eps M; blends lie between their gradients"},
      {"paths", "the fast path agrees with the plain formulas within 2 N eps M"},
      {"precisions", "float agrees with double within 2 N eps(float) M"},
      {"tolerance", "skipped corrections move points by no more than the tolerance"},
      {"steepness", "accepted kriging rows have h sum |g| <= 20 (cubic 40); means are no steeper than their cells"},
      {"smooth", "the error is at most half the greatest second derivative times sum |S_j| |X_j - X|^2"},
      {"bad_vertex", "NaN or infinity at a vertex changes no bit of points whose cells and stencils do not read it"},
      {"renumbered", "another numbering changes nothing beyond N eps c' M"},
      {"turned", "axes permuted and reversed change nothing beyond N eps c' M"},
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
    CaseRunner(result, made.mesh, random).run();
  } catch (const std::exception& error) {
    result.tallies[static_cast<std::size_t>(StressProperty::served)].add(infinity, seed, error.what());
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
