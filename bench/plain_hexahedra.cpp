/// The frame of explicit hexahedra by a plain kernel, one element after the other in scalar double: what the speed of
/// fem::ExplicitSystem is measured against on any machine. Mean gradients and stabilisation after Flanagan & Belytschko
/// (1981), Jaumann's rate, von Mises with a table by radial return, linear and quadratic bulk viscosity, removal at a
/// plastic strain, ground by a penalty. It has nothing else: no contact of surfaces, no debris, no ledger of energy.

#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <vector>

#include "cpu_time.h"
#include "explicit_frame.h"
#include "fem/explicit_system.h"

namespace topple::bench {
namespace {

constexpr double kHourglass = 0.05, kLinear = 0.06, kQuadratic = 1.2;
constexpr int kCorners[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};

struct PlainElement {
  std::array<int, 8> node{};
  Mat3 stress;
  std::array<Vec3, 4> stabilisation{};  // forces of the four modes
  double plastic = 0, mass = 0;
  bool live = true;
};

struct PlainHexahedra {
  std::vector<Vec3> x, v, force;
  std::vector<double> mass;
  std::vector<PlainElement> elements;
  std::vector<fem::YieldPoint> yield;
  double density = 0, lame = 0, shear = 0, limit = 0, penalty = 0;
  double modes[4][8] = {};

  explicit PlainHexahedra(const fem::ExplicitModel& model) : x(model.nodes), yield(model.materials[0].yield) {
    const fem::ExplicitMaterial& m = model.materials[0];
    density = m.density, limit = m.compression_limit;
    lame = m.E * m.nu / ((1 + m.nu) * (1 - 2 * m.nu)), shear = m.E / (2 * (1 + m.nu));
    v.assign(x.size(), {0, 0, -3});
    force.resize(x.size());
    mass.assign(x.size(), 0.0);
    for (const fem::ExplicitElement& from : model.elements) {
      PlainElement e;
      e.node = from.node;
      std::array<Vec3, 8> corners;
      for (size_t i = 0; i < 8; ++i) corners[i] = x[static_cast<size_t>(e.node[i])];
      e.mass = density * fem::calc_hex_volume(corners);
      for (const int n : e.node) mass[static_cast<size_t>(n)] += e.mass / 8;
      elements.push_back(e);
    }
    penalty = 0.1 * m.E * 0.4;  // of a cell's edge
    for (int i = 0; i < 8; ++i) {
      const int a = kCorners[i][0], b = kCorners[i][1], c = kCorners[i][2];
      const int mode[4] = {b * c, a * c, a * b, a * b * c};
      for (int k = 0; k < 4; ++k) modes[k][i] = mode[k];
    }
  }

  /// Yield stress and its slope at a plastic strain.
  std::pair<double, double> yield_stress(double strain) const {
    for (size_t i = 1; i < yield.size(); ++i)
      if (strain < yield[i].strain) {
        const double slope =
            (yield[i].compression - yield[i - 1].compression) / (yield[i].strain - yield[i - 1].strain);
        return {yield[i - 1].compression + slope * (strain - yield[i - 1].strain), slope};
      }
    return {yield.back().compression, 0.0};
  }

  void push(PlainElement& e, double h) {
    Vec3 at[8], speed[8];
    for (size_t i = 0; i < 8; ++i) {
      at[i] = x[static_cast<size_t>(e.node[i])];
      speed[i] = v[static_cast<size_t>(e.node[i])];
    }
    Mat3 J;  // dx / dxi
    for (int i = 0; i < 8; ++i)
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) J(r, c) += at[i][r] * kCorners[i][c] / 8.0;
    const double det = determinant(J), volume = 8 * det;
    const Mat3 I = inverse(J);
    Vec3 B[8];
    for (int i = 0; i < 8; ++i)
      for (int c = 0; c < 3; ++c)
        B[i][c] = (kCorners[i][0] * I(0, c) + kCorners[i][1] * I(1, c) + kCorners[i][2] * I(2, c)) / 8;
    Mat3 L;  // dv / dx
    for (int i = 0; i < 8; ++i)
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) L(r, c) += speed[i][r] * B[i][c];
    Mat3 D, W;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) D(r, c) = 0.5 * (L(r, c) + L(c, r)), W(r, c) = 0.5 * (L(r, c) - L(c, r));
    const double rate = D(0, 0) + D(1, 1) + D(2, 2);
    Mat3 s = e.stress;
    const Mat3 turned = W * s;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) s(r, c) += h * (turned(r, c) + turned(c, r) + 2 * shear * D(r, c));
    for (int r = 0; r < 3; ++r) s(r, r) += h * lame * rate;
    const double mean = (s(0, 0) + s(1, 1) + s(2, 2)) / 3;
    double square = 0;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) square += (s(r, c) - (r == c ? mean : 0)) * (s(r, c) - (r == c ? mean : 0));
    const double mises = std::sqrt(1.5 * square);
    const auto [limit_stress, slope] = yield_stress(e.plastic);
    double kept = 1;
    if (mises > limit_stress) {
      const double flow = (mises - limit_stress) / (3 * shear + slope);
      kept = (mises - 3 * shear * flow) / mises;
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) s(r, c) = kept * (s(r, c) - (r == c ? mean : 0)) + (r == c ? mean : 0);
      e.plastic += flow;
      if (e.plastic > limit) {
        e.live = false;
        return;
      }
    }
    e.stress = s;
    const double length = std::cbrt(volume), c = std::sqrt((lame + 2 * shear) / density);
    const double rho = e.mass / volume;
    if (rate < 0) {
      const double q = rho * length * rate * (kQuadratic * length * rate - kLinear * c);
      for (int r = 0; r < 3; ++r) s(r, r) -= q;
    }
    double gradients = 0;
    for (const Vec3& b : B) gradients += dot(b, b);
    const double stiffness = kHourglass * (lame + 2 * shear) * volume * gradients / 8;
    Vec3 out[8];
    for (int i = 0; i < 8; ++i) out[i] = volume * (s * B[i]);
    for (int k = 0; k < 4; ++k) {
      Vec3 middle;
      for (int i = 0; i < 8; ++i) middle += modes[k][i] * at[i];
      double gamma[8];
      Vec3 turn;
      for (int i = 0; i < 8; ++i) {
        gamma[i] = modes[k][i] - dot(middle, B[i]);
        turn += gamma[i] * speed[i];
      }
      Vec3& Q = e.stabilisation[static_cast<size_t>(k)];
      Q = kept * (Q + (h * stiffness / 8) * turn);
      for (int i = 0; i < 8; ++i) out[i] += gamma[i] * Q;
    }
    for (size_t i = 0; i < 8; ++i) force[static_cast<size_t>(e.node[i])] -= out[i];
  }

  void advance(double h) {
    for (size_t n = 0; n < x.size(); ++n) force[n] = {0, 0, -9.81 * mass[n]};
    for (PlainElement& e : elements)
      if (e.live) push(e, h);
    for (size_t n = 0; n < x.size(); ++n) {
      if (x[n].z < 0) {
        const double normal = -penalty * x[n].z, slip = std::hypot(v[n].x, v[n].y);
        const double rub = 0.5 * normal / std::max(slip, 0.01);
        force[n] += Vec3{-rub * v[n].x, -rub * v[n].y, normal};
      }
      v[n] += (h / mass[n]) * force[n];
      x[n] += h * v[n];
    }
  }
};

/// 64 steps from the 60th on, as explicit_hexahedra/1/0 which runs right before; 103,932 elements.
void explicit_hexahedra_plain(benchmark::State& state) {
  const fem::ExplicitModel model = make_explicit_frame(8, 8, 9);
  const double elements = static_cast<double>(model.elements.size());
  double plain = 0, engine = 0, apart = 0;
  int yielded = 0;
  for (auto _ : state) {
    fem::ExplicitOptions options;
    options.contact = false;
    fem::ExplicitSystem system(model, options);
    system.set_velocity({0, 0, -3});
    const double h = system.step();
    const auto run_system = [&](int steps) {
      const double begin = cpu_time();
      if (system.advance(system.time() + steps * h) != fem::ExplicitEnding::ReachedTime)
        state.SkipWithError("diverged");
      return cpu_time() - begin;
    };
    run_system(60);
    const double spent_by_engine = run_system(64);
    PlainHexahedra frame(model);
    const auto run_plain = [&](int steps) {
      const double begin = cpu_time();
      for (int i = 0; i < steps; ++i) frame.advance(h);
      return cpu_time() - begin;
    };
    run_plain(60);
    const double spent = run_plain(64);
    state.SetIterationTime(spent);
    plain += spent / 64, engine += spent_by_engine / 64;
    double fall = 0, fall_of_engine = 0, mass = 0;
    for (size_t n = 0; n < frame.x.size(); ++n) {
      fall += frame.mass[n] * (model.nodes[n].z - frame.x[n].z), mass += frame.mass[n];
      fall_of_engine += frame.mass[n] * (model.nodes[n].z - system.p(static_cast<int>(n)).z);
    }
    apart = (fall - fall_of_engine) / mass;
    yielded = 0;
    for (const PlainElement& e : frame.elements) yielded += e.plastic > 0;
  }
  const double runs = static_cast<double>(state.iterations());
  state.counters["ns"] = 1e9 * plain / runs / elements;
  state.counters["engine_ns"] = 1e9 * engine / runs / elements;
  state.counters["engine_over_plain"] = engine / plain;
  state.counters["yielded_pct"] = 100 * yielded / elements;
  state.counters["centres_apart_mm"] = 1e3 * apart;
}
BENCHMARK(explicit_hexahedra_plain)->Unit(benchmark::kMillisecond)->UseManualTime()->Iterations(2);

}  // namespace
}  // namespace topple::bench
