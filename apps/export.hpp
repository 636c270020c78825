// halfgrad export: the map from vertices to points, for other programs to apply.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "apps/progress.hpp"

namespace halfgrad::app {

struct ExportOptions {
  std::filesystem::path rest, points, out;
  std::string as;  ///< matrix, stencils or bones; empty: what the output's extension holds
  std::string interpolant = "phong";
  std::optional<double> alpha;
  std::string reconstructor;  ///< a name or JSON; empty: kriging, for dual_taylor with cubic drift
  std::string outside = "error";
  std::string precision = "double";  ///< of weights and transforms in the files
  bool transpose = false;            ///< of the matrix
  std::string frames;                ///< of bones
  std::int64_t first = 0, last = -1, step = 1;
  ProgressMode progress = ProgressMode::terminal;
  bool quiet = false;
};

/// Runs the command; throws Error on bad input, before the output bears its name.
void export_map(const ExportOptions& options);

}  // namespace halfgrad::app
