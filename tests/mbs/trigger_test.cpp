// Events that wait for a limit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "mbs/quantity.h"
#include "models.h"

namespace topple::mbs {
namespace {

using test::make_box;

Options options_of(double duration, double step) {
  Options o;
  o.equilibrium = false;
  o.duration = duration;
  o.step = step;
  o.frame_interval = step;
  return o;
}

/// A bar hinged at one end, let go from the horizontal, with a torsion spring and a spring to the ground; and a second
/// body on a bushing and a cable.
Model make_model() {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  Body bar = make_box("bar", 2, {1, 0.1, 0.1}, {1, 0, 0});
  add_body(m, bar);
  Joint j;
  j.kind = Joint::Kind::Revolute;
  j.name = "hinge";
  j.parent = kGround;
  j.child = {0};
  j.X_PF.q = j.X_CM.q = to_quat(Mat3::from_columns({1, 0, 0}, {0, 0, -1}, {0, 1, 0}));
  j.X_CM.p = {-1, 0, 0};
  RotationalSpring r;
  r.name = "torsion";
  r.joint = add_joint(m, j);
  r.spring.rate = 3;
  m.rotational_springs.push_back(r);
  RotationalElement knee;
  knee.name = "knee";
  knee.joint = r.joint;
  knee.stiffness = 0.2;
  knee.damping_ratio = 0;
  m.rotational_elements.push_back(knee);
  SpringDamper s;
  s.name = "stay";
  s.a = kGround;
  s.b = {0};
  s.p_A = {2, 0, 1};
  s.p_B = {1, 0, 0};
  s.free_length = 1;
  s.spring.rate = 2;
  s.damper.rate = 0.5;
  m.springs.push_back(s);
  add_body(m, make_box("block", 5, {0.1, 0.1, 0.1}, {0, 3, 0}));
  Bushing k;
  k.name = "pad";
  k.a = kGround;
  k.b = {1};
  k.X_AF.p = {0, 3, 0};
  for (int c = 0; c < 6; ++c) k.spring[c].rate = 400;
  m.bushings.push_back(k);
  Cable c;
  c.name = "rope";
  c.a = kGround;
  c.b = {1};
  c.p_A = {0, 3, 2};
  c.stiffness = 100;
  m.cables.push_back(c);
  ZoneElement z;
  z.name = "zone";
  z.a = kGround;
  z.b = {1};
  z.X_AF.p = {0, 3, 0};
  z.translational_stiffness = {50, 50, 50};
  z.rotational_stiffness = {50, 50, 50};
  z.damping_ratio = 0;
  add_element(m, z);
  Load l;
  l.name = "push";
  l.body = {1};
  l.force = {4, 0, 0};
  l.torque = {0, 0.3, 0};
  m.loads.push_back(l);
  return m;
}

struct Case {
  Quantity::Kind kind;
  int index, component;
  double limit;
  bool rising;
  int late;  // steps that it may be after the frame that passes the limit: 1 for what is known from the step before
};

class TriggerOf : public ::testing::TestWithParam<Case> {};

TEST_P(TriggerOf, FiresAtTheFirstStepBeyondTheLimit) {
  const Case& c = GetParam();
  Model m = make_model();
  const double h = 1e-3;
  Trigger t;
  t.quantity = {c.kind, c.index};
  t.component = c.component;
  t.limit = c.limit;
  t.rising = c.rising;
  Event e;
  e.name = "reached";
  e.triggers = {t};
  m.events.push_back(e);
  double fired = -1, passed = -1, first = 0;
  Options o = options_of(1, h);
  o.on_happening = [&](const Happening& w) {
    if (w.kind != Happening::Kind::EventFired) return;
    EXPECT_LT(fired, 0);  // once
    fired = w.time;
  };
  o.on_frame = [&](const View& v) {
    // the torsion spring's angle is that of its joint
    const auto kind = c.kind == Quantity::Kind::JointAngle ? Quantity::Kind::TorsionAngle : c.kind;
    const double x = calc_component({kind, c.index}, t.component, v);
    if (v.time == 0) first = x;
    if (passed < 0 && v.time > 0 && (c.rising ? x >= c.limit : x <= c.limit)) passed = v.time;
  };
  (void)run(m, o);
  ASSERT_GT(passed, 0) << "from " << first;
  EXPECT_GT(fired, passed - 1e-9);
  EXPECT_LT(fired, passed + c.late * h + 1e-9);
}

INSTANTIATE_TEST_SUITE_P(
    EveryQuantity, TriggerOf,
    ::testing::Values(
        Case{Quantity::Kind::Position, 0, 2, -0.5, false, 0}, Case{Quantity::Kind::Orientation, 0, 1, 0.5, true, 0},
        Case{Quantity::Kind::Velocity, 0, 3, 2, true, 0}, Case{Quantity::Kind::AngularVelocity, 0, 1, 2, true, 0},
        Case{Quantity::Kind::JointForce, 0, 3, 25, true, 1}, Case{Quantity::Kind::JointAngle, 0, 0, 0.6, true, 0},
        Case{Quantity::Kind::ElementTranslation, 0, 2, -0.05, false, 0},
        Case{Quantity::Kind::ElementForce, 0, 2, 4, true, 1}, Case{Quantity::Kind::HingeRotation, 0, 0, 0.6, true, 0},
        Case{Quantity::Kind::HingeMoment, 0, 0, -0.1, false, 1},
        Case{Quantity::Kind::BushingTranslation, 0, 3, 0.06, true, 0},
        Case{Quantity::Kind::BushingRotation, 0, 1, 1e-3, true, 0},
        Case{Quantity::Kind::BushingForce, 0, 2, 30, true, 1},
        Case{Quantity::Kind::BushingMoment, 0, 1, -0.4, false, 1},
        Case{Quantity::Kind::SpringLength, 0, 0, 1.5, true, 0}, Case{Quantity::Kind::SpringForce, 0, 0, 1.5, true, 1},
        Case{Quantity::Kind::TorsionAngle, 0, 0, 0.7, true, 0}, Case{Quantity::Kind::TorsionTorque, 0, 0, 2, true, 1},
        Case{Quantity::Kind::CableLength, 0, 0, 2.03, true, 0}, Case{Quantity::Kind::CableForce, 0, 0, 4, true, 1}));

Event make_event(const std::string& name, double time, std::vector<Trigger> triggers, Action::Kind kind, int index) {
  Event e;
  e.name = name;
  e.time = time;
  e.triggers = std::move(triggers);
  e.actions.emplace_back();
  e.actions[0].kind = kind;
  e.actions[0].index = index;
  if (kind == Action::Kind::ReleaseJoint) e.actions[0].joint = {index};
  return e;
}

TEST(Trigger, ReleasesAJointWhoseReactionIsTooLarge) {
  // a block hangs on a fixed joint and is pulled down by a load that grows by 100 N/s: weight 19.62 N, limit 50 N
  Model m;
  m.contact.ground = m.contact.bodies = false;
  add_body(m, make_box("block", 2, {0.1, 0.1, 0.1}, {0, 0, 0}));
  Joint j;
  j.parent = kGround;
  j.child = {0};
  add_joint(m, j);
  Load l;
  l.body = {0};
  l.force = {0, 0, -100};
  l.time = {0, 1};
  l.factor = {0, 1};
  m.loads.push_back(l);
  m.events.push_back(
      make_event("too much", 0, {{{Quantity::Kind::JointForce, 0}, 2, 50, true}}, Action::Kind::ReleaseJoint, 0));
  Options o = options_of(0.5, 1e-3);
  double fired = -1, released = -1;
  o.on_happening = [&](const Happening& w) {
    if (w.kind == Happening::Kind::EventFired) fired = w.time;
    if (w.kind == Happening::Kind::JointReleased) released = w.time;
  };
  (void)run(m, o);
  EXPECT_NEAR(fired, (50 - 19.62) / 100, 2.001e-3);  // known from the step before
  EXPECT_EQ(released, fired);
}

TEST(Trigger, RemovesWhatItNamesAndBooksItsEnergy) {
  // the block stretches the bushing to 60 mm: 400 N/m of it, 50 of the zone and the cable stay
  struct Removal {
    Action::Kind kind;
    Trigger trigger;
    std::function<double(const View&)> force;
  };
  const std::vector<Removal> removals = {{Action::Kind::RemoveBushing,
                                          {{Quantity::Kind::BushingTranslation, 0}, 2, -0.06, false},
                                          [](const View& v) { return norm(v.bushing_force[0]); }},
                                         {Action::Kind::RemoveSpring,
                                          {{Quantity::Kind::SpringLength, 0}, 0, 1.4, true},
                                          [](const View& v) { return v.spring_force[0]; }},
                                         {Action::Kind::RemoveRotationalSpring,
                                          {{Quantity::Kind::TorsionAngle, 0}, 3, 0.5, true},
                                          [](const View& v) { return v.torsion_torque[0]; }}};
  for (const Removal& r : removals) {
    Model m = make_model();
    m.events.push_back(make_event("enough", 0, {r.trigger}, r.kind, 0));
    double residual[2];
    for (int i = 0; i < 2; ++i) {
      Options o = options_of(1, 1e-3 / (1 << i));
      double fired = -1, stored = 0, removed = 0;
      residual[i] = 0;
      o.on_happening = [&](const Happening& w) {
        if (w.kind == Happening::Kind::EventFired) fired = w.time;
      };
      o.on_frame = [&](const View& v) {
        residual[i] = std::max(residual[i], std::abs(v.energy.residual));
        if (fired < 0) {
          stored = v.energy.elastic;
        } else {
          EXPECT_EQ(r.force(v), 0);
        }
        removed = v.energy.removed;
      };
      const Summary s = run(m, o);
      EXPECT_GT(fired, 0);
      EXPECT_GT(removed, 0);
      EXPECT_LT(removed, 1.05 * stored);
      EXPECT_LT(s.energy_error, 1e-4);
    }
    EXPECT_LT(residual[1], 0.3 * residual[0]);  // second order, the removal included
  }
}

TEST(Trigger, FiresOnceAtTheFirstOfSeveral) {
  Model m = make_model();
  m.events.push_back(make_event("either", 0,
                                {{{Quantity::Kind::Position, 0}, 2, -0.5, false},
                                 {{Quantity::Kind::JointAngle, 0}, 3, 0.3, true},
                                 {{Quantity::Kind::SpringLength, 0}, 0, 1.9, true}},
                                Action::Kind::RemoveSpring, 0));
  Options o = options_of(1, 1e-3);
  int count = 0;
  double fired = -1, passed = -1;
  o.on_happening = [&](const Happening& w) {
    if (w.kind == Happening::Kind::EventFired) ++count, fired = w.time;
  };
  o.on_frame = [&](const View& v) {
    if (passed < 0 && std::abs(v.torsion_angle[0]) >= 0.3) passed = v.time;
  };
  (void)run(m, o);
  EXPECT_EQ(count, 1);
  EXPECT_EQ(fired, passed);
}

TEST(Trigger, WaitsForTheTimeOfItsEvent) {
  Model m = make_model();
  m.events.push_back(
      make_event("late", 0.25, {{{Quantity::Kind::Position, 0}, 2, 1, false}}, Action::Kind::RemoveSpring, 0));
  Options o = options_of(0.5, 1e-3);
  double fired = -1;
  o.on_happening = [&](const Happening& w) {
    if (w.kind == Happening::Kind::EventFired) fired = w.time;
  };
  (void)run(m, o);
  EXPECT_NEAR(fired, 0.25, 1e-9);
}

TEST(Trigger, FiresInTheOrderOfTheModelWithinAStep) {
  Model m = make_model();
  const Trigger holds{{Quantity::Kind::Position, 0}, 2, 10, false};
  for (const auto& [name, time, waits] :
       {std::tuple{"a", 0.3, true}, {"b", 0.3, false}, {"c", 0.2, true}, {"d", 0.3, true}, {"e", 0.3, false}})
    m.events.push_back(
        make_event(name, time, waits ? std::vector{holds} : std::vector<Trigger>{}, Action::Kind::RemoveSpring, 0));
  std::string order;
  Options o = options_of(0.5, 1e-3);
  o.on_happening = [&](const Happening& w) {
    if (w.kind == Happening::Kind::EventFired) order += m.events[static_cast<size_t>(w.index)].name;
  };
  (void)run(m, o);
  EXPECT_EQ(order, "cabde");
}

TEST(Trigger, OnTheMotionOfAReleasedJointNeverHolds) {
  // it has neither angle nor displacement, and did not come back to 0
  for (const bool slides : {false, true}) {
    Model m;
    m.contact.ground = m.contact.bodies = false;
    Body b = make_box("b", 1, {0.1, 0.1, 0.1}, {slides ? 0.0 : 1.0, 0, 0});
    add_body(m, b);
    Joint j;
    j.kind = slides ? Joint::Kind::Prismatic : Joint::Kind::Revolute;
    j.parent = kGround, j.child = {0};
    if (!slides) j.X_PF.q = j.X_CM.q = to_quat(Mat3::from_columns({1, 0, 0}, {0, 0, -1}, {0, 1, 0}));
    j.X_CM.p = -m.bodies[0].X_WB.p;
    add_joint(m, j);
    Event release;
    release.time = 0.2;
    Action a;
    a.kind = Action::Kind::ReleaseJoint;
    a.joint = {0};
    release.actions = {a};
    const Quantity q{slides ? Quantity::Kind::JointDisplacement : Quantity::Kind::JointAngle, 0};
    Event far, none;
    far.name = "far", far.time = 0.3;
    far.triggers = {{q, 3, 0.15, true}};
    none.name = "none", none.time = 0.3;
    none.triggers = {{q, 3, 1e-9, false}};
    m.events = {release, far, none};
    std::vector<std::string> fired;
    Options o = options_of(1, 1e-3);
    o.on_happening = [&](const Happening& h) {
      if (h.kind == Happening::Kind::EventFired && h.index > 0) fired.push_back(h.reason);
    };
    o.on_frame = [&](const View& v) {
      if (v.time > 0.3) { EXPECT_EQ((slides ? v.joint_displacement : v.joint_angle)[0], 0); }
    };
    (void)run(m, o);
    EXPECT_TRUE(fired.empty()) << slides << ' ' << fired.front();
  }
}

TEST(Trigger, ThatNeverFiresLetsARunComeToRest) {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  m.gravity = {};
  Body b = make_box("b", 10, {0.1, 0.1, 0.1}, {0, 0, 0});
  b.v_WB.x = 1;
  add_body(m, b);
  Bushing k;
  k.a = kGround;
  k.b = {0};
  for (int c = 0; c < 6; ++c) {
    k.spring[c].rate = 1000;
    k.damper[c].rate = 100;
  }
  m.bushings.push_back(k);
  m.events.push_back(
      make_event("never", 0.1, {{{Quantity::Kind::Position, 0}, 0, 5, true}}, Action::Kind::RemoveBushing, 0));
  Options o = options_of(100, 1e-3);
  o.frame_interval = 1;
  o.rest_speed = 1e-3;
  EXPECT_EQ(run(m, o).ending, Summary::Ending::AtRest);
  // a load that is still to come does keep it
  Load l;
  l.body = {0};
  l.force = {1, 0, 0};
  l.time = {20, 21};
  l.factor = {0, 1};
  m.loads.push_back(l);
  const Summary s = run(m, o);
  EXPECT_EQ(s.ending, Summary::Ending::AtRest);
  EXPECT_GT(s.time, 21);
}

}  // namespace
}  // namespace topple::mbs
