#include "experiments/per_axis.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "framework/error.hpp"
#include "framework/json_values.hpp"

namespace halfgrad {

using nlohmann::json;

template <class Number>
std::array<Number, 3> per_axis(JsonReader& options, std::string_view key, Number fallback, int dim) {
  std::array<Number, 3> values;
  values.fill(fallback);
  const json* given = options.find(key);
  if (given == nullptr) {
    options.record(key, fallback);
    return values;
  }
  if (given->is_array()) {
    const bool numbers = std::all_of(given->begin(), given->end(), [](const json& entry) { return entry.is_number(); });
    if (!numbers || static_cast<int>(given->size()) != dim)
      raise("{}: found {}, expected a number or an array of {}", options.pointer_to(key), given->dump(), dim);
    for (int a = 0; a < dim; ++a)
      if constexpr (std::is_integral_v<Number>)
        values[a] = small_integer((*given)[a], fmt::format("{}/{}", options.pointer_to(key), a));
      else
        values[a] = (*given)[a].get<Number>();
  } else if constexpr (std::is_integral_v<Number>) {
    values.fill(small_integer(*given, options.pointer_to(key)));
  } else {
    values.fill(options.number(key));
  }
  return values;
}

int refined_count(int count, double refinement) {
  const double finer = std::round(count * refinement);
  if (!(std::abs(finer) <= 1e9)) raise("a refinement of {} to {}: at most 1000000000 are possible", count, finer);
  return static_cast<int>(finer);
}

template std::array<int, 3> per_axis(JsonReader&, std::string_view, int, int);
template std::array<double, 3> per_axis(JsonReader&, std::string_view, double, int);

}  // namespace halfgrad
