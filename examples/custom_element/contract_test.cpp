// The pentagon under the contract of halfgrad's own elements.
#include <tests/contracts/element_contract.hpp>

#include "pentagon.hpp"

namespace halfgrad {
INSTANTIATE_TYPED_TEST_SUITE_P(Pentagon, ElementContract, testing::Types<Pentagon>);
}
