#pragma once
/// A section with history: cells of concrete and bars that remember what they went through, for cyclic bending about
/// both axes; docs/theory/rcc.md, "Histories".

#include <vector>

#include "nearfield/fibres.h"
#include "nearfield/rcc.h"

namespace topple::nearfield {

/// C cells of concrete (those with a negative area are what bars displace) and R bars. Places from the section's
/// centre. Constant; what changes is the state.
struct FibreGrid {
  struct Cell {
    double y = 0, z = 0, area = 0;  // [m], [m²]
    bool is_core = false;
  };
  struct Bar {
    double y = 0, z = 0, area = 0;  // [m], [m²]
    material::Steel law;
  };
  std::vector<Cell> cell;  // (C)
  std::vector<Bar> bar;    // (R)
  material::Concrete core, cover;
  double half_height = 0, half_width = 0;  // along z, along y [m]
};

/// `across` cells of core in each direction, and two of cover on each side. Throws InputError as make_rcc.
FibreGrid make_fibre_grid(const ZoneInput&, int across = 20);

struct FibreState {
  std::vector<material::ConcreteState> cell;  // (C)
  std::vector<material::SteelState> bar;      // (R)
};
FibreState make_fibre_state(const FibreGrid&);

/// Resultants of the strains ε = ε0 + κ_y z - κ_z y and their derivatives: rows N, M_y, M_z; columns ε0, κ_y, κ_z.
struct SectionForces {
  double N = 0, M_y = 0, M_z = 0;  // [N], [N·m]
  double tangent[3][3] = {};
};

/// Goes to a plane of strains; the state moves on.
SectionForces advance_section(const FibreGrid&, FibreState&, double eps_0, double kappa_y, double kappa_z);

/// Goes to two curvatures at the normal force N, ε0 searched from its last value as in find_equilibrium. False, with
/// the state as it was: the section can no longer carry N there.
[[nodiscard]] bool advance_section_at(const FibreGrid&, FibreState&, double N, double kappa_y, double kappa_z,
                                      double& eps_0, SectionForces&);

}  // namespace topple::nearfield
