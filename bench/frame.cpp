#include "frame.h"

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "collapse/knowledge.h"

namespace topple::bench {

namespace {

using namespace mbs;

constexpr double kBay = 5, kDepth = 6, kStorey = 3.4, kGap = 0.8;  // [m]
constexpr int kStoreys = 5;
constexpr double kMass = 1.9e6 / 8;  // of a bay [kg]

/// Axes of a connection: x along the given unit vector, the other two along W's axes.
Quat along(const Vec3& x) {
  const Vec3 z = std::abs(x.z) > 0.5 ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
  return to_quat(Mat3::from_columns(x, cross(z, x), z));
}

/// Elastic to its limits, gone beyond any of them: what flows in one step is more than the lengths of rupture.
ZoneLaw make_brittle(const std::string& name, double compression, double tension, double shear, double moment,
                     double torsion) {
  constexpr double at_once = 1e-12;
  ZoneLaw law;
  law.name = name;
  for (MomentFamily* m : {&law.moment_y, &law.moment_z}) {
    m->normal_force = {-1e12, 1e12};
    m->plastic_rotation = {0, 1};
    m->positive = m->negative = {moment, moment, moment, moment};
  }
  law.biaxial_exponent = 2;
  law.rupture_rotation = at_once;
  law.compression = {{0, 1}, {compression, compression}};
  law.tension = {{0, 1}, {tension, tension}};
  law.crush_length = law.rupture_elongation = at_once;
  law.shear_y = law.shear_z = shear;
  law.slip_rupture = at_once;
  law.torsion = torsion;
  law.twist_rupture = at_once;
  return law;
}

BodyId add_box(Model& m, const std::string& name, const Vec3& half, const Vec3& centre) {
  Body b;
  b.name = name;
  b.mass = 8 * half.x * half.y * half.z;  // volume; scaled to kMass at the end
  b.X_WB.p = centre;
  Shape s;
  s.half = half;
  b.shapes.push_back(s);
  return add_body(m, b);
}

void connect(Model& m, BodyId a, BodyId b, const Vec3& at, const Vec3& axis, double k_axial, double k_shear,
             double k_turn, LawId law) {
  const auto centre = [&](BodyId id) {
    return id == kGround ? Vec3{} : m.bodies[static_cast<size_t>(id.index)].X_WB.p;
  };
  ZoneElement e;
  e.name = "k" + std::to_string(m.elements.size());
  e.a = a;
  e.b = b;
  const Quat q = along(axis);
  e.X_AF = {at - centre(a), q};
  e.X_BM = {at - centre(b), q};
  e.translational_stiffness = {k_axial, k_shear, k_shear};
  e.rotational_stiffness = {k_turn, k_turn, k_turn};
  e.stations = {{0, law}};
  add_element(m, e);
}

}  // namespace

Model make_frame(int bays) {
  Model m;
  m.name = "frame255";
  m.contact.contact_frequency = collapse::default_knowledge().contact_frequency;
  const LawId column_law = add_law(m, make_brittle("column", 9e6, 1.5e6, 1.2e6, 0.7e6, 0.5e6));
  const LawId beam_law = add_law(m, make_brittle("beam", 4e6, 1.0e6, 0.8e6, 0.6e6, 0.3e6));
  const LawId slab_law = add_law(m, make_brittle("slab", 4e6, 0.8e6, 0.5e6, 0.15e6, 0.15e6));
  const Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  using Row = std::vector<std::array<BodyId, 2>>;
  const size_t ends = static_cast<size_t>(bays) + 1;
  Row below(ends);
  for (auto& pair : below) pair[0] = pair[1] = kGround;
  Event cut;
  cut.name = "front row";
  cut.time = 1e-3;
  for (int s = 0; s < kStoreys; ++s) {
    const double floor = s * kStorey, foot = s == 0 ? kGap : floor, head = floor + kStorey;
    const std::string tag = std::to_string(s) + "-";
    Row column(ends);
    for (int i = 0; i <= bays; ++i)
      for (int k = 0; k < 2; ++k) {
        column[i][k] = add_box(m, "C" + tag + std::to_string(i) + std::to_string(k), {0.25, 0.25, (head - foot) / 2},
                               {i * kBay, k * kDepth, (head + foot) / 2});
        connect(m, below[i][k], column[i][k], {i * kBay, k * kDepth, foot}, z, 2e9, 4e8, 1.5e8, column_law);
        if (s == 0 && k == 0) {
          Action a;
          a.kind = Action::Kind::RemoveElement;
          a.element = {static_cast<int>(m.elements.size()) - 1};
          cut.actions.push_back(a);
        }
      }
    const double level = head - 0.3;
    Row long_beam(ends);
    std::vector<BodyId> cross_beam(ends);
    for (int i = 0; i < bays; ++i)
      for (int k = 0; k < 2; ++k) {
        long_beam[i][k] = add_box(m, "L" + tag + std::to_string(i) + std::to_string(k), {kBay / 2 - 0.25, 0.15, 0.3},
                                  {(i + 0.5) * kBay, k * kDepth, level});
        connect(m, column[i][k], long_beam[i][k], {i * kBay + 0.25, k * kDepth, level}, x, 1e9, 3e8, 8e7, beam_law);
        connect(m, long_beam[i][k], column[i + 1][k], {(i + 1) * kBay - 0.25, k * kDepth, level}, x, 1e9, 3e8, 8e7,
                beam_law);
      }
    for (int i = 0; i <= bays; ++i) {
      cross_beam[i] =
          add_box(m, "Q" + tag + std::to_string(i), {0.15, kDepth / 2 - 0.25, 0.3}, {i * kBay, kDepth / 2, level});
      connect(m, column[i][0], cross_beam[i], {i * kBay, 0.25, level}, y, 1e9, 3e8, 8e7, beam_law);
      connect(m, cross_beam[i], column[i][1], {i * kBay, kDepth - 0.25, level}, y, 1e9, 3e8, 8e7, beam_law);
    }
    for (int i = 0; i < bays; ++i) {
      // slabs lie between the beams, their tops flush
      const double half_x = kBay / 2 - 0.15, half_y = kDepth / 2 - 0.15, up = head - 0.15;
      const double cx = (i + 0.5) * kBay, cy = kDepth / 2;
      const BodyId slab = add_box(m, "S" + tag + std::to_string(i), {half_x, half_y, 0.15}, {cx, cy, up});
      for (const double t : {-0.5, 0.5}) {
        connect(m, cross_beam[i], slab, {cx - half_x, cy + t * half_y, up}, x, 8e8, 3e8, 3e7, slab_law);
        connect(m, slab, cross_beam[i + 1], {cx + half_x, cy + t * half_y, up}, x, 8e8, 3e8, 3e7, slab_law);
        connect(m, long_beam[i][0], slab, {cx + t * half_x, cy - half_y, up}, y, 8e8, 3e8, 3e7, slab_law);
        connect(m, slab, long_beam[i][1], {cx + t * half_x, cy + half_y, up}, y, 8e8, 3e8, 3e7, slab_law);
      }
    }
    for (int i = 0; i <= bays; ++i)
      for (int k = 0; k < 2; ++k) below[i][k] = column[i][k];
  }
  m.events.push_back(cut);

  double volume = 0;
  for (const Body& b : m.bodies) volume += b.mass;
  for (Body& b : m.bodies) {
    b.mass *= bays * kMass / volume;
    const Vec3 h = b.shapes[0].half;
    b.inertia = (b.mass / 3) * Mat3::diagonal({h.y * h.y + h.z * h.z, h.x * h.x + h.z * h.z, h.x * h.x + h.y * h.y});
  }
  return m;
}

}  // namespace topple::bench
