// Files that exist in memory only, each in a block of its own so that reading past the end is seen.
#pragma once

#include <string_view>

namespace halfgrad {

/// What InputFile opens in the fuzzers.
struct MemoryFiles {
  /// The input's parts, divided by lines "~~~~": the first bears this name, any other name opens the second.
  static void set(std::string_view name, std::string_view input);
};

}  // namespace halfgrad
