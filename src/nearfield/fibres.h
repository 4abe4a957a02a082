#pragma once
/// A section as layers of concrete and rows of bars for bending about one axis; plane sections, docs/theory/rcc.md.

#include <vector>

#include "material/concrete.h"
#include "material/steel.h"
#include "nearfield/rcc.h"

namespace topple::nearfield {

/// L layers and R bar rows. Coordinates from the section's centre; positive strain gradient pulls at positive `at`.
struct Fibres {
  std::vector<double> at, core_area, cover_area;  // layers [m], [m²] (L)
  std::vector<double> bar_at, bar_area;           // rows of equal place and diameter (R)
  std::vector<material::Steel> bar_law;           // (R)
  std::vector<size_t> bar_row;                    // of each bar of the section; empty for a section at an angle
  material::Concrete core, cover;
  double half_depth = 0;  // [m]
  double lost = 0;        // at each edge: the cover that is gone [m]
  double kept = 1;        // share of the concrete that bars displace: what cuts have left
  // Places along the axis of bending, of a section at an angle only: of the layers' core and cover [m] (L), bars [m]
  // (R)
  std::vector<double> core_across, cover_across, bar_across;
};

/// Stress resultants of a plane of strains.
struct Resultants {
  double N = 0, M = 0;  // [N], [N·m], M = ∫ σ · at dA
  double dN = 0;        // ∂N/∂ε0 [N]
  double dM = 0;        // ∂M/∂ε0 = ∂N/∂κ [N·m]
  double dM_kappa = 0;  // ∂M/∂κ [N·m²]
};

/// Whether there are layers of concrete (bars then take their place in it).
bool has_concrete(const Fibres&);

enum class Axis { Y, Z };

/// The section after preparation; the concrete is what is left in `concrete`. Throws InputError.
Fibres make_fibres(const ZoneInput&, Axis);

/// The same for bending about an axis in the section at `angle` from y towards z: `at` = z cos - y sin, in strips along
/// the axis. Angle 0 bends about y; π/2 about z, where a positive curvature pulls at -y. Throws InputError.
Fibres make_fibres(const ZoneInput&, double angle);
/// Histories of the rows of bars (R); none: never loaded.
using BarStates = std::vector<material::SteelState>;

/// Moment about the axis at a right angle to the bending axis, ∫ σ across dA, of a section at an angle [N·m].
double calc_cross_moment(const Fibres&, double eps_0, double kappa, const BarStates& = {});

/// Resultants at the mean strain ε0 and the curvature κ.
Resultants calc_resultants(const Fibres&, double eps_0, double kappa, const BarStates& = {});

/// Mean strain at which the section carries N at curvature κ, searched from `eps_0` towards equilibrium, as a section
/// under a constant force would move. False: no equilibrium on that way; the section can no longer carry N.
bool find_equilibrium(const Fibres&, double N, double kappa, double& eps_0, const BarStates& = {});

/// One march at constant N from M = 0 on; from no curvature on, without a first yield, if N is carried with a moment to
/// one side only.
struct March {
  std::vector<double> moment;  // magnitude for each of the given curvatures (from the one at M = 0), 0 after the loss
  int last = -1;               // index of the last curvature that could be carried, -1: none
  double yield_kappa = 0, yield_moment = 0;
  double origin = 0;          // where it begins; curvatures count from it, in the direction of the march [1/m]
  bool is_balanced = true;    // N can be carried with M = 0
  std::vector<double> eps_0;  // mean strain at each curvature held (last + 1)
  BarStates bars;             // histories at each curvature held (last + 1 times R)

  BarStates bars_at(size_t point) const;
};
/// `kappa` rises from 0; direction +1 or -1. Bars remember what they have come through on the way, concrete does not.
March march_curvature(const Fibres&, double N, int direction, const std::vector<double>& kappa);

/// Largest compressive force at no curvature (magnitude, positive) and the strain there (magnitude).
struct Peak {
  double force = 0, strain = 0;
};
Peak find_crushing(const Fibres&);
/// Where the force is largest and smallest on the way to the crushing, in turn, by strain: the sharp hill of a cover
/// that comes off before a strongly tied core bears more, and the valley behind it. Most sections have none.
std::vector<Peak> find_hills_before(const Fibres&, const Peak& crushing);

/// Concrete of the zone after losses, before regularisation. The factor of the strength lies in (0, 1].
material::ConcreteInput make_concrete_input(const ZoneInput&);
/// Law of a bar of the zone, free between its ties. Throws InputError.
material::Steel make_bar(const ZoneInput&, double diameter);
/// Effective lateral stress of the ties on the core, docs/theory/rcc.md (5) to (7).
double calc_tie_stress(const ZoneInput&);

}  // namespace topple::nearfield
