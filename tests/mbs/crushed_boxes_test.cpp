// Boxes that get shorter as their member is crushed, by its element or where its end meets something. g = 9.81.
#include "mbs/crushed_boxes.h"

#include <gtest/gtest.h>

#include "mbs/system.h"
#include "models.h"

namespace topple::mbs {
namespace {

using test::hash_of;
using test::make_box;
using test::make_event;

constexpr double kMass = 4000, kBears = 2e5, kSpeed = 8;  // [kg, N, m/s]
constexpr double kZone = 0.3, kThrough = 1.9;             // lengths of a zone and of the post [m]

/// A plate on a post of 2 m, one body, whose element holds the post's foot at a height; it comes down at kSpeed.
Model make_post(double height = 0) {
  Model m;
  m.contact.restitution = 0;
  Body plate = make_box("plate", kMass, {1, 1, 0.25}, {0, 0, height + 2.25});
  Shape post;
  post.half = {0.15, 0.15, 1};
  post.X_BS.p = {0, 0, -1.25};
  plate.shapes.push_back(post);
  plate.v_WB = {0, 0, -kSpeed};
  add_body(m, plate);
  ZoneLaw law;
  law.compression = {{0, 10}, {kBears, kBears}};
  law.crush_length = kZone;
  const LawId id = add_law(m, law);
  ZoneElement e;
  e.name = "post";
  e.a = kGround;
  e.b = {0};
  e.X_AF = {{0, 0, height + 1}, test::upright()};
  e.X_BM = {{0, 0, -1.25}, test::upright()};
  e.translational_stiffness = {1e9, 1e8, 1e8};
  e.rotational_stiffness = {1e8, 1e8, 1e8};
  e.damping_ratio = 0;
  e.stations = {{-1, id}, {1, id}};
  e.crush_through = kThrough;
  add_element(m, e);
  return m;
}

Options options_of(double step) {
  Options o;
  o.duration = 0.4;
  o.step = step;
  o.equilibrium = false;
  o.frame_interval = 1e-3;
  return o;
}

/// Way over which a force stops what comes down at kSpeed after a free fall [m].
double calc_way(double force, double fall = 0) {
  return kMass * (0.5 * kSpeed * kSpeed + 9.81 * fall) / (force - kMass * 9.81);
}

TEST(CrushedBoxPhysics, AMemberIsCrushedBeyondItsFirstZoneAndItsBoxWithIt) {
  System s(make_post(), options_of(1e-4), 0);
  s.start();
  for (int i = 0; i < 4000; ++i) ASSERT_TRUE(s.advance_step());
  s.save_elements();
  const double way = calc_way(kBears), shortened = s.state.element[0].shortened;
  ASSERT_GT(way, 2 * kZone);
  EXPECT_TRUE(s.state.element[0].live);
  EXPECT_NEAR(shortened, way, 0.005 * way);
  // the top of the post stays where it is, its foot recedes to the ground
  const CompiledShape& post = s.state.shapes[1];
  EXPECT_NEAR(2 * post.half.z, 2 - shortened, 1e-9);
  EXPECT_NEAR(post.p_BS.z + post.half.z, -0.25, 1e-12);
  const Vec3 p = s.state.p[0];
  EXPECT_NEAR(p.z + post.p_BS.z - post.half.z, 0, 1e-3);
  EXPECT_EQ(post.half.x, 0.15);
  EXPECT_EQ(s.state.shapes[0].half.z, 0.25);
}

TEST(CrushedBoxPhysics, AMemberEndsWhenAllOfItIsCrushed) {
  Model m = make_post();
  m.bodies[0].v_WB.z = -14;  // 2.4 m of way
  std::vector<std::string> told;
  Options o = options_of(1e-4);
  double height = 1e9;
  o.on_happening = [&](const Happening& h) {
    if (h.kind == Happening::Kind::ElementBroken) told.push_back(h.reason);
  };
  o.on_frame = [&](const View& v) {
    if (told.empty()) height = v.X_WB[0].p.z;
  };
  (void)run(m, o);
  EXPECT_EQ(told, std::vector<std::string>{"crushing"});
  EXPECT_NEAR(height, 2.25 - kThrough, 0.02);
}

TEST(CrushedBoxPhysics, EndsMeetWhereAWeakLengthIsCrushedThrough) {
  // 0.3 m that bear a quarter; the element breaks, and the post stands on its end, which bears what it always did
  constexpr double kWeak = 0.25 * kBears;
  Model m = make_post();
  ZoneLaw weak = *m.laws.shared(0);
  weak.compression = {{0, kZone, 1.001 * kZone, 10}, {kWeak, kWeak, kBears, kBears}};
  weak.keeps_length = true;
  m.events.push_back(make_event(0, Action::Kind::SwitchLaw, 0));
  m.events.back().actions.front().element = {0};
  m.events.back().actions.front().law = add_law(m, weak);
  // what comes down brings 1/2 m v² and its weight, over both ways
  const double way = kZone + (kMass * (0.5 * kSpeed * kSpeed + 9.81 * kZone) - kWeak * kZone) / (kBears - kMass * 9.81);
  for (const double step : {1e-4, 5e-5}) {
    Options o = options_of(step);
    double broken_at = 1e9, least = 1e9;
    std::string reason;
    o.on_happening = [&](const Happening& h) {
      if (h.kind == Happening::Kind::ElementBroken) reason = h.reason, broken_at = least;
    };
    o.on_frame = [&](const View& v) { least = std::min(least, v.X_WB[0].p.z); };
    EXPECT_LT(run(m, o).energy_error, 0.01);
    EXPECT_EQ(reason, "crushing");
    EXPECT_NEAR(broken_at, 2.25 - kZone, 0.01);
    EXPECT_NEAR(2.25 - least, way, 0.01 * way) << step;
  }
}

TEST(CrushedBoxPhysics, WherePointsOfItsCurveAreDoesNotShortenAMember) {
  // the same force all along, by one point behind the weak length or by two
  const auto find_way = [](const std::vector<double>& x) {
    Model m = make_post();
    ZoneLaw weak = *m.laws.shared(0);
    weak.compression = {x, std::vector<double>(x.size(), kBears)};
    weak.keeps_length = true;
    m.events.push_back(make_event(0, Action::Kind::SwitchLaw, 0));
    m.events.back().actions.front().element = {0};
    m.events.back().actions.front().law = add_law(m, weak);
    Options o = options_of(1e-4);
    double least = 1e9;
    o.on_frame = [&](const View& v) { least = std::min(least, v.X_WB[0].p.z); };
    EXPECT_LT(run(m, o).energy_error, 0.01);
    return 2.25 - least;
  };
  const double way = kMass * 0.5 * kSpeed * kSpeed / (kBears - kMass * 9.81);
  ASSERT_GT(way, 1.05 * kZone);
  for (const double next : {1.001, 1.1, 1.5, 5.0})
    EXPECT_NEAR(find_way({0, kZone, next * kZone, 20}), way, 0.01 * way) << next;
  EXPECT_NEAR(find_way({0, 10}), way, 0.01 * way);
}

/// Lowest place of the plate when the post comes down on its end.
double land(Model m, double step, double& energy_error) {
  m.events.push_back(make_event(0, Action::Kind::RemoveElement, 0));
  Options o = options_of(step);
  double least = 1e9;
  o.on_frame = [&](const View& v) { least = std::min(least, v.X_WB[0].p.z); };
  energy_error = run(m, o).energy_error;
  return least;
}

TEST(CrushedBoxPhysics, TheEndOfAMemberIsCrushedWhereItLands) {
  constexpr double kFall = 0.05;
  const double lowest = 2.25 - calc_way(kBears, kFall);
  for (const double step : {2e-4, 1e-4}) {
    double error = 0;
    EXPECT_NEAR(land(make_post(kFall), step, error), lowest, 0.01) << step;
    EXPECT_LT(error, 2e-3) << step;
    // on another body in place of the ground
    Model m = make_post(kFall);
    Body anvil = make_box("anvil", 1, {2, 2, 0.5}, {0, 0, -0.5});
    anvil.fixed = true;
    add_body(m, anvil);
    m.contact.ground = false;
    EXPECT_NEAR(land(m, step, error), lowest, 0.01) << step;
    EXPECT_LT(error, 2e-3) << step;
  }
}

TEST(CrushedBoxPhysics, AnEndThatBearsStaysWhole) {
  Model m = make_post(0.05);
  m.laws.edit(0, [](ZoneLaw& law) { law.compression = {{0, 10}, {1e12, 1e12}}; });
  m.bodies[0].v_WB.z = -1;
  double error = 0;
  EXPECT_NEAR(land(m, 1e-4, error), 2.25, 0.01);
}

TEST(CrushedBoxPhysics, OfTwoEndsTheWeakerOneIsCrushed) {
  // the post comes down on one that stands on the ground, twice as strong
  Model m = make_post(2);
  m.contact.friction = m.contact.body_friction = 5;
  Body below = make_box("below", 50000, {1, 1, 0.25}, {0, 0, 0.25});
  Shape post;
  post.half = {0.15, 0.15, 0.75};
  post.X_BS.p = {0, 0, 1};
  below.shapes.push_back(post);
  add_body(m, below);
  Body cap = make_box("cap", kMass, {1, 1, 1}, {0, 0, 1});
  cap.shapes.clear();
  add_body(m, cap);
  ZoneLaw law;
  law.compression = {{0, 10}, {2 * kBears, 2 * kBears}};
  law.crush_length = kZone;
  ZoneElement e = m.elements[0];  // the member stands on `below`, so its box is a's
  e.a = {1};
  e.b = {2};
  e.X_AF = {{0, 0, 0.75}, test::upright()};
  e.X_BM = {{}, test::upright()};
  const LawId id = add_law(m, law);
  e.stations = {{-0.75, id}, {0.75, id}};
  add_element(m, e);
  m.events.push_back(make_event(0, Action::Kind::RemoveElement, 0));
  m.events.push_back(make_event(0, Action::Kind::RemoveElement, 1));
  System s(m, options_of(1e-4), 0);
  s.start();
  for (int i = 0; i < 2500; ++i) ASSERT_TRUE(s.advance_step());
  const double way = calc_way(kBears);
  EXPECT_NEAR(2 - 2 * s.state.shapes[1].half.z, way, 0.02 * way);
  EXPECT_EQ(s.state.shapes[3].half.z, 0.75);
}

TEST(CrushedBoxReplay, GoesOnFromASnapshotWithTheSameBits) {
  Model m = make_post();
  m.events.push_back(
      make_event(0.1, Action::Kind::RemoveElement, 0));  // half of the way by the element, half at its end
  Options o = options_of(1e-4);
  Simulation whole(m, o), other(m, o);
  std::vector<std::vector<std::byte>> kept;
  const int at[] = {503, 1501};
  for (int i = 0; i < 3000; ++i) {
    if (i == at[0] || i == at[1]) kept.push_back(whole.snapshot());
    ASSERT_TRUE(whole.advance_step());
  }
  const std::uint64_t end = hash_of(whole.calc_view());
  EXPECT_NEAR(whole.calc_view().X_WB[0].p.z, 2.25 - calc_way(kBears), 0.02);
  for (size_t k = 0; k < 2; ++k) {
    other.restore(kept[k]);
    for (int i = at[k]; i < 3000; ++i) ASSERT_TRUE(other.advance_step());
    EXPECT_EQ(hash_of(other.calc_view()), end) << k;
  }
}

/// A column that falls on a plate as its element is crushed.
Model make_column_on_plate(Shape::Kind kind) {
  Model m;
  m.contact.ground = false;
  Body column = make_box("column", 1000, {0.2, 0.2, 1}, {0, 0, 1.01});
  add_body(m, column);
  Body plate = make_box("plate", 1, {1, 1, 0.5}, {0, 0, -0.5});
  plate.fixed = true;
  Shape& s = plate.shapes[0];
  s.kind = kind;
  if (kind == Shape::Kind::Hull)
    for (int i = 0; i < 8; ++i) s.vertices.push_back({i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 0.5 : -0.5});
  add_body(m, plate);
  ZoneLaw law;
  law.compression = {{0, 0.05}, {5e3, 5e3}};
  law.crush_length = 0.3;
  ZoneElement e;
  e.a = kGround, e.b = {0};
  e.X_AF = {{0, 0, 0.01}, test::upright()};
  e.X_BM = {{0, 0, -1}, test::upright()};
  e.translational_stiffness = {1e7, 1e7, 1e7};
  e.rotational_stiffness = {1e6, 1e6, 1e6};
  e.stations = {{0, add_law(m, law)}};
  e.crush_through = 1.9;
  add_element(m, e);
  return m;
}

TEST(CrushedBox, MeetsPolyhedraAsShortAsItIs) {
  Options o = options_of(0);
  o.duration = 0.6;
  double z[2] = {0, 0};
  for (const bool is_hull : {false, true}) {
    o.on_frame = [&](const View& v) { z[is_hull ? 1 : 0] = v.X_WB[0].p.z; };
    (void)run(make_column_on_plate(is_hull ? Shape::Kind::Hull : Shape::Kind::Box), o);
  }
  EXPECT_LT(z[0], 0.5);
  EXPECT_NEAR(z[1], z[0], 0.01);
  // what goes on from a snapshot has the same shapes
  o.on_frame = nullptr;
  o.step = 1e-4;
  Simulation a(make_column_on_plate(Shape::Kind::Hull), o), b(make_column_on_plate(Shape::Kind::Hull), o);
  for (int i = 0; i < 4000; ++i) ASSERT_TRUE(a.advance_step());
  b.restore(a.snapshot());
  const std::vector<std::byte> middle = a.snapshot();
  const auto go_on = [](Simulation& s) {
    for (int i = 0; i < 2000; ++i) EXPECT_TRUE(s.advance_step());
    return test::hash_of(s.calc_view());
  };
  const std::uint64_t end = go_on(a);
  EXPECT_EQ(go_on(b), end);
  a.restore(middle);  // it has shorter shapes by now
  EXPECT_EQ(go_on(a), end);
}

TEST(CrushedBox, FollowsABodyThatIsReplaced) {
  Model m = make_post();
  Event& event = m.events.emplace_back(make_event(0.02, Action::Kind::ReplaceBody, 0));
  event.actions[0].body = {0};
  event.actions[0].replacement = m.bodies[0];
  event.actions[0].replacement.X_WB = {};
  event.actions[0].replacement.shapes[1].half = {0.1, 0.1, 1};
  event.actions[0].replacement.shapes.erase(event.actions[0].replacement.shapes.begin());
  System s(m, options_of(1e-4), 0);
  s.start();
  for (int i = 0; i < 4000; ++i) ASSERT_TRUE(s.advance_step());
  s.save_elements();
  ASSERT_EQ(s.state.crushed_boxes.size(), 1U);
  const CrushedBox& box = s.state.crushed_boxes[0];
  const CompiledShape& post = s.state.shapes[static_cast<size_t>(box.shape)];
  EXPECT_EQ(post.half.x, 0.1);
  EXPECT_EQ(post.crushed, 0);
  EXPECT_NEAR(2 * post.half.z, 2 - s.state.element[0].shortened, 1e-9);
}

/// Boxes along x of a marker at the origin of the body, with their ends.
std::vector<Shape> make_boxes(std::initializer_list<std::pair<double, double>> ends) {
  std::vector<Shape> out;
  for (const auto& [low, high] : ends) {
    Shape s;
    s.half = {0.5 * (high - low), 0.1, 0.1};
    s.X_BS.p = {0.5 * (low + high), 0, 0};
    out.push_back(s);
  }
  return out;
}

TEST(CrushedBox, RecedesWhereTheMemberIsCrushed) {
  const double stations[] = {-1, 1};
  std::vector<Shape> shapes = make_boxes({{-1.5, 1.5}, {-0.5, 0.9}, {-3, -1.1}, {1.1, 2}});
  std::vector<CrushedBox> b, a;
  find_crushed_boxes(7, {}, true, stations, shapes, b);
  find_crushed_boxes(7, {}, false, stations, shapes, a);
  // what lies beyond the member is none of it
  ASSERT_EQ(b.size(), 2U);
  ASSERT_EQ(a.size(), 2U);
  for (const auto& boxes : {a, b})
    for (size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(boxes[i].shape, static_cast<int>(i));
      EXPECT_EQ(boxes[i].element, 7);
      EXPECT_EQ(boxes[i].axis, 0);
      EXPECT_TRUE(boxes[i].is_member);
    }
  // the long one from the first millimetre on, the short one once the crushing has come to it
  EXPECT_EQ(b[0].begin, 0);
  EXPECT_NEAR(b[1].begin, 0.5, 1e-12);
  EXPECT_NEAR(a[1].begin, 0.1, 1e-12);
  Shape& s = shapes[1];
  EXPECT_FALSE(shorten_box(0.45, b[1], s.X_BS.p, Mat3::identity(), s.half));
  EXPECT_TRUE(shorten_box(0.7, b[1], s.X_BS.p, Mat3::identity(), s.half));
  EXPECT_NEAR(s.X_BS.p.x - s.half.x, -0.3, 1e-12);
  EXPECT_NEAR(s.X_BS.p.x + s.half.x, 0.9, 1e-12);
  EXPECT_FALSE(shorten_box(0.6, b[1], s.X_BS.p, Mat3::identity(), s.half));  // what is crushed stays so
  EXPECT_TRUE(shorten_box(5, b[1], s.X_BS.p, Mat3::identity(), s.half));
  EXPECT_NEAR(2 * s.half.x, kRubble, 1e-12);
  EXPECT_TRUE(shorten_box(0.3, a[0], shapes[0].X_BS.p, Mat3::identity(), shapes[0].half));
  EXPECT_NEAR(shapes[0].X_BS.p.x + shapes[0].half.x, 1.2, 1e-12);
  EXPECT_NEAR(shapes[0].X_BS.p.x - shapes[0].half.x, -1.5, 1e-12);
}

TEST(CrushedBox, LiesAlongTheMember) {
  const double both[] = {-1, 1}, one[] = {0};
  std::vector<Shape> shapes = make_boxes({{0, 1}});
  std::vector<CrushedBox> found;
  shapes[0].X_BS.q = exp_rotation({0, 0, 0.1});
  find_crushed_boxes(0, {}, true, both, shapes, found);
  EXPECT_TRUE(found.empty());
  // turned upside down its other end is meant
  shapes[0].X_BS.q = exp_rotation({0, 0, 3.14159265358979});
  find_crushed_boxes(0, {}, true, both, shapes, found);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].end, 1);
  // beside the axis it is no part of the member, such as a wall; with one station the member is on b's side
  shapes[0].X_BS.p.y = 0.2;
  found.clear();
  find_crushed_boxes(0, {}, true, one, shapes, found);
  find_crushed_boxes(0, {}, false, one, shapes, found);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_FALSE(found[0].is_member);
  shapes[0].kind = Shape::Kind::Sphere;
  found.clear();
  find_crushed_boxes(0, {}, true, both, shapes, found);
  EXPECT_TRUE(found.empty());
}

}  // namespace
}  // namespace topple::mbs
