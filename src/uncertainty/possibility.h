#pragma once
/// How possible each outcome class is: Π_c = sup { μ(x) : class(x) = c } (docs/theory/uncertainty.md, section 4).

#include <cstdint>
#include <functional>
#include <vector>

#include "uncertainty/alpha.h"

namespace topple::uncertainty {

/// The class of a run: its outcome, or what else runs are parted by (a requirement that is kept or broken).
using Classify = std::function<int(const Result&)>;

struct Possibility {
  int outcome = 0;         // or another class; failed_outcome for failed runs
  double possibility = 0;  // μ of a run of this class: an inner estimate
  double resolution = 0;   // towards the core on the last ray, the next run of another class lies so much higher in μ
  int sample = -1;         // the run that has it, in the archive; -1: none in the support
  int above = 0;  // runs with a larger μ, all of other classes: an island of the volume fraction v of that cut
                  // is missed by so many spread points with a probability of (1-v)^above
  /// A search ended there because it saw nothing higher. Never where no run of the class was found from which one could
  /// begin.
  bool converged = false;
  std::vector<int> summits = {};  // runs with the largest μ on other islands of the class, as far as climbed
  int seen = 0;                   // runs that were there when the search ended
};

struct PossibilityOptions {
  double tolerance = 1e-4;  // of μ
  int rounds = 30;          // of bisecting, sliding and looking around, per class at most
  std::uint64_t seed = 1;
  int spread = 40;  // points per input above what was found, at last
  int islands = 4;  // of the class, at most, that no straight way in it leads to, are climbed too
  /// Found before: of a class that has converged and of which no run is more possible by now only islands are climbed
  /// that have turned up since.
  std::vector<Possibility> known = {};
  Classify classify = outcome_of;
  std::vector<int> skipped = {};  // classes that another search looks for
  Facets facets = {};             // of a call before
};

struct PossibilityResult {
  std::vector<Possibility> classes;  // by outcome, rising; all that the archive holds in the end
  Ending ending = Ending::Complete;
  Facets facets;  // those of before, too
};

/// Starts from the archive's best samples of each class: bisects towards the core, slides along the boundary of the
/// class, looks around above what was found, moves the class's other runs there, until nothing higher is seen; then
/// from runs of the class in other islands of it. Needs an archive that holds points (`optimise`).
PossibilityResult find_possibilities(const Space&, Asker&, const PossibilityOptions&);

/// What the runs of one class show, without a search: its best one, those above it; towards the core nothing is known.
Possibility read_possibility(const Space&, const Archive&, int outcome, const Classify& = outcome_of);
/// The same of all classes of runs in the support, rising. What a search found of one stays known where no run is more
/// possible by more than the tolerance, and its mark.
std::vector<Possibility> read_possibilities(const Space&, const Archive&, const std::vector<Possibility>& known,
                                            const Classify& = outcome_of);

/// Places at the same part of the cuts of lower levels as x, from its own on outwards to that of level 0.
std::vector<Point> make_ray(const Space&, const Point& x, int count);

/// 1 - the largest possibility of any other class.
double calc_necessity(const PossibilityResult&, int outcome);
/// Whether no other class may turn out to be more possible, so that the necessity is no less.
bool is_necessity_converged(const PossibilityResult&, int outcome);
/// The largest possibility among several classes ("any collapse"); 0 for none.
double calc_possibility_of(const PossibilityResult&, const std::vector<int>& outcomes);

}  // namespace topple::uncertainty
