// Results as one HTML file that opens anywhere.
#pragma once

#include <string>

#include "experiments/results.hpp"

namespace halfgrad {

/// A self-contained page, without script: the finest level as a table with the best of each column marked, convergence
/// inside and at the boundary, run time against error with the Pareto front, errors a frame, the expectations, and the
/// configuration.
std::string results_html(const ExperimentResult& result);

}  // namespace halfgrad
