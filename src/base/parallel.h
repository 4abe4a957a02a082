#pragma once
/// Loops over indices on several threads whose outcome does not depend on how many there are.

#include <atomic>
#include <cstddef>
#include <functional>

namespace topple {

/// Threads that the machine offers, at least 1.
int hardware_threads();

/// Calls body(i) once for every i in [0, count), on `threads` threads at most (0: all of the machine), in any order.
/// A body writes only what belongs to its own index; sums over indices are then made in order by the caller.
/// If bodies throw, the exception of the lowest such index is thrown again, at any number of threads, and every index
/// below it has been done.
/// Returns false if `cancel` was seen set, which leaves indices undone.
[[nodiscard]] bool parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& body,
                                const std::atomic<bool>* cancel = nullptr);

}  // namespace topple
