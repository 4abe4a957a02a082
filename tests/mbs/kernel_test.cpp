// The kernel against the law it stands for, and lanes against each other.

#include "mbs/kernel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "mbs/system.h"

namespace topple::mbs {
namespace {

/// Families like those of a reinforced concrete section: 9 forces by 33 rotations; moments times `strength`.
ZoneLaw make_law(double strength) {
  ZoneLaw law;
  for (MomentFamily* m : {&law.moment_y, &law.moment_z}) {
    for (int k = 0; k < 9; ++k) m->normal_force.push_back(-4e6 + 5.5e5 * k);
    for (int j = 0; j < 33; ++j) m->plastic_rotation.push_back(0.2 * j * j / (32.0 * 32.0));
    for (int k = 0; k < 9; ++k) {
      const double s = k / 8.0, base = strength * 4 * 3e5 * (0.05 + s * (1 - s)) * (m == &law.moment_y ? 1 : 0.7);
      for (const double phi : m->plastic_rotation) m->positive.push_back(base * std::exp(-4 * phi));
      for (const double phi : m->plastic_rotation) m->negative.push_back(1.1 * base * std::exp(-3 * phi));
      for (const double phi : m->plastic_rotation)
        m->elongation_positive.push_back((0.3 * s - 0.1) * std::sin(9 * phi));
      for (const double phi : m->plastic_rotation) m->elongation_negative.push_back((0.1 - 0.2 * s) * phi);
    }
  }
  law.damage_share = 0.4;
  law.compression = {{0, 0.002, 0.02, 0.1}, {3.5e6, 4e6, 0.4e6, 0.4e6}};
  law.tension = {{0, 0.05}, {0.3e6, 0.35e6}};
  law.crush_length = 0.3;
  law.rupture_elongation = 0.06;
  law.shear_y = law.shear_z = 1e6;
  law.shear_friction = 0.5;
  law.slip_softening = 0.02;
  law.slip_rupture = 0.1;
  law.torsion = 5e5;
  return law;
}

/// A body that is put where the test wants it, held to the ground by one element.
Model make_model(int stations, const ZoneLaw& law, bool cracks = false) {
  Model m;
  Body body;
  body.name = "end";
  body.fixed = true;
  add_body(m, body);
  add_law(m, law);
  ZoneElement e;
  e.name = "zone";
  e.a = kGround;
  e.b = {0};
  e.translational_stiffness = {4e8, 3e7, 3e7};
  e.rotational_stiffness = {5e7, 6e7, 6e7};
  e.damping_ratio = 0.05;
  if (stations == 1) e.stations = {{0, {0}}};
  if (stations == 2) e.stations = {{-1.5, {0}}, {1.5, {0}}};
  if (cracks) {
    e.cracking[0] = {{5e4, 4e4}, {2e5, 1.8e5}, 2e-8};
    e.cracking[1] = {{3e4, 6e4}, {1.5e5, 2e5}, 3e-8};
  }
  add_element(m, e);
  m.contact.ground = m.contact.bodies = false;
  return m;
}

/// A smooth path through six deformations with a seed of its own; `amplitude` in rad and 2 m, `pressed` by how much it
/// is shortened on the way, or if below zero, how far it is pressed and pulled in turn [m].
Six path_at(int i, double amplitude, std::uint32_t seed, double pressed = 0) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(0.3, 1.0);
  Six d;
  for (int c = 0; c < 6; ++c) {
    const double rate = 0.002 * share(random), phase = 6 * share(random), size = share(random) * amplitude;
    const double s = std::sin(rate * i + phase) - std::sin(phase);
    d.c[c] = size * s * (c < 3 ? 2 : 1);
  }
  d.c[0] = -2e-3 + 1.2e-3 * std::sin(0.0011 * i) - 2e-3 * std::sin(0.0004 * i);
  d.c[0] -= pressed > 0 ? pressed * i / 6000.0 * (1 + 0.01 * std::sin(0.05 * i))  // it is let go again now and then
                        : -pressed * std::sin(0.005 * i);
  return d;
}

struct Walked {
  Six resultant;
  double energy, plastic, damping, reached, strained, shortened;
  bool yielded;
};

Walked note(const ZoneState& z) {
  const StationState &a = z.station[0], &b = z.station[1];
  return {z.resultant,
          z.energy,
          z.plastic,
          z.damping,
          std::max(a.reached, b.reached),
          std::max(a.strained, b.strained),
          z.shortened,
          has_yielded(z)};
}

/// The path through the kernel (System), and from each of its states one step through the law alone, without bounds:
/// along some paths the law itself makes differences several times as large, step after step.
void walk(int stations, const ZoneLaw& zone, double amplitude, std::uint32_t seed, size_t width,
          std::vector<Walked>& kernel, std::vector<Walked>* law, double& share_of_full_law, double pressed = 0,
          bool cracks = false) {
  Options options;
  options.step = 1e-4;
  System s(make_model(stations, zone, cracks), options, width);
  s.start();
  ZoneState z = s.state.element[0];
  long outside = 0;
  constexpr int n = 6000;
  for (int i = 1; i <= n; ++i) {
    const Six d = path_at(i, amplitude, seed, pressed);
    s.state.p[0] = Vec3{d.c[0], d.c[1], d.c[2]};
    s.state.q[0] = exp_rotation({d.c[3], d.c[4], d.c[5]});
    s.state.R[0] = to_matrix(s.state.q[0]);
    s.state.time = 1e-4 * i;
    s.evaluate_elements();
    outside += static_cast<long>(s.lanes->outside.size());
    s.unpack_elements();
    const ZoneState& k = s.state.element[0];
    kernel.push_back(note(k));
    if (law != nullptr) {
      const Six deformation = s.measure_zone(s.elements[0]).deformation;
      advance_zone(s.elements[0].zone, s.laws, deformation, 1e-4 * i, 1e-4, z);
      law->push_back(note(z));
      EXPECT_EQ(k.live, z.live) << i;
      if (k.live != z.live || !z.live) break;
      z = k;
      z.safe_force[0] = 1, z.safe_force[1] = -1;
    }
  }
  share_of_full_law = static_cast<double>(outside) / n;
}

/// Walks through kernel and full law, which are to agree in each step. Returns what the latter gave.
std::vector<Walked> compare(int stations, ZoneLaw zone, double amplitude, std::uint32_t seed, double pressed,
                            double& full, bool cracks = false) {
  if (seed % 2 == 0) {  // a section that is not square, and turns further about its weak axis
    zone.rotation_ratio = 0.4;
    for (double& rotation : zone.moment_z.plastic_rotation) rotation /= 0.4;
  }
  std::vector<Walked> kernel, law;
  const auto check = [&] {
    walk(stations, zone, amplitude, seed, 0, kernel, &law, full, pressed, cracks);
    ASSERT_EQ(kernel.size(), law.size());
    double largest[6] = {0, 0, 0, 0, 0, 0};
    for (const Walked& w : law)
      for (int c = 0; c < 6; ++c) largest[c] = std::max(largest[c], std::abs(w.resultant.c[c]));
    for (size_t i = 0; i < law.size(); ++i) {
      // both do the same sums in another order; softening tables multiply the round-off
      for (int c = 0; c < 6; ++c)
        ASSERT_NEAR(kernel[i].resultant.c[c], law[i].resultant.c[c], 1e-10 * largest[c] + 1e-9)
            << "component " << c << " step " << i << " seed " << seed;
      const double energy = law[i].energy + law[i].plastic + law[i].damping;
      ASSERT_NEAR(kernel[i].energy, law[i].energy, 1e-10 * energy + 1e-9) << i;
      ASSERT_NEAR(kernel[i].plastic, law[i].plastic, 1e-10 * energy + 1e-9) << i << " seed " << seed;
      ASSERT_NEAR(kernel[i].damping, law[i].damping, 1e-10 * energy + 1e-9) << i;
      ASSERT_NEAR(kernel[i].strained, law[i].strained, 1e-12) << i;
      ASSERT_NEAR(kernel[i].reached, law[i].reached, 1e-12) << i;
      ASSERT_NEAR(kernel[i].shortened, law[i].shortened, 1e-12) << i << " seed " << seed;
      ASSERT_EQ(kernel[i].yielded, law[i].yielded) << i << " seed " << seed;
    }
  };
  check();
  return law;
}

class KernelLaw : public testing::TestWithParam<std::tuple<int, double, double>> {};

TEST_P(KernelLaw, FollowsTheFullLaw) {
  const auto [stations, amplitude, strength] = GetParam();
  for (std::uint32_t seed = 1; seed <= 6; ++seed) {
    double full = 0;
    const std::vector<Walked> law = compare(stations, make_law(strength), amplitude, seed, 0, full);
    if (amplitude > 1e-3) { EXPECT_GT(law.back().plastic, 0); }
    // the kernel does nearly all of it, cell after cell; the full law what flows in tension or breaks, and new bounds
    EXPECT_LT(full, 0.02) << "seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(Paths, KernelLaw,
                         testing::Combine(testing::Values(1, 2), testing::Values(1e-5, 1e-3, 5e-3, 2e-2),
                                          testing::Values(1.0)));
// a step turns by many times what the limits let the springs turn
INSTANTIATE_TEST_SUITE_P(FarBeyond, KernelLaw,
                         testing::Combine(testing::Values(1, 2), testing::Values(2e-2), testing::Values(1e-3)));

/// A step throws one station far beyond its limit and the other one a little, the other way: once the first has turned
/// the second is inside, and to turn both at once would bring work.
TEST(Kernel, TurnsStationsOneAfterTheOther) {
  const double limit = 3e5;
  Options options;
  options.step = 1e-4;
  System s(make_model(2, make_law(1)), options, 0);
  s.start();
  ZoneState z = s.state.element[0];
  const auto put = [&](double along_z, double about_y) {
    s.state.p[0] = {-2e-3, 0, along_z};
    s.state.q[0] = exp_rotation({0, about_y, 0});
    s.state.R[0] = to_matrix(s.state.q[0]);
    return s.measure_zone(s.elements[0]).deformation;
  };
  // moments of the stations, elastic, over the place and turn of the body: linear while they are small
  const ZoneParameters& p = s.elements[0].zone;
  const auto moments = [&](const Six& d) {
    const double bend = p.stiffness[4] * d.c[4], shear = p.stiffness[2] * d.c[2];
    return std::array{bend + p.x[0] * shear, bend + p.x[1] * shear};
  };
  constexpr double nudge = 1e-6;
  const auto by_place = moments(put(nudge, 0)), by_turn = moments(put(0, nudge));
  const double det = by_place[0] * by_turn[1] - by_place[1] * by_turn[0];
  const auto evaluate = [&](double m0, double m1, int step) {
    const Six d =
        put(nudge * (m0 * by_turn[1] - m1 * by_turn[0]) / det, nudge * (m1 * by_place[0] - m0 * by_place[1]) / det);
    s.state.time = 1e-4 * step;
    s.evaluate_elements();
    const bool is_asked = !s.lanes->outside.empty();
    s.unpack_elements();
    advance_zone(p, s.laws, d, 1e-4 * step, 1e-4, z);
    return is_asked;
  };
  for (int step = 1; step <= 3; ++step) (void)evaluate(0.95 * limit, -0.5 * limit, step);
  EXPECT_FALSE(evaluate(3 * limit, -1.13 * limit, 4)) << "the kernel can do it";
  const ZoneState& k = s.state.element[0];
  EXPECT_GT(z.station[0].reached, 0);
  EXPECT_EQ(z.station[1].reached, 0) << "the case is another one";
  EXPECT_EQ(k.station[1].reached, 0);
  EXPECT_NEAR(k.station[0].reached, z.station[0].reached, 1e-9 * z.station[0].reached);
  for (int c = 0; c < 6; ++c) EXPECT_NEAR(k.resultant.c[c], z.resultant.c[c], 1e-9 * limit) << c;
  EXPECT_NEAR(k.plastic, z.plastic, 1e-9 * z.plastic);
}

TEST(Kernel, SpringsWhoseCracksGrowStaySprings) {
  Options options;
  options.step = 1e-4;
  System s(make_model(2, make_law(1), true), options, 0);
  s.start();
  const auto push = [&](double along_z, int step) {
    s.state.p[0] = {-2e-3, 0, along_z};
    s.state.time = 1e-4 * step;
    s.evaluate_elements();
  };
  for (int step = 1; step <= 3; ++step) push(2e-4, step);
  int grown = 0;
  for (int step = 4; step <= 40; ++step) {
    s.unpack_elements();
    const double before = s.state.element[0].station[0].crack[0];
    push(5e-5 * step, step);
    const ZoneState& z = s.state.element[0];
    if (z.station[0].crack[0] == before) continue;
    ++grown;
    ASSERT_EQ(z.station[0].reached, 0) << "the case is another one";
    EXPECT_LE(z.safe_force[0], z.safe_force[1]) << step;
    EXPECT_EQ(s.lanes->field(s.slot_of(0), kernel::kFlows), 0) << step;
  }
  EXPECT_GT(grown, 10);
}

TEST(Kernel, FollowsTheFullLawWhileSectionsCrack) {
  int cracked = 0;
  for (const int stations : {1, 2})
    for (const double amplitude : {2e-4, 1e-3, 5e-3})
      for (std::uint32_t seed = 1; seed <= 6; ++seed) {
        double full = 0;
        const std::vector<Walked> law = compare(stations, make_law(1), amplitude, seed, 0, full, true);
        cracked += law.back().plastic > 1 ? 1 : 0;
        // cracks grow in it, a hundredth of the moment at a time, on each side of each axis by themselves
        EXPECT_LT(full, 0.15) << stations << " " << amplitude << " seed " << seed;
      }
  EXPECT_GT(cracked, 20);  // of 36; the smallest paths stay below
}

TEST(Kernel, FollowsTheFullLawWhileASectionIsCrushed) {
  for (const bool elongates : {true, false})
    for (const int stations : {1, 2})
      for (const double amplitude : {1e-5, 5e-3, 2e-2}) {
        ZoneLaw zone = make_law(1);
        if (elongates) {
          // at the edge of its families (8b) leaps with the last digit of a limit of nothing
          for (double& force : zone.compression.f) force *= 0.85;
        } else {
          for (MomentFamily* m : {&zone.moment_y, &zone.moment_z}) {
            for (std::vector<double>* limit : {&m->positive, &m->negative})
              std::fill_n(limit->begin(), m->plastic_rotation.size(), 0);
            m->elongation_positive.clear(), m->elongation_negative.clear();
          }
        }
        for (std::uint32_t seed = 1; seed <= 3; ++seed) {
          double full = 0;
          const std::vector<Walked> law = compare(stations, zone, amplitude, seed, 0.06, full);
          // past the peak of the curve at 2 mm and on the level behind its fall
          EXPECT_GT(law.back().shortened, 0.03) << stations << " " << amplitude << " " << seed;
          EXPECT_LT(full, 0.05) << stations << " " << amplitude << " " << seed;
        }
      }
}

// Six times as steep as the spring before its peak.
TEST(Kernel, FollowsTheFullLawUpASteepCurve) {
  for (const int stations : {1, 2})
    for (std::uint32_t seed = 1; seed <= 3; ++seed) {
      ZoneLaw zone = make_law(1);
      zone.compression = {{0, 0.0002, 0.02, 0.1}, {2.9e6, 3.4e6, 0.34e6, 0.34e6}};
      double full = 0;
      const std::vector<Walked> law = compare(stations, zone, 5e-3, seed, 0.06, full);
      EXPECT_GT(law.back().shortened, 0.03);
      const auto rising = std::count_if(law.begin(), law.end(),
                                        [](const Walked& w) { return w.shortened > 0 && w.shortened < 0.0002; });
      EXPECT_GT(rising, 5) << stations << " " << seed;
      EXPECT_LT(full, 0.05) << stations << " " << seed;
    }
}

TEST(Kernel, FollowsTheFullLawWhileBarsBuckleAndAreLetGo) {
  ZoneLaw zone = make_law(1);
  zone.buckles = true;
  zone.compression = {{0, 0.01, 0.1}, {0.5e6, 0.5e6, 0.1e6}};
  zone.damage_share = 0;
  for (MomentFamily* m : {&zone.moment_y, &zone.moment_z}) {
    for (double& force : m->normal_force) force *= 4;  // so far apart that bars buckle and pull within one cell
    m->elongation_positive.clear(), m->elongation_negative.clear();
  }
  int slack = 0, straightened = 0;
  for (const int stations : {1, 2})
    for (const double amplitude : {1e-5, 5e-3})
      for (std::uint32_t seed = 1; seed <= 3; ++seed) {
        double full = 0;
        const std::vector<Walked> law = compare(stations, zone, amplitude, seed, 0.06, full);
        for (const Walked& w : law) slack += w.shortened > 0 && w.resultant.c[0] > -1 ? 1 : 0;
        EXPECT_GT(law.back().shortened, 0.03) << stations << " " << amplitude << " " << seed;
        // what is slack stays in the lanes, as what buckles does
        EXPECT_LT(full, 0.02) << stations << " " << amplitude << " " << seed;
        // straight again on the way, pulled, and pressed anew
        for (const double swing : {-0.0005, -0.002, -0.008}) {
          const std::vector<Walked> swung = compare(stations, zone, amplitude, seed, swing, full);
          for (size_t i = 1; i < swung.size(); ++i)
            straightened += swung[i - 1].shortened > 0 && swung[i].shortened == 0 ? 1 : 0;
        }
      }
  EXPECT_GT(straightened, 0);
  EXPECT_GT(slack, 500);  // steps of 72,000
}

TEST(Kernel, BreaksZonesWhenTheFullLawDoes) {
  ZoneLaw zone = make_law(1);
  zone.rupture_rotation = 0.01, zone.rupture_rotation_pressed = 0.03;
  int pressed = 0, pulled_apart = 0, turned_apart = 0;
  for (const int stations : {1, 2})
    for (std::uint32_t seed = 1; seed <= 12; ++seed) {
      std::vector<Walked> kernel, law;
      double full = 0;
      walk(stations, zone, 2e-2, seed, 0, kernel, &law, full);
      ASSERT_EQ(kernel.size(), law.size());
      double largest = 0;
      for (const Walked& w : law) largest = std::max(largest, std::abs(w.resultant.c[0]));
      for (size_t i = 0; i < law.size(); ++i) {
        ASSERT_NEAR(kernel[i].resultant.c[0], law[i].resultant.c[0], 1e-8 * largest) << i << " seed " << seed;
        ASSERT_NEAR(kernel[i].reached, law[i].reached, 1e-9) << i;
        if (law[i].reached > 0.01 && law[i].resultant.c[0] < 0) ++pressed;
      }
      if (law.size() == 6000) continue;
      (law.back().reached < 0.03 ? pulled_apart : turned_apart) += 1;
    }
  // each of the three was seen
  EXPECT_GT(pressed, 1000);
  EXPECT_GT(pulled_apart, 0);
  EXPECT_GT(turned_apart, 0);
}

TEST(Kernel, GivesTheSameBitsWhateverTheWidth) {
  for (const int stations : {0, 1, 2}) {
    std::vector<Walked> wide, single;
    double share = 0;
    walk(stations, make_law(1), 5e-3, 3, 0, wide, nullptr, share);
    walk(stations, make_law(1), 5e-3, 3, 1, single, nullptr, share);
    ASSERT_EQ(wide.size(), single.size());
    for (size_t i = 0; i < wide.size(); ++i) {
      for (int c = 0; c < 6; ++c) ASSERT_EQ(wide[i].resultant.c[c], single[i].resultant.c[c]) << i;
      ASSERT_EQ(wide[i].plastic, single[i].plastic);
    }
  }
}

TEST(Kernel, ZonesThatFlowAreLaidSideBySideAndKeepTheirBits) {
  // every third of 48 zones is strong enough to stay elastic, every second has two stations
  constexpr int zones = 48, n = 1200;
  Model m = make_model(1, make_law(1));
  add_law(m, make_law(30));
  for (int i = 1; i < zones; ++i) {
    Body body = m.bodies[0];
    body.name += std::to_string(i);
    add_body(m, body);
    ZoneElement e = m.elements[0];
    e.name += std::to_string(i);
    e.b = {i};
    const LawId law{i % 3 == 0 ? 0 : 1};
    if (i % 2 == 1) e.stations = {{-1.5, law}, {1.5, law}};
    for (Station& s : e.stations) s.law = law;
    add_element(m, e);
  }
  Options options;
  options.step = 1e-4;
  System laid(m, options), left(m, options), singly(m, options, 1);
  const size_t W = laid.lanes->W;
  int scattered = 0, flowed = 0;
  for (System* s : {&laid, &left, &singly}) s->start();
  for (int i = 1; i <= n; ++i) {
    for (System* s : {&laid, &left, &singly}) {
      for (int b = 0; b < zones; ++b) {
        const Six d = path_at(i, 5e-3, static_cast<std::uint32_t>(b + 1));
        const size_t at = static_cast<size_t>(b);
        s->state.p[at] = Vec3{d.c[0], d.c[1], d.c[2]};
        s->state.q[at] = exp_rotation({d.c[3], d.c[4], d.c[5]});
        s->state.R[at] = to_matrix(s->state.q[at]);
      }
      s->state.time = 1e-4 * i;
      s->state.step_index = s == &left ? 1 : i;  // that one never looks
      s->evaluate_elements();
    }
    const auto flows = [&](const System& s, size_t e) { return s.lanes->field(s.slot_of(e), kernel::kFlows) > 0; };
    for (size_t e = 0; e < zones; ++e) {
      for (size_t f = 0; f < static_cast<size_t>(kernel::kForceFields); ++f) {
        const double force = laid.lanes->force_field(laid.slot_of(e), f);
        ASSERT_EQ(force, left.lanes->force_field(left.slot_of(e), f)) << e << " at " << i;
        ASSERT_EQ(force, singly.lanes->force_field(singly.slot_of(e), f)) << e << " at " << i;
      }
      flowed += flows(laid, e) ? 1 : 0;
    }
    scattered += left.is_work_scattered() ? 1 : 0;
    if (i % 64 == 0 && W > 1) { EXPECT_FALSE(laid.is_work_scattered()) << i; }
  }
  EXPECT_GT(flowed, 5 * n);
  if (W == 8) { EXPECT_GT(scattered, n / 4); }
}

/// A zone at a body that keeps to y = const, x along x of W and bending about its y, or upright and bending about its
/// z.
Model make_planar_model(int stations, bool is_upright) {
  Model m = make_model(stations, make_law(1));
  const Mat3 up = Mat3::from_columns({0, 0, 1}, {1, 0, 0}, {0, 1, 0});
  ZoneElement& e = m.elements[0];
  if (is_upright) e.X_AF.q = e.X_BM.q = to_quat(up);
  // markers off the centres, and askew in the plane
  e.X_AF.p = {0.3, 2, -0.2}, e.X_BM.p = {0.1, 2, 0.4};
  e.X_BM.q = exp_rotation({0, 0.02, 0}) * e.X_BM.q;
  const Quat turned = exp_rotation({0, -0.02, 0});
  m.bodies[0].X_WB = {e.X_AF.p - to_matrix(turned) * e.X_BM.p, turned};
  return m;
}

class KernelPlane : public testing::TestWithParam<std::tuple<bool, int, double, bool>> {};

TEST_P(KernelPlane, GivesTheForcesOfSpace) {
  const auto [is_upright, stations, amplitude, by_full_law] = GetParam();
  double most_plastic = 0;
  int compared = 0;
  // of paths some millimetres long; a member's chord of 3 m has the round-off of its length
  const double nudged = stations == 2 ? 1e-13 : 1e-14;
  for (std::uint32_t seed = 1; seed <= 6; ++seed) {
    Model m = make_planar_model(stations, is_upright);
    Options options;
    options.step = 1e-4;
    options.full_law = by_full_law;
    // in space, on paths that differ in their last digits to both sides, and in the plane
    System space(m, options), more(m, options), less(m, options);
    m.is_planar = true;
    System plane(m, options);
    ASSERT_NE(plane.elements[0].zone.plane, kernel::Plane::Space);
    ASSERT_EQ(space.elements[0].zone.plane, kernel::Plane::Space);
    const Pose at = m.bodies[0].X_WB;
    double most[2] = {0, 0}, apart[2] = {0, 0};  // of forces, torques
    for (System* s : {&space, &more, &less, &plane}) s->start();
    for (int i = 1; i <= 6000; ++i) {
      const Six d = path_at(i, amplitude, seed);
      for (System* s : {&space, &more, &less, &plane}) {
        const double nudge = s == &more ? 1 + nudged : s == &less ? 1 - nudged : 1;
        s->state.p[0] = at.p + nudge * Vec3{is_upright ? d.c[1] : d.c[0], 0, is_upright ? d.c[0] : d.c[2]};
        s->state.q[0] = exp_rotation({0, nudge * d.c[4], 0}) * at.q;
        s->state.R[0] = to_matrix(s->state.q[0]);
        s->state.time = 1e-4 * i;
        s->evaluate_elements();
        s->unpack_elements();
      }
      const ZoneState &a = space.state.element[0], &b = plane.state.element[0];
      ASSERT_EQ(a.live, b.live) << i << " seed " << seed;
      if (!a.live) break;
      const Vec3 f = space.force[0], g = plane.force[0];
      const double t = Vec3(space.torque[0]).y, u = Vec3(plane.torque[0]).y;
      most[0] = std::max(most[0], norm(f)), most[1] = std::max(most[1], std::abs(t));
      for (System* s : {&more, &less}) {
        apart[0] = std::max(apart[0], norm(f - s->force[0]));
        apart[1] = std::max(apart[1], std::abs(t - Vec3(s->torque[0]).y));
      }
      // the same sums in another order, some forty of them; softening tables multiply the round-off
      ASSERT_LE(std::hypot(f.x - g.x, f.z - g.z), 1e-12 * most[0] + 20 * apart[0]) << i << " seed " << seed;
      ASSERT_LE(std::abs(t - u), 1e-12 * most[1] + 20 * apart[1]) << i << " seed " << seed;
      // a zone that snaps tells last digits apart from here on
      if (apart[0] > 1e-7 * most[0]) break;
      ASSERT_NEAR(a.energy + a.plastic + a.damping, b.energy + b.plastic + b.damping,
                  1e-8 * (a.energy + a.plastic) + 1e-9)
          << i << " seed " << seed;
      ++compared;
    }
    most_plastic = std::max(most_plastic, space.state.element[0].plastic);
  }
  if (amplitude > 1e-3 && stations > 0) { EXPECT_GT(most_plastic, 100); }
  EXPECT_GT(compared, 15000);
}

INSTANTIATE_TEST_SUITE_P(Paths, KernelPlane,
                         testing::Combine(testing::Bool(), testing::Values(0, 1, 2), testing::Values(1e-5, 5e-3, 2e-2),
                                          testing::Bool()));

TEST(Kernel, LeavesElementsAcrossThePlaneInSpace) {
  Model m = make_planar_model(1, false);
  m.is_planar = true;
  m.elements[0].X_AF.q = m.elements[0].X_BM.q = to_quat(Mat3::from_columns({0, 1, 0}, {-1, 0, 0}, {0, 0, 1}));
  EXPECT_EQ(System(m, {}).elements[0].zone.plane, kernel::Plane::Space);
  m = make_planar_model(1, false);
  m.is_planar = true;
  m.elements[0].X_AF.p.y += 1e-3;
  EXPECT_EQ(System(m, {}).elements[0].zone.plane, kernel::Plane::Space) << "its markers are not beside each other";
}

}  // namespace
}  // namespace topple::mbs
