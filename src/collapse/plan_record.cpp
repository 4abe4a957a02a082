#include "collapse/plan_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/hash.h"
#include "base/unit.h"
#include "collapse/findings.h"
#include "collapse/outcome.h"
#include "collapse/vibration.h"
#include "record/provenance.h"
#include "record/told.h"

namespace topple::collapse {

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
      record.ending_text = fmt::format("No equilibrium was found under dead load{}: {}.", when, s.message);
      break;
    case Ending::Diverged:
      record.ending = "failed";
      record.ending_text = fmt::format("The computation failed at {:.3f} s: {}.", s.time, s.message);
      break;
  }
}

namespace {

/// Numbers in their order, alike ones together: "4.2 m, 6 x 3.6 m".
std::string join_runs(const std::vector<double>& values, const char* unit) {
  std::string out;
  for (size_t i = 0; i < values.size();) {
    size_t end = i;
    while (end < values.size() && values[end] == values[i]) ++end;
    out +=
        fmt::format("{}{}{:.4g} {}", i ? ", " : "", end - i > 1 ? fmt::format("{} x ", end - i) : "", values[i], unit);
    i = end;
  }
  return out;
}

/// Members of which the same is to be said, under what that is, in one row.
template <class Key>
void note_alike(std::vector<std::pair<Key, std::string>>& rows, const Key& key, const std::string& name) {
  const auto alike = std::ranges::find(rows, key, &std::pair<Key, std::string>::first);
  if (alike == rows.end())
    rows.emplace_back(key, name);
  else
    alike->second += ", " + name;
}

/// What was done before the first charge; members to which the same was done stand together.
void fill_preparation(const product::Plan& plan, record::Record& r) {
  std::vector<std::pair<std::string, std::string>> rows;  // what, names
  const auto note = [&rows](const std::string& what, const std::string& name) { note_alike(rows, what, name); };
  for (const product::Member& m : plan.members) {
    if (m.removed) note("taken out.", m.name);
    for (const product::Weakening& w : m.weakenings) {
      const double bars = 100 * w.cut_bars, concrete = 100 * w.cut_concrete;
      note(
          m.kind == product::MemberKind::Shaft
              ? fmt::format(
                    "{:.3g} % of the bars and {:.3g} % of the concrete cut over {:.2f} m around {:.2f} m, {:.4g} "
                    "deg at azimuth {:.4g} deg.",
                    bars, concrete, w.height, w.at, w.opening / unit::deg, w.azimuth / unit::deg)
              : fmt::format("{:.3g} % of the bars and {:.3g} % of the concrete cut at {:.2f} m.", bars, concrete, w.at),
          m.name);
    }
  }
  for (const auto& [what, names] : rows)
    r.plan_values.push_back({"Blasting", "Before the first charge", fmt::format("{}: {}", names, what)});
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
  if (!plan.row_names.empty()) add("Building", "Rows", joined(plan.row_names, plan.row_offsets));
  if (!plan.frame_names.empty()) add("Building", "Frames", joined(plan.frame_names, plan.frame_offsets));
  if (!plan.storey_heights.empty()) {
    add("Building", "Storeys", std::to_string(plan.storey_heights.size()));
    add("Building", "Heights of storeys", join_runs(plan.storey_heights, "m"));
    std::vector<double> loads;
    for (const double load : plan.storey_loads) loads.push_back(1e-3 * unit::gravity * load);
    if (std::ranges::any_of(plan.storey_loads, [](double load) { return load > 0; }))
      add("Building", "Loads on floors", join_runs(loads, "kN/m2"));
  }
  for (const product::Member& m : plan.members) {
    if (m.shaft < 0) continue;
    const product::Shaft& s = plan.shafts[static_cast<size_t>(m.shaft)];
    add("Building", "Shaft " + m.name,
        fmt::format(
            "{:.2f} m high, outer diameter {:.2f} m at the foot and {:.2f} m at the top, shell {:.3g} and {:.3g} cm",
            m.end.z - m.start.z, s.diameter_foot, s.diameter_top, s.thickness_foot / unit::cm,
            s.thickness_top / unit::cm));
  }
  if (!plan.storey_heights.empty()) {
    double height = plan.level(static_cast<int>(plan.storey_heights.size()) - 1);
    for (const product::Member& m : plan.members)
      if (m.shaft >= 0) height = std::max(height, m.end.z);
    add("Building", "Height", fmt::format("{:.2f} m", height));
  }
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
  for (const product::Panel& p : plan.panels) {
    const std::string thickness = fmt::format("{:.3g} cm thick, ", p.thickness / unit::cm);
    add("Sections", p.name,
        p.concrete < 0
            ? thickness + fmt::format("masonry of {:.3g} N/mm2", p.strength / unit::MPa)
            : thickness + fmt::format("bars {:.3g} cm2/m at the top and {:.3g} cm2/m at the bottom",
                                      p.as_top / (unit::cm * unit::cm), p.as_bottom / (unit::cm * unit::cm)));
  }
  fill_preparation(plan, r);
  for (const product::Stage& s : plan.stages) {
    // charges that are alike and fire together in one row
    std::vector<std::pair<std::pair<double, std::string>, std::string>> rows;
    for (const product::Charge& c : s.charges) {
      const product::Member& m = plan.members[static_cast<size_t>(c.member)];
      std::string what;
      if (m.kind == product::MemberKind::Shaft)
        what = fmt::format("mouth of {:.4g} deg at azimuth {:.4g} deg, ", c.opening / unit::deg, c.azimuth / unit::deg);
      what += fmt::format("{:.2f} m destroyed around {:.2f} m, {:.3g} % of the bars left.", c.destroyed_length,
                          c.position, 100 * c.residual_bars);
      if (c.residual_concrete > 0)
        what += fmt::format(" Not wholly: {:.3g} % of the concrete stays.", 100 * c.residual_concrete);
      if (c.transition_damage > 0) what += fmt::format(" Damage beside it: {:.3g} %.", 100 * c.transition_damage);
      if (c.scatter > 0) what += fmt::format(" Its time scatters by {:.3g} ms.", c.scatter * 1e3);
      if (c.fails) what += " It fails.";
      const std::pair<double, std::string> key{s.time + c.delay, what};
      note_alike(rows, key, m.name);
    }
    for (const auto& [key, names] : rows)
      add("Blasting", fmt::format("{} at {:g} s", s.name, key.first), names + ": " + key.second);
  }
  for (const product::Cable& c : plan.cables)
    add("Blasting", "Cable " + c.name,
        fmt::format("on {}, pretension {:.0f} kN", plan.members[static_cast<size_t>(c.member)].name,
                    c.pretension / unit::kN));
  add("Site", "Friction and restitution", fmt::format("{:g}, {:g}", plan.ground.friction, plan.ground.restitution));
  if (plan.vibration)
    add("Site", "Attenuation of vibration",
        fmt::format("{:g} mm/s at {:g} MJ and {:g} m, exponents {:g} and {:g}, factor {:g}",
                    plan.vibration->velocity / unit::mm, plan.vibration->energy * 1e-6, plan.vibration->distance,
                    plan.vibration->energy_exponent, plan.vibration->distance_exponent, plan.vibration->factor));
  const product::Criteria& want = plan.criteria;
  if (want.mechanism) add("Limits", "Mechanism", *want.mechanism);
  if (want.azimuth)
    add("Limits", "Direction of fall",
        fmt::format("{} +- {:g} deg", record::tell_azimuth(*want.azimuth, record::count_digits_of_angle(*want.azimuth)),
                    want.azimuth_tolerance.value_or(0) / unit::deg));
  if (want.debris_reach) add("Limits", "Reach of the debris", fmt::format("at most {:.7g} m", *want.debris_reach));
  if (want.stands_between_stages)
    add("Limits", "Between the stages", *want.stands_between_stages ? "it stands" : "it falls");
  for (const product::Neighbour& n : plan.neighbours) {
    if (n.clearance) add("Limits", "Clearance of " + n.name, fmt::format("{:.7g} m", *n.clearance));
    if (n.vibration_limit > 0)
      add("Limits", "Vibration of " + n.name, fmt::format("{:.7g} mm/s", n.vibration_limit / unit::mm));
    if (n.building_class != product::BuildingClass::Unknown)
      add("Limits", "Class of " + n.name, describe_vibration_limit(n.building_class));
  }
  const double planned = std::atan2(map.fall_direction.y, map.fall_direction.x);
  add("Planned fall", "Azimuth",
      map.is_direction_planned ? record::tell_azimuth(planned, record::count_digits_of_angle(planned)) : "not given");
}

void fill_building(const product::Plan& plan, const mbs::Model& model, const ModelMap& map, record::Record& r) {
  r.building_outline = calc_building_outline(model, map);
  r.fall_azimuth = std::atan2(map.fall_direction.y, map.fall_direction.x);
  for (const product::Neighbour& n : plan.neighbours) r.neighbours.push_back({n.name, n.footprint, n.is_utility});
}

}  // namespace

mbs::Options make_mbs_options(const mbs::RunSettings& settings, const Knowledge& k, int threads,
                              const Progress& progress) {
  mbs::Options o;
  o.duration = settings.duration;
  o.step = settings.step;
  o.frame_interval = settings.frame_interval;
  o.rest_speed = k.rest_speed;
  o.rest_time = k.rest_time;
  o.threads = threads;
  o.progress = progress;
  return o;
}

bool has_screening(const product::Plan& plan) { return plan.vibration && !plan.neighbours.empty(); }

void record_into(Recorder& recorder, mbs::Options& o) {
  o.on_frame = [&recorder](const mbs::View& v) { recorder.add_frame(v); };
  o.on_happening = [&recorder](const mbs::Happening& h) { recorder.add_happening(h); };
}

void fill_provenance(const RunOptions& options, const std::string& engine, record::Record& r) {
  r.provenance.program_version = options.program_version;
  r.provenance.engine = engine;
  r.provenance.machine = record::machine_words();
  r.provenance.created = record::now_utc();
  r.provenance.threads = options.threads;
}

void fill_from_plan(const product::Plan& plan, const mbs::Model& model, const ModelMap& map, record::Record& r) {
  r.counts = count(model);
  r.provenance.title = plan.title;
  r.provenance.plan_path = plan.path;
  r.provenance.plan_text = plan.text;
  r.provenance.plan_sha256 = calc_sha256(plan.text);
  r.provenance.seed = plan.analysis.seed;
  fill_plan_values(plan, map, r);
  fill_building(plan, model, map, r);
}

void tell_failing_charges(const product::Plan& plan, const ModelMap& map, Recorder& recorder, double after) {
  for (const Firing& f : map.schedule) {
    if (!f.fails || f.time <= after) continue;
    const product::Charge& c = plan.stages[static_cast<size_t>(f.stage)].charges[static_cast<size_t>(f.charge)];
    const std::string& name = plan.members[static_cast<size_t>(c.member)].name;
    recorder.add_coming_event({f.time, "charge", name, fmt::format("the charge of {} does not fire", name)});
  }
}

void end_record(const mbs::Summary& summary, const char* when, Recorder& recorder, record::Record& r) {
  r.provenance.step = summary.step;
  r.provenance.wall_time = summary.wall_time;
  fill_ending(summary, when, r);
  const bool failed = r.ending == "failed";
  recorder.add_event({summary.time, failed ? "failure" : "rest", r.ending, r.ending_text});
  recorder.finish();
}

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

}  // namespace topple::collapse
