// The contract over the registry, and over simplices of every dimension.
#include "tests/contracts/element_contract.hpp"

#include "elements/simplex.hpp"

namespace halfgrad {
namespace {

using AllElements = Elements::apply<testing::Types, std::type_identity_t>;
INSTANTIATE_TYPED_TEST_SUITE_P(Registered, ElementContract, AllElements);

using Simplices = testing::Types<Simplex<1>, Simplex<2>, Simplex<3>, Simplex<4>>;
INSTANTIATE_TYPED_TEST_SUITE_P(Simplices, ElementContract, Simplices);

TEST(Simplex, IsTheRegisteredSimplex) {
  const Eigen::Vector3d xi(0.1, 0.5, 0.2);
  EXPECT_EQ(Simplex<3>::shape(xi), Tetrahedron::shape(xi));
  EXPECT_EQ(Simplex<3>::shape_gradient(xi), Tetrahedron::shape_gradient(xi));
  EXPECT_EQ(Simplex<2>::nodes(), Triangle::nodes());
  EXPECT_EQ(Simplex<3>::reference_volume, Tetrahedron::reference_volume);
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
