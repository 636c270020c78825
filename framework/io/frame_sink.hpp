// Sequences of points, written one frame at a time.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "framework/io/point_set.hpp"

namespace halfgrad {

/// Named values at points or vertices, #points × #columns.
struct PointArray {
  std::string name;
  Values<double> values;
};

/// Receives frames in order. Nothing appears under its final name before finish(); destruction without it removes all
/// that was written. Float frames are stored as floats, double frames as doubles where the format allows, and ASCII
/// keeps all digits.
class FrameSink {
 public:
  virtual ~FrameSink() = default;

  /// Appends a frame, #points × #columns, the same size for all frames. `arrays` are further data at the points;
  /// formats other than .pvd throw Error where there are any.
  virtual void write(const Values<double>& points, std::span<const PointArray> arrays = {}) = 0;
  virtual void write(const Values<float>& points, std::span<const PointArray> arrays = {}) = 0;
  /// Completes all files and gives them their names.
  virtual void finish() = 0;
};

/// Creates frames of the format of the path's extension: .npy (#frames × #points × #columns; any number of columns),
/// .pc2, .obj (`name.%04d.obj` for sequences), .pvd (one name_0000.vtp a frame beside it). `shape` gives the faces and,
/// for OBJ, the text whose "v" lines are replaced; its points are not used. Throws Error on an unknown extension, a
/// folder that is missing or cannot be written, a full disk.
std::unique_ptr<FrameSink> create_frames(const std::filesystem::path& path, const PointSet& shape = {});

}  // namespace halfgrad
