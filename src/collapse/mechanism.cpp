#include "collapse/mechanism.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/unit.h"

namespace topple::collapse {

constexpr double kLeastRun = 0.5;  // of a mass centre that has gone to a side [m]

double calc_tilt(const Quat& q, const Vec3& fall_direction) {
  const Vec3 axis = cross({0, 0, 1}, fall_direction);
  // twist of the rotation about the axis
  return 2 * std::atan2(q.x * axis.x + q.y * axis.y + q.z * axis.z, q.w);
}

namespace {

/// On the way from one motion to another of the same bodies, and on behind it for a share of more than 1.
BlockFrame::Motion calc_between(const BlockFrame::Motion& a, const BlockFrame::Motion& b, double share) {
  return {normalized(exp_rotation(share * log_rotation(b.rotation * conjugate(a.rotation))) * a.rotation),
          a.displacement + share * (b.displacement - a.displacement), a.above};
}

/// The block at a time, as it was at the frame before: what breaks on the ground until the next one has not broken yet.
/// Its motion is on the way to the next frame, or goes on from the last two where the next one has another block.
BlockFrame find_block(const std::vector<BlockFrame>& frames, double time) {
  const auto after = std::find_if(frames.begin(), frames.end(), [time](const BlockFrame& f) { return f.time >= time; });
  if (after == frames.end()) return frames.back();
  if (after == frames.begin() || after->time == time) return *after;
  const auto before = after - 1;
  BlockFrame at = *before;
  at.time = time;
  const auto share_from = [time](const BlockFrame& a, const BlockFrame& b) {
    return (time - a.time) / (b.time - a.time);
  };
  at.pieces = calc_between(before->pieces, after->pieces, share_from(*before, *after));
  constexpr double rounding = 1e-9;
  const auto are_alike = [](const BlockFrame& a, const BlockFrame& b) {
    return std::abs(a.connected - b.connected) < rounding;
  };
  const auto move = [&](const BlockFrame& a, const BlockFrame& b) {
    const BlockFrame::Motion block =
        calc_between({a.rotation, a.displacement, a.above}, {b.rotation, b.displacement, b.above}, share_from(a, b));
    at.rotation = block.rotation, at.displacement = block.displacement;
  };
  if (are_alike(*before, *after))
    move(*before, *after);
  else if (before != frames.begin() && are_alike(*(before - 1), *before))
    move(*(before - 1), *before);
  return at;
}

double calc_away(const Vec3& u, double height, const Knowledge& k) {
  const double down = -u.z / k.stands_displacement,
               aside = std::hypot(u.x, u.y) / std::max(k.stands_displacement, k.stands_drift * height);
  return std::isfinite(down + aside) ? std::max(down, aside) : std::numeric_limits<double>::quiet_NaN();
}

bool is_in_pieces(const BlockFrame& f, const Knowledge& k) { return f.connected < k.mechanism_coherent_share; }

/// Of the block or, in pieces, of all of them.
BlockFrame::Motion find_motion(const BlockFrame& f, const Knowledge& k) {
  return is_in_pieces(f, k) ? f.pieces : BlockFrame::Motion{f.rotation, f.displacement, f.above};
}

/// Where a block leans, which a twist about its own axis or the vertical one is no part of.
struct Lean {
  explicit Lean(const Quat& rotation) {
    const Mat3 R = to_matrix(rotation);
    top = {R(0, 2), R(1, 2) + 0.0, 0};  // towards 180 deg, not -180
    lowest = {-R(2, 0), -R(2, 1), 0};
    tilt = std::atan2(norm(top), R(2, 2));
  }
  Vec3 top;     // horizontal part of where its vertical axis points
  Vec3 lowest;  // horizontal direction in the upright block that comes down most, as long
  double tilt;  // [rad]
};

/// Distance from the origin to where a ray leaves a convex polygon around it, counter-clockwise; 0 without one.
double calc_reach(const Polygon& outline, const Vec3& direction) {
  double reach = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < outline.size(); ++i) {
    const Point2 &a = outline[i], &b = outline[(i + 1) % outline.size()];
    const double nx = b[1] - a[1], ny = a[0] - b[0];  // outwards
    const double along = nx * direction.x + ny * direction.y;
    if (along > 0) reach = std::min(reach, (nx * a[0] + ny * a[1]) / along);
  }
  return std::isfinite(reach) ? std::max(0.0, reach) : 0;
}

/// Last way from side to side of a block that sways, in pieces of what is in its place, by its mass centre in plan [m]:
/// of four turning points or more since the last charge the last two are no farther to either side than those before.
/// Else none.
std::optional<double> find_last_swing(const MechanismInput& in, const Knowledge& k) {
  constexpr double least = 0.2;  // way between turning points, of the way in all
  const auto begin =
      std::find_if(in.frames.begin(), in.frames.end(), [&in](const BlockFrame& f) { return f.time >= in.last_charge; });
  if (begin == in.frames.end()) return {};
  std::vector<Vec3> ways;
  for (auto f = begin; f != in.frames.end(); ++f) {
    const Vec3 u = find_displacement(*f, k);
    ways.push_back({u.x, u.y, 0});
  }
  Vec3 axis;
  for (const Vec3& way : ways)
    if (!(norm(way - ways.front()) <= norm(axis))) axis = way - ways.front();
  const double length = norm(axis);
  if (!std::isfinite(length)) return {};
  // what round-off makes of a building at rest is no swing
  constexpr double still = 1e-6, enough_time = 0.1;  // [m, s]
  if (length < still) return in.frames.back().time - begin->time >= enough_time ? std::optional(0.0) : std::nullopt;
  std::vector<double> along;
  for (const Vec3& way : ways) along.push_back(dot(way, axis) / length);
  const auto [low, high] = std::minmax_element(along.begin(), along.end());
  const double enough = least * (*high - *low);
  std::vector<double> turns;
  double side = 0, extreme = along.front();  // side: +1 while it goes up, -1 down, 0 not known
  for (const double u : along) {
    if (side == 0 && std::abs(u - along.front()) >= enough) side = u > along.front() ? 1 : -1;
    if (side == 0) continue;
    if (side * (u - extreme) > 0) {
      extreme = u;
    } else if (side * (extreme - u) >= enough) {
      turns.push_back(extreme);
      extreme = u, side = -side;
    }
  }
  const size_t n = turns.size();
  if (n < 4) return {};
  const auto [from, to] = std::minmax_element(turns.begin(), turns.end() - 2);
  const double swing = std::abs(turns[n - 1] - turns[n - 2]), room = 0.01 * (*to - *from);
  for (const double turn : {turns[n - 2], turns[n - 1]})
    if (turn < *from - room || turn > *to + room) return {};
  return swing;
}

}  // namespace

Vec3 find_displacement(const BlockFrame& f, const Knowledge& k) {
  return is_in_pieces(f, k) ? f.standing : f.displacement;
}

double calc_away(const BlockFrame& block, const Knowledge& k) {
  const double away = calc_away(find_displacement(block, k), block.height, k);
  // ways of pieces that go apart may add up to nothing
  return is_in_pieces(block, k) && block.in_place < k.mechanism_coherent_share ? std::max(away, 1.0) : away;
}

void find_deciding_touchdown(MechanismInput& in, const Knowledge& k) {
  const auto decides = [&](double time) {
    return !(-find_motion(find_block(in.frames, time), k).displacement.z < k.stands_displacement);
  };
  in.touchdown = std::numeric_limits<double>::quiet_NaN();
  for (const auto* times : {&in.touchdowns, &in.all_touchdowns}) {
    const auto found = std::find_if(times->begin(), times->end(), decides);
    if (found == times->end()) continue;
    in.touchdown = *found;
    break;
  }
  in.is_later_touchdown = !in.all_touchdowns.empty() && in.touchdown > in.all_touchdowns.front();
}

Mechanism judge_mechanism(const MechanismInput& in, const Knowledge& k) {
  constexpr double pi = 3.14159265358979323846;
  Mechanism out;
  const BlockFrame& last = in.frames.back();
  const bool touched = std::isfinite(in.touchdown);
  const BlockFrame at = touched ? find_block(in.frames, in.touchdown) : last;
  out.time = touched ? in.touchdown : last.time;
  out.has_touchdown = touched;
  out.moved = last.down;
  out.run = last.centre - in.frames.front().centre;
  out.run.z = 0;

  // the way it leans when it touches down: the planned one, unless it turned more about another axis
  const bool lands_in_pieces = is_in_pieces(at, k);
  const BlockFrame::Motion whole = find_motion(at, k);
  const Lean lean(whole.rotation);
  Vec3 direction = in.fall_direction, lowest = direction;
  const bool leans = norm(lean.top) > 1e-3;
  if (leans) direction = (1 / norm(lean.top)) * lean.top, lowest = (1 / norm(lean.lowest)) * lean.lowest;
  out.tilt = lean.tilt;
  const Mat3 R = to_matrix(whole.rotation);
  const auto drop_of = [&](const Vec3& arm) { return -(whole.displacement + R * arm - arm).z; };
  const auto share_at = [&](double below) {
    const Vec3 down{0, 0, -below};
    const double front = drop_of(calc_reach(in.outline, lowest) * lowest + down);
    const double rear = drop_of(-calc_reach(in.outline, -lowest) * lowest + down);
    return front > 1e-3 ? std::max(0.0, rear) / front : 1;
  };
  out.drop = -whole.displacement.z;
  out.connected = at.connected;
  out.rear_share = share_at(0);
  out.foot_share = share_at(std::max(0.0, whole.above - in.foot));
  // a slender block that turns about its foot lowers both edges alike at its mass centre
  const bool drops = out.rear_share >= k.mechanism_topple_rear_share && out.tilt < k.mechanism_topple_rotation;
  const bool turns_about_foot = drops && out.foot_share < k.mechanism_topple_rear_share;
  double off = std::atan2(direction.y, direction.x) - std::atan2(in.fall_direction.y, in.fall_direction.x);
  off = std::remainder(off, 2 * pi);

  const std::string when =
      touched           ? in.is_later_touchdown
                              ? fmt::format("when the upper block has come down and touches the ground, at {:.2f} s", out.time)
                              : fmt::format("when the upper block first touches the ground, at {:.2f} s", out.time)
                : in.is_under_way ? fmt::format("so far, at {:.2f} s", out.time)
                        : fmt::format("at the end, {:.2f} s", out.time);
  const std::string motion = fmt::format(
      "{}, it leans by {:.1f} deg, its mass centre has come down by {:.2f} m, and its rear edge {:.0f} % as far as its "
      "front edge. {} {:.0f} % of the mass has come down",
      when, out.tilt / unit::deg, out.drop, 100 * out.rear_share, in.is_under_way ? "So far" : "In the end",
      100 * out.moved);
  const double height_left = in.frames.front().height > 0 ? last.height / in.frames.front().height : 1;
  // of the largest connected part of the upper block, not of pieces that came off, if that is most of it
  const BlockFrame::Motion end = find_motion(last, k);
  const bool ends_in_pieces = is_in_pieces(last, k);
  const double final_tilt = Lean(end.rotation).tilt;
  const Vec3 moved_by = find_displacement(last, k);
  const double sunk = -moved_by.z, aside = std::hypot(moved_by.x, moved_by.y);
  const bool has_left = !(calc_away(last, k) < 1);
  bool sways_less = false;
  const bool has_sunk = has_left && !(sunk < k.stands_displacement);
  if (out.moved < k.mechanism_stands_share && !has_left) {
    out.name = "stands";
    out.text = fmt::format("The building stands: {:.1f} % of its mass came down.", 100 * out.moved);
    if (1 - last.in_place >= k.mechanism_stands_share)
      out.text += fmt::format(" {:.0f} % of its upper mass has left its place.", 100 * (1 - last.in_place));
    if (const auto swing = in.came_to_rest ? std::nullopt : find_last_swing(in, k)) {
      sways_less = true;
      if (*swing > 0)
        out.text += fmt::format(
            " It sways on, less than it did: its upper block went {:.1f} cm from side to side in the last swing.",
            100 * *swing);
    }
  } else if (out.moved < k.mechanism_stands_share && !in.came_to_rest) {
    out.name = "partial";
    out.may_swing_back = !has_sunk;
    out.text =
        has_sunk ? fmt::format("It has begun to sink: the upper block has come down by {:.2f} m.", sunk)
                 : fmt::format("It leans: the mass centre of the upper block has moved to a side by {:.2f} m.", aside);
  } else if (in.came_to_rest && has_left && (!ends_in_pieces || out.moved < k.mechanism_partial_share) &&
             final_tilt < k.mechanism_aborted_rotation && height_left > 0.5) {
    out.name = "aborted";
    out.text = has_sunk
                   ? fmt::format(
                         "Aborted collapse: the upper block has sunk by {:.2f} m and stands, leaning by {:.1f} deg, "
                         "its mass centre at {:.0f} % of its height.",
                         sunk, final_tilt / unit::deg, 100 * height_left)
                   : fmt::format(
                         "Aborted collapse: the upper block has moved to a side by {:.2f} m and stands, leaning by "
                         "{:.1f} deg, its mass centre at {:.0f} % of its height.",
                         aside, final_tilt / unit::deg, 100 * height_left);
    if (ends_in_pieces)
      out.text += fmt::format(" It is in pieces, the largest of {:.0f} % of the upper mass: these numbers are of all.",
                              100 * last.connected);
  } else if (out.moved < k.mechanism_partial_share) {
    out.name = "partial";
    out.text = fmt::format("Partial collapse: {}.", motion);
  } else if (in.came_to_rest && final_tilt < k.mechanism_aborted_rotation && height_left > 0.5) {
    out.name = "aborted";
    out.text = fmt::format("Aborted collapse: at rest, leaning by {:.1f} deg with {:.0f} % of its height left; {}.",
                           final_tilt / unit::deg, 100 * height_left, motion);
  } else if (at.forward >= k.mechanism_fold_share && at.backward >= k.mechanism_fold_share) {
    out.name = "fold";
    out.text = fmt::format("It folds: {:.0f} % of the upper mass turns forward, {:.0f} % backward; {}.",
                           100 * at.forward, 100 * at.backward, motion);
  } else if (at.left >= k.mechanism_fold_share && at.right >= k.mechanism_fold_share) {
    out.name = "fold";
    out.text =
        fmt::format("It folds: {:.0f} % of the upper mass turns to one side of the fall, {:.0f} % to the other; {}.",
                    100 * at.left, 100 * at.right, motion);
  } else if ((1 - at.apart) * at.connected < k.mechanism_coherent_share && at.moved < k.mechanism_together_share) {
    out.name = "progressive";
    out.text = fmt::format("Progressive collapse: the largest connected part holds {:.0f} % of the upper mass; {}.",
                           100 * (1 - at.apart) * at.connected, motion);
  } else if (drops && !turns_about_foot) {
    out.name = "vertical";
    out.text = fmt::format("It comes down vertically (telescoping): {}.", motion);
  } else if (std::abs(off) > in.direction_tolerance.value_or(k.mechanism_direction_tolerance) &&
             in.is_direction_planned) {
    out.name = "wrong direction";
    out.text = fmt::format("It topples in the wrong direction, {:.0f} deg off the plan: {}.", off / unit::deg, motion);
  } else {
    out.name = "topple";
    out.text = fmt::format("It topples: {}.", motion);
  }
  const bool stays = out.name == "stands" || out.name == "partial" || out.name == "aborted";
  if (lands_in_pieces && !stays && out.name != "progressive")
    out.text +=
        fmt::format(" It is in pieces then, the largest of {:.0f} % of the upper mass: these numbers are of all.",
                    100 * at.connected);
  if (at.apart > 0.005 && !stays)
    out.text += fmt::format(" Before, {:.0f} % of the upper mass had fallen off: these numbers are of the rest.",
                            100 * at.apart);
  if (turns_about_foot && (out.name == "topple" || out.name == "wrong direction"))
    out.text += fmt::format(
        " At its foot the rear edge has come down {:.0f} % as far as the front edge: it turns about its foot.",
        100 * out.foot_share);
  out.is_final =
      in.came_to_rest || sways_less || (touched && out.moved >= k.mechanism_partial_share && height_left <= 0.5);
  out.is_azimuth_of_lean = leans && (out.name == "topple" || out.name == "wrong direction");
  const Vec3& way = out.is_azimuth_of_lean ? direction : out.run;
  const bool has_way = out.is_azimuth_of_lean || norm(out.run) >= kLeastRun;
  out.azimuth = has_way ? std::atan2(way.y, way.x) : std::numeric_limits<double>::quiet_NaN();
  if (in.is_cancelled)
    out.text += fmt::format(" The run was cancelled: this is how it stood at {:.2f} s.", last.time);
  else if (in.is_under_way)
    out.text += fmt::format(" The run is under way: this is how it stands at {:.2f} s.", last.time);
  else if (out.name != "stands" && !in.came_to_rest)
    out.text += " Parts were still moving when the run ended.";
  return out;
}

std::vector<NearVerdict> find_near_verdicts(const MechanismInput& in, const Knowledge& k) {
  constexpr double window = 0.1;  // [s]
  const Mechanism found = judge_mechanism(in, k);
  std::vector<NearVerdict> out;
  if (in.is_under_way || (!found.is_final && !std::isfinite(in.touchdown))) return out;
  const auto add = [&](NearVerdict near) {
    if (near.as.name == found.name) return;
    if (std::none_of(out.begin(), out.end(), [&](const NearVerdict& n) { return n.as.name == near.as.name; }))
      out.push_back(std::move(near));
  };
  if (std::isfinite(in.touchdown)) {
    std::vector<double> ways;
    for (const BlockFrame& f : in.frames)
      if (std::abs(f.time - in.touchdown) <= window + 1e-9) ways.push_back(f.time - in.touchdown);
    std::stable_sort(ways.begin(), ways.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
    MechanismInput then = in;
    for (const double way : ways) {
      then.touchdown = in.touchdown + way;
      add({judge_mechanism(then, k), way, "", 1});
    }
  }
  static constexpr std::pair<const char*, double Knowledge::*> bounds[] = {
      {"mechanism.topple_rear_share", &Knowledge::mechanism_topple_rear_share},
      {"mechanism.topple_rotation", &Knowledge::mechanism_topple_rotation},
      {"mechanism.coherent_share", &Knowledge::mechanism_coherent_share},
      {"mechanism.together_share", &Knowledge::mechanism_together_share},
      {"mechanism.fold_share", &Knowledge::mechanism_fold_share},
      {"mechanism.direction_tolerance", &Knowledge::mechanism_direction_tolerance},
      {"mechanism.partial_share", &Knowledge::mechanism_partial_share},
      {"mechanism.stands_share", &Knowledge::mechanism_stands_share},
      {"mechanism.aborted_rotation", &Knowledge::mechanism_aborted_rotation},
      {"stands.displacement", &Knowledge::stands_displacement},
      {"stands.drift", &Knowledge::stands_drift},
  };
  for (const auto& [rule, bound] : bounds) {
    for (const double times : {0.9, 1.1}) {
      Knowledge other = k;
      other.*bound *= times;
      MechanismInput then = in;
      if (bound == &Knowledge::mechanism_direction_tolerance && then.direction_tolerance)
        *then.direction_tolerance *= times;
      if (!in.all_touchdowns.empty()) find_deciding_touchdown(then, other);
      add({judge_mechanism(then, other), 0, rule, times});
    }
  }
  return out;
}

Mechanism join_mechanisms(const std::vector<std::string>& names, const std::vector<Mechanism>& verdicts,
                          const std::vector<double>& masses) {
  if (verdicts.size() == 1) return verdicts.front();
  // the one that falls where it must not, else the heaviest
  const auto wrong =
      std::find_if(verdicts.begin(), verdicts.end(), [](const Mechanism& m) { return m.name == "wrong direction"; });
  const size_t lead = wrong == verdicts.end() ? 0 : static_cast<size_t>(wrong - verdicts.begin());
  Mechanism out = verdicts[lead];
  double moved = 0, mass = 0, heaviest = 0;
  Vec3 run;
  bool do_agree = true;
  out.is_final = std::all_of(verdicts.begin(), verdicts.end(), [](const Mechanism& m) { return m.is_final; });
  std::string all;
  for (size_t i = 0; i < verdicts.size(); ++i) {
    moved += masses[i] * verdicts[i].moved, mass += masses[i];
    run += masses[i] * verdicts[i].run;
    out.falls.push_back({names[i], verdicts[i].time, verdicts[i].azimuth, verdicts[i].is_azimuth_of_lean});
    // of the heaviest one that fell to a side
    if (wrong == verdicts.end() && !std::isnan(verdicts[i].azimuth) && masses[i] > heaviest)
      heaviest = masses[i], out.azimuth = verdicts[i].azimuth;
    do_agree &= verdicts[i].name == out.name;
    all += fmt::format(" Verdict on {}: {}.", names[i], verdicts[i].name);
  }
  out.moved = mass > 0 ? moved / mass : 0;
  if (mass > 0) out.run = (1 / mass) * run;
  out.may_swing_back =
      std::any_of(verdicts.begin(), verdicts.end(), [](const Mechanism& m) { return m.may_swing_back; }) &&
      std::all_of(verdicts.begin(), verdicts.end(),
                  [](const Mechanism& m) { return m.may_swing_back || m.name == "stands"; });
  if (!do_agree && wrong == verdicts.end()) out.name = "partial";
  out.text = fmt::format("Separate structures are judged one by one.{} In detail, of {}: {}", all, names[lead],
                         verdicts[lead].text);
  return out;
}

}  // namespace topple::collapse
