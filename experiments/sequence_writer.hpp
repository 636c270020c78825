// The deformed points of every rule, frame by frame, for viewers.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "experiments/point_source.hpp"
#include "experiments/results.hpp"
#include "framework/io/frame_sink.hpp"

namespace halfgrad {

/// Writes RULE.pvd and truth.pvd (each with a .vtp a frame) into a folder.
class SequenceWriter {
 public:
  /// One sequence a rule, named by the rows.
  SequenceWriter(const std::filesystem::path& folder, const PointCloud& cloud, std::span<const ResultRow> rules);

  /// Adds a frame: true points and each rule's, #points × #columns.
  void add(const Points& truth, std::span<const Points> results);
  /// Gives all files their names and returns those of the sequences.
  std::vector<std::string> finish();

 private:
  std::vector<std::string> names_;                 ///< the truth first
  std::vector<std::unique_ptr<FrameSink>> sinks_;  ///< likewise
};

}  // namespace halfgrad
