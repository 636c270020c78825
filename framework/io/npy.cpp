#include "framework/io/npy.hpp"

#include <array>
#include <limits>

#include "framework/io/cursor.hpp"
#include "framework/io/frame_pattern.hpp"
#include "framework/io/output_file.hpp"
#include "framework/io/unfinished_run.hpp"

namespace halfgrad {

namespace {

// An array in a mapped file.
struct NpyArray {
  std::string_view data;
  std::vector<std::int64_t> shape;
  bool is_double = true, swap = false, fortran_order = false;

  // An element by its place in the file.
  template <class Scalar>
  Scalar at(std::int64_t element) const {
    return is_double ? value<double, Scalar>(element) : value<float, Scalar>(element);
  }

 private:
  template <class Stored, class Scalar>
  Scalar value(std::int64_t element) const {
    Stored stored;
    std::memcpy(&stored, data.data() + static_cast<std::size_t>(element) * sizeof(Stored), sizeof(Stored));
    return static_cast<Scalar>(swap ? byte_swapped(stored) : stored);
  }
};

// The text of a key's value in the header's dictionary, up to `end`.
std::string_view header_value(Cursor& in, std::string_view header, std::string_view key, std::string_view ends) {
  const std::size_t found = header.find(fmt::format("'{}':", key));
  if (found == std::string_view::npos) in.fail_at_byte("the header has no key '{}': {}", key, shown(header));
  std::string_view value = header.substr(found + key.size() + 3);
  value.remove_prefix(std::min(value.find_first_not_of(' '), value.size()));
  return value.substr(0, value.find_first_of(ends));
}

NpyArray parse_npy(const InputFile& file) {
  Cursor in(file);
  if (!file.bytes().starts_with("\x93NUMPY")) in.fail_at_byte("found no NumPy signature, expected \\x93NUMPY");
  in.skip(6, "the signature");
  const int version = in.binary<std::uint8_t>("the version");
  in.skip(1, "the version");
  if (version < 1 || version > 3) in.fail_at_byte("found version {}, expected 1, 2 or 3", version);
  constexpr bool big_endian = std::endian::native == std::endian::big;
  const std::size_t size = version == 1 ? in.binary<std::uint16_t>("the header's size", big_endian)
                                        : in.binary<std::uint32_t>("the header's size", big_endian);
  const std::size_t begin = in.position();
  in.skip(size, "the header");
  const std::string_view header = file.bytes().substr(begin, size);

  NpyArray array;
  const std::string_view type = header_value(in, header, "descr", ",}");
  if (type != "'<f4'" && type != "'<f8'" && type != "'>f4'" && type != "'>f8'")
    in.fail_at_byte("found element type {}, expected '<f4', '<f8', '>f4' or '>f8'", shown(type));
  array.is_double = type[3] == '8';
  array.swap = (type[1] == '>') != big_endian;
  const std::string_view order = header_value(in, header, "fortran_order", ",} ");
  if (order != "True" && order != "False")
    in.fail_at_byte("found fortran_order {}, expected True or False", shown(order));
  array.fortran_order = order == "True";

  std::string_view shape = header_value(in, header, "shape", ")");
  if (!shape.starts_with('(')) in.fail_at_byte("found shape {}, expected a tuple", shown(shape));
  shape.remove_prefix(1);
  const std::size_t available = in.remaining();
  std::size_t bytes = array.is_double ? 8 : 4;
  for (std::size_t at = 0; at < shape.size();) {
    const std::size_t end = std::min(shape.find(',', at), shape.size());
    std::string_view text = shape.substr(at, end - at);
    text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
    at = end + 1;
    if (text.empty()) break;
    std::int64_t extent = 0;
    if (!parse_integer(text, extent) || extent < 0)
      in.fail_at_byte("found extent \"{}\" in the shape, expected a count", shown(text));
    array.shape.push_back(extent);
    if (extent != 0 && bytes > std::numeric_limits<std::size_t>::max() / static_cast<std::size_t>(extent))
      in.fail_at_byte("found shape ({}), but only {} bytes follow", shown(shape), available);
    bytes *= static_cast<std::size_t>(extent);
  }
  if (bytes != available)
    in.fail_at_byte("found shape ({}), which takes {} bytes, but {} bytes follow", shown(shape), bytes, available);
  array.data = file.bytes().substr(in.position());
  return array;
}

// Row-major rows of frame `frame` of an array of shape (#frames,) #rows, #columns.
template <class Scalar>
void copy_frame(const NpyArray& array, std::int64_t frame, Values<Scalar>& out) {
  const std::int64_t rows = out.rows(), columns = out.cols();
  const std::int64_t frames = array.shape.size() == 3 ? array.shape[0] : 1;
  for (std::int64_t v = 0; v < rows; ++v)
    for (std::int64_t a = 0; a < columns; ++a)
      out(v, a) =
          array.at<Scalar>(array.fortran_order ? frame + frames * (v + rows * a) : (frame * rows + v) * columns + a);
}

// Throws unless the shape is (frames,) rows, columns with a number of columns within the bounds.
void check_shape(const InputFile& file, const NpyArray& array, std::int64_t min_columns, std::int64_t max_columns,
                 std::string_view expected) {
  const std::size_t d = array.shape.size();
  const bool fits = (d == 2 || d == 3) && array.shape[d - 2] <= std::numeric_limits<Index>::max() &&
                    array.shape[0] <= std::numeric_limits<Index>::max() && array.shape[0] > 0 &&
                    array.shape[d - 1] >= min_columns && array.shape[d - 1] <= max_columns;
  if (!fits)
    raise("{}: found an array of shape ({}), expected {}", file.path().string(), fmt::join(array.shape, ", "),
          expected);
}

class NpyFrames final : public FrameSource {
 public:
  NpyFrames(std::unique_ptr<InputFile> file, NpyArray array)
      : FrameSource(file->path().string(), array.shape.size() == 3 ? static_cast<Index>(array.shape[0]) : 1,
                    static_cast<Index>(array.shape[array.shape.size() - 2]), static_cast<int>(array.shape.back())),
        file_(std::move(file)),
        array_(std::move(array)) {}

 private:
  void fill(Index frame, Values<double>& out) override { copy_frame(array_, frame, out); }
  void fill(Index frame, Values<float>& out) override { copy_frame(array_, frame, out); }

  std::unique_ptr<InputFile> file_;  // keeps the mapping
  NpyArray array_;
};

// Of a sequence of frames: room for three extents of any size.
constexpr std::size_t header_size = 128;

template <class Scalar>
std::string_view bytes_of(const Values<Scalar>& values) {
  return {reinterpret_cast<const char*>(values.data()), static_cast<std::size_t>(values.size()) * sizeof(Scalar)};
}

class NpySink final : public FrameSink {
 public:
  NpySink(const std::filesystem::path& path, const FrameSinkOptions& options) : file_(path, options, header_size) {}

  void write(const Values<double>& points, std::span<const PointArray> arrays) override { append(points, arrays); }
  void write(const Values<float>& points, std::span<const PointArray> arrays) override { append(points, arrays); }

  Index num_resumable() const override { return file_.num_resumable(); }
  void resume(Index num_frames) override { file_.resume(num_frames); }
  void finish() override { file_.finish(header(file_.num_frames())); }

 private:
  std::string header(std::int64_t num_frames) const {
    return npy_header(is_double_ ? npy_type<double>() : npy_type<float>(), std::array{num_frames, rows_, columns_});
  }

  template <class Scalar>
  void append(const Values<Scalar>& points, std::span<const PointArray> arrays) {
    const std::string name = file_.path().string();
    if (!arrays.empty()) raise("{}: .npy cannot hold the array \"{}\"", name, arrays.front().name);
    constexpr bool is_double = sizeof(Scalar) == 8;
    if (columns_ == 0) {
      is_double_ = is_double;
      rows_ = points.rows();
      columns_ = points.cols();
    }
    if (points.rows() != rows_ || points.cols() != columns_ || is_double != is_double_)
      raise("{}: frame {} is {} × {} of {} bytes, expected {} × {} of {} as the first", name, file_.num_frames(),
            points.rows(), points.cols(), sizeof(Scalar), rows_, columns_, is_double_ ? 8 : 4);
    file_.append(header(0), bytes_of(points));
  }

  SeriesFile file_;
  bool is_double_ = true;
  std::int64_t rows_ = 0, columns_ = 0;
};

template <class Scalar>
std::string array_text(const Values<Scalar>& values) {
  std::string text = npy_header(npy_type<Scalar>(), std::array<std::int64_t, 2>{values.rows(), values.cols()});
  return text.append(bytes_of(values));
}

// One array a frame, where the name has a %d.
class NpySequence final : public FrameSink {
 public:
  NpySequence(const std::filesystem::path& path, FramePattern pattern, const FrameSinkOptions& options)
      : path_(path), pattern_(std::move(pattern)), sequence_(path, options) {}

  void write(const Values<double>& points, std::span<const PointArray> arrays) override { append(points, arrays); }
  void write(const Values<float>& points, std::span<const PointArray> arrays) override { append(points, arrays); }

  Index num_resumable() const override {
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
    if (!arrays.empty()) raise("{}: .npy cannot hold the array \"{}\"", path_.string(), arrays.front().name);
    sequence_.append(file_name(sequence_.number(sequence_.num_frames())), array_text(points));
  }
  std::filesystem::path file_name(std::int64_t number) const { return path_.parent_path() / pattern_.name(number); }

  std::filesystem::path path_;
  FramePattern pattern_;
  FileSequence sequence_;
};

template <class Scalar>
void write_array(const std::filesystem::path& path, const Values<Scalar>& values) {
  write_text_atomically(path, array_text(values));
}

}  // namespace

std::string npy_header(std::string_view type, std::span<const std::int64_t> shape) {
  std::string text = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}{}), }}", type,
                                 fmt::join(shape, ", "), shape.size() == 1 ? "," : "");
  // Ten bytes stand before the text, a line's end behind it; NumPy asks for a multiple of 64 bytes in all.
  text.resize(std::max(header_size, (text.size() + 11 + 63) / 64 * 64) - 11, ' ');
  text += '\n';
  return std::string("\x93NUMPY\x01\x00", 8) + static_cast<char>(text.size() & 255) +
         static_cast<char>(text.size() >> 8) + text;
}

void write_npy(const std::filesystem::path& path, const Values<double>& values) { write_array(path, values); }
void write_npy(const std::filesystem::path& path, const Values<float>& values) { write_array(path, values); }

Values<double> read_npy(const std::filesystem::path& path) {
  const InputFile file(path);
  const NpyArray array = parse_npy(file);
  if (array.shape.size() != 2)
    raise("{}: found an array of shape ({}), expected #rows × #columns", path.string(), fmt::join(array.shape, ", "));
  // An array without columns may claim any number of rows.
  check_shape(file, array, 1, std::numeric_limits<Index>::max(), "#rows × #columns with values");
  Values<double> values(array.shape[0], array.shape[1]);
  copy_frame(array, 0, values);
  return values;
}

Geometry read_npy_geometry(const std::filesystem::path& path) {
  const InputFile file(path);
  const NpyArray array = parse_npy(file);
  if (array.shape.size() != 2)
    raise("{}: found an array of shape ({}), expected #points × 2 or 3", path.string(), fmt::join(array.shape, ", "));
  check_shape(file, array, 2, 3, "#points × 2 or 3");
  Geometry geometry;
  geometry.vertices.resize(array.shape[0], array.shape[1]);
  copy_frame(array, 0, geometry.vertices);
  return geometry;
}

std::unique_ptr<FrameSource> open_npy_frames(const std::filesystem::path& path) {
  auto file = std::make_unique<InputFile>(path);
  NpyArray array = parse_npy(*file);
  check_shape(*file, array, 2, 3, "#frames × #vertices × 2 or 3, or #vertices × 2 or 3");
  return std::make_unique<NpyFrames>(std::move(file), std::move(array));
}

std::unique_ptr<FrameSource> open_npy_values(const std::filesystem::path& path) {
  auto file = std::make_unique<InputFile>(path);
  NpyArray array = parse_npy(*file);
  if (array.shape.size() == 1) array.shape.push_back(1);
  check_shape(*file, array, 1, 1'000'000, "#frames × #vertices × #columns, #vertices × #columns or #vertices");
  return std::make_unique<NpyFrames>(std::move(file), std::move(array));
}

std::unique_ptr<FrameSink> create_npy_frames(const std::filesystem::path& path, const PointSet&,
                                             const FrameSinkOptions& options) {
  if (auto pattern = FramePattern::parse(path.filename().string()))
    return std::make_unique<NpySequence>(path, std::move(*pattern), options);
  return std::make_unique<NpySink>(path, options);
}

}  // namespace halfgrad
