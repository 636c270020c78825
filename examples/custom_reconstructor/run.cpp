// halfgrad's experiments with one more reconstructor: run CONFIG.json.
#include <fmt/core.h>

#include <experiments/experiment.hpp>
#include <framework/error.hpp>

#include "least_squares.hpp"

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "usage: {} CONFIG.json\n", argv[0]);
    return 2;
  }
  try {
    const halfgrad::ReconstructorEntry mine = least_squares_entry();
    const halfgrad::ExperimentResult result = halfgrad::run_experiment(argv[1], {.reconstructors = {&mine, 1}});
    fmt::print("{}", halfgrad::summary_table(result));
    return result.all_expectations_hold() ? 0 : 3;
  } catch (const halfgrad::Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
