#include "collapse/condense.h"

#include <gmock/gmock.h>

#include <cmath>

#include "base/error.h"
#include "mbs/model_json.h"
#include "mbs/solver.h"
#include "plans.h"

namespace topple::collapse {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

Condensation find(const product::Plan& plan) {
  const product::Plan* const plans[] = {&plan};
  return find_like_frames(plans, default_knowledge());
}

mbs::Model condense(const product::Plan& plan, ModelMap& map, const KnownCurves* known = nullptr) {
  const Condensation c = find(plan);
  EXPECT_EQ(c.refusal, "");
  return make_condensed_model(plan, default_knowledge(), c, known, map);
}

product::Plan weida(const std::string& file = "plan.toml") {
  std::vector<Diagnostic> warnings;
  std::string text;
  return product::read_plan_file(TOPPLE_SOURCE_DIR "/examples/weida/" + file, warnings, text);
}

TEST(Condense, GableFramesOfTheStorehouseAreAlikeAndInnerOnesAre) {
  const Condensation c = find(weida());
  EXPECT_EQ(c.refusal, "");
  EXPECT_THAT(c.frames, ElementsAre(ElementsAre(0, 4), ElementsAre(1, 2, 3)));
  EXPECT_THAT(c.class_of, ElementsAre(0, 1, 1, 1, 0));
}

TEST(Condense, FramesDifferByWhatIsInOneOfTheSamples) {
  const product::Plan same = read(house(charge("C-A*-0")));
  EXPECT_THAT(find(same).frames, ElementsAre(ElementsAre(0, 2), ElementsAre(1)));
  // one charge of a sample is longer
  product::Plan other = same;
  for (product::Charge& c : other.stages[0].charges)
    if (other.members[static_cast<size_t>(c.member)].name == "C-A3-0") c.destroyed_length += 0.1;
  const product::Plan* const both[] = {&same, &other};
  EXPECT_EQ(find_like_frames(both, default_knowledge()).refusal, "no two frames are alike");
  const std::string towards_a = "[criteria]\nazimuth = \"180 deg\"\nazimuth_tolerance = \"15 deg\"\n";
  EXPECT_EQ(find(read(house(charge("C-A1-0") + towards_a))).refusal, "no two frames are alike");
}

TEST(Condense, WhatIsTakenOutBeforehandMakesNoDifference) {
  product::Plan plan = read(house(charge("C-A*-0")));
  product::Member wall = plan.members[static_cast<size_t>(plan.find_member("B-A1B1-1"))];
  wall.kind = product::MemberKind::Wall, wall.name = "wall", wall.removed = true;
  plan.members.push_back(wall);
  product::Member shaft;
  shaft.kind = product::MemberKind::Shaft, shaft.name = "shaft", shaft.removed = true;
  shaft.frame_a = shaft.frame_b = -1;
  plan.members.push_back(shaft);
  EXPECT_THAT(find(plan).frames, ElementsAre(ElementsAre(0, 2), ElementsAre(1)));
}

TEST(Condense, FramesThatASampleTellsApartAreNotOne) {
  product::Plan plan = read(house(charge("C-A*-0")));
  const Condensation like = find(plan);
  ModelMap map;
  EXPECT_NO_THROW(make_condensed_model(plan, default_knowledge(), like, nullptr, map));
  for (product::Charge& c : plan.stages[0].charges)
    if (plan.members[static_cast<size_t>(c.member)].name == "C-A3-0") c.residual_concrete = 0.5;
  try {
    make_condensed_model(plan, default_knowledge(), like, nullptr, map);
    ADD_FAILURE() << "frames 1 and 3 differ";
  } catch (const InputError& e) { EXPECT_THAT(e.what(), HasSubstr("frames 1 and 3 are one in a condensed run")); }
}

TEST(Condense, PartsThatStandApartAreNotOneBuilding) {
  product::Plan plan = read(house(charge("C-A*-0")));
  EXPECT_EQ(find(plan).refusal, "");
  for (product::Member& m : plan.members)
    if (m.frame_a != m.frame_b && std::max(m.frame_a, m.frame_b) == 2) m.removed = true;
  EXPECT_EQ(find(plan).refusal, "parts of it stand apart");
}

TEST(Condense, OneBayDoesNotStandForUnlikeOnes) {
  // frames 2 and 4 are charged and have floors on one side each, towards 1 and 3
  const std::string frames = "1 = \"0 m\", 2 = \"4 m\", 3 = \"8 m\", 4 = \"12 m\", 5 = \"16 m\"";
  product::Plan plan = read(materials() + grid("A = \"0 m\", B = \"5 m\"", frames, 2, "1 kN/m2") +
                            "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\n[[slabs]]\n"
                            "panel = \"floor\"\n" +
                            charge("C-A2-0") + charge("C-A4-0", "0.1 s") + analysis());
  for (product::Stage& stage : plan.stages)
    for (product::Charge& c : stage.charges) c.delay = 0;
  plan.stages[1].charges.insert(plan.stages[1].charges.end(), plan.stages[0].charges.begin(),
                                plan.stages[0].charges.end());
  plan.stages.erase(plan.stages.begin());
  EXPECT_EQ(find(plan).refusal, "");
  for (product::Member& m : plan.members)
    if (m.kind == product::MemberKind::Slab && std::min(m.frame_a, m.frame_b) % 2 == 1) m.removed = true;
  EXPECT_EQ(find(plan).refusal, "bays between like frames differ: between 2 and 3, and between 3 and 4");
}

TEST(Condense, SaysWhyItCannot) {
  const auto refusal = [](const std::string& text) { return find(read(text)).refusal; };
  EXPECT_THAT(refusal(house("[criteria]\nazimuth = \"90 deg\"\nazimuth_tolerance = \"15 deg\"\n")),
              HasSubstr("not along the frames"));
  EXPECT_THAT(refusal(house(charge("C-A*-0") + charge("B-A1A2-1", "0.5 s"))), HasSubstr("between two frames"));
  EXPECT_THAT(refusal(materials() + grid("A = \"0 m\", B = \"5 m\"", "1 = \"0 m\", 2 = \"4 m\", 3 = \"8 m\"", 1) +
                      "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\n"
                      "[[walls]]\npanel = \"thin\"\nperimeter = true\n" +
                      charge("C-A*-0") + analysis()),
              HasSubstr("in the ground storey"));
}

TEST(CondensePhysics, MassIsThatOfTheBuilding) {
  for (const product::Plan& plan : {read(house(charge("C-A*-0"))), weida()}) {
    ModelMap whole_map, map;
    const mbs::Model whole = make_model(plan, default_knowledge(), whole_map), model = condense(plan, map);
    const auto mass = [](const mbs::Model& m) {
      double sum = 0;
      for (const mbs::Body& b : m.bodies) sum += b.mass;
      return sum;
    };
    // sums of some hundred numbers
    EXPECT_NEAR(mass(model), mass(whole), 1e-12 * mass(whole));
    EXPECT_LT(model.bodies.size(), 0.7 * static_cast<double>(whole.bodies.size()));
    EXPECT_TRUE(model.is_planar);
    // what the charges leave of a class, over what they leave of its first frame, is the class's number of frames
    for (const mbs::Event& e : model.events)
      for (const mbs::Action& a : e.actions)
        if (a.kind == mbs::Action::Kind::ReplaceBody) {
          EXPECT_LT(a.replacement.mass, model.bodies[static_cast<size_t>(a.body.index)].mass);
        }
  }
}

TEST(CondensePhysics, ColumnsBearWhatTheyBearInTheBuilding) {
  const product::Plan plan = weida();
  const auto forces = [](const mbs::Model& m, const ModelMap& map, double& all) {
    mbs::Simulation s(m, {});
    std::string message;
    EXPECT_TRUE(s.find_equilibrium(message)) << message;
    const mbs::View& v = s.calc_view();
    all = v.ground_force.z;
    std::map<std::string, double> out;
    for (size_t i = 0; i < map.elements.size(); ++i)
      if (map.elements[i].name.ends_with("-0/foot")) out[map.elements[i].member] = -v.element_force[i].x;
    return out;
  };
  ModelMap whole_map, map;
  double whole_weight = 0, weight = 0;
  const auto whole = forces(make_model(plan, default_knowledge(), whole_map), whole_map, whole_weight);
  const auto condensed = forces(condense(plan, map), map, weight);
  EXPECT_NEAR(weight, whole_weight, 1e-6 * whole_weight) << "equilibrium to 1e-8 of the weight at each body";
  ASSERT_EQ(condensed.size(), 8u);
  for (const std::string row : {"A", "B", "C", "D"})
    for (const auto& [frames, first] :
         std::vector<std::pair<std::vector<std::string>, std::string>>{{{"1", "5"}, "1"}, {{"2", "3", "4"}, "2"}}) {
      double sum = 0;
      for (const std::string& f : frames) sum += whole.at("C-" + row + f + "-0");
      // In the building joints turn about x as well and make the beams between frames softer, and frames of a class
      // differ a little; here neither is so, and gable frames bear 4 % more (measured: at most 4.6 %).
      EXPECT_NEAR(condensed.at("C-" + row + first + "-0"), sum, 0.05 * std::abs(sum)) << row << first;
    }
}

TEST(Condense, KnownCurvesChangeNoBit) {
  const product::Plan plan = read(house(charge("C-A*-0")));
  const KnownCurves known = make_known_curves(plan, default_knowledge(), find(plan));
  EXPECT_FALSE(known.laws.empty());
  ModelMap a, b;
  EXPECT_EQ(mbs::to_json(condense(plan, a, &known), {}), mbs::to_json(condense(plan, b), {}));
  // of another strength only the laws that it does not concern are taken over
  product::Plan other = plan;
  other.concretes[0].fc *= 1.1;
  EXPECT_EQ(mbs::to_json(condense(other, a, &known), {}), mbs::to_json(condense(other, b), {}));
}

TEST(Condense, SamplesShareTheLawsThatTheirValuesLeaveAsTheyAre) {
  const product::Plan plan = weida("plan-fuzzy.toml");
  const KnownCurves known = make_known_curves(plan, default_knowledge(), find(plan));
  product::Plan other = plan;
  for (product::Concrete& c : other.concretes)
    if (c.name == "hinge") c.fc *= 1.1;
  ModelMap a, b;
  const mbs::Model one = condense(plan, a, &known), two = condense(other, b, &known);
  ASSERT_EQ(one.laws.size(), two.laws.size());
  int large = 0, shared = 0;
  for (size_t i = 0; i < one.laws.size(); ++i) {
    if (one.laws[i].moment_y.positive.size() + one.laws[i].moment_z.positive.size() < 100) continue;
    ++large;
    shared += one.laws.shared(i).identity() == two.laws.shared(i).identity();
  }
  EXPECT_GT(2 * shared, large);
}

}  // namespace
}  // namespace topple::collapse
