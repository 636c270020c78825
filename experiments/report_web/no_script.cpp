// Stands for the bundled script in builds without npm.
#include "experiments/interactive_report.hpp"

namespace halfgrad {

std::string_view report_script() { return {}; }

}  // namespace halfgrad
