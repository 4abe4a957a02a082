#include "fem/explicit_inside.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "fem/segment_contact.h"

namespace topple::fem {

namespace {

kernel::Law make_law(const ExplicitMaterial& m) {
  kernel::Law law;
  law.E = m.E, law.nu = m.nu;
  law.lambda = m.E * m.nu / ((1 + m.nu) * (1 - 2 * m.nu)), law.mu = m.E / (2 * (1 + m.nu));
  law.bending = m.E / (1 - m.nu * m.nu), law.bulk = law.lambda + 2.0 / 3 * law.mu;
  law.speed = std::sqrt((law.lambda + 2 * law.mu) / m.density);
  law.points = static_cast<int>(m.yield.size());
  for (size_t i = 0; i < m.yield.size(); ++i) {
    const YieldPoint& y = m.yield[i];
    law.at[i] = y.strain;
    if (i + 1 < m.yield.size()) {
      const YieldPoint& next = m.yield[i + 1];
      law.tension_slope[i] = (next.tension - y.tension) / (next.strain - y.strain);
      law.compression_slope[i] = (next.compression - y.compression) / (next.strain - y.strain);
    }
    law.tension[i] = y.tension - law.tension_slope[i] * y.strain;
    law.compression[i] = y.compression - law.compression_slope[i] * y.strain;
  }
  law.tension_cutoff = m.tension_cutoff, law.compression_cutoff = m.compression_cutoff;
  law.crack_strain = m.crack_strain;
  law.tension_rate = 1 / m.tension_limit, law.compression_rate = 1 / m.compression_limit;
  return law;
}

/// What is shared out by rows goes to this many tasks.
constexpr size_t kTasks = 16;

/// Steps of the elements in one of the debris (docs/theory/explicit.md, eq. 23): as many as are stable where balls of
/// one size are packed most densely, which have 8 times the squared frequency of one spring and dashpots alike. Forces
/// held on nodes lag by half of what a step is longer, a dashpot that gives: there must be twice as much of the other
/// kind.
int choose_debris_steps(double damping) {
  constexpr int kMost = 4;
  constexpr double kNeighbours = 8;
  int steps = kMost;
  const auto is_stable = [&] {
    const double spring = kNeighbours * kDebrisRate * steps * steps;
    const double dashpot = kNeighbours * 2 * damping * std::sqrt(kDebrisRate / 2) * steps;
    const double lag = 0.25 * (steps - 1) * std::sqrt(kTouchRate);
    return spring + 2 * dashpot < 4 && damping >= 2 * lag;
  };
  while (steps > 1 && !is_stable()) --steps;
  return steps;
}

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

}  // namespace

double calc_step_share(const ExplicitOptions& o) {
  const double b = o.linear_viscosity;
  return o.step_share * (std::sqrt(1 + b * b) - b);
}

ExplicitSystem::Inside::Inside(const ExplicitModel& m, const ExplicitOptions& o)
    : model(m), options(o), team(std::make_unique<Team>(o.threads)) {
  check_explicit_model(model);
  chunks = make_chunks(model, kernel::lanes(), choose_chunk(model));
  for (size_t e = 0; e < model.elements.size(); ++e)
    model.elements[e].node = turn_corners(model.elements[e].node, chunks.turn_of_element[e]);
  const size_t N = model.nodes.size(), E = model.elements.size(), rows = chunks.node_of_row.size();
  for (const ExplicitMaterial& material : model.materials) laws.push_back(make_law(material));
  first_laws = laws;
  s.bars.resize(model.bars.size()), s.releases.resize(model.releases.size());

  // step and mass scaling
  element_mass.resize(E), element_volume.resize(E);
  std::vector<double> steps(E);
  double least = std::numeric_limits<double>::infinity();
  for (size_t e = 0; e < E; ++e) {
    const ExplicitElement& element = model.elements[e];
    const ExplicitMaterial& material = model.materials[static_cast<size_t>(element.material)];
    std::array<Vec3, 8> x;
    for (size_t i = 0; i < 8; ++i) x[i] = model.nodes[static_cast<size_t>(element.node[i])];
    element_volume[e] = calc_hex_volume(x);
    element_mass[e] = element_volume[e] * material.density * element.mass_factor;
    steps[e] = calc_element_step(x, material, element.mass_factor);
    least = std::min(least, steps[e]);
  }
  const double share = calc_step_share(options);
  h = options.scaled_step > 0 ? options.scaled_step : share * least;
  for (size_t e = 0; e < E; ++e) {
    if (share * steps[e] >= h * (1 - 1e-12)) continue;
    const double factor = std::pow(h / (share * steps[e]), 2);
    added_mass += (factor - 1) * element_mass[e], ++scaled_elements;
    element_mass[e] *= factor;
  }

  // state
  const size_t W = chunks.W, fields = kernel::kElementFields;
  s.rows.assign(8 * rows, 0);
  s.flags.assign(rows, 0);
  s.pushes.assign(4 * rows, 0);
  loads.assign(4 * rows, 0);
  s.uses.assign(rows, 0);
  s.elements.assign(chunks.slots() * fields, 0);
  s.cracks.assign(chunks.slots() * 3, 0);
  s.live.assign(chunks.slots() / W, 0);
  rows_of_element.resize(E);
  constexpr int none = std::numeric_limits<int>::max();
  first_part_of_row.assign(rows, none);
  for (size_t n = 0; n < N; ++n) {
    double* row = s.rows.data() + 8 * static_cast<size_t>(chunks.row_of_node[n]);
    row[0] = model.nodes[n].x, row[1] = model.nodes[n].y, row[2] = model.nodes[n].z;
    if (!model.extra_mass.empty()) row[kernel::kNodeMass] = model.extra_mass[n];
  }
  std::vector<bool> is_released(E, false);  // of a node the part is that of what stays
  for (const ExplicitRelease& release : model.releases)
    for (const int e : release.elements) is_released[static_cast<size_t>(e)] = true;
  std::vector<int> released_part_of_row(rows, none);
  for (size_t e = 0; e < E; ++e) {
    const ExplicitElement& element = model.elements[e];
    parts = std::max(parts, element.part + 1);
    size_t lane = 0;
    double* block = element_block(s, static_cast<int>(e), lane);
    block[kernel::kMass * W + lane] = element_mass[e];
    std::array<Vec3, 8> x;
    for (size_t i = 0; i < 8; ++i) {
      const std::uint32_t row = chunks.row_of_node[static_cast<size_t>(element.node[i])];
      x[i] = model.nodes[static_cast<size_t>(element.node[i])];
      rows_of_element[e][i] = row;
      s.rows[8 * row + kernel::kNodeMass] += element_mass[e] / 8;
      ++s.uses[row];
      int& part = (is_released[e] ? released_part_of_row : first_part_of_row)[row];
      part = std::min(part, element.part);
    }
    // the shortest way through: at ν = 0 half of it is the step times the speed of waves over √2
    ExplicitMaterial plain;
    plain.density = plain.E = 1;
    block[kernel::kLength * W + lane] = calc_element_step(x, plain);
    const std::uint32_t slot = chunks.slot_of_element[e];
    s.live[slot / W] = static_cast<unsigned char>(s.live[slot / W] | (1U << (slot % W)));
  }
  for (size_t row = 0; row < rows; ++row) {
    if (first_part_of_row[row] == none) first_part_of_row[row] = released_part_of_row[row];
    double* r = s.rows.data() + 8 * row;
    if (s.uses[row] == 0) r[kernel::kNodeMass] = 0;
    r[kernel::kInverseMass] = r[kernel::kNodeMass] > 0 ? 1 / r[kernel::kNodeMass] : 0;
  }
  for (const ExplicitSupport& support : model.supports) {
    std::uint8_t& flags = s.flags[chunks.row_of_node[static_cast<size_t>(support.node)]];
    flags = static_cast<std::uint8_t>(flags | (support.x ? kernel::kHoldX : 0) | (support.y ? kernel::kHoldY : 0) |
                                      (support.z ? kernel::kHoldZ : 0));
  }
  for (size_t row = 0; row < rows; ++row)
    if (!(s.rows[8 * row + kernel::kNodeMass] > 0)) s.flags[row] |= kernel::kHoldX | kernel::kHoldY | kernel::kHoldZ;
  for (const NodalForce& f : model.forces) {
    const std::uint32_t row = chunks.row_of_node[static_cast<size_t>(f.node)];
    for (int c = 0; c < 3; ++c) loads[4 * size_t{row} + static_cast<size_t>(c)] += f.force[c];
    loaded.push_back(row);
  }
  std::sort(loaded.begin(), loaded.end());
  loaded.erase(std::unique(loaded.begin(), loaded.end()), loaded.end());
  for (const std::uint32_t row : loaded) push_load(s, row);
  s.ground_forces.assign(model.grounds.size(), {}), s.debris_forces = s.ground_forces;
  s.touchdowns.assign(static_cast<size_t>(parts), -1);
  s.whole_mass.assign(static_cast<size_t>(parts), 0), s.debris_mass = s.whole_mass;
  for (size_t e = 0; e < E; ++e) s.whole_mass[static_cast<size_t>(model.elements[e].part)] += element_mass[e];
  for (size_t row = 0; row < rows; ++row)
    for (const ExplicitGround& g : model.grounds) {
      const double* r = s.rows.data() + 8 * row;
      if (r[kernel::kNodeMass] > 0 && dot(g.normal, Vec3{r[0], r[1], r[2]} - g.point) < 0) {
        s.grounded.push_back(static_cast<std::uint32_t>(row));
        break;
      }
    }
  debris_steps = options.debris_steps > 0 ? options.debris_steps : choose_debris_steps(options.debris_damping);
  double edge = options.search_margin;
  if (!(edge > 0)) edge = calc_mesh_summary(model).smallest_edge / 3;
  contact = make_contact_setup(model, chunks, edge, options.contact);

  shared_forces.assign(4 * std::max<size_t>(1, chunks.shared_rows.size()), 0);
  failed.resize(chunks.chunks.size());
  chunk_sums.resize(chunks.chunks.size());
  grounded.resize(chunks.chunks.size() + kTasks);
  balances.resize(grounded.size());
  start.resize(rows);
  for (size_t row = 0; row < rows; ++row) start[row] = model.nodes[static_cast<size_t>(chunks.node_of_row[row])];
}

double* ExplicitSystem::Inside::element_block(ExplicitState& state, int element, size_t& lane) const {
  const size_t slot = chunks.slot_of_element[static_cast<size_t>(element)], W = chunks.W;
  lane = slot % W;
  return state.elements.data() + slot / W * W * kernel::kElementFields;
}
const double* ExplicitSystem::Inside::element_block(const ExplicitState& state, int element, size_t& lane) const {
  const size_t slot = chunks.slot_of_element[static_cast<size_t>(element)], W = chunks.W;
  lane = slot % W;
  return state.elements.data() + slot / W * W * kernel::kElementFields;
}

std::array<Vec3, 8> ExplicitSystem::Inside::corners(const ExplicitState& state, int element) const {
  std::array<Vec3, 8> x;
  for (size_t i = 0; i < 8; ++i) {
    const double* r = state.rows.data() + 8 * static_cast<size_t>(rows_of_element[static_cast<size_t>(element)][i]);
    x[i] = {r[0], r[1], r[2]};
  }
  return x;
}

kernel::StepJob ExplicitSystem::Inside::make_step() const {
  kernel::StepJob step;
  step.h = step.past = h, step.keep = 1, step.kick = h;
  for (int c = 0; c < 3; ++c) step.fall[c] = h * model.gravity[c];
  step.linear = options.linear_viscosity, step.quadratic = options.quadratic_viscosity;
  for (const ExplicitGround& g : model.grounds) {
    double* n = step.ground[step.grounds++];
    n[0] = g.normal.x, n[1] = g.normal.y, n[2] = g.normal.z, n[3] = dot(g.normal, g.point);
  }
  return step;
}

void ExplicitSystem::Inside::advance_nodes(const kernel::StepJob& step, ExplicitState& state) {
  const size_t count = chunks.chunks.size(), W = chunks.W;
  const double t0 = seconds();
  for (kernel::Law& law : laws) kernel::set_step(law, step.past);
  const auto run_chunk = [&](size_t i) {
    // of a thread rather than a chunk, so that it stays in the cache; all 0 between chunks
    static thread_local AlignedVector<double> room;
    if (room.size() < 4 * chunks.most_nodes) room.assign(4 * chunks.most_nodes, 0);
    const ElementChunk& chunk = chunks.chunks[i];
    kernel::ChunkJob job;
    job.laws = laws.data(), job.law_of_block = chunks.material_of_block.data() + chunk.first_block;
    job.blocks = chunk.blocks;
    job.elements = state.elements.data() + chunk.first_block * W * kernel::kElementFields;
    job.cracks = state.cracks.data() + chunk.first_block * W * 3;
    job.corners = chunks.corners.data() + chunk.first_block * 8 * W;
    job.joined = chunks.joined.data() + chunk.first_block;
    job.live = state.live.data() + chunk.first_block;
    job.own = chunk.own, job.shared = chunk.shared;
    job.own_nodes = state.rows.data() + 8 * chunk.first_row;
    job.nodes = state.rows.data();
    job.shared_nodes = chunks.shared_rows.data() + chunk.first_shared;
    job.shared_forces = shared_forces.data() + 4 * chunk.first_shared;
    job.own_flags = state.flags.data() + chunk.first_row;
    job.own_pushes = state.pushes.data() + 4 * chunk.first_row;
    job.forces = room.data();
    failed[i].clear(), grounded[i].clear();
    job.failed = &failed[i], job.grounded = &grounded[i];
    kernel::advance_chunk(step, job);
    for (size_t k = 0; k < 4; ++k) chunk_sums[i][k] = job.sums[k];
    balances[i] = job.balance;
    for (std::uint32_t& row : grounded[i]) row += static_cast<std::uint32_t>(chunk.first_row);
    for (std::uint32_t& f : failed[i]) f += static_cast<std::uint32_t>(4 * chunk.first_block * W);
  };
  const size_t shared = chunks.node_of_row.size() - chunks.first_shared_row;
  const auto run_shared = [&](size_t task) {
    kernel::SharedJob job;
    job.first = shared * task / kTasks, job.last = shared * (task + 1) / kTasks;
    job.nodes = state.rows.data(), job.first_row = chunks.first_shared_row;
    job.starts = chunks.starts.data(), job.entries = chunks.entries.data(), job.forces = shared_forces.data();
    job.flags = state.flags.data(), job.pushes = state.pushes.data();
    job.grounded = &grounded[count + task];
    job.grounded->clear();
    kernel::advance_shared(step, job);
    balances[count + task] = job.balance;
  };
  team->run(count, run_chunk);
  const double t1 = seconds();
  team->run(kTasks, run_shared);
  timing.kernel += t1 - t0, timing.boundary += seconds() - t1;
}

void ExplicitSystem::Inside::clear_pushes(ExplicitState& state) const {
  const size_t count = state.pushed.size(), tasks = std::clamp<size_t>(count / 512, 1, kTasks);
  team->run(tasks, [&](size_t task) {
    for (size_t i = count * task / tasks; i < count * (task + 1) / tasks; ++i) {
      const std::uint32_t row = state.pushed[i];
      state.flags[row] = static_cast<std::uint8_t>(state.flags[row] & ~kernel::kPushed);
      for (size_t c = 0; c < 3; ++c) state.pushes[4 * size_t{row} + c] = 0;
    }
  });
  state.pushed.clear();
  for (const std::uint32_t row : loaded)
    if (state.uses[row] > 0) push_load(state, row);
}

bool ExplicitSystem::Inside::is_finite(const ExplicitState& state) const {
  constexpr size_t kRow = kernel::kNodeFields;
  const size_t rows = state.rows.size() / kRow;
  std::array<bool, kTasks> finite{};
  team->run(kTasks, [&](size_t task) {
    // a number that is not finite leaves none in a sum; eight sums, so that none waits for the one before
    std::array<double, kRow> sums{};
    for (size_t row = rows * task / kTasks; row < rows * (task + 1) / kTasks; ++row)
      for (size_t i = 0; i < kRow; ++i) sums[i] += state.rows[kRow * row + i];
    finite[task] = std::all_of(sums.begin(), sums.end(), [](double sum) { return std::isfinite(sum); });
  });
  return std::all_of(finite.begin(), finite.end(), [](bool is) { return is; });
}

void ExplicitSystem::Inside::advance_step(ExplicitState& state, bool removes) {
  kernel::StepJob step = make_step();
  step.removes = removes;
  if (state.begins) step.past = 0;
  state.begins = false;
  const double t0 = seconds();
  const bool debris = pushes_debris(state);
  if (removes) end_releases(state);
  fade_laws(state);
  clear_pushes(state);
  press_bars(state);
  press_grounds(state, debris);
  double t1 = seconds();
  timing.contact += t1 - t0;
  const bool has_contact = options.contact || !state.particles.empty();
  if (has_contact) {
    search_contact(*this, state);
    timing.searches = state.contact.searches;
    t1 = seconds();
    press_surfaces(*this, state, debris);
    timing.contact += seconds() - t1;
  }
  advance_nodes(step, state);
  const double t2 = seconds();
  if (debris) move_particles(state);
  book_bars(state);
  book_grounds(state, debris);
  if (has_contact) book_surfaces(*this, state);
  for (const auto& sums : chunk_sums)
    for (size_t k = 0; k < 4; ++k) state.sums[k] += sums[k];
  state.grounded.clear();
  for (const auto& rows : grounded) state.grounded.insert(state.grounded.end(), rows.begin(), rows.end());
  ++state.steps;
  timing.contact += seconds() - t2;
  if (!removes) return;
  for (const auto& list : failed)
    for (const std::uint32_t f : list) {
      const int element = chunks.element_of_slot[f / 4];
      const RemovalCause causes[4] = {RemovalCause::Charge, RemovalCause::Tension, RemovalCause::Compression,
                                      RemovalCause::Degenerate};
      remove_element(state, element, causes[f % 4]);
    }
}

}  // namespace topple::fem
