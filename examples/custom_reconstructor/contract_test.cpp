// The fit under the contract of halfgrad's own reconstructors.
#include <tests/contracts/reconstructor_contract.hpp>

#include "least_squares.hpp"

namespace halfgrad {
INSTANTIATE_TEST_SUITE_P(LeastSquares, ReconstructorContract,
                         testing::Values(std::make_shared<LeastSquares>(),
                                         std::make_shared<LeastSquares>(LeastSquaresOptions{.power = 0})));
}
