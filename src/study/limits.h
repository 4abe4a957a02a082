#pragma once
/// How possible it is that limits of a plan (Problem::limits) are broken (docs/theory/uncertainty.md, section 4).

#include <limits>
#include <string>
#include <vector>

#include "study/manager.h"

namespace topple::study {

/// Whether a value, which may still get worse by `left`, breaks a limit.
bool is_broken(const Limit&, double value, double left = 0);

/// How runs in the support fare with one limit.
struct LimitFinding {
  int limit = 0;                                                          // which of Problem::limits
  double least = std::numeric_limits<double>::infinity(), most = -least;  // values, as outputs hold them
  int runs = 0;                                                           // that have the output
  int broken = 0;                                                         // of them
  int open = 0;      // of those that keep it: parts that still moved may break it
  double above = 0;  // possibility of a screening whose whole band lies above the limit, of the runs that are there
  bool is_core_broken = false;
  uncertainty::Possibility found;  // of breaking it; no run in the support does: 0, not converged
};
/// One for each limit whose output some run has, in their order.
std::vector<LimitFinding> list_limits(const Problem&, const StudyResult&);

/// Limits that some run breaks and the core does not, whose search has not come to its end.
int count_open_limits(const Problem&, const StudyResult&, const uncertainty::Archive&,
                      const std::vector<std::string>& outputs);
/// Searches on for StudyResult::limits, with as many runs for each of them.
void find_limits(StudyResult&, const Problem&, uncertainty::Asker&, const std::vector<std::string>& outputs);
/// By all runs there are now: marks stay where no run is more possible.
void read_limits(StudyResult&, const Problem&, const uncertainty::Archive&, const std::vector<std::string>& outputs);

}  // namespace topple::study
