// Springs and dampers against outputs of MSC.ADAMS (tests/data/adams/README.md).
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "models.h"

namespace topple::mbs {
namespace {

using Rows = std::vector<std::array<double, 4>>;

/// Rows of time, x, y, z.
Rows read_rows(const std::string& name) {
  std::ifstream in(std::string(TOPPLE_SOURCE_DIR) + "/tests/data/adams/" + name);
  Rows rows;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::array<double, 4> row{};
    if (words >> row[0] >> row[1] >> row[2] >> row[3]) rows.push_back(row);
  }
  return rows;
}

/// 1 kg and the inertia of the reference bars, no contact, g = 9.80665.
Model make_bar(const Vec3& centre) {
  Model m;
  m.gravity = {0, 0, -9.80665};
  m.contact.ground = m.contact.bodies = false;
  Body bar;
  bar.name = "bar";
  bar.mass = 1;
  bar.inertia = Mat3::diagonal({0.04, 0.1, 0.1});
  bar.X_WB.p = centre;
  add_body(m, bar);
  return m;
}

struct Off {
  double place = 0, force = 0, largest_force = 0;
  size_t rows = 0;
  Summary summary;
};

/// Largest distances from the reference over 5 s; `force_of` is what the reference calls its force.
template <class F>
Off compare(const Model& m, const std::string& name, double h, F&& force_of) {
  const Rows place = read_rows(name + "_ADAMS_Pos.txt"), force = read_rows(name + "_ADAMS_Rforce.txt");
  Off off;
  if (place.size() != 501 || force.size() != 501) return off;
  for (const auto& row : force) off.largest_force = std::max(off.largest_force, std::hypot(row[1], row[2], row[3]));
  Options o;
  o.equilibrium = false;
  o.duration = 5;
  o.step = h;
  o.frame_interval = 0.01;
  o.on_frame = [&](const View& v) {
    if (off.rows >= place.size() || std::abs(v.time - place[off.rows][0]) > 1e-9) return;
    const auto &p = place[off.rows], &f = force[off.rows];
    off.place = std::max(off.place, norm(v.X_WB[0].p - Vec3{p[1], p[2], p[3]}));
    // reactions are known once a step has been made
    if (off.rows > 0) off.force = std::max(off.force, norm(force_of(v) - Vec3{f[1], f[2], f[3]}));
    ++off.rows;
  };
  off.summary = run(m, o);
  return off;
}

TEST(ForcesReference, PendulumWithTorsionSpringAndDamper) {
  Model m = make_bar({2, 0, 0});
  Joint hinge;
  hinge.kind = Joint::Kind::Revolute;
  hinge.parent = kGround;
  hinge.child = {0};
  hinge.X_PF.q = to_quat(Mat3::from_columns({1, 0, 0}, {0, 0, -1}, {0, 1, 0}));  // axis z along W's y
  hinge.X_CM = {{-2, 0, 0}, hinge.X_PF.q};
  RotationalSpring spring;
  spring.joint = add_joint(m, hinge);
  spring.spring.rate = 200;
  spring.damper.rate = 10;
  m.rotational_springs.push_back(spring);
  const Off off = compare(m, "RotSpring_Case01", 1e-4, [](const View& v) { return -v.ground_force; });
  EXPECT_EQ(off.rows, 501U);
  // an independent integration of the same data reproduces the places within 5e-6 m
  EXPECT_LT(off.place, 2e-5);
  EXPECT_LT(off.force, 1e-3 * off.largest_force);
  EXPECT_LT(std::abs(off.summary.energy_error), 1e-6);
}

TEST(ForcesReference, BodyOnASpringAndDamper) {
  Model m = make_bar({0, 2, 0});
  SpringDamper spring;
  spring.a = kGround;
  spring.b = {0};
  spring.free_length = 2;
  spring.spring.rate = 100;
  spring.damper.rate = 5;
  m.springs.push_back(spring);
  const Off off = compare(m, "TranSpring_Case02", 1e-4, [](const View& v) {
    return (v.spring_force[0] / v.spring_length[0]) * v.X_WB[0].p;  // on the ground
  });
  EXPECT_EQ(off.rows, 501U);
  EXPECT_LT(off.place, 2e-5);
  EXPECT_LT(off.force, 1e-3 * off.largest_force);
  EXPECT_LT(std::abs(off.summary.energy_error), 1e-6);
}

}  // namespace
}  // namespace topple::mbs
