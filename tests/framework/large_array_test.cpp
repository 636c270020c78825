// Large arrays are arrays: what is written is read, whatever the pages below.
#include "framework/large_array.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <numeric>

namespace halfgrad {
namespace {

TEST(LargeArray, HoldsWhatIsWrittenBelowAndAboveTheSizeOfLargePages) {
  for (const std::size_t size : {std::size_t{1}, std::size_t{1000}, std::size_t{2'000'003}}) {
    const LargeArray<std::uint64_t> array = large_array<std::uint64_t>(size);
    std::iota(array.get(), array.get() + size, std::uint64_t{5});
    std::uint64_t num_wrong = 0;
    for (std::size_t i = 0; i < size; ++i) num_wrong += array[i] != i + 5;
    EXPECT_EQ(num_wrong, 0U) << size;
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(array.get()) % alignof(std::uint64_t), 0U);
  }
}

TEST(LargeArray, VectorsKeepTheirContentWhileTheyGrowAndShrink) {
  std::vector<int> vector = {3, 1, 4};
  reserve_large(vector, 3'000'000);
  EXPECT_GE(vector.capacity(), 3'000'000U);
  EXPECT_EQ(vector, (std::vector<int>{3, 1, 4}));
  vector.resize(1'500'000, 7);
  shrink_large(vector);
  EXPECT_EQ(vector.capacity(), 1'500'000U);
  EXPECT_EQ(vector[1], 1);
  EXPECT_EQ(vector.back(), 7);
  const int* const before = vector.data();
  reserve_large(vector, 10);
  EXPECT_EQ(vector.data(), before);
}

}  // namespace
}  // namespace halfgrad
