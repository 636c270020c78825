// What an experiment measured, as plain values.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "framework/types.hpp"

namespace halfgrad {

/// Which points an error is taken over. A point is boundary when its cell has a vertex on the mesh boundary.
enum class Region : std::uint8_t { all, interior, boundary };
inline constexpr std::array<std::string_view, 3> region_names = {"all", "interior", "boundary"};
/// Which norm of the Euclidean errors of points.
enum class Norm : std::uint8_t { rms, max, mean };
inline constexpr std::array<std::string_view, 3> norm_names = {"rms", "max", "mean"};

/// Error over a region, length units.
struct RegionError {
  double max = 0, rms = 0;
  Index points = 0;
  double mean = 0;
  double operator[](Norm norm) const { return norm == Norm::rms ? rms : norm == Norm::max ? max : mean; }
};

/// One line of results.json: a level, a frame, an interpolant and a reconstructor.
struct ResultRow {
  int level = 0;
  std::string element;  ///< names of the block's elements, joined by '+'
  Index vertices = 0, cells = 0;
  double h = 0;  ///< mean edge length
  Index points = 0;
  int frame = 0;
  std::string interpolant;
  std::optional<double> alpha;  ///< of blends
  std::string reconstructor;    ///< empty where the interpolant needs none
  std::string options;          ///< of the reconstructor and of a baseline, compact JSON
  std::array<RegionError, 3> error;
  std::array<std::optional<double>, 3> gain_over_linear;      ///< none where linear was not run or has no error
  std::array<std::optional<double>, 3> max_gain_over_linear;  ///< the same in the max norm
  std::optional<double> max_abs_sum;  ///< greatest Σ_j |S_ij| over the points; none for data-dependent rules
  std::optional<double> sigma;        ///< deviation of cell weights (James 2020, Fig. 6), averages of cells only
  std::optional<double>
      time_over_linear;  ///< a frame's gradients and points over linear's; none where linear was not run
  double locate_seconds = 0, reconstruct_seconds = 0, gradients_seconds = 0, evaluate_seconds = 0;
  Index skipped_cells = 0, skipped_vertices = 0, linear_cells = 0, outside_points = 0;
};

/// "phong + kriging (drift quadratic, patch wide)"; options is a compact JSON object or empty.
std::string rule_name(const std::string& interpolant, const std::string& reconstructor, const std::string& options);

/// Slope of log error over log h at the last frame.
struct ResultOrder {
  std::string interpolant;
  std::string reconstructor, options;
  Region region = Region::all;
  Norm norm = Norm::rms;
  double slope = 0;
};

/// One expectation and what became of it.
struct ResultExpectation {
  std::string text;   ///< the expectation, compact JSON
  std::string bound;  ///< "order_at_least", …
  double limit = 0;
  double measured = 0;  ///< the least favourable value among the matches
  int matches = 0;
  bool holds = false;
};

/// A rule and what it gained over linear.
struct MeasuredRule {
  std::string interpolant;
  std::string reconstructor, options;
  double gain = 1;  ///< geometric mean over the frames
};

/// Which rule to take, and why.
struct Recommendation {
  MeasuredRule chosen, best;
  std::optional<MeasuredRule> safe;  ///< phong with adaptive, where it was measured
  Index points = 0;                  ///< held out, all folds
  int frames = 0;                    ///< that count
  std::string reason;
};

/// All of it.
struct ExperimentResult {
  std::string name;
  std::string config;   ///< with every default filled in, JSON
  std::string machine;  ///< JSON
  std::vector<ResultRow> rows;
  std::vector<ResultOrder> orders;
  std::vector<ResultExpectation> expectations;
  std::optional<Recommendation> recommendation;  ///< of runs that hold out vertices
  std::string scene;               ///< of the finest level for the interactive report, JSON; empty where not asked for
  std::vector<std::string> files;  ///< written

  bool all_expectations_hold() const;
};

/// Where a point is: in a cell without a vertex on the mesh boundary, in one with, or nowhere.
enum class PointPlace : std::uint8_t { interior, boundary, nowhere };

/// Norms of the errors |a_i − b_i| over the three regions; points that are nowhere do not count.
std::array<RegionError, 3> region_errors(const Points& measured, const Points& truth,
                                         std::span<const PointPlace> places);

/// Least-squares slope of log(error) over log(h); none with fewer than two positive pairs of different h.
std::optional<double> fitted_order(std::span<const double> h, std::span<const double> errors);

/// The slopes of the last frame's rows that share everything but the level; none with fewer than two levels.
std::vector<ResultOrder> orders_of(const std::vector<ResultRow>& rows);

}  // namespace halfgrad
