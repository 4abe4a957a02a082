// The course of a run: time in which nothing happens.

#include "mbs/course.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "base/error.h"
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

TEST(Step, IsRefusedWhereTheRunWouldHaveNoEnd) {
  Model m = make_hanging();
  Options o;
  o.duration = 1, o.step = 0.99e-9, o.equilibrium = false;
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
