/// Touching points of bodies and the ground (docs/theory/contact.md).

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "mbs/boxes.h"
#include "mbs/contact_kernel.h"
#include "mbs/system.h"

namespace topple::mbs {

bool System::is_ground_box(size_t b) const {
  const BodyConstants& body = state.body[b];
  return model.contact.ground && !model.contact.bodies && !fixed[b] && jointed[b] < 2 && body.shapes == 1 &&
         state.shapes[static_cast<size_t>(body.first_shape)].kind == Shape::Kind::Box &&
         state.shapes[static_cast<size_t>(body.first_shape)].crushed < 0;
}

void System::count_other_bodies() {
  other_on_ground = 0;
  for (size_t b = 0; b < B; ++b) other_on_ground += !fixed[b] && state.body[b].shapes > 0 && !is_ground_box(b);
}

void System::pack_ground_box(size_t b) {
  Lanes& l = *lanes;
  const LaneLayout layout = l.body_layout(lane);
  const auto put = [&](int f, double x) {
    l.ground_constants[layout.at(b, static_cast<size_t>(f), kernel::kGroundConstants)] = x;
  };
  put(kernel::kPossible, 0);
  // a box that was there has its ledger closed
  l.watch[layout.at(b, 0, 1)] = kernel::kAlwaysLook;
  if (!is_ground_box(b)) return;
  const BodyConstants& body = state.body[b];
  const CompiledShape& shape = state.shapes[static_cast<size_t>(body.first_shape)];
  for (int i = 0; i < 3; ++i) {
    put(kernel::kBoxCentre + i, shape.p_BS[i]);
    const Vec3 edge = shape.half[i] * shape.R_BS.column(i);
    for (int k = 0; k < 3; ++k) put(kernel::kBoxEdges + 3 * i + k, edge[k]);
  }
  const ContactLaw& law = contact_laws[static_cast<size_t>(ground_law[b])];
  const double frequency = model.contact.contact_frequency;
  put(kernel::kCornerStiffness, law.stiffness > 0 ? law.stiffness : body.mass * frequency * frequency);
  put(kernel::kGroundMean, law.mean), put(kernel::kGroundBand, law.band), put(kernel::kGroundMost, law.most);
  put(kernel::kGroundZeta, law.zeta), put(kernel::kGroundDamping, law.damping);
  put(kernel::kGroundFriction, law.friction);
  put(kernel::kPossible, !state.tied_to_ground[b] && law.touches ? 1 : 0);
}

double System::calc_pressed_box(size_t b, double h) const {
  if (!is_ground_box(b)) return 0;
  const State& s = state;
  const BodyConstants& body = s.body[b];
  const CompiledShape& shape = s.shapes[static_cast<size_t>(body.first_shape)];
  const ContactLaw& law = contact_laws[static_cast<size_t>(ground_law[b])];
  const double frequency = model.contact.contact_frequency;
  const double stiffness = law.stiffness > 0 ? law.stiffness : body.mass * frequency * frequency;
  const GroundBox box = s.ground_box[b];
  const Vec3 n = model.contact.normal;
  const Mat3 R_WB = s.R[b];
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    if (!(box.slip[corner].x < kUnlimited)) continue;  // did not touch
    const Vec3 at = R_WB * (shape.p_BS + shape.R_BS * corner_of(shape.half, corner));
    const double penetration = model.contact.offset - dot(n, s.p[b] + at);
    const double approach = -dot(n, s.v[b] + cross(s.w[b], at));
    const double depth = std::max(0.0, penetration - 0.5 * h * approach - box.born[corner]);
    sum += depth * depth;
  }
  return 0.5 * law.mean * stiffness * sum;
}

void System::note_landing(std::uint32_t slot) {
  const size_t b = lanes->is_batch ? slot / lanes->W : slot;
  State& s = state;
  if (s.touched_ground[b]) return;
  s.touched_ground[b] = 1;
  // the speed of the first corner that touches
  const CompiledShape& shape = s.shapes[static_cast<size_t>(s.body[b].first_shape)];
  const GroundBox box = s.ground_box[b];
  size_t corner = 0;
  while (corner < 7 && !(box.slip[corner].x < kUnlimited)) ++corner;
  const Vec3 local = corner_of(shape.half, static_cast<int>(corner));
  const Mat3 R_WB = s.R[b];
  const double approach = -dot(model.contact.normal, s.v[b] + cross(s.w[b], R_WB * (shape.p_BS + shape.R_BS * local)));
  say_landing(b, approach);
}

void System::say_landing(size_t b, double approach) const {
  if (!options.on_happening) return;
  const State& s = state;
  const auto energy_of = [&s](size_t i) { return 0.5 * (s.body[i].mass * dot(s.v[i], s.v[i]) + dot(s.w[i], s.L[i])); };
  Landing landing{s.p[b], energy_of(b), -s.body[b].mass * dot(s.v[b], model.contact.normal), 0};
  for (size_t i = 0; i < B; ++i)
    if (!fixed[i]) landing.kinetic += energy_of(i);
  say({Happening::Kind::GroundContact, s.time, static_cast<int>(b), -1, {}, std::max(0.0, approach), landing});
}

void System::find_ground_points(double h) {
  State& s = state;
  const State& now = state;
  const Contact& c = model.contact;
  const Vec3 n = c.normal;
  const int passed = std::max(1, s.touching.steps);
  const LaneLayout layout = lanes->body_layout(lane);
  for (size_t b = 0; b < B; ++b) {
    if (is_ground_box(b)) continue;
    if (s.ground_clear[b] && (s.tied_to_ground[b] || lanes->low[layout.at(b, 0, 1)] > 0)) continue;
    const BodyConstants& body = s.body[b];
    s.ground_clear[b] = 1;
    if (fixed[b] || body.shapes == 0) continue;
    const ContactLaw& law = contact_laws[static_cast<size_t>(ground_law[b])];
    const bool possible = !s.tied_to_ground[b] && law.touches;
    // far above the ground nothing is remembered but that contact is possible
    const Vec3 p = now.p[b];
    const double above = dot(n, p) - c.offset - body.radius;
    if (above > 0.05 && possible) {
      for (int i = body.first_shape; i < body.first_shape + body.shapes; ++i) {
        CompiledShape& shape = s.shapes[static_cast<size_t>(i)];
        for (int corner = 0; corner < count_corners(shape); ++corner)
          s.ground_points[static_cast<size_t>(shape.first_corner + corner)] = {0, true};
        shape.is_clear = true;
        shape.is_touching = false;
        shape.sticks = {};
        shape.group = -1;
      }
      continue;
    }
    const double stiffness = law.stiffness > 0 ? law.stiffness : body.mass * c.contact_frequency * c.contact_frequency;
    const Mat3 R_WB = now.R[b];
    for (int i = body.first_shape; i < body.first_shape + body.shapes; ++i) {
      CompiledShape& shape = s.shapes[static_cast<size_t>(i)];
      const bool box = shape.kind == Shape::Kind::Box, hull = shape.kind == Shape::Kind::Hull;
      const Vec3 centre = R_WB * shape.p_BS;
      const Mat3 R = !(box || hull) ? Mat3{} : shape.is_straight ? R_WB : R_WB * shape.R_BS;
      // how far the plane lies above the shape's centre, and out of it in the shape's axes
      const double above_centre = c.offset - dot(n, p + centre);
      const Vec3 down = box || hull ? transpose_times(R, n) : Vec3{};
      if (possible && shape.is_clear) {
        // all its points are known not to touch: they do not as long as it stays above the ground
        const double reach =
            box ? std::abs(down.x) * shape.half.x + std::abs(down.y) * shape.half.y + std::abs(down.z) * shape.half.z
                : shape.reach;
        if (-above_centre > reach) continue;
      }
      shape.is_clear = possible;
      const size_t first = contact.point.size();
      const Hull* polyhedron = hull ? &hulls[static_cast<size_t>(shape.hull)] : nullptr;
      const int corners = count_corners(shape);
      for (int corner = 0; corner < corners; ++corner) {
        GroundPoint& g = s.ground_points[static_cast<size_t>(shape.first_corner + corner)];
        if (!possible) {
          g = {};
          continue;
        }
        const Vec3 local = box    ? corner_of(shape.half, corner)
                           : hull ? polyhedron->vertices[static_cast<size_t>(corner)]
                                  : Vec3{};
        const double penetration = above_centre - dot(down, local) + shape.radius;
        if (!g.active) {
          g.active = true;
          g.born = std::max(0.0, penetration);
        }
        g.born = std::max(0.0, std::min(g.born, penetration));
        const double depth = penetration - g.born;
        if (g.born > 0 || depth > 0) shape.is_clear = false, s.ground_clear[b] = 0;
        const bool is_new = !std::exchange(g.touches, depth > 0);
        if (depth <= 0) continue;
        const Vec3 at = box || hull ? centre + R * local : centre - shape.radius * n;
        add_contact_point(at, depth, hull ? polyhedron->weights[static_cast<size_t>(corner)] * stiffness : stiffness,
                          is_new ? kernel::kSlowed * passed : 0);
      }
      const int earned = std::exchange(shape.group, -1);
      if (contact.point.size() == first) {
        if (earned >= 0) contact.lost += std::max(0.0, contact.earnings[static_cast<size_t>(earned)].stored);
        shape.is_touching = false;
        shape.sticks = {};
        continue;
      }
      if (!shape.is_touching && !s.touched_ground[b]) {
        s.touched_ground[b] = 1;
        say_landing(b, -dot(n, now.v[b] + cross(now.w[b], contact.point[first].at)));
      }
      if (options.tells_lost_contact) {
        double deepest = 0;
        for (const ContactPoint& point : std::span(contact.point).subspan(first))
          deepest = std::max(deepest, point.depth);
        note_sunk(b, shape, deepest);
      }
      ContactGroup fitted;
      const bool is_held = fit_points(b, B, -n, first, law, fitted);
      (void)crush_ends(b, i, B, -1, -n, law, first, h);
      add_contact_group(b, B, -n, first, ground_law[b], is_held ? fitted.stiffness : stiffness, shape.sticks);
      if (is_held) keep_mobility(fitted);
      // its stiffness may be another one than before
      if (shape.crushed >= 0 || is_held || earned >= 0) {
        ContactGroup& g = s.touching.group.back();
        g.hands_on = true;
        if (earned >= 0) g.earnings = contact.earnings[static_cast<size_t>(earned)];
        shape.group = static_cast<int>(s.touching.group.size()) - 1;
      }
      shape.is_touching = true;
    }
  }
}

}  // namespace topple::mbs
