#include "study/plan_model.h"

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>

#include "base/unit.h"
#include "collapse/findings.h"
#include "collapse/vibration.h"

namespace topple::study {
namespace {

using json = nlohmann::ordered_json;

collapse::Knowledge read_rules(const std::string& text) {
  return text.empty() ? collapse::default_knowledge() : collapse::read_knowledge(text, "rules");
}

Answer to_answer(uncertainty::Result&& r, const PlanMapping& m) {
  Answer a;
  switch (r.state) {
    case uncertainty::Result::State::NotRun:
      a.kind = Answer::Kind::Cancelled;
      break;
    case uncertainty::Result::State::Failed:
      a.kind = Answer::Kind::Failed;
      a.text = std::move(r.text);
      break;
    case uncertainty::Result::State::Done:
      a.kind = Answer::Kind::Done;
      for (std::size_t i = 0; i < r.values.size(); ++i) a.outputs.emplace_back(m.outputs()[i].name, r.values[i]);
      a.outcome = plan_outcomes()[static_cast<std::size_t>(r.outcome)];
      a.trajectory = std::move(r.trajectory);
      break;
  }
  return a;
}

/// What make_plan_problem put into a definition.
struct Definition {
  product::Plan plan;
  PlanMappingOptions options;
  std::string rules;
};

Definition read_definition(const std::string& text) {
  const json d = json::parse(text);
  const json& identity = d.at("identity");
  Definition out;
  out.options.after = identity.at("after");
  out.options.tilt_times = identity.at("tilt_times").get<std::vector<double>>();
  out.options.tilt_interval = identity.at("tilt_interval");
  out.options.frame_rate = identity.at("frame_rate");
  out.options.directions = identity.at("directions");
  out.options.condensed = identity.contains("condensed");
  out.options.vibration = identity.value("vibration", false);
  out.options.sideways = !identity.contains("in_plane");
  out.options.findings = identity.contains("findings");
  out.options.threads = 1;
  out.rules = identity.at("rules").get<std::string>();
  std::vector<Diagnostic> warnings;
  out.plan =
      product::read_plan(identity.at("plan").get<std::string>(), d.at("settings").value("path", "plan"), warnings);
  return out;
}

/// Seen from above, as the plan has it: around columns, slabs, walls and the feet of shafts.
Site make_site(const product::Plan& plan) {
  Site site;
  double low[2] = {1e30, 1e30}, high[2] = {-1e30, -1e30};
  for (const product::Member& m : plan.members) {
    const bool is_column = m.kind == product::MemberKind::Column && m.section >= 0;
    const product::Section* s = is_column ? &plan.sections[static_cast<std::size_t>(m.section)] : nullptr;
    const product::Shaft* shaft = m.shaft >= 0 ? &plan.shafts[static_cast<std::size_t>(m.shaft)] : nullptr;
    const double round = shaft ? shaft->diameter_foot / 2 : 0;
    const double half[2] = {s ? s->width / 2 : round, s ? s->height / 2 : round};
    for (const Vec3& p : {m.start, m.end}) {
      const double at[2] = {p.x, p.y};
      for (int i = 0; i < 2; ++i) {
        low[i] = std::min(low[i], at[i] - half[i]);
        high[i] = std::max(high[i], at[i] + half[i]);
      }
    }
  }
  if (low[0] <= high[0]) site.footprint = {{low[0], low[1]}, {high[0], low[1]}, {high[0], high[1]}, {low[0], high[1]}};
  for (const product::Neighbour& n : plan.neighbours) site.neighbours.push_back({n.name, n.footprint, n.is_utility});
  return site;
}

/// Fills in what a plan asks of its debris: limits, and what a study does not compare with its runs.
void list_debris_limits(const product::Plan& plan, const PlanMappingOptions& options, Problem& p) {
  const bool is_judged = has_clearances(options);
  if (const auto most = plan.criteria.debris_reach; most && is_judged)
    p.limits.push_back({"debris_reach", "", *most, *most, "of the plan", Limit::Kind::Reach, "way_left"});
  else if (most)
    p.not_judged.emplace_back("debris_reach");
  for (std::size_t i = 0; i < plan.neighbours.size(); ++i) {
    const product::Neighbour& n = plan.neighbours[i];
    // a clearance of 0 is broken by what lands on the neighbour, not by what is above it; the number is 0 for both
    if (n.clearance && *n.clearance > 0 && is_judged)
      p.limits.push_back({name_of_clearance(plan, i), n.name, *n.clearance, *n.clearance, "of the plan",
                          Limit::Kind::Clearance, "way_left"});
    else if (n.clearance)
      p.not_judged.push_back("clearance: \"" + n.name + "\"");
  }
}

/// Adds limits of ground vibration at the neighbours' foundations, over the frequencies in which the ground answers.
void list_vibration_limits(const product::Plan& plan, std::vector<Limit>& out) {
  for (std::size_t i = 0; i < plan.neighbours.size(); ++i) {
    const product::Neighbour& n = plan.neighbours[i];
    Limit limit{name_of_screening(plan, i), n.name, 0, 0, "", Limit::Kind::Screening};
    if (n.vibration_limit > 0) {
      limit.least = limit.most = n.vibration_limit;
      limit.source = "of the plan";
    } else if (n.building_class != product::BuildingClass::Unknown) {
      limit.least = collapse::calc_vibration_limit(n.building_class, plan.vibration->low_frequency);
      limit.most = collapse::calc_vibration_limit(n.building_class, plan.vibration->high_frequency);
      limit.source = collapse::kVibrationSource;
    }
    if (limit.least > 0) out.push_back(std::move(limit));
  }
}

}  // namespace

Problem make_plan_problem(const product::Plan& plan, const PlanMappingOptions& given, const std::string& rules) {
  PlanMappingOptions options = given;
  if (options.after == 0) options.after = find_after(plan);
  const PlanMapping mapping(plan, read_rules(rules), options);
  Problem p;
  p.title = plan.title;
  for (const PlanQuantity& q : mapping.inputs()) p.inputs.push_back({q.name, q.symbol, q.unit});
  for (const product::DerivedValue& d : plan.fuzzy.derived) p.derived.push_back({d.path, d.symbol, d.unit});
  for (const PlanQuantity& q : mapping.outputs()) p.outputs.push_back({q.name, q.symbol, q.unit, q.is_searched});
  p.outcomes = plan_outcomes();
  p.curves.push_back({"tilt", "deg", unit::deg, "time after the last stage", "s", mapping.trajectory_times(), false});
  p.curves.push_back({"outline", "m", 1, "direction", "deg", {}, true});
  for (int k = 0; k < options.directions; ++k) p.curves.back().at.push_back(360.0 * k / options.directions);
  p.asked = plan.criteria.mechanism.value_or("");
  p.site = make_site(plan);
  p.not_modelled = collapse::not_modelled(plan);
  list_debris_limits(plan, options, p);
  p.horizon = {"touchdown", "stands", options.after};
  p.space = mapping.space();
  if (!p.derived.empty())
    p.calc_derived = [fuzzy = plan.fuzzy](const Point& x) { return product::calc_derived(fuzzy, x); };
  p.kind = "plan";
  p.identity = json{{"plan", plan.text},
                    {"rules", rules},
                    {"after", options.after},
                    {"tilt_times", options.tilt_times},
                    {"tilt_interval", options.tilt_interval},
                    {"frame_rate", options.frame_rate},
                    {"directions", options.directions}}
                   .dump();
  if (!has_sides(options)) {
    json identity = json::parse(p.identity);
    identity["in_plane"] = true;
    p.identity = identity.dump();
  }
  p.settings = json{{"path", plan.path}}.dump();
  if (options.findings) {
    json identity = json::parse(p.identity);
    identity["findings"] = true;
    p.identity = identity.dump();
  }
  if (has_screening(plan, options)) {
    json identity = json::parse(p.identity);
    identity["vibration"] = true;
    p.identity = identity.dump();
    list_vibration_limits(plan, p.limits);
  }
  if (options.condensed) {
    PlanMappingOptions whole = options;
    whole.condensed = whole.vibration = whole.sideways = false;
    p.whole = std::make_shared<const Problem>(make_plan_problem(plan, whole, rules));
    p.confirm = default_confirm;
    p.not_modelled.push_back("Frames that are alike move as one, in their plane: nothing falls sideways.");
    json identity = json::parse(p.identity);
    identity["condensed"] = true;
    set_plan_identity(p, identity.dump());
  }
  p.levels = plan.fuzzy.search.levels;
  p.limit = plan.fuzzy.search.limit;
  p.seed = plan.fuzzy.search.seed;
  return p;
}

void set_plan_identity(Problem& p, const std::string& identity) {
  p.identity = identity;
  if (!p.whole) return;
  json whole = json::parse(identity);
  whole.erase("condensed");
  Problem other = *p.whole;
  other.identity = whole.dump();
  p.whole = std::make_shared<const Problem>(std::move(other));
}

Problem read_plan_problem(const std::string& definition) {
  const Definition d = read_definition(definition);
  return make_plan_problem(d.plan, d.options, d.rules);
}

Runner make_plan_runner(const std::string& definition) {
  const Definition d = read_definition(definition);
  const auto mapping = std::make_shared<const PlanMapping>(d.plan, read_rules(d.rules), d.options);
  return [mapping](std::span<const Point> points, const std::function<void(std::size_t, Answer)>& give,
                   const std::atomic<bool>& cancel) {
    const std::size_t n = mapping->inputs().size();
    for (std::size_t i = 0; i < points.size() && !cancel.load(std::memory_order_relaxed); ++i) {
      const auto begin = std::chrono::steady_clock::now();
      const Point point(points[i].begin(), points[i].begin() + static_cast<std::ptrdiff_t>(n));
      uncertainty::Result r;
      mapping->evaluate({&point, 1}, {&r, 1}, &cancel);
      Answer a = to_answer(std::move(r), *mapping);
      a.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      give(i, std::move(a));
    }
  };
}

}  // namespace topple::study
