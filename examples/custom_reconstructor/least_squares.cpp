#include "least_squares.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <framework/error.hpp>
#include <reconstruction/row_assembly.hpp>

using namespace halfgrad;

Reconstruction LeastSquares::reconstruct(const CellGradients& cells, std::span<const Index> vertices) const {
  const int gdim = cells.gdim();
  const auto make_row = [&](Index vertex, StencilRow& row) {
    for (Index cell : cells.cells_of(vertex))
      for (Index v : cells.vertices_of(cell))
        if (v != vertex) row.neighbors.push_back(v);
    std::sort(row.neighbors.begin(), row.neighbors.end());
    row.neighbors.erase(std::unique(row.neighbors.begin(), row.neighbors.end()), row.neighbors.end());
    // W D g = W (x_j − x_v) in the least-squares sense: g = (W D)⁺ W, one column a neighbour.
    const auto count = static_cast<Eigen::Index>(row.neighbors.size());
    Eigen::MatrixXd differences(count, gdim);
    Eigen::VectorXd weights(count);
    for (Eigen::Index j = 0; j < count; ++j) {
      differences.row(j) = cells.vertices().row(row.neighbors[j]) - cells.vertices().row(vertex);
      weights[j] = std::pow(differences.row(j).norm(), -options_.power);
    }
    const Eigen::MatrixXd fit =
        (weights.asDiagonal() * differences).completeOrthogonalDecomposition().pseudoInverse() * weights.asDiagonal();
    row.weights.assign(fit.data(), fit.data() + fit.size());
  };
  Reconstruction result;
  result.stencils = assemble_rows(gdim, vertices, make_row);
  return result;
}

ReconstructorEntry least_squares_entry() {
  return {"least_squares", "slope of the weighted least-squares plane through a vertex",
          [](JsonReader& reader) -> std::unique_ptr<VertexGradientReconstructor> {
            LeastSquaresOptions options;
            options.power = reader.number("power", options.power);
            if (!(options.power >= 0)) raise("least_squares: power {}: expected a number >= 0", options.power);
            return std::make_unique<LeastSquares>(options);
          }};
}
