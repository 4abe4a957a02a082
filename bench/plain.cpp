/// The scene `frame255` by a plain core, one connection after the other in scalar double: what the engine's speed is
/// measured against on any machine. Semi-implicit Euler, linear-brittle connections without damping, corners on the
/// ground by a penalty. It has nothing else: no events but the front row, no ledger, no contact between bodies.

#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "cpu_time.h"
#include "frame.h"
#include "mbs/solver.h"

namespace topple::bench {
namespace {

constexpr double kDuration = 1.7;                // [s]
constexpr double kFriction = 0.6, kSlow = 0.01;  // Coulomb's, reached at this speed [m/s]

struct PlainBody {
  Vec3 p, v, w, force, torque;
  Quat q;
  Mat3 R = Mat3::identity();
  double mass = 0, radius = 0;
  Vec3 inertia, half;
};

struct PlainConnection {
  int a = -1, b = -1;
  Vec3 p_a, p_b;
  Quat q_a, q_b;
  Vec3 translational, rotational;
  double compression = 0, tension = 0, shear = 0, moment = 0, torsion = 0;
  bool live = true;
};

struct PlainFrame {
  double ground_frequency = 0;  // of a body on one corner [rad/s]
  std::vector<PlainBody> bodies;
  std::vector<PlainConnection> connections;
  std::vector<int> front;  // connections that are taken away
  Vec3 gravity;

  PlainFrame(const mbs::Model& model, const std::vector<Pose>& start)
      : ground_frequency(model.contact.contact_frequency), gravity(model.gravity) {
    for (size_t i = 0; i < model.bodies.size(); ++i) {
      const mbs::Body& from = model.bodies[i];
      PlainBody b;
      b.p = start[i].p, b.q = start[i].q;
      b.R = to_matrix(b.q);
      b.mass = from.mass;
      b.half = from.shapes[0].half;
      b.radius = norm(b.half);
      b.inertia = {from.inertia(0, 0), from.inertia(1, 1), from.inertia(2, 2)};
      bodies.push_back(b);
    }
    for (const mbs::ZoneElement& e : model.elements) {
      const mbs::ZoneLaw& law = model.laws[static_cast<size_t>(e.stations[0].law.index)];
      connections.push_back({e.a.index, e.b.index, e.X_AF.p, e.X_BM.p, e.X_AF.q, e.X_BM.q, e.translational_stiffness,
                             e.rotational_stiffness, law.compression.f[0], law.tension.f[0], law.shear_y,
                             law.moment_y.positive[0], law.torsion});
    }
    for (const mbs::Event& event : model.events)
      for (const mbs::Action& a : event.actions) front.push_back(a.element.index);
  }

  void connect(PlainConnection& c) {
    static PlainBody ground;
    PlainBody &A = c.a < 0 ? ground : bodies[static_cast<size_t>(c.a)], &B = bodies[static_cast<size_t>(c.b)];
    const Vec3 lever_a = A.R * c.p_a, lever_b = B.R * c.p_b;
    const Quat q_f = A.q * c.q_a, q_m = B.q * c.q_b;
    const Mat3 F = to_matrix(q_f);
    const Vec3 t = transpose_times(F, (B.p + lever_b) - (A.p + lever_a));
    const Quat r = conjugate(q_f) * q_m;
    const double two = r.w < 0 ? -2 : 2;  // rotations are small as long as a connection holds
    const Vec3 f{c.translational.x * t.x, c.translational.y * t.y, c.translational.z * t.z};
    const Vec3 m{c.rotational.x * two * r.x, c.rotational.y * two * r.y, c.rotational.z * two * r.z};
    if (f.x > c.tension || -f.x > c.compression || f.y * f.y + f.z * f.z > c.shear * c.shear ||
        m.y * m.y + m.z * m.z > c.moment * c.moment || std::abs(m.x) > c.torsion) {
      c.live = false;
      return;
    }
    const Vec3 force = F * f, torque = F * m;
    A.force += force;
    A.torque += cross((B.p + lever_b) - A.p, force) + torque;
    B.force -= force;
    B.torque -= cross(lever_b, force) + torque;
  }

  void touch_ground(PlainBody& b) const {
    if (b.p.z > b.radius) return;
    const double stiffness = b.mass * ground_frequency * ground_frequency / 8;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 lever = b.R * Vec3{corner & 1 ? b.half.x : -b.half.x, corner & 2 ? b.half.y : -b.half.y,
                                    corner & 4 ? b.half.z : -b.half.z};
      const double depth = -(b.p.z + lever.z);
      if (depth <= 0) continue;
      const Vec3 v = b.v + cross(b.w, lever);
      const double n = stiffness * depth * (v.z > 0 ? 0.5 : 1);  // half of it on the way back: restitution
      const double slip = std::sqrt(v.x * v.x + v.y * v.y), rub = kFriction * n / std::max(slip, kSlow);
      const Vec3 f{-rub * v.x, -rub * v.y, n};
      b.force += f;
      b.torque += cross(lever, f);
    }
  }

  void advance(double h) {
    for (PlainBody& b : bodies) b.force = b.mass * gravity, b.torque = {};
    for (PlainConnection& c : connections)
      if (c.live) connect(c);
    for (PlainBody& b : bodies) {
      touch_ground(b);
      b.v += (h / b.mass) * b.force;
      const Vec3 w = transpose_times(b.R, b.w), t = transpose_times(b.R, b.torque);
      const Vec3 l{b.inertia.x * w.x, b.inertia.y * w.y, b.inertia.z * w.z}, turn = t - cross(w, l);
      b.w = b.R * (w + h * Vec3{turn.x / b.inertia.x, turn.y / b.inertia.y, turn.z / b.inertia.z});
      b.p += h * b.v;
      const Vec3 s = (0.5 * h) * b.w;
      b.q = normalized(Quat{1, s.x, s.y, s.z} * b.q);
      b.R = to_matrix(b.q);
    }
  }
};

/// Steps of 0.1 ms from the same equilibrium; the engine right before, at 0.1 ms and at its own step.
///   falls  0: the front row holds, so that both work on all connections all the time
void frame255_plain(benchmark::State& state) {
  const bool falls = state.range(0) != 0;
  mbs::Model model = make_frame();
  model.contact.bodies = false;
  if (!falls) model.events.clear();
  const auto run_engine = [&](double step) {
    mbs::Options options;
    options.step = step;
    mbs::Simulation simulation(model, options);
    std::string message;
    if (!simulation.find_equilibrium(message)) state.SkipWithError(message.c_str());
    const double begin = cpu_time();
    while (simulation.time() < kDuration && simulation.advance_step()) {}
    return cpu_time() - begin;
  };
  mbs::Simulation rest(model, {});
  std::string message;
  if (!rest.find_equilibrium(message)) return state.SkipWithError(message.c_str());
  const std::vector<Pose> start = rest.calc_view().X_WB;
  double total = 0, total_same = 0, total_own = 0;
  int broken = 0;
  double low = 0;
  constexpr int kSteps = 17000;
  for (auto _ : state) {
    total_same += run_engine(kDuration / kSteps);
    total_own += run_engine(0);
    PlainFrame frame(model, start);
    const double begin = cpu_time();
    for (int i = 0; i < kSteps; ++i) {
      if (i == 10)
        for (const int c : frame.front) frame.connections[static_cast<size_t>(c)].live = false;
      frame.advance(kDuration / kSteps);
    }
    const double spent = cpu_time() - begin;
    total += spent;
    state.SetIterationTime(spent);
    broken = 0, low = 0;
    double mass = 0;
    for (const PlainConnection& c : frame.connections) broken += !c.live;
    for (const PlainBody& b : frame.bodies) low += b.mass * b.p.z, mass += b.mass;
    low /= mass;
  }
  const double runs = static_cast<double>(state.iterations());
  state.counters["step_us"] = 1e6 * total / (runs * kSteps);
  state.counters["broken"] = broken;
  state.counters["mass_centre"] = low;
  state.counters["engine_step_over_plain"] = total_same / total;
  state.counters["engine_run_over_plain"] = total_own / total;
}
BENCHMARK(frame255_plain)->Arg(1)->Arg(0)->Unit(benchmark::kMillisecond)->UseManualTime();

}  // namespace
}  // namespace topple::bench
