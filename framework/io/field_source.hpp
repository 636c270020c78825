// Further values at the vertices, frame by frame: colours, stresses, temperatures.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "framework/io/frame_source.hpp"

namespace halfgrad {

/// Values of the vertices besides their positions.
class FieldSource {
 public:
  /// `spec` is NAME=FILE.npy, #frames × #vertices × #columns, or #vertices × #columns or #vertices for values that
  /// stay; or NAME, the point data of that name in the files of `frames`, or else in `rest`, where they stay. Throws
  /// Error where the name is in neither (lists those that are), and on another number of vertices or frames.
  FieldSource(const std::string& spec, const std::filesystem::path& rest, const FrameSource& frames);

  const std::string& name() const { return name_; }
  /// The values of the frame that `frames` read last, #vertices × #columns. Throws Error on non-finite values.
  void read(Index frame, Values<double>& out);

 private:
  std::string name_;
  const FrameSource& frames_;
  std::unique_ptr<FrameSource> array_;  // of NAME=FILE
  Values<double> constant_;             // of the rest mesh
};

}  // namespace halfgrad
