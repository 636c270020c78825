// What an operation adds to the memory of the process at its peak.
#pragma once

#include <malloc.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <string>

namespace halfgrad::benchmarks {

/// Measures from its construction on. Zero where the system does not tell (/proc of Linux does).
class PeakMemory {
 public:
  PeakMemory() {
    malloc_trim(0);
    std::ofstream("/proc/self/clear_refs") << 5 << std::endl;  // the peak starts anew
    before_ = process_bytes("VmRSS:");
  }
  std::int64_t added_bytes() const { return process_bytes("VmHWM:") - before_; }

 private:
  static std::int64_t process_bytes(const std::string& name) {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
      if (line.starts_with(name)) return 1024 * std::atoll(line.c_str() + name.size());
    return 0;
  }

  std::int64_t before_;
};

}  // namespace halfgrad::benchmarks
