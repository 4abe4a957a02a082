// topple study: a fuzzy analysis that survives interruption, and what it found.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "commands.h"
#include "program.h"
#include "record/page.h"
#include "record/provenance.h"
#include "results.h"
#include "study/evaluator.h"
#include "study/page.h"
#include "study/randomness.h"
#include "study/results.h"
#include "study_model.h"
#include "study_text.h"
#include "terminal.h"

namespace topple::apps {

namespace {

using study::StudyResult;
using study::StudyState;

constexpr const char* no_study_page =
    "The page of studies is not built, so there is no study.html (run `npm ci && npm run build` in web/, then `topple "
    "study export`).";

/// Files of results and the page, into a folder; tells which. `source` is the file that was studied.
void write_all(std::FILE* out, const std::string& folder, const study::Problem& p, const StudyResult& r,
               const std::string& source, const std::string& source_name, const std::string& language) {
  for (const std::string& path : study::write_results(folder, p, r)) std::fprintf(out, "wrote %s\n", path.c_str());
  const std::string path = (std::filesystem::path(folder) / "study.html").string();
  const auto bundle = find_bundle("study.html");
  if (!bundle) {
    study::remove_result(path, "<!DOCTYPE html>\n<html lang=\"");
    std::fprintf(stderr, "%s\n", no_study_page);
    return;
  }
  record::write_page(study::to_page_json(p, r, {program_version(), record::now_utc(), source, source_name}), *bundle,
                     path, language);
  std::fprintf(out, "wrote %s\n", path.c_str());
}

/// Complaints, with the line of a file or of an answer that they point into.
int complain(const InputError& e, const std::string& text, bool as_json) {
  for (Diagnostic d : e.diagnostics()) {
    d.message = to_printable(d.message), d.help = to_printable(d.help);
    std::fputs(render(d, text, has_colour(stderr)).c_str(), stderr);
  }
  if (as_json) print_refusal(e.diagnostics());
  return kBadInput;
}

void read_what_is_there(const StudyPlace& place, study::Problem& problem, StudyResult& r, std::string& source,
                        std::string& source_name) {
  study::Store store(place.store);
  const std::optional<study::StudyRow> row = store.find_study(place.name);
  if (!row) return;
  problem = read_problem(*row);
  r = study::read_study(problem, store, *row);
  const nlohmann::json definition = nlohmann::json::parse(row->definition);
  source = definition.value("text", ""), source_name = definition.value("file", "");
}

/// Throws InputError E822 if a folder for files is that of another study than `from`.
void check_target(const std::string& folder, const StudyPlace& from) {
  StudyPlace there;
  try {
    there = find_place(folder);
  } catch (const InputError&) {
    return;  // of none
  }
  std::error_code failure;
  const bool is_same = study::is_server(there.store) || study::is_server(from.store)
                           ? there.store == study::hide_password(from.store) && there.name == from.name
                           : std::filesystem::equivalent(there.store, from.store, failure);
  if (!is_same)
    throw InputError("E822", fmt::format("{} holds another study, whose files these would replace", folder),
                     "choose another folder");
}

int start(const Arguments& a, const std::atomic<bool>& cancel) {
  std::string text;
  study::Problem problem;
  StudyPlace place;
  study::StudyOptions options;
  std::error_code failure;
  const bool is_new_folder = !std::filesystem::exists(a.output, failure);
  try {
    problem = read_problem(a, text);
    options.pool = make_pool_options(a.study);
    place = make_place(a);
    keep_runs_apart(problem, place);
    if (study::is_server(place.store) && !a.study.evaluator.empty())
      options.directory = std::filesystem::current_path().string();
  } catch (const InputError& e) { return complain(e, text, a.json); }
  options.store = place.store;
  options.name = place.name;
  options.source = text;
  options.source_name = a.input;
  options.rerun_failed = a.study.rerun_failed;
  options.is_new = place.is_new;
  options.accepted = [&] {
    keep_place(a.output, place);
    if (problem.random) std::fprintf(stderr, "%s\n", study::tell_random_cost(problem).c_str());
  };
  const bool is_new = !study::is_server(place.store) && !std::filesystem::exists(place.store);
  Progress progress;
  progress.cancel = &cancel;
  ProgressLine line;
  StudyResult r;
  bool is_finished = false;
  std::string source_name = a.input;
  long answers = 0;
  const auto remove_new = [&] { return is_new && remove_unused(place, study::calc_model_hash(problem), answers); };
  const auto remove_empty_folder = [&] {
    if (is_new_folder) std::filesystem::remove(a.output, failure);  // what holds something stays
  };
  try {
    r = study::run_study(problem, make_factories(), options, progress, [&](const StudyState& s) {
      answers = s.answers;
      line.say(describe_state(problem, s));
    });
    is_finished = r.is_finished;
    // what goes over its runs again may have met few of them: all is told that is there
    if (!is_finished) read_what_is_there(place, problem, r, text, source_name);
  } catch (const InputError& e) {
    line.clear();
    const std::string& code = e.first_error().code;
    const std::string model = study::calc_model_hash(problem);
    // nothing has ever answered: those runs say nothing of the model
    if (code == study::no_answer_code) study::Store(place.store).rerun_failed(model);
    if (code == "E823" || code == "E824" || code == "E827" || code == study::no_answer_code) {
      const auto refusal = study::Store(place.store).find_refusal(model);
      complain(e, refusal ? to_printable(study::read_refusal(*refusal).line) : "", a.json);
      const bool is_kept = !study::Store(place.store).load_results(model).empty();
      std::fprintf(stderr, is_kept ? "The study stopped; what was run before is kept. Mend the evaluator and give "
                                     "the command again.\n"
                                   : "The study stopped. Mend the evaluator and give the command again.\n");
    } else {
      complain(e, text, a.json);
    }
    remove_new();
    remove_empty_folder();
    return kBadInput;
  } catch (const study::ConnectionLost& e) {
    line.clear();
    remove_empty_folder();
    std::fprintf(stderr, "topple: the store is away: %s\nGive the same command again to go on.\n", e.what());
    if (a.json) print_failure(std::string("the store is away: ") + e.what());
    return kRunFailed;
  } catch (const study::DiskFailed& e) {
    line.clear();
    std::fprintf(stderr, "topple: %s\n", e.what());
    if (!remove_new())
      std::fprintf(stderr, "What was run before is kept. Make room and give the same command again to go on.\n");
    remove_empty_folder();
    if (a.json) print_failure(e.what());
    return kRunFailed;
  }
  line.clear();
  std::FILE* out = a.json ? stderr : stdout;
  print_study(out, problem, r);
  std::fprintf(out, "\n");
  write_all(out, a.output, problem, r, text, source_name, a.language);
  if (a.json) std::fputs(study::write_results_json(problem, r).c_str(), stdout);
  if (!is_finished) {
    std::fprintf(stderr, "Interrupted. The same command goes on with the study.\n");
    return kRunFailed;
  }
  return kOk;
}

}  // namespace

int run_study_command(const Arguments& a, const std::atomic<bool>& cancel) {
  if (a.study.action == StudyArguments::Action::Run) return start(a, cancel);
  try {
    const StudyPlace place = find_place(a.input);
    study::Store store(place.store, &cancel, 10, true);
    const std::optional<study::StudyRow> row = store.find_study(place.name);
    if (!row) throw InputError("E820", fmt::format("there is no study in {}", study::hide_password(a.input)));
    const study::Problem problem = read_problem(*row);
    const StudyResult r = study::read_study(problem, store, *row);
    if (a.study.action == StudyArguments::Action::Export) {
      const std::string folder = a.output.empty() ? a.input : a.output;
      check_target(folder, place);
      make_folder(folder);
      const nlohmann::json definition = nlohmann::json::parse(row->definition);
      write_all(a.json ? stderr : stdout, folder, problem, r, definition.value("text", ""),
                definition.value("file", ""), a.language);
    }
    if (a.json) {
      std::fputs(study::write_results_json(problem, r).c_str(), stdout);
    } else if (a.study.action == StudyArguments::Action::Show) {
      print_study(stdout, problem, r);
      const study::Counts c = store.count(row->model);
      if (!r.is_finished) std::printf("\nwaiting %ld, running %ld\n", c.waiting, c.running);
    }
    return kOk;
  } catch (const InputError& e) { return complain(e, "", a.json); }
}

}  // namespace topple::apps
