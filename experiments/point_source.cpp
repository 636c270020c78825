#include "experiments/point_source.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "experiments/mesh_source.hpp"
#include "experiments/random.hpp"
#include "experiments/tessellation.hpp"
#include "framework/cell_map.hpp"
#include "framework/embedding.hpp"
#include "framework/error.hpp"
#include "framework/io/point_set.hpp"
#include "framework/json_reader.hpp"

namespace halfgrad {

using nlohmann::json;

Points random_points(const Mesh& mesh, Index count, std::uint64_t seed) {
  // Cells by volume through the cumulative sum, then ξ uniform in the reference cell by rejection.
  std::vector<double> cumulative;
  cumulative.reserve(mesh.num_cells());
  double total = 0;
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) {
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
      const auto positions = node_positions(mesh, block, c);
      total += std::abs(cell_jacobian<E>(positions, E::center()).determinant()) * E::reference_volume;
      cumulative.push_back(total);
    }
  });
  if (!(total > 0)) raise("random points: the mesh has no volume");
  RandomStream random(seed, 2);
  Points points(count, mesh.gdim());
  for (Index p = 0; p < count; ++p) {
    const auto found = std::upper_bound(cumulative.begin(), cumulative.end(), random.uniform() * total);
    const Index cell = std::min(static_cast<Index>(found - cumulative.begin()), mesh.num_cells() - 1);
    with_cell(mesh, cell, [&]<Element E>(const ElementBlock<E>& block, Eigen::Index row) {
      ReferencePoint<E> xi;
      do {
        for (int a = 0; a < E::dim; ++a) xi[a] = random.uniform();
      } while (!contains<E>(xi, 0));
      points.row(p) = E::shape(xi).transpose() * node_positions(mesh, block, row);
    });
  }
  return points;
}

PointCloud geodesic_sphere(int frequency, double radius, const Vector& center) {
  const double golden = (1 + std::sqrt(5.0)) / 2;
  Eigen::Matrix<double, 12, 3> corners;
  corners << -1, golden, 0, 1, golden, 0, -1, -golden, 0, 1, -golden, 0,  //
      0, -1, golden, 0, 1, golden, 0, -1, -golden, 0, 1, -golden,         //
      golden, 0, -1, golden, 0, 1, -golden, 0, -1, -golden, 0, 1;
  constexpr int faces[20][3] = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                                {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                                {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  // A vertex is a set of corners with whole weights that sum to the frequency, which names it on shared edges too.
  using Name = std::array<std::pair<int, int>, 3>;
  std::map<Name, Index> numbers;
  std::vector<Eigen::Vector3d> positions;
  PointCloud cloud;
  for (const auto& face : faces) {
    const auto vertex = [&](int i, int j) {
      Name name = {{{face[0], frequency - i - j}, {face[1], i}, {face[2], j}}};
      for (auto& [corner, weight] : name)
        if (weight == 0) corner = -1;
      std::sort(name.begin(), name.end());
      const auto [found, is_new] = numbers.try_emplace(name, static_cast<Index>(positions.size()));
      if (is_new) {
        const Eigen::Vector3d flat = (frequency - i - j) * corners.row(face[0]).transpose() +
                                     i * corners.row(face[1]).transpose() + j * corners.row(face[2]).transpose();
        positions.push_back(center + radius * flat.normalized());
      }
      return found->second;
    };
    const auto add = [&](Index a, Index b, Index c) {
      cloud.faces.entries.insert(cloud.faces.entries.end(), {a, b, c});
      cloud.faces.offsets.push_back(static_cast<Offset>(cloud.faces.entries.size()));
    };
    for (int i = 0; i < frequency; ++i)
      for (int j = 0; i + j < frequency; ++j) {
        add(vertex(i, j), vertex(i + 1, j), vertex(i, j + 1));
        if (i + j + 1 < frequency) add(vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1));
      }
  }
  cloud.positions.resize(static_cast<Eigen::Index>(positions.size()), 3);
  for (std::size_t v = 0; v < positions.size(); ++v) cloud.positions.row(v) = positions[v].transpose();
  return cloud;
}

PointCloud cylinder_surface(double radius, double height, int around, int along, const Vector& center) {
  PointCloud cloud;
  const Index num_side = around * (along + 1);
  cloud.positions.resize(num_side + 2, 3);
  for (int k = 0; k <= along; ++k)
    for (int i = 0; i < around; ++i) {
      const double angle = 2 * std::numbers::pi * i / around;
      cloud.positions.row(k * around + i) << center[0] + radius * std::cos(angle), center[1] + radius * std::sin(angle),
          center[2] + height * (double(k) / along - 0.5);
    }
  cloud.positions.row(num_side) << center[0], center[1], center[2] - height / 2;
  cloud.positions.row(num_side + 1) << center[0], center[1], center[2] + height / 2;
  const auto add = [&](Index a, Index b, Index c) {
    cloud.faces.entries.insert(cloud.faces.entries.end(), {a, b, c});
    cloud.faces.offsets.push_back(static_cast<Offset>(cloud.faces.entries.size()));
  };
  for (int i = 0; i < around; ++i) {
    const int next = (i + 1) % around;
    for (int k = 0; k < along; ++k) {
      const Index a = k * around + i, b = k * around + next, c = a + around, d = b + around;
      add(a, b, d);
      add(a, d, c);
    }
    add(num_side, next, i);
    add(num_side + 1, along * around + i, along * around + next);
  }
  return cloud;
}

namespace {

int count_of(JsonReader& reader, std::string_view key, std::int64_t fallback, std::int64_t least, std::int64_t most) {
  const std::int64_t count = reader.integer(key, fallback);
  if (count < least || count > most)
    raise("{}: found {}, expected {} to {}", reader.pointer_to(key), count, least, most);
  return static_cast<int>(count);
}

double length_of(JsonReader& reader, std::string_view key, double fallback) {
  const double length = reader.number(key, fallback);
  if (!(length > 0)) raise("{}: found {}, expected a positive length", reader.pointer_to(key), length);
  return length;
}

Vector center_of(JsonReader& reader) {
  Vector center = Vector::Zero(3);
  const json* given = reader.find("center");
  if (given == nullptr) {
    reader.record("center", json::array({0.0, 0.0, 0.0}));
    return center;
  }
  if (!given->is_array() || given->size() != 3 ||
      !std::all_of(given->begin(), given->end(), [](const json& entry) { return entry.is_number(); }))
    raise("{}: found {}, expected an array of 3 numbers", reader.pointer_to("center"), given->dump());
  for (int a = 0; a < 3; ++a) center[a] = (*given)[a].get<double>();
  return center;
}

/// A surface is the same for all levels, and lives in space. It is made where it is used: a check of a configuration
/// makes no points.
template <class Make>
PointSource surface(Make make, const std::string& pointer) {
  return [make, pointer](const Mesh& mesh, int) {
    if (mesh.gdim() != 3) raise("{}: a surface of space, but the mesh has dimension {}", pointer, mesh.gdim());
    return make();
  };
}

PointSource random_source(JsonReader& reader, const std::string&, std::uint64_t seed) {
  const int count = count_of(reader, "count", 5000, 1, 100000000);
  return [count, seed](const Mesh& mesh, int level) {
    return PointCloud{random_points(mesh, count, seed + static_cast<std::uint64_t>(level)), {}};
  };
}

PointSource grid_source(JsonReader& reader, const std::string& pointer, std::uint64_t) {
  const int count = count_of(reader, "count", 20, 1, 1000);
  return [count, pointer](const Mesh& mesh, int) {
    // The middles of count^gdim boxes over the bounds of the mesh; those outside the mesh are left out.
    const int gdim = mesh.gdim();
    const Vector low = mesh.vertices().colwise().minCoeff(), high = mesh.vertices().colwise().maxCoeff();
    const Index total = static_cast<Index>(std::llround(std::pow(count, gdim)));
    Points all(total, gdim);
    for (Index p = 0; p < total; ++p)
      for (Index rest = p, a = 0; a < gdim; ++a, rest /= count)
        all(p, a) = low[a] + (high[a] - low[a]) * (rest % count + 0.5) / count;
    const Embedding embedding = embed(mesh, all, {.outside = Outside::mark});
    Points kept(total, gdim);
    Index num_kept = 0;
    for (Index p = 0; p < total; ++p)
      if (embedding.cells[p] >= 0) kept.row(num_kept++) = all.row(p);
    if (num_kept == 0) raise("{}: none of {} grid points lies in the mesh", pointer, total);
    return PointCloud{kept.topRows(num_kept), {}};
  };
}

PointSource geodesic_source(JsonReader& reader, const std::string& pointer, std::uint64_t) {
  const int frequency = count_of(reader, "frequency", 35, 1, 1000);
  const double radius = length_of(reader, "radius", 0.45);
  const Vector center = center_of(reader);
  return surface([=] { return geodesic_sphere(frequency, radius, center); }, pointer);
}

PointSource cylinder_source(JsonReader& reader, const std::string& pointer, std::uint64_t) {
  const double radius = length_of(reader, "radius", 0.3), height = length_of(reader, "height", 0.8);
  const int around = count_of(reader, "around", 96, 3, 100000), along = count_of(reader, "along", 64, 1, 100000);
  constexpr std::int64_t most_points = 100'000'000;
  if (std::int64_t{around} * (along + 1) > most_points)
    raise("{}: found {} points around and {} along, expected at most {} in all", pointer, around, along, most_points);
  const Vector center = center_of(reader);
  return surface([=] { return cylinder_surface(radius, height, around, along, center); }, pointer);
}

PointSource tessellation_source(JsonReader& reader, const std::string&, std::uint64_t) {
  const int subdivisions = count_of(reader, "subdivisions", 8, 1, 1000);
  return [subdivisions](const Mesh& mesh, int) { return tessellation(mesh, subdivisions); };
}

struct PointKind {
  std::string_view name;
  PointSource (*make)(JsonReader& reader, const std::string& pointer, std::uint64_t seed);
};
constexpr std::array point_kinds = {PointKind{"random", random_source}, PointKind{"grid", grid_source},
                                    PointKind{"geodesic", geodesic_source}, PointKind{"cylinder", cylinder_source},
                                    PointKind{"tessellation", tessellation_source}};

}  // namespace

PointSource read_point_source(const json& specification, const std::string& pointer,
                              const std::filesystem::path& directory, std::uint64_t seed, json& resolved) {
  JsonReader reader(specification, pointer);
  PointSource source;
  int kinds = 0;
  if (const json* file = reader.find("file")) {
    ++kinds;
    const auto paths = read_paths(*file, reader.pointer_to("file"), directory);
    source = [paths](const Mesh& mesh, int level) {
      const auto& path = paths[std::min(static_cast<std::size_t>(level), paths.size() - 1)];
      PointSet set = read_points(path);
      return PointCloud{in_dimension(set.points, mesh.gdim(), path.string()), std::move(set.faces)};
    };
  }
  for (const PointKind& kind : point_kinds) {
    const json* options = reader.find(kind.name);
    if (options == nullptr) continue;
    ++kinds;
    JsonReader own(*options, reader.pointer_to(kind.name));
    source = kind.make(own, own.pointer(), seed);
    own.finish();
    reader.record(kind.name, own.resolved());
  }
  reader.finish();
  if (kinds != 1)
    raise("{}: found {} of random, grid, geodesic, cylinder, tessellation, file; expected one", pointer, kinds);
  resolved = reader.resolved();
  return source;
}

}  // namespace halfgrad
