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

/// Writes into a folder RULE.pvd and truth.pvd (each with a .vtp a frame), for viewers, and for programs that are to be
/// compared rest_vertices.npy, vertices.npy, rest_points.npy and truth.npy (#frames × #rows × #columns).
class SequenceWriter {
 public:
  /// One sequence a rule, named by the rows.
  SequenceWriter(const std::filesystem::path& folder, const Mesh& mesh, const PointCloud& cloud,
                 std::span<const ResultRow> rules);

  /// Adds a frame: deformed vertices (#vertices × #columns), true points and each rule's (#points × #columns).
  void add(const Points& vertices, const Points& truth, std::span<const Points> results);
  /// Gives all files their names and returns those of the sequences.
  std::vector<std::string> finish();

 private:
  std::unique_ptr<FrameSink> add_sink(const std::filesystem::path& path, const PointSet& shape = {});

  std::vector<std::string> names_;
  std::unique_ptr<FrameSink> rest_vertices_, vertices_, rest_points_, truth_array_, truth_;
  std::vector<std::unique_ptr<FrameSink>> rules_;
};

}  // namespace halfgrad
