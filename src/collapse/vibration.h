#pragma once
/// Screening of ground vibration by the energy of what comes down (docs/theory/findings.md, section 6). The attenuation
/// law is the user's; nothing here predicts a vibration.

#include <string>
#include <vector>

#include "collapse/debris.h"
#include "product/plan.h"
#include "record/record.h"

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
  bool is_of_block =
      true;  // of the largest connected part then, or of one among pieces; not what had fallen off before
};

/// Velocities of the model's bodies, the first B of a record, at its frames.
struct Speeds {
  std::vector<float> velocity;  // of their origins, in W (S x B x 3) [m/s]
  std::vector<float> spin;      // in W                   (S x B x 3) [rad/s]
};

/// Largest velocity that the law gives at a footprint.
struct Shaking {
  double velocity = 0;      // middle of the band [m/s]
  double time = 0;          // end of the window in which it is reached [s]
  double window = 0;        // its length: at most the law's, or the interval between frames there if that is more [s]
  double energy = 0;        // lost in it [J]
  double distance = 0;      // of what counts most of it [m]
  int body = -1;            // the part that it belongs to
  double end_velocity = 0;  // as `velocity`, by the last window of the record alone [m/s]
};
/// What counts is the kinetic and potential energy that moving parts lose within the law's window, wherever it goes:
/// what zones, contacts and dampers take and store of it, by the record's series of energies. The loss of each interval
/// between frames is shared out over the parts, in pieces of at most kPieceLength, by what each of them loses of its
/// own; each share is weighed by its outline's distance, so that a single one gives v_0 (E/E_0)^a (r/r_0)^-b. The
/// largest of all windows; velocity 0 where nothing is lost.
///   gravity      [m/s²]
///   restitution  of impacts, at most 1
Shaking find_shaking(const product::VibrationLaw&, const record::Record&, const Speeds&, const Vec3& gravity,
                     double restitution, const Polygon& footprint);
/// Parts count in pieces no longer than this, so that results do not hang on how members are cut into parts [m].
inline constexpr double kPieceLength = 3;
/// What the law makes of an energy at a distance, which least_distance limits [J, m] -> [m/s].
double calc_velocity(const product::VibrationLaw&, double energy, double distance);

/// Energy that moving parts have lost until each frame of a record, loads' work on them included [J].
///   restitution  impacts count with what they bring: they take 1 - restitution² of it and give back the rest
std::vector<double> calc_lost_energy(const record::Record&, double restitution = 0);

/// Limit at a building's foundation for short vibrations of a frequency [Hz] -> [m/s]: DIN 4150-3:1999-02, Table 1.
double calc_vibration_limit(product::BuildingClass, double frequency);
/// "residential buildings (line 2): 5 mm/s up to 10 Hz, rising to 15 at 50 Hz and 20 at 100 Hz".
std::string describe_vibration_limit(product::BuildingClass);
/// Standard, edition and table.
inline constexpr const char* kVibrationSource = "DIN 4150-3:1999-02, Table 1";

}  // namespace topple::collapse
