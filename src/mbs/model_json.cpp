#include "mbs/model_json.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "base/error.h"

namespace topple::mbs {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "topple-mbs";
constexpr int kVersion = 1;

// --- out
// ---------------------------------------------------------------------------------------------------------------

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
  if (s.kind == Shape::Kind::Sphere) return {{"sphere", s.radius}, {"X_BS", json_of(s.X_BS)}};
  return {{"box", json_of(s.half)}, {"X_BS", json_of(s.X_BS)}};
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
  return {{"normal_force", m.normal_force},
          {"plastic_rotation", m.plastic_rotation},
          {"positive", m.positive},
          {"negative", m.negative}};
}

Json json_of(const ZoneLaw& l) {
  Json j{{"name", l.name}};
  if (!l.moment_y.normal_force.empty()) j["moment_y"] = json_of(l.moment_y);
  if (!l.moment_z.normal_force.empty()) j["moment_z"] = json_of(l.moment_z);
  j["biaxial_exponent"] = l.biaxial_exponent;
  j["damage_share"] = l.damage_share;
  put(j, "rupture_rotation", l.rupture_rotation);
  if (!l.compression.x.empty()) j["compression"] = json_of(l.compression);
  if (!l.tension.x.empty()) j["tension"] = json_of(l.tension);
  put(j, "crush_length", l.crush_length);
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

const char* word_of(Action::Kind k) {
  switch (k) {
    case Action::Kind::RemoveElement:
      return "remove_element";
    case Action::Kind::SwitchLaw:
      return "switch_law";
    case Action::Kind::ReleaseJoint:
      return "release_joint";
    case Action::Kind::ReplaceBody:
      return "replace_body";
    case Action::Kind::ReleaseCable:
      return "release_cable";
  }
  return "";
}

// --- in
// ----------------------------------------------------------------------------------------------------------------

/// A JSON value with the path that leads to it, for messages.
class Node {
 public:
  Node(const Json& json, std::string path, const std::string& file)
      : json_(&json), path_(std::move(path)), file_(&file) {}

  [[noreturn]] void fail(const std::string& what) const {
    Diagnostic d;
    d.code = "E610";
    d.where.file = *file_;
    d.message = (path_.empty() ? std::string("the file") : path_) + ": " + what;
    throw InputError(std::vector<Diagnostic>{d});
  }
  bool has(const char* key) const { return json_->is_object() && json_->contains(key); }
  Node operator[](const char* key) const {
    if (!json_->is_object()) fail("must be an object");
    const auto it = json_->find(key);
    if (it == json_->end()) fail(std::string("needs \"") + key + "\"");
    return {*it, path_.empty() ? key : path_ + "." + key, *file_};
  }
  std::vector<Node> items() const {
    if (!json_->is_array()) fail("must be a list");
    std::vector<Node> out;
    for (size_t i = 0; i < json_->size(); ++i)
      out.emplace_back((*json_)[i], path_ + "[" + std::to_string(i) + "]", *file_);
    return out;
  }
  double number() const {
    if (!json_->is_number()) fail("must be a number");
    const double x = json_->get<double>();
    if (!std::isfinite(x)) fail("is not finite");
    return x;
  }
  int integer() const {
    if (!json_->is_number_integer()) fail("must be a whole number");
    if (json_->is_number_unsigned() && json_->get<std::uint64_t>() > 100'000'000) fail("is out of range");
    const auto x = json_->get<std::int64_t>();
    if (x < -1 || x > 100'000'000) fail("is out of range: " + std::to_string(x));
    return static_cast<int>(x);
  }
  bool flag() const {
    if (!json_->is_boolean()) fail("must be true or false");
    return json_->get<bool>();
  }
  std::string text() const {
    if (!json_->is_string()) fail("must be a string");
    return json_->get<std::string>();
  }
  std::vector<double> numbers() const {
    std::vector<double> out;
    for (const Node& n : items()) out.push_back(n.number());
    return out;
  }
  Vec3 vec3() const {
    const auto n = numbers();
    if (n.size() != 3) fail("needs three numbers");
    return {n[0], n[1], n[2]};
  }
  Quat quat() const {
    const auto n = numbers();
    if (n.size() != 4) fail("needs four numbers, w x y z");
    return {n[0], n[1], n[2], n[3]};
  }
  Pose pose() const { return {(*this)["p"].vec3(), (*this)["q"].quat()}; }
  Mat3 mat3() const {
    const auto rows = items();
    if (rows.size() != 3) fail("needs three rows");
    Mat3 m;
    for (int i = 0; i < 3; ++i) {
      const Vec3 r = rows[static_cast<size_t>(i)].vec3();
      for (int j = 0; j < 3; ++j) m(i, j) = r[j];
    }
    return m;
  }
  /// Keys beyond those known are typing errors.
  void only(const std::vector<std::string>& known) const {
    if (!json_->is_object()) fail("must be an object");
    for (const auto& [key, value] : json_->items())
      if (std::find(known.begin(), known.end(), key) == known.end()) {
        const std::string near = nearest_name(key, known);
        fail("unknown key \"" + key + "\"" + (near.empty() ? "" : "; did you mean \"" + near + "\"?"));
      }
  }

 private:
  const Json* json_;
  std::string path_;
  const std::string* file_;
};

void read(const Node& n, const char* key, double& to) {
  if (n.has(key)) to = n[key].number();
}

Body body_from(const Node& n) {
  n.only({"name", "mass", "inertia", "X_WB", "v_WB", "w_WB", "fixed", "shapes"});
  Body b;
  b.name = n["name"].text();
  b.mass = n["mass"].number();
  b.inertia = n["inertia"].mat3();
  b.X_WB = n["X_WB"].pose();
  if (n.has("v_WB")) b.v_WB = n["v_WB"].vec3();
  if (n.has("w_WB")) b.w_WB = n["w_WB"].vec3();
  if (n.has("fixed")) b.fixed = n["fixed"].flag();
  if (n.has("shapes"))
    for (const Node& s : n["shapes"].items()) {
      s.only({"box", "sphere", "X_BS"});
      Shape shape;
      if (s.has("sphere")) {
        shape.kind = Shape::Kind::Sphere;
        shape.radius = s["sphere"].number();
      } else {
        shape.half = s["box"].vec3();
      }
      if (s.has("X_BS")) shape.X_BS = s["X_BS"].pose();
      b.shapes.push_back(shape);
    }
  return b;
}

MomentFamily family_from(const Node& n) {
  n.only({"normal_force", "plastic_rotation", "positive", "negative"});
  return {n["normal_force"].numbers(), n["plastic_rotation"].numbers(), n["positive"].numbers(),
          n["negative"].numbers()};
}

Curve curve_from(const Node& n) {
  n.only({"x", "f"});
  return {n["x"].numbers(), n["f"].numbers()};
}

ZoneLaw law_from(const Node& n) {
  n.only({"name", "moment_y", "moment_z", "biaxial_exponent", "damage_share", "rupture_rotation", "compression",
          "tension", "crush_length", "rupture_elongation", "shear_y", "shear_z", "shear_friction", "slip_softening",
          "slip_rupture", "torsion", "twist_rupture"});
  ZoneLaw l;
  if (n.has("name")) l.name = n["name"].text();
  if (n.has("moment_y")) l.moment_y = family_from(n["moment_y"]);
  if (n.has("moment_z")) l.moment_z = family_from(n["moment_z"]);
  if (n.has("compression")) l.compression = curve_from(n["compression"]);
  if (n.has("tension")) l.tension = curve_from(n["tension"]);
  read(n, "biaxial_exponent", l.biaxial_exponent);
  read(n, "damage_share", l.damage_share);
  read(n, "rupture_rotation", l.rupture_rotation);
  read(n, "crush_length", l.crush_length);
  read(n, "rupture_elongation", l.rupture_elongation);
  read(n, "shear_y", l.shear_y);
  read(n, "shear_z", l.shear_z);
  read(n, "shear_friction", l.shear_friction);
  read(n, "slip_softening", l.slip_softening);
  read(n, "slip_rupture", l.slip_rupture);
  read(n, "torsion", l.torsion);
  read(n, "twist_rupture", l.twist_rupture);
  return l;
}

Event event_from(const Node& n) {
  n.only({"time", "name", "actions"});
  Event e;
  e.time = n["time"].number();
  if (n.has("name")) e.name = n["name"].text();
  for (const Node& a : n["actions"].items()) {
    a.only({"do", "element", "rotational", "joint", "body", "cable", "law", "ramp", "stiffness_share", "replacement"});
    Action action;
    const std::string word = a["do"].text();
    if (word == word_of(Action::Kind::RemoveElement)) {
      action.kind = Action::Kind::RemoveElement;
      action.element = {a["element"].integer()};
    } else if (word == word_of(Action::Kind::SwitchLaw)) {
      action.kind = Action::Kind::SwitchLaw;
      if (a.has("rotational")) {
        action.rotational = a["rotational"].integer();
        if (action.rotational < 0) a["rotational"].fail("must not be negative");
      } else {
        action.element = {a["element"].integer()};
      }
      action.law = {a["law"].integer()};
      read(a, "ramp", action.ramp);
      read(a, "stiffness_share", action.stiffness_share);
    } else if (word == word_of(Action::Kind::ReleaseJoint)) {
      action.kind = Action::Kind::ReleaseJoint;
      action.joint = {a["joint"].integer()};
    } else if (word == word_of(Action::Kind::ReplaceBody)) {
      action.kind = Action::Kind::ReplaceBody;
      action.body = {a["body"].integer()};
      action.replacement = body_from(a["replacement"]);
    } else if (word == word_of(Action::Kind::ReleaseCable)) {
      action.kind = Action::Kind::ReleaseCable;
      action.cable = a["cable"].integer();
    } else {
      a["do"].fail("does not know \"" + word + "\"");
    }
    e.actions.push_back(std::move(action));
  }
  return e;
}

}  // namespace

std::string to_json(const Model& m) {
  Json j{{"format", kFormat}, {"version", kVersion}, {"name", m.name}};
  j["gravity"] = json_of(m.gravity);
  j["damping_frequency"] = m.damping_frequency;
  j["bodies"] = Json::array();
  for (const Body& b : m.bodies) j["bodies"].push_back(json_of(b));
  j["joints"] = Json::array();
  for (const Joint& x : m.joints) {
    Json o{{"kind", x.kind == Joint::Kind::Fixed ? "fixed" : "revolute"}, {"name", x.name}};
    o["parent"] = x.parent.index;
    o["child"] = x.child.index;
    o["X_PF"] = json_of(x.X_PF);
    o["X_CM"] = json_of(x.X_CM);
    put(o, "tension_limit", x.tension_limit);
    put(o, "shear_limit", x.shear_limit);
    put(o, "moment_limit", x.moment_limit);
    put(o, "rotation_limit", x.rotation_limit);
    j["joints"].push_back(std::move(o));
  }
  j["elements"] = Json::array();
  for (const ZoneElement& e : m.elements) {
    Json o{{"name", e.name}};
    o["a"] = e.a.index;
    o["b"] = e.b.index;
    o["X_AF"] = json_of(e.X_AF);
    o["X_BM"] = json_of(e.X_BM);
    o["translational_stiffness"] = json_of(e.translational_stiffness);
    o["rotational_stiffness"] = json_of(e.rotational_stiffness);
    o["damping_ratio"] = e.damping_ratio;
    o["stations"] = Json::array();
    for (const Station& s : e.stations) o["stations"].push_back({{"x", s.x}, {"law", s.law.index}});
    j["elements"].push_back(std::move(o));
  }
  j["rotational_elements"] = Json::array();
  for (const RotationalElement& r : m.rotational_elements)
    j["rotational_elements"].push_back({{"name", r.name},
                                        {"joint", r.joint.index},
                                        {"stiffness", r.stiffness},
                                        {"damping_ratio", r.damping_ratio},
                                        {"law", r.law.index}});
  j["laws"] = Json::array();
  for (const ZoneLaw& l : m.laws) j["laws"].push_back(json_of(l));
  j["cables"] = Json::array();
  for (const Cable& c : m.cables) {
    Json o{{"name", c.name},
           {"a", c.a.index},
           {"b", c.b.index},
           {"p_A", json_of(c.p_A)},
           {"p_B", json_of(c.p_B)},
           {"stiffness", c.stiffness},
           {"pretension", c.pretension}};
    put(o, "strength", c.strength);
    j["cables"].push_back(std::move(o));
  }
  const Contact& c = m.contact;
  j["contact"] = {{"normal", json_of(c.normal)},
                  {"offset", c.offset},
                  {"friction", c.friction},
                  {"restitution", c.restitution},
                  {"body_friction", c.body_friction},
                  {"body_restitution", c.body_restitution},
                  {"contact_frequency", c.contact_frequency},
                  {"ground", c.ground},
                  {"bodies", c.bodies}};
  j["events"] = Json::array();
  for (const Event& e : m.events) {
    Json o{{"time", e.time}, {"name", e.name}, {"actions", Json::array()}};
    for (const Action& a : e.actions) {
      Json x{{"do", word_of(a.kind)}};
      switch (a.kind) {
        case Action::Kind::RemoveElement:
          x["element"] = a.element.index;
          break;
        case Action::Kind::SwitchLaw:
          if (a.rotational >= 0) {
            x["rotational"] = a.rotational;
          } else {
            x["element"] = a.element.index;
          }
          x["law"] = a.law.index;
          x["ramp"] = a.ramp;
          x["stiffness_share"] = a.stiffness_share;
          break;
        case Action::Kind::ReleaseJoint:
          x["joint"] = a.joint.index;
          break;
        case Action::Kind::ReplaceBody:
          x["body"] = a.body.index;
          x["replacement"] = json_of(a.replacement);
          break;
        case Action::Kind::ReleaseCable:
          x["cable"] = a.cable;
          break;
      }
      o["actions"].push_back(std::move(x));
    }
    j["events"].push_back(std::move(o));
  }
  return j.dump(1) + "\n";
}

Model model_from_json(const std::string& text, const std::string& name) {
  Json json;
  try {
    json = Json::parse(text);
  } catch (const nlohmann::json::parse_error& e) {
    // line and column of the byte where reading stopped
    Diagnostic d;
    d.code = "E611";
    d.where.file = name;
    d.where.line = d.where.column = 1;
    const size_t stop = std::min(text.size(), e.byte > 0 ? e.byte - 1 : 0);
    for (size_t i = 0; i < stop; ++i) {
      if (text[i] == '\n') {
        ++d.where.line;
        d.where.column = 1;
      } else if ((static_cast<unsigned char>(text[i]) & 0xC0) != 0x80) {
        ++d.where.column;
      }
    }
    d.message = "this is not JSON";
    d.help = "a multibody model is a JSON object with \"format\": \"topple-mbs\"";
    throw InputError(std::vector<Diagnostic>{d});
  }
  const Node root(json, "", name);
  root.only({"format", "version", "name", "gravity", "damping_frequency", "bodies", "joints", "elements",
             "rotational_elements", "laws", "cables", "contact", "events"});
  if (root["format"].text() != kFormat) root["format"].fail(std::string("must be \"") + kFormat + "\"");
  if (root["version"].integer() != kVersion) root["version"].fail("must be " + std::to_string(kVersion));
  Model m;
  if (root.has("name")) m.name = root["name"].text();
  if (root.has("gravity")) m.gravity = root["gravity"].vec3();
  read(root, "damping_frequency", m.damping_frequency);
  for (const Node& n : root["bodies"].items()) m.bodies.push_back(body_from(n));
  if (root.has("joints"))
    for (const Node& n : root["joints"].items()) {
      n.only({"kind", "name", "parent", "child", "X_PF", "X_CM", "tension_limit", "shear_limit", "moment_limit",
              "rotation_limit"});
      Joint j;
      const std::string kind = n["kind"].text();
      if (kind != "fixed" && kind != "revolute") n["kind"].fail("must be \"fixed\" or \"revolute\"");
      j.kind = kind == "fixed" ? Joint::Kind::Fixed : Joint::Kind::Revolute;
      if (n.has("name")) j.name = n["name"].text();
      j.parent = {n["parent"].integer()};
      j.child = {n["child"].integer()};
      j.X_PF = n["X_PF"].pose();
      j.X_CM = n["X_CM"].pose();
      read(n, "tension_limit", j.tension_limit);
      read(n, "shear_limit", j.shear_limit);
      read(n, "moment_limit", j.moment_limit);
      read(n, "rotation_limit", j.rotation_limit);
      m.joints.push_back(j);
    }
  if (root.has("elements"))
    for (const Node& n : root["elements"].items()) {
      n.only({"name", "a", "b", "X_AF", "X_BM", "translational_stiffness", "rotational_stiffness", "damping_ratio",
              "stations"});
      ZoneElement e;
      if (n.has("name")) e.name = n["name"].text();
      e.a = {n["a"].integer()};
      e.b = {n["b"].integer()};
      e.X_AF = n["X_AF"].pose();
      e.X_BM = n["X_BM"].pose();
      e.translational_stiffness = n["translational_stiffness"].vec3();
      e.rotational_stiffness = n["rotational_stiffness"].vec3();
      read(n, "damping_ratio", e.damping_ratio);
      if (n.has("stations"))
        for (const Node& s : n["stations"].items()) {
          s.only({"x", "law"});
          e.stations.push_back({s["x"].number(), {s["law"].integer()}});
        }
      m.elements.push_back(std::move(e));
    }
  if (root.has("rotational_elements"))
    for (const Node& n : root["rotational_elements"].items()) {
      n.only({"name", "joint", "stiffness", "damping_ratio", "law"});
      RotationalElement r;
      if (n.has("name")) r.name = n["name"].text();
      r.joint = {n["joint"].integer()};
      r.stiffness = n["stiffness"].number();
      read(n, "damping_ratio", r.damping_ratio);
      if (n.has("law")) r.law = {n["law"].integer()};
      m.rotational_elements.push_back(std::move(r));
    }
  if (root.has("laws"))
    for (const Node& n : root["laws"].items()) m.laws.push_back(law_from(n));
  if (root.has("cables"))
    for (const Node& n : root["cables"].items()) {
      n.only({"name", "a", "b", "p_A", "p_B", "stiffness", "pretension", "strength"});
      Cable c;
      if (n.has("name")) c.name = n["name"].text();
      c.a = {n["a"].integer()};
      c.b = {n["b"].integer()};
      c.p_A = n["p_A"].vec3();
      c.p_B = n["p_B"].vec3();
      c.stiffness = n["stiffness"].number();
      read(n, "pretension", c.pretension);
      read(n, "strength", c.strength);
      m.cables.push_back(std::move(c));
    }
  if (root.has("contact")) {
    const Node n = root["contact"];
    n.only({"normal", "offset", "friction", "restitution", "body_friction", "body_restitution", "contact_frequency",
            "ground", "bodies"});
    Contact& c = m.contact;
    if (n.has("normal")) c.normal = n["normal"].vec3();
    read(n, "offset", c.offset);
    read(n, "friction", c.friction);
    read(n, "restitution", c.restitution);
    read(n, "body_friction", c.body_friction);
    read(n, "body_restitution", c.body_restitution);
    read(n, "contact_frequency", c.contact_frequency);
    if (n.has("ground")) c.ground = n["ground"].flag();
    if (n.has("bodies")) c.bodies = n["bodies"].flag();
  }
  if (root.has("events"))
    for (const Node& n : root["events"].items()) m.events.push_back(event_from(n));
  check_model(m);
  return m;
}

}  // namespace topple::mbs
