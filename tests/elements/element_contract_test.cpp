// What every registered element must satisfy, typed over the registry.
#include <gtest/gtest.h>

#include <random>

#include "elements/registry.hpp"

namespace halfgrad {
namespace {

template <class E>
ReferencePoint<E> random_inside(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  ReferencePoint<E> xi;
  do {
    for (int a = 0; a < E::dim; ++a) xi[a] = uniform(random);
  } while (!contains<E>(xi, 0));
  return xi;
}

template <class E>
class ElementContract : public testing::Test {};

using AllElements = Elements::apply<testing::Types, std::type_identity_t>;
TYPED_TEST_SUITE(ElementContract, AllElements);

TYPED_TEST(ElementContract, SatisfiesTheConcept) { static_assert(Element<TypeParam>); }

TYPED_TEST(ElementContract, ShapeIsOneAtItsNodeAndZeroAtOthers) {
  const auto nodes = TypeParam::nodes();
  for (int i = 0; i < TypeParam::num_nodes; ++i) {
    const NodeVector<TypeParam> beta = TypeParam::shape(nodes.row(i).transpose());
    for (int j = 0; j < TypeParam::num_nodes; ++j) EXPECT_NEAR(beta[j], i == j ? 1 : 0, 1e-15);
  }
}

TYPED_TEST(ElementContract, WeightsSumToOneAndReproducePosition) {
  std::mt19937 random(1);
  const auto nodes = TypeParam::nodes();
  for (int n = 0; n < 200; ++n) {
    const auto xi = random_inside<TypeParam>(random);
    const NodeVector<TypeParam> beta = TypeParam::shape(xi);
    EXPECT_NEAR(beta.sum(), 1, 1e-14);
    EXPECT_LT((nodes.transpose() * beta - xi).norm(), 1e-14);
  }
}

TYPED_TEST(ElementContract, PolynomialsAreTheShapeFunctions) {
  if constexpr (PolynomialElement<TypeParam>) {
    std::mt19937 random(4);
    for (int n = 0; n < 50; ++n) {
      const auto xi = random_inside<TypeParam>(random);
      NodeVector<TypeParam> beta = NodeVector<TypeParam>::Zero();
      for (std::size_t m = 0; m < TypeParam::shape_monomials.size(); ++m) {
        double monomial = 1;
        for (int k = 0; k < TypeParam::dim; ++k)
          monomial *= std::pow(xi[k], TypeParam::shape_monomials[m][static_cast<std::size_t>(k)]);
        for (int i = 0; i < TypeParam::num_nodes; ++i)
          beta[i] += TypeParam::shape_coefficients[m][static_cast<std::size_t>(i)] * monomial;
      }
      EXPECT_LT((beta - TypeParam::shape(xi)).cwiseAbs().maxCoeff(), 1e-15 * 8);
    }
    EXPECT_EQ(TypeParam::shape_monomials[0], (std::array<int, TypeParam::dim>{}));
  } else {
    GTEST_SKIP() << TypeParam::name << " states no polynomials";
  }
}

TYPED_TEST(ElementContract, GradientIsTheDerivativeOfShape) {
  std::mt19937 random(2);
  for (int n = 0; n < 50; ++n) {
    const auto xi = random_inside<TypeParam>(random);
    const NodeMatrix<TypeParam> gradient = TypeParam::shape_gradient(xi);
    for (int a = 0; a < TypeParam::dim; ++a) {
      constexpr double step = 1e-6;
      ReferencePoint<TypeParam> plus = xi, minus = xi;
      plus[a] += step;
      minus[a] -= step;
      const NodeVector<TypeParam> difference = (TypeParam::shape(plus) - TypeParam::shape(minus)) / (2 * step);
      EXPECT_LT((gradient.col(a) - difference).cwiseAbs().maxCoeff(), 1e-8);
    }
  }
}

TYPED_TEST(ElementContract, MarginIsZeroAtNodesAndPositiveAtTheCenter) {
  const auto nodes = TypeParam::nodes();
  for (int i = 0; i < TypeParam::num_nodes; ++i) EXPECT_NEAR(TypeParam::margin(nodes.row(i).transpose()), 0, 1e-15);
  EXPECT_GT(TypeParam::margin(TypeParam::center()), 0.1);
  EXPECT_FALSE(contains<TypeParam>(ReferencePoint<TypeParam>::Constant(1.5), 0));
  EXPECT_FALSE(contains<TypeParam>(ReferencePoint<TypeParam>::Constant(-1e-6), 1e-9));
}

TYPED_TEST(ElementContract, FacetsLieOnTheBoundaryAndCoverEveryNode) {
  const auto nodes = TypeParam::nodes();
  std::array<int, TypeParam::num_nodes> uses{};
  for (const Facet& facet : TypeParam::facets) {
    ReferencePoint<TypeParam> middle = ReferencePoint<TypeParam>::Zero();
    for (int i = 0; i < facet.num_nodes; ++i) {
      ++uses[facet.nodes[i]];
      middle += nodes.row(facet.nodes[i]).transpose() / facet.num_nodes;
    }
    EXPECT_NEAR(TypeParam::margin(middle), 0, 1e-15);
    // Outward: a step from the center through the facet leaves the cell.
    EXPECT_LT(TypeParam::margin(middle + 0.1 * (middle - TypeParam::center())), 0);
  }
  for (int count : uses) EXPECT_GE(count, TypeParam::dim);
}

TYPED_TEST(ElementContract, ReferenceVolumeIsTheShareOfTheUnitCube) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  constexpr int samples = 200000;
  int inside = 0;
  for (int n = 0; n < samples; ++n) {
    ReferencePoint<TypeParam> xi;
    for (int a = 0; a < TypeParam::dim; ++a) xi[a] = uniform(random);
    inside += contains<TypeParam>(xi, 0);
  }
  EXPECT_NEAR(static_cast<double>(inside) / samples, TypeParam::reference_volume, 0.006);
}

TEST(ElementRegistry, NamesAndVtkIdsAreDistinct) {
  std::vector<std::string_view> names;
  std::vector<int> ids;
  Elements::for_each([&]<class E>() {
    names.push_back(E::name);
    ids.push_back(E::vtk_id);
  });
  std::sort(names.begin(), names.end());
  std::sort(ids.begin(), ids.end());
  EXPECT_EQ(std::adjacent_find(names.begin(), names.end()), names.end());
  EXPECT_EQ(std::adjacent_find(ids.begin(), ids.end()), ids.end());
}

}  // namespace
}  // namespace halfgrad
