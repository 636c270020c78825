// A progress line on stderr.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

namespace halfgrad::app {

/// When to show progress.
enum class ProgressMode { terminal, always, never };

/// One line that is rewritten in place: bar, count, rate and time left. Draws at most ten times a second; erases
/// itself.
class Progress {
 public:
  /// `unit` names what is counted ("frames").
  Progress(ProgressMode mode, std::string label, std::int64_t total, std::string unit);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void advance(std::int64_t done);

 private:
  bool shown_;
  std::string label_, unit_;
  std::int64_t total_;
  std::chrono::steady_clock::time_point start_, drawn_;
};

}  // namespace halfgrad::app
