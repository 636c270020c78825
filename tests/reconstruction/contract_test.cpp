// What every reconstructor promises, over the registry of reconstructors and the registry of elements.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "reconstruction/registry.hpp"
#include "support/test_meshes.hpp"

namespace halfgrad {
namespace {

using nlohmann::json;

const json wide = "kriging", lean = {{"kriging", {{"patch", "lean"}}}}, cubic = {{"kriging", {{"drift", "cubic"}}}};

// Every entry of the registry with its defaults, and the variants of kriging; centered_difference serves grids only and
// has tests of its own.
std::vector<json> all_reconstructors() {
  std::vector<json> specifications = {lean, cubic};
  for (const ReconstructorEntry& entry : reconstructor_registry())
    if (entry.name != "centered_difference") specifications.push_back(std::string(entry.name));
  return specifications;
}

std::vector<Index> all_vertices(const Mesh& mesh) {
  std::vector<Index> vertices(mesh.num_vertices());
  std::iota(vertices.begin(), vertices.end(), 0);
  return vertices;
}

Reconstruction reconstruct(const json& specification, const Mesh& mesh) {
  return make_reconstructor(specification).reconstructor->reconstruct(CellGradients(mesh), all_vertices(mesh));
}

Values<double> gradients(const Reconstruction& reconstruction, const Values<double>& values) {
  return reconstruction.blend ? blended_gradients(reconstruction, values)
                              : apply_stencils(reconstruction.stencils, values);
}

// Σ over monomials of total degree ≤ `degree` with fixed coefficients, its gradient and its Hessian.
struct Polynomial {
  int degree;
  static double coefficient(int i, int j, int k) { return std::sin(1.0 + 3 * i + 5 * j + 7 * k); }
  static double power(double x, int n, int derivative) {
    double factor = 1;
    for (int d = 0; d < derivative; ++d) factor *= n - d;
    return n < derivative ? 0 : factor * std::pow(x, n - derivative);
  }
  double derivative(const Vector& x, std::array<int, 3> order) const {
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    p.head(x.size()) = x;
    double sum = 0;
    for (int i = 0; i <= degree; ++i)
      for (int j = 0; i + j <= degree; ++j)
        for (int k = 0; i + j + k <= degree; ++k)
          sum += coefficient(i, j, k) * power(p[0], i, order[0]) * power(p[1], j, order[1]) * power(p[2], k, order[2]);
    return sum;
  }
  double value(const Vector& x) const { return derivative(x, {0, 0, 0}); }
  double gradient(const Vector& x, int a) const {
    std::array<int, 3> order{};
    ++order[a];
    return derivative(x, order);
  }
  double hessian(const Vector& x, int a, int b) const {
    std::array<int, 3> order{};
    ++order[a], ++order[b];
    return derivative(x, order);
  }
};

Values<double> sample(const Mesh& mesh, const Polynomial& polynomial) {
  Values<double> values(mesh.num_vertices(), 1);
  for (Index v = 0; v < mesh.num_vertices(); ++v) values(v, 0) = polynomial.value(mesh.vertices().row(v).transpose());
  return values;
}

double gradient_error(const Mesh& mesh, const Polynomial& polynomial, const Values<double>& found, Index v) {
  double worst = 0;
  for (int a = 0; a < mesh.gdim(); ++a)
    worst = std::max(worst, std::abs(found(v, a) - polynomial.gradient(mesh.vertices().row(v).transpose(), a)));
  return worst;
}

bool determined(const StencilDiagnostics& row) {
  return row.rule == StencilRule::full_fit || row.rule == StencilRule::wider_patch;
}

// A deformation with all frequencies that a lattice of a few cells can tell.
Values<double> wave(const Mesh& mesh) {
  Values<double> values(mesh.num_vertices(), 2);
  for (Index v = 0; v < mesh.num_vertices(); ++v) {
    const double s = mesh.vertices().row(v).sum();
    values.row(v) << std::sin(3 * s + mesh.vertices()(v, 0)), std::cos(2 * s * s);
  }
  return values;
}

template <class E>
class ReconstructorContract : public testing::Test {
 protected:
  static Mesh mesh(int n = E::dim == 3 ? 3 : 5) { return test::lattice<E>(n, 0.2, 3); }
};
using AllElements = Elements::apply<testing::Types, std::type_identity_t>;
TYPED_TEST_SUITE(ReconstructorContract, AllElements);

TYPED_TEST(ReconstructorContract, AffineFieldsAreExactEverywhere) {
  const Mesh mesh = this->mesh();
  const Polynomial affine{1};
  for (const json& specification : all_reconstructors()) {
    const Values<double> found = gradients(reconstruct(specification, mesh), sample(mesh, affine));
    for (Index v = 0; v < mesh.num_vertices(); ++v)
      EXPECT_LT(gradient_error(mesh, affine, found, v), 1e-11) << specification << " vertex " << v;
  }
}

TYPED_TEST(ReconstructorContract, QuadraticsAreExactEverywhere) {
  const Mesh mesh = this->mesh();
  const Polynomial quadratic{2};
  for (const json& specification : {wide, lean, cubic, json("ppr"), json("adaptive")}) {
    const Reconstruction rows = reconstruct(specification, mesh);
    const Values<double> found = gradients(rows, sample(mesh, quadratic));
    // Every vertex, the boundary included: where cubic modes are weak, the quadratic ones are fitted before them.
    for (Index v = 0; v < mesh.num_vertices(); ++v)
      EXPECT_LT(gradient_error(mesh, quadratic, found, v), 2e-11) << specification << " vertex " << v;
  }
}

TYPED_TEST(ReconstructorContract, AdaptiveGradientsAreContinuousInTheValues) {
  const Mesh mesh = this->mesh();
  const Reconstruction rows = reconstruct("adaptive", mesh);
  const Values<double> from = wave(mesh), to = wave(test::stretched(mesh, 0.5));
  // Along a path of values, steps of the gradients shrink with the steps taken.
  const auto greatest_step = [&](int num_steps) {
    double greatest = 0;
    Values<double> last = gradients(rows, from);
    for (int k = 1; k <= num_steps; ++k) {
      const Values<double> next = gradients(rows, from + (to - from) * (static_cast<double>(k) / num_steps));
      greatest = std::max(greatest, (next - last).cwiseAbs().maxCoeff());
      last = next;
    }
    return greatest;
  };
  EXPECT_LT(greatest_step(256), 0.2 * greatest_step(16));
}

TYPED_TEST(ReconstructorContract, AdaptiveGradientsDoNotDependOnConstantColumns) {
  // A column without differences adds no roughness; four columns take the general code, two and three the fast one.
  const Mesh mesh = this->mesh();
  const Reconstruction rows = reconstruct("adaptive", mesh);
  const Values<double> values = wave(mesh);
  Values<double> wider = Values<double>::Constant(values.rows(), 4, 1);
  wider.leftCols(values.cols()) = values;
  const Values<double> found = gradients(rows, values), more = gradients(rows, wider),
                       three = gradients(rows, wider.leftCols(3));
  const double size = found.cwiseAbs().maxCoeff();
  EXPECT_LT((more.leftCols(found.cols()) - found).cwiseAbs().maxCoeff(), 1e-12 * size);
  EXPECT_LT((more.leftCols(three.cols()) - three).cwiseAbs().maxCoeff(), 1e-12 * size);
}

TYPED_TEST(ReconstructorContract, CubicDriftIsExactForCubicsAndTheirHessians) {
  const Mesh mesh = this->mesh(TypeParam::dim == 3 ? 4 : 6);
  const Polynomial polynomial{3};
  const Reconstruction rows = reconstruct(cubic, mesh);
  const Values<double> values = sample(mesh, polynomial), found = gradients(rows, values),
                       hessians = apply_hessian_stencils(rows.stencils, values);
  Index num_determined = 0;
  for (Index v = 0; v < mesh.num_vertices(); ++v) {
    if (!determined(rows.stencils.diagnostics[v])) continue;
    ++num_determined;
    EXPECT_LT(gradient_error(mesh, polynomial, found, v), 1e-10) << "vertex " << v;
    for (int a = 0, s = 0; a < mesh.gdim(); ++a)
      for (int b = a; b < mesh.gdim(); ++b, ++s)
        EXPECT_NEAR(hessians(v, s), polynomial.hessian(mesh.vertices().row(v).transpose(), a, b), 1e-9) << v;
  }
  EXPECT_GT(num_determined, 0.8 * mesh.num_vertices());
}

TYPED_TEST(ReconstructorContract, TranslatedValuesGiveTheSameGradients) {
  const Mesh mesh = this->mesh();
  for (const json& specification : all_reconstructors()) {
    const Reconstruction rows = reconstruct(specification, mesh);
    // Multiples of 2^-20 stay exact under a shift by 2^20: the differences, and so the gradients, are the same bits.
    Values<double> values = (wave(mesh).array() * 0x1p20).round().matrix() * 0x1p-20;
    const Values<double> before = gradients(rows, values);
    values.array() += 0x1p20;
    EXPECT_EQ((gradients(rows, values) - before).cwiseAbs().maxCoeff(), 0) << specification;
  }
}

TYPED_TEST(ReconstructorContract, FollowsRotationScaleAndOffset) {
  const int gdim = TypeParam::dim;
  Eigen::MatrixXd rotation = Eigen::MatrixXd::Identity(gdim, gdim);
  if (gdim == 2) rotation = Eigen::Rotation2Dd(0.7).toRotationMatrix();
  if (gdim == 3) rotation = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  struct Case {
    double scale, offset, tolerance;
  };
  // The plain lattice, where all distances tie and only their round-off differs, and the jittered one.
  for (const double jitter : {0.0, 0.2}) {
    const Mesh mesh = test::lattice<TypeParam>(gdim == 3 ? 3 : 5, jitter, 3);
    // An offset of 1e8 leaves positions of the unit cube 1.5e-8 of their digits.
    for (const Case& c : {Case{1, 0, 1e-9}, Case{1e-12, 0, 1e-9}, Case{1e12, 0, 1e-9}, Case{1, 1e8, 1e-4}}) {
      const Mesh moved = test::transformed(mesh, c.scale * rotation, Eigen::VectorXd::Constant(gdim, c.offset));
      for (const json& specification : all_reconstructors()) {
        const Values<double> before = gradients(reconstruct(specification, mesh), wave(mesh)),
                             after = gradients(reconstruct(specification, moved), wave(mesh));
        for (int k = 0; k < 2; ++k)
          EXPECT_LT((after.middleCols(k * gdim, gdim) * rotation * c.scale - before.middleCols(k * gdim, gdim))
                        .cwiseAbs()
                        .maxCoeff(),
                    c.tolerance * before.cwiseAbs().maxCoeff())
              << specification << " scale " << c.scale << " offset " << c.offset << " jitter " << jitter;
      }
    }
  }
}

TYPED_TEST(ReconstructorContract, NumberingPlaysNoPart) {
  // The plain lattice, where distances tie, and the jittered one.
  for (const double jitter : {0.0, 0.2}) {
    const Mesh mesh = test::lattice<TypeParam>(TypeParam::dim == 3 ? 3 : 5, jitter, 3);
    std::vector<Index> number = all_vertices(mesh);
    std::mt19937 random(5);
    std::shuffle(number.begin(), number.end(), random);
    Points vertices(mesh.num_vertices(), mesh.gdim());
    for (Index v = 0; v < mesh.num_vertices(); ++v) vertices.row(number[v]) = mesh.vertices().row(v);
    auto block = std::get<ElementBlock<TypeParam>>(mesh.blocks()[0]);
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c)
      for (int i = 0; i < TypeParam::num_nodes; ++i) block.cells(c, i) = number[block.cells(c, i)];
    block.cells = block.cells.colwise().reverse().eval();
    const Mesh renumbered(vertices, {block});
    for (const json& specification : all_reconstructors()) {
      const Values<double> before = gradients(reconstruct(specification, mesh), wave(mesh)),
                           after = gradients(reconstruct(specification, renumbered), wave(renumbered));
      double worst = 0;
      for (Index v = 0; v < mesh.num_vertices(); ++v)
        worst = std::max(worst, (after.row(number[v]) - before.row(v)).cwiseAbs().maxCoeff());
      EXPECT_LT(worst, 1e-9 * before.cwiseAbs().maxCoeff()) << specification << " jitter " << jitter;
    }
  }
}

TYPED_TEST(ReconstructorContract, ASubsetHasTheSameRows) {
  const Mesh mesh = this->mesh();
  std::vector<Index> some;
  for (Index v = mesh.num_vertices() - 1; v >= 0; v -= 3) some.push_back(v);
  for (const json& specification : all_reconstructors()) {
    const Reconstruction part = make_reconstructor(specification).reconstructor->reconstruct(CellGradients(mesh), some);
    const Values<double> full = gradients(reconstruct(specification, mesh), wave(mesh)),
                         found = gradients(part, wave(mesh));
    for (std::size_t r = 0; r < some.size(); ++r)
      EXPECT_EQ((found.row(static_cast<Eigen::Index>(r)) - full.row(some[r])).cwiseAbs().maxCoeff(), 0)
          << specification;
  }
}

// One cell, a row of cells, a layer of cells, and an unused vertex beside them: finite, bounded, affine fields exact.
TYPED_TEST(ReconstructorContract, ThinMeshesGiveBoundedRows) {
  constexpr int dim = TypeParam::dim;
  const Mesh cube = test::lattice<TypeParam>(dim == 1 ? 1 : 4, 0, 1);
  const auto& block = std::get<ElementBlock<TypeParam>>(cube.blocks()[0]);
  for (int num_thin = 0; num_thin <= dim; ++num_thin) {
    ElementBlock<TypeParam> kept;
    std::vector<Eigen::Index> cells;
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
      const auto positions = node_positions(cube, block, c);
      bool inside = true;
      for (int a = 0; a < num_thin; ++a) inside = inside && positions.col(a).maxCoeff() < 0.26 + (dim == 1);
      if (inside) cells.push_back(c);
    }
    if (num_thin == dim) cells.resize(1);
    kept.cells = block.cells(cells, Eigen::all);
    const Mesh mesh(cube.vertices(), {kept});
    const CellGradients incidence(mesh);
    const Polynomial affine{1};
    for (const json& specification : all_reconstructors()) {
      const Reconstruction rows = reconstruct(specification, mesh);
      const Values<double> found = gradients(rows, sample(mesh, affine));
      ASSERT_TRUE(found.allFinite()) << specification;
      for (Index v = 0; v < mesh.num_vertices(); ++v) {
        if (incidence.cells_of(v).empty()) {
          EXPECT_EQ(rows.stencils.diagnostics[v].rule, StencilRule::none) << specification;
          EXPECT_EQ(found.row(v).cwiseAbs().maxCoeff(), 0) << specification;
        } else {
          EXPECT_LT(gradient_error(mesh, affine, found, v), 1e-10) << specification << " thin " << num_thin;
        }
        // Accepted rows stay below 20 (cubic drift 40); the one of least expected error may pass that by a factor.
        EXPECT_LT(rows.stencils.diagnostics[v].absolute_sum, specification == cubic ? 100 : 40)
            << specification << " thin " << num_thin;
      }
    }
  }
}

}  // namespace
}  // namespace halfgrad
