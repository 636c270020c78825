#include "framework/io/input_file.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

#include "framework/error.hpp"
#include "framework/json_reader.hpp"

namespace halfgrad {

namespace {

// " (did you mean …?)" where a file of almost this name stands beside it, else nothing.
std::string similar_name(const std::filesystem::path& path) {
  std::error_code reason;
  std::vector<std::string> names;
  const std::filesystem::path folder = path.parent_path();
  for (const auto& entry : std::filesystem::directory_iterator(folder.empty() ? "." : folder, reason))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  const std::string nearest = nearest_name(path.filename().string(), {names.begin(), names.end()});
  return nearest.empty() ? "" : fmt::format(" (did you mean {}?)", (folder / nearest).string());
}

}  // namespace

InputFile::InputFile(const std::filesystem::path& path) : path_(path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    const int reason = errno;
    raise("{}: cannot be read: {}{}", path.string(), std::strerror(reason), reason == ENOENT ? similar_name(path) : "");
  }
  struct stat status {};
  if (::fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
    ::close(descriptor);
    raise("{}: found {}, expected a file", path.string(), S_ISDIR(status.st_mode) ? "a folder" : "no regular file");
  }
  if (status.st_size == 0) {
    ::close(descriptor);
    raise("{}: the file is empty", path.string());
  }
  const auto size = static_cast<std::size_t>(status.st_size);
  void* data = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, descriptor, 0);
  const int reason = errno;
  ::close(descriptor);
  if (data == MAP_FAILED) raise("{}: cannot be read: {}", path.string(), std::strerror(reason));
  bytes_ = {static_cast<const char*>(data), size};
}

InputFile::~InputFile() { ::munmap(const_cast<char*>(bytes_.data()), bytes_.size()); }

}  // namespace halfgrad
