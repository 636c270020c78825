// One mesh, every reconstructor and interpolant on it, and what of their guarantees held.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "framework/types.hpp"

namespace halfgrad {

/// What halfgrad promises on any mesh; docs/guarantees.md is the same table with its reasons.
enum class StressProperty : std::uint8_t {
  served,
  finite,
  located,
  affine_rows,
  affine,
  interpolation,
  continuity,
  constants,
  matrix,
  reference,
  paths,
  precisions,
  tolerance,
  steepness,
  smooth,
  bad_vertex,
  renumbered,
  turned,
  scaled
};
inline constexpr std::size_t num_stress_properties = 19;

/// A property's name and what it says.
struct StressPropertyEntry {
  std::string_view name, promise;
};

/// All of them, in the order of the enumeration.
std::span<const StressPropertyEntry> stress_properties();

/// What became of one property.
struct StressTally {
  std::int64_t checks = 0;  ///< comparisons made
  double worst = 0;         ///< greatest error over its bound; more than 1 fails
  std::uint64_t seed = 0;   ///< of the worst
  std::string where;        ///< rule, reconstructor and precision of the worst

  void add(double ratio, std::uint64_t of_seed, const std::string& place);
};

/// A property that did not hold, its worst instance in the case.
struct StressFailure {
  std::string element;
  std::uint64_t seed = 0;
  StressProperty property = StressProperty::served;
  double ratio = 0;  ///< error over bound; infinite where a bound makes no sense
  std::string where;
  std::string recipe;  ///< of the mesh
};

/// What one case found.
struct StressCase {
  std::string element, recipe;
  std::uint64_t seed = 0;
  Index num_vertices = 0, num_cells = 0, num_points = 0;
  bool refused = false;  ///< all cells without volume: embedding throws, as it should
  std::array<StressTally, num_stress_properties> tallies;
  StressTally linear_ratio;  ///< error over that of linear interpolation on a smooth field, stencils of kriging
  StressTally damped_norm;   ///< h Σ|g| of kriging's rows that were not accepted
  std::vector<StressFailure> failures;
};

/// Makes the mesh of an element and a seed and checks every property for all reconstructors, interpolants and
/// precisions. Throws Error on an unknown element only: whatever else is thrown is a failure of `served`.
StressCase run_stress_case(std::string_view element, std::uint64_t seed);

}  // namespace halfgrad
