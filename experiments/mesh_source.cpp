#include "experiments/mesh_source.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "experiments/ball.hpp"
#include "experiments/lattice.hpp"
#include "experiments/random_delaunay.hpp"
#include "framework/error.hpp"
#include "framework/io/mesh_file.hpp"
#include "framework/json_reader.hpp"

namespace halfgrad {

using nlohmann::json;

namespace {

/// One number, or one a given axis.
template <class Number>
std::array<Number, 3> per_axis(JsonReader& options, std::string_view key, Number fallback, int dim) {
  std::array<Number, 3> values;
  values.fill(fallback);
  const json* given = options.find(key);
  if (given == nullptr) {
    options.record(key, fallback);
    return values;
  }
  if (given->is_array()) {
    const bool numbers = std::all_of(given->begin(), given->end(), [](const json& entry) { return entry.is_number(); });
    if (!numbers || static_cast<int>(given->size()) != dim)
      raise("{}: found {}, expected a number or an array of {}", options.pointer_to(key), given->dump(), dim);
    for (int a = 0; a < dim; ++a) values[a] = (*given)[a].get<Number>();
  } else if constexpr (std::is_integral_v<Number>) {
    values.fill(static_cast<Number>(options.integer(key)));
  } else {
    values.fill(options.number(key));
  }
  return values;
}

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
  int dim = 0;
  Elements::for_each([&]<class E>() {
    if (E::name == options.element) dim = E::dim;
  });
  const std::vector<std::string_view> names = lattice_patterns(options.element);
  if (!names.empty()) options.pattern = reader.choice("pattern", names, names.front());
  options.cells = per_axis<int>(reader, "cells", 4, dim);
  options.size = per_axis<double>(reader, "size", 1, dim);
  options.origin = per_axis<double>(reader, "origin", 0, dim);
  options.jitter = reader.number("jitter", 0);
  options.warp = reader.number("warp", 0);
  reader.finish();
  resolved = reader.resolved();
  const auto at_level = [=](int level) {
    LatticeOptions finer = options;
    for (int& cells : finer.cells) cells = static_cast<int>(std::lround(cells * std::pow(factor, level)));
    finer.seed = seed + static_cast<std::uint64_t>(level);
    return make_lattice(finer);
  };
  return {levels, dim, at_level};
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
  options.gdim = static_cast<int>(reader.integer("dimension", options.gdim));
  if (options.gdim != 2 && options.gdim != 3)
    raise("{}: found {}, expected 2 or 3", reader.pointer_to("dimension"), options.gdim);
  options.num_points = static_cast<Index>(reader.integer("vertices", options.num_points));
  reader.finish();
  resolved = reader.resolved();
  const auto at_level = [=](int level) {
    RandomDelaunayOptions finer = options;
    finer.num_points = static_cast<Index>(std::lround(options.num_points * std::pow(factor, options.gdim * level)));
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
  const auto at_level = [=](int level) {
    const Mesh mesh = source.make(0);
    return Mesh(mesh.vertices() * std::pow(factor, -static_cast<double>(first + level)), mesh.blocks());
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
    source = {static_cast<int>(paths.size()), 0, [paths](int level) { return read_mesh(paths[level]); }};
  }
  for (const std::string_view kind : {"lattice", "ball", "disc", "random_delaunay"}) {
    const json* options = reader.find(kind);
    if (options == nullptr) continue;
    ++kinds;
    double factor = 2;
    const int levels = read_refinements(reader, factor);
    json filled;
    const std::string where = reader.pointer_to(kind);
    if (kind == "lattice")
      source = lattice_source(*options, where, levels, factor, seed, filled);
    else if (kind == "random_delaunay")
      source = random_delaunay_source(*options, where, levels, factor, seed, filled);
    else
      source = ball_source(*options, where, kind == "ball" ? 3 : 2, levels, factor, seed, filled);
    reader.record(kind, filled);
  }
  if (kinds != 1) raise("{}: found {} of lattice, ball, disc, random_delaunay, file; expected one", pointer, kinds);
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
