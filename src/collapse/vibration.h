#pragma once
/// Screening of ground vibration from parts that hit the ground (docs/theory/findings.md, section 6). The attenuation
/// law is the user's; nothing here predicts a vibration.

#include <string>
#include <vector>

#include "collapse/debris.h"
#include "product/plan.h"

namespace topple::collapse {

/// A part's first touch of the ground.
struct Touchdown {
  double time = 0;      // [s]
  int body = -1;        // of the model
  Point2 place{};       // of its mass centre [m]
  double speed = 0;     // with which its first point approaches the ground [m/s]
  double energy = 0;    // kinetic, of the part alone [J]
  double momentum = 0;  // vertical, of the part alone, downwards positive [N·s]
  double kinetic = 0;   // energy of all parts that move then [J]
};

/// Largest velocity that the law gives at a footprint.
struct Shaking {
  double velocity = 0;  // middle of the band [m/s]
  double time = 0;      // end of the window in which it is reached [s]
  double energy = 0;    // of the touchdowns in it [J]
  double distance = 0;  // of the one among them that counts most [m]
  int body = -1;        // that one
};
/// Touchdowns within the law's window add up their energies, each weighed by its distance, so that a single one gives
/// v_0 (E/E_0)^a (r/r_0)^-b. Velocity 0 without touchdowns.
Shaking find_shaking(const product::VibrationLaw&, const std::vector<Touchdown>&, const Polygon& footprint);

/// Limit at a building's foundation for short vibrations of a frequency [Hz] -> [m/s]: DIN 4150-3:1999-02, Table 1.
double calc_vibration_limit(product::BuildingClass, double frequency);
/// "residential buildings (line 2): 5 mm/s up to 10 Hz, rising to 15 at 50 Hz and 20 at 100 Hz".
std::string describe_vibration_limit(product::BuildingClass);
/// Standard, edition and table.
inline constexpr const char* kVibrationSource = "DIN 4150-3:1999-02, Table 1";

}  // namespace topple::collapse
