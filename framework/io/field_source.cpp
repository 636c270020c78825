#include "framework/io/field_source.hpp"

#include "framework/error.hpp"
#include "framework/io/npy.hpp"
#include "framework/json_reader.hpp"

namespace halfgrad {

namespace {

void check_values(const std::string& file, const std::string& name, const Values<double>& values, Index num_vertices) {
  if (values.rows() != num_vertices)
    raise("{}: \"{}\" has {} rows, expected one for each of {} vertices", file, name, values.rows(), num_vertices);
  for (Eigen::Index v = 0; v < values.rows(); ++v)
    if (!values.row(v).allFinite())
      raise("{}: \"{}\" at vertex {} is not finite ({})", file, name, v,
            fmt::join(values.row(v).begin(), values.row(v).end(), ", "));
}

}  // namespace

FieldSource::FieldSource(const std::string& spec, const std::filesystem::path& rest, const FrameSource& frames)
    : name_(spec.substr(0, spec.find('='))), frames_(frames) {
  if (name_.empty()) raise("field \"{}\": expected NAME or NAME=FILE.npy", spec);
  if (name_.size() < spec.size()) {
    const std::string file = spec.substr(name_.size() + 1);
    array_ = open_npy_values(file);
    if (array_->num_vertices() != frames.num_vertices() ||
        (array_->num_frames() != 1 && array_->num_frames() != frames.num_frames()))
      raise("{}: found {} frames of {} vertices, expected {} (or 1) of {}", file, array_->num_frames(),
            array_->num_vertices(), frames.num_frames(), frames.num_vertices());
    return;
  }
  const std::span<const PointArray> moving = frames.arrays();
  if (find_array(moving, name_) != nullptr) return;
  const std::vector<PointArray> fixed = read_points(rest).arrays;
  if (const PointArray* array = find_array(fixed, name_)) {
    constant_ = array->values;
    check_values(rest.string(), name_, constant_, frames.num_vertices());
    return;
  }
  std::vector<std::string_view> known;
  for (const std::span<const PointArray> arrays : {moving, std::span<const PointArray>(fixed)})
    for (const PointArray& array : arrays) known.push_back(array.name);
  raise("field \"{}\": neither {} nor {} has point data of this name; {}", name_, frames.frame_name(0), rest.string(),
        known.empty() ? "they have none: give NAME=FILE.npy" : "they have " + join_names(known));
}

void FieldSource::read(Index frame, Values<double>& out) {
  if (array_) {
    array_->read(array_->num_frames() == 1 ? 0 : frame, out);
  } else if (constant_.size() > 0) {
    out = constant_;
  } else {
    const std::string file = frames_.frame_name(frame);
    const PointArray* array = find_array(frames_.arrays(), name_);
    if (array == nullptr) raise("{}: frame {} has no point data \"{}\"", file, frame, name_);
    check_values(file, name_, array->values, frames_.num_vertices());
    out = array->values;
  }
}

}  // namespace halfgrad
