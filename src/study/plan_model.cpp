#include "study/plan_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/union_outline.h"
#include "base/unit.h"
#include "collapse/findings.h"
#include "collapse/vibration.h"
#include "product/plan_sampler.h"
#include "study/randomness.h"

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
  out.options.class_open = identity.contains(kClassOpen);
  out.options.threads = 1;
  out.rules = identity.at("rules").get<std::string>();
  std::vector<Diagnostic> warnings;
  out.plan =
      product::read_plan(identity.at("plan").get<std::string>(), d.at("settings").value("path", "plan"), warnings);
  return out;
}

/// Of what stands before the first charge, seen from above.
std::vector<std::vector<std::array<double, 2>>> calc_outlines(const product::Plan& plan) {
  std::vector<Rectangle> rectangles;
  std::vector<std::vector<std::array<double, 2>>> rings;
  for (const product::Member& m : plan.members) {
    if (m.removed) continue;
    if (m.shaft >= 0) {
      constexpr int corners = 48;
      auto& ring = rings.emplace_back();
      const double radius = plan.shafts[static_cast<std::size_t>(m.shaft)].diameter_foot / 2;
      for (int i = 0; i < corners; ++i) {
        const double a = 2 * M_PI * i / corners;
        ring.push_back({m.start.x + radius * std::cos(a), m.start.y + radius * std::sin(a)});
      }
      continue;
    }
    // half of its width, to the sides on which it has one
    double half[2] = {0, 0};
    const bool is_along_x = std::abs(m.end.x - m.start.x) > std::abs(m.end.y - m.start.y);
    if (m.section >= 0) {
      const product::Section& s = plan.sections[static_cast<std::size_t>(m.section)];
      if (m.kind == product::MemberKind::Column)
        half[0] = s.width / 2, half[1] = s.height / 2;
      else
        half[is_along_x ? 1 : 0] = s.width / 2;
    } else if (m.kind == product::MemberKind::Wall && m.panel >= 0) {
      half[is_along_x ? 1 : 0] = plan.panels[static_cast<std::size_t>(m.panel)].thickness / 2;
    }
    rectangles.push_back({{std::min(m.start.x, m.end.x) - half[0], std::min(m.start.y, m.end.y) - half[1]},
                          {std::max(m.start.x, m.end.x) + half[0], std::max(m.start.y, m.end.y) + half[1]}});
  }
  std::vector<std::vector<std::array<double, 2>>> outlines = calc_union_outlines(rectangles);
  outlines.insert(outlines.end(), rings.begin(), rings.end());
  return outlines;
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
  site.outlines = calc_outlines(plan);
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

/// The planned direction of fall, with the rules' tolerance [rad] where the plan has none.
void list_direction_limit(const product::Plan& plan, const PlanMappingOptions& options, double usual, Problem& p) {
  if (!plan.criteria.azimuth) return;
  const double most = plan.criteria.azimuth_tolerance.value_or(usual);
  if (has_clearances(options))
    p.limits.push_back({"azimuth_deviation", "", most, most, "of the plan", Limit::Kind::Direction});
  else
    p.not_judged.emplace_back("azimuth");
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
    limit.above = limit.most * plan.vibration->factor * plan.vibration->factor;
    if (limit.least > 0) out.push_back(std::move(limit));
  }
}

/// Least and largest value of each parameter of a random value.
std::array<std::array<double, 2>, 2> find_ends(const product::FuzzyPlan& fuzzy, const product::RandomValue& v) {
  std::array<std::array<double, 2>, 2> ends{};
  for (std::size_t i = 0; i < 2; ++i) {
    ends[i] = {v.parameters[i].value, v.parameters[i].value};
    for (std::size_t k = 0; k < fuzzy.fuzzy_count(); ++k)
      if (fuzzy.places[k].empty() && fuzzy.inputs[k].name == v.parameters[i].name)
        ends[i] = {fuzzy.inputs[k].corners.front().first, fuzzy.inputs[k].corners.back().first};
  }
  return ends;
}

/// Random values get the ends that runs give them, so that a mapping knows where they differ.
product::Plan spread_random(product::Plan plan) {
  product::FuzzyPlan& fuzzy = plan.fuzzy;
  for (std::size_t k = 0; k < fuzzy.random.size(); ++k) {
    auto& corners = fuzzy.inputs[fuzzy.fuzzy_count() + k].corners;
    const auto [low, high] =
        find_extremes(*fuzzy.random[k].distribution, find_ends(fuzzy, fuzzy.random[k]), fuzzy.randomness.runs);
    const double middle = std::clamp(corners[1].first, low, high);
    corners = {{low, 0}, {middle, 1}, {high, 0}};
  }
  return plan;
}

/// The least and the largest value of each random one must give a plan; else nearly every point would fail.
void try_random(const product::Plan& plan) {
  const product::FuzzyPlan& fuzzy = plan.fuzzy;
  if (fuzzy.random.empty()) return;
  const product::PlanSampler sampler = product::make_sampler(plan);
  std::vector<Diagnostic> faults;
  for (std::size_t i = fuzzy.fuzzy_count(); i < fuzzy.inputs.size(); ++i) {
    const product::FuzzyValue& v = fuzzy.inputs[i];
    for (const double x : {v.corners.front().first, v.corners.back().first}) {
      std::vector<double> point = product::calc_centre(fuzzy);
      point[i] = x;
      try {
        (void)product::make_sample(sampler, point);
      } catch (const InputError& e) {
        faults.push_back({Severity::Error, "E205", v.where, 1,
                          fmt::format("fuzzy: random: {} comes to {} among {} runs, which is not possible: {}", v.path,
                                      product::text_of(v, x), fuzzy.randomness.runs, e.first_error().message),
                          "narrow the distribution, or take one that has no such values (lognormal, uniform)"});
        break;
      }
    }
  }
  if (!faults.empty()) throw InputError(faults);
}

/// Makes a study of statistics of one whose inputs are all alike.
void make_random(Problem& p, const product::Plan& plan) {
  const product::FuzzyPlan& fuzzy = plan.fuzzy;
  const std::size_t n = fuzzy.fuzzy_count();
  product::Complaints complaints(plan.path);
  Randomness r;
  r.of = "plan";
  r.runs = fuzzy.randomness.runs, r.seed = fuzzy.randomness.seed, r.most_failed = fuzzy.randomness.most_failed;
  for (std::size_t k = 0; k < fuzzy.random.size(); ++k) {
    RandomInput x{p.inputs[n + k], fuzzy.random[k].distribution, {}};
    for (std::size_t i = 0; i < 2; ++i) {
      const product::RandomParameter& given = fuzzy.random[k].parameters[i];
      x.parameters[i].value = given.value;
      for (std::size_t j = 0; j < n; ++j)
        if (fuzzy.places[j].empty() && fuzzy.inputs[j].name == given.name) x.parameters[i].place = static_cast<int>(j);
    }
    r.inputs.push_back(std::move(x));
  }
  r.statistics = read_statistics(fuzzy.randomness, p, complaints);
  if (complaints.error_count() > 0) throw InputError(complaints.all());
  // constraints and what is shown beside the inputs use no random value: any will do
  const std::vector<double> centre = product::calc_centre(fuzzy);
  const auto complete =
      [middle = std::vector<double>(centre.begin() + static_cast<std::ptrdiff_t>(n), centre.end())](const Point& x) {
        Point all = x;
        all.insert(all.end(), middle.begin(), middle.end());
        return all;
      };
  p.inputs.resize(n);
  p.space.inputs.resize(n);
  for (auto& g : p.space.constraints) g = [complete, g](const Point& x) { return g(complete(x)); };
  if (p.space.joint) p.space.joint = [complete, joint = p.space.joint](const Point& x) { return joint(complete(x)); };
  std::vector<Quantity> derived;
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < p.derived.size(); ++i)
    if (!product::follows_from_random(fuzzy, i)) derived.push_back(p.derived[i]), kept.push_back(i);
  p.derived = derived;
  if (kept.empty()) p.calc_derived = nullptr;
  if (p.calc_derived)
    p.calc_derived = [complete, kept, calc = p.calc_derived](const Point& x) {
      const std::vector<double> all = calc(complete(x));
      std::vector<double> values;
      for (const std::size_t i : kept) values.push_back(all[i]);
      return values;
    };
  // what is told of single runs
  p.curves.clear();
  p.site = {};
  if (p.horizon) p.horizon->output.clear(), p.horizon->open.clear();  // those of a point's inner runs
  if (!p.asked.empty()) p.not_judged.emplace_back("mechanism");
  if (plan.criteria.stands_between_stages == true) p.not_judged.emplace_back("stands_between_stages");
  p.asked.clear();
  for (const Limit& l : p.limits) p.not_judged.push_back(l.output);
  p.limits.clear();
  set_random(p, std::move(r));
  set_plan_identity(p, p.identity);
}

}  // namespace

Problem make_plan_problem(const product::Plan& asked, const PlanMappingOptions& given, const std::string& rules) {
  const product::Plan plan = spread_random(asked);
  try_random(plan);
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
  if (!plan.stages.empty())
    p.horizon = {"touchdown", "stands", options.after, options.class_open ? kClassOpen : "way_left"};
  p.space = mapping.space();
  if (!p.derived.empty())
    p.calc_derived = [fuzzy = plan.fuzzy](const Point& x) { return product::calc_derived(fuzzy, x); };
  p.kind = "plan";
  json identity = {{"plan", plan.text},
                   {"rules", rules},
                   {"after", options.after},
                   {"tilt_times", options.tilt_times},
                   {"tilt_interval", options.tilt_interval},
                   {"frame_rate", options.frame_rate},
                   {"directions", options.directions}};
  if (!has_sides(options)) identity["in_plane"] = true;
  if (options.findings) identity["findings"] = true;
  if (options.class_open) identity[kClassOpen] = true;
  if (has_screening(plan, options)) identity["vibration"] = true;
  if (options.condensed) identity["condensed"] = true;
  p.settings = json{{"path", plan.path}}.dump();
  if (has_screening(plan, options)) {
    list_vibration_limits(plan, p.limits);
  } else if (plan.vibration) {
    for (const product::Neighbour& n : plan.neighbours)
      if (n.vibration_limit > 0 || n.building_class != product::BuildingClass::Unknown)
        p.not_judged.push_back("vibration: \"" + n.name + "\"");
  }
  // that the building stands between stages is the outcome "early", that it shall not is for a run to judge
  if (plan.criteria.stands_between_stages == false) p.not_judged.emplace_back("stands_between_stages");
  list_direction_limit(plan, options, read_rules(rules).mechanism_direction_tolerance, p);
  if (options.condensed) {
    PlanMappingOptions whole = options;
    whole.condensed = whole.vibration = whole.sideways = false;
    p.whole = std::make_shared<const Problem>(make_plan_problem(asked, whole, rules));
    p.confirm = default_confirm;
    p.not_modelled.push_back("Frames that are alike move as one, in their plane: nothing falls sideways.");
  }
  set_plan_identity(p, identity.dump());
  if (!plan.fuzzy.random.empty()) make_random(p, plan);
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
  const auto mapping = std::make_shared<const PlanMapping>(spread_random(d.plan), read_rules(d.rules), d.options);
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
