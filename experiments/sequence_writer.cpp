#include "experiments/sequence_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace halfgrad {

namespace {

/// "phong + kriging (patch wide)" as "phong_kriging_patch_wide".
std::string file_name(const std::string& rule) {
  std::string name;
  for (const char c : rule) {
    const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-';
    if (is_plain) name += c;
    if (!is_plain && !name.empty() && name.back() != '_') name += '_';
  }
  while (!name.empty() && name.back() == '_') name.pop_back();
  return name;
}

}  // namespace

SequenceWriter::SequenceWriter(const std::filesystem::path& folder, const Mesh& mesh, const PointCloud& cloud,
                               std::span<const ResultRow> rules) {
  std::filesystem::create_directories(folder);
  rest_vertices_ = add_sink(folder / "rest_vertices.npy");
  rest_vertices_->write(mesh.vertices());
  vertices_ = add_sink(folder / "vertices.npy");
  rest_points_ = add_sink(folder / "rest_points.npy");
  rest_points_->write(cloud.positions);
  truth_array_ = add_sink(folder / "truth.npy");
  PointSet shape;
  shape.points = cloud.positions;
  shape.faces = cloud.faces;
  truth_ = add_sink(folder / "truth.pvd", shape);
  std::vector<std::string> stems;
  for (const ResultRow& row : rules) {
    const std::string stem = file_name(rule_name(row.interpolant, row.reconstructor, row.options));
    const auto uses = std::count(stems.begin(), stems.end(), stem);
    stems.push_back(stem);
    rules_.push_back(add_sink(folder / ((uses == 0 ? stem : fmt::format("{}_{}", stem, uses + 1)) + ".pvd"), shape));
  }
}

std::unique_ptr<FrameSink> SequenceWriter::add_sink(const std::filesystem::path& path, const PointSet& shape) {
  names_.push_back(path.string());
  return create_frames(path, shape);
}

void SequenceWriter::add(const Points& vertices, const Points& truth, std::span<const Points> results) {
  vertices_->write(vertices);
  truth_array_->write(truth);
  truth_->write(truth);
  for (std::size_t r = 0; r < results.size(); ++r) rules_[r]->write(results[r]);
}

std::vector<std::string> SequenceWriter::finish() {
  for (FrameSink* sink : {rest_vertices_.get(), vertices_.get(), rest_points_.get(), truth_array_.get(), truth_.get()})
    sink->finish();
  for (const std::unique_ptr<FrameSink>& sink : rules_) sink->finish();
  return names_;
}

}  // namespace halfgrad
