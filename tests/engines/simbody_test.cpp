#include "engines/simbody.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "cases.h"

namespace topple::engines {
namespace {

using test::make_options;
using Kind = mbs::Joint::Kind;

/// Largest distances from an ADAMS case: places of the centre of mass, reactions on the ground.
struct Off {
  double place = 0, reaction = 0, largest_reaction = 0;
};

Off compare_with_adams(const mbs::Model& model, const std::string& name) {
  const auto place = test::read_adams(name + "_ADAMS_Pos.txt"), reaction = test::read_adams(name + "_ADAMS_Rforce.txt");
  EXPECT_EQ(place.size(), 501U);
  EXPECT_EQ(reaction.size(), place.size());
  const auto c = test::run(*make_engine("simbody"), model, make_options(5, 0.01));
  EXPECT_EQ(c.summary.ending, mbs::Summary::Ending::TimeLimit) << c.summary.message;
  EXPECT_EQ(c.frames.size(), place.size());
  Off off;
  for (size_t i = 0; i < std::min(c.frames.size(), place.size()); ++i) {
    const Vec3 p{place[i][1], place[i][2], place[i][3]}, f{reaction[i][1], reaction[i][2], reaction[i][3]};
    EXPECT_NEAR(c.frames[i].time, place[i][0], 1e-9);
    off.place = std::max(off.place, norm(c.frames[i].X_WB[0].p - p));
    off.reaction = std::max(off.reaction, norm(c.frames[i].ground_force + f));
    off.largest_reaction = std::max(off.largest_reaction, norm(f));
  }
  EXPECT_LT(c.summary.energy_error, 1e-6);  // of the energy released, with accuracy 1e-9
  return off;
}

TEST(SimbodyReference, PendulumOfAdams) {
  TOPPLE_NEEDS_ENGINE("simbody");
  const Off off = compare_with_adams(test::make_bar(Kind::Revolute, test::z_along_y()), "Revolute_Case01");
  EXPECT_LT(off.place, 1e-5);  // an independent integration reproduces ADAMS's rows within 5e-6 m
  EXPECT_LT(off.reaction, 1e-4 * off.largest_reaction);
}

}  // namespace
}  // namespace topple::engines
