#include "nearfield/history.h"

#include <algorithm>
#include <cmath>

#include "nearfield/zone.h"

namespace topple::nearfield {

namespace {

/// Edges of the cells along one direction: cover, core, cover.
std::vector<double> make_edges(double half, double half_core, int across) {
  std::vector<double> out;
  const auto add = [&](double from, double to, int n) {
    for (int i = 0; i < n; ++i) out.push_back(from + (to - from) * i / n);
  };
  const bool has_core = half_core > 0 && half_core < half;
  if (has_core) add(-half, -half_core, 2);
  add(has_core ? -half_core : -half, has_core ? half_core : half, across);
  if (has_core) add(half_core, half, 2);
  out.push_back(half);
  return out;
}

}  // namespace

FibreGrid make_fibre_grid(const ZoneInput& in, int across) {
  check_zone(in);
  const product::Section& s = in.section;
  FibreGrid out;
  const Fibres f = make_fibres(in, Axis::Y);  // the same materials
  out.core = f.core, out.cover = f.cover;
  out.half_width = 0.5 * s.width, out.half_height = 0.5 * s.height;
  const double edge = s.cover + 0.5 * s.tie_diameter;
  const double core_width = out.half_width - edge, core_height = out.half_height - edge;
  const bool has_core = core_width > 0 && core_height > 0;
  const double kept = in.concrete_loss >= 1 ? 0 : 1 - in.cut_concrete, cover_kept = in.cover_lost ? 0 : kept;
  const std::vector<double> y = make_edges(out.half_width, has_core ? core_width : 0, across);
  const std::vector<double> z = make_edges(out.half_height, has_core ? core_height : 0, across);
  for (size_t i = 0; i + 1 < y.size(); ++i)
    for (size_t j = 0; j + 1 < z.size(); ++j) {
      FibreGrid::Cell c{0.5 * (y[i] + y[i + 1]), 0.5 * (z[j] + z[j + 1]), 0, false};
      c.is_core = has_core && std::abs(c.y) < core_width && std::abs(c.z) < core_height;
      c.area = (c.is_core ? kept : cover_kept) * (y[i + 1] - y[i]) * (z[j + 1] - z[j]);
      if (c.area > 0) out.cell.push_back(c);
    }
  const bool displaces = has_concrete(f);
  for (const product::Bar& b : s.bars) {
    const double area = (1 - in.cut_bars) * b.area;
    if (!(area > 0)) continue;
    out.bar.push_back({b.y, b.z, area, make_bar(in, b.diameter)});
    if (displaces) out.cell.push_back({b.y, b.z, -kept * area, true});
  }
  return out;
}

FibreState make_fibre_state(const FibreGrid& g) {
  FibreState s;
  s.cell.resize(g.cell.size()), s.bar.resize(g.bar.size());
  return s;
}

SectionForces advance_section(const FibreGrid& g, FibreState& state, double eps_0, double kappa_y, double kappa_z) {
  SectionForces out;
  const auto add = [&](double y, double z, double force, double stiffness) {
    const double lever[3] = {1, z, -y};
    out.N += force, out.M_y += force * z, out.M_z -= force * y;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) out.tangent[i][j] += stiffness * lever[i] * lever[j];
  };
  for (size_t i = 0; i < g.cell.size(); ++i) {
    const FibreGrid::Cell& c = g.cell[i];
    const material::Response r =
        material::advance(c.is_core ? g.core : g.cover, state.cell[i], eps_0 + kappa_y * c.z - kappa_z * c.y);
    add(c.y, c.z, c.area * r.stress, c.area * r.tangent);
  }
  for (size_t i = 0; i < g.bar.size(); ++i) {
    const FibreGrid::Bar& b = g.bar[i];
    const material::SteelResponse r = material::advance(b.law, state.bar[i], eps_0 + kappa_y * b.z - kappa_z * b.y);
    add(b.y, b.z, b.area * r.stress, b.area * r.tangent);
  }
  return out;
}

bool advance_section_at(const FibreGrid& g, FibreState& state, double N, double kappa_y, double kappa_z, double& eps_0,
                        SectionForces& forces) {
  double scale = 0;
  for (const FibreGrid::Cell& c : g.cell) scale += c.area * (c.is_core ? g.core.fc : g.cover.fc);
  for (const FibreGrid::Bar& b : g.bar) scale += b.area * b.law.fy;
  const double tolerance = 1e-8 * scale;
  FibreState trial;
  const auto at = [&](double e) {
    trial = state;
    return advance_section(g, trial, e, kappa_y, kappa_z);
  };
  const auto accept = [&](double e, const SectionForces& f) {
    eps_0 = e, forces = f, state = trial;
    return true;
  };
  // Towards equilibrium until it is passed, then Newton within the bracket.
  constexpr double largest_strain = 0.6, largest_step = 1e-3;
  double e = eps_0, other = e, step = 0;
  SectionForces f = at(e);
  if (std::abs(f.N - N) <= tolerance) return accept(e, f);
  const double direction = f.N > N ? -1 : 1;
  for (int i = 0; (f.N - N) * direction < 0; ++i) {
    const double newton = f.tangent[0][0] > 0 ? std::abs(f.N - N) / f.tangent[0][0] : largest_step;
    step = std::min(std::max(1.02 * newton, 1.5 * step), largest_step * (1 + 0.2 * i));
    other = e, e += direction * step;
    if (std::abs(e) > largest_strain || i > 600) return false;
    f = at(e);
    if (std::abs(f.N - N) <= tolerance) return accept(e, f);
  }
  double low = std::min(e, other), high = std::max(e, other);
  for (int i = 0; i < 100 && high - low > 1e-15; ++i) {
    const double slope = f.tangent[0][0];
    double next = slope > 0 ? e - (f.N - N) / slope : low - 1;
    if (!(next > low && next < high) || i % 5 == 4) next = 0.5 * (low + high);
    e = next, f = at(e);
    if (std::abs(f.N - N) <= tolerance) return accept(e, f);
    (f.N > N ? high : low) = e;
  }
  return false;
}

}  // namespace topple::nearfield
