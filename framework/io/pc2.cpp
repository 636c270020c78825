#include "framework/io/pc2.hpp"

#include <cmath>
#include <limits>

#include "framework/io/cursor.hpp"
#include "framework/io/unfinished_run.hpp"

namespace halfgrad {

namespace {

constexpr std::size_t header_size = 32;
constexpr bool swap_bytes = std::endian::native == std::endian::big;
constexpr std::string_view signature{"POINTCACHE2\0", 12};

class Pc2Frames final : public FrameSource {
 public:
  Pc2Frames(std::unique_ptr<InputFile> file, Index num_frames, Index num_vertices)
      : FrameSource(file->path().string(), num_frames, num_vertices, 3), file_(std::move(file)) {}

 private:
  void fill(Index frame, Values<double>& out) override { copy(frame, out); }
  void fill(Index frame, Values<float>& out) override { copy(frame, out); }

  template <class Scalar>
  void copy(Index frame, Values<Scalar>& out) const {
    const char* data = file_->bytes().data() + header_size +
                       12 * static_cast<std::size_t>(frame) * static_cast<std::size_t>(num_vertices());
    for (Eigen::Index i = 0; i < out.size(); ++i) {
      float value;
      std::memcpy(&value, data + 4 * i, 4);
      out.data()[i] = static_cast<Scalar>(swap_bytes ? byte_swapped(value) : value);
    }
  }

  std::unique_ptr<InputFile> file_;
};

template <class T>
void append_value(std::string& bytes, T value) {
  if (swap_bytes) value = byte_swapped(value);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

class Pc2Sink final : public FrameSink {
 public:
  Pc2Sink(const std::filesystem::path& path, const FrameSinkOptions& options)
      : file_(path, options, header_size), first_(options.first), step_(options.step) {}

  void write(const Values<double>& points, std::span<const PointArray> arrays) override { append(points, arrays); }
  void write(const Values<float>& points, std::span<const PointArray> arrays) override { append(points, arrays); }

  Index num_resumable() const override { return file_.num_resumable(); }
  void resume(Index num_frames) override { file_.resume(num_frames); }
  void finish() override { file_.finish(header(file_.num_frames())); }

 private:
  std::string header(std::int32_t num_frames) const {
    std::string bytes(signature);
    append_value(bytes, std::int32_t{1});
    append_value(bytes, num_points_);
    append_value(bytes, static_cast<float>(first_));
    append_value(bytes, static_cast<float>(step_));
    append_value(bytes, num_frames);
    return bytes;
  }

  template <class Scalar>
  void append(const Values<Scalar>& points, std::span<const PointArray> arrays) {
    const std::string name = file_.path().string();
    if (!arrays.empty()) raise("{}: PC2 cannot hold the array \"{}\"", name, arrays.front().name);
    if (points.cols() != 2 && points.cols() != 3)
      raise("{}: found {} columns, PC2 holds 2 or 3 coordinates", name, points.cols());
    if (num_points_ != 0 && points.rows() != num_points_)
      raise("{}: frame {} has {} points, expected {} as the first", name, file_.num_frames(), points.rows(),
            num_points_);
    std::string bytes;
    bytes.reserve(static_cast<std::size_t>(12 * points.rows()));
    for (Eigen::Index v = 0; v < points.rows(); ++v)
      for (int a = 0; a < 3; ++a) {
        const Scalar value = a < points.cols() ? points(v, a) : Scalar{0};
        if (std::isfinite(value) && std::abs(value) > std::numeric_limits<float>::max())
          raise("{}: frame {}: point {} has coordinate {}, beyond the floats that PC2 holds", name, file_.num_frames(),
                v, value);
        append_value(bytes, static_cast<float>(value));
      }
    // Only now: a frame that was refused settles nothing.
    num_points_ = static_cast<std::int32_t>(points.rows());
    file_.append(header(0), bytes);
  }

  SeriesFile file_;
  std::int64_t first_, step_;
  std::int32_t num_points_ = 0;
};

}  // namespace

std::unique_ptr<FrameSource> open_pc2_frames(const std::filesystem::path& path) {
  auto file = std::make_unique<InputFile>(path);
  Cursor in(*file);
  if (!file->bytes().starts_with(signature)) in.fail_at_byte("found no PC2 signature, expected POINTCACHE2");
  in.skip(signature.size(), "the signature");
  const auto version = in.binary<std::int32_t>("the version", swap_bytes);
  if (version != 1) in.fail_at_byte("found version {}, expected 1", version);
  const auto num_points = in.binary<std::int32_t>("the number of points", swap_bytes);
  in.skip(8, "start and rate");
  const auto num_frames = in.binary<std::int32_t>("the number of frames", swap_bytes);
  if (num_points < 1 || num_frames < 1)
    in.fail_at_byte("found {} points in {} frames, expected at least one", num_points, num_frames);
  const std::size_t available = in.remaining() / 12 / static_cast<std::size_t>(num_points);
  if (available < static_cast<std::size_t>(num_frames))
    in.fail_at_byte("found {} frames of {} points, but the {} bytes that follow hold {}", num_frames, num_points,
                    in.remaining(), available);
  return std::make_unique<Pc2Frames>(std::move(file), num_frames, num_points);
}

std::unique_ptr<FrameSink> create_pc2_frames(const std::filesystem::path& path, const PointSet&,
                                             const FrameSinkOptions& options) {
  return std::make_unique<Pc2Sink>(path, options);
}

}  // namespace halfgrad
