#include "farfield/motion.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/rotation_fit.h"
#include "farfield/boxes.h"

namespace topple::farfield {

namespace {

/// Plastic strain from which a zone counts as yielded: that of bars at their yield stress, about f_y / E_s.
constexpr double kYielded = 2e-3;

struct MovingPoint {
  double mass = 0;
  Vec3 p, v;
};

/// Angular velocity of the rigid body with the points' angular momentum about their mass centre; 0 where they lie on a
/// line or there are none [rad/s].
Vec3 calc_spin(const std::vector<MovingPoint>& points) {
  double mass = 0;
  Vec3 centre, velocity;
  for (const MovingPoint& x : points) mass += x.mass, centre += x.mass * x.p, velocity += x.mass * x.v;
  if (!(mass > 0)) return {};
  centre = (1 / mass) * centre, velocity = (1 / mass) * velocity;
  Vec3 momentum;
  Mat3 inertia;
  for (const MovingPoint& x : points) {
    const Vec3 r = x.p - centre;
    momentum += x.mass * cross(r, x.v - velocity);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) inertia.m[i][j] += x.mass * ((i == j ? dot(r, r) : 0) - r[i] * r[j]);
  }
  const double size = inertia.m[0][0] + inertia.m[1][1] + inertia.m[2][2];
  const double determinant = dot(inertia.row(0), cross(inertia.row(1), inertia.row(2)));
  return determinant > 1e-12 * size * size * size ? inverse(inertia) * momentum : Vec3{};
}

}  // namespace

double calc_utilisation(const fem::ExplicitMaterial& m, const std::array<double, 6>& s) {
  if (m.yield.empty()) return 0;
  const double mean = (s[0] + s[1] + s[2]) / 3;
  const double a = s[0] - mean, b = s[1] - mean, c = s[2] - mean;
  const double q = std::sqrt(1.5 * (a * a + b * b + c * c) + 3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
  const double t = m.yield.front().tension, f = m.yield.front().compression;
  // from tension at mean t/3 to compression at mean -f/3
  const double yield = t + (f - t) * (t / 3 - mean) / (t / 3 + f / 3);
  return yield > 0 ? std::min(1.0, q / yield) : 1.0;
}

Motion::Motion(const product::Plan& plan, const Whole& whole, const mbs::Model& model, const collapse::ModelMap& map,
               double size)
    : whole_(whole), model_(model) {
  const fem::ExplicitModel& fe = whole.fe;
  body_elements_.resize(model.bodies.size());
  for (size_t b = 0; b < map.bodies.size(); ++b)
    if (map.bodies[b].is_upper) upper_.push_back(b);
  for (size_t e = 0; e < fe.elements.size(); ++e) {
    const fem::ExplicitElement& element = fe.elements[e];
    std::array<Vec3, 8> corners;
    Vec3 centre;
    for (size_t i = 0; i < 8; ++i) {
      corners[i] = fe.nodes[static_cast<size_t>(element.node[i])];
      centre += 0.125 * corners[i];
    }
    centre_.push_back(centre);
    element_mass_.push_back(fem::calc_hex_volume(corners) *
                            fe.materials[static_cast<size_t>(element.material)].density * element.mass_factor);
    for (const int b : whole.bodies[e]) body_elements_[static_cast<size_t>(b)].push_back(static_cast<int>(e));
  }
  std::map<int, std::vector<int>> charged;  // elements, and the bars that their charge leaves
  for (size_t c = 0; c < whole.charges.size(); ++c)
    for (const int e : whole.charges[c].elements) charged[e] = fe.releases[c].bars;
  std::multimap<int, int> elements_of;
  for (size_t e = 0; e < fe.elements.size(); ++e) elements_of.emplace(whole.grid.cells[e].member, static_cast<int>(e));
  // what a charge takes belongs to the nearest of the zones on which charges act
  const auto is_of_charge = [&](const collapse::ZoneEntry& z, int element, int axis) {
    if (!std::isfinite(z.firing_time) || charged.count(element) == 0) return false;
    const double place = centre_[static_cast<size_t>(element)][axis], away = std::abs(place - z.p_W[axis]);
    return std::none_of(map.elements.begin(), map.elements.end(), [&](const collapse::ZoneEntry& other) {
      return other.member == z.member && std::isfinite(other.firing_time) &&
             std::abs(place - other.p_W[axis]) < away - 1e-9;
    });
  };
  // cells of one cross-section lie at the same place along the member, to a thousandth of a millimetre
  const auto gather_sections = [&](const collapse::ZoneEntry& z) {
    std::vector<ZoneElements::Section> out;
    const int member = plan.find_member(z.member);
    if (member < 0 || plan.members[static_cast<size_t>(member)].section < 0) return out;
    const int axis = axis_of(plan.members[static_cast<size_t>(member)]);
    std::map<long, std::vector<int>> at;
    const auto [first, last] = elements_of.equal_range(member);
    for (auto it = first; it != last; ++it) {
      const double place = centre_[static_cast<size_t>(it->second)][axis];
      if (std::abs(place - z.p_W[axis]) <= size || is_of_charge(z, it->second, axis))
        at[std::lround(1e6 * place)].push_back(it->second);
    }
    for (auto& [place, cells] : at) {
      const auto taken = std::find_if(cells.begin(), cells.end(), [&](int e) { return charged.count(e) != 0; });
      if (taken == cells.end())
        out.push_back({std::move(cells), {}});
      else if (std::isfinite(z.firing_time))
        out.push_back({cells, charged[*taken]});
    }
    return out;
  };
  const auto gather = [&](const collapse::ZoneEntry& z) {
    ZoneElements out;
    for (const int b : {z.body_a, z.body_b}) {
      if (b < 0) continue;
      for (const int e : body_elements_[static_cast<size_t>(b)]) {
        const Vec3 d = centre_[static_cast<size_t>(e)] - z.p_W;
        if (std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)}) > size) continue;
        // both may share it
        if (std::find(out.elements.begin(), out.elements.end(), e) == out.elements.end()) out.elements.push_back(e);
      }
    }
    out.sections = gather_sections(z);
    return out;
  };
  for (const auto* list : {&map.elements, &map.rotationals})
    for (const collapse::ZoneEntry& z : *list) zones_.push_back(gather(z));
  for (const collapse::ZoneEntry& z : map.joints) joints_.push_back(gather(z));
}

mbs::View Motion::calc_view(const fem::ExplicitSystem& system, double time) const {
  const fem::ExplicitModel& fe = whole_.fe;
  mbs::View v;
  v.time = time;
  const size_t B = model_.bodies.size();
  std::vector<std::vector<const fem::DebrisParticle*>> debris(B);
  const auto share_of = [this](int e) {
    return 1.0 / static_cast<double>(whole_.bodies[static_cast<size_t>(e)].size());
  };
  for (const fem::DebrisParticle& d : system.debris())
    for (const int b : whole_.bodies[static_cast<size_t>(d.element)]) debris[static_cast<size_t>(b)].push_back(&d);
  std::vector<FitPoint> points;
  std::vector<MovingPoint> moving;
  for (size_t b = 0; b < B; ++b) {
    const Pose start = model_.bodies[b].X_WB;
    points.clear(), moving.clear();
    Vec3 momentum;
    double mass = 0;
    for (const int e : body_elements_[b]) {
      if (!system.is_alive(e)) continue;
      const double share = 0.125 * share_of(e) * element_mass_[static_cast<size_t>(e)];
      for (const int n : fe.elements[static_cast<size_t>(e)].node) {
        points.push_back({share, fe.nodes[static_cast<size_t>(n)], system.p(n)});
        moving.push_back({share, system.p(n), system.v(n)});
        momentum += share * system.v(n);
        mass += share;
      }
    }
    // the rotation of what holds together; the place of all that was not taken away
    PointFit fit = fit_points(points);
    fit.before *= mass, fit.after *= mass;
    for (const fem::DebrisParticle* d : debris[b]) {
      const double share = share_of(d->element) * d->mass;
      fit.before += share * centre_[static_cast<size_t>(d->element)];
      fit.after += share * d->p;
      momentum += share * d->v;
      mass += share;
    }
    Pose X = start;
    Vec3 velocity, centre = start.p;
    if (mass > 0) {
      const Vec3 before = (1 / mass) * fit.before;
      centre = (1 / mass) * fit.after;
      // the origin is not the elements' mass centre where they do not meet the body's bounds
      X = {centre + to_matrix(fit.rotation) * (start.p - before), fit.rotation * start.q};
      velocity = (1 / mass) * momentum;
    }
    v.X_WB.push_back(X);
    v.centre.push_back(centre);
    v.v_WB.push_back(velocity);
    v.w_WB.push_back(calc_spin(moving));
    v.mass.push_back(mass);
  }

  const auto judge = [&](const ZoneElements& z, double& utilisation) {
    size_t gone = 0;
    double plastic = 0, limit = 0;
    utilisation = 0;
    for (const int e : z.elements) {
      const fem::ExplicitMaterial& m = fe.materials[static_cast<size_t>(fe.elements[static_cast<size_t>(e)].material)];
      if (!system.is_alive(e)) {
        ++gone;
        continue;
      }
      plastic = std::max(plastic, system.plastic_strain(e));
      limit = std::max(limit, system.damage(e));
      utilisation = std::max(utilisation, calc_utilisation(m, system.stress(e)));
    }
    const auto is_gone = [&](int e) { return !system.is_alive(e); };
    const auto is_cut = [&](const ZoneElements::Section& s) {
      return std::all_of(s.elements.begin(), s.elements.end(), is_gone) &&
             std::none_of(s.bars.begin(), s.bars.end(), [&](int bar) { return system.bears(bar); });
    };
    const bool is_mostly_gone = gone > 0 && 2 * gone >= z.elements.size();
    if (is_mostly_gone || std::any_of(z.sections.begin(), z.sections.end(), is_cut)) return mbs::ElementState::Broken;
    if (gone > 0 || limit > 0.5) return mbs::ElementState::Softening;
    return plastic > kYielded ? mbs::ElementState::Yielded : mbs::ElementState::Elastic;
  };
  for (const ZoneElements& z : zones_) {
    double utilisation = 0;
    v.element_state.push_back(judge(z, utilisation));
    v.utilisation.push_back(utilisation);
  }
  for (const ZoneElements& z : joints_) {
    double utilisation = 0;
    v.joint_released.push_back(judge(z, utilisation) == mbs::ElementState::Broken);
  }
  v.rotation.assign(zones_.size(), 0);
  v.shortening.assign(zones_.size(), 0);
  v.joint_force.assign(joints_.size(), {});
  v.joint_moment.assign(joints_.size(), {});

  for (const double f : calc_foot_forces(system)) v.ground_force.z += f;
  v.contact_force_ground = -system.ground_force(0);
  v.ground_force += v.contact_force_ground;
  // what is left of bodies that belong to the ground
  for (size_t b = 0; b < B; ++b)
    if (model_.bodies[b].fixed) v.ground_force.z -= v.mass[b] * norm(fe.gravity);
  v.body_contacts = system.contacts();
  const fem::ExplicitEnergy e = system.calc_energy();
  v.energy.kinetic = e.kinetic + e.debris_kinetic;
  v.energy.gravity = e.gravity;
  v.energy.elastic = e.elastic;
  v.energy.contact = e.contact_elastic;
  v.energy.plastic = e.plastic + e.plastic_hourglass;
  v.energy.damping = e.bulk_viscosity;
  v.energy.friction = e.friction;
  v.energy.contact_loss = e.contact_damping;
  v.energy.removed = e.removed_internal + e.removed_kinetic + e.removed_gravity;
  v.energy.loads = e.loads;
  v.energy.residual = e.residual();
  v.energy.released = std::max(0.0, -(e.gravity + e.removed_gravity));
  return v;
}

std::vector<double> Motion::calc_foot_forces(const fem::ExplicitSystem& system) const {
  std::vector<double> forces;
  for (const Foot& foot : whole_.feet) {
    // what the elements press down, and the weight that is lumped at the held nodes
    double force = -system.calc_resultant(foot.elements, foot.nodes, foot.p_W).force.z;
    for (size_t i = 0; i < foot.nodes.size(); ++i)
      force += foot.shares[i] * system.node_mass(foot.nodes[i]) * norm(whole_.fe.gravity);
    for (const int b : foot.bars) force += system.bar_force_of_ground(b).z;
    forces.push_back(force);
  }
  return forces;
}

Vec3 Motion::calc_upper_place(const mbs::View& v) const {
  Vec3 sum;
  double mass = 0;
  for (const size_t b : upper_) sum += v.mass[b] * v.X_WB[b].p, mass += v.mass[b];
  return mass > 0 ? (1 / mass) * sum : sum;
}

double Motion::calc_speed(const mbs::View& v) const {
  double mass = 0;
  for (const double m : v.mass) mass += m;
  return mass > 0 ? std::sqrt(2 * v.energy.kinetic / mass) : 0;
}

}  // namespace topple::farfield
