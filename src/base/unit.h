#pragma once
/// SI inside; these constants turn a value in the named unit into SI, and the only place where text carries units.

#include <optional>
#include <string>
#include <string_view>

namespace topple {

namespace unit {
inline constexpr double mm = 1e-3, cm = 1e-2, m = 1, km = 1e3;
inline constexpr double mm2 = 1e-6, cm2 = 1e-4, m2 = 1;
inline constexpr double s = 1, ms = 1e-3;
inline constexpr double N = 1, kN = 1e3, MN = 1e6;
inline constexpr double kNm = 1e3, MNm = 1e6;
inline constexpr double Pa = 1, kPa = 1e3, MPa = 1e6, GPa = 1e9;
inline constexpr double kg = 1, t = 1e3;
inline constexpr double deg = 3.14159265358979323846 / 180;
inline constexpr double gravity = 9.81;  // [m/s²]
}  // namespace unit

enum class Dimension {
  Number,              // no unit; "%" allowed
  Length,              // m
  Area,                // m²
  AreaPerLength,       // m²/m (slab reinforcement)
  Time,                // s
  Mass,                // kg
  Force,               // N
  AreaLoad,            // N/m² (floors)
  Stress,              // Pa
  Density,             // kg/m³
  Energy,              // J
  EnergyPerArea,       // J/m² = N/m (fracture energy)
  Velocity,            // m/s
  Acceleration,        // m/s²
  Angle,               // rad
  Frequency,           // Hz
  StiffnessPerLength,  // N/m
  Moment,              // N·m
};

/// Result of reading "3.14 m": either a value in SI or words about what is wrong.
struct Quantity {
  std::optional<double> value;  // SI
  std::string problem;          // empty when there is a value
};

/// Reads a number and a unit of the wanted dimension. NaN, infinities and numbers beyond 1e15 are refused.
Quantity parse_quantity(std::string_view text, Dimension wanted);

/// "length", and the units that are understood for it, "mm, cm, m, km".
std::string name_of(Dimension);
std::string units_of(Dimension);

}  // namespace topple
