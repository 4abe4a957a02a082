#include "mbs/crushed_boxes.h"

#include <algorithm>
#include <cmath>

#include "mbs/kernel.h"
#include "mbs/system.h"

namespace topple::mbs {

namespace {
constexpr long kStepsBetween = 4;      // looks at how far elements are crushed
constexpr double kLeast = 1e-9;        // depth of a point that still touches [m]
constexpr double kMoreThanMet = 1.01;  // of the way since the last look: what was met before it is at least as deep
}  // namespace

void find_crushed_boxes(int element, const Pose& marker, bool is_b, std::span<const double> stations,
                        std::span<const Shape> shapes, std::vector<CrushedBox>& boxes) {
  if (stations.empty() || (!is_b && stations.size() == 1)) return;
  constexpr double kAlong = 1 - 1e-6;  // cosine of the angle up to which a box lies along the element
  const auto [first, last] = std::minmax_element(stations.begin(), stations.end());
  const double near = *first, far = stations.size() == 1 ? kUnlimited : *last;
  const Vec3 x = to_matrix(normalized(marker.q)).column(0);
  for (size_t i = 0; i < shapes.size(); ++i) {
    const Shape& s = shapes[i];
    if (s.kind != Shape::Kind::Box) continue;
    const Mat3 R = to_matrix(normalized(s.X_BS.q));
    int axis = 0;
    while (axis < 3 && std::abs(dot(x, R.column(axis))) < kAlong) ++axis;
    if (axis == 3) continue;
    const double centre = dot(x, s.X_BS.p - marker.p), half = s.half[axis], low = centre - half, high = centre + half;
    if (!(high > near && low < far) || 2 * half <= kRubble) continue;
    const bool is_along = dot(x, R.column(axis)) > 0;
    // b's recede at the foot, a's at the top
    const double begin = is_b ? std::max(0.0, low - near) : std::max(0.0, far - high);
    const Vec3 off = transpose_times(R, s.X_BS.p - marker.p);
    bool is_member = true;
    for (int k = 0; k < 3; ++k) is_member = is_member && (k == axis || std::abs(off[k]) <= s.half[k]);
    boxes.push_back(
        {element, -1, static_cast<int>(i), is_member, axis, is_along == is_b ? -1 : 1, begin, 2 * half - kRubble, 0});
  }
}

bool shorten_box(double shortening, CrushedBox& box, Vec3& p_BS, const Mat3& R_BS, Vec3& half) {
  const double wanted = std::min(shortening - box.begin, box.most);
  if (!(wanted > box.taken)) return false;
  const double by = wanted - box.taken;
  box.taken = wanted;
  half[box.axis] -= 0.5 * by;
  p_BS -= (0.5 * by * box.end) * R_BS.column(box.axis);
  return true;
}

void System::find_crushed_boxes_of(size_t b, const Body& body) {
  State& s = state;
  const BodyConstants& c = s.body[b];
  std::vector<double> stations;
  for (const int entry : incidence[b]) {
    const size_t e = static_cast<size_t>(entry / 2);
    const CompiledElement& element = elements[e];
    if (!(element.zone.crush_through > 0)) continue;
    // what a charge leaves of a member is none
    if (!is_crushed_by_shortening(element.zone, laws, s.element[e])) continue;
    const bool is_b = entry % 2 != 0;
    const Pose marker{(is_b ? element.p_BM : element.p_AF) - s.p_offset[b], is_b ? element.q_BM : element.q_AF};
    stations.assign(element.zone.x, element.zone.x + element.zone.stations);
    const size_t first = s.crushed_boxes.size();
    find_crushed_boxes(entry / 2, marker, is_b, stations, body.shapes, s.crushed_boxes);
    for (CrushedBox& box : std::span(s.crushed_boxes).subspan(first)) {
      box.body = static_cast<int>(b);
      box.shape += c.first_shape;
    }
  }
}

void System::forget_crushed_boxes_of(size_t b) {
  std::erase_if(state.crushed_boxes, [&](const CrushedBox& box) { return box.body == static_cast<int>(b); });
}

void System::number_crushed_boxes() {
  State& s = state;
  for (CompiledShape& shape : s.shapes) shape.crushed = -1;
  for (size_t i = 0; i < s.crushed_boxes.size(); ++i)
    if (s.crushed_boxes[i].is_member)
      s.shapes[static_cast<size_t>(s.crushed_boxes[i].shape)].crushed = static_cast<int>(i);
}

void System::shorten_shape(CrushedBox& box, double shortening) {
  CompiledShape& shape = state.shapes[static_cast<size_t>(box.shape)];
  if (shorten_box(shortening, box, shape.p_BS, shape.R_BS, shape.half)) shape.reach = norm(shape.half);
}

const Hull* System::hull_of(int shape) {
  const CompiledShape& s = state.shapes[static_cast<size_t>(shape)];
  if (s.hull < 0) return nullptr;
  const size_t whole = static_cast<size_t>(s.hull);
  if (s.kind != Shape::Kind::Box || hull_shapes[whole].half == s.half) return &hulls[whole];
  ShortHull& own = short_hulls[shape];
  if (own.hull.vertices.empty() || !(own.half == s.half)) own = {s.half, make_box_hull(s.half)};
  return &own.hull;
}

double System::calc_crushed_through(size_t e) const {
  const ZoneState& z = state.element[e];
  const int ruling = find_ruling_law(elements[e].zone, z);
  if (z.live || ruling < 0 || z.reason != BreakReason::Crushing) return 0;
  const CompiledLaw& law = laws[static_cast<size_t>(ruling)];
  return law.keeps_length ? law.end_begins : 0;
}

void System::shorten_boxes() {
  State& s = state;
  // those of elements that have just broken at once: what comes next meets the end behind the weak length
  const bool is_look = s.step_index % kStepsBetween == 0;
  if (!is_look && !s.links_due) return;
  int last = -1;
  double shortening = 0;
  for (CrushedBox& box : s.crushed_boxes) {
    if (box.element != last) {
      last = box.element;
      const size_t e = static_cast<size_t>(last);
      const ZoneState& z = s.element[e];
      shortening = 0;
      if (is_crushed_by_shortening(elements[e].zone, laws, z)) {
        const size_t slot = slot_of(e);
        const bool flows = lanes->field(slot, kernel::kFlows) > 0;
        shortening = !is_look ? 0 : flows ? lanes->flow(slot, kernel::kShortened) : z.shortened;
      } else {
        shortening = calc_crushed_through(e);
      }
    }
    if (shortening > box.begin + box.taken) shorten_shape(box, shortening);
  }
}

const CrushedBox* System::find_met_end(size_t b, int shape, const Vec3& outward) const {
  constexpr double kHeadOn = 0.7;  // cosine of the angle between the member and the normal up to which its end is met
  if (b == B) return nullptr;
  const CompiledShape& s = state.shapes[static_cast<size_t>(shape)];
  if (s.crushed < 0) return nullptr;
  const CrushedBox& box = state.crushed_boxes[static_cast<size_t>(s.crushed)];
  const bool is_met = box.end * dot(state.R[b] * s.R_BS.column(box.axis), outward) >= kHeadOn;
  return is_met && box.taken < box.most ? &box : nullptr;
}

double System::calc_end_bearing(const CrushedBox* box, double way) const {
  if (box == nullptr) return kUnlimited;
  const size_t e = static_cast<size_t>(box->element);
  const CompiledLaw& law = laws[static_cast<size_t>(find_ruling_law(elements[e].zone, state.element[e]))];
  const double from = box->begin + box->taken;
  // it meets what it meets at full speed, and its peak may be as narrow as the way between two looks
  return calc_mean(law.compression, from, from + (law.keeps_length ? way : 0));
}

double System::crush_ends(size_t a, int shape_a, size_t b, int shape_b, const Vec3& n, const ContactLaw& law,
                          size_t first, double h) {
  const CrushedBox *end_a = find_met_end(a, shape_a, n), *end_b = find_met_end(b, shape_b, -n);
  if (end_a == nullptr && end_b == nullptr) return 0;
  State& s = state;
  const std::span<ContactPoint> points = std::span(contact.point).subspan(first);
  const bool is_ground = b == B;
  const double mass = 1 / (s.body[a].inverse_mass + (is_ground ? 0 : s.body[b].inverse_mass));
  const Vec3 p_a = s.p[a], p_b = is_ground ? Vec3{} : s.p[b];
  const auto speed_of = [&](const ContactPoint& p) {
    Vec3 v = s.v[a] + cross(s.w[a], p.at);
    if (!is_ground) v -= s.v[b] + cross(s.w[b], p_a + p.at - p_b);
    return dot(n, v);
  };
  double way = 0;  // until the next look
  for (const ContactPoint& p : points) way = std::max(way, contact_interval * h * speed_of(p));
  const double bears_a = calc_end_bearing(end_a, way), bears_b = calc_end_bearing(end_b, way);
  const double bears = std::min(bears_a, bears_b);
  // force over depth, and its growth in a step
  const auto rate_of = [&](const ContactPoint& p, double speed) {
    const double spring = p.stiffness * p.depth;
    const double dashpot = law.damping >= 0 ? law.damping * speed
                                            : std::clamp(2 * law.zeta * std::sqrt(p.stiffness * mass) * speed,
                                                         -law.band * spring, law.most * spring);
    return std::max(0.0, law.mean * spring + dashpot) / p.depth;
  };
  double pressed = 0, growth = 0, deepest = 0, fastest = 0;
  for (const ContactPoint& p : points) {
    const double speed = speed_of(p), rate = rate_of(p, speed);
    pressed += rate * p.depth;
    growth += rate * speed * h;
    deepest = std::max(deepest, p.depth);
    fastest = std::max(fastest, std::abs(speed));
  }
  if (!(pressed > bears)) return 0;
  // What is deeper than its elastic part is crushed; but as much stays as no point of before can have been met since
  // the last look, see (4) of the theory, and springs are soft enough for the mean force until the next one.
  const double steps = contact_interval, seen = std::max(1, state.touching.steps);
  const double kept = std::max(deepest * bears / pressed, kMoreThanMet * seen * h * fastest);
  double by = 0;
  if (deepest > kept) {
    const bool is_a = bears_a <= bears_b;
    const CompiledShape& shape = s.shapes[static_cast<size_t>(is_a ? shape_a : shape_b)];
    CrushedBox& box = s.crushed_boxes[static_cast<size_t>(shape.crushed)];
    const double along = std::abs(dot(s.R[is_a ? a : b] * shape.R_BS.column(box.axis), n));
    by = std::min(deepest - kept, along * (box.most - box.taken));
    shorten_shape(box, box.begin + box.taken + by / along);
    for (ContactPoint& p : points) {
      const double left = std::max(kLeast, p.depth - by);
      pressed -= rate_of(p, speed_of(p)) * (p.depth - left);
      p.depth = left;
    }
  }
  const double mean = pressed + 0.5 * (steps - 1) * std::max(0.0, growth);
  if (mean > bears)
    for (ContactPoint& p : points) p.stiffness *= bears / mean;
  return by;
}

}  // namespace topple::mbs
