#pragma once
/// What the verbs that run something have in common: options, complaints, files, the JSON object, the exit code.

#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arguments.h"
#include "base/error.h"
#include "base/unit.h"
#include "collapse/knowledge.h"
#include "collapse/run.h"
#include "record/record.h"
#include "refusal.h"
#include "terminal.h"

namespace topple::apps {

/// What was written: what it is, and its path.
using Files = std::vector<std::pair<std::string, std::string>>;

/// All complaints of an InputError, and the JSON object if that was asked for; `text` is the input. `then` says what
/// was not done.
int refuse(const InputError&, const std::vector<Diagnostic>& warnings, const std::string& text, bool as_json,
           const char* then = "Nothing was run.");

/// Says where something beside a run has another title than it.
void tell_of_other_title(const std::string& what, const std::string& title, const std::string& title_of_run);

/// Complaints on standard error; the number of errors among them. `text` is the input.
int print_diagnostics(const std::vector<Diagnostic>&, const std::string& text);

/// The built-in rules, or those of --knowledge.
collapse::Knowledge load_knowledge(const Arguments&);

/// A quantity from the command line, greater than 0; a bare number counts in SI, an empty text is 0. Throws InputError
/// (E801) that names the option.
double read_quantity(const std::string& text, Dimension, const char* option);

/// Throws InputError for quantities that cannot be read.
collapse::RunOptions make_options(const Arguments&, const char* duration = "--duration");
/// For runs of plans: what is given keeps to the limits of a plan. Throws InputError E801.
collapse::RunOptions make_plan_options(const Arguments&, const char* duration = "--duration");

/// The checkpoint of a run's folder. Throws InputError E674 if the run is to go on from it and there is none.
std::string find_checkpoint(const Arguments&);
/// Where a run keeps its checkpoint, and whether it goes on from it. Throws InputError: E801, E674.
template <class Options>
void set_checkpoint(const Arguments& a, Options& o) {
  o.resume = a.resume;
  if (const double interval = read_quantity(a.checkpoint_interval, Dimension::Time, "--checkpoint-interval");
      interval > 0)
    o.checkpoint_interval = interval;
  if (a.checkpoint || a.resume) o.checkpoint = find_checkpoint(a);
}
/// Says that a checkpoint could not be written.
void tell_lost_checkpoint(ProgressLine&, const std::string& why);
/// An option as it is typed, with a space before it; nothing without a value.
std::string write_option(const char* name, const std::string& value);
/// Says how a run that was cancelled goes on.
///   verb, options  as typed, for the same run, options with a space before each
void tell_how_to_go_on(std::FILE* out, const Arguments&, const std::string& verb, const std::string& options);
/// Of topple run and topple mbs run, what else must be typed again.
std::string write_run_options(const Arguments&);

/// Refuses to write over what is read. Throws InputError E801.
void check_own_input(const std::string& output, const std::string& input);

/// Throws InputError E801 if the path of a folder that is to come is that of a file.
void refuse_file(const std::string& path);

/// As refuse_file(), and throws std::runtime_error with the path if there is no folder that
/// can be written to, or a folder in the place of one of the files that are to come.
void make_folder(const std::string& path, const std::vector<const char*>& files = {});
/// The folder of a run, made as by make_folder(). What of it is new goes again with this, where nothing is in it.
class RunFolder {
 public:
  explicit RunFolder(const std::string& path);
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

 private:
  std::vector<std::string> new_;  // the innermost first
};

/// A built page, such as "report.html": beside an installed program, or in the source tree.
std::optional<std::string> find_bundle(const std::string& name);

/// Files of a finished record. `failed_report` is set when a report was asked for and could not be made.
Files write_files(const record::Record&, const Arguments&, bool& failed_report);

/// Names files of an earlier run that are still in the folder.
void print_leftovers(std::FILE* out, const Arguments&, const Files& of_this_run);

/// Says what a finished run found, writes its files, and gives the exit code. `files` are there already.
int close_run(const record::Record&, const Arguments&, std::FILE* out, Files files);

nlohmann::ordered_json summary_json(const record::Record&, const Files&, int exit_code);
int exit_code_of(const record::Record&, bool failed_report);

}  // namespace topple::apps
