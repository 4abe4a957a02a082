#pragma once
/// What is studied: fuzzy inputs, what follows from them, and which model answers. Made from a file of inputs
/// (inputs_file.h) or from a plan with fuzzy values.

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "study/model.h"
#include "uncertainty/space.h"

namespace topple::study {

struct Randomness;

/// Name and unit of a coordinate, for people and programs. Points hold values in `unit_value` (1: as they are shown).
struct Quantity {
  std::string name, unit;
  double unit_value = 1;    // of one unit, in what points hold
  bool is_searched = true;  // of an output: runs are spent on its bounds; else they are those of the others' runs
};

/// What a part of each trajectory means.
struct Curve {
  std::string name, unit;
  double unit_value = 1;
  std::string over, over_unit;  // the grid's quantity
  std::vector<double> at;       // grid, in `over_unit`; its size is that of the part
  bool is_outline = false;      // how far a plan view extends from W's origin towards the direction `at` [deg]
};

/// The place seen from above, for pictures of what a plan's building leaves.
struct Site {
  struct Area {
    std::string name;
    std::vector<std::array<double, 2>> corners;  // counter-clockwise in W [m]
    bool is_utility = false;
  };
  std::vector<std::array<double, 2>> footprint;  // of the building: the rectangle around it, from which reaches count
  std::vector<std::vector<std::array<double, 2>>> outlines;  // of its parts, without inner yards, counter-clockwise
  std::vector<Area> neighbours;
};

/// What an output should keep, for sentences.
struct Limit {
  enum class Kind {
    Screening,  // stays below it
    Reach,      // is at most it
    Clearance,  // is at least it
    Direction,  // is at most it
  };
  std::string output;          // its name
  std::string place;           // for people: a neighbour; empty: none
  double least = 0, most = 0;  // the limit, or the range in which it lies, in what outputs hold
  std::string source;          // of the limit
  Kind kind = Kind::Screening;
  /// Output by how much the value may still get worse behind the end of a run; empty: not at all.
  std::string left = {};
  /// Upper end of a screening's band from which the whole band lies above the limit.
  double above = std::numeric_limits<double>::infinity();
};

/// When runs of a plan end. One whose `output` says just that time, and whose outcome is not `unless`, ended before
/// anything had happened that its numbers are about.
struct Horizon {
  std::string output, unless;
  double after = 0;  // behind the last stage [s]
  std::string open;  // output that is 1 where the outcome may become another, else 0
};

struct Problem {
  std::string title;
  std::vector<Quantity> inputs;   // fuzzy; as many as space.inputs
  std::vector<Quantity> derived;  // follow from them
  uncertainty::Space space;
  std::vector<Quantity> outputs;      // units of those that are known beforehand; others have none
  std::vector<std::string> outcomes;  // that are known beforehand; empty: any
  std::vector<Curve> curves;          // parts of trajectories, one behind the other; empty: one curve over 0, 1, 2, ...
  /// Values of `derived` for a point; may be empty. A value that is not finite makes a failed run.
  std::function<std::vector<double>(const Point&)> calc_derived;
  std::string kind = "evaluator";  // names the factory of the model
  /// JSON object: everything on which answers depend (a command, a plan). Other text: another model, no run is shared.
  std::string identity = "{}";
  /// JSON object: what answers do not depend on (time-out).
  std::string settings = "{}";
  std::vector<double> levels;  // empty: the program's choice
  int limit = 0;               // runs at most; 0: the program's choice
  std::uint64_t seed = 1;
  /// What boxes of inputs must keep, see permissible.h; empty: no boxes are looked for.
  std::string permissible;
  bool has_drivers = true;                // spend runs on them
  std::string asked;                      // the outcome that is wanted; empty: none is named
  Site site;                              // of a plan
  std::vector<Limit> limits;              // of a plan
  std::vector<std::string> not_modelled;  // sentences
  std::vector<std::string> not_judged;    // what is asked for and not looked at
  std::optional<Horizon> horizon;         // of a plan
  /// The model that the one above stands for, at a fraction of its cost: a study ends with runs of it. Null: none.
  std::shared_ptr<const Problem> whole;
  int confirm = 0;  // whole runs at most; not part of the model
  /// Random inputs: each point stands for many runs, outputs are statistics of them (randomness.h). Null: none.
  std::shared_ptr<const Randomness> random;
};

/// The output of that name, without a unit if it is not known beforehand.
Quantity find_output(const Problem&, const std::string& name);

/// Names for sentences and narrow columns: what stands behind the last dot of a plan's path, with as much in front as
/// tells them apart.
std::vector<std::string> make_short_names(const std::vector<Quantity>&);

/// Name of the model in a store.
std::string calc_model_hash(const Problem&);
/// What a RunnerFactory gets: {"kind", "inputs": [names, derived behind], "identity": {...}, "settings": {...}}.
std::string make_model_definition(const Problem&);

}  // namespace topple::study
