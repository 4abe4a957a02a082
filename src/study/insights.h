#pragma once
/// What a study tells beyond bounds and possibilities: which input drives what, and which boxes of inputs are
/// permissible. Both may take runs of their own, which go through the same store (docs/study.md).

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "study/problem.h"
#include "uncertainty/design.h"
#include "uncertainty/sensitivity.h"

namespace topple::study {

/// How the runs of a study are shared out: numbers of different points by which each part has ended.
struct Budget {
  int limit = 0;          // all
  int rows = 0;           // of Sobol's design; 0: too few runs, or inputs that are tied
  int spread = 0;         // spread points for the drivers instead
  int knowing = 0;        // per input, for what becomes of outcomes when it is known; 0: not looked for
  int bounds = 0;         // the search of bounds ends here, the points before it included
  int possibilities = 0;  // that of possibilities
  int of_limit = 0;       // for how possible it is that a limit of the plan is broken: of each that some run breaks
  int outcomes = 0;       // that of outcomes with an input known; the rest is for boxes,
  int requirement = 0;    // but for so many to tell how possible it is that their requirement is broken,
  int in_boxes = 0;       // and so many for bounds of outputs in them, behind their search (0: too few for it)
};
Budget calc_budget(const Problem&, int limit);

struct Insights {
  enum class Source { None, Design, Spread };
  Source source = Source::None;
  uncertainty::Sensitivity drivers;         // over the support
  std::vector<uncertainty::Fixed> knowing;  // outcomes with an input known; empty: not looked for
  bool has_boxes = false;
  uncertainty::DesignResult boxes;
};

/// Points that are spread over the support for the drivers' sake and are alike in distribution, before a run.
std::vector<Point> make_spread_points(const Problem&, const Budget&);
/// Those of them that an archive holds.
std::vector<int> find_spread_samples(const Problem&, const Budget&, const uncertainty::Archive&);

/// Runs the points of the drivers; call it first, so that the search of bounds profits from them.
void ask_for_drivers(const Problem&, const Budget&, uncertainty::Asker&);
/// Drivers from what the archive holds, without a run.
void read_drivers(Insights&, const Problem&, const Budget&, const uncertainty::Archive&);
/// Boxes that keep Problem::permissible. Throws InputError E825.
void find_boxes(Insights&, const Problem&, const Budget&, uncertainty::Asker&, const std::vector<double>& levels,
                const std::vector<std::string>& outputs, const std::vector<std::string>& outcomes);
/// By all runs there are now: those behind the search of boxes may have met something inside. What is left goes to
/// bounds inside of boxes whose searches have not ended.
void finish_boxes(Insights&, const Problem&, uncertainty::Asker&, const std::vector<double>& levels,
                  const std::vector<std::string>& outputs, const std::vector<std::string>& outcomes);

/// Whether a share is larger than its standard error; else nothing is known but that it is small or hidden.
bool is_share_known(const uncertainty::Driver&);

/// What takes runs (knowing, boxes), back with the same bits.
nlohmann::ordered_json to_json(const Insights&);
void read_json(Insights&, const nlohmann::ordered_json&);

}  // namespace topple::study
