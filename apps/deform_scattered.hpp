// halfgrad deform by a rule that knows vertices only (attribute_transfer, moving_least_squares).
#pragma once

#include "apps/deform.hpp"

namespace halfgrad::app {

/// Whether --interpolant, a name or JSON with options, is such a rule. Throws Error, with the known names, on what is
/// no interpolant.
bool is_scattered(const std::string& interpolant);

/// Runs the command; throws Error on bad input and on options that need cells, before the output bears its name.
void deform_scattered(const DeformOptions& options);

}  // namespace halfgrad::app
