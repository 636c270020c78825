// The evaluator against mathematics: exactness, interpolation, continuity, invariance; typed over the registry.
#include "framework/interpolant.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <functional>
#include <map>

#include "reconstruction/cell_averages.hpp"
#include "support/message_of.hpp"
#include "support/test_meshes.hpp"

namespace halfgrad {
namespace {

using testing::HasSubstr;

constexpr Index num_samples = 400;

// Points at random ξ of random cells, embedded by construction: these tests do not depend on the locator.
template <Element E>
std::pair<Points, Embedding> sampled(const Mesh& mesh, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<Index> cell(0, mesh.num_cells() - 1);
  const auto& block = std::get<ElementBlock<E>>(mesh.blocks()[0]);
  Points points(num_samples, E::dim);
  Embedding embedding;
  embedding.gdim = E::dim;
  embedding.local.resize(num_samples, E::dim);
  embedding.status.assign(num_samples, PointStatus::inside);
  for (Index p = 0; p < num_samples; ++p) {
    embedding.cells.push_back(cell(random));
    const auto xi = test::random_inside<E>(random);
    embedding.local.row(p) = xi.transpose();
    points.row(p) = (node_positions(mesh, block, embedding.cells[p]).transpose() * E::shape(xi)).transpose();
  }
  return {points, embedding};
}

// A field u: R^d → R² with its gradient (2 × d, flattened) and Hessian (2 × symmetric entries).
struct Field {
  std::function<Eigen::Vector2d(const Vector&)> value;
  std::function<Eigen::VectorXd(const Vector&)> gradient, hessian;
};

// All monomials of degree `degree` along two skew directions, so that mixed derivatives take part.
Field power_field(int dim, int degree) {
  Vector first(dim), second(dim);
  for (int k = 0; k < dim; ++k) {
    first[k] = 0.9 - 0.4 * k;
    second[k] = 0.3 + 0.5 * k * k;
  }
  const auto power = [degree](double t, int derivative) {
    double factor = 1;
    for (int k = 0; k < derivative; ++k) factor *= degree - k;
    return degree < derivative ? 0.0 : factor * std::pow(t, degree - derivative);
  };
  Field field;
  field.value = [=](const Vector& X) { return Eigen::Vector2d(power(first.dot(X), 0), power(second.dot(X), 0)); };
  field.gradient = [=](const Vector& X) {
    Eigen::VectorXd g(2 * dim);
    g << power(first.dot(X), 1) * first, power(second.dot(X), 1) * second;
    return g;
  };
  field.hessian = [=](const Vector& X) {
    Eigen::VectorXd h(2 * num_symmetric(dim));
    int entry = 0;
    for (const Vector& direction : {first, second})
      for (int k = 0; k < dim; ++k)
        for (int l = k; l < dim; ++l) h[entry++] = power(direction.dot(X), 2) * direction[k] * direction[l];
    return h;
  };
  return field;
}

Values<double> at_points(const Points& points, const std::function<Eigen::VectorXd(const Vector&)>& f) {
  Values<double> result;
  for (Eigen::Index p = 0; p < points.rows(); ++p) {
    const Eigen::VectorXd row = f(points.row(p).transpose());
    if (p == 0) result.resize(points.rows(), row.size());
    result.row(p) = row.transpose();
  }
  return result;
}

Points rows_of(const Points& points, std::span<const Index> rows) {
  Points result(static_cast<Eigen::Index>(rows.size()), points.cols());
  for (std::size_t r = 0; r < rows.size(); ++r) result.row(static_cast<Eigen::Index>(r)) = points.row(rows[r]);
  return result;
}

// The field through an interpolant with exact vertex gradients and Hessians.
Values<double> with_exact_gradients(const Mesh& mesh, const Embedding& embedding, const InterpolationRule& rule,
                                    const Field& field) {
  const Interpolant<double> interpolant(mesh, embedding, rule, nullptr);
  const Points active = rows_of(mesh.vertices(), interpolant.active());
  Values<double> out;
  interpolant.evaluate_given(at_points(mesh.vertices(), field.value), at_points(active, field.gradient),
                             at_points(active, field.hessian), out);
  return out;
}

Reconstruction reconstruct(const Mesh& mesh, const Embedding& embedding) {
  return ChandrashekarGarg().reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
}

template <class E>
class InterpolantOn : public testing::Test {
 protected:
  Mesh mesh = test::lattice<E>(3, 0.2, 5);
  std::pair<Points, Embedding> sample = sampled<E>(mesh, 11);
  const Points& points = sample.first;
  const Embedding& embedding = sample.second;
};

using AllElements = Elements::apply<testing::Types, std::type_identity_t>;
TYPED_TEST_SUITE(InterpolantOn, AllElements);

double largest(const Values<double>& difference) { return difference.cwiseAbs().maxCoeff(); }

TYPED_TEST(InterpolantOn, ReproducesPolynomialsUpToTheDegreeOfEachRuleFromExactData) {
  for (const NamedRule& named : named_rules()) {
    if (named.rule.formula == Formula::quadratic10 && !TypeParam::affine) continue;
    // Cubic Hermite interpolation in one dimension is exact for cubics.
    const bool cubic =
        named.rule.formula == Formula::dual_taylor || (named.rule.formula == Formula::hermite && TypeParam::dim == 1);
    const bool affine = named.name == "linear" || named.name == "vertex_blend";
    const int degree = cubic ? 3 : affine ? 1 : 2;
    for (int k = 0; k <= degree; ++k) {
      const Field field = power_field(TypeParam::dim, k);
      const Values<double> truth = at_points(this->points, field.value);
      EXPECT_LT(largest(with_exact_gradients(this->mesh, this->embedding, named.rule, field) - truth), 1e-13)
          << named.name << ", degree " << k;
    }
    const Field beyond = power_field(TypeParam::dim, degree + 1);
    EXPECT_GT(largest(with_exact_gradients(this->mesh, this->embedding, named.rule, beyond) -
                      at_points(this->points, beyond.value)),
              1e-5)
        << named.name << " is not expected to be exact for degree " << degree + 1;
  }
}

TYPED_TEST(InterpolantOn, ErrorsOfLinearAndVertexBlendAreOppositeForQuadratics) {
  // James 2020, §5: E_V = −E_Linear for quadratics.
  const Field field = power_field(TypeParam::dim, 2);
  const Values<double> truth = at_points(this->points, field.value);
  const Values<double> linear = with_exact_gradients(this->mesh, this->embedding, named_rule("linear"), field) - truth;
  const Values<double> blend =
      with_exact_gradients(this->mesh, this->embedding, named_rule("vertex_blend"), field) - truth;
  EXPECT_GT(largest(linear), 1e-3);
  EXPECT_LT(largest(linear + blend), 1e-13);
}

TYPED_TEST(InterpolantOn, Quadratic10EqualsPhong) {
  if (!TypeParam::affine) GTEST_SKIP() << "quadratic10 is defined on simplices";
  const Field field = power_field(TypeParam::dim, 4);
  const Values<double> phong = with_exact_gradients(this->mesh, this->embedding, named_rule("phong"), field);
  const Values<double> midpoints = with_exact_gradients(this->mesh, this->embedding, named_rule("quadratic10"), field);
  EXPECT_LT(largest(phong - midpoints), 1e-15 * largest(at_points(this->mesh.vertices(), field.value)));
}

TYPED_TEST(InterpolantOn, InterpolatesVertices) {
  // Points at the nodes of every cell.
  const auto& block = std::get<ElementBlock<TypeParam>>(this->mesh.blocks()[0]);
  Embedding corners;
  corners.gdim = TypeParam::dim;
  corners.local.resize(this->mesh.num_cells() * TypeParam::num_nodes, TypeParam::dim);
  std::vector<Index> vertices;
  for (Index c = 0; c < this->mesh.num_cells(); ++c)
    for (int i = 0; i < TypeParam::num_nodes; ++i) {
      corners.local.row(corners.num_points()) = TypeParam::nodes().row(i);
      corners.cells.push_back(c);
      corners.status.push_back(PointStatus::inside);
      vertices.push_back(block.cells(c, i));
    }
  const Reconstruction reconstruction = reconstruct(this->mesh, corners);
  const Values<double> values = at_points(this->mesh.vertices(), power_field(TypeParam::dim, 3).value);
  for (const char* name : {"linear", "phong", "vertex_blend", "hermite"}) {
    const Values<double> result =
        Interpolant<double>(this->mesh, corners, named_rule(name), &reconstruction).evaluate(values);
    for (std::size_t p = 0; p < vertices.size(); ++p)
      ASSERT_LT((result.row(static_cast<Eigen::Index>(p)) - values.row(vertices[p])).norm(), 1e-14) << name;
  }
}

TYPED_TEST(InterpolantOn, IsContinuousAcrossFacets) {
  // Each interior facet seen from its two cells: the same ξ on the facet through matching node weights.
  using E = TypeParam;
  const auto& block = std::get<ElementBlock<E>>(this->mesh.blocks()[0]);
  std::map<std::vector<Index>, std::vector<std::pair<Index, Facet>>> owners;
  for (Index c = 0; c < this->mesh.num_cells(); ++c)
    for (const Facet& facet : E::facets) {
      std::vector<Index> key;
      for (int i = 0; i < facet.num_nodes; ++i) key.push_back(block.cells(c, facet.nodes[i]));
      std::sort(key.begin(), key.end());
      owners[key].push_back({c, facet});
    }
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0.05, 0.95);
  Embedding sides;
  sides.gdim = E::dim;
  std::vector<ReferencePoint<E>> local;
  for (const auto& [key, pair] : owners) {
    if (pair.size() != 2) continue;
    // A point on the edge between the facet's first and third vertex (of a quadrilateral facet: its middle), or at a
    // random place of a simplex facet: both sides describe it by the same vertex weights.
    std::map<Index, double> weight;
    const int num_nodes = static_cast<int>(key.size());
    if (num_nodes == 4) {
      for (Index v : key) weight[v] = 0.25;
    } else {
      double sum = 0;
      for (Index v : key) sum += weight[v] = uniform(random);
      for (Index v : key) weight[v] /= sum;
    }
    for (const auto& [cell, facet] : pair) {
      ReferencePoint<E> xi = ReferencePoint<E>::Zero();
      for (int i = 0; i < facet.num_nodes; ++i)
        xi += weight[block.cells(cell, facet.nodes[i])] * E::nodes().row(facet.nodes[i]).transpose();
      local.push_back(xi);
      sides.cells.push_back(cell);
      sides.status.push_back(PointStatus::inside);
    }
  }
  sides.local.resize(static_cast<Eigen::Index>(local.size()), E::dim);
  for (std::size_t p = 0; p < local.size(); ++p) sides.local.row(static_cast<Eigen::Index>(p)) = local[p].transpose();
  ASSERT_GT(local.size(), 2u);
  const Reconstruction reconstruction = reconstruct(this->mesh, sides);
  const Values<double> values = at_points(this->mesh.vertices(), power_field(E::dim, 4).value);
  for (const char* name : {"linear", "phong", "vertex_blend", "hermite"}) {
    const Interpolant<double> interpolant(this->mesh, sides, named_rule(name), &reconstruction);
    const Values<double> result = interpolant.evaluate(values);
    const bool has_gradients = interpolant.rule().needs_gradients();
    const Values<double> smooth = has_gradients ? interpolant.smooth_gradient(values) : result;
    for (Eigen::Index p = 0; p < result.rows(); p += 2) {
      ASSERT_LT((result.row(p) - result.row(p + 1)).norm(), 1e-13) << name;
      ASSERT_LT((smooth.row(p) - smooth.row(p + 1)).norm(), 1e-12) << name;
    }
  }
}

TYPED_TEST(InterpolantOn, EqualsItsMatrix) {
  const Reconstruction reconstruction = reconstruct(this->mesh, this->embedding);
  const Values<double> values = at_points(this->mesh.vertices(), power_field(TypeParam::dim, 3).value);
  for (const char* name : {"linear", "phong", "vertex_blend", "hermite"}) {
    const Interpolant<double> interpolant(this->mesh, this->embedding, named_rule(name), &reconstruction);
    const auto matrix = interpolant.matrix();
    EXPECT_LT(largest(interpolant.evaluate(values) - Values<double>(matrix * values)), 1e-13) << name;
    // S·1 = 1 and S·rest = points: constants and affine maps are reproduced.
    EXPECT_LT((matrix * Eigen::VectorXd::Ones(this->mesh.num_vertices()) - Eigen::VectorXd::Ones(num_samples))
                  .cwiseAbs()
                  .maxCoeff(),
              1e-13)
        << name;
    EXPECT_LT(largest(Values<double>(matrix * this->mesh.vertices()) - this->points), 1e-13) << name;
  }
}

TYPED_TEST(InterpolantOn, GradientIsTheDerivativeOfTheInterpolant) {
  using E = TypeParam;
  const Reconstruction reconstruction = reconstruct(this->mesh, this->embedding);
  const Values<double> values = at_points(this->mesh.vertices(), power_field(E::dim, 3).value);
  const auto& block = std::get<ElementBlock<E>>(this->mesh.blocks()[0]);
  constexpr double step = 1e-6;
  for (const char* name : {"linear", "phong", "vertex_blend", "hermite"}) {
    const Interpolant<double> interpolant(this->mesh, this->embedding, named_rule(name), &reconstruction);
    const Values<double> gradient = interpolant.gradient(values);
    for (int axis = 0; axis < E::dim; ++axis) {
      // Steps along a reference axis, within the cell's polynomial: df = ∇f · J e_axis.
      Embedding plus = this->embedding, minus = this->embedding;
      plus.local.col(axis).array() += step;
      minus.local.col(axis).array() -= step;
      const Values<double> difference =
          (Interpolant<double>(this->mesh, plus, named_rule(name), &reconstruction).evaluate(values) -
           Interpolant<double>(this->mesh, minus, named_rule(name), &reconstruction).evaluate(values)) /
          (2 * step);
      for (Index p = 0; p < num_samples; ++p) {
        const ReferencePoint<E> xi = this->embedding.local.row(p).transpose();
        const Eigen::Matrix<double, E::dim, 1> direction =
            node_positions(this->mesh, block, this->embedding.cells[p]).transpose() * E::shape_gradient(xi).col(axis);
        for (int c = 0; c < 2; ++c)
          ASSERT_NEAR(gradient.row(p).segment(c * E::dim, E::dim).dot(direction), difference(p, c), 2e-8)
              << name << ", point " << p;
      }
    }
  }
}

TYPED_TEST(InterpolantOn, AffineMapsOfTheDataPassThrough) {
  // James 2020, §3.3: T f(X; x) = f(X; T x), and translation changes nothing but the translation.
  const Reconstruction reconstruction = reconstruct(this->mesh, this->embedding);
  const Interpolant<double> interpolant(this->mesh, this->embedding, named_rule("phong"), &reconstruction);
  const Values<double> values = at_points(this->mesh.vertices(), power_field(TypeParam::dim, 3).value);
  Eigen::Matrix2d map;
  map << 0.3, -1.2, 2.1, 0.7;
  const Eigen::RowVector2d shift(3, -5);
  const Values<double> mapped = (values * map.transpose()).rowwise() + shift;
  const Values<double> expected = (interpolant.evaluate(values) * map.transpose()).rowwise() + shift;
  EXPECT_LT(largest(interpolant.evaluate(mapped) - expected), 1e-13);
  // A power of two and a far offset: gradients see differences only, so nothing but the offset's own rounding is lost.
  const Values<double> far = values.array() + 1e8;
  EXPECT_LT(largest(interpolant.evaluate(far) - (interpolant.evaluate(values).array() + 1e8).matrix()), 1e-6);
  EXPECT_TRUE(interpolant.evaluate(Values<double>(values * 4)) == interpolant.evaluate(values) * 4);
}

TYPED_TEST(InterpolantOn, FloatAgreesWithDouble) {
  const Reconstruction reconstruction = reconstruct(this->mesh, this->embedding);
  const Values<double> values = at_points(this->mesh.vertices(), power_field(TypeParam::dim, 3).value);
  const double extent = values.cwiseAbs().maxCoeff();
  for (const char* name : {"linear", "phong", "hermite"}) {
    const Interpolant<double> precise(this->mesh, this->embedding, named_rule(name), &reconstruction);
    const Interpolant<float> coarse(this->mesh, this->embedding, named_rule(name), &reconstruction);
    EXPECT_LT(largest(coarse.evaluate(values.cast<float>()).template cast<double>() - precise.evaluate(values)),
              1e-6 * extent)
        << name;
  }
}

TYPED_TEST(InterpolantOn, ColumnsAreIndependent) {
  const Reconstruction reconstruction = reconstruct(this->mesh, this->embedding);
  const Interpolant<double> interpolant(this->mesh, this->embedding, named_rule("phong"), &reconstruction);
  Values<double> values(this->mesh.num_vertices(), 5);
  for (int c = 0; c < 5; ++c)
    values.col(c) = at_points(this->mesh.vertices(), power_field(TypeParam::dim, c).value).col(0);
  const Values<double> together = interpolant.evaluate(values);
  // One column goes the fast path where there is one, five the plain path.
  for (int c = 0; c < 5; ++c)
    EXPECT_LT(largest(interpolant.evaluate(Values<double>(values.col(c))) - Values<double>(together.col(c))), 1e-14);
}

TYPED_TEST(InterpolantOn, ToleranceKeepsItsBound) {
  const Reconstruction reconstruction = reconstruct(this->mesh, this->embedding);
  const Interpolant<double> interpolant(this->mesh, this->embedding, named_rule("phong"), &reconstruction);
  const Values<double> values = at_points(this->mesh.vertices(), power_field(TypeParam::dim, 3).value);
  const Values<double> full = interpolant.evaluate(values);
  const Values<double> linear =
      with_exact_gradients(this->mesh, this->embedding, named_rule("linear"), power_field(TypeParam::dim, 3));
  Index before = 0;
  for (double tolerance : {1e-12, 3e-3, 1e-2, 3e-2, 1e-1, 10.0}) {
    const Values<double> result = interpolant.evaluate(values, {.tolerance = tolerance});
    EXPECT_LE((result - full).rowwise().norm().maxCoeff(), tolerance);
    const Index skipped = interpolant.num_linear_cells(values, {.tolerance = tolerance});
    EXPECT_GE(skipped, before);
    before = skipped;
    // Where the test would cost more than it saves, cells are evaluated in full.
    if (!TypeParam::affine) {
      EXPECT_EQ(result, full);
    }
  }
  EXPECT_EQ(before, TypeParam::affine ? interpolant.report().num_active_cells : 0);
  EXPECT_EQ(interpolant.num_linear_cells(values, {}), 0);
  EXPECT_LT(largest(interpolant.evaluate(values, {.tolerance = 10}) - (TypeParam::affine ? linear : full)), 1e-14);
}

TEST(Interpolant, OneAndTwoThreadsGiveTheSameBits) {
  const Mesh mesh = test::lattice<Tetrahedron>(8, 0.2, 1);
  const auto [few, embedding] = sampled<Tetrahedron>(mesh, 2);
  // Past the threshold below which a frame stays on one thread.
  Embedding many = embedding;
  constexpr int repetitions = 600;
  many.local.resize(num_samples * repetitions, 3);
  for (int r = 0; r < repetitions; ++r) {
    many.local.middleRows(r * num_samples, num_samples) = embedding.local * (1 - 1e-3 * r);
    if (r > 0) {
      many.cells.insert(many.cells.end(), embedding.cells.begin(), embedding.cells.end());
      many.status.insert(many.status.end(), embedding.status.begin(), embedding.status.end());
    }
  }
  const Reconstruction reconstruction = reconstruct(mesh, many);
  const Interpolant<float> interpolant(mesh, many, named_rule("phong"), &reconstruction);
  const Values<float> values = at_points(mesh.vertices(), power_field(3, 3).value).cast<float>();
  std::vector<Values<float>> results;
  for (std::size_t threads : {1, 2}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(interpolant.evaluate(values));
  }
  EXPECT_TRUE(results[0] == results[1]);
}

TEST(Interpolant, CountsOnlyWhatPointsTouch) {
  const Mesh mesh = test::lattice<Hexahedron>(4, 0, 1);
  Embedding one;
  one.gdim = 3;
  one.cells = {5, -1};
  one.local = Points::Constant(2, 3, 0.5);
  one.status = {PointStatus::inside, PointStatus::not_found};
  one.outside = {{1, 0.5, Vector::Zero(3)}};
  const Reconstruction reconstruction = reconstruct(mesh, one);
  EXPECT_EQ(reconstruction.stencils.num_rows(), 8);
  const Interpolant<double> interpolant(mesh, one, named_rule("phong"), &reconstruction);
  EXPECT_EQ(interpolant.report().num_active_cells, 1);
  EXPECT_EQ(interpolant.report().num_active_vertices, 8);
  EXPECT_EQ(interpolant.report().num_not_found, 1);
  EXPECT_EQ(interpolant.report().max_outside_distance, 0.5);
  const Values<double> result = interpolant.evaluate(Values<double>(mesh.vertices()));
  EXPECT_TRUE(result.row(0).allFinite());
  EXPECT_TRUE(result.row(1).array().isNaN().all());
  // Linear interpolation takes no stencils even where they are offered.
  EXPECT_EQ(Interpolant<double>(mesh, one, named_rule("linear"), &reconstruction).report().num_stencil_entries, 0);
}

TEST(Interpolant, RefusesWhatItCannotDo) {
  const Mesh mesh = test::lattice<Hexahedron>(2, 0, 1);
  const auto [points, embedding] = sampled<Hexahedron>(mesh, 2);
  const Reconstruction reconstruction = reconstruct(mesh, embedding);
  const Values<double> values = mesh.vertices();
  EXPECT_THAT(message_of([&] { Interpolant<double>(mesh, embedding, named_rule("dual_taylor"), &reconstruction); }),
              HasSubstr("Hessians"));
  EXPECT_THAT(message_of([&] { Interpolant<double>(mesh, embedding, named_rule("quadratic10"), &reconstruction); }),
              HasSubstr("simplices"));
  EXPECT_THAT(message_of([&] { named_rule("phnog"); }), HasSubstr("did you mean \"phong\""));
  const Interpolant<double> unbound(mesh, embedding, named_rule("phong"), nullptr);
  EXPECT_THAT(message_of([&] { unbound.evaluate(values); }), HasSubstr("without a reconstructor"));
  const Interpolant<double> bound(mesh, embedding, named_rule("phong"), &reconstruction);
  Values<double> out;
  EXPECT_THAT(message_of([&] { bound.evaluate(Values<double>(values.topRows(5))); }),
              HasSubstr("values of 5 vertices"));
  Reconstruction partial = reconstruction;
  partial = ChandrashekarGarg().reconstruct(CellGradients(mesh), std::vector<Index>{0, 1});
  EXPECT_THAT(message_of([&] { Interpolant<double>(mesh, embedding, named_rule("phong"), &partial); }),
              HasSubstr("no gradient stencil for vertex"));
  EXPECT_THAT(message_of([&] { bound.evaluate_given(values, Values<double>::Zero(3, 9), {}, out); }),
              HasSubstr("3 × 9"));
  const Embedding flat = embed(test::lattice<Quadrilateral>(2, 0, 1), Points::Constant(1, 2, 0.3));
  EXPECT_THAT(message_of([&] { Interpolant<double>(mesh, flat, named_rule("linear"), nullptr); }),
              HasSubstr("points embedded in 2 dimensions, but the mesh has 3"));
  const Reconstruction planar =
      ChandrashekarGarg().reconstruct(CellGradients(test::lattice<Quadrilateral>(2, 0, 1)), std::vector<Index>{0});
  EXPECT_THAT(message_of([&] { Interpolant<double>(mesh, embedding, named_rule("phong"), &planar); }),
              HasSubstr("stencils of dimension 2 for a mesh of 3"));
}

// A moved interpolant is the one that it was made from.
TEST(Interpolant, MovesWithItsBinding) {
  const Mesh mesh = test::lattice<Triangle>(2, 0.1, 1);
  const auto [points, embedding] = sampled<Triangle>(mesh, 5);
  Interpolant<double> first(mesh, embedding, named_rule("linear"), nullptr);
  const Values<double> before = first.evaluate(mesh.vertices());
  const Interpolant<double> second(std::move(first));
  EXPECT_EQ(second.gdim(), 2);
  EXPECT_EQ(second.num_points(), points.rows());
  EXPECT_EQ(second.evaluate(mesh.vertices()), before);
}

// At a corner of a hexahedron where two nodes coincide its map is singular: the gradient there is the continuous one.
TEST(Interpolant, GradientAtACollapsedCornerIsTheContinuousOne) {
  const Mesh cube = test::lattice<Hexahedron>(1, 0, 1);
  const std::span<const Index> nodes = cube.cell_vertices(0);
  Points vertices = cube.vertices();
  vertices.row(nodes[7]) = vertices.row(nodes[6]);
  const Mesh mesh(vertices, cube.blocks());
  Embedding embedding = embed(mesh, vertices.row(nodes[0]));
  embedding.local.row(0) = Hexahedron::nodes().row(6);
  const Reconstruction rows = reconstruct(mesh, embedding);
  const Interpolant<double> interpolant(mesh, embedding, named_rule("phong"), &rows);
  const Values<double> values = mesh.vertices() * Eigen::Vector3d(1, -2, 3);
  const Values<double> gradient = interpolant.gradient(values);
  EXPECT_EQ(gradient, interpolant.smooth_gradient(values));
  EXPECT_LE((gradient - Eigen::RowVector3d(1, -2, 3)).norm(), 1e-12);
}

}  // namespace
}  // namespace halfgrad
