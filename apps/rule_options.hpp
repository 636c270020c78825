// The words of the command line that choose a rule: what several commands read alike.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "framework/embedding.hpp"
#include "framework/interpolation_rule.hpp"

namespace halfgrad::app {

/// --interpolant and --alpha. Throws Error on an unknown name, and on an alpha for another rule than vertex_blend.
InterpolationRule parse_rule(std::string_view interpolant, std::optional<double> alpha);

/// --reconstructor, a name or JSON. Where it is empty: kriging with cubic drift for rules that need Hessians, else
/// `preferred`.
nlohmann::json parse_reconstructor(const std::string& text, const InterpolationRule& rule, std::string_view preferred);

/// --outside.
Outside parse_outside(std::string_view word);

}  // namespace halfgrad::app
