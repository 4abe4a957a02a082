/// `topple rcc`: resistance curves of a zone of a section, or of a member of a plan.

#include "nearfield/rcc.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <regex>
#include <string>
#include <vector>

#include "base/file.h"
#include "base/hash.h"
#include "base/unit.h"
#include "collapse/member_zone.h"
#include "commands.h"
#include "product/section_file.h"
#include "program.h"
#include "rcc_fuzzy.h"
#include "rcc_report.h"
#include "rcc_solid.h"
#include "record/rcc_figures.h"
#include "record/rcc_page.h"
#include "record/rcc_report.h"
#include "results.h"
#include "terminal.h"

namespace topple::apps {

namespace fs = std::filesystem;
using json = nlohmann::ordered_json;

namespace {

/// What is computed, from either kind of file.
struct Task {
  nearfield::ZoneInput zone;
  std::vector<double> normal_forces;  // tension positive; none: to be chosen [N]
  std::string title, name;            // of the file, of the zone
  std::vector<std::string> notes;
  product::SectionFile file;  // of a section file
};

nearfield::ZoneInput to_zone(const product::SectionFile& f) {
  nearfield::ZoneInput in;
  in.section = f.section, in.concrete = f.concrete, in.steel = f.steel;
  in.length = f.length;
  in.cut_bars = f.cut_bars, in.cut_concrete = f.cut_concrete;
  in.concrete_loss = f.concrete_loss, in.cover_lost = f.cover_lost;
  return in;
}

Task read_section_task(const Arguments& a, std::vector<Diagnostic>& warnings, std::string& text) {
  const product::SectionFile f = product::read_section_file(a.input, warnings, text);
  Task task;
  task.zone = to_zone(f);
  task.normal_forces = f.normal_forces;
  task.title = f.title;
  task.name = f.section.name;
  task.file = f;
  const double longest = nearfield::calc_largest_zone_length(f.concrete);
  if (f.length < longest) return task;
  if (f.has_length)
    throw InputError(std::vector<Diagnostic>{
        {Severity::Error, "E611", f.where_length, 1,
         fmt::format(
             "zone: length: {:.4g} m is too long for this concrete: it would give back more than its crushing or "
             "fracture energy",
             f.length),
         fmt::format("allowed: below {:.4g} m; without it the program chooses", longest)}});
  task.zone.length = nearfield::kLongestZoneShare * longest;
  task.notes.push_back(
      fmt::format("The zone is {:.3g} m long, shorter than one depth of the section ({:.3g} m): over that length the "
                  "concrete would give back more than its crushing or fracture energy.",
                  task.zone.length, f.length));
  return task;
}

Task read_member_task(const Arguments& a, std::vector<Diagnostic>& warnings, std::string& text) {
  const product::Plan plan = product::read_plan_file(a.input, warnings, text);
  const int index = plan.find_member(a.member);
  if (index < 0) {
    std::vector<std::string> names;
    for (const product::Member& m : plan.members) names.push_back(m.name);
    std::string near = nearest_name(a.member, names);
    for (const std::string& name : names)
      if (near.empty() && name.starts_with(a.member)) near = name;
    throw InputError("E302", fmt::format("--member: there is no member \"{}\" in {}", a.member, a.input),
                     near.empty() ? "names look like C-A1-0 and B-A1A2-0 (docs/plan.md)"
                                  : fmt::format("did you mean \"{}\"?", near));
  }
  const bool at_end = a.zone == "top" || a.zone == "end";
  const collapse::MemberZone m = collapse::find_member_zone(plan, load_knowledge(a), index, at_end, a.threads);
  Task task;
  task.zone = m.input;
  task.title = plan.title;
  task.name = m.name;
  task.normal_forces = {m.normal_force};
  task.notes.push_back(
      m.is_estimate
          ? fmt::format("Dead load of {:.4g} MN, by summing up weights: no equilibrium was found ({}).",
                        -m.normal_force / unit::MN, m.message)
          : fmt::format("Dead load of {:.4g} MN from the equilibrium of the building before the first charge.",
                        -m.normal_force / unit::MN));
  return task;
}

/// Forces of the command line, tension positive; only 0 needs no unit.
std::vector<double> read_forces(const std::vector<std::string>& typed) {
  std::vector<double> out;
  for (const std::string& text : typed) {
    Quantity q = parse_quantity(text, Dimension::Force);
    if (!q.value) {
      const Quantity bare = parse_quantity(text, Dimension::Number);
      if (bare.value && *bare.value == 0) q = bare;
    }
    if (!q.value)
      throw InputError("E801", fmt::format("--normal-force \"{}\": {}", text, q.problem),
                       "units: " + units_of(Dimension::Force));
    out.push_back(-*q.value);
  }
  return out;
}

/// Each force once, in their order; those that differ by rounding alone are equal.
std::vector<double> take_once(const std::vector<double>& forces) {
  std::vector<double> out;
  for (const double N : forces) {
    const auto is_equal = [N](double other) {
      return std::abs(N - other) <= 1e-9 * std::max(std::abs(N), std::abs(other));
    };
    if (std::none_of(out.begin(), out.end(), is_equal)) out.push_back(N);
  }
  return out;
}

/// A positive quantity of the command line; 0 if it was not given.
double read_positive(const std::string& text, Dimension dimension, const char* option) {
  if (text.empty()) return 0;
  const Quantity q = parse_quantity(text, dimension);
  if (!q.value || !(*q.value > 0))
    throw InputError("E801", fmt::format("{} \"{}\": {}", option, text, q.value ? "must be > 0" : q.problem),
                     "units: " + units_of(dimension));
  return *q.value;
}

/// Options that would be read and have no effect.
void refuse_idle_options(const Arguments& a) {
  const auto refuse = [](const std::string& option, const char* of, const char* help) {
    throw InputError("E801", fmt::format("{} has no effect: {}", option, of), help);
  };
  if (a.route == "layered") {
    const char* help = "add --route solid or --route both";
    if (!a.rotation.empty()) refuse("--rotation", "it is of the solid route", help);
    if (!a.element_size.empty()) refuse("--element-size", "it is of the solid route", help);
    const char* more = "leave it out: layered curves are of both axes and directions; or add --fuzzy or --route solid";
    if (a.fuzzy.empty() && a.axis != "y")
      refuse("--axis " + a.axis, "it is of fuzzy curves and of the solid route", more);
    if (a.fuzzy.empty() && a.direction != "+")
      refuse("--direction " + a.direction, "it is of fuzzy curves and of the solid route", more);
  }
  if (a.member.empty() && !a.knowledge.empty())
    refuse("--knowledge", "its rules are for the members of a plan", "add --member NAME");
}

std::string cell(double value, double scale, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value / scale, digits) : "-";
}

/// One line for each curve; equal ones share it.
void print_table(std::FILE* out, const record::RccReport& r) {
  std::fprintf(out, "\n  %-8s %-12s %8s  %9s  %15s  %15s  %15s  %15s\n", "route", "about", "N", "EI eff", "yield",
               "peak", "ultimate", "residual");
  std::fprintf(out, "  %-8s %-12s %8s  %9s  %15s  %15s  %15s  %15s\n", "", "", "MN", "MNm2", "mrad    kNm",
               "mrad    kNm", "mrad    kNm", "mrad    kNm");
  for (const auto& [curve, about] : record::group_curves(r)) {
    const record::RccCurve& c = *curve;
    const auto point = [](const record::RccPoint& p) {
      return fmt::format("{:>7} {:>7}", cell(p.rotation, 1e-3, 2), cell(p.moment, unit::kNm, 1));
    };
    const std::string N = cell(c.normal_force, unit::MN, 3);
    if (!std::isfinite(c.peak.moment)) {
      std::fprintf(out, "  %-8s %-12s %8s  %s\n", c.route.c_str(), about.c_str(), N.c_str(), c.ending.c_str());
      continue;
    }
    std::fprintf(out, "  %-8s %-12s %8s  %9s  %s  %s  %s  %s\n", c.route.c_str(), about.c_str(), N.c_str(),
                 cell(c.stiffness_effective, 1e6, 2).c_str(), point(c.yield).c_str(), point(c.peak).c_str(),
                 point(c.ultimate).c_str(), point(c.residual).c_str());
  }
  std::fprintf(out, "\n  Strained evenly it crushes at %.3f MN and tears at %.3f MN. Compression is positive.\n",
               r.crushing_force / unit::MN, r.rupture_force / unit::MN);
}

/// Puts files into a folder and remembers them.
struct Writer {
  std::string folder;
  Files files;
  void write(const std::string& what, const std::string& name, const std::string& bytes) {
    const std::string path = (fs::path(folder) / name).string();
    replace_file(path, bytes);
    files.emplace_back(what, path);
  }
  void write_pictures(const std::vector<record::Figure>& figures) {
    constexpr double pixels_per_point = 2;
    for (const record::Figure& f : figures) write(f.id, f.id + ".png", record::to_png(f.drawing, pixels_per_point));
  }
};

/// Names that this command gives to its files.
bool is_own_name(const std::string& name) {
  static const std::regex own(
      R"((points|curves|interaction|biaxial|axial|states|solid_states|fan|samples|originals)\.csv|(rcc|fuzzy)\.(json|html)|)"
      R"(moment_[yz](_beginning)?\.png|interaction_[yz]\.png|(biaxial|axial|axial_whole|crushing|inputs)\.png|)"
      R"((solid|fan|switch)_[0-9]+\.png|section_[yz]_(pos|neg)_[0-9]+\.png)");
  return std::regex_match(name, own);
}

/// Takes away what an earlier run left in a folder and this one has not written anew; how many files.
int remove_earlier(const std::string& folder, const Files& written) {
  std::vector<fs::path> earlier;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const auto is_it = [&](const auto& file) { return fs::path(file.second).filename() == entry.path().filename(); };
    if (entry.is_regular_file() && is_own_name(entry.path().filename().string()) &&
        std::none_of(written.begin(), written.end(), is_it))
      earlier.push_back(entry.path());
  }
  int removed = 0;
  for (const fs::path& path : earlier) {
    std::error_code error;
    removed += fs::remove(path, error);
  }
  return removed;
}

void write_rcc_files(const record::RccReport& r, Writer& out) {
  const auto write = [&out](const char* what, const char* name, const std::string& bytes) {
    out.write(what, name, bytes);
  };
  write("points", "points.csv", record::points_csv(r));
  write("curves", "curves.csv", record::curves_csv(r));
  write("interaction", "interaction.csv", record::interaction_csv(r));
  write("biaxial", "biaxial.csv", record::biaxial_csv(r));
  write("axial", "axial.csv", record::axial_csv(r));
  write("states", "states.csv", record::states_csv(r));
  if (!r.solid_states.empty()) write("solid_states", "solid_states.csv", record::solid_states_csv(r));
  write("json", "rcc.json", record::to_json(r) + "\n");
  const std::vector<record::Figure> figures = record::make_figures(r);
  write("page", "rcc.html", record::to_page(r, figures));
  out.write_pictures(figures);
}

void write_fuzzy_files(const record::RccFuzzyReport& r, Writer& out) {
  out.write("fan", "fan.csv", record::fan_csv(r));
  out.write("samples", "samples.csv", record::samples_csv(r));
  out.write("originals", "originals.csv", record::originals_csv(r));
  out.write("fuzzy_json", "fuzzy.json", record::to_json(r) + "\n");
  const std::vector<record::Figure> figures = record::make_figures(r);
  out.write("fuzzy_page", "fuzzy.html", record::to_page(r, figures));
  out.write_pictures(figures);
}

void print_fuzzy(std::FILE* out, const record::RccFuzzyReport& r) {
  const int width = find_width(out);
  for (const record::RccFan& f : r.fans) {
    std::fprintf(out, "\n  N = %.4g MN, %zu runs on the %s route\n", f.normal_force / unit::MN, f.originals.size(),
                 r.route.c_str());
    for (const std::string& s : record::describe_switch(r, f)) std::fprintf(out, "    %s\n", wrap(s, width, 4).c_str());
    for (const record::RccOrdinate& o : f.ordinates) {
      std::string line = fmt::format("    {:<18}", o.name);
      for (const record::RccInterval& i : o.cuts)
        line += fmt::format("  {:g}: {:.0f} to {:.0f}", i.alpha, i.left / unit::kNm, i.right / unit::kNm);
      std::fprintf(out, "%s kNm\n", line.c_str());
    }
    if (f.failed > 0) std::fprintf(out, "    %d runs failed; first: %s\n", f.failed, wrap(f.failure, width, 4).c_str());
    std::fprintf(out, "    %s\n", wrap(f.ending, width, 4).c_str());
  }
}

/// Adds the solid route; what failed, or nothing if it was cancelled.
std::optional<std::vector<std::string>> compute_solid(const Arguments& a, const Task& task, record::RccReport& report,
                                                      const std::atomic<bool>& cancel) {
  SolidTask s;
  s.normal_forces = task.normal_forces;
  s.axis = a.axis[0], s.direction = a.direction == "-" ? -1 : 1;
  s.largest_rotation = read_positive(a.rotation, Dimension::Angle, "--rotation");
  s.element_size = read_positive(a.element_size, Dimension::Length, "--element-size");
  s.threads = a.threads;
  ProgressLine progress;
  const SolidOutcome outcome = add_solid_route(
      task.zone, s, report, cancel,
      [&](const std::string& what, double done, double whole) { progress.show_work(what, done, whole); });
  progress.clear();
  if (outcome.cancelled) return std::nullopt;
  if (a.route == "solid") {
    std::erase_if(report.curves, [](const record::RccCurve& c) { return c.route == "layered"; });
    report.states.clear(), report.interactions.clear(), report.biaxial.clear(), report.axial.clear();
  }
  return outcome.failures;
}

/// The fuzzy report, or nothing if it was cancelled.
std::optional<record::RccFuzzyReport> compute_fuzzy(const Arguments& a, const product::FuzzyFile& fuzzy,
                                                    const Task& task, const record::RccReport& crisp,
                                                    const std::atomic<bool>& cancel) {
  FuzzyTask f;
  f.normal_forces = task.normal_forces;
  f.axis = a.axis[0], f.direction = a.direction == "-" ? -1 : 1;
  f.threads = a.threads;
  ProgressLine progress;
  auto r = make_fuzzy_report(task.file, fuzzy, f, cancel, [&](const std::string& words) { progress.say(words); });
  progress.clear();
  if (!r) return r;
  r->title = fuzzy.title, r->zone = crisp.zone;
  r->source = crisp.source, r->sha256 = crisp.sha256;
  r->inputs_source = fuzzy.path, r->inputs_sha256 = calc_sha256(fuzzy.text);
  r->program_version = crisp.program_version;
  r->section = crisp.inputs, r->not_modelled = crisp.not_modelled;
  return r;
}

int say_cancelled(bool as_json) {
  std::fprintf(stderr, "Cancelled. Nothing was written.\n");
  if (as_json) print_failure("cancelled");
  return kRunFailed;
}

}  // namespace

int compute_rcc(const Arguments& a, const std::atomic<bool>& cancel) {
  std::FILE* out = a.json ? stderr : stdout;
  std::vector<Diagnostic> warnings;
  std::string text;
  try {
    const std::vector<double> typed = read_forces(a.normal_forces);
    read_positive(a.rotation, Dimension::Angle, "--rotation");  // before any work
    read_positive(a.element_size, Dimension::Length, "--element-size");
    refuse_idle_options(a);
    if (!a.output.empty()) refuse_file(a.output);
    Task task = a.member.empty() ? read_section_task(a, warnings, text) : read_member_task(a, warnings, text);
    std::optional<product::FuzzyFile> fuzzy;
    if (!a.fuzzy.empty()) {
      std::string section_text;
      std::swap(section_text, text);
      fuzzy = product::read_fuzzy_file(a.fuzzy, task.file, warnings, text);  // complaints show its lines
      std::swap(section_text, text);
    }
    for (const Diagnostic& d : warnings) std::fputs(render(d, text, has_colour(stderr)).c_str(), stderr);
    const nearfield::Rcc rcc = nearfield::make_rcc(task.zone);
    if (!typed.empty()) {
      task.normal_forces = typed;
    } else if (task.normal_forces.empty()) {
      task.normal_forces = choose_forces(rcc);
    } else if (!a.member.empty()) {
      const double dead_load = task.normal_forces.front(), apart = 0.03 * rcc.y_pos.normal_force.front();
      for (const double N : choose_forces(rcc))
        if (std::abs(N - dead_load) > -apart) task.normal_forces.push_back(N);
    }
    task.normal_forces = take_once(task.normal_forces);
    record::RccReport report = make_rcc_report(task.zone, rcc, task.normal_forces);
    report.title = task.title;
    report.source = a.input;
    report.sha256 = calc_sha256(text);
    report.program_version = program_version();
    report.zone = fmt::format("{}, zone of {:.3g} m", task.name, task.zone.length);
    report.notes.insert(report.notes.begin(), task.notes.begin(), task.notes.end());

    std::vector<std::string> failures;
    if (a.route != "layered") {
      if (task.zone.flange.breadth > 0)
        throw InputError("E618", task.name + " has slabs as flanges, which the solid route does not know",
                         "use --route layered, or describe its section in a file of its own");
      const auto outcome = compute_solid(a, task, report, cancel);
      if (!outcome) return say_cancelled(a.json);
      failures = *outcome;
    }
    std::fprintf(out, "%s: %s\n", report.title.c_str(), report.zone.c_str());
    for (const std::string& note : report.notes) std::fprintf(out, "  %s\n", note.c_str());
    print_table(out, report);
    std::optional<record::RccFuzzyReport> fans;
    if (fuzzy) {
      fans = compute_fuzzy(a, *fuzzy, task, report, cancel);
      if (!fans) return say_cancelled(a.json);
      print_fuzzy(out, *fans);
    }
    if (!a.output.empty()) {
      const bool is_again = fs::exists(fs::path(a.output) / "rcc.json");
      make_folder(a.output);
      Writer writer{a.output, {}};
      write_rcc_files(report, writer);
      if (fans) write_fuzzy_files(*fans, writer);
      const int removed = is_again ? remove_earlier(a.output, writer.files) : 0;
      if (removed > 0) std::fprintf(out, "Took away %d files of an earlier run.\n", removed);
      for (const auto& [what, path] : writer.files) std::fprintf(out, "Wrote %s\n", path.c_str());
    }
    if (a.json) std::printf("%s\n", (fans ? record::to_json(*fans) : record::to_json(report)).c_str());
    for (const std::string& failure : failures) std::fprintf(stderr, "topple: %s\n", failure.c_str());
    return failures.empty() ? kOk : kRunFailed;
  } catch (const InputError& e) { return refuse(e, warnings, text, a.json); }
}

}  // namespace topple::apps
