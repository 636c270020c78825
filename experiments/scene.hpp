// What the interactive report shows in 3D: the points of the finest level, deformed by each rule, frame by frame.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "experiments/point_source.hpp"

namespace halfgrad {

/// Collects the frames of a level as JSON with base64 arrays: positions as 16-bit steps in their bounding box, errors
/// as floats. Long sequences are thinned to evenly spaced frames and the last, and points without faces to every n-th,
/// so that a page stays below about 30 MB; a note in the JSON says so.
class SceneRecorder {
 public:
  /// For so many frames and rules.
  SceneRecorder(const Mesh& mesh, const PointCloud& cloud, std::size_t num_frames, std::size_t num_rules);
  ~SceneRecorder();
  SceneRecorder(SceneRecorder&&) noexcept;

  /// Whether the f-th frame is one of those to show.
  bool wants(std::size_t f) const;
  /// Adds a frame: vertex values (#vertices × #columns), true points and each rule's points (#points × #columns).
  void add(int number, const Points& values, const Points& truth, std::span<const Points> results);
  /// All of it, compact.
  std::string text() const;

 private:
  Points selected(const Points& points) const;

  std::unique_ptr<nlohmann::json> scene_;
  std::vector<char> wanted_;       ///< #frames
  Eigen::Index point_stride_ = 1;  ///< every so many points
  bool is_omitted_ = false;
};

}  // namespace halfgrad
