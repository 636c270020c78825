// What must not depend on numbering, axes and units.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "experiments/stress_mesh.hpp"
#include "experiments/stress_runner.hpp"

namespace halfgrad::stress {

namespace {

// A fit computes in the unit of length of its patch, where numbers are of size one: what is smaller in a row, as the
// weights of far points are, comes of cancellation. A row's Σ |g| is at least one over that unit.
void fill_kriging_magnitudes(const GradientStencilTable& table, std::vector<double>& gradient,
                             std::vector<double>& hessian) {
  const int gdim = table.gdim, symmetric = num_symmetric(gdim);
  hessian.assign(table.hessian_weights.size(), 0.0);
  for (Index r = 0; r < table.num_rows(); ++r) {
    if (table.diagnostics[r].rule == StencilRule::cell_value) continue;
    const Offset begin = table.offsets[r], end = table.offsets[r + 1];
    double sum = 0;
    for (Offset e = begin; e < end; ++e)
      sum += Eigen::Map<const Eigen::VectorXd>(table.weights.data() + e * gdim, gdim).norm();
    std::fill(gradient.begin() + begin * gdim, gradient.begin() + end * gdim, sum);
    if (table.has_hessians())
      std::fill(hessian.begin() + begin * symmetric, hessian.begin() + end * symmetric, sum * sum);
  }
}

}  // namespace

// A case is renumbered, turned by a permutation of the axes with signs, or scaled by a power of two: each leaves every
// coordinate exact, so that results differ by the order of roundings alone. Or it is turned by any orthogonal matrix:
// about a vertex of the mesh. Places are rounded to gdim ε times their distance from the origin, of vertices after it
// and of centroids before; a cell with gradient g sees that as gdim ε |X| |g|, which adds to the ε of rounding itself.
void CaseRunner::check_transformed() {
  const int gdim = mesh_.gdim();
  const int choice = static_cast<int>(random_.uniform(0, 4));
  double moved_by = 1;  // rounding of coordinates as cells see it, in units of ε
  Points vertices = mesh_.vertices();
  std::vector<Index> number(mesh_.num_vertices()), cell_number(mesh_.num_cells());
  std::iota(number.begin(), number.end(), 0);
  std::iota(cell_number.begin(), cell_number.end(), 0);
  std::vector<AnyBlock> blocks = mesh_.blocks();
  StressProperty property = StressProperty::scaled;
  if (choice == 0) {
    property = StressProperty::renumbered;
    std::reverse(number.begin(), number.end());
    for (std::size_t v = number.size(); v > 1; --v)
      std::swap(number[v - 1], number[static_cast<std::size_t>(random_.uniform(0, static_cast<double>(v)))]);
    for (Index v = 0; v < mesh_.num_vertices(); ++v) vertices.row(number[v]) = mesh_.vertices().row(v);
    for (std::size_t b = 0; b < blocks.size(); ++b)
      std::visit(
          [&](auto& block) {
            block.cells = block.cells.unaryExpr([&](Index v) { return number[v]; }).colwise().reverse().eval();
            const Index first = mesh_.first_cell(b), last = mesh_.first_cell(b + 1) - 1;
            for (Index c = first; c <= last; ++c) cell_number[c] = first + last - c;
          },
          blocks[b]);
  } else if (choice == 1) {
    property = StressProperty::turned;
    const int shift = static_cast<int>(random_.uniform(0, gdim));
    for (int a = 0; a < gdim; ++a)
      vertices.col((a + shift) % gdim) = (random_.uniform() < 0.5 ? -1 : 1) * mesh_.vertices().col(a);
  } else if (choice == 2) {
    property = StressProperty::turned;
    const SmallMatrix rotation = random_rotation(random_, gdim);
    for (Index v = 0; v < mesh_.num_vertices(); ++v)
      vertices.row(v) = (mesh_.vertices().row(v) - mesh_.vertices().row(origin_)) * rotation.transpose();
    moved_by += gdim * (size_ + mesh_.vertices().cwiseAbs().maxCoeff()) * steepest_cell_;
  } else {
    vertices *= std::exp2(std::floor(random_.uniform(-60, 60)));
  }
  const Mesh moved(std::move(vertices), std::move(blocks));
  // Rounding gives volume to cells that have none.
  if (choice == 2 && usable_cells(moved) != usable_) return;
  Embedding embedding = points_.embedding;
  for (Index& cell : embedding.cells) cell = cell_number[cell];
  Values<double> values(noise_.values.rows(), columns);
  for (Index v = 0; v < mesh_.num_vertices(); ++v) values.row(number[v]) = noise_.values.row(v);

  const CellGradients moved_cells(moved);
  std::vector<Index> vertices_of_moved(moved.num_vertices());
  std::iota(vertices_of_moved.begin(), vertices_of_moved.end(), 0);
  const double epsilon = std::numeric_limits<double>::epsilon();
  const bool turned = property == StressProperty::turned;
  for (const Rows& rows : rows_) {
    if (rows.blended()) continue;  // its tables are those of two others; the blend depends on their roundings
    const StressReconstructor& made = *rows.made;
    // Cells turn with a rounding of their own, and a metric is rounded to the square of the cells' aspect.
    const double condition = made.forward_condition *
                             (made.accepted_sum > 0 ? aspect_ * aspect_
                              : turned              ? aspect_
                                                    : 1) *
                             moved_by;
    if (!((steps_of_a_point + rows.longest) * epsilon * condition < 0.1)) continue;
    // Where vertices coincide a grid has two neighbours in one place, and numbering chooses. A grid lies along the
    // axes.
    if (made.grids_only && (choice == 0 || choice == 2)) continue;
    const Reconstruction again = made.reconstructor->reconstruct(moved_cells, vertices_of_moved);
    const GradientStencilTable& table = rows.reconstruction.stencils;
    std::vector<double> magnitudes = rows.magnitudes, hessian_magnitudes;
    if (made.accepted_sum > 0) fill_kriging_magnitudes(table, magnitudes, hessian_magnitudes);
    const ReferenceGradients gradients = reference_gradients(table, magnitudes, noise_, hessian_magnitudes);
    for (std::size_t r = 0; r < named_rules().size(); ++r) {
      const InterpolationRule& rule = named_rules()[r].rule;
      if (!rule.needs_gradients() || rule.formula == Formula::quadratic10) continue;
      if (rule.needs_hessians() && !rows.reconstruction.stencils.has_hessians()) continue;
      const Values<double> before =
          Interpolant<double>(mesh_, points_.embedding, rule, &rows.reconstruction).evaluate(noise_.values);
      const Values<double> after = Interpolant<double>(moved, embedding, rule, &again).evaluate(values);
      for (Index p = 0; p < before.rows(); ++p)
        for (int c = 0; c < columns; ++c) {
          const Measured value = reference_value(rule, weights_[p], coefficients_[r][p], gradients, noise_, gdim, c);
          record(property,
                 ratio_of(std::abs(after(p, c) - before(p, c)),
                          2 * (steps_of_a_point + rows.longest) * epsilon * condition * value.magnitude),
                 fmt::format("{}, {}", named_rules()[r].name, made.name));
        }
    }
  }
}

}  // namespace halfgrad::stress
