/// `topple mbs run`: a multibody model on its own.

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "base/file.h"
#include "base/words.h"
#include "collapse/findings.h"
#include "commands.h"
#include "mbs/model_json.h"
#include "mbs/model_words.h"
#include "results.h"
#include "terminal.h"

namespace topple::apps {

namespace fs = std::filesystem;
using json = nlohmann::ordered_json;

namespace {

/// "2 springs, 1 bushing"; items of which there are none are left out.
std::string count_all(const std::vector<std::pair<size_t, const char*>>& items) {
  std::string out;
  for (const auto& [n, what] : items)
    if (n > 0) out += (out.empty() ? "" : ", ") + count_words(static_cast<long long>(n), what);
  return out.empty() ? "none" : out;
}

std::string describe_joints(const mbs::Model& m) {
  std::vector<size_t> count(mbs::kJointWords.size());
  for (const mbs::Joint& j : m.joints) ++count[static_cast<size_t>(j.kind)];
  std::string out;
  for (size_t k = 0; k < count.size(); ++k)
    if (count[k] > 0) out += fmt::format("{}{} {}", out.empty() ? "" : ", ", count[k], mbs::kJointWords[k]);
  return out.empty() ? "none" : out;
}

void print_table(std::FILE* out, const std::vector<std::pair<const char*, std::string>>& rows) {
  const int width = find_width(out);
  for (const auto& [what, text] : rows) std::fprintf(out, "  %-16s %s\n", what, wrap(text, width, 19).c_str());
}

void print_model(std::FILE* out, const mbs::Model& m) {
  size_t fixed = 0;
  double mass = 0;
  for (const mbs::Body& b : m.bodies) {
    fixed += b.fixed;
    if (!b.fixed) mass += b.mass;
  }
  std::fprintf(out, "%s\n", m.name.empty() ? "Multibody model" : m.name.c_str());
  std::vector<std::pair<const char*, std::string>> rows = {
      {"Bodies", fmt::format("{}{}, {:.6g} kg in motion", m.bodies.size(),
                             fixed > 0 ? fmt::format(" ({} fixed)", fixed) : "", mass)},
      {"Joints", describe_joints(m)},
      {"Elements", count_all({{m.elements.size(), "six-component element"},
                              {m.rotational_elements.size(), "rotational element"},
                              {m.springs.size(), "spring"},
                              {m.rotational_springs.size(), "rotational spring"},
                              {m.bushings.size(), "bushing"},
                              {m.cables.size(), "cable"}})}};
  if (!m.loads.empty()) rows.emplace_back("Loads", std::to_string(m.loads.size()));
  if (!m.events.empty()) rows.emplace_back("Events", std::to_string(m.events.size()));
  if (!m.outputs.empty()) rows.emplace_back("Outputs", std::to_string(m.outputs.size()));
  print_table(out, rows);
}

void print_summary(std::FILE* out, const mbs::Model& m, const mbs::Summary& s, const record::Record& r,
                   bool equilibrium) {
  std::vector<std::pair<const char*, std::string>> rows = {{"Ending", r.ending_text}};
  if (equilibrium)
    rows.emplace_back("Equilibrium", fmt::format("{} iterations, largest unbalanced force {:.1e} of the weight",
                                                 s.equilibrium_iterations, s.equilibrium_residual));
  if (s.ending == mbs::Summary::Ending::NoEquilibrium) {
    rows.emplace_back("Hint",
                      "a mechanism has none, nor what breaks under its loads: --no-equilibrium, or \"run\": "
                      "{\"equilibrium\": false} in the file, begins with the poses and velocities given");
  } else {
    const std::string step =
        !(s.step > 0) ? "the engine's choice"
        : s.shortest_step < 0.9999 * s.step
            ? fmt::format("{:.4g} ms at first, {:.4g} at the least", s.step * 1e3, s.shortest_step * 1e3)
            : fmt::format("{:.4g} ms", s.step * 1e3);
    rows.emplace_back(
        "Time", fmt::format("{:.6g} s in {} steps of {}, computed in {:.2g} s", s.time, s.steps, step, s.wall_time));
    if (s.ending != mbs::Summary::Ending::Diverged)
      rows.emplace_back(
          "Energy error",
          fmt::format("{:.1e} of the potential energy released, or of the energy at the start", s.energy_error));
    if (!m.joints.empty()) rows.emplace_back("Joint drift", fmt::format("{:.1e} m or rad", s.joint_drift));
  }
  if (s.step_needed > 0) rows.emplace_back("Note", collapse::describe_step_needed(s));
  for (const std::string& note : s.notes) rows.emplace_back("Note", note);
  std::fprintf(out, "\n");
  print_table(out, rows);
  std::fprintf(out, "\n");
}

}  // namespace

int run_model_file(const Arguments& a, const std::atomic<bool>& cancel) {
  std::FILE* out = a.json ? stderr : stdout;
  std::string text;
  try {
    collapse::RunOptions options = make_options(a);
    set_checkpoint(a, options);
    text = read_file(a.input);
    mbs::RunSettings settings;
    const mbs::Model model = mbs::model_from_json(text, a.input, &settings);
    if (!(options.duration > 0)) options.duration = settings.duration;
    if (!(options.step > 0)) options.step = settings.step;
    options.stability_share = settings.stability_share;
    if (!(options.frame_rate > 0) && settings.frame_interval > 0) options.frame_rate = 1 / settings.frame_interval;
    options.equilibrium = a.equilibrium.value_or(settings.equilibrium.value_or(true));
    if (options.equilibrium) mbs::refuse_velocities(model, text, a.input);
    options.rest_speed = settings.rest_speed.value_or(0);
    const RunFolder folder(a.output);
    print_model(out, model);
    ProgressLine progress;
    EventPrinter events(out, a.verbose, progress);
    mbs::Summary summary;
    collapse::RunCallbacks callbacks;
    callbacks.on_event = [&](const record::Event& e) {
      if (e.kind != "rest" && e.kind != "failure") events.print(e);
    };
    bool has_checkpoint = options.resume;
    callbacks.on_checkpoint = [&] { has_checkpoint = true; };
    callbacks.on_lost_checkpoint = [&](const std::string& why) { tell_lost_checkpoint(progress, why); };
    callbacks.on_resume = [&](double time) { std::fprintf(out, "Going on from %.4g s.\n", time); };
    callbacks.on_summary = [&](const mbs::Summary& s) { summary = s; };
    callbacks.progress.report = [&](double done, double whole) { progress.show(done, whole); };
    callbacks.progress.cancel = &cancel;
    const record::Record r = collapse::run_model(model, options, callbacks);
    progress.clear();
    print_summary(out, model, summary, r, options.equilibrium);

    record::write_output_csv(r, a.output);
    bool failed_report = false;
    const Files files = write_files(r, a, failed_report);
    const int code = exit_code_of(r, failed_report);
    for (const auto& [what, path] : files) std::fprintf(out, "Wrote %s\n", path.c_str());
    json outputs = json::array();
    Files all = files;
    for (const record::Output& o : r.outputs) {
      const std::string path = (fs::path(a.output) / "outputs" / (o.name + ".csv")).string();
      std::fprintf(out, "Wrote %s\n", path.c_str());
      all.emplace_back("output", path);
      outputs.push_back(
          {{"name", o.name}, {"quantity", o.quantity}, {"unit", o.unit}, {"samples", o.time.size()}, {"file", path}});
    }
    print_leftovers(out, a, all);
    if (r.ending == "cancelled" && has_checkpoint) tell_how_to_go_on(out, a, "mbs run", write_run_options(a));
    if (a.json) {
      json j = summary_json(r, files, code);
      j["steps"] = summary.steps;
      j["highest_frequency"] = summary.highest_frequency;
      j["energy_error"] = summary.energy_error;
      j["joint_drift"] = summary.joint_drift;
      j["notes"] = summary.notes;
      j["outputs"] = outputs;
      std::printf("%s\n", dump(j).c_str());
    }
    return code;
  } catch (const InputError& e) { return refuse(e, {}, text, a.json); }
}

}  // namespace topple::apps
