// The version of halfgrad; the build reads it from here.
#pragma once

namespace halfgrad {

inline constexpr const char* version = "0.1.0";

}  // namespace halfgrad
