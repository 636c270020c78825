// Results as one HTML file that opens anywhere.
#pragma once

#include <span>
#include <string>

#include "experiments/results.hpp"

namespace halfgrad {

/// A self-contained page, without script: for each result the finest level as a table with the best of each column
/// marked, convergence inside and at the boundary, run time against error with the Pareto front, errors a frame, the
/// expectations, and the configuration. What builds without npm write in place of the interactive page.
std::string results_html(const std::string& title, std::span<const ExperimentResult> results);

}  // namespace halfgrad
