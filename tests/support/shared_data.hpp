<<<<<<< HEAD
// Where the shared data of the project lies, which the repository does not contain.
=======
// Where tests find data that is not part of the repository.
>>>>>>> e4c288f (Kriging reconstructor, ring search, workers with workspace, golden tests (in progress))
#pragma once

#include <cstdlib>
#include <filesystem>
<<<<<<< HEAD
#include <optional>
=======
>>>>>>> e4c288f (Kriging reconstructor, ring search, workers with workspace, golden tests (in progress))
#include <string>

namespace halfgrad {

<<<<<<< HEAD
/// A file or folder of the shared data: below the environment's HALFGRAD_SHARED, else below "shared" beside the
/// checkout. Empty where it is absent; tests that need it then skip.
inline std::optional<std::filesystem::path> shared_path(const std::string& relative) {
  const char* folder = std::getenv("HALFGRAD_SHARED");
  const std::filesystem::path root =
      folder != nullptr ? std::filesystem::path(folder) : std::filesystem::path(PROJECT_SOURCE_DIR) / ".." / "shared";
  const std::filesystem::path path = root / relative;
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return std::nullopt;
  return path;
=======
/// Path of a shared file or folder: below the environment's HALFGRAD_SHARED, else beside the checkout (../shared).
/// Empty where it does not exist; tests skip then.
inline std::filesystem::path shared_path(const std::string& relative) {
  const char* root = std::getenv("HALFGRAD_SHARED");
  const std::filesystem::path path =
      (root ? std::filesystem::path(root) : std::filesystem::path(PROJECT_SOURCE_DIR) / ".." / "shared") / relative;
  return std::filesystem::exists(path) ? path : std::filesystem::path();
>>>>>>> e4c288f (Kriging reconstructor, ring search, workers with workspace, golden tests (in progress))
}

}  // namespace halfgrad
