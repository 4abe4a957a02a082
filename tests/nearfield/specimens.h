#pragma once
/// Columns of the PEER structural performance database: cantilevers under constant P, pushed sideways at the top.

#include <cmath>

#include "base/unit.h"
#include "material/concrete.h"
#include "nearfield/column.h"

namespace topple::nearfield::test {

/// mm, N/mm², kN. Envelope: largest |F| at a drift of 0.25, 0.5, 1, 2 and 3 %, 0: not reached.
struct Specimen {
  const char* name;
  double side, length, fc, fy, fu, P;
  int bars_a_side;
  double bar, cover, tie, spacing;
  int legs;
  double F_max;
  double envelope[5];
};

inline constexpr Specimen specimens[] = {
    {"Gill 1", 550, 1200, 23.1, 375, 636, 1815, 4, 24, 40, 10, 80, 4, 696, {397, 567, 671, 651, 613}},
    {"Soesianawati 1", 400, 1600, 46.5, 446, 702, 744, 4, 16, 13, 7, 85, 4, 199.6, {85, 142, 195, 186, 193}},
    {"Tanaka-Park 1", 400, 1600, 25.6, 474, 721, 819, 3, 20, 40, 12, 80, 3, 167.1, {60, 130, 165, 164, 144}},
    {"Atalay 1S1", 305, 1676, 29.1, 367, 578, 267, 2, 22, 32, 9.5, 76, 2, 61.7, {26, 40, 62, 60, 0}},
    {"Atalay 9", 305, 1676, 33.3, 363, 563, 801, 2, 22, 32, 9.5, 76, 2, 78.9, {42, 54, 73, 64, 54}},
    // f_u is not given: 1.55 f_y, as the other five have on average.
    {"Saatcioglu U3", 350, 1000, 34.8, 430, 1.55 * 430, 600, 3, 25, 22.5, 10, 75, 2, 271, {155, 170, 232, 260, 266}},
};
inline constexpr double drifts[] = {0.0025, 0.005, 0.01, 0.02, 0.03};

inline ZoneInput make_input(const Specimen& s) {
  ZoneInput in;
  product::Section& section = in.section;
  section.name = s.name;
  section.width = section.height = s.side * unit::mm;
  section.cover = s.cover * unit::mm, section.tie_diameter = s.tie * unit::mm,
  section.tie_spacing = s.spacing * unit::mm;
  section.tie_legs_y = section.tie_legs_z = s.legs;
  const double edge = (0.5 * s.side - s.cover - s.tie - 0.5 * s.bar) * unit::mm, d = s.bar * unit::mm;
  const int n = s.bars_a_side;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      if (i == 0 || j == 0 || i == n - 1 || j == n - 1)
        section.bars.push_back(
            {edge * (2.0 * i / (n - 1) - 1), edge * (2.0 * j / (n - 1) - 1), 0.25 * 3.14159265358979 * d * d, d});
  const double fc = s.fc * unit::MPa;
  in.concrete.fc = fc;
  in.concrete.fct = 0.3 * std::pow(s.fc - 8, 2.0 / 3) * unit::MPa;  // Model Code 2010
  in.concrete.Ec = 0.85 * material::calc_initial_modulus(fc);
  in.concrete.eps_c1 = 2.2e-3;
  in.concrete.Gf = material::calc_fracture_energy(fc);
  in.concrete.Gcl = 15e3;
  in.steel = {"", s.fy * unit::MPa, s.fu * unit::MPa, 200e3 * unit::MPa, 0.1};
  in.length = calc_hinge_length(in, s.length * unit::mm);
  return in;
}

}  // namespace topple::nearfield::test
