#include "collapse/manager.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "base/error.h"
#include "collapse/law.h"
#include "collapse/member_zone.h"
#include "collapse/run.h"
#include "mbs/solver.h"
#include "mbs/zone_law.h"
#include "nearfield/fired.h"
#include "plans.h"

namespace topple::collapse {
namespace {

struct Built {
  ModelMap map;
  mbs::Model model;
  record::Counts counts;
};

/// Members as stiff as they are, whatever step that asks for.
Knowledge without_limit() {
  Knowledge k = default_knowledge();
  k.body_highest_frequency = 1e5;
  return k;
}

Built build(const product::Plan& plan, const Knowledge& k = default_knowledge()) {
  Built b;
  b.model = make_model(plan, k, b.map);
  b.counts = count(b.model);
  mbs::check_model(b.model);
  EXPECT_EQ(b.map.bodies.size(), b.model.bodies.size());
  EXPECT_EQ(b.map.elements.size(), b.model.elements.size());
  EXPECT_EQ(b.map.rotationals.size(), b.model.rotational_elements.size());
  EXPECT_EQ(b.map.joints.size(), b.model.joints.size());
  EXPECT_EQ(b.map.events.size(), b.model.events.size());
  std::set<std::string> names;
  for (const BodyEntry& e : b.map.bodies) EXPECT_TRUE(names.insert(e.name).second) << e.name;
  return b;
}

void expect_exact_mass(const product::Plan& plan, const Built& b) {
  double mass = 0;
  for (const mbs::Body& body : b.model.bodies) mass += body.mass;
  // round-off of a few hundred additions
  EXPECT_NEAR(mass / calc_standing_mass(plan), 1, 1e-12);
}

std::string complaint_of(const product::Plan& plan) {
  ModelMap map;
  try {
    make_model(plan, default_knowledge(), map);
  } catch (const InputError& e) { return e.what(); }
  return "";
}

product::Plan weida(const std::string& name = "plan.toml") {
  std::vector<Diagnostic> warnings;
  std::string text;
  return product::read_plan_file(TOPPLE_SOURCE_DIR "/examples/weida/" + name, warnings, text);
}

bool is_joined(const mbs::Model& m, int a, int b) {
  const auto between = [&](int x, int y) {
    const auto same = [&](int p, int q) { return (p == x && q == y) || (p == y && q == x); };
    return std::any_of(m.elements.begin(), m.elements.end(),
                       [&](const mbs::ZoneElement& e) { return same(e.a.index, e.b.index); }) ||
           std::any_of(m.joints.begin(), m.joints.end(),
                       [&](const mbs::Joint& j) { return same(j.parent.index, j.child.index); });
  };
  return between(a, b);
}

TEST(Manager, BuildsTheStorehouseInThePapersOrder) {
  const product::Plan plan = weida();
  const Built b = build(plan);
  // 20 shafts + 20 joints + 120 columns + 105 beams + 36 gable walls + 15 stumps
  EXPECT_EQ(b.counts.bodies, 316);
  EXPECT_EQ(b.counts.revolute_joints, 20);
  EXPECT_EQ(b.counts.rigid_joints, 36);
  // 20 feet + 20 hinges + 120 columns + 210 beam ends + 112 beams along y + 84 slabs + 36 wall heads
  EXPECT_EQ(b.counts.force_elements, 602);
  expect_exact_mass(plan, b);
  EXPECT_NEAR(b.map.fall_direction.x, -1, 1e-12);
  EXPECT_EQ(b.model.events.size(), 30u);  // 15 charges, and what each throws out when its ramp is over
}

TEST(Manager, ColumnsCanBeCrushedOverTheirClearLength) {
  const Built b = build(weida());
  int columns = 0;
  for (const mbs::ZoneElement& e : b.model.elements) {
    if (!e.name.starts_with("C-")) {
      EXPECT_EQ(e.crush_through, 0) << e.name;
      continue;
    }
    // storeys of 3.14 m under beams of 0.7 m; both ends of a member do not meet
    EXPECT_NEAR(e.crush_through, (e.stations.size() < 2 ? 1 : 0.95) * 2.44, 1e-9) << e.name;
    if (e.stations.size() == 2) {
      EXPECT_LT(e.crush_through, 0.96 * std::abs(e.stations[1].x - e.stations[0].x)) << e.name;
    }
    const mbs::ZoneLaw& law = b.model.laws[static_cast<size_t>(e.stations[0].law.index)];
    EXPECT_LT(law.crush_length, 0.5) << e.name;
    ++columns;
  }
  EXPECT_EQ(columns, 140);
}

TEST(ManagerPhysics, WhatIsCrushedThroughPropsNothing) {
  // weak concrete and few bars in the ground columns: rows C and D do not bear the building after the first stage, and
  // it comes down vertically, as in the paper
  product::Plan plan = weida("plan-left-values.toml");
  plan.analysis.duration = 1.2;
  const record::Record r = run_plan(plan, default_knowledge(), {}, {});
  const auto m = std::find_if(r.findings.begin(), r.findings.end(), [](const auto& f) { return f.id == "mechanism"; });
  ASSERT_NE(m, r.findings.end());
  EXPECT_EQ(m->title, "Mechanism: vertical") << m->text;
}

TEST(Manager, ShapesOfPartsThatAreNotJoinedKeepApart) {
  const Built b = build(weida());
  for (size_t i = 0; i < b.model.bodies.size(); ++i)
    for (size_t j = i + 1; j < b.model.bodies.size(); ++j)
      for (const mbs::Shape& s : b.model.bodies[i].shapes)
        for (const mbs::Shape& t : b.model.bodies[j].shapes) {
          const Vec3 d = (b.model.bodies[i].X_WB.p + s.X_BS.p) - (b.model.bodies[j].X_WB.p + t.X_BS.p);
          const bool overlap = std::abs(d.x) < s.half.x + t.half.x && std::abs(d.y) < s.half.y + t.half.y &&
                               std::abs(d.z) < s.half.z + t.half.z;
          if (overlap) {
            EXPECT_TRUE(is_joined(b.model, static_cast<int>(i), static_cast<int>(j)))
                << b.model.bodies[i].name << " and " << b.model.bodies[j].name;
          }
        }
}

TEST(Manager, ShapesSayWhatTheyAre) {
  // walls of 27 cm on all sides: those along x are bodies of their own, those along y belong to the joints; nothing
  // else is as thick, nor as the slabs are
  std::string text = house(charge("C-A*-0"));
  const std::string thin = "[wall.thin]\nthickness = \"10 cm\"";
  text.replace(text.find(thin), thin.size(), "[wall.thin]\nthickness = \"27 cm\"");
  const product::Plan plan = read(text);
  double slab = 0;
  for (const product::Panel& p : plan.panels)
    if (p.name == "floor") slab = p.thickness;
  const Built b = build(plan);
  int in_walls = 0, in_joints = 0, slabs = 0;
  for (const BodyEntry& body : b.map.bodies)
    for (const record::BoxShape& s : body.shapes) {
      const bool is_wall = std::abs(2 * std::min(s.half.x, s.half.y) - 0.27) < 1e-9;
      EXPECT_EQ(s.part == "wall", is_wall) << body.name << " " << s.part;
      const bool is_slab = std::abs(2 * s.half.z - slab) < 1e-9;
      EXPECT_EQ(s.part == "slab", is_slab) << body.name << " " << s.part;
      EXPECT_TRUE(is_wall || is_slab || s.part == body.kind) << body.name << " " << s.part;
      in_walls += s.part == "wall" && body.kind == "wall";
      in_joints += s.part == "wall" && body.kind == "node";
      slabs += s.part == "slab";
    }
  EXPECT_GT(in_walls, 0);
  EXPECT_GT(in_joints, 0);
  EXPECT_GT(slabs, 0);
}

TEST(Manager, MassIsExactForEveryKindOfPlan) {
  const std::string front = charge("C-A*-0");
  for (const std::string& text :
       {portal(charge("C-A1-0")), house(front),
        house("[preparation]\nremoved = [\"W-*-1\", \"B-A1A2-1\"]\n" + front + charge("C-A*-1", "0.1 s")),
        house(front + charge("B-A1B1-0", "0.1 s") + charge("B-B2B3-1", "0.2 s"))}) {
    const product::Plan plan = read(text);
    expect_exact_mass(plan, build(plan));
  }
}

TEST(Manager, AFloorWithoutBeamsAlongXHangsOnTheJoints) {
  const product::Plan plan =
      read(materials() + grid("A = \"0 m\", B = \"5 m\"", "1 = \"0 m\", 2 = \"4 m\"", 1, "1 kN/m2") +
           "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\nalong = \"y\"\n[[slabs]]\npanel = "
           "\"floor\"\n" +
           charge("C-A*-0") + analysis());
  const Built b = build(plan);
  expect_exact_mass(plan, b);
  EXPECT_TRUE(
      std::none_of(b.map.bodies.begin(), b.map.bodies.end(), [](const BodyEntry& e) { return e.kind == "beam"; }));
  // 4 feet, 4 hinges, 2 beams and the slab's four strips between its quarters
  EXPECT_EQ(b.counts.force_elements, 14);
  std::string message;
  mbs::Simulation s(b.model, {});
  EXPECT_TRUE(s.find_equilibrium(message)) << message;
}

TEST(Manager, BuildsALoneColumn) {
  const product::Plan plan = read(materials() + grid("A = \"0 m\"", "1 = \"0 m\"", 1) +
                                  "[[columns]]\nsection = \"column\"\n" + charge("C-A1-0") + analysis());
  const Built b = build(plan);
  EXPECT_EQ(b.counts.bodies, 3);  // stump, shaft, joint
  EXPECT_EQ(b.counts.revolute_joints, 1);
  EXPECT_EQ(b.counts.force_elements, 2);
  expect_exact_mass(plan, b);
}

TEST(Manager, ABeamWithoutColumnBelowEndsInAJointOfItsOwn) {
  const product::Plan plan =
      read(materials() + grid("A = \"0 m\", B = \"4 m\", C = \"8 m\"", "1 = \"0 m\"", 1) +
           "[[columns]]\nsection = \"column\"\nat = [\"A1\", \"C1\"]\n[[beams]]\nsection = \"beam\"\nalong = \"x\"\n" +
           charge("C-A1-0") + analysis());
  const Built b = build(plan);
  expect_exact_mass(plan, b);
  EXPECT_TRUE(
      std::any_of(b.map.bodies.begin(), b.map.bodies.end(), [](const BodyEntry& e) { return e.name == "N-B1-0"; }));
}

TEST(Manager, ABeamEndsAtThePointOfTheGridWhereNoColumnIs) {
  // a cantilever of 2 m along x or y, alone or with a beam across its end: mass centre as by statics, nothing beyond
  for (const bool along_x : {true, false})
    for (const bool is_crossed : {false, true}) {
      const std::string ends = "A = \"0 m\", B = \"2 m\"", wide = "A = \"0 m\", B = \"4 m\"",
                        one = "1 = \"0 m\", 2 = \"4 m\"", two = "1 = \"0 m\", 2 = \"2 m\"";
      const std::string beams = along_x ? "\"A1B1\", \"A2B2\", \"A1A2\"" : "\"A1A2\", \"B1B2\", \"A1B1\"",
                        across = along_x ? ", \"B1B2\"" : ", \"A2B2\"";
      const product::Plan plan = read(materials() + grid(along_x ? ends : wide, along_x ? one : two, 1) +
                                      "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\nat = [" +
                                      beams + (is_crossed ? across : "") + "]\n[preparation]\nremoved = [\"" +
                                      (along_x ? "C-B*-0" : "C-*2-0") + "\"]\n" + analysis());
      const Built b = build(plan);
      expect_exact_mass(plan, b);
      const int axis = along_x ? 0 : 1;
      double moment = 0, by_hand = 0, farthest = 0;
      for (size_t i = 0; i < b.model.bodies.size(); ++i) {
        moment += b.model.bodies[i].mass * b.model.bodies[i].X_WB.p[axis];
        for (const record::BoxShape& s : b.map.bodies[i].shapes)
          farthest = std::max(farthest, b.model.bodies[i].X_WB.p[axis] + s.X_BS.p[axis] + s.half[axis]);
      }
      for (const product::Member& m : plan.members) {
        if (m.removed) continue;
        // concrete of a beam begins at the face of a column
        const double face = m.kind == product::MemberKind::Beam && std::abs(m.end[axis] - m.start[axis]) > 1
                                ? (along_x ? 0.15 : 0.2)
                                : 0;
        by_hand += product::calc_mass(plan, m) * 0.5 * (m.start[axis] + face + m.end[axis]);
      }
      EXPECT_NEAR(moment, by_hand, 1e-9 * by_hand) << along_x << is_crossed;
      EXPECT_NEAR(farthest, is_crossed ? 2.15 : 2, 0.02) << along_x << is_crossed;
    }
}

TEST(Manager, SaysOnceOfAChargeThatItLiesTooHighAndWhere) {
  std::string text = house(charge("C-A*-0"));
  text.replace(text.find("position = \"1 m\""), 16, "position = \"2.5 m\"");
  const product::Plan plan = read(text);
  ModelMap map;
  std::vector<Diagnostic> found;
  try {
    make_model(plan, default_knowledge(), map);
  } catch (const InputError& e) { found = e.diagnostics(); }
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].code, "E621");
  // storeys of 3 m above beams of 0.5 m
  EXPECT_EQ(found[0].message, "C-A1-0 and 2 more: a charge lies in the joint above the clear height of 2.5 m");
  EXPECT_EQ(found[0].help, "its position must be 2.48 m or less, 2 cm under the joint");
  const size_t at = text.find("\"2.5 m\"");
  EXPECT_EQ(found[0].where.line, 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
  EXPECT_EQ(found[0].where.column, static_cast<int>(at - text.rfind('\n', at)));
  EXPECT_EQ(found[0].width, 7);
}

TEST(Manager, RefusesASecondChargeInTheJointToo) {
  const auto found = [](const char* position) {
    std::string text = house(charge("C-A*-0")), second = charge("C-A*-0", "0.5 s");
    second.replace(second.find("position = \"1 m\""), 16, fmt::format("position = \"{}\"", position));
    second.replace(second.find("destroyed_length = \"1 m\""), 24, "destroyed_length = \"0.2 m\"");
    text.insert(text.find("[analysis]"), second);
    return complaint_of(read(text));
  };
  EXPECT_THAT(found("2.6 m"), testing::HasSubstr("a charge lies in the joint above the clear height of 2.5 m"));
  EXPECT_EQ(found("2.48 m"), "");  // 2 cm under it
}

TEST(Manager, NamesMembersThatCannotBeBuilt) {
  product::Plan plan = read(house(charge("C-A*-0")));
  plan.stages[0].charges[0].member = plan.find_member("S-A1B2-0");
  EXPECT_THAT(complaint_of(plan), testing::HasSubstr("S-A1B2-0: charges act on columns and beams only"));
  plan = read(house(charge("C-A*-0")));
  plan.stages[0].charges[0].position = 2.8;
  EXPECT_THAT(complaint_of(plan), testing::HasSubstr("a charge lies in the joint"));
  plan = read(house(charge("C-A*-0")));
  for (product::Member& m : plan.members)
    if (m.kind == product::MemberKind::Column && m.storey == 0 && m.name == "C-B3-0") m.removed = true;
  EXPECT_EQ(complaint_of(plan), "");  // the beams carry the joint over it
}

TEST(Manager, TheTopOfAColumnTurnsAsFarAsItsHingeDoes) {
  Knowledge k = default_knowledge();
  const auto limit = [&](double pressed) {
    k.zone_rupture_rotation_pressed = pressed;
    ModelMap map;
    return make_model(read(portal()), k, map).joints.front().rotation_limit;
  };
  EXPECT_LT(limit(k.zone_rupture_rotation), 0.5);
  EXPECT_GT(limit(1), 1);
}

TEST(Manager, MembersStartUncrackedAsFarAsTheRuleSaysAndResistAsBefore) {
  Knowledge k = default_knowledge();
  const auto beam = [&](double share, mbs::ZoneElement& element) {
    k.member_uncracked_share = share;
    ModelMap map;
    const mbs::Model m = make_model(read(portal()), k, map);
    for (const mbs::ZoneElement& e : m.elements)
      if (e.name.starts_with("B-") && e.name.ends_with("/start")) {
        element = e;
        return *m.laws.shared(static_cast<size_t>(e.stations[0].law.index));
      }
    return mbs::ZoneLaw{};
  };
  mbs::ZoneElement cracked, half, whole;
  const mbs::ZoneLaw before = beam(0, cracked), law = beam(1, whole);
  (void)beam(0.5, half);
  EXPECT_EQ(cracked.cracking[0].flexibility, 0);
  const double k0 = cracked.rotational_stiffness.y, k1 = whole.rotational_stiffness.y;
  EXPECT_GT(k1, 1.5 * k0);
  EXPECT_NEAR(half.rotational_stiffness.y, 0.5 * (k0 + k1), 1e-9 * k1);
  EXPECT_EQ(law.moment_y.positive, before.moment_y.positive);
  EXPECT_EQ(law.moment_y.negative, before.moment_y.negative);
  const mbs::Cracking& c = whole.cracking[0];
  for (int side : {0, 1}) {
    EXPECT_GT(c.begin[side], 0.1 * c.end[side]);
    EXPECT_LT(c.begin[side], 0.9 * c.end[side]);
  }
  // the beam at rest has its fixed-end moment, cracked or not
  const auto moment_at_rest = [](const mbs::ZoneElement& e) {
    const double turn = 2 * std::atan2(e.X_BM.q.y, e.X_BM.q.w);
    const mbs::Cracking& line = e.cracking[0];
    double m = turn * e.rotational_stiffness.y;
    if (line.flexibility > 0 && m > line.begin[0]) {
      const double slope = line.flexibility * line.end[0] / (line.end[0] - line.begin[0]);
      m = (turn + slope * line.begin[0]) / (1 / e.rotational_stiffness.y + slope);
    }
    return m;
  };
  EXPECT_NEAR(moment_at_rest(whole), moment_at_rest(cracked), 1e-6 * moment_at_rest(cracked));
}

TEST(Manager, EndsOfMembersCrackAsTheirMomentsDoAlongThem) {
  // sections that bend along two straight lines, the second one from r of the yield moment on
  constexpr double EI = 4e7, EI_yield = 1.5e7, M_y = 2e5, r = 0.4, L = 6, zone = 0.5;
  nearfield::MomentFamily f;
  f.normal_force = {-1e6, 1e6};
  f.rotation = {0, r * M_y / EI * zone, M_y / EI_yield * zone, 0.1};
  for (int k = 0; k < 2; ++k) {
    f.moment.insert(f.moment.end(), {0, r * M_y, M_y, M_y});
    f.yield_moment.push_back(M_y), f.yield_rotation.push_back(M_y / EI_yield * zone);
  }
  const mbs::Cracking c = make_cracking(f, f, zone, 0, EI, EI_yield, L / 6);
  // what the end of a member in double curvature turns against its chord: ∫ κ x dx over half of it, over its half
  // length
  const auto turned = [&](double moment) {
    constexpr int n = 20000;
    double sum = 0;
    for (int i = 0; i < n; ++i) {
      const double x = (i + 0.5) / n, m = moment * x, over = std::max(0.0, m - r * M_y);
      sum += over * (M_y / EI_yield - M_y / EI) / (M_y - r * M_y) * x / n;
    }
    return sum * L / 2;
  };
  EXPECT_NEAR(c.flexibility * M_y, turned(M_y), 1e-5 * turned(M_y));
  // the straight line takes as much work on the way as what it stands for
  double work = 0;
  for (int i = 0; i < 400; ++i) work += turned((i + 0.5) / 400 * M_y) * M_y / 400;
  EXPECT_NEAR(0.5 * c.flexibility * M_y * (M_y - c.begin[0]), work, 1e-3 * work);
  EXPECT_EQ(c.end[1], M_y);
  EXPECT_NEAR(calc_crack_rotation(c, 0.5 * (c.begin[0] + M_y)), 0.5 * c.flexibility * M_y, 1e-12);
  EXPECT_EQ(make_cracking(f, f, zone, 0, EI_yield, EI_yield, L / 6).flexibility, 0);
}

TEST(Manager, StiffnessOfMembersIsThatOfPrismaticBars) {
  const product::Plan plan = read(house(charge("C-A*-0")));
  const Built b = build(plan, without_limit());
  const auto element = [&](const std::string& name) -> const mbs::ZoneElement& {
    return *std::find_if(b.model.elements.begin(), b.model.elements.end(),
                         [&](const mbs::ZoneElement& e) { return e.name == name; });
  };
  // a beam whose ends turn by θ takes 6 EI θ / L at each end: each zone has 6 EI / L and the beam is rigid
  const mbs::ZoneElement &start = element("B-A1B1-0/start"), &end = element("B-A1B1-0/end");
  EXPECT_EQ(start.rotational_stiffness, end.rotational_stiffness);
  // two springs in series give EA / L
  nearfield::ZoneInput in;
  const product::Member& m = plan.members[static_cast<size_t>(plan.find_member("B-A1B1-0"))];
  in.section = plan.sections[static_cast<size_t>(m.section)];
  in.concrete = plan.concretes[0], in.steel = plan.steels[0];
  in.flange = find_member_zone(plan, default_knowledge(), plan.find_member("B-A1B1-0"), false).input.flange;
  EXPECT_GT(in.flange.breadth, 0);
  const double L = 5 - 0.3;
  in.length = calc_zone_length(in.section, in.concrete, in.steel, 0.5, L, default_knowledge());
  const nearfield::Rcc rcc = nearfield::make_rcc(in);
  EXPECT_NEAR(start.translational_stiffness.x / 2 / (rcc.EA / L), 1, 1e-12);
  // uncracked; with the cracks of first yield no softer than a beam that has cracked all along
  EXPECT_NEAR(start.rotational_stiffness.y / (6 * rcc.EI_y / L), 1, 1e-12);
  const double cracked = 1 / (1 / start.rotational_stiffness.y + start.cracking[0].flexibility);
  EXPECT_GT(cracked, 6 * rcc.calc_EI_effective_y(0) / L);
  EXPECT_LT(cracked, 2 * 6 * rcc.calc_EI_effective_y(0) / L);
  // a column of the upper storey is one element at its middle
  const mbs::ZoneElement& column = element("C-A2-1");
  ASSERT_EQ(column.stations.size(), 2u);
  const double Lc = 3 - 0.5;
  EXPECT_NEAR(std::abs(column.stations[0].x), Lc / 2, 1e-12);
  EXPECT_NEAR(column.stations[0].x, -column.stations[1].x, 1e-12);
  const double EI = column.rotational_stiffness.z * Lc;
  const double shear = column.translational_stiffness.y * Lc * Lc * Lc / (12 * EI);
  EXPECT_GT(shear, 0.9);  // 1 / (1 + Φ)
  EXPECT_LT(shear, 1);
}

TEST(Manager, AChargeRemovesItsLengthFromTheShaft) {
  const product::Plan plan = read(portal(charge("C-A1-0")));
  const Built b = build(plan, without_limit());
  ASSERT_EQ(b.model.events.size(), 2u);
  const mbs::Event &fired = b.model.events[0], &gone = b.model.events[1];
  ASSERT_FALSE(fired.actions.empty());
  const mbs::Action& limits = fired.actions[0];
  EXPECT_EQ(limits.kind, mbs::Action::Kind::SwitchLaw);
  EXPECT_EQ(b.model.elements[static_cast<size_t>(limits.element.index)].name, "C-A1-0/foot");
  EXPECT_LT(limits.stiffness_share, 0.1);  // bars alone, over the destroyed length
  EXPECT_NEAR(gone.time, fired.time + limits.ramp, 1e-12);
  EXPECT_TRUE(b.map.events[1].is_aftermath);
  ASSERT_EQ(gone.actions.size(), 2u);
  const mbs::Action& lighter = gone.actions[0];
  EXPECT_EQ(lighter.kind, mbs::Action::Kind::ReplaceBody);
  // 1 m of a column of 0.3 x 0.4 m goes, half of it from the stump
  const double per_metre = plan.concretes[0].density * 0.12;
  EXPECT_NEAR(b.map.events[0].debris_mass, per_metre, 1e-6);
  const mbs::Body& shaft = b.model.bodies[static_cast<size_t>(lighter.body.index)];
  EXPECT_NEAR(shaft.mass - lighter.replacement.mass, 0.5 * per_metre, 1e-6);
  // what is left reaches from 1.5 m to the underside of the beam at 2.5 m: its centre rises by a quarter of a metre
  EXPECT_NEAR(lighter.replacement.X_WB.p.z, 0.25, 1e-9);
  // and hangs as a stub that can be crushed from then on, over all its length
  const mbs::Action &stub = fired.actions[1], &loosen = gone.actions[1];
  EXPECT_EQ(stub.kind, mbs::Action::Kind::SwitchLaw);
  EXPECT_EQ(loosen.kind, mbs::Action::Kind::LoosenJoint);
  const mbs::RotationalElement& top = b.model.rotational_elements[static_cast<size_t>(stub.rotational)];
  EXPECT_EQ(top.name, "C-A1-0/top");
  EXPECT_EQ(top.joint, loosen.joint);
  const mbs::ZoneLaw &now = b.model.laws[static_cast<size_t>(stub.law.index)],
                     &before = b.model.laws[static_cast<size_t>(top.law.index)];
  EXPECT_NEAR(now.crush_length, 1, 1e-9);
  EXPECT_NEAR(now.slip_rupture, 0.3, 1e-9);
  EXPECT_EQ(now.compression.f, before.compression.f);
  EXPECT_EQ(now.moment_z.positive, before.moment_z.positive);
  // it turned over 1.5 of 2.5 m; from then on about its own end alone
  EXPECT_NEAR(stub.stiffness_share * 1.5 / 2.5, 1, 1e-12);
  // as stiff as the foot
  const mbs::ZoneElement& foot = b.model.elements[static_cast<size_t>(limits.element.index)];
  EXPECT_EQ(top.loose_translational.x, foot.translational_stiffness.x);
}

TEST(ManagerPhysics, ColumnsWhoseBarsHoldAfterTheirChargesGoOnStanding) {
  // all bars stay over 20 cm: the cages bear more than there is, and no blow of loosened joints may break them
  const std::string charges =
      "[[stage]]\ntime = \"0.2 s\"\n[[stage.charge]]\nmembers = [\"C-*-0\"]\nposition = \"1 m\"\n"
      "destroyed_length = \"20 cm\"\nresidual_bars = 1.0\n";
  for (const double share : {1.0, 0.3}) {
    RunOptions o;
    o.step_share = share;
    const record::Record r = run_plan(read(house(charges, "1 s")), default_knowledge(), o, {});
    const auto said = std::find_if(r.findings.begin(), r.findings.end(),
                                   [](const record::Finding& f) { return f.id == "mechanism"; });
    ASSERT_NE(said, r.findings.end());
    EXPECT_THAT(said->text, testing::StartsWith("The building stands")) << share;
    const auto energy = std::find_if(r.findings.begin(), r.findings.end(),
                                     [](const record::Finding& f) { return f.id == "verification.energy"; });
    ASSERT_NE(energy, r.findings.end());
    EXPECT_EQ(energy->status, record::Status::Good) << energy->text;
  }
}

TEST(ManagerPhysics, WhatAChargeLeavesOfTheConcreteBearsOrIsCrushed) {
  // columns of the front row bear 0.1 MN each
  const auto run = [](double concrete) {
    const std::string kept = fmt::format("residual_concrete = {}\n", concrete);
    const record::Record r = run_plan(read(house(charge("C-A*-0", "0.1 s", kept), "1 s")), default_knowledge(), {}, {});
    const auto energy = std::find_if(r.findings.begin(), r.findings.end(),
                                     [](const record::Finding& f) { return f.id == "verification.energy"; });
    EXPECT_TRUE(energy != r.findings.end() && energy->status == record::Status::Good);
    const auto said = std::find_if(r.findings.begin(), r.findings.end(),
                                   [](const record::Finding& f) { return f.id == "mechanism"; });
    return said == r.findings.end() ? std::string() : said->text;
  };
  EXPECT_THAT(run(0.5), testing::StartsWith("The building stands"));
  EXPECT_THAT(run(0.02), testing::Not(testing::StartsWith("The building stands")));
}

TEST(ManagerPhysics, EndsMeetWhereAWeakLengthIsCrushedThrough) {
  // hardly any concrete and a tenth of the bars: the house comes down by the length, and its columns bear 20 times the
  // load
  const auto fall = [](const std::string& length, double share) {
    const std::string charges =
        "[[stage]]\ntime = \"0.1 s\"\n[[stage.charge]]\nmembers = [\"C-*-0\"]\nposition = \"1.2 m\"\n"
        "destroyed_length = \"" +
        length + "\"\nresidual_bars = 0.1\nresidual_concrete = 0.02\n";
    RunOptions o;
    o.step_share = share;
    const record::Record r = run_plan(read(house(charges, "1.2 s")), default_knowledge(), o, {});
    const auto height = std::find_if(r.series.begin(), r.series.end(),
                                     [](const record::Series& x) { return x.id == "mass_centre_height"; });
    return height->value.front() - height->value.back();
  };
  // 30 cm bring 2.4 m/s, and the first peak of the columns is 3 mm wide; crushed on it fell by 1.6 m
  for (const auto& [length, most] : {std::pair{"1 cm", 0.05}, {"10 cm", 0.25}, {"30 cm", 0.55}}) {
    const double own = fall(length, 1), fine = fall(length, 0.4);
    EXPECT_GT(fine, 0.005) << length;
    EXPECT_LT(fine, most) << length;
    EXPECT_NEAR(own, fine, 0.1 * fine) << length;
  }
}

TEST(ManagerPhysics, AWeakenedColumnIsAskedForItsMargin) {
  const std::string kept = "residual_concrete = 0.1\n";
  const record::Record r = run_plan(read(house(charge("C-A*-0", "0.1 s", kept) + charge("C-B*-0", "0.9 s"), "1 s")),
                                    default_knowledge(), {}, {});
  const auto said = std::find_if(r.findings.begin(), r.findings.end(),
                                 [](const record::Finding& f) { return f.id == "stability.stage_1"; });
  ASSERT_NE(said, r.findings.end());
  EXPECT_THAT(said->text, testing::HasSubstr("C-A2-0")) << "it bears most of all weakened columns";
}

TEST(ManagerPhysics, AStubIsCrushedByWhatComesDownOnIt) {
  // the house tilts over row A, whose stubs of 1 m reach the ground at 0.71 s: they do not prop it up
  const product::Plan plan = read(house(charge("C-A*-0", "0.1 s"), "1.2 s"));
  double drop[2];  // of the mass centre at 1 s
  for (const double step : {0.0, 1e-4}) {
    RunOptions o;
    o.step = step;
    const record::Record r = run_plan(plan, default_knowledge(), o, {});
    const auto at = std::find_if(r.events.begin(), r.events.end(), [](const record::Event& e) {
      return e.kind == "touchdown" && (e.subject.starts_with("N-A") || e.subject.starts_with("B-A"));
    });
    ASSERT_NE(at, r.events.end()) << step;
    EXPECT_LT(at->time, 1.1) << step;  // propped up until 1.5 s by a rigid one
    const auto height = std::find_if(r.series.begin(), r.series.end(),
                                     [](const record::Series& x) { return x.id == "mass_centre_height"; });
    ASSERT_NE(height, r.series.end());
    const size_t late = static_cast<size_t>(std::lower_bound(r.time.begin(), r.time.end(), 1.0) - r.time.begin());
    const double w = (r.time[late] - 1) / (r.time[late] - r.time[late - 1]);
    drop[step > 0] = height->value.front() - (1 - w) * height->value[late] - w * height->value[late - 1];
    // it is marked from the frame at which it is shortened beyond its strength, and said
    const auto zone =
        std::find_if(r.zones.begin(), r.zones.end(), [](const auto& z) { return z.name == "C-A2-0/top"; });
    const auto frame = std::find_if(r.time.begin(), r.time.end(), [&](const double& t) {
      return r.zone_state[static_cast<size_t>(&t - r.time.data()) * r.zones.size() +
                          static_cast<size_t>(zone - r.zones.begin())] == 5;
    });
    ASSERT_NE(frame, r.time.end());
    const auto said = std::find_if(r.events.begin(), r.events.end(),
                                   [](const auto& e) { return e.kind == "crushing" && e.subject == "C-A2-0"; });
    ASSERT_NE(said, r.events.end());
    EXPECT_EQ(said->time, *frame);
    EXPECT_GT(*frame, 0.7);
    EXPECT_EQ(std::count_if(r.events.begin(), r.events.end(), [](const auto& e) { return e.kind == "crushing"; }), 3);
    const auto f = std::find_if(r.findings.begin(), r.findings.end(), [](const auto& x) { return x.id == "stubs"; });
    ASSERT_NE(f, r.findings.end());
    EXPECT_THAT(f->text,
                testing::StartsWith("Of 3 stubs that charges left under joints what came down has crushed 3,"));
    EXPECT_GT(f->value, 0.1);
    EXPECT_LE(f->value, 1.01);
  }
  // the peak of a stub's strength is 2 mm wide and passes in a step of 0.6 ms, so steps of 0.66, 0.3, 0.2, 0.1 and 0.05
  // ms give 1.390, 1.480, 1.481, 1.440 and 1.436 m
  EXPECT_NEAR(drop[0], drop[1], 0.04 * drop[1]);
}

TEST(Manager, WhatStandsApartTurnsNoHinge) {
  const auto is_about_y = [](const std::string& frames, const std::string& more) {
    return build(read(materials() +
                      grid("A = \"0 m\", B = \"5 m\", C = \"10 m\"", "1 = \"0 m\", 2 = \"4 m\"" + frames, 1) +
                      "[[columns]]\nsection = \"column\"\nat = [\"?1\", \"?2\"]\n" + more +
                      "[[beams]]\nsection = \"beam\"\nat = [\"?1?1\", \"?2?2\", \"?1?2\"]\n" + charge("C-A*-0") +
                      analysis()))
        .map.hinge_about_y;
  };
  EXPECT_TRUE(is_about_y("", ""));
  const std::string far = ", 3 = \"204 m\"", column = "[[columns]]\nsection = \"column\"\nat = [\"B3\"]\n";
  EXPECT_TRUE(is_about_y(far, column)) << "a column 200 m away";
  // one that a beam ties to them counts
  EXPECT_FALSE(is_about_y(far, column + "[[beams]]\nsection = \"beam\"\nat = [\"B2B3\"]\n"));
}

TEST(Manager, AFailingChargeDoesNothing) {
  const product::Plan plan = read(portal(charge("C-A1-0", "0 s", "fails = true") + charge("C-B1-0", "0.5 s")));
  const Built b = build(plan);
  EXPECT_EQ(b.model.events.size(), 2u);  // one charge and what it throws out
  EXPECT_EQ(b.map.schedule.size(), 2u);
  EXPECT_EQ(b.map.events[0].member, "C-B1-0");
}

TEST(Manager, AChargeThatLeavesConcreteThrowsNothingOut) {
  const std::string partly = "residual_concrete = 0.3\ntransition_damage = 0.2\n";
  const Built b = build(read(portal(charge("C-A1-0", "0 s", partly))));
  ASSERT_EQ(b.model.events.size(), 1u);
  EXPECT_EQ(b.map.events[0].debris_mass, 0);
  EXPECT_EQ(b.map.events[0].kept, 0.3);
  EXPECT_TRUE(b.map.debris.empty());
  EXPECT_TRUE(b.map.stubs.empty());
  ASSERT_EQ(b.model.events[0].actions.size(), 1u);
  const mbs::Action& act = b.model.events[0].actions[0];
  ASSERT_EQ(act.kind, mbs::Action::Kind::SwitchLaw);
  EXPECT_EQ(act.stiffness_share, 1);
  const mbs::ZoneElement& foot = b.model.elements[static_cast<size_t>(act.element.index)];
  EXPECT_EQ(foot.name, "C-A1-0/foot");
  const mbs::ZoneLaw &now = b.model.laws[static_cast<size_t>(act.law.index)],
                     &before = b.model.laws[static_cast<size_t>(foot.stations[0].law.index)];
  // what is left of 1 m of the column, until it is crushed through; then its ends as they were, from the elastic limit
  const product::Plan plan = read(portal());
  nearfield::ZoneInput intact;
  intact.section = plan.sections[0], intact.concrete = plan.concretes[0], intact.steel = plan.steels[0];
  const nearfield::Rcc left = nearfield::make_rcc(nearfield::make_partial_zone(intact, {1, 0.1, 0.2, 0.3}));
  const auto peak = [](const std::vector<double>& f) { return *std::max_element(f.begin(), f.end()); };
  const mbs::Curve& c = now.compression;
  const size_t end = static_cast<size_t>(std::find(c.x.begin(), c.x.end(), 1.0) - c.x.begin());
  ASSERT_LT(end + 1, c.x.size());
  EXPECT_EQ(*std::max_element(c.f.begin(), c.f.begin() + static_cast<std::ptrdiff_t>(end)),
            peak(left.compression.force));
  EXPECT_LT(peak(left.compression.force), 0.3 * peak(before.compression.f));
  EXPECT_EQ(c.f[end + 1], before.compression.f[0]);
  EXPECT_EQ(peak(c.f), peak(before.compression.f));
  EXPECT_TRUE(now.keeps_length);
  EXPECT_EQ(now.crush_length, 1);
  EXPECT_EQ(now.slip_rupture, 0.3) << "off its ends when it has slid by the column's thickness";
  // what is left is judged by its own peak
  EXPECT_EQ(mbs::compile_law(now).peak_compression, peak(left.compression.force));
  EXPECT_EQ(now.moment_y.normal_force.front(), left.y_pos.normal_force.front());
  EXPECT_LT(peak(now.moment_y.positive), 0.5 * peak(before.moment_y.positive));
}

/// One stage of the portal, whose columns are 2.5 m high in the clear, with such charges.
std::string stage_of(const std::string& charges) { return "[[stage]]\nname = \"s\"\ntime = \"0.1 s\"\n" + charges; }
std::string charge_at(const std::string& position, const std::string& length, const std::string& more = "",
                      const std::string& member = "C-A1-0") {
  return "[[stage.charge]]\nmembers = [\"" + member + "\"]\nposition = \"" + position + "\"\ndestroyed_length = \"" +
         length + "\"\nresidual_bars = 0.1\n" + more;
}

TEST(Manager, AFailingChargeOfSeveralLeavesTheColumnAsItIs) {
  const std::string high = charge_at("1.7 m", "0.6 m");
  const product::Plan alone = read(portal(stage_of(high))),
                      with_failing = read(portal(stage_of(high + charge_at("0.3 m", "0.3 m", "fails = true\n"))));
  const Built a = build(alone), b = build(with_failing);
  ASSERT_EQ(a.model.bodies.size(), b.model.bodies.size());
  for (size_t i = 0; i < a.model.bodies.size(); ++i) {
    EXPECT_EQ(a.model.bodies[i].mass, b.model.bodies[i].mass) << a.model.bodies[i].name;
    EXPECT_EQ(a.model.bodies[i].X_WB.p.z, b.model.bodies[i].X_WB.p.z) << a.model.bodies[i].name;
  }
  ASSERT_EQ(a.map.stubs.size(), 1u);
  ASSERT_EQ(b.map.stubs.size(), 1u);
  EXPECT_EQ(a.map.stubs[0].length, b.map.stubs[0].length);
  EXPECT_EQ(a.map.events[0].debris_mass, b.map.events[0].debris_mass);
  // one that fails alone: as without a charge
  const std::string other = charge_at("1 m", "0.5 m", "", "C-B1-0");
  const Built whole = build(read(portal(stage_of(other))));
  const Built fails = build(read(portal(stage_of(other + charge_at("0.5 m", "0.4 m", "fails = true\n")))));
  EXPECT_EQ(whole.model.bodies.size(), fails.model.bodies.size());
}

TEST(Manager, TheHighestOfSeveralChargesMakesTheStubInAnyOrder) {
  const std::string late = "delay = \"0.5 s\"\n", low = charge_at("0.4 m", "0.4 m"), high = charge_at("1.7 m", "0.6 m"),
                    low_late = charge_at("0.4 m", "0.4 m", late), high_late = charge_at("1.7 m", "0.6 m", late);
  const product::Plan plan = read(portal(stage_of(low + high)));
  const double per_metre = plan.concretes[0].density * 0.12;
  for (const std::string& charges : {low + high, high + low, low + high_late, high + low_late}) {
    const Built b = build(read(portal(stage_of(charges))));
    ASSERT_FALSE(b.map.stubs.empty());
    // from 2 m to the underside of the beam
    EXPECT_NEAR(b.map.stubs.back().length, 0.5, 1e-9) << charges;
    int hinge = -1, cage = -1;
    double debris = 0;
    mbs::Body shaft;
    for (size_t e = 0; e < b.model.events.size(); ++e) {
      if (!b.map.events[e].is_aftermath) debris += b.map.events[e].debris_mass;
      for (const mbs::Action& act : b.model.events[e].actions) {
        if (act.kind == mbs::Action::Kind::SwitchLaw) (act.rotational >= 0 ? hinge : cage) = act.law.index;
        if (act.kind == mbs::Action::Kind::ReplaceBody) shaft = act.replacement;
      }
    }
    ASSERT_GE(hinge, 0);
    EXPECT_NEAR(b.model.laws[static_cast<size_t>(hinge)].crush_length, 0.5, 1e-9) << charges;
    // of as many bars the longer ones are the weaker
    const Built alone = build(read(portal(stage_of(high))));
    const mbs::Action& act = alone.model.events[0].actions[0];
    EXPECT_EQ(b.model.laws[static_cast<size_t>(cage)].compression.f,
              alone.model.laws[static_cast<size_t>(act.law.index)].compression.f)
        << charges;
    // what lies between the gaps hangs from nothing: all from 0.2 to 2 m is gone
    EXPECT_NEAR(debris, 1.8 * per_metre, 1e-6) << charges;
    EXPECT_NEAR(shaft.mass, 0.5 * per_metre, 1e-6) << charges;
  }
}

TEST(Manager, ABeamDestroyedOverItsClearLengthHangsFromNoEnd) {
  // 4.7 m are clear between the columns; on the way to one end, 1 cm short of it, and all of them
  const auto switched = [](const Built& b) {
    std::set<std::string> names;
    for (const mbs::Action& act : b.model.events[0].actions)
      if (act.kind == mbs::Action::Kind::SwitchLaw && act.rotational < 0)
        names.insert(b.model.elements[static_cast<size_t>(act.element.index)].name);
    return names;
  };
  const auto blast = [](const std::string& position, const std::string& length) {
    return build(read(portal(
        stage_of(charge_at(position, length, "", "B-A1B1-0") + charge_at("1 m", "0.5 m", "delay = \"0.5 s\"\n")))));
  };
  EXPECT_EQ(switched(blast("2.5 m", "4.7 m")), (std::set<std::string>{"B-A1B1-0/start", "B-A1B1-0/end"}));
  EXPECT_EQ(switched(blast("2.5 m", "4.9 m")), (std::set<std::string>{"B-A1B1-0/start", "B-A1B1-0/end"}));
  EXPECT_EQ(switched(blast("2.4 m", "4.5 m")), (std::set<std::string>{"B-A1B1-0/start"}));
  const Built all = blast("2.5 m", "4.7 m");
  for (const char* name : {"B-A1B1-0/start", "B-A1B1-0/end"}) {
    const auto zone = std::find_if(all.map.elements.begin(), all.map.elements.end(),
                                   [&](const ZoneEntry& z) { return z.name == name; });
    EXPECT_EQ(zone->firing_time, 0.1) << name;
  }
}

TEST(Manager, DamageBesideALaterChargeBringsNoFiredEndBack) {
  // the start is gone before the end fires, whose damage reaches the start
  const std::string damage = "transition_damage = 0.3\n";
  const Built b = build(read(materials() + grid("A = \"0 m\", B = \"2.5 m\"", "1 = \"0 m\"", 1) +
                             "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\nalong = \"x\"\n" +
                             stage_of(charge_at("0.4 m", "0.3 m", damage, "B-A1B1-0") +
                                      charge_at("1.5 m", "1.6 m", damage + "delay = \"0.2 s\"\n", "B-A1B1-0") +
                                      charge_at("1 m", "0.5 m", "delay = \"0.5 s\"\n")) +
                             analysis()));
  std::string last;  // law of the start
  int times = 0;
  for (const mbs::Event& e : b.model.events)
    for (const mbs::Action& act : e.actions)
      if (act.kind == mbs::Action::Kind::SwitchLaw && act.rotational < 0 &&
          b.model.elements[static_cast<size_t>(act.element.index)].name == "B-A1B1-0/start")
        last = b.model.laws[static_cast<size_t>(act.law.index)].name, ++times;
  EXPECT_EQ(last, "B-A1B1-0/charge");
  EXPECT_EQ(times, 1);
}

TEST(Manager, SaysWhereAChargeLiesInTheJointAtABeamsEnd) {
  const auto beam = [](const std::string& position, const std::string& length) {
    return read(portal(stage_of(charge_at("1 m", "0.5 m") + charge_at(position, length, "", "B-A1B1-0"))));
  };
  EXPECT_THAT(complaint_of(beam("0.05 m", "0.1 m")),
              testing::AllOf(testing::HasSubstr("error E621: B-A1B1-0: a charge lies in "
                                                "the joint at its end"),
                             testing::HasSubstr("between 0.15 m and 4.85 m")));
  EXPECT_THAT(complaint_of(beam("4.9 m", "0.2 m")), testing::HasSubstr("error E621"));
  EXPECT_EQ(complaint_of(beam("0.2 m", "0.4 m")), "");
}

TEST(Manager, SaysWhichBeamsLeaveAJointWithoutMass) {
  const auto hidden = [](const std::string& height) {
    const std::string section = "[section.hidden]\nwidth = \"60 cm\"\nheight = \"" + height +
                                "\"\nconcrete = \"C25\"\nsteel = \"S\"\ncover = \"2 cm\"\nties = { diameter = \"8 "
                                "mm\", spacing = \"15 cm\" }\ntop = \"3 x 12 mm\"\nbottom = \"3 x 12 mm\"\n";
    return read(
        materials() + section +
        grid("A = \"0 m\", B = \"5 m\", C = \"10 m\"", "1 = \"0 m\", 2 = \"5 m\", 3 = \"10 m\"", 1) +
        "[[columns]]\nsection = \"column\"\nexcept = [\"B2\"]\n[[beams]]\nsection = \"hidden\"\n[[slabs]]\npanel "
        "= \"floor\"\n[[walls]]\npanel = \"thin\"\nat = \"A2B2\"\n" +
        analysis());
  };
  try {
    (void)build(hidden("15 cm"));
    FAIL();
  } catch (const InputError& e) {
    EXPECT_EQ(e.first_error().code, "E622");
    EXPECT_GT(e.first_error().where.line, 0) << "the rule of its beams";
    EXPECT_THAT(e.first_error().help, testing::HasSubstr("more depth than the slab"));
  }
  EXPECT_EQ(complaint_of(hidden("16 cm")), "");
}

TEST(Manager, OpeningsAboveEachOtherCountOnce) {
  const auto wall = [](const std::string& openings) {
    return build(read(materials() + grid("A = \"0 m\", B = \"5 m\"", "1 = \"0 m\"", 1) +
                      "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\nalong = \"x\"\n"
                      "[[walls]]\npanel = \"thin\"\nat = \"A1B1\"\nopening = [" +
                      openings + "]\n" + analysis()));
  };
  const std::string one = "{ left = \"1 m\", sill = \"0 m\", width = \"1.4 m\", height = \"2 m\" }",
                    low = "{ left = \"1 m\", sill = \"0 m\", width = \"1.4 m\", height = \"0.9 m\" }",
                    high = "{ left = \"1 m\", sill = \"0.9 m\", width = \"1.4 m\", height = \"1.1 m\" }";
  const Built a = wall(one), b = wall(low + ", " + high);
  const auto head = [](const Built& x) {
    return *std::find_if(x.model.elements.begin(), x.model.elements.end(),
                         [](const mbs::ZoneElement& e) { return e.name == "W-A1B1-0/head"; });
  };
  const auto base = [](const Built& x) {
    return *std::find_if(x.model.joints.begin(), x.model.joints.end(),
                         [](const mbs::Joint& j) { return j.name == "W-A1B1-0/base"; });
  };
  EXPECT_NEAR(head(a).translational_stiffness.y / head(b).translational_stiffness.y, 1, 1e-12);
  EXPECT_NEAR(base(a).shear_limit / base(b).shear_limit, 1, 1e-12);
}

TEST(Manager, HeadsOfMasonryBendAcrossAsOpenJoints) {
  const auto head = [](const std::string& panel, const std::string& more = "") {
    const Built b =
        build(read(portal(brick(more) + "[[walls]]\npanel = \"" + panel + "\"\nat = \"A1B1\"\n")), without_limit());
    return *std::find_if(b.model.elements.begin(), b.model.elements.end(),
                         [](const mbs::ZoneElement& e) { return e.name == "W-A1B1-0/head"; });
  };
  const double length = 4.7, height = 2.5, thickness = 0.24, EI = 2.5e9 * std::pow(thickness, 3) / 12;
  const double open = head("brick").rotational_stiffness.y;
  EXPECT_NEAR(open / (default_knowledge().wall_axial_share * EI * length / height), 1, 1e-12);
  // bars cross the joint, and concrete is cast to its beam
  EXPECT_NEAR(
      head("brick", "steel = \"S\"\nas_faces = \"1 mm2/m\"\n").rotational_stiffness.y / (3 * EI * length / height), 1,
      1e-12);
  const mbs::ZoneElement thin = head("thin");
  EXPECT_NEAR(thin.rotational_stiffness.y / (thin.translational_stiffness.z * height * height), 1, 1e-12);
}

TEST(Manager, TheOrderOfTwoSlabsBesideABeamChangesNothing) {
  // mirrored in the beam of frame 2: a thin slab beside a thick one whose bars lie deeper
  const auto beams = [](const char* first, const char* second) {
    const Built b =
        build(read(materials() +
                   "[slab.thick]\nthickness = \"26 cm\"\nconcrete = \"C25\"\nsteel = \"S\"\nas_top = \"10 cm2/m\"\n"
                   "as_bottom = \"10 cm2/m\"\ncover = \"6 cm\"\n" +
                   grid("A = \"0 m\", B = \"5 m\"", "1 = \"0 m\", 2 = \"4 m\", 3 = \"8 m\"", 1) +
                   "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\n[[slabs]]\npanel = \"" + first +
                   "\"\nat = \"A1B2\"\n[[slabs]]\npanel = \"" + second + "\"\nat = \"A2B3\"\n" + analysis()));
    const auto e = std::find_if(b.model.elements.begin(), b.model.elements.end(),
                                [](const mbs::ZoneElement& x) { return x.name == "B-A2B2-0/start"; });
    return b.model.laws[static_cast<size_t>(e->stations[0].law.index)].moment_y;
  };
  const mbs::MomentFamily a = beams("floor", "thick"), b = beams("thick", "floor");
  ASSERT_EQ(a.positive.size(), b.positive.size());
  const double most = *std::max_element(a.negative.begin(), a.negative.end());
  for (size_t i = 0; i < a.positive.size(); ++i) {
    EXPECT_NEAR(a.positive[i], b.positive[i], 1e-9 * most);
    EXPECT_NEAR(a.negative[i], b.negative[i], 1e-9 * most);
  }
}

TEST(Manager, SpansBearWhatThreeHingesBear) {
  const std::string slabs =
      "[slab.strong]\nthickness = \"20 cm\"\nconcrete = \"C25\"\nsteel = \"S\"\nas_top = \"3 cm2/m\"\n"
      "as_bottom = \"6 cm2/m\"\ncover = \"3 cm\"\n";
  const auto margins = [&](const std::string& load, const std::string& more = "") {
    const Built b =
        build(read(materials() + slabs + grid("A = \"0 m\", B = \"6 m\"", "1 = \"0 m\", 2 = \"5 m\"", 1, load) +
                   "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\n[[slabs]]\npanel = "
                   "\"strong\"\n" +
                   more + analysis()),
              without_limit());
    std::map<std::string, double> of;
    for (const SpanMargin& s : b.map.spans) of[s.member] = s.margin;
    EXPECT_TRUE(std::is_sorted(b.map.spans.begin(), b.map.spans.end(),
                               [](const SpanMargin& l, const SpanMargin& r) { return l.margin < r.margin; }));
    return of;
  };
  const auto light = margins("1 kN/m2"), heavy = margins("6 kN/m2");
  EXPECT_EQ(light.size(), 3u) << "two beams along x and the slab";
  // the slab between the faces of its beams, a block of stresses over its bars
  const auto moment = [](double as) { return as * 420e6 * (0.17 - 0.5 * as * 420e6 / (0.85 * 25e6)); };
  // what its corners share with columns counts there
  const double g = 9.81, slab = (1 - 0.3 * 0.4 / 30) * 2500 * g * 0.2, span = 4.7,
               bears = 8 * (moment(6e-4) + moment(3e-4)) / (span * span);
  EXPECT_NEAR(light.at("S-A1B2-0"), bears / (slab + 1e3), 1e-6 * light.at("S-A1B2-0"));
  EXPECT_NEAR(heavy.at("S-A1B2-0"), bears / (slab + 6e3), 1e-6 * heavy.at("S-A1B2-0"));
  // a beam with half of the slab, 5.6 m between columns: bars between first yield and their strength, with the lever of
  // a slab that is pressed and of a web that is
  const double bars = M_PI * 1e-4, lever = 0.5 - 0.03 - 0.008 - 0.01,
               weight = 5.6 * (2500 * g * 0.3 * 0.5 + 2.5 * (slab + 1e3));
  const double least = 8 * 420e6 * bars * (3 + 4) * 0.85 * lever / (5.6 * weight),
               most = 8 * 500e6 * (bars * (3 + 4) + 6e-4 * 5) * lever / (5.6 * weight);
  EXPECT_GT(light.at("B-A1B1-0"), least);
  EXPECT_LT(light.at("B-A1B1-0"), most);
  const auto complaints = [&](const std::string& load) {
    const product::Plan plan =
        read(materials() + slabs + grid("A = \"0 m\", B = \"6 m\"", "1 = \"0 m\", 2 = \"5 m\"", 1, load) +
             "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\n[[slabs]]\npanel = \"strong\"\n" +
             analysis());
    return complain_of_spans(plan, build(plan, without_limit()).map);
  };
  EXPECT_TRUE(complaints("1 kN/m2").empty());
  const std::vector<Diagnostic> weak = complaints("19 kN/m2");
  ASSERT_EQ(weak.size(), 1u);
  EXPECT_EQ(weak[0].code, "W513");
  EXPECT_NE(weak[0].message.find("S-A1B2-0: with hinges at both ends and in the middle it bears 0.9"),
            std::string::npos)
      << weak[0].message;
  EXPECT_GT(weak[0].where.line, 0);
  // a wall that is cast on a beam bears it
  const auto walled = margins("1 kN/m2", "[[walls]]\npanel = \"thin\"\nat = \"A1B1\"\nstoreys = 0\n");
  EXPECT_EQ(walled.count("B-A1B1-0"), 1u) << "it stands below";
}

TEST(Manager, CablesLetGoOfWhatIsDestroyed) {
  // 0.5 to 1.5 m of a column are thrown out; what stands below and above holds its cable
  const auto released = [](const std::string& position, const std::string& member = "C-A1-0") {
    const Built b =
        build(read(portal(charge("C-A1-0", "0.2 s", "scatter = \"0 s\"") + "[[cable]]\nname = \"pull\"\nmember = \"" +
                          member + "\"\nposition = \"" + position +
                          "\"\nanchor = [\"-20 m\", \"0 m\", \"0 m\"]\nstiffness = \"1 MN/m\"\nstrength = \"1 MN\"\n")),
              without_limit());
    double at = -1;
    for (const mbs::Event& e : b.model.events)
      for (const mbs::Action& a : e.actions)
        if (a.kind == mbs::Action::Kind::ReleaseCable && a.cable == 0) at = e.time;
    const bool is_told = std::any_of(b.map.notes.begin(), b.map.notes.end(), [](const ModelNote& n) {
      return n.text.find("pull lets go at 0.20 s: what it is tied to on C-A1-0") != std::string::npos;
    });
    EXPECT_EQ(is_told, at >= 0) << position;
    return at;
  };
  const double gone = 0.2 + default_knowledge().charge_release_time;
  EXPECT_NEAR(released("1 m"), gone, 1e-12);
  EXPECT_NEAR(released("1.45 m"), gone, 1e-12);
  EXPECT_EQ(released("0.2 m"), -1);
  EXPECT_EQ(released("1.6 m"), -1);
  EXPECT_EQ(released("1 m", "C-B1-0"), -1);
}

TEST(Manager, WhatWasTakenOutCoversNoMember) {
  const std::string frame = materials() + grid("A = \"0 m\", B = \"5 m\"", "1 = \"0 m\", 2 = \"4 m\"", 1) +
                            "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\n";
  const std::string slabs = "[[slabs]]\npanel = \"floor\"\n", out = "[preparation]\nremoved = [\"S-*\"]\n";
  const double none = build(read(frame + analysis())).map.mass, with = build(read(frame + slabs + analysis())).map.mass,
               removed = build(read(frame + slabs + out + analysis())).map.mass;
  EXPECT_NEAR(removed / none, 1, 1e-12);
  EXPECT_GT(with, none);
}

TEST(Manager, AnOblongColumnTurnsAlikeInFallsAlongBothAxes) {
  const auto head = [](const std::string& size, const std::string& azimuth) {
    std::string text = materials();
    text.replace(text.find("width = \"30 cm\"\nheight = \"40 cm\""), 32, size);
    const Built b = build(read(text + grid("A = \"0 m\", B = \"5 m\"", "1 = \"0 m\", 2 = \"5 m\"", 1) +
                               "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\n"
                               "[criteria]\nazimuth = \"" +
                               azimuth + "\"\nazimuth_tolerance = \"15 deg\"\n" + analysis()));
    return b.model.laws[static_cast<size_t>(b.model.rotational_elements.front().law.index)];
  };
  const mbs::ZoneLaw along_x = head("width = \"30 cm\"\nheight = \"90 cm\"", "180 deg"),
                     along_y = head("width = \"90 cm\"\nheight = \"30 cm\"", "270 deg");
  EXPECT_GT(std::abs(std::log(along_x.rotation_ratio)), 0.7);
  EXPECT_NEAR(along_y.rotation_ratio / along_x.rotation_ratio, 1, 1e-9);
  EXPECT_NEAR(along_y.shear_y / along_x.shear_y, 1, 1e-9);
  for (const auto family : {&mbs::ZoneLaw::moment_y, &mbs::ZoneLaw::moment_z}) {
    const mbs::MomentFamily &x = along_x.*family, &y = along_y.*family;
    ASSERT_EQ(x.positive.size(), y.positive.size());
    for (size_t i = 0; i < x.positive.size(); ++i) EXPECT_NEAR(y.positive[i], x.positive[i], 1e-6 * 100e3);
  }
}

/// A charge that fires late, with its middle at this height [m].
std::string late_charge_at(const std::string& members, double at) {
  std::string text = charge(members, "0.5 s");
  const std::string from = "position = \"1 m\"", to = fmt::format("position = \"{} m\"", at);
  return text.replace(text.find(from), from.size(), to);
}

TEST(Manager, AColumnOnAStumpResistsAndTurnsAsTheWholeOne) {
  const auto column = [](const std::string& charges) {
    const Built b = build(read(portal(charges)), without_limit());
    const mbs::RotationalElement& top = b.model.rotational_elements.front();
    const auto foot = std::find_if(b.model.elements.begin(), b.model.elements.end(),
                                   [](const mbs::ZoneElement& e) { return e.name == "C-A1-0/foot"; });
    const mbs::ZoneLaw& law = b.model.laws[static_cast<size_t>(foot->stations[0].law.index)];
    const mbs::ZoneLaw& hinge = b.model.laws[static_cast<size_t>(top.law.index)];
    return std::tuple{*foot, top, law, hinge};
  };
  const auto [foot, top, law, hinge] = column("");
  constexpr double L = 2.5;
  for (const double at : {0.5, 1.0, 1.9}) {
    const auto [foot_above, top_above, law_above, hinge_above] = column(late_charge_at("C-A1-0", at));
    const double l = L - at;
    // sway of both ends: V = (k_foot + k_top) δ / l²
    EXPECT_NEAR((foot_above.rotational_stiffness.z + top_above.stiffness) / (l * l) /
                    ((foot.rotational_stiffness.z + top.stiffness) / (L * L)),
                1, 1e-9);
    EXPECT_EQ(foot_above.translational_stiffness, foot.translational_stiffness);
    EXPECT_EQ(law_above.compression.f, law.compression.f);
    EXPECT_EQ(law_above.shear_y, law.shear_y);
    const mbs::MomentFamily &f = law_above.moment_z, &h = hinge_above.moment_z, &whole = law.moment_z;
    ASSERT_EQ(f.positive.size(), whole.positive.size());
    ASSERT_EQ(h.positive.size(), whole.positive.size());
    // V = (M_foot + M_top) / l at δ = φ l
    for (size_t i = 0; i < whole.positive.size(); ++i)
      EXPECT_NEAR((f.positive[i] + h.positive[i]) / l, 2 * whole.positive[i] / L, 1e-6);
    for (size_t j = 0; j < whole.plastic_rotation.size(); ++j) {
      EXPECT_NEAR(f.plastic_rotation[j] * l, whole.plastic_rotation[j] * L, 1e-12);
      EXPECT_NEAR(h.plastic_rotation[j] * l, whole.plastic_rotation[j] * L, 1e-12);
    }
    EXPECT_NEAR(law_above.rupture_rotation * l, law.rupture_rotation * L, 1e-12);
    // what the column has at the charge, where its ends do not turn
    const double share = std::max((0.5 * L - at) / (0.5 * L), 0.2);
    EXPECT_NEAR(f.positive[whole.positive.size() / 2] / h.positive[whole.positive.size() / 2], share, 1e-9);
    EXPECT_NEAR(foot_above.rotational_stiffness.z / top_above.stiffness, share, 1e-9);
    const mbs::Cracking &above = foot_above.cracking[1], &cracks = foot.cracking[1];
    EXPECT_NEAR(above.end[0] / cracks.end[0], foot_above.rotational_stiffness.z * L / (foot.rotational_stiffness.z * l),
                1e-9);
    EXPECT_NEAR(calc_crack_rotation(above, above.end[0]) * l, calc_crack_rotation(cracks, cracks.end[0]) * L, 1e-12);
    EXPECT_EQ(top_above.cracking.flexibility, top.cracking.flexibility);  // the stub's, which it becomes
  }
}

TEST(ManagerPhysics, AChargeThatHasNotFiredHardlyChangesTheSway) {
  const auto sway = [](const std::string& charges) {
    Built b = build(read(portal(charges)), without_limit());
    b.model.gravity = {0.2, 0, -9.81};
    mbs::Simulation s(b.model, {});
    std::string message;
    EXPECT_TRUE(s.find_equilibrium(message)) << message;
    double x = 0;
    for (size_t i = 0; i < b.model.bodies.size(); ++i)
      if (b.map.bodies[i].kind == "beam") x = s.calc_view().X_WB[i].p.x - b.model.bodies[i].X_WB.p.x;
    return x;
  };
  const double whole = sway("");
  // half of the stump's own force is missing, and heads resist a turn of the joints a little otherwise
  for (const double at : {0.5, 0.75, 1.0}) EXPECT_NEAR(sway(late_charge_at("C-*-0", at)) / whole, 1, 0.1) << at;
}

TEST(Manager, CutBarsWeakenTheNearestZoneOnly) {
  const Built whole = build(read(portal(charge("C-A1-0"))));
  const Built cut = build(read(
      portal("[[preparation.weaken]]\nmembers = [\"B-A1B1-0\"]\nat = \"4.6 m\"\ncut_bars = 0.5\n" + charge("C-A1-0"))));
  const auto moment = [](const Built& b, const std::string& name) {
    const auto e = std::find_if(b.model.elements.begin(), b.model.elements.end(),
                                [&](const mbs::ZoneElement& x) { return x.name == name; });
    const mbs::MomentFamily& f = b.model.laws[static_cast<size_t>(e->stations[0].law.index)].moment_y;
    return *std::max_element(f.positive.begin(), f.positive.end());
  };
  EXPECT_NEAR(moment(cut, "B-A1B1-0/start") / moment(whole, "B-A1B1-0/start"), 1, 1e-9);
  EXPECT_LT(moment(cut, "B-A1B1-0/end"), 0.85 * moment(whole, "B-A1B1-0/end"));
}

TEST(ManagerPhysics, DeadLoadOfAPortalGoesHalfToEachColumn) {
  const product::Plan plan = read(portal());
  Built b = build(plan);
  mbs::Simulation s(b.model, {});
  std::string message;
  ASSERT_TRUE(s.find_equilibrium(message)) << message;
  const mbs::View& v = s.calc_view();
  const double weight = calc_standing_mass(plan) * 9.81;
  EXPECT_NEAR(v.ground_force.z / weight, 1, 1e-6);  // what the issue asks for
  for (size_t e = 0; e < b.model.elements.size(); ++e) {
    if (b.model.elements[e].name.find("/foot") == std::string::npos) continue;
    EXPECT_NEAR(v.element_force[e].x / (weight / 2), 1, 1e-6);
  }
  // the shaft pushes the joint up along x, with its own weight less
  const double shaft = plan.concretes[0].density * 0.3 * 0.4 * 2.5 * 9.81;
  // along the shaft, which leans by about a milliradian: cosine and a thousandth of the thrust
  EXPECT_NEAR(v.joint_force[0].x / (weight / 2 - shaft), 1, 1e-5);
}

TEST(ManagerPhysics, ABeamOnStiffColumnsHasItsFixedEndMoments) {
  // columns of 2 m x 2 m hardly turn
  std::string text = portal();
  const size_t at = text.find("width = \"30 cm\"\nheight = \"40 cm\"");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, 32, "width = \"2 m\"\nheight = \"2 m\"");
  const product::Plan plan = read(text);
  const Built b = build(plan);
  mbs::Simulation s(b.model, {});
  std::string message;
  ASSERT_TRUE(s.find_equilibrium(message)) << message;
  const mbs::View& v = s.calc_view();
  const double L = 5 - 2, q = plan.concretes[0].density * 9.81 * 0.3 * 0.5;
  for (size_t e = 0; e < b.model.elements.size(); ++e) {
    if (b.model.elements[e].name.find("B-A1B1-0/") == std::string::npos) continue;
    // the moment of a on b is minus the section's, which pulls at the top; the joints turn by a few per cent of θ_0
    EXPECT_NEAR(-v.element_moment[e].y / (q * L * L / 12), 1, 0.05) << b.model.elements[e].name;
  }
}

TEST(ManagerPhysics, APortalUnderSidewaysGravitySwaysLikeAFrame) {
  product::Plan plan = read(portal());
  Built b = build(plan, without_limit());
  constexpr double g = 0.2;  // small, so that everything stays elastic and straight
  b.model.gravity = {g, 0, -9.81};
  mbs::Simulation s(b.model, {});
  std::string message;
  ASSERT_TRUE(s.find_equilibrium(message)) << message;
  const mbs::View& v = s.calc_view();
  double EI_c = 0, EI_b = 0, GA = 0, F = 0, sway = 0;
  constexpr double h = 2.5, H = 2.75, L = 4.7,
                   L_b = 5;  // clear height, height to the beam's axis, clear and whole span
  for (const mbs::RotationalElement& r : b.model.rotational_elements) EI_c = r.stiffness * h / 6;
  for (const mbs::ZoneElement& e : b.model.elements) {
    if (e.name == "B-A1B1-0/start") EI_b = e.rotational_stiffness.y * L / 6;
    if (e.name == "C-A1-0/foot") GA = e.translational_stiffness.y * h;
  }
  for (size_t i = 0; i < b.model.bodies.size(); ++i) {
    const mbs::Body& body = b.model.bodies[i];
    if (b.map.bodies[i].kind == "beam") sway = v.X_WB[i].p.x - body.X_WB.p.x;  // the dead load alone is symmetric
    // half of a shaft's own force goes to its head
    F += body.mass * g * (b.map.bodies[i].kind == "column" ? 0.5 : 1);
  }
  // Slope and deflection by hand with rigid joints of half depth a = H - h: each column takes F/2, its head turns by
  // the joint's rotation r; the beam's end zones turn by r L_b / L.
  const double V = F / 2, k_c = 6 * EI_c / h, k_b = 6 * EI_b / L, a = H - h;
  // unknowns: chord rotation c = δ/h of the shaft (shear slip apart) and joint rotation r
  // foot moment k_c c, head moment k_c (c - r); V h = k_c c + k_c (c - r); joint: k_c (c - r) + V a = k_b r (L_b /
  // L)²
  const double kb = k_b * (L_b / L) * (L_b / L);
  const double r = V * (h / 2 + a) / (kb + k_c / 2), c = (V * h / k_c + r) / 2;
  const double expected = c * h + V * h / GA + r * a;
  // the own forces of the shafts act at mid-height and not at the head: about 1 % of the sway
  EXPECT_NEAR(sway / expected, 1, 0.03);
}

TEST(ManagerPhysics, TheStorehouseStandsStillUnderDeadLoad) {
  product::Plan plan = weida();
  plan.stages.clear();
  Built b = build(plan);
  mbs::Options o;
  o.duration = 0.5;
  std::vector<Pose> start;
  double moved = 0;
  int yielded = 0;
  o.on_frame = [&](const mbs::View& v) {
    if (start.empty()) start = v.X_WB;
    for (size_t i = 0; i < start.size(); ++i) moved = std::max(moved, norm(v.X_WB[i].p - start[i].p));
    for (mbs::ElementState s : v.element_state) yielded += s != mbs::ElementState::Elastic;
  };
  const mbs::Summary s = mbs::run(b.model, o);
  EXPECT_EQ(s.ending, mbs::Summary::Ending::TimeLimit);
  EXPECT_LT(moved, 1e-5);  // a hundredth of the millimetre that is allowed in 10 s
  EXPECT_EQ(yielded, 0);
  EXPECT_LT(s.equilibrium_residual, 1e-6);
}

}  // namespace
}  // namespace topple::collapse
