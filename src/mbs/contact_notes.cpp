/// What the summary tells about bodies that contact did not keep apart.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mbs/boxes.h"
#include "mbs/system.h"

namespace topple::mbs {

namespace {

constexpr size_t kMostNoted = 6;     // pairs of bodies
constexpr double kMostSunken = 0.5;  // share of the thinner shape that they may overlap by
constexpr double kBegun = 0.01;      // share of it from which on an overlap at the start is told
constexpr double kMostSwing = 0.5;   // of contact in a set step: impacts then miss percents of their energy [rad]

std::string name_of(const Model& model, size_t b) {
  const std::string& name = model.bodies[b].name;
  return name.empty() ? "number " + std::to_string(b) : "\"" + name + "\"";
}

}  // namespace

double System::thickness_of(const CompiledShape& shape) const {
  switch (shape.kind) {
    case Shape::Kind::Box:
      return 2 * std::min({shape.half.x, shape.half.y, shape.half.z});
    case Shape::Kind::Sphere:
      return 2 * shape.radius;
    case Shape::Kind::Hull:
      return hulls[static_cast<size_t>(shape.hull)].thickness;
    case Shape::Kind::Plane:
      break;
  }
  return kUnlimited;
}

void System::note_lost_contact(const PairDue& due, double depth, double interval) {
  const size_t a = static_cast<size_t>(due.a), b = static_cast<size_t>(due.b);
  const CompiledShape &shape_a = state.shapes[static_cast<size_t>(due.shape_a)],
                      &shape_b = state.shapes[static_cast<size_t>(due.shape_b)];
  const double thickness = std::min(thickness_of(shape_a), thickness_of(shape_b));
  const double way = norm(Vec3(state.v[a]) - Vec3(state.v[b])) * interval;
  const bool is_sunken = depth > kMostSunken * thickness;
  if (!is_sunken && way <= std::max(thickness, -depth)) return;
  const std::pair<int, int> pair{std::min(due.a, due.b), std::max(due.a, due.b)};
  if (noted_pairs.size() >= kMostNoted || std::find(noted_pairs.begin(), noted_pairs.end(), pair) != noted_pairs.end())
    return;
  noted_pairs.push_back(pair);
  const std::string bodies = fmt::format("bodies {} and {}: ", name_of(model, static_cast<size_t>(pair.first)),
                                         name_of(model, static_cast<size_t>(pair.second)));
  // told before a snapshot
  std::vector<std::string>& notes = summary.notes;
  if (std::any_of(notes.begin(), notes.end(), [&](const std::string& note) { return note.starts_with(bodies); }))
    return;
  notes.push_back(bodies +
                  (is_sunken ? fmt::format("one has sunk {:.3g} m into the other at {:.4g} s, half of the "
                                           "{:.3g} m of the thinner one, and contact may let it through; stiffer "
                                           "contact (a pair's \"stiffness\", \"contact_frequency\") keeps them apart",
                                           depth, state.time, thickness)
                             : fmt::format("they move {:.3g} m against each other from one look for contact to the "
                                           "next at {:.4g} s, and the thinner one has {:.3g} m: they may pass through "
                                           "each other; a shorter step tells",
                                           way, state.time, thickness)));
}

void System::note_sunk(size_t b, const CompiledShape& shape, double depth) {
  const double thickness = thickness_of(shape);
  if (!(depth > kMostSunken * thickness)) return;
  const std::pair<int, int> pair{kGround.index, static_cast<int>(b)};
  if (noted_pairs.size() >= kMostNoted || std::find(noted_pairs.begin(), noted_pairs.end(), pair) != noted_pairs.end())
    return;
  noted_pairs.push_back(pair);
  const std::string start = fmt::format("body {}: it has sunk ", name_of(model, b));
  std::vector<std::string>& notes = summary.notes;
  if (std::any_of(notes.begin(), notes.end(), [&](const std::string& note) { return note.starts_with(start); })) return;
  notes.push_back(start +
                  fmt::format("{:.3g} m into the ground at {:.4g} s, more than half of its {:.3g} m, which contact is "
                              "not made for; stiffer contact (a pair's \"stiffness\", \"contact_frequency\") holds it",
                              depth, state.time, thickness));
}

void System::note_sunk_boxes() {
  const LaneLayout layout = lanes->body_layout(lane);
  for (size_t b = 0; b < B; ++b) {
    if (!is_ground_box(b)) continue;
    const double pressed = lanes->ground_states[layout.at(b, kernel::kPressed, kernel::kGroundFields)];
    if (!(pressed > 0)) continue;
    const auto constant = [&](int f) {
      return lanes->ground_constants[layout.at(b, static_cast<size_t>(f), kernel::kGroundConstants)];
    };
    // no corner is deeper than if it had all of the energy
    const double k = constant(kernel::kGroundMean) * constant(kernel::kCornerStiffness);
    const CompiledShape& shape = state.shapes[static_cast<size_t>(state.body[b].first_shape)];
    if (!(std::sqrt(2 * pressed / k) > kMostSunken * thickness_of(shape))) continue;
    const Mat3 R = state.R[b];
    const Vec3 centre = state.p[b] + R * shape.p_BS;
    const GroundBox box = state.ground_box[b];
    double deepest = 0;
    for (int i = 0; i < 8; ++i) {
      const Vec3 corner = corner_of(shape.half, i);
      const double height = dot(model.contact.normal, centre + R * (shape.R_BS * corner)) - model.contact.offset;
      deepest = std::max(deepest, -height - std::max(0.0, box.born[i]));
    }
    note_sunk(b, shape, deepest);
  }
}

void System::note_overlaps_at_start() {
  const State& s = state;
  size_t pairs = 0, sunken = 0;
  double deepest = 0, lowest = 0;
  std::string deepest_pair, lowest_body;
  for (size_t i = 0; i < s.pairs.size(); ++i) {
    const PairDue& due = s.pair_due[i];
    const double depth = s.pairs[i].allowed;
    if (!(depth > kBegun * std::min(thickness_of(s.shapes[static_cast<size_t>(due.shape_a)]),
                                    thickness_of(s.shapes[static_cast<size_t>(due.shape_b)]))))
      continue;
    ++pairs;
    if (depth <= deepest) continue;
    deepest = depth;
    deepest_pair = fmt::format("{} and {}", name_of(model, static_cast<size_t>(due.a)),
                               name_of(model, static_cast<size_t>(due.b)));
  }
  if (pairs > 0)
    summary.notes.push_back(fmt::format(
        "{} at the start, {}those of bodies {} by {:.3g} m: contact lets them keep that until they have parted",
        pairs == 1 ? "two shapes overlap" : fmt::format("{} pairs of shapes overlap", pairs),
        pairs == 1 ? "" : "deepest ", deepest_pair, deepest));
  if (!model.contact.ground) return;
  for (size_t b = 0; b < B; ++b) {
    const BodyConstants& body = s.body[b];
    if (fixed[b] || s.tied_to_ground[b] || !contact_laws[static_cast<size_t>(ground_law[b])].touches) continue;
    for (int i = body.first_shape; i < body.first_shape + body.shapes; ++i) {
      const CompiledShape& shape = s.shapes[static_cast<size_t>(i)];
      const Mat3 R = s.R[b];
      const Vec3 down = transpose_times(shape.is_straight ? R : R * shape.R_BS, -1 * model.contact.normal);
      double reach = 0;
      if (shape.kind == Shape::Kind::Box) {
        for (int k = 0; k < 3; ++k) reach += std::abs(down[k]) * shape.half[k];
      } else if (shape.kind == Shape::Kind::Sphere) {
        reach = shape.radius;
      } else if (const Hull* hull = hull_of(i)) {
        reach = -kUnlimited;  // it may lie beside the origin of its frame
        for (const Vec3& v : hull->vertices) reach = std::max(reach, dot(down, v));
      }
      const double depth = model.contact.offset - dot(model.contact.normal, Vec3{s.p[b]} + R * shape.p_BS) + reach;
      if (!(depth > kBegun * thickness_of(shape))) continue;
      ++sunken;
      if (depth > lowest) lowest = depth, lowest_body = name_of(model, b);
    }
  }
  if (sunken > 0)
    summary.notes.push_back(fmt::format(
        "{} below the ground at the start, {}{} by {:.3g} m: contact lets {} keep that until {} parted from it",
        sunken == 1 ? "a shape reaches" : fmt::format("{} shapes reach", sunken),
        sunken == 1 ? "that of body " : "deepest that of body ", lowest_body, lowest, sunken == 1 ? "it" : "them",
        sunken == 1 ? "it has" : "they have"));
}

void System::note_swing_of_contact() {
  const double frequency = calc_contact_frequency(), swing = step * frequency;
  if (!(options.step > 0) || !(swing > kMostSwing)) return;
  const Energy e = calc_energy();
  if (e.contact == 0 && e.contact_loss == 0 && e.friction == 0) return;
  summary.notes.push_back(fmt::format(
      "contact swings at up to {:.4g} rad/s, by {:.2g} rad in the set step of {:.3g} s: impacts may not keep "
      "their energy. A step below {:.2g} s is short enough; where none is set one is chosen",
      frequency, swing, step, kContactAngle / frequency));
}

}  // namespace topple::mbs
