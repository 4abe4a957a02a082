#include "nearfield/moment_curve.h"

#include <algorithm>
#include <cmath>

namespace topple::nearfield {

namespace {

/// Side of the fibres that a rotation of the member pulls.
int side_of(Axis axis, int direction) { return axis == Axis::Y ? direction : -direction; }

/// Largest strain of a bar over its strain at rupture.
double calc_tearing(const Fibres& f, double eps_0, double kappa) {
  double share = 0;
  for (size_t i = 0; i < f.bar_at.size(); ++i)
    if (f.bar_area[i] > 0) share = std::max(share, (eps_0 + kappa * f.bar_at[i]) / f.bar_law[i].eps_u);
  return share;
}

ConcreteCondition judge(const material::Concrete& c, double strain, double stress) {
  if (strain >= 0) {
    if (!(c.fct > 0)) return strain > 0 ? ConcreteCondition::Open : ConcreteCondition::Uncracked;
    if (strain <= c.eps_ct) return ConcreteCondition::Uncracked;
    return stress <= 0.01 * c.fct ? ConcreteCondition::Open : ConcreteCondition::Cracked;
  }
  if (-strain <= c.eps_c1) return ConcreteCondition::Compressed;
  return -stress < 0.2 * c.fc ? ConcreteCondition::Crushed : ConcreteCondition::Crushing;
}

BarCondition judge(const material::Steel& s, const material::SteelState& state, double strain) {
  if (state.ruptured || strain > s.eps_u) return BarCondition::Torn;
  const double trial = s.Es * (strain - state.plastic) - state.back, flows = s.fy * (1 - 1e-9);
  if (trial > flows) return BarCondition::YieldsInTension;
  const bool shortened = -strain > std::min(s.eps_star, s.buckling_stress / s.Es);
  if (shortened && trial < 0) return BarCondition::Buckled;
  if (trial < -flows) return BarCondition::YieldsInCompression;
  return state.plastic == 0 ? BarCondition::Elastic : BarCondition::Yielded;
}

}  // namespace

std::vector<double> refine_rotations(const MomentFamily& family, int parts) {
  std::vector<double> out{0};
  for (size_t j = 1; j < family.rotation.size(); ++j) {
    const double from = family.rotation[j - 1], to = family.rotation[j];
    for (int i = 1; i < parts; ++i) out.push_back(from + (to - from) * i / parts);
    out.push_back(to);
  }
  return out;
}

MomentCurve make_moment_curve(const Fibres& fibres, Axis axis, double N, int direction, double length,
                              const std::vector<double>& rotation) {
  MomentCurve out;
  out.axis = axis, out.direction = direction, out.N = N, out.length = length;
  const int side = side_of(axis, direction);
  std::vector<double> kappa(rotation);
  for (double& k : kappa) k /= length;
  const March march = march_curvature(fibres, N, side, kappa);
  if (march.last < 0) {
    out.loses_force = true;
    return out;
  }
  out.is_balanced = march.is_balanced;
  const BarStates none;
  const size_t held = static_cast<size_t>(march.last) + 1;
  for (size_t j = 0; j < held; ++j) {
    out.rotation.push_back(rotation[j]);
    out.moment.push_back(march.moment[j]);
    out.eps_0.push_back(march.eps_0[j]);
    out.kappa.push_back(march.origin + side * kappa[j]);
    out.bars.push_back(march.bars_at(j));
  }
  if (!out.is_balanced)
    out.moment.front() = std::max(0.0, side * calc_resultants(fibres, march.eps_0.front(), march.origin, none).M);
  out.yield_rotation = march.yield_kappa * length;
  out.yield_moment = march.yield_moment;
  out.loses_force = held < rotation.size();
  if (out.loses_force) {  // the last equilibrium lies between two rotations of the grid
    double low = out.rotation.back(), high = rotation[held], eps_0 = out.eps_0.back();
    BarStates bars = out.bars.back();
    while (high - low > 1e-3 * high) {
      const double middle = 0.5 * (low + high), k = march.origin + side * middle / length;
      double e = eps_0;
      if (!find_equilibrium(fibres, N, k, e, bars)) {
        high = middle;
        continue;
      }
      low = middle, eps_0 = e;
    }
    if (low > out.rotation.back()) {
      const double k = march.origin + side * low / length;
      out.rotation.push_back(low);
      out.moment.push_back(std::max(0.0, side * calc_resultants(fibres, eps_0, k, bars).M));
      out.eps_0.push_back(eps_0);
      out.kappa.push_back(k);
      out.bars.push_back(bars);
    }
  }
  out.carried_to = out.rotation.back();
  const size_t peak = static_cast<size_t>(std::max_element(out.moment.begin(), out.moment.end()) - out.moment.begin());
  for (size_t j = peak + 1; j < out.rotation.size(); ++j) {
    if (out.moment[j] > 0) continue;
    for (auto* list : {&out.rotation, &out.moment, &out.eps_0, &out.kappa}) list->resize(j + 1);
    out.bars.resize(j + 1);
    break;
  }
  for (size_t j = 1; j < out.rotation.size(); ++j) {
    const double before = calc_tearing(fibres, out.eps_0[j - 1], out.kappa[j - 1]);
    const double after = calc_tearing(fibres, out.eps_0[j], out.kappa[j]);
    if (after <= 1) continue;
    const double s = after > before ? std::clamp((1 - before) / (after - before), 0.0, 1.0) : 0;
    out.first_torn = {out.rotation[j - 1] + s * (out.rotation[j] - out.rotation[j - 1]), 0};
    // the last equilibrium with all bars
    double low = out.rotation[j - 1], high = out.rotation[j], eps_0 = out.eps_0[j - 1];
    out.first_torn.moment = out.moment[j - 1];
    out.torn = {eps_0, out.kappa[j - 1], j - 1};
    const double origin = out.kappa[j - 1] - side * low / length;
    while (high - low > 1e-4 * high) {
      const double middle = 0.5 * (low + high), k = origin + side * middle / length;
      BarStates bars = out.bars[j - 1];
      double e = eps_0;
      if (!find_equilibrium(fibres, N, k, e, bars) || calc_tearing(fibres, e, k) > 1) {
        high = middle;
        continue;
      }
      low = middle, eps_0 = e;
      out.first_torn = {low, std::max(0.0, side * calc_resultants(fibres, e, k, bars).M)};
      out.torn = {e, k, j - 1};
    }
    break;
  }
  return out;
}

CurvePoints find_points(const std::vector<double>& rotation, const std::vector<double>& moment, CurvePoint yield,
                        CurvePoint first_torn) {
  CurvePoints out;
  if (rotation.empty()) return out;
  size_t top = static_cast<size_t>(std::max_element(moment.begin(), moment.end()) - moment.begin());
  if (!(moment[top] > 0)) return out;
  out.yield = yield;
  out.peak = {rotation[top], moment[top]};
  if (first_torn.rotation <= rotation.back() && first_torn.moment > moment[top]) {
    out.peak = first_torn;
    const auto behind = std::upper_bound(rotation.begin(), rotation.end(), first_torn.rotation);
    top = static_cast<size_t>(behind - rotation.begin()) - 1;
  }
  const auto at = [&](double phi) {
    const auto above = std::lower_bound(rotation.begin(), rotation.end(), phi);
    if (above == rotation.end()) return moment.back();
    const size_t j = static_cast<size_t>(above - rotation.begin());
    if (j == 0) return moment.front();
    const double s = (phi - rotation[j - 1]) / (rotation[j] - rotation[j - 1]);
    return moment[j - 1] + s * (moment[j] - moment[j - 1]);
  };
  double end = rotation.back(), left = moment.back();
  const double level = 0.8 * out.peak.moment;
  for (size_t j = top + 1; j < rotation.size(); ++j) {
    const CurvePoint before{rotation[j - 1], moment[j - 1]};
    CurvePoint after{rotation[j], moment[j]};
    // where a bar tears the moment drops at once: what the section bears until then is not on the line between
    const bool tears = first_torn.rotation >= before.rotation && first_torn.rotation <= after.rotation;
    if (tears) after = first_torn;
    if (after.moment <= level && after.moment < before.moment) {
      end = before.rotation +
            (before.moment - level) / (before.moment - after.moment) * (after.rotation - before.rotation);
      left = level;
      break;
    }
    if (tears) {
      end = first_torn.rotation, left = first_torn.moment;
      break;
    }
  }
  out.ultimate = {end, left};
  const double last = std::min(rotation.back(), 2 * end);
  out.residual = {last, at(last)};
  return out;
}

CurvePoints find_points(const MomentCurve& c) {
  return find_points(c.rotation, c.moment, {c.yield_rotation, c.yield_moment}, c.first_torn);
}

bool has_yield(const MomentCurve& c, const CurvePoints& p) {
  constexpr double none = 1e-6;  // of the peak's rotation: the force alone makes the bars yield
  return c.is_balanced && p.yield.rotation > none * p.peak.rotation;
}

Interaction make_interaction(const Fibres& fibres, Axis axis, int direction, const MomentFamily& family, double length,
                             int count) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  Interaction out;
  const int side = side_of(axis, direction);
  const std::vector<double> rotation = refine_rotations(family, 4);
  const double low = family.normal_force.front(), high = family.normal_force.back();
  for (int i = 0; i < count; ++i) {
    const bool is_end = i == 0 || i + 1 == count;
    constexpr double inside = 1e-6;  // of the force: where both ends are carried still
    const double N = low + (high - low) * i / (count - 1);
    const MomentCurve curve =
        make_moment_curve(fibres, axis, is_end ? (1 - inside) * N : N, direction, length, rotation);
    out.normal_force.push_back(N);
    if (curve.is_balanced && is_end) {
      out.yield_moment.push_back(0), out.peak_moment.push_back(0);
    } else if (curve.is_balanced) {
      const CurvePoints points = find_points(curve);
      out.yield_moment.push_back(has_yield(curve, points) ? curve.yield_moment : nan);
      out.peak_moment.push_back(std::isfinite(points.peak.moment) ? points.peak.moment : 0);
    } else {  // the march begins with a moment, which may have the other sign
      out.yield_moment.push_back(nan);
      double most = -std::numeric_limits<double>::infinity();
      for (size_t j = 0; j < curve.eps_0.size() && (j == 0 || !is_end); ++j)
        most = std::max(most, side * calc_resultants(fibres, curve.eps_0[j], curve.kappa[j], curve.bars[j]).M);
      out.peak_moment.push_back(most);
    }
  }
  // an end has no yield where the force beside it has none
  if (count > 2) {
    std::vector<double>& yield = out.yield_moment;
    if (std::isnan(yield[1])) yield.front() = nan;
    if (std::isnan(yield[yield.size() - 2])) yield.back() = nan;
  }
  return out;
}

SectionState make_section_state(const ZoneInput& in, const Fibres& fibres, Axis axis, double eps_0, double kappa,
                                const BarStates& bars) {
  SectionState out;
  out.eps_0 = eps_0, out.kappa = kappa;
  const product::Section& s = in.section;
  const double breadth = axis == Axis::Y ? s.width : s.height;
  const double core_breadth = std::max(0.0, breadth - 2 * (s.cover + 0.5 * s.tie_diameter));
  double edge = fibres.at.empty() ? 0 : -fibres.half_depth;
  if (!fibres.at.empty() && in.cover_lost) edge = fibres.at.front() - 0.5 * (fibres.at[1] - fibres.at[0]);
  for (size_t i = 0; i < fibres.at.size(); ++i) {
    SectionState::Layer layer;
    layer.from = edge;
    layer.to = edge = 2 * fibres.at[i] - layer.from;
    layer.core_breadth = fibres.core_area[i] > 0 ? core_breadth : 0;
    layer.cover_breadth = fibres.cover_area[i] > 0 ? breadth - layer.core_breadth : 0;
    if (axis == Axis::Y && in.flange.breadth > 0 && layer.cover_breadth > 0)
      layer.cover_breadth = fibres.cover_area[i] / ((1 - in.cut_concrete) * (layer.to - layer.from));
    layer.strain = eps_0 + kappa * fibres.at[i];
    layer.core_stress = material::calc_envelope(fibres.core, layer.strain).stress;
    layer.cover_stress = material::calc_envelope(fibres.cover, layer.strain).stress;
    layer.core = judge(fibres.core, layer.strain, layer.core_stress);
    layer.cover = judge(fibres.cover, layer.strain, layer.cover_stress);
    out.layers.push_back(layer);
  }
  for (size_t i = 0; i < s.bars.size(); ++i) {
    const product::Bar& bar = s.bars[i];
    SectionState::BarState b;
    b.y = bar.y, b.z = bar.z, b.diameter = bar.diameter;
    const size_t row = fibres.bar_row[i];
    b.strain = eps_0 + kappa * fibres.bar_at[row];
    const material::SteelState state = bars.empty() ? material::SteelState{} : bars[row];
    b.stress = material::calc_response(fibres.bar_law[row], state, b.strain).stress;
    b.condition = judge(fibres.bar_law[row], state, b.strain);
    out.bars.push_back(b);
  }
  return out;
}

const char* name_of(ConcreteCondition c) {
  switch (c) {
    case ConcreteCondition::Uncracked:
      return "uncracked";
    case ConcreteCondition::Cracked:
      return "cracked";
    case ConcreteCondition::Open:
      return "open crack";
    case ConcreteCondition::Compressed:
      return "compressed";
    case ConcreteCondition::Crushing:
      return "crushing";
    case ConcreteCondition::Crushed:
      return "crushed";
  }
  return "";
}

const char* name_of(BarCondition c) {
  switch (c) {
    case BarCondition::Elastic:
      return "elastic";
    case BarCondition::YieldsInTension:
      return "yields in tension";
    case BarCondition::YieldsInCompression:
      return "yields in compression";
    case BarCondition::Yielded:
      return "has yielded";
    case BarCondition::Buckled:
      return "buckled";
    case BarCondition::Torn:
      return "torn";
  }
  return "";
}

}  // namespace topple::nearfield
