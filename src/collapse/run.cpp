#include "collapse/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/unit.h"
#include "collapse/findings.h"
#include "collapse/heads_across.h"
#include "collapse/keeper.h"
#include "collapse/outcome.h"
#include "collapse/plan_record.h"
#include "collapse/recorder.h"
#include "engines/engine.h"
#include "engines/requirements.h"
#include "mbs/quantity.h"
#include "record/told.h"

namespace topple::collapse {

namespace {

/// The name of the item, or its place where it has none.
std::string item_of(const mbs::Model& m, const mbs::Quantity& q) {
  const std::string item = mbs::traits_of(q.kind).item;
  const size_t i = static_cast<size_t>(q.index);
  const std::string& name = item == "body"         ? m.bodies[i].name
                            : item == "joint"      ? m.joints[i].name
                            : item == "element"    ? m.elements[i].name
                            : item == "rotational" ? m.rotational_elements[i].name
                            : item == "bushing"    ? m.bushings[i].name
                            : item == "spring"     ? m.springs[i].name
                            : item == "cable"      ? m.cables[i].name
                                                   : m.rotational_springs[i].name;
  return fmt::format("{} {}", item == "rotational" ? "rotational element" : item,
                     name.empty() ? fmt::format("number {}", i) : name);
}

/// One table in the record for each output, and who fills it while the model runs.
std::vector<mbs::Sampling> make_samplings(const mbs::Model& model, record::Record& r) {
  std::vector<mbs::Sampling> samplings;
  for (const mbs::Output& o : model.outputs) {
    const mbs::QuantityTraits& t = mbs::traits_of(o.quantity.kind);
    r.outputs.push_back({o.name,
                         fmt::format("{} of {}", t.word, item_of(model, o.quantity)),
                         t.unit,
                         t.frame,
                         mbs::column_names(o.quantity.kind),
                         {},
                         {}});
  }
  for (size_t i = 0; i < model.outputs.size(); ++i)
    samplings.push_back({1 / model.outputs[i].rate, [&r, i, quantity = model.outputs[i].quantity](const mbs::View& v) {
                           record::Output& out = r.outputs[i];
                           out.time.push_back(v.time);
                           for (const double x : mbs::calc_quantity(quantity, v)) out.value.push_back(x);
                         }});
  return samplings;
}

/// What the engine says about its own numbers.
void add_checks(const mbs::Model& model, const mbs::Summary& s, bool equilibrium, const Knowledge& k,
                record::Record& r) {
  using record::Status;
  const auto add = [&r](const std::string& id, const char* title, const std::string& text, double value,
                        const char* unit, Status status) {
    record::add_finding(r,
                        {id, id.rfind("note.", 0) == 0 ? "Notes" : "Verification", title, text, value, unit, status});
  };
  if (equilibrium)
    add("verification.equilibrium", "Equilibrium under dead load",
        fmt::format("After {} iterations the largest unbalanced force is {:.1e} of the weight.",
                    s.equilibrium_iterations, s.equilibrium_residual),
        s.equilibrium_residual, "1",
        s.ending == mbs::Summary::Ending::NoEquilibrium                 ? Status::Bad
        : s.equilibrium_residual <= k.verification_equilibrium_residual ? Status::Good
                                                                        : Status::Warning);
  if (s.ending != mbs::Summary::Ending::NoEquilibrium) {
    add("verification.energy", "Energy balance",
        fmt::format("The largest error is {:.1e} of the potential energy released, or of the energy at the start.",
                    s.energy_error),
        s.energy_error, "1", s.energy_error <= k.verification_energy_error ? Status::Good : Status::Warning);
    add("verification.step", "Time step", describe_steps(s), s.step, "s",
        s.step_needed > 0 ? Status::Warning : Status::Info);
    if (!model.joints.empty())
      add("verification.joints", "Joints", fmt::format("They drift by at most {:.1e} m or rad.", s.joint_drift),
          s.joint_drift, "1", s.joint_drift <= 1e-8 ? Status::Good : Status::Warning);
  }
  for (size_t i = 0; i < s.notes.size(); ++i)
    add(fmt::format("note.{}", i + 1), "Note", s.notes[i], std::numeric_limits<double>::quiet_NaN(), "", Status::Info);
}

/// run_plan; `has_zones`: resistance is that of zones alone. Then an equilibrium of its own says what heads of ground
/// columns bear about the other axis, and spans are looked at beside the model.
record::Record run_with(const product::Plan& plan, const Knowledge& k, const RunOptions& options,
                        const RunCallbacks& callbacks, const std::string& engine, const Mover& move, bool has_zones) {
  ModelMap map;
  const mbs::Model model = make_model(plan, k, map, options.threads);
  if (!has_zones) map.spans.clear();
  record::Record r;
  r.counts = count(model);
  if (callbacks.on_model) callbacks.on_model(model, map, r.counts);
  fill_provenance(options, engine, r);
  fill_from_plan(plan, model, map, r);

  Recorder recorder(model, map, k, r, callbacks);
  if (has_screening(plan)) recorder.keep_speeds();
  tell_failing_charges(plan, map, recorder);
  mbs::Options o = make_mbs_options(settings_of(plan, k, options), k, options.threads, callbacks.progress);
  o.step_share = options.step_share;
  record_into(recorder, o);
  Keeper keeper(options, callbacks, recorder);
  keeper.join(model, plan.text + "\n" + write_rules(k), o);
  const mbs::Summary summary = move(model, map, o);
  end_record(summary, " before the first charge", recorder, r);
  const std::atomic<bool>* cancel = callbacks.progress.cancel;
  std::optional<HeadsAcross> across;
  if (has_zones && has_heads(map) && (r.ending == "at_rest" || r.ending == "time_limit"))
    across = find_heads_across(plan, k, options, cancel, move);
  add_findings(plan, model, map, k, recorder, summary, r, nullptr,
               across && !callbacks.progress.is_cancelled() ? &*across : nullptr);
  if (across && callbacks.progress.is_cancelled()) tell_heads_left_out(r);
  if (callbacks.on_summary) callbacks.on_summary(summary);
  return r;
}

}  // namespace

record::Record run_plan(const product::Plan& plan, const Knowledge& k, const RunOptions& options,
                        const RunCallbacks& callbacks) {
  const std::unique_ptr<engines::Engine> engine = engines::make_engine(options.engine);
  return run_with(
      plan, k, options, callbacks, engine->name(),
      [&engine](const mbs::Model& model, const ModelMap&, const mbs::Options& o) { return engine->run(model, o); },
      true);
}

record::Record run_plan(const product::Plan& plan, const Knowledge& k, const RunOptions& options,
                        const RunCallbacks& callbacks, const std::string& engine, const Mover& move) {
  return run_with(plan, k, options, callbacks, engine, move, false);
}

mbs::RunSettings settings_of(const product::Plan& plan, const Knowledge& k, const RunOptions& options) {
  mbs::RunSettings s;
  s.duration = options.duration > 0 ? options.duration : plan.analysis.duration;
  s.step = options.step_share * (options.step > 0 ? options.step : plan.analysis.step);
  const double rate = options.frame_rate > 0 ? options.frame_rate : plan.analysis.frame_rate;
  s.frame_interval = 1 / (rate > 0 ? rate : 60);
  s.stability_share = mbs::Options().step_safety;
  s.equilibrium = true;
  s.rest_speed = k.rest_speed;
  return s;
}

record::Record run_model(const mbs::Model& model, const RunOptions& options, const RunCallbacks& callbacks) {
  const std::unique_ptr<engines::Engine> engine = engines::make_engine(options.engine);
  mbs::check_model(model);
  const Knowledge& k = default_knowledge();
  const ModelMap map = describe_model(model);
  record::Record r;
  r.counts = count(model);
  if (callbacks.on_model) callbacks.on_model(model, map, r.counts);
  r.provenance.title = model.name;
  fill_provenance(options, engine->name(), r);
  Recorder recorder(model, map, k, r, callbacks);
  mbs::RunSettings settings;
  settings.duration = options.duration > 0 ? options.duration : 10;
  settings.step = options.step_share * options.step;
  if (options.stability_share > 0) settings.stability_share = options.stability_share;
  settings.frame_interval = 1 / (options.frame_rate > 0 ? options.frame_rate : 60);
  mbs::Options o = make_mbs_options(settings, k, options.threads, callbacks.progress);
  mbs::choose_steps(settings, o);
  o.step_share = options.step_share;
  record_into(recorder, o);
  o.equilibrium = options.equilibrium;
  o.rest_speed = options.rest_speed.value_or(k.rest_speed);
  o.tells_lost_contact = true;
  o.samplings = make_samplings(model, r);
  Keeper keeper(options, callbacks, recorder);
  keeper.join(model, "", o);
  mbs::Summary summary = engine->run(model, o);
  if (const auto odd = engines::find_impossible_inertias(model); !model.is_planar && !odd.empty())
    summary.notes.push_back(fmt::format("{}: {}, which no body has{}", odd[0].place, odd[0].what,
                                        odd.size() > 1 ? fmt::format("; {} more like it", odd.size() - 1) : ""));
  for (const mbs::Output& out : model.outputs)
    if (summary.step > 0 && out.rate * summary.step > 1.000001)
      summary.notes.push_back(fmt::format("output \"{}\" asks for {:g} samples a second, the steps give {:.4g}",
                                          out.name, out.rate, 1 / summary.step));
  end_record(summary, "", recorder, r);
  add_checks(model, summary, options.equilibrium, k, r);
  if (callbacks.on_summary) callbacks.on_summary(summary);
  return r;
}

}  // namespace topple::collapse
