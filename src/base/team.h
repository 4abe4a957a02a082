#pragma once
/// Threads that stand by for many short loops, such as those of every step of a simulation.

#include <cstddef>
#include <functional>
#include <memory>

namespace topple {

/// A thread begins with the same part of the indices in every loop of as many, so that what it works on stays in its
/// cache, and then takes from the end of what others have left. Between loops its threads look for work for about a
/// millisecond, then sleep.
class Team {
 public:
  /// `threads` with the one that calls run (0: all of the machine).
  explicit Team(int threads);
  ~Team();
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;

  int threads() const;
  /// Calls body(i) once for every i in [0, count), in any order, and returns when all are done. A body writes only what
  /// belongs to its own index, and calls no run of the same team. Of exceptions that bodies throw, that of the lowest
  /// index is thrown again.
  void run(std::size_t count, const std::function<void(std::size_t)>& body);

 private:
  struct Inside;
  std::unique_ptr<Inside> inside_;
};

}  // namespace topple
