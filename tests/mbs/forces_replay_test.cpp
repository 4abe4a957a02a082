// The same bits again with every force element: from snapshots, and another run.
#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "mbs/batch.h"
#include "models.h"

namespace topple::mbs {
namespace {

using test::make_box;

/// Springs, torsion springs, bushings with dampers of all laws, loads that come and go, triggers that wait, some that
/// fire, elements that break, a hinge that is released, ground to fall on.
Model make_everything() {
  Model m;
  Characteristic cubic, corner, drag;
  cubic.kind = drag.kind = Characteristic::Kind::Polynomial;
  cubic.coefficients = {0, 4e4, 0, 3e6};
  drag.coefficients = {0, 300, 0, 40};
  corner.kind = Characteristic::Kind::Table;
  corner.x = {-1, -0.01, 0.01, 1};
  corner.f = {-6e3, -2e3, 2e3, 6e3};
  BodyId below = kGround;
  for (int i = 0; i < 5; ++i) {
    const BodyId b = add_body(m, make_box("b" + std::to_string(i), 200, {0.3, 0.2, 0.3}, {0.05 * i, 0, 0.5 + 0.8 * i}));
    if (i == 3) {
      Joint j;
      j.name = "hinge";
      j.kind = Joint::Kind::Revolute;
      j.parent = below;
      j.child = b;
      j.X_PF = {{0, 0, 0.4}, to_quat(Mat3::from_columns({0, 0, 1}, {1, 0, 0}, {0, 1, 0}))};
      j.X_CM = {{-0.05, 0, -0.4}, j.X_PF.q};
      RotationalSpring r;
      r.name = "r";
      r.joint = add_joint(m, j);
      r.spring = corner;
      r.damper.rate = 200;
      m.rotational_springs.push_back(r);
    } else {
      Bushing k;
      k.name = "k" + std::to_string(i);
      k.a = below;
      k.b = b;
      k.X_AF.p = i == 0 ? Vec3{0, 0, 0.1} : Vec3{0.05, 0, 0.4};
      k.X_BM.p = {0, 0, -0.4};
      for (int c = 0; c < 6; ++c) {
        k.spring[c].rate = c < 3 ? 1e6 : 1e5;
        k.damper[c].rate = c < 3 ? 4e3 : 400;
      }
      if (i == 1) k.spring[4] = corner, k.damper[4] = drag;
      if (i == 4) k.strength[4] = 2000;
      m.bushings.push_back(k);
    }
    SpringDamper s;
    s.name = "s" + std::to_string(i);
    s.a = kGround;
    s.b = b;
    s.p_A = {3, 0, 0};
    s.free_length = norm(m.bodies.back().X_WB.p - s.p_A);
    s.spring = cubic;
    s.damper = drag;
    if (i == 2) s.tension_strength = 3.5e3;
    m.springs.push_back(s);
    below = b;
  }
  Load gust;
  gust.name = "gust";
  gust.body = {4};
  gust.p_B = {0, 0, 0.3};
  gust.force = {-6e3, 300, 0};
  gust.time = {0, 0.3, 0.5, 2};
  gust.factor = {0, 1, 0.4, 1};
  Load follower = gust;
  follower.name = "follower";
  follower.body = {2};
  follower.follows_body = true;
  follower.time = follower.factor = {};
  follower.torque = {0, 50, 20};
  m.loads = {gust, follower};
  const auto event = [&](const char* name, double time, std::vector<Trigger> triggers, Action::Kind kind, int index) {
    Event e;
    e.name = name;
    e.time = time;
    e.triggers = std::move(triggers);
    e.actions.emplace_back();
    e.actions[0].kind = kind;
    e.actions[0].index = index;
    if (kind == Action::Kind::ReleaseJoint) e.actions[0].joint = {index};
    m.events.push_back(e);
  };
  event("push", 0.1234, {}, Action::Kind::ApplyLoad, 1);
  event("no push", 0.9, {}, Action::Kind::RemoveLoad, 1);
  event("never", 0, {{{Quantity::Kind::Position, 0}, 2, 50, true}}, Action::Kind::RemoveSpring, 0);
  event("let go", 0.2, {{{Quantity::Kind::TorsionAngle, 0}, 3, 0.004, true}}, Action::Kind::ReleaseJoint, 0);
  event("fall", 0.4, {{{Quantity::Kind::Position, 4}, 0, -0.15, false}}, Action::Kind::RemoveBushing, 1);
  event("untie", 0.4, {{{Quantity::Kind::SpringLength, 4}, 0, 4.7, true}}, Action::Kind::RemoveSpring, 4);
  return m;
}

struct Bits {
  std::uint64_t h = 1469598103934665603ULL;
  void add(double x) {
    std::uint64_t bits;
    std::memcpy(&bits, &x, sizeof bits);
    h = (h ^ bits) * 1099511628211ULL;
  }
};

std::uint64_t hash_of(const View& v) {
  Bits b;
  for (const Pose& X : v.X_WB)
    for (const double x : {X.p.x, X.p.y, X.p.z, X.q.w, X.q.x, X.q.y, X.q.z}) b.add(x);
  for (const auto* list : {&v.spring_force, &v.spring_length, &v.torsion_angle, &v.torsion_torque})
    for (const double x : *list) b.add(x);
  for (const auto* list : {&v.bushing_force, &v.bushing_moment, &v.bushing_rotation})
    for (const Vec3& x : *list) b.add(x.x), b.add(x.y), b.add(x.z);
  for (const double x : {v.energy.residual, v.energy.loads, v.energy.damping, v.energy.plastic, v.energy.removed,
                         v.energy.friction, v.ground_force.z})
    b.add(x);
  return b.h;
}

TEST(ForcesReplay, GoesOnWithTheSameBitsFromAnyStep) {
  const Model m = make_everything();
  Options o;
  o.equilibrium = false;
  o.step = 2e-4;
  int broken = 0, fired = 0, touched = 0, released = 0;
  o.on_happening = [&](const Happening& h) {
    broken += h.kind == Happening::Kind::SpringBroken || h.kind == Happening::Kind::BushingBroken ||
              h.kind == Happening::Kind::RotationalSpringBroken;
    fired += h.kind == Happening::Kind::EventFired;
    touched += h.kind == Happening::Kind::GroundContact;
    released += h.kind == Happening::Kind::JointReleased;
  };
  constexpr int steps = 8000, every = 700;
  Simulation whole(m, o);
  o.on_happening = nullptr;
  Simulation other(m, o);
  std::vector<std::vector<std::byte>> kept;
  for (int i = 0; i < steps; ++i) {
    if (i % every == 0) kept.push_back(whole.snapshot());
    ASSERT_TRUE(whole.advance_step()) << i;
  }
  const std::uint64_t end = hash_of(whole.calc_view());
  // all of it took part
  EXPECT_EQ(fired, 5);
  EXPECT_GE(broken, 3);
  EXPECT_EQ(released, 1);
  EXPECT_GT(touched, 0);
  const Energy e = whole.calc_view().energy;
  EXPECT_NE(e.loads, 0);
  EXPECT_GT(e.damping, 0);
  EXPECT_GT(e.plastic, 0);
  EXPECT_GT(e.removed, 0);
  EXPECT_LT(std::abs(e.residual), 2e-3 * e.released);
  for (size_t k = 0; k < kept.size(); ++k) {
    other.restore(kept[k]);
    for (size_t i = every * k; i < steps; ++i) ASSERT_TRUE(other.advance_step());
    EXPECT_EQ(hash_of(other.calc_view()), end) << "snapshot " << k;
  }
}

TEST(ForcesReplay, GoesOnWithTheSameBitsWhileTheStepFollowsTheModel) {
  Model m = make_everything();
  m.contact.contact_frequency = 20;  // so that springs bound the step
  Options o;
  o.equilibrium = false;
  Simulation whole(m, o), other(m, o);
  std::vector<std::vector<std::byte>> kept;
  constexpr size_t steps = 800, every = 100;
  double least = 1, most = 0;
  for (size_t i = 0; i < steps; ++i) {
    if (i % every == 0) kept.push_back(whole.snapshot());
    const double before = whole.time();
    ASSERT_TRUE(whole.advance_step()) << i;
    least = std::min(least, whole.time() - before);
    most = std::max(most, whole.time() - before);
  }
  EXPECT_GT(most, 1.001 * least);
  const std::uint64_t end = hash_of(whole.calc_view());
  for (size_t k = 0; k < kept.size(); ++k) {
    other.restore(kept[k]);
    for (size_t i = every * k; i < steps; ++i) ASSERT_TRUE(other.advance_step());
    EXPECT_EQ(hash_of(other.calc_view()), end) << "snapshot " << k;
  }
}

TEST(ForcesReplay, GivesTheSameBitsAfterTheEquilibrium) {
  Model m = make_everything();
  m.events.resize(2);
  std::uint64_t h[2] = {0, 0};
  for (std::uint64_t& x : h) {
    Options o;
    o.duration = 0.5;
    o.on_frame = [&](const View& v) { x = 31 * x + hash_of(v); };
    const Summary s = run(m, o);
    ASSERT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
  }
  EXPECT_EQ(h[0], h[1]);
}

TEST(ForcesReplay, GivesTheSameBitsInABatch) {
  const auto variation = [](int i) {
    return [i](Model& m) {
      m.loads[0].force.x *= 1 + 0.1 * i;
      m.springs[2].tension_strength *= 1 + 0.2 * i;
      m.bushings[0].damper[4].rate *= 1 + i;
    };
  };
  constexpr int samples = 5;
  BatchOptions b;
  b.run.equilibrium = false;
  b.run.duration = 0.6;
  std::vector<std::uint64_t> together(samples, 0), alone(samples, 0);
  b.on_frame = [&](size_t i, const View& v) { together[i] = 31 * together[i] + hash_of(v); };
  std::vector<Variation> variations;
  for (int i = 0; i < samples; ++i) variations.push_back(variation(i));
  (void)run_batch(make_everything(), variations, b);
  for (int i = 0; i < samples; ++i) {
    Model m = make_everything();
    variation(i)(m);
    Options o = b.run;
    o.on_frame = [&](const View& v) { alone[i] = 31 * alone[i] + hash_of(v); };
    (void)run(m, o);
    EXPECT_EQ(alone[i], together[i]) << i;
  }
  EXPECT_NE(alone[0], alone[1]);
}

}  // namespace
}  // namespace topple::mbs
