// What ends between two kicks, by an event, a trigger or its strength: second order, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "mbs/moment.h"
#include "models.h"

namespace topple::mbs {
namespace {

using test::make_box;

constexpr double kRate = 40, kMass = 1, kSpeed = 1;  // [N/m, kg, m/s]
const double kOmega = std::sqrt(kRate / kMass);

/// A body at (1, 0, 0) that flies off along x, without weight.
Model make_flier() {
  Model m;
  m.gravity = {};
  m.contact.ground = m.contact.bodies = false;
  Body body = make_box("flier", kMass, {0.1, 0.1, 0.1}, {1, 0, 0});
  body.v_WB = {kSpeed, 0, 0};
  add_body(m, body);
  return m;
}

Model make_sprung(double damper = 0) {
  Model m = make_flier();
  SpringDamper s;
  s.name = "spring";
  s.a = kGround, s.b = {0};
  s.free_length = 1;
  s.spring.rate = kRate;
  s.damper.rate = damper;
  m.springs.push_back(s);
  return m;
}

Model make_tied() {
  Model m = make_flier();
  Cable c;
  c.name = "cable";
  c.a = kGround, c.b = {0};
  c.stiffness = kRate;
  m.cables.push_back(c);
  return m;
}

Model make_bushed() {
  Model m = make_flier();
  Bushing k;
  k.name = "bushing";
  k.a = kGround, k.b = {0};
  k.X_AF.p = {1, 0, 0};
  for (int c = 0; c < 6; ++c) k.spring[c].rate = kRate;
  m.bushings.push_back(k);
  return m;
}

Model make_zoned() {
  Model m = make_flier();
  ZoneElement z;
  z.name = "zone";
  z.a = kGround, z.b = {0};
  z.X_AF.p = {1, 0, 0};
  z.translational_stiffness = z.rotational_stiffness = {kRate, kRate, kRate};
  z.damping_ratio = 0;
  add_element(m, z);
  return m;
}

/// A pendulum of reduced length 1.1 m, horizontal.
Model make_pendulum() {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  Body bar = make_box("bar", 2, {0.1, 0.1, 0.1}, {1, 0, 0});
  bar.inertia = Mat3::diagonal({0.1, 0.2, 0.2});
  add_body(m, bar);
  Joint j;
  j.kind = Joint::Kind::Revolute;
  j.name = "hinge";
  j.parent = kGround, j.child = {0};
  j.X_PF.q = j.X_CM.q = to_quat(Mat3::from_columns({1, 0, 0}, {0, 0, -1}, {0, 1, 0}));
  j.X_CM.p = {-1, 0, 0};
  add_joint(m, j);
  return m;
}

Event make_event(double time, Action::Kind kind, std::vector<Trigger> triggers = {}) {
  Event e;
  e.name = "end";
  e.time = time;
  e.triggers = std::move(triggers);
  e.actions.resize(1);
  e.actions[0].kind = kind;
  e.actions[0].index = 0;
  e.actions[0].cable = 0;
  e.actions[0].element = {0};
  e.actions[0].joint = {0};
  return e;
}

/// Where a spring that ends at the elongation x (at the time t) lets the body be at 1 s.
double calc_place(double x, double t, double speed) { return 1 + x + speed * (1 - t); }
double calc_place_at(double t) {
  return calc_place(kSpeed / kOmega * std::sin(kOmega * t), t, kSpeed * std::cos(kOmega * t));
}
double calc_place_from(double x) {
  const double t = std::asin(kOmega * x / kSpeed) / kOmega;
  return calc_place(x, t, kSpeed * std::cos(kOmega * t));
}

struct Result {
  Vec3 place;
  double energy_error = 0;
};

Result run_to_one(const Model& m, double step) {
  Options o;
  o.duration = 1;
  o.step = step;
  o.equilibrium = false;
  o.frame_interval = 1;
  Result r;
  o.on_frame = [&](const View& v) { r.place = v.X_WB[0].p; };
  r.energy_error = run(m, o).energy_error;
  return r;
}

struct Case {
  const char* name;
  std::function<Model()> make;
  double place;
};

Model with(Model m, const Event& e) {
  m.events.push_back(e);
  return m;
}

std::vector<Case> cases() {
  const double late = 0.0707, strength = 5;
  using Kind = Action::Kind;
  const Trigger far{{Quantity::Kind::Position, 0}, 0, 1.1, true}, near{{Quantity::Kind::Position, 0}, 0, 1.05, true},
      hard{{Quantity::Kind::SpringForce, 0}, 0, 4, true};
  return {
      {"spring, event", [=] { return with(make_sprung(), make_event(late, Kind::RemoveSpring)); }, calc_place_at(late)},
      {"spring, place", [=] { return with(make_sprung(), make_event(0, Kind::RemoveSpring, {far})); },
       calc_place_from(0.1)},
      {"spring, place held before", [=] { return with(make_sprung(), make_event(late, Kind::RemoveSpring, {near})); },
       calc_place_at(late)},
      {"spring, force", [=] { return with(make_sprung(), make_event(0, Kind::RemoveSpring, {hard})); },
       calc_place_from(0.1)},
      {"spring, strength",
       [=] {
         Model m = make_sprung();
         m.springs[0].tension_strength = strength;
         return m;
       },
       calc_place_from(strength / kRate)},
      {"bushing, event", [=] { return with(make_bushed(), make_event(late, Kind::RemoveBushing)); },
       calc_place_at(late)},
      {"bushing, strength",
       [=] {
         Model m = make_bushed();
         m.bushings[0].strength[0] = strength;
         return m;
       },
       calc_place_from(strength / kRate)},
      {"cable, event", [=] { return with(make_tied(), make_event(late, Kind::ReleaseCable)); }, calc_place_at(late)},
      {"cable, strength",
       [=] {
         Model m = make_tied();
         m.cables[0].strength = strength;
         return m;
       },
       calc_place_from(strength / kRate)},
      {"zone, event", [=] { return with(make_zoned(), make_event(late, Kind::RemoveElement)); }, calc_place_at(late)},
  };
}

TEST(Ending, WithinAStepIsOfSecondOrder) {
  for (const Case& c : cases())
    for (const double step : {2e-3, 1e-3, 5e-4}) {
      const Result r = run_to_one(c.make(), step);
      // half a step of the force that ends makes 5e-3 and more at 2 ms
      EXPECT_NEAR(r.place.x, c.place, 7e-6 * std::pow(step / 1e-3, 2)) << c.name << " " << step;
      EXPECT_LT(r.energy_error, 4e-5 * std::pow(step / 1e-3, 2)) << c.name << " " << step;
    }
}

TEST(Ending, OfADamperIsOfSecondOrder) {
  const double late = 0.0707, z = 1, w = std::sqrt(kRate - z * z), decay = std::exp(-z * late);
  const double x = decay * std::sin(w * late) / w, v = decay * (std::cos(w * late) - z / w * std::sin(w * late));
  for (const double step : {2e-3, 1e-3, 5e-4}) {
    const Result r = run_to_one(with(make_sprung(2), make_event(late, Action::Kind::RemoveSpring)), step);
    EXPECT_NEAR(r.place.x, calc_place(x, late, v), 5e-6 * std::pow(step / 1e-3, 2)) << step;
  }
}

TEST(Ending, OfAStrongDamperTurnsNothingRound) {
  // 1e5 N·s/m stop 1 kg in 1e-5 s; a step of 1 ms later the damper goes
  Model m = make_sprung(1e5);
  m.springs[0].spring.rate = 0;
  const Result r = run_to_one(with(m, make_event(1e-3, Action::Kind::RemoveSpring)), 1e-3);
  EXPECT_NEAR(r.place.x, 1, 2e-3);
  EXPECT_GE(r.place.x, 1 - 1e-9);
}

TEST(Ending, OfAJointIsOfSecondOrder) {
  // let go from the horizontal, its hinge released after 0.5003 s: angle and speed computed independently to 1e-9
  const double late = 0.5003, angle = 1.072451754, speed = 3.958158176;
  const double flown = 1 - late;
  const Vec3 wanted{std::cos(angle) - speed * std::sin(angle) * flown, 0,
                    -std::sin(angle) - speed * std::cos(angle) * flown - 0.5 * 9.81 * flown * flown};
  double error[3];
  for (int i = 0; i < 3; ++i) {
    Model m = make_pendulum();
    m.events.push_back(make_event(late, Action::Kind::ReleaseJoint));
    error[i] = norm(run_to_one(m, 2e-3 / (1 << i)).place - wanted);
  }
  EXPECT_LT(error[1], 2e-5);  // half a step of the reaction makes 3e-3
  EXPECT_GT(error[0] / error[2], 12);
}

TEST(ReplacedBody, GoesOnWithSecondOrder) {
  // a tenth of the mass is left: the speed stays, the frequency does not
  const double late = 0.0707, left = 0.1, fast = std::sqrt(kRate / left);
  const double x = kSpeed / kOmega * std::sin(kOmega * late), v = kSpeed * std::cos(kOmega * late);
  const double place = 1 + x * std::cos(fast * (1 - late)) + v / fast * std::sin(fast * (1 - late));
  for (const double step : {2e-3, 1e-3, 5e-4}) {
    Model m = with(make_sprung(), make_event(late, Action::Kind::ReplaceBody));
    m.events[0].actions[0].body = {0};
    m.events[0].actions[0].replacement = make_box("left", left, {0.1, 0.1, 0.1}, {});
    const Result r = run_to_one(m, step);
    // a rest of half a step with the new mass made 3e-3 at 2 ms
    EXPECT_NEAR(r.place.x, place, 4e-5 * std::pow(step / 1e-3, 2)) << step;
    EXPECT_LT(r.energy_error, 2e-4 * std::pow(step / 1e-3, 2)) << step;
  }
}

TEST(ReplacedBody, DoesNotDependOnWhatEndsBeforeOrAfterIt) {
  // a pendulum under the pull of a spring, whose piece that is left has its centre elsewhere as the hinge comes off
  const auto make = [](bool is_first) {
    Model m = make_pendulum();
    SpringDamper s;
    s.name = "spring";
    s.a = kGround, s.b = {0};
    s.p_A = {0.5, 2, 3}, s.p_B = {0.5, 0.3, 0.2};
    s.free_length = 2;
    s.spring.rate = 900;
    m.springs.push_back(s);
    m = with(m, make_event(0.304, Action::Kind::ReleaseJoint));
    Action a;
    a.kind = Action::Kind::ReplaceBody;
    a.body = {0};
    a.replacement = make_box("left", 0.5, {0.1, 0.1, 0.1}, {0.3, 0.1, -0.05});
    a.replacement.inertia = Mat3::diagonal({0.1, 0.05, 0.12});
    std::vector<Action>& actions = m.events[0].actions;
    actions.insert(is_first ? actions.begin() : actions.end(), a);
    return m;
  };
  Vec3 place[4];
  for (int i = 0; i < 4; ++i) {
    place[i] = run_to_one(make(false), 1e-3 / (1 << i)).place;
    EXPECT_LT(norm(run_to_one(make(true), 1e-3 / (1 << i)).place - place[i]), 1e-9) << i;
  }
  EXPECT_GT(norm(place[0] - place[1]) / norm(place[2] - place[3]), 11);
}

/// A body of 1 kg under 100 N from rest, without weight.
Model make_pushed() {
  Model m = make_flier();
  m.bodies[0].v_WB = {};
  Load l;
  l.name = "push";
  l.body = {0};
  l.force = {100, 0, 0};
  m.loads.push_back(l);
  return m;
}

Event make_replacement(double time, double mass, const Vec3& centre = {}) {
  Event e = make_event(time, Action::Kind::ReplaceBody);
  e.actions[0].body = {0};
  e.actions[0].replacement = make_box("other", mass, {0.1, 0.1, 0.1}, centre);
  return e;
}

double find_speed(const Model& m, double until) {
  Options o;
  o.duration = until;
  o.step = o.frame_interval = 1e-3;
  o.equilibrium = false;
  double speed = 0;
  o.on_frame = [&](const View& v) { speed = v.v_WB[0].x; };
  (void)run(m, o);
  return speed;
}

TEST(ReplacedBody, HasNothingOfWhatEndedEarlierInTheStep) {
  Model m = with(make_sprung(), make_event(0.0301, Action::Kind::RemoveSpring));
  m = with(m, make_replacement(0.0309, 0.01));
  // the spring's pull over the 0.8 ms between both would be 0.1 m/s; what it grows by in half a step is 0.002
  EXPECT_NEAR(find_speed(m, 0.05), kSpeed * std::cos(kOmega * 0.0301), 2e-3);
}

TEST(ReplacedBody, MayBeReplacedTwiceInAStep) {
  Model m = with(make_pushed(), make_replacement(0.03, 1, {0, 0, 0.5}));
  m = with(m, make_replacement(0.03, 1, {0, 0, -0.5}));
  EXPECT_NEAR(find_speed(m, 0.06), 6, 1e-6);
}

TEST(ReplacedBody, ThatBecomesLightIsNotThrownBackByItsDamper) {
  // 100 kg that a damper of 1e4 N s/m stops in 10 ms; 0.1 kg are left of it
  Model m = make_sprung(1e4);
  m.springs[0].spring.rate = 0;
  m.bodies[0].mass = 100;
  m = with(m, make_replacement(5e-3, 0.1));
  const Result r = run_to_one(m, 1e-3);
  // it rings by the way of a step, as beside any damper that stops it within one
  EXPECT_NEAR(r.place.x, 1 + 0.01 * (1 - std::exp(-0.5)), 1e-3 * std::exp(-0.5));
  EXPECT_LT(r.energy_error, 0.05);
}

TEST(Ending, OfASpringWhoseJointComesOffAtItsLimitTurnsNothing) {
  Model m = make_pendulum();
  RotationalSpring r;
  r.name = "torsion";
  r.joint = {0};
  r.spring.rate = 3;
  m.rotational_springs.push_back(r);
  m.joints[0].shear_limit = 25;
  Options o;
  o.duration = 1;
  o.step = o.frame_interval = 1e-3;
  o.equilibrium = false;
  double spin = 0, largest = 0;
  bool is_off = false;
  o.on_frame = [&](const View& v) {
    largest = std::max(largest, std::abs(v.w_WB[0].y - spin));
    spin = v.w_WB[0].y;
  };
  o.on_happening = [&](const Happening& h) { is_off |= h.kind == Happening::Kind::RotationalSpringBroken; };
  EXPECT_LT(run(m, o).energy_error, 2e-3);
  EXPECT_TRUE(is_off);
  EXPECT_LT(largest, 0.02);  // gravity makes 9 rad/s² at most
}

TEST(Ending, OfALatchSetsFreeWhatASpringStoredAtRest) {
  // 20 J at rest, without weight or loads: half a swing, and the balance is judged by what was set free
  Model m = make_sprung();
  m.bodies[0].v_WB = {};
  m.springs[0].free_length = 0;
  Joint latch;
  latch.name = "latch", latch.kind = Joint::Kind::Fixed;
  latch.parent = kGround, latch.child = {0};
  latch.X_PF.p = {1, 0, 0};
  add_joint(m, latch);
  m.events.push_back(make_event(0.1, Action::Kind::ReleaseJoint));
  Options o;
  o.duration = 1, o.step = 1e-3;
  double fastest = 0;
  o.on_frame = [&](const View& v) { fastest = std::max(fastest, norm(v.v_WB[0])); };
  const Summary s = run(m, o);
  EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
  EXPECT_NEAR(fastest, kOmega, 0.02 * kOmega);
  EXPECT_GT(s.energy_error, 0);
  EXPECT_LT(s.energy_error, 1e-4);
  o.step = 0.9 * 2 / kOmega;
  EXPECT_GT(run(m, o).energy_error, 0.1);
}

TEST(Equilibrium, OfABodyThatHangsOnASoftSpringIsFound) {
  // k θ = m g l cos θ, from where it sticks out
  for (const double k : {0.5, 2.0, 8.0, 30.0}) {
    Model m = make_pendulum();
    RotationalSpring r;
    r.name = "spring";
    r.joint = {0};
    r.spring.rate = k;
    m.rotational_springs.push_back(r);
    Options o;
    o.duration = 0.1;
    double lean = 0, fastest = 0;
    o.on_frame = [&](const View& v) {
      lean = std::atan2(-v.X_WB[0].p.z, v.X_WB[0].p.x);
      fastest = std::max(fastest, norm(v.w_WB[0]));
    };
    const Summary s = run(m, o);
    ASSERT_EQ(s.ending, Summary::Ending::TimeLimit) << k << " " << s.message;
    EXPECT_NEAR(k * lean, 2 * 9.81 * std::cos(lean), 1e-6) << k;
    EXPECT_LT(fastest, 1e-6) << k;
  }
}

TEST(Ending, OfLongAgoIsNow) {
  // the successor of a run has an event before the instant at which it takes over
  const Model m = make_sprung();
  Options o;
  o.duration = 1;
  o.step = 1e-3;
  o.equilibrium = false;
  Simulation before(m, o);
  ASSERT_TRUE(before.begin());
  while (before.time() < 0.4) ASSERT_TRUE(before.advance());
  Simulation after(with(m, make_event(0.1, Action::Kind::RemoveSpring)), o, before.keep(), true);
  const double speed = before.calc_view().v_WB[0].x;
  ASSERT_TRUE(after.advance());
  const View& now = after.calc_view();
  EXPECT_EQ(now.spring_force[0], 0);
  EXPECT_NEAR(now.v_WB[0].x, speed, 1e-2);  // the spring makes 6 m/s² at most
}

TEST(Ending, AtTheStartGivesNothing) {
  const Result r = run_to_one(with(make_sprung(3), make_event(0, Action::Kind::RemoveSpring)), 1e-3);
  EXPECT_NEAR(r.place.x, 2, 1e-12);
  EXPECT_LT(r.energy_error, 1e-12);
}

/// A body at (1, 0, 0) that is welded to the ground and pulled along x by 1000 N, from or until an event.
Model make_welded(bool is_load, double limit) {
  Model m = make_flier();
  m.bodies[0].v_WB = {};
  Joint weld;
  weld.name = "weld", weld.kind = Joint::Kind::Fixed;
  weld.parent = kGround, weld.child = {0};
  weld.X_PF.p = {1, 0, 0};
  weld.tension_limit = limit;
  add_joint(m, weld);
  if (is_load) {
    Load l;
    l.name = "load", l.body = {0}, l.force = {1000, 0, 0};
    m.loads.push_back(l);
  } else {
    SpringDamper k;
    k.name = "spring";
    k.a = kGround, k.b = {0};
    k.p_A = {3, 0, 0};
    k.free_length = 1, k.spring.rate = 1000;
    m.springs.push_back(k);
  }
  return m;
}

TEST(Ending, LeavesAJointThatHoldsWhatPulls) {
  struct Way {
    bool is_load, begins;
    Action::Kind kind;
  };
  for (const auto& [is_load, begins, kind] :
       {Way{true, true, Action::Kind::ApplyLoad}, Way{true, false, Action::Kind::RemoveLoad},
        Way{false, false, Action::Kind::RemoveSpring}})
    for (int i = 0; i < 10; ++i) {
      const double time = 0.05 + 1e-4 * i;
      Options o;
      o.duration = 0.1;
      o.step = o.frame_interval = 1e-3;
      o.equilibrium = false;
      double most = 0, least = 0;
      bool is_off = false;
      o.on_frame = [&](const View& v) {
        most = std::max(most, v.joint_force[0].x), least = std::min(least, v.joint_force[0].x);
        is_off |= v.joint_released[0];
      };
      Model m = with(make_welded(is_load, 1200), make_event(time, kind));
      run(m, o);
      EXPECT_FALSE(is_off) << is_load << begins << ' ' << time;
      EXPECT_NEAR(least, -1000, 1e-6) << is_load << begins << ' ' << time;
      EXPECT_NEAR(most, 0, 1e-6) << is_load << begins << ' ' << time;
      // and lets go where it does not
      is_off = false;
      m.joints[0].tension_limit = 900;
      run(m, o);
      EXPECT_TRUE(is_off);
    }
}

TEST(Ending, AtAForceThatFallsLaterWaits) {
  // 500 N at the start, a quarter swing of 1 kg on 40 N/m: to 100 N where cos is a fifth
  Model m = make_sprung();
  m.bodies[0].v_WB = {};
  m.springs[0].p_A.x = -500 / kRate;
  m.springs[0].a = kGround;
  const Trigger low{{Quantity::Kind::SpringForce, 0}, 0, 100, false};
  double fired = -1;
  Options o;
  o.duration = 1, o.step = 1e-4;
  o.equilibrium = false;
  o.on_happening = [&](const Happening& h) {
    if (h.kind == Happening::Kind::EventFired) fired = h.time;
  };
  run(with(m, make_event(0, Action::Kind::RemoveSpring, {low})), o);
  EXPECT_NEAR(fired, std::acos(0.2) / kOmega, 3e-4);
}

TEST(Ending, AtAForceThatHoldsAtTheStartPullsNothingBack) {
  Model m = make_sprung();
  m.bodies[0].v_WB = {};
  m.springs[0].p_A.x = -500 / kRate;
  const Trigger high{{Quantity::Kind::SpringForce, 0}, 0, 100, true};
  Vec3 v;
  Options o;
  o.duration = 0.01, o.step = 1e-3;
  o.equilibrium = false;
  o.on_frame = [&](const View& view) { v = view.v_WB[0]; };
  run(with(m, make_event(0, Action::Kind::RemoveSpring, {high})), o);
  EXPECT_LE(v.x, 1e-9);
  EXPECT_GE(v.x, -500 * 1e-3);
}

}  // namespace
}  // namespace topple::mbs
