// NumPy arrays of any type and shape, alone (.npy) or several in a file (.npz).
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "framework/io/npy.hpp"

namespace halfgrad::app {

/// An array as NumPy sees it; the bytes stay the caller's.
struct NumpyArray {
  std::string name;                 ///< its key in an .npz
  std::string type;                 ///< NumPy's type string, e.g. "<f8"
  std::vector<std::int64_t> shape;  ///< empty: a single value
  std::string_view bytes;           ///< in C order
};

/// An array over `values`, anything with data() and size().
template <class Container>
NumpyArray numpy_array(std::string name, const Container& values, std::vector<std::int64_t> shape) {
  using T = std::remove_cvref_t<decltype(values.data()[0])>;
  return {std::move(name), npy_type<T>(), std::move(shape),
          std::string_view(reinterpret_cast<const char*>(values.data()),
                           static_cast<std::size_t>(values.size()) * sizeof(T))};
}

/// Writes one array, atomically. The name is not stored.
void write_npy_array(const std::filesystem::path& path, const NumpyArray& array);

/// Writes arrays as numpy.savez does: a ZIP file of stored .npy files, atomically. The same arrays give the same bytes.
void write_npz(const std::filesystem::path& path, std::span<const NumpyArray> arrays);

}  // namespace halfgrad::app
