#include "mbs/model_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "base/error.h"
#include "mbs/hull.h"
#include "mbs/quantity.h"
#include "mbs/solver.h"

namespace topple::mbs {

namespace {

/// Directions count as at right angles, places as the same, when they differ by less [1, m per metre from the origin].
constexpr double kClosed = 1e-10;

/// An item of a list, for complaints about it.
struct Place {
  std::string path, name;
};

Place at(const char* list, size_t i, const std::string& name = {}) { return {fmt::format("{}[{}]", list, i), name}; }

class Checker {
 public:
  explicit Checker(const Model& model) : m_(model) {}
  std::vector<Complaint> find();

 private:
  void fail(const Place& p, const char* key, std::string what) {
    found_.push_back({*key ? p.path + "." + key : p.path, p.name, std::move(what)});
  }

  // numbers
  void finite(const Place& p, const char* key, double x) {
    if (!std::isfinite(x)) fail(p, key, "is not a finite number");
  }
  void finite(const Place& p, const char* key, const Vec3& v) {
    if (!is_finite(v)) fail(p, key, "is not finite");
  }
  void positive(const Place& p, const char* key, double x) {
    if (!(x > 0) || !std::isfinite(x)) return fail(p, key, fmt::format("must be > 0, is {:g}", x));
    if (!std::isnormal(x)) fail(p, key, fmt::format("is {:g}, too small to compute with", x));
  }
  /// Infinite is allowed: unlimited.
  void not_negative(const Place& p, const char* key, double x) {
    if (!(x >= 0)) fail(p, key, fmt::format("must not be negative, is {:g}", x));
  }
  void finite_not_negative(const Place& p, const char* key, double x) {
    if (!(x >= 0) || !std::isfinite(x)) fail(p, key, fmt::format("must be finite and not negative, is {:g}", x));
  }
  void share(const Place& p, const char* key, double x, double low, double high) {
    if (!(x >= low && x <= high)) fail(p, key, fmt::format("must lie between {:g} and {:g}, is {:g}", low, high, x));
  }
  /// Of a planar model: a joint off the plane of its body's centre would turn the body out of it.
  void in_plane(const Place& p, const char* key, BodyId body, const Vec3& point) {
    constexpr double most = 1e-6;  // [m]
    if (body == kGround || body.index < 0 || static_cast<size_t>(body.index) >= m_.bodies.size()) return;
    const double off = (to_matrix(m_.bodies[static_cast<size_t>(body.index)].X_WB.q) * point).y;
    if (std::abs(off) > most)
      fail(p, key,
           fmt::format("lies {:g} m off the plane of the body's centre, in which a planar model's joints lie", off));
  }
  void pose(const Place& p, const char* key, const Pose& X) {
    if (!is_finite(X.p)) fail(p, key, "is not finite");
    const double n = X.q.w * X.q.w + X.q.x * X.q.x + X.q.y * X.q.y + X.q.z * X.q.z;
    if (!(std::abs(n - 1) < 1e-9)) fail(p, key, "is not a unit quaternion");
  }
  void rising(const Place& p, const char* key, const std::vector<double>& x) {
    for (size_t i = 0; i < x.size(); ++i) {
      if (!std::isfinite(x[i])) return fail(p, key, fmt::format("is not finite at index {}", i));
      if (i > 0 && !(x[i] > x[i - 1])) return fail(p, key, fmt::format("does not rise at index {}", i));
    }
  }
  void all_finite(const Place& p, const char* key, const std::vector<double>& f) {
    for (size_t i = 0; i < f.size(); ++i)
      if (!std::isfinite(f[i])) return fail(p, key, fmt::format("is not finite at index {}", i));
  }
  void magnitudes(const Place& p, const char* key, const std::vector<double>& f) {
    for (size_t i = 0; i < f.size(); ++i)
      if (!(f[i] >= 0) || !std::isfinite(f[i]))
        return fail(p, key, fmt::format("must hold finite values >= 0, index {} is {:g}", i, f[i]));
  }

  // references
  template <class List>
  bool index(const Place& p, const char* key, int i, const List& of) {
    if (i >= 0 && static_cast<size_t>(i) < of.size()) return true;
    fail(p, key, fmt::format("names number {}; there are {}", i, of.size()));
    return false;
  }
  bool body(const Place& p, const char* key, BodyId id, bool ground_allowed) {
    return (id == kGround && ground_allowed) || index(p, key, id.index, m_.bodies);
  }
  bool two_bodies(const Place& p, BodyId a, BodyId b, const char* key_a = "a", const char* key_b = "b") {
    const bool knows_a = body(p, key_a, a, true), knows_b = body(p, key_b, b, true);  // both are complained of
    if (a == b) fail(p, "", "joins a body to itself");
    return knows_a && knows_b && !(a == b);
  }
  Pose pose_of(BodyId id) const { return id == kGround ? Pose{} : m_.bodies[static_cast<size_t>(id.index)].X_WB; }

  // parts
  void curve(const Place& p, const char* key, const Curve& c) {
    if (c.x.size() != c.f.size()) fail(p, key, "x and f differ in length");
    rising(p, key, c.x);
    magnitudes(p, key, c.f);
    if (!c.x.empty() && c.x.front() != 0) fail(p, key, "must begin at x = 0");
  }
  void family(const Place& p, const char* key, const MomentFamily&);
  void cracking(const Place& p, const char* key, const Cracking&);
  void characteristic(const Place& p, const char* key, const Characteristic&);
  void mass_and_inertia(const Place& p, const Body&);
  void shapes(const Place& p, const Body&, bool fixed);
  void hull(const Place& p, const Shape&);
  void quantity(const Place& p, const Quantity&);

  // lists
  void check_bodies();
  void check_laws();
  void check_elements();
  void check_joints();
  void check_rotational_elements();
  void check_lines();
  void check_bushings();
  void check_loads();
  void check_contact();
  void check_events();
  /// Whether the element that an action names is there, a zone element or a rotational one.
  bool element(const Place&, const Action&);
  void check_action(const Place& p, const Action&);
  void check_outputs();
  /// Whether the joints are closed at the start; ids and poses must be good.
  void check_closure();

  const Model& m_;
  std::vector<Complaint> found_;
};

void Checker::family(const Place& p, const char* key, const MomentFamily& m) {
  const size_t n = m.normal_force.size() * m.plastic_rotation.size();
  if (m.normal_force.empty() && m.plastic_rotation.empty() && m.positive.empty() && m.negative.empty()) return;
  const Place in{p.path + "." + key, p.name};
  if (m.normal_force.size() < 2) fail(in, "normal_force", "needs at least two values");
  if (m.plastic_rotation.size() < 2) fail(in, "plastic_rotation", "needs at least two values");
  if (m.positive.size() != n || m.negative.size() != n)
    fail(in, "", fmt::format("needs forces x rotations = {} moments in each direction", n));
  rising(in, "normal_force", m.normal_force);
  rising(in, "plastic_rotation", m.plastic_rotation);
  if (!m.plastic_rotation.empty() && m.plastic_rotation.front() != 0) fail(in, "plastic_rotation", "must begin at 0");
  magnitudes(in, "positive", m.positive);
  magnitudes(in, "negative", m.negative);
  const size_t along[2] = {m.elongation_positive.size(), m.elongation_negative.size()};
  if ((along[0] > 0 || along[1] > 0) && (along[0] != n || along[1] != n))
    fail(in, "", fmt::format("needs forces x rotations = {} elongations in each direction, or none", n));
  for (const auto* list : {&m.elongation_positive, &m.elongation_negative})
    for (const double u : *list)
      if (!std::isfinite(u)) {
        fail(in, list == &m.elongation_positive ? "elongation_positive" : "elongation_negative", "is not finite");
        break;
      }
}

void Checker::cracking(const Place& p, const char* key, const Cracking& c) {
  const Place in{p.path + "." + key, p.name};
  finite_not_negative(in, "flexibility", c.flexibility);
  if (c.flexibility == 0) return;
  for (int side : {0, 1})
    if (!(c.begin[side] > 0 && c.end[side] > c.begin[side] && std::isfinite(c.end[side])))
      fail(in, "",
           fmt::format("needs 0 < begin < end in each direction, these are {:g} and {:g}", c.begin[side], c.end[side]));
}

void Checker::characteristic(const Place& p, const char* key, const Characteristic& c) {
  switch (c.kind) {
    case Characteristic::Kind::Linear:
      finite(p, key, c.rate);
      break;
    case Characteristic::Kind::Polynomial:
      if (c.coefficients.empty()) fail(p, key, "the polynomial has no coefficients");
      all_finite(p, key, c.coefficients);
      break;
    case Characteristic::Kind::Table:
      if (c.x.size() != c.f.size())
        fail(p, key, fmt::format("the table has {} values of x and {} of f", c.x.size(), c.f.size()));
      if (c.x.size() < 2) fail(p, key, "the table needs at least two points");
      rising(p, key, c.x);
      all_finite(p, key, c.f);
      break;
  }
}

void Checker::mass_and_inertia(const Place& p, const Body& b) {
  positive(p, "mass", b.mass);
  const Mat3& I = b.inertia;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (!std::isfinite(I(i, j)) || std::abs(I(i, j) - I(j, i)) > 1e-9 * (std::abs(I(i, i)) + std::abs(I(j, j))))
        return fail(p, "inertia", "must be finite and symmetric");
  const double minor = I(0, 0) * I(1, 1) - I(0, 1) * I(1, 0);
  if (!(I(0, 0) > 0) || !(minor > 0) || !(determinant(I) > 0)) fail(p, "inertia", "must be positive definite");
}

/// Four vertices that span a volume: the farthest from the first, from their line, from their plane.
void Checker::hull(const Place& p, const Shape& s) {
  if (s.vertices.size() < 4)
    return fail(p, "hull", fmt::format("needs at least 4 vertices, has {}", s.vertices.size()));
  for (size_t i = 0; i < s.vertices.size(); ++i)
    if (!is_finite(s.vertices[i])) return fail(p, "hull", fmt::format("vertex {} is not finite", i));
  const Vec3& first = s.vertices.front();
  Vec3 line, normal;
  double thickness = 0;
  for (const Vec3& v : s.vertices)
    if (norm(v - first) > norm(line)) line = v - first;
  const double size = norm(line);
  for (const Vec3& v : s.vertices)
    if (const Vec3 n = cross(line, v - first); norm(n) > norm(normal)) normal = n;
  if (norm(normal) > 0)
    for (const Vec3& v : s.vertices) thickness = std::max(thickness, std::abs(dot(normal, v - first)) / norm(normal));
  if (!(thickness > 1e-6 * size)) return fail(p, "hull", "its vertices lie in one plane");
  if (s.vertices.size() <= static_cast<size_t>(kMostFaceCorners)) return;
  size_t most = 0;
  for (const Hull::Face& face : make_hull(s.vertices).faces) most = std::max(most, face.loop.size());
  if (most > static_cast<size_t>(kMostFaceCorners))
    fail(p, "hull", fmt::format("a face has {} corners; at most {} are possible", most, kMostFaceCorners));
}

void Checker::shapes(const Place& p, const Body& b, bool fixed) {
  for (size_t i = 0; i < b.shapes.size(); ++i) {
    const Shape& s = b.shapes[i];
    const Place in{fmt::format("{}.shapes[{}]", p.path, i), p.name};
    pose(in, "X_BS", s.X_BS);
    switch (s.kind) {
      case Shape::Kind::Box:
        if (!(s.half.x > 0 && s.half.y > 0 && s.half.z > 0 && is_finite(s.half)))
          fail(in, "box", "half edges must be > 0 and finite");
        break;
      case Shape::Kind::Sphere:
        positive(in, "sphere", s.radius);
        break;
      case Shape::Kind::Hull:
        hull(in, s);
        break;
      case Shape::Kind::Plane:
        if (!fixed) fail(in, "plane", "only a fixed body can have a plane");
        break;
    }
  }
}

void Checker::check_bodies() {
  for (size_t i = 0; i < m_.bodies.size(); ++i) {
    const Body& b = m_.bodies[i];
    const Place p = at("bodies", i, b.name);
    if (!b.fixed)
      mass_and_inertia(p, b);
    else
      finite_not_negative(p, "mass", b.mass);
    pose(p, "X_WB", b.X_WB);
    finite(p, "v_WB", b.v_WB);
    finite(p, "w_WB", b.w_WB);
    if (b.fixed && norm(b.v_WB) > 0) fail(p, "v_WB", "is not 0, and a fixed body does not move");
    if (b.fixed && norm(b.w_WB) > 0) fail(p, "w_WB", "is not 0, and a fixed body does not turn");
    if (m_.is_planar && b.v_WB.y != 0)
      fail(p, "v_WB", fmt::format("has {:g} m/s along y, across which nothing of a planar model moves", b.v_WB.y));
    if (m_.is_planar && (b.w_WB.x != 0 || b.w_WB.z != 0))
      fail(p, "w_WB", "has a part about x or z, while the bodies of a planar model turn about y alone");
    shapes(p, b, b.fixed);
  }
}

void Checker::check_laws() {
  for (size_t i = 0; i < m_.laws.size(); ++i) {
    const SharedLaw& law = m_.laws.shared(i);
    if (law.is_checked()) continue;
    const size_t found_before = found_.size();
    const ZoneLaw& l = *law;
    const Place p = at("laws", i, l.name);
    family(p, "moment_y", l.moment_y);
    family(p, "moment_z", l.moment_z);
    curve(p, "compression", l.compression);
    curve(p, "tension", l.tension);
    share(p, "biaxial_exponent", l.biaxial_exponent, 1, 10);
    positive(p, "rotation_ratio", l.rotation_ratio);
    share(p, "damage_share", l.damage_share, 0, 0.95);
    const std::pair<const char*, double> ruptures[] = {{"rupture_rotation", l.rupture_rotation},
                                                       {"crush_length", l.crush_length},
                                                       {"rupture_elongation", l.rupture_elongation},
                                                       {"slip_rupture", l.slip_rupture},
                                                       {"twist_rupture", l.twist_rupture}};
    for (const auto& [key, x] : ruptures)
      if (!(x > 0)) fail(p, key, fmt::format("lengths and rotations of rupture must be > 0, this is {:g}", x));
    const std::pair<const char*, double> limits[] = {{"rupture_rotation_pressed", l.rupture_rotation_pressed},
                                                     {"shear_y", l.shear_y},
                                                     {"shear_z", l.shear_z},
                                                     {"shear_friction", l.shear_friction},
                                                     {"slip_softening", l.slip_softening},
                                                     {"torsion", l.torsion}};
    for (const auto& [key, x] : limits) not_negative(p, key, x);
    if (found_.size() == found_before) law.note_checked();
  }
}

void Checker::check_elements() {
  for (size_t i = 0; i < m_.elements.size(); ++i) {
    const ZoneElement& e = m_.elements[i];
    const Place p = at("elements", i, e.name);
    two_bodies(p, e.a, e.b);
    pose(p, "X_AF", e.X_AF);
    pose(p, "X_BM", e.X_BM);
    for (int k = 0; k < 3; ++k) {
      finite_not_negative(p, "translational_stiffness", e.translational_stiffness[k]);
      finite_not_negative(p, "rotational_stiffness", e.rotational_stiffness[k]);
    }
    share(p, "damping_ratio", e.damping_ratio, 0, 0.2);
    finite_not_negative(p, "crush_through", e.crush_through);
    if (e.crush_through > 0 && e.stations.empty()) fail(p, "crush_through", "needs a station whose law is crushed");
    cracking(p, "cracking_y", e.cracking[0]);
    cracking(p, "cracking_z", e.cracking[1]);
    for (int k : {0, 1})
      if (e.cracking[k].flexibility > 0 && e.stations.empty())
        fail(p, k == 0 ? "cracking_y" : "cracking_z", "needs a station that cracks");
    if (e.stations.size() > 2) fail(p, "stations", "has more than two stations");
    for (size_t k = 0; k < e.stations.size(); ++k) {
      const Place in{fmt::format("{}.stations[{}]", p.path, k), p.name};
      finite(in, "x", e.stations[k].x);
      index(in, "law", e.stations[k].law.index, m_.laws);
      if (k == 1 && e.stations[0].x == e.stations[1].x) fail(in, "x", "is that of the other station");
    }
  }
}

void Checker::check_joints() {
  using Kind = Joint::Kind;
  for (size_t i = 0; i < m_.joints.size(); ++i) {
    const Joint& j = m_.joints[i];
    const Place p = at("joints", i, j.name);
    two_bodies(p, j.parent, j.child, "parent", "child");
    pose(p, "X_PF", j.X_PF);
    pose(p, "X_CM", j.X_CM);
    not_negative(p, "tension_limit", j.tension_limit);
    not_negative(p, "shear_limit", j.shear_limit);
    not_negative(p, "moment_limit", j.moment_limit);
    not_negative(p, "rotation_limit", j.rotation_limit);
    if (j.rotation_limit < kUnlimited && j.kind != Kind::Revolute && j.kind != Kind::Cylindrical)
      fail(p, "rotation_limit", "only revolute and cylindrical joints have an angle");
    if (j.moment_limit < kUnlimited && (j.kind == Kind::Spherical || j.kind == Kind::Distance))
      fail(p, "moment_limit", "this kind of joint holds no moment");
    if (m_.is_planar) {
      in_plane(p, "X_PF", j.parent, j.X_PF.p);
      in_plane(p, "X_CM", j.child, j.X_CM.p);
    }
  }
}

void Checker::check_rotational_elements() {
  std::map<int, size_t> of_joint;
  for (size_t i = 0; i < m_.rotational_elements.size(); ++i) {
    const RotationalElement& r = m_.rotational_elements[i];
    const Place p = at("rotational_elements", i, r.name);
    if (index(p, "joint", r.joint.index, m_.joints)) {
      const auto [it, is_first] = of_joint.emplace(r.joint.index, i);
      if (!is_first) fail(p, "joint", fmt::format("has rotational element number {} already", it->second));
      if (m_.joints[static_cast<size_t>(r.joint.index)].kind != Joint::Kind::Revolute)
        fail(p, "joint", "is not a revolute joint");
    }
    if (r.law.is_valid()) index(p, "law", r.law.index, m_.laws);
    if (r.axial_element.is_valid()) index(p, "axial_element", r.axial_element.index, m_.elements);
    finite_not_negative(p, "stiffness", r.stiffness);
    cracking(p, "cracking", r.cracking);
    if (r.cracking.flexibility > 0 && !r.law.is_valid()) fail(p, "cracking", "needs a law");
    share(p, "damping_ratio", r.damping_ratio, 0, 0.2);
    for (int k = 0; k < 3; ++k) finite_not_negative(p, "loose_translational", r.loose_translational[k]);
    finite_not_negative(p, "loose_torsion", r.loose_torsion);
    finite_not_negative(p, "loose_bending", r.loose_bending);
  }
}

/// Cables, springs and what turns about joints.
void Checker::check_lines() {
  for (size_t i = 0; i < m_.cables.size(); ++i) {
    const Cable& c = m_.cables[i];
    const Place p = at("cables", i, c.name);
    const bool known = two_bodies(p, c.a, c.b);
    finite(p, "p_A", c.p_A);
    finite(p, "p_B", c.p_B);
    positive(p, "stiffness", c.stiffness);
    finite_not_negative(p, "pretension", c.pretension);
    if (known && c.pretension > 0 && norm(pose_of(c.b) * c.p_B - pose_of(c.a) * c.p_A) == 0)
      fail(p, "pretension", "its ends are at the same place at the start: the line between them has no direction");
    if (const double length = known ? norm(pose_of(c.b) * c.p_B - pose_of(c.a) * c.p_A) : 0;
        length > 0 && c.stiffness > 0 && c.pretension > c.stiffness * length)
      fail(p, "pretension", "stretches it by more than the distance of its ends, so nothing would be left of it");
    not_negative(p, "strength", c.strength);
  }
  for (size_t i = 0; i < m_.springs.size(); ++i) {
    const SpringDamper& s = m_.springs[i];
    const Place p = at("springs", i, s.name);
    const bool known = two_bodies(p, s.a, s.b);
    finite(p, "p_A", s.p_A);
    finite(p, "p_B", s.p_B);
    finite_not_negative(p, "free_length", s.free_length);
    characteristic(p, "spring", s.spring);
    characteristic(p, "damper", s.damper);
    not_negative(p, "tension_strength", s.tension_strength);
    not_negative(p, "compression_strength", s.compression_strength);
    // a force without a direction
    if (known && norm(pose_of(s.b) * s.p_B - pose_of(s.a) * s.p_A) == 0)
      fail(p, "", "its ends are at the same place at the start: the line between them has no direction");
  }
  for (size_t i = 0; i < m_.rotational_springs.size(); ++i) {
    const RotationalSpring& s = m_.rotational_springs[i];
    const Place p = at("rotational_springs", i, s.name);
    if (index(p, "joint", s.joint.index, m_.joints)) {
      const Joint::Kind kind = m_.joints[static_cast<size_t>(s.joint.index)].kind;
      if (kind != Joint::Kind::Revolute && kind != Joint::Kind::Cylindrical)
        fail(p, "joint", "is neither a revolute nor a cylindrical joint");
    }
    finite(p, "free_angle", s.free_angle);
    characteristic(p, "spring", s.spring);
    characteristic(p, "damper", s.damper);
    not_negative(p, "strength", s.strength);
  }
}

void Checker::check_bushings() {
  for (size_t i = 0; i < m_.bushings.size(); ++i) {
    const Bushing& b = m_.bushings[i];
    const Place p = at("bushings", i, b.name);
    two_bodies(p, b.a, b.b);
    pose(p, "X_AF", b.X_AF);
    pose(p, "X_BM", b.X_BM);
    for (int k = 0; k < 6; ++k) {
      const auto component = [k](const char* list) { return fmt::format("{}[{}]", list, k); };
      characteristic(p, component("spring").c_str(), b.spring[k]);
      characteristic(p, component("damper").c_str(), b.damper[k]);
      not_negative(p, component("strength").c_str(), b.strength[k]);
    }
  }
}

void Checker::check_loads() {
  for (size_t i = 0; i < m_.loads.size(); ++i) {
    const Load& l = m_.loads[i];
    const Place p = at("loads", i, l.name);
    body(p, "body", l.body, false);
    finite(p, "p_B", l.p_B);
    finite(p, "force", l.force);
    finite(p, "torque", l.torque);
    if (l.time.size() != l.factor.size())
      fail(p, "table", fmt::format("has {} times and {} factors", l.time.size(), l.factor.size()));
    rising(p, "table", l.time);
    all_finite(p, "table", l.factor);
  }
}

void Checker::check_contact() {
  const Contact& c = m_.contact;
  const Place p{"contact", {}};
  if (!(std::abs(norm(c.normal) - 1) < 1e-9)) fail(p, "normal", "is not a unit vector");
  if (m_.is_planar && std::abs(c.normal.y) > 1e-9)
    fail(p, "normal", "has a part along y, and bodies of a planar model do not move along it");
  finite(p, "offset", c.offset);
  finite_not_negative(p, "friction", c.friction);
  finite_not_negative(p, "body_friction", c.body_friction);
  share(p, "restitution", c.restitution, 0, 1);
  share(p, "body_restitution", c.body_restitution, 0, 1);
  positive(p, "contact_frequency", c.contact_frequency);
  std::map<std::pair<int, int>, size_t> seen;
  for (size_t i = 0; i < c.pairs.size(); ++i) {
    const Contact::Pair& pair = c.pairs[i];
    const Place in = at("contact.pairs", i);
    const bool knows_a = body(in, "a", pair.a, false), knows_b = body(in, "b", pair.b, true);
    if (knows_a && knows_b) {
      if (pair.a == pair.b) fail(in, "", "names one body twice");
      const auto [it, is_new] = seen.emplace(std::minmax(pair.a.index, pair.b.index), i);
      if (!is_new) fail(in, "", fmt::format("these two have rules already, number {}", it->second));
    }
    finite_not_negative(in, "friction", pair.friction);
    share(in, "restitution", pair.restitution, 0, 1);
    finite_not_negative(in, "stiffness", pair.stiffness);
    finite(in, "damping", pair.damping);
  }
}

void Checker::quantity(const Place& p, const Quantity& q) {
  using Kind = Quantity::Kind;
  using JointKind = Joint::Kind;
  const char* item = traits_of(q.kind).item;
  const std::string_view of = item;
  const size_t count = of == "body"         ? m_.bodies.size()
                       : of == "rotational" ? m_.rotational_elements.size()
                       : of == "joint"      ? m_.joints.size()
                       : of == "element"    ? m_.elements.size()
                       : of == "bushing"    ? m_.bushings.size()
                       : of == "spring"     ? m_.springs.size()
                       : of == "cable"      ? m_.cables.size()
                                            : m_.rotational_springs.size();
  if (q.index < 0 || static_cast<size_t>(q.index) >= count)
    return fail(p, item, fmt::format("names number {}; there are {}", q.index, count));
  if (q.kind != Kind::JointAngle && q.kind != Kind::JointDisplacement) return;
  const JointKind kind = m_.joints[static_cast<size_t>(q.index)].kind;
  if (q.kind == Kind::JointAngle && kind != JointKind::Revolute && kind != JointKind::Cylindrical)
    fail(p, "quantity", "only revolute and cylindrical joints have an angle");
  if (q.kind == Kind::JointDisplacement && kind != JointKind::Prismatic && kind != JointKind::Cylindrical)
    fail(p, "quantity", "only prismatic and cylindrical joints have a displacement");
}

bool Checker::element(const Place& p, const Action& a) {
  if (a.rotational < 0) return index(p, "element", a.element.index, m_.elements);
  if (a.element.is_valid()) fail(p, "", "names an element and a rotational element");
  return index(p, "rotational", a.rotational, m_.rotational_elements);
}

void Checker::check_action(const Place& p, const Action& a) {
  switch (a.kind) {
    case Action::Kind::RemoveElement:
      (void)element(p, a);
      break;
    case Action::Kind::SwitchLaw: {
      const bool is_there = element(p, a);
      if (is_there && a.rotational >= 0 && !m_.rotational_elements[static_cast<size_t>(a.rotational)].law.is_valid())
        fail(p, "rotational", "has no law that could change");
      if (is_there && a.rotational < 0 && m_.elements[static_cast<size_t>(a.element.index)].stations.empty())
        fail(p, "element", "has no station whose law could change");
      index(p, "law", a.law.index, m_.laws);
      finite_not_negative(p, "ramp", a.ramp);
      if (!(a.stiffness_share > 0 && a.stiffness_share <= 1000))
        fail(p, "stiffness_share", fmt::format("must lie in (0, 1000], is {:g}", a.stiffness_share));
      break;
    }
    case Action::Kind::ReleaseJoint:
      index(p, "joint", a.joint.index, m_.joints);
      break;
    case Action::Kind::LoosenJoint:
      if (index(p, "joint", a.joint.index, m_.joints) &&
          std::none_of(m_.rotational_elements.begin(), m_.rotational_elements.end(),
                       [&](const RotationalElement& r) { return r.joint == a.joint && can_be_loosened(r); }))
        fail(p, "joint", "has no rotational element with loose_translational > 0 that could take over");
      break;
    case Action::Kind::ReplaceBody: {
      const Place in{p.path + ".replacement", p.name};
      mass_and_inertia(in, a.replacement);
      pose(in, "X_WB", a.replacement.X_WB);
      if (!(a.replacement.X_WB.q == Quat{})) fail(in, "X_WB", "its q must be 1 0 0 0: axes stay");
      shapes(in, a.replacement, false);
      if (index(p, "body", a.body.index, m_.bodies) &&
          (a.replacement.fixed || m_.bodies[static_cast<size_t>(a.body.index)].fixed))
        fail(p, "body", "is fixed or would become so");
      break;
    }
    case Action::Kind::ReleaseCable:
      index(p, "cable", a.cable, m_.cables);
      break;
    case Action::Kind::RemoveSpring:
      index(p, "spring", a.index, m_.springs);
      break;
    case Action::Kind::RemoveRotationalSpring:
      index(p, "rotational_spring", a.index, m_.rotational_springs);
      break;
    case Action::Kind::RemoveBushing:
      index(p, "bushing", a.index, m_.bushings);
      break;
    case Action::Kind::RemoveLoad:
    case Action::Kind::ApplyLoad:
      index(p, "load", a.index, m_.loads);
      break;
  }
}

void Checker::check_events() {
  for (size_t i = 0; i < m_.events.size(); ++i) {
    const Event& e = m_.events[i];
    const Place p = at("events", i, e.name);
    finite_not_negative(p, "time", e.time);
    for (size_t k = 0; k < e.triggers.size(); ++k) {
      const Trigger& t = e.triggers[k];
      const Place in{fmt::format("{}.when[{}]", p.path, k), p.name};
      quantity(in, t.quantity);
      const bool is_scalar = traits_of(t.quantity.kind).components == 1;
      if (t.component < 0 || t.component > 3 || (is_scalar && t.component != 0 && t.component != 3))
        fail(in, "component", is_scalar ? "must be 0 or 3 (magnitude) of a single number" : "must be 0, 1, 2 or 3");
      finite(in, t.rising ? "rises_to" : "falls_to", t.limit);
    }
    for (size_t k = 0; k < e.actions.size(); ++k)
      check_action({fmt::format("{}.actions[{}]", p.path, k), p.name}, e.actions[k]);
  }
}

/// Whether a name can be that of a file and of an HDF5 link.
const char* fault_of_file_name(const std::string& name) {
  if (name.empty()) return "is empty; the output's file is called by it";
  if (name.size() > 100) return "is longer than 100 bytes; the output's file is called by it";
  if (name.front() == '.' || name.back() == '.' || name.front() == ' ' || name.back() == ' ')
    return "begins or ends with a dot or a space; the output's file is called by it";
  for (const char c : name)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F ||
        std::string_view("/\\:*?\"<>|").find(c) != std::string::npos)
      return "holds a character that file names cannot have (/ \\ : * ? \" < > | or a control character)";
  return nullptr;
}

void Checker::check_outputs() {
  std::set<std::string> names;
  for (size_t i = 0; i < m_.outputs.size(); ++i) {
    const Output& o = m_.outputs[i];
    const Place p = at("outputs", i, o.name);
    if (const char* fault = fault_of_file_name(o.name)) fail(p, "name", fault);
    if (!names.insert(o.name).second) fail(p, "name", "another output has this name");
    quantity(p, o.quantity);
    if (!(o.rate > 0 && o.rate <= 1e6)) fail(p, "rate", fmt::format("must be > 0 and at most 1e6, is {:g}", o.rate));
  }
}

void Checker::check_closure() {
  using Kind = Joint::Kind;
  for (size_t i = 0; i < m_.joints.size(); ++i) {
    const Joint& j = m_.joints[i];
    const Place p = at("joints", i, j.name);
    const Pose X_WF = pose_of(j.parent) * j.X_PF, X_WM = pose_of(j.child) * j.X_CM;
    const Mat3 F = to_matrix(X_WF.q), M = to_matrix(X_WM.q);
    const Vec3 line = X_WM.p - X_WF.p;
    // a gap is closed within the first step, and what force that takes must not be felt
    const double near = kClosed * (1 + norm(X_WF.p));
    if (j.kind == Kind::Distance) {
      if (!(norm(line) > near)) fail(p, "", "its frames are at the same place at the start; a distance must be > 0");
      continue;
    }
    const bool slides = j.kind == Kind::Prismatic || j.kind == Kind::Cylindrical;
    const double gap = slides ? norm(line - dot(line, F.column(2)) * F.column(2)) : norm(line);
    double turn = 0;
    if (j.kind == Kind::Fixed || j.kind == Kind::Prismatic) turn = norm(log_rotation(conjugate(X_WF.q) * X_WM.q));
    if (j.kind == Kind::Revolute || j.kind == Kind::Cylindrical)
      turn = std::atan2(norm(cross(F.column(2), M.column(2))), dot(F.column(2), M.column(2)));
    if (!std::isfinite(gap) || !(gap <= near) || !(turn <= kClosed))
      fail(p, "",
           fmt::format("its frames are {:.3g} m{} and {:.3g} rad apart at the start; they must meet", gap,
                       slides ? " beside the axis" : "", turn));
    if (j.kind == Kind::Universal) {
      const double off = std::abs(std::asin(std::clamp(dot(F.column(0), M.column(1)), -1.0, 1.0)));
      if (!(off <= kClosed))
        fail(p, "", fmt::format("its axes, x of F and y of M, are {:.3g} rad off the right angle at the start", off));
    }
  }
}

std::vector<Complaint> Checker::find() {
  if (!is_finite(m_.gravity)) found_.push_back({"gravity", {}, "is not finite"});
  if (!(m_.damping_frequency > 0) || !std::isfinite(m_.damping_frequency))
    found_.push_back({"damping_frequency", {}, fmt::format("must be > 0, is {:g}", m_.damping_frequency)});
  check_bodies();
  check_laws();
  check_elements();
  check_joints();
  check_rotational_elements();
  check_lines();
  check_bushings();
  check_loads();
  check_contact();
  check_events();
  check_outputs();
  if (found_.empty()) check_closure();
  return std::move(found_);
}

}  // namespace

std::vector<Complaint> find_complaints(const Model& model) { return Checker(model).find(); }

void check_step(double step, double duration) {
  if (!(step > 0)) return;
  if (step > duration)
    throw InputError("E606", fmt::format("a step of {:.3g} s is longer than the run of {:.6g} s", step, duration),
                     "give a shorter step, or none");
  if (duration <= kMostSteps * step) return;
  throw InputError(
      "E606",
      fmt::format("a step of {:.3g} s is too short for {:.6g} s: the run would take {:.2g} steps, at most {:g} "
                  "are allowed",
                  step, duration, duration / step, kMostSteps),
      fmt::format("give a step of {:.3g} s or more", duration / kMostSteps));
}

}  // namespace topple::mbs
