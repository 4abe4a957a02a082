#pragma once
/// How possible it is that a study's requirement (Problem::permissible) is kept, and that it is broken
/// (docs/theory/uncertainty.md, section 4).

#include <string>
#include <vector>

#include "study/manager.h"

namespace topple::study {

/// Classes of runs by a requirement; those that failed are of uncertainty::failed_outcome, and do not keep it either.
inline constexpr int kept_class = 0, broken_class = 1;

/// The class of a run; empty where nothing is asked, or no run has the outputs. Both lists outlive it, and outcomes
/// that runs meet later count.
uncertainty::Classify make_requirement_classes(const Problem&, const std::vector<std::string>& outputs,
                                               const std::vector<std::string>& outcomes);

/// Whether outcomes alone tell what keeps it: then the search of their possibilities is the search of this.
bool is_of_outcomes(const Problem&);

/// Searches on for StudyResult::requirement, where outcomes do not tell it. Failed runs are left to the search of
/// outcomes.
void find_requirement(StudyResult&, const Problem&, uncertainty::Asker&, const std::vector<std::string>& outputs,
                      const std::vector<std::string>& outcomes);
/// By all runs there are now, behind the same of outcomes: marks stay where no run is more possible.
void read_requirement(StudyResult&, const Problem&, const uncertainty::Archive&,
                      const std::vector<std::string>& outputs, const std::vector<std::string>& outcomes);

struct RequirementClass {
  std::string name;  // kept, broken, failed
  long runs = 0;
  uncertainty::Possibility found;  // without a run in the support: 0, not converged
  double necessity = 0;
  bool is_necessity_converged = false;
};
/// Kept, broken and, if there are any, failed runs; nothing where it cannot be told.
std::vector<RequirementClass> list_requirement(const Problem&, const StudyResult&);

}  // namespace topple::study
