/// The writing half of model_json.h.

#include <cmath>
#include <nlohmann/json.hpp>

#include "mbs/model_json.h"
#include "mbs/model_words.h"
#include "mbs/quantity.h"

namespace topple::mbs {

namespace {

using Json = nlohmann::ordered_json;

Json json_of(const Vec3& v) { return Json::array({v.x, v.y, v.z}); }
Json json_of(const Quat& q) { return Json::array({q.w, q.x, q.y, q.z}); }
Json json_of(const Pose& X) { return {{"p", json_of(X.p)}, {"q", json_of(X.q)}}; }
Json json_of(const Mat3& m) { return Json::array({json_of(m.row(0)), json_of(m.row(1)), json_of(m.row(2))}); }
Json json_of(const Curve& c) { return {{"x", c.x}, {"f", c.f}}; }
/// JSON knows no infinity: an unlimited value is left out.
void put(Json& j, const char* key, double value) {
  if (!std::isinf(value)) j[key] = value;
}

Json json_of(const Shape& s) {
  Json j;
  switch (s.kind) {
    case Shape::Kind::Box:
      j["box"] = json_of(s.half);
      break;
    case Shape::Kind::Sphere:
      j["sphere"] = s.radius;
      break;
    case Shape::Kind::Hull:
      j["hull"] = Json::array();
      for (const Vec3& v : s.vertices) j["hull"].push_back(json_of(v));
      break;
    case Shape::Kind::Plane:
      j["plane"] = true;
      break;
  }
  j["X_BS"] = json_of(s.X_BS);
  return j;
}

Json json_of(const Body& b) {
  Json j{{"name", b.name}};
  j["mass"] = b.mass;
  j["inertia"] = json_of(b.inertia);
  j["X_WB"] = json_of(b.X_WB);
  j["v_WB"] = json_of(b.v_WB);
  j["w_WB"] = json_of(b.w_WB);
  if (b.fixed) j["fixed"] = true;
  j["shapes"] = Json::array();
  for (const Shape& s : b.shapes) j["shapes"].push_back(json_of(s));
  return j;
}

Json json_of(const MomentFamily& m) {
  Json j{{"normal_force", m.normal_force},
         {"plastic_rotation", m.plastic_rotation},
         {"positive", m.positive},
         {"negative", m.negative}};
  if (!m.elongation_positive.empty()) {
    j["elongation_positive"] = m.elongation_positive;
    j["elongation_negative"] = m.elongation_negative;
  }
  return j;
}

Json json_of(const ZoneLaw& l) {
  Json j{{"name", l.name}};
  if (!l.moment_y.normal_force.empty()) j["moment_y"] = json_of(l.moment_y);
  if (!l.moment_z.normal_force.empty()) j["moment_z"] = json_of(l.moment_z);
  j["biaxial_exponent"] = l.biaxial_exponent;
  if (l.rotation_ratio != 1) j["rotation_ratio"] = l.rotation_ratio;
  j["damage_share"] = l.damage_share;
  put(j, "rupture_rotation", l.rupture_rotation);
  if (l.rupture_rotation_pressed != 0) put(j, "rupture_rotation_pressed", l.rupture_rotation_pressed);
  if (!l.compression.x.empty()) j["compression"] = json_of(l.compression);
  if (!l.tension.x.empty()) j["tension"] = json_of(l.tension);
  if (l.buckles) j["buckles"] = true;
  put(j, "crush_length", l.crush_length);
  if (l.keeps_length) j["keeps_length"] = true;
  put(j, "rupture_elongation", l.rupture_elongation);
  put(j, "shear_y", l.shear_y);
  put(j, "shear_z", l.shear_z);
  put(j, "shear_friction", l.shear_friction);
  put(j, "slip_softening", l.slip_softening);
  put(j, "slip_rupture", l.slip_rupture);
  put(j, "torsion", l.torsion);
  put(j, "twist_rupture", l.twist_rupture);
  return j;
}

Json json_of(const Characteristic& c) {
  switch (c.kind) {
    case Characteristic::Kind::Linear:
      return c.rate;
    case Characteristic::Kind::Polynomial:
      return {{"polynomial", c.coefficients}};
    case Characteristic::Kind::Table:
      return {{"table", {{"x", c.x}, {"f", c.f}}}};
  }
  return nullptr;
}

Json json_of(const Joint& x) {
  Json j{{"kind", kJointWords[static_cast<size_t>(x.kind)]}, {"name", x.name}};
  j["parent"] = x.parent.index;
  j["child"] = x.child.index;
  j["X_PF"] = json_of(x.X_PF);
  j["X_CM"] = json_of(x.X_CM);
  put(j, "tension_limit", x.tension_limit);
  put(j, "shear_limit", x.shear_limit);
  put(j, "moment_limit", x.moment_limit);
  put(j, "rotation_limit", x.rotation_limit);
  return j;
}

Json json_of(const Cracking& c) { return {{"begin", c.begin}, {"end", c.end}, {"flexibility", c.flexibility}}; }

Json json_of(const ZoneElement& e) {
  Json j{{"name", e.name}};
  j["a"] = e.a.index;
  j["b"] = e.b.index;
  j["X_AF"] = json_of(e.X_AF);
  j["X_BM"] = json_of(e.X_BM);
  j["translational_stiffness"] = json_of(e.translational_stiffness);
  j["rotational_stiffness"] = json_of(e.rotational_stiffness);
  j["damping_ratio"] = e.damping_ratio;
  j["stations"] = Json::array();
  for (const Station& s : e.stations) j["stations"].push_back({{"x", s.x}, {"law", s.law.index}});
  if (e.crush_through > 0) j["crush_through"] = e.crush_through;
  if (e.cracking[0].flexibility > 0) j["cracking_y"] = json_of(e.cracking[0]);
  if (e.cracking[1].flexibility > 0) j["cracking_z"] = json_of(e.cracking[1]);
  return j;
}

Json json_of(const RotationalElement& r) {
  Json j{{"name", r.name},
         {"joint", r.joint.index},
         {"stiffness", r.stiffness},
         {"damping_ratio", r.damping_ratio},
         {"law", r.law.index}};
  if (r.cracking.flexibility > 0) j["cracking"] = json_of(r.cracking);
  if (r.axial_element.is_valid()) j["axial_element"] = r.axial_element.index;
  if (can_be_loosened(r)) {
    j["loose_translational"] = json_of(r.loose_translational);
    j["loose_torsion"] = r.loose_torsion;
    j["loose_bending"] = r.loose_bending;
  }
  return j;
}

Json json_of(const Cable& c) {
  Json j{{"name", c.name},
         {"a", c.a.index},
         {"b", c.b.index},
         {"p_A", json_of(c.p_A)},
         {"p_B", json_of(c.p_B)},
         {"stiffness", c.stiffness},
         {"pretension", c.pretension}};
  put(j, "strength", c.strength);
  return j;
}

Json json_of(const SpringDamper& s) {
  Json j{{"name", s.name},
         {"a", s.a.index},
         {"b", s.b.index},
         {"p_A", json_of(s.p_A)},
         {"p_B", json_of(s.p_B)},
         {"free_length", s.free_length},
         {"spring", json_of(s.spring)},
         {"damper", json_of(s.damper)}};
  put(j, "tension_strength", s.tension_strength);
  put(j, "compression_strength", s.compression_strength);
  return j;
}

Json json_of(const RotationalSpring& s) {
  Json j{{"name", s.name},
         {"joint", s.joint.index},
         {"free_angle", s.free_angle},
         {"spring", json_of(s.spring)},
         {"damper", json_of(s.damper)}};
  put(j, "strength", s.strength);
  return j;
}

Json json_of(const Bushing& b) {
  Json j{{"name", b.name}, {"a", b.a.index}, {"b", b.b.index}, {"X_AF", json_of(b.X_AF)}, {"X_BM", json_of(b.X_BM)}};
  j["spring"] = j["damper"] = j["strength"] = Json::array();
  for (int k = 0; k < 6; ++k) {
    j["spring"].push_back(json_of(b.spring[k]));
    j["damper"].push_back(json_of(b.damper[k]));
    j["strength"].push_back(std::isinf(b.strength[k]) ? Json(nullptr) : Json(b.strength[k]));
  }
  return j;
}

Json json_of(const Load& l) {
  Json j{{"name", l.name},
         {"body", l.body.index},
         {"p_B", json_of(l.p_B)},
         {"force", json_of(l.force)},
         {"torque", json_of(l.torque)},
         {"follows_body", l.follows_body}};
  if (!l.time.empty()) j["table"] = {{"time", l.time}, {"factor", l.factor}};
  return j;
}

Json json_of(const Contact::Pair& p) {
  Json j{{"a", p.a.index}, {"b", p.b.index}, {"touches", p.touches}, {"friction", p.friction}};
  j[p.damping >= 0 ? "damping" : "restitution"] = p.damping >= 0 ? p.damping : p.restitution;
  j["stiffness"] = p.stiffness;
  return j;
}

Json json_of(const Contact& c) {
  Json j{{"normal", json_of(c.normal)},
         {"offset", c.offset},
         {"friction", c.friction},
         {"restitution", c.restitution},
         {"body_friction", c.body_friction},
         {"body_restitution", c.body_restitution},
         {"contact_frequency", c.contact_frequency},
         {"ground", c.ground},
         {"bodies", c.bodies},
         {"pairs", Json::array()}};
  for (const Contact::Pair& p : c.pairs) j["pairs"].push_back(json_of(p));
  return j;
}

void put_quantity(Json& j, const Quantity& q) {
  j[traits_of(q.kind).item] = q.index;
  j["quantity"] = traits_of(q.kind).word;
}

Json json_of(const Trigger& t) {
  Json j;
  put_quantity(j, t.quantity);
  if (t.component == 3 || traits_of(t.quantity.kind).components > 1)
    j["component"] = kComponentWords[static_cast<size_t>(t.component)];
  j[t.rising ? "rises_to" : "falls_to"] = t.limit;
  return j;
}

Json json_of(const Output& o) {
  Json j{{"name", o.name}};
  put_quantity(j, o.quantity);
  j["rate"] = o.rate;
  return j;
}

void put_element(Json& j, const Action& a) {
  if (a.rotational >= 0) {
    j["rotational"] = a.rotational;
  } else {
    j["element"] = a.element.index;
  }
}

Json json_of(const Action& a) {
  Json j{{"do", kActionWords[static_cast<size_t>(a.kind)]}};
  switch (a.kind) {
    case Action::Kind::RemoveElement:
      put_element(j, a);
      break;
    case Action::Kind::SwitchLaw:
      put_element(j, a);
      j["law"] = a.law.index;
      j["ramp"] = a.ramp;
      j["stiffness_share"] = a.stiffness_share;
      break;
    case Action::Kind::ReleaseJoint:
    case Action::Kind::LoosenJoint:
      j["joint"] = a.joint.index;
      break;
    case Action::Kind::ReplaceBody:
      j["body"] = a.body.index;
      j["replacement"] = json_of(a.replacement);
      break;
    case Action::Kind::ReleaseCable:
      j["cable"] = a.cable;
      break;
    case Action::Kind::RemoveSpring:
      j["spring"] = a.index;
      break;
    case Action::Kind::RemoveRotationalSpring:
      j["rotational_spring"] = a.index;
      break;
    case Action::Kind::RemoveBushing:
      j["bushing"] = a.index;
      break;
    case Action::Kind::RemoveLoad:
    case Action::Kind::ApplyLoad:
      j["load"] = a.index;
      break;
  }
  return j;
}

Json json_of(const Event& e) {
  Json j{{"time", e.time}, {"name", e.name}};
  if (!e.triggers.empty()) {
    j["when"] = Json::array();
    for (const Trigger& t : e.triggers) j["when"].push_back(json_of(t));
  }
  j["actions"] = Json::array();
  for (const Action& a : e.actions) j["actions"].push_back(json_of(a));
  return j;
}

template <class T>
Json list_of(const T& items) {
  Json j = Json::array();
  for (const auto& item : items) j.push_back(json_of(item));
  return j;
}

}  // namespace

std::string to_json(const Model& m, const RunSettings& run) {
  Json j{{"format", kModelFormat}, {"version", kModelVersion}, {"name", m.name}};
  Json settings = Json::object();
  if (run.duration > 0) settings["duration"] = run.duration;
  if (run.step > 0) settings["step"] = run.step;
  if (run.stability_share != RunSettings().stability_share) settings["stability_share"] = run.stability_share;
  if (run.frame_interval > 0) settings["frame_interval"] = run.frame_interval;
  if (run.equilibrium) settings["equilibrium"] = *run.equilibrium;
  if (run.rest_speed) settings["rest_speed"] = *run.rest_speed;
  if (!settings.empty()) j["run"] = std::move(settings);
  j["gravity"] = json_of(m.gravity);
  j["damping_frequency"] = m.damping_frequency;
  if (m.is_planar) j["is_planar"] = true;
  j["bodies"] = list_of(m.bodies);
  j["joints"] = list_of(m.joints);
  j["elements"] = list_of(m.elements);
  j["rotational_elements"] = list_of(m.rotational_elements);
  j["laws"] = list_of(m.laws);
  j["cables"] = list_of(m.cables);
  j["springs"] = list_of(m.springs);
  j["rotational_springs"] = list_of(m.rotational_springs);
  j["bushings"] = list_of(m.bushings);
  j["loads"] = list_of(m.loads);
  j["contact"] = json_of(m.contact);
  j["events"] = list_of(m.events);
  j["outputs"] = list_of(m.outputs);
  return j.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace topple::mbs
