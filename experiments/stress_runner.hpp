// The checks of one stress case. Internal to stress_*.cpp.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "experiments/random.hpp"
#include "experiments/stress_case.hpp"
#include "experiments/stress_points.hpp"
#include "experiments/stress_reference.hpp"
#include "experiments/stress_rows.hpp"
#include "framework/interpolant.hpp"

namespace halfgrad::stress {

inline constexpr double infinity = std::numeric_limits<double>::infinity();
inline constexpr int columns = 3;

// Every chain of operations is as long as its row and a few steps a node.
inline constexpr double steps_of_a_point = 64;

inline double ratio_of(long double error, long double bound) {
  if (error == 0) return 0;
  if (!(bound > 0) || std::isnan(error)) return infinity;
  return static_cast<double>(error / bound);
}

// The greatest |e| |g| of a usable cell for which bounds in units of rounding mean something: beyond it a cell's
// thickness is a handful of units in the last place of its coordinates.
inline constexpr double greatest_aspect = 1e9;

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
  std::vector<double> magnitudes;
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
    const bool always = property == StressProperty::served || property == StressProperty::finite ||
                        property == StressProperty::constants || property == StressProperty::bad_vertex;
    if (always || aspect_ <= greatest_aspect)
      result_.tallies[static_cast<std::size_t>(property)].add(ratio, result_.seed, place);
  }
  // Whether a vertex belongs to a cell with volume.
  bool serves(Index vertex) const {
    const std::span<const Index> adjacent = cells_->cells_of(vertex);
    return std::any_of(adjacent.begin(), adjacent.end(), [&](Index c) { return usable_[c] != 0; });
  }
  void make_values();
  void measure_cells();
  void prepare_points();
  void check_located();
  void check_rows(const Rows& rows);
  Rows make_rows(const StressReconstructor& made);
  void bound_blend(Rows& rows) const;
  void check_rules(const Rows* rows);
  template <class Scalar>
  void check_rule(std::size_t rule, const Rows* rows);
  template <class Scalar>
  void check_bad_vertex(std::size_t rule, const Interpolant<Scalar>& interpolant, const Rows* rows,
                        const Values<Scalar>& values, const Values<Scalar>& before, const std::string& place);
  template <class Scalar>
  bool fits(const Rows& rows, const InterpolationRule& rule) const;
  // Whether the coefficients of a point are numbers of the type: far outside a small cell they are not.
  template <class Scalar>
  bool holds(std::size_t rule, Index point) const;
  // Whether its value is, and what the gradients add to it anywhere in its cell: a path may compute that first.
  template <class Scalar>
  bool holds(std::size_t rule, Index point, const Measured& value, const ReferenceGradients& gradients,
             int column) const;
  // The bound of the rounding of a value, but for the number of steps. What underflows in a coefficient is multiplied
  // by its gradient and by up to three weights.
  template <class Scalar>
  long double rounding(Index point, const Measured& value, const ReferenceGradients& gradients, int column) const;
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
  double size_ = 0;           // of the mesh, a length
  double aspect_ = 1;         // greatest |e||g| of a usable cell
  double steepest_cell_ = 0;  // greatest |g|
  bool all_simplices_ = true;
  Eigen::MatrixXd slope_;  // of the affine values, columns × gdim
  Eigen::VectorXd shift_;
  std::vector<Wave> waves_;
  ReferenceValues noise_, affine_, smooth_;
  Values<double> linear_smooth_;  // what linear interpolation makes of smooth_
};

}  // namespace halfgrad::stress
