#include "mbs/quantity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "models.h"

namespace topple::mbs {
namespace {

/// A view in which every number is another.
View make_view() {
  double next = 1;
  const auto number = [&next] { return next++; };
  const auto vector = [&] { return Vec3{number(), number(), number()}; };
  View v;
  for (int i = 0; i < 2; ++i) {
    v.X_WB.push_back({vector(), exp_rotation({0.1 * i, 0.2, -0.3})});
    v.centre.push_back(vector());
    v.v_WB.push_back(vector());
    v.w_WB.push_back(vector());
    for (auto* list :
         {&v.joint_force, &v.joint_moment, &v.element_translation, &v.element_rotation, &v.element_force,
          &v.element_moment, &v.bushing_translation, &v.bushing_rotation, &v.bushing_force, &v.bushing_moment})
      list->push_back(vector());
    for (auto* list : {&v.joint_angle, &v.joint_displacement, &v.spring_length, &v.spring_force, &v.torsion_angle,
                       &v.torsion_torque, &v.hinge_rotation, &v.hinge_moment, &v.cable_length, &v.cable_force})
      list->push_back(number());
  }
  return v;
}

Quantity::Kind kind_of(int i) { return static_cast<Quantity::Kind>(i); }

TEST(Quantities, AreReadFromTheirOwnPlaceInTheView) {
  const View v = make_view();
  std::set<std::vector<double>> seen;
  for (int k = 0; k < kQuantityKinds; ++k)
    for (int index : {0, 1}) {
      const std::vector<double> values = calc_quantity({kind_of(k), index}, v);
      EXPECT_EQ(values.size(), static_cast<size_t>(traits_of(kind_of(k)).components)) << k;
      EXPECT_EQ(values.size(), column_names(kind_of(k)).size()) << k;
      EXPECT_TRUE(seen.insert(values).second) << traits_of(kind_of(k)).word << " reads what another kind reads";
    }
  using Kind = Quantity::Kind;
  EXPECT_EQ(calc_quantity({Kind::BushingMoment, 1}, v)[2], v.bushing_moment[1].z);
  EXPECT_EQ(calc_quantity({Kind::CableForce, 1}, v)[0], v.cable_force[1]);
  EXPECT_EQ(calc_quantity({Kind::JointDisplacement, 0}, v)[0], v.joint_displacement[0]);
  EXPECT_EQ(calc_quantity({Kind::Orientation, 1}, v)[0], v.X_WB[1].q.w);
}

TEST(Quantities, PlaceAndVelocityAreOfTheCentreOfMassWhateverReplacesABody) {
  Model m;
  m.gravity = {};
  m.contact.ground = m.contact.bodies = false;
  Body b = test::make_box("b", 4, {0.3, 0.2, 0.1}, {1, 0, 0});
  b.v_WB = {1, 2, 0}, b.w_WB = {0.5, 3, -1};
  add_body(m, b);
  Action a;
  a.kind = Action::Kind::ReplaceBody;
  a.body = {0};
  a.replacement = test::make_box("c", 1, {0.1, 0.2, 0.1}, {0.3, -0.2, 0.1});
  Event replace;
  replace.time = 0.1;
  replace.actions = {a};
  m.events = {replace};
  Event far;
  far.name = "far";
  far.triggers.push_back({{Quantity::Kind::Position, 0}, 0, 1.45, true});
  Action again = a;
  again.replacement.X_WB.p = {};
  far.actions = {again};
  m.events.push_back(far);
  Options o;
  o.duration = 0.3, o.step = 1e-3, o.frame_interval = 1e-3, o.equilibrium = false;
  std::vector<View> views;
  o.on_frame = [&](const View& v) { views.push_back(v); };
  double fired = 0;
  o.on_happening = [&](const Happening& h) {
    if (h.kind == Happening::Kind::EventFired && h.index == 1) fired = h.time;
  };
  (void)run(m, o);
  const auto at = [&](Quantity::Kind kind, size_t i) {
    const std::vector<double> x = calc_quantity({kind, 0}, views[i]);
    return Vec3{x[0], x[1], x[2]};
  };
  ASSERT_GT(views.size(), 290u);
  for (const size_t i : {size_t{50}, size_t{200}, size_t{280}}) {
    const Vec3 moved = at(Quantity::Kind::Position, i + 1) - at(Quantity::Kind::Position, i - 1);
    EXPECT_LT(norm((1 / 2e-3) * moved - at(Quantity::Kind::Velocity, i)), 1e-9) << i;
  }
  // the limit means what the output shows
  const size_t f = static_cast<size_t>(std::lround(fired / 1e-3));
  ASSERT_GT(f, 1u);
  EXPECT_GE(at(Quantity::Kind::Position, f).x, 1.45);
  EXPECT_LT(at(Quantity::Kind::Position, f - 1).x, 1.45);
}

TEST(Quantities, HaveComponentsForTriggers) {
  const View v = make_view();
  using Kind = Quantity::Kind;
  EXPECT_EQ(calc_component({Kind::Velocity, 1}, 1, v), v.v_WB[1].y);
  EXPECT_EQ(calc_component({Kind::Velocity, 1}, 3, v), norm(v.v_WB[1]));
  EXPECT_EQ(calc_component({Kind::TorsionAngle, 0}, 0, v), v.torsion_angle[0]);
  // the rotation vector, not the quaternion; round-off of exp and log
  EXPECT_NEAR(calc_component({Kind::Orientation, 1}, 0, v), 0.1, 1e-15);
  EXPECT_NEAR(calc_component({Kind::Orientation, 1}, 3, v), std::sqrt(0.14), 1e-15);
}

TEST(Quantities, AreUnknownWhereTheViewHasNothing) {
  const View v;
  for (int k = 0; k < kQuantityKinds; ++k) {
    for (const double x : calc_quantity({kind_of(k), 0}, v)) EXPECT_TRUE(std::isnan(x)) << k;
    EXPECT_TRUE(std::isnan(calc_component({kind_of(k), 0}, 3, v))) << k;
  }
}

TEST(Quantities, HaveNamesOfTheirOwn) {
  std::set<std::string> names;
  for (int k = 0; k < kQuantityKinds; ++k) {
    const QuantityTraits& t = traits_of(kind_of(k));
    EXPECT_TRUE(names.insert(std::string(t.item) + "." + t.word).second) << t.item << " " << t.word;
    EXPECT_GE(t.components, 1);
    EXPECT_EQ(*t.frame == 0, t.components == 1) << t.word;
  }
}

}  // namespace
}  // namespace topple::mbs
