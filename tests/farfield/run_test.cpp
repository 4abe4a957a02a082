#include "farfield/run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <numeric>

#include "../record/same_record.h"
#include "base/file.h"
#include "farfield/checkpoint.h"
#include "farfield/fragments.h"
#include "farfield/motion.h"
#include "plans.h"

namespace topple::farfield {
namespace {

using record::expect_same;

const collapse::Knowledge& rules() { return collapse::default_knowledge(); }

FeOptions coarse() {
  FeOptions o;
  o.grid.size = 0.5;
  return o;
}

record::Record run(const std::string& text, const FeOptions& fe, int threads = 1,
                   const collapse::RunCallbacks& callbacks = {}) {
  collapse::RunOptions o;
  o.threads = threads;
  return run_plan(read(text), rules(), o, fe, callbacks, {});
}

record::Record run_bodies(const std::string& text) { return collapse::run_plan(read(text), rules(), {}, {}); }

const record::Finding& find(const record::Record& r, const std::string& id) {
  for (const record::Finding& f : r.findings)
    if (f.id == id) return f;
  ADD_FAILURE() << "no finding " << id;
  return r.findings.front();
}

const std::vector<double>& series(const record::Record& r, const std::string& id) {
  for (const record::Series& s : r.series)
    if (s.id == id) return s.value;
  ADD_FAILURE() << "no series " << id;
  return r.series.front().value;
}

/// The portal that loses most of both columns at once: its upper part falls freely for a while.
std::string dropped() {
  const std::string more = "destroyed_length = \"2 m\"\nposition = \"1.3 m\"\nresidual_bars = 0\n";
  return portal("[[stage]]\nname = \"Both\"\ntime = \"50 ms\"\n[[stage.charge]]\nmembers = [\"C-*\"]\n" + more);
}

std::string with_duration(std::string text, const std::string& duration) {
  const std::string old = "duration = \"1 s\"";
  return text.replace(text.find(old), old.size(), "duration = \"" + duration + "\"");
}

/// A plan in elements, and their bodies.
struct Building {
  explicit Building(product::Plan p)
      : plan(std::move(p)),
        model(collapse::make_model(plan, rules(), map)),
        whole(make_whole(plan, rules(), coarse().grid, model, map)) {}
  product::Plan plan;
  collapse::ModelMap map;
  mbs::Model model;
  Whole whole;
};

TEST(Whole, WeighsWhatThePlanWeighs) {
  for (const std::string& text : {portal(), house()}) {
    const product::Plan plan = read(text);
    const Whole whole = make_whole(plan, rules(), coarse().grid, 1);
    const MeshReport report = calc_mesh_report(plan, whole);
    const double mass = collapse::calc_standing_mass(plan);
    EXPECT_NEAR(report.mesh.mass, mass, 1e-9 * mass);
  }
}

TEST(Whole, HasItsMassCentreWhereThePlanHasIt) {
  const product::Plan plan = read(portal());
  GridOptions fine;
  fine.size = 0.15;  // no faces share a line, so that every member lies where the plan has it
  const MeshReport report = calc_mesh_report(plan, make_whole(plan, rules(), fine, 1));
  // two columns of 3 m and a beam between them whose middle is 2.75 m up, by hand
  const double column = 0.3 * 0.4 * 3, beam = 0.3 * 0.5 * 4.7;
  const double height = (2 * column * 1.5 + beam * 2.75) / (2 * column + beam);
  EXPECT_NEAR(norm(report.mesh.p_WBcm - Vec3{2.5, 0, height}), 0, 1e-9);
}

TEST(Whole, GivesEachElementToABodyOfTheManager) {
  const product::Plan plan = read(house());
  collapse::ModelMap map;
  const mbs::Model model = collapse::make_model(plan, rules(), map);
  const Whole whole = make_whole(plan, rules(), coarse().grid, model, map);
  std::vector<int> count(model.bodies.size(), 0);
  for (const fem::ExplicitElement& e : whole.fe.elements) ++count[static_cast<size_t>(e.part)];
  for (size_t b = 0; b < count.size(); ++b) EXPECT_GT(count[b], 0) << map.bodies[b].name;
}

TEST(Whole, TakesAwayWhatAChargeDestroys) {
  const product::Plan plan = read(portal(charge("C-A1-0")));
  const Whole whole = make_whole(plan, rules(), coarse().grid, 1);
  ASSERT_EQ(whole.charges.size(), 1u);
  for (const int e : whole.charges[0].elements) {
    const Cell& c = whole.grid.cells[static_cast<size_t>(e)];
    EXPECT_EQ(c.member, plan.find_member("C-A1-0"));
    EXPECT_NEAR(c.centre.z, 1, 0.5);
  }
  EXPECT_EQ(whole.feet.size(), 2u);
}

TEST(Whole, LeavesBarsWhereAChargeDestroys) {
  const product::Plan plan = read(portal(charge("C-A1-0", "0 s", "transition_damage = 0.4")));
  const Whole whole = make_whole(plan, rules(), coarse().grid, 1);
  const product::Member& m = plan.members[static_cast<size_t>(plan.find_member("C-A1-0"))];
  const product::Section& s = plan.sections[static_cast<size_t>(m.section)];
  ASSERT_EQ(whole.fe.releases.size(), 1u);
  const fem::ExplicitRelease& release = whole.fe.releases[0];
  EXPECT_EQ(release.duration, rules().charge_release_time);
  EXPECT_EQ(release.elements, whole.charges[0].elements);
  ASSERT_EQ(release.bars.size(), s.bars.size());
  const product::Steel& steel = plan.steels[static_cast<size_t>(s.steel)];
  for (size_t i = 0; i < s.bars.size(); ++i) {
    const fem::ExplicitBar& bar = whole.fe.bars[i];
    // 0.1 of the bars over 1 m, upright, where the section has them
    EXPECT_NEAR(bar.yield, 0.1 * s.bars[i].area * steel.fy, 1e-9 * bar.yield);
    EXPECT_NEAR(bar.stiffness, 0.1 * s.bars[i].area * steel.Es, 0.02 * bar.stiffness);
    double height = 0;
    for (const fem::ExplicitBar::End* end : {&bar.a, &bar.b}) {
      Vec3 p;
      for (size_t k = 0; k < 4; ++k) p += end->weight[k] * whole.fe.nodes[static_cast<size_t>(end->node[k])];
      EXPECT_NEAR(p.x, m.start.x + s.bars[i].y, 1e-9);
      EXPECT_NEAR(p.y, m.start.y + s.bars[i].z, 1e-9);
      height = p.z - height;
    }
    EXPECT_NEAR(height, 1, 0.02);
  }
  // beside it concrete loses two fifths of its strength, once the charge has fired
  ASSERT_FALSE(release.weakened.empty());
  for (const auto& [from, to] : release.weakened) {
    const double before = whole.fe.materials[static_cast<size_t>(from)].yield[0].compression;
    const double after = whole.fe.materials[static_cast<size_t>(to)].yield[0].compression;
    EXPECT_LT(after, 0.75 * before);
    EXPECT_GT(after, 0.6 * before);  // bars stay
  }
}

TEST(Whole, LeavesAllAsItIsWhereAChargeFails) {
  const product::Plan plan = read(portal(charge("C-A1-0", "0 s", "fails = true\ntransition_damage = 0.4")));
  const Whole whole = make_whole(plan, rules(), coarse().grid, 1);
  EXPECT_TRUE(whole.fe.bars.empty());
  for (const fem::ExplicitMaterial& m : whole.fe.materials) EXPECT_EQ(m.name.find("/charge"), std::string::npos);
}

TEST(FarfieldPhysics, CarriesTheDeadLoadToTheGround) {
  const record::Record r = run(with_duration(house(), "20 ms"), coarse());
  double upward = 0;
  const double a = series(r, "ground_force_row_A").front(), b = series(r, "ground_force_row_B").front();
  upward = a + b;
  double weight = 0;
  for (const record::BodyInfo& body : r.bodies) weight += body.mass * 9.81;
  // the relaxation ends with a thousandth of the load out of balance, as root of the sum of squares over nodes; what
  // that makes at the feet is seen to be some thousandths
  EXPECT_NEAR(upward, weight, 0.01 * weight);
  EXPECT_NEAR(a, b, 0.01 * weight);  // the house is symmetrical
  EXPECT_EQ(find(r, "farfield.settling").status, record::Status::Good);
}

TEST(FarfieldPhysics, FallsFreelyOnceNothingHoldsIt) {
  const record::Record r = run(with_duration(dropped(), "350 ms"), coarse());
  const std::vector<double>& height = series(r, "mass_centre_height");
  // The beam with both column heads, from the frame after the charges: h = h0 + v t - g t²/2; the second difference of
  // frames 1/60 s apart is -g/3600. What was elastic swings within the part and does not move its mass centre.
  size_t beam = r.bodies.size();
  for (size_t b = 0; b < r.bodies.size(); ++b)
    if (r.bodies[b].name == "B-A1B1-0") beam = b;
  ASSERT_LT(beam, r.bodies.size());
  const auto z = [&](size_t frame) { return r.position[3 * (frame * r.bodies.size() + beam) + 2]; };
  const size_t first = 5, last = 17;  // 83 ms to 283 ms
  ASSERT_LT(last, r.time.size());
  const size_t middle = (first + last) / 2;
  const double span = r.time[last] - r.time[first];
  const double fall = z(first) - 2.0 * z(middle) + z(last);
  // the beam swings by its dead-load deflection, below a millimetre at either end of the parabola
  EXPECT_NEAR(fall, -9.81 * span * span / 4, 4e-3);
  EXPECT_LT(height.back(), height.front());
}

TEST(FarfieldPhysics, IsPushedUpByTheGroundOnWhichItFalls) {
  const record::Record r = run(with_duration(dropped(), "900 ms"), coarse());
  double weight = 0;
  for (const record::BodyInfo& body : r.bodies) weight += body.mass * 9.81;
  const std::vector<double>& force = series(r, "ground_force");
  EXPECT_GT(*std::max_element(force.begin(), force.end()), weight);  // an impact
  // Stumps ring at their feet, so that a single frame may show a pull, of whatever phase. In the mean nothing holds
  // what falls, and what lands is borne.
  double falling = 0, landing = 0;
  int fall_frames = 0, land_frames = 0;
  for (size_t i = 0; i < force.size(); ++i) {
    if (r.time[i] > 0.1 && r.time[i] < 0.65) falling += force[i], ++fall_frames;
    if (r.time[i] > 0.69) landing += force[i], ++land_frames;
  }
  EXPECT_NEAR(falling / fall_frames, 0, 0.2 * weight);
  EXPECT_GT(landing / land_frames, 0.5 * weight);
}

TEST(FarfieldPhysics, FallsAsTheMultibodyModelDoes) {
  const std::string text = with_duration(dropped(), "350 ms");
  const record::Record fe = run(text, coarse()), bodies = run_bodies(text);
  ASSERT_EQ(fe.bodies.size(), bodies.bodies.size());
  // the multibody engine shows frames at whole steps; a step at 3 m/s is some millimetres of what is allowed below
  ASSERT_EQ(fe.time.size(), bodies.time.size());
  ASSERT_NEAR(fe.time.back(), bodies.time.back(), 1e-3);
  for (size_t b = 0; b < fe.bodies.size(); ++b) {
    EXPECT_EQ(fe.bodies[b].name, bodies.bodies[b].name);
    if (fe.bodies[b].kind != "beam") continue;
    const size_t i = 3 * ((fe.time.size() - 1) * fe.bodies.size() + b) + 2;
    // both let go over charge.release_time, 3 ms; an offset of it would be 9 mm after 0.3 s of fall
    EXPECT_NEAR(fe.position[i], bodies.position[i], 0.005);
  }
}

TEST(FarfieldPhysics, BooksItsEnergy) {
  const record::Record r = run(with_duration(dropped(), "600 ms"), coarse());
  EXPECT_EQ(find(r, "verification.energy").status, record::Status::Good) << find(r, "verification.energy").text;
}

TEST(Farfield, NamesTheOptionOfAShorterStep) {
  collapse::Knowledge strict = rules();
  strict.verification_energy_error = 1e-12;
  const record::Record r = run_plan(read(with_duration(dropped(), "900 ms")), strict, {}, coarse(), {}, {});
  const record::Finding& f = find(r, "verification.energy");
  ASSERT_EQ(f.status, record::Status::Bad) << f.text;
  const size_t at = f.text.find("; --scaled-step \"");
  ASSERT_NE(at, std::string::npos) << f.text;
  // and half of the step comes of it, but for its two digits
  FeOptions half = coarse();
  half.scaled_step = 1e-3 * std::stod(f.text.substr(at + 17));
  const double step = find(r, "verification.step").value;
  EXPECT_NEAR(half.scaled_step, step / 2, 0.05 * step / 2);
  const record::Record shorter = run_plan(read(with_duration(dropped(), "60 ms")), strict, {}, half, {}, {});
  EXPECT_NEAR(find(shorter, "verification.step").value, half.scaled_step, 1e-9);
}

TEST(Farfield, SaysWithoutARunWhatAScaledStepAdds) {
  const product::Plan plan = read(with_duration(portal(), "20 ms"));
  const Whole whole = make_whole(plan, rules(), coarse().grid, 1);
  const MeshReport mesh = calc_mesh_report(plan, whole);
  FeOptions fe = coarse();
  fe.scaled_step = 0.04e-3;
  std::string said;
  FeCallbacks callbacks;
  callbacks.on_mesh = [&](const MeshReport&, const std::string& added_mass) { said = added_mass; };
  (void)run_plan(plan, rules(), {}, fe, {}, callbacks);
  const MassScaling scaling = calc_mass_scaling(whole, mesh, rules(), fe.scaled_step);
  EXPECT_GT(scaling.mass, 0);
  EXPECT_EQ(scaling.describe(), said);
  EXPECT_EQ(calc_mass_scaling(whole, mesh, rules(), 0.001e-3).describe(), "");
  EXPECT_THROW((void)calc_mass_scaling(whole, mesh, rules(), 5e-3), InputError);
}

TEST(FarfieldPhysics, PlacesBodiesWithTheirDebris) {
  const Building built(read(portal()));
  const auto& [plan, map, model, whole] = built;
  fem::ExplicitSystem system(whole.fe, {});
  system.set_velocity({2, 0, -25});  // into its feet
  ASSERT_EQ(system.advance(0.5), fem::ExplicitEnding::ReachedTime);
  ASSERT_GT(system.debris().size(), 50u);
  const Motion motion(plan, whole, model, map, coarse().grid.size);
  const mbs::View v = motion.calc_view(system, system.time());
  // the bodies' potential and momentum against those of the ledger and of the nodes
  double gravity = 0, scale = 0, mass = 0;
  Vec3 momentum, expected;
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    const double weight = 9.81 * v.mass[b], fall = v.X_WB[b].p.z - model.bodies[b].X_WB.p.z;
    gravity += weight * fall, scale += weight * std::abs(fall);
    mass += v.mass[b];
    momentum += v.mass[b] * v.v_WB[b];
  }
  for (size_t n = 0; n < whole.fe.nodes.size(); ++n)
    expected += system.node_mass(static_cast<int>(n)) * system.v(static_cast<int>(n));
  for (const fem::DebrisParticle& d : system.debris()) expected += d.mass * d.v;
  const fem::ExplicitEnergy energy = system.calc_energy();
  ASSERT_NEAR(energy.removed_gravity, 0, 1e-9 * scale);
  EXPECT_NEAR(gravity, energy.gravity, 1e-3 * scale);
  EXPECT_NEAR(norm(momentum - expected), 0, 1e-6 * norm(expected) + 1e-6 * mass);
}

TEST(FarfieldPhysics, CountsTheWeightOfStumpsAsLongAsTheyAreThere) {
  const Building built(read(dropped()));
  const auto& [plan, map, model, whole] = built;
  fem::ExplicitSystem system(whole.fe, {});
  const Motion motion(plan, whole, model, map, coarse().grid.size);
  std::vector<int> fixed;
  for (size_t e = 0; e < whole.fe.elements.size(); ++e)
    if (model.bodies[static_cast<size_t>(whole.fe.elements[e].part)].fixed) fixed.push_back(static_cast<int>(e));
  ASSERT_GT(fixed.size(), 8u);
  for (const bool taken : {false, true}) {
    if (taken) system.remove(fixed);
    const mbs::View v = motion.calc_view(system, 0);
    double borne = 0, stumps = 0;
    for (const double f : motion.calc_foot_forces(system)) borne += f;
    for (size_t b = 0; b < model.bodies.size(); ++b)
      if (model.bodies[b].fixed) stumps += 9.81 * v.mass[b];
    EXPECT_EQ(stumps > 0, !taken);
    EXPECT_NEAR(borne - v.ground_force.z, stumps, 1e-9 * 9.81 * 1e4);
  }
}

TEST(FarfieldPhysics, FindsReactionsInBalanceWithCellsLargerThanStumps) {
  FeOptions fe = coarse();
  fe.grid.size = 1.3;
  const record::Record r = run(with_duration(dropped(), "60 ms"), fe);
  const record::Finding& f = find(r, "verification.equilibrium");
  EXPECT_LT(f.value, 0.01) << f.text;
  EXPECT_EQ(f.status, record::Status::Good);
}

/// Four columns under a floor; walls of 60 cm between columns as thick, or charges with all their bars at the feet.
std::string table(const std::string& more) {
  return materials() + grid("A = \"0 m\", B = \"4 m\"", "1 = \"0 m\", 2 = \"4 m\"", 1, "4 kN/m2") +
         "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\n[[slabs]]\npanel = \"floor\"\n" + more;
}

TEST(FarfieldPhysics, CountsNodesOnceOnWhichAWallAndAColumnStand) {
  FeOptions fe = coarse();
  fe.grid.size = 1.5;  // a large share of all lies at the feet
  const record::Record r = run(table("[wall.thick]\nthickness = \"30 cm\"\nconcrete = \"C25\"\nsteel = \"S\"\n"
                                     "as_faces = \"4 cm2/m\"\n[[walls]]\npanel = \"thick\"\n" +
                                     analysis("20 ms")),
                               fe);
  const record::Finding& f = find(r, "verification.equilibrium");
  EXPECT_LT(f.value, 2e-3) << f.text;
  EXPECT_EQ(f.status, record::Status::Good) << f.text;
}

TEST(FarfieldPhysics, WeighsWhatScalingOfMassAdds) {
  FeOptions fe = coarse();
  for (const double step : {0.02e-3, 0.024e-3, 0.028e-3, 0.032e-3, 0.036e-3}) {
    fe.scaled_step = step;
    const record::Record r = run(with_duration(house(), "20 ms"), fe);
    const record::Finding& f = find(r, "verification.equilibrium");
    EXPECT_LT(f.value, 5e-3) << step << ' ' << f.text;
  }
}

TEST(FarfieldPhysics, StandsOnBarsThatAreHeldInTheGround) {
  std::string plan = table(charge("C-*", "10 ms", "scatter = \"0 ms\"") + analysis("300 ms"));
  const auto put = [&plan](const std::string& old, const std::string& now) {
    const size_t at = plan.find(old);
    ASSERT_NE(at, std::string::npos) << old;
    plan.replace(at, old.size(), now);
  };
  put("diameter = \"20 mm\" }", "diameter = \"40 mm\" }");
  put("position = \"1 m\"", "position = \"0.15 m\"");
  put("destroyed_length = \"1 m\"", "destroyed_length = \"30 cm\"");
  put("residual_bars = 0.1", "residual_bars = 1");
  const record::Record r = run(plan, coarse());
  const std::vector<double>& force = series(r, "ground_force");
  const double weight = force.front();
  double mean = 0, rows = 0;
  const size_t half = force.size() / 2;
  for (size_t i = half; i < force.size(); ++i) {
    mean += force[i] / static_cast<double>(force.size() - half);
    rows += (series(r, "ground_force_row_A")[i] + series(r, "ground_force_row_B")[i]) /
            static_cast<double>(force.size() - half);
  }
  // it swings on them
  EXPECT_NEAR(mean, weight, 0.1 * weight);
  EXPECT_NEAR(rows, weight, 0.15 * weight);
}

TEST(Farfield, LetsABeamGoWhoseEndsWereCharged) {
  for (const std::string beam : {"B-A1B1-0", "B-A1A2-0"}) {
    std::string text = table(charge("C-B2-0", "10 ms"));
    for (const char* at : {"0.4 m", "3.6 m"})
      text +=
          "[[stage.charge]]\nmembers = [\"" + beam + "\"]\nposition = \"" + at + "\"\ndestroyed_length = \"30 cm\"\n";
    const Building built(read(text + analysis("60 ms")));
    const auto& [plan, map, model, whole] = built;
    const Motion motion(plan, whole, model, map, coarse().grid.size);
    fem::ExplicitSystem system(whole.fe, {});
    const auto count_broken = [&, &map = map] {
      const mbs::View v = motion.calc_view(system, 0);
      int count = 0;
      for (size_t i = 0; i < map.elements.size(); ++i)
        count += map.elements[i].member == beam && v.element_state[i] == mbs::ElementState::Broken;
      return count;
    };
    EXPECT_EQ(count_broken(), 0);
    for (const ChargeElements& c : whole.charges) system.remove(c.elements);
    // along x each end has a zone, along y both are of one
    EXPECT_EQ(count_broken(), beam == "B-A1B1-0" ? 2 : 1) << beam;
  }
}

TEST(FarfieldPhysics, ShakesTheGroundWhateverTheRestitutionOfTheSite) {
  const auto shaking = [](const std::string& restitution) {
    const record::Record r =
        run(with_duration(dropped(), "900 ms") + "[site]\nrestitution = " + restitution +
                "\n[[site.neighbour]]\nname = \"N\"\nfootprint = [[\"-12 m\", \"0 m\"], [\"-8 m\", \"0 m\"], " +
                "[\"-8 m\", \"4 m\"]]\nvibration_limit = \"5 mm/s\"\n" + collapse::vibration_law(),
            coarse());
    return find(r, "vibration.N").text;
  };
  EXPECT_THAT(shaking("0.9"), testing::HasSubstr("MJ lost"));
  EXPECT_EQ(shaking("0.9"), shaking("0.1"));
}

TEST(Farfield, BreaksAZoneWhoseCrossSectionHasGone) {
  const Building built(read(portal()));
  const auto& [plan, map, model, whole] = built;
  const Motion motion(plan, whole, model, map, coarse().grid.size);
  int tried = 0;
  for (size_t z = 0; z < map.elements.size(); ++z) {
    const collapse::ZoneEntry& zone = map.elements[z];
    const int member = plan.find_member(zone.member);
    if (plan.members[static_cast<size_t>(member)].kind != product::MemberKind::Beam) continue;
    // the layer of the beam next to the zone
    double least = 1e9;
    const auto away = [&](const Cell& c) { return std::abs(c.centre.x - zone.p_W.x); };
    for (const Cell& c : whole.grid.cells)
      if (c.member == member) least = std::min(least, away(c));
    std::vector<int> layer;
    for (size_t c = 0; c < whole.grid.cells.size(); ++c)
      if (whole.grid.cells[c].member == member && away(whole.grid.cells[c]) < least + 1e-6)
        layer.push_back(static_cast<int>(c));
    ASSERT_GE(layer.size(), 4u);
    const int last = layer.back();
    layer.pop_back();
    fem::ExplicitSystem system(whole.fe, {});
    system.remove(layer);
    EXPECT_EQ(motion.calc_view(system, 0).element_state[z], mbs::ElementState::Softening) << zone.name;
    system.remove(std::vector<int>{last});
    EXPECT_EQ(motion.calc_view(system, 0).element_state[z], mbs::ElementState::Broken) << zone.name;
    ++tried;
  }
  EXPECT_GT(tried, 1);
}

TEST(FarfieldPhysics, TurnsBodiesAsTheirElementsDo) {
  const Building built(read(portal()));
  const auto& [plan, map, model, whole] = built;
  fem::ExplicitSystem system(whole.fe, {});
  const Vec3 w{0.3, -0.7, 1.1}, about{1, 2, 3};
  std::vector<Vec3> v;
  for (const Vec3& p : whole.fe.nodes) v.push_back(Vec3{5, 0, 0} + cross(w, p - about));
  for (const fem::ExplicitSupport& s : whole.fe.supports) v[static_cast<size_t>(s.node)] = {};
  system.set_velocities(v);
  const mbs::View view = Motion(plan, whole, model, map, coarse().grid.size).calc_view(system, 0);
  int turning = 0;
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    if (map.bodies[b].name != "B-A1B1-0") continue;
    EXPECT_NEAR(norm(view.w_WB[b] - w), 0, 1e-9);
    ++turning;
  }
  EXPECT_EQ(turning, 1);
}

TEST(FarfieldPhysics, RubsWithTheFrictionOfTheRules) {
  collapse::Knowledge slippery = rules();
  slippery.contact_body_friction = 0;
  const product::Plan plan = read(with_duration(dropped(), "900 ms"));
  const record::Record rough = run_plan(plan, rules(), {}, coarse(), {}, {});
  const record::Record smooth = run_plan(plan, slippery, {}, coarse(), {}, {});
  EXPECT_NE(rough.position, smooth.position);
  EXPECT_LT(series(smooth, "energy_friction").back(), series(rough, "energy_friction").back());
}

TEST(Farfield, LeavesOutWhatZonesAloneLack) {
  const std::string text = with_duration(portal(charge("C-A1-0", "50 ms", "transition_damage = 0.4")), "60 ms");
  const auto tells = [](const record::Record& r) {
    return std::any_of(r.findings.begin(), r.findings.end(),
                       [](const record::Finding& f) { return f.title == "Damage without effect"; });
  };
  EXPECT_TRUE(tells(run_bodies(text)));
  EXPECT_FALSE(tells(run(text, coarse())));
}

TEST(Farfield, SaysWhatWasTakenAway) {
  const record::Record r = run(with_duration(dropped(), "100 ms"), coarse());
  EXPECT_EQ(r.provenance.engine, "finite elements");
  EXPECT_EQ(r.ending, "time_limit");
  EXPECT_THAT(find(r, "farfield.removed").text, testing::HasSubstr(" by charges, 0 torn, 0 crushed"));
  EXPECT_THAT(find(r, "farfield.fragments").text, testing::HasSubstr("sound parts"));
  EXPECT_THAT(find(r, "not_modelled").text, testing::HasSubstr("cracks that close again"));
  EXPECT_THAT(find(r, "not_modelled").text, testing::Not(testing::HasSubstr("distance")));
  EXPECT_EQ(find(r, "not_modelled.distances").text, "No distance given here is a safe distance.");
}

TEST(Farfield, PassesOverTheTimeInWhichNothingMoves) {
  FeOptions skipping = coarse();
  skipping.skip_quiet = true;
  std::string text = with_duration(dropped(), "5.2 s");
  text.replace(text.find("time = \"50 ms\""), 14, "time = \"5 s\"");
  const record::Record r = run(text, skipping);
  EXPECT_THAT(find(r, "farfield.skipped.1").text, testing::HasSubstr("the clock was put forward"));
  // from its place under dead load, not from where it was built
  EXPECT_THAT(find(r, "farfield.skipped.1").text, testing::HasSubstr("within 0.0 mm of where it was last at rest"));
  EXPECT_THAT(find(r, "farfield.settling").text, testing::Not(testing::HasSubstr("settled by up to 0.0 mm")));
  EXPECT_GT(find(r, "farfield.skipped.1").value, 4);
  EXPECT_LT(r.time.size(), 80u);  // of the 313 frames of 5.2 s
  double fired = 0;
  for (const record::Event& e : r.events)
    if (e.kind == "charge") fired = e.time;
  EXPECT_EQ(fired, 5);
  EXPECT_NEAR(r.time.back(), 5.2, 1.0 / 60);
}

/// A frame of three columns that loses the first, so that its beam hangs over, and later the last.
std::string overhanging(const std::string& late) {
  const std::string more = "destroyed_length = \"1 m\"\nposition = \"1 m\"\nresidual_bars = 0\n";
  const auto stage = [&](const std::string& time, const std::string& column) {
    return "[[stage]]\nname = \"" + column + "\"\ntime = \"" + time + "\"\n[[stage.charge]]\nmembers = [\"" + column +
           "\"]\n" + more;
  };
  return collapse::materials() + grid("A = \"0 m\", B = \"2.5 m\", C = \"7 m\"", "1 = \"0 m\"", 1) +
         "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\nalong = \"x\"\n" + stage("0 s", "C-A1-0") +
         stage(late, "C-C1-0") + analysis("4 s");
}

TEST(FarfieldPhysics, SettlesAfterTheFirstSwing) {
  FeOptions fe = coarse();
  const record::Record whole = run(overhanging("3.9 s"), fe);
  fe.skip_quiet = true;
  const record::Record r = run(overhanging("3.9 s"), fe);
  const record::Finding& wait = find(r, "farfield.skipped.1");
  EXPECT_GT(wait.value, 3.85 - 0.4) << wait.text;  // while it still swings by as much as it leans
  // it stands where the whole run swings about
  double sum = 0, swing = 0;
  int frames = 0;
  const std::vector<double>& tilt = series(whole, "tilt_angle");
  for (size_t f = 0; f < tilt.size(); ++f)
    if (whole.time[f] > 0.5 && whole.time[f] < 3.7) sum += tilt[f], ++frames;
  const double mean = sum / frames;
  for (size_t f = 0; f < tilt.size(); ++f)
    if (whole.time[f] > 0.5 && whole.time[f] < 3.7) swing = std::max(swing, std::abs(tilt[f] - mean));
  const auto fired = std::find_if(r.time.begin(), r.time.end(), [](double t) { return t > 3.84; });
  const double settled = series(r, "tilt_angle")[static_cast<size_t>(fired - r.time.begin())];
  EXPECT_NEAR(settled, mean, 0.1 * swing);
  EXPECT_GT(swing, 0.5 * std::abs(mean));
}

TEST(Farfield, KnowsWhatASwingHasPassed) {
  Swing swing;
  EXPECT_FALSE(swing.has_passed({}));
  swing.path = {{5, 0, 10}, {5.01, 0, 9.99}, {5.02, 0, 9.98}, {5.015, 0, 9.985}};
  EXPECT_TRUE(swing.has_passed({5.018, 0, 9.982}));
  EXPECT_FALSE(swing.has_passed({5.022, 0, 9.978}));
  EXPECT_FALSE(swing.has_passed({4.99, 0, 10}));
}

TEST(Farfield, FollowsInTimeWhatFindsNoEquilibrium) {
  // by these rules what falls swings about where it stands
  collapse::Knowledge lax = rules();
  lax.rest_speed = 10, lax.rest_time = 0.05;
  std::string text = with_duration(dropped(), "600 ms");
  text += "[[stage]]\nname = \"Late\"\ntime = \"550 ms\"\n[[stage.charge]]\nmembers = [\"C-A1-0\"]\n";
  text += "destroyed_length = \"20 cm\"\nposition = \"0.1 m\"\n";
  FeOptions skipping = coarse();
  const record::Record whole = run_plan(read(text), lax, {}, skipping, {}, {});
  skipping.skip_quiet = true;
  const record::Record r = run_plan(read(text), lax, {}, skipping, {}, {});
  EXPECT_THAT(find(r, "farfield.unsettled.1").text, testing::HasSubstr("found no equilibrium there"));
  EXPECT_EQ(find(r, "farfield.unsettled.1").status, record::Status::Warning);
  EXPECT_EQ(r.time, whole.time);
  EXPECT_EQ(r.position, whole.position);
  EXPECT_EQ(r.ending, "time_limit");
}

TEST(Farfield, SaysWhereThereIsNoEquilibrium) {
  // 150 kN/m over the beam's span of 5 m are 460 kNm in its middle, twice what its bars bear
  std::string text = with_duration(portal(), "20 ms");
  text.replace(text.find("duration = \"20 ms\""), 0, "gravity = \"98 m/s2\"\n");
  text.replace(text.find("[steel.S]"), 0, "density = \"10000 kg/m3\"\n");
  const record::Record r = run(text, coarse());
  ASSERT_EQ(r.ending, "failed") << r.ending_text;
  EXPECT_THAT(r.ending_text, testing::HasSubstr("dead load not in equilibrium after"));
  EXPECT_THAT(r.ending_text, testing::HasSubstr(" yields most, at ("));
  EXPECT_THAT(r.ending_text, testing::HasSubstr("; B-A1B1-0 has moved farthest, from (2."));
}

class FarfieldReplay : public testing::Test {
 protected:
  FarfieldReplay() : folder(testing::TempDir() + "topple_fe_" + name() + "/") {
    std::filesystem::create_directories(folder);
  }
  ~FarfieldReplay() override { std::filesystem::remove_all(folder); }
  static std::string name() { return testing::UnitTest::GetInstance()->current_test_info()->name(); }
  std::string folder;
};

TEST_F(FarfieldReplay, GivesTheSameBitsOnAnyNumberOfThreads) {
  std::string text = with_duration(dropped(), "30 ms");
  text.replace(text.find("time = \"50 ms\""), 14, "time = \"10 ms\"");
  expect_same(run(text, coarse(), 1), run(text, coarse(), 2));
}

TEST_F(FarfieldReplay, GoesOnFromACheckpointAsIfNothingHadHappened) {
  const std::string text = with_duration(dropped(), "500 ms");
  const record::Record whole = run(text, coarse());
  FeOptions kept = coarse();
  kept.checkpoint = folder + "checkpoint.bin";
  std::atomic<bool> cancel{false};
  collapse::RunCallbacks callbacks;
  callbacks.progress.cancel = &cancel;
  callbacks.progress.report = [&](double done, double) { cancel = done > 0.3; };
  const record::Record part = run(text, kept, 1, callbacks);
  EXPECT_EQ(part.ending, "cancelled");
  ASSERT_TRUE(std::filesystem::exists(kept.checkpoint));
  kept.resume = true;
  const record::Record rest = run(text, kept);
  EXPECT_EQ(rest.ending, "time_limit");
  expect_same(whole, rest);
}

TEST_F(FarfieldReplay, GoesOnWhereAWaitWasBeingSettled) {
  FeOptions kept = coarse();
  kept.skip_quiet = true;
  const std::string text = overhanging("1 s");
  collapse::RunOptions o;
  o.duration = 1.1;
  const record::Record whole = run_plan(read(text), rules(), o, kept, {}, {});
  kept.checkpoint = folder + "checkpoint.bin";
  std::atomic<bool> cancel{false};
  bool moves = false;
  collapse::RunCallbacks callbacks;
  callbacks.progress.cancel = &cancel;
  callbacks.progress.report = [&](double, double) { moves = true; };
  FeCallbacks fe_callbacks;
  fe_callbacks.on_settling = [&](int) { cancel = moves; };
  const record::Record part = run_plan(read(text), rules(), o, kept, callbacks, fe_callbacks);
  ASSERT_EQ(part.ending, "cancelled");
  ASSERT_LT(part.time.back(), 0.9);
  kept.resume = true;
  expect_same(whole, run_plan(read(text), rules(), o, kept, {}, {}));
}

TEST(Farfield, SaysWhenAddedMassMakesItAnotherBuilding) {
  const std::string text = with_duration(portal(), "20 ms");
  for (const double step : {0.02e-3, 0.04e-3}) {
    FeOptions fe = coarse();
    fe.scaled_step = step;
    std::string said;
    FeCallbacks callbacks;
    callbacks.on_mesh = [&](const MeshReport&, const std::string& added_mass) { said = added_mass; };
    const record::Record r = run_plan(read(text), rules(), {}, fe, {}, callbacks);
    if (said.empty()) {
      EXPECT_EQ(step, 0.02e-3);
      continue;
    }
    const record::Finding& f = find(r, "farfield.scaled");
    EXPECT_EQ(f.text, said);
    EXPECT_EQ(f.status, record::Status::Warning) << said;
    EXPECT_THAT(said, testing::HasSubstr("another building"));
  }
}

TEST(Farfield, RefusesAScaledStepThatAddsABuilding) {
  for (const double step : {5e-3, 1e10}) {
    FeOptions fe = coarse();
    fe.scaled_step = step;
    try {
      (void)run_plan(read(with_duration(portal(), "20 ms")), rules(), {}, fe, {}, {});
      ADD_FAILURE() << step;
    } catch (const InputError& e) {
      EXPECT_EQ(e.diagnostics()[0].code, "E677");
      const std::string& help = e.diagnostics()[0].help;
      ASSERT_THAT(help, testing::HasSubstr("the mesh bears 0.0"));
      // and that step adds none, but for its digits
      FeOptions borne = fe;
      borne.scaled_step = 1e-3 * std::stod(help.substr(help.find("bears ") + 6));
      const record::Record r = run_plan(read(with_duration(portal(), "10 ms")), rules(), {}, borne, {}, {});
      for (const record::Finding& f : r.findings)
        if (f.id == "farfield.scaled") {
          EXPECT_LT(f.value, 1) << f.text;  // [kg]
        }
    }
  }
}

TEST_F(FarfieldReplay, RefusesAScaledStepWithoutEnd) {
  FeOptions fe = coarse();
  fe.scaled_step = 1e-12;
  EXPECT_THROW((void)run(with_duration(portal(), "20 ms"), fe), InputError);
}

TEST_F(FarfieldReplay, RefusesACheckpointOfSomethingElse) {
  FeOptions kept = coarse();
  kept.checkpoint = folder + "checkpoint.bin";
  kept.checkpoint_interval = 1e-9;  // after every frame
  (void)run(with_duration(portal(), "20 ms"), kept);
  kept.resume = true;
  EXPECT_THROW((void)run(with_duration(portal(), "30 ms"), kept), InputError);
  const auto resume_with = [&](const collapse::Knowledge& k, const FeOptions& fe) {
    (void)run_plan(read(with_duration(portal(), "20 ms")), k, {}, fe, {}, {});
  };
  collapse::Knowledge other = rules();
  other.rules.front().value *= 2;
  EXPECT_THROW(resume_with(other, kept), InputError);
  FeOptions finer = kept;
  finer.grid.least_across = 3;
  EXPECT_THROW(resume_with(rules(), finer), InputError);
  EXPECT_NO_THROW(resume_with(rules(), kept));
  kept.checkpoint = folder + "missing.bin";
  EXPECT_THROW((void)run(with_duration(portal(), "20 ms"), kept), InputError);
}

TEST_F(FarfieldReplay, RefusesACheckpointThatIsDamagedOrLaterThanTheEnd) {
  FeOptions kept = coarse();
  kept.checkpoint = folder + "checkpoint.bin";
  kept.checkpoint_interval = 1e-9;  // after every frame
  (void)run(with_duration(portal(), "20 ms"), kept);
  kept.resume = true;
  const auto complaint = [&](double until) -> std::string {
    collapse::RunOptions options;
    options.duration = until;
    try {
      (void)run_plan(read(with_duration(portal(), "20 ms")), rules(), options, kept, {}, {});
    } catch (const InputError& e) {
      EXPECT_EQ(e.diagnostics()[0].code, "E674");
      return e.diagnostics()[0].message;
    }
    return "";
  };
  EXPECT_THAT(complaint(5e-3), testing::HasSubstr("s, and is to end at 0.005 s"));
  const std::string whole = read_file(kept.checkpoint);
  const auto damage = [&](size_t place) {
    std::string bytes = whole;
    bytes[place] = static_cast<char>(bytes[place] ^ 1);
    replace_file(kept.checkpoint, bytes);
  };
  for (const size_t place : {whole.size() / 3, whole.size() / 2, whole.size() - 1}) {
    damage(place);
    EXPECT_THAT(complaint(0), testing::HasSubstr("damaged")) << place;
  }
  replace_file(kept.checkpoint, whole.substr(0, whole.size() - 100));
  EXPECT_THAT(complaint(0), testing::HasSubstr("cut off"));
  replace_file(kept.checkpoint, whole);
  EXPECT_EQ(complaint(0), "");
}

}  // namespace
}  // namespace topple::farfield
