#include "framework/interpolation_rule.hpp"

#include <array>
#include <string>
#include <vector>

#include "framework/error.hpp"
#include "framework/json_reader.hpp"

namespace halfgrad {

std::span<const NamedRule> named_rules() {
  static constexpr std::array rules = {
      NamedRule{"linear", {Formula::blend, 0}, "sum of beta_i x_i: order two"},
      NamedRule{
          "phong", {Formula::blend, 0.5}, "James 2020, Eq. 19: order three where the vertex gradients are order two"},
      NamedRule{"vertex_blend", {Formula::blend, 1}, "blended vertex models, James 2020, Eq. 10; alpha sets the blend"},
      NamedRule{"hermite", {Formula::hermite, 0.5}, "cubic along edges from the same data as phong"},
      NamedRule{"dual_taylor", {Formula::dual_taylor, 0.5}, "order four, from vertex gradients and Hessians"},
      NamedRule{"quadratic10",
                {Formula::quadratic10, 0.5},
                "quadratic with Hermite midpoints, James 2020, Eq. 20-23: equals phong; simplices only"},
  };
  return rules;
}

InterpolationRule named_rule(std::string_view name) {
  std::vector<std::string_view> names;
  for (const NamedRule& rule : named_rules()) {
    if (rule.name == name) return rule.rule;
    names.push_back(rule.name);
  }
  raise("no interpolant \"{}\"; known: {}", name, known_names(name, names));
}

}  // namespace halfgrad
