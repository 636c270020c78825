// Runs a configuration: every level, frame, interpolant and reconstructor, to errors, orders and expectations.
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "experiments/results.hpp"
#include "reconstruction/registry.hpp"

namespace halfgrad {

struct RunOptions {
  std::filesystem::path out_directory = {};  ///< for results.json and the other outputs; empty writes nothing
  std::vector<std::string> overrides = {};   ///< "/json/pointer=VALUE", VALUE as JSON or, where it is none, as a string
  bool reduced = false;                      ///< apply the configuration's "reduced" object first
  bool check_only = false;                   ///< read and validate; the result has a name and a config only
  std::span<const ReconstructorEntry> reconstructors = {};  ///< of the caller's own, besides the registry's
  std::function<void(std::string_view stage, double fraction)> progress = {};  ///< called from the running thread
};

/// Runs a configuration file. Throws Error on bad input, before any file is written.
ExperimentResult run_experiment(const std::filesystem::path& config, const RunOptions& options = {});

/// The table that a terminal shows: the finest level a line per rule, then orders, then expectations.
std::string summary_table(const ExperimentResult& result);

/// results.json and results.csv as text.
std::string results_json(const ExperimentResult& result);
std::string results_csv(const ExperimentResult& result);

}  // namespace halfgrad
