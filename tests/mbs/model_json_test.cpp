#include "mbs/model_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "base/error.h"
#include "models.h"

namespace topple::mbs {
namespace {

using test::make_box;
using testing::HasSubstr;

/// Two links and a few parts between them; `more` is put in front of the file's end.
std::string file_with(const std::string& more, const std::string& bodies = "") {
  return R"({"format": "topple-mbs", "version": 2,
 "bodies": [
  {"name": "link1", "mass": 2, "inertia": [1, 2, 3], "X_WB": {"p": [1, 0, 0], "axis": [0, 0, 2], "angle": 0.5}},
  {"name": "link2", "mass": 2, "inertia": [[1, 0, 0], [0, 2, 0.1], [0, 0.1, 3]], "X_WB": {"p": [3, 1, 0]}})" +
         bodies + "]" + (more.empty() ? "" : ",\n " + more) + "\n}\n";
}

Model read(const std::string& more, const std::string& bodies = "") {
  return model_from_json(file_with(more, bodies), "m.json");
}

/// All complaints about a text, a line each: "line:column message | help".
std::string complaints_of(const std::function<void()>& f) {
  try {
    f();
  } catch (const InputError& e) {
    std::string all;
    for (const Diagnostic& d : e.diagnostics())
      all +=
          std::to_string(d.where.line) + ":" + std::to_string(d.where.column) + " " + d.message + " | " + d.help + "\n";
    return all;
  }
  return "no complaint";
}
std::string complaints(const std::string& more, const std::string& bodies = "") {
  return complaints_of([&] { (void)read(more, bodies); });
}

Pose pose_of(const Model& m, BodyId id) {
  return id == kGround ? Pose{} : m.bodies[static_cast<size_t>(id.index)].X_WB;
}

TEST(ModelJson, FacesWithTooManyCornersAreToldWithTheirPlace) {
  const auto drum = [](int corners) {
    std::string text =
        ",\n  {\"name\": \"drum\", \"mass\": 1, \"inertia\": [1, 1, 1], \"X_WB\": {},\n   \"shapes\": [{\"hull\": [";
    for (int i = 0; i < 2 * corners; ++i) {
      const double angle = 2 * std::numbers::pi * (i / 2) / corners;
      text += (i > 0 ? ", [" : "[") + std::to_string(std::cos(angle)) + ", " + std::to_string(std::sin(angle)) +
              (i % 2 ? ", 0]" : ", 1]");
    }
    return text + "]}]}";
  };
  EXPECT_EQ(complaints("", drum(64)), "no complaint");
  EXPECT_EQ(complaints("", drum(65)),
            "6:16 bodies[2].shapes[0].hull \"drum\": a face has 65 corners; at most 64 are possible | \n");
}

TEST(ModelJson, NamesAndPlacesMeanTheSame) {
  const std::string rest = R"(, "at": [2, 0, 0], "axis": [0, 1, 0]}])";
  const Model by_name = read(R"("joints": [{"kind": "revolute", "parent": "ground", "child": "link2")" + rest);
  const Model by_place = read(R"("joints": [{"kind": "revolute", "parent": -1, "child": 1)" + rest);
  EXPECT_EQ(to_json(by_name), to_json(by_place));
  EXPECT_EQ(by_name.joints[0].parent, kGround);
  EXPECT_EQ(by_name.joints[0].child.index, 1);
}

TEST(ModelJson, ProposesTheNearestName) {
  const auto cable = [](const std::string& a) {
    return complaints(R"("cables": [{"a": ")" + a +
                      R"(", "b": "link1", "p_A": [0, 0, 9], "p_B": [0, 0, 0], "stiffness": 1}])");
  };
  EXPECT_THAT(cable("lnik2"), HasSubstr("cables[0].a: there is no body \"lnik2\"; did you mean \"link2\"?"));
  EXPECT_THAT(cable("groud"), HasSubstr("did you mean \"ground\"?"));
  EXPECT_THAT(cable("7"), HasSubstr("there is no body \"7\""));
  EXPECT_THAT(complaints(R"("cabels": [])"), HasSubstr("unknown key \"cabels\"; did you mean \"cables\"?"));
  EXPECT_THAT(complaints(R"("loads": [{"body": "ground", "force": [1, 0, 0]}])"), HasSubstr("not the ground"));
  EXPECT_THAT(complaints(R"("loads": [{"body": -1, "force": [1, 0, 0]}])"), HasSubstr("not the ground"));
  EXPECT_THAT(complaints(R"("loads": [{"body": 2, "force": [1, 0, 0]}])"), HasSubstr("out of range: there are 2"));
}

TEST(ModelJson, SaysWhenANameIsAmbiguous) {
  const std::string twin = R"(, {"name": "link1", "mass": 1, "inertia": [1, 1, 1], "X_WB": {}})";
  EXPECT_THAT(complaints(R"("loads": [{"body": "link1", "force": [1, 0, 0]}])", twin),
              HasSubstr("\"link1\" is ambiguous: 2 items of \"bodies\" have this name, the first at 0 and 2"));
  EXPECT_EQ(complaints(R"("loads": [{"body": "link2", "force": [1, 0, 0]}])", twin), "no complaint");
  const std::string ground = R"(, {"name": "ground", "mass": 1, "inertia": [1, 1, 1], "X_WB": {}})";
  EXPECT_THAT(
      complaints(R"("cables": [{"a": "ground", "b": 0, "p_A": [0, 0, 0], "p_B": [0, 0, 0], "stiffness": 1}])", ground),
      HasSubstr("\"ground\" is ambiguous"));
}

TEST(ModelJson, PlacesEveryComplaint) {
  const std::string all = complaints(
      R"("joints": [
  {"kind": "revolut", "parent": 0, "child": 1, "at": [0, 0, 0], "axis": [0, 1, 0]},
  {"kind": "revolute", "parent": 0, "child": 1, "at": [0, 0], "axis": [0, 1, 0]}],
 "outputs": [{"name": "x", "body": 0, "quantity": "postion"}])");
  EXPECT_THAT(all,
              HasSubstr("6:4 joints[0].kind: does not know \"revolut\"; did you mean \"revolute\"? | one of: fixed,"));
  EXPECT_THAT(all, HasSubstr("7:49 joints[1].at: needs a list of three numbers"));
  EXPECT_THAT(all, HasSubstr("8:39 outputs[0].quantity: does not know \"postion\"; did you mean \"position\"?"));
  // what only the check of the whole model finds is placed as well
  EXPECT_THAT(complaints("\"outputs\": [{\"name\": \"x\", \"body\": 0, \"quantity\": \"position\",\n \"rate\": 0}]"),
              HasSubstr("6:2 outputs[0].rate \"x\": must be > 0 and at most 1e6, is 0"));
}

TEST(ModelJson, RefusesWhatStandsBehindAZeroByte) {
  std::string text = file_with("");
  text.insert(text.size() - 1, std::string("\0 no JSON {", 11));
  EXPECT_THAT(complaints_of([&] { (void)model_from_json(text, "m.json"); }), HasSubstr("a zero byte is no JSON"));
}

TEST(ModelJson, PlacesMistakesBehindOtherLetters) {
  // columns count characters, not bytes; a byte order mark is no character
  const std::string text =
      "\xEF\xBB\xBF{\"format\": \"topple-mbs\", \"version\": 2, \"name\": \"Stütze\", \"bodies\": 3}";
  const std::string told = complaints_of([&] { (void)model_from_json(text, "m.json"); });
  EXPECT_THAT(told, HasSubstr("1:58 bodies: must be a list"));
  EXPECT_EQ(told.find("must be a list"), told.rfind("must be a list")) << told;  // once
  const std::string escaped = R"({"format": "topple-mbs", "version": 2, "b\u006fdies": [], "joints": 4})";
  EXPECT_THAT(complaints_of([&] { (void)model_from_json(escaped, "m.json"); }),
              HasSubstr("1:59 joints: must be a list"));
}

TEST(ModelJson, ReadsVersionOneAndNoLaterThanItsOwn) {
  const std::string old = R"({"format": "topple-mbs", "version": 1, "bodies": [{"name": "b", "mass": 1,
    "inertia": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "X_WB": {"p": [0, 0, 0], "q": [1, 0, 0, 0]},
    "shapes": [{"box": [1, 1, 1]}]}],
    "joints": [{"kind": "fixed", "parent": -1, "child": 0, "X_PF": {"p": [0, 0, 0], "q": [1, 0, 0, 0]},
                "X_CM": {"p": [0, 0, 0], "q": [1, 0, 0, 0]}}]})";
  EXPECT_EQ(model_from_json(old, "m.json").joints[0].kind, Joint::Kind::Fixed);
  std::string later = old;
  later.replace(later.find("\"version\": 1"), 12, "\"version\": 3");
  EXPECT_THAT(complaints_of([&] { (void)model_from_json(later, "m.json"); }), HasSubstr("versions 1 to 2"));
}

TEST(ModelJson, ReadsTheSettingsOfTheRun) {
  RunSettings run;
  (void)model_from_json(
      file_with(
          R"("run": {"duration": 3, "step": 1e-4, "stability_share": 0.5, "frame_interval": 0.1, "equilibrium": false,
              "rest_speed": 0.2})"),
      "m.json", &run);
  EXPECT_EQ(run.duration, 3);
  EXPECT_EQ(run.step, 1e-4);
  EXPECT_EQ(run.stability_share, 0.5);
  EXPECT_EQ(run.frame_interval, 0.1);
  EXPECT_EQ(run.equilibrium, false);
  EXPECT_EQ(run.rest_speed, 0.2);
  RunSettings again;
  (void)model_from_json(to_json(read(""), run), "m.json", &again);
  EXPECT_EQ(again.duration, 3);
  EXPECT_EQ(again.stability_share, 0.5);
  EXPECT_EQ(again.rest_speed, 0.2);
  for (const char* wrong : {"\"duration\": 0", "\"step\": -1", "\"frame_interval\": 0", "\"rest_speed\": -1",
                            "\"stability_share\": 0", "\"stability_share\": 1.1", "\"equilibrium\": 1", "\"steps\": 5"})
    EXPECT_THAT(complaints(std::string("\"run\": {") + wrong + "}"), HasSubstr("run")) << wrong;
  EXPECT_THAT(complaints(R"("run": {"duration": 20, "step": 1e-30})"),
              testing::AllOf(HasSubstr("5:"), HasSubstr("run.step"), HasSubstr("at least 2e-08")));
}

// --------------------------------------------------------------------------------------------- what people write
// easily

TEST(ModelJson, TurnsAreQuaternionsOrAnAngleAboutAnAxis) {
  const Model m = read("");
  const Quat q = exp_rotation({0, 0, 0.5});
  EXPECT_NEAR(m.bodies[0].X_WB.q.w, q.w, 1e-16);
  EXPECT_NEAR(m.bodies[0].X_WB.q.z, q.z, 1e-16);
  EXPECT_EQ(m.bodies[1].X_WB.q, Quat{});
  EXPECT_EQ(m.bodies[0].inertia, Mat3::diagonal({1, 2, 3}));
  const auto with = [](const std::string& pose) {
    return complaints("", R"(, {"name": "b", "mass": 1, "inertia": [1, 1, 1], "X_WB": )" + pose + "}");
  };
  EXPECT_THAT(with(R"({"axis": [0, 0, 0], "angle": 1})"), HasSubstr("is no direction"));
  EXPECT_THAT(with(R"({"axis": [0, 0, 1]})"), HasSubstr("belong together"));
  EXPECT_THAT(with(R"({"axis": [0, 0, 1], "angle": 1, "q": [1, 0, 0, 0]})"), HasSubstr("not both"));
  EXPECT_THAT(with(R"({"q": [0.7, 0, 0, 0.7]})"), HasSubstr("is not a unit quaternion"));
}

TEST(ModelJson, TypedQuaternionsAreRoundedToATurn) {
  // ten digits are a turn to 1e-10, but the joint that hangs on it must be closed to round-off
  const Model m = read(
      R"("joints": [{"kind": "fixed", "parent": "ground", "child": 2, "at": [50, 60, 70]}])",
      R"(, {"name": "b", "mass": 1, "inertia": [1, 1, 1], "X_WB": {"p": [10, 20, 30], "q": [0.7071067812, 0.7071067812, 0, 0]}})");
  const Quat& q = m.bodies[2].X_WB.q;
  EXPECT_NEAR(q.w * q.w + q.x * q.x, 1, 1e-15);  // some units of the last place
}

/// F and M of a joint in W.
struct JointFrames {
  Pose F, M;
};
JointFrames frames_of(const Model& m, size_t j = 0) {
  const Joint& joint = m.joints[j];
  return {pose_of(m, joint.parent) * joint.X_PF, pose_of(m, joint.child) * joint.X_CM};
}
void expect_near(const Vec3& a, const Vec3& b) { EXPECT_LT(norm(a - b), 1e-14) << a.x << " " << a.y << " " << a.z; }

TEST(ModelJson, JointsStandWhereTheyAreSaidToBe) {
  for (const char* kind : {"revolute", "prismatic", "cylindrical", "fixed", "spherical"})
    for (const Vec3& axis : {Vec3{0, 0, 1}, Vec3{1, 0, 0}, Vec3{0, -3, 0}, Vec3{1, 2, 3}}) {
      const Model m =
          read(std::string(R"("joints": [{"parent": "link1", "child": "link2", "at": [2, 0.5, 7], "kind": ")") + kind +
               "\", \"axis\": [" + std::to_string(axis.x) + "," + std::to_string(axis.y) + "," +
               std::to_string(axis.z) + "]}]");
      const JointFrames f = frames_of(m);
      expect_near(f.F.p, {2, 0.5, 7});
      expect_near(f.M.p, {2, 0.5, 7});
      expect_near(to_matrix(f.F.q).column(2), (1 / norm(axis)) * axis);
      EXPECT_LT(norm(log_rotation(conjugate(f.F.q) * f.M.q)), 1e-14);
      EXPECT_GT(to_matrix(f.F.q).column(0).x + to_matrix(f.F.q).column(0).y, 0.5)
          << "x is an axis of W as far as z allows";
    }
}

TEST(ModelJson, JointsTakeTheDirectionOfPullFromX) {
  const Model m = read(
      R"("joints": [{"kind": "revolute", "parent": "link1", "child": "link2", "at": [2, 0, 0], "axis": [0, 1, 0],
      "x": [1, 1, 1], "tension_limit": 5}])");
  const double h = std::sqrt(0.5);
  expect_near(to_matrix(frames_of(m).F.q).column(0), {h, 0, h});
  EXPECT_THAT(complaints(R"("joints": [{"kind": "revolute", "parent": "link1", "child": "link2", "at": [2, 0, 0],
      "axis": [0, 1, 0], "tension_limit": 5}])"),
              HasSubstr("need \"x\""));
  EXPECT_THAT(complaints(R"("joints": [{"kind": "revolute", "parent": "link1", "child": "link2", "at": [2, 0, 0],
      "axis": [0, 1, 0], "x": [0, 2, 0]}])"),
              HasSubstr("is parallel to \"axis\""));
  const Model along =
      read(R"("joints": [{"kind": "fixed", "parent": 0, "child": 1, "at": [2, 0, 0], "x": [0, 0, -2]}])");
  expect_near(to_matrix(frames_of(along).F.q).column(0), {0, 0, -1});
}

TEST(ModelJson, UniversalJointsHaveTwoAxes) {
  const Model m = read(
      R"("joints": [{"kind": "universal", "parent": "link1", "child": "link2", "at": [2, 0, 0], "axes": [[0, 0, 3], [1, 1, 0]]}])");
  const JointFrames f = frames_of(m);
  const double h = std::sqrt(0.5);
  expect_near(to_matrix(f.F.q).column(0), {0, 0, 1});
  expect_near(to_matrix(f.M.q).column(1), {h, h, 0});
  EXPECT_THAT(
      complaints(
          R"("joints": [{"kind": "universal", "parent": 0, "child": 1, "at": [2, 0, 0], "axes": [[0, 0, 1], [1, 0, 1]]}])"),
      HasSubstr("must be at right angles; they are at 45 degrees"));
  EXPECT_THAT(
      complaints(R"("joints": [{"kind": "universal", "parent": 0, "child": 1, "at": [2, 0, 0], "axis": [0, 0, 1]}])"),
      HasSubstr("does not go with"));
  EXPECT_THAT(
      complaints(
          R"("joints": [{"kind": "revolute", "parent": 0, "child": 1, "at": [2, 0, 0], "axes": [[0, 0, 1], [1, 0, 0]]}])"),
      HasSubstr("axis"));
}

TEST(ModelJson, DistanceJointsHaveTwoPoints) {
  const Model m = read(
      R"("joints": [{"kind": "distance", "parent": "link1", "child": "ground", "points": [[1, 0, 0], [1, 0, 2]]}])");
  const JointFrames f = frames_of(m);
  expect_near(f.F.p, {1, 0, 0});
  expect_near(f.M.p, {1, 0, 2});
  expect_near(to_matrix(f.F.q).column(0), {0, 0, 1});
  EXPECT_THAT(
      complaints(R"("joints": [{"kind": "distance", "parent": 0, "child": 1, "points": [[1, 0, 0], [1, 0, 0]]}])"),
      HasSubstr("no distance apart"));
  EXPECT_THAT(complaints(R"("joints": [{"kind": "distance", "parent": 0, "child": 1, "at": [1, 0, 0]}])"),
              HasSubstr("needs \"points\""));
  EXPECT_THAT(complaints(R"("joints": [{"kind": "fixed", "parent": 0, "child": 1, "points": [[1, 0, 0], [2, 0, 0]]}])"),
              HasSubstr("is for distance joints"));
}

TEST(ModelJson, PointsInWBecomePointsOfTheBodies) {
  const Model m = read(R"("springs": [{"a": "link1", "b": "ground", "points": [[1, 0, 1], [1, 3, 5]], "spring": 7}],
    "cables": [{"a": "link2", "b": "ground", "points": [[3, 1, 1], [0, 0, 9]], "stiffness": 1}],
    "loads": [{"body": "link1", "at": [1, 0, 2], "force": [1, 0, 0]}],
    "bushings": [{"a": "link1", "b": "link2", "at": [2, 0, 0], "spring": [1, 1, 1, 1, 1, 1]}])");
  expect_near(m.bodies[0].X_WB * m.springs[0].p_A, {1, 0, 1});
  expect_near(m.springs[0].p_B, {1, 3, 5});
  EXPECT_DOUBLE_EQ(m.springs[0].free_length, 5) << "left out: at rest at the start";
  EXPECT_EQ(m.springs[0].spring.rate, 7);
  expect_near(m.cables[0].p_A, {0, 0, 1});
  expect_near(m.bodies[0].X_WB * m.loads[0].p_B, {1, 0, 2});
  const Pose F = m.bodies[0].X_WB * m.bushings[0].X_AF;
  expect_near(F.p, {2, 0, 0});
  EXPECT_LT(norm(log_rotation(F.q)), 1e-15) << "axes of W";
}

TEST(ModelJson, CharacteristicsReadNaturally) {
  const Model m = read(R"("springs": [{"a": "link1", "b": "link2", "p_A": [0, 0, 0], "p_B": [0, 0, 0],
    "spring": {"table": {"x": [-1, 2], "f": [-3, 4]}}, "damper": {"polynomial": [0, 5, 0, 6]}}])");
  EXPECT_EQ(m.springs[0].spring.kind, Characteristic::Kind::Table);
  EXPECT_EQ(m.springs[0].spring.f, (std::vector<double>{-3, 4}));
  EXPECT_EQ(m.springs[0].damper.kind, Characteristic::Kind::Polynomial);
  EXPECT_EQ(m.springs[0].damper.coefficients, (std::vector<double>{0, 5, 0, 6}));
  const auto spring = [](const std::string& law) {
    return complaints(R"("springs": [{"a": 0, "b": 1, "p_A": [0, 0, 0], "p_B": [0, 0, 0], "spring": )" + law + "}]");
  };
  EXPECT_THAT(spring("\"stiff\""), HasSubstr("must be a number (linear)"));
  EXPECT_THAT(spring("{}"), HasSubstr("needs \"polynomial\" or \"table\""));
  EXPECT_THAT(spring(R"({"polynomial": []})"), HasSubstr("has no coefficients"));
  EXPECT_THAT(spring(R"({"table": {"x": [0], "f": [0]}})"), HasSubstr("at least two points"));
  EXPECT_THAT(spring(R"({"table": {"x": [0, 0], "f": [0, 1]}})"), HasSubstr("does not rise at index 1"));
  EXPECT_THAT(spring(R"({"table": {"x": [0, 1], "f": [0, 1, 2]}})"), HasSubstr("2 values of x and 3 of f"));
  EXPECT_THAT(spring(R"({"table": {"x": [0, 1], "f": [0, null]}})"),
              HasSubstr("springs[0].spring.table.f[1]: must be a number"));
}

TEST(ModelJson, FamiliesHaveTheirRowsInOneList) {
  const auto family = [](const std::string& positive) {
    return complaints(
        R"("laws": [{"moment_y": {"normal_force": [-1, 1], "plastic_rotation": [0, 1], "negative": [1, 2, 3, 4],
    "positive": )" +
        positive + "}}]");
  };
  EXPECT_EQ(family("[1, 2, 3, 4]"), "no complaint");
  EXPECT_THAT(family("[[1, 2], [3, 4]]"),
              HasSubstr("laws[0].moment_y.positive[0]: must be a number: the K x J values are one list, row by row"));
}

TEST(ModelJson, PairsFollowTheGeneralRulesWhereTheySayNothing) {
  const Model m = read(R"("contact": {"friction": 0.3, "restitution": 0, "body_friction": 0.2, "body_restitution": 0.5,
    "pairs": [{"a": "link1", "b": "ground"}, {"a": "link1", "b": "link2", "damping": 0}]})");
  EXPECT_EQ(m.contact.pairs[0].friction, 0.3);
  EXPECT_EQ(m.contact.pairs[0].restitution, 0);
  EXPECT_LT(m.contact.pairs[0].damping, 0);
  EXPECT_EQ(m.contact.pairs[1].friction, 0.2);
  EXPECT_EQ(m.contact.pairs[1].restitution, 0.5);
  EXPECT_EQ(m.contact.pairs[1].damping, 0);
}

TEST(ModelJson, EventsWaitForLimits) {
  const Model m = read(R"("events": [{"when": [
      {"body": "link2", "quantity": "position", "component": "z", "falls_to": -1},
      {"cable": "rope", "quantity": "force", "rises_to": 5}],
      "actions": [{"do": "release_cable", "cable": "rope"}]}],
    "cables": [{"name": "rope", "a": 0, "b": 1, "p_A": [0, 0, 0], "p_B": [0, 0, 0], "stiffness": 1}])");
  ASSERT_EQ(m.events[0].triggers.size(), 2u);
  const Trigger& t = m.events[0].triggers[0];
  EXPECT_EQ(t.quantity.kind, Quantity::Kind::Position);
  EXPECT_EQ(t.quantity.index, 1);
  EXPECT_EQ(t.component, 2);
  EXPECT_FALSE(t.rising);
  EXPECT_EQ(t.limit, -1);
  EXPECT_EQ(m.events[0].triggers[1].quantity.kind, Quantity::Kind::CableForce);
  EXPECT_TRUE(m.events[0].triggers[1].rising);
  const auto when = [](const std::string& limit) {
    return complaints(R"("events": [{"when": [)" + limit + R"(], "actions": []}])");
  };
  EXPECT_EQ(when(R"({"body": 0, "quantity": "velocity", "component": "magnitude", "rises_to": 1})"), "no complaint");
  EXPECT_THAT(when(R"({"body": 0, "quantity": "velocity", "rises_to": 1})"), HasSubstr("needs \"component\""));
  EXPECT_THAT(when(R"({"body": 0, "quantity": "velocity", "component": "x"})"),
              HasSubstr("\"rises_to\" or \"falls_to\""));
  EXPECT_THAT(when(R"({"body": 0, "quantity": "torque", "component": "x", "rises_to": 1})"),
              HasSubstr("does not know \"torque\""));
  EXPECT_THAT(when(R"({"body": 0, "joint": 0, "quantity": "force", "component": "x", "rises_to": 1})"),
              HasSubstr("joint"));
  EXPECT_THAT(when(R"({"quantity": "force", "component": "x", "rises_to": 1})"), HasSubstr("needs a body, joint"));
  EXPECT_THAT(complaints(R"("events": [{"when": [], "actions": []}])"), HasSubstr("is empty"));
  EXPECT_THAT(complaints(R"("events": [{"actions": []}])"), HasSubstr("needs \"time\" or \"when\""));
}

TEST(ModelJson, ActionsHaveTheKeysOfTheirKind) {
  const auto action = [](const std::string& a) {
    return complaints(R"("events": [{"time": 1, "actions": [)" + a + "]}]");
  };
  EXPECT_THAT(action(R"({"do": "remove_load", "element": 0})"),
              HasSubstr("\"element\" does not go with \"remove_load\""));
  EXPECT_THAT(action(R"({"do": "remove_load", "load": 0})"), HasSubstr("out of range: there are 0"));
  EXPECT_THAT(action(R"({"do": "remove_lode"})"), HasSubstr("did you mean \"remove_load\"?"));
}

TEST(ModelJson, RefusesModelsOfNothing) {
  try {
    (void)model_from_json(R"({"format": "topple-mbs", "version": 2, "bodies": []})", "m.json");
    ADD_FAILURE() << "no complaint";
  } catch (const InputError& e) { EXPECT_THAT(e.what(), HasSubstr("bodies: is empty: a model has at least one body")); }
}

TEST(ModelJson, VelocitiesDoNotGoWithTheEquilibrium) {
  const std::string text = R"({"format": "topple-mbs", "version": 2, "bodies": [
  {"name": "still", "mass": 1, "inertia": [1, 1, 1], "X_WB": {}},
  {"name": "thrown", "mass": 1, "inertia": [1, 1, 1], "X_WB": {}, "v_WB": [1, 0, 0],
   "w_WB": [0, 0, 5]}]})";
  Model m = model_from_json(text, "m.json");
  try {
    refuse_velocities(m, text, "m.json");
    ADD_FAILURE() << "no complaint";
  } catch (const InputError& e) {
    ASSERT_EQ(e.diagnostics().size(), 2u);
    const Diagnostic& d = e.diagnostics()[0];
    EXPECT_EQ(d.code, "E601");
    EXPECT_THAT(d.message, HasSubstr("bodies[1].v_WB \"thrown\": would be lost"));
    EXPECT_THAT(d.help, HasSubstr("\"equilibrium\": false"));
    EXPECT_EQ(d.where.line, 3);
    EXPECT_EQ(e.diagnostics()[1].where.line, 4);
  }
  m.bodies[1].v_WB = m.bodies[1].w_WB = {};
  EXPECT_NO_THROW(refuse_velocities(m, text, "m.json"));
}

TEST(ModelJson, NamesHoldNoControlCharacters) {
  EXPECT_THAT(complaints(R"("name": "a\u001b[2Jb")"), HasSubstr("holds a control character"));
}

TEST(ModelJson, ManyMistakesEndSomewhere) {
  std::string joints;
  for (int i = 0; i < 1000; ++i) joints += std::string(i ? "," : "") + R"({"kind": "ball"})";
  try {
    (void)read("\"joints\": [" + joints + "]");
    FAIL();
  } catch (const InputError& e) { EXPECT_EQ(e.diagnostics().size(), 50u); }
}

// -------------------------------------------------------------------------------------------------------------- checks

/// A model that is right and has one of each of the newer things.
Model make_model() {
  Model m;
  m.bodies = {make_box("a", 1, {1, 1, 1}, {0, 0, 5}), make_box("b", 1, {1, 1, 1}, {4, 0, 5})};
  Body plane;
  plane.name = "plane";
  plane.fixed = true;
  plane.shapes.resize(1);
  plane.shapes[0].kind = Shape::Kind::Plane;
  m.bodies.push_back(plane);
  Shape hull;
  hull.kind = Shape::Kind::Hull;
  hull.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  m.bodies[0].shapes.push_back(hull);
  Joint j;
  j.kind = Joint::Kind::Cylindrical;
  j.parent = {0};
  j.child = {1};
  j.X_PF.p = {2, 0, 0};
  j.X_CM.p = {-2, 0, 0.5};
  m.joints = {j};
  SpringDamper s;
  s.a = {0};
  s.b = {1};
  s.spring.rate = 5;
  m.springs = {s};
  RotationalSpring r;
  r.joint = {0};
  m.rotational_springs = {r};
  Bushing b;
  b.a = {0};
  b.b = kGround;
  m.bushings = {b};
  Load l;
  l.body = {0};
  l.time = {0, 1};
  l.factor = {0, 1};
  m.loads = {l};
  m.contact.pairs = {{{0}, {1}}};
  Event e;
  e.triggers = {{{Quantity::Kind::JointAngle, 0}, 0, 1, true}};
  m.events = {e};
  m.outputs = {{"x", {Quantity::Kind::Position, 0}, 100}, {"y", {Quantity::Kind::JointDisplacement, 0}, 100}};
  return m;
}

Joint make_joint(Joint::Kind kind, const Pose& X_PF, const Pose& X_CM) {
  Joint j;
  j.kind = kind;
  j.parent = kGround;
  j.child = {0};
  j.X_PF = X_PF;
  j.X_CM = X_CM;
  return j;
}

TEST(CheckModel, LetsTheRightModelPass) {
  EXPECT_EQ(complaints_of([] { check_model(make_model()); }), "no complaint");
  const Model m = make_model();
  EXPECT_EQ(to_json(model_from_json(to_json(m), "m.json")), to_json(m));
}

TEST(CheckModel, FindsEachMistake) {
  const double nan = std::nan(""), inf = kUnlimited;
  using Edit = std::function<void(Model&)>;
  const auto action = [](Action::Kind kind, int index) {
    Action a;
    a.kind = kind;
    a.index = index;
    return a;
  };
  const auto crushed = [](double through) {
    ZoneElement e;
    e.a = kGround;
    e.b = {0};
    e.crush_through = through;
    return e;
  };
  const std::vector<std::pair<Edit, std::string>> cases = {
      {[](Model& m) { m.bodies[0].shapes.push_back(m.bodies[2].shapes[0]); },
       "bodies[0].shapes[2].plane \"a\": only a fixed"},
      {[](Model& m) {
         m.bodies[2].v_WB = {0, 0, 1};
       },
       "is not 0, and a fixed body does not move"},
      {[](Model& m) {
         m.bodies[2].w_WB = {0, 0, 1};
       },
       "is not 0, and a fixed body does not turn"},
      {[](Model& m) { m.bodies[2].mass = -3; }, "bodies[2].mass \"plane\": must be finite and not negative, is -3"},
      {[](Model& m) { m.bodies[0].mass = 1e-320; }, "bodies[0].mass \"a\": is 9.99989e-321, too small to compute"},
      {[](Model& m) { m.bodies[0].shapes[1].vertices.pop_back(); }, "at least 4 vertices, has 3"},
      {[](Model& m) {
         m.bodies[0].shapes[1].vertices[3] = {1, 1, 1e-9};
       },
       "lie in one plane"},
      {[](Model& m) {
         m.bodies[0].shapes[1].vertices.assign(9, {1, 2, 3});
       },
       "lie in one plane"},
      {[=](Model& m) { m.bodies[0].shapes[1].vertices[2].y = nan; }, "vertex 2 is not finite"},
      {[](Model& m) { m.joints[0].child = {7}; }, "joints[0].child: names number 7; there are 3"},
      {[](Model& m) { m.joints[0].child = {0}; }, "joins a body to itself"},
      {[](Model& m) {
         m.joints[0].kind = Joint::Kind::Spherical;
         m.joints[0].rotation_limit = 1;
       },
       "only revolute and cylindrical joints have an angle"},
      {[](Model& m) {
         m.joints[0].kind = Joint::Kind::Spherical;
         m.joints[0].moment_limit = 1;
       },
       "holds no moment"},
      {[=](Model& m) { m.joints[0].tension_limit = nan; }, "tension_limit: must not be negative"},
      {[](Model& m) { m.springs[0].b = {0}; }, "springs[0]: joins a body to itself"},
      {[=](Model& m) { m.springs[0].p_A.x = nan; }, "springs[0].p_A: is not finite"},
      {[](Model& m) {
         m.springs[0].p_A = {4, 0, 0};
       },
       "at the same place at the start"},
      {[](Model& m) {
         Cable c;
         c.a = kGround, c.b = {0};
         c.p_A = pose_of(m, c.b) * c.p_B;
         c.stiffness = 1, c.pretension = 5;
         m.cables = {c};
       },
       "cables[0].pretension: its ends are at the same place at the start"},
      {[](Model& m) {
         Cable c;
         c.a = kGround, c.b = {0};
         c.p_A = pose_of(m, c.b) * c.p_B + Vec3{0, 0, 2};
         c.stiffness = 100, c.pretension = 201;
         m.cables = {c};
       },
       "cables[0].pretension: stretches it by more than the distance of its ends"},
      {[=](Model& m) { m.elements.push_back(crushed(-1)); }, "crush_through: must be finite and not negative"},
      {[=](Model& m) { m.elements.push_back(crushed(1)); }, "crush_through: needs a station"},
      {[](Model& m) { m.springs[0].free_length = -1; }, "free_length: must be finite and not negative"},
      {[=](Model& m) { m.springs[0].spring.rate = inf; }, "springs[0].spring: is not a finite number"},
      {[=](Model& m) {
         m.springs[0].damper = {Characteristic::Kind::Polynomial, 0, {1, nan}, {}, {}};
       },
       "damper: is not finite at index 1"},
      {[](Model& m) {
         m.springs[0].damper = {Characteristic::Kind::Table, 0, {}, {1, 0}, {0, 0}};
       },
       "damper: does not rise at index 1"},
      {[](Model& m) { m.springs[0].tension_strength = -1; }, "tension_strength: must not be negative"},
      {[](Model& m) { m.springs[0].compression_strength = -1; }, "compression_strength: must not be negative"},
      {[](Model& m) { m.rotational_springs[0].joint = {1}; },
       "rotational_springs[0].joint: names number 1; there are 1"},
      {[](Model& m) { m.joints[0].kind = Joint::Kind::Prismatic; }, "is neither a revolute nor a cylindrical joint"},
      {[=](Model& m) { m.rotational_springs[0].free_angle = nan; }, "free_angle"},
      {[](Model& m) { m.rotational_springs[0].strength = -1; }, "rotational_springs[0].strength"},
      {[](Model& m) { m.bushings[0].a = kGround; }, "bushings[0]: joins a body to itself"},
      {[](Model& m) { m.bushings[0].X_AF.q.w = 2; }, "bushings[0].X_AF: is not a unit quaternion"},
      {[=](Model& m) { m.bushings[0].spring[4].rate = nan; }, "bushings[0].spring[4]: is not a finite number"},
      {[](Model& m) { m.bushings[0].damper[1].kind = Characteristic::Kind::Polynomial; },
       "bushings[0].damper[1]: the polynomial has no"},
      {[=](Model& m) { m.bushings[0].strength[5] = -inf; }, "bushings[0].strength[5]: must not be negative"},
      {[](Model& m) { m.loads[0].body = kGround; }, "loads[0].body: names number -1"},
      {[](Model& m) { m.loads[0].factor.pop_back(); }, "has 2 times and 1 factors"},
      {[](Model& m) { m.loads[0].time[1] = 0; }, "loads[0].table: does not rise at index 1"},
      {[=](Model& m) { m.loads[0].factor[1] = nan; }, "loads[0].table: is not finite at index 1"},
      {[=](Model& m) { m.loads[0].torque.z = inf; }, "loads[0].torque"},
      {[](Model& m) { m.contact.restitution = -0.1; }, "contact.restitution: must lie between 0 and 1"},
      {[](Model& m) { m.contact.body_restitution = 1.1; }, "contact.body_restitution: must lie between 0 and 1"},
      {[](Model& m) { m.contact.pairs[0].a = kGround; }, "contact.pairs[0].a"},
      {[](Model& m) { m.contact.pairs[0].b = {0}; }, "names one body twice"},
      {[](Model& m) {
         m.contact.pairs.push_back({{1}, {0}});
       },
       "these two have rules already, number 0"},
      {[](Model& m) { m.contact.pairs[0].restitution = 2; }, "contact.pairs[0].restitution"},
      {[](Model& m) { m.contact.pairs[0].friction = -1; }, "contact.pairs[0].friction"},
      {[=](Model& m) { m.contact.pairs[0].stiffness = inf; }, "contact.pairs[0].stiffness"},
      {[=](Model& m) { m.contact.pairs[0].damping = nan; }, "contact.pairs[0].damping"},
      {[](Model& m) { m.events[0].triggers[0].component = 1; }, "events[0].when[0].component: must be 0 or 3"},
      {[](Model& m) {
         m.events[0].triggers[0] = {{Quantity::Kind::Position, 0}, 4, 0, true};
       },
       "component: must be 0, 1, 2 or 3"},
      {[](Model& m) { m.events[0].triggers[0].quantity.index = 1; },
       "events[0].when[0].joint: names number 1; there are 1"},
      {[=](Model& m) { m.events[0].triggers[0].limit = nan; }, "rises_to: is not a finite number"},
      {[](Model& m) { m.events[0].triggers[0].quantity.kind = Quantity::Kind::CableForce; },
       "when[0].cable: names number 0; there are 0"},
      {[=](Model& m) { m.events[0].actions = {action(Action::Kind::RemoveSpring, 1)}; },
       "actions[0].spring: names number 1"},
      {[=](Model& m) { m.events[0].actions = {action(Action::Kind::RemoveRotationalSpring, -1)}; },
       "actions[0].rotational_spring"},
      {[=](Model& m) { m.events[0].actions = {action(Action::Kind::RemoveBushing, 1)}; }, "actions[0].bushing"},
      {[=](Model& m) { m.events[0].actions = {action(Action::Kind::RemoveLoad, 1)}; }, "actions[0].load"},
      {[=](Model& m) { m.events[0].actions = {action(Action::Kind::ApplyLoad, 1)}; }, "actions[0].load"},
      {[=](Model& m) { m.outputs[0].rate = inf; }, "outputs[0].rate \"x\": must be > 0"},
      {[](Model& m) { m.outputs[1].name = "x"; }, "outputs[1].name \"x\": another output has this name"},
      {[](Model& m) { m.outputs[1].name = ""; }, "outputs[1].name: is empty"},
      {[](Model& m) { m.outputs[1].name = "../x"; }, "outputs[1].name"},
      {[](Model& m) { m.outputs[1].name = "a/b"; }, "a character that file names cannot have"},
      {[](Model& m) { m.outputs[0].quantity.index = 3; }, "outputs[0].body \"x\": names number 3"},
      {[](Model& m) {
         m.joints[0].kind = Joint::Kind::Revolute;
         m.joints[0].X_CM.p.z = 0;
       },
       "only prismatic and cylindrical joints have a displacement"},
  };
  for (const auto& [edit, expected] : cases) {
    Model m = make_model();
    edit(m);
    EXPECT_THAT(complaints_of([&] { check_model(m); }), HasSubstr(expected));
  }
}

/// A joint of a kind is closed; moved by `p` or turned by `r` it is open or still closed.
void expect_closed(Joint::Kind kind, const Vec3& p, const Vec3& r, bool closed) {
  const Pose X_WF{{1, 2, 3}, exp_rotation({0.3, -0.2, 0.9})};
  Model m;
  m.bodies = {make_box("a", 1, {1, 1, 1}, {0.5, 0, 5})};
  m.bodies[0].X_WB.q = exp_rotation({0.1, 0.2, 0.3});
  const Pose X_FM{p, exp_rotation(r)};
  m.joints = {make_joint(kind, X_WF, inverse(m.bodies[0].X_WB) * X_WF * X_FM)};
  const std::string said = complaints_of([&] { check_model(m); });
  if (closed) {
    EXPECT_EQ(said, "no complaint") << static_cast<int>(kind);
  } else {
    EXPECT_THAT(said, HasSubstr("at the start")) << static_cast<int>(kind);
  }
}

TEST(CheckModel, JointsMustHoldAtTheStartWhatTheyHold) {
  using Kind = Joint::Kind;
  const double tiny = 1e-9;  // ten times what is accepted
  for (Kind kind : {Kind::Fixed, Kind::Revolute, Kind::Spherical, Kind::Universal, Kind::Prismatic, Kind::Cylindrical})
    for (int k = 0; k < 3; ++k) {
      Vec3 shift, turn;
      shift[k] = 2e1 * tiny;
      turn[k] = tiny;
      const bool slides = kind == Kind::Prismatic || kind == Kind::Cylindrical;
      expect_closed(kind, {}, {}, true);
      expect_closed(kind, shift, {}, slides && k == 2);
      const bool may_turn = kind == Kind::Spherical || (kind == Kind::Universal && k != 2) ||
                            ((kind == Kind::Revolute || kind == Kind::Cylindrical) && k == 2);
      expect_closed(kind, {}, turn, may_turn);
    }
  // large values of what is free
  expect_closed(Kind::Cylindrical, {0, 0, -3}, {0, 0, 2.5}, true);
  expect_closed(Kind::Prismatic, {0, 0, 5}, {}, true);
  expect_closed(Kind::Spherical, {}, {1, 2, -1}, true);
  expect_closed(Kind::Revolute, {}, {0, 0, 3}, true);
  expect_closed(Kind::Universal, {}, {0.7, 0, 0}, true);
  expect_closed(Kind::Universal, {}, {0, 0.7, 0}, true);
  expect_closed(Kind::Distance, {0, 1, 0}, {1, 1, 1}, true);
  expect_closed(Kind::Distance, {0, 0, 0}, {}, false);
  // the other way round is not closed
  expect_closed(Kind::Revolute, {}, {3.14159265358979, 0, 0}, false);
}

TEST(CheckModel, SaysByHowMuchAJointIsOpen) {
  Model m;
  m.bodies = {make_box("a", 1, {1, 1, 1}, {0, 0, 0})};
  m.joints = {make_joint(Joint::Kind::Revolute, {{0, 0, 0}, {}}, {{0, 3e-7, 0}, exp_rotation({2e-6, 0, 0})})};
  EXPECT_THAT(complaints_of([&] { check_model(m); }),
              HasSubstr("3e-07 m and 2e-06 rad apart at the start; they must meet"));
  m.joints = {make_joint(Joint::Kind::Universal, {}, {{}, exp_rotation({0, 0, 0.01})})};
  EXPECT_THAT(complaints_of([&] { check_model(m); }), HasSubstr("0.01 rad off the right angle at the start"));
}

}  // namespace
}  // namespace topple::mbs
