#include "engines/engine.h"

#include <gtest/gtest.h>

#include "base/error.h"

namespace topple::engines {
namespace {

TEST(Engine, NativeRunsAFallingBody) {
  mbs::Model model;
  mbs::Body body;
  body.name = "stone";
  body.X_WB.p = {0, 0, 100};
  mbs::add_body(model, body);
  mbs::Options o;
  o.duration = 1;
  o.step = 1e-3;
  o.equilibrium = false;
  double z = 0;
  o.on_frame = [&](const mbs::View& v) { z = v.X_WB[0].p.z; };
  const auto engine = make_engine("native");
  EXPECT_EQ(engine->name(), "native");
  EXPECT_EQ(engine->run(model, o).ending, mbs::Summary::Ending::TimeLimit);
  EXPECT_NEAR(z, 100 - 0.5 * 9.81, 0.02);  // the last frame may lie a step before the end
}

TEST(Engine, UnknownNamesAreRefused) { EXPECT_THROW(make_engine("adams"), InputError); }

}  // namespace
}  // namespace topple::engines
