#pragma once
/// The verdict of a study in words: how possible each outcome is, and which values turn one into another.

#include <string>
#include <vector>

#include "record/record.h"
#include "study/manager.h"

namespace topple::study {

struct Sentence {
  std::string id;  // stable: "verdict", "outcome.NAME", "split.NAME", "failed", ...
  std::string text;
  record::Status status = record::Status::Info;
};

/// Of how much weight a degree is: "fully possible", ...
std::string words_of_possibility(double degree);

/// A degree or a part as a decimal that is at most, or at least, so large: "at least" and "at most" stay true of it.
std::string words_of_least(double, int digits = 2);
std::string words_of_most(double, int digits = 2);

/// The value of one input that parts the runs of an outcome from the others best: of spread runs below `value` the part
/// `below` has this outcome, of those above the part `above`.
struct Split {
  int outcome = 0, input = -1;  // input -1: no value parts them
  double value = 0;
  int below_runs = 0, above_runs = 0;
  double below = 0, above = 0;
  double gain = 0;  // part of the indicator's variance that the two sides explain, 0 to 1
};
/// Of each outcome class among spread samples, by outcome. A side holds at least a tenth of the runs.
std::vector<Split> find_splits(const uncertainty::Space&, const uncertainty::Archive&, const std::vector<int>& spread);

/// Four digits of a number for people, or as many as tell values apart that lie within `width`, if it is given.
std::string words_of_number(double, double width = 0);
/// A value and its unit for people, from what results hold.
std::string words_of_value(const Quantity&, double value, double width = 0);
/// "fc 20.1 N/mm2 (core 25), fy 400 N/mm2 (core 420)": the fuzzy inputs that lie off their core by more than a
/// hundredth of their support, or "the core values".
std::string words_of_point(const Problem&, const Point&);

std::vector<Sentence> tell(const Problem&, const StudyResult&);

/// What is known of a permissible box, and what is not.
std::string tell_guarantee(const uncertainty::PermissibleBox&, int violating, bool has_interaction = false);

/// Runs that somebody should look at: of each outcome but that of the core its most possible run, of each output the
/// runs with its least and largest value.
struct NotableRun {
  int sample = -1;
  std::string why;
};
std::vector<NotableRun> list_notable_runs(const Problem&, const StudyResult&);

}  // namespace topple::study
