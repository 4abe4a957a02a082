// Rubble of elements beside the limits that a plan sets: by hand.
#include "farfield/rubble.h"

#include <gmock/gmock.h>

#include <algorithm>

namespace topple::farfield {
namespace {

using record::Status;

/// A building of 4 m by 4 m with its corner at the origin, a house 1 m beside it, a pipe 3 m beside it.
struct Site {
  product::Plan plan;
  fem::ExplicitModel model;
  std::vector<fem::DebrisParticle> rubble;
  record::Record r;

  Site() {
    product::Neighbour house, pipe;
    house.name = "House", house.footprint = {{5, 0}, {9, 0}, {9, 4}, {5, 4}}, house.clearance = 0.8;
    pipe.name = "Pipe", pipe.footprint = {{0, 7}, {4, 7}, {4, 8}, {0, 8}};
    plan.neighbours = {house, pipe};
    plan.criteria.debris_reach = 2;
    r.bodies.resize(1);
    r.time = {0}, r.position = {2, 2, 1}, r.orientation = {1, 0, 0, 0};
    r.building_outline = {{0, 0}, {4, 0}, {4, 4}, {0, 4}};
    for (const char* id : {"clearance.House", "clearance.Pipe", "debris.reach", "criterion.debris_reach"})
      r.findings.push_back({id, "", "", "Parts.", 0.9, "m", Status::Good});
    model.elements.resize(1);
    model.elements[0].part = 0;
  }
  void add(double x, double y, double mass) {
    fem::DebrisParticle d;
    d.p = {x, y, 0.1}, d.radius = d.full_radius = 0.1, d.mass = mass;
    rubble.push_back(d);
  }
  const record::Finding& judge(const std::string& id) {
    judge_rubble(plan, model, rubble, r);
    return *std::find_if(r.findings.begin(), r.findings.end(), [&](const auto& f) { return f.id == id; });
  }
};

TEST(Rubble, WithinTheLimitsIsTold) {
  Site s;
  s.add(2, 2, 100);
  s.add(-1, 2, 20);
  EXPECT_EQ(s.judge("clearance.House").text, "Parts.");
  for (const record::Finding& f : s.r.findings) EXPECT_EQ(f.status, Status::Good) << f.id;
  EXPECT_THAT(s.r.findings[2].text, testing::HasSubstr("Rubble, which these numbers leave out, lies up to 1.1 m"));
  EXPECT_EQ(s.r.findings[3].text, "Parts.");
}

TEST(Rubble, NearerThanAskedBreaksTheClearance) {
  Site s;
  s.add(4.5, 2, 30);  // 0.5 m from the house, less its radius
  s.add(4.2, 2, 20);  // 0.7 m
  s.add(3.9, 2, 10);  // 1 m
  const record::Finding& house = s.judge("clearance.House");
  EXPECT_EQ(house.status, Status::Bad);
  EXPECT_NEAR(house.value, 0.4, 1e-12);
  EXPECT_EQ(house.text, "Parts. Rubble lies 0.4 m from it at the end, 50 kg of it nearer than the limit.");
  EXPECT_EQ(s.r.findings[1].status, Status::Good);
}

TEST(Rubble, OnANeighbourWithoutALimitIsAWarning) {
  Site s;
  s.add(2, 7.5, 30);
  const record::Finding& pipe = s.judge("clearance.Pipe");
  EXPECT_EQ(pipe.status, Status::Warning);
  EXPECT_EQ(pipe.value, 0);
  EXPECT_THAT(pipe.text, testing::HasSubstr("Rubble lies on it at the end, 30 kg"));
  // and 3.6 m from the building
  EXPECT_EQ(s.r.findings[3].status, Status::Bad);
  EXPECT_THAT(s.r.findings[3].text,
              testing::HasSubstr("Rubble lies up to 3.6 m from the footprint, 30 kg of it beyond"));
}

}  // namespace
}  // namespace topple::farfield
