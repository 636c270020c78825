// Files read through a mapping.
#pragma once

#include <filesystem>
#include <string_view>

namespace halfgrad {

/// The bytes of a whole file, mapped. Throws Error where it is missing, a directory, empty or unreadable.
class InputFile {
 public:
  explicit InputFile(const std::filesystem::path& path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::string_view bytes() const { return bytes_; }

 private:
  std::filesystem::path path_;
  std::string_view bytes_;
};

}  // namespace halfgrad
