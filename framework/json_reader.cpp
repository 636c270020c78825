#include "framework/json_reader.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "framework/error.hpp"
#include "framework/json_values.hpp"

namespace halfgrad {

using nlohmann::json;

namespace {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({row[j] + 1, row[j + 1] + 1, substituted});
    }
  }
  return row.back();
}

}  // namespace

std::string nearest_name(std::string_view word, const std::vector<std::string_view>& known) {
  std::string best;
  std::size_t least = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (std::string_view name : known) {
    const std::size_t distance = edit_distance(word, name);
    if (distance < least) {
      least = distance;
      best = name;
    }
  }
  return best;
}

std::string join_names(const std::vector<std::string_view>& names) { return fmt::format("{}", fmt::join(names, ", ")); }

std::string known_names(std::string_view word, const std::vector<std::string_view>& known) {
  const std::string nearest = nearest_name(word, known);
  return nearest.empty() ? join_names(known) : fmt::format("{}; did you mean \"{}\"?", join_names(known), nearest);
}

NamedOptions read_named_options(const json& specification, const std::string& pointer, std::string_view kind,
                                const std::vector<std::string_view>& known) {
  static const json none = json::object();
  NamedOptions choice{"", pointer, &none};
  if (specification.is_string()) {
    choice.name = specification.get<std::string>();
  } else if (specification.is_object() && specification.size() == 1) {
    choice.name = specification.begin().key();
    choice.pointer += "/" + choice.name;
    choice.options = &specification.begin().value();
  } else {
    raise("{}: found {}, expected one {}: its name, or {{\"name\": {{options}}}}",
          pointer.empty() ? kind : std::string_view(pointer), described(specification), kind);
  }
  if (std::find(known.begin(), known.end(), choice.name) == known.end())
    raise("{}: no {} \"{}\"; known: {}", pointer.empty() ? kind : std::string_view(pointer), kind, choice.name,
          known_names(choice.name, known));
  return choice;
}

JsonReader::JsonReader(const json& value, std::string pointer)
    : object_(&value), pointer_(std::move(pointer)), resolved_(std::make_unique<json>(json::object())) {
  if (!value.is_object())
    raise("{}: found {}, expected an object", pointer_.empty() ? "the document" : pointer_, described(value));
}

JsonReader::~JsonReader() = default;

std::string JsonReader::pointer_to(std::string_view key) const { return fmt::format("{}/{}", pointer_, key); }

const json* JsonReader::find(std::string_view key) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.emplace_back(key);
  const auto found = object_->find(std::string(key));
  if (found == object_->end()) return nullptr;
  (*resolved_)[std::string(key)] = *found;
  return &*found;
}

bool JsonReader::has(std::string_view key) { return find(key) != nullptr; }

const json& JsonReader::at(std::string_view key) {
  const json* value = find(key);
  if (value == nullptr) raise("{}: missing", pointer_to(key));
  return *value;
}

void JsonReader::record(std::string_view key, json value) { (*resolved_)[std::string(key)] = std::move(value); }

double JsonReader::number(std::string_view key, double fallback) {
  if (has(key)) return number(key);
  record(key, fallback);
  return fallback;
}

double JsonReader::number(std::string_view key) {
  const json& value = at(key);
  if (!value.is_number() || !std::isfinite(value.get<double>()))
    raise("{}: found {}, expected a finite number", pointer_to(key), described(value));
  return value.get<double>();
}

std::int64_t JsonReader::integer(std::string_view key, std::int64_t fallback) {
  if (has(key)) return integer(key);
  record(key, fallback);
  return fallback;
}

std::int64_t JsonReader::integer(std::string_view key) { return whole_number(at(key), pointer_to(key)); }

bool JsonReader::boolean(std::string_view key, bool fallback) {
  if (!has(key)) {
    record(key, fallback);
    return fallback;
  }
  const json& value = at(key);
  if (!value.is_boolean()) raise("{}: found {}, expected true or false", pointer_to(key), described(value));
  return value.get<bool>();
}

std::string JsonReader::text(std::string_view key, std::string_view fallback) {
  if (has(key)) return text(key);
  record(key, fallback);
  return std::string(fallback);
}

std::string JsonReader::text(std::string_view key) {
  const json& value = at(key);
  if (!value.is_string()) raise("{}: found {}, expected a string", pointer_to(key), described(value));
  return value.get<std::string>();
}

std::string JsonReader::choice(std::string_view key, const std::vector<std::string_view>& known,
                               std::string_view fallback) {
  const std::string word = text(key, fallback);
  if (std::find(known.begin(), known.end(), word) == known.end())
    raise("{}: found \"{}\", expected one of {}", pointer_to(key), word, known_names(word, known));
  return word;
}

void JsonReader::finish() const {
  for (const auto& [key, value] : object_->items())
    if (std::find(known_.begin(), known_.end(), key) == known_.end()) {
      const std::vector<std::string_view> names(known_.begin(), known_.end());
      raise("{}: unknown key; known here: {}", pointer_to(key), names.empty() ? "none" : known_names(key, names));
    }
}

const json& JsonReader::resolved() const { return *resolved_; }

}  // namespace halfgrad
