#include "framework/io/frame_pattern.hpp"

#include <algorithm>
#include <cctype>

#include "framework/error.hpp"
#include "framework/io/cursor.hpp"

namespace halfgrad {

std::optional<FramePattern> FramePattern::parse(const std::string& name) {
  const std::size_t begin = name.find_first_of("%#");
  if (begin == std::string::npos) return std::nullopt;
  FramePattern pattern;
  std::size_t end = begin;
  if (name[begin] == '#') {
    end = std::min(name.find_first_not_of('#', begin), name.size());
    pattern.width = static_cast<int>(end - begin);
  } else {
    end = std::min(name.find_first_not_of("0123456789", begin + 1), name.size());
    const std::string_view digits = std::string_view(name).substr(begin + 1, end - begin - 1);
    std::int64_t width = 0;
    const bool valid =
        digits.empty() || (digits.size() > 1 && digits[0] == '0' && parse_integer(digits, width) && width <= 18);
    if (!valid || end == name.size() || name[end] != 'd')
      raise("\"{}\": expected a number written as %d, %04d or ####", name);
    pattern.width = static_cast<int>(width);
    ++end;
  }
  pattern.prefix = name.substr(0, begin);
  pattern.suffix = name.substr(end);
  if (pattern.suffix.find_first_of("%#") != std::string::npos)
    raise("\"{}\": expected one number written as %d, %04d or ####, found two", name);
  return pattern;
}

std::string FramePattern::name(std::int64_t number) const {
  return fmt::format("{}{:0{}}{}", prefix, number, width, suffix);
}

std::optional<std::int64_t> FramePattern::number(std::string_view text) const {
  if (text.size() <= prefix.size() + suffix.size() || !text.starts_with(prefix) || !text.ends_with(suffix))
    return std::nullopt;
  const std::string_view digits = text.substr(prefix.size(), text.size() - prefix.size() - suffix.size());
  std::int64_t number = 0;
  if (!std::isdigit(static_cast<unsigned char>(digits[0])) || !parse_integer(digits, number) || name(number) != text)
    return std::nullopt;
  return number;
}

}  // namespace halfgrad
