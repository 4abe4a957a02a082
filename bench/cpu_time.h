#pragma once
/// Processor time of this thread [s]: what other programs do on the machine meanwhile does not count.

#include <ctime>

namespace topple::bench {

inline double cpu_time() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace topple::bench
