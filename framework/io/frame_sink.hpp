// Sequences of points, written one frame at a time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "framework/io/point_set.hpp"

namespace halfgrad {

/// What becomes of frames that an interrupted run left.
enum class Unfinished : std::uint8_t { discard, resume };

struct FrameSinkOptions {
  /// Number of the first frame and the distance of numbers: they name the files of a sequence and are its times.
  std::int64_t first = 0, step = 1;
  /// Names the run that writes; only frames of the same run are resumed. Empty: the run cannot be resumed.
  std::string run = {};
  Unfinished unfinished = Unfinished::discard;
};

/// The file that marks a named run as begun and not ended; it is written with the first frame.
std::filesystem::path run_mark(const std::filesystem::path& output);

/// Receives frames in order. A single file appears under its name at finish(); of a file a frame, each appears when its
/// frame is whole. Where a run is named, a single file's frames outlive a failure or a kill as ".name.unfinished" and a
/// sink of the same run can go on behind them; without a name, destruction without finish() removes the file. Float
/// frames are stored as floats, double frames as doubles where the format allows, and ASCII keeps all digits.
class FrameSink {
 public:
  virtual ~FrameSink() = default;

  /// Appends a frame, #points × #columns, the same size for all frames. `arrays` are further data at the points;
  /// formats other than .pvd throw Error where there are any.
  virtual void write(const Values<double>& points, std::span<const PointArray> arrays = {}) = 0;
  virtual void write(const Values<float>& points, std::span<const PointArray> arrays = {}) = 0;

  /// Frames at the front of the sequence that an interrupted run left whole; 0 unless the sink was made to resume.
  virtual Index num_resumable() const = 0;
  /// Keeps this many of them (at most num_resumable()); the next write() is the frame behind.
  virtual void resume(Index num_frames) = 0;

  /// Completes all files and gives them their names.
  virtual void finish() = 0;
};

/// Creates frames of the format of the path's extension: .npy (#frames × #points × #columns; any number of columns;
/// `name.%04d.npy` one array a frame),
/// .pc2, .obj (`name.%04d.obj` for sequences), .pvd (one name_0000.vtp a frame beside it). `shape` gives the faces and,
/// for OBJ, the text whose "v" lines are replaced; its points are not used. Throws Error on an unknown extension, a
/// folder that is missing or cannot be written, a full disk, a single file that another process is writing.
std::unique_ptr<FrameSink> create_frames(const std::filesystem::path& path, const PointSet& shape = {},
                                         const FrameSinkOptions& options = {});

}  // namespace halfgrad
