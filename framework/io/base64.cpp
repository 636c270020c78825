#include "framework/io/base64.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

namespace halfgrad {

namespace {

constexpr auto digits = [] {
  std::array<std::int8_t, 256> table{};
  table.fill(-1);
  constexpr std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < alphabet.size(); ++i)
    table[static_cast<unsigned char>(alphabet[i])] = static_cast<std::int8_t>(i);
  return table;
}();

}  // namespace

std::string decode_base64(std::string_view text, std::size_t enough) {
  std::string bytes;
  bytes.reserve(std::min(enough, text.size() / 4 * 3) + 3);
  std::uint32_t group = 0;
  int length = 0, padding = 0;
  for (const char c : text) {
    if (c == ' ' || (c >= '\t' && c <= '\r')) continue;
    const int digit = digits[static_cast<unsigned char>(c)];
    if (digit < 0 && c != '=') break;
    if (c == '=') ++padding;
    group = group << 6 | static_cast<std::uint32_t>(c == '=' ? 0 : digit);
    if (++length < 4) continue;
    for (int i = 0; i < 3 - padding; ++i) bytes += static_cast<char>(group >> (16 - 8 * i) & 255);
    if (bytes.size() >= enough) break;
    group = 0;
    length = padding = 0;
  }
  return bytes;
}

}  // namespace halfgrad
