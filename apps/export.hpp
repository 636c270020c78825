// halfgrad export: the map from vertices to points, for other programs to apply.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "apps/binding.hpp"
#include "apps/progress.hpp"

namespace halfgrad::app {

struct ExportOptions {
  BindOptions bind;  ///< the reconstructor preferred is kriging
  std::filesystem::path out;
  std::string as;                    ///< matrix, stencils or bones; empty: what the output's extension holds
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
