// Numbered names: x.%04d.obj, x.%d.vtu, x_####.vtu.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace halfgrad {

/// A file name with one number in it.
struct FramePattern {
  std::string prefix, suffix;
  int width = 0;  ///< digits, filled with zeros; longer numbers are written out

  /// The pattern in a file name, or none. Throws Error on two numbers and on a % that is no %d or %0Nd.
  static std::optional<FramePattern> parse(const std::string& name);
  std::string name(std::int64_t number) const;
  /// The number of a name that the pattern makes, or none.
  std::optional<std::int64_t> number(std::string_view name) const;
};

}  // namespace halfgrad
