#include "farfield/mixture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "fem/explicit_system.h"
#include "fem/mesh.h"
#include "nearfield/fibres.h"
#include "plans.h"

namespace topple::farfield {
namespace {

nearfield::ZoneInput make_zone(const product::Plan& plan, double length) {
  nearfield::ZoneInput in;
  in.section = plan.sections.front();
  in.concrete = plan.concretes.front();
  in.steel = plan.steels.front();
  in.length = length;
  return in;
}

/// Yield stress of a law at a plastic strain.
double find_stress(const fem::ExplicitMaterial& m, double strain, double fem::YieldPoint::*which) {
  for (size_t i = 1; i < m.yield.size(); ++i) {
    const fem::YieldPoint &a = m.yield[i - 1], &b = m.yield[i];
    if (strain <= b.strain) return a.*which + (b.*which - a.*which) * (strain - a.strain) / (b.strain - a.strain);
  }
  return m.yield.back().*which;
}

/// Work of a law up to a plastic strain [J/m³].
double calc_work(const fem::ExplicitMaterial& m, double to, double fem::YieldPoint::*which) {
  double work = 0;
  constexpr int n = 4000;
  for (int i = 0; i < n; ++i) work += find_stress(m, to * (i + 0.5) / n, which) * to / n;
  return work;
}

TEST(Mixture, PullsWithTheBarsAndPushesWithBoth) {
  const product::Plan plan = read(portal());
  const nearfield::ZoneInput in = make_zone(plan, 0.4);
  const fem::ExplicitMaterial m = make_section_material(in, 0.4, "column");
  const double area = in.section.area(), steel = in.section.steel_area(), fy = in.steel.fy;
  ASSERT_GE(m.yield.size(), 4u);
  // it begins to flow where it cracks; bars stretch with it
  EXPECT_NEAR(m.yield.front().tension, in.concrete.fct, 0.1 * in.concrete.fct);
  // the bars at their yield stress, and what an open crack still passes on, below a quarter of fct
  const double yields = find_stress(m, fy / in.steel.Es, &fem::YieldPoint::tension);
  EXPECT_GE(yields, steel * fy / area * (1 - 1e-9));
  EXPECT_LE(yields, steel * fy / area + 0.25 * in.concrete.fct);
  // the fibres' own peak, read every 0.1 per mille of strain
  const auto fibres = nearfield::make_fibres(in, nearfield::Axis::Y);
  EXPECT_NEAR(m.yield.front().compression, nearfield::find_crushing(fibres).force / area,
              0.002 * m.yield.front().compression);
  EXPECT_NEAR(m.E, in.concrete.Ec + steel / area * (in.steel.Es - in.concrete.Ec), 1);
}

TEST(Mixture, IsAsStiffInTensionAsItsCrackedSection) {
  // at half the strain at which its bars yield; chords of few points stand in for the curve
  const nearfield::ZoneInput in = make_zone(read(portal()), 0.4);
  const fem::ExplicitMaterial m = make_section_material(in, 0.2, "column");
  const auto fibres = nearfield::make_fibres(in, nearfield::Axis::Y);
  const double strain = 0.5 * in.steel.fy / in.steel.Es;
  double plastic = strain;  // where elastic and plastic strain make up the whole
  for (int i = 0; i < 200; ++i) plastic = strain - find_stress(m, plastic, &fem::YieldPoint::tension) / m.E;
  const double wanted = nearfield::calc_resultants(fibres, strain, 0).N / in.section.area();
  EXPECT_NEAR(find_stress(m, plastic, &fem::YieldPoint::tension), wanted, 0.1 * wanted);
}

TEST(Mixture, TakesTheZonesWorkWhateverTheElementsLength) {
  const nearfield::ZoneInput in = make_zone(read(portal()), 0.35);
  const auto fibres = nearfield::make_fibres(in, nearfield::Axis::Y);
  // shortening by 1 cm beyond the peak
  const double E = make_section_material(in, in.length, "").E, to = 0.01 / in.length, area = in.section.area();
  const nearfield::Peak peak = nearfield::find_crushing(fibres);
  double work = 0, before = 0, last = peak.force / area;
  for (double e = peak.strain; before < to; e += 1e-6) {
    const double s = -nearfield::calc_resultants(fibres, -e, 0).N / area;
    const double plastic = e - peak.strain + (peak.force / area - s) / E;
    work += 0.5 * (s + last) * (plastic - before) * in.length;
    before = plastic, last = s;
  }
  for (const double length : {0.1, 0.2, 0.35, 0.6}) {
    const fem::ExplicitMaterial m = make_section_material(in, length, "column");
    // few chords in place of the curve: 3 %
    EXPECT_NEAR(length * calc_work(m, 0.01 / length, &fem::YieldPoint::compression), work, 0.03 * work) << length;
    // the strain up to yield, which spreads over the element, is a fiftieth of the one of rupture
    EXPECT_NEAR(m.tension_limit * length, in.steel.eps_u * in.length, 0.02 * in.steel.eps_u * in.length) << length;
  }
}

TEST(Mixture, LosesItsConcreteAndKeepsSomeOfItsBars) {
  const nearfield::ZoneInput in = make_zone(read(portal()), 0.4);
  const fem::ExplicitMaterial m = make_section_material(in, 0.4, "column");
  for (size_t i = 1; i < m.yield.size(); ++i) {
    EXPECT_GT(m.yield[i].strain, m.yield[i - 1].strain);
    EXPECT_LE(m.yield[i].compression, m.yield[i - 1].compression * (1 + 1e-12));
  }
  EXPECT_LT(m.yield.back().compression, 0.3 * m.yield.front().compression);
  EXPECT_GT(m.yield.back().compression, 0);
  EXPECT_GT(m.compression_limit, in.concrete.eps_c1);
  // bars buckle between their ties, also where the zone is shorter than these are apart
  nearfield::ZoneInput stub = in;
  stub.length = 0.25 * in.section.tie_spacing;
  EXPECT_GT(make_section_material(stub, stub.length, "stub").compression_limit, 0.9 * m.compression_limit);
}

struct Strained {
  double strain, stress;
};
/// A layer of 2 x 2 cubes of 20 cm whose ends are drawn apart or pressed at a strain of 0.5 1/s. Their nodes may or may
/// not move sideways; the driven ones are too heavy to.
class Layer {
 public:
  Layer(const fem::ExplicitMaterial& material, bool held) {
    const std::vector<double> across{-0.2, 0, 0.2};
    const fem::Mesh grid = fem::make_grid(across, across, std::vector<double>{0, 0.2});
    fem::ExplicitModel model;
    model.nodes = grid.nodes;
    model.gravity = {};
    model.materials.push_back(material);
    for (const fem::Hex& hex : grid.hexes) {
      fem::ExplicitElement e;
      for (size_t i = 0; i < 8; ++i) e.node[i] = hex.node[i];
      model.elements.push_back(e);
    }
    speed_.assign(model.nodes.size(), {});
    model.extra_mass.assign(model.nodes.size(), 0);
    for (size_t n = 0; n < model.nodes.size(); ++n) {
      const Vec3& p = model.nodes[n];
      const bool is_top = p.z > 0.1;
      model.supports.push_back({static_cast<int>(n), held || p.x == 0, held || p.y == 0, !is_top});
      if (is_top) speed_[n] = {0, 0, 0.1}, model.extra_mass[n] = 1e7;  // keeps its speed
    }
    system_ = std::make_unique<fem::ExplicitSystem>(model, fem::ExplicitOptions{});
  }
  ~Layer() {
    // what is dissipated beyond the cutoffs, and comes back as cracks close, is in the balance
    const fem::ExplicitEnergy energy = system_->calc_energy();
    EXPECT_NEAR(energy.residual(), 0, 0.01 * (energy.elastic + energy.plastic));
  }
  Layer(const Layer&) = delete;
  Layer& operator=(const Layer&) = delete;

  /// Each 0.05 mm/m on the way; positive: pulled.
  std::vector<Strained> go(double to) {
    const int direction = to > strain_ ? 1 : -1;
    std::vector<Vec3> speed = speed_;
    for (Vec3& v : speed) v = direction * v;
    system_->set_velocities(speed);
    std::vector<Strained> out;
    for (int steps = static_cast<int>(std::lround(std::abs(to - strain_) / 5e-5)); steps > 0; --steps) {
      time_ += 1e-4, strain_ += direction * 5e-5;
      EXPECT_EQ(system_->advance(time_), fem::ExplicitEnding::ReachedTime);
      out.push_back({strain_, system_->stress(0)[2]});
    }
    return out;
  }

 private:
  std::vector<Vec3> speed_;
  std::unique_ptr<fem::ExplicitSystem> system_;
  double time_ = 0, strain_ = 0;
};

// The law is that of one stress along the member, also where it has hardened or softened, and where the sides are held.
TEST(MixturePhysics, FollowsItsLawAlongAMember) {
  fem::ExplicitMaterial m = make_section_material(make_zone(read(portal()), 0.4), 0.2, "column");
  m.tension_limit = m.compression_limit = 1e9;
  for (const bool held : {false, true})
    for (const int direction : {1, -1}) {
      const auto member = direction > 0 ? &fem::YieldPoint::tension : &fem::YieldPoint::compression;
      // held sideways it needs more strain to get to its peak
      const double from = direction > 0 ? 1.2e-4 : 1.5e-3;
      for (const Strained& s : Layer(m, held).go(0.025 * direction)) {
        const double strain = direction * s.strain, stress = direction * s.stress;
        if (strain < from) continue;
        const double wanted = find_stress(m, strain - stress / m.E, member);
        EXPECT_NEAR(stress, wanted, 0.06 * wanted) << "held " << held << ", strain " << s.strain;
      }
    }
}

TEST(MixturePhysics, BearsWithoutLimitWhereItIsHeldSidewaysAndMayPressAndPullAsItLikes) {
  fem::ExplicitMaterial m = make_section_material(make_zone(read(portal()), 0.4), 0.2, "column");
  const double tension = Layer(m, true).go(0.02).back().stress;
  const double compression = Layer(m, true).go(-0.005).back().stress;
  m.tension_cutoff = m.compression_cutoff = std::numeric_limits<double>::infinity();
  EXPECT_GT(Layer(m, true).go(0.02).back().stress, 5 * tension);
  EXPECT_LT(Layer(m, true).go(-0.005).back().stress, 5 * compression);
}

// Until the bars yield a crack closes on the line to the origin, then the member is as stiff as a new one, and it opens
// again on the same line.
TEST(MixturePhysics, CracksCloseUntilTheBarsYield) {
  const fem::ExplicitMaterial m = make_section_material(make_zone(read(portal()), 0.4), 0.2, "column");
  for (const bool held : {false, true}) {
    Layer layer(m, held);
    const Strained tip = layer.go(0.8e-3).back();
    const auto expect_on_the_line = [&](const std::vector<Strained>& way) {
      for (const Strained& s : way)
        if (s.strain > 2e-5) {
          EXPECT_NEAR(s.stress, tip.stress / tip.strain * s.strain, 0.12 * tip.stress) << held << ", " << s.strain;
        }
    };
    const std::vector<Strained> pressed = layer.go(-0.4e-3);
    expect_on_the_line(pressed);
    const double stiffness = (pressed.back().stress - pressed[pressed.size() - 5].stress) / -0.2e-3;
    EXPECT_NEAR(stiffness, m.E, (held ? 0.15 : 0.06) * m.E) << held;
    EXPECT_NEAR(pressed.back().stress, -0.4e-3 * m.E, 0.2 * 0.4e-3 * m.E) << held;
    expect_on_the_line(layer.go(0.8e-3));
    // bars that have yielded hold it open
    const double yielded = layer.go(6e-3).back().stress;
    EXPECT_NEAR(layer.go(5.8e-3).back().stress, yielded - 0.2e-3 * m.E, 0.2 * 0.2e-3 * m.E) << held;
  }
}

TEST(Mixture, OfAPanelHoldsItsBarsOverTheThickness) {
  const product::Plan plan = read(house());
  const product::Panel& floor = plan.panels.front();
  const double bars = (floor.as_top + floor.as_bottom) / floor.thickness * plan.steels.front().fy;
  const fem::ExplicitMaterial m = make_panel_material(plan, floor, floor.thickness, 0.4);
  const double yields = find_stress(m, 0.1 * m.tension_limit, &fem::YieldPoint::tension);
  EXPECT_GE(yields, bars * (1 - 1e-9));
  EXPECT_LE(yields, bars * 1.1 + 0.25 * plan.concretes.front().fct);
  EXPECT_GT(m.yield.front().compression, plan.concretes.front().fc);
  EXPECT_NEAR(m.tension_limit * 0.4, plan.steels.front().eps_u * floor.thickness, 5e-3 * floor.thickness);
}

TEST(Mixture, OfAPanelIsNotCrushedEarlierForStrongerBars) {
  product::Plan plan = read(house());
  product::Panel wall = plan.panels.front();
  wall.as_top = wall.as_bottom = 20e-4;
  plan.steels.front().eps_u = 0.025;
  double limit[2], end[2];
  for (const int i : {0, 1}) {
    plan.steels.front().fu = (i == 0 ? 1.002 : 1.1) * plan.steels.front().fy;
    const fem::ExplicitMaterial m = make_panel_material(plan, wall, wall.thickness, 0.4);
    limit[i] = m.compression_limit;
    end[i] = find_stress(m, m.compression_limit, &fem::YieldPoint::compression);
    // no bar bears more than its strength
    EXPECT_LT(end[i], 2 * 20e-4 / wall.thickness * plan.steels.front().fu + 0.1 * plan.concretes.front().fc);
  }
  EXPECT_GT(limit[1], 0.8 * limit[0]);
}

TEST(Mixture, OfPlainConcreteCracksAndCrushesWithItsEnergies) {
  product::Plan plan = read(house());
  product::Panel bare = plan.panels.front();
  bare.as_top = bare.as_bottom = 0;
  const product::Concrete& c = plan.concretes.front();
  for (const double length : {0.1, 0.3}) {
    const fem::ExplicitMaterial m = make_panel_material(plan, bare, bare.thickness, length);
    EXPECT_EQ(m.yield.front().tension, c.fct);
    // two lines with the areas 0.53 + 0.47 of Gf, and a hundredth of the strength that is kept to the end
    const double kept = 0.011 * c.fct * m.tension_limit * length;
    EXPECT_NEAR(length * calc_work(m, m.tension_limit, &fem::YieldPoint::tension), c.Gf, 0.1 * c.Gf + kept) << length;
    EXPECT_NEAR(length * calc_work(m, 2 * c.Gcl / c.fc / length, &fem::YieldPoint::compression), c.Gcl, 0.03 * c.Gcl)
        << length;
  }
}

TEST(Mixture, OfMasonryPullsAsItsJointsDo) {
  const product::Plan plan = read(portal());
  product::Panel brick;
  brick.name = "brick";
  brick.thickness = 0.24;
  brick.density = 1800;
  brick.strength = 5e6;
  brick.modulus = 3e9;
  const fem::ExplicitMaterial m = make_panel_material(plan, brick, 0.24, 0.4);
  EXPECT_EQ(m.E, 3e9);
  EXPECT_EQ(m.yield.front().tension, 0.1e6);
  EXPECT_EQ(m.yield.front().compression, 5e6);
}

}  // namespace
}  // namespace topple::farfield
