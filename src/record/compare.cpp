#include "record/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "base/error.h"
#include "base/rotation_fit.h"
#include "base/unit.h"
#include "record/csv_text.h"
#include "record/told.h"

namespace topple::record {

namespace {

using json = nlohmann::ordered_json;

constexpr const char* kLean = "lean_compared";
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Where an instant lies between two frames.
struct Place {
  size_t low = 0, high = 0;
  double share = 0;  // of the later one
};

Place find_place(const std::vector<double>& time, double at) {
  const auto it = std::lower_bound(time.begin(), time.end(), at);
  if (it == time.end()) return {time.size() - 1, time.size() - 1, 0};
  const size_t high = static_cast<size_t>(it - time.begin());
  if (high == 0 || *it == at) return {high, high, 0};
  return {high - 1, high, (at - time[high - 1]) / (time[high] - time[high - 1])};
}

/// Of a point of a body, its origin if none is given [m].
Vec3 position_at(const Record& r, const Place& place, size_t body, const Vec3& p_B = {}) {
  const auto one = [&](size_t frame) { return pose_at(r, frame, body) * p_B; };
  return place.share == 0 ? one(place.low) : (1 - place.share) * one(place.low) + place.share * one(place.high);
}

double value_at(const std::vector<double>& values, const Place& place) {
  return place.share == 0 ? values[place.low]
                          : (1 - place.share) * values[place.low] + place.share * values[place.high];
}

bool moves(const BodyInfo& b) { return !b.fixed && b.kind != "debris"; }

Vec3 calc_centre(const Record& r, const Place& place) {
  Vec3 sum;
  double mass = 0;
  for (size_t b = 0; b < r.bodies.size(); ++b) {
    if (!moves(r.bodies[b])) continue;
    sum += r.bodies[b].mass * position_at(r, place, b);
    mass += r.bodies[b].mass;
  }
  return mass > 0 ? (1 / mass) * sum : sum;
}

/// Of the finding of that id; NaN without one.
double value_of(const Record& r, const std::string& id) {
  for (const Finding& f : r.findings)
    if (f.id == id) return f.value;
  return kNone;
}

/// The axis, upright at first, of what turned as bodies have moved since the first frame, by least squares.
Vec3 find_axis(const Record& r, const Place& place, const std::vector<size_t>& bodies) {
  std::vector<FitPoint> points;
  for (const size_t b : bodies) points.push_back({r.bodies[b].mass, position_at(r, {}, b), position_at(r, place, b)});
  return to_matrix(fit_points(points).rotation) * Vec3{0, 0, 1};
}

double calc_lean(const Vec3& axis) { return std::atan2(std::hypot(axis.x, axis.y), axis.z); }

/// Azimuth of an axis that leans by more than round-off [rad]; NaN: of none.
double calc_lean_azimuth(const Vec3& axis) { return calc_lean(axis) > 1e-5 ? std::atan2(axis.y, axis.x) : kNone; }

bool is_tilt(const Series& s) { return s.group == "angle" && s.id.rfind("tilt_angle", 0) == 0; }

const SeriesPair* find_series(const Comparison& c, const std::string& id) {
  for (const SeriesPair& s : c.series)
    if (s.id == id) return &s;
  return nullptr;
}

/// Of the values of a share of what holds together: the first instant with less than half; their number if there is
/// none.
size_t find_break_up(const std::vector<double>& share) {
  const auto is_less = [](double v) { return v < 0.5; };
  return static_cast<size_t>(std::find_if(share.begin(), share.end(), is_less) - share.begin());
}

bool has_finding(const Record& r, const std::string& id) {
  return std::any_of(r.findings.begin(), r.findings.end(), [&id](const Finding& f) { return f.id == id; });
}

/// When something happened; of a record that ends without it, up to when it did not.
std::string seconds(double t, double end, bool is_known = true) {
  if (!is_known) return "not known";
  return std::isfinite(t) ? fmt::format("{:.2f} s", t) : fmt::format("not up to {:.2f} s", end);
}

json number(double v) { return std::isfinite(v) ? json(v) : json(nullptr); }

json numbers(const std::vector<double>& values) {
  json list = json::array();
  for (const double v : values) list.push_back(number(v));
  return list;
}

/// "native (multibody)" would be wrong for others: the engine's name, with the file's or a number where both are alike.
void name_both(const Record& a, const Record& b, const std::string& path_a, const std::string& path_b, Comparison& c) {
  c.name_a = a.provenance.engine.empty() ? "A" : a.provenance.engine;
  c.name_b = b.provenance.engine.empty() ? "B" : b.provenance.engine;
  if (c.name_a != c.name_b) return;
  const auto [of_a, of_b] = tell_files_apart(path_a, path_b);
  const bool is_known = !of_a.empty() && !of_b.empty();
  c.name_a += is_known ? fmt::format(" ({})", of_a) : " (first)";
  c.name_b += is_known ? fmt::format(" ({})", of_b) : " (second)";
}

/// A number in a column, "-" where there is none.
std::string cell(double value, int width, int digits) {
  if (!std::isfinite(value)) return fmt::format("{:>{}}", "-", width);
  const double unit = std::pow(10, digits);
  return fmt::format("{:{}.{}f}", std::round(value * unit) / unit + 0.0, width, digits);  // no -0.00
}

}  // namespace

std::pair<std::string, std::string> tell_files_apart(const std::string& a, const std::string& b) {
  namespace fs = std::filesystem;
  const auto split = [](const std::string& path) {
    std::error_code unknown;
    fs::path whole = fs::weakly_canonical(path, unknown);
    if (unknown) whole = fs::path(path).lexically_normal();
    std::vector<std::string> parts;
    for (const fs::path& p : whole) parts.push_back(p.string());
    return parts;
  };
  if (a.empty() || b.empty()) return {};
  std::vector<std::string> of_a = split(a), of_b = split(b);
  const bool are_files_alike = of_a.back() == of_b.back();
  while (!of_a.empty() && !of_b.empty() && of_a.back() == of_b.back()) of_a.pop_back(), of_b.pop_back();
  if (of_a.empty() || of_b.empty()) return {};
  if (are_files_alike) return {of_a.back(), of_b.back()};
  const std::string stem_a = fs::path(of_a.back()).stem().string(), stem_b = fs::path(of_b.back()).stem().string();
  return stem_a == stem_b ? std::pair{of_a.back(), of_b.back()} : std::pair{stem_a, stem_b};
}

Comparison compare(const Record& a, const Record& b, const std::string& path_a, const std::string& path_b) {
  Comparison c;
  name_both(a, b, path_a, path_b, c);
  c.title_a = a.provenance.title, c.title_b = b.provenance.title;
  if (c.title_a != c.title_b)
    c.note = fmt::format("A is of \"{}\", B of \"{}\": see that both are of one building.", c.title_a, c.title_b);
  if (!a.time.empty() && !b.time.empty())
    for (const double t : a.time)
      if (t >= b.time.front() && t <= b.time.back()) c.time.push_back(t);
  if (c.time.empty()) throw InputError("E680", "the records have no time in common", "run both over the same time");
  std::vector<Place> in_a, in_b;
  for (const double t : c.time) in_a.push_back(find_place(a.time, t)), in_b.push_back(find_place(b.time, t));

  c.fall_azimuth_a = a.fall_azimuth, c.fall_azimuth_b = b.fall_azimuth;
  constexpr double kSameAzimuth = 1e-6;
  c.are_tilts_alike = !(std::abs(std::remainder(a.fall_azimuth - b.fall_azimuth, 2 * std::numbers::pi)) > kSameAzimuth);
  for (const Series& s : a.series) {
    if (is_tilt(s) && !c.are_tilts_alike) continue;
    const auto other = std::find_if(b.series.begin(), b.series.end(), [&](const Series& x) { return x.id == s.id; });
    if (other == b.series.end() || other->unit != s.unit) continue;
    SeriesPair pair{s.id, s.title, s.unit, s.group, {}, {}};
    for (size_t i = 0; i < c.time.size(); ++i) {
      pair.a.push_back(value_at(s.value, in_a[i]));
      pair.b.push_back(value_at(other->value, in_b[i]));
    }
    c.series.push_back(std::move(pair));
  }

  std::map<std::string, size_t> names;
  for (size_t i = 0; i < b.bodies.size(); ++i)
    if (moves(b.bodies[i])) names[b.bodies[i].name] = i;
  std::vector<std::pair<size_t, size_t>> matched;
  size_t moving = 0;
  double matched_mass = 0, mass = 0;
  for (size_t i = 0; i < a.bodies.size(); ++i) {
    if (!moves(a.bodies[i])) continue;
    ++moving;
    mass += a.bodies[i].mass;
    const auto it = names.find(a.bodies[i].name);
    if (it == names.end()) continue;
    matched.emplace_back(i, it->second);
    matched_mass += a.bodies[i].mass;
  }
  c.matched = static_cast<int>(matched.size());
  c.points = matched.empty()
                 ? "The records have no body in common; only the mass centres of all that moves are compared."
                 : fmt::format(
                       "{} of {} moving bodies of A, with {:.0f} % of its mass, have the same name in B ({} "
                       "bodies); where their frames' origins in A lie at first is compared, weighed by mass.",
                       matched.size(), moving, mass > 0 ? 100 * matched_mass / mass : 0.0, names.size());
  // a charge, or another load, gives a body another mass centre in the same place
  std::vector<Vec3> in_b_body;
  double offset = 0;
  for (const auto& [in_first, in_second] : matched) {
    const Vec3 origin = position_at(a, {}, in_first);
    in_b_body.push_back(inverse(pose_at(b, 0, in_second)) * origin);
    offset = std::max(offset, norm(origin - position_at(b, {}, in_second)));
  }
  constexpr double kSamePlace = 1e-3;  // [m]
  if (offset > kSamePlace)
    c.points += fmt::format(
        " In the first frames their origins lie up to {:.2f} m apart: see that the bodies stand in the same places.",
        offset);
  for (size_t i = 0; i < c.time.size(); ++i) {
    double squares = 0, largest = matched.empty() ? kNone : 0;
    int farthest = -1;
    for (size_t m = 0; m < matched.size(); ++m) {
      const auto [in_first, in_second] = matched[m];
      const double d = norm(position_at(a, in_a[i], in_first) - position_at(b, in_b[i], in_second, in_b_body[m]));
      squares += a.bodies[in_first].mass * d * d;
      if (d > largest) largest = d, farthest = static_cast<int>(in_first);
    }
    c.rms.push_back(matched_mass > 0 ? std::sqrt(squares / matched_mass) : kNone);
    c.largest.push_back(largest);
    c.farthest.push_back(farthest);
    c.centre.push_back(norm(calc_centre(a, in_a[i]) - calc_centre(b, in_b[i])));
  }

  c.lean_azimuth_a = c.lean_azimuth_b = kNone;
  constexpr size_t enough = 3;  // fewer lie on a line
  if (matched.size() >= enough) {
    std::vector<size_t> of_a, of_b;
    for (const auto& [in_first, in_second] : matched) of_a.push_back(in_first), of_b.push_back(in_second);
    SeriesPair lean{kLean, "Lean of all bodies compared", "rad", "angle", {}, {}};
    for (size_t i = 0; i < c.time.size(); ++i) {
      const Vec3 axis_a = find_axis(a, in_a[i], of_a), axis_b = find_axis(b, in_b[i], of_b);
      lean.a.push_back(calc_lean(axis_a)), lean.b.push_back(calc_lean(axis_b));
      c.lean_apart.push_back(std::atan2(norm(cross(axis_a, axis_b)), dot(axis_a, axis_b)));
      c.lean_azimuth_a = calc_lean_azimuth(axis_a), c.lean_azimuth_b = calc_lean_azimuth(axis_b);
    }
    c.series.push_back(std::move(lean));
  }

  std::map<std::string, TouchdownPair> touched;
  for (const auto& [record, is_first] : {std::pair{&a, true}, std::pair{&b, false}})
    for (const Event& e : record->events) {
      if (e.kind != "touchdown") continue;
      TouchdownPair& t = touched.try_emplace(e.subject, TouchdownPair{e.subject, kNone, kNone}).first->second;
      double& at = is_first ? t.a : t.b;
      if (std::isnan(at)) at = e.time;
    }
  for (const auto& [name, t] : touched) c.touchdowns.push_back(t);
  std::stable_sort(c.touchdowns.begin(), c.touchdowns.end(), [](const TouchdownPair& x, const TouchdownPair& y) {
    return std::fmin(x.a, x.b) < std::fmin(y.a, y.b);
  });
  c.touchdown_a = value_of(a, "touchdown.first");
  c.touchdown_b = value_of(b, "touchdown.first");
  c.knows_touchdown_a = has_finding(a, "touchdown.first"), c.knows_touchdown_b = has_finding(b, "touchdown.first");
  c.end_a = a.time.back(), c.end_b = b.time.back();
  c.until = std::fmin(c.time.back(), std::fmin(c.touchdown_a, c.touchdown_b));
  const bool is_known = c.knows_touchdown_a && c.knows_touchdown_b;
  // of any body, where an upper block is not known
  if (!is_known && !c.touchdowns.empty())
    c.until = std::fmin(c.until, std::fmin(c.touchdowns.front().a, c.touchdowns.front().b));
  c.tilt_share = c.tilt_difference = c.tilt_time = kNone;
  const SeriesPair* tilt = find_series(c, "tilt_angle");
  double scale = 0;
  for (size_t i = 0; i < c.time.size() && c.time[i] <= c.until; ++i) {
    c.centre_difference = std::max(c.centre_difference, c.centre[i]);
    if (!tilt || !is_known) continue;  // tilts of what is not the same
    const double d = std::abs(tilt->a[i] - tilt->b[i]);
    if (!std::isfinite(d)) continue;
    if (!(d <= c.tilt_difference)) c.tilt_difference = d, c.tilt_time = c.time[i];
    scale = std::max(std::abs(tilt->a[i]), std::abs(tilt->b[i]));
  }
  if (scale > 1e-4) c.tilt_share = c.tilt_difference / scale;
  return c;
}

std::vector<std::string> summarise(const Comparison& c) {
  const double later = c.touchdown_b - c.touchdown_a;
  std::vector<std::string> out = {
      fmt::format("First touchdown of the upper block: A {}, B {}{}.",
                  seconds(c.touchdown_a, c.end_a, c.knows_touchdown_a),
                  seconds(c.touchdown_b, c.end_b, c.knows_touchdown_b),
                  std::isfinite(c.touchdown_a) && std::isfinite(c.touchdown_b)
                      ? fmt::format(", difference {:+.3f} s", std::abs(later) < 5e-4 ? 0.0 : later)
                      : std::string()),
      std::isfinite(c.tilt_difference)
          ? fmt::format("Tilt up to {:.2f} s: largest difference {:.2f} deg at {:.2f} s{}.", c.until,
                        c.tilt_difference / unit::deg, c.tilt_time,
                        std::isfinite(c.tilt_share)
                            ? fmt::format(", {:.0f} % of the larger tilt at the end of this time", 100 * c.tilt_share)
                            : std::string())
      : !c.are_tilts_alike
          ? fmt::format("Tilt: A counts it towards {}, B towards {}, so it is not compared; see how they lean.",
                        tell_azimuth(c.fall_azimuth_a, count_digits_of_angle(c.fall_azimuth_a)),
                        tell_azimuth(c.fall_azimuth_b, count_digits_of_angle(c.fall_azimuth_b)))
          : fmt::format("Tilt up to {:.2f} s: not known of both.", c.until),
      fmt::format("Mass centres up to then: at most {:.2f} m apart.", c.centre_difference)};
  // the tilt of a record is that of what hangs together there
  if (const SeriesPair* lean = find_series(c, kLean)) {
    out.push_back(fmt::format(
        "At {:.2f} s all bodies compared lean by {:.2f} deg in A, {:.2f} deg in B: {:.2f} deg apart.", c.time.back(),
        lean->a.back() / unit::deg, lean->b.back() / unit::deg, c.lean_apart.back() / unit::deg));
    if (std::isfinite(c.lean_azimuth_a) && std::isfinite(c.lean_azimuth_b))
      out.push_back(fmt::format("They lean towards {} in A, {} in B.", tell_azimuth(c.lean_azimuth_a),
                                tell_azimuth(c.lean_azimuth_b)));
    const auto until = std::upper_bound(c.time.begin(), c.time.end(), c.until) - c.time.begin();
    if (until > 0)
      out.push_back(fmt::format("Leans up to {:.2f} s: at most {:.2f} deg apart.", c.until,
                                *std::max_element(c.lean_apart.begin(), c.lean_apart.begin() + until) / unit::deg));
  }
  return out;
}

std::string describe(const Comparison& c, const Record& a, const Record& b) {
  std::string out;
  const auto line = [&out](const std::string& text) { out += text + "\n"; };
  line(fmt::format("A  {}: {}, {} frames to {:.2f} s", c.name_a, a.provenance.title, a.time.size(), a.time.back()));
  line(fmt::format("B  {}: {}, {} frames to {:.2f} s", c.name_b, b.provenance.title, b.time.size(), b.time.back()));
  if (!c.note.empty()) line(c.note);
  line(c.points);
  line("");
  for (const std::string& sentence : summarise(c)) line(sentence);
  // a dozen instants
  const SeriesPair *tilt = find_series(c, "tilt_angle"), *force = find_series(c, "ground_force"),
                   *kinetic = find_series(c, "energy_kinetic");
  line("");
  // towards different sides tilts are no pair, leans are
  const bool has_leans = !c.are_tilts_alike;
  if (has_leans) tilt = find_series(c, kLean);
  line(std::string("  time     ") + (has_leans ? "lean A   lean B" : "tilt A   tilt B") +
       "  kinetic A  kinetic B  ground A  ground B  apart (rms)  largest");
  line("     s        deg      deg         MJ         MJ        MN        MN            m        m");
  const auto at = [](const SeriesPair* s, bool first, size_t i, double scale) {
    return s ? (first ? s->a[i] : s->b[i]) / scale : kNone;
  };
  const SeriesPair* share = find_series(c, "connected_share");
  const size_t end_a = share ? find_break_up(share->a) : c.time.size(), end_b = share ? find_break_up(share->b) : end_a;
  // tilt of an upper block beside that of all bodies says nothing
  if (!has_leans && c.knows_touchdown_a != c.knows_touchdown_b) tilt = nullptr;
  const auto tilt_at = [&](bool first, size_t i) {
    return has_leans || i < (first ? end_a : end_b) ? at(tilt, first, i, unit::deg) : kNone;
  };
  const size_t rows = std::min<size_t>(12, c.time.size());
  for (size_t k = 0; k < rows; ++k) {
    const size_t i = rows > 1 ? k * (c.time.size() - 1) / (rows - 1) : 0;
    line(fmt::format("{:6.2f} {} {} {} {} {} {} {} {}", c.time[i], cell(tilt_at(true, i), 10, 2),
                     cell(tilt_at(false, i), 8, 2), cell(at(kinetic, true, i, 1e6), 10, 2),
                     cell(at(kinetic, false, i, 1e6), 10, 2), cell(at(force, true, i, 1e6), 9, 2),
                     cell(at(force, false, i, 1e6), 9, 2), cell(c.rms[i], 12, 3), cell(c.largest[i], 8, 2)));
  }
  std::string ends;
  for (const auto& [name, end] : {std::pair{"A", end_a}, {"B", end_b}})
    if (tilt && !has_leans && end < c.time.size())
      ends += fmt::format("{}{} ends at {:.2f} s", ends.empty() ? "" : ", ", name, c.time[end]);
  if (!ends.empty()) line(fmt::format("Tilt: {}, when less than half of the upper block holds together.", ends));
  if (!c.touchdowns.empty()) line(fmt::format("\nTouchdowns, the first of {}:", c.touchdowns.size()));
  for (size_t i = 0; i < std::min<size_t>(10, c.touchdowns.size()); ++i)
    line(fmt::format("  {:24} A {:>8}  B {:>8}", c.touchdowns[i].body, seconds(c.touchdowns[i].a, c.end_a),
                     seconds(c.touchdowns[i].b, c.end_b)));
  return out;
}

std::string to_csv(const Comparison& c, const Record& a) {
  std::string out = "time [s]";
  for (const SeriesPair& s : c.series)
    for (const char* of : {"A", "B", "B - A"}) out += "," + quote_csv(fmt::format("{} {} [{}]", s.id, of, s.unit));
  out += ",distance rms [m],distance largest [m],farthest,distance of mass centres [m],leans apart [rad]\r\n";
  const auto field = [](double v) { return std::isfinite(v) ? fmt::format(",{}", v + 0.0) : std::string(","); };
  for (size_t i = 0; i < c.time.size(); ++i) {
    out += fmt::format("{}", c.time[i]);
    for (const SeriesPair& s : c.series) out += field(s.a[i]) + field(s.b[i]) + field(s.b[i] - s.a[i]);
    out += field(c.rms[i]) + field(c.largest[i]);
    out += "," + (c.farthest[i] < 0 ? std::string() : quote_csv(a.bodies[static_cast<size_t>(c.farthest[i])].name));
    out += field(c.centre[i]) + field(c.lean_apart.empty() ? kNone : c.lean_apart[i]) + "\r\n";
  }
  return out;
}

std::string to_json(const Comparison& c, const Record& a) {
  json j;
  j["format"] = "topple-comparison";
  j["version"] = 1;
  j["names"] = {c.name_a, c.name_b};
  j["titles"] = {c.title_a, c.title_b};
  j["note"] = c.note.empty() ? json(nullptr) : json(c.note);
  j["points"] = c.points;
  j["matched"] = c.matched;
  j["touchdown"] = {number(c.touchdown_a), number(c.touchdown_b)};
  j["end"] = {number(c.end_a), number(c.end_b)};
  j["until"] = number(c.until);
  j["tilt_difference"] = number(c.tilt_difference);
  j["tilt_time"] = number(c.tilt_time);
  j["tilt_share"] = number(c.tilt_share);
  j["centre_difference"] = number(c.centre_difference);
  j["fall_azimuth"] = {number(c.fall_azimuth_a), number(c.fall_azimuth_b)};
  j["lean_azimuth"] = {number(c.lean_azimuth_a), number(c.lean_azimuth_b)};
  j["time"] = numbers(c.time);
  j["series"] = json::array();
  for (const SeriesPair& s : c.series)
    j["series"].push_back({{"id", s.id},
                           {"title", s.title},
                           {"unit", s.unit},
                           {"group", s.group},
                           {"a", numbers(s.a)},
                           {"b", numbers(s.b)}});
  json farthest = json::array();
  for (const int b : c.farthest)
    farthest.push_back(b < 0 ? json(nullptr) : json(a.bodies[static_cast<size_t>(b)].name));
  j["distance"] = {{"rms", numbers(c.rms)},
                   {"largest", numbers(c.largest)},
                   {"farthest", std::move(farthest)},
                   {"centre", numbers(c.centre)},
                   {"lean", c.lean_apart.empty() ? json(nullptr) : numbers(c.lean_apart)}};
  j["touchdowns"] = json::array();
  for (const TouchdownPair& t : c.touchdowns)
    j["touchdowns"].push_back({{"body", t.body}, {"a", number(t.a)}, {"b", number(t.b)}});
  return j.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace topple::record
