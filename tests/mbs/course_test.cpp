// The course of a run: time in which nothing happens.

#include "mbs/course.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "base/error.h"
#include "mbs/moment.h"
#include "models.h"
#include "views.h"

namespace topple::mbs {
namespace {

using test::look;
using test::make_box;

/// A box that hangs on an elastic element until an event lets it fall at 3 s.
Model make_hanging() {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  const BodyId b = add_body(m, make_box("b", 1000, {0.5, 0.5, 0.5}, {0, 0, 10}));
  ZoneElement e;
  e.name = "hanger";
  e.a = kGround, e.b = b;
  e.X_AF.p = {0, 0, 10};
  e.translational_stiffness = {1e7, 1e7, 1e7};
  e.rotational_stiffness = {1e6, 1e6, 1e6};
  const ElementId hanger = add_element(m, e);
  Event cut;
  cut.time = 3;
  cut.name = "cut";
  Action a;
  a.kind = Action::Kind::RemoveElement;
  a.element = hanger;
  cut.actions.push_back(a);
  m.events.push_back(cut);
  return m;
}

TEST(Course, TellsAnEnergyThatIsNoNumber) {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  Body fast = make_box("fast", 1, {0.5, 0.5, 0.5}, {0, 0, 10});
  fast.v_WB = {1e200, 0, 0};
  add_body(m, fast);
  Options o;
  o.duration = 0.1, o.step = 1e-3, o.equilibrium = false;
  const Summary s = run(m, o);
  EXPECT_EQ(s.ending, Summary::Ending::Diverged);
  EXPECT_THAT(s.message, testing::HasSubstr("energy is no longer finite"));
}

TEST(Course, ARestoredRunForgetsThatItFailed) {
  // a spring so stiff where it is stretched that the set step is too long there
  Model m;
  m.gravity = {};
  m.contact.ground = m.contact.bodies = false;
  Body b = make_box("b", 1, {0.1, 0.1, 0.1}, {1, 0, 0});
  b.v_WB.x = 200;
  add_body(m, b);
  SpringDamper s;
  s.a = kGround, s.b = {0};
  s.p_A = {-1, 0, 0};
  s.free_length = 2;
  s.spring.kind = Characteristic::Kind::Polynomial;
  s.spring.coefficients = {0, 1, 0, 1e6};
  m.springs.push_back(s);
  Options o;
  o.duration = 1, o.step = 2e-3, o.equilibrium = false;
  Simulation simulation(m, o);
  ASSERT_TRUE(simulation.advance_step());
  const std::vector<std::byte> early = simulation.snapshot();
  const auto count_steps = [&] {
    int n = 0;
    while (n < 100 && simulation.advance_step()) ++n;
    return n;
  };
  const int first = count_steps();
  EXPECT_GT(first, 0);
  EXPECT_LT(first, 100);
  simulation.restore(early);
  EXPECT_EQ(count_steps(), first);
}

TEST(Course, RefusesAContactOfNoStep) {
  Model m;
  m.contact.contact_frequency = 1e200;
  add_body(m, make_box("b", 1, {0.5, 0.5, 0.5}, {0, 0, 0.5}));
  Options o;
  o.duration = 0.1, o.equilibrium = false;
  const Summary s = run(m, o);
  EXPECT_EQ(s.ending, Summary::Ending::Diverged);
  EXPECT_THAT(s.message, testing::HasSubstr("more steps than"));
}

Model make_unmoved() {
  Model m;
  m.gravity = {};
  m.contact.ground = m.contact.bodies = false;
  Body b = make_box("b", 2, {0.1, 0.2, 0.3}, {8.3, -3.1, 5.7});
  b.X_WB.q = exp_rotation({0.3, -0.9, 0.4});
  add_body(m, b);
  return m;
}

TEST(Course, WhatNothingMovesKeepsItsEnergyToRoundOff) {
  // gravity 0: work and energy of what stands still are round-off themselves
  Model held = make_unmoved();
  Joint j;
  j.name = "weld", j.kind = Joint::Kind::Fixed;
  j.parent = kGround, j.child = {0};
  j.X_PF = held.bodies[0].X_WB;
  add_joint(held, j);
  Load ramp;
  ramp.name = "ramp", ramp.body = {0};
  ramp.force = {-100, 3, 4}, ramp.torque = {1, 2, 3};
  ramp.time = {0, 1}, ramp.factor = {0, 1};
  held.loads.push_back(ramp);
  Model balanced = make_unmoved();
  ZoneElement e;
  e.name = "e", e.a = kGround, e.b = {0};
  e.X_AF.p = balanced.bodies[0].X_WB.p + Vec3{0.3, 0.1, 0.2};
  e.X_BM.p = transpose_times(to_matrix(balanced.bodies[0].X_WB.q), {0.3, 0.1, 0.2});
  e.X_BM.q = conjugate(balanced.bodies[0].X_WB.q);
  e.translational_stiffness = {5e7, 3e5, 3e5};
  e.rotational_stiffness = {5e4, 1e5, 1e5};
  add_element(balanced, e);
  const Model unloaded = balanced;
  ramp.time = ramp.factor = {};
  balanced.loads.push_back(ramp);
  struct Case {
    const Model& model;
    bool equilibrium;
  };
  for (const Case& c : {Case{held, false}, Case{balanced, true}, Case{unloaded, false}, Case{unloaded, true}}) {
    Options o;
    o.duration = 1, o.equilibrium = c.equilibrium;
    const Summary s = run(c.model, o);
    EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
    EXPECT_LT(s.energy_error, 1e-6);
  }
}

TEST(Course, MeasuresTheEnergyByWhatActs) {
  const double most = 1e-6;  // [m]
  EXPECT_EQ(calc_energy_error(2, {4, 1, 0, 0}), 0.5);
  EXPECT_EQ(calc_energy_error(2, {4, 8, 0, 0}), 0.25);
  EXPECT_EQ(calc_energy_error(2, {0, 0, 100, 0}), 2 / (most * 100));
  EXPECT_EQ(calc_energy_error(2, {1, 0, 0, 1.9}), 2) << "more than round-off";
  EXPECT_EQ(calc_energy_error(2, {1, 0, 0, 2.1}), 0);
  EXPECT_EQ(calc_energy_error(2, {1, 0, 0, 0, 8}), 0.25);
  Load l;
  l.force = {0, 3, 4}, l.torque = {2, 0, 0};
  EXPECT_EQ(calc_largest_force(l), 7);
  l.time = {0, 1, 2}, l.factor = {0, -3, 1};
  EXPECT_EQ(calc_largest_force(l), 21);
  // a body of 2 kg at 10 m in 1000 steps of a millisecond: far below what such a body does
  Model m = make_unmoved();
  EXPECT_LT(calc_round_off(m, 1e-3, 1000), 1e-17);
  EXPECT_GT(calc_round_off(m, 1e-3, 1000), 0);
}

TEST(Course, WhatIsSetFreeAtTheEndHasNotDiverged) {
  // of the energy of a step h²/8 m g² is not booked yet
  for (const double h : {1e-3, 5e-3}) {
    for (const int steps : {0, 1, 2}) {
      Model m;
      m.contact.ground = m.contact.bodies = false;
      add_body(m, test::make_box("held", 2, {0.1, 0.1, 0.1}, {0, 0, 1}));
      Joint j;
      j.parent = kGround;
      j.child = {0};
      j.X_PF.p = {0, 0, 1};
      add_joint(m, j);
      Event e;
      e.time = 1 - steps * h;
      Action release;
      release.kind = Action::Kind::ReleaseJoint;
      release.joint = {0};
      e.actions.push_back(release);
      m.events.push_back(e);
      Options o;
      o.duration = 1;
      o.step = h;
      const Summary s = run(m, o);
      EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << h << " " << steps << ": " << s.message;
      EXPECT_LT(s.energy_error, 0.1);
    }
  }
}

TEST(Course, TellsALostBalanceWithoutGravity) {
  // the spring's body becomes so light that its step is too long: thrown about
  Model m = make_unmoved();
  SpringDamper s;
  s.name = "s", s.a = kGround, s.b = {0};
  s.p_A = m.bodies[0].X_WB.p + Vec3{1, 0, 0};
  s.free_length = 0.999;
  s.spring.kind = Characteristic::Kind::Linear;
  s.spring.rate = 1e6;
  m.springs.push_back(s);
  Action a;
  a.kind = Action::Kind::ReplaceBody;
  a.body = {0};
  a.replacement = make_box("light", 0.1, {0.1, 0.2, 0.3}, {});
  Event lighter;
  lighter.time = 0.01, lighter.actions = {a};
  m.events = {lighter};
  Options o;
  o.duration = 0.1, o.step = 1e-3, o.equilibrium = false;
  const Summary lost = run(m, o);
  EXPECT_EQ(lost.ending, Summary::Ending::Diverged) << lost.energy_error;
  EXPECT_THAT(lost.message, testing::HasSubstr("balance of energy"));
}

/// A heavy box that lands flat at 8 m/s.
Model make_landing() {
  Model m;
  m.contact.restitution = 0.2;
  Body b = make_box("b", 20e3, {2, 2, 0.3}, {0, 0, 1.1});
  b.v_WB = {0, 0, -7};
  add_body(m, b);
  return m;
}

Options watch_each_step(double& largest, double& released) {
  Options o;
  o.duration = 0.5, o.equilibrium = false, o.frame_interval = 1e-9;
  o.on_frame = [&](const View& v) {
    largest = std::max(largest, std::abs(v.energy.residual));
    released = std::max(released, v.energy.released);
  };
  return o;
}

TEST(Course, WhatTheNextStepPaysIsNoLostEnergy) {
  double largest = 0, released = 0;
  const Summary each = run(make_landing(), watch_each_step(largest, released));
  Options rare = watch_each_step(largest, released);
  rare.frame_interval = 0.1;
  const double single = largest;
  const Summary few = run(make_landing(), rare);
  EXPECT_GT(single, 0.01 * released) << "or frames show nothing that is not there";
  EXPECT_LT(each.energy_error, 2e-3);
  EXPECT_NEAR(each.energy_error, few.energy_error, 1e-3) << "it hangs on the rate of frames";
}

TEST(Course, EnergyGainedInAnImpactStays) {
  for (const double when : {0.07, 0.2}) {  // as it lands, and as it lands again
    double largest = 0, released = 0;
    const Options o = watch_each_step(largest, released);
    const Model m = make_landing();
    System s(m, o);
    Course course(s);
    ASSERT_TRUE(course.begin());
    constexpr double gained = 2e4;  // [J]
    double stored = 0;
    for (bool has_gained = false, goes_on = true; goes_on; goes_on = course.follow()) {
      s.advance_step();
      if (has_gained || s.state.time < when || !(s.calc_view().energy.contact > 0)) continue;
      s.state.removed += gained;
      stored = s.calc_view().energy.contact;
      has_gained = true;
    }
    EXPECT_GT(stored, 0) << when;
    const double reference = std::max(s.state.released, s.state.total_at_start);
    EXPECT_GT(course.finish().energy_error * reference, 0.98 * gained) << when;
  }
}

TEST(Course, NotesAnElementThatIsTurnedOver) {
  Model m = make_hanging();
  m.events.clear();
  m.gravity = {};
  m.elements[0].rotational_stiffness = {1e-3, 1e-3, 1e-3};
  m.bodies[0].w_WB = {0, 0, 4};
  Options o;
  o.duration = 0.7, o.step = 1e-3, o.equilibrium = false;
  EXPECT_TRUE(run(m, o).notes.empty()) << "2.8 rad";
  o.duration = 2;
  const Summary s = run(m, o);
  ASSERT_EQ(s.notes.size(), 1u);
  EXPECT_THAT(s.notes[0], testing::HasSubstr("element \"hanger\" is turned by more than half a turn at 0.78"));
}

TEST(PassQuietPhysics, GoesOnAtTheEventAsIfItHadWaited) {
  Model m = make_hanging();
  std::vector<View> waited, passed;
  Options o = look(3.5, waited, true);
  const Summary slow = run(m, o);
  o = look(3.5, passed, true);
  o.pass_speed = 1e-6;
  const Summary fast = run(m, o);
  EXPECT_GT(static_cast<double>(slow.steps - fast.steps) * slow.step, 2.6) << "of 3 s it looks at 0.25 s, by frames";
  EXPECT_NEAR(fast.time, slow.time, 1e-9);
  // at rest nothing changes while time passes; the whole steps left out sum up to round-off
  EXPECT_NEAR(passed.back().X_WB[0].p.z, waited.back().X_WB[0].p.z, 1e-9);
  EXPECT_NEAR(passed.back().X_WB[0].p.z, 10 - 0.5 * 9.81 * 0.25, 0.05) << "it has fallen for half a second";
}

TEST(PassQuiet, WaitsWhereSomethingMoves) {
  Model m = make_hanging();
  m.bodies[0].v_WB = {0, 0, 0.5};
  m.elements[0].damping_ratio = 0;
  std::vector<View> all, passed;
  Options o = look(3.5, all);
  const long steps = run(m, o).steps;
  o = look(3.5, passed);
  o.pass_speed = 0.05;  // below it for a thirtieth of each swing of 0.03 s, never for 0.25 s on end
  EXPECT_EQ(run(m, o).steps, steps);
}

TEST(PassQuiet, WaitsForLoadsThatFollowTheTime) {
  Model m = make_hanging();
  Load l;
  l.name = "weight", l.body = BodyId{0};
  l.force = {0, 0, -1};
  m.loads.push_back(l);
  std::vector<View> views;
  Options o = look(3.5, views, true);
  const long steps = run(m, o).steps;
  o.pass_speed = 1;
  EXPECT_EQ(run(m, o).steps, steps);
}

TEST(Rest, TakesAsLongAsItsTimeHoweverLongThatIs) {
  Model m = make_hanging();
  Options o;
  o.duration = 1, o.rest_speed = 0.01;
  m.events.clear();
  EXPECT_EQ(run(m, o).ending, Summary::Ending::AtRest);
  o.rest_time = 1e30;
  EXPECT_EQ(run(m, o).ending, Summary::Ending::TimeLimit);
}

TEST(Course, GoesOnFromAMomentOfQuietToTheSameBits) {
  Model m = make_hanging();
  m.bodies[0].v_WB = {0, 0, 0.5};
  m.elements[0].damping_ratio = 0.2;
  Options o;
  o.duration = 3.5, o.step = 1e-3, o.equilibrium = false, o.frame_interval = 0.01;
  o.pass_speed = 0.1, o.pass_time = 0.5, o.pass_share = 1;
  Simulation whole(m, o);
  ASSERT_TRUE(whole.begin());
  double passed_from = 0;
  std::vector<Moment> moments;
  for (double time = 0; whole.advance(); time = whole.time()) {
    if (whole.steps() % 100 == 0) moments.push_back(whole.keep());
    if (whole.time() > time + 0.5) passed_from = time;
  }
  EXPECT_GT(passed_from, 0.5);
  EXPECT_LT(passed_from, 2);
  const Summary a = whole.finish();
  for (const Moment& moment : moments) {
    Simulation rest(m, o, moment);
    while (rest.advance()) {}
    const Summary b = rest.finish();
    EXPECT_EQ(b.steps, a.steps) << moment.time;
    EXPECT_EQ(rest.calc_view().X_WB[0].p.z, whole.calc_view().X_WB[0].p.z);
  }
}

/// A column on a zone whose law goes over to one of a twentieth within 5 s.
Model make_weakened(double triggered_at = 0) {
  Model m = make_hanging();
  m.events.clear();
  m.elements[0].X_AF = {{0, 0, 9.5}, test::upright()};
  m.elements[0].X_BM = {{0, 0, -0.5}, test::upright()};
  for (const double bears : {1e5, 5e3}) {
    ZoneLaw law;
    law.compression = {{0, 0.1}, {bears, bears}};
    add_law(m, law);
  }
  m.elements[0].stations = {{0, {0}}};
  Action a;
  a.kind = Action::Kind::SwitchLaw;
  a.element = {0}, a.law = {1}, a.ramp = 5;
  Event weaken;
  weaken.name = "weaken";
  weaken.time = 0.2, weaken.actions = {a};
  if (triggered_at > 0) {
    weaken.time = triggered_at;
    weaken.triggers = {{{Quantity::Kind::Position, 0}, 2, 0, true}};
  }
  m.events = {weaken};
  return m;
}

TEST(Rest, WaitsForLawsThatStillGoOver) {
  // it bears 1.02 of its weight when 0.95 of the ramp is over
  for (const double triggered_at : {0.0, 0.3}) {
    Options o;
    o.duration = 5.6, o.step = 1e-3;
    double z = 0;
    o.on_frame = [&](const View& v) { z = v.X_WB[0].p.z; };
    (void)run(make_weakened(triggered_at), o);
    const double fallen = z;
    EXPECT_LT(fallen, 9.9);
    o.rest_speed = 0.001;
    EXPECT_EQ(run(make_weakened(triggered_at), o).ending, Summary::Ending::TimeLimit) << triggered_at;
    EXPECT_EQ(z, fallen);
  }
}

TEST(Step, IsRefusedWhereTheRunWouldHaveNoEndOrNoStep) {
  Model m = make_hanging();
  Options o;
  o.duration = 1, o.step = 0.99e-9, o.equilibrium = false;
  EXPECT_THROW((void)run(m, o), InputError);
  o.step = 1.001;  // nor one longer than the run
  EXPECT_THROW((void)run(m, o), InputError);
  o.step = 0;
  m.elements[0].translational_stiffness = {1e27, 1e27, 1e27};
  const Summary stiff = run(m, o);
  EXPECT_EQ(stiff.ending, Summary::Ending::Diverged);
  EXPECT_THAT(stiff.message, testing::HasSubstr("more steps than the 1e+09 that a run may take"));
  EXPECT_LE(stiff.steps, 1);
}

}  // namespace
}  // namespace topple::mbs
