// What a run in finite elements shows of them: places and masses of bodies.
#include "farfield/motion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>

#include "farfield/run.h"
#include "plans.h"

namespace topple::farfield {
namespace {

const collapse::Knowledge& rules() { return collapse::default_knowledge(); }

const std::vector<double>& series(const record::Record& r, const std::string& id) {
  for (const record::Series& s : r.series)
    if (s.id == id) return s.value;
  ADD_FAILURE() << "no series " << id;
  return r.series.front().value;
}

FeOptions sized(double size) {
  FeOptions o;
  o.grid.size = size;
  return o;
}

/// Four columns under a floor with beams all around, symmetrical to x = 2 m and y = 2 m, and charges in some of them.
std::string table(const std::string& members) {
  return collapse::materials() + grid("A = \"0 m\", B = \"4 m\"", "1 = \"0 m\", 2 = \"4 m\"", 1, "4 kN/m2") +
         "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\n[[slabs]]\npanel = \"floor\"\n" +
         charge(members, "50 ms", "scatter = \"0 ms\"") + analysis("550 ms");
}

/// Of what no charge takes and no stump holds [kg].
double calc_moving_mass(const product::Plan& plan, const GridOptions& grid) {
  collapse::ModelMap map;
  const mbs::Model model = collapse::make_model(plan, rules(), map);
  const Whole whole = make_whole(plan, rules(), grid, model, map);
  std::set<int> charged;
  for (const ChargeElements& c : whole.charges) charged.insert(c.elements.begin(), c.elements.end());
  double mass = 0;
  for (size_t e = 0; e < whole.fe.elements.size(); ++e) {
    if (charged.count(static_cast<int>(e)) != 0) continue;
    const fem::ExplicitElement& element = whole.fe.elements[e];
    std::array<Vec3, 8> corners;
    for (size_t i = 0; i < 8; ++i) corners[i] = whole.fe.nodes[static_cast<size_t>(element.node[i])];
    const double whole_mass = fem::calc_hex_volume(corners) *
                              whole.fe.materials[static_cast<size_t>(element.material)].density * element.mass_factor;
    const std::vector<int>& bodies = whole.bodies[e];
    const auto moving =
        std::count_if(bodies.begin(), bodies.end(), [&](int b) { return !model.bodies[static_cast<size_t>(b)].fixed; });
    mass += whole_mass * static_cast<double>(moving) / static_cast<double>(bodies.size());
  }
  return mass;
}

TEST(FarfieldMotion, LowersTheMassCentreByWhatItsPotentialLoses) {
  for (const std::string members : {"C-A*", "C-*1-0"})
    for (const double size : {0.5, 0.6, 0.8}) {  // 8, 7 and 5 cells along beams and floor
      const product::Plan plan = read(table(members));
      const record::Record r = run_plan(plan, rules(), {}, sized(size), {}, {});
      const double weight = 9.81 * calc_moving_mass(plan, sized(size).grid);
      const std::vector<double>& height = series(r, "mass_centre_height");
      const std::vector<double>& gravity = series(r, "energy_gravity");
      const size_t first = 4;  // once the charges have taken what they take
      ASSERT_GT(r.time[first], 0.06);
      ASSERT_GT(height[first] - height.back(), 0.4);
      // what is left on the ground sinks or rises by less than a tenth of a millimetre
      for (size_t i = first; i < height.size(); ++i)
        EXPECT_NEAR(height[first] - height[i], (gravity[first] - gravity[i]) / weight, 1e-4)
            << members << ", cells of " << size << " m, " << r.time[i] << " s";
    }
}

TEST(FarfieldMotion, MirrorsWhatIsMirrored) {
  const auto run = [](const std::string& members, double size) {
    return run_plan(read(table(members)), rules(), {}, sized(size), {}, {});
  };
  for (const auto& [one, other] : {std::pair("C-A*", "C-B*"), std::pair("C-*1-0", "C-*2-0")})
    for (const double size : {0.5, 0.6, 0.8}) {
      const record::Record a = run(one, size), b = run(other, size);
      ASSERT_EQ(a.time, b.time);
      for (const char* id : {"mass_centre_height", "tilt_angle"})
        for (size_t i = 0; i < a.time.size(); ++i)
          // round-off, which grows as elements yield; nothing has been crushed
          EXPECT_NEAR(series(a, id)[i], series(b, id)[i], 1e-6)
              << id << ' ' << one << ", cells of " << size << " m, " << a.time[i] << " s";
    }
}

}  // namespace
}  // namespace topple::farfield
