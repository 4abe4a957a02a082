// Results do not depend on the units in which a model is written, nor on what is far away.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "mbs/model_json.h"
#include "mbs/solver.h"
#include "models.h"

namespace topple::mbs {
namespace {

using nlohmann::json;

// A body on a slide, held by a spring of third degree and by a member that yields at both stations.
const char* const kHeld =
    R"json({"format":"topple-mbs","version":2,"run":{"duration":0.02},"gravity":[-2.0456,2.69584,-1.19539],"bodies":[{
"name":"b0","mass":3.27145,"inertia":[[0.385007,-0.00599272,-0.0289643],[-0.00599272,0.250515,-0.048379],[
-0.0289643,-0.048379,0.332187]],"X_WB":{"p":[0.05104105122692,0.005422380477715,0.4746935250395],"q":[
0.5616966736157,-0.3618174326798,0.5120925325714,-0.5397649769508]}},{"name":"fx","fixed":true,"X_WB":{"p":[
-0.7,0,0.5],"q":[-0.5918629358293,-0.5853328528469,-0.1083666694514,0.5434522808137]}}],"joints":[{"name":"j0",
"kind":"prismatic","parent":"b0","child":"ground","X_PF":{"p":[-0.2540811504691,0.1906275520893,
-0.4436722698347],"q":[0.1120285926333,0.3315611323003,-0.8227976309527,0.4477955654972]},"X_CM":{"p":[
-0.007087446485281,0.4081007232969,-0.005906670708257],"q":[0.8459435712149,-0.06910169175665,-0.4217385317032,
0.3189687153835]}}],"springs":[{"name":"s0","a":"b0","b":"fx","p_A":[-0.212109,0.135238,-0.212064],"p_B":[
0.100844,-0.166778,0.0881709],"spring":{"polynomial":[11.9686,138.175,12.9987,38.5021]},"free_length":1.41333}],
"elements":[{"name":"e0","a":"b0","b":"ground","X_AF":{"p":[-0.2868423854569,-0.08636903733057,0.2877752048216],
"q":[0.8692959383786,0.3545049297468,0.1799041757425,-0.2937436192569]},"X_BM":{"p":[0.3294681720227,
0.2290955727422,0.6777047879371],"q":[0.3681354489144,-0.179578158404,0.2631377884576,-0.873490973372]},
"translational_stiffness":[2485.88,2584.45,1888.89],"rotational_stiffness":[195.714,87.2259,152.173],
"damping_ratio":0.15,"stations":[{"x":-0.36452,"law":"L0"},{"x":0.417467,"law":"L0"}]}],"laws":[{"name":"L0",
"moment_y":{"normal_force":[-180.0,-60.0,0,36.0],"plastic_rotation":[0,0.05,0.15,0.6],"positive":[0,0,0,0,
12.3709,13.3225,11.4193,8.56447,9.51608,10.4677,9.51608,5.70965,1.90322,1.90322,1.42741,0.951608],"negative":[0,
0,0,0,9.02043,9.71431,8.32655,6.24491,6.93879,7.63267,6.93879,4.16328,1.38776,1.38776,1.04082,0.693879]},
"moment_z":{"normal_force":[-180.0,-60.0,0,36.0],"plastic_rotation":[0,0.05,0.15,0.6],"positive":[0,0,0,0,
9.92862,10.6924,9.16488,6.87366,7.6374,8.40114,7.6374,4.58244,1.52748,1.52748,1.14561,0.76374],"negative":[0,0,
0,0,9.60762,10.3467,8.86857,6.65143,7.39048,8.12953,7.39048,4.43429,1.4781,1.4781,1.10857,0.739048]},
"biaxial_exponent":3,"damage_share":0.479615,"rupture_rotation":0.532727,"compression":{"x":[0,0.02,0.1],"f":[
60.0,42.0,30.0]},"crush_length":0.142989,"tension":{"x":[0,0.03,0.1],"f":[30.0,33.0,18.0]},
"rupture_elongation":0.0547765}],"contact":{"ground":false,"bodies":false}})json";

// A body on a slide whose box meets a fixed one along one axis and then along another; another body is far away.
const char* const kFar =
    R"json({"format":"topple-mbs","version":2,"run":{"duration":0.5,"equilibrium":false},"gravity":[1.72334,-1.32336,-9],
"bodies":[{"name":"b1","mass":2.60224,"inertia":[[0.473287,-0.0194766,-0.0266897],[-0.0194766,0.400894,
0.0043251],[-0.0266897,0.0043251,0.389329]],"X_WB":{"p":[0.05361912943347,0.004717571338935,1.118458902537],
"q":[0.6169336474577,0.08710463029677,-0.4137638696016,-0.6637809263814]},"v_WB":[0,0,0],"w_WB":[0,0,0],
"shapes":[{"sphere":0.180232}]},{"name":"b2","mass":3.72424,"inertia":[[0.655524,-0.0243252,0.00814933],[
-0.0243252,0.651602,0.00171638],[0.00814933,0.00171638,0.692383]],"X_WB":{"p":[100.9073957073,0.0686960104452,
0.4692816851642],"q":[0.09448321888317,-0.08110784727933,0.3428192914123,-0.9311119008448]},"v_WB":[0,0,-20],
"w_WB":[0,0,0],"shapes":[{"hull":[[0.186316,0.0,0.0],[-0.149331,0.199726,0.0],[-0.109275,-0.21755,0.0414481],[
0.0,0.0,0.281573],[0.0502739,0.0323974,-0.219111],[0.093063,0.143315,0.0939571]]}]},{"name":"fx","fixed":true,
"X_WB":{"p":[-0.7,0,0.5],"q":[-0.1808656999904,0.6911746737335,0.6913466343914,-0.1077265058937]},"shapes":[{
"box":[0.2,0.3,0.25]}]}],"joints":[{"name":"j1","kind":"prismatic","parent":"ground","child":"b1","X_PF":{"p":[
0.2581179733827,-0.04822750459656,1.190650404262],"q":[0.08686301970341,0.9371279847003,-0.2642909644938,
-0.2107041579715]},"X_CM":{"p":[-0.05803294037829,-0.193113536864,-0.240487740615],"q":[0.3844323595633,
0.6588291480207,0.4765851644826,-0.4370612035333]}}],"events":[{"name":"v0","time":0,"actions":[{
"do":"replace_body","body":"b1","replacement":{"name":"nb1","mass":1.56237,"inertia":[0.2,0.25,0.3],"X_WB":{
"p":[-0.03042684690249,-0.0491139375323,-0.0148649376725]},"shapes":[{"box":[0.1,0.12,0.14]}]}}]}],"contact":{
"ground":false,"bodies":true,"body_friction":0,"body_restitution":0.4,"contact_frequency":342.618}})json";

void multiply(json& owner, const char* key, double by) {
  if (!owner.contains(key)) return;
  for (json& x : owner[key].is_array() ? owner[key] : owner[key] = json::array({owner[key]})) x = x.get<double>() * by;
  if (owner[key].size() == 1) owner[key] = json(owner[key][0]);
}

/// The model with lengths times L, masses times L^3 and times such that gravity is the same.
json magnify(json m, double L) {
  const double force = std::pow(L, 3), moment = std::pow(L, 4);
  for (json& b : m["bodies"]) {
    multiply(b, "mass", force);
    if (b.contains("inertia"))
      for (json& row : b["inertia"])
        for (json& x : row) x = x.get<double>() * std::pow(L, 5);
    multiply(b["X_WB"], "p", L);
  }
  for (json& j : m["joints"])
    for (const char* frame : {"X_PF", "X_CM"}) multiply(j[frame], "p", L);
  for (json& s : m["springs"]) {
    for (const char* length : {"p_A", "p_B", "free_length"}) multiply(s, length, L);
    double by = force;
    for (json& c : s["spring"]["polynomial"]) c = c.get<double>() * by, by /= L;
  }
  for (json& e : m["elements"]) {
    for (const char* frame : {"X_AF", "X_BM"}) multiply(e[frame], "p", L);
    multiply(e, "translational_stiffness", force / L);
    multiply(e, "rotational_stiffness", moment);
    for (json& s : e["stations"]) multiply(s, "x", L);
  }
  for (json& law : m["laws"]) {
    for (const char* axis : {"moment_y", "moment_z"}) {
      multiply(law[axis], "normal_force", force);
      for (const char* side : {"positive", "negative"}) multiply(law[axis], side, moment);
    }
    for (const char* side : {"compression", "tension"}) multiply(law[side], "x", L), multiply(law[side], "f", force);
    for (const char* length : {"crush_length", "rupture_elongation"}) multiply(law, length, L);
  }
  return m;
}

TEST(SimilarityPhysics, AnEquilibriumIsFoundInEveryUnitOfLength) {
  // 10 and 30 times as large there was none: rotations counted as lengths
  const json m = json::parse(kHeld);
  Vec3 start;
  for (const double L : {1.0, 0.1, 10.0, 30.0}) {
    const Model model = model_from_json(magnify(m, L).dump(), "m.json");
    Simulation s(model, {});
    std::string message;
    ASSERT_TRUE(s.find_equilibrium(message)) << L << ": " << message;
    const Vec3 place = (1 / L) * s.calc_view().X_WB[0].p;
    if (L == 1) start = place;
    EXPECT_LT(norm(place - start), 1e-7) << L;
  }
}

TEST(SimilarityPhysics, WhatIsFarAwayChangesNoImpact) {
  // ways are counted against the mean motion of all bodies: a far one that falls brought v_z = 0.102 for 0.059 m/s
  json m = json::parse(kFar);
  View last;
  Options o;
  o.duration = 0.5, o.step = 2e-4, o.equilibrium = false;
  o.on_frame = [&](const View& v) { last = v; };
  (void)run(model_from_json(m.dump(), "m.json"), o);
  const Vec3 place = last.X_WB[0].p, speed = last.v_WB[0];
  m["bodies"].erase(1);
  (void)run(model_from_json(m.dump(), "m.json"), o);
  EXPECT_LT(norm(last.X_WB[0].p - place), 1e-9);
  EXPECT_LT(norm(last.v_WB[0] - speed), 1e-7);
  EXPECT_GT(norm(speed), 0.05) << "it has met nothing";
}

TEST(SimilarityPhysics, AJointIsNotLoadedBeyondItsLimitsInEquilibrium) {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  add_body(m, test::make_box("block", 100, {0.1, 0.1, 0.1}, {0, 0, -1}));
  Joint j;
  j.kind = Joint::Kind::Fixed;
  j.name = "hook";
  j.parent = kGround, j.child = {0};
  j.X_PF.q = j.X_CM.q = to_quat(Mat3::from_columns({0, 0, -1}, {0, 1, 0}, {1, 0, 0}));
  j.X_CM.p = {0, 0, 1};
  j.tension_limit = 990;
  add_joint(m, j);
  std::string message;
  EXPECT_TRUE(Simulation(m, {}).find_equilibrium(message)) << message;
  m.joints[0].tension_limit = 500;
  EXPECT_FALSE(Simulation(m, {}).find_equilibrium(message));
  EXPECT_THAT(message,
              testing::HasSubstr(R"(joint "hook" (tension) would carry 981 N, more than its strength of 500 N)"));
}

}  // namespace
}  // namespace topple::mbs
