#include "framework/large_array.hpp"

#include <cstdint>
#include <cstring>
#include <new>
#ifdef __linux__
#include <sys/mman.h>
#endif

namespace halfgrad {

namespace {

constexpr std::size_t large_page = std::size_t{2} << 20, small_page = 4096;

bool is_large(std::size_t bytes) { return bytes >= 2 * large_page; }

void* moved(void* memory, std::size_t bytes, std::size_t fewer) {
  void* const result = allocate_large(fewer);
  std::memcpy(result, memory, fewer);
  free_large(memory, bytes);
  return result;
}

}  // namespace

void use_large_pages([[maybe_unused]] void* memory, [[maybe_unused]] std::size_t bytes) {
#ifdef __linux__
  if (!is_large(bytes)) return;
  const auto at = reinterpret_cast<std::uintptr_t>(memory);
  const std::uintptr_t begin = (at + small_page - 1) / small_page * small_page,
                       end = (at + bytes) / small_page * small_page;
  // Advice: where it is refused, the pages stay small.
  madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
#endif
}

#ifdef __linux__

// From the system, since what malloc hands out may have been touched before, in small pages.
void* allocate_large(std::size_t bytes) {
  if (!is_large(bytes)) return ::operator new(bytes);
  void* memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  use_large_pages(memory, bytes);
  return memory;
}

void free_large(void* memory, std::size_t bytes) {
  if (!is_large(bytes)) return ::operator delete(memory);
  munmap(memory, bytes);
}

void* shrink_large(void* memory, std::size_t bytes, std::size_t fewer) {
  if (!is_large(fewer)) return moved(memory, bytes, fewer);
  const std::size_t end = (bytes + small_page - 1) / small_page * small_page,
                    kept = (fewer + small_page - 1) / small_page * small_page;
  if (kept < end) munmap(static_cast<char*>(memory) + kept, end - kept);
  return memory;
}

#else

void* allocate_large(std::size_t bytes) { return ::operator new(bytes); }
void free_large(void* memory, std::size_t) { ::operator delete(memory); }
void* shrink_large(void* memory, std::size_t bytes, std::size_t fewer) { return moved(memory, bytes, fewer); }

#endif

}  // namespace halfgrad
