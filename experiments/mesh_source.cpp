#include "experiments/mesh_source.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "experiments/ball.hpp"
#include "experiments/grid_source.hpp"
#include "experiments/lattice.hpp"
#include "experiments/per_axis.hpp"
#include "experiments/random_delaunay.hpp"
#include "framework/error.hpp"
#include "framework/io/formats.hpp"
#include "framework/io/mesh_file.hpp"
#include "framework/json_values.hpp"

namespace halfgrad {

using nlohmann::json;

namespace {

int read_refinements(JsonReader& source, double& factor) {
  const std::int64_t levels = source.integer("refinements", 1);
  if (levels < 1 || levels > 12) raise("{}: found {}, expected 1 to 12", source.pointer_to("refinements"), levels);
  factor = source.number("factor", 2);
  if (!(factor > 1)) raise("{}: found {}, expected more than 1", source.pointer_to("factor"), factor);
  return static_cast<int>(levels);
}

MeshSource lattice_source(const json& specification, const std::string& pointer, int levels, double factor,
                          std::uint64_t seed, json& resolved) {
  JsonReader reader(specification, pointer);
  LatticeOptions options;
  options.element = reader.choice("element", lattice_elements(), options.element);
  const std::vector<std::string_view> names = lattice_patterns(options.element);
  if (!names.empty()) options.pattern = reader.choice("pattern", names, names.front());
  const int dim = lattice_dim(options);
  options.cells = per_axis<int>(reader, "cells", 4, dim);
  options.size = per_axis<double>(reader, "size", 1, dim);
  options.origin = per_axis<double>(reader, "origin", 0, dim);
  options.jitter = reader.number("jitter", 0);
  options.warp = reader.number("warp", 0);
  reader.finish();
  resolved = reader.resolved();
  const auto at_level = [=](int level) {
    LatticeOptions finer = options;
    for (int& cells : finer.cells) cells = refined_count(cells, std::pow(factor, level));
    finer.seed = seed + static_cast<std::uint64_t>(level);
    return make_lattice(finer);
  };
  return {levels, dim, at_level};
}

/// The explicit mesh of a grid has the grid's numbers.
MeshSource with_meshes(int levels, int gdim, std::function<Grid(int level)> make_grid) {
  return {levels, gdim, [make_grid](int level) { return make_grid(level).mesh(); }, false, make_grid};
}

MeshSource grid_source(const json& specification, const std::string& pointer, int levels, double factor,
                       json& resolved) {
  const GridSource source = read_grid_source(specification, pointer, resolved);
  return with_meshes(levels, source.gdim, [=](int level) { return source.make(std::pow(factor, level)); });
}

MeshSource ball_source(const json& specification, const std::string& pointer, int gdim, int levels, double factor,
                       std::uint64_t seed, json& resolved) {
  JsonReader reader(specification, pointer);
  BallOptions options;
  options.gdim = gdim;
  options.radius = reader.number("radius", options.radius);
  options.spacing = reader.number("spacing", options.spacing);
  const std::array<double, 3> center = per_axis<double>(reader, "center", 0, gdim);
  options.center = Eigen::Map<const Eigen::VectorXd>(center.data(), gdim);
  reader.finish();
  resolved = reader.resolved();
  const auto at_level = [=](int level) {
    BallOptions finer = options;
    finer.spacing /= std::pow(factor, level);
    finer.seed = seed + static_cast<std::uint64_t>(level);
    return make_ball(finer);
  };
  return {levels, gdim, at_level};
}

MeshSource random_delaunay_source(const json& specification, const std::string& pointer, int levels, double factor,
                                  std::uint64_t seed, json& resolved) {
  JsonReader reader(specification, pointer);
  RandomDelaunayOptions options;
  options.gdim = small_integer(reader, "dimension", options.gdim);
  if (options.gdim != 2 && options.gdim != 3)
    raise("{}: found {}, expected 2 or 3", reader.pointer_to("dimension"), options.gdim);
  options.num_points = small_integer(reader, "vertices", options.num_points);
  reader.finish();
  resolved = reader.resolved();
  const auto at_level = [=](int level) {
    RandomDelaunayOptions finer = options;
    finer.num_points = refined_count(options.num_points, std::pow(factor, options.gdim * level));
    finer.seed = seed + static_cast<std::uint64_t>(level);
    return make_random_delaunay(finer);
  };
  return {levels, options.gdim, at_level};
}

/// The source's one mesh, shrunk about the origin level by level.
MeshSource zoomed(const MeshSource& source, const json& specification, const std::string& pointer, json& resolved) {
  JsonReader reader(specification, pointer);
  const std::int64_t levels = reader.integer("levels", 5), first = reader.integer("first", 0);
  if (levels < 1 || levels > 12) raise("{}: found {}, expected 1 to 12", reader.pointer_to("levels"), levels);
  const double factor = reader.number("factor", 2);
  if (!(factor > 1)) raise("{}: found {}, expected more than 1", reader.pointer_to("factor"), factor);
  reader.finish();
  resolved = reader.resolved();
  if (source.num_levels != 1)
    raise("{}: found a mesh of {} levels, expected one: a zoom makes its own", pointer, source.num_levels);
  const auto scale = [=](int level) { return std::pow(factor, -static_cast<double>(first + level)); };
  if (source.make_grid) {
    MeshSource levelled = with_meshes(static_cast<int>(levels), source.gdim,
                                      [=](int level) { return scaled(source.make_grid(0), scale(level)); });
    levelled.is_zoom = true;
    return levelled;
  }
  const auto at_level = [=](int level) {
    const Mesh mesh = source.make(0);
    return Mesh(mesh.vertices() * scale(level), mesh.blocks());
  };
  return {static_cast<int>(levels), source.gdim, at_level, true};
}

}  // namespace

std::vector<std::filesystem::path> read_paths(const json& value, const std::string& pointer,
                                              const std::filesystem::path& directory) {
  const json list = value.is_array() ? value : json::array({value});
  std::vector<std::filesystem::path> paths;
  for (const json& entry : list) {
    if (!entry.is_string()) raise("{}: found {}, expected a file name or a list of them", pointer, value.dump());
    const std::string name = entry.get<std::string>();
    paths.push_back(directory / name);
    const bool is_pattern = name.find_first_of("%*?#") != std::string::npos;
    if (!is_pattern && !std::filesystem::exists(paths.back()))
      raise("{}: {} does not exist", pointer, paths.back().string());
  }
  if (paths.empty()) raise("{}: found an empty list, expected a file name", pointer);
  return paths;
}

MeshSource read_mesh_source(const json& specification, const std::string& pointer,
                            const std::filesystem::path& directory, std::uint64_t seed, json& resolved) {
  JsonReader reader(specification, pointer);
  MeshSource source;
  int kinds = 0;
  if (const json* file = reader.find("file")) {
    ++kinds;
    const auto paths = read_paths(*file, reader.pointer_to("file"), directory);
    const auto read_grid = find_format(paths[0], FormatUse::read_mesh).read_grid;
    if (read_grid != nullptr)
      source = with_meshes(static_cast<int>(paths.size()), 0, [=](int level) { return read_grid(paths[level]); });
    else
      source = {static_cast<int>(paths.size()), 0, [paths](int level) { return read_mesh(paths[level]); }};
  }
  for (const std::string_view kind : {"lattice", "ball", "disc", "random_delaunay", "grid"}) {
    const json* options = reader.find(kind);
    if (options == nullptr) continue;
    ++kinds;
    double factor = 2;
    const int levels = read_refinements(reader, factor);
    json filled;
    const std::string where = reader.pointer_to(kind);
    if (kind == "lattice")
      source = lattice_source(*options, where, levels, factor, seed, filled);
    else if (kind == "grid")
      source = grid_source(*options, where, levels, factor, filled);
    else if (kind == "random_delaunay")
      source = random_delaunay_source(*options, where, levels, factor, seed, filled);
    else
      source = ball_source(*options, where, kind == "ball" ? 3 : 2, levels, factor, seed, filled);
    reader.record(kind, filled);
  }
  if (kinds != 1)
    raise("{}: found {} of lattice, ball, disc, random_delaunay, grid, file; expected one", pointer, kinds);
  if (const json* zoom = reader.find("zoom")) {
    json filled;
    source = zoomed(source, *zoom, reader.pointer_to("zoom"), filled);
    reader.record("zoom", filled);
  }
  reader.finish();
  resolved = reader.resolved();
  return source;
}

}  // namespace halfgrad
