#include "collapse/rigid_block.h"

#include <gtest/gtest.h>

#include <cmath>

namespace topple::collapse {
namespace {

RigidBlock block() { return {1.9e6, 1.9e6 * 190, 6, 10.6, 3e6, 9.81, 4}; }

TEST(RigidBlock, StartsWithTheAccelerationOfItsMoment) {
  const RigidBlock b = block();
  const double alpha = (b.mass * b.gravity * b.ahead - b.plastic_moment) / b.inertia;
  const auto angle = calc_rigid_block(b, {0, 3.9, 4, 4.05});
  EXPECT_EQ(angle[1], 0);
  EXPECT_EQ(angle[2], 0);
  // ½ α t²; gravity's moment grows by θ above / ahead, less than a tenth of a per cent so early
  EXPECT_NEAR(angle[3] / (0.5 * alpha * 0.05 * 0.05), 1, 1e-3);
}

TEST(RigidBlock, KeepsItsEnergy) {
  const RigidBlock b = block();
  constexpr double dt = 1e-3;
  const auto a = calc_rigid_block(b, {4, 5.2 - dt, 5.2, 5.2 + dt});
  const double omega = (a[3] - a[1]) / (2 * dt), theta = a[2];
  const double fallen =
      b.mass * b.gravity * (b.ahead * std::sin(theta) + b.above * (1 - std::cos(theta))) - b.plastic_moment * theta;
  // central difference: relative error of dt² over the square of the time scale of a second
  EXPECT_NEAR(0.5 * b.inertia * omega * omega / fallen, 1, 1e-5);
}

TEST(RigidBlock, StandsWhenItsHingesHoldAndEndsLying) {
  RigidBlock b = block();
  EXPECT_NEAR(calc_rigid_block(b, {4, 20})[1], std::acos(0.0), 1e-12);
  b.plastic_moment = b.mass * b.gravity * b.ahead * 1.01;
  EXPECT_EQ(calc_rigid_block(b, {4, 20})[1], 0);
}

}  // namespace
}  // namespace topple::collapse
