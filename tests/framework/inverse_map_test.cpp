#include "framework/inverse_map.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/support/test_meshes.hpp"

namespace halfgrad {
namespace {

constexpr int num_cells = 10000;

// Distorted cells an element; a full measurement sets HALFGRAD_INVERSE_CELLS=1000000 (docs/locating.md).
int num_distorted_cells() {
  const char* wanted = std::getenv("HALFGRAD_INVERSE_CELLS");
  return wanted != nullptr ? std::atoi(wanted) : num_cells;
}

template <class E>
class Inverse : public testing::Test {};
using AllElements = Elements::apply<testing::Types, std::type_identity_t>;
TYPED_TEST_SUITE(Inverse, AllElements);

template <int Rows, int Columns>
Eigen::Matrix<double, Rows, Columns> random_matrix(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  return Eigen::Matrix<double, Rows, Columns>::NullaryExpr([&] { return uniform(random); });
}

// Least det J over a lattice of the reference cell that reaches its nodes.
template <Element E>
double least_determinant(const NodeMatrix<E>& positions) {
  if constexpr (E::affine) return (positions.transpose() * E::shape_gradient(E::center())).determinant();
  constexpr int steps = 4;
  int num_samples = 1;
  for (int a = 0; a < E::dim; ++a) num_samples *= steps + 1;
  double least = std::numeric_limits<double>::infinity();
  const auto take = [&](const ReferencePoint<E>& xi) {
    const ReferencePoint<E> inner = E::center() + 0.999999 * (xi - E::center());
    least = std::min(least, (positions.transpose() * E::shape_gradient(inner)).determinant());
  };
  for (int s = 0; s < num_samples; ++s) {
    ReferencePoint<E> xi;
    for (int a = 0, rest = s; a < E::dim; ++a, rest /= steps + 1) xi[a] = double(rest % (steps + 1)) / steps;
    if (contains<E>(xi, 0)) take(xi);
  }
  for (int i = 0; i < E::num_nodes; ++i) take(E::nodes().row(i).transpose());
  return least;
}

// The reference cell with nodes moved along a random direction, up to where det J turns negative.
template <Element E>
NodeMatrix<E> distorted(std::mt19937& random) {
  const NodeMatrix<E> nodes = E::nodes(), direction = random_matrix<E::num_nodes, E::dim>(random);
  double good = 0, bad = 4;
  for (int i = 0; i < 8; ++i) {
    const double middle = 0.5 * (good + bad);
    (least_determinant<E>(nodes + middle * direction) > 0 ? good : bad) = middle;
  }
  return nodes + std::uniform_real_distribution<double>(0.5, 0.99)(random) * good * direction;
}

// |x(ξ) − X| in units of the cell's extent, axis by axis.
template <Element E>
double residual(const InverseMap<E>& map, const NodeMatrix<E>& positions, const ReferencePoint<E>& position,
                const ReferencePoint<E>& xi) {
  return map.difference(position, xi).cwiseQuotient(cell_extent<E>(positions)).norm();
}

TYPED_TEST(Inverse, RoundTripOnCellsDistortedToTheLimitOfPositiveJacobians) {
  using E = TypeParam;
  std::mt19937 random(1);
  int lost = 0;
  double worst = 0;
  for (int c = 0; c < num_distorted_cells(); ++c) {
    const NodeMatrix<E> positions = distorted<E>(random);
    const InverseMap<E> map(positions);
    ASSERT_FALSE(map.degenerate());
    const ReferencePoint<E> position = cell_position<E>(positions, test::random_inside<E>(random));
    const InverseMapResult<E> result = map(position);
    // Near the limit the map may cover a position twice: any ξ in the cell is right. Rounding of X moves ξ by 1 / det
    // J.
    if (!result.converged || E::margin(result.xi) < -1e-9) ++lost;
    if (result.converged) worst = std::max(worst, residual<E>(map, positions, position, result.xi));
    EXPECT_FALSE(map.surely_outside(position, 1e-9));
  }
  EXPECT_EQ(lost, 0);
  EXPECT_LE(worst, 2e-12);  // 1e-12 in units of powers of two, which are up to twice the extents
  this->RecordProperty("worst_residual", std::to_string(worst * 1e12) + "e-12");
}

TYPED_TEST(Inverse, IsTheClosedFormOnParallelepipeds) {
  using E = TypeParam;
  std::mt19937 random(2);
  for (int c = 0; c < num_cells; ++c) {
    const Eigen::Matrix<double, E::dim, E::dim> linear = random_matrix<E::dim, E::dim>(random);
    if (std::abs(linear.determinant()) < 1e-3) continue;
    const ReferencePoint<E> offset = random_matrix<E::dim, 1>(random);
    const NodeMatrix<E> positions = (E::nodes() * linear.transpose()).rowwise() + offset.transpose();
    const InverseMap<E> map(positions);
    const ReferencePoint<E> xi = 3 * random_matrix<E::dim, 1>(random);
    const InverseMapResult<E> result = map(linear * xi + offset);
    EXPECT_TRUE(map.affine());
    EXPECT_TRUE(result.converged);
    // |J⁻¹| ≤ |J|^(dim−1) / det ≤ 1e4 carries the rounding of positions of size 10.
    EXPECT_LT((result.xi - xi).norm(), 1e-10);
  }
}

TYPED_TEST(Inverse, FoldedCellsSayNotConvergedOrGiveAPreimage) {
  using E = TypeParam;
  std::mt19937 random(3);
  int num_found = 0, num_tried = 0;
  for (int c = 0; c < num_cells; ++c) {
    const NodeMatrix<E> positions = random_matrix<E::num_nodes, E::dim>(random);
    const InverseMap<E> map(positions);
    if (map.degenerate()) continue;
    const ReferencePoint<E> position = cell_position<E>(positions, test::random_inside<E>(random));
    const InverseMapResult<E> result = map(position);
    ++num_tried;
    if (!result.converged) continue;
    num_found += E::margin(result.xi) >= -1e-9;
    // Far preimages of positions near a fold carry the size of their own ξ.
    EXPECT_LE(residual<E>(map, positions, position, result.xi), 2e-12);
  }
  // Every position has a ξ in the cell. Random nodes fold most cells; a search that gave up early would find far fewer.
  EXPECT_GE(num_found, 0.95 * num_tried);
}

TYPED_TEST(Inverse, StretchingAlongAxesCostsNoDigits) {
  using E = TypeParam;
  std::mt19937 random(4);
  for (int c = 0; c < 1000; ++c) {
    NodeMatrix<E> positions = distorted<E>(random);
    positions.col(0) *= 1e8;
    const InverseMap<E> map(positions);
    ASSERT_FALSE(map.degenerate());
    const ReferencePoint<E> position = cell_position<E>(positions, test::random_inside<E>(random));
    const InverseMapResult<E> result = map(position);
    EXPECT_TRUE(result.converged);
    EXPECT_GE(E::margin(result.xi), -1e-9);
  }
}

TYPED_TEST(Inverse, RefusesFlatCellsWhateverTheirScale) {
  using E = TypeParam;
  std::mt19937 random(5);
  for (int c = 0; c < 1000; ++c) {
    NodeMatrix<E> flat = distorted<E>(random);
    // Nodes moved into a plane oblique to all axes, up to rounding.
    const ReferencePoint<E> normal = random_matrix<E::dim, 1>(random)
                                         .unaryExpr([](double x) { return std::copysign(0.5 + 0.5 * std::abs(x), x); })
                                         .normalized();
    flat -= (flat * normal) * normal.transpose();
    EXPECT_TRUE(InverseMap<E>(1e-6 * flat).degenerate());
    EXPECT_TRUE(InverseMap<E>(1e6 * flat).degenerate());
  }
}

TEST(UnitScale, IsThePowerOfTwoThatBringsAnExtentToOne) {
  for (const double extent : {1.0, 0.75, 1e-300, 1e300, 3.0, 0.5}) {
    int exponent;
    const double scaled = unit_scale(extent) * extent;
    EXPECT_GE(scaled, 0.5);
    EXPECT_LT(scaled, 1);
    EXPECT_EQ(std::frexp(unit_scale(extent), &exponent), 0.5);
  }
  EXPECT_EQ(unit_scale(0), 1);
}

}  // namespace
}  // namespace halfgrad
