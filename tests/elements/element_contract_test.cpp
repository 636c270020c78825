// The contract over the registry.
#include "tests/contracts/element_contract.hpp"

namespace halfgrad {
namespace {

using AllElements = Elements::apply<testing::Types, std::type_identity_t>;
INSTANTIATE_TYPED_TEST_SUITE_P(Registered, ElementContract, AllElements);

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
