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
/// Memory with the first `fewer` bytes of such memory, in its place where it is large: the rest goes back.
void* shrink_large(void* memory, std::size_t bytes, std::size_t fewer);

/// An array in such memory: room that is never written costs nothing, and giving it back moves nothing.
template <class T>
class LargeArray {
  static_assert(std::is_trivially_destructible_v<T>);

 public:
  LargeArray() = default;
  /// Elements are not initialised.
  explicit LargeArray(std::size_t size)
      : elements_(static_cast<T*>(allocate_large(size * sizeof(T))), {size * sizeof(T)}) {}

  std::size_t size() const { return elements_.get_deleter().bytes / sizeof(T); }
  T* data() { return elements_.get(); }
  const T* data() const { return elements_.get(); }
  T& operator[](std::size_t i) { return elements_[i]; }
  const T& operator[](std::size_t i) const { return elements_[i]; }

  void shrink(std::size_t size) {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::size_t before = elements_.get_deleter().bytes, after = size * sizeof(T);
    T* const kept = static_cast<T*>(shrink_large(elements_.get(), before, after));
    elements_.release();
    elements_ = {kept, {after}};
  }

 private:
  struct Free {
    std::size_t bytes = 0;
    void operator()(void* memory) const { free_large(memory, bytes); }
  };
  std::unique_ptr<T[], Free> elements_;
};

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

}  // namespace halfgrad
