// halfgrad deform: carries points through a sequence of deformed meshes.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/binding.hpp"
#include "apps/progress.hpp"

namespace halfgrad::app {

struct DeformOptions {
  BindOptions bind;
  std::filesystem::path out, report;
  std::string frames;
  double tolerance = 0;
  std::optional<std::string> normals;  ///< "gradient" or "smooth"
  bool tangents = false;               ///< by the gradients that normals take, which they come with
  bool gradients = false, stretch = false;
  std::vector<std::string> fields;  ///< NAME or NAME=FILE.npy each
  std::string precision = "double";
  std::int64_t first = 0, last = -1, step = 1;  ///< frames; −1 is the last one
  bool resume = false;
  ProgressMode progress = ProgressMode::terminal;
  bool quiet = false;
};

/// A signal ended the run between two frames; what() says how to go on.
struct Interrupted : std::runtime_error {
  Interrupted(const std::string& what, int number) : std::runtime_error(what), signal(number) {}
  int signal;
};

/// Runs the command; throws Error on bad input, before the output bears its name, and Interrupted on SIGINT and
/// SIGTERM.
void deform(const DeformOptions& options);

}  // namespace halfgrad::app
