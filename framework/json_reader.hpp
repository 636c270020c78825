// Reads JSON objects strictly: every key is known, every value has its type, every default is recorded.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace halfgrad {

/// One object at a JSON pointer. Keys are asked for one by one; finish() refuses the ones never asked for. All errors
/// name the pointer, what was found and what was expected.
class JsonReader {
 public:
  /// Throws Error where `value` is not an object.
  JsonReader(const nlohmann::json& value, std::string pointer);
  ~JsonReader();
  JsonReader(const JsonReader&) = delete;
  JsonReader& operator=(const JsonReader&) = delete;

  bool has(std::string_view key);
  /// Finite number, or the default where the key is absent.
  double number(std::string_view key, double fallback);
  double number(std::string_view key);
  std::int64_t integer(std::string_view key, std::int64_t fallback);
  std::int64_t integer(std::string_view key);
  bool boolean(std::string_view key, bool fallback);
  std::string text(std::string_view key, std::string_view fallback);
  std::string text(std::string_view key);
  /// A name out of a list, or the default.
  std::string choice(std::string_view key, const std::vector<std::string_view>& known, std::string_view fallback);
  /// The raw value; null where absent.
  const nlohmann::json* find(std::string_view key);
  const nlohmann::json& at(std::string_view key);
  /// Records what a key resolved to, for results that show the whole configuration.
  void record(std::string_view key, nlohmann::json value);

  const std::string& pointer() const { return pointer_; }
  std::string pointer_to(std::string_view key) const;
  /// Throws Error on a key that nobody asked for, naming the nearest known one and the list.
  void finish() const;
  /// The object with every default filled in.
  const nlohmann::json& resolved() const;

 private:
  const nlohmann::json* object_;
  std::string pointer_;
  std::vector<std::string> known_;
  std::unique_ptr<nlohmann::json> resolved_;
};

/// What "name" or {"name": {options}} chooses.
struct NamedOptions {
  std::string name;
  std::string pointer;            ///< of the options
  const nlohmann::json* options;  ///< part of the specification, or a constant empty object
};

/// Reads the choice of one `kind` ("field", …), whose names are `known`; throws Error with them. The specification must
/// outlive the result.
NamedOptions read_named_options(const nlohmann::json& specification, const std::string& pointer, std::string_view kind,
                                const std::vector<std::string_view>& known);

/// The entry of `known` closest to `word` by edit distance, or empty where none is near.
std::string nearest_name(std::string_view word, const std::vector<std::string_view>& known);

/// "a, b, c" for error messages.
std::string join_names(const std::vector<std::string_view>& names);

/// "a, b, c; did you mean "b"?": the known names, and the nearest where one is near.
std::string known_names(std::string_view word, const std::vector<std::string_view>& known);

}  // namespace halfgrad
