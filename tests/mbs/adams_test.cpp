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

/// A bar of 4 m along an axis of W, held at the origin by a joint of one kind whose frames have the orientation q.
struct Case {
  std::string name;
  Joint::Kind kind;
  Vec3 centre;
  Vec3 inertia;
  Quat q;
  // How far their places are from the motion. 2e-5 m: an independent integration of the same data reproduces those of
  // the revolute joint within 5e-6 m. The spherical and the universal case are the same plane motion of the same bar,
  // but their files are 9.1e-4 m away from that of the revolute one, growing in time: an error of theirs.
  double tolerance = 2e-5;
};

Model make_model(const Case& c) {
  Model m;
  m.gravity = {0, 0, -9.80665};
  m.contact.ground = m.contact.bodies = false;
  Body bar;
  bar.name = "bar";
  bar.mass = 1;
  bar.inertia = Mat3::diagonal(c.inertia);
  bar.X_WB.p = c.centre;
  add_body(m, bar);
  Joint j;
  j.kind = c.kind;
  j.parent = kGround;
  j.child = {0};
  j.X_PF.q = c.q;
  j.X_CM = {-c.centre, c.q};
  add_joint(m, j);
  return m;
}

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class AdamsReference : public testing::TestWithParam<Case> {};

TEST_P(AdamsReference, PlacesAndReactionsAgreeForFiveSeconds) {
  const Case& c = GetParam();
  const auto place = read_rows(c.name + "_Case01_ADAMS_Pos.txt");
  const auto reaction = read_rows(c.name + "_Case01_ADAMS_Rforce.txt");
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
  double off = 0, plane_off = 0, force_off = 0, first_force_off = 0, other_off = 0;
  const auto plane = read_rows("Revolute_Case01_ADAMS_Pos.txt");
  o.on_frame = [&](const View& v) {
    ASSERT_LT(row, place.size());
    ASSERT_NEAR(v.time, place[row][0], 1e-9);
    const Vec3 p{place[row][1], place[row][2], place[row][3]}, f{reaction[row][1], reaction[row][2], reaction[row][3]};
    // six digits are given: beyond 2 m the last one counts
    off = std::max(off, norm(v.X_WB[0].p - p) - 5e-6 * norm(p));
    const double along = dot(v.X_WB[0].p, c.centre) / norm(c.centre);
    plane_off = std::max(plane_off, std::hypot(along - plane[row][1], v.X_WB[0].p.z - plane[row][3]));
    // theirs is that of the bar on the ground, in W
    force_off = std::max(force_off, norm(v.ground_force + f));
    if (row == 0) first_force_off = norm(v.ground_force + f);
    other_off = std::max(other_off, norm(to_matrix(c.q) * v.joint_force[0] + f));
    ++row;
  };
  const Summary s = run(make_model(c), o);
  EXPECT_EQ(row, place.size());
  EXPECT_LT(off, c.tolerance);
  const bool slides = c.kind == Joint::Kind::Prismatic || c.kind == Joint::Kind::Cylindrical;
  if (!slides) { EXPECT_LT(plane_off, 2e-5); }
  EXPECT_LT(force_off, 1e-3 * largest + 1e-9);  // the two that slide fall freely: no force but round-off
  EXPECT_LT(other_off, 1e-3 * largest + 1e-9);
  EXPECT_LT(first_force_off, 1e-6);  // at rest: their six digits
  EXPECT_LT(s.joint_drift, 1e-11);
  EXPECT_TRUE(s.notes.empty());
}

const Quat kAlongY = to_quat(Mat3::from_columns({1, 0, 0}, {0, 0, -1}, {0, 1, 0}));  // z along W's y
const Quat kAlongMinusY = to_quat(Mat3::from_columns({1, 0, 0}, {0, 0, 1}, {0, -1, 0}));

INSTANTIATE_TEST_SUITE_P(
    Cases, AdamsReference,
    testing::Values(Case{"Revolute", Joint::Kind::Revolute, {2, 0, 0}, {0.04, 0.1, 0.1}, kAlongY},
                    Case{"Spherical", Joint::Kind::Spherical, {2, 0, 0}, {0.04, 0.1, 0.1}, {}, 1e-3},
                    Case{"Universal", Joint::Kind::Universal, {0, 2, 0}, {0.1, 0.04, 0.1}, kAlongMinusY, 1e-3},
                    Case{"Prismatic", Joint::Kind::Prismatic, {2, 0, 0}, {0.04, 0.1, 0.1}, {}},
                    Case{"Cylindrical", Joint::Kind::Cylindrical, {2, 0, 0}, {0.04, 0.1, 0.1}, {}}),
    [](const auto& i) { return i.param.name; });

}  // namespace
}  // namespace topple::mbs
