#include "rcc_solid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/unit.h"
#include "nearfield/moment_curve.h"
#include "nearfield/solid.h"

namespace topple::apps {

namespace {

constexpr double pi = 3.14159265358979323846;
constexpr double yield_share = 0.75;  // of the peak, as the layered route's last condition

const record::RccCurve* find_layered(const record::RccReport& r, const SolidTask& task, double N) {
  for (const record::RccCurve& c : r.curves)
    if (c.route == "layered" && c.axis == task.axis && c.direction == task.direction && c.normal_force == -N) return &c;
  return nullptr;
}

nearfield::CurvePoint find_yield(const std::vector<double>& rotation, const std::vector<double>& moment) {
  const double level = yield_share * *std::max_element(moment.begin(), moment.end());
  for (size_t j = 1; j < rotation.size(); ++j) {
    if (moment[j] < level) continue;
    const double s = (level - moment[j - 1]) / (moment[j] - moment[j - 1]);
    return {rotation[j - 1] + s * (rotation[j] - rotation[j - 1]), level};
  }
  return {};
}

record::RccPoint to_record(const nearfield::CurvePoint& p) { return {p.rotation, p.moment}; }

record::RccCurve to_curve(const nearfield::SolidMarch& march, const SolidTask& task, double N, double length,
                          double EI) {
  record::RccCurve c;
  c.route = "solid", c.axis = task.axis, c.direction = task.direction, c.normal_force = -N;
  c.stiffness_uncracked = EI;
  c.ending = march.ending;
  if (march.complete && !march.rotation.empty())
    c.ending = march.moment.back() > 0 ? fmt::format("computed up to {:.3g} rad", march.rotation.back())
                                       : fmt::format("no moment is left beyond {:.4g} rad", march.rotation.back());
  if (march.rotation.size() < 2) return c;
  c.rotation = march.rotation, c.moment = march.moment;
  for (double& m : c.moment) m = std::max(0.0, m);
  c.end = {c.rotation.back(), c.moment.back()};
  const double largest = *std::max_element(c.moment.begin(), c.moment.end());
  constexpr double falls = 0.97;  // of the largest moment: from there on it counts as a peak
  if (c.moment.back() > falls * largest) {
    c.ending += fmt::format("; largest moment up to there {:.4g} kNm", largest / unit::kNm);
    return c;
  }
  const nearfield::CurvePoint yield = find_yield(c.rotation, c.moment);
  const nearfield::CurvePoints p = nearfield::find_points(c.rotation, c.moment, yield);
  c.yield = to_record(p.yield), c.peak = to_record(p.peak);
  // behind a march that stopped early nothing is known
  const bool fell = c.moment.back() <= 0.8 * p.peak.moment;
  if (fell) c.ultimate = to_record(p.ultimate);
  if (fell && (c.moment.back() <= 0 || p.residual.rotation >= 2 * p.ultimate.rotation))
    c.residual = to_record(p.residual);
  if (yield.rotation > 0) c.stiffness_effective = yield.moment / yield.rotation * length;
  return c;
}

/// Ends of cells from their rising middles, the first one at `from`.
std::map<double, std::pair<double, double>> find_cells(std::vector<double> middles, double from) {
  std::sort(middles.begin(), middles.end());
  std::map<double, std::pair<double, double>> out;
  double edge = from;
  for (const double m : middles) {
    if (!out.empty() && m - out.rbegin()->first < 1e-9) continue;
    const double to = 2 * m - edge;
    out[m] = {edge, to};
    edge = to;
  }
  return out;
}

/// The cell of a middle that is off by round-off.
std::pair<double, double> cell_at(const std::map<double, std::pair<double, double>>& cells, double middle) {
  auto at = cells.lower_bound(middle - 1e-6);
  return at == cells.end() ? std::prev(at)->second : at->second;
}

record::RccSolidState to_state(const nearfield::ZoneInput& in, const nearfield::SolidMarch& march,
                               const nearfield::SolidState& s, const SolidTask& task, double N) {
  record::RccSolidState out;
  out.axis = task.axis, out.direction = task.direction, out.normal_force = -N;
  out.rotation = s.rotation, out.moment = s.moment, out.cut_at = s.cut_at;
  out.cut_normal_force = -s.cut_force.x;
  std::vector<double> ys, zs;
  for (const auto& p : s.cut) ys.push_back(p.y), zs.push_back(p.z);
  const auto y_cells = find_cells(ys, -0.5 * in.section.width), z_cells = find_cells(zs, -0.5 * in.section.height);
  for (const auto& p : s.cut) {
    const auto [y0, y1] = cell_at(y_cells, p.y);
    const auto [z0, z1] = cell_at(z_cells, p.z);
    out.cut.push_back({y0, y1, z0, z1, p.stress});
  }
  for (const auto& b : s.bars) out.bars.push_back({b.y, b.z, b.stress, b.strain});
  // seen from the side: the worst element across the breadth
  std::map<std::pair<long, long>, record::RccSolidState::SideCell> side;
  constexpr double grain = 1e-6;  // [m]
  for (size_t h = 0; h < march.mesh.hexes.size(); ++h) {
    double low_x = 1e9, high_x = -1e9, low_a = 1e9, high_a = -1e9;
    for (const int n : march.mesh.hexes[h].node) {
      const Vec3& p = march.mesh.nodes[static_cast<size_t>(n)];
      const double a = task.axis == 'y' ? p.z : p.y;
      low_x = std::min(low_x, p.x), high_x = std::max(high_x, p.x);
      low_a = std::min(low_a, a), high_a = std::max(high_a, a);
    }
    auto& cell = side[{std::lround(low_x / grain), std::lround(low_a / grain)}];
    cell.x_from = low_x, cell.x_to = high_x, cell.a_from = low_a, cell.a_to = high_a;
    cell.crack_width = std::max(cell.crack_width, s.crack_width[h]);
    cell.crushing = std::max(cell.crushing, s.crushing[h]);
  }
  for (const auto& [at, cell] : side) out.side.push_back(cell);
  return out;
}

}  // namespace

SolidOutcome add_solid_route(const nearfield::ZoneInput& in, const SolidTask& task, record::RccReport& r,
                             const std::atomic<bool>& cancel,
                             const std::function<void(const std::string&, double, double)>& show) {
  SolidOutcome out;
  const double EI = task.axis == 'y' ? r.EI_y : r.EI_z;
  const double angle = task.axis == 'y' ? 0 : 0.5 * pi;
  const double count = static_cast<double>(task.normal_forces.size());
  r.fc = in.concrete.fc, r.fct = in.concrete.fct;
  for (size_t i = 0; i < task.normal_forces.size(); ++i) {
    const double N = task.normal_forces[i];
    const std::string name = fmt::format("N = {:.4g} MN", -N / unit::MN);
    const record::RccCurve* layered = find_layered(r, task, N);
    nearfield::SolidOptions options;
    options.element_size = task.element_size;
    options.threads = task.threads;
    options.largest_rotation = task.largest_rotation;
    if (!(options.largest_rotation > 0)) {
      constexpr double without_guide = 0.02;  // where the layered route has no curve [rad]
      options.largest_rotation =
          layered && std::isfinite(layered->residual.rotation) ? layered->residual.rotation : without_guide;
    }
    if (layered)
      for (const record::RccPoint& p : {layered->yield, layered->peak, layered->ultimate})
        if (p.rotation <= options.largest_rotation) options.pictures.push_back(p.rotation);
    if (options.pictures.empty()) options.pictures.push_back(0.999 * options.largest_rotation);
    Progress progress;
    progress.cancel = &cancel;
    progress.report = [&](double done, double whole) {
      if (whole > 0)
        show(fmt::format("solid route, {} ({} of {})", name, i + 1, task.normal_forces.size()),
             static_cast<double>(i) + done / whole, count);
    };
    const nearfield::SolidMarch march = nearfield::march_solid(in, N, angle, task.direction, options, progress);
    if (cancel.load(std::memory_order_relaxed)) {
      out.cancelled = true;
      return out;
    }
    record::RccCurve curve = to_curve(march, task, N, in.length, EI);
    if (!march.complete) out.failures.push_back(fmt::format("solid route, {}: {}", name, march.ending));
    r.solid_notes.push_back(fmt::format("Solid route, {}: {} degrees of freedom, {} steps, {} iterations; {}.", name,
                                        march.degrees_of_freedom, march.steps, march.iterations,
                                        march.complete ? "complete" : march.ending));
    r.curves.push_back(std::move(curve));
    for (const nearfield::SolidState& s : march.states) r.solid_states.push_back(to_state(in, march, s, task, N));
  }
  return out;
}

}  // namespace topple::apps
