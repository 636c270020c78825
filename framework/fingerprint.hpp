// A number that tells whether two inputs are the same.
#pragma once

#include <cstdint>
#include <string_view>

#include "framework/mesh.hpp"

namespace halfgrad {

/// FNV-1a over what is added, 64 bits: notices changed files, not malice.
class Fingerprint {
 public:
  Fingerprint& add(std::string_view bytes);
  /// Rest vertices, element types and cells.
  Fingerprint& add(const Mesh& mesh);
  Fingerprint& add(const Points& points);
  std::uint64_t value() const { return value_; }
  /// 16 hexadecimal digits.
  std::string text() const;

 private:
  std::uint64_t value_ = 14695981039346656037U;
};

}  // namespace halfgrad
