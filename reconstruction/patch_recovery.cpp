#include "reconstruction/patch_recovery.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <memory>

#include "framework/error.hpp"
#include "reconstruction/row_assembly.hpp"
#include "reconstruction/vertex_rings.hpp"

namespace halfgrad {

namespace {

using Eigen::MatrixXd;

// Singular values below this part of the largest count as undetermined: columns are scaled to the patch, so that those
// of a healthy one stay above a tenth.
constexpr double undetermined = 1e-3;

struct PseudoInverse {
  MatrixXd matrix;
  Eigen::Index rank;
};

PseudoInverse pseudo_inverse(const MatrixXd& matrix, double smallest) {
  const Eigen::JacobiSVD<MatrixXd> svd(matrix, Eigen::ComputeThinU | Eigen::ComputeThinV);
  PseudoInverse result{MatrixXd::Zero(matrix.cols(), matrix.rows()), 0};
  for (Eigen::Index m = 0; m < svd.singularValues().size() && svd.singularValues()[m] > smallest; ++m, ++result.rank)
    result.matrix += svd.matrixV().col(m) * svd.matrixU().col(m).transpose() / svd.singularValues()[m];
  return result;
}

// Cells within some rings of a vertex, ascending.
std::vector<Index> cells_within(const CellGradients& cells, Index vertex, int rings) {
  std::vector<Index> found(cells.cells_of(vertex).begin(), cells.cells_of(vertex).end());
  for (int ring = 1; ring < rings; ++ring) {
    std::vector<Index> next;
    for (Index cell : found)
      for (Index v : cells.vertices_of(cell))
        next.insert(next.end(), cells.cells_of(v).begin(), cells.cells_of(v).end());
    std::sort(next.begin(), next.end());
    next.erase(std::unique(next.begin(), next.end()), next.end());
    found = std::move(next);
  }
  return found;
}

}  // namespace

Spr::Spr(const SprOptions& options) : options_(options) {
  if (options.rings < 1) raise("spr: rings {}: expected a whole number >= 1", options.rings);
}

void Spr::weigh(const CellGradients& cells, Index vertex, CellStar& star) const {
  const int rings = options_.rings + (cells.on_boundary(vertex) ? 1 : 0);
  star.add(vertex, cells_within(cells, vertex, rings));
  const auto count = static_cast<Eigen::Index>(star.cells.size());
  if (count == 0) return;
  MatrixXd centroids(count, cells.gdim());
  for (Eigen::Index k = 0; k < count; ++k) centroids.row(k) = star.offsets[k].transpose();
  // The mean first and the slope about it: the weights sum to one whatever the rank.
  const Eigen::RowVectorXd mean = centroids.colwise().mean();
  const double rounding = 1e-12 * centroids.norm();  // of centroids in one place, as of a cell and its double
  centroids.rowwise() -= mean;
  const PseudoInverse slope = pseudo_inverse(centroids, std::max(rounding, undetermined * centroids.norm()));
  const Eigen::RowVectorXd weights =
      Eigen::RowVectorXd::Constant(count, 1.0 / static_cast<double>(count)) - mean * slope.matrix;
  star.weights.assign(weights.begin(), weights.end());
}

Ppr::Ppr(const PprOptions& options) : options_(options) {
  if (options.rings < 1) raise("ppr: rings {}: expected a whole number >= 1", options.rings);
}

Reconstruction Ppr::reconstruct(const CellGradients& cells, std::span<const Index> vertices) const {
  const int gdim = cells.gdim();
  const auto make_row = [&](VertexRings& rings, Index vertex, StencilRow& row) {
    row.diagnostics.rule = StencilRule::none;
    rings.start(vertex);
    const std::span<const Index> patch = rings.within(options_.rings);
    const auto count = static_cast<Eigen::Index>(patch.size());
    if (count == 0) return;
    row.neighbors.assign(patch.begin(), patch.end());
    std::sort(row.neighbors.begin(), row.neighbors.end());
    // The vertex itself is the last row of the fit.
    MatrixXd linear = MatrixXd::Zero(count + 1, gdim + 1), quadratic = MatrixXd::Zero(count + 1, num_symmetric(gdim));
    linear.col(0).setOnes();
    for (Eigen::Index j = 0; j < count; ++j)
      linear.row(j).tail(gdim) = cells.vertices().row(row.neighbors[j]) - cells.vertices().row(vertex);
    const double scale = std::sqrt(linear.rightCols(gdim).squaredNorm() / static_cast<double>(count));
    if (scale > 0) linear.rightCols(gdim) /= scale;
    for (int a = 0, s = 0; a < gdim; ++a)
      for (int b = a; b < gdim; ++b, ++s) quadratic.col(s) = linear.col(1 + a).cwiseProduct(linear.col(1 + b));
    // Linear terms first, so that a quadratic mode that the patch cannot tell from them changes nothing.
    const PseudoInverse first = pseudo_inverse(linear, undetermined * linear.norm());
    if (first.rank <= gdim) {
      row.clear();
      const CellWeights average = VolumeAverage().weights(cells, vertex);
      compose_row(cells, vertex, average.cells, average.weights, row);
      row.diagnostics.rule = average.cells.empty() ? StencilRule::none : StencilRule::cell_value;
      row.diagnostics.num_points = static_cast<Index>(row.neighbors.size());
      return;
    }
    const PseudoInverse second =
        pseudo_inverse(quadratic - linear * (first.matrix * quadratic), undetermined * quadratic.norm());
    const MatrixXd fit = first.matrix - first.matrix * quadratic * second.matrix;
    row.weights.resize(count * gdim);
    Eigen::Map<MatrixXd>(row.weights.data(), gdim, count) = fit.block(1, 0, gdim, count) / scale;
    row.diagnostics.rule = second.rank == quadratic.cols() ? StencilRule::full_fit : StencilRule::damped;
    row.diagnostics.num_points = static_cast<Index>(count);
    row.diagnostics.absolute_sum = static_cast<float>(fit.block(1, 0, gdim, count).colwise().norm().sum());
  };
  Reconstruction result;
  result.stencils = assemble_rows_with_workers(gdim, vertices, [&]() -> RowMaker {
    return [&make_row, rings = std::make_shared<VertexRings>(cells)](Index vertex, StencilRow& row) {
      make_row(*rings, vertex, row);
    };
  });
  return result;
}

}  // namespace halfgrad
