// What an interrupted run leaves behind, so that the same run can go on.
#pragma once

#include <cstdint>

#include "framework/io/frame_sink.hpp"
#include "framework/io/output_file.hpp"

namespace halfgrad {

/// The mark of a run in progress (see run_mark), which holds the run's name until the run ends.
class RunMark {
 public:
  RunMark(const std::filesystem::path& output, const FrameSinkOptions& options);

  bool is_named() const { return !run_.empty(); }
  /// Whether the same run left frames and is to go on.
  bool resumes() const { return resumes_; }
  /// Bytes a frame, as the earlier process set them.
  std::int64_t frame_bytes() const { return frame_bytes_; }
  void set(std::int64_t frame_bytes = 0);
  void clear();

 private:
  std::filesystem::path path_;
  std::string run_;
  bool resumes_ = false;
  std::int64_t frame_bytes_ = 0;
};

/// A file of a header and frames of equal size.
class SeriesFile {
 public:
  SeriesFile(const std::filesystem::path& path, const FrameSinkOptions& options, std::int64_t header_bytes);
  ~SeriesFile();

  const std::filesystem::path& path() const { return file_.path(); }
  /// Frames in the file.
  std::int32_t num_frames() const { return num_frames_; }
  Index num_resumable() const;
  void resume(Index num_frames);
  /// Appends a frame. The first one decides the size; `header` takes the place of the final one until then.
  void append(std::string_view header, std::string_view frame);
  void finish(std::string_view header);

 private:
  RunMark mark_;
  OutputFile file_;
  std::int64_t header_bytes_, frame_bytes_ = 0;
  std::int32_t num_frames_ = 0;
};

/// Numbers and resumption of output that is one file a frame.
class FileSequence {
 public:
  /// `output` is the name of the whole: a pattern, or a collection.
  FileSequence(const std::filesystem::path& output, const FrameSinkOptions& options);

  Index num_frames() const { return num_frames_; }
  /// The number of a frame in names and times.
  std::int64_t number(Index frame) const { return first_ + frame * step_; }
  /// Leading frames for which `name_of(number)` exists already.
  template <class NameOf>
  Index num_resumable(const NameOf& name_of) const {
    Index count = 0;
    std::error_code absent;
    while (mark_.resumes() && std::filesystem::exists(name_of(number(count)), absent)) ++count;
    return count;
  }
  void resume(Index num_frames) { num_frames_ = num_frames; }
  /// Writes the file of the next frame.
  void append(const std::filesystem::path& name, std::string_view text);
  void finish() { mark_.clear(); }

 private:
  RunMark mark_;
  std::int64_t first_, step_;
  Index num_frames_ = 0;
};

}  // namespace halfgrad
