// Values of JSON documents: read from text that nobody has checked, and as whole numbers.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "framework/json_reader.hpp"

namespace halfgrad {

/// Parses JSON text. Throws Error that begins with `name` where it is malformed or nested deeper than 100 levels.
nlohmann::json parse_json(std::string_view text, std::string_view name);

/// A value that must be a whole number; 1e6 is one too. Throws Error that names the pointer.
std::int64_t whole_number(const nlohmann::json& value, std::string_view pointer);

/// The same, within the range of int.
int small_integer(const nlohmann::json& value, std::string_view pointer);

/// A key of an object, or the default where it is absent.
int small_integer(JsonReader& reader, std::string_view key, int fallback);

/// What a value was found to be, short enough for a message.
std::string described(const nlohmann::json& value);

}  // namespace halfgrad
