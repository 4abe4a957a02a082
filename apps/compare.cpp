// topple mbs compare: one model on several engines.

#include "engines/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "base/file.h"
#include "base/unit.h"
#include "collapse/findings.h"
#include "commands.h"
#include "engines/engine.h"
#include "mbs/model_json.h"
#include "results.h"
#include "terminal.h"

namespace topple::apps {

namespace fs = std::filesystem;
using json = nlohmann::ordered_json;

namespace {

using engines::Comparison;
using engines::Difference;
using engines::EngineRun;
using Ending = mbs::Summary::Ending;

constexpr double kDuration = 10;  // of models that do not say [s], as of `topple mbs run`
constexpr int kFrames = 100;

const char* word_of(Ending e) {
  switch (e) {
    case Ending::TimeLimit:
      return "time limit";
    case Ending::AtRest:
      return "at rest";
    case Ending::Cancelled:
      return "cancelled";
    case Ending::NoEquilibrium:
      return "no equilibrium";
    case Ending::Diverged:
      return "diverged";
  }
  return "";
}

double read_positive(const std::string& text, Dimension dimension, const char* option) {
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

std::vector<std::unique_ptr<engines::Engine>> make_engines(const Arguments& a) {
  std::vector<std::string> names;
  for (size_t begin = 0; begin <= a.engines.size();) {
    const size_t end = std::min(a.engines.find(',', begin), a.engines.size());
    const size_t first = std::min(a.engines.find_first_not_of(" \t", begin), end);
    size_t last = end;
    while (last > first && std::strchr(" \t", a.engines[last - 1])) --last;
    if (last > first) names.push_back(a.engines.substr(first, last - first));
    begin = end + 1;
  }
  if (a.engines.empty()) names = engines::engine_names();
  if (names.empty()) throw InputError("E802", "--engines \"" + a.engines + "\" names no engine");
  engines::Accuracy accuracy;
  // without a step of the user's, engines that control their errors do
  accuracy.relative = !a.accuracy.empty() ? read_positive(a.accuracy, Dimension::Number, "--accuracy")
                      : a.step.empty()    ? 1e-9
                                          : 0;
  if (!(accuracy.relative < 1))
    throw InputError("E801", fmt::format("--accuracy \"{}\": must be below 1", a.accuracy),
                     "a relative error, 1e-9 for example");
  std::vector<std::unique_ptr<engines::Engine>> list;
  for (size_t i = 0; i < names.size(); ++i) {
    if (std::find(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(i), names[i]) !=
        names.begin() + static_cast<std::ptrdiff_t>(i))
      throw InputError("E802", "--engines names \"" + names[i] + "\" twice");
    list.push_back(engines::make_engine(names[i], accuracy));
  }
  return list;
}

mbs::Options make_options(const Arguments& a, const mbs::RunSettings& run) {
  mbs::Options o;
  o.duration = !a.duration.empty() ? read_positive(a.duration, Dimension::Time, "--duration")
               : run.duration > 0  ? run.duration
                                   : kDuration;
  o.step = !a.step.empty() ? read_positive(a.step, Dimension::Time, "--step") : run.step;
  mbs::choose_steps(run, o);
  o.frame_interval = o.duration / (a.frames > 0 ? a.frames : kFrames);
  o.equilibrium = a.equilibrium.value_or(run.equilibrium.value_or(true));
  o.threads = a.threads;
  return o;
}

/// Columns of equal width, the first for what the rows are about.
class Table {
 public:
  explicit Table(const std::vector<std::string>& heads) { add("", heads); }
  void add(const std::string& what, const std::vector<std::string>& cells) {
    rows_.emplace_back(what, cells);
    first_ = std::max(first_, what.size());
    widths_.resize(std::max(widths_.size(), cells.size()), 0);
    for (size_t i = 0; i < cells.size(); ++i) widths_[i] = std::max(widths_[i], cells[i].size());
  }
  void print() const {
    for (const auto& [what, cells] : rows_) {
      std::string line = fmt::format("{:<{}}", what, first_);
      for (size_t i = 0; i < cells.size(); ++i) line += fmt::format("  {:<{}}", cells[i], widths_[i]);
      while (!line.empty() && line.back() == ' ') line.pop_back();
      std::printf("%s\n", line.c_str());
    }
  }

 private:
  std::vector<std::pair<std::string, std::vector<std::string>>> rows_;
  size_t first_ = 0;
  std::vector<size_t> widths_;
};

/// What a run says of itself, advice on its step included.
std::vector<std::string> notes_of(const mbs::Summary& s) {
  std::vector<std::string> notes = s.notes;
  if (s.step_needed > 0) notes.push_back(collapse::describe_step_needed(s));
  return notes;
}

void print_table(const mbs::Model& model, const Comparison& c) {
  const EngineRun* first = nullptr;
  std::vector<std::string> heads;
  for (const EngineRun& r : c.runs) {
    heads.push_back(r.name + " " + r.version);
    if (!first && r.has_run()) first = &r;
  }
  Table table(heads);
  const auto row = [&](const std::string& what, auto cell) {
    std::vector<std::string> cells;
    for (const EngineRun& r : c.runs) cells.push_back(r.has_run() ? cell(r) : "");
    table.add(what, cells);
  };
  const auto differs = [&](const std::string& what, Difference EngineRun::*which, bool of_body) {
    row(what, [&](const EngineRun& r) {
      return &r == first || r.time.empty() ? std::string("-") : fmt::format("{:.3g}", (r.*which).value);
    });
    row(of_body ? "  body, time" : "  time", [&](const EngineRun& r) {
      const Difference& d = r.*which;
      if (&r == first || d.body < 0) return std::string("-");
      const std::string when = fmt::format("{:.4g} s", d.time);
      return of_body ? model.bodies[static_cast<size_t>(d.body)].name + ", " + when : when;
    });
  };
  std::vector<std::string> endings;
  for (const EngineRun& r : c.runs) endings.push_back(r.has_run() ? word_of(r.summary.ending) : "not run");
  table.add("ending", endings);
  row("steps", [](const EngineRun& r) { return fmt::format("{}", r.summary.steps); });
  row("time [s]", [](const EngineRun& r) { return fmt::format("{:.3g}", r.summary.wall_time); });
  row("  over " + (first ? first->name : std::string("the first")), [&](const EngineRun& r) {
    return first && first->summary.wall_time > 0 ? fmt::format("{:.3g}", r.summary.wall_time / first->summary.wall_time)
                                                 : std::string("-");
  });
  row("energy error", [](const EngineRun& r) { return fmt::format("{:.2g}", r.summary.energy_error); });
  if (!model.joints.empty())
    row("joint drift [m, rad]", [](const EngineRun& r) { return fmt::format("{:.2g}", r.summary.joint_drift); });
  row("broken", [](const EngineRun& r) { return fmt::format("{}", r.broken); });
  differs("position [m]", &EngineRun::position, true);
  differs("orientation [rad]", &EngineRun::orientation, true);
  differs("height of mass centre [m]", &EngineRun::height, false);
  table.print();
}

void print_bodies(const mbs::Model& model, const Comparison& c) {
  std::vector<std::string> heads;
  std::vector<const EngineRun*> runs;
  for (const EngineRun& r : c.runs)
    if (!r.time.empty()) {
      runs.push_back(&r);
      heads.push_back(r.name + " [m, rad]");
    }
  if (runs.empty()) return;
  std::vector<size_t> order(model.bodies.size());
  std::iota(order.begin(), order.end(), 0);
  const auto worst = [&](size_t b) {
    double w = 0;
    for (const EngineRun* r : runs) w = std::max(w, r->body_position[b].value);
    return w;
  };
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return worst(a) > worst(b); });
  Table table(heads);
  for (const size_t b : order) {
    if (model.bodies[b].fixed) continue;
    std::vector<std::string> cells;
    for (const EngineRun* r : runs)
      cells.push_back(fmt::format("{:.3g}, {:.3g}", r->body_position[b].value, r->body_orientation[b].value));
    table.add(model.bodies[b].name, cells);
  }
  std::printf("\nLargest differences of each body\n");
  table.print();
}

json to_json(const mbs::Model& model, const Difference& d) {
  json j{{"value", d.value}, {"time", d.time}};
  if (d.body >= 0) j["body"] = model.bodies[static_cast<size_t>(d.body)].name;
  return j;
}

json to_json(const mbs::Model& model, const Comparison& c) {
  json out{{"step", c.step}, {"interval", c.interval}, {"engines", json::array()}};
  for (const EngineRun& r : c.runs) {
    json j{{"name", r.name}, {"version", r.version}};
    if (!r.has_run()) {
      j["unsupported"] = json::array();
      for (const auto& u : r.unsupported) j["unsupported"].push_back({{"place", u.place}, {"what", u.what}});
    } else {
      j["ending"] = word_of(r.summary.ending);
      j["message"] = r.summary.message;
      j["steps"] = r.summary.steps;
      j["wall_time"] = r.summary.wall_time;
      j["energy_error"] = r.summary.energy_error;
      j["joint_drift"] = r.summary.joint_drift;
      j["broken"] = r.broken;
      j["notes"] = notes_of(r.summary);
      if (!r.time.empty()) {
        j["position"] = to_json(model, r.position);
        j["orientation"] = to_json(model, r.orientation);
        j["height"] = {{"value", r.height.value}, {"time", r.height.time}};
      }
    }
    out["engines"].push_back(std::move(j));
  }
  return out;
}

/// Says what engines cannot express, the first few of each; one complaint for each engine.
std::vector<Diagnostic> print_unsupported(const mbs::Model& model, const mbs::Options& options,
                                          const std::vector<std::unique_ptr<engines::Engine>>& list) {
  constexpr size_t shown = 5;
  std::vector<Diagnostic> refusing;
  for (const auto& engine : list) {
    const auto unsupported = engine->find_unsupported(model, options);
    if (unsupported.empty()) continue;
    refusing.push_back(
        {Severity::Error,
         "E652",
         {},
         1,
         fmt::format("{} cannot express {}: {}", engine->name(), unsupported[0].place, unsupported[0].what),
         "--skip-unsupported compares the other engines"});
    std::fprintf(stderr, "%s cannot express\n", engine->name().c_str());
    for (size_t i = 0; i < std::min(shown, unsupported.size()); ++i)
      std::fprintf(stderr, "  %s: %s\n", unsupported[i].place.c_str(), unsupported[i].what.c_str());
    if (unsupported.size() > shown) std::fprintf(stderr, "  and %zu more\n", unsupported.size() - shown);
  }
  return refusing;
}

int refuse(const InputError& e, const std::string& text, bool as_json) {
  for (const Diagnostic& d : e.diagnostics()) std::fputs(render(d, text, has_colour(stderr)).c_str(), stderr);
  std::fprintf(stderr, "Nothing was run.\n");
  if (as_json) print_refusal(e.diagnostics());
  return kBadInput;
}

}  // namespace

int compare_engines(const Arguments& a, const std::atomic<bool>& cancel) {
  std::string text;
  try {
    text = read_file(a.input);
    mbs::RunSettings run;
    const mbs::Model model = mbs::model_from_json(text, a.input, &run);
    const auto list = make_engines(a);
    mbs::Options options = make_options(a, run);
    if (options.equilibrium) mbs::refuse_velocities(model, text, a.input);
    options.progress.cancel = &cancel;
    const std::vector<Diagnostic> refusing = print_unsupported(model, options, list);
    if (!refusing.empty() && (!a.skip_unsupported || refusing.size() == list.size())) {
      std::fprintf(stderr, "Nothing was run.%s\n",
                   a.skip_unsupported ? "" : " With --skip-unsupported the other engines are compared.");
      if (a.json) print_refusal(refusing);
      return kBadInput;
    }
    if (!a.output.empty()) make_folder(a.output, {"compare.csv", "compare.svg"});
    const bool shows = has_colour(stderr);
    const Comparison c = engines::compare(model, options, list, [&](const std::string& name) {
      if (shows) std::fprintf(stderr, "\r\x1b[2K%s ...", name.c_str());
    });
    if (shows) std::fprintf(stderr, "\r\x1b[2K");
    if (!a.json) {
      std::printf("%s: %zu bodies, %.6g s in %ld instants; fixed steps are %.4g s\n\n",
                  model.name.empty() ? a.input.c_str() : model.name.c_str(), model.bodies.size(), options.duration,
                  std::lround(options.duration / c.interval), c.step);
      print_table(model, c);
      if (a.bodies) print_bodies(model, c);
      for (const EngineRun& r : c.runs) {
        if (!r.has_run()) continue;
        if (r.summary.ending == Ending::Diverged || r.summary.ending == Ending::NoEquilibrium)
          std::printf("\n%s: %s\n", r.name.c_str(), r.summary.message.c_str());
        for (const std::string& note : notes_of(r.summary)) std::printf("\n%s: %s\n", r.name.c_str(), note.c_str());
      }
    }
    if (!a.output.empty()) {
      const auto write = [&](const char* name, const std::string& content) {
        if (content.empty()) return;
        const std::string path = (fs::path(a.output) / name).string();
        replace_file(path, content);
        std::fprintf(a.json ? stderr : stdout, "Wrote %s\n", path.c_str());
      };
      write("compare.csv", engines::to_csv(model, c));
      write("compare.svg", engines::to_svg(model, c));
    }
    const bool all_ended = std::all_of(c.runs.begin(), c.runs.end(), [](const EngineRun& r) {
      return !r.has_run() || r.summary.ending == Ending::TimeLimit || r.summary.ending == Ending::AtRest;
    });
    if (a.json) std::printf("%s\n", to_json(model, c).dump(2, ' ', false, json::error_handler_t::replace).c_str());
    return all_ended && c.runs.size() == list.size() ? kOk : kRunFailed;
  } catch (const InputError& e) { return refuse(e, text, a.json); }
}

}  // namespace topple::apps
