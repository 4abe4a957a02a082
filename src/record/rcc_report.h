#pragma once
/// What `topple rcc` leaves behind: curves of a zone and what is read off them, and its files (docs/rcc.md).
/// Here normal forces count positive in COMPRESSION, as people type them; strains and stresses positive in tension.

#include <limits>
#include <string>
#include <vector>

#include "record/record.h"

namespace topple::record {

struct RccPoint {
  double rotation = std::numeric_limits<double>::quiet_NaN();  // [rad]
  double moment = std::numeric_limits<double>::quiet_NaN();    // [N·m]
};

/// One curve M(φ) at a constant normal force. J points; none: the section cannot carry the force.
struct RccCurve {
  std::string route = "layered";  // or "solid"
  char axis = 'y';
  int direction = 1;
  double normal_force = 0;               // [N]
  std::vector<double> rotation, moment;  // magnitudes [rad], [N·m] (J)
  RccPoint yield, peak, ultimate, residual, end;
  double stiffness_uncracked = 0;                                         // EI [N·m²]
  double stiffness_effective = std::numeric_limits<double>::quiet_NaN();  // to first yield; none: no yield [N·m²]
  std::string ending;                                                     // a sentence
};

/// Resistance over the normal force; K forces. A peak below 0: N is carried only with a moment to the other side, at
/// least this one; such forces have no yield (NaN).
struct RccInteraction {
  std::string route = "layered";
  char axis = 'y';
  int direction = 1;
  std::vector<double> normal_force;               // rising [N] (K)
  std::vector<double> yield_moment, peak_moment;  // [N·m] (K)
};

/// Largest moments about y and z when the zone turns about an oblique axis, positive directions, from a moment about y
/// alone to one about z alone (which may not be there). P points.
struct RccBiaxial {
  double normal_force = 0;                 // [N]
  std::vector<double> moment_y, moment_z;  // [N·m] (P)
};

/// Force against the zone's shortening, elongation negative; no bending.
struct RccAxial {
  std::string route = "layered";
  std::vector<double> shortening, normal_force;  // rising [m], [N]
};

/// The section at one point of a curve.
struct RccState {
  std::string point;  // "yield", "peak", "ultimate"
  char axis = 'y';
  int direction = 1;
  double normal_force = 0, rotation = 0, moment = 0, eps_0 = 0, curvature = 0;
  struct Layer {
    double from = 0, to = 0, core_breadth = 0, cover_breadth = 0;  // along the strain gradient and across it [m]
    double strain = 0, core_stress = 0, cover_stress = 0;          // [-], [Pa]
    std::string core, cover;                                       // conditions in words
  };
  struct Bar {
    double y = 0, z = 0, diameter = 0, strain = 0, stress = 0;  // [m], [-], [Pa]
    std::string condition;
  };
  std::vector<Layer> layers;
  std::vector<Bar> bars;
};

/// The zone on the solid route at one rotation.
struct RccSolidState {
  char axis = 'y';
  int direction = 1;
  double normal_force = 0, rotation = 0, moment = 0;
  double cut_at = 0;            // place of the cut along the zone [m]
  double cut_normal_force = 0;  // integrated over the cut [N]
  struct CutCell {
    double y_from = 0, y_to = 0, z_from = 0, z_to = 0;  // [m]
    double stress = 0;                                  // [Pa]
  };
  struct Bar {
    double y = 0, z = 0, stress = 0, strain = 0;
  };
  /// Seen along the axis of bending; the worst across the breadth. a is z for bending about y, y for bending about z.
  struct SideCell {
    double x_from = 0, x_to = 0, a_from = 0, a_to = 0;  // [m]
    double crack_width = 0;                             // [m]
    double crushing = 0;                                // share of the strength lost
  };
  std::vector<CutCell> cut;
  std::vector<Bar> bars;
  std::vector<SideCell> side;
};

/// The family of make_rcc as it goes into the multibody system.
struct RccFamily {
  char axis = 'y';
  int direction = 1;
  std::vector<double> normal_force, rotation, moment;  // rising [N] (K), [rad] (J), [N·m] (K x J)
};

struct RccReport {
  std::string title, source, sha256, program_version;  // of the input file
  std::string zone;                                    // what is computed, in words
  double width = 0, height = 0, length = 0;            // of the section and of the zone [m]
  std::vector<KeyValue> inputs;
  std::vector<RccCurve> curves;
  std::vector<RccInteraction> interactions;
  std::vector<RccBiaxial> biaxial;
  double biaxial_exponent = std::numeric_limits<double>::quiet_NaN();  // of the power law that fits these points
  std::vector<RccAxial> axial;
  std::vector<RccState> states;
  std::vector<RccSolidState> solid_states;
  std::vector<std::string> solid_notes;
  double fc = 0, fct = 0;  // scales of the solid route's pictures [Pa]
  std::vector<RccFamily> families;
  double EA = 0, EI_y = 0, EI_z = 0, GA = 0, GJ = 0;                 // [N], [N·m²], [N], [N·m²]
  double shear_y = 0, shear_z = 0, shear_friction = 0, torsion = 0;  // [N], [N], [-], [N·m]
  double crushing_force = 0, rupture_force = 0;                      // without bending, magnitudes [N]
  std::vector<std::string> notes, not_modelled;
};

/// Curves of one route and normal force that are equal but for round-off stand together, as "+y -y".
struct RccGroup {
  const RccCurve* curve = nullptr;  // the first of them, in the report
  std::string about;
};
std::vector<RccGroup> group_curves(const RccReport&);

/// The report as JSON in SI; bytes depend on the input alone.
std::string to_json(const RccReport&);
/// One table (RFC 4180) each, with units in the first line.
std::string points_csv(const RccReport&);
std::string curves_csv(const RccReport&);
std::string interaction_csv(const RccReport&);
std::string biaxial_csv(const RccReport&);
std::string axial_csv(const RccReport&);
std::string states_csv(const RccReport&);
/// Cells of the cut, bars and cells seen from the side, of every state of the solid route.
std::string solid_states_csv(const RccReport&);

}  // namespace topple::record
