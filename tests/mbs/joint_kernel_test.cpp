// Pairs of bodies in lanes: against the general solver, against each other and in batches.
#include "mbs/joint_kernel.h"

#include <gtest/gtest.h>

#include <cstring>

#include "mbs/batch.h"
#include "mbs/system.h"
#include "mechanisms.h"
#include "models.h"

namespace topple::mbs {
namespace {

using test::hash_of;

constexpr Joint::Kind kPaired[] = {Joint::Kind::Fixed, Joint::Kind::Spherical, Joint::Kind::Universal,
                                   Joint::Kind::Revolute};

/// Pairs of every kind that the kernel knows, `each` of each; every third hangs on the ground, the others fly; and a
/// chain of three that the kernel leaves alone.
Model make_pairs(int each) {
  Model m = test::empty_model();
  const auto add_bar = [&](const Vec3& from, const Vec3& to, double mass, const Vec3& w, const Vec3& v) {
    Body b = test::make_rod("b" + std::to_string(m.bodies.size()), mass, from, to);
    const double I = b.inertia(1, 1);
    b.inertia = Mat3::diagonal({0.3 * I, I, 1.1 * I});
    b.w_WB = w;
    b.v_WB = v;
    return add_body(m, b);
  };
  int number = 0;
  for (const Joint::Kind kind : kPaired)
    for (int i = 0; i < each; ++i, ++number) {
      const Vec3 at{3.0 * number, 0, 5}, axis{0.2 + 0.1 * i, 1, 0.3};
      const Vec3 w{0.5, 1 - 0.2 * i, 0.7};
      const Vec3 end = at + Vec3{0.4, 0.2 * i, 1};
      if (i % 3 == 2 && kind != Joint::Kind::Fixed) {
        const BodyId b = add_bar(at, end, 2 + i, w, cross(w, 0.5 * (end - at)));
        test::join(m, kind, kGround, b, at, test::along(axis));
        continue;
      }
      const Vec3 far = at + Vec3{0.1, 1, -0.3};
      const BodyId a = add_bar(at, end, 2 + i, w, cross(w, 0.5 * (end - at)));
      const BodyId b = add_bar(at, far, 1 + 0.5 * i, w, cross(w, 0.5 * (far - at)));
      test::join(m, kind, a, b, at, test::along(axis));
    }
  BodyId before = kGround;
  for (int i = 0; i < 3; ++i) {
    const BodyId b = add_bar({-3 + 0.5 * i, 0, 0}, {-2.5 + 0.5 * i, 0, 0}, 1, {}, {});
    test::join(m, Joint::Kind::Revolute, before, b, {-3 + 0.5 * i, 0, 0}, test::along({0.1, 1, 0}));
    before = b;
  }
  return m;
}

Options options_of(double step) {
  Options o;
  o.equilibrium = false;
  o.step = step;
  return o;
}

/// Leaves the kernel without joints.
void do_without_kernel(System& s) {
  for (JointCluster& c : s.clusters) c.is_pair = false;
  s.paired.clear();
  s.pair_slot.assign(s.joints.size(), Lanes::kNoSlot);
  s.lanes->pairs.blocks = 0;
}

double find_distance(const System& a, const System& b) {
  double most = 0;
  for (size_t i = 0; i < a.B; ++i) {
    const Vec3 p = a.state.p[i], q = b.state.p[i];
    most = std::max(most, norm(p - q));
    most = std::max(most, norm(log_rotation(conjugate(a.state.q[i]) * Quat(b.state.q[i]))));
  }
  return most;
}

TEST(JointKernel, MovesBodiesAsTheGeneralSolverDoes) {
  const Model m = make_pairs(3);
  System a(m, options_of(1e-3)), b(m, options_of(1e-3));
  a.start(), b.start();
  ASSERT_TRUE(a.advance_step() && b.advance_step());
  EXPECT_EQ(a.paired.size(), 12U);
  do_without_kernel(b);
  double most = 0, force = 0, moment = 0;
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(a.advance_step() && b.advance_step());
    for (size_t j = 3; j < a.joints.size(); ++j) {
      force = std::max(force, norm(a.state.joint[j].force - b.state.joint[j].force));
      moment = std::max(moment, norm(a.state.joint[j].moment - b.state.joint[j].moment));
      most = std::max(most, norm(a.state.joint[j].force));
      EXPECT_NEAR(a.state.joint[j].angle, b.state.joint[j].angle, 1e-8);
    }
  }
  ASSERT_GT(most, 10);
  // gaps of 1e-12 m closed in 1 ms are forces of 1e-6 N
  EXPECT_LT(force, 1e-5);
  EXPECT_LT(moment, 1e-5);
  // but for welds, which both solve with the square of the step
  EXPECT_LT(find_distance(a, b), 1e-5);
  for (size_t i = 6; i < a.B; ++i) {
    const Vec3 p = a.state.p[i], q = b.state.p[i];
    EXPECT_LT(norm(p - q), 1e-8) << i;
  }
}

TEST(JointKernel, GivesTheSameBitsWhateverTheWidth) {
  const Model m = make_pairs(3);
  System wide(m, options_of(5e-4)), single(m, options_of(5e-4), 1);
  ASSERT_EQ(single.lanes->W, 1U);
  wide.start(), single.start();
  for (int i = 0; i < 500; ++i) {
    if (i == 250) wide.release_joint(4, "released"), single.release_joint(4, "released");
    ASSERT_TRUE(wide.advance_step() && single.advance_step());
  }
  for (size_t b = 0; b < wide.B; ++b) {
    EXPECT_EQ(Vec3(wide.state.p[b]), Vec3(single.state.p[b])) << b;
    EXPECT_EQ(Quat(wide.state.q[b]), Quat(single.state.q[b])) << b;
    EXPECT_EQ(Vec3(wide.state.L[b]), Vec3(single.state.L[b])) << b;
    EXPECT_EQ(Vec3(wide.state.w[b]), Vec3(single.state.w[b])) << b;
    EXPECT_EQ(Vec3(wide.joint_torque[b]), Vec3(single.joint_torque[b])) << b;
  }
}

TEST(JointKernel, LeavesWhatTurnsTooFastToTheGeneralSolver) {
  // half a radian a step: two discs on one shaft's hinge, spinning together, next to a quiet pair of the same kind
  for (const Joint::Kind kind : {Joint::Kind::Revolute, Joint::Kind::Fixed}) {
    Model m = test::empty_model();
    m.gravity = {};
    for (int pair = 0; pair < 2; ++pair) {
      const double spin = pair == 0 ? 500 : 1;
      for (int i = 0; i < 2; ++i) {
        Body b;
        b.name = "disc " + std::to_string(2 * pair + i);
        b.inertia = Mat3::diagonal({1, 1, 2});
        b.X_WB.p = {5.0 * pair, 0, 1.0 * i};
        b.w_WB = {0, 0, spin};
        add_body(m, b);
      }
      test::join(m, kind, {2 * pair}, {2 * pair + 1}, {5.0 * pair, 0, 0.5}, {});
    }
    System s(m, options_of(1e-3));
    s.start();
    for (int i = 0; i < 1000; ++i) ASSERT_TRUE(s.advance_step());
    EXPECT_EQ(s.lanes->pairs.unfit.size(), 1U);
    for (size_t b = 0; b < 4; ++b) {
      const double turned = 2 * std::atan2(s.state.q[b].operator Quat().z, s.state.q[b].operator Quat().w);
      const double wanted = b < 2 ? 500 : 1;
      EXPECT_NEAR(std::remainder(turned - wanted, 2 * 3.14159265358979323846), 0, 1e-9);
      const Vec3 p = s.state.p[b];
      EXPECT_LT(norm(p - m.bodies[b].X_WB.p), 1e-10);
    }
    EXPECT_LT(s.state.largest_drift, 1e-11);
  }
}

TEST(JointKernelReplay, SamplesOfABatchHaveTheBitsOfTheirRuns) {
  // masses, spins and limits differ: joints of some samples let go, one turns too fast for the kernel
  const Model m = make_pairs(2);
  std::vector<Variation> variations;
  for (int k = 0; k < 11; ++k)
    variations.push_back([k](Model& x) {
      for (Body& b : x.bodies) b.mass *= 1 + 0.05 * k;
      for (size_t j = 0; j < x.joints.size(); ++j)
        if ((static_cast<int>(j) + k) % 3 == 0) x.joints[j].tension_limit = x.joints[j].shear_limit = 15 + k;
      if (k == 4)
        for (size_t b = 0; b < 2; ++b) {
          x.bodies[b].w_WB = {0, 0, 900};
          x.bodies[b].v_WB = cross(x.bodies[b].w_WB, x.bodies[b].X_WB.p - Vec3{0, 0, 5});
        }
    });
  BatchOptions batch;
  batch.run = options_of(5e-4);
  batch.run.duration = 0.4;
  batch.run.frame_interval = 0.02;
  batch.threads = 2;
  std::vector<std::uint64_t> together(variations.size(), 0);
  std::vector<int> released(variations.size(), 0);
  batch.on_frame = [&](size_t sample, const View& v) { together[sample] = together[sample] * 31 + hash_of(v); };
  batch.on_happening = [&](size_t sample, const Happening& h) {
    released[sample] += h.kind == Happening::Kind::JointReleased;
  };
  (void)run_batch(m, variations, batch);
  EXPECT_GT(released[0], 0);
  for (size_t k = 0; k < variations.size(); ++k) {
    Model alone = m;
    variations[k](alone);
    Options o = batch.run;
    std::uint64_t hash = 0;
    int count = 0;
    o.on_frame = [&](const View& v) { hash = hash * 31 + hash_of(v); };
    o.on_happening = [&](const Happening& h) { count += h.kind == Happening::Kind::JointReleased; };
    (void)run(alone, o);
    EXPECT_EQ(hash, together[k]) << k;
    EXPECT_EQ(count, released[k]) << k;
  }
}

}  // namespace
}  // namespace topple::mbs
