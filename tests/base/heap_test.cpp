#include "base/heap.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <memory>

namespace topple {
namespace {

long count_faults() {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  return use.ru_minflt;
}

/// Pages that the system hands out where so many bytes are taken, written to and given back.
long count_pages_of(std::size_t bytes) {
  const long before = count_faults();
  const auto block = std::make_unique<volatile char[]>(bytes);
  for (std::size_t i = 0; i < bytes; i += 4096) block[i] = 1;
  return count_faults() - before;
}

TEST(Heap, KeepsWhatIsGivenBack) {
#if !defined(__GLIBC__) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "another heap";
#endif
  keep_freed_memory();
  constexpr std::size_t bytes = 16 << 20;
  const long first = count_pages_of(bytes);
  EXPECT_GT(first, 0);
  EXPECT_LT(count_pages_of(bytes), first / 4 + 1);
}

}  // namespace
}  // namespace topple
