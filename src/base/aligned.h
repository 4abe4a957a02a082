#pragma once
/// Memory that begins at a cache line, for vector registers; large pieces in large pages where the system has them.

#include <cstddef>
#include <new>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace topple {

inline constexpr std::size_t kCacheLine = 64;         // [bytes]
inline constexpr std::size_t kLargePage = 2UL << 20;  // [bytes]

template <class T>
struct AlignedAllocator {
  using value_type = T;  // NOLINT(readability-identifier-naming): the standard's name
  AlignedAllocator() = default;
  template <class U>
  AlignedAllocator(const AlignedAllocator<U>&) {}
  T* allocate(std::size_t n) {
    void* p = ::operator new(n * sizeof(T), alignment(n));
#if defined(__linux__)
    // fewer pages to look up while all of it is passed over step by step; a wish, so nothing if it fails
    if (is_large(n)) (void)::madvise(p, n * sizeof(T) / kLargePage * kLargePage, MADV_HUGEPAGE);
#endif
    return static_cast<T*>(p);
  }
  void deallocate(T* p, std::size_t n) { ::operator delete(p, alignment(n)); }
  friend bool operator==(const AlignedAllocator&, const AlignedAllocator&) { return true; }

 private:
  static bool is_large(std::size_t n) { return n * sizeof(T) >= 2 * kLargePage; }
  static std::align_val_t alignment(std::size_t n) { return std::align_val_t{is_large(n) ? kLargePage : kCacheLine}; }
};

template <class T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

}  // namespace topple
