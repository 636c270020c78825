#include "framework/io/obj.hpp"

#include <limits>

#include "framework/io/cursor.hpp"
#include "framework/io/frame_pattern.hpp"
#include "framework/io/unfinished_run.hpp"

namespace halfgrad {

namespace {

// The first word of a line, and what follows it.
std::pair<std::string_view, std::string_view> split_word(std::string_view line) {
  const std::size_t begin = std::min(line.find_first_not_of(" \t"), line.size());
  const std::size_t end = std::min(line.find_first_of(" \t\r\n", begin), line.size());
  return {line.substr(begin, end - begin), line.substr(end)};
}

// Vertex of a corner "v", "v/vt", "v//vn" or "v/vt/vn"; negative numbers count back from the last vertex read.
std::int64_t corner_vertex(const Cursor& in, std::string_view corner, std::int64_t num_vertices) {
  std::int64_t number = 0;
  if (!parse_integer(corner.substr(0, corner.find('/')), number) || number == 0)
    in.fail_at_line("found \"{}\", expected a corner such as 7 or 7/1/3", shown(corner));
  const std::int64_t vertex = number > 0 ? number - 1 : num_vertices + number;
  if (vertex < 0) in.fail_at_line("a face names vertex {}, {} are known here", number, num_vertices);
  return vertex;
}

// Its texture vertex, or −1 where it names none that is known so far.
std::int64_t corner_texture(std::string_view corner, std::int64_t num_textures) {
  const std::size_t slash = corner.find('/');
  if (slash == std::string_view::npos) return -1;
  const std::string_view word = corner.substr(slash + 1);
  std::int64_t number = 0;
  if (!parse_integer(word.substr(0, word.find('/')), number)) return -1;
  const std::int64_t texture = number > 0 ? number - 1 : num_textures + number;
  return texture < num_textures ? std::max<std::int64_t>(texture, -1) : -1;
}

template <class Scalar>
void append_position(std::string& text, const Values<Scalar>& points, Eigen::Index row) {
  for (int a = 0; a < 3; ++a) {
    text += ' ';
    fmt::format_to(std::back_inserter(text), "{}", a < points.cols() ? points(row, a) : Scalar{0});
  }
}

class ObjSink final : public FrameSink {
 public:
  ObjSink(const std::filesystem::path& path, const PointSet& shape, const FrameSinkOptions& options)
      : path_(path), pattern_(FramePattern::parse(path.filename().string())), shape_(shape), sequence_(path, options) {}

  void write(const Values<double>& points, std::span<const PointArray> arrays) override { append(points, arrays); }
  void write(const Values<float>& points, std::span<const PointArray> arrays) override { append(points, arrays); }

  Index num_resumable() const override {
    if (!pattern_) return 0;
    return sequence_.num_resumable([&](std::int64_t number) { return file_name(number); });
  }
  void resume(Index num_frames) override { sequence_.resume(num_frames); }
  void finish() override {
    if (sequence_.num_frames() == 0) raise("{}: no frame was written", path_.string());
    sequence_.finish();
  }

 private:
  template <class Scalar>
  void append(const Values<Scalar>& points, std::span<const PointArray> arrays) {
    if (!arrays.empty()) raise("{}: OBJ cannot hold the array \"{}\"", path_.string(), arrays.front().name);
    if (points.cols() != 2 && points.cols() != 3)
      raise("{}: found {} columns, OBJ holds 2 or 3 coordinates", path_.string(), points.cols());
    if (!pattern_ && sequence_.num_frames() > 0)
      raise("{}: a sequence needs a numbered name such as {}.%04d.obj", path_.string(), path_.stem().string());
    const std::string text = shape_.obj_text.empty() ? plain_text(points) : replaced_text(points);
    sequence_.append(file_name(sequence_.number(sequence_.num_frames())), text);
  }

  std::filesystem::path file_name(std::int64_t number) const {
    return pattern_ ? path_.parent_path() / pattern_->name(number) : path_;
  }

  template <class Scalar>
  std::string plain_text(const Values<Scalar>& points) const {
    std::string text;
    for (Eigen::Index v = 0; v < points.rows(); ++v) {
      text += 'v';
      append_position(text, points, v);
      text += '\n';
    }
    for (Index f = 0; f < shape_.faces.num_rows(); ++f) {
      text += 'f';
      for (Index v : shape_.faces[f]) fmt::format_to(std::back_inserter(text), " {}", v + 1);
      text += '\n';
    }
    return text;
  }

  // The input with other coordinates: what follows them on a line (weights, colours, comments) stays.
  template <class Scalar>
  std::string replaced_text(const Values<Scalar>& points) const {
    std::string text;
    text.reserve(shape_.obj_text.size() + static_cast<std::size_t>(8 * points.size()));
    std::string_view left = shape_.obj_text;
    Eigen::Index row = 0;
    while (!left.empty()) {
      const std::size_t size = std::min(left.find('\n'), left.size() - 1) + 1;
      const std::string_view line = left.substr(0, size);
      left.remove_prefix(size);
      auto [keyword, rest] = split_word(line);
      if (keyword != "v") {
        text += line;
        continue;
      }
      if (row == points.rows()) break;
      for (int a = 0; a < 3; ++a) rest = split_word(rest).second;
      text.append(line.data(), keyword.data() + keyword.size());
      append_position(text, points, row++);
      text += rest;
    }
    if (row != points.rows() || !left.empty())
      raise("{}: found {} points, the OBJ text they replace has {}", path_.string(), points.rows(),
            left.empty() ? "fewer" : "more");
    return text;
  }

  std::filesystem::path path_;
  std::optional<FramePattern> pattern_;
  PointSet shape_;
  FileSequence sequence_;
};

}  // namespace

Geometry read_obj(const std::filesystem::path& path) {
  const InputFile file(path);
  Cursor in(file);
  Geometry geometry;
  std::vector<double> positions, textures, corner_uv;
  std::vector<std::int64_t> nodes;
  while (in.remaining() > 0) {
    const auto [keyword, rest] = split_word(in.line());
    if (keyword != "v" && keyword != "f" && keyword != "vt") continue;
    std::string_view left = rest.substr(0, rest.find('#'));
    if (keyword == "vt") {
      // Without a second number v is 0. What is no number at all makes no texture, and its corners none.
      for (int a = 0; a < 2; ++a) {
        const auto [number, after] = split_word(left);
        double value = 0;
        if (!number.empty() && !parse_number(number, value)) value = std::numeric_limits<double>::quiet_NaN();
        textures.push_back(value);
        left = after;
      }
    } else if (keyword == "v") {
      for (int a = 0; a < 3; ++a) {
        const auto [number, after] = split_word(left);
        double value = 0;
        if (!parse_number(number, value))
          in.fail_at_line("found \"{}\", expected three numbers after v", shown(number));
        positions.push_back(value);
        left = after;
      }
    } else {
      nodes.clear();
      for (auto [corner, after] = split_word(left); !corner.empty(); std::tie(corner, after) = split_word(after)) {
        nodes.push_back(corner_vertex(in, corner, static_cast<std::int64_t>(positions.size() / 3)));
        const std::int64_t texture = corner_texture(corner, static_cast<std::int64_t>(textures.size() / 2));
        for (int a = 0; a < 2; ++a)
          corner_uv.push_back(texture < 0 ? std::numeric_limits<double>::quiet_NaN()
                                          : textures[static_cast<std::size_t>(2 * texture + a)]);
      }
      if (nodes.size() < 3) in.fail_at_line("found a face with {} corners, expected three or more", nodes.size());
      geometry.add_cell(7, nodes);
    }
  }
  geometry.vertices = Eigen::Map<const Points>(positions.data(), static_cast<Eigen::Index>(positions.size() / 3), 3);
  if (!textures.empty())
    geometry.corner_uv = Eigen::Map<const Points>(corner_uv.data(), static_cast<Eigen::Index>(corner_uv.size() / 2), 2);
  geometry.obj_text = std::string(file.bytes());
  return geometry;
}

std::unique_ptr<FrameSink> create_obj_frames(const std::filesystem::path& path, const PointSet& shape,
                                             const FrameSinkOptions& options) {
  return std::make_unique<ObjSink>(path, shape, options);
}

}  // namespace halfgrad
