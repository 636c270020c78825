// Memory for large arrays.
#pragma once

#include <cstddef>
#include <memory>
#include <type_traits>

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

/// std::vector::reserve in such pages.
template <class Vector>
void reserve_large(Vector& vector, std::size_t size) {
  if (size <= vector.capacity()) return;
  vector.reserve(size);
  use_large_pages(vector.data() + vector.size(), (size - vector.size()) * sizeof(vector[0]));
}

}  // namespace halfgrad
