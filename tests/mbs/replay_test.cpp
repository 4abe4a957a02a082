// The same bits again: from a snapshot, and whatever the number of threads.
#include <gtest/gtest.h>

#include "base/error.h"
#include "mbs/model_json.h"
#include "models.h"

namespace topple::mbs {
namespace {

using test::hash_of;
using test::make_box;
using test::make_tower;

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

TEST(SnapshotReplay, GoesOnBetweenTwoLooksForTouchingPoints) {
  Options o;
  o.equilibrium = false;
  o.contact_interval = 3;
  const Model m = make_tower();
  Simulation whole(m, o), other(m, o);
  std::vector<std::vector<std::byte>> kept;
  for (int i = 0; i < 6000; ++i) {
    if (i >= 4000 && i < 4003) kept.push_back(whole.snapshot());
    ASSERT_TRUE(whole.advance_step());
  }
  const std::uint64_t end = hash_of(whole.calc_view());
  ASSERT_GT(whole.calc_view().energy.friction, 0);  // contact took part
  for (size_t k = 0; k < kept.size(); ++k) {
    other.restore(kept[k]);
    for (size_t i = 4000 + k; i < 6000; ++i) ASSERT_TRUE(other.advance_step());
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
