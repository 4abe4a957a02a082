#include "engines/engine.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>

#include "ballistic.h"
#include "base/error.h"
#include "cases.h"
#include "engines/compare.h"

namespace topple::engines {
namespace {

using test::make_options;
using Kind = mbs::Joint::Kind;

mbs::Model make_stone() {
  mbs::Model m = test::make_empty({0, 0, -9.81});
  mbs::Body b = test::make_body("stone", 2, {1, 1, 1}, {0, 0, 100});
  b.v_WB = {3, 0, 1};
  b.w_WB = {0, 0.5, 0};
  mbs::add_body(m, b);
  return m;
}

/// All that an error says.
std::string message_of(const std::function<void()>& f) {
  try {
    f();
  } catch (const InputError& e) { return e.what(); }
  return {};
}

TEST(Engine, NativeRunsAFallingBody) {
  const auto c = test::run(*make_engine("native"), make_stone(), make_options(1, 0.5, 1e-3));
  EXPECT_EQ(c.summary.ending, mbs::Summary::Ending::TimeLimit);
  ASSERT_EQ(c.frames.size(), 3U);
  EXPECT_NEAR(c.frames[2].X_WB[0].p.z, 100 + 1 - 0.5 * 9.81, 1e-9);
}

TEST(Simbody, EndsWithAStepLongerThanItsFrames) {
  if (!test::is_available("simbody")) GTEST_SKIP() << "not built in";
  const auto c = test::run(*make_engine("simbody"), make_stone(), make_options(0.3, 0.01, 0.017));
  EXPECT_EQ(c.summary.ending, mbs::Summary::Ending::TimeLimit);
  EXPECT_NEAR(c.frames.back().X_WB[0].p.x, 0.9, 0.06);
}

TEST(Simbody, SamplesAtTheInstantsThatItsStepsEndOn) {
  if (!test::is_available("simbody")) GTEST_SKIP() << "not built in";
  // what is cut off the grid by an event is back on the instants of outputs, the end among them
  mbs::Model m = make_stone();
  mbs::Action a;
  a.kind = mbs::Action::Kind::ReplaceBody;
  a.body = {0};
  a.replacement = test::make_body("stone", 1, {1, 1, 1}, {0.1, 0, 0});
  mbs::Event e;
  e.time = 0.10017;
  e.actions = {a};
  m.events = {e};
  mbs::Options o = make_options(0.3, 0.1, 5e-4);
  std::vector<double> times;
  o.samplings.push_back({1e-3, [&](const mbs::View& v) { times.push_back(v.time); }});
  (void)make_engine("simbody")->run(m, o);
  ASSERT_EQ(times.size(), 301u);
  for (size_t i = 0; i < times.size(); ++i) EXPECT_NEAR(times[i], 1e-3 * static_cast<double>(i), 1e-11);
}

TEST(SimbodyPhysics, SeesAPulseShorterThanItsSteps) {
  if (!test::is_available("simbody")) GTEST_SKIP() << "not built in";
  mbs::Model m = test::make_empty({});
  mbs::add_body(m, test::make_body("b", 2, {1, 1, 1}, {}));
  mbs::Load l;
  l.body = {0};
  l.force = {2000, 0, 0};
  l.time = {0, 0.123, 0.12301, 0.12302, 1}, l.factor = {0, 0, 1, 0, 0};
  m.loads.push_back(l);
  const auto c = test::run(*make_engine("simbody"), m, make_options(1, 1, 0));
  EXPECT_NEAR(c.frames.back().v_WB[0].x, 0.01, 1e-8);
}

TEST(Engine, UnknownNamesAreRefusedWithAGuess) {
  const std::string message = message_of([] { make_engine("simbodi"); });
  EXPECT_NE(message.find("there is no engine \"simbodi\""), std::string::npos);
  EXPECT_NE(message.find("did you mean \"simbody\"?"), std::string::npos);
  EXPECT_NE(message.find("native, simbody, mujoco"), std::string::npos);
}

TEST(Engine, ThoseNotBuiltInNameTheirPackage) {
  for (const EngineInfo& e : list_engines()) {
    if (e.is_available()) {
      EXPECT_EQ(make_engine(e.name)->version(), e.version);
      continue;
    }
    const std::string message = message_of([&] { make_engine(e.name); });
    EXPECT_NE(message.find(e.package), std::string::npos) << message;
  }
}

TEST(Engine, TheSmallestOneComparesWithTheNative) {
  std::vector<std::unique_ptr<Engine>> list;
  list.push_back(make_engine("native"));
  list.push_back(std::make_unique<example::BallisticEngine>());
  const Comparison c = compare(make_stone(), make_options(2, 0.1, 1e-3), list);
  ASSERT_EQ(c.runs.size(), 2U);
  EXPECT_EQ(c.runs[1].time.size(), 21U);
  EXPECT_LT(c.runs[1].position.value, 1e-10);  // round-off
  EXPECT_LT(c.runs[1].orientation.value, 1e-10);
  EXPECT_LT(c.runs[1].summary.energy_error, 1e-12);
}

/// Lines without comments and blanks around them.
std::vector<std::string> code_lines(std::istream& in, bool inside_blocks) {
  std::vector<std::string> lines;
  bool inside = !inside_blocks;
  for (std::string line; std::getline(in, line);) {
    if (inside_blocks && line.starts_with("```")) {
      inside = line == "```cpp";
      continue;
    }
    line = line.substr(0, line.find("//"));
    const size_t begin = line.find_first_not_of(' '), end = line.find_last_not_of(' ');
    if (inside && begin != std::string::npos) lines.push_back(line.substr(begin, end - begin + 1));
  }
  return lines;
}

TEST(Engine, TheDocumentShowsTheSmallestOneAsItIs) {
  std::ifstream page(std::string(TOPPLE_SOURCE_DIR) + "/docs/engines.md");
  std::ifstream code(std::string(TOPPLE_SOURCE_DIR) + "/tests/engines/ballistic.h");
  const auto shown = code_lines(page, true), is = code_lines(code, false);
  ASSERT_GT(shown.size(), 15U);
  for (const std::string& line : shown)
    if (line != "...") { EXPECT_NE(std::find(is.begin(), is.end(), line), is.end()) << line; }
}

TEST(Engine, TheSmallestOneNamesWhatItCannotExpress) {
  mbs::Model m = make_stone();
  mbs::add_joint(m, test::make_joint(m, Kind::Spherical, mbs::kGround, {0}, {}));
  m.joints[0].name = "ball";
  const example::BallisticEngine engine;
  const std::string message = message_of([&] { (void)engine.run(m, make_options(1, 0.1)); });
  EXPECT_NE(message.find("joints[0] \"ball\": engine \"ballistic\" cannot express joints"), std::string::npos)
      << message;
}

/// What an engine says about a model, one line each.
std::string unsupported_by(const std::string& engine, const mbs::Model& model, bool equilibrium = false) {
  mbs::Options o = make_options(1, 0.1);
  o.equilibrium = equilibrium;
  std::string text;
  for (const Unsupported& u : make_engine(engine)->find_unsupported(model, o)) text += u.place + ": " + u.what + "\n";
  return text;
}

class Unexpressed : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TOPPLE_NEEDS_ENGINE(GetParam()); }
  /// The engine names the place and refuses to run.
  void expect_named(const mbs::Model& model, const std::string& place, const std::string& what) {
    const std::string text = unsupported_by(GetParam(), model);
    EXPECT_EQ(text.find(place + ": " + what), 0U) << "\"" << text << "\"";
    const std::string message =
        message_of([&] { (void)make_engine(GetParam())->run(model, make_options(0.01, 0.01)); });
    EXPECT_NE(message.find(place), std::string::npos) << message;
    EXPECT_EQ(unsupported_by("native", model), "");
  }
};

TEST_P(Unexpressed, InertiasThatNoMassHas) {
  mbs::Model m = make_stone();
  m.bodies[0].inertia = Mat3::diagonal({0.2, 0.2, 0.5});
  expect_named(m, "bodies[0] \"stone\".inertia", "an inertia with a principal moment larger than");
}

TEST_P(Unexpressed, InertiasThatNoReplacementHas) {
  mbs::Model m = make_stone();
  mbs::Event e;
  e.name = "strip";
  mbs::Action a;
  a.kind = mbs::Action::Kind::ReplaceBody;
  a.body = {0};
  a.replacement = test::make_body("half", 1, {0.1, 0.1, 0.3}, {});
  e.actions = {a};
  m.events.push_back(e);
  expect_named(m, "events[0] \"strip\".replacement.inertia", "an inertia");
}

TEST_P(Unexpressed, VelocitiesThatOpenAJoint) {
  mbs::Model m = make_stone();
  mbs::add_joint(m, test::make_joint(m, Kind::Revolute, mbs::kGround, {0}, {{0, 0, 100}, {}}));
  expect_named(m, "joints[0] \"j0\"", "velocities at the start that open a joint");
  EXPECT_EQ(unsupported_by(GetParam(), m, true), "") << "the equilibrium has none";
  m.bodies[0].v_WB = {};
  m.bodies[0].w_WB = {0, 0, 4};
  EXPECT_EQ(unsupported_by(GetParam(), m), "") << "about the axis";
}

INSTANTIATE_TEST_SUITE_P(Each, Unexpressed, testing::Values("simbody", "mujoco"),
                         [](const testing::TestParamInfo<std::string>& engine) { return engine.param; });

/// A cube of 1 m half a metre above the ground, and another beside it.
mbs::Model make_cubes() {
  mbs::Model m = test::make_empty({0, 0, -9.81});
  for (int i = 0; i < 2; ++i) {
    mbs::Body b = test::make_body("cube", 10, {1.7, 1.7, 1.7}, {2.0 * i, 0, 1});
    mbs::Shape s;
    s.half = {0.5, 0.5, 0.5};
    b.shapes.push_back(s);
    mbs::add_body(m, b);
  }
  m.contact.ground = m.contact.bodies = true;
  return m;
}

TEST(UnexpressedBySimbody, ContactBetweenBodies) {
  TOPPLE_NEEDS_ENGINE("simbody");
  mbs::Model m = make_cubes();
  EXPECT_NE(unsupported_by("simbody", m).find("contact.bodies: contact between bodies"), std::string::npos);
  m.contact.bodies = m.contact.ground = false;
  EXPECT_EQ(unsupported_by("simbody", m), "");
}

TEST(UnexpressedByMujoco, RulesOfPairs) {
  TOPPLE_NEEDS_ENGINE("mujoco");
  mbs::Model m = make_cubes();
  EXPECT_EQ(unsupported_by("mujoco", m), "");
  mbs::Contact::Pair p;
  p.a = {0};
  p.b = {1};
  p.touches = false;
  m.contact.pairs.push_back(p);
  EXPECT_EQ(unsupported_by("mujoco", m), "") << "pairs that do not touch are expressed";
  p.touches = true;
  m.contact.pairs.push_back(p);
  EXPECT_EQ(unsupported_by("mujoco", m), "contact.pairs[1]: rules of its own for a pair of bodies\n");
}

TEST(UnexpressedByMujoco, BodiesTooSmallForIt) {
  TOPPLE_NEEDS_ENGINE("mujoco");
  mbs::Model m = test::make_empty({0, 0, -9.81});
  mbs::add_body(m, test::make_body("dust", 1e-16, {1, 1, 1}, {}));
  mbs::add_body(m, test::make_body("needle", 1, {1e-16, 1, 1}, {}));
  mbs::add_body(m, test::make_body("speck", 1e-14, {1e-14, 1e-14, 1e-14}, {}));
  EXPECT_EQ(unsupported_by("mujoco", m),
            "bodies[0] \"dust\": a mass of 1e-16 kg; above 1e-15 kg it can\n"
            "bodies[1] \"needle\": a principal moment of 1e-16 kg·m²; above 1e-15 kg·m² it can\n");
  m.bodies.erase(m.bodies.begin(), m.bodies.begin() + 2);
  EXPECT_EQ(test::run(*make_engine("mujoco"), m, make_options(0.01, 0.01)).summary.ending,
            mbs::Summary::Ending::TimeLimit);
}

/// Flat bodies: moments a, b and a + b, about the axes and turned.
TEST(UnexpressedByNone, FlatBodiesWhoseMomentsAreRounded) {
  mbs::Model m = test::make_empty({0, 0, 0});
  std::mt19937 random(1);
  const auto draw = [&] { return (1 + static_cast<double>(random())) / 4294967296.0; };
  for (int i = 0; i < 400; ++i) {
    const double size = std::pow(10, 12 * draw() - 4), a = size * draw(), b = size * draw() * std::pow(10, -4 * draw());
    const Mat3 R = i % 2 ? to_matrix(exp_rotation({3 * draw(), 3 * draw(), 3 * draw()})) : Mat3::identity();
    mbs::Body body = test::make_body("flat", 1, {1, 1, 1}, {5.0 * i, 0, 0});
    body.inertia = R * Mat3::diagonal({a, b, a + b}) * transpose(R);
    for (int k = 0; k < 3; ++k) body.inertia(k, (k + 1) % 3) = body.inertia((k + 1) % 3, k);
    body.w_WB = {1, 2, 3};
    mbs::add_body(m, body);
  }
  m.bodies[0].inertia = Mat3::diagonal({0.01, 0.09, 0.1});
  ASSERT_LT(0.01 + 0.09, 0.1);
  // the thinnest one wobbles at 4e4 rad/s
  const auto native = test::run(*make_engine("native"), m, make_options(0.01, 0.01, 2.5e-6));
  for (const char* engine : {"simbody", "mujoco"}) {
    if (!test::is_available(engine)) continue;
    const auto c = test::run(*make_engine(engine), m, make_options(0.01, 0.01, 1e-5));
    ASSERT_EQ(c.summary.ending, mbs::Summary::Ending::TimeLimit) << engine << ": " << c.summary.message;
    for (size_t b = 0; b < m.bodies.size(); ++b)
      EXPECT_LT(norm(log_rotation(conjugate(c.frames.back().X_WB[b].q) * native.frames.back().X_WB[b].q)), 1e-7)
          << engine << " " << b;
  }
}

}  // namespace
}  // namespace topple::engines
