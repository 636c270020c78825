#include "framework/fingerprint.hpp"

#include <fmt/format.h>

namespace halfgrad {

namespace {

template <class Matrix>
std::string_view bytes_of(const Matrix& values) {
  return {reinterpret_cast<const char*>(values.data()),
          static_cast<std::size_t>(values.size()) * sizeof(typename Matrix::Scalar)};
}

}  // namespace

Fingerprint& Fingerprint::add(std::string_view bytes) {
  // The length keeps "ab" + "c" apart from "a" + "bc".
  const std::uint64_t size = bytes.size();
  for (int shift = 0; shift < 64; shift += 8) value_ = (value_ ^ (size >> shift & 255)) * 1099511628211U;
  for (const char byte : bytes) value_ = (value_ ^ static_cast<unsigned char>(byte)) * 1099511628211U;
  return *this;
}

Fingerprint& Fingerprint::add(const Points& points) {
  return add(fmt::format("{} × {}", points.rows(), points.cols())).add(bytes_of(points));
}

Fingerprint& Fingerprint::add(const Mesh& mesh) {
  add(mesh.vertices());
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) {
    add(std::string_view(E::name)).add(bytes_of(block.cells));
  });
  return *this;
}

std::string Fingerprint::text() const { return fmt::format("{:016x}", value_); }

}  // namespace halfgrad
