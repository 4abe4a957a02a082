#pragma once
/// What the user typed, understood.

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "fe_options.h"
#include "study_options.h"

namespace topple::apps {

struct Arguments {
  enum class Verb {
    None,
    New,
    Check,
    Run,
    Rules,
    MbsRun,
    MbsCompare,
    MbsVerify,
    Report,
    Export,
    Import,
    Compare,
    Fe,
    Rcc,
    Study,
    Worker,
    Steer,
    Replay,
    Demo,
    Doctor,
    Version
  };
  Verb verb = Verb::None;
  std::string input;      // plan, model, record, or the file to write
  std::string output;     // folder or file
  std::string knowledge;  // file of rules, empty: built in
  std::string engine = "native";
  std::string language = "en";             // of pages
  std::string study_results;               // of a report, empty: none
  std::vector<std::string> other_records;  // of a report
  std::string unit;                        // of a drawing, as typed
  std::string plan_template = "frame";     // of a new plan
  bool list = false;                       // show the templates instead
  std::string markdown, json_file;         // files to write, empty: none
  std::string engines;                     // names between commas, empty: all
  std::string accuracy;                    // relative, as typed
  std::string duration, step, frame_rate;  // quantities as typed; empty: the plan's
  double step_share = 1;
  std::vector<std::string> normal_forces;  // as typed
  std::string member, zone = "foot";       // of a plan
  std::string fuzzy;                       // file of fuzzy inputs, empty: none
  std::string route = "layered";
  std::string axis = "y", direction = "+";  // of fuzzy curves and of the solid route
  std::string rotation, element_size;       // of the solid route, as typed
  std::optional<bool> equilibrium;          // of a bare model; none: as its file says
  bool checkpoint = false, resume = false;  // of runs
  std::string checkpoint_interval;          // as typed; empty: the program's
  StudyArguments study;
  FeArguments fe;
  int threads = 1, frames = 0;
  std::string port;         // of the steering server, empty: a free one
  bool no_open = false;     // do not open the page
  bool open = false;        // do (of verbs that do not by themselves)
  bool goes_on = false;     // with the latest steering session of the plan
  bool check_step = false;  // run also at half the step
  bool json = false, csv = false, no_report = false, report = false, verbose = false;
  bool bodies = false, skip_unsupported = false;
  bool vtk = false, gltf = false, adams = false;  // formats of an export, beside csv and json
};

/// Exit codes of every verb.
inline constexpr int kOk = 0, kRunFailed = 1, kBadInput = 2, kCriterionViolated = 3;

/// Reads the command line. Either arguments, or the exit code with which to stop at once: help and errors are printed.
std::variant<Arguments, int> parse_arguments(int argc, char** argv);

}  // namespace topple::apps
