// Against outputs of MSC.ADAMS (tests/data/adams/README.md).
#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "models.h"

namespace topple::mbs {
namespace {

/// Rows of time, x, y, z.
std::vector<std::array<double, 4>> read_rows(const std::string& name) {
  std::ifstream in(std::string(TOPPLE_SOURCE_DIR) + "/tests/data/adams/" + name);
  std::vector<std::array<double, 4>> rows;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::array<double, 4> row{};
    if (words >> row[0] >> row[1] >> row[2] >> row[3]) rows.push_back(row);
  }
  return rows;
}

TEST(AdamsReference, RevolutePendulum) {
  Model m;
  m.gravity = {0, 0, -9.80665};
  m.contact.ground = m.contact.bodies = false;
  Body bar;
  bar.name = "bar";
  bar.mass = 1;
  bar.inertia = Mat3::diagonal({0.04, 0.1, 0.1});
  bar.X_WB.p = {2, 0, 0};
  add_body(m, bar);
  Joint hinge;
  hinge.kind = Joint::Kind::Revolute;
  hinge.parent = kGround;
  hinge.child = {0};
  hinge.X_PF.q = to_quat(Mat3::from_columns({1, 0, 0}, {0, 0, -1}, {0, 1, 0}));  // axis z along W's y
  hinge.X_CM = {{-2, 0, 0}, hinge.X_PF.q};
  add_joint(m, hinge);

  const auto place = read_rows("Revolute_Case01_ADAMS_Pos.txt");
  const auto reaction = read_rows("Revolute_Case01_ADAMS_Rforce.txt");
  ASSERT_EQ(place.size(), 501U);
  ASSERT_EQ(reaction.size(), place.size());
  double largest = 0;
  for (const auto& row : reaction) largest = std::max(largest, std::hypot(row[1], row[2], row[3]));

  Options o;
  o.equilibrium = false;
  o.duration = 5;
  o.step = 1e-4;
  o.frame_interval = 0.01;
  size_t row = 0;
  double off = 0, force_off = 0;
  o.on_frame = [&](const View& v) {
    ASSERT_LT(row, place.size());
    ASSERT_NEAR(v.time, place[row][0], 1e-9);
    const Vec3 p{place[row][1], place[row][2], place[row][3]}, f{reaction[row][1], reaction[row][2], reaction[row][3]};
    off = std::max(off, norm(v.X_WB[0].p - p));
    // a reaction is known once a step has been made
    if (row > 0) force_off = std::max(force_off, norm(v.ground_force + f));
    ++row;
  };
  const Summary s = run(m, o);
  EXPECT_EQ(row, place.size());
  EXPECT_LT(off, 2e-5);                  // an independent integration of the same data reproduces them within 5e-6 m
  EXPECT_LT(force_off, 1e-3 * largest);  // the reaction is that of the step before, 0.1 ms
  EXPECT_LT(s.joint_drift, 1e-9);
}

}  // namespace
}  // namespace topple::mbs
