#pragma once
/// Single curves M(φ) of a zone at a constant normal force, what is read off them, and the section at a point of one;
/// layered route, docs/theory/rcc.md. Forces are positive in tension, rotations and moments magnitudes.

#include <limits>
#include <string>
#include <vector>

#include "nearfield/fibres.h"

namespace topple::nearfield {

/// Rotations of a family with every interval cut in `parts`, so that curves are smooth and hold the family's points.
std::vector<double> refine_rotations(const MomentFamily&, int parts);

struct CurvePoint {
  double rotation = std::numeric_limits<double>::quiet_NaN(), moment = std::numeric_limits<double>::quiet_NaN();
};

/// One curve, from the state without moment (see March) to the last rotation at which the section carries N and
/// resists. J points.
struct MomentCurve {
  Axis axis = Axis::Y;
  int direction = 1;                            // +1 or -1 about that axis of the section
  double N = 0;                                 // [N]
  double length = 0;                            // of the zone [m]
  std::vector<double> rotation, moment;         // [rad], [N·m] (J); none: N cannot be carried
  std::vector<double> eps_0, kappa;             // the section at each point [-], [1/m] (J)
  std::vector<BarStates> bars;                  // histories of its rows of bars (J)
  double yield_rotation = 0, yield_moment = 0;  // as in MomentFamily
  bool is_balanced = true;                      // N can be carried without a moment
  bool loses_force = false;                     // beyond `carried_to` N cannot be carried
  double carried_to = 0;  // last rotation at which N is carried; beyond the last point if no moment was left [rad]
  CurvePoint first_torn{std::numeric_limits<double>::infinity(), 0};  // last equilibrium before the first bar tears
  struct {
    double eps_0 = 0, kappa = 0;
    size_t after = 0;  // point of the curve, for the histories
  } torn;              // the section there
};

/// The march of make_rcc with the rotations given, its loss of N sought to 1e-3 of the rotation.
///   direction  of the member's rotation: +1 or -1; about z a positive one pulls at -y
MomentCurve make_moment_curve(const Fibres&, Axis, double N, int direction, double length,
                              const std::vector<double>& rotation);

/// What an engineer reads off a curve. NaN where a curve has no such point.
struct CurvePoints {
  CurvePoint yield;  // as given
  CurvePoint peak;   // largest moment, that at which the first bar tears included
  CurvePoint
      ultimate;  // at or behind the peak: the moment has fallen to 0.8 of it, the first bar tears, or the curve ends
  CurvePoint residual;  // what is left where the curve ends or, earlier, at twice the ultimate rotation
};
CurvePoints find_points(const std::vector<double>& rotation, const std::vector<double>& moment, CurvePoint yield,
                        CurvePoint first_torn = {std::numeric_limits<double>::infinity(), 0});
CurvePoints find_points(const MomentCurve&);
/// False where the normal force alone makes bars yield, or is carried with a moment only.
bool has_yield(const MomentCurve&, const CurvePoints&);

/// Resistance over normal force in one direction: first yield and largest moment, between rotations of the grid as
/// well; both ends are strained evenly, with the moment that this needs. Where N makes the bars yield by itself there
/// is no yield (NaN), nor where it is carried with a moment to one side only; a largest moment below 0 is then the
/// least one to the other side that carries it. K forces.
struct Interaction {
  std::vector<double> normal_force, yield_moment, peak_moment;  // rising [N], [N·m] (K)
};
Interaction make_interaction(const Fibres&, Axis, int direction, const MomentFamily&, double length, int count);

enum class ConcreteCondition { Uncracked, Cracked, Open, Compressed, Crushing, Crushed };
enum class BarCondition { Elastic, YieldsInTension, YieldsInCompression, Yielded, Buckled, Torn };

/// The section at one point of a curve. Places along the strain gradient: z for bending about y, y for bending about z.
struct SectionState {
  struct Layer {
    double from = 0, to = 0;                     // [m]
    double core_breadth = 0, cover_breadth = 0;  // of both sides together [m]
    double strain = 0;                           // at its middle
    double core_stress = 0, cover_stress = 0;    // [Pa]
    ConcreteCondition core = ConcreteCondition::Uncracked, cover = ConcreteCondition::Uncracked;
  };
  struct BarState {
    double y = 0, z = 0, diameter = 0;  // [m]
    double strain = 0, stress = 0;      // [Pa]
    BarCondition condition = BarCondition::Elastic;
  };
  double eps_0 = 0, kappa = 0;
  std::vector<Layer> layers;   // rising
  std::vector<BarState> bars;  // as in the section
};
/// Open: the crack carries no more than a hundredth of f_ct. Crushing: beyond the strain of the peak; crushed: below a
/// fifth of the strength. Yielded: a bar that has yielded and is elastic again.
SectionState make_section_state(const ZoneInput&, const Fibres&, Axis, double eps_0, double kappa,
                                const BarStates& = {});

const char* name_of(ConcreteCondition);
const char* name_of(BarCondition);

}  // namespace topple::nearfield
