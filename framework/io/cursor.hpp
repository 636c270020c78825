// A position in a file that mixes text and binary numbers.
#pragma once

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include "framework/error.hpp"
#include "framework/io/input_file.hpp"

namespace halfgrad {

/// The value with its bytes reversed.
template <class T>
T byte_swapped(T value) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  std::reverse(bytes, bytes + sizeof(T));
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

/// Reads words, numbers and binary values in turn. Every failure throws Error with the file, the line (text) or the
/// byte offset (binary), what was found and what was expected. `what` arguments name the thing read, for these
/// messages.
class Cursor {
 public:
  /// `comment` starts a comment that reaches to the end of its line; 0 for none. The file must outlive the cursor.
  explicit Cursor(const InputFile& file, char comment = 0) : Cursor(file.path().string(), file.bytes(), comment) {}
  Cursor(std::string name, std::string_view bytes, char comment = 0)
      : name_(std::move(name)), bytes_(bytes), comment_(comment) {}

  const std::string& name() const { return name_; }
  std::size_t position() const { return position_; }
  void seek(std::size_t position) { position_ = std::min(position, bytes_.size()); }
  std::size_t remaining() const { return bytes_.size() - position_; }
  /// Whether only white space and comments are left.
  bool at_end();

  /// The next word.
  std::string_view word(std::string_view what);
  /// The next word without moving past it; empty at the end.
  std::string_view peek();
  /// Moves past a word that must be next.
  void expect(std::string_view word);
  /// A number in text. Infinite and NaN are numbers here; check() of the geometry finds them.
  double number(std::string_view what);
  std::int64_t integer(std::string_view what);
  /// The rest of the line without its end, and moves behind it.
  std::string_view line();
  /// Moves to the next occurrence of a text; false, without moving, where there is none.
  bool find(std::string_view text);
  /// Whether only blanks are left before the end of the line.
  bool at_line_end();

  /// A number of things that are still to come and take at least `least_bytes` each: checked against what is left of
  /// the file, so that memory is never reserved on the word of a broken file.
  std::int64_t count(std::int64_t number, std::size_t least_bytes, std::string_view what);

  /// Binary values; `swap` where the file's byte order is the other one.
  template <class T>
  T binary(std::string_view what, bool swap = false) {
    static_assert(std::is_arithmetic_v<T>);
    need(sizeof(T), what);
    T value;
    std::memcpy(&value, bytes_.data() + position_, sizeof(T));
    position_ += sizeof(T);
    return swap ? byte_swapped(value) : value;
  }
  void skip(std::size_t size, std::string_view what) {
    need(size, what);
    position_ += size;
  }

  /// Throws at the line of the position.
  template <class... Args>
  [[noreturn]] void fail_at_line(fmt::format_string<Args...> format, Args&&... args) const {
    raise("{}:{}: {}", name_, line_number(), fmt::format(format, std::forward<Args>(args)...));
  }
  /// Throws at the byte of the position.
  template <class... Args>
  [[noreturn]] void fail_at_byte(fmt::format_string<Args...> format, Args&&... args) const {
    raise("{}: byte {}: {}", name_, position_, fmt::format(format, std::forward<Args>(args)...));
  }

 private:
  void need(std::size_t size, std::string_view what) const;
  void skip_space();
  std::size_t line_number() const;

  std::string name_;
  std::string_view bytes_;
  char comment_;
  std::size_t position_ = 0;
  std::size_t word_start_ = 0;  // of the word last read, whose line messages name
};

/// A word as shown in messages: printable and short.
std::string shown(std::string_view word);

/// Reads a number that fills the whole word; false where it does not.
bool parse_number(std::string_view word, double& value);
bool parse_integer(std::string_view word, std::int64_t& value);

}  // namespace halfgrad
