// halfgrad list and halfgrad info: what there is, and what is in a mesh.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace halfgrad::app {

/// Prints elements, reconstructors, interpolants or fields; all of them where `what` is empty.
void list(const std::string& what, bool as_json);

/// Prints counts, bounds, quality and faults of a mesh file; then throws Error where a fault exceeds a limit,
/// NAME=NUMBER each.
void info(const std::filesystem::path& mesh, const std::vector<std::string>& limits, bool as_json);

}  // namespace halfgrad::app
