#include "framework/io/output_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "framework/error.hpp"

namespace halfgrad {

namespace {

[[noreturn]] void fail(const std::filesystem::path& path) {
  const std::string reason = std::strerror(errno);
  std::error_code ignored;
  const std::filesystem::path folder = path.parent_path();
  if (!folder.empty() && !std::filesystem::exists(folder, ignored))
    raise("{}: cannot be written: {}: make the folder {} first", path.string(), reason, folder.string());
  raise("{}: cannot be written: {}", path.string(), reason);
}

}  // namespace

OutputFile::OutputFile(const std::filesystem::path& path, std::filesystem::path part, int flags)
    : path_(path), part_(std::move(part)) {
  if (!path.has_filename()) raise("\"{}\": expected the name of a file to write", path.string());
  if (std::error_code ignored; std::filesystem::is_directory(path, ignored))
    raise("{}: found a folder, expected the name of a file to write", path.string());
  descriptor_ = ::open(part_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | flags, 0666);
  if (descriptor_ < 0) fail(path_);
}

OutputFile::OutputFile(const std::filesystem::path& path)
    : OutputFile(path, path.parent_path() / fmt::format(".{}.part-{}", path.filename().string(), ::getpid()), O_TRUNC) {
}

OutputFile OutputFile::open_unfinished(const std::filesystem::path& path) {
  OutputFile file(path, path.parent_path() / fmt::format(".{}.unfinished", path.filename().string()), 0);
  file.outlives_ = true;
  if (::flock(file.descriptor_, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) fail(path);
    raise("{}: another process is writing it", path.string());
  }
  if (::lseek(file.descriptor_, 0, SEEK_END) < 0) fail(path);
  return file;
}

OutputFile::~OutputFile() {
  if (!outlives_) discard();
  if (descriptor_ >= 0) ::close(descriptor_);
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      part_(std::exchange(other.part_, {})),
      descriptor_(std::exchange(other.descriptor_, -1)),
      outlives_(other.outlives_) {}

std::int64_t OutputFile::size() const {
  const off_t size = ::lseek(descriptor_, 0, SEEK_END);
  if (size < 0) fail(path_);
  return size;
}

void OutputFile::truncate(std::int64_t size) {
  if (::ftruncate(descriptor_, size) != 0 || ::lseek(descriptor_, size, SEEK_SET) < 0) fail(path_);
}

void OutputFile::discard() {
  if (!part_.empty()) ::unlink(part_.c_str());
  part_.clear();
}

void OutputFile::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(path_);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

void OutputFile::overwrite(std::int64_t offset, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(descriptor_, bytes.data(), bytes.size(), offset);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(path_);
    bytes.remove_prefix(static_cast<std::size_t>(written));
    offset += written;
  }
}

void OutputFile::commit() {
  // Some file systems report a full disk only here.
  if (descriptor_ >= 0 && ::close(std::exchange(descriptor_, -1)) != 0) fail(path_);
  if (::rename(part_.c_str(), path_.c_str()) != 0) fail(path_);
  part_.clear();
}

void write_text_atomically(const std::filesystem::path& path, std::string_view text) {
  OutputFile file(path);
  file.write(text);
  file.commit();
}

}  // namespace halfgrad
