#include "fem/explicit_system.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

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
double ExplicitSystem::added_mass(int element) const {
  const ExplicitElement& e = inside_->model.elements[static_cast<size_t>(element)];
  const double density = inside_->model.materials[static_cast<size_t>(e.material)].density;
  return inside_->element_mass[static_cast<size_t>(element)] -
         inside_->element_volume[static_cast<size_t>(element)] * density * e.mass_factor;
}
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
  in.restart_bars(in.s);
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
    if (!in.is_finite(in.s)) return ExplicitEnding::Diverged;
    if (progress.report) progress.report(time() - begin, until - begin);
  }
  return ExplicitEnding::ReachedTime;
}

void ExplicitSystem::remove(std::span<const int> elements) {
  for (const int e : elements) inside_->remove_element(inside_->s, e, RemovalCause::Charge);
}

void ExplicitSystem::release(int number) {
  Inside& in = *inside_;
  ReleaseState& state = in.s.releases[static_cast<size_t>(number)];
  if (state.begun >= 0) return;
  state.begun = in.s.steps;
  for (const int b : in.model.releases[static_cast<size_t>(number)].bars) in.s.bars[static_cast<size_t>(b)].phase = 1;
  in.end_releases(in.s);
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
bool ExplicitSystem::bears(int bar) const { return inside_->s.bars[static_cast<size_t>(bar)].phase == 1; }
Vec3 ExplicitSystem::bar_force_of_ground(int bar) const {
  const ExplicitBar& b = inside_->model.bars[static_cast<size_t>(bar)];
  const Vec3& pull = inside_->s.bars[static_cast<size_t>(bar)].pull;
  if (!bears(bar) || (b.a.node[0] >= 0 && b.b.node[0] >= 0)) return {};
  return b.a.node[0] < 0 ? pull : -pull;
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
  const double lead = inside_->calc_lead(inside_->s);
  for (size_t i = 0; i < inside_->s.particles.size(); ++i) {
    const Particle& q = inside_->s.particles[i];
    const ParticleMake& make = inside_->s.particle_makes[i];
    view.push_back({q.p - lead * q.v, q.v, q.mass, q.radius, make.full_radius, make.element});
  }
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
                     [&](const GroundTouch& t) { return t.row == row; });
}
const std::vector<double>& ExplicitSystem::touchdowns() const { return inside_->s.touchdowns; }
int ExplicitSystem::contacts() const {
  return static_cast<int>(inside_->s.contact.touching.count + inside_->s.contact.debris.count);
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
  const double lead = inside_->calc_lead(inside_->s);
  for (const Particle& q : inside_->s.particles) sum += q.mass * (q.p - lead * q.v), mass += q.mass;
  return (1 / mass) * sum;
}

ExplicitSystem::Resultant ExplicitSystem::calc_resultant(std::span<const int> elements, std::span<const int> nodes,
                                                         const Vec3& about) const {
  // the kernel on copies of the chosen elements and their nodes alone, at rest and with masses of 1: speeds are forces
  const Inside& in = *inside_;
  const size_t W = in.chunks.W, fields = kernel::kElementFields;
  kernel::StepJob step = in.make_step();
  step.removes = false, step.grounds = 0, step.kick = 1;
  for (double& fall : step.fall) fall = 0;
  std::vector<int> chosen;
  for (const int e : elements)
    if (is_alive(e)) chosen.push_back(e);
  const auto material_of = [&](int e) { return in.model.elements[static_cast<size_t>(e)].material; };
  std::sort(chosen.begin(), chosen.end(),
            [&](int a, int b) { return std::pair(material_of(a), a) < std::pair(material_of(b), b); });
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());

  Resultant sum;
  constexpr size_t kMost = 1000;  // of a chunk
  for (size_t first = 0; first < chosen.size(); first += kMost) {
    const std::span<const int> these =
        std::span<const int>(chosen).subspan(first, std::min(kMost, chosen.size() - first));
    std::map<int, size_t> place;
    AlignedVector<double> rows, state, cracks;
    std::vector<std::uint16_t> corners, laws;
    std::vector<unsigned char> live;
    for (size_t i = 0; i < these.size();) {
      const int material = material_of(these[i]);
      laws.push_back(static_cast<std::uint16_t>(material)), live.push_back(0);
      const size_t block = laws.size() - 1;
      state.resize((block + 1) * fields * W, 0), corners.resize((block + 1) * 8 * W),
          cracks.resize(laws.size() * 3 * W, 0);
      const size_t begin = i;
      for (size_t lane = 0; lane < W; ++lane) {
        const bool is_used = i < these.size() && material_of(these[i]) == material;
        const size_t e = static_cast<size_t>(these[is_used ? i++ : begin]);
        size_t from_lane = 0;
        const double* from = in.element_block(in.s, static_cast<int>(e), from_lane);
        if (is_used) live[block] = static_cast<unsigned char>(live[block] | (1U << lane));
        for (size_t f = 0; is_used && f < fields; ++f) state[(block * fields + f) * W + lane] = from[f * W + from_lane];
        const double* open = in.s.cracks.data() + in.chunks.slot_of_element[e] / W * 3 * W + from_lane;
        for (size_t f = 0; is_used && f < 3; ++f) cracks[(block * 3 + f) * W + lane] = open[f * W];
        for (size_t k = 0; k < 8; ++k) {
          const int node = in.model.elements[e].node[k];
          const auto [at, is_new] = place.emplace(node, place.size());
          if (is_new) {
            const double* r = in.row(in.s, node);
            const double row[kernel::kNodeFields] = {r[0], r[1], r[2], 0, 0, 0, 1, 1};
            rows.insert(rows.end(), row, row + kernel::kNodeFields);
          }
          corners[(block * 8 + k) * W + lane] = static_cast<std::uint16_t>(kernel::kNodeFields * at->second);
        }
      }
    }
    const size_t count = place.size();
    const AlignedVector<double> pushes(4 * count, 0);
    AlignedVector<double> forces(4 * count, 0);
    const std::vector<std::uint8_t> flags(count, 0), joined(laws.size(), 0);
    std::vector<std::uint32_t> failed, grounded;
    kernel::ChunkJob job;
    job.laws = in.laws.data(), job.law_of_block = laws.data(), job.blocks = laws.size();
    job.elements = state.data(), job.cracks = cracks.data(), job.corners = corners.data(), job.joined = joined.data(),
    job.live = live.data();
    job.own = count, job.own_nodes = rows.data(), job.own_flags = flags.data(), job.own_pushes = pushes.data();
    job.forces = forces.data(), job.failed = &failed, job.grounded = &grounded;
    double none = 0;
    job.shared_forces = &none;
    kernel::advance_chunk(step, job);
    for (const int n : nodes) {
      const auto at = place.find(n);
      if (at == place.end()) continue;
      const double* r = rows.data() + kernel::kNodeFields * at->second + kernel::kSpeed;
      const Vec3 f{r[0], r[1], r[2]};
      sum.force += f;
      sum.moment += cross(p(n) - about, f);
    }
  }
  return sum;
}

}  // namespace topple::fem
