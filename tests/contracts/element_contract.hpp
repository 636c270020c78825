// What every element must satisfy, as a GoogleTest suite for elements of this project and of others: include it, then
//
//   INSTANTIATE_TYPED_TEST_SUITE_P(Mine, ElementContract, testing::Types<MyElement>);
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "framework/cell_blocks.hpp"
#include "framework/interpolant.hpp"
#include "tests/support/random_inside.hpp"

namespace halfgrad {

/// The reference cell with every node moved by up to `reach` times its box along each axis.
template <Element E>
NodeMatrix<E> contract_cell(std::mt19937& random, double reach) {
  NodeMatrix<E> nodes = E::nodes();
  std::uniform_real_distribution<double> uniform(-reach, reach);
  for (int a = 0; a < E::dim; ++a) {
    const double extent = nodes.col(a).maxCoeff() - nodes.col(a).minCoeff();
    for (int i = 0; i < E::num_nodes; ++i) nodes(i, a) += extent * uniform(random);
  }
  return nodes;
}

/// A random quadratic of R^d, without its constant.
struct ContractQuadratic {
  Eigen::MatrixXd hessian;
  Eigen::VectorXd slope;

  ContractQuadratic(int d, std::mt19937& random) : hessian(d, d), slope(d) {
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (double& entry : hessian.reshaped()) entry = uniform(random);
    for (double& entry : slope) entry = uniform(random);
    hessian += hessian.transpose().eval();
  }
  double value(const Eigen::VectorXd& X) const { return 0.5 * X.dot(hessian * X) + slope.dot(X); }
  Eigen::VectorXd gradient(const Eigen::VectorXd& X) const { return hessian * X + slope; }
};

/// Frobenius norm of the difference of two arrays of one size.
template <class First, class Second>
double contract_difference(const First& first, const Second& second) {
  double squared = 0;
  for (Eigen::Index r = 0; r < first.rows(); ++r)
    for (Eigen::Index c = 0; c < first.cols(); ++c) squared += std::pow(first(r, c) - second(r, c), 2);
  return std::sqrt(squared);
}

template <class E>
class ElementContract : public testing::Test {};
TYPED_TEST_SUITE_P(ElementContract);

TYPED_TEST_P(ElementContract, SatisfiesTheConcept) { static_assert(Element<TypeParam>); }

TYPED_TEST_P(ElementContract, ShapeIsOneAtItsNodeAndZeroAtOthers) {
  const auto nodes = TypeParam::nodes();
  for (int i = 0; i < TypeParam::num_nodes; ++i) {
    const NodeVector<TypeParam> beta = TypeParam::shape(nodes.row(i).transpose());
    for (int j = 0; j < TypeParam::num_nodes; ++j) EXPECT_NEAR(beta[j], i == j ? 1 : 0, 1e-14);
  }
}

TYPED_TEST_P(ElementContract, WeightsSumToOneAndReproducePosition) {
  std::mt19937 random(1);
  for (int n = 0; n < 200; ++n) {
    const auto xi = test::random_inside<TypeParam>(random);
    EXPECT_NEAR(TypeParam::shape(xi).sum(), 1, 1e-14);
    EXPECT_LT(contract_difference(cell_position<TypeParam>(TypeParam::nodes(), xi), xi), 1e-14);
  }
}

TYPED_TEST_P(ElementContract, PolynomialsAreTheShapeFunctions) {
  if constexpr (MonomialElement<TypeParam>) {
    std::mt19937 random(4);
    for (int n = 0; n < 50; ++n) {
      const auto xi = test::random_inside<TypeParam>(random);
      Eigen::Matrix<double, num_variables<TypeParam>, 1> eta;
      eta.template head<TypeParam::dim>() = xi;
      if constexpr (RationalElement<TypeParam>) {
        const auto affine = [&](const auto& f) {
          double sum = f[0];
          for (int k = 0; k < TypeParam::dim; ++k) sum += f[static_cast<std::size_t>(k) + 1] * xi[k];
          return sum;
        };
        const auto& [first, second, denominator] = TypeParam::rational;
        eta[TypeParam::dim] = affine(first) * affine(second) / affine(denominator);
      }
      NodeVector<TypeParam> beta = NodeVector<TypeParam>::Zero();
      for (std::size_t m = 0; m < TypeParam::shape_monomials.size(); ++m) {
        double monomial = 1;
        for (int k = 0; k < num_variables<TypeParam>; ++k)
          monomial *= std::pow(eta[k], TypeParam::shape_monomials[m][static_cast<std::size_t>(k)]);
        for (int i = 0; i < TypeParam::num_nodes; ++i)
          beta[i] += TypeParam::shape_coefficients[m][static_cast<std::size_t>(i)] * monomial;
      }
      EXPECT_LT(contract_difference(beta, TypeParam::shape(xi)), 1e-15 * 8);
    }
    EXPECT_EQ(TypeParam::shape_monomials[0], (std::array<int, num_variables<TypeParam>>{}));
  } else {
    GTEST_SKIP() << TypeParam::name << " states no polynomials";
  }
}

TYPED_TEST_P(ElementContract, CubeCollapsesOntoTheCell) {
  using E = TypeParam;
  if constexpr (CubeElement<E>) {
    std::mt19937 random(6);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (int n = 0; n < 200; ++n) {
      std::array<double, E::dim> u;
      for (double& coordinate : u) coordinate = uniform(random);
      NodeVector<E> beta = NodeVector<E>::Zero();
      for (std::size_t c = 0; c < std::size_t{1} << E::dim; ++c) {
        double weight = 1;
        for (std::size_t k = 0; k < u.size(); ++k) weight *= c >> k & 1 ? u[k] : 1 - u[k];
        beta[E::cube_nodes[c]] += weight;
      }
      const ReferencePoint<E> xi = E::nodes().transpose() * beta;
      EXPECT_TRUE(contains<E>(xi, 1e-14));
      EXPECT_LT(contract_difference(E::shape(xi), beta), 1e-13);
    }
    // Onto: no node is left out.
    for (int i = 0; i < E::num_nodes; ++i)
      EXPECT_EQ(std::count(E::cube_nodes.begin(), E::cube_nodes.end(), i) > 0, true) << "node " << i;
  } else {
    GTEST_SKIP() << TypeParam::name << " is not stated as a cube";
  }
}

TYPED_TEST_P(ElementContract, GradientIsTheDerivativeOfShape) {
  std::mt19937 random(2);
  for (int n = 0; n < 50; ++n) {
    const auto xi = test::random_inside<TypeParam>(random);
    const NodeMatrix<TypeParam> gradient = TypeParam::shape_gradient(xi);
    for (int a = 0; a < TypeParam::dim; ++a) {
      constexpr double step = 1e-6;
      ReferencePoint<TypeParam> plus = xi, minus = xi;
      plus[a] += step;
      minus[a] -= step;
      const NodeVector<TypeParam> difference = (TypeParam::shape(plus) - TypeParam::shape(minus)) / (2 * step);
      EXPECT_LT(contract_difference(gradient.col(a), difference), 1e-8);
    }
  }
}

TYPED_TEST_P(ElementContract, CellGradientIsThatOfTheShapeFunctionsAtTheCenter) {
  using E = TypeParam;
  std::mt19937 random(5);
  for (int n = 0; n < 50; ++n) {
    const NodeMatrix<E> nodes = contract_cell<E>(random, 0.15);
    const CellGradient cell = cell_gradient<E>(nodes);
    const Eigen::MatrixXd positions = nodes, derivative = E::shape_gradient(E::center());
    const Eigen::VectorXd beta = E::shape(E::center());
    const Eigen::MatrixXd jacobian = positions.transpose() * derivative;
    EXPECT_LE((cell.centroid - positions.transpose() * beta).norm(), 1e-14);
    EXPECT_NEAR(cell.volume, std::abs(jacobian.determinant()) * E::reference_volume, 1e-14);
    EXPECT_LE((cell.weights - derivative * jacobian.inverse()).norm(), 1e-12);
  }
}

TYPED_TEST_P(ElementContract, MarginIsZeroAtNodesAndPositiveAtTheCenter) {
  const auto nodes = TypeParam::nodes();
  EXPECT_GT(TypeParam::margin(TypeParam::center()), 0.1);
  for (int i = 0; i < TypeParam::num_nodes; ++i) {
    const ReferencePoint<TypeParam> node = nodes.row(i).transpose(), outward = node - TypeParam::center();
    EXPECT_NEAR(TypeParam::margin(node), 0, 1e-15);
    EXPECT_FALSE(contains<TypeParam>(node + 1e-6 * outward, 1e-9));
    EXPECT_FALSE(contains<TypeParam>(node + 2 * outward, 0));
  }
}

TYPED_TEST_P(ElementContract, FacetsLieOnTheBoundaryAndCoverEveryNode) {
  const auto nodes = TypeParam::nodes();
  std::array<int, TypeParam::num_nodes> uses{};
  for (const Facet& facet : TypeParam::facets) {
    ReferencePoint<TypeParam> middle = ReferencePoint<TypeParam>::Zero();
    for (int i = 0; i < facet.num_nodes; ++i) {
      ++uses[facet.nodes[i]];
      for (int a = 0; a < TypeParam::dim; ++a) middle[a] += nodes(facet.nodes[i], a) / facet.num_nodes;
    }
    EXPECT_NEAR(TypeParam::margin(middle), 0, 1e-15);
    // Outward: a step from the center through the facet leaves the cell.
    const ReferencePoint<TypeParam> outward = middle - TypeParam::center();
    EXPECT_LT(TypeParam::margin(middle + 0.1 * outward), 0);
  }
  for (int count : uses) EXPECT_GE(count, TypeParam::dim);
}

TYPED_TEST_P(ElementContract, ReferenceVolumeIsTheShareOfTheNodesBox) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  const NodeMatrix<TypeParam> nodes = TypeParam::nodes();
  const ReferencePoint<TypeParam> extent = cell_extent<TypeParam>(nodes);
  constexpr int samples = 200000;
  int inside = 0;
  for (int n = 0; n < samples; ++n) {
    ReferencePoint<TypeParam> xi;
    for (int a = 0; a < TypeParam::dim; ++a) xi[a] = nodes.col(a).minCoeff() + extent[a] * uniform(random);
    inside += contains<TypeParam>(xi, 0);
  }
  // Five standard deviations of the count.
  EXPECT_NEAR(static_cast<double>(inside) / samples * extent.prod(), TypeParam::reference_volume,
              0.006 * extent.prod());
}

TYPED_TEST_P(ElementContract, InverseMapReturnsToThePoint) {
  using E = TypeParam;
  std::mt19937 random(4);
  for (int n = 0; n < 500; ++n) {
    const NodeMatrix<E> cell = contract_cell<E>(random, 0.08);
    const InverseMap<E> map(cell);
    ASSERT_FALSE(map.degenerate());
    const ReferencePoint<E> xi = test::random_inside<E>(random), position = cell_position<E>(cell, xi);
    const InverseMapResult<E> result = map(position);
    ASSERT_TRUE(result.converged);
    EXPECT_LT(contract_difference(result.xi, xi), 1e-11);
  }
}

TYPED_TEST_P(ElementContract, PhongReproducesQuadraticsFromExactGradients) {
  // On one distorted cell: wrong factors, signs, transposes and node orders all show.
  using E = TypeParam;
  std::mt19937 random(5);
  const NodeMatrix<E> cell = contract_cell<E>(random, 0.08);
  CellBlocks<E> cells;
  cells.vertices = cell;
  auto& block = std::get<0>(cells.blocks);
  block.cells.resize(1, E::num_nodes);
  for (int i = 0; i < E::num_nodes; ++i) block.cells(0, i) = i;
  constexpr int num_points = 100;
  Points points(num_points, E::dim);
  for (int p = 0; p < num_points; ++p)
    points.row(p) = cell_position<E>(cell, test::random_inside<E>(random)).transpose();

  const ContractQuadratic field(E::dim, random);
  Values<double> values(E::num_nodes, 1), gradients(E::num_nodes, E::dim), out;
  const WeightedPoints weights = embed(cells, points);
  const Interpolant<double> phong(weights, named_rule("phong"), nullptr);
  for (int i = 0; i < E::num_nodes; ++i) {
    values(i, 0) = field.value(cells.vertices.row(i));
    gradients.row(i) = field.gradient(cells.vertices.row(phong.active()[i]));
  }
  phong.evaluate_given(values, gradients, {}, out);
  for (int p = 0; p < num_points; ++p) EXPECT_NEAR(out(p, 0), field.value(points.row(p)), 1e-13);
}

REGISTER_TYPED_TEST_SUITE_P(ElementContract, SatisfiesTheConcept, ShapeIsOneAtItsNodeAndZeroAtOthers,
                            WeightsSumToOneAndReproducePosition, PolynomialsAreTheShapeFunctions,
                            CubeCollapsesOntoTheCell, GradientIsTheDerivativeOfShape,
                            CellGradientIsThatOfTheShapeFunctionsAtTheCenter, MarginIsZeroAtNodesAndPositiveAtTheCenter,
                            FacetsLieOnTheBoundaryAndCoverEveryNode, ReferenceVolumeIsTheShareOfTheNodesBox,
                            InverseMapReturnsToThePoint, PhongReproducesQuadraticsFromExactGradients);

}  // namespace halfgrad
