#include "mbs/model.h"

#include <cmath>
#include <string>

#include "base/error.h"

namespace topple::mbs {

namespace {

/// Collects complaints about a model, each naming its place like a path in the JSON file.
class Checker {
 public:
  void fail(const std::string& place, const std::string& what) {
    Diagnostic d;
    d.code = "E601";
    d.message = place + ": " + what;
    found_.push_back(d);
  }
  void finite(const std::string& place, double x) {
    if (!std::isfinite(x)) fail(place, "is not a finite number");
  }
  void finite(const std::string& place, const Vec3& v) {
    if (!is_finite(v)) fail(place, "is not finite");
  }
  void not_negative(const std::string& place, double x) {
    if (!(x >= 0)) fail(place, "must not be negative, is " + std::to_string(x));
  }
  void damping(const std::string& place, double x) {
    if (!(x >= 0 && x <= 0.2)) fail(place, "must lie between 0 and 0.2, is " + std::to_string(x));
  }
  void pose(const std::string& place, const Pose& X) {
    finite(place + ".p", X.p);
    const double n = X.q.w * X.q.w + X.q.x * X.q.x + X.q.y * X.q.y + X.q.z * X.q.z;
    if (!(std::abs(n - 1) < 1e-9)) fail(place + ".q", "is not a unit quaternion");
  }
  void rising(const std::string& place, const std::vector<double>& x) {
    for (size_t i = 0; i < x.size(); ++i) {
      if (!std::isfinite(x[i])) return fail(place, "holds a value that is not finite");
      if (i > 0 && !(x[i] > x[i - 1])) return fail(place, "does not rise at index " + std::to_string(i));
    }
  }
  void magnitudes(const std::string& place, const std::vector<double>& f) {
    for (size_t i = 0; i < f.size(); ++i)
      if (!(f[i] >= 0) || !std::isfinite(f[i]))
        return fail(place, "must hold finite values >= 0, index " + std::to_string(i) + " is " + std::to_string(f[i]));
  }
  void curve(const std::string& place, const Curve& c) {
    if (c.x.size() != c.f.size()) fail(place, "x and f differ in length");
    rising(place + ".x", c.x);
    magnitudes(place + ".f", c.f);
    if (!c.x.empty() && c.x.front() != 0) fail(place + ".x", "must begin at 0");
  }
  void family(const std::string& place, const MomentFamily& m) {
    const size_t n = m.normal_force.size() * m.plastic_rotation.size();
    if (m.normal_force.empty() && m.plastic_rotation.empty() && m.positive.empty() && m.negative.empty()) return;
    if (m.normal_force.size() < 2) fail(place + ".normal_force", "needs at least two values");
    if (m.plastic_rotation.size() < 2) fail(place + ".plastic_rotation", "needs at least two values");
    if (m.positive.size() != n || m.negative.size() != n)
      fail(place, "needs forces x rotations = " + std::to_string(n) + " moments in each direction");
    rising(place + ".normal_force", m.normal_force);
    rising(place + ".plastic_rotation", m.plastic_rotation);
    if (!m.plastic_rotation.empty() && m.plastic_rotation.front() != 0)
      fail(place + ".plastic_rotation", "must begin at 0");
    magnitudes(place + ".positive", m.positive);
    magnitudes(place + ".negative", m.negative);
  }
  void body(const std::string& place, const Model& model, BodyId id, bool ground_allowed) {
    if (id == kGround && ground_allowed) return;
    if (id.index < 0 || static_cast<size_t>(id.index) >= model.bodies.size())
      fail(place, "names body " + std::to_string(id.index) + "; there are " + std::to_string(model.bodies.size()));
  }
  template <class Tag, class T>
  void index(const std::string& place, Id<Tag> id, const std::vector<T>& of, bool may_be_unset = false) {
    if (may_be_unset && !id.is_valid()) return;
    if (id.index < 0 || static_cast<size_t>(id.index) >= of.size())
      fail(place, "names number " + std::to_string(id.index) + "; there are " + std::to_string(of.size()));
  }
  void mass_and_inertia(const std::string& place, const Body& b) {
    if (!(b.mass > 0) || !std::isfinite(b.mass)) fail(place + ".mass", "must be > 0, is " + std::to_string(b.mass));
    const Mat3& I = b.inertia;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        if (!std::isfinite(I(i, j)) || std::abs(I(i, j) - I(j, i)) > 1e-9 * (std::abs(I(i, i)) + std::abs(I(j, j))))
          return fail(place + ".inertia", "must be finite and symmetric");
    const double minor = I(0, 0) * I(1, 1) - I(0, 1) * I(1, 0);
    if (!(I(0, 0) > 0) || !(minor > 0) || !(determinant(I) > 0)) fail(place + ".inertia", "must be positive definite");
  }
  void shapes(const std::string& place, const Body& b) {
    for (const Shape& s : b.shapes) {
      pose(place + ".shapes", s.X_BS);
      if (s.kind == Shape::Kind::Box ? !(s.half.x > 0 && s.half.y > 0 && s.half.z > 0 && is_finite(s.half))
                                     : !(s.radius > 0 && std::isfinite(s.radius)))
        fail(place + ".shapes", "sizes must be > 0 and finite");
    }
  }
  void finish() {
    if (!found_.empty()) throw InputError(std::move(found_));
  }

 private:
  std::vector<Diagnostic> found_;
};

std::string at(const char* list, size_t i, const std::string& name) {
  return std::string(list) + "[" + std::to_string(i) + "]" + (name.empty() ? "" : " \"" + name + "\"");
}

Pose pose_of(const Model& model, BodyId id) {
  return id == kGround ? Pose{} : model.bodies[static_cast<size_t>(id.index)].X_WB;
}

}  // namespace

BodyId add_body(Model& model, Body body) {
  model.bodies.push_back(std::move(body));
  return {static_cast<int>(model.bodies.size()) - 1};
}

JointId add_joint(Model& model, Joint joint) {
  model.joints.push_back(std::move(joint));
  return {static_cast<int>(model.joints.size()) - 1};
}

ElementId add_element(Model& model, ZoneElement element) {
  model.elements.push_back(std::move(element));
  return {static_cast<int>(model.elements.size()) - 1};
}

LawId add_law(Model& model, ZoneLaw law) {
  model.laws.push_back(std::move(law));
  return {static_cast<int>(model.laws.size()) - 1};
}

void check_model(const Model& model) {
  Checker c;
  c.finite("gravity", model.gravity);
  if (!(model.damping_frequency > 0) || !std::isfinite(model.damping_frequency))
    c.fail("damping_frequency", "must be > 0");
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& b = model.bodies[i];
    const std::string place = at("bodies", i, b.name);
    if (!b.fixed) c.mass_and_inertia(place, b);
    c.pose(place + ".X_WB", b.X_WB);
    c.finite(place + ".v_WB", b.v_WB);
    c.finite(place + ".w_WB", b.w_WB);
    c.shapes(place, b);
  }
  for (size_t i = 0; i < model.laws.size(); ++i) {
    const ZoneLaw& l = model.laws[i];
    const std::string place = at("laws", i, l.name);
    c.family(place + ".moment_y", l.moment_y);
    c.family(place + ".moment_z", l.moment_z);
    c.curve(place + ".compression", l.compression);
    c.curve(place + ".tension", l.tension);
    if (!(l.biaxial_exponent >= 1 && l.biaxial_exponent <= 10))
      c.fail(place + ".biaxial_exponent", "must lie between 1 and 10");
    if (!(l.damage_share >= 0 && l.damage_share <= 0.95))
      c.fail(place + ".damage_share", "must lie between 0 and 0.95");
    for (double x : {l.rupture_rotation, l.crush_length, l.rupture_elongation, l.slip_rupture, l.twist_rupture})
      if (!(x > 0)) c.fail(place, "lengths and rotations of rupture must be > 0, one is " + std::to_string(x));
    for (double x : {l.rupture_rotation, l.crush_length, l.rupture_elongation, l.shear_y, l.shear_z, l.shear_friction,
                     l.slip_softening, l.slip_rupture, l.torsion, l.twist_rupture})
      c.not_negative(place, x);
  }
  for (size_t i = 0; i < model.elements.size(); ++i) {
    const ZoneElement& e = model.elements[i];
    const std::string place = at("elements", i, e.name);
    c.body(place + ".a", model, e.a, true);
    c.body(place + ".b", model, e.b, true);
    if (e.a == e.b) c.fail(place, "joins a body to itself");
    c.pose(place + ".X_AF", e.X_AF);
    c.pose(place + ".X_BM", e.X_BM);
    for (int k = 0; k < 3; ++k) {
      c.not_negative(place + ".translational_stiffness", e.translational_stiffness[k]);
      c.not_negative(place + ".rotational_stiffness", e.rotational_stiffness[k]);
    }
    c.finite(place + ".translational_stiffness", e.translational_stiffness);
    c.finite(place + ".rotational_stiffness", e.rotational_stiffness);
    c.damping(place + ".damping_ratio", e.damping_ratio);
    if (e.stations.size() > 2) c.fail(place + ".stations", "has more than two stations");
    for (const Station& s : e.stations) {
      c.finite(place + ".stations.x", s.x);
      c.index(place + ".stations.law", s.law, model.laws);
    }
  }
  for (size_t i = 0; i < model.joints.size(); ++i) {
    const Joint& j = model.joints[i];
    const std::string place = at("joints", i, j.name);
    c.body(place + ".parent", model, j.parent, true);
    c.body(place + ".child", model, j.child, true);
    if (j.parent == j.child) c.fail(place, "joins a body to itself");
    c.pose(place + ".X_PF", j.X_PF);
    c.pose(place + ".X_CM", j.X_CM);
    for (double x : {j.tension_limit, j.shear_limit, j.moment_limit, j.rotation_limit}) c.not_negative(place, x);
  }
  for (size_t i = 0; i < model.rotational_elements.size(); ++i) {
    const RotationalElement& r = model.rotational_elements[i];
    const std::string place = at("rotational_elements", i, r.name);
    c.index(place + ".joint", r.joint, model.joints);
    c.index(place + ".law", r.law, model.laws, true);
    c.finite(place + ".stiffness", r.stiffness);
    c.not_negative(place + ".stiffness", r.stiffness);
    for (size_t k = 0; k < i; ++k)
      if (model.rotational_elements[k].joint == r.joint)
        c.fail(place + ".joint", "has rotational element number " + std::to_string(k) + " already");
    c.damping(place + ".damping_ratio", r.damping_ratio);
    if (r.joint.is_valid() && static_cast<size_t>(r.joint.index) < model.joints.size() &&
        model.joints[static_cast<size_t>(r.joint.index)].kind != Joint::Kind::Revolute)
      c.fail(place + ".joint", "is not a revolute joint");
  }
  for (size_t i = 0; i < model.cables.size(); ++i) {
    const Cable& k = model.cables[i];
    const std::string place = at("cables", i, k.name);
    c.body(place + ".a", model, k.a, true);
    c.body(place + ".b", model, k.b, true);
    if (k.a == k.b) c.fail(place, "joins a body to itself");
    c.finite(place + ".p_A", k.p_A);
    c.finite(place + ".p_B", k.p_B);
    if (!(k.stiffness > 0) || !std::isfinite(k.stiffness)) c.fail(place + ".stiffness", "must be > 0");
    c.not_negative(place + ".pretension", k.pretension);
    c.not_negative(place + ".strength", k.strength);
  }
  const Contact& ct = model.contact;
  if (!(std::abs(norm(ct.normal) - 1) < 1e-9)) c.fail("contact.normal", "is not a unit vector");
  c.finite("contact.offset", ct.offset);
  for (double x : {ct.friction, ct.body_friction}) {
    c.finite("contact.friction", x);
    c.not_negative("contact.friction", x);
  }
  for (double x : {ct.restitution, ct.body_restitution})
    if (!(x > 0 && x <= 1)) c.fail("contact.restitution", "must lie in (0, 1], is " + std::to_string(x));
  if (!(ct.contact_frequency > 0) || !std::isfinite(ct.contact_frequency))
    c.fail("contact.contact_frequency", "must be > 0");
  for (size_t i = 0; i < model.events.size(); ++i) {
    const Event& e = model.events[i];
    const std::string place = at("events", i, e.name);
    c.finite(place + ".time", e.time);
    c.not_negative(place + ".time", e.time);
    for (const Action& a : e.actions) {
      switch (a.kind) {
        case Action::Kind::RemoveElement:
          c.index(place + ".element", a.element, model.elements);
          break;
        case Action::Kind::SwitchLaw:
          if (a.rotational < 0) c.index(place + ".element", a.element, model.elements);
          if (a.rotational >= 0 && static_cast<size_t>(a.rotational) >= model.rotational_elements.size())
            c.fail(place + ".rotational", "names no rotational element");
          if (a.rotational >= 0 && a.element.is_valid()) c.fail(place, "names an element and a rotational element");
          if (a.rotational >= 0 && static_cast<size_t>(a.rotational) < model.rotational_elements.size() &&
              !model.rotational_elements[static_cast<size_t>(a.rotational)].law.is_valid())
            c.fail(place + ".rotational", "has no law that could change");
          c.index(place + ".law", a.law, model.laws);
          if (a.element.is_valid() && static_cast<size_t>(a.element.index) < model.elements.size() &&
              model.elements[static_cast<size_t>(a.element.index)].stations.empty())
            c.fail(place + ".element", "has no station whose law could change");
          c.finite(place + ".ramp", a.ramp);
          c.not_negative(place + ".ramp", a.ramp);
          if (!(a.stiffness_share > 0 && a.stiffness_share <= 1))
            c.fail(place + ".stiffness_share", "must lie in (0, 1], is " + std::to_string(a.stiffness_share));
          break;
        case Action::Kind::ReleaseJoint:
          c.index(place + ".joint", a.joint, model.joints);
          break;
        case Action::Kind::ReplaceBody:
          c.body(place + ".body", model, a.body, false);
          c.mass_and_inertia(place + ".replacement", a.replacement);
          c.pose(place + ".replacement.X_WB", a.replacement.X_WB);
          if (!(a.replacement.X_WB.q == Quat{})) c.fail(place + ".replacement.X_WB.q", "must be 1 0 0 0: axes stay");
          c.shapes(place + ".replacement", a.replacement);
          if (a.body.index >= 0 && static_cast<size_t>(a.body.index) < model.bodies.size() &&
              (a.replacement.fixed || model.bodies[static_cast<size_t>(a.body.index)].fixed))
            c.fail(place + ".body", "is fixed or would become so");
          break;
        case Action::Kind::ReleaseCable:
          if (a.cable < 0 || static_cast<size_t>(a.cable) >= model.cables.size())
            c.fail(place + ".cable", "names no cable");
          break;
      }
    }
  }
  c.finish();
  // Only now are all ids known to be good.
  for (size_t i = 0; i < model.joints.size(); ++i) {
    const Joint& j = model.joints[i];
    const Pose X_WF = pose_of(model, j.parent) * j.X_PF, X_WM = pose_of(model, j.child) * j.X_CM;
    const double gap = norm(X_WM.p - X_WF.p);
    const double turn = j.kind == Joint::Kind::Fixed
                            ? norm(log_rotation(conjugate(X_WF.q) * X_WM.q))
                            : norm(cross(to_matrix(X_WF.q).column(2), to_matrix(X_WM.q).column(2)));
    // a gap is closed within the first step, and what force that takes must not be felt
    if (gap > 1e-10 * (1 + norm(X_WF.p)) || turn > 1e-10)
      c.fail(at("joints", i, j.name), "its frames are " + std::to_string(gap) + " m and " + std::to_string(turn) +
                                          " rad apart at the start; they must meet");
  }
  c.finish();
}

}  // namespace topple::mbs
