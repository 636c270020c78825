// Large arrays are arrays: what is written is read, whatever the pages below.
#include "framework/large_array.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <numeric>

namespace halfgrad {
namespace {

TEST(LargeArray, HoldsWhatIsWrittenBelowAndAboveTheSizeOfLargePages) {
  for (const std::size_t size : {std::size_t{1}, std::size_t{1000}, std::size_t{2'000'003}}) {
    LargeArray<std::uint64_t> array(size);
    EXPECT_EQ(array.size(), size);
    std::iota(array.data(), array.data() + size, std::uint64_t{5});
    std::uint64_t num_wrong = 0;
    for (std::size_t i = 0; i < size; ++i) num_wrong += array[i] != i + 5;
    EXPECT_EQ(num_wrong, 0U) << size;
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(array.data()) % alignof(std::uint64_t), 0U);
  }
}

// From large to large in place, from large to small and from small to small by moving.
TEST(LargeArray, KeepsItsContentWhileItShrinks) {
  LargeArray<int> array(5'000'000);
  const int* const before = array.data();
  for (const std::size_t size : {4'000'001, 2'000'003, 2'000'003, 1'000, 3, 0}) {
    if (size >= 2'000'003) std::iota(array.data(), array.data() + size, 7);
    array.shrink(size);
    EXPECT_EQ(array.size(), size);
    std::size_t num_wrong = 0;
    for (std::size_t i = 0; i < size; ++i) num_wrong += array[i] != static_cast<int>(i) + 7;
    EXPECT_EQ(num_wrong, 0U) << size;
    if (size == 4'000'001) {
      EXPECT_EQ(array.data(), before);
    }
  }
}

TEST(LargeArray, VectorsKeepTheirContentWhileTheyGrow) {
  std::vector<int> vector = {3, 1, 4};
  reserve_large(vector, 3'000'000);
  EXPECT_GE(vector.capacity(), 3'000'000U);
  EXPECT_EQ(vector, (std::vector<int>{3, 1, 4}));
  const int* const before = vector.data();
  reserve_large(vector, 10);
  EXPECT_EQ(vector.data(), before);
}

}  // namespace
}  // namespace halfgrad
