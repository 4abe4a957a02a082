#pragma once
/// Reads the part of ADAMS's dataset format that models of rigid bodies need. Its measure is data of others: the
/// datasets in tests/data/adams give the places that ADAMS found (adams_test.cpp). Throws std::runtime_error.

#include <algorithm>
#include <cctype>
#include <map>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/unit.h"
#include "mbs/model.h"

namespace topple::engines::test {

struct AdamsStatement {
  std::string kind;
  int id = 0;
  std::string rest;                          // all arguments, upper case, continued lines joined
  std::map<std::string, std::string> value;  // KEY = value
  std::vector<std::string> words;            // arguments without a value
  bool has(const std::string& word) const { return std::find(words.begin(), words.end(), word) != words.end(); }
  std::vector<double> numbers(const std::string& key) const {
    std::vector<double> out;
    const auto found = value.find(key);
    if (found == value.end()) return out;
    std::istringstream in(found->second);
    for (std::string item; std::getline(in, item, ',');) {
      const double x = std::stod(item);
      out.push_back(item.find('D') != std::string::npos ? x * unit::deg : x);
    }
    return out;
  }
  double number(const std::string& key, double otherwise = 0) const {
    const auto all = numbers(key);
    return all.empty() ? otherwise : all[0];
  }
  int id_of(const std::string& key) const { return static_cast<int>(number(key)); }
};

inline std::vector<AdamsStatement> read_statements(const std::string& text) {
  std::vector<std::string> joined;
  std::istringstream in(text);
  std::string line;
  std::getline(in, line);  // title
  while (std::getline(in, line)) {
    line = line.substr(0, line.find('!'));
    while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back())) != 0) line.pop_back();
    if (line.empty()) continue;
    std::transform(line.begin(), line.end(), line.begin(), [](unsigned char c) { return std::toupper(c); });
    if (line[0] == ',' && !joined.empty()) {
      joined.back() += line;
    } else {
      joined.push_back(line);
    }
  }
  std::vector<AdamsStatement> out;
  const std::regex head(R"(^\s*([A-Z]+)\s*/?\s*(\d*)\s*,?(.*)$)");
  for (const std::string& one : joined) {
    std::smatch m;
    if (!std::regex_match(one, m, head)) throw std::runtime_error("not a statement: " + one);
    AdamsStatement s;
    s.kind = m[1];
    s.id = m[2].length() > 0 ? std::stoi(m[2]) : 0;
    s.rest = m[3];
    // a value runs up to the next "KEY ="; words stand between commas before the first of them or after a value
    const std::regex key(R"((^|[,\\])\s*([A-Z][A-Z0-9_]*)\s*=)");
    std::vector<std::pair<std::size_t, std::size_t>> keys;  // where a key's words begin; where its value begins
    std::vector<std::string> names;
    for (std::sregex_iterator i(s.rest.begin(), s.rest.end(), key), end; i != end; ++i) {
      keys.emplace_back(i->position(0), i->position(0) + i->length(0));
      names.push_back((*i)[2]);
    }
    const auto add_words = [&s](const std::string& list) {
      std::istringstream words(list);
      for (std::string w; std::getline(words, w, ',');) {
        w.erase(0, w.find_first_not_of(" \t"));
        w.erase(w.find_last_not_of(" \t") + 1);
        if (!w.empty()) s.words.push_back(w);
      }
    };
    add_words(s.rest.substr(0, keys.empty() ? std::string::npos : keys[0].first));
    for (std::size_t k = 0; k < keys.size(); ++k) {
      const std::size_t to = k + 1 < keys.size() ? keys[k + 1].first : s.rest.size();
      std::string value = s.rest.substr(keys[k].second, to - keys[k].second);
      if (s.kind != "SFORCE" && s.kind != "SPLINE" && s.kind != "GFORCE") {
        // a word behind a value: ", POISSON"
        std::smatch tail;
        const std::regex word(R"(^(.*?),\s*([A-Z_]{3,})\s*$)");
        if (std::regex_match(value, tail, word)) {
          const std::string before = tail[1], behind = tail[2];
          add_words(behind);
          value = before;
        }
      }
      if (s.value.count(names[k]) > 0) {
        s.value[names[k]] += ";" + value;  // rows of a surface
      } else {
        s.value[names[k]] = value;
      }
    }
    out.push_back(std::move(s));
  }
  return out;
}

/// Rotation by angles about z, the new x, the new z.
inline Quat from_reuler(const std::vector<double>& a) {
  if (a.empty()) return {};
  return exp_rotation({0, 0, a.at(0)}) * exp_rotation({a.at(1), 0, 0}) * exp_rotation({0, 0, a.at(2)});
}
inline Vec3 to_vec(const std::vector<double>& a) { return a.empty() ? Vec3{} : Vec3{a.at(0), a.at(1), a.at(2)}; }

/// A marker of the dataset, in the frame of its part.
struct AdamsMarker {
  int part = 0;
  Pose X_PM;
};

struct AdamsDataset {
  mbs::Model model;  // bodies in the order of the parts, origins in the centres of mass
  std::map<int, AdamsMarker> markers;
  std::map<int, Pose> X_WP;    // frames of parts
  std::map<int, int> body_of;  // part -> body
  std::vector<AdamsStatement> statements;
  mbs::BodyId body(int part) const { return body_of.count(part) > 0 ? mbs::BodyId{body_of.at(part)} : mbs::kGround; }
  Pose X_WM(int id) const { return X_WP.at(markers.at(id).part) * markers.at(id).X_PM; }
  /// In the frame of the model's body.
  Pose X_BM(int id) const {
    const mbs::BodyId b = body(markers.at(id).part);
    const Pose X_WB = b == mbs::kGround ? Pose{} : model.bodies[static_cast<std::size_t>(b.index)].X_WB;
    return inverse(X_WB) * X_WM(id);
  }
};

/// Parts, markers, joints, linear bushings, gravity, and torsion springs and dampers.
inline AdamsDataset read_dataset(const std::string& text) {
  AdamsDataset d;
  d.statements = read_statements(text);
  d.model.contact.ground = d.model.contact.bodies = false;
  d.model.gravity = {};
  for (const AdamsStatement& s : d.statements)
    if (s.kind == "MARKER" && !s.has("FLOATING"))
      d.markers[s.id] = {s.id_of("PART"), {to_vec(s.numbers("QP")), from_reuler(s.numbers("REULER"))}};
  for (const AdamsStatement& s : d.statements) {
    if (s.kind == "ACCGRAV") d.model.gravity = {s.number("IGRAV"), s.number("JGRAV"), s.number("KGRAV")};
    if (s.kind != "PART") continue;
    d.X_WP[s.id] = {to_vec(s.numbers("QG")), from_reuler(s.numbers("REULER"))};
    if (s.has("GROUND")) continue;
    mbs::Body b;
    b.name = "part" + std::to_string(s.id);
    b.mass = s.number("MASS");
    const Pose X_WC = d.X_WP[s.id] * d.markers.at(s.id_of("CM")).X_PM;
    b.X_WB = {X_WC.p, d.X_WP[s.id].q};
    const auto ip = s.numbers("IP");
    if (ip.size() != 3) throw std::runtime_error("PART with products of inertia");
    const Mat3 R = to_matrix(d.markers.at(s.id_of("CM")).X_PM.q);
    b.inertia = R * Mat3::diagonal(to_vec(ip)) * transpose(R);
    b.v_WB = {s.number("VX"), s.number("VY"), s.number("VZ")};
    b.w_WB = to_matrix(X_WC.q) * Vec3{s.number("WX"), s.number("WY"), s.number("WZ")};
    d.body_of[s.id] = mbs::add_body(d.model, b).index;
  }
  std::map<std::pair<int, int>, mbs::JointId> joint_between;  // markers
  for (const AdamsStatement& s : d.statements) {
    using Kind = mbs::Joint::Kind;
    static const std::map<std::string, Kind> kinds{
        {"FIXED", Kind::Fixed},     {"REVOLUTE", Kind::Revolute},       {"SPHERICAL", Kind::Spherical},
        {"HOOKE", Kind::Universal}, {"TRANSLATIONAL", Kind::Prismatic}, {"CYLINDRICAL", Kind::Cylindrical}};
    const int i = s.id_of("I"), j = s.id_of("J");
    if (s.kind == "JOINT") {
      mbs::Joint joint;
      joint.kind = kinds.at(s.words.at(0));
      joint.name = "joint" + std::to_string(s.id);
      joint.parent = d.body(d.markers.at(i).part);
      joint.child = d.body(d.markers.at(j).part);
      joint.X_PF = d.X_BM(i);
      joint.X_CM = d.X_BM(j);
      joint_between[{i, j}] = joint_between[{j, i}] = mbs::add_joint(d.model, joint);
    } else if (s.kind == "BUSHING") {
      mbs::ZoneElement e;
      e.name = "bushing" + std::to_string(s.id);
      e.a = d.body(d.markers.at(j).part);
      e.b = d.body(d.markers.at(i).part);
      e.X_AF = d.X_BM(j);
      e.X_BM = d.X_BM(i);
      e.translational_stiffness = to_vec(s.numbers("K"));
      e.rotational_stiffness = to_vec(s.numbers("KT"));
      mbs::add_element(d.model, e);
    } else if (s.kind == "SFORCE" && s.has("ROTATIONAL")) {
      // the joint whose axis it turns about stands where its markers do
      const std::regex term(R"(-\s*([0-9.E+-]+)\*(RTOD\*)?\(?(AZ|WZ)\((\d+))");
      const std::string& f = s.value.at("FUNCTION");
      mbs::RotationalSpring spring;
      spring.joint = mbs::JointId{0};
      for (std::sregex_iterator t(f.begin(), f.end(), term), end; t != end; ++t) {
        if (std::stoi((*t)[4]) != i) throw std::runtime_error("SFORCE does not act on what it measures");
        const double rate = std::stod((*t)[1]) / ((*t)[2].length() > 0 ? unit::deg : 1.0);
        ((*t)[3] == "AZ" ? spring.spring : spring.damper).rate = rate;
      }
      if (const auto at = joint_between.find({i, j}); at != joint_between.end()) spring.joint = at->second;
      d.model.rotational_springs.push_back(spring);
    }
  }
  return d;
}

}  // namespace topple::engines::test
