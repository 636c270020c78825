// Memory for large arrays.
#pragma once

#include <cstddef>
#include <iterator>
#include <memory>
#include <type_traits>
#include <vector>

namespace halfgrad {

/// Memory that is not initialised, in pages of two megabytes where it is large and the system has such pages. In pages
/// of four kilobytes, an array that is read in random order misses the translation of addresses for every element, and
/// the first touch of a page can cost more than what is computed for the page.
void* allocate_large(std::size_t bytes);
void free_large(void* memory, std::size_t bytes);

struct LargeArrayDeleter {
  std::size_t bytes = 0;
  void operator()(void* memory) const { free_large(memory, bytes); }
};

/// An array in such memory.
template <class T>
using LargeArray = std::unique_ptr<T[], LargeArrayDeleter>;

template <class T>
LargeArray<T> large_array(std::size_t size) {
  static_assert(std::is_trivially_destructible_v<T>);
  const std::size_t bytes = size * sizeof(T);
  return {static_cast<T*>(allocate_large(bytes)), {bytes}};
}

/// Asks for such pages under memory that is about to be written for the first time.
void use_large_pages(void* memory, std::size_t bytes);

/// std::vector::reserve in such pages. Room that is never used costs no memory.
template <class T>
void reserve_large(std::vector<T>& vector, std::size_t size) {
  if (size <= vector.capacity()) return;
  std::vector<T> larger;
  larger.reserve(size);
  use_large_pages(larger.data(), size * sizeof(T));
  larger.insert(larger.end(), std::make_move_iterator(vector.begin()), std::make_move_iterator(vector.end()));
  vector.swap(larger);
}

/// std::vector::shrink_to_fit in such pages.
template <class T>
void shrink_large(std::vector<T>& vector) {
  std::vector<T> exact;
  reserve_large(exact, vector.size());
  exact.assign(vector.begin(), vector.end());
  vector.swap(exact);
}

}  // namespace halfgrad
