// What goes within milliseconds, and the bars that stay.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "base/error.h"
#include "explicit_mesh.h"

namespace topple::fem {
namespace {

constexpr double kMass = 1000;  // of the block [kg]

/// A rigid block of a cubic metre without weight whose top hangs on a bar of 2 m, held at (0.5, 0.5, 3).
ExplicitModel make_hanging() {
  ExplicitModel model;
  add_brick(model, {0, 0, 0}, {1, 1, 1}, 1, 1, 1);
  model.materials = {make_explicit_elastic(kMass, 1e9, 0.2)};
  model.gravity = {};
  ExplicitBar bar;
  bar.a.place = {0.5, 0.5, 3};
  const std::vector<int> top = find_nodes(model, [](const Vec3& p) { return p.z > 0.99; });
  for (size_t k = 0; k < 4; ++k) bar.b.node[k] = top[k], bar.b.weight[k] = 0.25;
  bar.stiffness = 1e7, bar.yield = 2e4, bar.rupture = 3e4, bar.tears_at = 0.1;
  bar.shortening = {0, 0.1, 2}, bar.buckling = {1e4, 2e3, 2e3};
  model.bars = {bar};
  ExplicitRelease release;
  release.bars = {0};
  model.releases = {release};
  return model;
}

/// Runs until the speed along z changes its sign, or to the time; the block's place then [m].
double run_to_turn(ExplicitSystem& system, double until) {
  const bool rises = system.calc_momentum().z > 0;
  while (system.time() < until && (system.calc_momentum().z > 0) == rises)
    EXPECT_EQ(system.advance(system.time() + system.step()), ExplicitEnding::ReachedTime);
  return system.calc_centre_of_mass().z - 0.5;
}

TEST(ExplicitReleasePhysics, ABarYieldsAndHardensWithItsWork) {
  ExplicitSystem system(make_hanging(), {});
  system.release(0);
  // elastic work and 60 mm of hardening: Fy s + ½ H s² with H = 1e5 N/m, and F²/2k
  const double s = 0.06, force = 2e4 + 1e5 * s;
  const double work = 2e4 * s + 0.5 * 1e5 * s * s + force * force / 2e7;
  system.set_velocity({0, 0, -std::sqrt(2 * work / kMass)});
  EXPECT_NEAR(run_to_turn(system, 1), -(s + force / 1e7), 0.002 * s);
  const ExplicitEnergy energy = system.calc_energy();
  EXPECT_NEAR(energy.residual(), 0, 1e-3 * work);
  EXPECT_NEAR(energy.plastic, work - force * force / 2e7, 0.002 * work);
  EXPECT_NEAR(energy.elastic, force * force / 2e7, 0.05 * force * force / 2e7);
}

TEST(ExplicitReleasePhysics, ABarTearsAndHoldsNoMore) {
  ExplicitSystem system(make_hanging(), {});
  system.release(0);
  const double work = 0.5 * (2e4 + 3e4) * 0.1 + 3e4 * 3e4 / 2e7, fast = std::sqrt(2 * (work + 500) / kMass);
  system.set_velocity({0, 0, -fast});
  ASSERT_EQ(system.advance(0.3), ExplicitEnding::ReachedTime);
  EXPECT_NEAR(system.calc_momentum().z / kMass, -1, 0.01);  // what 500 J are
  EXPECT_NEAR(system.calc_energy().residual(), 0, 1e-3 * work);
  EXPECT_NEAR(system.calc_energy().elastic, 0, 0.02 * work);
}

TEST(ExplicitReleasePhysics, ABarBucklesAndComesBackWithoutForce) {
  ExplicitSystem system(make_hanging(), {});
  system.release(0);
  // 50 mm: from 10 to 6 kN
  const double work = 0.5 * (1e4 + 6e3) * 0.05;
  system.set_velocity({0, 0, std::sqrt(2 * work / kMass)});
  EXPECT_NEAR(run_to_turn(system, 1), 0.05, 0.001);
  // only what was elastic comes back
  const double slow = std::sqrt(6e3 * 6e3 / 1e7 / kMass);
  ASSERT_EQ(system.advance(system.time() + 0.1), ExplicitEnding::ReachedTime);
  EXPECT_NEAR(system.calc_momentum().z / kMass, -slow, 0.1 * slow);
  // until it is straight again: about that place it swings by less than 1 mm
  ASSERT_EQ(system.advance(system.time() + 0.05 / slow + 0.05), ExplicitEnding::ReachedTime);
  EXPECT_NEAR(system.calc_centre_of_mass().z, 0.5, 0.001);
  EXPECT_NEAR(system.calc_energy().residual(), 0, 1e-3 * work);
}

TEST(ExplicitReleasePhysics, BarsBearNothingBefore) {
  ExplicitSystem system(make_hanging(), {});
  system.set_velocity({0, 0, -1});
  ASSERT_EQ(system.advance(0.1), ExplicitEnding::ReachedTime);
  EXPECT_NEAR(system.calc_momentum().z, -kMass, 1e-9 * kMass);
}

constexpr double kStress = 5e6, kStrength = 1e7, kDuration = 0.02;

/// A column of 0.2 m that a heavy block above it presses to half of its strength; its middle is released.
ExplicitModel make_column() {
  ExplicitModel model;
  ExplicitMaterial plastic = make_explicit_elastic(2400, 3e10, 0.2);
  plastic.yield = {{0, kStrength, kStrength}};
  model.materials = {plastic, plastic, make_explicit_elastic(2400, 3e10, 0.2)};
  add_brick(model, {0, 0, 0}, {0.2, 0.2, 1.2}, 2, 2, 12);
  add_brick(model, {0, 0, 1.2}, {0.2, 0.2, 1.4}, 2, 2, 2, 2);
  // nodes of both bricks at 1.2 m are the same
  const std::vector<int> at = find_nodes(model, [](const Vec3& p) { return std::abs(p.z - 1.2) < 1e-9; });
  for (ExplicitElement& e : model.elements)
    for (int& n : e.node)
      for (const int first : at)
        if (norm(model.nodes[static_cast<size_t>(n)] - model.nodes[static_cast<size_t>(first)]) < 1e-9) {
          n = first;
          break;
        }
  ExplicitRelease release;
  release.duration = kDuration;
  for (size_t e = 0; e < model.elements.size(); ++e) {
    double z = 0;
    for (const int n : model.elements[e].node) z += model.nodes[static_cast<size_t>(n)].z / 8;
    if (z > 0.4 && z < 0.8) {
      model.elements[e].material = 1;
      release.elements.push_back(static_cast<int>(e));
    }
    if (z > 1.2) model.elements[e].mass_factor = kStress / (0.2 * 2400 * 9.81);
  }
  release.materials = {1};
  model.releases = {release};
  for (const int n : find_nodes(model, [](const Vec3& p) { return p.z < 1e-9; }))
    model.supports.push_back({n, true, true, true});
  return model;
}

TEST(ExplicitReleasePhysics, StrengthFallsLinearlyAndWhatItHeldFalls) {
  ExplicitSystem system(make_column(), {});
  ASSERT_TRUE(system.relax({}).converged);
  system.release(0);
  const double whole = system.calc_mass();
  const auto speed = [&] { return system.v(static_cast<int>(make_column().nodes.size()) - 1).z; };
  // half of it bears the block: until half of the time nothing falls
  ASSERT_EQ(system.advance(0.5 * kDuration), ExplicitEnding::ReachedTime);
  EXPECT_NEAR(speed(), 0, 0.004);
  // then what is missing grows linearly: v = g (t - t*)² / 2 (T - t*)
  ASSERT_EQ(system.advance(kDuration - 3 * system.step()), ExplicitEnding::ReachedTime);
  EXPECT_NEAR(speed(), -9.81 * 0.25 * kDuration, 0.004);
  EXPECT_TRUE(system.removals().empty());
  ASSERT_EQ(system.advance(kDuration + 0.01), ExplicitEnding::ReachedTime);
  EXPECT_EQ(system.removals().size(), 16U);
  for (const Removal& r : system.removals()) EXPECT_EQ(r.cause, RemovalCause::Charge);
  EXPECT_NEAR(whole - system.calc_mass(), 0.04 * 0.4 * 2400, 1e-6);
  EXPECT_NEAR(speed(), -9.81 * (0.25 * kDuration + 0.01), 0.006);
  const ExplicitEnergy energy = system.calc_energy();
  EXPECT_NEAR(energy.residual(), 0, 0.01 * energy.plastic);
}

TEST(ExplicitReleasePhysics, WhatIsWeakenedHoldsUntilThen) {
  ExplicitModel model = make_column();
  ExplicitMaterial weak = model.materials[1];
  weak.yield = {{0, 0.8 * kStress, 0.8 * kStress}};
  model.materials.push_back(weak);
  model.releases[0] = {};
  model.releases[0].duration = kDuration;
  model.releases[0].weakened = {{1, 3}};
  ExplicitSystem system(model, {});
  ASSERT_TRUE(system.relax({}).converged);
  system.release(0);
  const int top = static_cast<int>(model.nodes.size()) - 1;
  ASSERT_EQ(system.advance(kDuration), ExplicitEnding::ReachedTime);
  EXPECT_NEAR(system.v(top).z, 0, 0.004);
  ASSERT_EQ(system.advance(kDuration + 0.01), ExplicitEnding::ReachedTime);
  EXPECT_NEAR(system.v(top).z, -0.2 * 9.81 * 0.01, 0.005);
  EXPECT_TRUE(system.removals().empty());
}

std::vector<std::byte> run_column(int threads, bool interrupted) {
  ExplicitModel model = make_column();
  ExplicitBar bar = make_hanging().bars[0];
  const auto nearest = [&](double z) {
    std::array<int, 4> four{};
    size_t count = 0;
    for (const int n :
         find_nodes(model, [&](const Vec3& p) { return std::abs(p.z - z) < 1e-9 && p.x > 0.05 && p.y > 0.05; }))
      if (count < 4) four[count++] = n;
    return four;
  };
  bar.a.node = nearest(0.4), bar.b.node = nearest(0.8);
  bar.a.weight = bar.b.weight = {0.1, 0.2, 0.3, 0.4};
  model.bars = {bar};
  model.releases[0].bars = {0};
  ExplicitOptions options;
  options.threads = threads;
  ExplicitSystem system(model, options);
  EXPECT_TRUE(system.relax({}).converged);
  system.release(0);
  EXPECT_EQ(system.advance(0.7 * kDuration), ExplicitEnding::ReachedTime);
  if (!interrupted) {
    EXPECT_EQ(system.advance(0.1), ExplicitEnding::ReachedTime);
    EXPECT_EQ(system.removals().size(), 16U);
    return system.write_snapshot();
  }
  const std::vector<std::byte> snapshot = system.write_snapshot();
  ExplicitSystem other(model, options);
  other.read_snapshot(snapshot);
  EXPECT_EQ(other.advance(0.1), ExplicitEnding::ReachedTime);
  return other.write_snapshot();
}

TEST(ExplicitReplay, GoesOnInTheMiddleOfARelease) {
  const std::vector<std::byte> once = run_column(1, false);
  EXPECT_EQ(once, run_column(2, false));
  EXPECT_EQ(once, run_column(1, true));
}

TEST(ExplicitRelease, RefusesWhatCannotBe) {
  const auto refuses = [](const std::function<void(ExplicitModel&)>& change, const std::string& words) {
    ExplicitModel model = make_column();
    model.bars = make_hanging().bars;
    change(model);
    try {
      ExplicitSystem system(model, {});
      ADD_FAILURE() << words;
    } catch (const InputError& e) { EXPECT_THAT(e.what(), testing::HasSubstr(words)); }
  };
  refuses([](ExplicitModel& m) { m.elements[0].material = 1; }, "element 0 has material 1 of release 0");
  refuses([](ExplicitModel& m) { m.releases[0].weakened = {{0, 7}}; }, "no material 0 or 7");
  refuses(
      [](ExplicitModel& m) {
        m.materials.push_back(make_explicit_elastic(2400, 2e10, 0.2));
        m.releases[0].weakened = {{0, 3}};
      },
      "material 3 is not as elastic");
  refuses([](ExplicitModel& m) { m.releases[0].bars = {4}; }, "no bar 4");
  refuses([](ExplicitModel& m) { m.releases[0].duration = -1; }, "duration, -1 s");
  refuses([](ExplicitModel& m) { m.bars[0].b.weight[0] = 2; }, "weights of sum 1");
  refuses([](ExplicitModel& m) { m.bars[0].b = m.bars[0].a; }, "both ends are held");
  refuses([](ExplicitModel& m) { m.bars[0].shortening = {0, 2, 1}; }, "rises from 0");
  refuses([](ExplicitModel& m) { m.bars[0].rupture = 1; }, "yields before it tears");
}

}  // namespace
}  // namespace topple::fem
