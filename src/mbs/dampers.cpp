/// Dampers of springs and bushings, taken with the velocity at the time of the positions and implicitly enough that
/// they do not bound the step (docs/theory/multibody.md, eq. F3 to F5).

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "mbs/forces.h"
#include "mbs/system.h"

namespace topple::mbs {

namespace {

/// Root of r + q c(r) = s. r holds a first guess. False if the law falls so fast that there is none nearby.
bool find_rate(const CompiledCharacteristic& c, double q, double s, double& r) {
  if (c.kind == Characteristic::Kind::Linear) {
    const double d = 1 + q * c.rate;
    r = s / d;
    return d > 0;
  }
  const auto lack = [&](double x) { return x + q * calc_force(c, x) - s; };
  // for a law that rises the root lies between s and s - q c(s)
  const double first = q * calc_force(c, s);
  double low = s - std::max(0.0, first), high = s - std::min(0.0, first);
  if (low == high) {
    r = s;
    return true;
  }
  if (lack(low) > 0 || lack(high) < 0) return false;
  if (!(r >= low && r <= high)) r = 0.5 * (low + high);
  for (int round = 0; round < 200; ++round) {
    const double g = lack(r);
    if (g == 0) return true;
    (g < 0 ? low : high) = r;
    const double slope = 1 + q * calc_slope(c, r);
    double next = slope > 0 ? r - g / slope : low - 1;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - r) <= 1e-15 * std::max(std::abs(r), std::abs(s)) || next == r) {
      r = next;
      return true;
    }
    r = next;
  }
  return false;
}

/// Largest step for a damper on jointed bodies beside springs of the frequency omega (eq. F5).
///   rate  of the damper: coefficient times inverse mass [1/s]
double find_jointed_limit(double omega, double rate) {
  const auto is_stable = [&](double h) {
    const double z = h * rate, share = z / (1 + 0.5 * z), stiff = h * h * omega * omega;
    return stiff * (1 + 0.5 * share) < 4 - 2 * share;
  };
  double low = 0, high = 2 / omega;
  for (int i = 0; i < 60; ++i) {
    const double h = 0.5 * (low + high);
    (is_stable(h) ? low : high) = h;
  }
  return low;
}

}  // namespace

void System::find_damper_bounds() {
  std::vector<DamperRow>& rows = forces.damper_rows;
  std::vector<DampedBody>& bodies = forces.damped;
  for (DampedBody& d : bodies) {
    d.rows.clear();
    d.inverse_inertia = calc_world_inverse_inertia(static_cast<size_t>(d.body));
  }
  for (size_t i = 0; i < rows.size(); ++i) {
    DamperRow& d = rows[i];
    d.own = calc_inverse_mass(d.a, d.row.line, d.row.turn_a) + calc_inverse_mass(d.b, d.row.line, d.row.turn_b);
    d.bound = d.own;
    if (d.place_a >= 0) bodies[static_cast<size_t>(d.place_a)].rows.push_back(static_cast<int>(2 * i));
    if (d.place_b >= 0) bodies[static_cast<size_t>(d.place_b)].rows.push_back(static_cast<int>(2 * i + 1));
  }
  // neighbours couple rows: the sums of their magnitudes, each scaled by both rows' own, bound the matrix from above
  for (const DampedBody& body : bodies) {
    const double inverse_mass = state.body[static_cast<size_t>(body.body)].inverse_mass;
    for (size_t m = 0; m < body.rows.size(); ++m) {
      DamperRow& i = rows[static_cast<size_t>(body.rows[m] / 2)];
      const Vec3& turn_i = body.rows[m] % 2 == 0 ? i.row.turn_a : i.row.turn_b;
      const Vec3 spin = body.inverse_inertia * turn_i;
      for (size_t n = 0; n < m; ++n) {
        DamperRow& k = rows[static_cast<size_t>(body.rows[n] / 2)];
        if (&i == &k || !(i.own > 0) || !(k.own > 0)) continue;
        const Vec3& turn_k = body.rows[n] % 2 == 0 ? k.row.turn_a : k.row.turn_b;
        const double coupling = std::abs(inverse_mass * dot(i.row.line, k.row.line) + dot(turn_k, spin));
        i.bound += coupling * std::sqrt(i.own / k.own);
        k.bound += coupling * std::sqrt(k.own / i.own);
      }
    }
  }
}

void System::keep_forces() {
  for (DampedBody& d : forces.damped) {
    d.force_before = force[static_cast<size_t>(d.body)];
    d.torque_before = torque[static_cast<size_t>(d.body)];
  }
}

void System::evaluate_dampers() {
  std::vector<DamperRow>& rows = forces.damper_rows;
  if (rows.empty()) return;
  if (clusters_due) {
    build_clusters();
    clusters_due = true;  // the next step does it with all that follows from it
  }
  find_damper_bounds();
  const double half = 0.5 * step;
  // velocities at the time of the positions, the last pulls of the dampers standing for the present ones
  for (DampedBody& d : forces.damped) {
    const size_t b = static_cast<size_t>(d.body);
    Vec3 f = force[b], t = torque[b];
    if (in_cluster[b]) {
      // the reactions of joints are known for the step before only: so are the other forces taken
      f = t = {};
      if (!state.first_kick) {
        f = d.force_before + joint_force[b];
        t = d.torque_before + joint_torque[b];
      }
    } else {
      for (const int entry : d.rows) {
        const DamperRow& r = rows[static_cast<size_t>(entry / 2)];
        const double last = entry % 2 == 0 ? r.state->damper : -r.state->damper;
        f += last * r.row.line;
        t += last * (entry % 2 == 0 ? r.row.turn_a : r.row.turn_b);
      }
    }
    const bool has_no_past = in_cluster[b] && state.first_kick;
    d.velocity = state.v[b] + (half * state.body[b].inverse_mass) * f + (has_no_past ? 0 : half) * model.gravity;
    d.spin = d.inverse_inertia * (state.L[b] + half * t);
  }
  for (DamperRow& d : rows) {
    double rate = 0;
    if (d.place_b >= 0) {
      const DampedBody& b = forces.damped[static_cast<size_t>(d.place_b)];
      rate += dot(d.row.line, b.velocity) + dot(d.row.turn_b, b.spin);
    }
    if (d.place_a >= 0) {
      const DampedBody& a = forces.damped[static_cast<size_t>(d.place_a)];
      rate -= dot(d.row.line, a.velocity) + dot(d.row.turn_a, a.spin);
    }
    ComponentState& c = *d.state;
    const double q = half * d.bound, last = c.damper;
    if (std::isfinite(rate) && !find_rate(*d.law, q, rate + q * last, c.rate) && trouble.empty()) {
      char words[160];
      std::snprintf(
          words, sizeof words,
          "a damper's law falls so fast near %.3g m/s or rad/s that a step of %.3g s does not determine its force",
          rate, step);
      trouble = words;
    }
    c.damper = calc_force(*d.law, c.rate);
    *d.damping += 0.5 * (last + c.damper) * (c.deformation - c.before);
  }
  for (const DamperRow& d : rows) pull(d.a, d.b, d.row, d.state->damper);
}

double System::calc_damper_limit(double omega) {
  double limit = kUnlimited;
  if (forces.damped.empty()) return limit;
  const auto springs = state.spring, torsions = state.torsion;
  const auto bushings = state.bushing;
  evaluate_springs(true);
  find_damper_bounds();
  std::vector<unsigned char> jointed(B, 0);
  for (const CompiledJoint& j : joints)
    for (const int b : {j.parent, j.child})
      if (b >= 0) jointed[static_cast<size_t>(b)] = 1;
  const auto is_jointed = [&](int b) { return b >= 0 && jointed[static_cast<size_t>(b)]; };
  double fastest = 0;
  for (const DamperRow& d : forces.damper_rows) {
    // of a polynomial the slope at rest: what it grows to is not known beforehand
    const double rate = find_steepest(*d.law, 0, 0) * d.bound;
    fastest = std::max(fastest, rate);
    if (omega > 0 && rate > 0 && (is_jointed(d.a) || is_jointed(d.b)))
      limit = std::min(limit, find_jointed_limit(omega, rate));
  }
  forces.fastest_damper = fastest;
  state.spring = springs;
  state.torsion = torsions;
  state.bushing = bushings;
  forces.damper_rows.clear();
  for (size_t b = 0; b < B; ++b) force[b] = torque[b] = Vec3{};
  ground_reaction = {};
  return limit;
}

}  // namespace topple::mbs
