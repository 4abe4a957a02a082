/// Forces at touching points (docs/theory/contact.md): springs first, then dashpots, then friction. Each stage sees the
/// speeds that the ones before it leave, and within a stage no group sees another, so the order of groups does not
/// count.

#include "mbs/contact.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "mbs/boxes.h"
#include "mbs/contact_kernel.h"
#include "mbs/system.h"

namespace topple::mbs {

namespace {

constexpr int kMostContactInterval = 2;
constexpr size_t kFewBodies = 100;  // that move: points are looked for in each step
// of a contact's swing from one look for points to the next, at most [rad]
constexpr double kLookAngle = std::numbers::pi / 10;
constexpr int kMembersOfNode = 15;  // shapes of a body; more are pieces of one surface

/// Component of a vector in a block of lanes.
Vec3 read3(const double* slot, int field, size_t W) {
  const double* at = slot + static_cast<size_t>(field) * W;
  return {at[0], at[W], at[2 * W]};
}

}  // namespace

void System::compile_contact() {
  const Contact& c = model.contact;
  contact_laws = {make_contact_law(c.restitution, c.friction), make_contact_law(c.body_restitution, c.body_friction)};
  ground_law.assign(B, 0);
  for (const Contact::Pair& p : c.pairs) {
    const int law = static_cast<int>(contact_laws.size());
    contact_laws.push_back(make_contact_law(p));
    if (p.b == kGround) {
      ground_law[static_cast<size_t>(p.a.index)] = law;
    } else if (p.a == kGround) {
      ground_law[static_cast<size_t>(p.b.index)] = law;
    } else {
      pair_rules.push_back({std::min(p.a.index, p.b.index), std::max(p.a.index, p.b.index), law});
    }
  }
  std::sort(pair_rules.begin(), pair_rules.end());
  contact.place.assign(B + 1, -1);
}

double System::calc_contact_frequency() const {
  const Contact& c = model.contact;
  const double usual = c.contact_frequency * c.contact_frequency;
  double most = 0;
  if (c.ground) most = contact_laws[0].mean * usual;
  if (c.bodies) most = std::max(most, contact_laws[1].mean * usual);
  for (size_t i = 0; i < c.pairs.size(); ++i) {
    const Contact::Pair& p = c.pairs[i];
    if (!p.touches || !(p.b == kGround || p.a == kGround ? c.ground : c.bodies)) continue;
    double inverse_mass = 0;
    for (const BodyId id : {p.a, p.b})
      if (id != kGround) inverse_mass += state.body[static_cast<size_t>(id.index)].inverse_mass;
    most = std::max(most, contact_laws[2 + i].mean * (p.stiffness > 0 ? p.stiffness * inverse_mass : usual));
  }
  // of members that meet in a node one or two touch at once, of the staves of a ring all
  int pieces = 1;
  for (size_t b = 0; b < B; ++b)
    if (const int shapes = state.body[b].shapes; !fixed[b] && shapes > kMembersOfNode)
      pieces = std::max(pieces, shapes);
  double stretch = pieces;
  for (size_t b = 0; b < B; ++b)
    if (!fixed[b] && !jointed[b]) stretch = std::max(stretch, state.body[b].contact_stretch);
  return std::sqrt(most * stretch);
}

double System::calc_contact_stretch(const BodyConstants& body) const {
  // from so much easier than the centre of mass on a point counts, and all that lie where it does count from twice that
  // on: corners of the plates, columns and joints of buildings are below
  constexpr double far = 13,
                   flat = 12;  // a plate on its corners has the square root of 12 times one corner's frequency
  struct Point {
    Vec3 r;
    double weight;
  };
  std::vector<Point> points;
  for (int i = body.first_shape; i < body.first_shape + body.shapes; ++i) {
    const CompiledShape& shape = state.shapes[static_cast<size_t>(i)];
    const Hull* hull = shape.kind == Shape::Kind::Hull ? &hulls[static_cast<size_t>(shape.hull)] : nullptr;
    for (int corner = 0; corner < count_corners(shape); ++corner) {
      const size_t c = static_cast<size_t>(corner);
      const Vec3 at = hull != nullptr                  ? hull->vertices[c]
                      : shape.kind == Shape::Kind::Box ? corner_of(shape.half, corner)
                                                       : Vec3{};
      points.push_back({shape.p_BS + shape.R_BS * at, hull != nullptr ? hull->weights[c] : 1});
    }
  }
  /// How much more easily it moves along n.
  const auto calc_ease = [&body](const Vec3& r, const Vec3& n) {
    const Vec3 turn = cross(r, n);
    return 1 + dot(turn, body.inverse_inertia * turn) * body.mass;
  };
  const Mat3& W = body.inverse_inertia;
  const double trace = W(0, 0) + W(1, 1) + W(2, 2);
  double most = 0;
  Vec3 n;
  for (const Point& p : points) {
    // no direction has more than the trace of (r x)ᵀ W (r x): 9 over the mass for the corners of a box
    if (1 + body.mass * (trace * dot(p.r, p.r) - dot(p.r, W * p.r)) <= far) continue;
    // the direction in which it moves most easily, by powers of (r x)ᵀ W (r x)
    Vec3 way{0.6, 0.5, 0.62};
    for (int round = 0; round < 30; ++round) {
      const Vec3 next = cross(body.inverse_inertia * cross(p.r, way), p.r);
      if (!(norm(next) > 0)) break;
      way = (1 / norm(next)) * next;
    }
    if (const double ease = calc_ease(p.r, way); ease > most) most = ease, n = way;
  }
  if (!(most > far) || body.inverse_mass == 0) return 1;
  double all = 0;
  for (const Point& p : points)
    if (const double ease = calc_ease(p.r, n); ease > 0.5 * most) all += p.weight * ease;
  return 1 + std::min(1.0, (most - far) / far) * std::max(0.0, all / flat - 1);
}

int System::find_pair_law(int a, int b) const {
  if (pair_rules.empty()) return 1;
  const PairRule wanted{std::min(a, b), std::max(a, b), 0};
  const auto at = std::lower_bound(pair_rules.begin(), pair_rules.end(), wanted);
  return at != pair_rules.end() && at->a == wanted.a && at->b == wanted.b ? at->law : 1;
}

int System::calc_contact_interval() const {
  if (options.contact_interval > 0) return options.contact_interval;
  // between looks points turn with their body, and those of a sphere do not
  if (std::any_of(state.shapes.begin(), state.shapes.end(),
                  [](const CompiledShape& s) { return s.kind == Shape::Kind::Sphere; }))
    return 1;
  const double frequency = calc_contact_frequency();
  if (options.step > 0 || frequency <= 0) return 1;
  // of few bodies one impact that is met late is much of all energy, and a look costs little
  if (static_cast<size_t>(std::count(fixed.begin(), fixed.end(), 0)) < kFewBodies) return 1;
  return std::clamp(static_cast<int>(kLookAngle / (frequency * step)), 1, kMostContactInterval);
}

void System::evaluate_contact(double h) {
  add_travel(h);
  if (options.tells_lost_contact && model.contact.ground && !model.contact.bodies) note_sunk_boxes();
  if (!has_other_contacts()) return;
  Touching& t = state.touching;
  const bool follows = h > 0 && !is_look_due();
  if (!follows) {
    find_contacts(h);
    t.steps = 0;
  }
  resolve_contacts(h, follows);
  ++t.steps;
}

void System::find_contacts(double h) {
  Touching& t = state.touching;
  const size_t W = kernel::lanes();
  // friction springs as they are now
  contact.sticks.clear();
  contact.earnings.clear();
  contact.lost = 0;
  for (const ContactGroup& g : t.group) {
    contact.earnings.push_back(h > 0 ? calc_earnings(g, h) : Earnings{});
    for (int i = 0; i < g.count; ++i) {
      const size_t row = t.rows[g.slot / W] + static_cast<size_t>(i);
      const double* at = t.points.data() + row * kernel::kPointFields * W + g.slot % W;
      contact.sticks.push_back({read3(at, kernel::kPlace, W), read3(at, kernel::kSpringSlip, W)});
    }
  }
  begin_holding();
  contact.place.assign(B, -1);
  t.body.assign(1, static_cast<int>(B));
  contact.groups.assign(1, 0);
  contact.point.clear();
  t.group.clear();
  body_contacts = 0;
  if (model.contact.ground) find_ground_points(h);
  if (model.contact.bodies) find_pair_points(h);
  hold_contacts();
  fill_contact_blocks();
  fill_held_blocks();
  find_together();
}

Earnings System::calc_earnings(const ContactGroup& g, double h) const {
  if (!g.hands_on) return {};
  return calc_energies(g, h);
}

Earnings System::calc_energies(const ContactGroup& g, double h) const {
  const State& s = state;
  const size_t W = kernel::lanes();
  const auto speed_of = [&](int touched) {  // none of what is fixed
    const size_t body = static_cast<size_t>(s.touching.body[static_cast<size_t>(touched)]);
    if (body == B) return std::pair<Vec3, Vec3>{};
    // the spin of the step that has led here, as it began: the inertia has turned since
    const Vec3 w = s.w[body];
    return std::pair<Vec3, Vec3>{s.v[body], w + h * (calc_world_inverse_inertia(body) * cross(w, s.L[body]))};
  };
  const auto [v_a, w_a] = speed_of(g.a);
  const auto [v_b, w_b] = speed_of(g.b);
  const double* slot = s.touching.groups.data() + g.slot / W * kernel::kGroupFields * W + g.slot % W;
  const Vec3 f = -slot[kernel::kHeldForce * W] * g.n, turn = read3(slot, kernel::kHeldTorque, W);
  const Vec3 v = v_a - v_b - cross(w_b, read3(slot, kernel::kApart, W)), w = w_a - w_b;
  const double damped = dot(read3(slot, kernel::kDamp, W), v + read3(slot, kernel::kMotion, W)) +
                        dot(read3(slot, kernel::kDamp + 3, W), w + read3(slot, kernel::kMotion + 3, W));
  return {std::max(0.0, slot[kernel::kPressEnergy * W] - 0.5 * h * (dot(f, v) + dot(turn, w))),
          slot[kernel::kSpent * W] - 0.5 * h * damped};
}

double System::take_pressed(size_t b, double h) {
  Touching& t = state.touching;
  const size_t W = kernel::lanes();
  double pressed = 0;
  for (const ContactGroup& g : t.group) {
    const auto is_of = [&](int touched) { return t.body[static_cast<size_t>(touched)] == static_cast<int>(b); };
    if (!is_of(g.a) && !is_of(g.b)) continue;
    pressed += calc_energies(g, h).stored;
    // only once, whatever else is replaced in this step
    double* slot = t.groups.data() + g.slot / W * kernel::kGroupFields * W + g.slot % W;
    slot[kernel::kPressEnergy * W] = slot[kernel::kHeldForce * W] = 0;
    for (int i = 0; i < 3; ++i) slot[static_cast<size_t>(kernel::kHeldTorque + i) * W] = 0;
  }
  return pressed + calc_pressed_box(b, h);
}

void System::add_contact_point(const Vec3& at, double depth, double stiffness, double unseen) {
  ContactPoint& p = contact.point.emplace_back();
  p.at = at;
  p.depth = depth;
  p.stiffness = stiffness;
  p.unseen = unseen;
}

int System::touch(size_t b) {
  if (b == B || fixed[b]) return 0;
  int& place = contact.place[b];
  if (place < 0) {
    place = static_cast<int>(state.touching.body.size());
    state.touching.body.push_back(static_cast<int>(b));
    contact.groups.push_back(0);
  }
  ++contact.groups[static_cast<size_t>(place)];
  return place;
}

void System::add_contact_group(size_t a, size_t b, const Vec3& n, size_t first, int law, double stiffness,
                               StickRange& sticks) {
  const size_t count = contact.point.size() - first;
  for (ContactPoint& p : std::span(contact.point).subspan(first)) {
    double least = kUnlimited;
    for (int i = sticks.first; i < sticks.first + sticks.count; ++i) {
      const Stick& stick = contact.sticks[static_cast<size_t>(i)];
      const Vec3 d = stick.at - p.at;
      if (const double distance2 = dot(d, d); distance2 < least) {
        least = distance2;
        p.slip = stick.slip;
        p.is_fresh = false;
      }
    }
  }
  sticks = {static_cast<int>(first), static_cast<int>(count)};
  ContactGroup& g = state.touching.group.emplace_back();
  g.a = touch(a), g.b = touch(b);
  g.first = sticks.first, g.count = sticks.count;
  g.n = n;
  const State& s = state;
  g.hands_on = b != B;
  if (b != B) g.apart = s.p[a] - s.p[b];
  g.law = law;
  g.stiffness = g.stick = stiffness;
}

void System::fill_contact_blocks() {
  Touching& t = state.touching;
  const size_t W = kernel::lanes(), groups = t.group.size(), blocks = (groups + W - 1) / W;
  // by rising count, in order within a count
  std::vector<std::uint32_t>& next = contact.by_count;
  next.assign(BoxContact::kMostPoints + 2, 0);
  const auto key = [&](const ContactGroup& g) {
    return static_cast<size_t>(std::min(g.count, BoxContact::kMostPoints));
  };
  for (const ContactGroup& g : t.group) ++next[key(g) + 1];
  for (size_t i = 1; i < next.size(); ++i) next[i] += next[i - 1];
  t.rows.assign(blocks + 1, 0);
  for (ContactGroup& g : t.group) {
    g.slot = next[key(g)]++;
    std::uint32_t& most = t.rows[g.slot / W + 1];
    most = std::max(most, static_cast<std::uint32_t>(g.count));
  }
  for (size_t i = 0; i < blocks; ++i) t.rows[i + 1] += t.rows[i];
  t.a.assign(blocks * W, 0);
  t.b.assign(blocks * W, 0);
  t.groups.resize(blocks * W * kernel::kGroupFields);
  t.points.resize(t.rows[blocks] * W * kernel::kPointFields);
  // a place without a point has no depth and no stiffness, and what the last point there left
  static_assert(kernel::kPointStiffness == kernel::kDepth + 1);
  for (size_t row = 0; row < t.rows[blocks]; ++row)
    std::fill_n(t.points.data() + (row * kernel::kPointFields + kernel::kDepth) * W, 2 * W, 0.0);
  for (size_t slot = groups; slot < blocks * W; ++slot)
    for (size_t f = 0; f < kernel::kGroupFields; ++f)
      t.groups[(slot / W * kernel::kGroupFields + f) * W + slot % W] = 0;
  for (const ContactGroup& g : t.group) {
    const size_t block = g.slot / W, place = g.slot % W;
    t.a[g.slot] = static_cast<std::uint32_t>(g.a);
    t.b[g.slot] = static_cast<std::uint32_t>(g.b);
    const ContactLaw& law = contact_laws[static_cast<size_t>(g.law)];
    const double known[] = {g.n.x,
                            g.n.y,
                            g.n.z,
                            g.apart.x,
                            g.apart.y,
                            g.apart.z,
                            law.mean,
                            law.band,
                            law.most,
                            law.zeta,
                            law.damping,
                            law.friction,
                            kernel::kStickStiffness * law.mean * g.stick};
    static_assert(std::size(known) == kernel::kStick + 1);
    double* earnings = t.groups.data() + (block * kernel::kGroupFields + kernel::kEarned) * W + place;
    earnings[0] = g.earnings.stored, earnings[W] = g.earnings.spent;
    static_assert(kernel::kSpent == kernel::kEarned + 1);
    t.groups[(block * kernel::kGroupFields + kernel::kTogether) * W + place] = -1;
    double* to = t.groups.data() + block * kernel::kGroupFields * W + place;
    for (const double x : known) *to = x, to += W;
    for (int i = 0; i < g.count; ++i) {
      const ContactPoint& p = contact.point[static_cast<size_t>(g.first + i)];
      const double fields[] = {
          p.at.x, p.at.y, p.at.z, p.depth, p.stiffness, p.slip.x, p.slip.y, p.slip.z, p.is_fresh ? 1.0 : 0.0, p.unseen};
      static_assert(std::size(fields) == kernel::kMet + 1);
      double* at = t.points.data() + (t.rows[block] + static_cast<size_t>(i)) * kernel::kPointFields * W + place;
      for (const double x : fields) *at = x, at += W;
    }
  }
  // groups of each body; the kernel reads the rest
  const size_t touched = (t.body.size() + W - 1) / W;
  t.share.assign(touched * W, 0);
  for (size_t i = 0; i < contact.groups.size(); ++i) t.share[i] = contact.groups[i];
}

void System::resolve_contacts(double h, bool follows) {
  State& s = state;
  Touching& t = s.touching;
  s.contact_energy = s.stick_energy = 0;
  double loss = 0, loss_after = 0, friction = 0, friction_after = 0, lost = follows ? 0 : contact.lost;
  if (!t.group.empty()) {
    const size_t W = kernel::lanes(), blocks = (t.body.size() + W - 1) / W;
    const LaneLayout layout = lanes->body_layout(lane);
    contact.vectors.assign(blocks * W, static_cast<std::uint32_t>(layout.at(B, 0, 3)));
    contact.tensors.assign(blocks * W, static_cast<std::uint32_t>(layout.at(B, 0, 9)));
    contact.touched.resize(blocks * W * kernel::kTouchedFields);
    contact.rows.resize(blocks * W * kernel::kTouchedRow);
    contact.changes.resize(blocks * W * kernel::kWrenchRow);
    contact.sums.resize(blocks * W * kernel::kWrenchRow);
    contact.wrenches.resize(t.a.size() * 2 * kernel::kWrenchRow);
    for (size_t i = 0; i < t.body.size(); ++i) {
      const size_t b = static_cast<size_t>(t.body[i]);
      contact.vectors[i] = static_cast<std::uint32_t>(layout.at(b, 0, 3));
      contact.tensors[i] = static_cast<std::uint32_t>(layout.at(b, 0, 9));
    }
    kernel::TouchJob bodies;
    bodies.blocks = blocks;
    bodies.vectors = contact.vectors.data(), bodies.tensors = contact.tensors.data();
    bodies.stride = layout.W;
    bodies.v = lanes->v.data(), bodies.w = lanes->w.data(), bodies.R = lanes->R.data();
    bodies.constants = lanes->body_constants.data();
    bodies.force = lanes->force.data(), bodies.torque = lanes->torque.data();
    bodies.joint_force = lanes->joint_force.data(), bodies.joint_torque = lanes->joint_torque.data();
    bodies.groups = t.share.data();
    bodies.touched = contact.touched.data();
    bodies.rows = contact.rows.data(), bodies.changes = contact.changes.data(), bodies.sums = contact.sums.data();
    bodies.h = h;
    for (int i = 0; i < 3; ++i) bodies.gravity[i] = model.gravity[i];
    kernel::ContactJob job;
    job.blocks = t.rows.size() - 1;
    job.rows = t.rows.data();
    job.a = t.a.data(), job.b = t.b.data();
    job.count = t.group.size();
    job.bodies = contact.rows.data(), job.changes = contact.changes.data(), job.sums = contact.sums.data();
    job.wrenches = contact.wrenches.data();
    job.groups = t.groups.data();
    job.points = t.points.data();
    job.h = h;
    job.follows = follows;
    if (!t.held_block.empty()) job.held = t.held_block.data(), job.held_fields = t.held_fields.data();
    const auto push = [&] {
      kernel::sum_wrenches(job);
      kernel::update_touched(bodies);
      if (!t.held.empty()) hold_changes(h);
    };
    if (!t.held.empty()) foresee_joints(h);
    kernel::read_touched(bodies);
    kernel::press_contacts(job);
    push();
    if (!t.together.empty()) match_dashpots();
    kernel::damp_contacts(job);
    push();
    kernel::rub_contacts(job);
    push();
    kernel::book_contacts(job);

    // forces do their work over the half steps before and after
    for (size_t slot = 0; slot < job.count; ++slot) {
      const double* g = t.groups.data() + slot / W * kernel::kGroupFields * W + slot % W;
      s.contact_energy += g[kernel::kPressEnergy * W];
      s.stick_energy += g[kernel::kStickEnergy * W];
      loss += g[kernel::kGroupLoss * W], loss_after += g[(kernel::kGroupLoss + 1) * W];
      friction += g[kernel::kGroupRubPower * W], friction_after += g[(kernel::kGroupRubPower + 1) * W];
      if (!follows) lost += g[kernel::kLost * W];
    }
    for (size_t i = 0; i < t.body.size(); ++i) {
      const double* sum = contact.sums.data() + i * kernel::kWrenchRow;
      const Vec3 f{sum[0], sum[1], sum[2]};
      if (i == 0) {
        ground_contact -= f;
        continue;
      }
      const size_t b = static_cast<size_t>(t.body[i]);
      force[b] += f;
      torque[b] += Vec3{sum[3], sum[4], sum[5]};
    }
  }
  s.contact_loss += 0.5 * h * (s.contact_loss_power + loss) + lost;
  s.friction_work += 0.5 * h * (s.friction_power + friction);
  s.contact_loss_power = loss_after;
  s.friction_power = friction_after;
}

}  // namespace topple::mbs
