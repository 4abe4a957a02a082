#include "base/heap.h"

#include <cstdlib>  // __GLIBC__

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace topple {

void keep_freed_memory() {
#ifdef __GLIBC__
  constexpr int kNever = 1 << 30, kLargest = 32 << 20;  // what is larger than the second glibc maps by itself
  (void)mallopt(M_TRIM_THRESHOLD, kNever);
  (void)mallopt(M_MMAP_THRESHOLD, kLargest);
#endif
}

}  // namespace topple
