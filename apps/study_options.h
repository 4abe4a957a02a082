#pragma once
/// What was typed for topple study and topple worker.

#include <string>

namespace topple::apps {

struct StudyArguments {
  enum class Action { Run, Show, Export };
  Action action = Action::Run;
  std::string evaluator;             // command, empty: the file is a plan
  std::string alpha;                 // levels between commas, empty: the file's
  std::string store;                 // server, empty: a file in the folder
  std::string permissible;           // what boxes of inputs must keep, empty: none are looked for
  bool no_drivers = false;           // no runs for them
  std::string name;                  // of the study in a server, empty: that of the folder
  int samples = 0;                   // at most, 0: the file's
  long long seed = -1;               // -1: the file's
  int jobs = 0;                      // at the same time here
  bool is_jobs_given = false;        // 0 jobs: workers elsewhere do everything
  int batch = 1;                     // points that an evaluator gets at once
  std::string timeout, lease, idle;  // as typed
  bool one_shot = false, rerun_failed = false;
  bool condensed = false;  // of a plan: like frames as one
  int confirm = -1;        // whole runs of a condensed study at most, -1: the program's choice
};

}  // namespace topple::apps
