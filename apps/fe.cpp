#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

#include "base/error.h"
#include "commands.h"
#include "farfield/run.h"
#include "product/plan.h"
#include "results.h"
#include "terminal.h"

namespace topple::apps {

namespace fs = std::filesystem;
using json = nlohmann::ordered_json;

namespace {

farfield::FeOptions make_fe_options(const Arguments& a) {
  farfield::FeOptions o;
  o.grid.size = read_quantity(a.fe.size, Dimension::Length, "--size");
  o.grid.least_across = a.fe.across;
  o.scaled_step = read_quantity(a.fe.scaled_step, Dimension::Time, "--scaled-step");
  o.skip_quiet = a.fe.skip_quiet;
  set_checkpoint(a, o);
  return o;
}

/// Those that a run has to have again to go on.
std::string write_options(const Arguments& a) {
  std::string out = write_option("--size", a.fe.size);
  if (a.fe.across != FeArguments{}.across) out += fmt::format(" --across {}", a.fe.across);
  return out + write_option("--scaled-step", a.fe.scaled_step) + (a.fe.skip_quiet ? " --skip-quiet" : "");
}

void print_mesh(std::FILE* out, const farfield::MeshReport& report) {
  for (const std::string& line : farfield::describe(report)) std::fprintf(out, "%s\n", line.c_str());
}

json to_json(const farfield::MeshReport& r) {
  return {{"elements", r.mesh.elements},
          {"nodes", r.mesh.nodes},
          {"mass", r.mesh.mass},
          {"mass_centre", {r.mesh.p_WBcm.x, r.mesh.p_WBcm.y, r.mesh.p_WBcm.z}},
          {"smallest_edge", r.mesh.smallest_edge},
          {"smallest_edge_member", r.smallest_edge_member},
          {"largest_aspect", r.mesh.largest_aspect},
          {"critical_step", r.mesh.critical_step},
          {"critical_member", r.critical_member},
          {"largest_shift", r.largest_shift},
          {"shifted_member", r.shifted_member},
          {"smallest_volume_share", r.smallest_fit},
          {"largest_volume_share", r.largest_fit}};
}

}  // namespace

int run_finite_elements(const Arguments& a, const std::atomic<bool>& cancel) {
  std::vector<Diagnostic> warnings;
  std::string text;
  std::FILE* out = a.json ? stderr : stdout;
  try {
    const collapse::RunOptions options = make_plan_options(a, "--until");
    const farfield::FeOptions fe = make_fe_options(a);
    const product::Plan plan = product::read_plan_file(a.input, warnings, text);
    const collapse::Knowledge knowledge = load_knowledge(a);
    print_diagnostics(warnings, text);
    if (plan.analysis.step > 0)
      std::fprintf(stderr,
                   "topple: \"step\" of [analysis] is that of the multibody model and has no effect here; "
                   "--scaled-step sets that of the elements, a shorter one too.\n");
    if (a.fe.mesh_only) {
      const farfield::Whole whole = farfield::make_whole(plan, knowledge, fe.grid, a.threads);
      const farfield::MeshReport report = farfield::calc_mesh_report(plan, whole);
      json mesh = to_json(report);
      std::string added_mass;
      if (fe.scaled_step > 0) {
        const farfield::MassScaling scaling = farfield::calc_mass_scaling(whole, report, knowledge, fe.scaled_step);
        added_mass = scaling.mass > 0
                         ? scaling.describe()
                         : fmt::format("No element needs mass for a step of {:.4f} ms.", 1e3 * scaling.step);
        mesh["added_mass"] = scaling.mass;
        mesh["scaled_elements"] = scaling.elements;
      }
      print_mesh(out, report);
      if (!added_mass.empty()) std::fprintf(out, "%s\n", added_mass.c_str());
      for (const std::string& note : whole.notes) std::fprintf(out, "%s\n", note.c_str());
      if (a.json) std::printf("%s\n", dump({{"exit_code", kOk}, {"mesh", mesh}}).c_str());
      return kOk;
    }
    const RunFolder folder(a.output);
    ProgressLine progress;
    EventPrinter events(out, a.verbose, progress);
    collapse::RunCallbacks callbacks;
    callbacks.on_event = [&](const record::Event& e) { events.print(e); };
    callbacks.progress.report = [&](double done, double whole) { progress.show(done, whole); };
    callbacks.progress.cancel = &cancel;
    farfield::FeCallbacks fe_callbacks;
    fe_callbacks.on_mesh = [&](const farfield::MeshReport& report, const std::string& added_mass) {
      std::fprintf(out, "%s\n", plan.title.c_str());
      print_mesh(out, report);
      if (!added_mass.empty()) std::fprintf(out, "%s\n", added_mass.c_str());
      if (!fe.resume) std::fprintf(out, "Putting on the dead load ...\n");
      std::fflush(out);
    };
    fe_callbacks.on_settling = [&](int steps) { progress.say(fmt::format("settling: {} steps", steps)); };
    fe_callbacks.on_relaxed = [&](const fem::RelaxationSummary& s) {
      progress.clear();
      std::fprintf(out, "%s\n", s.text.c_str());
      std::fflush(out);
    };
    fem::ExplicitSystem::Timing timing;
    fe_callbacks.on_timing = [&](const fem::ExplicitSystem::Timing& t) { timing = t; };
    bool has_checkpoint = fe.resume;  // none is written while the dead load is put on
    fe_callbacks.on_lost_checkpoint = [&](const std::string& why) { tell_lost_checkpoint(progress, why); };
    fe_callbacks.on_checkpoint = [&] { has_checkpoint = true; };
    const record::Record r = farfield::run_plan(plan, knowledge, options, fe, callbacks, fe_callbacks);
    progress.clear();
    const int code = close_run(r, a, out, {});
    const double elements = timing.kernel + timing.boundary, contact = timing.contact + timing.search;
    if (elements > 0)
      std::fprintf(out, "Elements and nodes took %.1f s, contact and debris %.1f s: %.2f of that.\n", elements, contact,
                   contact / elements);
    if (r.ending == "cancelled" && has_checkpoint) tell_how_to_go_on(out, a, "fe", write_options(a));
    return code;
  } catch (const InputError& e) { return refuse(e, warnings, text, a.json); }
}

}  // namespace topple::apps
