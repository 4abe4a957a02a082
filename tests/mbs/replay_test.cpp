// The same bits again: from a snapshot, and whatever the number of threads.
#include <gtest/gtest.h>

#include <cstring>

#include "base/error.h"
#include "mbs/model_json.h"
#include "models.h"

namespace topple::mbs {
namespace {

using test::make_box;

/// A tower of boxes on weak zones that comes down: yielding, breaking, ground and body contact, a joint that is
/// released.
Model make_tower() {
  Model m;
  ZoneLaw law = test::plastic_hinge(2e4);
  law.rupture_rotation = 0.05;
  law.compression = {{0, 0.02, 0.3}, {4e5, 2e5, 2e5}};
  law.crush_length = 0.2;
  law.shear_y = law.shear_z = 1e5;
  law.slip_rupture = 0.1;
  law.slip_softening = 0.05;
  const LawId id = add_law(m, law);
  BodyId below = kGround;
  for (int i = 0; i < 6; ++i) {
    const BodyId b =
        add_body(m, make_box("b" + std::to_string(i), 4000, {0.5, 0.4, 0.5}, {0.02 * i, 0.01 * i, 0.6 + 1.1 * i}));
    ZoneElement e;
    e.name = "z" + std::to_string(i);
    e.a = below;
    e.b = b;
    e.X_AF = {below == kGround ? Vec3{0, 0, 0.05} : Vec3{0.02, 0.01, 0.55}, test::upright()};
    e.X_BM = {{0, 0, -0.55}, test::upright()};
    if (below == kGround) e.X_AF.p = {0, 0, 0.05};
    e.translational_stiffness = {4e8, 1e8, 1e8};
    e.rotational_stiffness = {2e7, 2e7, 2e7};
    e.stations = {{0, id}};
    add_element(m, e);
    below = b;
  }
  const BodyId flag = add_body(m, make_box("flag", 500, {0.2, 0.2, 0.2}, {0.8, 0.05, 6.1}));
  Joint j;
  j.name = "arm";
  j.parent = below;
  j.child = flag;
  j.X_PF.p = Vec3{0.6, 0.05, 6.1} - m.bodies[5].X_WB.p;
  j.X_CM.p = {-0.2, 0, 0};
  j.shear_limit = 3e4;
  add_joint(m, j);
  Event e;
  e.time = 0.1;
  e.name = "cut";
  Action a;
  a.kind = Action::Kind::RemoveElement;
  a.element = {0};
  e.actions.push_back(a);
  m.events.push_back(e);
  return m;
}

std::uint64_t hash_of(const View& v) {
  std::uint64_t h = 1469598103934665603ULL;
  const auto add = [&](double x) {
    std::uint64_t bits;
    std::memcpy(&bits, &x, sizeof bits);
    h = (h ^ bits) * 1099511628211ULL;
  };
  for (const Pose& X : v.X_WB) {
    for (const double x : {X.p.x, X.p.y, X.p.z, X.q.w, X.q.x, X.q.y, X.q.z}) add(x);
  }
  add(v.energy.residual);
  add(v.energy.friction);
  return h;
}

TEST(SnapshotReplay, GoesOnWithTheSameBitsFromAnyStep) {
  const Model m = make_tower();
  Options o;
  o.equilibrium = false;
  Simulation whole(m, o), other(m, o);
  std::vector<std::vector<std::byte>> kept;
  for (int i = 0; i < 9000; ++i) {
    if (i % 1500 == 700) kept.push_back(whole.snapshot());
    ASSERT_TRUE(whole.advance_step());
  }
  const std::uint64_t end = hash_of(whole.calc_view());
  ASSERT_GT(whole.calc_view().energy.friction, 0);  // contact took part
  for (size_t k = 0; k < kept.size(); ++k) {
    other.restore(kept[k]);
    for (size_t i = 700 + 1500 * k; i < 9000; ++i) ASSERT_TRUE(other.advance_step());
    EXPECT_EQ(hash_of(other.calc_view()), end) << "snapshot " << k;
  }
}

TEST(SnapshotReplay, RefusesForeignBytes) {
  const Model m = make_tower();
  Simulation s(m, {});
  auto bytes = s.snapshot();
  bytes.resize(bytes.size() / 2);
  EXPECT_THROW(s.restore(bytes), InputError);
  EXPECT_THROW(s.restore({}), InputError);
}

TEST(ThreadsReplay, GiveTheSameBits) {
  std::vector<std::uint64_t> ends;
  for (const int threads : {1, 2, 4}) {
    Options o;
    o.equilibrium = false;
    o.duration = 1.5;
    o.threads = threads;
    std::uint64_t h = 0;
    o.on_frame = [&](const View& v) { h = h * 31 + hash_of(v); };
    (void)run(make_tower(), o);
    ends.push_back(h);
  }
  EXPECT_EQ(ends[0], ends[1]);
  EXPECT_EQ(ends[0], ends[2]);
}

TEST(ThreadsReplay, GiveTheSameBitsForALargeModel) {
  // 400 towers of six zones each: enough for the elements to be shared among threads
  const Model one = make_tower();
  Model m;
  m.laws = one.laws;
  for (int t = 0; t < 400; ++t) {
    const Vec3 shift{3.0 * (t % 20), 3.0 * (t / 20), 0};
    const int first = static_cast<int>(m.bodies.size());
    for (Body b : one.bodies) {
      b.X_WB.p += shift;
      add_body(m, b);
    }
    for (ZoneElement e : one.elements) {
      if (e.a == kGround) {
        e.X_AF.p += shift;
      } else {
        e.a.index += first;
      }
      e.b.index += first;
      add_element(m, e);
    }
  }
  std::vector<std::uint64_t> ends;
  std::vector<int> broken;
  for (const int threads : {1, 2, 4}) {
    Options o;
    o.equilibrium = false;
    o.duration = 0.12;
    o.threads = threads;
    std::uint64_t h = 0;
    int breaks = 0;
    o.on_happening = [&](const Happening& x) { breaks += x.kind == Happening::Kind::ElementBroken; };
    o.on_frame = [&](const View& v) { h = h * 31 + hash_of(v); };
    (void)run(m, o);
    ends.push_back(h);
    broken.push_back(breaks);
  }
  EXPECT_EQ(ends[0], ends[1]);
  EXPECT_EQ(ends[0], ends[2]);
  EXPECT_EQ(broken[0], broken[1]);
  EXPECT_EQ(broken[0], broken[2]);
}

TEST(ModelJsonReplay, GivesTheSameRunFromTheFile) {
  const Model m = make_tower();
  const Model back = model_from_json(to_json(m), "tower.json");
  EXPECT_EQ(to_json(back), to_json(m));
  std::uint64_t h[2] = {0, 0};
  for (int i = 0; i < 2; ++i) {
    Options o;
    o.equilibrium = false;
    o.duration = 1;
    o.on_frame = [&](const View& v) { h[i] = h[i] * 31 + hash_of(v); };
    (void)run(i == 0 ? m : back, o);
  }
  EXPECT_EQ(h[0], h[1]);
}

TEST(ModelJson, NamesThePlaceOfAMistake) {
  const auto complaint = [](const std::string& text) {
    try {
      (void)model_from_json(text, "m.json");
    } catch (const InputError& e) { return std::string(e.what()); }
    return std::string("no complaint");
  };
  EXPECT_NE(complaint("{\n  \"format\": \"topple-mbs\",,").find("m.json:2:26"), std::string::npos)
      << complaint("{\n  \"format\": \"topple-mbs\",,");
  EXPECT_NE(complaint("{}").find("format"), std::string::npos);
  std::string text = to_json(make_tower());
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string t = text;
    t.replace(t.find(from), from.size(), to);
    return complaint(t);
  };
  EXPECT_NE(with("\"mass\": 4000.0", "\"mass\": \"heavy\"").find("bodies[0].mass"), std::string::npos);
  EXPECT_NE(with("\"mass\": 4000.0", "\"mass\": -1").find("must be > 0"), std::string::npos);
  EXPECT_NE(with("\"gravity\"", "\"gravitas\"").find("gravity"), std::string::npos);
  EXPECT_NE(with("\"law\": 0", "\"law\": 7").find("there are 1"), std::string::npos);
}

}  // namespace
}  // namespace topple::mbs
