#pragma once
/// Fuzzy resistance curves: a fan of alpha-cuts with the original curves it consists of, and its files (docs/rcc.md).
/// Forces count positive in compression, as in rcc_report.h.

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "record/rcc_figures.h"
#include "record/record.h"

namespace topple::record {

struct RccFuzzyInput {
  std::string path, name, symbol;                  // symbol: unit for people
  double unit = 1;                                 // SI value of one of it
  std::vector<std::pair<double, double>> corners;  // value, membership [SI]; none: follows by the formula
  std::string formula;
};

struct RccInterval {
  double alpha = 0, left = 0, right = 0;
};

/// One parameter set and the curve that belongs to it.
struct RccOriginal {
  int sample = 0;  // number of the run
  double membership = 0;
  std::vector<double> values;  // of the inputs, then of the derived ones [SI]
  std::string outcome;         // in words
  double peak = 0;             // largest moment [N·m]
  std::vector<double> moment;  // over the fan's rotations; empty: kept without its curve [N·m]
  bool is_drawn = false;
};

/// An ordinate whose bounds were searched for.
struct RccOrdinate {
  std::string name;      // "peak", "M(5 mrad)"
  double rotation = -1;  // [rad]; -1: none
  std::vector<RccInterval> cuts;
};

struct RccOutcome {
  std::string name;
  int count = 0;           // runs
  double possibility = 0;  // largest membership among them
  int sample = -1;         // the run that has it
};

/// The fuzzy curve of one normal force.
struct RccFan {
  double normal_force = 0;       // [N]
  std::vector<double> rotation;  // (J) [rad]
  struct Level {
    double alpha = 0;
    std::vector<double> low, high;  // (J) [N·m]
  };
  std::vector<Level> levels;  // rising
  std::vector<RccOrdinate> ordinates;
  std::vector<RccOutcome> outcomes;
  std::vector<RccOriginal> originals;  // every run, in its order
  int core = 0;                        // the run at the middle of the inputs
  double crushing_possibility = 0;     // that the section cannot carry the force at all
  double tearing_possibility = 0;      // the same under tension
  std::string window;                  // why the outcomes are those of a zone turned to the last rotation
  int failed = 0;
  std::string failure, ending;  // of the first failed run; of the search
};

struct RccFuzzyReport {
  std::string title, zone;
  std::string source, sha256, inputs_source, inputs_sha256, program_version;
  std::string route = "layered";  // that every run's curve comes from, as in rcc_report.h
  char axis = 'y';
  int direction = 1;
  std::uint64_t seed = 1;
  std::vector<RccFuzzyInput> inputs;     // fuzzy ones, then derived ones
  std::vector<std::string> constraints;  // what ties them together, as it is written
  std::string joint;                     // the same: their joint membership
  std::vector<RccInterval> crushing;     // force that crushes the section without bending [N]
  std::vector<RccInterval> tearing;      // that tears it, tension positive; none: no fan is of tension [N]
  std::vector<RccFan> fans;
  std::vector<KeyValue> section;
  std::vector<std::string> notes, not_modelled;
};

std::string to_json(const RccFuzzyReport&);
/// normal force, alpha, rotation, lower and upper moment
std::string fan_csv(const RccFuzzyReport&);
/// every run: number, membership, values, outcome, largest moment
std::string samples_csv(const RccFuzzyReport&);
/// the curves of the runs that are drawn
std::string originals_csv(const RccFuzzyReport&);

std::vector<Figure> make_figures(const RccFuzzyReport&);
std::string to_page(const RccFuzzyReport&, const std::vector<Figure>&);

/// What the fan says about carrying the force, in sentences.
std::vector<std::string> describe_switch(const RccFuzzyReport&, const RccFan&);

}  // namespace topple::record
