#include "fem/relaxation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace topple::fem {

RelaxationSummary relax_system(ExplicitSystem::Inside& in, const RelaxationOptions& options, const Progress& progress) {
  ExplicitState& s = in.s;
  const size_t N = in.start.size();
  RelaxationSummary summary;
  const auto field = [&](size_t element, size_t number) -> double& {
    size_t lane = 0;
    double* block = in.element_block(s, static_cast<int>(element), lane);
    return block[number * in.chunks.W + lane];
  };

  // masses with which every element has the same critical step, and its bulk viscosity with them: without viscosity
  // what opens and closes at each step swings ever more
  std::vector<double> fictitious(N, 0), lengths(in.element_mass.size(), 0);
  constexpr double kShare = 0.85;  // of the critical step
  for (size_t e = 0; e < in.element_mass.size(); ++e) {
    if (s.contact.gone.size() > e && s.contact.gone[e] != 0) continue;
    const ExplicitMaterial& material = in.model.materials[static_cast<size_t>(in.model.elements[e].material)];
    const auto x = in.corners(s, static_cast<int>(e));
    const double volume = calc_hex_volume(x);
    const double density = in.element_mass[e] / volume / material.density;
    const double ratio = in.h / (kShare * calc_element_step(x, material, density));
    for (const std::uint32_t row : in.rows_of_element[e]) fictitious[row] += in.element_mass[e] / 8 * ratio * ratio;
    double& length = field(e, kernel::kLength);
    lengths[e] = length, length *= ratio / std::sqrt(density);
  }
  // the ground's springs go with real masses
  for (size_t row = 0; row < N; ++row) {
    const double* r = s.rows.data() + 8 * row;
    const double mass = r[kernel::kNodeMass];
    if (!(mass > 0)) continue;
    for (const ExplicitGround& g : in.model.grounds)
      if (dot(g.normal, Vec3{r[0], r[1], r[2]} - g.point) < 1e-2) fictitious[row] = std::max(fictitious[row], mass);
  }
  std::vector<std::uint32_t> live;
  std::vector<Vec3> begin;  // of those
  double load2 = 0;
  const double g2 = dot(in.model.gravity, in.model.gravity);
  for (size_t row = 0; row < N; ++row) {
    double* r = s.rows.data() + 8 * row;
    for (int c = 0; c < 3; ++c) r[kernel::kSpeed + c] = 0;
    const double mass = r[kernel::kNodeMass];
    if (!(mass > 0)) continue;
    live.push_back(static_cast<std::uint32_t>(row));
    begin.push_back({r[0], r[1], r[2]});
    r[kernel::kInverseMass] = 1 / fictitious[row];
    load2 += mass * mass * g2;
  }
  for (const std::uint32_t row : in.loaded)
    for (size_t c = 0; c < 3; ++c) load2 += std::pow(in.loads[4 * size_t{row} + c], 2);

  kernel::StepJob step = in.make_step();
  step.removes = false, step.quadratic = 0, step.weighs = true;
  for (double& fall : step.fall) fall = 0;
  double last_kinetic = 0;
  bool rests = true;
  const long long steps = s.steps;
  const bool bears_its_load = steps > 0;
  for (; summary.steps < options.most_steps && !progress.is_cancelled(); ++summary.steps) {
    const double ramp = bears_its_load ? 1 : std::min(1.0, (summary.steps + 1.0) / std::max(1, options.ramp));
    in.clear_pushes(s);
    in.press_bars(s);
    in.press_grounds(s, false);
    for (int c = 0; c < 3; ++c) step.weight[c] = ramp * in.model.gravity[c];
    // nodal forces, which a push begins with, rise as well
    if (ramp < 1)
      for (const std::uint32_t row : in.loaded)
        if (s.uses[row] > 0)
          for (size_t c = 0; c < 3; ++c) s.pushes[4 * size_t{row} + c] -= (1 - ramp) * in.loads[4 * size_t{row} + c];
    // while loads rise, damped; then free from one peak of the kinetic energy to the next
    const double half = ramp < 1 ? 0.05 : 0;
    step.keep = (1 - half) / (1 + half),
    step.kick = in.h / (1 + half) * (rests ? 0.5 : 1);  // leapfrog from rest begins with half a kick
    const bool rested = std::exchange(rests, false);
    in.advance_nodes(step, s);
    s.grounded.clear();
    for (const auto& rows : in.grounded) s.grounded.insert(s.grounded.end(), rows.begin(), rows.end());

    double out2 = 0, kinetic = 0;
    for (const kernel::Balance& balance : in.balances) out2 += balance.force2, kinetic += balance.kinetic;
    summary.residual = std::sqrt(out2 / load2);
    // at rest no viscosity hides what is out of balance
    const bool is_balanced = ramp >= 1 && summary.residual < options.tolerance;
    if (is_balanced && rested) {
      summary.converged = true;
      break;
    }
    if (is_balanced || (ramp >= 1 && kinetic < last_kinetic)) {
      // the mode that leads stands in its equilibrium: back to the places of the stresses, and stop
      for (const std::uint32_t row : live) {
        double* r = s.rows.data() + 8 * size_t{row};
        for (int c = 0; c < 3; ++c) r[c] -= in.h * r[kernel::kSpeed + c], r[kernel::kSpeed + c] = 0;
      }
      kinetic = 0;
      rests = true;
      ++summary.stops;
    }
    last_kinetic = kinetic;
    if (summary.steps % 100 != 0) continue;
    if (progress.report) progress.report(summary.steps, options.most_steps);
    const auto has_left = [&](size_t i) {
      const double* r = s.rows.data() + 8 * size_t{live[i]};
      return norm(Vec3{r[0], r[1], r[2]} - begin[i]) > options.most_settlement;
    };
    bool leaves = false;
    for (size_t i = 0; i < live.size() && !leaves; ++i) leaves = has_left(i);
    if (leaves) break;
  }
  s.steps = steps;
  for (size_t e = 0; e < lengths.size(); ++e)
    if (lengths[e] > 0) { field(e, kernel::kLength) = lengths[e], field(e, kernel::kViscous) = 0; }
  s.contact.pairs.clear(), s.contact.fresh = true, s.held.clear();  // of other places
  in.clear_pushes(s);
  for (const std::uint32_t row : live) {
    double* r = s.rows.data() + 8 * size_t{row};
    r[kernel::kInverseMass] = 1 / r[kernel::kNodeMass];
    for (int c = 0; c < 3; ++c) r[kernel::kSpeed + c] = 0;
    summary.settlement = std::max(summary.settlement, norm(Vec3{r[0], r[1], r[2]} - in.start[row]));
  }
  summary.text = fmt::format("dead load {} after {} steps: out of balance by {:.2g} of the load, settled by {:.3g} mm",
                             summary.converged ? "in equilibrium" : "not in equilibrium", summary.steps,
                             summary.residual, 1e3 * summary.settlement);
  return summary;
}

}  // namespace topple::fem
