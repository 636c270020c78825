// halfgrad deform: carries points through a sequence of deformed meshes.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/progress.hpp"

namespace halfgrad::app {

struct DeformOptions {
  std::filesystem::path rest, points, out, report;
  std::string frames;
  std::string interpolant = "phong";
  std::optional<double> alpha;
  std::string reconstructor;  ///< a name or JSON; empty: adaptive, or for dual_taylor kriging with cubic drift
  std::string outside = "error";
  double tolerance = 0;
  bool normals = false, gradients = false;
  std::string precision = "double";
  std::int64_t first = 0, last = -1, step = 1;  ///< frames; −1 is the last one
  ProgressMode progress = ProgressMode::terminal;
  bool quiet = false;
};

/// Runs the command; throws Error on bad input, before the output bears its name.
void deform(const DeformOptions& options);

}  // namespace halfgrad::app
