// Sequences of deformed positions, read one frame at a time.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "framework/io/point_set.hpp"

namespace halfgrad {

/// A sequence of frames: positions, or other values of vertices. Holds one frame at most, whatever the length.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  Index num_frames() const { return num_frames_; }
  Index num_vertices() const { return num_vertices_; }
  /// Columns of a frame; of positions 2 or 3, and files other than .npy always have 3.
  int num_columns() const { return num_columns_; }

  /// The file that holds a frame.
  virtual std::string frame_name(Index) const { return name_; }

  /// Further point data in the file of the frame that was read last, the first frame's before any was read; none of
  /// formats that hold positions only.
  virtual std::span<const PointArray> arrays() const { return {}; }

  /// Reads a frame into `out`, resized to #vertices × #columns. Throws Error on a frame out of range, on another number
  /// of vertices than the first frame's and on non-finite values; the message names the file, the frame and the vertex.
  void read(Index frame, Values<double>& out);
  void read(Index frame, Values<float>& out);

 protected:
  FrameSource(std::string name, Index num_frames, Index num_vertices, int num_columns)
      : name_(std::move(name)), num_frames_(num_frames), num_vertices_(num_vertices), num_columns_(num_columns) {}
  /// Fills `out`, which has the right size.
  virtual void fill(Index frame, Values<double>& out) = 0;
  virtual void fill(Index frame, Values<float>& out);

 private:
  template <class Scalar>
  void read_checked(Index frame, Values<Scalar>& out);

  std::string name_;
  Index num_frames_, num_vertices_;
  int num_columns_;
  Values<double> buffer_;  // for sources that only fill double
};

/// Opens frames. `spec` is
/// - an .npy file, #frames × #vertices × 2|3, or #vertices × 2|3 for one frame,
/// - a .pc2 point cache,
/// - a .pvd collection (ordered by timestep), one file a step,
/// - a numbered pattern, `x.%04d.obj`, `x.%d.vtu` or `x_####.vtu`: all numbers from the least to the greatest found
///   must exist,
/// - a glob pattern with * and ? in the file name, `frames/*.vtu`, in natural order (2 before 10),
/// - one mesh or point file: one frame.
/// Files of a collection or pattern hold deformed points, or rest points plus a point vector `displacement`. It is
/// added in files whose points equal those of the first file, provided that the last file's do too; so files that hold
/// deformed points and, besides, a displacement for display are read as they are.
std::unique_ptr<FrameSource> open_frames(const std::string& spec);

}  // namespace halfgrad
