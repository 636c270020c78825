// Many stress cases in one run.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "experiments/stress_case.hpp"

namespace halfgrad {

struct StressOptions {
  std::uint64_t seed = 1;             ///< of the first case; each further one counts up
  Index num_cases = 100;              ///< an element
  double minutes = 0;                 ///< > 0: stops when they have passed, with as many cases an element as were done
  std::vector<std::string> elements;  ///< empty: all of stress_elements()
  std::function<void(double fraction)> progress;
};

/// Sums over the cases of one element.
struct StressElement {
  std::string element;
  Index num_cases = 0, num_refused = 0;  ///< refused: all cells without volume
  std::int64_t num_vertices = 0, num_cells = 0, num_points = 0;
  std::array<StressTally, num_stress_properties> tallies;
  StressTally linear_ratio, damped_norm;
};

struct StressResult {
  std::uint64_t seed = 0;
  double seconds = 0;
  std::vector<StressElement> elements;
  std::vector<StressFailure> failures;  ///< the first of each element and property, then further ones up to a hundred
  std::int64_t num_failures = 0;

  bool passed() const { return num_failures == 0; }
};

/// Runs the cases on all threads. The same options give the same result for any number of threads, but for minutes.
StressResult run_stress(const StressOptions& options);

/// The command that repeats a case.
std::string stress_command(std::string_view element, std::uint64_t seed);

/// A few lines for people at a terminal.
std::string stress_summary(const StressResult& result);

/// Writes stress.json and stress.html.
std::vector<std::string> write_stress_report(const StressResult& result, const std::filesystem::path& directory);

}  // namespace halfgrad
