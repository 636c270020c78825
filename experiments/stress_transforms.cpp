// What must not depend on numbering, axes and units.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "experiments/stress_runner.hpp"

namespace halfgrad::stress {

// A case is renumbered, turned by a permutation of the axes with signs, or scaled by a power of two: each leaves every
// coordinate exact, so that results differ by the order of roundings alone.
void CaseRunner::check_transformed() {
  const int gdim = mesh_.gdim();
  const int choice = static_cast<int>(random_.uniform(0, 3));
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
  } else {
    vertices *= std::exp2(std::floor(random_.uniform(-60, 60)));
  }
  const Mesh moved(std::move(vertices), std::move(blocks));
  Embedding embedding = points_.embedding;
  for (Index& cell : embedding.cells) cell = cell_number[cell];
  Values<double> values(noise_.values.rows(), columns);
  for (Index v = 0; v < mesh_.num_vertices(); ++v) values.row(number[v]) = noise_.values.row(v);

  const CellGradients moved_cells(moved);
  std::vector<Index> vertices_of_moved(moved.num_vertices());
  std::iota(vertices_of_moved.begin(), vertices_of_moved.end(), 0);
  const double epsilon = std::numeric_limits<double>::epsilon();
  for (const Rows& rows : rows_) {
    if (rows.blended()) continue;  // its tables are those of two others; the blend depends on their roundings
    const StressReconstructor& made = *rows.made;
    // Cells turn with a rounding of their own, and a metric is rounded to the square of the cells' aspect.
    const double condition = made.forward_condition * (made.accepted_sum > 0 ? aspect_ * aspect_
                                                       : choice == 1         ? aspect_
                                                                             : 1);
    if (!((steps_of_a_point + rows.longest) * epsilon * condition < 1e-3)) continue;
    // Where vertices coincide a grid has two neighbours in one place, and numbering chooses.
    if (made.grids_only && choice == 0) continue;
    const Reconstruction again = made.reconstructor->reconstruct(moved_cells, vertices_of_moved);
    const ReferenceGradients gradients = reference_gradients(rows.reconstruction.stencils, rows.magnitudes, noise_);
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
