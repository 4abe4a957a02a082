#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/unit.h"
#include "collapse/manager.h"
#include "collapse/run.h"
#include "mbs/solver.h"
#include "plans.h"

namespace topple::collapse {
namespace {

constexpr double kPi = 3.14159265358979323846;

std::string tower(const std::string& shaft, const std::string& more, const std::string& duration) {
  return "[concrete.C]\nfc = \"25 N/mm2\"\nEc = \"30 GPa\"\n[steel.S]\nfy = \"420 N/mm2\"\nfu = \"500 N/mm2\"\n"
         "eps_u = 0.08\n[[shafts]]\nname = \"tower\"\nconcrete = \"C\"\nsteel = \"S\"\n" +
         shaft + more + analysis(duration);
}

const std::string slender = "height = \"40 m\"\ndiameter = \"3 m\"\nthickness = \"20 cm\"\n";
const std::string strong = "as_outer = \"40 cm2/m\"\nas_inner = \"40 cm2/m\"\nbar_diameter = \"25 mm\"\n";

std::string mouth(const std::string& height, const std::string& opening, const std::string& more = "") {
  return "[[stage]]\ntime = \"0.2 s\"\n[[stage.charge]]\nmembers = \"tower\"\nposition = \"2.5 m\"\n"
         "destroyed_length = \"" +
         height + "\"\nazimuth = \"180 deg\"\nopening = \"" + opening + "\"\n" + more;
}

struct Built {
  product::Plan plan;
  ModelMap map;
  mbs::Model model;
  explicit Built(const std::string& text) : plan(read(text)), model(make_model(plan, default_knowledge(), map)) {}
  double mass() const { return product::calc_mass(plan, plan.members.front()); }
};

/// Body that stands for the whole shaft: mass, mass centre, inertia about W's y through it.
struct Whole {
  double mass = 0, inertia = 0;
  Vec3 centre;
};
Whole gather(const mbs::Model& model) {
  Whole w;
  for (const mbs::Body& b : model.bodies)
    if (!b.fixed) w.mass += b.mass, w.centre += b.mass * b.X_WB.p;
  w.centre *= 1 / w.mass;
  for (const mbs::Body& b : model.bodies) {
    if (b.fixed) continue;
    const Vec3 d = b.X_WB.p - w.centre;
    w.inertia += b.inertia(1, 1) + b.mass * (d.x * d.x + d.z * d.z);
  }
  return w;
}

TEST(Shaft, ItsBodiesHaveTheMassCentreAndInertiaOfTheRing) {
  const Built b(tower(slender + "as_outer = \"6 cm2/m\"\n", "", "1 s"));
  const double ro = 1.5, ri = 1.3, H = 40, mass = 2500 * kPi * (ro * ro - ri * ri) * H;
  const Whole w = gather(b.model);
  EXPECT_NEAR(b.mass(), mass, 1e-9 * mass);
  EXPECT_NEAR(w.mass, mass, 1e-9 * mass);
  EXPECT_NEAR(w.centre.z, 20, 1e-9);
  EXPECT_NEAR(w.inertia, mass * ((ro * ro + ri * ri) / 4 + H * H / 12), 1e-4 * w.inertia);  // staves are boxes
  double about_axis = 0;
  for (const mbs::Body& x : b.model.bodies) about_axis += x.inertia(2, 2);
  EXPECT_NEAR(about_axis, mass * (ro * ro + ri * ri) / 2, 1e-6 * about_axis);
}

TEST(Shaft, TheOrderOfTwoCutsAtALevelChangesNothing) {
  const auto cut = [](const std::string& azimuth, const std::string& height) {
    return "[[preparation.weaken]]\nmembers = \"tower\"\nat = \"20 m\"\nazimuth = \"" + azimuth +
           "\"\nopening = \"60 deg\"\nheight = \"" + height + "\"\ncut_concrete = 0.5\ncut_bars = 0.5\n";
  };
  const std::string low = cut("0 deg", "0.2 m"), high = cut("180 deg", "1.5 m");
  const Built a(tower(slender + strong, low + high, "1 s")), b(tower(slender + strong, high + low, "1 s"));
  ASSERT_EQ(a.model.elements.size(), b.model.elements.size());
  for (size_t e = 0; e < a.model.elements.size(); ++e) {
    const mbs::ZoneLaw &x = a.model.laws[static_cast<size_t>(a.model.elements[e].stations[0].law.index)],
                       &y = b.model.laws[static_cast<size_t>(b.model.elements[e].stations[0].law.index)];
    EXPECT_NEAR(x.crush_length, y.crush_length, 1e-9) << a.model.elements[e].name;
    EXPECT_NEAR(x.rupture_rotation, y.rupture_rotation, 1e-9) << a.model.elements[e].name;
  }
}

TEST(Shaft, TheHighestOfTwoCutsMakesTheLevelInAnyOrder) {
  const auto cut = [](const std::string& at, const std::string& azimuth, const std::string& height) {
    return "[[preparation.weaken]]\nmembers = \"tower\"\nat = \"" + at + "\"\nazimuth = \"" + azimuth +
           "\"\nopening = \"60 deg\"\nheight = \"" + height + "\"\ncut_concrete = 0.5\ncut_bars = 0.5\n";
  };
  const std::string low = cut("20 m", "0 deg", "0.1 m"), high = cut("20.04 m", "180 deg", "2 m");
  const Built a(tower(slender + strong, low + high, "1 s")), b(tower(slender + strong, high + low, "1 s"));
  ASSERT_EQ(a.model.elements.size(), b.model.elements.size());
  for (size_t e = 0; e < a.model.elements.size(); ++e)
    EXPECT_NEAR(a.model.elements[e].rotational_stiffness.z, b.model.elements[e].rotational_stiffness.z,
                1e-9 * a.model.elements[e].rotational_stiffness.z)
        << a.model.elements[e].name;
}

TEST(Shaft, ACableHoldsItsStumpBelowAMouth) {
  const Built b(tower(slender + strong,
                      mouth("2 m", "200 deg") +
                          "[[cable]]\nmember = \"tower\"\nposition = \"0.5 m\"\nanchor = [\"30 m\", \"0 m\", \"1 m\"]\n"
                          "stiffness = \"1 MN/m\"\npretension = \"10 kN\"\nstrength = \"200 kN\"\n",
                      "1 s"));
  ASSERT_EQ(b.model.cables.size(), 1u);
  EXPECT_TRUE(b.model.bodies[static_cast<size_t>(b.model.cables[0].a.index)].fixed);
}

TEST(Shaft, ItsBodiesHaveTheVolumeOfTheRing) {
  // 50 kN of a platform have none
  const Built b(
      tower(slender + strong + "load = [{ at = \"30 m\", weight = \"50 kN\" }]\n", mouth("2 m", "200 deg"), "1 s"));
  double moving = 0, boxes = 0, thrown = 0;
  for (size_t i = 0; i < b.map.bodies.size(); ++i) {
    if (b.model.bodies[i].fixed) continue;
    moving += b.map.bodies[i].volume;
    for (const record::BoxShape& s : b.map.bodies[i].shapes) boxes += 8 * s.half.x * s.half.y * s.half.z;
  }
  for (const DebrisEntry& d : b.map.debris) thrown += d.volume;
  const double area = kPi * (1.5 * 1.5 - 1.3 * 1.3), mouth_share = 200.0 / 360;
  EXPECT_NEAR(moving, area * (37.5 - 1 * mouth_share), 1e-9);
  EXPECT_NEAR(thrown, area * 2 * mouth_share, 1e-9);
  EXPECT_GT(boxes, 1.05 * moving) << "boxes overlap";
}

TEST(Shaft, TheNoteOnItsMouthCountsWhatIsLeftOfTheRing) {
  const Built b(tower(slender + strong, mouth("2 m", "200 deg"), "1 s"));
  const double area = kPi * (1.5 * 1.5 - 1.3 * 1.3), per_metre = 2500 * 9.81 * area;
  ASSERT_FALSE(b.map.notes.empty());
  const std::string& text = b.map.notes.front().text;
  EXPECT_THAT(text,
              testing::HasSubstr("The weight of " + fmt::format("{:.2f}", (37.5 - 200.0 / 360) * per_metre * 1e-6) +
                                 " MN above it"));
}

TEST(Shaft, ATaperedOneHasTheMassOfItsCone) {
  const Built b(
      tower("height = \"60 m\"\ndiameter = \"5 m\"\ndiameter_top = \"3 m\"\nthickness = \"40 cm\"\n"
            "thickness_top = \"20 cm\"\nlining = { thickness = \"12 cm\", density = \"1800 kg/m3\" }\n"
            "load = [{ at = \"58 m\", weight = \"98.1 kN\" }]\n",
            "", "1 s"));
  double mass = 10000 * 9.81 / unit::gravity, moment = mass * 58;
  const int n = 20000;
  for (int i = 0; i < n; ++i) {
    const double s = (i + 0.5) / n, ro = 2.5 - s, t = 0.4 - 0.2 * s, ri = ro - t, rl = ri - 0.12;
    const double m = 60.0 / n * kPi * (2500 * (ro * ro - ri * ri) + 1800 * (ri * ri - rl * rl));
    mass += m, moment += m * 60 * s;
  }
  const Whole w = gather(b.model);
  EXPECT_NEAR(w.mass, mass, 1e-7 * mass);
  EXPECT_NEAR(w.centre.z, moment / mass, 0.003 * w.centre.z);  // the pieces' own taper, (h / 12)² / 12
}

TEST(ShaftPhysics, TheFootBearsItsWeightEvenly) {
  Built b(tower(slender + "as_outer = \"6 cm2/m\"\n", "", "1 s"));
  mbs::Simulation s(b.model, {});
  std::string message;
  ASSERT_TRUE(s.find_equilibrium(message)) << message;
  const mbs::View& v = s.calc_view();
  const double area = kPi * (1.5 * 1.5 - 1.3 * 1.3);
  ASSERT_EQ(b.map.elements.front().p_W, (Vec3{0, 0, 0}));
  EXPECT_NEAR(std::abs(v.element_force.front().x) / area, 2500 * 9.81 * 40, 1.0);  // rho g h [Pa]
  EXPECT_NEAR(norm(v.element_moment.front()), 0, 1e-6 * 2500 * 9.81 * 40 * area);
}

TEST(ShaftPhysics, SectorsShareTheWeightAsTheyShareTheRing) {
  Built b(tower(slender + "as_outer = \"6 cm2/m\"\n", mouth("2 m", "200 deg"), "1 s"));
  mbs::Simulation s(b.model, {});
  std::string message;
  ASSERT_TRUE(s.find_equilibrium(message)) << message;
  const mbs::View& v = s.calc_view();
  const double above = b.mass() * 37.5 / 40 * 9.81;
  double sum = 0;
  for (size_t e : {0UL, 1UL}) sum += std::abs(v.element_force[e].x);
  EXPECT_NEAR(sum, above, 1e-6 * above);
  const bool first_is_mouth = b.map.elements[0].name.find("mouth") != std::string::npos;
  EXPECT_NEAR(std::abs(v.element_force[first_is_mouth ? 0 : 1].x) / above, 200.0 / 360, 0.01);
  // nothing turns before the charge: the sectors' moments and their forces about the axis cancel
  double tilt = 0;
  for (const Pose& X : v.X_WB) tilt = std::max(tilt, norm(log_rotation(X.q)));
  EXPECT_LT(tilt, 1e-5);
}

/// The rotation of the shaft towards the mouth over the time, from the frames of a run.
struct Fall {
  std::vector<double> time, angle, rate;
  std::vector<std::vector<double>> moment;  // of each element about its z axis
};
Fall fall(const mbs::Model& model, double duration, double interval) {
  Fall f;
  mbs::Options o;
  o.duration = duration, o.frame_interval = interval;
  o.on_frame = [&](const mbs::View& v) {
    f.time.push_back(v.time);
    const size_t top = v.X_WB.size() - 1;
    f.angle.push_back(-log_rotation(v.X_WB[top].q).y);
    f.rate.push_back(-v.w_WB[top].y);
    std::vector<double> m;
    for (const Vec3& e : v.element_moment) m.push_back(e.z);
    f.moment.push_back(std::move(m));
  };
  const mbs::Summary s = mbs::run(model, o);
  EXPECT_LT(s.energy_error, 0.01) << s.message;
  return f;
}

TEST(ShaftPhysics, ItFallsAsARigidBodyAboutItsHinge) {
  // one piece above a high mouth that leaves a third of a thin ring without bars
  Built b(tower("height = \"40 m\"\ndiameter = \"3 m\"\nthickness = \"20 cm\"\njoint_spacing = \"500 m\"\n",
                mouth("4 m", "240 deg"), "6 s"));
  const Fall f = fall(b.model, 6, 0.01);
  const Whole w = gather(b.model);
  ASSERT_GT(f.angle.back(), 0.5) << "it does not fall";
  // from 0.1 rad on, when the hinge is broken, about the lips of the mouth: theta'' = m g r sin(theta + theta_0) / I
  size_t from = 0;
  while (f.angle[from] < 0.1) ++from;
  const double lip = -1.4 * std::cos(kPi / 3);  // of the rear sector's ends, along the fall: behind the axis
  const double height = w.centre.z - 2.5, ahead = -lip;
  const double r2 = height * height + ahead * ahead, lean = std::atan2(ahead, height);
  const double I = w.inertia + w.mass * r2, rate = w.mass * 9.81 * std::sqrt(r2) / I;
  double angle = f.angle[from], speed = f.rate[from], t = f.time[from];
  double worst = 0;
  for (size_t i = from; i < f.angle.size() && f.angle[i] < 0.7; ++i) {
    while (t < f.time[i] - 1e-9) {
      const double h = 1e-4;
      const double half = speed + 0.5 * h * rate * std::sin(angle + lean);
      angle += h * half;
      speed = half + 0.5 * h * rate * std::sin(angle + lean);
      t += h;
    }
    worst = std::max(worst, std::abs(angle - f.angle[i]));
  }
  EXPECT_LT(worst, 0.03);  // rad; the lips are crushed a little
}

TEST(ShaftPhysics, TheMomentInTheFallingShaftIsLargestAtAThirdOfItsHeight) {
  Built b(tower(slender + strong + "joint_spacing = \"2.5 m\"\n", mouth("4 m", "270 deg"), "8 s"));
  const Fall f = fall(b.model, 8, 0.005);
  ASSERT_GT(*std::max_element(f.angle.begin(), f.angle.end()), 0.65) << "it does not fall";
  // A rod that turns about a pivot b behind its axis: what gravity and its acceleration leave across the axis,
  //   q = mu (g sin a + b a'^2 - s a''),   a'' = g (L/2 sin a + b cos a) / (L^2/3 + b^2 + k^2)
  // bends it at x = s/L by M = m L ((g sin a + b a'^2) (1-x)^2 / 2 - L a'' (x (1-x)^2 / 2 + (1-x)^3 / 3)), less the
  // rotary inertia of what is above. With b = k = 0 it is m g L sin a x (1-x)^2 / 4.
  const double L = 37.5, m = b.mass() * L / 40, pivot = 1.4 * std::cos(kPi / 4), k2 = (1.5 * 1.5 + 1.3 * 1.3) / 4;
  double largest = 0, where = 0, worst = 0, most = 0;
  for (size_t e = 0; e < b.map.elements.size(); ++e) {
    const double x = (b.map.elements[e].p_W.z - 2.5) / L;
    if (x < 0.02) continue;
    double sum = 0, expected = 0, classical = 0;
    int n = 0;
    for (size_t i = 0; i < f.time.size(); ++i) {
      if (f.angle[i] < 0.25 || f.angle[i] > 0.65) continue;
      const double a = f.angle[i], s = std::sin(a), y = 1 - x;
      const double turn = 9.81 * (L / 2 * s + pivot * std::cos(a)) / (L * L / 3 + pivot * pivot + k2);
      sum += f.moment[i][e];
      expected -= m * L *
                  ((9.81 * s + pivot * f.rate[i] * f.rate[i]) * y * y / 2 - L * turn * (x * y * y / 2 + y * y * y / 3) -
                   turn * k2 / L * y);
      // without the moment that the pivot's place gives
      const double foot = m * 9.81 * pivot * std::cos(a);
      classical += f.moment[i][e] - foot * y * y * (1 + x / 2);
      ++n;
    }
    worst = std::max(worst, std::abs(sum - expected) / n), most = std::max(most, std::abs(expected) / n);
    if (classical / n > largest) largest = classical / n, where = x;
  }
  EXPECT_LT(worst, 0.1 * most);  // the shaft swings a little while it falls
  EXPECT_NEAR(where, 1.0 / 3, 0.1);
}

TEST(ShaftPhysics, AWeakShaftBreaksAroundThereAndAStrongOneDoesNot) {
  const auto broken = [](const std::string& bars) {
    Built b(tower("height = \"60 m\"\ndiameter = \"3 m\"\nthickness = \"20 cm\"\njoint_spacing = \"4 m\"\n" + bars,
                  mouth("2 m", "230 deg"), "10 s"));
    std::vector<double> heights;
    mbs::Options o;
    o.duration = 7.8;  // before it lands
    double angle = 0;
    o.on_frame = [&](const mbs::View& v) { angle = -log_rotation(v.X_WB.back().q).y; };
    o.on_happening = [&](const mbs::Happening& h) {
      if (h.kind == mbs::Happening::Kind::ElementBroken && angle < 1.0 &&
          b.map.elements[static_cast<size_t>(h.index)].p_W.z > 3)
        heights.push_back(b.map.elements[static_cast<size_t>(h.index)].p_W.z);
    };
    const mbs::Summary s = mbs::run(b.model, o);
    EXPECT_LT(s.energy_error, 0.02) << s.message;
    EXPECT_GT(angle, 0.5);
    return heights;
  };
  const std::vector<double> weak = broken("as_outer = \"0.7 cm2/m\"\nbar_diameter = \"10 mm\"\n");
  ASSERT_FALSE(weak.empty());
  EXPECT_GT(weak.front(), 2.5 + 0.15 * 57.5);
  EXPECT_LT(weak.front(), 2.5 + 0.7 * 57.5);
  EXPECT_TRUE(broken(strong).empty());
}

TEST(ShaftPhysics, ItFallsWhereItsMouthPointsAndReachesItsHeight) {
  const std::string text =
      tower(slender + "as_outer = \"6 cm2/m\"\n",
            "[[stage]]\ntime = \"0.2 s\"\n[[stage.charge]]\nmembers = \"tower\"\nposition = \"2 m\"\n"
            "destroyed_length = \"1.5 m\"\nazimuth = \"50 deg\"\nopening = \"220 deg\"\n"
            // 25 to 33 m along the fall
            "[[site.neighbour]]\nname = \"House\"\nfootprint = [[\"16 m\", \"19 m\"], [\"21 m\", \"19 m\"], [\"21 m\", "
            "\"25 m\"], "
            "[\"16 m\", \"25 m\"]]\n",
            "10 s");
  const record::Record r = run_plan(read(text), default_knowledge(), {}, {});
  const auto finding = [&](const std::string& id) {
    const auto it = std::find_if(r.findings.begin(), r.findings.end(), [&](const auto& f) { return f.id == id; });
    EXPECT_NE(it, r.findings.end()) << id;
    return *it;
  };
  EXPECT_EQ(finding("mechanism").title, "Mechanism: topple") << finding("mechanism").text;
  EXPECT_NEAR(finding("azimuth").value / unit::deg, 50, 5);
  // single rings at the top tumble on, since rigid ones do not flatten
  double mass = 0, within = 0, farthest = 0;
  for (size_t b = 0; b < r.bodies.size(); ++b) {
    if (r.bodies[b].fixed) continue;
    const Vec3 p = record::pose_at(r, r.time.size() - 1, b).p;
    const double way = p.x * std::cos(50 * unit::deg) + p.y * std::sin(50 * unit::deg);
    mass += r.bodies[b].mass;
    if (way < 1.1 * 40) within += r.bodies[b].mass;
    farthest = std::max(farthest, way);
  }
  EXPECT_GT(farthest, 0.8 * 40);
  EXPECT_GT(within / mass, 0.65);
  // it is over the neighbour long before it lies there
  const auto on_it =
      std::find_if(r.findings.begin(), r.findings.end(), [](const auto& f) { return f.title == "House"; });
  ASSERT_NE(on_it, r.findings.end());
  const size_t at = on_it->text.find(" lands on it at ");
  ASSERT_NE(at, std::string::npos) << on_it->text;
  EXPECT_GT(std::stod(on_it->text.substr(at + 16)), finding("touchdown.first").value - 0.1);
}

TEST(ShaftPhysics, ASmallMouthLeavesItStanding) {
  const record::Record r = run_plan(read(tower(slender + "as_outer = \"6 cm2/m\"\n", mouth("1 m", "90 deg"), "2 s")),
                                    default_knowledge(), {}, {});
  for (const record::Finding& f : r.findings)
    if (f.id == "mechanism") { EXPECT_EQ(f.title, "Mechanism: stands") << f.text; }
}

// its edges, or the lips of its mouth, meet as a contact
TEST(Shaft, NoRingHoldsTogetherBecauseItIsPressed) {
  Knowledge k = default_knowledge();
  k.zone_rupture_rotation_pressed = 1;
  ModelMap map;
  const mbs::Model model = make_model(read(tower(slender + strong, mouth("1.5 m", "200 deg"), "1 s")), k, map);
  ASSERT_FALSE(model.laws.empty());
  for (const mbs::ZoneLaw& law : model.laws) EXPECT_EQ(law.rupture_rotation_pressed, 0) << law.name;
}

TEST(Shaft, WhatIsNotModelledSaysSo) {
  const std::string near_each_other =
      mouth("2 m", "200 deg") +
      "[[stage]]\ntime = \"0.3 s\"\n[[stage.charge]]\nmembers = \"tower\"\nposition = \"4.6 m\"\n"
      "destroyed_length = \"2 m\"\nazimuth = \"0 deg\"\nopening = \"200 deg\"\n";
  ModelMap map;
  EXPECT_THROW(make_model(read(tower(slender, near_each_other, "1 s")), default_knowledge(), map), InputError);
}

/// A charge or a cut in the middle of the lower part, with a sector or all around.
std::string sector(const std::string& azimuth, const std::string& opening) {
  if (azimuth.empty()) return "";
  return "azimuth = \"" + azimuth + " deg\"\nopening = \"" + opening + " deg\"\n";
}

TEST(Shaft, AChargeTakesItsShareOfTheRingWhereverItsMiddleLies) {
  const auto share = [](const std::string& where) {
    const Built b(tower(slender,
                        "[[stage]]\ntime = \"0.2 s\"\n[[stage.charge]]\nmembers = \"tower\"\nposition = \"2.5 m\"\n"
                        "destroyed_length = \"2 m\"\n" +
                            where,
                        "1 s"));
    double mass = 0;
    for (const DebrisEntry& d : b.map.debris) mass += d.mass;
    return mass / (b.mass() * 2 / 40);
  };
  EXPECT_NEAR(share(""), 1, 1e-9);
  for (const char* azimuth : {"0", "10", "45", "90", "135", "180", "-180", "225", "270", "-90", "359", "360", "-360"})
    for (const double opening : {20.0, 120.0, 180.0, 270.0, 359.0, 360.0})
      EXPECT_NEAR(share(sector(azimuth, std::to_string(opening))), opening / 360, 1e-9) << azimuth << " " << opening;
}

TEST(Shaft, NoPieceLiesWithinAMouth) {
  const std::string all_around =
      "[[stage]]\ntime = \"0.2 s\"\n[[stage.charge]]\nmembers = \"tower\"\nposition = \"15 m\"\n"
      "destroyed_length = \"10 m\"\n";
  for (const char* spacing : {"1 m", "2 m", "3 m", "4 m", "15 m"}) {
    SCOPED_TRACE(spacing);
    const Built b(tower(slender + "joint_spacing = \"" + spacing + "\"\n", all_around, "1 s"));
    const double per_metre = b.mass() / 40;
    double removed = 0;
    for (const mbs::Event& e : b.model.events)
      for (const mbs::Action& act : e.actions) {
        if (act.kind != mbs::Action::Kind::ReplaceBody) continue;
        EXPECT_GT(act.replacement.mass, 0.2999 * per_metre);
        removed += b.model.bodies[static_cast<size_t>(act.body.index)].mass - act.replacement.mass;
      }
    EXPECT_NEAR(removed, 10 * per_metre, 1e-6 * removed);
    int in_mouth = 0;
    for (const ZoneEntry& z : b.map.elements) {
      const bool is_near = z.p_W.z > 9.7001 && z.p_W.z < 20.2999;
      in_mouth += is_near;
      EXPECT_TRUE(!is_near || std::abs(z.p_W.z - 15) < 1e-6) << z.p_W.z;
    }
    EXPECT_EQ(in_mouth, 1);
  }
}

TEST(Shaft, ACutAllAroundWeakensTheRingBehindAMouthAsItsHalvesDo) {
  const auto cut = [](const std::string& more) {
    return "[[preparation.weaken]]\nmembers = \"tower\"\nat = \"2.5 m\"\nheight = \"2 m\"\ncut_concrete = 0.5\n"
           "cut_bars = 0.5\n" +
           more;
  };
  const auto resistance = [](const std::string& cuts) {
    const Built b(tower(slender + strong, cuts + mouth("2 m", "200 deg"), "1 s"));
    const mbs::LawId law = b.map.ground_columns.at(0).element.law;
    const std::vector<double>& m = b.model.laws[static_cast<size_t>(law.index)].moment_z.positive;
    return *std::max_element(m.begin(), m.end());
  };
  const double halves = resistance(cut(sector("90", "180")) + cut(sector("270", "180")));
  EXPECT_LT(halves, 0.6 * resistance(""));
  // the halves' fibres lie elsewhere
  EXPECT_NEAR(resistance(cut("")), halves, 1e-4 * halves);
  EXPECT_NEAR(resistance(cut(sector("180", "360"))), halves, 1e-4 * halves);
}

TEST(Shaft, NothingHoldsWhereACutGoesAllAround) {
  for (const char* azimuth : {"", "0", "90", "180"}) {
    const std::string cut =
        "[[preparation.weaken]]\nmembers = \"tower\"\nat = \"2.5 m\"\ncut_concrete = 1\ncut_bars = 1\n" +
        sector(azimuth, "360");
    ModelMap map;
    EXPECT_THROW(
        make_model(read(tower(slender + strong, cut + mouth("2 m", "200 deg"), "1 s")), default_knowledge(), map),
        InputError)
        << azimuth;
  }
}

/// A second, lower shaft far from the first.
const std::string second =
    "[[shafts]]\nname = \"low\"\nposition = [\"100 m\", \"0 m\"]\nconcrete = \"C\"\nsteel = \"S\"\nheight = \"20 m\"\n"
    "diameter = \"3 m\"\nthickness = \"20 cm\"\n";

TEST(Structures, WhatNoChargeActsOnIsNotJudged) {
  const Built b(tower(slender, second + mouth("2 m", "200 deg"), "1 s"));
  ASSERT_EQ(b.map.structures.size(), 1u);
  EXPECT_EQ(b.map.structures[0].name, "tower");
  for (const BodyEntry& body : b.map.bodies) {
    if (body.kind == "stump") continue;
    const bool is_low = body.name.substr(0, 3) == "low";
    EXPECT_EQ(body.structure, is_low ? -1 : 0) << body.name;
    EXPECT_EQ(body.is_upper, !is_low) << body.name;
  }
  ASSERT_FALSE(b.map.notes.empty());
  EXPECT_EQ(b.map.notes.front().title, "The mouth of tower") << "a finding's title says what it is about";
  EXPECT_EQ(
      b.map.notes.back().text,
      "No charge acts on 1 of 2 separate structures (with low): the mechanism is judged without what stands there.");
}

TEST(Structures, ThoseThatChargesActOnAreJudgedOneByOneTheHeaviestFirst) {
  std::string fired = mouth("2 m", "200 deg");
  fired +=
      "[[stage.charge]]\nmembers = \"low\"\nposition = \"2.5 m\"\ndestroyed_length = \"2 m\"\n"
      "azimuth = \"0 deg\"\nopening = \"200 deg\"\n";
  const Built b(tower(slender, second + fired, "1 s"));
  ASSERT_EQ(b.map.structures.size(), 2u);
  EXPECT_EQ(b.map.structures[0].name, "tower");
  EXPECT_EQ(b.map.structures[1].name, "low");
  EXPECT_NEAR(b.map.structures[0].mass / b.map.structures[1].mass, 37.5 / 17.5, 1e-6);
  EXPECT_NE(b.map.notes.back().text.find("Charges act on 2 separate structures (with tower, low)"), std::string::npos);
}

TEST(ShaftRun, WhatIsJudgedDoesNotHangOnStoreysElsewhere) {
  // a low shaft falls beside a frame that no charge acts on: half of the 9 m of its storey are no measure for it
  const auto judge = [](const std::string& beside) {
    const record::Record r =
        run_plan(read(materials() + beside +
                      "[[shafts]]\nname = \"a\"\nposition = [\"0 m\", \"0 m\"]\nheight = \"6 m\"\ndiameter = \"4 m\"\n"
                      "thickness = \"25 cm\"\nconcrete = \"C25\"\nsteel = \"S\"\nas_outer = \"1 cm2/m\"\n"
                      "[[stage]]\ntime = \"0.1 s\"\n[[stage.charge]]\nmembers = \"a\"\nposition = \"2 m\"\n"
                      "destroyed_length = \"2 m\"\nazimuth = \"0 deg\"\nopening = \"290 deg\"\n" +
                      analysis("8 s")),
                 default_knowledge(), {}, {});
    for (const record::Finding& f : r.findings)
      if (f.id == "mechanism") return f.text;
    return std::string();
  };
  const std::string frame =
      "[grid]\nrows = { A = \"100 m\", B = \"105 m\" }\nframes = { 1 = \"0 m\" }\n"
      "[storeys]\nheights = [\"9 m\"]\n[[columns]]\nsection = \"column\"\n"
      "[[beams]]\nsection = \"beam\"\n";
  for (const std::string& text : {judge(""), judge(frame)}) {
    EXPECT_NE(text.find("In the end 100 % of the mass has come down"), std::string::npos) << text;
  }
}

TEST(Structures, OneWhoseChargesAllFailIsStillJudged) {
  const Built b(tower(slender,
                      second + mouth("2 m", "200 deg") +
                          "[[stage.charge]]\nmembers = \"low\"\nposition = \"2.5 m\"\ndestroyed_length = \"2 m\"\n"
                          "azimuth = \"0 deg\"\nopening = \"200 deg\"\nfails = true\n",
                      "1 s"));
  ASSERT_EQ(b.map.structures.size(), 2u);
  EXPECT_EQ(b.map.structures[1].name, "low");
}

TEST(Structures, APauseIsThatOfThoseWithChargesToCome) {
  std::string later = mouth("2 m", "150 deg");
  later.replace(later.find("0.2 s"), 5, "5 s");
  later.replace(later.find("tower"), 5, "low");
  const record::Record r =
      run_plan(read(tower(slender, second + mouth("2 m", "240 deg") + later, "5.2 s")), default_knowledge(), {}, {});
  for (const record::Finding& f : r.findings)
    if (f.id == "stability.stage_1") {
      EXPECT_EQ(f.status, record::Status::Good) << f.text;
      EXPECT_NE(f.text.find("Judged of what has charges to come: low."), std::string::npos) << f.text;
      EXPECT_NE(f.text.find("Zone low/"), std::string::npos) << f.text;
      return;
    }
  FAIL() << "no pause";
}

TEST(Shaft, ASliverBetweenTwoChargesBearsNothing) {
  const auto split = [](const std::string& azimuth) {
    return mouth("2 m", "100 deg") +
           "[[stage.charge]]\nmembers = \"tower\"\nposition = \"2.5 m\"\ndestroyed_length = " +
           "\"2 m\"\nazimuth = \"" + azimuth + "\"\nopening = \"100 deg\"\n";
  };
  const Built touching(tower(slender + strong, split("280 deg"), "1 s")),
      apart(tower(slender + strong, split("280.01 deg"), "1 s"));
  ASSERT_EQ(touching.model.elements.size(), apart.model.elements.size());
  for (size_t i = 0; i < touching.model.elements.size(); ++i) {
    const Vec3 &a = touching.model.elements[i].rotational_stiffness, &b = apart.model.elements[i].rotational_stiffness;
    EXPECT_NEAR(a.y, b.y, 1e-3 * a.y) << touching.model.elements[i].name;
    EXPECT_NEAR(a.z, b.z, 1e-3 * a.z) << touching.model.elements[i].name;
  }
}

TEST(Structures, TheUpperBlockOfAShaftStandsOnItsLowestMouth) {
  std::string high = mouth("2 m", "200 deg");
  high.replace(high.find("2.5 m"), 5, "30 m");
  const Built b(tower(slender, high, "1 s"));
  double upper = 0;
  for (size_t i = 0; i < b.model.bodies.size(); ++i)
    if (b.map.bodies[i].is_upper) upper += b.model.bodies[i].mass;
  EXPECT_NEAR(upper, b.mass() / 4, 1e-9 * b.mass());
}

std::string text_of(const record::Record& r, const std::string& id) {
  for (const record::Finding& f : r.findings)
    if (f.id == id) return f.text;
  return "";
}

TEST(ShaftPhysics, OneThatStandsAndSwaysLessAndLessBreaksNoLimitByIt) {
  const std::string limits =
      "[criteria]\nmechanism = \"stands\"\ndebris_reach = \"20 m\"\n[[site.neighbour]]\nname = \"Hut\"\n"
      "footprint = [[\"30 m\", \"-5 m\"], [\"40 m\", \"-5 m\"], [\"40 m\", \"5 m\"]]\nclearance = \"10 m\"\n";
  double fastest = 0;
  for (const char* until : {"9 s", "9.3 s", "9.6 s"}) {
    const record::Record r =
        run_plan(read(tower(slender + strong, mouth("1 m", "200 deg") + limits, until)), default_knowledge(), {}, {});
    ASSERT_EQ(r.ending, "time_limit");
    const size_t last = r.time.size() - 1,
                 tip = r.bodies.size() - 1 -
                       static_cast<size_t>(std::count_if(r.bodies.begin(), r.bodies.end(),
                                                         [](const record::BodyInfo&b) { return b.kind == "debris"; }));
    fastest = std::max(fastest, norm(record::pose_at(r, last, tip).p - record::pose_at(r, last - 1, tip).p) /
                                    (r.time[last] - r.time[last - 1]));
    for (const record::Finding& f : r.findings) EXPECT_NE(f.status, record::Status::NotJudged) << until << f.text;
    EXPECT_EQ(text_of(r, "stability.start").find("Heads of ground columns"), std::string::npos) << "it has none";
    EXPECT_EQ(text_of(r, "verification.step").find("Joints drift"), std::string::npos) << "nor joints";
  }
  EXPECT_GT(fastest, 0.2) << "or nothing here is fast enough to be asked";
}

TEST(ShaftPhysics, TheRigidBlockHasTheMassAboveItsMouth) {
  const std::string stiff = slender + strong;
  const std::string low =
      text_of(run_plan(read(tower(stiff, second + mouth("2 m", "200 deg"), "1.3 s")), default_knowledge(), {}, {}),
              "rigid_block");
  const double t = 2500 * kPi * (1.5 * 1.5 - 1.3 * 1.3) * 1e-3;  // per metre
  // a fixed stump below the middle of the mouth; of the mouth's upper half 160 of 360 degrees stay
  EXPECT_NE(low.find(std::to_string(std::lround(37.5 * t)) + " t on a plastic hinge"), std::string::npos) << low;
  std::string high = mouth("2 m", "200 deg");
  high.replace(high.find("2.5 m"), 5, "30 m");
  const std::string top =
      text_of(run_plan(read(tower(stiff, high, "1.3 s")), default_knowledge(), {}, {}), "rigid_block");
  EXPECT_NE(top.find(std::to_string(std::lround(10 * t)) + " t on a plastic hinge"), std::string::npos) << top;
  const std::string falls = text_of(
      run_plan(read(tower(slender, mouth("4 m", "240 deg"), "1.3 s")), default_knowledge(), {}, {}), "rigid_block");
  EXPECT_THAT(falls,
              testing::HasSubstr("that block does not bend, yield or break above its mouth. Its hinge does not give"));
  // 120 deg stay: the weight alone does not turn it, and let go at once it turns over
  std::string low_mouth = mouth("1.5 m", "240 deg");
  low_mouth.replace(low_mouth.find("2.5 m"), 5, "1.5 m");
  const record::Record both =
      run_plan(read(tower("height = \"30 m\"\ndiameter = \"3 m\"\nthickness = \"30 cm\"\nas_outer = \"40 cm2/m\"\n"
                          "as_inner = \"40 cm2/m\"\n",
                          low_mouth, "1.3 s")),
               default_knowledge(), {}, {});
  std::string told;
  for (const record::Finding& f : both.findings) told += f.text + "\n";
  EXPECT_THAT(told, testing::HasSubstr("a rigid block that is let go at once on such a hinge does."));
  EXPECT_THAT(text_of(both, "rigid_block"),
              testing::HasSubstr("would stay at rest: its weight alone does not turn it."));
  EXPECT_THAT(text_of(both, "rigid_block"),
              testing::HasSubstr("on a hinge that gives first may turn over all the same."));
}

/// Charges of a tower at a level, in the order given: azimuth and opening [deg], and what else they have.
std::string charges(const std::vector<std::pair<double, double>>& sectors, const std::string& at = "2 m",
                    const std::string& more = "") {
  std::string text;
  for (const auto& [azimuth, opening] : sectors)
    text += fmt::format(
        "[[stage.charge]]\nmembers = \"tower\"\nposition = \"{}\"\ndestroyed_length = \"1.5 m\"\nazimuth = \"{} "
        "deg\"\nopening = \"{} deg\"\n{}",
        at, azimuth, opening, more);
  return text;
}

const std::string one_stage = "[[stage]]\ntime = \"0.2 s\"\n";
const std::string wide = "height = \"40 m\"\ndiameter = \"4 m\"\nthickness = \"30 cm\"\nas_outer = \"6 cm2/m\"\n";

/// A mouth of 184 deg towards 37 deg as one charge and as several.
const std::vector<std::vector<std::pair<double, double>>> splits = {{{37, 184}},
                                                                    {{-9, 92}, {83, 92}},
                                                                    {{83, 92}, {-9, 92}},
                                                                    {{-32, 46}, {106, 46}, {60, 46}, {14, 46}},
                                                                    {{-29, 52}, {37, 80}, {103, 52}}};

TEST(Shaft, AMouthIsTheSameInHoweverManyChargesItIsListed) {
  const Built whole(tower(wide, one_stage + charges(splits[0]), "1 s"));
  ASSERT_EQ(whole.map.ground_columns.size(), 1u);
  const auto law_of = [](const Built& b) -> const mbs::ZoneLaw& {
    return b.model.laws[static_cast<size_t>(b.map.ground_columns[0].element.law.index)];
  };
  const auto most = [](const std::vector<double>& m) { return *std::max_element(m.begin(), m.end()); };
  for (const auto& split : splits) {
    const Built b(tower(wide, one_stage + charges(split), "1 s"));
    EXPECT_EQ(b.map.notes.front().text, whole.map.notes.front().text);
    EXPECT_NEAR(norm(b.map.ground_columns[0].p_top - whole.map.ground_columns[0].p_top), 0, 1e-9);
    for (const auto family : {&mbs::ZoneLaw::moment_y, &mbs::ZoneLaw::moment_z})
      EXPECT_NEAR(most((law_of(b).*family).positive), most((law_of(whole).*family).positive),
                  1e-6 * most((law_of(whole).*family).positive));
    EXPECT_NEAR(b.map.fall_direction.y / b.map.fall_direction.x, std::tan(37 * unit::deg), 1e-9);
    ASSERT_EQ(b.map.bodies.size(), whole.map.bodies.size());
    for (size_t i = 0; i < b.map.bodies.size(); ++i)
      EXPECT_EQ(b.map.bodies[i].shapes.size(), whole.map.bodies[i].shapes.size()) << b.map.bodies[i].name;
    double thrown = 0, all = 0;
    for (const DebrisEntry& d : b.map.debris) thrown += d.mass;
    for (const DebrisEntry& d : whole.map.debris) all += d.mass;
    EXPECT_NEAR(thrown, all, 1e-9 * all);
  }
}

TEST(ShaftPhysics, AMouthThatIsSplitIntoChargesFallsAsOne) {
  // until its lips meet, at 6.15 s: from then on contact amplifies last digits
  const auto lean = [](const std::vector<std::pair<double, double>>& split) {
    const Built b(tower(wide, one_stage + charges(split), "9 s"));
    return std::abs(fall(b.model, 6.1, 0.1).angle.back());
  };
  const double whole = lean(splits[0]);
  EXPECT_GT(whole, 0.3) << "it does not fall";
  for (size_t i : {1UL, 3UL}) EXPECT_NEAR(lean(splits[i]), whole, 1e-5 * whole) << i;
}

TEST(Shaft, EachMouthIsJudgedTowardsItsOwnSide) {
  const std::string low = charges({{0, 190}}, "2 m"), high = charges({{90, 220}}, "20 m");
  const Built b(tower(wide, one_stage + low + high, "1 s")), other(tower(wide, one_stage + high + low, "1 s"));
  ASSERT_GE(b.map.notes.size(), 2u);
  EXPECT_THAT(b.map.notes[0].text, testing::HasSubstr("MNm towards 0 deg"));
  EXPECT_THAT(b.map.notes[1].text, testing::HasSubstr("MNm towards 90 deg"));
  EXPECT_THAT(b.map.notes[1].text, testing::Not(testing::HasSubstr(" 0.00 MNm")));
  for (size_t i : {0UL, 1UL}) EXPECT_EQ(other.map.notes[i].text, b.map.notes[i].text);
  // each alone says the same
  EXPECT_EQ(Built(tower(wide, one_stage + low, "1 s")).map.notes[0].text, b.map.notes[0].text);
  EXPECT_EQ(Built(tower(wide, one_stage + high, "1 s")).map.notes[0].text, b.map.notes[1].text);
}

TEST(Shaft, ChargesThatFailOpenNoMouth) {
  const Built none(tower(wide, one_stage + charges({{0, 220}}, "2 m", "fails = true\n"), "1 s"));
  for (const ModelNote& note : none.map.notes)
    EXPECT_THAT(note.text, testing::Not(testing::StartsWith("The mouth of")));
  const Built half(
      tower(wide, one_stage + charges({{-55, 110}}) + charges({{55, 110}}, "2 m", "fails = true\n"), "1 s"));
  EXPECT_EQ(half.map.notes.front().text,
            Built(tower(wide, one_stage + charges({{-55, 110}}), "1 s")).map.notes.front().text);
}

TEST(Shaft, TheNoteOnItsMouthSaysWhatAReleaseAtOnceDoes) {
  // in runs it stands over 205 deg and turns over 210 deg
  const auto note = [](double opening) {
    return Built(tower("height = \"20 m\"\ndiameter = \"6 m\"\nthickness = \"30 cm\"\nas_outer = \"8 cm2/m\"\n"
                       "as_inner = \"8 cm2/m\"\n",
                       one_stage + charges({{0, opening}}), "1 s"))
        .map.notes.front()
        .text;
  };
  EXPECT_THAT(note(190), testing::HasSubstr("it does not turn over, nor does a rigid block that is let go at once"));
  EXPECT_THAT(note(225), testing::HasSubstr("does not turn over by its weight alone, but a rigid block"));
  EXPECT_THAT(note(245), testing::HasSubstr("at most: it turns over."));
}

TEST(ShaftPhysics, WhatOnlyLeansHasNotComeDown) {
  const record::Record r = run_plan(read(tower(slender + "as_outer = \"6 cm2/m\"\n", mouth("2 m", "220 deg"), "2.5 s")),
                                    default_knowledge(), {}, {});
  double farthest = 0;
  for (size_t b = 0; b < r.bodies.size(); ++b)
    farthest = std::max(farthest, norm(record::pose_at(r, r.time.size() - 1, b).p - record::pose_at(r, 0, b).p));
  EXPECT_GT(farthest, 0.6);
  for (const record::Finding& f : r.findings)
    if (f.id == "mechanism") {
      EXPECT_THAT(f.text, testing::Not(testing::HasSubstr("of the mass has come down"))) << farthest;
    }
}

TEST(ShaftPhysics, AShaftThatTurnsOverAMouthAtItsFootTopples) {
  std::string foot = mouth("2 m", "220 deg");
  foot.replace(foot.find("2.5 m"), 5, "1 m");
  const record::Record r =
      run_plan(read(tower(wide + "as_inner = \"6 cm2/m\"\n", foot, "8 s")), default_knowledge(), {}, {});
  for (const record::Finding& f : r.findings)
    if (f.id == "mechanism") { EXPECT_EQ(f.title, "Mechanism: topple") << f.text; }
}

TEST(ShaftPhysics, RingsWithoutBarsThatRollOnAreWarnedOf) {
  const auto stack = [](const std::string& duration) {
    return "[[shafts]]\nname = \"tower\"\nheight = \"20 m\"\ndiameter = \"2 m\"\ndiameter_top = \"1.6 m\"\n"
           "thickness = \"25 cm\"\nthickness_top = \"20 cm\"\ndensity = \"1800 kg/m3\"\nstrength = \"8 N/mm2\"\n"
           "modulus = \"5 GPa\"\n" +
           mouth("1 m", "220 deg") + analysis(duration);
  };
  const auto told = [&](const std::string& duration) {
    const record::Record r = run_plan(read(stack(duration)), default_knowledge(), {}, {});
    const auto f = std::find_if(r.findings.begin(), r.findings.end(),
                                [](const record::Finding& x) { return x.id == "debris.rings.tower"; });
    return f == r.findings.end() ? record::Finding{} : *f;
  };
  EXPECT_EQ(told("1 s").text, "");
  const record::Finding f = told("15 s");
  EXPECT_EQ(f.status, record::Status::Warning);
  EXPECT_THAT(f.text,
              testing::StartsWith("Rings of tower that lie farther from where it stood than it was high and wide ("
                                  "22.0 m): "));
  EXPECT_GE(f.value, 1);
}

}  // namespace
}  // namespace topple::collapse
