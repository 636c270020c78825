// The "mesh" of a configuration: generated levels, or files from coarse to fine.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "framework/grid.hpp"

namespace halfgrad {

/// Levels of a mesh, coarse to fine, made on demand.
struct MeshSource {
  int num_levels = 1;
  int gdim = 3;  ///< 0 where only the file knows
  std::function<Mesh(int level)> make;
  bool is_zoom = false;                           ///< the levels are one mesh at several sizes
  std::function<Grid(int level)> make_grid = {};  ///< the same levels as grids; empty where they are none
};

/// From {"lattice": {…}, "refinements": n}, {"ball": {…}}, {"disc": {…}}, {"random_delaunay": {…}}, {"grid": {…}},
/// {"file": name or list}, with "zoom": {…} shrunk level by level. Relative paths start at `directory`. `resolved`
/// receives the object with defaults. Throws Error that names the JSON pointer.
MeshSource read_mesh_source(const nlohmann::json& specification, const std::string& pointer,
                            const std::filesystem::path& directory, std::uint64_t seed, nlohmann::json& resolved);

/// A file name or a list of them under a key, relative to `directory`. Throws Error that names the pointer.
std::vector<std::filesystem::path> read_paths(const nlohmann::json& value, const std::string& pointer,
                                              const std::filesystem::path& directory);

}  // namespace halfgrad
