// The "grid" of a configuration's mesh: cells found by arithmetic.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "framework/grid.hpp"

namespace halfgrad {

/// Grids, coarse to fine.
struct GridSource {
  int gdim = 3;
  /// `refinement` multiplies the number of cells along each axis.
  std::function<Grid(double refinement)> make;
};

/// From {"dimension", "cells", "size", "origin", "grading", "occupied"}. `resolved` receives the object with defaults.
/// Throws Error that names the JSON pointer.
GridSource read_grid_source(const nlohmann::json& specification, const std::string& pointer, nlohmann::json& resolved);

/// The grid with all coordinates multiplied by a factor > 0.
Grid scaled(const Grid& grid, double factor);

}  // namespace halfgrad
