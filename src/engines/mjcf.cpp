#include "engines/mjcf.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engines/ground.h"
#include "engines/requirements.h"

namespace topple::engines {

namespace {

using Kind = mbs::Joint::Kind;

std::string text_of(const Vec3& v) { return fmt::format("{:.17g} {:.17g} {:.17g}", v.x, v.y, v.z); }
std::string text_of(const Quat& q) { return fmt::format("{:.17g} {:.17g} {:.17g} {:.17g}", q.w, q.x, q.y, q.z); }
std::string text_of(const Pose& X) { return fmt::format("pos=\"{}\" quat=\"{}\"", text_of(X.p), text_of(X.q)); }

/// Direct spring and damper of MuJoCo's contact, per unit of mass; the damper takes no more in a step than all speed.
std::string contact_of(double frequency, double restitution, double friction, double step) {
  return fmt::format("solref=\"{:.17g} {:.17g}\" solimp=\"0.99 0.99 0.001\" friction=\"{:.17g} 0 0\"",
                     -frequency * frequency, -std::min(2 * find_damping_ratio(restitution) * frequency, 1 / step),
                     friction);
}

/// MuJoCo asks for A + B >= C of principal moments to the last bit, which flat bodies miss by round-off.
Mat3 round_up(const Mat3& inertia) {
  constexpr double margin = 1e-12;  // of their sum; more than MuJoCo's own round-off
  const Vec3 I = calc_principal_moments(inertia);
  const double lacking = I.z - I.x - I.y + margin * (I.x + I.y + I.z);
  return lacking > 0 ? inertia + Mat3::diagonal({lacking, lacking, lacking}) : inertia;
}

class Writer {
 public:
  Writer(const Course& course, const Articulation& articulation, const Ties& ties)
      : course_(course), model_(course.model()), articulation_(articulation), ties_(ties) {
    const size_t B = model_.bodies.size();
    children_.resize(B);
    twins_at_.resize(B);
    sites_at_.resize(B);
    copies_.assign(B, 1);
    for (size_t i = 0; i < articulation.branches.size(); ++i) {
      const int inboard = articulation.branches[i].inboard;
      (inboard < 0 ? roots_ : children_[static_cast<size_t>(inboard)]).push_back(i);
    }
    for (const int loop : articulation.loops) {
      const mbs::Joint& j = model_.joints[static_cast<size_t>(loop)];
      out_.twin_of_loop.push_back(-1);
      if (j.kind == Kind::Distance) {
        add_site(j.parent, "p", loop, j.X_PF.p);
        add_site(j.child, "c", loop, j.X_CM.p);
        continue;
      }
      Branch b{j.child.index, j.parent.index, loop, false};
      if (is_ground(model_, b.body)) b = {j.parent.index, j.child.index, loop, true};
      if (is_ground(model_, b.inboard)) b.inboard = -1;
      ++copies_[static_cast<size_t>(b.body)];
      out_.twin_of_loop.back() = out_.twins++;
      (b.inboard < 0 ? root_twins_ : twins_at_[static_cast<size_t>(b.inboard)]).push_back(twins_.size());
      twins_.push_back(b);
    }
  }

  Mjcf write(double step) {
    const mbs::Contact& c = model_.contact;
    add("<mujoco><compiler angle=\"radian\" boundmass=\"0\" boundinertia=\"0\" balanceinertia=\"false\" "
        "inertiafromgeom=\"false\"/>");
    add(fmt::format(
        "<option timestep=\"{:.17g}\" gravity=\"{}\" solver=\"Newton\" iterations=\"200\" "
        "tolerance=\"1e-13\" cone=\"elliptic\" impratio=\"10\"><flag energy=\"enable\" refsafe=\"disable\"/>"
        "</option>",
        step, text_of(model_.gravity)));
    add_sizes();
    // bits of the geoms are set when the model is there
    add("<default><geom contype=\"0\" conaffinity=\"0\" condim=\"3\" " +
        contact_of(c.contact_frequency, c.body_restitution, c.body_friction, step) + "/></default>");
    add_meshes();
    add("<worldbody>");
    if (can_touch_ground(model_)) {
      Mat3 R;
      const Vec3 z = c.normal, x = std::abs(z.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
      const Vec3 y = (1 / norm(cross(z, x))) * cross(z, x);
      R = Mat3::from_columns(cross(y, z), y, z);
      add(fmt::format("<geom name=\"ground\" type=\"plane\" size=\"0 0 1\" contype=\"{}\" priority=\"1\" {} {}/>",
                      kGroundBit, text_of(Pose{c.offset * z, to_quat(R)}),
                      contact_of(c.contact_frequency, c.restitution, c.friction, step)));
    }
    for (size_t b = 0; b < model_.bodies.size(); ++b)
      if (model_.bodies[b].fixed && !model_.bodies[b].shapes.empty()) {
        add(fmt::format("<body name=\"b{}\" {}>", b, text_of(course_.motion().X_WB[b])));
        add_geoms(b);
        add("</body>");
      }
    out_.text += root_sites_;
    for (const size_t twin : root_twins_) add_body(twins_[twin], static_cast<int>(twin));
    for (const size_t i : roots_) add_body(articulation_.branches[i], -1);
    add("</worldbody>");
    if (!ties_.pairs.empty() && can_touch_bodies(model_)) {
      add("<contact>");
      for (const auto& [a, b] : ties_.pairs)
        if (has_place(a) && has_place(b)) add(fmt::format("<exclude body1=\"b{}\" body2=\"b{}\"/>", a, b));
      add("</contact>");
    }
    add_loops(step);
    add("</mujoco>");
    return std::move(out_);
  }

 private:
  void add(const std::string& line) { out_.text += line + "\n"; }

  const std::vector<mbs::Shape>& shapes_of(size_t b) const { return course_.bodies()[b].shapes; }

  void add_sizes() {
    const bool touches = can_touch_ground(model_) || can_touch_bodies(model_);
    size_t points = 0, moving = 0;
    for (size_t b = 0; b < model_.bodies.size(); ++b) {
      if (model_.bodies[b].fixed) continue;
      ++moving;
      if (touches) points += 8 * shapes_of(b).size();
    }
    const size_t rows = 3 * points + 12 * articulation_.loops.size() + 10;
    const size_t nv = 6 * (moving + articulation_.loops.size());
    // Newton's method needs some matrices of nv x nv where there are constraints
    const size_t stack = (rows > 10 ? 8 * nv * nv : 0) + 400 * (nv + rows) + 100000;
    add(fmt::format("<size nconmax=\"{}\" njmax=\"{}\" nstack=\"{}\"/>", points + 10, rows, stack));
  }

  void add_meshes() {
    std::string list;
    for (size_t b = 0; b < model_.bodies.size(); ++b)
      for (size_t i = 0; i < shapes_of(b).size(); ++i) {
        const mbs::Shape& s = shapes_of(b)[i];
        if (s.kind != mbs::Shape::Kind::Hull) continue;
        list += fmt::format("<mesh name=\"m{}.{}\" vertex=\"", b, i);
        for (const Vec3& v : s.vertices) list += text_of(v) + " ";
        list += "\"/>\n";
      }
    if (!list.empty()) add("<asset>\n" + list + "</asset>");
  }

  void add_geoms(size_t b) {
    for (size_t i = 0; i < shapes_of(b).size(); ++i) {
      const mbs::Shape& s = shapes_of(b)[i];
      std::string shape;
      switch (s.kind) {
        case mbs::Shape::Kind::Box:
          shape = fmt::format("type=\"box\" size=\"{}\"", text_of(s.half));
          break;
        case mbs::Shape::Kind::Sphere:
          shape = fmt::format("type=\"sphere\" size=\"{:.17g}\"", s.radius);
          break;
        case mbs::Shape::Kind::Hull:
          shape = fmt::format("type=\"mesh\" mesh=\"m{}.{}\"", b, i);
          break;
        case mbs::Shape::Kind::Plane:
          shape = "type=\"plane\" size=\"0 0 1\"";
          break;
      }
      add(fmt::format("<geom name=\"g{}.{}\" {} {}/>", b, i, shape, text_of(s.X_BS)));
    }
  }

  /// Whether MuJoCo's model has a body of it.
  bool has_place(int body) const {
    const mbs::Body& b = model_.bodies[static_cast<size_t>(body)];
    return !b.fixed || !b.shapes.empty();
  }
  Pose pose_of(int body) const { return body < 0 ? Pose{} : course_.motion().X_WB[static_cast<size_t>(body)]; }

  /// A body with what hangs on it; of a twin (twin >= 0) itself alone.
  void add_body(const Branch& b, int twin) {
    const size_t body = static_cast<size_t>(b.body);
    const Pose X_WB = pose_of(b.body);
    const Pose X_PB = inverse(pose_of(b.inboard)) * X_WB;
    add(fmt::format("<body name=\"{}{}\" {}>", twin < 0 ? "b" : "t", twin < 0 ? b.body : twin, text_of(X_PB)));
    const BodyNow& now = course_.bodies()[body];
    const double share = 1.0 / copies_[body];
    const Mat3 I = round_up(share * now.inertia);
    add(fmt::format(
        "<inertial pos=\"{}\" mass=\"{:.17g}\" fullinertia=\"{:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}\"/>",
        text_of(now.p_BBcm), share * now.mass, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)));
    add_joint(b, X_WB);
    if (twin < 0) {
      add_geoms(body);
      out_.text += sites_at_[body];
      for (const size_t t : twins_at_[body]) add_body(twins_[t], static_cast<int>(t));
      for (const size_t i : children_[body]) add_body(articulation_.branches[i], -1);
    }
    add("</body>");
  }

  void add_joint(const Branch& b, const Pose& X_WB) {
    if (b.joint < 0) return add(fmt::format("<freejoint name=\"f{}\"/>", b.body));
    const mbs::Joint& j = model_.joints[static_cast<size_t>(b.joint)];
    const Pose X_BO = b.reversed ? j.X_PF : j.X_CM;  // frame on this body
    const Pose X_WI = b.reversed ? frame_in_world(j.child, j.X_CM) : frame_in_world(j.parent, j.X_PF);
    const Mat3 R_BO = to_matrix(X_BO.q), R_WI = to_matrix(X_WI.q), R_WB = to_matrix(X_WB.q);
    const auto joint = [&](int number, const char* type, const Vec3& axis) {
      add(fmt::format("<joint name=\"j{}.{}\" type=\"{}\" pos=\"{}\" axis=\"{}\"/>", b.joint, number, type,
                      text_of(X_BO.p), text_of(axis)));
    };
    switch (j.kind) {
      case Kind::Fixed:
      case Kind::Distance:
        break;
      case Kind::Revolute:
        joint(0, "hinge", R_BO.column(2));
        break;
      case Kind::Spherical:
        joint(0, "ball", {0, 0, 1});
        break;
      case Kind::Universal:  // first the axis that the inboard body holds: x of F, or y of M on the child
        joint(0, "hinge", transpose_times(R_WB, R_WI.column(b.reversed ? 1 : 0)));
        joint(1, "hinge", R_BO.column(b.reversed ? 0 : 1));
        break;
      case Kind::Prismatic:
        joint(0, "slide", R_BO.column(2));
        break;
      case Kind::Cylindrical:
        joint(0, "slide", R_BO.column(2));
        joint(1, "hinge", R_BO.column(2));
        break;
    }
  }

  Pose frame_in_world(mbs::BodyId id, const Pose& X_BF) const {
    return id == mbs::kGround ? X_BF : pose_of(id.index) * X_BF;
  }
  void add_site(mbs::BodyId id, const char* name, int loop, const Vec3& p) {
    const bool moves = !is_ground(model_, id.index);
    const Vec3 at = moves ? p : frame_in_world(id, {p, {}}).p;
    (moves ? sites_at_[static_cast<size_t>(id.index)] : root_sites_) +=
        fmt::format("<site name=\"{}{}\" pos=\"{}\"/>\n", name, loop, text_of(at));
  }

  void add_loops(double step) {
    if (articulation_.loops.empty()) return;
    // as hard as MuJoCo recommends for the step: critically damped, time constant of two steps
    const std::string hard = fmt::format("solref=\"{:.17g} 1\" solimp=\"0.9999 0.9999 0.001\"", 2 * step);
    std::string equality, tendon;
    for (size_t i = 0; i < articulation_.loops.size(); ++i) {
      const int loop = articulation_.loops[i];
      if (const int twin = out_.twin_of_loop[i]; twin >= 0) {
        equality += fmt::format("<weld name=\"e{}\" body1=\"b{}\" body2=\"t{}\" {}/>\n", loop,
                                twins_[static_cast<size_t>(twin)].body, twin, hard);
      } else {
        tendon += fmt::format("<spatial name=\"d{0}\"><site site=\"p{0}\"/><site site=\"c{0}\"/></spatial>\n", loop);
        equality += fmt::format("<tendon name=\"e{0}\" tendon1=\"d{0}\" polycoef=\"0 0 0 0 0\" {1}/>\n", loop, hard);
      }
    }
    if (!tendon.empty()) add("<tendon>\n" + tendon + "</tendon>");
    add("<equality>\n" + equality + "</equality>");
  }

  const Course& course_;
  const mbs::Model& model_;
  const Articulation& articulation_;
  const Ties& ties_;
  std::vector<size_t> roots_, root_twins_;
  std::vector<std::vector<size_t>> children_, twins_at_;  // branches and twins that hang on a body (B)
  std::vector<Branch> twins_;
  std::string root_sites_;
  std::vector<std::string> sites_at_;  // ends of distances (B)
  std::vector<int> copies_;            // among which a body's mass is shared (B)
  Mjcf out_;
};

}  // namespace

Mjcf make_mjcf(const Course& course, const Articulation& articulation, const Ties& ties, double step) {
  return Writer(course, articulation, ties).write(step);
}

}  // namespace topple::engines
