// NumPy arrays (.npy, format versions 1 to 3).
#pragma once

#include <bit>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <type_traits>

#include "framework/io/frame_sink.hpp"
#include "framework/io/frame_source.hpp"
#include "framework/io/geometry.hpp"

namespace halfgrad {

/// NumPy's type string of a number as it stands in memory, "<f8" for a double.
template <class T>
std::string npy_type() {
  static_assert(std::is_arithmetic_v<T>);
  return std::string(std::endian::native == std::endian::little ? "<" : ">") +
         (std::is_floating_point_v<T> ? "f"
          : std::is_signed_v<T>       ? "i"
                                      : "u") +
         std::to_string(sizeof(T));
}
/// What stands before the bytes of an array in C order (format version 1.0). Its size is the same for all arrays of up
/// to three dimensions, so that a number of frames can be put in at the end. An empty shape is that of a single value.
std::string npy_header(std::string_view type, std::span<const std::int64_t> shape);

/// Writes #rows × #columns values as a two-dimensional array, atomically.
void write_npy(const std::filesystem::path& path, const Values<double>& values);
void write_npy(const std::filesystem::path& path, const Values<float>& values);
/// Reads a two-dimensional array of floats of either size, byte order and storage order; any number of columns.
Values<double> read_npy(const std::filesystem::path& path);

/// The points of a two-dimensional array with two or three columns.
Geometry read_npy_geometry(const std::filesystem::path& path);
/// Values of any number of columns: #frames × #vertices × #columns, or #vertices × #columns or #vertices for one frame.
std::unique_ptr<FrameSource> open_npy_values(const std::filesystem::path& path);
/// Positions: the same with two or three columns.
std::unique_ptr<FrameSource> open_npy_frames(const std::filesystem::path& path);
std::unique_ptr<FrameSink> create_npy_frames(const std::filesystem::path& path, const PointSet& shape,
                                             const FrameSinkOptions& options);

}  // namespace halfgrad
