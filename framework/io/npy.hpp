// NumPy arrays (.npy, format versions 1 to 3).
#pragma once

#include <filesystem>
#include <memory>

#include "framework/io/frame_sink.hpp"
#include "framework/io/frame_source.hpp"
#include "framework/io/geometry.hpp"

namespace halfgrad {

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
