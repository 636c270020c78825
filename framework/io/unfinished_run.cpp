#include "framework/io/unfinished_run.hpp"

#include <fstream>

#include "framework/error.hpp"

namespace halfgrad {

std::filesystem::path run_mark(const std::filesystem::path& output) {
  return output.parent_path() / ("." + output.filename().string() + ".run");
}

RunMark::RunMark(const std::filesystem::path& output, const FrameSinkOptions& options)
    : path_(run_mark(output)), run_(options.run) {
  if (run_.empty() || options.unfinished == Unfinished::discard) return;
  std::ifstream file(path_);
  std::string found;
  resumes_ = std::getline(file, found) && found == run_ && file >> frame_bytes_;
}

void RunMark::set(std::int64_t frame_bytes) {
  if (is_named()) write_text_atomically(path_, fmt::format("{}\n{}\n", run_, frame_bytes));
}

void RunMark::clear() {
  std::error_code absent;
  if (is_named()) std::filesystem::remove(path_, absent);
}

SeriesFile::SeriesFile(const std::filesystem::path& path, const FrameSinkOptions& options, std::int64_t header_bytes)
    : mark_(path, options),
      file_(mark_.is_named() ? OutputFile::open_unfinished(path) : OutputFile(path)),
      header_bytes_(header_bytes) {
  if (mark_.resumes())
    frame_bytes_ = mark_.frame_bytes();
  else
    file_.truncate(0);
}

SeriesFile::~SeriesFile() {
  if (num_frames_ > 0) return;
  if (mark_.resumes() && num_resumable() > 0) return;
  mark_.clear();
  file_.discard();
}

Index SeriesFile::num_resumable() const {
  if (!mark_.resumes() || frame_bytes_ <= 0) return 0;
  return static_cast<Index>(std::max<std::int64_t>(0, (file_.size() - header_bytes_) / frame_bytes_));
}

void SeriesFile::resume(Index num_frames) {
  file_.truncate(num_frames == 0 ? 0 : header_bytes_ + num_frames * frame_bytes_);
  num_frames_ = num_frames;
}

void SeriesFile::append(std::string_view header, std::string_view frame) {
  const auto bytes = static_cast<std::int64_t>(frame.size());
  if (num_frames_ == 0) {
    // The mark comes first: a file without it is never resumed.
    frame_bytes_ = bytes;
    file_.truncate(0);
    mark_.set(frame_bytes_);
    file_.write(header);
  }
  if (bytes != frame_bytes_)
    raise("{}: frame {} takes {} bytes, the frames before it {}", path().string(), num_frames_, bytes, frame_bytes_);
  file_.write(frame);
  ++num_frames_;
}

void SeriesFile::finish(std::string_view header) {
  if (num_frames_ == 0) raise("{}: no frame was written", path().string());
  file_.overwrite(0, header);
  file_.commit();
  mark_.clear();
}

FileSequence::FileSequence(const std::filesystem::path& output, const FrameSinkOptions& options)
    : mark_(output, options), first_(options.first), step_(options.step) {
  // Files of another run must not pass for frames of this one.
  if (!mark_.resumes()) mark_.clear();
}

void FileSequence::append(const std::filesystem::path& name, std::string_view text) {
  if (!mark_.resumes() && num_frames_ == 0) mark_.set();
  write_text_atomically(name, text);
  ++num_frames_;
}

}  // namespace halfgrad
