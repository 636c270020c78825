// Several runs in one page.
#pragma once

#include <filesystem>
#include <span>

#include "experiments/results.hpp"

namespace halfgrad {

/// Reads a results.json back. Throws Error that names the file and what is wrong in it.
ExperimentResult read_results(const std::filesystem::path& file);

/// Writes one page for the runs in the folders (each with a results.json, and a scene.json for the 3D view where the
/// run wrote one). Throws Error on a folder without results, before the page appears.
void write_merged_report(std::span<const std::filesystem::path> folders, const std::filesystem::path& out);

}  // namespace halfgrad
