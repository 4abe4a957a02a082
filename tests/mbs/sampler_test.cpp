#include "mbs/sampler.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "models.h"

namespace topple::mbs {
namespace {

Model make_falling_box() {
  Model m;
  add_body(m, test::make_box("box", 10, {0.5, 0.4, 0.3}, {0, 0, 1.2}));
  m.bodies[0].X_WB.q = exp_rotation({0.3, 0.2, 0.1});
  return m;
}

/// Times at which a view was taken in a run of 1 s with steps of 1/1024 s.
std::vector<double> times_at(double interval) {
  std::vector<double> times;
  Options o;
  o.equilibrium = false;
  o.duration = 1;
  o.step = 1.0 / 1024;
  o.samplings = {{interval, [&](const View& v) { times.push_back(v.time); }}};
  (void)run(make_falling_box(), o);
  return times;
}

TEST(Sampler, TakesTheStepNearestToEachInstant) {
  for (double interval : {1.0 / 128, 0.01, 0.0333, 0.3}) {
    const std::vector<double> times = times_at(interval);
    ASSERT_EQ(times.size(), static_cast<size_t>(std::floor(1 / interval + 0.5 / 1024 / interval)) + 1) << interval;
    for (size_t i = 0; i < times.size(); ++i)
      EXPECT_LE(std::abs(times[i] - static_cast<double>(i) * interval), 0.5 / 1024 + 1e-12) << interval << " " << i;
  }
}

TEST(Sampler, TakesEachStepOnceWhereTheInstantsAreCloser) {
  for (double interval : {1.0 / 1024, 1.0 / 1500, 1e-6, 1e-300}) {
    const std::vector<double> times = times_at(interval);
    ASSERT_EQ(times.size(), 1025u) << interval;
    for (size_t i = 0; i < times.size(); ++i) EXPECT_NEAR(times[i], static_cast<double>(i) / 1024, 1e-12);
  }
}

TEST(Sampler, AsksForNothingWithoutSamplings) {
  const std::vector<Sampling> none;
  const Sampler s(none);
  EXPECT_FALSE(s.is_due(1e9, 1));
}

TEST(SamplerReplay, LeavesTheRunAsItIs) {
  std::vector<Vec3> places[2];
  Summary summary[2];
  for (int i = 0; i < 2; ++i) {
    Options o;
    o.equilibrium = false;
    o.duration = 1;
    o.on_frame = [&](const View& v) { places[i].push_back(v.X_WB[0].p); };
    if (i == 1) o.samplings = {{1e-9, [](const View&) {}}, {0.013, [](const View&) {}}};
    summary[i] = run(make_falling_box(), o);
  }
  EXPECT_EQ(places[0], places[1]);
  EXPECT_EQ(summary[0].energy_error, summary[1].energy_error);
  EXPECT_EQ(summary[0].message, summary[1].message);
}

}  // namespace
}  // namespace topple::mbs
