// NumPy arrays of any type and shape, alone (.npy) or several in a file (.npz).
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace halfgrad::app {

/// An array as NumPy sees it; the bytes stay the caller's.
struct NumpyArray {
  std::string name;                 ///< its key in an .npz
  std::string type;                 ///< NumPy's type string, e.g. "<f8"
  std::vector<std::int64_t> shape;  ///< empty: a single value
  std::string_view bytes;           ///< in C order
};

/// The type strings of what the program writes.
template <class T>
constexpr const char* numpy_type();
template <>
constexpr const char* numpy_type<double>() {
  return "<f8";
}
template <>
constexpr const char* numpy_type<float>() {
  return "<f4";
}
template <>
constexpr const char* numpy_type<std::int32_t>() {
  return "<i4";
}
template <>
constexpr const char* numpy_type<std::int64_t>() {
  return "<i8";
}

/// An array over `values`, anything with data() and size().
template <class Container>
NumpyArray numpy_array(std::string name, const Container& values, std::vector<std::int64_t> shape) {
  using T = std::remove_cvref_t<decltype(values.data()[0])>;
  return {std::move(name), numpy_type<T>(), std::move(shape),
          std::string_view(reinterpret_cast<const char*>(values.data()),
                           static_cast<std::size_t>(values.size()) * sizeof(T))};
}

/// What stands before the bytes of an array in an .npy file (format version 1.0).
std::string npy_header(std::string_view type, std::span<const std::int64_t> shape);

/// Writes one array, atomically. The name is not stored.
void write_npy_array(const std::filesystem::path& path, const NumpyArray& array);

/// Writes arrays as numpy.savez does: a ZIP file of stored .npy files, atomically. The same arrays give the same bytes.
void write_npz(const std::filesystem::path& path, std::span<const NumpyArray> arrays);

}  // namespace halfgrad::app
