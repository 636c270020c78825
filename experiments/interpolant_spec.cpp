#include "experiments/interpolant_spec.hpp"

#include <nlohmann/json.hpp>

#include "framework/error.hpp"
#include "framework/json_reader.hpp"

namespace halfgrad {

using nlohmann::json;

namespace {

void read_scattered(JsonReader& reader, ScatteredRule& rule) {
  rule.radius = reader.number("radius", rule.radius);
  if (!(rule.radius > 0)) raise("{}: found {}, expected a positive number", reader.pointer_to("radius"), rule.radius);
  const std::int64_t neighbors = reader.integer("neighbors", rule.neighbors);
  if (neighbors < 1 || neighbors > 100000)
    raise("{}: found {}, expected 1 to 100000", reader.pointer_to("neighbors"), neighbors);
  rule.neighbors = static_cast<int>(neighbors);
  if (rule.kind == ScatteredRule::Kind::attribute_transfer)
    rule.carried = reader.choice("carry", {"displacement", "gradient"}, "displacement") == "gradient"
                       ? Carried::gradient
                       : Carried::displacement;
}

}  // namespace

ConfiguredInterpolant read_interpolant(const json& specification, const std::string& pointer, json& resolved) {
  std::vector<std::string_view> names;
  for (const NamedRule& known : named_rules()) names.push_back(known.name);
  for (const NamedScatteredRule& known : scattered_rules()) names.push_back(known.name);
  const auto [name, where, options] = read_named_options(specification, pointer, "interpolant", names);
  ConfiguredInterpolant interpolant{name, {}, find_scattered_rule(name), {}};
  JsonReader reader(*options, where);
  if (interpolant.scattered) {
    read_scattered(reader, *interpolant.scattered);
    interpolant.options = reader.resolved().dump();
  } else {
    interpolant.rule = named_rule(name);
    if (name == "vertex_blend") interpolant.rule.alpha = reader.number("alpha", interpolant.rule.alpha);
  }
  reader.finish();
  resolved = reader.resolved().empty() ? json(name) : json{{name, reader.resolved()}};
  return interpolant;
}

}  // namespace halfgrad
