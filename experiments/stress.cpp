#include "experiments/stress.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "experiments/stress_mesh.hpp"
#include "framework/error.hpp"
#include "framework/parallel.hpp"

namespace halfgrad {

namespace {

constexpr Index batch_size = 256;
constexpr std::size_t most_failures = 100;

void merge(StressTally& into, const StressTally& from) {
  if (from.checks == 0) return;
  if (into.checks == 0 || from.worst > into.worst) {
    into.worst = from.worst;
    into.seed = from.seed;
    into.where = from.where;
  }
  into.checks += from.checks;
}

void add_case(const StressCase& found, StressElement& element, StressResult& result) {
  ++element.num_cases;
  element.num_refused += found.refused;
  element.num_vertices += found.num_vertices;
  element.num_cells += found.num_cells;
  element.num_points += found.num_points;
  for (std::size_t p = 0; p < num_stress_properties; ++p) merge(element.tallies[p], found.tallies[p]);
  merge(element.linear_ratio, found.linear_ratio);
  merge(element.damped_norm, found.damped_norm);
  for (const StressFailure& failure : found.failures) {
    ++result.num_failures;
    const bool first = std::none_of(result.failures.begin(), result.failures.end(), [&](const StressFailure& other) {
      return other.element == failure.element && other.property == failure.property;
    });
    if (first || result.failures.size() < most_failures) result.failures.push_back(failure);
  }
}

}  // namespace

StressResult run_stress(const StressOptions& options) {
  if (options.num_cases < 1) raise("stress: {} cases, expected at least 1", options.num_cases);
  if (!(options.minutes >= 0)) raise("stress: {} minutes, expected a number >= 0", options.minutes);
  std::vector<std::string> elements = options.elements;
  if (elements.empty())
    for (const std::string_view name : stress_elements()) elements.emplace_back(name);
  for (const std::string& name : elements) make_stress_mesh(name, options.seed);  // refuses unknown names

  const auto start = std::chrono::steady_clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  StressResult result;
  result.seed = options.seed;
  for (const std::string& name : elements) {
    result.elements.emplace_back();
    result.elements.back().element = name;
  }
  // Batches of all elements in turn, so that a run that ends early has seen each as often.
  for (Index begin = 0; begin < options.num_cases; begin += batch_size) {
    const Index end = std::min(options.num_cases, begin + batch_size);
    for (StressElement& element : result.elements) {
      std::vector<StressCase> cases(static_cast<std::size_t>(end - begin));
      parallel_for(end - begin, 1, [&](std::int64_t first, std::int64_t last) {
        for (std::int64_t c = first; c < last; ++c)
          cases[c] = run_stress_case(element.element, options.seed + static_cast<std::uint64_t>(begin + c));
      });
      for (const StressCase& found : cases) add_case(found, element, result);
    }
    if (options.progress) options.progress(static_cast<double>(end) / options.num_cases);
    if (options.minutes > 0 && seconds() > 60 * options.minutes) break;
  }
  result.seconds = seconds();
  return result;
}

std::string stress_command(std::string_view element, std::uint64_t seed) {
  return fmt::format("halfgrad stress --element {} --seed {} --cases 1", element, seed);
}

std::string stress_summary(const StressResult& result) {
  std::string text;
  std::int64_t checks = 0;
  for (const StressElement& element : result.elements) {
    double worst = 0;
    for (const StressTally& tally : element.tallies) {
      checks += tally.checks;
      worst = std::max(worst, tally.worst);
    }
    text += fmt::format("{:<14} {:>7} cases ({} without volume), worst error over bound {:.3g}\n", element.element,
                        element.num_cases, element.num_refused, worst);
  }
  text += fmt::format("{} checks from seed {} on in {:.0f} s, {} failures\n", checks, result.seed, result.seconds,
                      result.num_failures);
  for (const StressFailure& failure : result.failures)
    text += fmt::format("  {} {}: {:.3g} times its bound ({}; {})\n    {}\n", failure.element,
                        stress_properties()[static_cast<std::size_t>(failure.property)].name, failure.ratio,
                        failure.where, failure.recipe, stress_command(failure.element, failure.seed));
  return text;
}

}  // namespace halfgrad
