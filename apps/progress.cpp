#include "apps/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace halfgrad::app {

Progress::Progress(ProgressMode mode, std::string label, std::int64_t total, std::string unit)
    : shown_(mode == ProgressMode::always || (mode == ProgressMode::terminal && isatty(STDERR_FILENO) == 1)),
      label_(std::move(label)),
      unit_(std::move(unit)),
      total_(total),
      start_(std::chrono::steady_clock::now()),
      drawn_(start_ - std::chrono::seconds(1)) {}

Progress::~Progress() {
  if (shown_) fmt::print(stderr, "\r\x1b[K");
}

void Progress::advance(std::int64_t done) {
  const auto now = std::chrono::steady_clock::now();
  if (!shown_ || total_ <= 0 || (done < total_ && now - drawn_ < std::chrono::milliseconds(100))) return;
  drawn_ = now;
  const double seconds = std::chrono::duration<double>(now - start_).count();
  const double rate = seconds > 0 ? static_cast<double>(done) / seconds : 0;
  const double left = rate > 0 ? static_cast<double>(total_ - done) / rate : 0;
  constexpr int width = 24;
  const int filled = static_cast<int>(width * std::min(done, total_) / total_);
  fmt::print(stderr, "\r\x1b[K{} [{}{}] {}/{} {}, {:.3g}/s, {:.0f} s left", label_, std::string(filled, '#'),
             std::string(width - filled, '.'), done, total_, unit_, rate, left);
  std::fflush(stderr);
}

}  // namespace halfgrad::app
