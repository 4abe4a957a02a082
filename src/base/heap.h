#pragma once
/// What the program does with memory that is given back to the heap.

namespace topple {

/// From now on the heap keeps what is given back for what is asked for next, up to the largest amount in use so far.
/// For work that takes and gives back the same many megabytes thousands of times, as samples of a study do; without it
/// the system has to clear their pages each time. Of the whole process; nothing but with glibc's own
/// allocator (others keep it for some seconds by themselves).
void keep_freed_memory();

}  // namespace topple
