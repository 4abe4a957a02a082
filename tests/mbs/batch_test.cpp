// Samples in lanes give the bits of runs alone.

#include "mbs/batch.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <map>
#include <mutex>

#include "base/error.h"
#include "mbs/lanes.h"
#include "models.h"

namespace topple::mbs {
namespace {

/// Thirteen towers that differ in masses, limits, the time of the cut and so in their steps and fates.
std::vector<Variation> make_variations() {
  std::vector<Variation> out;
  for (int i = 0; i < 13; ++i)
    out.push_back([i](Model& m) {
      for (size_t b = 0; b < m.bodies.size(); ++b) {
        const double f = 1 + 0.02 * i + 0.003 * static_cast<double>(b);
        m.bodies[b].mass *= f;
        m.bodies[b].inertia = f * m.bodies[b].inertia;
      }
      m.laws.edit(0, [i](ZoneLaw& law) {
        for (double& x : law.moment_z.positive) x *= 1 + 0.1 * i;
      });
      m.events[0].time = 0.05 + 0.01 * (i % 3);
      if (i == 4) m.events.clear();  // stands
      if (i == 7) m.gravity.z = -3;
    });
  return out;
}

Options make_options() {
  Options o;
  o.duration = 0.8;
  o.frame_interval = 0.05;
  o.equilibrium = false;
  return o;
}

TEST(Batch, SampleHasTheBitsOfItsRunAlone) {
  const Model base = test::make_tower();
  const std::vector<Variation> variations = make_variations();
  std::vector<std::vector<std::uint64_t>> alone(variations.size());
  std::vector<int> happenings(variations.size(), 0);
  std::vector<Summary> ends;
  for (size_t i = 0; i < variations.size(); ++i) {
    Model m = base;
    variations[i](m);
    Options o = make_options();
    o.on_frame = [&](const View& v) { alone[i].push_back(test::hash_of(v)); };
    o.on_happening = [&](const Happening&) { ++happenings[i]; };
    ends.push_back(run(m, o));
  }
  EXPECT_NE(alone[0].back(), alone[1].back());
  EXPECT_GT(happenings[0], 5);
  for (const int threads : {1, 3}) {
    // in their order, and turned round so that every sample has another lane and other neighbours
    for (const bool turned : {false, true}) {
      std::vector<Variation> order = variations;
      if (turned) std::reverse(order.begin(), order.end());
      const auto sample_of = [&](size_t i) { return turned ? order.size() - 1 - i : i; };
      std::vector<std::vector<std::uint64_t>> together(order.size());
      std::vector<int> said(order.size(), 0);
      BatchOptions o;
      o.run = make_options();
      o.threads = threads;
      o.on_frame = [&](size_t i, const View& v) { together[sample_of(i)].push_back(test::hash_of(v)); };
      o.on_happening = [&](size_t i, const Happening&) { ++said[sample_of(i)]; };
      const std::vector<Summary> out = run_batch(base, order, o);
      ASSERT_EQ(out.size(), ends.size());
      for (size_t i = 0; i < ends.size(); ++i) {
        const Summary &a = ends[sample_of(i)], &b = out[i];
        EXPECT_EQ(a.ending, b.ending) << b.message;
        EXPECT_EQ(a.steps, b.steps);
        EXPECT_EQ(a.time, b.time);
        EXPECT_EQ(a.energy_error, b.energy_error);
        EXPECT_EQ(a.joint_drift, b.joint_drift);
      }
      EXPECT_EQ(together, alone) << threads << " threads, turned " << turned;
      EXPECT_EQ(said, happenings);
    }
  }
}

TEST(Batch, ElementsThatHoldInOneSampleAloneStayInTheSums) {
  // one element is cut in all samples, another one in all but the third
  Model base = test::make_tower();
  Event second = base.events[0];
  second.name = "second";
  second.time = 0.08;  // before the first, after which sums are made anew
  second.actions[0].element = {3};
  base.events.push_back(second);
  std::vector<Variation> variations;
  for (int i = 0; i < 4; ++i)
    variations.push_back([i](Model& m) {
      m.bodies[1].mass *= 1 + 0.01 * i;
      if (i == 2) m.events[1].time = 10;
    });
  std::vector<std::uint64_t> alone(4), together(4);
  Options run_options = make_options();
  run_options.duration = 0.3;
  for (size_t i = 0; i < 4; ++i) {
    Model m = base;
    variations[i](m);
    Options o = run_options;
    o.on_frame = [&](const View& v) { alone[i] = test::hash_of(v); };
    (void)run(m, o);
  }
  BatchOptions o;
  o.run = run_options;
  o.on_frame = [&](size_t i, const View& v) { together[i] = test::hash_of(v); };
  (void)run_batch(base, variations, o);
  EXPECT_EQ(together, alone);
}

TEST(Batch, ConstantsAreSharedAgainAndStayWhatTheyAre) {
  Lanes l;
  l.W = 4;
  l.is_batch = true;
  l.allocate_elements(200);
  for (size_t slot = 0; slot < 800; ++slot) l.clear_slot(slot);
  l.share_constants();
  const size_t few = l.uses.size();
  const auto value = [](size_t slot, int f) { return static_cast<double>((slot % 4 + 1) * static_cast<size_t>(f)); };
  // every change of one lane makes a vector of its own, until there are many
  for (size_t slot = 0; slot < 800; ++slot)
    for (const int f : {kernel::kMarkerA, kernel::kStiffness, kernel::kShearScale}) l.set(slot, f, value(slot, f));
  const size_t many = l.uses.size();
  EXPECT_GE(many, 600U);
  l.share_again();
  EXPECT_LE(l.uses.size(), few + 3);
  for (size_t slot = 0; slot < 800; ++slot)
    for (const int f : {kernel::kMarkerA, kernel::kStiffness, kernel::kShearScale})
      EXPECT_EQ(l.field(slot, f), value(slot, f));
  // what was broken has neither stiffness nor bounds, and keeps its markers
  l.still_slot(5);
  EXPECT_EQ(l.field(5, kernel::kStiffness), 0);
  EXPECT_EQ(l.field(5, kernel::kMarkerA), value(5, kernel::kMarkerA));
  EXPECT_EQ(l.field(4, kernel::kStiffness), value(4, kernel::kStiffness));
  EXPECT_TRUE(std::isinf(l.field(5, kernel::kMostTurn)));
}

Model make_hinged(bool is_planar, bool about_y) {
  Model m;
  m.is_planar = is_planar;
  m.contact.ground = m.contact.bodies = false;
  add_body(m, test::make_box("bar", 1, {0.5, 0.1, 0.1}, {1, 0, 0}));
  Joint j;
  j.kind = Joint::Kind::Revolute;
  j.parent = kGround, j.child = {0};
  j.X_PF.q = j.X_CM.q = to_quat(about_y ? Mat3::from_columns({1, 0, 0}, {0, 0, -1}, {0, 1, 0})
                                        : Mat3::from_columns({1, 0, 0}, {0, 0, 1}, {0, -1, 0}));
  j.X_CM.p = {-1, 0, 0};
  add_joint(m, j);
  return m;
}

TEST(Batch, RefusesVariationsThatAddOrTurnWhatLanesShare) {
  const auto added = [](Model& m) {
    RotationalElement r;
    r.joint = {0};
    r.stiffness = 100;
    m.rotational_elements.push_back(r);
  };
  const auto turned = [](Model& m) { m.joints = make_hinged(true, false).joints; };
  const auto same = [](Model&) {};
  BatchOptions o;
  o.run = make_options();
  o.run.duration = 0.1;
  for (const bool is_planar : {false, true}) {
    const Model m = make_hinged(is_planar, true);
    EXPECT_THROW((void)run_batch(m, {same, added}, o), InputError);
    EXPECT_THROW((void)run_batch(m, {added, same}, o), InputError);
    // in a plane the kernel of hinges about y is another one
    if (is_planar) {
      EXPECT_THROW((void)run_batch(m, {same, turned}, o), InputError);
    } else {
      EXPECT_EQ(run_batch(m, {same, turned}, o).size(), 2U);
    }
  }
  // the elements of rotational ones have places in the lanes, too
  Model m = make_hinged(false, true);
  added(m);
  m.joints.push_back(m.joints[0]);
  m.joints[1].child = add_body(m, m.bodies[0]);
  const auto other_joint = [](Model& varied) { varied.rotational_elements[0].joint = {1}; };
  EXPECT_THROW((void)run_batch(m, {same, other_joint}, o), InputError);
}

TEST(Batch, SampleThatEndsEarlyDisturbsNoOther) {
  const Model base = test::make_tower();
  std::vector<Variation> variations(3);
  variations[1] = [](Model& m) { m.gravity = {0, 0, -9.81e200}; };  // not for long
  std::vector<std::uint64_t> last(3);
  BatchOptions o;
  o.run = make_options();
  o.on_frame = [&](size_t i, const View& v) { last[i] = test::hash_of(v); };
  const std::vector<Summary> out = run_batch(base, variations, o);
  EXPECT_EQ(out[0].ending, Summary::Ending::TimeLimit);
  EXPECT_EQ(out[1].ending, Summary::Ending::Diverged) << out[1].message;
  EXPECT_EQ(out[2].ending, Summary::Ending::TimeLimit);
  EXPECT_EQ(last[0], last[2]);
}

TEST(Batch, EquilibriaOneAfterTheOtherAreThoseOfRunsAlone) {
  Model base = test::make_tower();
  for (int b = 0; b < static_cast<int>(base.bodies.size()); ++b) {
    Load l;
    l.name = "lift of " + std::to_string(b), l.body = {b};
    base.loads.push_back(l);
  }
  std::vector<Variation> variations;
  for (int i = 0; i < 6; ++i)
    variations.push_back([i](Model& m) {
      m.bodies[2].mass *= 1 + 0.1 * i;
      if (i == 1) m.gravity.z *= 1000;       // more than it bears
      if (i == 2) m.bodies[1].fixed = true;  // other unknowns
      if (i == 3)
        for (ZoneElement& e : m.elements) e.translational_stiffness.x *= 0.5;
      if (i == 5)  // all but balanced from the start
        for (Load& l : m.loads)
          l.force.z = -(1 - 1e-8) * m.gravity.z * m.bodies[static_cast<size_t>(l.body.index)].mass;
    });
  Options run_options = make_options();
  run_options.equilibrium = true;
  run_options.duration = 0.2;
  std::vector<std::uint64_t> alone(6), together(6);
  std::vector<Summary> ends;
  for (size_t i = 0; i < 6; ++i) {
    Model m = base;
    variations[i](m);
    Options o = run_options;
    o.on_frame = [&](const View& v) { alone[i] = test::hash_of(v); };
    ends.push_back(run(m, o));
  }
  BatchOptions o;
  o.run = run_options;
  o.on_frame = [&](size_t i, const View& v) { together[i] = test::hash_of(v); };
  const std::vector<Summary> out = run_batch(base, variations, o);
  EXPECT_EQ(together, alone);
  for (size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(out[i].ending, i == 1 ? Summary::Ending::NoEquilibrium : Summary::Ending::TimeLimit) << out[i].message;
    EXPECT_EQ(out[i].message, ends[i].message);
    EXPECT_EQ(out[i].equilibrium_residual, ends[i].equilibrium_residual);
    EXPECT_EQ(out[i].equilibrium_iterations, ends[i].equilibrium_iterations);
  }
  EXPECT_NE(alone[0], alone[2]);
}

TEST(Batch, RefusesAnotherBuild) {
  const Model base = test::make_tower();
  EXPECT_THROW(run_batch(base, {[](Model& m) { m.elements.pop_back(); }}, {}), InputError);
  EXPECT_THROW(run_batch(base, {[](Model& m) { m.elements[2].a = {4}; }}, {}), InputError);
  EXPECT_THROW(run_batch(base, {[](Model& m) { m.bodies[0].mass = -1; }}, {}), InputError);
}

TEST(Batch, ReportsProgressAndCanBeCancelled) {
  const Model base = test::make_tower();
  std::atomic<bool> cancel = false;
  double done = 0;
  BatchOptions o;
  o.run = make_options();
  o.progress.cancel = &cancel;
  o.progress.report = [&](double finished, double) { done = finished; };
  o.on_end = [&](size_t, const Summary&) { cancel = true; };
  const std::vector<Summary> out = run_batch(base, std::vector<Variation>(20), o);
  EXPECT_GE(done, 1);
  EXPECT_EQ(out[19].ending, Summary::Ending::Cancelled);
}

}  // namespace
}  // namespace topple::mbs
