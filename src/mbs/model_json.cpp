#include "mbs/model_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "base/error.h"
#include "mbs/json_document.h"
#include "mbs/model_check.h"
#include "mbs/model_words.h"
#include "mbs/quantity.h"
#include "mbs/solver.h"

namespace topple::mbs {

namespace {

using Node = JsonNode;

constexpr size_t kMostComplaints = 50;

const std::vector<std::string>& keys_of(const std::string& object) {
  for (const KeyList& l : model_json_keys())
    if (l.object == object) return l.keys;
  throw std::logic_error("model_json: no keys of " + object);
}

/// The items of one list by their names.
struct Names {
  const char* what = "";  // "body"
  const char* many = "";  // "bodies"
  int count = 0;
  std::map<std::string, std::vector<int>> places;
};

Names names_of(const Node& root, const char* list, const char* what) {
  Names names{what, list, 0, {}};
  if (!root.has(list) || !root[list].is_list()) return names;
  for (const Node& n : root[list].items()) {
    if (n.has("name") && n["name"].is_text()) names.places[n["name"].text()].push_back(names.count);
    ++names.count;
  }
  names.places.erase("");
  return names;
}

void read(const Node& n, const char* key, double& to) {
  if (n.has(key)) to = n[key].number();
}
void read(const Node& n, const char* key, bool& to) {
  if (n.has(key)) to = n[key].flag();
}
void read(const Node& n, const char* key, std::string& to) {
  if (n.has(key)) to = n[key].text();
}
void read(const Node& n, const char* key, Vec3& to) {
  if (n.has(key)) to = n[key].vec3();
}

/// Two alternatives of which just one must be given.
bool has_first(const Node& n, const char* first, const char* second) {
  if (n.has(first) && n.has(second)) n.fail(fmt::format("give \"{}\" or \"{}\", not both", first, second));
  if (!n.has(first) && !n.has(second)) n.fail(fmt::format("needs \"{}\" or \"{}\"", first, second));
  return n.has(first);
}

void refuse_keys(const Node& n, std::initializer_list<const char*> keys, const char* beside) {
  for (const char* key : keys)
    if (n.has(key)) n.fail_at(key, fmt::format("\"{}\" does not go with \"{}\"", key, beside));
}

/// Directions in W are of use with a place in W only.
void demand_at(const Node& n) {
  for (const char* key : {"axis", "axes", "x"})
    if (n.has(key)) n.fail_at(key, fmt::format("\"{}\" needs \"at\", the place in W", key));
}

Characteristic characteristic_from(const Node& n) {
  Characteristic c;
  if (n.is_number()) {
    c.rate = n.number();
    return c;
  }
  if (!n.is_object()) n.fail("must be a number (linear), {\"polynomial\": [...]} or {\"table\": {...}}");
  n.only(keys_of("characteristic"));
  if (has_first(n, "polynomial", "table")) {
    c.kind = Characteristic::Kind::Polynomial;
    c.coefficients = n["polynomial"].numbers();
  } else {
    const Node t = n["table"];
    t.only(keys_of("table"));
    c.kind = Characteristic::Kind::Table;
    c.x = t["x"].numbers();
    c.f = t["f"].numbers();
  }
  return c;
}

void read(const Node& n, const char* key, Characteristic& to) {
  if (n.has(key)) to = characteristic_from(n[key]);
}

Shape shape_from(const Node& n) {
  n.only(keys_of("shape"));
  Shape s;
  int given = 0;
  for (const char* key : {"box", "sphere", "hull", "plane"}) given += n.has(key);
  if (given != 1) n.fail("needs just one of \"box\", \"sphere\", \"hull\", \"plane\"");
  if (n.has("box")) s.half = n["box"].vec3();
  if (n.has("sphere")) {
    s.kind = Shape::Kind::Sphere;
    s.radius = n["sphere"].number();
  }
  if (n.has("hull")) {
    s.kind = Shape::Kind::Hull;
    for (const Node& v : n["hull"].items()) s.vertices.push_back(v.vec3());
  }
  if (n.has("plane")) {
    s.kind = Shape::Kind::Plane;
    if (!n["plane"].flag()) n["plane"].fail("must be true; its place is X_BS");
  }
  if (n.has("X_BS")) s.X_BS = n["X_BS"].pose();
  return s;
}

Mat3 inertia_from(const Node& n) {
  if (n.is_list() && !n.items().empty() && n.items().front().is_number()) return Mat3::diagonal(n.vec3());
  return n.mat3();
}

Body body_from(const Node& n) {
  n.only(keys_of("body"));
  Body b;
  b.name = n["name"].text();
  read(n, "fixed", b.fixed);
  // what never moves needs no mass
  if (!b.fixed || n.has("mass")) b.mass = n["mass"].number();
  if (!b.fixed || n.has("inertia")) b.inertia = inertia_from(n["inertia"]);
  b.X_WB = n["X_WB"].pose();
  read(n, "v_WB", b.v_WB);
  read(n, "w_WB", b.w_WB);
  if (n.has("shapes"))
    for (const Node& s : n["shapes"].items()) b.shapes.push_back(shape_from(s));
  return b;
}

std::vector<double> rows_from(const Node& n) {
  for (const Node& x : n.items())
    if (x.is_list()) x.fail("must be a number: the K x J values are one list, row by row of equal force");
  return n.numbers();
}

MomentFamily family_from(const Node& n) {
  n.only(keys_of("family"));
  MomentFamily f{n["normal_force"].numbers(),
                 n["plastic_rotation"].numbers(),
                 rows_from(n["positive"]),
                 rows_from(n["negative"]),
                 {},
                 {}};
  if (n.has("elongation_positive")) f.elongation_positive = rows_from(n["elongation_positive"]);
  if (n.has("elongation_negative")) f.elongation_negative = rows_from(n["elongation_negative"]);
  return f;
}

Cracking cracking_from(const Node& n) {
  n.only(keys_of("cracking"));
  Cracking c;
  for (const auto& [key, to] : {std::pair{"begin", c.begin}, {"end", c.end}}) {
    const std::vector<double> both = n[key].numbers();
    if (both.size() != 2) n[key].fail("needs two moments, for those > 0 and for those < 0");
    std::copy(both.begin(), both.end(), to);
  }
  c.flexibility = n["flexibility"].number();
  return c;
}

Curve curve_from(const Node& n) {
  n.only(keys_of("curve"));
  return {n["x"].numbers(), n["f"].numbers()};
}

ZoneLaw law_from(const Node& n) {
  n.only(keys_of("law"));
  ZoneLaw l;
  read(n, "name", l.name);
  if (n.has("moment_y")) l.moment_y = family_from(n["moment_y"]);
  if (n.has("moment_z")) l.moment_z = family_from(n["moment_z"]);
  if (n.has("compression")) l.compression = curve_from(n["compression"]);
  if (n.has("tension")) l.tension = curve_from(n["tension"]);
  read(n, "biaxial_exponent", l.biaxial_exponent);
  read(n, "rotation_ratio", l.rotation_ratio);
  read(n, "damage_share", l.damage_share);
  read(n, "rupture_rotation", l.rupture_rotation);
  read(n, "rupture_rotation_pressed", l.rupture_rotation_pressed);
  read(n, "buckles", l.buckles);
  read(n, "crush_length", l.crush_length);
  read(n, "keeps_length", l.keeps_length);
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

/// Orthonormal axes of which z is as given; x as near to `x` as that allows, or to an axis of W.
Mat3 axes_about(const Vec3& z, const Vec3& x_wanted) {
  const Vec3 across = x_wanted - dot(x_wanted, z) * z;
  const Vec3 x = (1 / norm(across)) * across;
  return Mat3::from_columns(x, cross(z, x), z);
}

/// An axis of W that is far from a direction: x, but y where the direction is nearer to x than 45 degrees.
Vec3 far_axis(const Vec3& direction) { return std::abs(direction.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}; }

/// Axes that "axis" (z) and "x" describe in W; those of W where they say nothing.
Mat3 axes_from(const Node& n) {
  if (!n.has("axis") && !n.has("x")) return Mat3::identity();
  if (!n.has("axis")) {
    const Vec3 x = n["x"].direction();
    // z is W's as far as x allows, or y where x stands upright
    const Vec3 up = std::abs(x.z) < 0.7 ? Vec3{0, 0, 1} : Vec3{0, 1, 0};
    const Vec3 across = up - dot(up, x) * x;
    const Vec3 z = (1 / norm(across)) * across;
    return Mat3::from_columns(x, cross(z, x), z);
  }
  const Vec3 z = n["axis"].direction();
  if (!n.has("x")) return axes_about(z, far_axis(z));
  const Vec3 x = n["x"].direction();
  if (norm(cross(z, x)) < 1e-3) n["x"].fail("is parallel to \"axis\"");
  return axes_about(z, x);
}

class Reader {
 public:
  Reader(const std::string& text, const std::string& name) : document_(text, name), root_(document_.root()) {}

  Model read_model(RunSettings* run);

 private:
  /// Keeps the complaint and goes on, up to a number of them.
  template <class F>
  void attempt(F&& f) {
    try {
      f();
    } catch (const InputError& e) {
      found_.insert(found_.end(), e.diagnostics().begin(), e.diagnostics().end());
      if (found_.size() >= kMostComplaints) throw InputError(std::move(found_));
    }
  }
  /// Reads a list; an item that is wrong leaves its place to a default one.
  template <class List, class F>
  void each(const char* key, List& list, F&& read_item) {
    if (!root_.has(key)) return;
    attempt([&] {
      for (const Node& n : root_[key].items()) {
        std::invoke_result_t<F, const Node&> item;
        attempt([&] { item = read_item(n); });
        list.push_back(std::move(item));
      }
    });
  }

  int refer(const Node& n, const Names& names, int low = 0) const;
  BodyId body(const Node& n, bool may_be_ground) const;
  Pose pose_of(BodyId id) const {
    return id.is_valid() && static_cast<size_t>(id.index) < model_.bodies.size()
               ? model_.bodies[static_cast<size_t>(id.index)].X_WB
               : Pose{};
  }
  Vec3 point_in(BodyId id, const Vec3& p_W) const { return inverse(pose_of(id)) * p_W; }
  Pose frame_in(BodyId id, const Pose& X_W) const { return inverse(pose_of(id)) * X_W; }
  void read_points(const Node& n, BodyId a, BodyId b, Vec3& p_A, Vec3& p_B) const;
  void read_frames(const Node& n, BodyId a, BodyId b, const char* key_a, const char* key_b, Pose& X_AF,
                   Pose& X_BM) const;
  void place_joint(const Node& n, Joint& j) const;
  Quantity quantity_from(const Node& n) const;
  Trigger trigger_from(const Node& n) const;
  void element_of(const Node& n, Action& a) const;
  Action action_from(const Node& n) const;

  Joint joint_from(const Node& n) const;
  ZoneElement element_from(const Node& n) const;
  RotationalElement rotational_element_from(const Node& n) const;
  Cable cable_from(const Node& n) const;
  SpringDamper spring_from(const Node& n) const;
  RotationalSpring rotational_spring_from(const Node& n) const;
  Bushing bushing_from(const Node& n) const;
  Load load_from(const Node& n) const;
  void read_contact(const Node& n, Contact& c) const;
  Event event_from(const Node& n) const;
  Output output_from(const Node& n) const;
  RunSettings run_from(const Node& n) const;

  JsonDocument document_;
  Node root_;
  Names bodies_, joints_, elements_, rotational_elements_, laws_, cables_, springs_, rotational_springs_, bushings_,
      loads_;
  Model model_;
  std::vector<Diagnostic> found_;
};

/// An item by its place in the list or by its name.
int Reader::refer(const Node& n, const Names& names, int low) const {
  if (!n.is_text()) {
    if (!n.is_number())
      n.fail(fmt::format("must be the name of a {0} or its place in \"{1}\"", names.what, names.many));
    const int i = n.integer(low);
    if (i >= names.count)
      n.fail(fmt::format("is out of range: there are {}, counted from 0", names.count),
             fmt::format("the list is \"{}\"", names.many));
    return i;
  }
  const std::string name = n.text();
  const auto it = names.places.find(name);
  if (it == names.places.end()) {
    std::vector<std::string> known;
    for (const auto& [word, places] : names.places) known.push_back(word);
    if (low < 0 && &names == &bodies_) known.push_back("ground");
    const std::string near = nearest_name(name, known);
    n.fail(fmt::format("there is no {} \"{}\"{}", names.what, name,
                       near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)));
  }
  if (it->second.size() > 1)
    n.fail(fmt::format("\"{}\" is ambiguous: {} items of \"{}\" have this name, the first at {} and {}", name,
                       it->second.size(), names.many, it->second[0], it->second[1]),
           "give them names of their own, or refer to the place in the list");
  return it->second.front();
}

BodyId Reader::body(const Node& n, bool may_be_ground) const {
  if (n.is_text() && n.text() == "ground") {
    if (bodies_.places.contains("ground"))
      n.fail("\"ground\" is ambiguous: a body has this name, too", "give the body another name; the ground is -1");
    if (!may_be_ground) n.fail("must be a body, not the ground");
    return kGround;
  }
  if (n.is_number() && !may_be_ground && n.integer(-1) < 0) n.fail("must be a body, not the ground");
  return {refer(n, bodies_, may_be_ground ? -1 : 0)};
}

void Reader::read_points(const Node& n, BodyId a, BodyId b, Vec3& p_A, Vec3& p_B) const {
  if (n.has("points")) {
    refuse_keys(n, {"p_A", "p_B"}, "points");
    const auto points = n["points"].items();
    if (points.size() != 2) n["points"].fail("needs two points, [[x, y, z], [x, y, z]]");
    p_A = point_in(a, points[0].vec3());
    p_B = point_in(b, points[1].vec3());
    return;
  }
  if (!n.has("p_A") && !n.has("p_B")) n.fail("needs \"p_A\" and \"p_B\", or \"points\"");
  p_A = n["p_A"].vec3();
  p_B = n["p_B"].vec3();
}

void Reader::read_frames(const Node& n, BodyId a, BodyId b, const char* key_a, const char* key_b, Pose& X_AF,
                         Pose& X_BM) const {
  if (n.has("at")) {
    refuse_keys(n, {key_a, key_b}, "at");
    const Pose X_WF{n["at"].vec3(), to_quat(axes_from(n))};
    X_AF = frame_in(a, X_WF);
    X_BM = frame_in(b, X_WF);
    return;
  }
  demand_at(n);
  if (!n.has(key_a) && !n.has(key_b)) n.fail(fmt::format("needs \"{}\" and \"{}\", or \"at\"", key_a, key_b));
  X_AF = n[key_a].pose();
  X_BM = n[key_b].pose();
}

void Reader::place_joint(const Node& n, Joint& j) const {
  using Kind = Joint::Kind;
  const std::string& word = kJointWords[static_cast<size_t>(j.kind)];
  if (n.has("points")) {
    if (j.kind != Kind::Distance) n.fail_at("points", "\"points\" is for distance joints, this one is " + word);
    refuse_keys(n, {"X_PF", "X_CM", "at", "axis", "axes", "x"}, "points");
    const auto points = n["points"].items();
    if (points.size() != 2) n["points"].fail("needs two points, [[x, y, z], [x, y, z]]");
    const Vec3 first = points[0].vec3(), second = points[1].vec3(), line = second - first;
    const double length = norm(line);
    if (!(length > 0) || !std::isfinite(length)) n["points"].fail("are no distance apart");
    const Vec3 x = (1 / length) * line;
    const Mat3 about_x = axes_about(x, far_axis(x));
    const Quat q_W = to_quat(Mat3::from_columns(about_x.column(2), about_x.column(0), about_x.column(1)));
    j.X_PF = frame_in(j.parent, {first, q_W});
    j.X_CM = frame_in(j.child, {second, q_W});
    return;
  }
  if (n.has("at")) {
    refuse_keys(n, {"X_PF", "X_CM"}, "at");
    if (j.kind == Kind::Distance) n.fail_at("at", "a distance joint needs \"points\" (or X_PF and X_CM)");
    const bool has_axis = j.kind == Kind::Revolute || j.kind == Kind::Prismatic || j.kind == Kind::Cylindrical;
    if (has_axis && !n.has("axis")) n.fail("needs \"axis\", a direction in W");
    const bool limited = n.has("tension_limit") || n.has("shear_limit");
    Quat q_W;
    if (j.kind == Kind::Universal) {
      refuse_keys(n, {"axis", "x"}, "axes");
      const auto axes = n["axes"].items();
      if (axes.size() != 2) n["axes"].fail("needs two directions in W: of the parent, of the child");
      const Vec3 first = axes[0].direction(), second = axes[1].direction();
      if (!(std::abs(dot(first, second)) < 1e-9))
        n["axes"].fail(fmt::format("must be at right angles; they are at {:.9g} degrees",
                                   std::acos(std::clamp(dot(first, second), -1.0, 1.0)) * 180 / M_PI));
      q_W = to_quat(axes_about((1 / norm(cross(first, second))) * cross(first, second), first));
    } else {
      if (n.has("axes")) n.fail_at("axes", "\"axes\" is for universal joints, this one is " + word);
      if (limited && !n.has("x")) n.fail("tension_limit and shear_limit need \"x\", the direction in W of the pull");
      q_W = to_quat(axes_from(n));
    }
    j.X_PF = frame_in(j.parent, {n["at"].vec3(), q_W});
    j.X_CM = frame_in(j.child, {n["at"].vec3(), q_W});
    return;
  }
  demand_at(n);
  if (!n.has("X_PF") && !n.has("X_CM")) n.fail("needs \"at\", or \"X_PF\" and \"X_CM\"");
  j.X_PF = n["X_PF"].pose();
  j.X_CM = n["X_CM"].pose();
}

Joint Reader::joint_from(const Node& n) const {
  n.only(keys_of("joint"));
  Joint j;
  j.kind = static_cast<Joint::Kind>(n["kind"].word(kJointWords));
  read(n, "name", j.name);
  j.parent = body(n["parent"], true);
  j.child = body(n["child"], true);
  read(n, "tension_limit", j.tension_limit);
  read(n, "shear_limit", j.shear_limit);
  read(n, "moment_limit", j.moment_limit);
  read(n, "rotation_limit", j.rotation_limit);
  place_joint(n, j);
  return j;
}

ZoneElement Reader::element_from(const Node& n) const {
  n.only(keys_of("element"));
  ZoneElement e;
  read(n, "name", e.name);
  e.a = body(n["a"], true);
  e.b = body(n["b"], true);
  read_frames(n, e.a, e.b, "X_AF", "X_BM", e.X_AF, e.X_BM);
  e.translational_stiffness = n["translational_stiffness"].vec3();
  e.rotational_stiffness = n["rotational_stiffness"].vec3();
  read(n, "damping_ratio", e.damping_ratio);
  if (n.has("stations"))
    for (const Node& s : n["stations"].items()) {
      s.only(keys_of("station"));
      e.stations.push_back({s["x"].number(), {refer(s["law"], laws_)}});
    }
  read(n, "crush_through", e.crush_through);
  if (n.has("cracking_y")) e.cracking[0] = cracking_from(n["cracking_y"]);
  if (n.has("cracking_z")) e.cracking[1] = cracking_from(n["cracking_z"]);
  return e;
}

RotationalElement Reader::rotational_element_from(const Node& n) const {
  n.only(keys_of("rotational_element"));
  RotationalElement r;
  read(n, "name", r.name);
  r.joint = {refer(n["joint"], joints_)};
  r.stiffness = n["stiffness"].number();
  read(n, "damping_ratio", r.damping_ratio);
  if (n.has("law")) r.law = {refer(n["law"], laws_, -1)};
  if (n.has("cracking")) r.cracking = cracking_from(n["cracking"]);
  if (n.has("axial_element")) r.axial_element = {refer(n["axial_element"], elements_, -1)};
  read(n, "loose_translational", r.loose_translational);
  read(n, "loose_torsion", r.loose_torsion);
  read(n, "loose_bending", r.loose_bending);
  return r;
}

Cable Reader::cable_from(const Node& n) const {
  n.only(keys_of("cable"));
  Cable c;
  read(n, "name", c.name);
  c.a = body(n["a"], true);
  c.b = body(n["b"], true);
  read_points(n, c.a, c.b, c.p_A, c.p_B);
  c.stiffness = n["stiffness"].number();
  read(n, "pretension", c.pretension);
  read(n, "strength", c.strength);
  return c;
}

SpringDamper Reader::spring_from(const Node& n) const {
  n.only(keys_of("spring"));
  SpringDamper s;
  read(n, "name", s.name);
  s.a = body(n["a"], true);
  s.b = body(n["b"], true);
  read_points(n, s.a, s.b, s.p_A, s.p_B);
  s.free_length = norm(pose_of(s.b) * s.p_B - pose_of(s.a) * s.p_A);
  read(n, "free_length", s.free_length);
  read(n, "spring", s.spring);
  read(n, "damper", s.damper);
  read(n, "tension_strength", s.tension_strength);
  read(n, "compression_strength", s.compression_strength);
  return s;
}

RotationalSpring Reader::rotational_spring_from(const Node& n) const {
  n.only(keys_of("rotational_spring"));
  RotationalSpring s;
  read(n, "name", s.name);
  s.joint = {refer(n["joint"], joints_)};
  read(n, "free_angle", s.free_angle);
  read(n, "spring", s.spring);
  read(n, "damper", s.damper);
  read(n, "strength", s.strength);
  return s;
}

Bushing Reader::bushing_from(const Node& n) const {
  n.only(keys_of("bushing"));
  Bushing b;
  read(n, "name", b.name);
  b.a = body(n["a"], true);
  b.b = body(n["b"], true);
  read_frames(n, b.a, b.b, "X_AF", "X_BM", b.X_AF, b.X_BM);
  const auto six = [&n](const char* key) {
    auto items = n[key].items();
    if (items.size() != 6) n[key].fail("needs six items: along x y z, about x y z");
    return items;
  };
  for (const auto& [key, list] : {std::pair{"spring", b.spring}, std::pair{"damper", b.damper}}) {
    if (!n.has(key)) continue;
    const auto items = six(key);
    for (size_t k = 0; k < 6; ++k) list[k] = characteristic_from(items[k]);
  }
  if (n.has("strength")) {
    const auto items = six("strength");
    for (size_t k = 0; k < 6; ++k)
      if (!items[k].is_null()) b.strength[k] = items[k].number();
  }
  return b;
}

Load Reader::load_from(const Node& n) const {
  n.only(keys_of("load"));
  Load l;
  read(n, "name", l.name);
  l.body = body(n["body"], false);
  if (n.has("at")) {
    refuse_keys(n, {"p_B"}, "at");
    l.p_B = point_in(l.body, n["at"].vec3());
  }
  read(n, "p_B", l.p_B);
  if (!n.has("force") && !n.has("torque")) n.fail("needs \"force\", \"torque\" or both");
  read(n, "force", l.force);
  read(n, "torque", l.torque);
  read(n, "follows_body", l.follows_body);
  if (n.has("table")) {
    const Node t = n["table"];
    t.only(keys_of("load_table"));
    l.time = t["time"].numbers();
    l.factor = t["factor"].numbers();
    if (l.time.empty()) t["time"].fail("is empty");
  }
  return l;
}

void Reader::read_contact(const Node& n, Contact& c) const {
  n.only(keys_of("contact"));
  read(n, "normal", c.normal);
  read(n, "offset", c.offset);
  read(n, "friction", c.friction);
  read(n, "restitution", c.restitution);
  read(n, "body_friction", c.body_friction);
  read(n, "body_restitution", c.body_restitution);
  read(n, "contact_frequency", c.contact_frequency);
  read(n, "ground", c.ground);
  read(n, "bodies", c.bodies);
  if (!n.has("pairs")) return;
  for (const Node& p : n["pairs"].items()) {
    p.only(keys_of("pair"));
    Contact::Pair pair;
    pair.a = body(p["a"], false);
    pair.b = body(p["b"], true);
    const bool ground = pair.b == kGround;
    pair.friction = ground ? c.friction : c.body_friction;
    pair.restitution = ground ? c.restitution : c.body_restitution;
    read(p, "touches", pair.touches);
    read(p, "friction", pair.friction);
    if (p.has("restitution")) refuse_keys(p, {"damping"}, "restitution");
    read(p, "restitution", pair.restitution);
    read(p, "stiffness", pair.stiffness);
    if (p.has("damping")) {
      pair.damping = p["damping"].number();
      if (pair.damping < 0) p["damping"].fail("must not be negative");
    }
    c.pairs.push_back(pair);
  }
}

/// The one key that names an item, and the word for what is asked of it.
Quantity Reader::quantity_from(const Node& n) const {
  const std::pair<const char*, const Names*> items[] = {{"body", &bodies_},
                                                        {"joint", &joints_},
                                                        {"element", &elements_},
                                                        {"rotational", &rotational_elements_},
                                                        {"bushing", &bushings_},
                                                        {"spring", &springs_},
                                                        {"rotational_spring", &rotational_springs_},
                                                        {"cable", &cables_}};
  const char* item = nullptr;
  Quantity q;
  for (const auto& [key, names] : items) {
    if (!n.has(key)) continue;
    if (item) n.fail(fmt::format("names a {} and a {}", item, key));
    item = key;
    q.index = names == &bodies_ ? body(n[key], false).index : refer(n[key], *names);
  }
  if (!item) n.fail("needs a body, joint, element, rotational (element), bushing, spring, rotational_spring or cable");
  std::vector<std::string> words;
  std::vector<Quantity::Kind> kinds;
  for (int k = 0; k < kQuantityKinds; ++k) {
    const auto kind = static_cast<Quantity::Kind>(k);
    if (std::string_view(traits_of(kind).item) != item) continue;
    words.push_back(traits_of(kind).word);
    kinds.push_back(kind);
  }
  q.kind = kinds[static_cast<size_t>(n["quantity"].word(words))];
  return q;
}

Trigger Reader::trigger_from(const Node& n) const {
  n.only(keys_of("trigger"));
  Trigger t;
  t.quantity = quantity_from(n);
  if (traits_of(t.quantity.kind).components == 1) {
    if (n.has("component") && n["component"].word(kComponentWords) != 3)
      n["component"].fail("this quantity has one number only; \"magnitude\" takes its sign away");
    t.component = n.has("component") ? 3 : 0;
  } else {
    t.component = n["component"].word(kComponentWords);
  }
  t.rising = has_first(n, "rises_to", "falls_to");
  t.limit = n[t.rising ? "rises_to" : "falls_to"].number();
  return t;
}

Output Reader::output_from(const Node& n) const {
  n.only(keys_of("output"));
  Output o;
  o.name = n["name"].text();
  o.quantity = quantity_from(n);
  read(n, "rate", o.rate);
  return o;
}

/// A zone element, or a rotational one.
void Reader::element_of(const Node& n, Action& a) const {
  if (has_first(n, "element", "rotational")) {
    a.element = {refer(n["element"], elements_)};
  } else {
    a.rotational = refer(n["rotational"], rotational_elements_);
  }
}

Action Reader::action_from(const Node& n) const {
  using Kind = Action::Kind;
  Action a;
  n.only(keys_of("action"));
  a.kind = static_cast<Kind>(n["do"].word(kActionWords));
  const auto only = [&](std::vector<std::string> keys) {
    keys.push_back("do");
    for (const std::string& key : keys_of("action"))
      if (n.has(key.c_str()) && std::find(keys.begin(), keys.end(), key) == keys.end())
        n.fail_at(key, fmt::format("\"{}\" does not go with \"{}\"", key, n["do"].text()));
  };
  switch (a.kind) {
    case Kind::RemoveElement:
      only({"element", "rotational"});
      element_of(n, a);
      break;
    case Kind::SwitchLaw:
      only({"element", "rotational", "law", "ramp", "stiffness_share"});
      element_of(n, a);
      a.law = {refer(n["law"], laws_)};
      read(n, "ramp", a.ramp);
      read(n, "stiffness_share", a.stiffness_share);
      break;
    case Kind::ReleaseJoint:
    case Kind::LoosenJoint:
      only({"joint"});
      a.joint = {refer(n["joint"], joints_)};
      break;
    case Kind::ReplaceBody:
      only({"body", "replacement"});
      a.body = body(n["body"], false);
      a.replacement = body_from(n["replacement"]);
      break;
    case Kind::ReleaseCable:
      only({"cable"});
      a.cable = refer(n["cable"], cables_);
      break;
    case Kind::RemoveSpring:
      only({"spring"});
      a.index = refer(n["spring"], springs_);
      break;
    case Kind::RemoveRotationalSpring:
      only({"rotational_spring"});
      a.index = refer(n["rotational_spring"], rotational_springs_);
      break;
    case Kind::RemoveBushing:
      only({"bushing"});
      a.index = refer(n["bushing"], bushings_);
      break;
    case Kind::RemoveLoad:
    case Kind::ApplyLoad:
      only({"load"});
      a.index = refer(n["load"], loads_);
      break;
  }
  return a;
}

Event Reader::event_from(const Node& n) const {
  n.only(keys_of("event"));
  Event e;
  if (!n.has("time") && !n.has("when")) n.fail("needs \"time\" or \"when\"");
  read(n, "time", e.time);
  read(n, "name", e.name);
  if (n.has("when")) {
    for (const Node& t : n["when"].items()) e.triggers.push_back(trigger_from(t));
    if (e.triggers.empty()) n["when"].fail("is empty: name at least one limit, or give \"time\" alone");
  }
  for (const Node& a : n["actions"].items()) e.actions.push_back(action_from(a));
  return e;
}

RunSettings Reader::run_from(const Node& n) const {
  n.only(keys_of("run"));
  RunSettings r;
  if (n.has("duration")) r.duration = n["duration"].positive();
  if (n.has("step")) r.step = n["step"].positive();
  if (r.step > 0 && r.duration > kMostSteps * r.step)
    n["step"].fail(fmt::format("must be at least {:.3g} for the duration of {:g} s: a run takes at most {:g} steps",
                               r.duration / kMostSteps, r.duration, kMostSteps));
  if (r.duration > 0 && r.step > r.duration)
    n["step"].fail(fmt::format("must not be longer than the run of {:g} s", r.duration));
  if (n.has("stability_share")) r.stability_share = n["stability_share"].positive();
  if (r.stability_share > 1) n["stability_share"].fail("must be at most 1");
  if (n.has("frame_interval")) r.frame_interval = n["frame_interval"].positive();
  if (n.has("equilibrium")) r.equilibrium = n["equilibrium"].flag();
  if (n.has("rest_speed")) {
    r.rest_speed = n["rest_speed"].number();
    if (*r.rest_speed < 0) n["rest_speed"].fail("must not be negative");
  }
  return r;
}

Model Reader::read_model(RunSettings* run) {
  Model& m = model_;
  attempt([&] { root_.only(keys_of("model")); });
  if (root_["format"].text() != kModelFormat) root_["format"].fail(std::string("must be \"") + kModelFormat + "\"");
  const int version = root_["version"].integer(1);
  if (version > kModelVersion)
    root_["version"].fail(fmt::format("is {}; this program reads versions 1 to {}", version, kModelVersion));
  bodies_ = names_of(root_, "bodies", "body");
  joints_ = names_of(root_, "joints", "joint");
  elements_ = names_of(root_, "elements", "element");
  rotational_elements_ = names_of(root_, "rotational_elements", "rotational element");
  laws_ = names_of(root_, "laws", "law");
  cables_ = names_of(root_, "cables", "cable");
  springs_ = names_of(root_, "springs", "spring");
  rotational_springs_ = names_of(root_, "rotational_springs", "rotational spring");
  bushings_ = names_of(root_, "bushings", "bushing");
  loads_ = names_of(root_, "loads", "load");
  attempt([&] { read(root_, "name", m.name); });
  attempt([&] { read(root_, "gravity", m.gravity); });
  attempt([&] { read(root_, "damping_frequency", m.damping_frequency); });
  attempt([&] { read(root_, "is_planar", m.is_planar); });
  if (root_.has("run"))
    attempt([&] {
      const RunSettings settings = run_from(root_["run"]);
      if (run) *run = settings;
    });
  attempt([&] {
    const bool is_known_to_fail = root_.has("bodies") && !root_["bodies"].is_list();  // told with the items
    if (!is_known_to_fail && root_["bodies"].items().empty())
      root_["bodies"].fail("is empty: a model has at least one body");
  });
  // the others' places are worked out from the bodies' poses
  each("bodies", m.bodies, [](const Node& n) { return body_from(n); });
  each("joints", m.joints, [this](const Node& n) { return joint_from(n); });
  each("elements", m.elements, [this](const Node& n) { return element_from(n); });
  each("rotational_elements", m.rotational_elements, [this](const Node& n) { return rotational_element_from(n); });
  each("laws", m.laws, [](const Node& n) { return law_from(n); });
  each("cables", m.cables, [this](const Node& n) { return cable_from(n); });
  each("springs", m.springs, [this](const Node& n) { return spring_from(n); });
  each("rotational_springs", m.rotational_springs, [this](const Node& n) { return rotational_spring_from(n); });
  each("bushings", m.bushings, [this](const Node& n) { return bushing_from(n); });
  each("loads", m.loads, [this](const Node& n) { return load_from(n); });
  if (root_.has("contact")) attempt([&] { read_contact(root_["contact"], m.contact); });
  each("events", m.events, [this](const Node& n) { return event_from(n); });
  each("outputs", m.outputs, [this](const Node& n) { return output_from(n); });
  if (!found_.empty()) throw InputError(std::move(found_));
  for (const Complaint& c : find_complaints(m)) {
    found_.push_back(document_.make_diagnostic("E601", c.path, c.message()));
    if (found_.size() >= kMostComplaints) break;
  }
  if (!found_.empty()) throw InputError(std::move(found_));
  return std::move(m);
}

}  // namespace

void choose_steps(const RunSettings& run, Options& o) {
  constexpr double most_turn = 0.03;  // a free top that wobbles keeps its energy to 1e-4 then
  constexpr int least_steps = 200;
  o.step_safety = run.stability_share, o.most_turn = most_turn, o.least_steps = least_steps;
}

Model model_from_json(const std::string& text, const std::string& name, RunSettings* run) {
  return Reader(text, name).read_model(run);
}

void refuse_velocities(const Model& m, const std::string& text, const std::string& name) {
  std::vector<Diagnostic> found;
  std::optional<JsonDocument> document;
  for (size_t i = 0; i < m.bodies.size() && found.size() < kMostComplaints; ++i) {
    const Body& b = m.bodies[i];
    for (const auto& [key, v] : {std::pair{"v_WB", b.v_WB}, {"w_WB", b.w_WB}}) {
      if (norm(v) == 0) continue;
      if (!document) document.emplace(text, name);
      const Complaint c{fmt::format("bodies[{}].{}", i, key), b.name,
                        "would be lost, because the run begins with the equilibrium, at rest"};
      found.push_back(document->make_diagnostic(
          "E601", c.path, c.message(),
          "\"run\": {\"equilibrium\": false} in the file, or mbs run --no-equilibrium, begins with it"));
    }
  }
  if (!found.empty()) throw InputError(std::move(found));
}

}  // namespace topple::mbs
