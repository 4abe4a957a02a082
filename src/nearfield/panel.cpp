#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/unit.h"
#include "nearfield/rcc.h"

namespace topple::nearfield {

PanelRcc make_panel_rcc(const product::Panel& panel, const product::Concrete* concrete, const product::Steel* steel) {
  const double t = panel.thickness;
  if (!(t > 0)) throw InputError("E614", "panel '" + panel.name + "': thickness must be positive");
  const double fc = concrete ? concrete->fc : panel.strength, E = concrete ? concrete->Ec : panel.modulus;
  if (!(fc > 0) || !(E > 0))
    throw InputError("E614", "panel '" + panel.name + "': strength and modulus must be positive");
  // Masonry: bed joints open at a few hundredths of the strength, and give little energy; docs/theory/rcc.md (24).
  const double ft = concrete ? concrete->fct : std::min(0.04 * fc, 0.3 * unit::MPa);
  const double Gf = concrete ? concrete->Gf : 10.0;
  const double top = steel ? panel.as_top : 0, bottom = steel ? panel.as_bottom : 0;
  if (!(top >= 0) || !(bottom >= 0))
    throw InputError("E614", "panel '" + panel.name + "': reinforcement must not be negative");
  const double fy = steel ? steel->fy : 0, fu = steel ? steel->fu : 0, Es = steel ? steel->Es : 0;
  const double both = top + bottom;

  PanelRcc out;
  const double cracking = ft * t * t / 6;
  const double d = t - panel.cover;
  if (both > 0 && !(d > 0.5 * t)) throw InputError("E614", "panel '" + panel.name + "': the cover exceeds half of it");
  const auto moment = [&](double as) {
    if (!(as > 0)) return cracking;
    const double block = std::min(as * fy / (0.85 * fc), d);
    return std::max(cracking, as * fy * (d - 0.5 * block));
  };
  out.moment_pos = moment(bottom);
  out.moment_neg = moment(top);
  out.EA = E * t;
  out.compression = fc * t + both * fy;
  out.tension = std::max(both * fu, ft * t);
  out.shear_in_plane = concrete ? 0.25 * std::sqrt(fc / unit::MPa) * unit::MPa * t + both * fy
                                : std::min(0.3 * unit::MPa, 0.06 * fc) * t;
  out.EI = E * t * t * t / 12;
  out.ultimate_rotation = ft > 0 ? 5.14 * Gf / ft / t : 1e-4;
  out.elongation_at_rupture = ft > 0 ? 5.14 * Gf / ft : 1e-4 * t;
  if (both > 0) {
    // One layer counts for the stiffness: the weaker one that there is.
    const double as = std::min(top, bottom) > 0 ? std::min(top, bottom) : both;
    const double n = Es / E;
    const double x = n * as * (std::sqrt(1 + 2 * d / (n * as)) - 1);
    // bars that bear less than the concrete does before it cracks leave the panel uncracked up to its resistance
    const double by_bars = as * fy * (d - 0.5 * std::min(as * fy / (0.85 * fc), d));
    if (by_bars > cracking) out.EI = std::min(out.EI, E * (x * x * x / 3 + n * as * (d - x) * (d - x)));
    const double block = std::min(as * fu / (0.85 * fc * 0.8), 0.5 * d);
    out.ultimate_rotation = steel->eps_u / (d - block) * t;
    out.elongation_at_rupture = steel->eps_u * t;
  }
  const double ratio = both > 0 ? std::min(0.02, 0.5 * both / d) : 0;
  const double depth = both > 0 ? d : t, size = 1 + std::min(1.0, std::sqrt(0.2 / depth));
  const double least = 0.035 * std::pow(size, 1.5) * std::sqrt(fc / unit::MPa);
  out.shear_out_of_plane =
      concrete ? std::max(0.2 * size * std::cbrt(100 * ratio * fc / unit::MPa), least) * unit::MPa * depth
               : std::min(0.3 * unit::MPa, 0.06 * fc) * t;
  return out;
}

}  // namespace topple::nearfield
