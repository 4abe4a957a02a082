#include "self_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "base/unit.h"
#include "engines/engine.h"
#include "engines/verification.h"
#include "mbs/model.h"
#include "mbs/solver.h"
#include "nearfield/fibres.h"
#include "record/record.h"
#include "study/store.h"
#include "uncertainty/alpha.h"

namespace topple::apps {

namespace fs = std::filesystem;

namespace {

/// Cases of the verification by name, at their finest step.
std::vector<CheckedNumber> verify_case(const std::string& name) {
  for (engines::VerificationCase& c : engines::make_verification_cases()) {
    if (c.name != name) continue;
    c.steps = {c.steps.back()};
    const engines::VerificationResult r = engines::verify(c, *engines::make_engine("native"));
    if (!r.failure.empty()) throw std::runtime_error(r.failure);
    std::vector<CheckedNumber> numbers;
    for (size_t q = 0; q < r.rows.size(); ++q) {
      const engines::VerifiedQuantity& quantity = c.quantities[q];
      if (quantity.exact.size() != 1) continue;
      numbers.push_back({quantity.what, quantity.unit, quantity.exact[0], r.rows[q].value.at(0), quantity.tolerance});
    }
    return numbers;
  }
  throw std::logic_error("there is no case \"" + name + "\" in the verification");
}

/// Uncracked: M/kappa is that of the transformed section, less a share of 1/L² that L layers leave out.
std::vector<CheckedNumber> check_section() {
  nearfield::ZoneInput in;
  product::Section& s = in.section;
  s.name = "square", s.width = s.height = 0.4;
  for (const double y : {-0.15, 0.15})
    for (const double z : {-0.15, 0.15}) s.bars.push_back({y, z, 491e-6, 25 * unit::mm});
  in.concrete.fc = 25 * unit::MPa, in.concrete.fct = 2 * unit::MPa, in.concrete.Ec = 30 * unit::GPa;
  in.concrete.eps_c1 = 2.2e-3, in.concrete.Gf = 100, in.concrete.Gcl = 15e3;
  in.steel = {"", 500 * unit::MPa, 550 * unit::MPa, 200 * unit::GPa, 0.05};
  in.length = 0.4;
  const nearfield::Fibres f = nearfield::make_fibres(in, nearfield::Axis::Y);
  const double kappa = 1e-6;  // 0.2 microstrain at the edge
  double eps_0 = 0;
  if (!nearfield::find_equilibrium(f, 0, kappa, eps_0)) throw std::runtime_error("the section is not in equilibrium");
  const double got = nearfield::calc_resultants(f, eps_0, kappa).M / kappa;
  const double gross = in.concrete.Ec * std::pow(0.4, 4) / 12, bars = 4 * 491e-6 * 0.15 * 0.15;
  const double EI = gross + (in.steel.Es - in.concrete.Ec) * bars;
  double layers = 0;  // without those that only fill the lanes
  for (size_t i = 0; i < f.at.size(); ++i) layers += f.core_area[i] + f.cover_area[i] > 0;
  return {{"bending stiffness of a column of 40 x 40 cm", "N m2", EI, got, 1.01 * gross / (layers * layers)}};
}

/// y = (a - 2)² + b over two triangular numbers: least where a = 2 lies inside the cut, greatest at a corner.
std::vector<CheckedNumber> check_alpha_levels() {
  using namespace uncertainty;
  const std::vector<FuzzyNumber> inputs{make_triangular(1, 2.5, 3), make_triangular(0, 1, 4)};
  const Evaluate model = make_evaluate_values([](const Point& x) { return Point{(x[0] - 2) * (x[0] - 2) + x[1]}; });
  AlphaOptions o = make_thrifty_options();
  o.levels = {0, 0.5, 1};
  const AlphaResult r = optimise(inputs, model, o, {});
  std::vector<CheckedNumber> numbers;
  const double exact[3][2] = {{0, 5}, {0.5, 3.0625}, {1.25, 1.25}};  // a: [1, 3], [1.75, 2.75], 2.5
  for (size_t i = 0; i < 3; ++i) {
    const LevelBounds& level = r.outputs.at(0).levels.at(i);
    numbers.push_back(
        {fmt::format("least value at alpha {:g}", level.alpha), "", exact[i][0], level.lower.value, 1e-6});
    numbers.push_back(
        {fmt::format("greatest value at alpha {:g}", level.alpha), "", exact[i][1], level.upper.value, 1e-6});
  }
  return numbers;
}

std::uint64_t count_different(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) return std::max(a.size(), b.size());
  std::uint64_t n = 0;
  for (size_t i = 0; i < a.size(); ++i) n += std::bit_cast<std::uint64_t>(a[i]) != std::bit_cast<std::uint64_t>(b[i]);
  return n;
}

/// Awkward numbers.
std::vector<double> make_numbers(size_t count) {
  std::vector<double> out{0.1, -0.0, 1e-310, 1.7976931348623157e308, 1.0 / 3};
  for (std::uint64_t x = 1; out.size() < count;) {
    x = x * 6364136223846793005u + 1442695040888963407u;
    out.push_back(static_cast<double>(static_cast<std::int64_t>(x)) * 1e-17);
  }
  return out;
}

std::vector<CheckedNumber> check_record(const fs::path& scratch) {
  record::Record r;
  r.provenance.title = "Self-check: größe \"x\"";
  r.ending = "at_rest";
  r.bodies.resize(7);
  for (size_t b = 0; b < r.bodies.size(); ++b) r.bodies[b].name = "B" + std::to_string(b);
  constexpr size_t kFrames = 40;
  const size_t poses = kFrames * r.bodies.size();
  const std::vector<double> numbers = make_numbers(3 * poses);
  for (size_t f = 0; f < kFrames; ++f) r.time.push_back(0.1 * static_cast<double>(f));
  for (const double x : numbers) r.position.push_back(static_cast<float>(std::fmod(x, 1e6)));
  for (size_t i = 0; i < poses; ++i) r.orientation.insert(r.orientation.end(), {1, 0, 0, 0});
  r.series = {{"x", "Numbers", "m", "x", {numbers.begin(), numbers.begin() + kFrames}}};
  const std::string path = (scratch / "record.h5").string();
  record::write_hdf5(r, path);
  const record::Record back = record::read_hdf5(path);
  std::vector<double> before(r.series[0].value), after(back.series.at(0).value);
  before.insert(before.end(), r.time.begin(), r.time.end());
  after.insert(after.end(), back.time.begin(), back.time.end());
  for (const float x : r.position) before.push_back(x);
  for (const float x : back.position) after.push_back(x);
  double different = static_cast<double>(count_different(before, after));
  different += back.provenance.title != r.provenance.title;
  return {{fmt::format("numbers of {} that a record gives back otherwise", before.size()), "", 0, different, 0}};
}

std::vector<CheckedNumber> check_store(const fs::path& scratch) {
  study::Store store((scratch / "study.sqlite").string());
  store.put_model("m", "{}");
  const study::Point point = make_numbers(12);
  const std::string hash = study::calc_job_hash("m", point);
  store.add_jobs("m", {{hash, point}});
  const std::vector<study::Job> jobs = store.claim("w", 1, 60);
  if (jobs.size() != 1) throw std::runtime_error("the queue does not give its job");
  study::Answer answer;
  answer.kind = study::Answer::Kind::Done;
  answer.outputs = {{"y", 0.1}};
  answer.trajectory = make_numbers(50);
  if (!store.finish(jobs[0], "w", answer)) throw std::runtime_error("the queue does not take the result");
  const std::vector<study::StoredResult> results = store.load_results("m");
  double different = 50 + 12;
  if (results.size() == 1)
    different = static_cast<double>(count_different(results[0].inputs, point) +
                                    count_different(results[0].answer.trajectory, answer.trajectory));
  return {{"numbers of 62 that a study gives back otherwise", "", 0, different, 0}};
}

/// The same bits at one and at several threads: a heap of boxes that fall on each other.
std::vector<CheckedNumber> check_threads() {
  std::vector<double> places[2];
  for (const int threads : {1, 3}) {
    mbs::Model m;
    for (int i = 0; i < 27; ++i) {
      mbs::Body b;
      b.name = "b" + std::to_string(i);
      b.mass = 100 + i;
      b.inertia = Mat3::diagonal({10, 11, 12});
      const int row = i / 3 % 3, layer = i / 9;
      b.X_WB.p = {0.7 * (i % 3), 0.6 * row, 0.5 + 0.9 * layer};
      b.X_WB.q = exp_rotation({0.1 * i, 0.2, 0.05 * i});
      b.shapes = {mbs::Shape{mbs::Shape::Kind::Box, {}, {0.25, 0.2, 0.15}, 0, {}}};
      mbs::add_body(m, b);
    }
    mbs::Options o;
    o.equilibrium = false;
    o.duration = 0.5;
    o.threads = threads;
    std::vector<double>& out = places[threads > 1];
    o.on_frame = [&out](const mbs::View& v) {
      for (const Pose& X : v.X_WB) out.insert(out.end(), {X.p.x, X.p.y, X.p.z, X.q.w});
    };
    const mbs::Summary s = mbs::run(m, o);
    if (s.ending != mbs::Summary::Ending::TimeLimit) throw std::runtime_error(s.message);
  }
  return {{fmt::format("numbers of {} that differ between 1 and 3 threads", places[0].size()), "", 0,
           static_cast<double>(count_different(places[0], places[1])), 0}};
}

}  // namespace

bool CheckedNumber::is_ok() const { return std::isfinite(got) && std::abs(got - expected) <= tolerance; }

bool SelfCheck::is_ok() const {
  return failure.empty() && !numbers.empty() &&
         std::all_of(numbers.begin(), numbers.end(), [](const CheckedNumber& n) { return n.is_ok(); });
}

std::vector<SelfCheckCase> make_self_checks(const fs::path& scratch) {
  const auto verified = [](const std::string& name, const std::string& source) {
    return SelfCheckCase{name, source, [name] { return verify_case(name); }};
  };
  return {verified("Pendulum on a revolute joint", "IFToMM, \"simple pendulum\""),
          verified("Rod toppling about a hinge", "energy balance, elliptic integral"),
          verified("Bouncing ball", "free flights with half the speed after each impact"),
          verified("Cantilever, lowest frequency, 8 cells", "the discrete beam's closed form"),
          verified("Cantilever, sag against the discrete values", "dead load, sum of the hinges' rotations"),
          {"Section of a column", "transformed section, uncracked", check_section},
          {"Alpha-level optimisation", "least and greatest value of a parabola", check_alpha_levels},
          {"Threads", "the same bits", check_threads},
          {"Record written and read back", "the same bits", [scratch] { return check_record(scratch); }},
          {"Study written and read back", "the same bits", [scratch] { return check_store(scratch); }}};
}

std::vector<SelfCheck> run_self_checks(const std::vector<SelfCheckCase>& cases, const std::atomic<bool>& cancel) {
  std::vector<SelfCheck> out;
  for (const SelfCheckCase& c : cases) {
    if (cancel.load(std::memory_order_relaxed)) break;
    SelfCheck check{c.name, c.source, {}, {}, 0};
    const auto start = std::chrono::steady_clock::now();
    try {
      check.numbers = c.measure();
      if (check.numbers.empty()) check.failure = "nothing was measured";
    } catch (const std::exception& e) { check.failure = e.what(); }
    check.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    out.push_back(std::move(check));
  }
  return out;
}

bool all_ok(const std::vector<SelfCheck>& checks) {
  return std::all_of(checks.begin(), checks.end(), [](const SelfCheck& c) { return c.is_ok(); });
}

std::string to_text(const std::vector<SelfCheck>& checks) {
  size_t width = 0;
  for (const SelfCheck& c : checks)
    for (const CheckedNumber& n : c.numbers) width = std::max(width, n.what.size() + n.unit.size() + 3);
  std::string out;
  for (const SelfCheck& c : checks) {
    out += fmt::format("  {}  {} ({})\n", c.is_ok() ? "ok    " : "FAILED", c.name, c.source);
    if (!c.failure.empty()) out += fmt::format("          {}\n", c.failure);
    for (const CheckedNumber& n : c.numbers) {
      const std::string what = n.unit.empty() ? n.what : n.what + " [" + n.unit + "]";
      out += fmt::format("          {:<{}}  expected {:<13.9g} got {:<13.9g} tolerance {:<8.2g}{}\n", what, width,
                         n.expected, n.got, n.tolerance, n.is_ok() ? "" : "  <- differs");
    }
  }
  return out;
}

}  // namespace topple::apps
