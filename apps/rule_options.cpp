#include "apps/rule_options.hpp"

#include <nlohmann/json.hpp>

#include "framework/error.hpp"

namespace halfgrad::app {

using nlohmann::json;

InterpolationRule parse_rule(std::string_view interpolant, std::optional<double> alpha) {
  InterpolationRule rule = named_rule(interpolant);
  if (alpha) {
    if (interpolant != "vertex_blend")
      raise("--alpha {}: only vertex_blend takes it; {} has its own", *alpha, interpolant);
    rule.alpha = *alpha;
  }
  return rule;
}

json parse_reconstructor(const std::string& text, const InterpolationRule& rule, std::string_view preferred) {
  if (text.empty()) return rule.needs_hessians() ? json{{"kriging", {{"drift", "cubic"}}}} : json(preferred);
  if (text[0] != '{' && text[0] != '"') return text;
  try {
    return json::parse(text);
  } catch (const json::parse_error& error) {
    raise("--reconstructor {}: {}", text, error.what());
  }
}

Outside parse_outside(std::string_view word) {
  if (word == "error") return Outside::error;
  if (word == "nearest") return Outside::nearest;
  if (word == "mark") return Outside::mark;
  raise("--outside {}: expected error, nearest or mark", word);
}

}  // namespace halfgrad::app
