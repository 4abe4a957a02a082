#pragma once
/// What boxes of inputs must keep, as people write it: "topple, reach_pos_x <= 20 m, tilt_1 > 3".
///
/// Parts stand between commas and all of them must hold. A part is a limit of an output (<, <=, >, >=, in the unit in
/// which the output is shown, which may stand behind the number; the limit itself violates < and >), or the name of an
/// outcome; of several outcomes one must happen. Names with spaces or signs may stand in double quotes.

#include <string>
#include <vector>

#include "study/problem.h"
#include "uncertainty/design.h"

namespace topple::study {

struct PermissibleLimit {
  std::string output;
  bool is_most = true;     // at most, else at least
  bool is_strict = false;  // the value itself violates it
  double value = 0;        // in what results hold
  std::string text;        // as written
};

struct Permissible {
  std::vector<std::string> outcomes;  // one of them; empty: any
  std::vector<PermissibleLimit> limits;
};

/// Names are checked against what the problem knows beforehand. Throws InputError E825.
Permissible read_permissible(const std::string& text, const Problem&);

/// Throws InputError E825 for an output that is not among these.
void check_outputs(const Permissible&, const std::vector<std::string>& outputs);

/// The same as a requirement on results with these outputs and outcomes. Its size is the least part by which a limit is
/// kept (of the limit's size, or of 1 for the limit 0), at most 1, and below 0 on a strict limit. Nothing keeps
/// outcomes that have not happened. Throws InputError E825 for an output that results do not have.
uncertainty::Requirement make_requirement(const Permissible&, const std::vector<std::string>& outputs,
                                          const std::vector<std::string>& outcomes);

}  // namespace topple::study
