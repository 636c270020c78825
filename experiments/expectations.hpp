// The "expect" of a configuration: a claim about results that holds or does not.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "experiments/results.hpp"

namespace halfgrad {

/// Selectors and bounds of one expectation.
struct Expectation {
  struct Bound {
    std::string key;  ///< order_at_least, gain_at_most, …
    double limit = 0;
  };
  std::string text;     ///< compact JSON
  std::string pointer;  ///< where it stands
  std::optional<std::string> interpolant, reconstructor;
  std::string options;  ///< compact JSON object; every key given must agree
  Region region = Region::all;
  Norm norm = Norm::rms;
  int level = -1;  ///< negative counts from the last
  int frame = -1;  ///< negative counts from the last
  bool every_level = false, every_frame = false;
  std::vector<Bound> bounds;
};

/// Reads an array of expectations. Throws Error on unknown keys and on an expectation without a bound.
std::vector<Expectation> read_expectations(const nlohmann::json& list, const std::string& pointer);

/// Compares. Throws Error on an expectation that matches no row (or no order).
std::vector<ResultExpectation> check_expectations(const std::vector<Expectation>& expectations,
                                                  const std::vector<ResultRow>& rows,
                                                  const std::vector<ResultOrder>& orders);

}  // namespace halfgrad
