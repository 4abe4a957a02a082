#include "fem/explicit_system.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "fem/explicit_inside.h"
#include "fem/relaxation.h"

namespace topple::fem {

ExplicitSystem::ExplicitSystem(const ExplicitModel& model, const ExplicitOptions& options)
    : inside_(std::make_unique<Inside>(model, options)) {}
ExplicitSystem::~ExplicitSystem() = default;
ExplicitSystem::ExplicitSystem(ExplicitSystem&&) noexcept = default;
ExplicitSystem& ExplicitSystem::operator=(ExplicitSystem&&) noexcept = default;

double ExplicitSystem::time() const { return static_cast<double>(inside_->s.steps) * inside_->h; }
double ExplicitSystem::step() const { return inside_->h; }
long long ExplicitSystem::steps() const { return inside_->s.steps; }
double ExplicitSystem::added_mass() const { return inside_->added_mass; }
int ExplicitSystem::scaled_elements() const { return inside_->scaled_elements; }
const ExplicitSystem::Timing& ExplicitSystem::timing() const { return inside_->timing; }
std::string ExplicitSystem::instruction_set() const { return kernel::target_name(); }

RelaxationSummary ExplicitSystem::relax(const RelaxationOptions& options, const Progress& progress) {
  RelaxationSummary summary = relax_system(*inside_, options, progress);
  Inside& in = *inside_;
  // the ledger begins here
  for (size_t row = 0; row < in.start.size(); ++row) {
    const double* r = in.s.rows.data() + 8 * row;
    in.start[row] = {r[0], r[1], r[2]};
  }
  in.s.sums = {};
  in.started = false;
  return summary;
}

ExplicitEnding ExplicitSystem::advance(double until, const Progress& progress) {
  Inside& in = *inside_;
  if (!in.started) {
    in.start_energy = 0;
    in.start_energy = in.calc_energy().sum();
    in.started = true;
  }
  const double begin = time();
  const auto last = static_cast<long long>(std::llround(until / in.h));
  while (in.s.steps < last) {
    if (progress.is_cancelled()) return ExplicitEnding::Cancelled;
    in.advance_step(in.s, true);
    if (in.s.steps % 64 != 0 && in.s.steps != last) continue;
    // a number that is not finite spreads
    double sum = 0;
    for (const double x : in.s.rows) sum += x;
    if (!std::isfinite(sum)) return ExplicitEnding::Diverged;
    if (progress.report) progress.report(time() - begin, until - begin);
  }
  return ExplicitEnding::ReachedTime;
}

void ExplicitSystem::remove(std::span<const int> elements) {
  for (const int e : elements) inside_->remove_element(inside_->s, e, RemovalCause::Charge);
}

void ExplicitSystem::set_velocities(std::span<const Vec3> v) {
  Inside& in = *inside_;
  for (size_t n = 0; n < in.model.nodes.size(); ++n) {
    const std::uint32_t row = in.chunks.row_of_node[n];
    double* r = in.s.rows.data() + 8 * static_cast<size_t>(row);
    for (int c = 0; c < 3; ++c)
      r[kernel::kSpeed + c] = r[kernel::kNodeMass] > 0 && (in.s.flags[row] & (1 << c)) == 0 ? v[n][c] : 0;
  }
  in.started = false;
  in.s.begins = true;
}
void ExplicitSystem::set_velocity(const Vec3& v) { set_velocities(std::vector<Vec3>(inside_->model.nodes.size(), v)); }

Vec3 ExplicitSystem::p(int node) const {
  const double* r = inside_->row(inside_->s, node);
  return {r[0], r[1], r[2]};
}
Vec3 ExplicitSystem::v(int node) const {
  const double* r = inside_->row(inside_->s, node);
  return {r[kernel::kSpeed], r[kernel::kSpeed + 1], r[kernel::kSpeed + 2]};
}
double ExplicitSystem::node_mass(int node) const { return inside_->row(inside_->s, node)[kernel::kNodeMass]; }
void ExplicitSystem::copy_positions(std::vector<Vec3>& out) const {
  out.resize(inside_->model.nodes.size());
  for (size_t n = 0; n < out.size(); ++n) out[n] = p(static_cast<int>(n));
}

namespace {
template <class Inside, class State>
double field_of(const Inside& in, const State& state, int element, int field) {
  size_t lane = 0;
  return in.element_block(state, element, lane)[static_cast<size_t>(field) * in.chunks.W + lane];
}
}  // namespace

bool ExplicitSystem::is_alive(int element) const { return field_of(*inside_, inside_->s, element, kernel::kMass) > 0; }
double ExplicitSystem::plastic_strain(int element) const {
  return field_of(*inside_, inside_->s, element, kernel::kStrain);
}
double ExplicitSystem::damage(int element) const { return field_of(*inside_, inside_->s, element, kernel::kDamage); }
std::array<double, 6> ExplicitSystem::stress(int element) const {
  std::array<double, 6> s{};
  for (int i = 0; i < 6; ++i) s[static_cast<size_t>(i)] = field_of(*inside_, inside_->s, element, kernel::kStress + i);
  return s;
}

const std::vector<Removal>& ExplicitSystem::removals() const { return inside_->s.removals; }
const std::vector<DebrisParticle>& ExplicitSystem::debris() const {
  auto& view = inside_->debris_view;
  view.clear();
  for (const Particle& q : inside_->s.particles) view.push_back({q.p, q.v, q.mass, q.radius, q.full_radius, q.element});
  return view;
}

ExplicitEnergy ExplicitSystem::calc_energy() const {
  ExplicitEnergy energy = inside_->calc_energy();
  if (!inside_->started) energy.start = energy.sum();
  return energy;
}

std::vector<ExplicitSystem::PartSummary> ExplicitSystem::calc_parts() const {
  const Inside& in = *inside_;
  std::vector<PartSummary> parts(static_cast<size_t>(in.parts));
  for (size_t e = 0; e < in.model.elements.size(); ++e) {
    PartSummary& part = parts[static_cast<size_t>(in.model.elements[e].part)];
    const double strain = plastic_strain(static_cast<int>(e));
    part.largest_plastic_strain = std::max(part.largest_plastic_strain, strain);
    if (is_alive(static_cast<int>(e)))
      ++part.alive, part.plastic_strain += strain;
    else
      ++part.removed;
  }
  for (PartSummary& part : parts)
    if (part.alive > 0) part.plastic_strain /= part.alive;
  return parts;
}

Vec3 ExplicitSystem::ground_force(int ground) const { return inside_->s.ground_forces[static_cast<size_t>(ground)]; }
bool ExplicitSystem::touches_ground(int node) const {
  const std::uint32_t row = inside_->chunks.row_of_node[static_cast<size_t>(node)];
  return std::any_of(inside_->s.touches.begin(), inside_->s.touches.end(),
                     [&](const GroundTouch& t) { return t.particle == 0 && t.row == row; });
}
const std::vector<double>& ExplicitSystem::touchdowns() const { return inside_->s.touchdowns; }
int ExplicitSystem::contacts() const {
  size_t count = 0;
  for (const auto& touches : inside_->s.contact.touches) count += touches.size();
  return static_cast<int>(count);
}

double ExplicitSystem::calc_mass() const {
  double mass = 0;
  for (size_t row = 0; row < inside_->start.size(); ++row) mass += inside_->s.rows[8 * row + kernel::kNodeMass];
  for (const Particle& q : inside_->s.particles) mass += q.mass;
  return mass;
}
Vec3 ExplicitSystem::calc_momentum() const {
  Vec3 sum;
  for (size_t row = 0; row < inside_->start.size(); ++row) {
    const double* r = inside_->s.rows.data() + 8 * row;
    sum += r[kernel::kNodeMass] * Vec3{r[kernel::kSpeed], r[kernel::kSpeed + 1], r[kernel::kSpeed + 2]};
  }
  for (const Particle& q : inside_->s.particles) sum += q.mass * q.v;
  return sum;
}
Vec3 ExplicitSystem::calc_centre_of_mass() const {
  Vec3 sum;
  double mass = 0;
  for (size_t row = 0; row < inside_->start.size(); ++row) {
    const double* r = inside_->s.rows.data() + 8 * row;
    sum += r[kernel::kNodeMass] * Vec3{r[0], r[1], r[2]}, mass += r[kernel::kNodeMass];
  }
  for (const Particle& q : inside_->s.particles) sum += q.mass * q.p, mass += q.mass;
  return (1 / mass) * sum;
}

ExplicitSystem::Resultant ExplicitSystem::calc_resultant(std::span<const int> elements, std::span<const int> nodes,
                                                         const Vec3& about) const {
  // nodal forces of the chosen elements alone: the kernel on a copy in which all others are gone, without history
  const Inside& in = *inside_;
  ExplicitState copy = in.s;
  const size_t W = in.chunks.W;
  std::fill(copy.live.begin(), copy.live.end(), static_cast<unsigned char>(0));
  std::vector<unsigned char> chosen(in.model.elements.size(), 0);
  for (const int e : elements) chosen[static_cast<size_t>(e)] = 1;
  for (size_t e = 0; e < chosen.size(); ++e) {
    size_t lane = 0;
    double* block = in.element_block(copy, static_cast<int>(e), lane);
    if (chosen[e] == 0 || !(block[kernel::kMass * W + lane] > 0)) {
      block[kernel::kMass * W + lane] = 0;
      continue;
    }
    const std::uint32_t slot = in.chunks.slot_of_element[e];
    copy.live[slot / W] = static_cast<unsigned char>(copy.live[slot / W] | (1U << (slot % W)));
  }
  for (size_t row = 0; row < in.start.size(); ++row) {
    double* r = copy.rows.data() + 8 * row;
    r[kernel::kInverseMass] = 1;
    for (int c = 0; c < 3; ++c) r[kernel::kSpeed + c] = 0;
  }
  std::fill(copy.flags.begin(), copy.flags.end(), static_cast<std::uint8_t>(0));
  kernel::StepJob step = in.make_step();
  step.removes = false, step.grounds = 0, step.kick = 1;
  for (double& fall : step.fall) fall = 0;
  Inside& room = *inside_;
  const Timing kept = room.timing;
  room.advance_nodes(step, copy);
  room.timing = kept;
  Resultant sum;
  for (const int n : nodes) {
    const double* r = in.row(copy, n);
    const Vec3 f{r[kernel::kSpeed], r[kernel::kSpeed + 1], r[kernel::kSpeed + 2]};
    sum.force += f;
    sum.moment += cross(p(n) - about, f);
  }
  return sum;
}

}  // namespace topple::fem
