#pragma once
/// A cantilever column under a constant vertical load, pushed sideways at its top: lateral force over drift, through
/// the peak; docs/theory/rcc.md, "Columns".

#include <vector>

#include "nearfield/fibres.h"
#include "nearfield/rcc.h"

namespace topple::nearfield {

/// Half of a storey's column between its foot and where its moment vanishes, or a cantilever.
struct ColumnInput {
  ZoneInput zone;               // `length` is that of the plastic hinge; 0: calc_hinge_length
  Axis axis = Axis::Y;          // of bending
  double height = 0;            // from the foot to the lateral force [m]
  double compression = 0;       // vertical load, positive in compression [N]
  double largest_drift = 0.05;  // displacement of the top over the height, where to stop [-]
  bool bars_slip = true;        // out of the foundation
};

/// Plastic hinge of Paulay & Priestley, 0.08 height + 0.022 f_y d_b (f_y in MPa, the thickest bar) [m].
double calc_hinge_length(const ZoneInput&, double height);

struct ColumnPoint {
  double drift = 0;        // displacement of the top over the height
  double force = 0;        // lateral [N]; may become negative
  double foot_moment = 0;  // force · height + compression · displacement [N·m]
  double kappa = 0;        // of the hinge [1/m]
  double slip = 0;         // displacement by bars that slip [m]
  double shear = 0;        // displacement by shear [m]
  double shear_limit = 0;  // Sezen & Moehle, at the displacement ductility reached [N]
};

/// Buckles: without a push already, as the load is above Euler's for the column as it deforms.
enum class ColumnEnding { ReachedDrift, LostCompression, LostMoment, Buckles };

struct ColumnEnvelope {
  std::vector<ColumnPoint> points;  // drift need not rise where the column snaps back
  double yield_drift = 0;           // first yield of the foot, (8) of docs/theory/rcc.md
  double shear_from = -1;           // drift from which the force exceeds the shear limit: a shear failure; -1: never
  double largest_force = 0;         // [N]
  ColumnEnding ending = ColumnEnding::ReachedDrift;
  bool converged = true;  // every point's displacements agree with its moments to 1e-9 of the height
};

/// Throws InputError: what make_rcc refuses, a height or load out of range, more load than the section carries.
ColumnEnvelope push_column(const ColumnInput&);

/// Lateral force when the column first passes a drift; NaN: it does not get there.
double calc_force_at(const ColumnEnvelope&, double drift);

}  // namespace topple::nearfield
