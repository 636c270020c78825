#include "benchmarks/workload.hpp"

#include <algorithm>
#include <fstream>
#include <random>
#include <string_view>

#include "experiments/lattice.hpp"
#include "framework/error.hpp"

namespace halfgrad::benchmarks {

namespace {

template <class Matrix>
Matrix read_matrix(std::istream& file, const std::string& path, std::int64_t rows, std::int64_t columns) {
  Matrix matrix(rows, columns);
  const auto bytes = static_cast<std::streamsize>(matrix.size() * sizeof(typename Matrix::Scalar));
  if (!file.read(reinterpret_cast<char*>(matrix.data()), bytes)) raise("{}: the file ends early", path);
  return matrix;
}

}  // namespace

Workload read_workload(const std::string& path, std::int64_t max_points) {
  std::ifstream file(path, std::ios::binary);
  if (!file) raise("cannot open {}", path);
  char magic[8] = {};
  std::int64_t count[3] = {};
  file.read(magic, sizeof(magic));
  file.read(reinterpret_cast<char*>(count), sizeof(count));
  if (!file || std::string_view(magic, 8) != std::string_view("TETPTS1\0", 8))
    raise("{}: expected a workload, which starts with TETPTS1", path);
  Points rest = read_matrix<Points>(file, path, count[0], 3);
  ElementBlock<Tetrahedron> block;
  block.cells = read_matrix<decltype(block.cells)>(file, path, count[1], 4);
  Workload workload;
  workload.points = read_matrix<Points>(file, path, count[2], 3);
  workload.deformed = read_matrix<Points>(file, path, count[0], 3);
  if (max_points >= 0 && max_points < workload.points.rows())
    workload.points.conservativeResize(max_points, Eigen::NoChange);
  workload.mesh = Mesh(std::move(rest), {std::move(block)});
  return workload;
}

Workload lattice_workload(const std::string& name, std::int64_t num_points) {
  const std::size_t colon = name.find(':');
  LatticeOptions options;
  options.element = name.substr(0, colon);
  options.cells.fill(colon == std::string::npos ? 0 : std::atoi(name.c_str() + colon + 1));
  Workload workload;
  workload.mesh = make_lattice(options);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(1e-6, 1 - 1e-6);
  workload.points = Points::NullaryExpr(num_points, workload.mesh.gdim(), [&] { return uniform(random); });
  const Points& rest = workload.mesh.vertices();
  workload.deformed = rest + 0.1 * (3 * rest).array().sin().matrix();
  return workload;
}

}  // namespace halfgrad::benchmarks
