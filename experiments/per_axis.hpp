// Options that are one number, or one an axis, and counts that refinement multiplies.
#pragma once

#include <array>

#include "framework/json_reader.hpp"

namespace halfgrad {

/// A number for all of `dim` axes, or an array of one each; for int and double. Throws Error that names the pointer.
template <class Number>
std::array<Number, 3> per_axis(JsonReader& options, std::string_view key, Number fallback, int dim);

/// A count times a refinement, rounded. Throws Error where it exceeds a thousand million.
int refined_count(int count, double refinement);

}  // namespace halfgrad
