#include "apps/diagnosis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <nlohmann/json.hpp>

#include "framework/error.hpp"
#include "framework/json_values.hpp"
#include "framework/mesh_faults.hpp"

namespace halfgrad::app {

using json = nlohmann::ordered_json;

namespace {

constexpr std::size_t most_listed = 10;

struct FaultKind {
  std::string_view name, meaning;
};
constexpr std::array kinds = {
    FaultKind{"degenerate_cells", "cells without volume, which hold no points and have no gradient"},
    FaultKind{"inverted_cells", "cells of negative volume, at one node at least"},
    FaultKind{"folded_cells", "cells whose volume changes sign within them"},
    FaultKind{"duplicate_cells", "cells of the same vertices as an earlier one"},
    FaultKind{"duplicate_vertices", "vertices at the place of an earlier one, where the mesh is not connected"},
    FaultKind{"unused_vertices", "vertices of no cell"},
    FaultKind{"nonmanifold_facets", "facets that three cells or more share"},
    FaultKind{"outside_points", "points outside the mesh"},
    FaultKind{"outside_distance", "distance of the farthest of them, length units"},
    FaultKind{"wider_patch_vertices", "vertices whose stencil took more cells around them than usual"},
    FaultKind{"damped_vertices", "vertices around which the mesh does not determine every mode"},
    FaultKind{"cell_value_vertices", "vertices that fell back to the mean of their cells' gradients"},
    FaultKind{"no_gradient_vertices", "vertices of no usable cell, whose gradient is zero"}};

constexpr std::array rule_names = {"average", "full_fit", "wider_patch", "damped", "cell_value", "none"};

Fault listed(std::string_view name, const std::vector<Index>& numbers) {
  Fault fault{name, static_cast<double>(numbers.size()), {}};
  for (std::size_t i = 0; i < std::min(most_listed, numbers.size()); ++i) fault.first.push_back({numbers[i]});
  return fault;
}

std::string shown(const std::vector<Index>& item) { return fmt::format("{}", fmt::join(item, "-")); }

std::string in_words(std::string_view name) {
  std::string words(name);
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

bool is_count(const Fault& fault) { return fault.name != "outside_distance"; }

}  // namespace

std::vector<std::string_view> fault_names() {
  std::vector<std::string_view> names;
  for (const FaultKind& kind : kinds) names.push_back(kind.name);
  return names;
}

std::vector<Fault> mesh_faults(const Mesh& mesh, const MeshReport& report) {
  std::vector<Fault> faults = {listed("degenerate_cells", report.degenerate_cells),
                               listed("inverted_cells", report.inverted_cells),
                               listed("folded_cells", report.folded_cells),
                               listed("duplicate_cells", duplicate_cells(mesh)),
                               listed("duplicate_vertices", duplicate_vertices(mesh)),
                               listed("unused_vertices", report.unused_vertices)};
  Fault& facets =
      faults.emplace_back(Fault{"nonmanifold_facets", static_cast<double>(report.num_nonmanifold_facets), {}});
  if (report.num_nonmanifold_facets == 0) return faults;
  const std::vector<FacetKey> keys = nonmanifold_facets(mesh);
  for (std::size_t i = 0; i < std::min(most_listed, keys.size()); ++i)
    facets.first.emplace_back(keys[i].begin(),
                              std::find(keys[i].begin(), keys[i].end(), std::numeric_limits<Index>::max()));
  return faults;
}

std::vector<Fault> point_faults(const Embedding& embedding) {
  std::vector<Index> points;
  Fault distance{"outside_distance", 0, {{}}};
  for (const OutsidePoint& outside : embedding.outside) {
    points.push_back(outside.point);
    if (outside.distance > distance.amount) distance = {"outside_distance", outside.distance, {{outside.point}}};
  }
  return {listed("outside_points", points), distance};
}

std::vector<Fault> gradient_faults(const GradientStencilTable& table) {
  std::array<std::vector<Index>, rule_names.size()> vertices;
  for (std::size_t row = 0; row < table.diagnostics.size(); ++row)
    vertices[static_cast<std::size_t>(table.diagnostics[row].rule)].push_back(table.vertices[row]);
  const auto of = [&](StencilRule rule) -> const std::vector<Index>& {
    return vertices[static_cast<std::size_t>(rule)];
  };
  return {listed("wider_patch_vertices", of(StencilRule::wider_patch)),
          listed("damped_vertices", of(StencilRule::damped)),
          listed("cell_value_vertices", of(StencilRule::cell_value)),
          listed("no_gradient_vertices", of(StencilRule::none))};
}

Limits::Limits(const std::vector<std::string>& texts) : most_(kinds.size(), std::numeric_limits<double>::infinity()) {
  const std::vector<std::string_view> names = fault_names();
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    const std::string name = text.substr(0, equals);
    const auto kind = std::find(names.begin(), names.end(), name);
    if (kind == names.end() || equals == std::string::npos) {
      const std::string nearest = nearest_name(name, names);
      raise("--limit {}: expected NAME=NUMBER with one of {}{}", text, join_names(names),
            nearest.empty() || nearest == name ? "" : fmt::format("; did you mean {}?", nearest));
    }
    const json number = json::parse(text.substr(equals + 1), nullptr, false);
    if (!number.is_number() || !(number.get<double>() >= 0)) raise("--limit {}: expected a number from 0", text);
    most_[static_cast<std::size_t>(kind - names.begin())] = number;
  }
}

void Limits::check(const std::filesystem::path& file, const std::vector<Fault>& faults) const {
  for (const Fault& fault : faults) {
    const auto kind =
        std::find_if(kinds.begin(), kinds.end(), [&](const FaultKind& k) { return k.name == fault.name; });
    const double most = most_[static_cast<std::size_t>(kind - kinds.begin())];
    if (!(fault.amount > most)) continue;
    raise("{}: found {} {} ({}), the first is {}; at most {} accepted, --limit {}=NUMBER accepts more", file.string(),
          fault.amount, in_words(fault.name), kind->meaning, shown(fault.first.front()), most, fault.name);
  }
}

json to_json(const std::vector<Fault>& faults) {
  json result = json::object();
  for (const Fault& fault : faults) {
    if (!is_count(fault)) {
      result[fault.name] = fault.amount;
      continue;
    }
    json first = json::array();
    for (const std::vector<Index>& item : fault.first) first.push_back(item.size() == 1 ? json(item[0]) : json(item));
    result[fault.name] = {{"count", static_cast<std::int64_t>(fault.amount)}, {"first", std::move(first)}};
  }
  return result;
}

json rule_counts(const GradientStencilTable& table) {
  json counts = json::object();
  for (const StencilDiagnostics& row : table.diagnostics) {
    json& count = counts[rule_names[static_cast<std::size_t>(row.rule)]];
    count = count.is_null() ? 1 : count.get<std::int64_t>() + 1;
  }
  return counts;
}

json vertices_by_rule(const GradientStencilTable& table) {
  json lists = json::object();
  for (std::size_t row = 0; row < table.diagnostics.size(); ++row)
    if (const StencilRule rule = table.diagnostics[row].rule; rule > StencilRule::full_fit)
      lists[rule_names[static_cast<std::size_t>(rule)]].push_back(table.vertices[row]);
  return lists;
}

std::string fault_lines(const std::vector<Fault>& faults) {
  std::string text;
  for (const Fault& fault : faults) {
    if (fault.amount == 0) continue;
    std::vector<std::string> first;
    for (const std::vector<Index>& item : fault.first) first.push_back(shown(item));
    text += fmt::format("  {:<26} {:.6g}: {}{}\n", in_words(fault.name), fault.amount, fmt::join(first, ", "),
                        is_count(fault) && fault.amount > static_cast<double>(first.size()) ? ", ..." : "");
  }
  return text;
}

}  // namespace halfgrad::app
