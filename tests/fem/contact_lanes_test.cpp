#include "fem/contact_lanes.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cmath>
#include <cstring>
#include <random>

#include "fem/explicit_kernel.h"

namespace topple::fem::lanes {
namespace {

struct Scene {
  AlignedVector<double> rows;
  Faces faces;
  void add_face(const std::array<Vec3, 4>& x, const Vec3& v) {
    for (const Vec3& p : x) rows.insert(rows.end(), {p.x, p.y, p.z, v.x, v.y, v.z, 0.5, 2});
  }
  void add_candidate(std::uint32_t point, std::uint32_t face) {
    faces.number.push_back(static_cast<std::uint32_t>(faces.point.size()));
    faces.point.push_back(point);
    for (std::uint32_t k = 0; k < 4; ++k) faces.corners[k].push_back(4 * face + k);
  }
  Setup setup() const { return {rows.data(), 1e-5, 0.5, 0.03, 0.02}; }
  std::vector<Touch> press() {
    std::vector<Touch> touches;
    press_faces(setup(), faces, 0, faces.point.size(), touches);
    return touches;
  }
};

Point make_ball(const Vec3& p, double radius) {
  Point q;
  q.p = p, q.v = {0, 0, -1}, q.inverse_mass = 0.2, q.radius = radius, q.stiffness = 1e6, q.ball = 1, q.bears = 5e3;
  return q;
}

const std::array<Vec3, 4> kSquare = {Vec3{-1, -1, 0}, Vec3{1, -1, 0}, Vec3{1, 1, 0}, Vec3{-1, 1, 0}};

TEST(ContactLanes, PressesABallOnASquareByItsDepth) {
  Scene scene;
  scene.add_face(kSquare, {});
  scene.faces.points = {make_ball({0.5, -0.25, 0.09}, 0.1), make_ball({0, 0, 0.11}, 0.1),
                        make_ball({1.05, 0, 0.02}, 0.1)};
  for (std::uint32_t i = 0; i < 3; ++i) scene.add_candidate(i, 0);
  const std::vector<Touch> touches = scene.press();
  ASSERT_EQ(touches.size(), 2U);  // the second is above
  const Touch& t = touches[0];
  EXPECT_EQ(t.candidate, 0U);
  EXPECT_NEAR(t.depth, 0.01, 1e-15);
  const double weights[4] = {0.25 * 0.5 * 1.25, 0.25 * 1.5 * 1.25, 0.25 * 1.5 * 0.75, 0.25 * 0.5 * 0.75};
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(t.weights[k], weights[k], 1e-14);
  EXPECT_NEAR(t.normal_force.z, 1e4, 1e-6);  // the ball's own stiffness, no damping
  EXPECT_EQ(t.friction, Vec3{});             // it does not slide
  EXPECT_NEAR(t.normal, -1e4, 1e-6);
  EXPECT_NEAR(t.stored, 50, 1e-9);
  EXPECT_NEAR(t.crushed, 0.005, 1e-12);  // half of the force is more than it bears
  // over the edge: along the line to it, at half the stiffness
  const Touch& edge = touches[1];
  EXPECT_EQ(edge.candidate, 2U);
  const double distance = std::hypot(0.05, 0.02);
  EXPECT_NEAR(edge.depth, 0.1 - distance, 1e-14);
  EXPECT_NEAR(edge.normal_force.x / edge.normal_force.z, 2.5, 1e-12);
  EXPECT_NEAR(std::hypot(edge.normal_force.x, edge.normal_force.z), 0.5e6 * (0.1 - distance), 1e-6);
}

TEST(ContactLanes, GivesTheSameBitsWithEveryInstructionSet) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto vector = [&] { return Vec3{number(random), number(random), number(random)}; };
  Scene scene;
  constexpr std::uint32_t kFaces = 40, kPoints = 203;  // no multiple of any number of lanes
  for (std::uint32_t f = 0; f < kFaces; ++f) {
    std::array<Vec3, 4> x = kSquare;
    for (Vec3& p : x) p += 0.2 * vector();
    scene.add_face(x, vector());
  }
  for (std::uint32_t i = 0; i < kPoints; ++i) {
    Point q = make_ball(vector(), 0.3);
    q.p.z *= 0.3, q.v = 5 * vector(), q.damping = 0.1;
    if (i % 3 == 0) q.ball = q.radius = 0, q.stiffness = q.bears = 1e300;
    scene.faces.points.push_back(q);
    for (std::uint32_t f = i % 5; f < kFaces; f += 7) scene.add_candidate(i, f);
  }
  const std::int64_t supported = hwy::SupportedTargets();
  std::vector<Touch> first;
  for (std::int64_t left = supported; left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left & -left);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    const std::vector<Touch> touches = scene.press();
    if (first.empty()) first = touches;
    ASSERT_EQ(touches.size(), first.size());
    EXPECT_EQ(std::memcmp(touches.data(), first.data(), first.size() * sizeof(Touch)), 0);
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  EXPECT_GT(first.size(), 200U);
  // forces and the power at the speeds before belong together
  for (const Touch& t : first) {
    const Point& q = scene.faces.points[scene.faces.point[t.candidate]];
    Vec3 v = q.v;
    for (size_t k = 0; k < 4; ++k) {
      const double* r = scene.rows.data() + 8 * size_t{scene.faces.corners[k][t.candidate]} + kernel::kSpeed;
      v -= t.weights[k] * Vec3{r[0], r[1], r[2]};
    }
    EXPECT_NEAR(t.normal, dot(t.normal_force, v), 1e-9 * (1 + std::abs(t.normal)));
    EXPECT_NEAR(t.rubbing, dot(t.friction, v), 1e-9 * (1 + std::abs(t.rubbing)));
    EXPECT_LE(t.rubbing, 0);
    EXPECT_LE(norm(t.friction), 0.5 * norm(t.normal_force) * (1 + 1e-12));
  }
}

struct Balls {
  AlignedVector<Particle> particles;
  std::vector<ParticleMake> makes;
  void add(const Vec3& p, const Vec3& v, double radius, double mass) {
    particles.push_back({p, v, radius, mass});
    ParticleMake make;
    make.full_radius = radius, make.stiffness = 1e6, make.bears = 5e3;
    makes.push_back(make);
  }
  std::vector<ParticleTouch> press(std::span<const ParticlePair> pairs, TouchSums& sums) const {
    std::vector<ParticleTouch> touches;
    press_particles({particles.data(), makes.data(), 1e-5, 0.5, 0.25, 0.02}, pairs, touches, sums);
    return touches;
  }
};

TEST(ContactLanes, PressesBallsApartByTheirOverlap) {
  Balls balls;
  balls.add({0.19, 0, 0}, {-1, 0, 0}, 0.1, 2), balls.add({0, 0, 0}, {1, 0, 0}, 0.1, 2);
  const std::vector<ParticlePair> pairs = {{0, 1}};
  TouchSums sums;
  const std::vector<ParticleTouch> touches = balls.press(pairs, sums);
  ASSERT_EQ(touches.size(), 1U);
  // spring 1e6 N/m by 1 cm, dashpot 2 ζ √(k m) v with the mass of both in series, 1 kg
  const double spring = 1e4, dashpot = 2 * 0.25 * 1e3 * 2;
  EXPECT_NEAR(touches[0].normal_force.x, spring + dashpot, 1e-6);
  EXPECT_EQ(touches[0].friction, Vec3{});
  EXPECT_NEAR(sums.stored, 50, 1e-9);
  EXPECT_NEAR(sums.normal, -2 * (spring + dashpot), 1e-6);
  for (const double crushed : touches[0].crushed) EXPECT_NEAR(crushed, 0.005, 1e-12);
  EXPECT_EQ(touches[0].pair, pairs[0]);
}

TEST(ContactLanes, PressesBallsWithTheSameBitsWithEveryInstructionSet) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto vector = [&] { return Vec3{number(random), number(random), number(random)}; };
  Balls balls;
  std::vector<ParticlePair> pairs;
  for (std::uint32_t i = 0; i < 101; ++i) {
    balls.add(vector(), 5 * vector(), 2, 3 + number(random));
    if (i > 0) pairs.push_back({i, i / 2});
  }
  const std::int64_t supported = hwy::SupportedTargets();
  std::vector<ParticleTouch> first;
  TouchSums first_sums;
  for (std::int64_t left = supported; left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left & -left);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    TouchSums sums;
    const std::vector<ParticleTouch> touches = balls.press(pairs, sums);
    if (first.empty()) first = touches, first_sums = sums;
    ASSERT_EQ(touches.size(), pairs.size());
    EXPECT_EQ(std::memcmp(touches.data(), first.data(), first.size() * sizeof(ParticleTouch)), 0);
    EXPECT_EQ(std::memcmp(&sums, &first_sums, sizeof sums), 0);
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  for (const ParticleTouch& t : first) {
    const Particle &a = balls.particles[t.pair[0]], &b = balls.particles[t.pair[1]];
    EXPECT_GE(dot(t.normal_force, a.p - b.p), 0);
    EXPECT_LE(dot(t.friction, a.v - b.v), 0);
    EXPECT_LE(norm(t.friction), 0.5 * norm(t.normal_force) * (1 + 1e-12));
  }
}

}  // namespace
}  // namespace topple::fem::lanes
