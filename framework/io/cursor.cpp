#include "framework/io/cursor.hpp"

#include <fast_float/fast_float.h>

#include <charconv>

namespace halfgrad {

namespace {

bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

// Signs of plus are allowed in all formats but by neither parser.
std::string_view without_plus(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  return word;
}

}  // namespace

std::string shown(std::string_view word) {
  std::string text;
  for (char c : word.substr(0, 40)) text += c >= ' ' && c <= '~' ? c : '?';
  if (word.size() > 40) text += "...";
  return text;
}

bool parse_number(std::string_view word, double& value) {
  word = without_plus(word);
  const auto result = fast_float::from_chars(word.data(), word.data() + word.size(), value);
  return result.ec == std::errc() && result.ptr == word.data() + word.size();
}

bool parse_integer(std::string_view word, std::int64_t& value) {
  word = without_plus(word);
  const auto result = std::from_chars(word.data(), word.data() + word.size(), value);
  return result.ec == std::errc() && result.ptr == word.data() + word.size();
}

void Cursor::skip_space() {
  while (position_ < bytes_.size()) {
    const char c = bytes_[position_];
    if (comment_ != 0 && c == comment_)
      position_ = std::min(bytes_.find('\n', position_), bytes_.size());
    else if (is_space(c))
      ++position_;
    else
      break;
  }
}

bool Cursor::at_end() {
  skip_space();
  return position_ == bytes_.size();
}

std::string_view Cursor::peek() {
  skip_space();
  std::size_t end = position_;
  while (end < bytes_.size() && !is_space(bytes_[end]) && (comment_ == 0 || bytes_[end] != comment_)) ++end;
  return bytes_.substr(position_, end - position_);
}

std::string_view Cursor::word(std::string_view what) {
  const std::string_view found = peek();
  word_start_ = position_;
  if (found.empty()) fail_at_line("the file ends, expected {}", what);
  position_ += found.size();
  return found;
}

void Cursor::expect(std::string_view expected) {
  const std::string_view found = word(expected);
  if (found != expected) fail_at_line("found \"{}\", expected \"{}\"", shown(found), expected);
}

double Cursor::number(std::string_view what) {
  const std::string_view found = word(what);
  double value = 0;
  if (!parse_number(found, value)) fail_at_line("found \"{}\", expected a number for {}", shown(found), what);
  return value;
}

std::int64_t Cursor::integer(std::string_view what) {
  const std::string_view found = word(what);
  std::int64_t value = 0;
  if (!parse_integer(found, value)) fail_at_line("found \"{}\", expected a whole number for {}", shown(found), what);
  return value;
}

std::string_view Cursor::line() {
  word_start_ = position_;
  const std::size_t end = std::min(bytes_.find('\n', position_), bytes_.size());
  std::string_view found = bytes_.substr(position_, end - position_);
  position_ = std::min(end + 1, bytes_.size());
  if (!found.empty() && found.back() == '\r') found.remove_suffix(1);
  return found;
}

bool Cursor::find(std::string_view text) {
  const std::size_t found = bytes_.find(text, position_);
  if (found == std::string_view::npos) return false;
  position_ = found;
  return true;
}

bool Cursor::at_line_end() {
  while (position_ < bytes_.size() && is_space(bytes_[position_]) && bytes_[position_] != '\n') ++position_;
  return position_ == bytes_.size() || bytes_[position_] == '\n' || (comment_ != 0 && bytes_[position_] == comment_);
}

std::int64_t Cursor::count(std::int64_t number, std::size_t least_bytes, std::string_view what) {
  if (number < 0) fail_at_line("found {} {}, expected a count", number, what);
  if (static_cast<std::uint64_t>(number) > remaining() / std::max<std::size_t>(least_bytes, 1) + 1)
    fail_at_line("found {} {}, but only {} bytes follow", number, what, remaining());
  return number;
}

void Cursor::need(std::size_t size, std::string_view what) const {
  if (size > remaining()) fail_at_byte("the file ends, expected {} ({} bytes, {} left)", what, size, remaining());
}

std::size_t Cursor::line_number() const {
  return 1 + static_cast<std::size_t>(
                 std::count(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(word_start_), '\n'));
}

}  // namespace halfgrad
