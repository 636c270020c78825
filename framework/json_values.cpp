#include "framework/json_values.hpp"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "framework/error.hpp"

namespace halfgrad {

using nlohmann::json;

json parse_json(std::string_view text, std::string_view name) {
  // What walks a document later recurses into it.
  constexpr int most_levels = 100;
  const auto check_depth = [&](int depth, json::parse_event_t, json&) {
    if (depth > most_levels) raise("{}: nested deeper than {} levels", name, most_levels);
    return true;
  };
  try {
    return json::parse(text, check_depth);
  } catch (const json::exception& error) {
    raise("{}: not JSON: {}", name, error.what());
  }
}

int small_integer(const json& value, std::string_view pointer) {
  const std::int64_t number = whole_number(value, pointer);
  if (number < std::numeric_limits<int>::min() || number > std::numeric_limits<int>::max())
    raise("{}: found {}, expected at most {} in size", pointer, number, std::numeric_limits<int>::max());
  return static_cast<int>(number);
}

std::int64_t whole_number(const json& value, std::string_view pointer) {
  if (value.is_number_integer() && !(value.is_number_unsigned() && value.get<std::uint64_t>() > INT64_MAX))
    return value.get<std::int64_t>();
  // 1e6 is how people write a million.
  if (value.is_number_float()) {
    const double number = value.get<double>();
    if (std::abs(number) < 9e15 && number == std::floor(number)) return static_cast<std::int64_t>(number);
  }
  raise("{}: found {}, expected a whole number", pointer, described(value));
}

int small_integer(JsonReader& reader, std::string_view key, int fallback) {
  if (reader.has(key)) return small_integer(reader.at(key), reader.pointer_to(key));
  reader.record(key, fallback);
  return fallback;
}

std::string described(const json& value) {
  std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return fmt::format("{} {}", value.type_name(), text);
}

}  // namespace halfgrad
