// An entry of "interpolants": a rule on cells, or one that knows vertices only.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "framework/interpolation_rule.hpp"
#include "framework/scattered_transfer.hpp"

namespace halfgrad {

/// A rule and the name it was configured by.
struct ConfiguredInterpolant {
  std::string name;
  InterpolationRule rule;                  ///< where `scattered` is none
  std::optional<ScatteredRule> scattered;  ///< of the baselines
  std::string options;                     ///< of the baselines, compact JSON

  bool needs_gradients() const { return scattered ? scattered->needs_gradients() : rule.needs_gradients(); }
  bool needs_hessians() const { return !scattered && rule.needs_hessians(); }
};

/// From "name" or {"name": {options}}; `resolved` receives the same with every default. Throws Error with the known
/// names or keys.
ConfiguredInterpolant read_interpolant(const nlohmann::json& specification, const std::string& pointer,
                                       nlohmann::json& resolved);

}  // namespace halfgrad
