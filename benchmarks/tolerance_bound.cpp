// tolerance_bound WORKLOAD.bin: how much a bound of phong's correction that reads no vertex gradients overestimates the
// one that does. A map that is affine but for residuals of at most r has gradients F_v that differ from the affine
// map's by at most 2 r Σ_j |g_vj|, so that r bounds the correction without a stencil. r is that of the best affine map
// of the vertices that a cell's stencils read, or those of 128 cells in a row. One JSON line of quantiles.
#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <set>

#include "benchmarks/workload.hpp"
#include "framework/error.hpp"
#include "framework/interpolant.hpp"
#include "reconstruction/cell_averages.hpp"

namespace halfgrad::benchmarks {
namespace {

// Greatest distance of the deformed vertices from the affine map of their rest positions that fits them best.
double residual(const Workload& workload, const std::set<Index>& vertices) {
  const auto count = static_cast<Eigen::Index>(vertices.size());
  Eigen::MatrixXd rest(count, 4), deformed(count, 3);
  Eigen::Index row = 0;
  for (Index v : vertices) {
    rest.row(row) << 1, workload.mesh.vertices().row(v);
    deformed.row(row++) = workload.deformed.row(v);
  }
  return (rest * rest.colPivHouseholderQr().solve(deformed) - deformed).rowwise().norm().maxCoeff();
}

void run(const std::string& path) {
  const Workload workload = read_workload(path, 200'000);
  const Mesh& mesh = workload.mesh;
  EmbedOptions nearest;
  nearest.outside = Outside::nearest;
  const Embedding embedding = embed(mesh, workload.points, nearest);
  const std::vector<Index> active = active_vertices(mesh, embedding);
  const Reconstruction reconstruction = ChandrashekarGarg().reconstruct(CellGradients(mesh), active);
  const Interpolant<double> phong(mesh, embedding, named_rule("phong"), &reconstruction);
  const Values<double> gradients = apply_stencils(reconstruction.stencils, workload.deformed);
  const GradientStencilTable& table = reconstruction.stencils;
  std::vector<Index> row_of(static_cast<std::size_t>(mesh.num_vertices()), -1);
  for (Index r = 0; r < table.num_rows(); ++r) row_of[table.vertices[r]] = r;

  // The cells that hold points, in the order of a frame.
  std::vector<Index> cells;
  for (Index p : phong.permutation())
    if (const Index cell = embedding.cells[p]; cell >= 0 && (cells.empty() || cells.back() != cell))
      cells.push_back(cell);
  const auto add_patch = [&](Index cell, std::set<Index>& patch) {
    for (Index v : mesh.cell_vertices(cell)) {
      patch.insert(v);
      for (Offset e = table.offsets[row_of[v]]; e < table.offsets[row_of[v] + 1]; ++e) patch.insert(table.neighbors[e]);
    }
  };
  std::vector<double> by_cell, by_window;
  constexpr std::size_t window_size = 128;
  for (std::size_t begin = 0; begin < cells.size(); begin += window_size) {
    const std::size_t end = std::min(begin + window_size, cells.size());
    std::set<Index> window;
    for (std::size_t c = begin; c < end; ++c) add_patch(cells[c], window);
    const double window_residual = residual(workload, window);
    for (std::size_t c = begin; c < end; c += 4) {
      std::set<Index> patch;
      add_patch(cells[c], patch);
      const auto vertices = mesh.cell_vertices(cells[c]);
      double without_residual = 0, bulge = 0;
      for (int i = 0; i < 4; ++i)
        for (int j = 0; j < i; ++j) {
          const Eigen::RowVector3d edge = mesh.vertices().row(vertices[j]) - mesh.vertices().row(vertices[i]);
          double sum = 0;
          for (Index v : {vertices[i], vertices[j]})
            for (Offset e = table.offsets[row_of[v]]; e < table.offsets[row_of[v] + 1]; ++e)
              sum += std::abs(edge.dot(Eigen::Map<const Eigen::RowVector3d>(table.weights.data() + 3 * e)));
          without_residual = std::max(without_residual, 2 * sum);
          const Eigen::Matrix<double, 1, 9> difference =
              gradients.row(row_of[vertices[i]]) - gradients.row(row_of[vertices[j]]);
          Eigen::Vector3d s;
          for (int column = 0; column < 3; ++column) s[column] = difference.segment<3>(3 * column).dot(edge);
          bulge = std::max(bulge, s.norm());
        }
      by_cell.push_back(without_residual * residual(workload, patch) / bulge);
      by_window.push_back(without_residual * window_residual / bulge);
    }
  }
  const auto quantiles = [](std::vector<double>& values) {
    std::sort(values.begin(), values.end());
    const auto at = [&](double share) { return values[static_cast<std::size_t>(share * (values.size() - 1.0))]; };
    return fmt::format("[{:.3g},{:.3g},{:.3g}]", at(0.1), at(0.5), at(0.9));
  };
  fmt::print("{{\"quantiles\":[0.1,0.5,0.9],\"patch_of_cell\":{},\"patch_of_window\":{}}}\n", quantiles(by_cell),
             quantiles(by_window));
}

}  // namespace
}  // namespace halfgrad::benchmarks

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "usage: tolerance_bound WORKLOAD.bin\n");
    return 2;
  }
  try {
    halfgrad::benchmarks::run(argv[1]);
  } catch (const halfgrad::Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
