#include "product/templates.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/unit.h"
#include "collapse/run.h"
#include "mbs/solver.h"
#include "plans.h"

namespace topple::collapse {
namespace {

constexpr double kPi = 3.14159265358979323846;

product::Plan template_named(const std::string& name) { return read(product::find_template(name).text); }

const record::Finding& finding_of(const record::Record& r, const std::string& id) {
  const auto it = std::find_if(r.findings.begin(), r.findings.end(), [&](const auto& f) { return f.id == id; });
  EXPECT_NE(it, r.findings.end()) << id;
  return *it;
}

class EachTemplate : public testing::TestWithParam<std::string> {};

TEST_P(EachTemplate, RunsToWhatItAsksFor) {
  const record::Record r = run_plan(template_named(GetParam()), default_knowledge(), {}, {});
  EXPECT_NE(r.ending, "failed") << r.ending_text;
  for (const record::Finding& f : r.findings) {
    EXPECT_FALSE(f.heading == "Criteria" && f.status == record::Status::Bad) << f.title << ": " << f.text;
    EXPECT_FALSE(f.heading == "Verification" && f.status == record::Status::Bad) << f.title << ": " << f.text;
  }
}

std::vector<std::string> names_of_templates() {
  std::vector<std::string> names;
  for (const product::Template& t : product::templates()) names.push_back(t.name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(TemplatePhysics, EachTemplate, testing::ValuesIn(names_of_templates()),
                         [](const auto& of) { return of.param; });

TEST(TemplatePhysics, TheChimneyFallsInTheTimeOfARigidBody) {
  const product::Plan plan = template_named("chimney");
  ModelMap map;
  const mbs::Model model = make_model(plan, default_knowledge(), map);
  EXPECT_NEAR(product::calc_mass(plan, plan.members.front()) / unit::t, 649.6, 0.1);
  // fallen from 0.1 rad on over the ends of the mouth: theta'' = m g r sin(theta + lean) / I
  double mass = 0, inertia = 0;
  Vec3 centre;
  for (const mbs::Body& b : model.bodies)
    if (!b.fixed) mass += b.mass, centre += b.mass * b.X_WB.p;
  centre *= 1 / mass;
  const double ahead = 2.3 * std::cos(71 * kPi / 180), above = centre.z - 2.5;
  EXPECT_NEAR(above, 25, 0.1);
  for (const mbs::Body& b : model.bodies) {
    if (b.fixed) continue;
    const Vec3 d = b.X_WB.p - Vec3{ahead, 0, 2.5};
    inertia += b.inertia(1, 1) + b.mass * (d.x * d.x + d.z * d.z);
  }
  mbs::Options o;
  o.duration = 9, o.frame_interval = 0.01;
  double t = 0, angle = 0, speed = 0, worst = 0;
  o.on_frame = [&](const mbs::View& v) {
    // of the whole, without the swing of its pieces
    double here = 0;
    for (size_t b = 0; b < model.bodies.size(); ++b)
      if (!model.bodies[b].fixed) here -= v.mass[b] / mass * log_rotation(v.X_WB[b].q).y;
    if (t == 0 && here > 0.1) t = v.time, angle = here, speed = std::sqrt(2 * v.energy.kinetic / inertia);
    if (t == 0 || here > 0.5) return;
    for (; t < v.time - 1e-9; t += 1e-3) {
      speed += 1e-3 * mass * 9.81 / inertia * (ahead * std::cos(angle) + above * std::sin(angle));
      angle += 1e-3 * speed;
    }
    worst = std::max(worst, std::abs(angle - here));
  };
  const mbs::Summary s = mbs::run(model, o);
  EXPECT_GT(t, 1) << s.message;
  EXPECT_LT(worst, 0.02);  // [rad]
}

TEST(TemplatePhysics, TheChimneyReachesAboutItsHeightInItsDirection) {
  const record::Record r = run_plan(template_named("chimney"), default_knowledge(), {}, {});
  EXPECT_NEAR(std::abs(finding_of(r, "azimuth").value) / unit::deg, 180, 3);  // -180 is 180
  const double reach = finding_of(r, "debris.reach").value;
  EXPECT_GT(reach, 0.95 * 57.5);
  EXPECT_LT(reach, 1.1 * 60);
}

TEST(TemplatePhysics, TheTowerStandsOnWhatTheFirstStepLeaves) {
  product::Plan plan = template_named("tower");
  plan.stages.resize(1);
  plan.criteria = {};
  plan.analysis.duration = 3;
  const record::Record r = run_plan(plan, default_knowledge(), {}, {});
  EXPECT_EQ(finding_of(r, "mechanism").title, "Mechanism: stands");
}

/// Compression in an element under dead load [N].
double compression_in(const std::string& plan_name, const std::string& element) {
  ModelMap map;
  const mbs::Model model = make_model(template_named(plan_name), default_knowledge(), map);
  mbs::Simulation s(model, {});
  std::string message;
  EXPECT_TRUE(s.find_equilibrium(message)) << message;
  const mbs::View& v = s.calc_view();
  for (size_t e = 0; e < map.elements.size(); ++e)
    if (map.elements[e].name == element) return std::abs(v.element_force[e].x);
  ADD_FAILURE() << element;
  return 0;
}

TEST(TemplatePhysics, AColumnOfTheHallBearsHalfAGirderAndItsRoof) {
  // 12 m x 6 m of roof, a girder between the columns' faces below it, edge beams, the column above its charge at 2 m
  const double roof = 1200 * 0.1 * 12 * 6, girder = 2500 * 0.3 * 0.9 * 11.4, edge = 2500 * 0.25 * 0.45 * 5.6;
  const double column = 2500 * 0.6 * 0.4 * 4;
  const double weight = 9.81 * (0.5 * (roof + girder) + edge + column);
  EXPECT_NEAR(compression_in("hall", "C-A3-0/foot"), weight, 0.03 * weight);  // the frame is stiff along the hall
}

TEST(TemplatePhysics, HallsOfAnySpanHaveAnEquilibrium) {
  const std::string text = product::find_template("hall").text, rows = "B = \"12 m\"";
  for (const std::string span : {"15", "17", "20"}) {
    std::string wider = text;
    ASSERT_NE(wider.find(rows), std::string::npos);
    wider.replace(wider.find(rows), rows.size(), "B = \"" + span + " m\"");
    const product::Plan plan = read(wider);
    RunOptions options;
    options.duration = 0.02;
    const record::Record r = run_plan(plan, default_knowledge(), options, {});
    const record::Finding& f = finding_of(r, "verification.equilibrium");
    EXPECT_EQ(f.status, record::Status::Good) << span << ": " << f.text;
    EXPECT_LT(f.value, 1e-8) << span;  // round-off of places times the stiffest spring; 30 times that was 3e-8
  }
}

TEST(TemplatePhysics, AnInnerPanelBearsTheFloorsOfItsOwnArea) {
  const double floors = 5 * (2500 * 0.14 + 1000 / 9.81) * 3.6 * 4, panels = 2500 * 2.4 * 0.15 * (5 * 2.8 - 1.3);
  const double weight = 9.81 * (floors + panels);
  EXPECT_NEAR(compression_in("wall", "C-B2-0/foot"), weight, 0.1 * weight);  // floors are continuous
}

TEST(TemplatePhysics, ASiloWithoutColumnsDropsFreely) {
  // all columns lose 1.5 m at once, no bar stays: t = sqrt(2 h / g)
  product::Plan plan = template_named("silo");
  product::Charge charge = plan.stages.front().charges.front();
  charge.position = 2.5, charge.destroyed_length = 1.5, charge.residual_bars = 0;
  plan.stages.resize(1);
  plan.stages.front().charges.clear();
  for (size_t i = 0; i < plan.members.size(); ++i)
    if (plan.members[i].kind == product::MemberKind::Column && plan.members[i].storey == 0) {
      charge.member = static_cast<int>(i);
      plan.stages.front().charges.push_back(charge);
    }
  ModelMap map;
  const mbs::Model model = make_model(plan, default_knowledge(), map);
  const double release = default_knowledge().charge_release_time;
  mbs::Options o;
  o.duration = 0.5, o.frame_interval = 0.05;
  double start = 0, worst = 0;
  o.on_frame = [&](const mbs::View& v) {
    double mass = 0, height = 0;
    for (size_t b = 0; b < model.bodies.size(); ++b)
      if (map.bodies[b].is_upper) mass += v.mass[b], height += v.mass[b] * v.X_WB[b].p.z;
    if (v.time == 0) start = height / mass;
    const double fallen = std::max(0.0, v.time - 0.5 * release);
    worst = std::max(worst, std::abs(start - height / mass - 0.5 * 9.81 * fallen * fallen));
  };
  const mbs::Summary s = mbs::run(model, o);
  EXPECT_LT(s.energy_error, 0.01);
  EXPECT_LT(worst, 0.03);  // [m] of 1.2 m: the release takes 3 ms
}

}  // namespace
}  // namespace topple::collapse
