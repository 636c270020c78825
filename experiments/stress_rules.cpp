// What one rule with one reconstructor promises.
#include <fmt/format.h>

#include <algorithm>

#include "experiments/stress_runner.hpp"

namespace halfgrad::stress {

template <class Scalar>
bool CaseRunner::fits(const Rows& rows, const InterpolationRule& rule) const {
  // What a row multiplies must be numbers of the type with room for sums: lengths, and their squares with Hessians.
  const double most = std::sqrt(static_cast<double>(std::numeric_limits<Scalar>::max())) * 1e17;
  const double length = rule.needs_hessians() ? size_ * size_ : size_;
  const double tiny = static_cast<double>(std::numeric_limits<Scalar>::min()) * 1e3;
  return rows.steepest < most && length < most && length > tiny;
}

template <class Scalar>
bool CaseRunner::holds(std::size_t rule, Index point) const {
  const ReferenceCoefficients& coefficients = coefficients_[rule][point];
  const long double most = std::numeric_limits<Scalar>::max() / 1000;
  for (int i = 0; i < weights_[point].num_nodes; ++i) {
    bool fits = coefficients.a[i].magnitude < most;
    for (const Measured& c : coefficients.c[i]) fits &= c.magnitude < most;
    for (const Measured& q : coefficients.q[i]) fits &= q.magnitude < most;
    if (!fits) return false;
  }
  return true;
}

template <class Scalar>
bool CaseRunner::holds(std::size_t rule, Index point, const Measured& value, const ReferenceGradients& gradients,
                       int column) const {
  const long double most = std::numeric_limits<Scalar>::max() / 1000;
  if (!(value.magnitude < most) || !holds<Scalar>(rule, point)) return false;
  const ReferenceWeights& weights = weights_[point];
  const int gdim = mesh_.gdim(), sym = num_symmetric(gdim);
  long double sum = 0;
  for (int i = 0; i < weights.num_nodes && !gradients.gradient.empty(); ++i) {
    std::array<long double, max_gdim> extent{};
    for (int j = 0; j < weights.num_nodes; ++j)
      for (int k = 0; k < gdim; ++k)
        extent[k] = std::max(extent[k], std::abs(weights.rest[j][k].value - weights.rest[i][k].value));
    const Index v = weights.vertices[i];
    for (int k = 0; k < gdim; ++k) sum += gradients.gradient[v][column * gdim + k].magnitude * extent[k];
    if (!named_rules()[rule].rule.needs_hessians()) continue;
    for (int k = 0, entry = column * sym; k < gdim; ++k)
      for (int l = k; l < gdim; ++l, ++entry) sum += gradients.hessian[v][entry].magnitude * extent[k] * extent[l];
  }
  return sum < most;
}

template <class Scalar>
long double CaseRunner::rounding(Index point, const Measured& value, const ReferenceGradients& gradients,
                                 int column) const {
  const ReferenceWeights& weights = weights_[point];
  const int gdim = mesh_.gdim(), sym = num_symmetric(gdim);
  long double multiplied = 0, spread = 0;
  for (int i = 0; i < weights.num_nodes; ++i) spread += weights.beta[i].magnitude;
  for (int i = 0; i < weights.num_nodes && !gradients.gradient.empty(); ++i) {
    const Index v = weights.vertices[i];
    for (int k = 0; k < gdim; ++k) multiplied += gradients.gradient[v][column * gdim + k].magnitude;
    for (int k = 0; k < sym && !gradients.hessian.empty(); ++k)
      multiplied += gradients.hessian[v][column * sym + k].magnitude;
  }
  return std::numeric_limits<Scalar>::epsilon() * value.magnitude + std::numeric_limits<Scalar>::min() +
         std::numeric_limits<Scalar>::denorm_min() * multiplied * spread * spread * spread;
}

template <class Scalar>
void CaseRunner::check_bad_vertex(std::size_t rule, const Interpolant<Scalar>& interpolant, const Rows* rows,
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
    if (rows->blended()) {  // what it blends is tested at the neighbours too
      for (const Rows& other : rows_)
        if (other.made->blended_in) mark(other.reconstruction.stencils);
      const std::vector<char> own = reads;
      for (Index c = 0; c < mesh_.num_cells(); ++c) {
        const std::span<const Index> nodes = cells_->vertices_of(c);
        if (std::any_of(nodes.begin(), nodes.end(), [&](Index v) { return own[v] != 0; }))
          for (const Index v : nodes) reads[v] = 1;
      }
    }
  }
  const Values<Scalar> after = interpolant.evaluate(spoilt);
  for (Index p = 0; p < after.rows(); ++p) {
    const ReferenceWeights& weights = weights_[p];
    bool touched = false;
    for (int i = 0; i < weights.num_nodes; ++i)
      touched |= weights.vertices[i] == bad || reads[weights.vertices[i]] != 0;
    // Where the type's numbers end is the subject of `finite`.
    if (touched || !holds<Scalar>(rule, p) || !before.row(p).allFinite()) continue;
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
  // Blended vertex models are no better than linear however good the gradients.
  const bool competes = named_rules()[rule].rule.alpha == 0.5;
  if (rows != nullptr && competes && rows->made->accepted_sum > 0 && error_of_linear > 100 * rounding_of_rule)
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

  // A blend depends on the data: its gradients are taken as they are, and the points from there.
  ReferenceGradients noise_gradients = rows != nullptr ? rows->noise : none;
  if (rows != nullptr && rows->blended()) {
    const Values<Scalar> blended = interpolant.vertex_gradients(values);
    for (std::size_t r = 0; r < interpolant.active().size(); ++r) {
      std::vector<Measured>& gradient = noise_gradients.gradient[interpolant.active()[r]];
      for (std::size_t k = 0; k < gradient.size(); ++k)
        gradient[k].value = blended(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(k));
    }
  }

  std::vector<std::array<Measured, columns>> reference(num_points);
  for (Index p = 0; p < num_points; ++p)
    for (int c = 0; c < columns; ++c) {
      const Measured value =
          reference_value(rule, weights_[p], coefficients_[rule_number][p], noise_gradients, noise_, mesh_.gdim(), c);
      reference[p][c] = value;
      // Beyond the greatest number of the type nothing is promised.
      if (!holds<Scalar>(rule_number, p, value, noise_gradients, c)) continue;
      const bool finite = std::isfinite(found(p, c)) && std::isfinite(plain(p, c));
      record(StressProperty::finite, finite ? 0 : infinity, place);
      const long double bound = steps * rounding<Scalar>(p, value, noise_gradients, c);
      record(StressProperty::reference, ratio_of(std::abs(found(p, c) - value.value), bound), place + ", fast");
      // The weight of a blend is as well conditioned as the mismatches that decide it: each path rounds its own.
      if (rows == nullptr || !rows->blended()) {
        record(StressProperty::reference, ratio_of(std::abs(plain(p, c) - value.value), bound), place + ", plain");
        record(StressProperty::paths, ratio_of(std::abs(found(p, c) - plain(p, c)), 2 * bound), place);
      }
      const Index vertex = p < points_.num_placed ? points_.vertex[p] : -1;
      if (vertex >= 0)
        record(StressProperty::interpolation, ratio_of(std::abs(found(p, c) - values(vertex, c)), bound), place);
    }
  for (const auto& [a, b] : points_.shared)
    for (int c = 0; c < columns; ++c) {
      bool held = true;
      long double bound = 0;
      for (const Index p : {a, b}) {
        held &= holds<Scalar>(rule_number, p, reference[p][c], noise_gradients, c);
        bound += steps * rounding<Scalar>(p, reference[p][c], noise_gradients, c);
      }
      if (!held) continue;
      record(StressProperty::continuity, ratio_of(std::abs(static_cast<long double>(found(a, c)) - found(b, c)), bound),
             place);
    }

  const ReferenceGradients& affine_gradients = rows != nullptr ? rows->affine : none;
  const Values<Scalar> affine = interpolant.evaluate(affine_.values.cast<Scalar>());
  for (Index p = 0; p < num_points; ++p) {
    const auto position = point_position(p);
    for (int c = 0; c < columns; ++c) {
      const Measured value =
          reference_value(rule, weights_[p], coefficients_[rule_number][p], affine_gradients, affine_, mesh_.gdim(), c);
      if (!holds<Scalar>(rule_number, p, value, affine_gradients, c)) continue;
      // The rows' own rounding is double's, whatever the frame's.
      const double solved = condition * std::numeric_limits<double>::epsilon();
      const long double bound =
          std::max(rounding<Scalar>(p, value, affine_gradients, c), solved * value.magnitude + least);
      record(StressProperty::affine, ratio_of(std::abs(affine(p, c) - affine_value(position, c)), steps * bound),
             place);
    }
  }

  Values<Scalar> constant(mesh_.num_vertices(), columns);
  constant.rowwise() = values.row(mesh_.num_vertices() / 2);
  const Values<Scalar> kept = interpolant.evaluate(constant);
  for (Index p = 0; p < num_points; ++p)
    if (holds<Scalar>(rule_number, p))
      record(StressProperty::constants, kept.row(p) == constant.row(0) ? 0 : infinity, place);

  check_bad_vertex(rule_number, interpolant, rows, values, found, place);
  if (rule.formula == Formula::blend && rule.needs_gradients()) {
    const double tolerance = std::pow(10, random_.uniform(-4, 0)) * noise_.values.cwiseAbs().maxCoeff();
    const Values<Scalar> rough = interpolant.evaluate(values, {.tolerance = tolerance, .kernel = Kernel::fast});
    for (Index p = 0; p < num_points; ++p) {
      if (points_.embedding.status[p] != PointStatus::inside) continue;
      long double squared = 0, magnitude = 0;
      // In a sliver far from the origin the last place of a position may lie beyond the cell.
      bool held = true;
      for (int i = 0; i < weights_[p].num_nodes; ++i) held &= weights_[p].beta[i].value >= -1e-9L;
      for (int c = 0; c < columns; ++c) {
        squared += std::pow(static_cast<long double>(rough(p, c)) - found(p, c), 2);
        magnitude += reference[p][c].magnitude;
        held &= holds<Scalar>(rule_number, p, reference[p][c], noise_gradients, c);
      }
      if (!held || !(magnitude < std::sqrt(std::numeric_limits<Scalar>::max()))) continue;
      record(StressProperty::tolerance, ratio_of(std::sqrt(squared), tolerance + steps * (epsilon * magnitude + least)),
             place);
    }
  }
  if constexpr (is_double) {
    if (rows != nullptr && rows->blended()) return;  // what follows is about maps that are the same for all data
    check_smooth(rule_number, rows, interpolant, place);
    check_matrix(rule_number, interpolant, rows, found, reference, place);
    // The same frame in float: each is as near to the reference as its type allows, so are they to each other.
    if (rows != nullptr && !fits<float>(*rows, rule)) return;
    const Values<float> single =
        Interpolant<float>(mesh_, points_.embedding, rule, rows != nullptr ? &rows->reconstruction : nullptr)
            .evaluate(noise_.values.cast<float>());
    for (Index p = 0; p < num_points; ++p)
      for (int c = 0; c < columns; ++c) {
        if (!holds<float>(rule_number, p, reference[p][c], noise_gradients, c)) continue;
        const long double bound = 2 * steps * rounding<float>(p, reference[p][c], noise_gradients, c);
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

}  // namespace halfgrad::stress
