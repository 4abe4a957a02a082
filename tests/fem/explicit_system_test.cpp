#include "fem/explicit_system.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "explicit_mesh.h"

namespace topple::fem {
namespace {

ExplicitModel make_bar() {
  ExplicitModel model;
  model.materials = {make_explicit_elastic(2400, 30e9, 0)};
  model.gravity = {};
  add_brick(model, {0, 0, 0}, {0.4, 0.4, 4}, 2, 2, 80);
  return model;
}

// Seven hexahedra of MacNeal & Harder (1985) in a cube of 1, u = 1e-3 (2x + y + z, x + 2y + z, x + y + 2z) / 2,
// E = 1e6, ν = 0.25: normal stresses 2000, shear stresses 400.
TEST(ExplicitElement, PassesThePatchTestOfMacNealAndHarder) {
  ExplicitModel model;
  model.materials = {make_explicit_elastic(1, 1e6, 0.25)};
  model.gravity = {};
  model.nodes = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  for (const Vec3& p : {Vec3{.249, .342, .192},
                        {.826, .288, .288},
                        {.850, .649, .263},
                        {.273, .750, .230},
                        {.320, .186, .643},
                        {.677, .305, .683},
                        {.788, .693, .644},
                        {.165, .745, .702}})
    model.nodes.push_back(p);
  for (const std::array<int, 8>& n : {std::array{8, 9, 10, 11, 12, 13, 14, 15},
                                      {0, 1, 2, 3, 8, 9, 10, 11},
                                      {12, 13, 14, 15, 4, 5, 6, 7},
                                      {0, 1, 9, 8, 4, 5, 13, 12},
                                      {1, 2, 10, 9, 5, 6, 14, 13},
                                      {2, 3, 11, 10, 6, 7, 15, 14},
                                      {3, 0, 8, 11, 7, 4, 12, 15}}) {
    ExplicitElement e;
    e.node = n;
    model.elements.push_back(e);
  }
  // a thousand steps at the speed of the field; a thousandth of the strain, so that its square does not count
  constexpr double kSize = 1e-6;
  ExplicitOptions options;
  options.linear_viscosity = options.quadratic_viscosity = 0;
  options.contact = false;
  ExplicitSystem system(model, options);
  const double time = 50 * system.step();
  std::vector<Vec3> v;
  for (const Vec3& p : model.nodes)
    v.push_back((kSize / time) * Vec3{p.x + (p.y + p.z) / 2, p.y + (p.x + p.z) / 2, p.z + (p.x + p.y) / 2});
  // all but the inner nodes go on at their speed: nothing holds them, so their masses are made large
  model.extra_mass.assign(model.nodes.size(), 0);
  for (size_t n = 0; n < 8; ++n) model.extra_mass[n] = 1e9;
  system = ExplicitSystem(model, options);
  system.set_velocities(v);
  ASSERT_EQ(system.advance(time), ExplicitEnding::ReachedTime);
  // stresses are half a step and places a whole step past those of the last forces
  const double share = 49.0 / 50 * kSize / 1e-3;
  for (int e = 0; e < 7; ++e) {
    const auto s = system.stress(e);
    for (size_t i = 0; i < 6; ++i)
      EXPECT_NEAR(s[i] / share, i < 3 ? 2000 : 400, 2000 * 1e-5)
          << e << ' ' << i;  // square of the strain, 1e-6, and waves of round-off
  }
  // inner nodes feel no force: they keep their speeds but for second order in the strain
  for (size_t n = 8; n < 16; ++n) EXPECT_LT(norm(system.v(static_cast<int>(n)) - v[n]), 1e-4 * norm(v[n])) << n;
}

TEST(ExplicitElement, TurnsFreelyWithoutForces) {
  ExplicitModel model;
  model.materials = {make_explicit_elastic(2400, 30e9, 0.2)};
  model.gravity = {};
  add_brick(model, {-0.2, -0.3, -0.5}, {0.2, 0.3, 0.5}, 1, 1, 1);
  // slowly: the centripetal force is a million times below what the test looks for
  for (Vec3& p : model.nodes) p += 0.03 * Vec3{p.y * p.z, p.z * p.x, p.x * p.y};
  ExplicitSystem system(model, {});
  const Vec3 w{0.3, -0.2, 0.5};
  std::vector<Vec3> v;
  for (const Vec3& p : model.nodes) v.push_back(cross(w, p));
  system.set_velocities(v);
  ASSERT_EQ(system.advance(2.0), ExplicitEnding::ReachedTime);
  // a turn of 70 degrees; centrifugal stress ρ ω² l² is 250 Pa, a strain of 1e-8; a hypoelastic error of ω h a step,
  // 6e-5, of a strain of the turn would be 20 kPa
  const auto s = system.stress(0);
  for (const double x : s) EXPECT_LT(std::abs(x), 500);
  const ExplicitEnergy energy = system.calc_energy();
  EXPECT_LT(energy.elastic, 1e-6 * energy.kinetic);
  // forces stand on places of half a step before: a share of ω² h of the energy each second (explicit.md)
  EXPECT_NEAR(energy.kinetic, energy.start, 1.1 * dot(w, w) * system.step() * 2 * energy.start);
}

// E = 30e9, ρ = 2400, L = 4 m, v = 1 m/s, ν = 0: the wall sees σ = ρ c v = 8.485 MPa for 2 L / c = 2.263 ms, and the
// bar leaves with its speed.
TEST(ExplicitBarPhysics, LeavesTheWallAsItCame) {
  ExplicitModel model = make_bar();
  model.grounds = {ExplicitGround{}};
  ExplicitOptions options;
  options.linear_viscosity = options.quadratic_viscosity = 0;
  options.contact_damping = 0;
  ExplicitSystem system(model, options);
  system.set_velocity({0, 0, -1});
  double first = -1, last = 0, impulse = 0, middle = 0;
  int count = 0;
  while (system.time() < 3e-3) {
    ASSERT_EQ(system.advance(system.time() + system.step()), ExplicitEnding::ReachedTime);
    const double f = -system.ground_force(0).z;
    // between half the plateau on the way up and down
    if (f > 0.5 * 8.485e6 * 0.16 && first < 0) first = system.time();
    if (f > 0.5 * 8.485e6 * 0.16) last = system.time();
    impulse += f * system.step();
    if (system.time() > 0.5e-3 && system.time() < 1.5e-3) middle += f / 0.16, ++count;
  }
  EXPECT_NEAR(middle / count, 8.485e6, 0.01 * 8.485e6);    // dispersion behind the front
  EXPECT_NEAR(last - first, 2.263e-3, 0.03 * 2.263e-3);    // the front takes some elements of 5 cm, L/80
  EXPECT_NEAR(impulse, 2 * 2400 * 0.16 * 4, 0.01 * 3072);  // vibration that stays behind
  EXPECT_NEAR(system.calc_momentum().z / (2400 * 0.16 * 4), 1, 0.01);
  const ExplicitEnergy energy = system.calc_energy();
  EXPECT_LT(std::abs(energy.residual()), 1e-5 * energy.start);  // bending of the mesh by 3e-5 in a step
}

TEST(ExplicitBarPhysics, EnergyClosesWithViscosityAndDamping) {
  ExplicitModel model = make_bar();
  model.grounds = {ExplicitGround{}};
  ExplicitSystem system(model, {});
  system.set_velocity({0, 0, -1});
  ASSERT_EQ(system.advance(2e-3), ExplicitEnding::ReachedTime);
  const ExplicitEnergy energy = system.calc_energy();
  EXPECT_GT(energy.bulk_viscosity, 0);
  EXPECT_GT(energy.contact_damping, 0);
  EXPECT_LT(std::abs(energy.residual()), 1e-4 * energy.start);  // geometry of half a step ago
}

/// A cantilever of length 4, 0.2 x 0.2, along x.
ExplicitModel make_cantilever(int along, int across) {
  ExplicitModel model;
  model.materials = {make_explicit_elastic(2500, 30e9, 0.2)};
  add_brick(model, {0, 0, 0}, {4, 0.2, 0.2}, along, across, across);
  for (const int n : find_nodes(model, [](const Vec3& p) { return p.x == 0; }))
    model.supports.push_back({n, true, true, true});
  return model;
}

TEST(ExplicitCantileverPhysics, RelaxesToTheDeflectionOfABeam) {
  for (const int across : {1, 2}) {
    const ExplicitModel model = make_cantilever(20 * across, across);
    ExplicitSystem system(model, {});
    RelaxationOptions options;
    options.tolerance = 1e-5;
    const RelaxationSummary summary = system.relax(options);
    ASSERT_TRUE(summary.converged) << summary.text;
    const std::vector<int> tip = find_nodes(model, [](const Vec3& p) { return p.x == 4; });
    const double q = 2500 * 9.81 * 0.04, I = std::pow(0.2, 4) / 12, G = 30e9 / 2.4;
    const double expected = q * 256 / (8 * 30e9 * I) + q * 16 / (2 * G * 0.04 * 5 / 6);
    const double found = model.nodes[static_cast<size_t>(tip[0])].z - system.p(tip[0]).z;
    // 0.3 % of a clamped end that holds Poisson's strain, 0.2 % the coarse mesh along
    EXPECT_NEAR(found / expected, 1, 0.01) << across << ' ' << summary.text;
    // what holds the beam is its weight
    std::vector<int> all(model.elements.size());
    for (size_t e = 0; e < all.size(); ++e) all[e] = static_cast<int>(e);
    const auto root = find_nodes(model, [](const Vec3& p) { return p.x == 0; });
    const auto r = system.calc_resultant(all, root, {0, 0.1, 0.1});
    const double half_cell = 0.5 * 4 / (20.0 * across);  // its mass hangs at the root's nodes
    EXPECT_NEAR(r.force.z, -q * (4 - half_cell), 1e-3 * q * 4);
    EXPECT_NEAR(r.moment.y, q * 8, 0.01 * q * 8);
  }
}

TEST(ExplicitCantileverPhysics, GivesUpWhatFalls) {
  ExplicitModel model = make_cantilever(20, 1);
  model.supports.clear();
  ExplicitSystem system(model, {});
  const RelaxationSummary summary = system.relax({});
  EXPECT_FALSE(summary.converged);
  EXPECT_LT(summary.steps, RelaxationOptions{}.most_steps);
  EXPECT_NEAR(summary.settlement, RelaxationOptions{}.most_settlement, 0.1);  // looked at now and then
  EXPECT_NE(summary.text.find("not in equilibrium"), std::string::npos) << summary.text;
}

TEST(ExplicitCantileverPhysics, SwingsAtTheFrequencyOfABeam) {
  const ExplicitModel model = make_cantilever(40, 2);
  ExplicitOptions options;
  options.linear_viscosity = options.quadratic_viscosity = 0;
  options.contact = false;
  ExplicitSystem system(model, options);
  // the load comes at once: from 0 to twice the static deflection and back in one period
  const int tip = find_nodes(model, [](const Vec3& p) { return p.x == 4; })[0];
  const double expected = 1.8751 * 1.8751 / (2 * M_PI) * std::sqrt(30e9 * std::pow(0.2, 4) / 12 / (2500 * 0.04 * 256));
  double lowest = 0, deepest = 0, highest_after = -1, end = 0;
  while (system.time() < 1.3 / expected) {
    ASSERT_EQ(system.advance(system.time() + 0.002 / expected), ExplicitEnding::ReachedTime);
    const double z = system.p(tip).z - model.nodes[static_cast<size_t>(tip)].z;
    if (z < lowest) lowest = z, deepest = system.time();
    if (system.time() > 0.8 / expected && z > highest_after) highest_after = z, end = system.time();
  }
  EXPECT_NEAR(deepest * expected, 0.5, 0.03);  // higher modes on top
  EXPECT_NEAR(end * expected, 1, 0.03);
  const ExplicitEnergy energy = system.calc_energy();
  EXPECT_LT(std::abs(energy.residual()), 1e-4 * (energy.elastic + energy.kinetic));
}

// Central differences bear the bound (16) itself: a layer of thin bricks on cubes, shaken at random.
TEST(ExplicitStep, IsStableUpToTheBoundOfTheWorstElement) {
  ExplicitModel model;
  model.materials = {make_explicit_elastic(2400, 30e9, 0.2)};
  model.gravity = {};
  add_brick(model, {0, 0, 0}, {0.4, 0.4, 0.4}, 4, 4, 4);
  add_brick(model, {1, 0, 0}, {1.4, 0.4, 0.05}, 2, 2, 1);
  add_brick(model, {2, 0, 0}, {2.1, 0.1, 0.1}, 1, 1, 1);
  ExplicitOptions options;
  options.step_share = 0.995, options.linear_viscosity = options.quadratic_viscosity = 0;
  options.contact = false;
  ExplicitSystem system(model, options);
  std::vector<Vec3> v(model.nodes.size());
  std::uint32_t random = 1;
  for (Vec3& each : v)
    for (int c = 0; c < 3; ++c) random = random * 1664525U + 1013904223U, each[c] = 1e-4 * (random / 2147483648.0 - 1);
  system.set_velocities(v);
  ASSERT_EQ(system.advance(20000 * system.step()), ExplicitEnding::ReachedTime);
  const ExplicitEnergy energy = system.calc_energy();
  EXPECT_TRUE(system.removals().empty());
  EXPECT_LT(std::abs(energy.residual()), 0.01 * energy.start);
}

}  // namespace
}  // namespace topple::fem
