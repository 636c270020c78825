// Files that appear under their name when they are whole.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace halfgrad {

/// A file that is written as ".name.part-PID" beside its name and renamed by commit(). Destruction without commit()
/// removes it. All failures throw Error with the path and the system's reason.
class OutputFile {
 public:
  explicit OutputFile(const std::filesystem::path& path);
  /// A file that outlives its process: it is written as ".name.unfinished", which destruction leaves where it is.
  /// Opens what an earlier process left; throws Error where another process is writing it.
  static OutputFile open_unfinished(const std::filesystem::path& path);
  ~OutputFile();
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::int64_t size() const;
  /// Drops all bytes from `size` on.
  void truncate(std::int64_t size);
  void write(std::string_view bytes);
  /// Overwrites bytes written before, for headers that hold a count.
  void overwrite(std::int64_t offset, std::string_view bytes);
  void commit();
  /// Removes the file, unfinished as it is.
  void discard();

 private:
  OutputFile(const std::filesystem::path& path, std::filesystem::path part, int flags);

  std::filesystem::path path_, part_;
  int descriptor_ = -1;
  bool outlives_ = false;
};

/// Writes a whole file at once.
void write_text_atomically(const std::filesystem::path& path, std::string_view text);

}  // namespace halfgrad
