#include "collapse/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/hash.h"
#include "base/unit.h"
#include "collapse/findings.h"
#include "collapse/outcome.h"
#include "collapse/recorder.h"
#include "engines/engine.h"
#include "mbs/quantity.h"
#include "record/provenance.h"

namespace topple::collapse {

namespace {

void fill_ending(const mbs::Summary& s, const char* when, record::Record& record) {
  using Ending = mbs::Summary::Ending;
  switch (s.ending) {
    case Ending::AtRest:
      record.ending = "at_rest";
      record.ending_text = fmt::format("Everything came to rest at {:.2f} s.", s.time);
      break;
    case Ending::TimeLimit:
      record.ending = "time_limit";
      record.ending_text = fmt::format("Stopped by the time limit of {:.2f} s.", s.time);
      break;
    case Ending::Cancelled:
      record.ending = "cancelled";
      record.ending_text = fmt::format("Cancelled at {:.2f} s.", s.time);
      break;
    case Ending::NoEquilibrium:
      record.ending = "failed";
      record.ending_text = fmt::format("There is no equilibrium under dead load{}: {}.", when, s.message);
      break;
    case Ending::Diverged:
      record.ending = "failed";
      record.ending_text = fmt::format("The computation failed at {:.3f} s: {}.", s.time, s.message);
      break;
  }
}

void fill_plan_values(const product::Plan& plan, const ModelMap& map, record::Record& r) {
  const auto add = [&r](const char* group, const std::string& key, const std::string& value) {
    r.plan_values.push_back({group, key, value});
  };
  const auto joined = [](const std::vector<std::string>& names, const std::vector<double>& at) {
    std::string out;
    for (size_t i = 0; i < names.size(); ++i) out += fmt::format("{}{} at {:g} m", i ? ", " : "", names[i], at[i]);
    return out;
  };
  add("Building", "Rows", joined(plan.row_names, plan.row_offsets));
  add("Building", "Frames", joined(plan.frame_names, plan.frame_offsets));
  add("Building", "Storeys", std::to_string(plan.storey_heights.size()));
  if (!plan.storey_heights.empty())
    add("Building", "Height", fmt::format("{:.2f} m", plan.level(static_cast<int>(plan.storey_heights.size()) - 1)));
  add("Building", "Mass", fmt::format("{:.0f} t", calc_standing_mass(plan) / unit::t));
  for (const product::Concrete& c : plan.concretes)
    add("Materials", "Concrete " + c.name,
        fmt::format("fc {:.3g} N/mm2, fct {:.3g} N/mm2, Ec {:.5g} N/mm2", c.fc / unit::MPa, c.fct / unit::MPa,
                    c.Ec / unit::MPa));
  for (const product::Steel& s : plan.steels)
    add("Materials", "Steel " + s.name,
        fmt::format("fy {:.4g} N/mm2, fu {:.4g} N/mm2, rupture at {:.3g} %", s.fy / unit::MPa, s.fu / unit::MPa,
                    100 * s.eps_u));
  for (const product::Section& s : plan.sections)
    add("Sections", s.name,
        fmt::format("{:.3g} x {:.3g} cm, bars {:.3g} cm2, ties {:.3g} mm every {:.3g} cm", s.width / unit::cm,
                    s.height / unit::cm, s.steel_area() / unit::cm2, s.tie_diameter / unit::mm,
                    s.tie_spacing / unit::cm));
  for (const product::Stage& s : plan.stages) {
    std::string members;
    for (const product::Charge& c : s.charges)
      members += (members.empty() ? "" : ", ") + plan.members[static_cast<size_t>(c.member)].name +
                 (c.fails ? " (fails)" : "");
    add("Blasting", fmt::format("{} at {:g} s", s.name, s.time), members);
  }
  for (const product::Cable& c : plan.cables)
    add("Blasting", "Cable " + c.name,
        fmt::format("on {}, pretension {:.0f} kN", plan.members[static_cast<size_t>(c.member)].name,
                    c.pretension / unit::kN));
  add("Site", "Friction and restitution", fmt::format("{:g}, {:g}", plan.ground.friction, plan.ground.restitution));
  add("Planned fall", "Azimuth",
      map.is_direction_planned
          ? fmt::format("{:.0f} deg", std::atan2(map.fall_direction.y, map.fall_direction.x) / unit::deg)
          : "not given");
}

void fill_building(const product::Plan& plan, const mbs::Model& model, const ModelMap& map, record::Record& r) {
  r.building_outline = calc_building_outline(model, map);
  for (const product::Neighbour& n : plan.neighbours) r.neighbours.push_back({n.name, n.footprint, n.is_utility});
}

mbs::Options make_options(const RunOptions& in, double duration, double step, double frame_rate, const Knowledge& k,
                          Recorder& recorder, const Progress& progress) {
  mbs::Options o;
  o.duration = in.duration > 0 ? in.duration : duration;
  o.step = in.step > 0 ? in.step : step;
  const double rate = in.frame_rate > 0 ? in.frame_rate : frame_rate;
  o.frame_interval = 1 / (rate > 0 ? rate : 60);
  o.rest_speed = k.rest_speed;
  o.rest_time = k.rest_time;
  o.threads = in.threads;
  o.on_frame = [&recorder](const mbs::View& v) { recorder.add_frame(v); };
  o.on_happening = [&recorder](const mbs::Happening& h) { recorder.add_happening(h); };
  o.progress = progress;
  return o;
}

void fill_provenance(const RunOptions& options, const std::string& engine, record::Record& r) {
  r.provenance.program_version = options.program_version;
  r.provenance.engine = engine;
  r.provenance.machine = record::machine_words();
  r.provenance.created = record::now_utc();
  r.provenance.threads = options.threads;
}

/// The name of the item, or its place where it has none.
std::string item_of(const mbs::Model& m, const mbs::Quantity& q) {
  const std::string item = mbs::traits_of(q.kind).item;
  const size_t i = static_cast<size_t>(q.index);
  const std::string& name = item == "body"      ? m.bodies[i].name
                            : item == "joint"   ? m.joints[i].name
                            : item == "element" ? m.elements[i].name
                            : item == "bushing" ? m.bushings[i].name
                            : item == "spring"  ? m.springs[i].name
                            : item == "cable"   ? m.cables[i].name
                                                : m.rotational_springs[i].name;
  return fmt::format("{} {}", item, name.empty() ? fmt::format("number {}", i) : name);
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
    r.findings.push_back({id, id.rfind("note.", 0) == 0 ? "Notes" : "Verification", title, text, value, unit, status});
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
        fmt::format("The largest error is {:.1e} of the released potential energy.", s.energy_error), s.energy_error,
        "1", s.energy_error <= k.verification_energy_error ? Status::Good : Status::Warning);
    add("verification.step", "Time step",
        fmt::format("{:.3g} ms in {} steps; the fastest mode has {:.0f} rad/s.", s.step * 1e3, s.steps,
                    s.highest_frequency),
        s.step, "s", Status::Info);
    if (!model.joints.empty())
      add("verification.joints", "Joints", fmt::format("They drift by at most {:.1e} m or rad.", s.joint_drift),
          s.joint_drift, "1", s.joint_drift <= 1e-8 ? Status::Good : Status::Warning);
  }
  for (size_t i = 0; i < s.notes.size(); ++i)
    add(fmt::format("note.{}", i + 1), "Note", s.notes[i], std::numeric_limits<double>::quiet_NaN(), "", Status::Info);
}

/// `when` the equilibrium is that of the start.
void finish(const mbs::Summary& summary, const char* when, Recorder& recorder, record::Record& r) {
  r.provenance.step = summary.step;
  r.provenance.wall_time = summary.wall_time;
  fill_ending(summary, when, r);
  const bool failed = r.ending == "failed";
  recorder.add_event({summary.time, failed ? "failure" : "rest", r.ending, r.ending_text});
  recorder.finish();
}

}  // namespace

record::Counts count(const mbs::Model& model) {
  record::Counts c;
  c.bodies = static_cast<int>(model.bodies.size());
  for (const mbs::Joint& j : model.joints) {
    c.revolute_joints += j.kind == mbs::Joint::Kind::Revolute;
    c.rigid_joints += j.kind == mbs::Joint::Kind::Fixed;
  }
  c.force_elements = static_cast<int>(model.elements.size() + model.rotational_elements.size() + model.springs.size() +
                                      model.rotational_springs.size() + model.bushings.size());
  c.cables = static_cast<int>(model.cables.size());
  for (const mbs::Body& b : model.bodies)
    if (!b.fixed) c.mass += b.mass;
  return c;
}

record::Record run_plan(const product::Plan& plan, const Knowledge& k, const RunOptions& options,
                        const RunCallbacks& callbacks) {
  const std::unique_ptr<engines::Engine> engine = engines::make_engine(options.engine);
  return run_plan(
      plan, k, options, callbacks, engine->name(),
      [&engine](const mbs::Model& model, const ModelMap&, const mbs::Options& o) { return engine->run(model, o); });
}

record::Record run_plan(const product::Plan& plan, const Knowledge& k, const RunOptions& options,
                        const RunCallbacks& callbacks, const std::string& engine, const Mover& move) {
  ModelMap map;
  const mbs::Model model = make_model(plan, k, map, options.threads);
  record::Record r;
  r.counts = count(model);
  if (callbacks.on_model) callbacks.on_model(model, map, r.counts);
  r.provenance.title = plan.title;
  r.provenance.plan_path = plan.path;
  r.provenance.plan_text = plan.text;
  r.provenance.plan_sha256 = calc_sha256(plan.text);
  r.provenance.seed = plan.analysis.seed;
  fill_provenance(options, engine, r);
  fill_plan_values(plan, map, r);
  fill_building(plan, model, map, r);

  Recorder recorder(model, map, k, r, callbacks);
  for (const Firing& f : map.schedule)
    if (f.fails) {
      const product::Charge& c = plan.stages[static_cast<size_t>(f.stage)].charges[static_cast<size_t>(f.charge)];
      const std::string& name = plan.members[static_cast<size_t>(c.member)].name;
      recorder.add_event({f.time, "charge", name, fmt::format("the charge of {} does not fire", name)});
    }
  const mbs::Summary summary = move(model, map,
                                    make_options(options, plan.analysis.duration, plan.analysis.step,
                                                 plan.analysis.frame_rate, k, recorder, callbacks.progress));
  finish(summary, " before the first charge", recorder, r);
  add_findings(plan, model, map, k, recorder, summary, r);
  if (callbacks.on_summary) callbacks.on_summary(summary);
  return r;
}

mbs::RunSettings settings_of(const product::Plan& plan, const Knowledge& k, const RunOptions& options) {
  mbs::RunSettings s;
  s.duration = options.duration > 0 ? options.duration : plan.analysis.duration;
  s.step = options.step > 0 ? options.step : plan.analysis.step;
  const double rate = options.frame_rate > 0 ? options.frame_rate : plan.analysis.frame_rate;
  s.frame_interval = 1 / (rate > 0 ? rate : 60);
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
  mbs::Options o = make_options(options, 10, 0, 60, k, recorder, callbacks.progress);
  o.equilibrium = options.equilibrium;
  o.rest_speed = options.rest_speed.value_or(k.rest_speed);
  o.samplings = make_samplings(model, r);
  mbs::Summary summary = engine->run(model, o);
  for (const mbs::Output& out : model.outputs)
    if (summary.step > 0 && out.rate * summary.step > 1.000001)
      summary.notes.push_back(fmt::format("output \"{}\" asks for {:g} samples a second, the steps give {:.4g}",
                                          out.name, out.rate, 1 / summary.step));
  finish(summary, "", recorder, r);
  add_checks(model, summary, options.equilibrium, k, r);
  if (callbacks.on_summary) callbacks.on_summary(summary);
  return r;
}

bool violates_criteria(const record::Record& r) {
  return std::any_of(r.findings.begin(), r.findings.end(), [](const record::Finding& f) {
    return f.status == record::Status::Bad && (f.id.rfind("criterion.", 0) == 0 || f.id.rfind("clearance.", 0) == 0);
  });
}

}  // namespace topple::collapse
