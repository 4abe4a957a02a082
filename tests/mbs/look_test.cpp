// Points that are met between two looks for them, and such that move with their bodies until the next look: neither
// may take energy from nowhere.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "models.h"

namespace topple::mbs {
namespace {

using test::make_box;

Options free_options(double duration, double step, int interval) {
  Options o;
  o.duration = duration;
  o.step = step;
  o.contact_interval = interval;
  o.equilibrium = false;
  o.frame_interval = 0.02;
  return o;
}

Contact make_contact(double restitution, double friction) {
  Contact c;
  c.contact_frequency = 250;
  c.restitution = c.body_restitution = restitution;
  c.friction = c.body_friction = friction;
  return c;
}

TEST(ContactLookPhysics, LandingsKeepTheirEnergyWhereverInAStepTheyFall) {
  // a step of 0.18 rad of a corner's swing, so that the corners slow the box by a third within the first step
  for (const bool others : {true, false})  // by groups of points; by itself, as boxes that touch nothing but the ground
    for (const int interval : {1, 2}) {
      if (!others && interval > 1) continue;  // they are looked at in every step
      double worst = 0;
      for (int i = 0; i < 24; ++i) {
        Model m;
        m.contact = make_contact(0, 0.5);
        m.contact.bodies = others;
        Body box = make_box("box", 2400, {0.5, 0.4, 0.6}, {0, 0, 0.6 + 1 + 0.002 * i});
        if (i % 2) box.X_WB.q = exp_rotation({0.1, 0.2 + 0.01 * i, 0}), box.X_WB.p.z += 0.2;
        box.v_WB = {0, 0, -8};
        add_body(m, box);
        // what is left at rest; on the way the balance swings with the middle of a step
        Options o = free_options(0.6, 0.7e-3, interval);
        double left = 0, moved = 0;
        o.on_frame = [&](const View& v) {
          left = v.energy.residual;
          moved = std::max(moved, v.energy.kinetic);
        };
        (void)run(m, o);
        worst = std::max(worst, std::abs(left) / moved);
      }
      RecordProperty(std::string(others ? "groups_" : "alone_") + std::to_string(interval), std::to_string(worst));
      EXPECT_LT(worst, interval == 1 ? 5e-5 : 2e-3) << others << " " << interval;
    }
}

TEST(ContactLookPhysics, HeapsKeepTheirEnergy) {
  for (const double friction : {0.0, 0.5}) {
    Model m;
    m.contact = make_contact(0, friction);
    for (int layer = 0; layer < 3; ++layer)
      for (int i = 0; i < 9; ++i) {
        Body b = make_box("b" + std::to_string(m.bodies.size()), 150, {0.2, 0.2, 0.2},
                          {0.6 * (i % 3) + 0.1 * (layer % 3), 0.6 * (i / 3) + 0.1 * (layer % 2), 0.5 + 0.6 * layer});
        b.X_WB.q = exp_rotation({0.3 * std::sin(3.0 * layer + i), 0.3 * std::cos(2.0 * layer + i), 0.5 * layer});
        add_body(m, b);
      }
    for (const int interval : {1, 2}) {
      const Summary s = run(m, free_options(1.5, 2.5e-4, interval));
      RecordProperty("friction_" + std::to_string(friction) + "_" + std::to_string(interval),
                     std::to_string(s.energy_error));
      EXPECT_LT(s.energy_error, 1e-4) << friction << " " << interval;
    }
  }
}

TEST(ContactLookPhysics, LinksThatEndBetweenLooksLeaveNeighboursInPeace) {
  // two boxes that fall together, 2 cm in each other, until what holds them lets go in one step or the next
  constexpr double step = 5e-4;
  for (int i = 0; i < 4; ++i) {
    Model m;
    m.contact = make_contact(0, 0.5);
    m.contact.ground = false;
    for (const double x : {0.0, 0.98}) {
      Body b = make_box(x > 0 ? "right" : "left", 1000, {0.5, 0.4, 0.3}, {x, 0, 0});
      b.v_WB = {0, 0, -12};
      add_body(m, b);
    }
    Body still = make_box("still", 1000, {0.5, 0.4, 0.3}, {5, 0, 0});  // ways count against what others do
    still.fixed = true;
    add_body(m, still);
    Joint j;
    j.name = "link";
    j.parent = BodyId{0}, j.child = BodyId{1};
    j.X_PF.p = {0.49, 0, 0}, j.X_CM.p = {-0.49, 0, 0};
    m.joints.push_back(j);
    Event& e = m.events.emplace_back();
    e.time = 0.1 + i * step;
    e.name = "let go";
    Action& a = e.actions.emplace_back();
    a.kind = Action::Kind::ReleaseJoint;
    a.joint = JointId{0};
    Options o = free_options(0.4, step, 2);
    View last;
    o.on_frame = [&](const View& v) { last = v; };
    const Summary s = run(m, o);
    EXPECT_LT(norm(last.v_WB[1] - last.v_WB[0]), 1e-9) << i;
    EXPECT_LT(s.energy_error, 1e-9) << i;
  }
}

}  // namespace
}  // namespace topple::mbs
