#pragma once
/// Bending about any axis in the section: families at an angle and how well the power law of a zone joins the moments
/// about both principal axes; docs/theory/rcc.md, "Biaxial bending".

#include <vector>

#include "nearfield/fibres.h"
#include "nearfield/rcc.h"

namespace topple::nearfield {

/// The family of rotations about the axis at `angle` from y towards z [rad], moments about that axis; forces and
/// rotations as of make_rcc. Angle 0 is y_pos, π/2 z_pos, π y_neg. Throws InputError as make_rcc.
MomentFamily make_oblique_family(const ZoneInput&, double angle);

/// Largest moment of a zone turned about an oblique axis, its parts about y and z as shares of the largest moments
/// about each axis alone under the same normal force.
struct BiaxialPoint {
  double angle = 0, normal_force = 0;  // of the axis [rad], [N]
  double y = 0, z = 0;
};
/// One point for each skew and each force that leaves a moment about both axes. A skew β in (0, π/2) turns about the
/// axis with tan angle = (height / width) tan β, so that at π/4 both edges are strained alike. Forces as shares of the
/// crushing force, compression positive.
std::vector<BiaxialPoint> calc_biaxial_points(const ZoneInput&, const std::vector<double>& skew,
                                              const std::vector<double>& compression);

/// Exponent p of y^p + z^p = 1 for which the points lie on the curve in the mean (1 to 4), and their distances from it:
/// the factor by which a point lies outside of the curve (mean 1), least and greatest.
struct BiaxialFit {
  double exponent = 0, least = 1, greatest = 1;
};
BiaxialFit fit_biaxial(const std::vector<BiaxialPoint>&);

/// Largest moments about both axes at once under one normal force [N·m] while the zone turns about oblique axes: true
/// points, from the resistance to a moment about y alone to that to one about z alone, positive directions. A section
/// that is not symmetric reaches these by turning about an oblique axis, too.
struct BiaxialLine {
  std::vector<double> y, z;  // (P); none: no positive moment about y alone is resisted
  bool ends_at_z = false;    // with y = 0; otherwise there is no moment about z alone and the last axis is known
  std::vector<BiaxialPoint> inside;  // without both ends, as shares of them; none unless it ends at z
};
/// `steps` of skew between both ends, each on the grid of rotations of the report's curves. Throws InputError.
BiaxialLine make_biaxial_line(const ZoneInput&, double N, int steps);

/// The largest moment while the zone turns about one principal axis alone, and the moment that comes with it about the
/// other one: signed, positive directions [N·m].
struct CrossedPeak {
  double moment = 0, across = 0;
};
CrossedPeak find_crossed_peak(const ZoneInput&, Axis, int direction, double N);

/// The exponent of a zone whose families are known: skew π/4, forces of 0, 0.2, 0.4 and 0.6 of crushing; 1.5 if none of
/// them leaves a moment.
double calc_biaxial_exponent(const ZoneInput&, const Rcc&);
/// The same where they are not known, without a flange.
double calc_biaxial_exponent(const ZoneInput&);

}  // namespace topple::nearfield
