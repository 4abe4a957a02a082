#include "commands.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "base/error.h"
#include "base/file.h"
#include "base/unit.h"
#include "base/words.h"
#include "collapse/findings.h"
#include "collapse/run.h"
#include "collapse/step_check.h"
#include "mbs/model_json.h"
#include "product/plan.h"
#include "product/plan_limits.h"
#include "product/templates.h"
#include "program.h"
#include "record/compare.h"
#include "record/page.h"
#include "record/record.h"
#include "record/report.h"
#include "results.h"
#include "study/plan_model.h"
#include "terminal.h"

namespace topple::apps {

namespace fs = std::filesystem;
using json = nlohmann::ordered_json;

int print_diagnostics(const std::vector<Diagnostic>& list, const std::string& text) {
  int errors = 0;
  for (const Diagnostic& d : list) {
    std::fputs(render(d, text, has_colour(stderr)).c_str(), stderr);
    errors += d.severity == Severity::Error;
  }
  return errors;
}

int refuse(const InputError& e, const std::vector<Diagnostic>& warnings, const std::string& text, bool as_json,
           const char* then) {
  std::vector<Diagnostic> all = e.diagnostics();
  all.insert(all.end(), warnings.begin(), warnings.end());
  const int errors = print_diagnostics(all, text);
  std::fprintf(stderr, "%s. %s\n", count_words(errors, "error").c_str(), then);
  if (as_json) print_refusal(all);
  return kBadInput;
}

void tell_of_other_title(const std::string& what, const std::string& title, const std::string& title_of_run) {
  if (title != title_of_run)
    std::fprintf(stderr, "topple: %s is of \"%s\", the run of \"%s\": see that both are of one building\n",
                 what.c_str(), title.c_str(), title_of_run.c_str());
}

void check_own_input(const std::string& output, const std::string& input) {
  std::error_code none;
  if (fs::equivalent(output, input, none))
    throw InputError("E801", fmt::format("{} is what is read, and would be written over", output),
                     "give another name to -o");
}

double read_quantity(const std::string& text, Dimension dimension, const char* option) {
  if (text.empty()) return 0;
  Quantity q = parse_quantity(text, dimension);
  if (!q.value) {
    const Quantity bare = parse_quantity(text, Dimension::Number);
    if (bare.value) q = bare;
  }
  if (!q.value || !(*q.value > 0))
    throw InputError("E801", fmt::format("{} \"{}\": {}", option, text, q.value ? "must be > 0" : q.problem),
                     "units: " + units_of(dimension));
  return *q.value;
}

collapse::RunOptions make_options(const Arguments& a, const char* duration) {
  collapse::RunOptions o;
  o.duration = read_quantity(a.duration, Dimension::Time, duration);
  o.step = read_quantity(a.step, Dimension::Time, "--step");
  o.step_share = a.step_share;
  o.frame_rate = read_quantity(a.frame_rate, Dimension::Frequency, "--frame-rate");
  o.threads = a.threads;
  o.engine = a.engine;
  o.program_version = program_version();
  return o;
}

std::string find_checkpoint(const Arguments& a) {
  std::string path = (fs::path(a.output) / "checkpoint.bin").string();
  if (!a.resume || fs::is_regular_file(a.output)) return path;
  if (!fs::exists(path))
    throw InputError("E674", fmt::format("{}: there is no checkpoint to go on from", path), "start without --resume");
  remove_unfinished_files(a.output);
  return path;
}

std::string write_option(const char* name, const std::string& value) {
  return value.empty() ? "" : fmt::format(" {} {}", name, quote_word(value));
}

void tell_lost_checkpoint(ProgressLine& progress, const std::string& why) {
  progress.clear();
  std::fprintf(stderr, "topple: %s. The run goes on; an older checkpoint is left as it was.\n", why.c_str());
}

void tell_how_to_go_on(std::FILE* out, const Arguments& a, const std::string& verb, const std::string& options) {
  std::string more = a.no_report ? " --no-report" : a.report ? " --report" : "";
  more += write_option("--language", a.language == "en" ? "" : a.language);
  if (a.threads > 1) more += fmt::format(" --threads {}", a.threads);
  for (const auto& [is_asked, option] : {std::pair{a.verbose, " --verbose"}, std::pair{a.json, " --json"}})
    if (is_asked) more += option;
  std::fprintf(out, "Go on with: topple %s %s%s%s%s%s%s -o %s --resume\n", verb.c_str(), quote_word(a.input).c_str(),
               options.c_str(), write_option("--knowledge", a.knowledge).c_str(),
               write_option(verb == "fe" ? "--until" : "--duration", a.duration).c_str(), a.csv ? " --csv" : "",
               more.c_str(), quote_word(a.output).c_str());
}

std::string write_run_options(const Arguments& a) {
  std::string out = write_option("--step", a.step) + write_option("--frame-rate", a.frame_rate);
  if (a.step_share != 1) out += fmt::format(" --step-share {}", a.step_share);
  if (a.equilibrium) out += *a.equilibrium ? " --equilibrium" : " --no-equilibrium";
  return out;
}

collapse::RunOptions make_plan_options(const Arguments& a, const char* duration) {
  collapse::RunOptions o = make_options(a, duration);
  const auto check = [](double value, const std::string& text, product::Range range, Dimension d, const char* option) {
    if (value != 0 && !product::is_within(value, range))
      throw InputError("E801",
                       fmt::format("{} \"{}\": must be {}, as in a plan", option, text, product::describe(range, d)));
  };
  check(o.duration, a.duration, product::limits::duration, Dimension::Time, duration);
  check(o.step, a.step, product::limits::step, Dimension::Time, "--step");
  check(o.frame_rate, a.frame_rate, product::limits::frame_rate, Dimension::Frequency, "--frame-rate");
  return o;
}

collapse::Knowledge load_knowledge(const Arguments& a) {
  if (a.knowledge.empty()) return collapse::default_knowledge();
  try {
    return collapse::read_knowledge(read_file(a.knowledge), a.knowledge);
  } catch (const InputError& e) {
    std::vector<Diagnostic> complaints = e.diagnostics();
    for (Diagnostic& d : complaints) d.width = 0;  // lines that are shown are those of the plan
    throw InputError(complaints);
  }
}

std::optional<std::string> find_bundle(const std::string& name) {
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  for (const fs::path& folder :
       {program.parent_path().parent_path() / "share" / "topple", fs::path(TOPPLE_PAGE_FOLDER)})
    if (fs::is_regular_file(folder / name, ignored)) return read_file((folder / name).string());
  return std::nullopt;
}

namespace {

constexpr const char* kNoBundle =
    "The report page is not built, so there is no report.html (run `npm ci && npm run build` in web/, then `topple "
    "report`).";

}  // namespace

void refuse_file(const std::string& path) {
  std::error_code failure;
  if (fs::exists(path, failure) && !fs::is_directory(path, failure))
    throw InputError("E801", fmt::format("--output: {} is a file; a folder is wanted", path));
}

void make_folder(const std::string& path, const std::vector<const char*>& files) {
  refuse_file(path);
  std::error_code failure;
  fs::create_directories(path, failure);
  if (failure) throw std::runtime_error(path + ": the folder cannot be made: " + failure.message());
  if (access(path.c_str(), W_OK | X_OK) != 0)
    throw std::runtime_error(path + ": the folder cannot be written to: " + std::strerror(errno));
  for (const char* name : files)
    if (const fs::path file = fs::path(path) / name; fs::is_directory(file, failure))
      throw std::runtime_error(file.string() + " is a folder, where a file is to be written");
}

RunFolder::RunFolder(const std::string& path) {
  std::error_code failure;
  for (fs::path p = fs::absolute(path); !p.empty() && !fs::exists(p, failure); p = p.parent_path())
    if (p.has_filename()) new_.push_back(p.string());  // not of a slash at its end
  make_folder(path, {"model.json", "record.h5", "report.html"});
}

RunFolder::~RunFolder() {
  std::error_code ignored;  // what is not empty stays
  for (const std::string& path : new_) fs::remove(path, ignored);
}

Files write_files(const record::Record& r, const Arguments& a, bool& failed_report) {
  Files files;
  const auto in = [&a](const char* name) { return (fs::path(a.output) / name).string(); };
  record::write_hdf5(r, in("record.h5"));
  files.emplace_back("record", in("record.h5"));
  if (a.csv) {
    record::write_csv(r, a.output);
    for (const char* name : {"series.csv", "events.csv", "bodies.csv", "findings.csv"})
      files.emplace_back(fs::path(name).stem().string(), in(name));
  }
  if (!a.no_report) {
    if (const auto bundle = find_bundle("report.html")) {
      record::write_page(record::to_report_json(r), *bundle, in("report.html"), a.language);
      files.emplace_back("report", in("report.html"));
    } else {
      std::fprintf(stderr, "%s\n", kNoBundle);
      failed_report = a.report;
    }
  }
  return files;
}

void print_leftovers(std::FILE* out, const Arguments& a, const Files& files) {
  std::vector<fs::path> there;
  for (const char* name : {"model.json", "series.csv", "events.csv", "bodies.csv", "findings.csv", "report.html"})
    there.push_back(fs::path(a.output) / name);
  std::error_code none;
  std::vector<fs::path> outputs;
  for (const auto& entry : fs::directory_iterator(fs::path(a.output) / "outputs", none))
    if (entry.path().extension() == ".csv") outputs.push_back(entry.path());
  std::sort(outputs.begin(), outputs.end());
  there.insert(there.end(), outputs.begin(), outputs.end());
  if (!a.checkpoint && !a.resume) there.push_back(fs::path(a.output) / "checkpoint.bin");
  for (const std::string& path : find_unfinished_files(a.output)) there.emplace_back(path);
  std::string words;
  for (const fs::path& path : there) {
    const auto is_same = [&path](const auto& file) { return fs::path(file.second) == path; };
    if (!fs::exists(path, none) || fs::equivalent(path, a.input, none) ||
        std::any_of(files.begin(), files.end(), is_same))
      continue;
    words += (words.empty() ? "" : ", ") + path.string();
  }
  if (!words.empty()) std::fprintf(out, "Left from before, not of this run: %s\n", words.c_str());
}

namespace {

/// A run that is cancelled ends behind its last frame [s].
double find_end(const record::Record& r) {
  double end = r.time.empty() ? 0 : r.time.back();
  for (const record::Event& e : r.events)
    if (e.subject == r.ending && e.text == r.ending_text) end = std::max(end, e.time);
  return end;
}

}  // namespace

json summary_json(const record::Record& r, const Files& files, int exit_code) {
  json out;
  out["title"] = r.provenance.title;
  out["exit_code"] = exit_code;
  out["ending"] = r.ending;
  out["ending_text"] = r.ending_text;
  out["simulated_time"] = find_end(r);
  out["wall_time"] = r.provenance.wall_time;
  out["step"] = r.provenance.step;
  out["seed"] = r.provenance.seed;
  out["engine"] = r.provenance.engine;
  out["version"] = r.provenance.program_version;
  out["counts"] = {{"bodies", r.counts.bodies},
                   {"revolute_joints", r.counts.revolute_joints},
                   {"rigid_joints", r.counts.rigid_joints},
                   {"force_elements", r.counts.force_elements},
                   {"cables", r.counts.cables},
                   {"mass", r.counts.mass}};
  out["findings"] = json::array();
  out["violated"] = json::array();
  out["not_judged"] = json::array();
  for (const record::Finding& f : r.findings) {
    out["findings"].push_back({{"id", f.id},
                               {"heading", f.heading},
                               {"title", f.title},
                               {"text", f.text},
                               {"value", std::isfinite(f.value) ? json(f.value) : json(nullptr)},
                               {"unit", f.unit},
                               {"status", record::name_of(f.status)}});
    if (collapse::is_violated(f)) out["violated"].push_back(f.id);
    if (collapse::is_not_judged(f)) out["not_judged"].push_back(f.id);
  }
  out["files"] = json::object();
  for (const auto& [what, path] : files) out["files"][what] = path;
  return out;
}

int exit_code_of(const record::Record& r, bool failed_report) {
  if (r.ending == "failed" || r.ending == "cancelled" || failed_report) return kRunFailed;
  const auto is_open = [](const record::Finding& f) { return collapse::is_violated(f) || collapse::is_not_judged(f); };
  return std::any_of(r.findings.begin(), r.findings.end(), is_open) ? kCriterionViolated : kOk;
}

int close_run(const record::Record& r, const Arguments& a, std::FILE* out, Files files) {
  print_findings(out, r);  // first: a disk that is full leaves them
  std::fprintf(out, "\n%s Computed in %.1f s.\n", r.ending_text.c_str(), r.provenance.wall_time);
  for (const record::Finding& f : r.findings)
    if (collapse::is_violated(f) || collapse::is_not_judged(f))
      std::fprintf(out, "%s: %s (%s)\n", collapse::is_violated(f) ? "Violated" : "Not judged", f.title.c_str(),
                   f.heading.c_str());
  bool failed_report = false;
  for (auto& f : write_files(r, a, failed_report)) files.push_back(std::move(f));
  const int code = exit_code_of(r, failed_report);
  for (const auto& [what, path] : files) std::fprintf(out, "Wrote %s\n", path.c_str());
  print_leftovers(out, a, files);
  if (a.json) std::printf("%s\n", dump(summary_json(r, files, code)).c_str());
  return code;
}

int write_template(const Arguments& a) {
  if (a.list && a.json) {
    json out{{"exit_code", kOk}, {"templates", json::array()}};
    for (const product::Template& t : product::templates())
      out["templates"].push_back({{"name", t.name}, {"title", t.title}, {"description", t.description}});
    std::printf("%s\n", dump(out).c_str());
    return kOk;
  }
  if (a.list) {
    for (const product::Template& t : product::templates())
      std::printf("%-9s %s. %s\n", t.name.c_str(), t.title.c_str(), t.description.c_str());
    return kOk;
  }
  try {
    const product::Template& chosen = product::find_template(a.plan_template);
    if (fs::exists(a.input)) {
      const std::string words = a.input + " exists already and is left as it is";
      std::fprintf(stderr, "%s.\n", words.c_str());
      if (a.json) print_refusal({{Severity::Error, "E802", {}, 1, words, "choose another name"}});
      return kBadInput;
    }
    replace_file(a.input, chosen.text);
  } catch (const InputError& e) { return refuse(e, {}, {}, a.json); }
  if (a.json)
    std::printf("%s\n",
                dump(json{{"exit_code", kOk}, {"template", a.plan_template}, {"files", {{"plan", a.input}}}}).c_str());
  std::fprintf(a.json ? stderr : stdout, "Wrote %s. Next: topple check %s\n", a.input.c_str(),
               quote_word(a.input).c_str());
  return kOk;
}

int check_plan(const Arguments& a) {
  std::vector<Diagnostic> warnings;
  std::string text;
  try {
    const product::Plan plan = product::read_plan_file(a.input, warnings, text);
    const collapse::Knowledge knowledge = load_knowledge(a);
    collapse::ModelMap map;
    const mbs::Model model = collapse::make_model(plan, knowledge, map, a.threads);
    mbs::check_model(model);
    if (!plan.fuzzy.inputs.empty())  // what only topple study would say
      (void)study::make_plan_problem(plan, {}, a.knowledge.empty() ? std::string() : read_file(a.knowledge));
    for (Diagnostic& d : collapse::complain_of_spans(plan, map)) warnings.push_back(std::move(d));
    print_diagnostics(warnings, text);
    if (a.json) {
      json out{{"exit_code", kOk}, {"diagnostics", json::array()}};
      for (const Diagnostic& d : warnings) out["diagnostics"].push_back(to_json(d));
      std::printf("%s\n", dump(out).c_str());
    } else {
      std::printf("%s: no errors, %s. Next: topple run %s -o out\n", a.input.c_str(),
                  count_words(std::ssize(warnings), "warning").c_str(), quote_word(a.input).c_str());
    }
    return kOk;
  } catch (const InputError& e) { return refuse(e, warnings, text, a.json); }
}

int run_plan_file(const Arguments& a, const std::atomic<bool>& cancel) {
  std::vector<Diagnostic> warnings;
  std::string text;
  std::FILE* out = a.json ? stderr : stdout;
  try {
    collapse::RunOptions options = make_plan_options(a);
    set_checkpoint(a, options);
    const product::Plan plan = product::read_plan_file(a.input, warnings, text);
    const collapse::Knowledge knowledge = load_knowledge(a);
    print_diagnostics(warnings, text);
    if (!a.json) warnings.clear();  // they have been said
    const RunFolder folder(a.output);
    ProgressLine progress;
    EventPrinter events(out, a.verbose, progress);
    Files files;
    collapse::RunCallbacks callbacks;
    callbacks.on_model = [&](const mbs::Model& model, const collapse::ModelMap& map, const record::Counts& counts) {
      std::fprintf(out, "%s\n", plan.title.c_str());
      std::fprintf(out, "%s\n", tell_counts(counts, map.mass).c_str());
      const std::string path = (fs::path(a.output) / "model.json").string();
      // of a run that goes on it is there, and a checkpoint of another plan must not replace it
      if (!options.resume || !fs::exists(path))
        replace_file(path, mbs::to_json(model, collapse::settings_of(plan, knowledge, options)));
      files.emplace_back("model", path);
    };
    callbacks.on_event = [&](const record::Event& e) { events.print(e); };
    bool has_checkpoint = options.resume;
    callbacks.on_checkpoint = [&] { has_checkpoint = true; };
    callbacks.on_lost_checkpoint = [&](const std::string& why) { tell_lost_checkpoint(progress, why); };
    callbacks.on_resume = [&](double time) { std::fprintf(out, "Going on from %.4g s.\n", time); };
    callbacks.progress.report = [&](double done, double whole) { progress.show(done, whole); };
    callbacks.progress.cancel = &cancel;
    const record::Record r = a.check_step ? collapse::run_plan_at_two_steps(plan, knowledge, options, callbacks)
                                          : collapse::run_plan(plan, knowledge, options, callbacks);
    progress.clear();
    const int code = close_run(r, a, out, std::move(files));
    if (r.ending == "cancelled" && has_checkpoint) tell_how_to_go_on(out, a, "run", write_run_options(a));
    return code;
  } catch (const InputError& e) { return refuse(e, warnings, text, a.json); }
}

int show_rules(const Arguments& a) {
  const collapse::Knowledge& k = collapse::default_knowledge();
  if (a.json) {
    json out{{"title", "Knowledge rules of the simulation manager"}, {"rules", json::array()}};
    for (const collapse::Rule& r : k.rules)
      out["rules"].push_back(
          {{"id", r.id}, {"value", r.value}, {"unit", r.unit}, {"text", r.text}, {"reason", r.reason}});
    std::printf("%s\n", dump(out).c_str());
    return kOk;
  }
  for (const collapse::Rule& r : k.rules)
    std::printf("%s = %s%s\n    %s\n    because: %s\n", r.id.c_str(), fmt::format("{:g}", r.value).c_str(),
                r.unit == "1" ? "" : (" " + r.unit).c_str(), r.text.c_str(), r.reason.c_str());
  return kOk;
}

namespace {

/// Of a study's results what a report tells: verdict, outcomes, bounds. Throws InputError E682.
///   title  of the run that it is told beside
std::string read_study(std::string path, const std::string& title) {
  if (std::filesystem::is_directory(path)) path = (std::filesystem::path(path) / "results.json").string();
  const json whole = json::parse(read_file(path), nullptr, false);
  const auto refuse_file = [&path](const std::string& why) {
    throw InputError("E682", fmt::format("{}: {}", path, why), "give the folder that topple study wrote");
  };
  if (!whole.is_object()) refuse_file("not the results of a study (no JSON object)");
  json out;
  for (const char* key : {"title", "runs", "failed", "verdict", "inputs", "outcomes", "outputs"}) {
    if (!whole.contains(key)) refuse_file(fmt::format("not the results of a study (no \"{}\")", key));
    out[key] = whole[key];
  }
  for (const char* key : {"verdict", "inputs", "outcomes", "outputs"})
    for (json& entry : out[key]) {
      if (!entry.is_object()) refuse_file(fmt::format("not the results of a study (\"{}\")", key));
      if (std::string_view(key) == "outcomes") entry.erase("outputs");
    }
  tell_of_other_title("the study", out["title"].is_string() ? out["title"].get<std::string>() : "", title);
  return out.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace

int write_report_file(const Arguments& a) {
  try {
    check_own_input(a.output, a.input);
    for (const std::string& path : a.other_records) check_own_input(a.output, path);
    if (!a.study_results.empty()) check_own_input(a.output, a.study_results);
    const record::Record r = record::read_hdf5(a.input);
    record::ReportExtras extras;
    if (!a.study_results.empty()) extras.study = read_study(a.study_results, r.provenance.title);
    for (const std::string& path : a.other_records) {
      const record::Record other = record::read_hdf5(path);
      const record::Comparison c = record::compare(r, other, a.input, path);
      tell_of_other_title(path, other.provenance.title, r.provenance.title);
      extras.others.push_back({c.name_b, other.provenance.title, record::summarise(c)});
    }
    const auto bundle = find_bundle("report.html");
    if (!bundle) {
      std::fprintf(stderr, "%s\n", kNoBundle);
      if (a.json) print_failure(kNoBundle);
      return kRunFailed;
    }
    record::write_page(record::to_report_json(r, extras), *bundle, a.output, a.language);
    std::fprintf(a.json ? stderr : stdout, "Wrote %s\n", a.output.c_str());
    if (a.json)
      std::printf(
          "%s\n",
          dump(json{{"title", r.provenance.title}, {"exit_code", kOk}, {"files", {{"report", a.output}}}}).c_str());
    return kOk;
  } catch (const InputError& e) { return refuse(e, {}, {}, a.json); }
}

}  // namespace topple::apps
