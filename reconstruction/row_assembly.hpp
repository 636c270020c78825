// Rows of a stencil table computed in parallel, stored in order.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "framework/cell_gradients.hpp"
#include "framework/gradient_stencils.hpp"
#include "reconstruction/places.hpp"

namespace halfgrad {

/// One row under construction.
struct StencilRow {
  std::vector<Index> neighbors;
  std::vector<double> weights;          ///< gdim an entry
  std::vector<double> hessian_weights;  ///< none, or num_symmetric(gdim) an entry
  StencilDiagnostics diagnostics;

  void clear();
};

/// Writes the row of a vertex into a cleared row.
using RowMaker = std::function<void(Index vertex, StencilRow& row)>;

/// Fills a table: make_row(vertex, row) is called once a vertex, from several threads, on a cleared row. The result
/// does not depend on the number of threads.
GradientStencilTable assemble_rows(int gdim, std::span<const Index> vertices, const RowMaker& make_row);

/// The same for makers that own workspace: make_worker() is called at most once a thread at work, and each maker it
/// returns serves one thread at a time. Rows must not depend on what a maker did before.
GradientStencilTable assemble_rows_with_workers(int gdim, std::span<const Index> vertices,
                                                const std::function<RowMaker()>& make_worker);

/// The row Σ_k w_k F_k of a vertex: cell gradients composed to vertex differences, the vertex itself left out (its
/// weight is minus the sum of the others). Neighbours ascend.
void compose_row(const CellGradients& cells, Index vertex, std::span<const Index> cell_numbers,
                 std::span<const double> cell_weights, StencilRow& row);

/// compose_row for vertex after vertex, where the cells' gradient stencils (#nodes × gdim, row-major) are at hand;
/// keeps its storage.
class RowComposer {
 public:
  void compose(const CellGradients& cells, Index vertex, std::span<const Index> cell_numbers,
               std::span<const double* const> gradients, std::span<const double> cell_weights, StencilRow& row);

 private:
  template <int D>
  void compose_in(const CellGradients& cells, Index vertex, std::span<const Index> cell_numbers,
                  std::span<const double* const> gradients, std::span<const double> cell_weights, StencilRow& row);

  // Neighbours as they are met, and their sums; a key is a neighbour's number and its place.
  Places places_{32};
  std::vector<std::uint64_t> keys_;
  std::vector<double> sums_;
};

}  // namespace halfgrad
