#pragma once
/// A place in a run: everything that the rest of the run follows from, on this machine.

#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "base/archive.h"
#include "mbs/course.h"
#include "mbs/solver.h"

namespace topple::mbs {

struct Moment {
  double time = 0;       // [s]
  double next_time = 0;  // of the step after it [s]
  long steps = 0;        // from the start of the run
  std::vector<std::byte> state;
  CourseState course;
  Summary summary;                               // so far
  std::vector<std::pair<int, int>> joint_notes;  // made so far
  std::vector<std::pair<int, int>> noted_pairs;  // bodies that contact has let through, likewise
  // what a successor must agree with
  std::array<std::size_t, 11> counts{};               // of items, as in succession.cpp
  std::vector<std::pair<double, std::string>> fired;  // events, in their order
  std::vector<int> laws;                              // of the stations of elements and rotational elements

  std::size_t bytes() const { return sizeof(Moment) + state.size() + 4 * laws.size() + 48 * fired.size(); }
};

void write_moment(const Moment&, ArchiveWriter&);
void read_moment(ArchiveReader&, Moment&);

}  // namespace topple::mbs
