// Random numbers that are the same on every platform and standard library.
#pragma once

#include <cstdint>
#include <random>

namespace halfgrad {

/// A stream of numbers for one purpose: the same seed and salt give the same stream everywhere.
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, std::uint64_t salt) : engine_(seed * 0x9E3779B97F4A7C15ull + salt) {}
  /// Uniform in [0, 1): the standard fixes the engine, but not its distributions.
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  /// Uniform in [low, high).
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

 private:
  std::mt19937_64 engine_;
};

}  // namespace halfgrad
