// The algebra of stencils as properties of random tables, meshes and maps, by RapidCheck: a failure prints the seed
// (RC_PARAMS) that repeats it and the smallest case it found.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <numeric>

#include "framework/interpolant.hpp"
#include "reconstruction/registry.hpp"
#include "support/message_of.hpp"
#include "support/test_meshes.hpp"

namespace halfgrad {
namespace {

// The same cases in every run, unless the environment asks for others.
[[maybe_unused]] const int seeded = ::setenv("RC_PARAMS", "seed=20", 0);

// Sums and differences of these are exact in double: what must be equal to the bit can be compared so.
rc::Gen<double> dyadic(int bound = 64) {
  return rc::gen::map(rc::gen::inRange(-16 * bound, 16 * bound + 1), [](int sixteenths) { return sixteenths / 16.0; });
}

Values<double> random_values(Index rows, int columns) {
  Values<double> values(rows, columns);
  for (double& x : values.reshaped<Eigen::RowMajor>()) x = *dyadic();
  return values;
}

std::vector<Index> shuffled(std::vector<Index> numbers) {
  for (std::size_t i = 1; i < numbers.size(); ++i)
    std::swap(numbers[i], numbers[*rc::gen::inRange<std::size_t>(0, i + 1)]);
  return numbers;
}

// Rows of any neighbours and weights, whatever they mean.
GradientStencilTable random_table(Index num_vertices, bool with_hessians) {
  GradientStencilTable table;
  table.gdim = *rc::gen::inRange(1, 4);
  std::vector<Index> order(num_vertices);
  std::iota(order.begin(), order.end(), 0);
  table.vertices = shuffled(order);
  table.vertices.resize((table.vertices.size() + 1) / 2);
  for (Index v : table.vertices) {
    const int count = *rc::gen::inRange(0, 5);
    for (int i = 0; i < count; ++i) {
      const Index neighbor = *rc::gen::inRange<Index>(0, num_vertices);
      if (neighbor == v) continue;
      table.neighbors.push_back(neighbor);
      for (int k = 0; k < table.gdim; ++k) table.weights.push_back(*dyadic(4));
      for (int k = 0; with_hessians && k < num_symmetric(table.gdim); ++k) table.hessian_weights.push_back(*dyadic(4));
    }
    table.offsets.push_back(table.num_entries());
  }
  return table;
}

std::vector<Index> some_of(const std::vector<Index>& vertices) {
  std::vector<Index> chosen = shuffled(vertices);
  chosen.resize(*rc::gen::inRange<std::size_t>(1, vertices.size() + 1));
  return chosen;
}

Index row_of(const GradientStencilTable& table, Index vertex) {
  return static_cast<Index>(std::find(table.vertices.begin(), table.vertices.end(), vertex) - table.vertices.begin());
}

RC_GTEST_PROP(StencilAlgebra, ATranslationOfTheValuesChangesNoBit, ()) {
  const Index num_vertices = *rc::gen::inRange<Index>(2, 12);
  const GradientStencilTable table = random_table(num_vertices, false);
  const Values<double> values = random_values(num_vertices, 3);
  Values<double> moved = values;
  for (int a = 0; a < 3; ++a) moved.col(a).array() += *dyadic(1 << 20);
  RC_ASSERT(apply_stencils(table, moved) == apply_stencils(table, values));
}

RC_GTEST_PROP(StencilAlgebra, RowsAreLinear, ()) {
  const Index num_vertices = *rc::gen::inRange<Index>(2, 12);
  const GradientStencilTable table = random_table(num_vertices, true);
  const Values<double> x = random_values(num_vertices, 2), y = random_values(num_vertices, 2);
  const double a = *dyadic(4), b = *dyadic(4);
  // Products and sums of so few dyadic numbers are exact.
  RC_ASSERT(apply_stencils(table, Values<double>(a * x + b * y)) ==
            Values<double>(a * apply_stencils(table, x) + b * apply_stencils(table, y)));
  if (table.has_hessians())
    RC_ASSERT(apply_hessian_stencils(table, Values<double>(a * x + b * y)) ==
              Values<double>(a * apply_hessian_stencils(table, x) + b * apply_hessian_stencils(table, y)));
}

RC_GTEST_PROP(StencilAlgebra, SelectedRowsAreRowsOfTheWhole, ()) {
  const Index num_vertices = *rc::gen::inRange<Index>(2, 12);
  const Reconstruction whole{random_table(num_vertices, *rc::gen::arbitrary<bool>()), {}};
  const Values<double> values = random_values(num_vertices, 2);
  const std::vector<Index> chosen = some_of(whole.stencils.vertices);
  const GradientStencilTable part = select_rows(whole, chosen).stencils;
  RC_ASSERT(part.vertices == chosen);
  const Values<double> all = apply_stencils(whole.stencils, values), some = apply_stencils(part, values);
  for (std::size_t i = 0; i < chosen.size(); ++i)
    RC_ASSERT(some.row(static_cast<Index>(i)) == all.row(row_of(whole.stencils, chosen[i])));
}

RC_GTEST_PROP(StencilAlgebra, SelectionsCompose, ()) {
  const Reconstruction whole{random_table(*rc::gen::inRange<Index>(2, 12), true), {}};
  const std::vector<Index> first = some_of(whole.stencils.vertices), second = some_of(first);
  const GradientStencilTable twice = select_rows(select_rows(whole, first), second).stencils,
                             once = select_rows(whole, second).stencils,
                             same = select_rows(whole, whole.stencils.vertices).stencils;
  const auto equal = [](const GradientStencilTable& a, const GradientStencilTable& b) {
    return a.vertices == b.vertices && a.offsets == b.offsets && a.neighbors == b.neighbors && a.weights == b.weights &&
           a.hessian_weights == b.hessian_weights;
  };
  RC_ASSERT(equal(twice, once));
  RC_ASSERT(equal(same, whole.stencils));
}

RC_GTEST_PROP(StencilAlgebra, AVertexWithoutARowIsNamed, ()) {
  const Reconstruction whole{random_table(8, false), {}};
  std::vector<Index> missing;
  for (Index v = 0; v < 8; ++v)
    if (row_of(whole.stencils, v) == whole.stencils.num_rows()) missing.push_back(v);
  const Index vertex = *rc::gen::elementOf(missing);
  const std::string message = message_of([&] { select_rows(whole, std::vector{vertex}); });
  RC_ASSERT(message.find(fmt::format("vertex {}:", vertex)) != std::string::npos);
}

RC_GTEST_PROP(StencilAlgebra, RenumberedTablesGiveTheSameBits, ()) {
  const Index num_vertices = *rc::gen::inRange<Index>(2, 12);
  const GradientStencilTable table = random_table(num_vertices, false);
  const Values<double> values = random_values(num_vertices, 2);
  std::vector<Index> number(num_vertices);
  std::iota(number.begin(), number.end(), 0);
  number = shuffled(number);
  GradientStencilTable renumbered = table;
  for (Index& v : renumbered.vertices) v = number[v];
  for (Index& v : renumbered.neighbors) v = number[v];
  Values<double> moved(num_vertices, 2);
  for (Index v = 0; v < num_vertices; ++v) moved.row(number[v]) = values.row(v);
  RC_ASSERT(apply_stencils(renumbered, moved) == apply_stencils(table, values));
}

// Meshes and what is made of them.
Mesh random_mesh() {
  const auto seed = *rc::gen::inRange(0u, 1000u);
  const double jitter = *rc::gen::inRange(0, 4) * 0.08;
  switch (*rc::gen::inRange(0, 5)) {
    case 0:
      return test::lattice<Segment>(5, jitter, seed);
    case 1:
      return test::lattice<Triangle>(3, jitter, seed);
    case 2:
      return test::lattice<Quadrilateral>(3, jitter, seed);
    case 3:
      return test::lattice<Tetrahedron>(2, jitter, seed);
    default:
      return test::lattice<Hexahedron>(2, jitter, seed);
  }
}

nlohmann::json random_reconstructor() {
  std::vector<std::string> names;
  for (const ReconstructorEntry& entry : reconstructor_registry())
    if (entry.name != "centered_difference" && entry.name != "adaptive") names.emplace_back(entry.name);
  return *rc::gen::elementOf(names);
}

Reconstruction reconstruct(const nlohmann::json& name, const Mesh& mesh, const std::vector<Index>& vertices) {
  return make_reconstructor(name).reconstructor->reconstruct(CellGradients(mesh), vertices);
}

std::vector<Index> all_vertices(const Mesh& mesh) {
  std::vector<Index> vertices(mesh.num_vertices());
  std::iota(vertices.begin(), vertices.end(), 0);
  return vertices;
}

// Rounding of a row applied to values of size `scale`: each of its products errs by some units.
double rounding(const GradientStencilTable& table, double scale) {
  double greatest = 0;
  for (Index r = 0; r < table.num_rows(); ++r) {
    double sum = 0;
    for (Offset e = table.offsets[r] * table.gdim; e < table.offsets[r + 1] * table.gdim; ++e)
      sum += std::abs(table.weights[e]);
    greatest = std::max(greatest, sum);
  }
  return 1000 * std::numeric_limits<double>::epsilon() * greatest * scale;
}

RC_GTEST_PROP(StencilAlgebra, AffineMapsHaveTheirMatrixAtEveryVertex, ()) {
  const Mesh mesh = random_mesh();
  const Reconstruction rows = reconstruct(random_reconstructor(), mesh, all_vertices(mesh));
  const Values<double> matrix = random_values(2, mesh.gdim()), shift = random_values(1, 2);
  const Values<double> values = (mesh.vertices() * matrix.transpose()).rowwise() + shift.row(0);
  const Values<double> found = apply_stencils(rows.stencils, values);
  const double bound = rounding(rows.stencils, values.cwiseAbs().maxCoeff());
  for (Index v = 0; v < mesh.num_vertices(); ++v)
    RC_ASSERT((found.row(v) - matrix.reshaped<Eigen::RowMajor>().transpose()).cwiseAbs().maxCoeff() <= bound);
}

RC_GTEST_PROP(StencilAlgebra, RowsDoNotDependOnWhichOthersAreAskedFor, ()) {
  const Mesh mesh = random_mesh();
  const nlohmann::json name = random_reconstructor();
  const std::vector<Index> chosen = some_of(all_vertices(mesh));
  const GradientStencilTable part = reconstruct(name, mesh, chosen).stencils,
                             selected = select_rows(reconstruct(name, mesh, all_vertices(mesh)), chosen).stencils;
  const Values<double> values = random_values(mesh.num_vertices(), 2);
  RC_ASSERT(apply_stencils(part, values) == apply_stencils(selected, values));
}

RC_GTEST_PROP(StencilAlgebra, RenumberedMeshesHaveTheSameGradients, ()) {
  const Mesh mesh = random_mesh();
  const nlohmann::json name = random_reconstructor();
  const std::vector<Index> number = shuffled(all_vertices(mesh));
  const Values<double> values = random_values(mesh.num_vertices(), 2);
  Points vertices = mesh.vertices();
  Values<double> moved = values;
  for (Index v = 0; v < mesh.num_vertices(); ++v) {
    vertices.row(number[v]) = mesh.vertices().row(v);
    moved.row(number[v]) = values.row(v);
  }
  std::vector<AnyBlock> blocks = mesh.blocks();
  for (AnyBlock& any : blocks)
    std::visit(
        [&](auto& block) {
          for (Index& v : block.cells.reshaped()) v = number[v];
        },
        any);
  const Mesh renumbered(vertices, std::move(blocks));
  const Reconstruction rows = reconstruct(name, mesh, all_vertices(mesh));
  const Values<double> before = apply_stencils(rows.stencils, values),
                       after = apply_stencils(reconstruct(name, renumbered, all_vertices(mesh)).stencils, moved);
  // Sums over neighbours and cells in another order; the fits amplify that by their condition.
  const double bound = 1e4 * rounding(rows.stencils, values.cwiseAbs().maxCoeff());
  for (Index v = 0; v < mesh.num_vertices(); ++v)
    RC_ASSERT((after.row(number[v]) - before.row(v)).cwiseAbs().maxCoeff() <= bound);
}

RC_GTEST_PROP(StencilAlgebra, PointWeightsComposedWithStencilsAreTheMatrix, ()) {
  const Mesh mesh = random_mesh();
  const Points points = test::random_points_inside(mesh, 5, *rc::gen::inRange(0u, 1000u));
  const Embedding embedding = embed(mesh, points);
  const Reconstruction rows = reconstruct(random_reconstructor(), mesh, active_vertices(mesh, embedding));
  const Interpolant<double> interpolant(mesh, embedding, named_rule("phong"), &rows);
  const Eigen::SparseMatrix<double, Eigen::RowMajor> matrix = interpolant.matrix();
  const Values<double> values = random_values(mesh.num_vertices(), 2);
  const double scale = 1e3 * std::numeric_limits<double>::epsilon() *
                       (Eigen::MatrixXd(matrix).cwiseAbs().rowwise().sum().maxCoeff() + 1);
  RC_ASSERT((matrix * values - interpolant.evaluate(values)).cwiseAbs().maxCoeff() <=
            scale * values.cwiseAbs().maxCoeff());
  RC_ASSERT((matrix * Eigen::VectorXd::Ones(mesh.num_vertices()) - Eigen::VectorXd::Ones(5)).cwiseAbs().maxCoeff() <=
            scale);
  RC_ASSERT((matrix * mesh.vertices() - points).cwiseAbs().maxCoeff() <= scale);
}

}  // namespace
}  // namespace halfgrad
