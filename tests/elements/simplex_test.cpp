// Simplices of every dimension under the contract.
#include "elements/simplex.hpp"

#include "tests/contracts/element_contract.hpp"

namespace halfgrad {
namespace {

using Simplices = testing::Types<Simplex<1>, Simplex<2>, Simplex<3>, Simplex<4>>;
INSTANTIATE_TYPED_TEST_SUITE_P(Simplices, ElementContract, Simplices);

TEST(Simplex, IsTheRegisteredSimplex) {
  const Eigen::Vector3d xi(0.1, 0.5, 0.2);
  EXPECT_LT((Simplex<3>::shape(xi) - Tetrahedron::shape(xi)).norm(), 1e-15);
  EXPECT_EQ(Simplex<3>::shape_gradient(xi), Tetrahedron::shape_gradient(xi));
  EXPECT_EQ(Simplex<2>::nodes(), Triangle::nodes());
  EXPECT_EQ(Simplex<3>::reference_volume, Tetrahedron::reference_volume);
}

}  // namespace
}  // namespace halfgrad
