#include "experiments/expectations.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "framework/error.hpp"
#include "framework/json_values.hpp"

namespace halfgrad {

using nlohmann::json;

namespace {

/// What a bound limits, and from which side.
struct BoundKind {
  std::string_view key;
  enum Quantity { order, gain, error, max_abs_sum, sigma, time_over_linear } quantity;
  bool at_least;
};
constexpr std::array bound_kinds = {
    BoundKind{"order_at_least", BoundKind::order, true},
    BoundKind{"order_at_most", BoundKind::order, false},
    BoundKind{"gain_at_least", BoundKind::gain, true},
    BoundKind{"gain_at_most", BoundKind::gain, false},
    BoundKind{"error_at_least", BoundKind::error, true},
    BoundKind{"error_at_most", BoundKind::error, false},
    BoundKind{"max_abs_sum_at_least", BoundKind::max_abs_sum, true},
    BoundKind{"max_abs_sum_at_most", BoundKind::max_abs_sum, false},
    BoundKind{"sigma_at_least", BoundKind::sigma, true},
    BoundKind{"sigma_at_most", BoundKind::sigma, false},
    BoundKind{"time_over_linear_at_most", BoundKind::time_over_linear, false},
};

const BoundKind& kind_of(const std::string& key) {
  return *std::find_if(bound_kinds.begin(), bound_kinds.end(), [&](const BoundKind& kind) { return kind.key == key; });
}

/// "last", "all", or a number that counts from the end where it is negative.
void read_which(JsonReader& reader, std::string_view key, int& which, bool& every) {
  const json* value = reader.find(key);
  if (value == nullptr) {
    reader.record(key, "last");
    return;
  }
  if (*value == "all")
    every = true;
  else if (*value != "last") {
    if (!value->is_number_integer())
      raise("{}: found {}, expected a whole number, \"last\" or \"all\"", reader.pointer_to(key), value->dump());
    which = small_integer(*value, reader.pointer_to(key));
  }
}

/// Every key of the wanted options has the same value in the row's.
bool options_agree(const std::string& wanted, const std::string& found) {
  if (wanted.empty()) return true;
  const json options = json::parse(found.empty() ? "{}" : found);
  const json keys = json::parse(wanted);
  for (const auto& [key, value] : keys.items()) {
    const auto entry = options.find(key);
    if (entry == options.end() || *entry != value) return false;
  }
  return true;
}

template <class Row>
bool rule_agrees(const Expectation& expected, const Row& row) {
  return (!expected.interpolant || *expected.interpolant == row.interpolant) &&
         (!expected.reconstructor || *expected.reconstructor == row.reconstructor) &&
         options_agree(expected.options, row.options);
}

int resolve(int which, int last) { return which < 0 ? last + 1 + which : which; }

std::vector<double> measured_orders(const Expectation& expected, const std::vector<ResultOrder>& orders) {
  std::vector<double> values;
  for (const ResultOrder& order : orders)
    if (rule_agrees(expected, order) && order.region == expected.region && order.norm == expected.norm)
      values.push_back(order.slope);
  return values;
}

std::vector<double> measured_rows(const Expectation& expected, BoundKind::Quantity quantity,
                                  const std::vector<ResultRow>& rows) {
  int last_level = 0, last_frame = 0;
  for (const ResultRow& row : rows) {
    last_level = std::max(last_level, row.level);
    last_frame = std::max(last_frame, row.frame);
  }
  std::vector<double> values;
  for (const ResultRow& row : rows) {
    if (!rule_agrees(expected, row)) continue;
    if (!expected.every_level && row.level != resolve(expected.level, last_level)) continue;
    if (!expected.every_frame && row.frame != resolve(expected.frame, last_frame)) continue;
    const int region = static_cast<int>(expected.region);
    std::optional<double> value;
    if (quantity == BoundKind::gain)
      value = expected.norm == Norm::rms   ? row.gain_over_linear[region]
              : expected.norm == Norm::max ? row.max_gain_over_linear[region]
                                           : std::nullopt;
    else if (quantity == BoundKind::max_abs_sum)
      value = row.max_abs_sum;
    else if (quantity == BoundKind::sigma)
      value = row.sigma;
    else if (quantity == BoundKind::time_over_linear)
      value = row.time_over_linear;
    else if (row.error[region].points > 0)
      value = row.error[region][expected.norm];
    if (value) values.push_back(*value);
  }
  return values;
}

}  // namespace

std::vector<Expectation> read_expectations(const json& list, const std::string& pointer) {
  if (!list.is_array()) raise("{}: found {}, expected an array of objects", pointer, list.dump());
  std::vector<Expectation> expectations;
  for (std::size_t i = 0; i < list.size(); ++i) {
    Expectation expected;
    expected.pointer = fmt::format("{}/{}", pointer, i);
    expected.text = list[i].dump();
    JsonReader reader(list[i], expected.pointer);
    if (reader.has("interpolant")) expected.interpolant = reader.text("interpolant");
    if (reader.has("reconstructor")) expected.reconstructor = reader.text("reconstructor");
    if (const json* options = reader.find("options")) {
      if (!options->is_object())
        raise("{}: found {}, expected an object", reader.pointer_to("options"), options->dump());
      expected.options = options->dump();
    }
    const std::string region = reader.choice("region", {region_names.begin(), region_names.end()}, "all");
    expected.region =
        static_cast<Region>(std::find(region_names.begin(), region_names.end(), region) - region_names.begin());
    const std::string norm = reader.choice("norm", {norm_names.begin(), norm_names.end()}, "rms");
    expected.norm = static_cast<Norm>(std::find(norm_names.begin(), norm_names.end(), norm) - norm_names.begin());
    read_which(reader, "level", expected.level, expected.every_level);
    read_which(reader, "frame", expected.frame, expected.every_frame);
    for (const BoundKind& kind : bound_kinds)
      if (reader.has(kind.key)) expected.bounds.push_back({std::string(kind.key), reader.number(kind.key)});
    reader.finish();
    if (expected.bounds.empty()) {
      std::vector<std::string_view> names;
      for (const BoundKind& kind : bound_kinds) names.push_back(kind.key);
      raise("{}: no bound; give at least one of {}", expected.pointer, join_names(names));
    }
    expectations.push_back(std::move(expected));
  }
  return expectations;
}

std::vector<ResultExpectation> check_expectations(const std::vector<Expectation>& expectations,
                                                  const std::vector<ResultRow>& rows,
                                                  const std::vector<ResultOrder>& orders) {
  std::vector<ResultExpectation> results;
  for (const Expectation& expected : expectations) {
    for (const Expectation::Bound& bound : expected.bounds) {
      const BoundKind& kind = kind_of(bound.key);
      const std::vector<double> values = kind.quantity == BoundKind::order
                                             ? measured_orders(expected, orders)
                                             : measured_rows(expected, kind.quantity, rows);
      if (values.empty())
        raise(
            "{}: {} matches no result; the configuration ran no such interpolant, reconstructor, region, level or "
            "frame (orders need two levels, gains need \"linear\")",
            expected.pointer, expected.text);
      ResultExpectation result{expected.text, bound.key, bound.limit, values.front(), static_cast<int>(values.size()),
                               true};
      for (const double value : values) {
        const bool worse = kind.at_least ? !(value >= result.measured) : !(value <= result.measured);
        if (worse) result.measured = value;
      }
      result.holds = kind.at_least ? result.measured >= bound.limit : result.measured <= bound.limit;
      results.push_back(std::move(result));
    }
  }
  return results;
}

}  // namespace halfgrad
