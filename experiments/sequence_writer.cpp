#include "experiments/sequence_writer.hpp"

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

SequenceWriter::SequenceWriter(const std::filesystem::path& folder, const PointCloud& cloud,
                               std::span<const ResultRow> rules) {
  std::filesystem::create_directories(folder);
  PointSet shape;
  shape.points = cloud.positions;
  shape.faces = cloud.faces;
  std::vector<std::string> stems = {"truth"};
  for (const ResultRow& row : rules) {
    const std::string stem = file_name(rule_name(row.interpolant, row.reconstructor, row.options));
    const auto uses = std::count(stems.begin(), stems.end(), stem);
    stems.push_back(uses == 0 ? stem : stem + "_" + std::to_string(uses + 1));
  }
  for (const std::string& stem : stems) {
    names_.push_back((folder / (stem + ".pvd")).string());
    sinks_.push_back(create_frames(names_.back(), shape));
  }
}

void SequenceWriter::add(const Points& truth, std::span<const Points> results) {
  sinks_[0]->write(truth);
  for (std::size_t r = 0; r < results.size(); ++r) sinks_[r + 1]->write(results[r]);
}

std::vector<std::string> SequenceWriter::finish() {
  for (const std::unique_ptr<FrameSink>& sink : sinks_) sink->finish();
  return names_;
}

}  // namespace halfgrad
