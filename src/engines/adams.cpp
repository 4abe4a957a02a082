#include "engines/adams.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <set>

#include "base/unit.h"
#include "engines/engine.h"

namespace topple::engines {

namespace {

using mbs::BodyId;
using mbs::Characteristic;

/// The shortest digits that give the number back, with a point or an exponent.
std::string num(double x) { return fmt::format("{}", x == 0 ? 0.0 : x); }
std::string num(const Vec3& v) { return num(v.x) + ", " + num(v.y) + ", " + num(v.z); }

/// Within an expression, where no two operators follow each other.
std::string term(double x) { return x < 0 ? "(" + num(x) + ")" : num(x); }

/// Names of ADAMS: letters, digits, underscores.
std::string plain_name(const std::string& name) {
  std::string out;
  for (const char c : name) out += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return out;
}

/// Euler angles about z, the new x, the new z [deg].
std::string calc_reuler(const Quat& q) {
  const Mat3 R = to_matrix(q);
  const double theta = std::atan2(std::hypot(R(0, 2), R(1, 2)), R(2, 2));
  double psi = 0, phi = 0;
  if (std::hypot(R(0, 2), R(1, 2)) > 1e-12) {
    psi = std::atan2(R(0, 2), -R(1, 2));
    phi = std::atan2(R(2, 0), R(2, 1));
  } else {
    psi = std::atan2(R(1, 0), R(0, 0));  // both turn about one axis: the first takes it all
  }
  const auto degrees = [](double a) { return num(a / unit::deg) + "D"; };
  return degrees(psi) + ", " + degrees(theta) + ", " + degrees(phi);
}

/// What is lost, counted by kind.
class Losses {
 public:
  void add(const std::string& what) {
    if (count_[what]++ == 0) order_.push_back(what);
  }
  std::vector<std::string> sentences() const {
    std::vector<std::string> out;
    for (const std::string& what : order_) out.push_back(fmt::format("{} x {}", count_.at(what), what));
    return out;
  }

 private:
  std::map<std::string, int> count_;
  std::vector<std::string> order_;
};

class Dataset {
 public:
  Dataset(const mbs::Model& model, const mbs::RunSettings& settings) : model_(model), settings_(settings) {}

  AdamsFiles make(const std::string& name) {
    text_ = "ADAMS/View model name: " + plain_name(model_.name.empty() ? name : model_.name) + "\n";
    section("SYSTEM UNITS");
    text_ += "UNITS/\n, FORCE = NEWTON\n, MASS = KILOGRAM\n, LENGTH = METER\n, TIME = SECOND\n";
    section("PARTS");
    text_ += "PART/1, GROUND\n";
    world_ = add_marker(mbs::kGround, Pose{});
    for (size_t b = 0; b < model_.bodies.size(); ++b) add_body(b);
    section("CONSTRAINTS");
    for (const mbs::Joint& j : model_.joints) add_joint(j);
    section("FORCES");
    for (const mbs::ZoneElement& e : model_.elements) add_element(e);
    for (const mbs::RotationalElement& e : model_.rotational_elements) add_rotational(e);
    for (const mbs::Bushing& b : model_.bushings) add_bushing(b);
    for (const mbs::SpringDamper& s : model_.springs) add_spring(s);
    for (const mbs::RotationalSpring& s : model_.rotational_springs) add_rotational_spring(s);
    for (const mbs::Cable& c : model_.cables) add_cable(c);
    for (const mbs::Load& l : model_.loads) add_load(l);
    add_contacts();
    section("GRAVITATIONAL ACCELERATION");
    text_ += fmt::format("ACCGRAV/\n, IGRAV = {}\n, JGRAV = {}\n, KGRAV = {}\n", num(model_.gravity.x),
                         num(model_.gravity.y), num(model_.gravity.z));
    section("OUTPUT REQUESTS");
    for (size_t b = 0; b < model_.bodies.size(); ++b)
      if (centre_[b] > 0) {
        statement("REQUEST", ++requests_, model_.bodies[b].name);
        text_ += fmt::format(", DISPLACEMENT\n, I = {}\n, J = {}\n, COMMENT = {}\n", centre_[b], world_,
                             plain_name(model_.bodies[b].name));
      }
    text_ += "!\nOUTPUT/\n, REQSAVE\n!\nEND\n";
    const std::string commands = make_commands(name);
    return {std::move(text_), commands, losses_.sentences()};
  }

 private:
  void section(const char* title) { text_ += fmt::format("!\n!{:-^78}\n!\n", fmt::format(" {} ", title)); }
  void statement(const char* kind, int id, const std::string& name) {
    if (!name.empty()) text_ += fmt::format("! adams_view_name='{}'\n", plain_name(name));
    text_ += fmt::format("{}/{}\n", kind, id);
  }

  bool is_ground(BodyId b) const { return b == mbs::kGround || model_.bodies[static_cast<size_t>(b.index)].fixed; }
  int part_of(BodyId b) const { return is_ground(b) ? 1 : b.index + 2; }
  Pose X_WB(BodyId b) const { return b == mbs::kGround ? Pose{} : model_.bodies[static_cast<size_t>(b.index)].X_WB; }

  int add_marker(BodyId body, const Pose& X_BM) {
    // the frame of a fixed body is that of the ground part
    const Pose X = is_ground(body) ? X_WB(body) * X_BM : X_BM;
    text_ += fmt::format("MARKER/{}\n, PART = {}\n, QP = {}\n, REULER = {}\n", ++markers_, part_of(body), num(X.p),
                         calc_reuler(X.q));
    return markers_;
  }
  int add_marker(BodyId body, const Vec3& p_B) { return add_marker(body, Pose{p_B, {}}); }

  void add_body(size_t index) {
    const mbs::Body& body = model_.bodies[index];
    const BodyId id{static_cast<int>(index)};
    centre_.push_back(0);
    graphics_.emplace_back();
    if (!body.fixed) {
      Eigen::Matrix3d I;
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) I(i, k) = body.inertia(i, k);
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(I);
      // axes of the centre's marker are the principal ones: the sign of products of inertia does not matter
      Quat q_BC;
      Vec3 moments{body.inertia(0, 0), body.inertia(1, 1), body.inertia(2, 2)};
      const double off = std::abs(I(0, 1)) + std::abs(I(0, 2)) + std::abs(I(1, 2));
      if (off > 1e-12 * I.trace()) {
        Eigen::Matrix3d R = principal.eigenvectors();
        if (R.determinant() < 0) R.col(2) *= -1;
        Mat3 axes;
        for (int i = 0; i < 3; ++i)
          for (int k = 0; k < 3; ++k) axes(i, k) = R(i, k);
        q_BC = to_quat(axes);
        moments = {principal.eigenvalues()[0], principal.eigenvalues()[1], principal.eigenvalues()[2]};
      }
      statement("PART", part_of(id), body.name);
      const Vec3 w_C = transpose_times(to_matrix(body.X_WB.q * q_BC), body.w_WB);
      text_ += fmt::format(", MASS = {}\n, CM = {}\n, IP = {}\n, QG = {}\n, REULER = {}\n", num(body.mass),
                           markers_ + 1, num(moments), num(body.X_WB.p), calc_reuler(body.X_WB.q));
      text_ += fmt::format(", VX = {}, VY = {}, VZ = {}\n, WX = {}, WY = {}, WZ = {}\n", num(body.v_WB.x),
                           num(body.v_WB.y), num(body.v_WB.z), num(w_C.x), num(w_C.y), num(w_C.z));
      centre_[index] = add_marker(id, Pose{{}, q_BC});
    }
    for (const mbs::Shape& s : body.shapes) add_shape(id, s);
  }

  void add_shape(BodyId id, const mbs::Shape& s) {
    auto& list = graphics_[static_cast<size_t>(id.index)];
    if (s.kind == mbs::Shape::Kind::Box) {
      const int corner = add_marker(id, s.X_BS * Pose{-s.half, {}});
      statement("GRAPHICS", ++graphic_, {});
      text_ += fmt::format(", BOX\n, CORNER = {}\n, X = {}, Y = {}, Z = {}\n", corner, num(2 * s.half.x),
                           num(2 * s.half.y), num(2 * s.half.z));
      list.push_back(graphic_);
    } else if (s.kind == mbs::Shape::Kind::Sphere) {
      const int centre = add_marker(id, s.X_BS);
      statement("GRAPHICS", ++graphic_, {});
      text_ += fmt::format(", ELLIPSOID\n, CM = {}\n, XS = {}, YS = {}, ZS = {}\n", centre, num(2 * s.radius),
                           num(2 * s.radius), num(2 * s.radius));
      list.push_back(graphic_);
    } else {
      losses_.add("a polyhedron or plane of a body is left out: it touches nothing");
    }
  }

  void add_joint(const mbs::Joint& j) {
    using Kind = mbs::Joint::Kind;
    const int F = add_marker(j.parent, j.X_PF), M = add_marker(j.child, j.X_CM);
    joint_.push_back({0, F, M});
    if (is_ground(j.parent) && is_ground(j.child)) return;
    const char* word = nullptr;
    switch (j.kind) {
      case Kind::Fixed:
        word = "FIXED";
        break;
      case Kind::Revolute:
        word = "REVOLUTE";
        break;
      case Kind::Spherical:
        word = "SPHERICAL";
        break;
      case Kind::Universal:
        word = "HOOKE";
        break;
      case Kind::Prismatic:
        word = "TRANSLATIONAL";
        break;
      case Kind::Cylindrical:
        word = "CYLINDRICAL";
        break;
      case Kind::Distance:
        break;
    }
    const double most = std::min({j.tension_limit, j.shear_limit, j.moment_limit, j.rotation_limit});
    if (most < mbs::kUnlimited) losses_.add("a joint never comes off: the limits of its reaction are left out");
    if (word == nullptr) {
      losses_.add("a joint that keeps a distance is left out");
      return;
    }
    joint_.back().id = ++joints_;
    statement("JOINT", joints_, j.name);
    text_ += fmt::format(", {}\n, I = {}\n, J = {}\n", word, F, M);
  }

  void add_element(const mbs::ZoneElement& e) {
    if (!e.stations.empty()) losses_.add("a zone is elastic for ever: its resistance curves are left out");
    const Vec3 k = e.translational_stiffness, kt = e.rotational_stiffness;
    const double rate = 2 * e.damping_ratio / model_.damping_frequency;
    element_.push_back(put_bushing(e.name, e.a, e.b, e.X_AF, e.X_BM, k, kt, rate * k, rate * kt));
  }

  int put_bushing(const std::string& name, BodyId a, BodyId b, const Pose& X_AF, const Pose& X_BM, const Vec3& k,
                  const Vec3& kt, const Vec3& c, const Vec3& ct) {
    const int J = add_marker(a, X_AF), I = add_marker(b, X_BM);
    if (is_ground(a) && is_ground(b)) return 0;
    statement("BUSHING", ++bushings_, name);
    text_ += fmt::format(", I = {}\n, J = {}\n, K = {}\n, KT = {}\n, C = {}\n, CT = {}\n", I, J, num(k), num(kt),
                         num(c), num(ct));
    return bushings_;
  }

  /// A number for a curve or a surface; `rows` is what stands behind Y, with the second variable first in a surface.
  int add_spline(const std::vector<double>& x, const std::vector<std::vector<double>>& rows) {
    statement("SPLINE", ++splines_, {});
    const auto put = [this](const char* key, const std::vector<double>& values) {
      text_ += fmt::format(", {} = ", key);
      for (size_t i = 0; i < values.size(); ++i) {
        if (i > 0) text_ += i % 6 == 0 ? "\n, " : ", ";  // short lines
        text_ += num(values[i]);
      }
      text_ += "\n";
    };
    put("X", x);
    for (const auto& row : rows) put("Y", row);
    return splines_;
  }

  /// Moment over rotation from 0: elastic up to the limit, then along it.
  static std::vector<std::pair<double, double>> calc_curve(const std::vector<double>& plastic, const double* limit,
                                                           double stiffness) {
    std::vector<std::pair<double, double>> points{{0, 0}};
    for (size_t j = 0; j < plastic.size(); ++j) {
      const double angle = plastic[j] + limit[j] / stiffness;
      if (angle > points.back().first + 1e-12) points.emplace_back(angle, limit[j]);
    }
    return points;
  }
  static double interpolate(const std::vector<std::pair<double, double>>& points, double x) {
    if (x >= points.back().first) return points.back().second;
    size_t i = 1;
    while (points[i].first < x) ++i;
    const double s = (x - points[i - 1].first) / (points[i].first - points[i - 1].first);
    return points[i - 1].second + s * (points[i].second - points[i - 1].second);
  }

  void add_rotational(const mbs::RotationalElement& e) {
    const JointIds& j = joint_[static_cast<size_t>(e.joint.index)];
    rotational_.push_back(0);
    if (j.id == 0) return;
    const double damping = 2 * e.damping_ratio / model_.damping_frequency * e.stiffness;
    std::string moment = fmt::format("{}*AZ({},{})", num(e.stiffness), j.M, j.F);
    const bool has_law = e.law.index >= 0;
    if (has_law && !model_.laws[static_cast<size_t>(e.law.index)].moment_z.plastic_rotation.empty()) {
      losses_.add("a hinge gives back on unloading what it took: its moment follows the family of curves both ways");
      if (e.axial_element.is_valid()) losses_.add("a hinge keeps its length as it turns");
      const int spline = spline_of(e);
      // the force that the parent pulls the child with, tension positive
      moment = fmt::format("AKISPL(AZ({},{}), -JOINT({},1,2,{}), {})", j.M, j.F, j.id, j.F, spline);
    }
    statement("SFORCE", ++sforces_, e.name);
    text_ += fmt::format(", ROTATIONAL\n, I = {}\n, J = {}\n, FUNCTION = -{}\n, -{}*WZ({},{},{})\n", j.M, j.F, moment,
                         num(damping), j.M, j.F, j.F);
    rotational_.back() = sforces_;
  }

  int spline_of(const mbs::RotationalElement& e) {
    const auto key = std::pair{e.law.index, e.stiffness};
    if (const auto known = hinge_spline_.find(key); known != hinge_spline_.end()) return known->second;
    const mbs::MomentFamily& f = model_.laws[static_cast<size_t>(e.law.index)].moment_z;
    const size_t J = f.plastic_rotation.size();
    std::set<double> angles;
    std::vector<std::vector<std::pair<double, double>>> positive, negative;
    double softest = 0;
    for (size_t n = 0; n < f.normal_force.size(); ++n) {
      positive.push_back(calc_curve(f.plastic_rotation, &f.positive[n * J], e.stiffness));
      negative.push_back(calc_curve(f.plastic_rotation, &f.negative[n * J], e.stiffness));
      for (const auto* curve : {&positive.back(), &negative.back()}) {
        const double yield = (*curve)[std::min<size_t>(1, curve->size() - 1)].first;
        if (yield > 0) angles.insert(yield);
        softest = std::max(softest, yield);
      }
    }
    for (const double p : f.plastic_rotation)
      if (p + softest > 0) angles.insert(p + softest);
    std::vector<double> x;
    for (auto a = angles.rbegin(); a != angles.rend(); ++a)
      if (x.empty() || -*a - x.back() > 1e-9) x.push_back(-*a);
    const std::vector<double> left = x;
    x.push_back(0);
    for (auto a = left.rbegin(); a != left.rend(); ++a) x.push_back(-*a);
    std::vector<std::vector<double>> rows;
    for (size_t n = 0; n < f.normal_force.size(); ++n) {
      std::vector<double> row{f.normal_force[n]};
      for (const double a : x) row.push_back(a < 0 ? -interpolate(negative[n], -a) : interpolate(positive[n], a));
      rows.push_back(std::move(row));
    }
    return hinge_spline_[key] = add_spline(x, rows);
  }

  /// A law as an expression of `variable`; `at` is where its deformation is 0.
  std::string express(const Characteristic& c, const std::string& variable) {
    switch (c.kind) {
      case Characteristic::Kind::Linear:
        return fmt::format("{}*({})", term(c.rate), variable);
      case Characteristic::Kind::Polynomial: {
        std::string sum;
        for (size_t i = 0; i < c.coefficients.size(); ++i)
          sum += fmt::format("{}{}*({})**{}", i == 0 ? "" : "+", term(c.coefficients[i]), variable, i);
        return sum.empty() ? "0.0" : "(" + sum + ")";
      }
      case Characteristic::Kind::Table:
        break;
    }
    // linear between its points: ADAMS would round the corners of a table of few points
    std::vector<double> x, f;
    for (size_t i = 0; i < c.x.size(); ++i) {
      if (i > 0)
        for (const double s : {0.01, 0.5, 0.99}) {
          x.push_back(c.x[i - 1] + s * (c.x[i] - c.x[i - 1]));
          f.push_back(c.f[i - 1] + s * (c.f[i] - c.f[i - 1]));
        }
      x.push_back(c.x[i]);
      f.push_back(c.f[i]);
    }
    const int spline = add_spline(x, {f});
    return fmt::format("AKISPL(MAX({},MIN({},{})),0,{})", num(x.front()), num(x.back()), variable, spline);
  }

  bool is_linear(const Characteristic& c) const { return c.kind == Characteristic::Kind::Linear; }

  void add_bushing(const mbs::Bushing& b) {
    bool linear = true, breaks = false;
    for (int i = 0; i < 6; ++i) {
      linear &= is_linear(b.spring[i]) && is_linear(b.damper[i]);
      breaks |= b.strength[i] < mbs::kUnlimited;
    }
    if (breaks) losses_.add("a bushing never breaks: its strength is left out");
    if (!linear) losses_.add("a bushing keeps only the first slope of its curved laws");
    const auto slope = [&](const Characteristic& c) {
      if (is_linear(c)) return c.rate;
      if (c.kind == Characteristic::Kind::Polynomial) return c.coefficients.size() > 1 ? c.coefficients[1] : 0.0;
      size_t i = 1;
      while (i + 1 < c.x.size() && c.x[i] <= 0) ++i;
      return (c.f[i] - c.f[i - 1]) / (c.x[i] - c.x[i - 1]);
    };
    const auto three = [&](const Characteristic* c) { return Vec3{slope(c[0]), slope(c[1]), slope(c[2])}; };
    bushing_.push_back(put_bushing(b.name, b.a, b.b, b.X_AF, b.X_BM, three(b.spring), three(b.spring + 3),
                                   three(b.damper), three(b.damper + 3)));
  }

  void add_spring(const mbs::SpringDamper& s) {
    spring_.push_back(0);
    if (is_ground(s.a) && is_ground(s.b)) return;
    if (std::min(s.tension_strength, s.compression_strength) < mbs::kUnlimited)
      losses_.add("a spring never breaks: its strength is left out");
    const int I = add_marker(s.b, s.p_B), J = add_marker(s.a, s.p_A);
    const std::string pull = express(s.spring, fmt::format("DM({},{})-{}", I, J, term(s.free_length)));
    const std::string damp = express(s.damper, fmt::format("VR({},{})", I, J));
    statement("SFORCE", ++sforces_, s.name);  // positive pushes apart
    text_ += fmt::format(", TRANSLATIONAL\n, I = {}\n, J = {}\n, FUNCTION = -{}\n, -{}\n", I, J, pull, damp);
    spring_.back() = sforces_;
  }

  void add_rotational_spring(const mbs::RotationalSpring& s) {
    rotational_spring_.push_back(0);
    const JointIds& j = joint_[static_cast<size_t>(s.joint.index)];
    if (j.id == 0) return;
    if (s.strength < mbs::kUnlimited) losses_.add("a rotational spring never breaks: its strength is left out");
    const std::string back = express(s.spring, fmt::format("AZ({},{})-{}", j.M, j.F, term(s.free_angle)));
    const std::string damp = express(s.damper, fmt::format("WZ({},{},{})", j.M, j.F, j.F));
    statement("SFORCE", ++sforces_, s.name);
    text_ += fmt::format(", ROTATIONAL\n, I = {}\n, J = {}\n, FUNCTION = -{}\n, -{}\n", j.M, j.F, back, damp);
    rotational_spring_.back() = sforces_;
  }

  void add_cable(const mbs::Cable& c) {
    cable_.push_back(0);
    if (is_ground(c.a) && is_ground(c.b)) return;
    if (c.strength < mbs::kUnlimited) losses_.add("a cable never breaks: its strength is left out");
    const int I = add_marker(c.b, c.p_B), J = add_marker(c.a, c.p_A);
    const double length = norm(X_WB(c.b) * c.p_B - X_WB(c.a) * c.p_A);
    statement("SFORCE", ++sforces_, c.name);
    text_ += fmt::format(", TRANSLATIONAL\n, I = {}\n, J = {}\n, FUNCTION = -MAX(0.0,{}+{}*(DM({},{})-{}))\n", I, J,
                         num(c.pretension), term(c.stiffness), I, J, term(length));
    cable_.back() = sforces_;
  }

  void add_load(const mbs::Load& l) {
    load_.push_back(0);
    if (is_ground(l.body)) return;
    std::string factor;
    if (!l.time.empty()) {
      Characteristic table{Characteristic::Kind::Table, 0, {}, l.time, l.factor};
      factor = "*" + (l.time.size() > 1 ? express(table, "TIME") : term(l.factor.front()));
    }
    const int I = add_marker(l.body, l.p_B);
    text_ += fmt::format("MARKER/{}\n, PART = 1\n, FLOATING\n", ++markers_);
    const int floating = markers_;
    statement("GFORCE", ++gforces_, l.name);
    text_ += fmt::format(", I = {}\n, JFLOAT = {}\n, RM = {}\n", I, floating, l.follows_body ? I : world_);
    const Vec3 parts[2] = {l.force, l.torque};
    for (int i = 0; i < 6; ++i)
      text_ += fmt::format(", {}{} = {}{}{}\n", i < 3 ? "F" : "T", "XYZ"[i % 3], num(parts[i / 3][i % 3]), factor,
                           i < 5 ? "\\" : "");
    load_.back() = gforces_;
  }

  void add_contacts() {
    const mbs::Contact& c = model_.contact;
    if (!c.pairs.empty()) losses_.add("rules of contact for single pairs of bodies are left out");
    bool moving = false;
    for (size_t b = 0; b < model_.bodies.size(); ++b) moving |= !model_.bodies[b].fixed && !graphics_[b].empty();
    if (model_.is_planar) losses_.add("forces and motion across the plane are not left out");
    if (c.bodies && moving) losses_.add("bodies pass through each other: only contact with the ground is written");
    if (!c.ground || !moving) return;
    // the ground as a thick plate far beyond the building
    double reach = 100;
    for (const mbs::Body& b : model_.bodies) reach = std::max(reach, 20 * norm(b.X_WB.p));
    const Vec3 z = c.normal, x = std::abs(z.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
    const Vec3 y = (1 / norm(cross(z, x))) * cross(z, x);
    const Pose X_WG{c.offset * z, to_quat(Mat3::from_columns(cross(y, z), y, z))};
    const int corner = add_marker(mbs::kGround, X_WG * Pose{{-reach, -reach, -0.1 * reach}, {}});
    statement("GRAPHICS", ++graphic_, "ground");
    text_ += fmt::format(", BOX\n, CORNER = {}\n, X = {}, Y = {}, Z = {}\n", corner, num(2 * reach), num(2 * reach),
                         num(0.1 * reach));
    const int ground = graphic_;
    std::vector<bool> is_tied(model_.bodies.size(), false);
    const auto tie = [&](BodyId a, BodyId b) {
      if (is_ground(a) && !is_ground(b)) is_tied[static_cast<size_t>(b.index)] = true;
      if (is_ground(b) && !is_ground(a)) is_tied[static_cast<size_t>(a.index)] = true;
    };
    for (const mbs::Joint& j : model_.joints) tie(j.parent, j.child);
    for (const mbs::ZoneElement& e : model_.elements) tie(e.a, e.b);
    for (const mbs::Bushing& k : model_.bushings) tie(k.a, k.b);
    int id = 0;
    for (size_t b = 0; b < model_.bodies.size(); ++b) {
      if (model_.bodies[b].fixed || graphics_[b].empty()) continue;
      if (is_tied[b]) losses_.add("a body that is tied to the ground touches it as well");
      std::string list;
      for (const int g : graphics_[b]) list += (list.empty() ? "" : ", ") + std::to_string(g);
      statement("CONTACT", ++id, model_.bodies[b].name);
      text_ += fmt::format(
          ", IGEOM = {}\n, JGEOM = {}\n, POISSON\n, PENALTY = {}\n, RESTITUTION_COEFFICIENT = {}\n"
          ", COULOMB_FRICTION = ON\n, MU_STATIC = {}\n, MU_DYNAMIC = {}\n, STICTION_TRANSITION_VELOCITY = 0.01\n"
          ", FRICTION_TRANSITION_VELOCITY = 0.02\n",
          list, ground, num(c.contact_frequency * c.contact_frequency * model_.bodies[b].mass), num(c.restitution),
          num(c.friction), num(c.friction));
    }
  }

  /// What an event takes away, as a command; empty: nothing of the dataset.
  std::string deactivation(const mbs::Action& a) {
    using Kind = mbs::Action::Kind;
    const auto off = [](const char* kind, int id) {
      return id > 0 ? fmt::format("DEACTIVATE/{}, ID = {}\n", kind, id) : std::string();
    };
    const auto of = [](const std::vector<int>& ids, int index) { return ids[static_cast<size_t>(index)]; };
    const auto off_element = [&](const mbs::Action& e) {
      return e.rotational >= 0 ? off("SFORCE", of(rotational_, e.rotational))
                               : off("BUSHING", of(element_, e.element.index));
    };
    switch (a.kind) {
      case Kind::RemoveElement:
        return off_element(a);
      case Kind::SwitchLaw:
        if (a.law.index >= 0 && model_.laws[static_cast<size_t>(a.law.index)].keeps_length) {
          losses_.add("a charge that leaves part of the concrete is left out: its zone stays as it was");
          return {};
        }
        if (a.stiffness_share >= 1) {
          losses_.add("a zone near a charge keeps its law: what the charge takes of it is left out");
          return {};
        }
        losses_.add("a charge takes its zone away at once: the bars that it leaves resist nothing");
        return off_element(a);
      case Kind::ReleaseJoint:
        return off("JOINT", joint_[static_cast<size_t>(a.joint.index)].id);
      case Kind::ReplaceBody:
        losses_.add("a body keeps its mass and shape: what a charge throws out of it stays");
        return {};
      case Kind::ReleaseCable:
        return off("SFORCE", of(cable_, a.cable));
      case Kind::RemoveSpring:
        return off("SFORCE", of(spring_, a.index));
      case Kind::RemoveRotationalSpring:
        return off("SFORCE", of(rotational_spring_, a.index));
      case Kind::RemoveBushing:
        return off("BUSHING", of(bushing_, a.index));
      case Kind::RemoveLoad:
        return off("GFORCE", of(load_, a.index));
      case Kind::LoosenJoint:
        losses_.add("a joint that a charge loosens stays: the stub above the charge cannot be crushed");
        return {};
      case Kind::ApplyLoad:
        losses_.add("a load that an event applies acts from the start");
        return {};
    }
    return {};
  }

  std::string make_commands(const std::string& name) {
    std::string out = name + ".adm\n" + name + "\n\n";
    std::vector<const mbs::Event*> events;
    for (const mbs::Event& e : model_.events) events.push_back(&e);
    std::stable_sort(events.begin(), events.end(),
                     [](const mbs::Event* a, const mbs::Event* b) { return a->time < b->time; });
    if (settings_.equilibrium.value_or(true)) out += "SIMULATE/STATICS\n";
    const double interval = settings_.frame_interval > 0 ? settings_.frame_interval : 0.01;
    double now = 0;
    const auto run_to = [&](double time) {
      if (time > now) out += fmt::format("SIMULATE/DYNAMIC, END = {}, DTOUT = {}\n", num(time), num(interval));
      now = std::max(now, time);
    };
    const double end = settings_.duration > 0 ? settings_.duration : 10;
    for (const mbs::Event* e : events) {
      if (e->time > end) break;
      if (!e->triggers.empty()) {
        losses_.add("an event that waits for a limit is left out");
        continue;
      }
      std::string commands;
      for (const mbs::Action& a : e->actions) commands += deactivation(a);
      if (commands.empty()) continue;
      run_to(e->time);
      out += "! " + plain_name(e->name) + "\n" + commands;
    }
    run_to(end);
    return out + "STOP\n";
  }

  struct JointIds {
    int id = 0, F = 0, M = 0;  // 0: not written
  };
  const mbs::Model& model_;
  const mbs::RunSettings& settings_;
  std::string text_;
  Losses losses_;
  int world_ = 0, markers_ = 0, graphic_ = 0, joints_ = 0, bushings_ = 0, sforces_ = 0, gforces_ = 0, splines_ = 0,
      requests_ = 0;
  std::vector<int> centre_;                 // marker of each body's centre, 0: fixed
  std::vector<std::vector<int>> graphics_;  // of each body
  std::vector<JointIds> joint_;
  std::vector<int> element_, rotational_, bushing_, spring_, rotational_spring_, cable_, load_;
  std::map<std::pair<int, double>, int> hinge_spline_;
};

}  // namespace

AdamsFiles to_adams(const mbs::Model& model, const mbs::RunSettings& settings, const std::string& name) {
  return Dataset(model, settings).make(name);
}

}  // namespace topple::engines
