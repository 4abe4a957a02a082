#include "collapse/findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>

#include "base/interpolate.h"
#include "base/unit.h"
#include "base/words.h"
#include "collapse/debris.h"
#include "collapse/heads_across.h"
#include "collapse/outcome.h"
#include "collapse/rigid_block.h"
#include "collapse/stability.h"
#include "record/told.h"

namespace topple::collapse {

namespace {

using record::Status;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kDiagonal = 5 * unit::deg;  // of a diagonal, within which a planned azimuth lies along it
constexpr double kSkew = 0.1;                // sine of the azimuth against the grid from which it lies askew
constexpr double kFramesApart = 0.04;        // more is told [s]
constexpr double kForceFramesApart = 0.1 * kForceWindow;
constexpr const char* kNotJudged = " Not judged: ";
constexpr size_t kShownMargins = 5;
constexpr size_t kShownTouchdowns = 5;

/// Everything that the sections below share.
struct Context {
  const product::Plan& plan;
  const mbs::Model& model;
  const ModelMap& map;
  const Knowledge& k;
  const Recorder& recorder;
  const mbs::Summary& summary;
  record::Record& r;
  bool is_under_way = false;
  const std::atomic<bool>* cancel = nullptr;
  std::vector<OpenPart> open = {};  // of a run that ended with its time
  long charges_left = 0;            // that had not fired by then
  const HeadsAcross* across = nullptr;

  bool is_cancelled() const { return cancel != nullptr && *cancel; }

  void add(const std::string& id, const std::string& heading, const std::string& title, const std::string& text,
           double value = kNone, const std::string& unit = "", Status status = Status::Info) const {
    record::add_finding(r, {id, heading, title, text, value, unit, status});
  }
  std::vector<StageTimes> stage_times() const { return find_stage_times(map); }
  std::string stage_name(size_t s) const { return plan.stages[s].name; }
  Pose pose(size_t frame, size_t body) const { return record::pose_at(r, frame, body); }
};

/// "no zone has yielded", "1 zone has yielded", "2 zones have yielded".
std::string count_words(long n, const char* none, const char* one, const char* many) {
  return n == 0 ? none : fmt::format("{} {}", n, n == 1 ? one : many);
}

std::string tell_charges_left(const Context& c) {
  return count_words(c.charges_left, "", "charge had not fired when the run ended",
                     "charges had not fired when the run ended") +
         ".";
}

/// Why a limit that is kept so far is not judged; empty: nothing that still moved or may fall could break it, and all
/// has fired.
///   breaks  whether a part on its way would
template <class Breaks>
std::string find_what_is_open(const Context& c, const Breaks& breaks) {
  if (c.charges_left > 0) return kNotJudged + tell_charges_left(c);
  const OpenPart* fastest = nullptr;
  for (const OpenPart& part : c.open)
    if ((fastest == nullptr || part.speed > fastest->speed) && breaks(part)) fastest = &part;
  if (fastest == nullptr) return {};
  const std::string& who = c.r.bodies[fastest->body].name;
  return fastest->speed > kStill
             ? fmt::format("{}{} still moved at {:.1f} m/s when the run ended, and may break this limit.", kNotJudged,
                           who, fastest->speed)
             : fmt::format("{}it had not come to rest when the run ended, and {} may break this limit.", kNotJudged,
                           who);
}

/// Distances of the nearest and the farthest point of a part from an area in the last frame, seen from above; 0: over
/// it [m].
std::pair<double, double> calc_distances_at_end(const Context& c, size_t body, const Polygon& area) {
  double least = std::numeric_limits<double>::infinity(), most = 0;
  const size_t last = c.r.time.size() - 1;
  const Pose X_WB = c.pose(last, body);
  for (size_t i = 0; i < c.r.bodies[body].shapes.size(); ++i) {
    const record::BoxShape s = record::shape_at(c.r, last, body, i);
    const Polygon outline = calc_outline({X_WB * s.X_BS, s.half});
    least = std::min(least, calc_distance(outline, area));
    for (const Point2& p : outline) most = std::max(most, calc_distance(p, area));
  }
  return {least, most};
}

std::string fixed_words(double value, int digits) { return fmt::format("{:.{}f}", value, digits); }

/// Two numbers, with as many digits as show which is larger.
std::pair<std::string, std::string> tell_apart(double value, double limit, int digits) {
  constexpr int most = 6;
  const auto tell = [&digits](double v) { return fmt::format("{:.{}f}", v, digits); };
  while (value != limit && tell(value) == tell(limit) && digits < most) ++digits;
  return {tell(value), tell(limit)};
}

/// A length and its limit, with at least the digits that the limit was given with [m].
std::pair<std::string, std::string> tell_beside_limit(double value, double limit) {
  int digits = 1;
  const auto is_rounded = [&] { return std::abs(std::stod(fmt::format("{:.{}f}", limit, digits)) - limit) > 1e-9; };
  while (digits < 4 && std::isfinite(limit) && is_rounded()) ++digits;
  return tell_apart(value, limit, digits);
}

/// Significant digits without an exponent: "0.0026", "1.3", "360".
std::string tell_briefly(double value, int digits = 2) {
  if (!(value > 0) || !std::isfinite(value)) return fmt::format("{:g}", value);
  int places = digits - 1 - static_cast<int>(std::floor(std::log10(value)));
  // of the rounded value: 0.996 is 1.0
  if (std::round(value * std::pow(10, places)) >= std::pow(10, digits)) --places;
  if (places >= 0) return fmt::format("{:.{}f}", value, places);
  return fmt::format("{:.0f}", std::round(value * std::pow(10, places)) * std::pow(10, -places));
}

void add_mechanism(const Context& c, const Mechanism& m) {
  Status status = Status::Info;
  if (m.name == "wrong direction") status = Status::Bad;
  if (c.plan.criteria.mechanism) status = *c.plan.criteria.mechanism == m.name ? Status::Good : Status::Bad;
  if (c.is_under_way) status = Status::Info;
  if (status == Status::Good && !m.is_final) status = Status::NotJudged;
  if (status == Status::Bad && c.plan.criteria.mechanism && may_change(c.plan, m)) status = Status::NotJudged;
  c.add("mechanism", "Mechanism", (c.is_under_way ? "Mechanism so far: " : "Mechanism: ") + m.name, m.text, m.tilt,
        "rad", status);
}

/// What it might have been called instead.
void add_near_verdicts(const Context& c, const Mechanism& m) {
  std::string text;
  for (const NearVerdict& near : find_near_verdicts(c.plan, c.model, c.map, c.k, c.recorder, c.summary)) {
    if (!text.empty()) text += " ";
    if (near.later != 0) {
      text += near.later > 0 ? fmt::format("Judged {:.2f} s later it would be \"{}\".", near.later, near.as.name)
                             : fmt::format("Judged {:.2f} s earlier it would be \"{}\".", -near.later, near.as.name);
      const auto [then, now] = tell_apart(100 * near.as.connected, 100 * m.connected, 0);
      text += then == now
                  ? fmt::format(" The largest connected part then holds {} % of the upper mass as well.", then)
                  : fmt::format(" The largest connected part then holds {} % of the upper mass instead of {} %.", then,
                                now);
      text += fmt::format(" It leans by {:.1f} deg, and its rear edge has come down {:.0f} % as far as its front edge.",
                          near.as.tilt / unit::deg, 100 * near.as.rear_share);
    } else {
      text += fmt::format("With {:g} times the bound of {} it would be \"{}\".", near.times, near.rule, near.as.name);
    }
  }
  if (text.empty()) return;
  text += " Changes as small as a charge's scatter may decide which it is.";
  c.add("mechanism.near", "Mechanism", "Near another verdict", text, kNone, "", Status::Warning);
}

/// Whether an upper block that moves at frame `last` has, since `begin` [s], not yet lost half of the speed that it had
/// gained: so far it may fall as well as sway. Speeds are those of its mass centre from frame to frame.
bool gains_speed(const Context& c, const std::vector<bool>& counts, double begin, size_t last) {
  for (size_t s = 0; s < c.map.structures.size(); ++s) {
    if (!counts[s]) continue;
    const std::vector<BlockFrame>& block = c.recorder.block_frames(s);
    if (block[last].fastest < c.k.rest_speed) continue;
    double highest = 0;
    bool has_slowed = false;
    for (size_t f = 1; f <= last; ++f) {
      const double dt = block[f].time - block[f - 1].time;
      if (block[f].time <= begin + 1e-9 || !(dt > 0)) continue;
      const double speed = norm(block[f].displacement - block[f - 1].displacement) / dt;
      if (speed > highest)
        highest = speed, has_slowed = false;
      else if (speed <= 0.5 * highest)
        has_slowed = true;
    }
    if (!has_slowed) return true;
  }
  return false;
}

/// About which axis heads of ground columns turn in what was said before the first charge, and what the other one
/// leaves.
std::string tell_heads(const Context& c, bool is_across) {
  const bool is_about_y = c.map.hinge_about_y != is_across;
  const std::string text = fmt::format(" Heads of ground columns turn about {} here; about {} ", is_about_y ? "y" : "x",
                                       is_about_y ? "x" : "y");
  if (c.across->zones.empty()) return text + "no equilibrium was found under dead load.";
  const ZoneFrame& other = (is_across ? c.recorder.zone_frames() : c.across->zones)[0];
  if (!(other.utilisation > 0)) return text + "no zone is loaded.";
  const std::string yielded = count_words(other.yielded, "", "zone has yielded", "zones have yielded");
  return text + fmt::format("the margin is {:.2f}", 1 / other.utilisation) +
         (yielded.empty() ? "" : ", and " + yielded) + ".";
}

/// What spans bear as mechanisms that the model has no hinges for, where that is less than the margin of its zones.
std::string tell_spans(const Context& c, double margin) {
  const std::vector<SpanMargin>& spans = c.map.spans;
  if (spans.empty() || spans[0].margin >= margin) return "";
  const size_t weak = c.map.count_weak_spans();
  const std::string lowest =
      fmt::format(" With hinges at both ends and in the middle {} bears {:.2f} times its dead load at the most",
                  spans[0].member, spans[0].margin);
  if (weak == 0) return lowest + ".";
  return lowest + fmt::format(
                      ": as described it could not stand, and the model does not see that. So it is with {} of {} "
                      "spans; check their bars.",
                      weak, spans.size());
}

/// Whether a state is nearer to its resistance than another: zones that have yielded stand on it.
bool is_nearer(const ZoneFrame& a, const ZoneFrame& b) {
  if ((a.yielded > 0) != (b.yielded > 0)) return a.yielded > 0;
  constexpr double round_off = 1e-6;  // of zones that stand on their limits
  if (a.yielded > 0 && std::abs(a.utilisation - b.utilisation) <= round_off) return a.yielded > b.yielded;
  return a.utilisation > b.utilisation;
}

/// Whether the building stood until each next stage, as far as frames tell.
struct Standing {
  bool fell = false;
  bool is_open = false;  // of some interval it cannot be said
};

Standing add_stability(const Context& c) {
  // each interval of standing: its last frame before the next stage, and what happened in it
  const auto stages = find_stage_times(c.map, true);
  Standing out;
  // of several structures those that have charges to come
  std::vector<bool> counts(c.map.structures.size(), true), counted_zones;
  std::vector<BlockFrame> block = c.recorder.farthest_block_frames();
  std::vector<ZoneFrame> zones = c.recorder.zone_frames();
  const auto look_at_those_to_stand = [&](double from) {
    if (c.map.structures.size() < 2) return;
    counts = find_structures_to_stand(c.plan, c.map, from);
    counted_zones = find_zones_of(counts, c.map, c.r);
    block = c.recorder.farthest_block_frames(counts);
    zones = find_zone_frames(c.r, counted_zones);
  };
  const auto describe = [&](const std::string& id, const std::string& title, size_t i, bool settled, double begin) {
    // before the first charge the smaller margin of both axes about which heads of ground columns may turn
    const HeadsAcross* across = settled ? nullptr : c.across;
    const bool is_across = across != nullptr && !across->zones.empty() && is_nearer(across->zones[0], zones[i]);
    const record::Record& r = is_across ? across->record : c.r;
    const ZoneFrame& z = is_across ? across->zones[0] : zones[i];
    const auto margins = is_across ? find_margins(r, 0) : find_margins(r, i, counted_zones);
    // margins are those of a building that stands
    const bool is_standing = stands(block[i], c.k);
    const bool has = is_standing && z.zone >= 0 && z.utilisation > 0;
    const double margin = has ? 1 / z.utilisation : kNone;
    std::string text = !is_standing ? "It does not stand"
                       : has
                           ? fmt::format("Zone {} is nearest to its resistance and uses {:.0f} % of it (margin {:.2f})",
                                         r.zones[static_cast<size_t>(z.zone)].name, 100 * z.utilisation, margin)
                           : "No zone is loaded";
    text += "; " + count_words(z.yielded, "no zone has yielded", "zone has yielded", "zones have yielded");
    if (settled)
      text += fmt::format(", {}. The upper block has moved by {:.1f} cm and its fastest part moves at {:.3f} m/s",
                          count_words(z.broken, "none is broken", "is broken", "are broken"),
                          100 * norm(find_displacement(block[i], c.k)), block[i].fastest);
    text += ".";
    if (is_standing && margins.size() > 1) {
      text += " Lowest margins:";
      for (size_t m = 0; m < std::min<size_t>(margins.size(), kShownMargins); ++m)
        text += fmt::format("{} {} {:.2f}", m > 0 ? "," : "", margins[m].member, margins[m].margin);
      text += fmt::format(" of {} members.", margins.size());
    }
    if (across != nullptr && is_standing) text += tell_heads(c, is_across);
    if (!settled && is_standing) text += tell_spans(c, margin);
    const bool has_weak_span = !settled && c.map.count_weak_spans() > 0;
    bool is_still = true, may_fall = false;
    if (settled && is_standing) {
      is_still = block[i].fastest < c.k.rest_speed;
      may_fall = !is_still && gains_speed(c, counts, begin, i);
      text += is_still   ? " It stands still."
              : may_fall ? " It has not slowed down since the stage before, so that it may sway or fall: not judged."
                         : fmt::format(" It still sways (still: below {:.2f} m/s).", c.k.rest_speed);
      out.is_open |= may_fall;
      size_t worst = i;  // of the frames of the pause
      for (size_t f = i; f-- > 0 && zones[f].time >= begin - 1e-9;)
        if (zones[f].utilisation > zones[worst].utilisation) worst = f;
      if (has && !is_still && worst != i)
        text += fmt::format(" This is the margin of one instant: the least in the pause is {:.2f}, at {:.2f} s.",
                            1 / zones[worst].utilisation, zones[worst].time);
    }
    if (settled && std::find(counts.begin(), counts.end(), false) != counts.end()) {
      std::string names;
      for (size_t s = 0; s < counts.size(); ++s)
        if (counts[s]) names += (names.empty() ? "" : ", ") + c.map.structures[s].name;
      text += fmt::format(" Judged of what has charges to come: {}.", names);
    }
    const Status status = !is_standing                                                  ? Status::Bad
                          : may_fall                                                    ? Status::NotJudged
                          : z.yielded > 0 || z.broken > 0 || !is_still || has_weak_span ? Status::Warning
                          : across != nullptr && across->zones.empty()                  ? Status::Warning
                                                                                        : Status::Good;
    c.add(id, "Stability", title, text, margin, "1", status);
    return is_standing;
  };
  if (block.empty()) return out;
  const bool rests = c.summary.ending == mbs::Summary::Ending::AtRest;  // from its end on nothing happens
  describe("stability.start", "Before the first charge", 0, false, 0);
  std::vector<size_t> fired;
  for (size_t s = 0; s + 1 < stages.size(); ++s) {
    const double end = stages[s + 1].first;
    look_at_those_to_stand(end);
    fired.push_back(stages[s].stage);
    const double begin = find_last_charge(c.plan, c.map, counts, fired);
    const size_t i = find_frame(block, end);
    const std::string id = fmt::format("stability.stage_{}", s + 1),
                      title = fmt::format("Between \"{}\" and \"{}\"", c.stage_name(stages[s].stage),
                                          c.stage_name(stages[s + 1].stage));
    const auto leave_open = [&](const std::string& why) {
      if (!c.is_under_way) c.add(id, "Stability", title, "Not judged: " + why + ".", kNone, "", Status::NotJudged);
      out.is_open = true;
    };
    const std::string next = c.stage_name(stages[s + 1].stage);
    const BlockFrame& last = block[i];
    if (stands(last, c.k)) {
      // no part falls faster than freely
      const double gap = rests && end > c.r.time.back() ? 0 : end - last.time;
      const double way = last.fastest * gap + 0.5 * norm(c.model.gravity) * gap * gap;
      if (!rests && end > c.r.time.back() + 1e-9) {
        leave_open(fmt::format("the run ends at {:.2f} s, before \"{}\"", c.r.time.back(), next));
        break;
      }
      if (begin >= end) {
        leave_open(fmt::format("\"{}\" begins before all charges of the stage before it have fired", next));
        continue;
      }
      if (last.time < begin || calc_away(last, c.k) + way / c.k.stands_displacement >= 1) {
        leave_open(fmt::format("the last frame before \"{}\" ({:.3f} s) is of {:.3f} s; a higher frame_rate keeps more",
                               next, end, last.time));
        continue;
      }
    }
    out.fell |= !describe(id, title, i, true, begin);
    if (!rests && end > c.r.time.back() + 1e-9) break;
  }
  return out;
}

/// Rings of shafts without bars that lie farther from where the shaft stood than it was high and wide.
void add_rolling_rings(const Context& c) {
  const size_t last = c.r.time.size() - 1;
  for (const product::Member& m : c.plan.members) {
    if (m.kind != product::MemberKind::Shaft || m.removed) continue;
    const product::Shaft& s = c.plan.shafts[static_cast<size_t>(m.shaft)];
    if (s.as_outer > 0 || s.as_inner > 0) continue;
    const double reach = m.end.z - m.start.z + s.diameter_foot;
    int count = 0;
    for (size_t b = 0; b < c.r.bodies.size(); ++b) {
      const float* at = &c.r.position[3 * (last * c.r.bodies.size() + b)];
      if (c.r.bodies[b].name.starts_with(m.name + "/") && std::hypot(at[0] - m.start.x, at[1] - m.start.y) > reach)
        ++count;
    }
    if (count == 0) continue;
    std::string text =
        fmt::format("Rings of {} that lie farther from where it stood than it was high and wide ({:.1f} m): {}.",
                    m.name, reach, count);
    text +=
        " A shaft without bars comes apart as it falls, and its rings are rigid: they roll and tumble on where real "
        "ones shatter.";
    text += " How far hangs on the last digits: look what shorter steps make of it.";
    c.add("debris.rings." + m.name, "Fall and debris", "Rings that roll", text, count, "", Status::Warning);
  }
}

void add_direction(const Context& c, const Mechanism& m) {
  const char *heading = "Fall and debris", *title = "Direction of fall";
  if (std::isnan(m.azimuth)) {
    c.add("azimuth", heading, title, "The mass centre moved by less than half a metre to any side.", kNone, "rad");
    return;
  }
  const auto off_plan = [&c](double azimuth) -> std::string {
    if (!c.map.is_direction_planned) return {};
    const double planned = std::atan2(c.map.fall_direction.y, c.map.fall_direction.x);
    const int digits = record::count_digits_of_angle(planned);
    return fmt::format(", {} deg from the planned {}",
                       fixed_words(calc_deviation(azimuth, planned) / unit::deg, digits),
                       record::tell_azimuth(planned, digits));
  };
  std::string text;
  if (m.falls.empty()) {
    const std::string way = record::tell_azimuth(m.azimuth);
    text = m.is_azimuth_of_lean ? fmt::format("At {:.2f} s the upper block leans towards {}", m.time, way)
                                : "The mass centre moved towards " + way;
    text += off_plan(m.azimuth) + " (0 deg is +x, counter-clockwise).";
  } else {
    text = "Of separate structures one by one (0 deg is +x, counter-clockwise).";
  }
  for (const Fall& f : m.falls) {
    const std::string way = record::tell_azimuth(f.azimuth);
    text += std::isnan(f.azimuth)
                ? fmt::format(" The mass centre of {} moved by less than half a metre to any side.", f.structure)
            : f.is_azimuth_of_lean
                ? fmt::format(" At {:.2f} s {} leans towards {}{}.", f.time, f.structure, way, off_plan(f.azimuth))
                : fmt::format(" The mass centre of {} moved towards {}{}.", f.structure, way, off_plan(f.azimuth));
  }
  if (m.is_azimuth_of_lean || !m.falls.empty())
    text += fmt::format(" The mass centre moved by {:.1f} m towards {}.", norm(m.run),
                        record::tell_azimuth(std::atan2(m.run.y, m.run.x)));
  const Vec3 d = c.map.fall_direction;
  const bool is_diagonal = c.map.is_direction_planned && has_heads(c.map) &&
                           std::abs(std::abs(d.x) - std::abs(d.y)) < std::numbers::sqrt2 * std::sin(kDiagonal);
  if (is_diagonal)
    text += fmt::format(
        " The plan asks for a fall along a diagonal of the grid: heads of ground columns turn about {} here, and about "
        "{} where the planned azimuth lies beyond the diagonal. Compare both.",
        c.map.hinge_about_y ? 'y' : 'x', c.map.hinge_about_y ? 'x' : 'y');
  c.add("azimuth", heading, title, text, m.azimuth < 0 ? m.azimuth + 2 * std::numbers::pi : m.azimuth, "rad");
}

Reach add_debris(const Context& c, const Mechanism& m) {
  const size_t last = c.r.time.size() - 1;
  Reach reach = calc_reach(c.r, last);
  add_direction(c, m);
  std::string text = fmt::format(
      "Beyond the footprint: {:.1f} m towards -x, {:.1f} m towards +x, {:.1f} m towards -y, {:.1f} m towards +y; the "
      "outline of all parts encloses {:.0f} m2.",
      reach.side[0], reach.side[1], reach.side[2], reach.side[3], reach.area);
  if (reach.farthest >= 0 && reach.largest >= 0.05)
    text += fmt::format(
        " The farthest part, {}, lies {:.1f} m from the footprint; 95 % of the mass lies within {:.1f} m of it.",
        c.r.bodies[static_cast<size_t>(reach.farthest)].name, reach.largest, reach.most_mass);
  text += fmt::format(
      " Towards each of these sides 95 % of the mass lies within {:.1f}, {:.1f}, {:.1f} and {:.1f} m of it.",
      reach.side_most[0], reach.side_most[1], reach.side_most[2], reach.side_most[3]);
  for (const double share : {0.5, 0.9})
    text += fmt::format(" The outline of the nearest {:.0f} % of the mass encloses {:.0f} m2.", 100 * share,
                        calc_area(calc_share_outline(c.r, last, share)));
  c.add("debris.reach", "Fall and debris", "Reach of the debris", text, reach.largest, "m");
  add_rolling_rings(c);
  const Heap heap = find_heap(c.r, last);
  double solid = 0;  // what is crushed included
  for (size_t b = 0; b < c.map.bodies.size(); ++b)
    if (!c.model.bodies[b].fixed && !stays_beside(c.r, b, last)) solid += c.map.bodies[b].volume;
  for (const DebrisEntry& d : c.map.debris) solid += d.volume;
  c.add("debris.height", "Fall and debris", "Height of the hill",
        fmt::format("The highest point of all parts lies {:.1f} m above the ground.", heap.height), heap.height, "m");
  c.add("debris.volume", "Fall and debris", "Volume of the hill",
        fmt::format("Bulk volume under the upper surface of all parts: {:.0f} m3, hollows under parts that lie across "
                    "others included. The parts themselves have {:.0f} m3: bulked by a factor of {:.1f}.",
                    heap.volume, solid, solid > 0 ? heap.volume / solid : 0.0),
        heap.volume, "m3");
  return reach;
}

/// What a part that stands in its place at the start belongs to: "C-A1-0" for its stump, and for what a charge will
/// throw out of it.
std::string standing_name(const Context& c, size_t body) {
  const std::string& name = c.r.bodies[body].name;
  for (const product::Member& m : c.plan.members)
    if (name.rfind(m.name + "/", 0) == 0) return m.name;
  return name;
}

void add_clearances(const Context& c) {
  for (const product::Neighbour& n : c.plan.neighbours) {
    const Approach a = find_approach(c.r, n.footprint, c.cancel);
    const std::string lowest_who = c.r.bodies[a.lowest_body].name;
    const bool asked = n.clearance.has_value(), is_over = std::isfinite(a.lowest);
    const auto [distance, limit] = tell_beside_limit(a.least, n.clearance.value_or(kNone));
    std::string text =
        a.when <= c.r.time.front()
            ? fmt::format("{} stands {} m away from the start, and nothing has come nearer", standing_name(c, a.body),
                          distance)
            : fmt::format("The nearest part, {}, comes to {} m at {:.2f} s", c.r.bodies[a.body].name, distance, a.when);
    if (a.lowest <= kOnGround)
      text = a.lowest_when <= c.r.time.front()
                 ? fmt::format("{} stands on it from the start", standing_name(c, a.lowest_body))
                 : fmt::format("{} lands on it at {:.2f} s", lowest_who, a.lowest_when);
    else if (is_over)
      text = fmt::format(
          "Nothing lands on it, but parts are over it: {} comes down to {:.1f} m above the ground there, at {:.2f} s",
          lowest_who, a.lowest, a.lowest_when);
    if (asked) text += fmt::format("; the limit is {} m", limit);
    const double stave = calc_stave_error(c.r.bodies[a.body]);
    std::string of_staves;
    if (stave > 0)
      of_staves = fmt::format(" A shaft's ring is made of flat staves: real distances may differ by {:.2f} m.", stave);
    const bool is_reached = is_over, lands = a.lowest <= kOnGround;
    const bool is_close = asked && !is_over && std::abs(a.least - *n.clearance) < stave;
    const bool is_broken = asked && (a.least < *n.clearance || lands);
    const std::string why = !asked || is_broken ? "" : find_what_is_open(c, [&](const OpenPart& part) {
      return calc_distances_at_end(c, part.body, n.footprint).first - part.way < *n.clearance;
    });
    const Status status = !asked           ? (is_reached ? Status::Warning : Status::Info)
                          : is_close       ? Status::NotJudged
                          : is_broken      ? Status::Bad
                          : !why.empty()   ? Status::NotJudged
                          : is_reached     ? Status::Warning
                          : c.is_under_way ? Status::Info
                                           : Status::Good;
    c.add("clearance." + n.name, "Clearance", n.name, fmt::format("{}.{}{}", text, of_staves, why), a.least, "m",
          status);
  }
}

/// Limits of a neighbour over the frequencies in which the ground answers; 0: none [m/s].
std::pair<double, double> find_vibration_limits(const product::Neighbour& n, const product::VibrationLaw& law) {
  if (n.vibration_limit > 0) return {n.vibration_limit, n.vibration_limit};
  if (n.building_class == product::BuildingClass::Unknown) return {0, 0};
  return {calc_vibration_limit(n.building_class, law.low_frequency),
          calc_vibration_limit(n.building_class, law.high_frequency)};
}

/// Why a band that stays below its limit is not judged; empty: nothing that still moved could bring it there, if all
/// its energy came down at once as near as it may go.
std::string find_what_may_shake(const Context& c, const product::Neighbour& n, const Shaking& s, double limit) {
  const product::VibrationLaw& law = *c.plan.vibration;
  const double a = law.energy_exponent, gravity = norm(c.model.gravity);
  const OpenPart* fastest = nullptr;
  double sum = std::pow(s.end_velocity, 1 / a);
  for (const OpenPart& part : c.open) {
    const double energy =
        c.r.bodies[part.body].mass *
        (0.5 * part.speed * part.speed + gravity * std::max(0.0, c.pose(c.r.time.size() - 1, part.body).p.z));
    const double distance = calc_distances_at_end(c, part.body, n.footprint).first - part.way;
    sum += std::pow(calc_velocity(law, energy, distance), 1 / a);
    if (fastest == nullptr || part.speed > fastest->speed) fastest = &part;
  }
  if (fastest == nullptr || law.factor * std::pow(sum, a) < limit) return {};
  return fmt::format("{}{} still moved at {:.1f} m/s when the run ended, and what has yet to come down may reach it",
                     kNotJudged, c.r.bodies[fastest->body].name, fastest->speed);
}

void add_vibration(const Context& c, const Mechanism& m) {
  const char* heading = "Ground vibration";
  if (!c.plan.vibration) {
    c.add("vibration", heading, "Ground vibration",
          "Not given: a screening needs the site's attenuation law ([site.vibration]).", kNone, "");
    for (const product::Neighbour& n : c.plan.neighbours)
      if (n.vibration_limit > 0 || n.building_class != product::BuildingClass::Unknown)
        c.add("vibration." + n.name, heading, n.name,
              n.vibration_limit > 0
                  ? fmt::format("Not judged: the limit of {:g} mm/s needs the site's attenuation law "
                                "([site.vibration]).",
                                n.vibration_limit / unit::mm)
                  : "Not judged: the limits of its class need the site's attenuation law ([site.vibration]).",
              kNone, "m/s", Status::NotJudged);
    return;
  }
  const product::VibrationLaw& law = *c.plan.vibration;
  std::string source = law.source;
  while (!source.empty() && (source.back() == '.' || source.back() == ' ')) source.pop_back();  // the sentence has one
  c.add("vibration", heading, "Screening, not a prediction",
        fmt::format("v = {:g} mm/s (E / {:g} MJ)^{:g} (r / {:g} m)^-{:g}, between 1/{:g} and {:g} times that, with E "
                    "the energy that moving parts lose within {:g} s, whatever takes it, so that it is an upper end; "
                    "source of these numbers: {}. What the ground really does is for measurements on site to show.",
                    law.velocity / unit::mm, law.energy * 1e-6, law.energy_exponent, law.distance,
                    law.distance_exponent, law.factor, law.factor, law.window, source),
        kNone, "");
  // what round-off makes of a building that stands is no energy
  const double least_energy = 1e-6 * c.map.moving_mass * norm(c.model.gravity);
  // contacts of finite elements have no restitution: what is booked is what they take
  const double restitution = c.r.provenance.engine == "finite elements" ? 0 : c.model.contact.restitution;
  for (const product::Neighbour& n : c.plan.neighbours) {
    const Shaking s = find_shaking(law, c.r, c.recorder.speeds(), c.model.gravity, restitution, n.footprint);
    const bool is_shaken = s.energy > least_energy;
    const double low = is_shaken ? s.velocity / law.factor : 0, high = is_shaken ? s.velocity * law.factor : 0;
    const auto [least, most] = find_vibration_limits(n, law);
    // as many digits as show on which side of a limit an end lies
    int digits = 2;
    const auto looks_like = [&digits](double end, double limit) {
      return end != limit && tell_briefly(end / unit::mm, digits) == tell_briefly(limit / unit::mm, digits);
    };
    while (digits < 6 && (looks_like(high, least) || looks_like(low, most))) ++digits;
    std::string text = "No moving part loses energy";
    if (is_shaken)
      text = fmt::format(
          "Screening: {} to {} mm/s, {} in the middle, around {:.2f} s from {} MJ lost within {:.2f} s, most of it by "
          "{} at {:.0f} m",
          tell_briefly(low / unit::mm, digits), tell_briefly(high / unit::mm, digits),
          tell_briefly(s.velocity / unit::mm), s.time, tell_briefly(s.energy * 1e-6), s.window,
          c.r.bodies[static_cast<size_t>(s.body)].name, s.distance);
    if (n.vibration_limit > 0)
      text += fmt::format(". Limit of the plan: {:g} mm/s", least / unit::mm);
    else if (least > 0)
      text += fmt::format(". Limit at the foundation between {:g} Hz and {:g} Hz: {:.3g} to {:.3g} mm/s ({}; {})",
                          law.low_frequency, law.high_frequency, least / unit::mm, most / unit::mm, kVibrationSource,
                          describe_vibration_limit(n.building_class));
    Status status = Status::Info;
    if (least > 0) {
      status = high < least ? Status::Good : low > most ? Status::Bad : Status::Warning;
      text += status == Status::Good  ? ": the band stays below it"
              : status == Status::Bad ? ": the band lies above it"
                                      : ": the band reaches it";
      if (status == Status::Good && c.is_under_way) {
        status = Status::Info;
      } else if (status == Status::Good) {
        const std::string why = m.is_final ? find_what_may_shake(c, n, s, least)
                                           : fmt::format("{}it had not come to rest when the run ended", kNotJudged);
        if (!why.empty()) text += "." + why, status = Status::NotJudged;
      }
    }
    c.add("vibration." + n.name, heading, n.name, text + ".", high, "m/s", status);
  }
}

void add_touchdown(const Context& c) {
  const double t = c.recorder.first_touchdown();
  if (!std::isfinite(t)) {
    c.add("touchdown.first", "Touchdown", "First touchdown",
          fmt::format("No part of the upper block {} the ground{}.", c.is_under_way ? "has touched" : "touched",
                      c.is_under_way ? " so far" : ""),
          kNone, "s");
  } else {
    const double kinetic = c.recorder.first_touchdown_kinetic();
    c.add("touchdown.first", "Touchdown", "First touchdown",
          fmt::format("{} is the first part of the upper block on the ground, at {:.2f} s, when {} are in motion.",
                      c.recorder.first_touchdown_body(), t, record::tell_measure(kinetic, "J", 1)),
          t, "s");
    double largest = 0, when = 0;
    const auto series = std::find_if(c.r.series.begin(), c.r.series.end(),
                                     [](const record::Series& s) { return s.id == "energy_kinetic"; });
    for (size_t i = 0; i < c.r.time.size(); ++i)
      if (series->value[i] > largest) largest = series->value[i], when = c.r.time[i];
    // the impact takes some of it before the next frame
    if (kinetic > largest) largest = kinetic, when = t;
    c.add("touchdown.energy", "Touchdown", "Largest energy in motion",
          fmt::format("{} at {:.2f} s.", record::tell_measure(largest, "J", 1), when), largest, "J");
    const MeanForce mean = c.recorder.find_largest_ground_force();
    const double apart = c.r.time.size() > 1 ? c.r.time[1] - c.r.time[0] : 0;
    c.add("touchdown.force", "Touchdown", "Largest ground force",
          fmt::format("{} at {:.2f} s, {:.1f} times the weight, as a mean over {:.3g} s; shorter peaks are higher.",
                      record::tell_measure(mean.force, "N", 1), mean.time,
                      mean.force / (c.map.moving_mass * std::max(norm(c.model.gravity), 1e-9)), mean.window) +
              (apart > kForceFramesApart
                   ? fmt::format(" It is known at frames {:.2g} s apart and may be higher between them.", apart)
                   : std::string()),
          mean.force, "N");
  }
  const std::vector<Touchdown>& all = c.recorder.touchdowns();
  if (!all.empty()) {
    std::vector<const Touchdown*> order;
    double energy = 0, momentum = 0;
    for (const Touchdown& d : all) order.push_back(&d), energy += d.energy, momentum += d.momentum;
    std::stable_sort(order.begin(), order.end(),
                     [](const Touchdown* a, const Touchdown* b) { return a->energy > b->energy; });
    const std::string falls = record::tell_measure(energy, "J", 1), pushes = record::tell_measure(momentum, "N s", 2);
    std::string text =
        all.size() == 1
            ? fmt::format(
                  "One part touches the ground for the first time, at {:.2f} s, with {} and {} downwards. It is:",
                  all.front().time, falls, pushes)
            : fmt::format(
                  "{} parts touch the ground for the first time between {:.2f} s and {:.2f} s, with {} and {} "
                  "downwards in all (each part alone, as it touches). Largest:",
                  all.size(), all.front().time, all.back().time, falls, pushes);
    for (size_t i = 0; i < std::min(order.size(), kShownTouchdowns); ++i)
      text += fmt::format("{} {} at {:.2f} s at ({:.1f}, {:.1f}) m with {} and {}", i > 0 ? ";" : "",
                          c.r.bodies[static_cast<size_t>(order[i]->body)].name, order[i]->time, order[i]->place[0],
                          order[i]->place[1], record::tell_measure(order[i]->energy, "J", 2),
                          record::tell_measure(order[i]->momentum, "N s", 2));
    c.add("touchdown.parts", "Touchdown", "Touchdown of the parts", text + ".", energy, "J");
  }
}

void add_rigid_block(const Context& c) {
  const auto stages = c.stage_times();
  if (stages.empty()) return;
  const Vec3 d = c.map.fall_direction, axis = c.map.hinge_axis;
  // one block over one level of hinges: that of a mouth, or of the ground storey if charges act there
  if (c.map.structures.size() > 1) return;
  std::vector<const GroundColumn*> hinges;
  bool is_fired = false, is_shaft = false;
  for (const GroundColumn& g : c.map.ground_columns) {
    const BodyEntry& carried = c.map.bodies[static_cast<size_t>(g.body)];
    if (carried.structure < 0) continue;
    is_fired |= g.is_fired;
    is_shaft |= carried.kind == "shaft";
    if (!g.is_fired) hinges.push_back(&g);
  }
  if (hinges.empty() || !(is_fired || is_shaft)) return;
  if (is_shaft && hinges.size() > 1) return;
  if (!is_shaft && std::min(std::abs(d.x), std::abs(d.y)) > kSkew) {
    c.add("rigid_block", "Mechanism", "Beside a rigid block",
          "No comparison: the heads of the columns turn about an axis of the grid, and the planned azimuth lies askew "
          "to it.",
          kNone, "rad");
    return;
  }
  // the block pivots over the foremost row that keeps standing
  // rows follow the grid, also where the fall lies a little askew to it
  const Vec3 across = is_shaft        ? d
                      : is_along_x(d) ? Vec3{std::copysign(1.0, d.x), 0, 0}
                                      : Vec3{0, std::copysign(1.0, d.y), 0};
  double foremost = -1e30;
  for (const GroundColumn* g : hinges) foremost = std::max(foremost, dot(g->p_top, across));
  std::vector<const GroundColumn*> row;
  for (const GroundColumn* g : hinges)
    if (dot(g->p_top, across) > foremost - 0.5) row.push_back(g);
  RigidBlock block;
  block.gravity = norm(c.model.gravity);
  block.release = 0;
  for (const auto& stage : stages) block.release = std::max(block.release, stage.last);
  Vec3 pivot, centre;
  for (const GroundColumn* g : row) pivot += (1.0 / static_cast<double>(row.size())) * g->p_top;
  for (size_t b = 0; b < c.model.bodies.size(); ++b) {
    if (!c.map.bodies[b].is_upper) continue;
    const mbs::Body& body = c.model.bodies[b];
    block.mass += body.mass;
    centre += body.mass * body.X_WB.p;
    const Vec3 arm = body.X_WB.p - pivot;
    block.inertia += dot(axis, body.inertia * axis) + body.mass * (dot(arm, arm) - std::pow(dot(arm, axis), 2));
  }
  centre *= 1 / block.mass;
  block.ahead = dot(centre - pivot, d);
  // a shaft falls to its mouth, over the ring behind it
  const Vec3 aside = centre - pivot - block.ahead * d;
  if (is_shaft && std::hypot(aside.x, aside.y) > kSkew * std::abs(block.ahead)) {
    c.add("rigid_block", "Mechanism", "Beside a rigid block",
          "No comparison: what is left of the ring does not lie behind the planned direction.", kNone, "rad");
    return;
  }
  block.above = (centre - pivot).z;
  const double share = -block.mass * block.gravity / static_cast<double>(row.size());
  for (const GroundColumn* g : row) {
    const mbs::MomentFamily& f = c.model.laws[static_cast<size_t>(g->element.law.index)].moment_z;
    double most = 0;
    const size_t J = f.plastic_rotation.size();
    for (size_t n = 0; n + 1 < f.normal_force.size(); ++n) {
      if (share < f.normal_force[n] || share > f.normal_force[n + 1]) continue;
      const double s = (share - f.normal_force[n]) / (f.normal_force[n + 1] - f.normal_force[n]);
      for (size_t j = 0; j < J; ++j)
        most = std::max({most, (1 - s) * f.positive[n * J + j] + s * f.positive[(n + 1) * J + j],
                         (1 - s) * f.negative[n * J + j] + s * f.negative[(n + 1) * J + j]});
    }
    block.plastic_moment += most;
  }
  record::Series series{"tilt_angle_rigid_block", "Tilt angle of a rigid block", "rad", "angle",
                        calc_rigid_block(block, c.r.time)};
  const double when = block.release + 1;
  const std::string tons = decimal_words(block.mass / unit::t, 0),
                    moment = decimal_words(block.plastic_moment * 1e-6, 2);  // [t, MNm]
  // literals as wholes, as they are translated
  const auto words = [&]() -> std::string {
    const double way = std::abs(block.ahead);
    if (row.size() == 1 && block.ahead < 0)
      return fmt::format(
          "a rigid block in its place ({} t on a plastic hinge of {} MNm, its mass centre {:.2f} m behind it)", tons,
          moment, way);
    if (row.size() == 1)
      return fmt::format(
          "a rigid block in its place ({} t on a plastic hinge of {} MNm, its mass centre {:.2f} m ahead of "
          "it)",
          tons, moment, way);
    if (block.ahead < 0)
      return fmt::format(
          "a rigid block in its place ({} t on {} plastic hinges of {} MNm in all, its mass centre {:.2f} m "
          "behind them)",
          tons, row.size(), moment, way);
    return fmt::format(
        "a rigid block in its place ({} t on {} plastic hinges of {} MNm in all, its mass centre {:.2f} m "
        "ahead of them)",
        tons, row.size(), moment, way);
  };
  const std::string model_words = words();
  std::string hinge_words = row.size() == 1 ? "Its hinge does not give before it yields, unlike a zone of the model."
                                            : "Its hinges do not give before they yield, unlike zones of the model.";
  if (!c.model.cables.empty()) hinge_words += " Cables are not counted in that.";
  // a block that has already left its place is not released from rest
  bool rests = true;
  for (const BlockFrame& f : c.recorder.block_frames())
    rests &= f.time > block.release || norm(f.displacement) < c.k.stands_displacement;
  double before = -1;  // the last charge of a stage that is over before
  for (const auto& stage : stages)
    if (stage.last < block.release) before = std::max(before, stage.last);
  if (before >= 0)
    rests &= !gains_speed(c, std::vector<bool>(c.map.structures.size(), true), before,
                          find_frame(c.recorder.block_frames(), block.release));
  if (!rests) {
    const bool has_fired = c.r.time.back() >= block.release - 1e-9;
    c.add("rigid_block", "Mechanism", "Beside a rigid block",
          has_fired ? "No comparison: the upper block was in motion before the last charge fired."
                    : "No comparison: the run ended before the last charge fired.",
          kNone, "rad");
    return;
  }
  if (block.mass * block.gravity * block.ahead <= block.plastic_moment) {
    c.add("rigid_block", "Mechanism", "Beside a rigid block",
          "By comparison, " + model_words + " would stay at rest: its weight alone does not turn it. " + hinge_words +
              " What is let go at once on a hinge that gives first may turn over all the same.",
          kNone, "rad");
  } else if (when <= c.r.time.back() + 1e-9) {
    const double here = interpolate(c.r.time, c.r.series.front().value, when),
                 there = interpolate(c.r.time, series.value, when);
    c.add("rigid_block", "Mechanism", "Beside a rigid block",
          fmt::format("1 s after the last stage the upper block leans by {:.1f} deg; {} would lean by {:.1f} deg.",
                      here / unit::deg, model_words, there / unit::deg) +
              (is_shaft ? " Unlike the model, that block does not bend, yield or break above its mouth."
                        : " Unlike the model, that block has no yielding storeys, no swaying ground storey and no "
                          "columns that shorten.") +
              " " + hinge_words,
          here - there, "rad");
  }
  c.r.series.insert(c.r.series.begin() + 1, std::move(series));
}

const product::Charge& charge_of(const Context& c, const Firing& f) {
  return c.plan.stages[static_cast<size_t>(f.stage)].charges[static_cast<size_t>(f.charge)];
}
const std::string& member_of(const Context& c, const Firing& f) {
  return c.plan.members[static_cast<size_t>(charge_of(c, f).member)].name;
}

void add_events(const Context& c) {
  std::map<std::string, long> n;
  // events of charges that fail say so; those that were taken out of the plan fail without its word
  long failed = 0, taken_out = 0;
  for (const record::Event& e : c.r.events) {
    const auto failing = std::find_if(c.map.schedule.begin(), c.map.schedule.end(), [&](const Firing& f) {
      return f.fails && f.time == e.time && e.kind == "charge" && member_of(c, f) == e.subject;
    });
    if (failing == c.map.schedule.end())
      ++n[e.kind];
    else
      ++(charge_of(c, *failing).fails ? failed : taken_out);
  }
  // bars that a charge left and that are crushed later are no zone that broke
  const auto zones = c.r.zone_state.end() - static_cast<std::ptrdiff_t>(c.r.zones.size());
  const auto joints = zones + static_cast<std::ptrdiff_t>(c.model.elements.size() + c.model.rotational_elements.size());
  const auto broken = std::count(zones, joints, static_cast<std::uint8_t>(record::ZoneState::Broken));
  std::string text = fmt::format("Charges: {}; zones yielded: {}, broken: {}; joints off: {}; parts on the ground: {}.",
                                 n["charge"], n["yield"], broken, n["release"], n["touchdown"]);
  if (c.charges_left > 0) text += " " + tell_charges_left(c);
  if (failed > 0)
    text += " " + count_words(failed, "", "charge fails, as the plan says", "charges fail, as the plan says") + ".";
  if (taken_out > 0) text += " " + count_words(taken_out, "", "charge was taken out", "charges were taken out") + ".";
  c.add("events", "Events", "Events", text, static_cast<double>(c.r.events.size()), "1",
        c.charges_left > 0 ? Status::Warning : Status::Info);
  size_t i = 0;
  for (const ModelNote& note : c.map.notes)
    c.add("note." + std::to_string(++i), "Events", note.title, note.text, kNone, "", Status::Warning);
  for (const ModelNote& remark : c.map.remarks)
    c.add("note." + std::to_string(++i), "Events", remark.title, remark.text, kNone, "", Status::Info);
}

/// How far what came down has crushed what charges left of columns.
void add_stubs(const Context& c) {
  std::map<std::string, const StubEntry*> crushed;  // by member
  const StubEntry* most = nullptr;
  const auto by = [&c](const StubEntry& s) { return c.recorder.shortening_of(s.zone); };
  std::set<std::string> stubs;  // by member, which a higher charge may shorten
  for (const StubEntry& s : c.map.stubs) {
    stubs.insert(s.member);
    if (!(by(s) > s.peak)) continue;
    crushed[s.member] = &s;
    if (!most || by(s) > by(*most)) most = &s;
  }
  if (!most) return;
  const auto first =
      std::find_if(c.r.events.begin(), c.r.events.end(), [](const auto& e) { return e.kind == "crushing"; });
  std::string text = stubs.size() == 1
                         ? std::string("What came down has crushed the one stub that charges left under joints")
                         : fmt::format("Of {} stubs that charges left under joints what came down has crushed {}",
                                       stubs.size(), crushed.size());
  if (first != c.r.events.end()) text += fmt::format(", the first at {:.2f} s ({})", first->time, first->subject);
  c.add("stubs", "Touchdown", "Crushed stubs",
        text + fmt::format(". Most: {} by {:.2f} of {:.2f} m.", most->member, by(*most), most->length), by(*most), "m");
}

/// Where it fell, or each of several structures: "180 deg (heavy), 0 deg (light)".
std::string tell_ways(const Mechanism& m, int digits) {
  if (m.falls.empty()) return record::tell_azimuth(m.azimuth, digits);
  std::string text;
  for (const Fall& f : m.falls)
    if (!std::isnan(f.azimuth))
      text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", record::tell_azimuth(f.azimuth, digits), f.structure);
  return text;
}

void add_criteria(const Context& c, const Mechanism& m, const Standing& standing, const Reach& reach) {
  const product::Criteria& want = c.plan.criteria;
  // why: it may still change
  const auto judge_one = [&](const std::string& id, const std::string& title, bool met, const std::string& text,
                             double value, const std::string& unit, const std::string& why) {
    c.add("criterion." + id, "Criteria", title, text + why, value, unit,
          !why.empty() ? Status::NotJudged
          : met        ? Status::Good
                       : Status::Bad);
  };
  const auto falls_on = [&](bool met) -> std::string {
    if (met ? m.is_final && c.charges_left == 0 : !may_change(c.plan, m)) return "";
    if (c.charges_left > 0) return kNotJudged + tell_charges_left(c);
    return fmt::format("{}it had not come to rest when the run ended.", kNotJudged);
  };
  if (want.mechanism) {
    const bool met = m.name == *want.mechanism;
    judge_one("mechanism", "Mechanism", met, fmt::format("Asked: {}; found: {}.", *want.mechanism, m.name), kNone, "",
              falls_on(met));
  }
  if (want.azimuth) {
    const double off = calc_deviation(m, *want.azimuth);
    const double tolerance = want.azimuth_tolerance.value_or(c.k.mechanism_direction_tolerance);
    // as many digits as show whether it is within the tolerance
    const int asked = record::count_digits_of_angle(*want.azimuth), about = record::count_digits_of_angle(tolerance);
    int digits = asked;
    while (std::isfinite(off) && off > tolerance && digits < 6 &&
           fmt::format("{:.{}f}", off / unit::deg, digits) == fmt::format("{:.{}f}", tolerance / unit::deg, digits))
      ++digits;
    judge_one("azimuth", "Direction", off <= tolerance,
              std::isnan(m.azimuth)
                  ? fmt::format("Asked: {} +- {} deg; nothing fell to any side.",
                                record::tell_azimuth(*want.azimuth, asked), fixed_words(tolerance / unit::deg, about))
                  : fmt::format("Asked: {} +- {} deg; found: {}.", record::tell_azimuth(*want.azimuth, asked),
                                fixed_words(tolerance / unit::deg, about), tell_ways(m, digits)),
              off, "rad", falls_on(off <= tolerance));
  }
  if (want.debris_reach) {
    const auto [found, limit] = tell_beside_limit(reach.largest, *want.debris_reach);
    const bool met = reach.largest <= *want.debris_reach;
    const std::string why = !met ? "" : find_what_is_open(c, [&](const OpenPart& part) {
      return calc_distances_at_end(c, part.body, find_start_outline(c.r, part.body)).second + part.way >
             *want.debris_reach;
    });
    judge_one("debris_reach", "Reach of the debris", met,
              fmt::format("Asked: at most {} m; found: {} m.", limit, found), reach.largest, "m", why);
  }
  if (want.stands_between_stages) {
    const bool is_known = standing.fell || !standing.is_open;
    c.add("criterion.stands_between_stages", "Criteria", "Standing between stages",
          fmt::format("Asked: {}; found: {}.", *want.stands_between_stages ? "stands" : "falls",
                      standing.fell ? "falls"
                      : is_known    ? "stands"
                                    : "not judged"),
          kNone, "",
          !is_known                                      ? Status::NotJudged
          : standing.fell != *want.stands_between_stages ? Status::Good
                                                         : Status::Bad);
  }
}

void add_verification(const Context& c) {
  const mbs::Summary& s = c.summary;
  // a standing building releases nothing that its round-off could be measured with
  const auto energy = [&c](const char* id, size_t frame) {
    const auto at =
        std::find_if(c.r.series.begin(), c.r.series.end(), [id](const record::Series& x) { return x.id == id; });
    return at == c.r.series.end() || at->value.empty() ? 0.0 : at->value[frame];
  };
  double residual = 0, released = 0;
  for (size_t i = 0; i < c.r.time.size(); ++i) {
    residual = std::max(residual, std::abs(energy("energy_residual", i)));
    released =
        std::max(released, energy("energy_loads", i) - energy("energy_gravity", i) - energy("energy_removed", i));
  }
  const double stored = c.r.time.empty() ? 0 : energy("energy_elastic", 0);
  const double scale = c.map.moving_mass * norm(c.model.gravity) * std::max(c.map.ground_storey_height, 1.0);
  const bool negligible =
      residual <= 1e-5 * scale;  // as if the building were lifted by some hundredths of a millimetre
  const auto add_balance = [&c](const std::string& text, double error, Status status) {
    c.add("verification.energy", "Verification", "Energy balance", text, error, std::isnan(error) ? "" : "1", status);
  };
  const double accepted = c.k.verification_energy_error;
  const bool has_elements = c.r.provenance.engine == "finite elements";
  const std::string half_step =
      has_elements ? fmt::format("; --scaled-step \"{:.2g} ms\" shows whether it is the step's", s.step * 500)
                   : fmt::format("; a step of {:.2g} ms shows whether it is the step's", s.step * 500);
  if (s.ending == mbs::Summary::Ending::Diverged)
    add_balance(fmt::format("The computation failed at {:.3f} s; the balance says nothing about that.", s.time), kNone,
                Status::Bad);
  else if (negligible)
    add_balance(
        fmt::format(
            "The largest error of the energy balance is {:.1e} J, the work of lifting the building by {:.2g} mm.",
            residual, residual / (c.map.moving_mass * norm(c.model.gravity)) * 1e3),
        0, Status::Good);
  else if (released < stored)
    add_balance(
        fmt::format("The largest error of the energy balance is {:.1e} J, the work of lifting the building by {:.2g} "
                    "mm: {:.2g} % of what its zones store at rest, which is more than it releases (accepted: {:.2g} "
                    "%){}.",
                    residual, residual / (c.map.moving_mass * norm(c.model.gravity)) * 1e3, 100 * residual / stored,
                    100 * accepted, residual > accepted * stored ? half_step : ""),
        residual / stored, residual <= accepted * stored ? Status::Good : Status::Bad);
  else
    add_balance(
        fmt::format("The largest error of the energy balance is {:.2g} % of the released potential energy (accepted: "
                    "{:.2g} %){}.",
                    100 * s.energy_error, 100 * accepted, s.energy_error > accepted ? half_step : "") +
            (s.energy_error <= accepted && residual > 1.05 * s.energy_error * released
                 ? fmt::format(" Single frames read up to {:.2g} %, of steps in which parts meet: the steps after them "
                               "take that back.",
                               100 * residual / released)
                 : std::string()),
        s.energy_error, s.energy_error <= accepted ? Status::Good : Status::Bad);
  const double reaction = c.recorder.start_reaction_error();
  // charges that fire at the very beginning are already at work in the first frame
  const bool early = !c.map.events.empty() && c.model.events.front().time <= 0;
  c.add("verification.equilibrium", "Verification", "Equilibrium under dead load",
        fmt::format(
            "After {1} iterations the largest unbalanced force is {0:.1e} of the weight, and the reactions of the "
            "ground differ from the weight by {2:.1e} of it{3}.",
            s.equilibrium_residual, s.equilibrium_iterations, reaction,
            early ? " (the first charges fire in this instant)" : ""),
        early ? s.equilibrium_residual : reaction, "1",
        std::max(s.equilibrium_residual, early ? 0.0 : reaction) <= c.k.verification_equilibrium_residual
            ? Status::Good
            : Status::Bad);
  if (const double apart = c.r.time.size() > 1 ? c.r.time[1] - c.r.time[0] : 0; apart > kFramesApart)
    c.add(
        "verification.frames", "Verification", "Rate of frames",
        fmt::format("Frames are {:.3g} s apart: leans, energies and distances between them are interpolated, and peaks "
                    "between them are not seen. A higher frame_rate keeps more.",
                    apart),
        apart, "s", Status::Warning);
  c.add("verification.step", "Verification", "Time step",
        describe_steps(s) + (c.model.joints.empty()
                                 ? std::string()
                                 : fmt::format(" Joints drift by at most {:.1e} m or rad.", s.joint_drift)),
        s.step, "s", s.step_needed > 0 ? Status::Warning : Status::Info);
  for (size_t i = 0; i < s.notes.size(); ++i)
    c.add(fmt::format("verification.note.{}", i + 1), "Verification", "Note of the engine", s.notes[i], kNone, "",
          Status::Warning);
}

/// Of what finds no equilibrium: the members that would bear more than they can, the most loaded first.
void add_overloads(const Context& c) {
  constexpr size_t most = 20;
  constexpr double countless = 100;  // hardly any capacity is left
  std::vector<std::pair<std::string, double>> members;
  for (const mbs::Overload& o : c.summary.overloads) {
    const std::string& name = c.map.elements[o.element].member;
    if (std::none_of(members.begin(), members.end(), [&](const auto& m) { return m.first == name; }))
      members.emplace_back(name, o.used);
  }
  if (members.empty()) return;
  std::string list;
  for (size_t i = 0; i < std::min(most, members.size()); ++i)
    list += fmt::format("{}{} {}", i > 0 ? ", " : "", members[i].first,
                        members[i].second < countless ? fmt::format("{:.0f} %", 100 * members[i].second)
                                                      : fmt::format("> {:.0f} %", 100 * countless));
  if (members.size() > most) list += fmt::format(", and {} more", members.size() - most);
  c.add("overloads", "Stability", "Overloaded members",
        fmt::format("Members that would be loaded beyond their capacity if they had no limits: {}. Share of the "
                    "capacity, the most loaded first: {}.",
                    members.size(), list),
        members.front().second, "1", Status::Bad);
}

/// How hard cables pull, by the frames.
void add_cables(const Context& c) {
  for (const mbs::Cable& cable : c.model.cables) {
    const auto& all = c.r.series;
    const auto pull =
        std::find_if(all.begin(), all.end(), [&](const auto& s) { return s.id == "cable_" + cable.name; });
    if (pull == all.end()) continue;
    double first = kNone, most = 0, when = 0;
    for (size_t i = 0; i < c.r.time.size(); ++i) {
      if (!std::isfinite(pull->value[i])) continue;
      if (std::isnan(first)) first = pull->value[i];
      if (pull->value[i] > most) most = pull->value[i], when = c.r.time[i];
    }
    std::string text = "It is slack in all frames.";
    if (most > 0) {
      text = fmt::format("It pulls with {:.4g} kN at first and with {:.4g} kN at most, at {:.2f} s", first / unit::kN,
                         most / unit::kN, when);
      if (std::isfinite(cable.strength)) text += fmt::format(": {:.0f} % of its strength", 100 * most / cable.strength);
      text += ".";
    }
    const auto& events = c.r.events;
    const auto rupture = std::find_if(events.begin(), events.end(),
                                      [&](const auto& e) { return e.kind == "cable" && e.subject == cable.name; });
    const bool is_broken = rupture != events.end();
    if (is_broken) text += fmt::format(" It breaks at {:.2f} s.", rupture->time);
    c.add("cable." + cable.name, "Cables", cable.name, text, most, "N", is_broken ? Status::Warning : Status::Info);
  }
}

bool is_limit(const record::Finding& f) { return f.id.rfind("criterion.", 0) == 0 || f.id.rfind("clearance.", 0) == 0; }

}  // namespace

bool may_change(const product::Plan& plan, const Mechanism& m) {
  if (m.is_final || m.name == "wrong direction") return false;
  return plan.criteria.mechanism != "stands" || m.name == "stands" || m.may_swing_back;
}

bool is_violated(const record::Finding& f) { return is_limit(f) && f.status == Status::Bad; }

bool is_not_judged(const record::Finding& f) { return is_limit(f) && f.status == Status::NotJudged; }

std::string describe_steps(const mbs::Summary& s) {
  std::string text = s.shortest_step < 0.995 * s.step
                         ? fmt::format("{:.3g} ms at first, {:.3g} ms at the shortest, {} steps in all.", s.step * 1e3,
                                       s.shortest_step * 1e3, s.steps)
                         : fmt::format("{:.3g} ms in {} steps.", s.step * 1e3, s.steps);
  if (s.highest_frequency > 0) text += fmt::format(" The fastest mode has {:.0f} rad/s.", s.highest_frequency);
  return s.step_needed > 0 ? text + " " + describe_step_needed(s) : text;
}

std::string describe_step_needed(const mbs::Summary& s) {
  return fmt::format("The fastest mode needs less than {:.3g} ms: what swings so fast may have been thrown about.",
                     s.step_needed * 1e3);
}

std::vector<std::string> not_modelled(const product::Plan& plan) {
  std::vector<std::string> list = {"fragments thrown by the charges",
                                   "air overpressure",
                                   "dust",
                                   "ground vibration as such (at most a screening with the site's own law)",
                                   "wind, and people's behaviour",
                                   ("cracking and crushing of slabs within a bay, of walls within a panel and of beams "
                                    "between their end zones; room that rubble takes"),
                                   "infill and finishes beyond their weight"};
  if (!plan.shafts.empty())
    list.emplace_back(
        "rings that flatten as they land: single pieces of a shaft may roll and tumble farther than real ones");
  list.emplace_back(kNoSafeDistance);
  return list;
}

std::string tell_not_modelled(const std::vector<std::string>& list) {
  std::string text;
  for (const std::string& s : list)
    if (s != kNoSafeDistance) text += (text.empty() ? "" : "; ") + s;
  return text + ".";
}

bool add_findings(const product::Plan& plan, const mbs::Model& model, const ModelMap& map, const Knowledge& k,
                  const Recorder& recorder, const mbs::Summary& summary, record::Record& r,
                  const std::atomic<bool>* cancel, const HeadsAcross* across) {
  r.not_modelled = not_modelled(plan);
  // what was cancelled says how far it came
  const bool is_under_way = r.ending == "under_way" || r.ending == "cancelled";
  Context c{plan, model, map, k, recorder, summary, r, is_under_way, cancel};
  c.across = across;
  if (!is_under_way && !r.time.empty())
    c.charges_left = std::count_if(map.schedule.begin(), map.schedule.end(),
                                   [&r](const Firing& f) { return !f.fails && f.time > r.time.back() + 1e-9; });
  const auto add_not_modelled = [&] {
    c.add("not_modelled", "Not modelled", "Not modelled", tell_not_modelled(r.not_modelled), kNone, "");
    c.add("not_modelled.distances", "Not modelled", "Not modelled", kNoSafeDistance, kNone, "");
  };
  if (r.time.empty() || r.ending == "failed") {
    c.add("mechanism", "Mechanism", "No result", r.ending_text, kNone, "", Status::Bad);
    if (summary.ending == mbs::Summary::Ending::NoEquilibrium) add_overloads(c);
    if (r.time.empty()) return true;
    add_events(c);
    add_not_modelled();
    add_verification(c);
    return true;
  }
  const std::vector<Mechanism> verdicts =
      judge_structures(plan, model, map, k, recorder, summary, is_under_way, r.ending == "cancelled");
  const Mechanism m = judge_run(verdicts, map, k, recorder);
  if (r.ending == "time_limit") c.open = find_open_parts(r, map, verdicts, norm(model.gravity), plan.ground.friction);
  add_mechanism(c, m);
  if (!is_under_way) add_near_verdicts(c, m);
  add_rigid_block(c);
  const Standing standing = add_stability(c);
  if (c.is_cancelled()) return false;
  add_cables(c);
  const Reach reach = add_debris(c, m);
  add_clearances(c);
  if (c.is_cancelled()) return false;
  add_touchdown(c);
  add_stubs(c);
  add_vibration(c, m);
  add_events(c);
  if (r.ending == "at_rest" || r.ending == "time_limit") add_criteria(c, m, standing, reach);
  add_not_modelled();
  add_verification(c);
  return true;
}

}  // namespace topple::collapse
