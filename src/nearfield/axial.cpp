#include "nearfield/axial.h"

#include <algorithm>
#include <cmath>

#include "nearfield/section_kernel.h"

namespace topple::nearfield {

AxialCurve make_compression(const Fibres& f, const Peak& peak, double EA, double length) {
  const PackedSection packed = pack_section(f);
  const auto force = [&](double e) { return std::max(0.0, -calc_resultants(packed, -e, 0).N); };
  const std::vector<Peak> hills = find_hills_before(f, peak);
  double low = 0, high = peak.strain;
  for (const Peak& hill : hills)
    if (hill.force >= 0.75 * peak.force) high = std::min(high, hill.strain);
  for (int i = 0; i < 50; ++i) {
    const double e = 0.5 * (low + high);
    (force(e) < 0.75 * peak.force ? low : high) = e;
  }
  AxialCurve out;
  const double start = high, offset = start - force(start) / EA;
  const auto add = [&](double e) {
    const double F = force(e), u = length * (e - F / EA - offset);
    if (!out.displacement.empty() && u <= out.displacement.back() * (1 + 1e-12) + 1e-12 * length) return;
    out.displacement.push_back(out.displacement.empty() ? 0 : u);
    out.force.push_back(F);
  };
  double from = start;
  const auto climb = [&](double to) {
    for (int i = from == start ? 0 : 1; i <= 5; ++i) add(from + (to - from) * i / 5.0);
    from = to;
  };
  for (const Peak& hill : hills)
    if (hill.strain > start) climb(hill.strain);
  climb(peak.strain);
  constexpr int points = 28;
  double x = 0.15 * peak.strain;
  const double ratio = std::pow(std::max(1.01, (1 - peak.strain) / x), 1.0 / (points - 1));
  for (int i = 0; i < points; ++i, x *= ratio) add(std::min(1.0, peak.strain + x));
  return out;
}

AxialCurve make_tension(const TensionBars& all, const material::Concrete& concrete, double area, double length) {
  const double yield = all.yield, rupture = all.rupture, cracking = area * concrete.fct;
  const double broken = length * std::max(all.plastic_strain, 1e-4);
  AxialCurve out;
  const auto add = [&](double u) {
    const double bars = u <= broken ? yield + (rupture - yield) * u / broken : 0;
    const double crack = area * material::calc_tension(concrete, concrete.eps_ct + u / length).stress;
    out.displacement.push_back(u);
    out.force.push_back(std::max(bars, crack));
  };
  add(0);
  if (cracking > yield) {
    const double opened = std::min(concrete.eps_tu * length, 0.9 * broken);
    for (double share : {0.05, 0.1, 0.2, 0.35, 0.6, 1.0}) add(share * opened);
  }
  for (double share : {0.25, 0.5, 0.75, 1.0})
    if (share * broken > out.displacement.back()) add(share * broken);
  out.displacement.push_back(1.001 * broken);
  out.force.push_back(0);
  return out;
}

}  // namespace topple::nearfield
