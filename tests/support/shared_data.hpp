// Where the shared data of the project lies, which the repository does not contain.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

namespace halfgrad {

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
}

}  // namespace halfgrad
