#pragma once
/// Small plans for the manager's tests.

#include <string>
#include <vector>

#include "product/plan.h"

namespace topple::collapse {

/// Materials, sections and panels of all the plans below.
inline std::string materials() {
  return R"toml(title = "Test building"
[concrete.C25]
fc = "25 N/mm2"
Ec = "30 GPa"
[steel.S]
fy = "420 N/mm2"
fu = "500 N/mm2"
eps_u = 0.1
[section.column]
width = "30 cm"
height = "40 cm"
concrete = "C25"
steel = "S"
cover = "3 cm"
ties = { diameter = "8 mm", spacing = "20 cm" }
bars = { count_y = 2, count_z = 2, diameter = "20 mm" }
[section.beam]
width = "30 cm"
height = "50 cm"
concrete = "C25"
steel = "S"
cover = "3 cm"
ties = { diameter = "8 mm", spacing = "15 cm" }
top = "4 x 20 mm"
bottom = "3 x 20 mm"
[slab.floor]
thickness = "15 cm"
concrete = "C25"
steel = "S"
as_top = "4 cm2/m"
as_bottom = "4 cm2/m"
[wall.thin]
thickness = "10 cm"
concrete = "C25"
steel = "S"
as_faces = "2 cm2/m"
cover = "2 cm"
)toml";
}

/// A wall of masonry for them, `more` its bars.
inline std::string brick(const std::string& more = "") {
  return "[wall.brick]\nthickness = \"24 cm\"\ndensity = \"1400 kg/m3\"\nstrength = \"4 N/mm2\"\nmodulus = \"2.5 "
         "GPa\"\n" +
         more;
}

inline std::string grid(const std::string& rows, const std::string& frames, int storeys, const std::string& load = "") {
  return "[grid]\nrows = { " + rows + " }\nframes = { " + frames + " }\n[storeys]\ncount = " + std::to_string(storeys) +
         "\nheight = \"3 m\"\n" + (load.empty() ? "" : "load = \"" + load + "\"\n");
}

/// A site's law of vibration.
inline std::string vibration_law() {
  return R"toml([site.vibration]
velocity = "2 mm/s"
energy = "1 MJ"
distance = "10 m"
energy_exponent = 0.5
distance_exponent = 1.2
factor = 2
frequency = ["8 Hz", "30 Hz"]
source = "drop tests on the site"
)toml";
}

inline std::string analysis(const std::string& duration = "1 s") {
  return "[analysis]\nduration = \"" + duration + "\"\n";
}

inline product::Plan read(const std::string& text) {
  std::vector<Diagnostic> warnings;
  return product::read_plan(text, "test.toml", warnings);
}

/// Two columns and a beam along x.
inline std::string portal(const std::string& more = "") {
  return materials() + grid("A = \"0 m\", B = \"5 m\"", "1 = \"0 m\"", 1) +
         "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\nalong = \"x\"\n" + more + analysis();
}

/// Two storeys of two by three columns with floors and walls all around.
inline std::string house(const std::string& more = "", const std::string& duration = "1 s") {
  return materials() + grid("A = \"0 m\", B = \"5 m\"", "1 = \"0 m\", 2 = \"4 m\", 3 = \"8 m\"", 2, "1 kN/m2") +
         "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\n[[slabs]]\npanel = \"floor\"\n"
         "[[walls]]\npanel = \"thin\"\nperimeter = true\nstoreys = 1\n"
         "opening = [{ left = \"1 m\", sill = \"0.9 m\", width = \"1 m\", height = \"1.2 m\" }]\n" +
         more + analysis(duration);
}

inline std::string charge(const std::string& members, const std::string& time = "0 s",
                          const std::string& more = "scatter = \"1 ms\"") {
  return "[[stage]]\nname = \"Stage at " + time + "\"\ntime = \"" + time + "\"\n[[stage.charge]]\nmembers = [\"" +
         members + "\"]\nposition = \"1 m\"\ndestroyed_length = \"1 m\"\nresidual_bars = 0.1\n" + more + "\n";
}

}  // namespace topple::collapse
