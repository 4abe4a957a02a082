#include "product/plan.h"

namespace topple::product {

std::string plan_template() {
  return R"toml(# A plan for topple: a building, what is done to it, and what it should do.
# Every length, time, force and so on is a string with a unit. Check it with `topple check`, run it with `topple run`.
# This one is a small frame of 2 x 2 bays and three storeys that is toppled to the front.

title = "Small frame"

# The ground, and what must not be reached. x runs from the first row to the last, y along the frames, z upwards.
[site]
friction = 0.6
restitution = 0.1

# [[site.neighbour]]                # or [[site.utility]]
# name = "House next door"
# footprint = [["0 m", "20 m"], ["10 m", "20 m"], ["10 m", "30 m"], ["0 m", "30 m"]]
# clearance = "3 m"                 # debris must keep this distance
# vibration_limit = "5 mm/s"        # peak particle velocity

# Materials: any number of each, named by you.
[concrete.C25]
fc = "25 N/mm2"  # compressive strength; its tensile strength follows unless fct is given
Ec = "30 GPa"

[steel.bars]
fy = "420 N/mm2"
fu = "500 N/mm2"
eps_u = "10 %"  # strain at rupture

# Sections of columns and beams. A column's width lies along x, a beam's is horizontal.
[section.column]
width = "40 cm"
height = "40 cm"
concrete = "C25"
steel = "bars"
cover = "3 cm"  # to the ties
ties = { diameter = "8 mm", spacing = "20 cm" }
bars = { count_y = 3, count_z = 3, diameter = "20 mm" }  # around the perimeter: eight bars
# steel_area = "25 cm2"             # measured area, if it differs from the bars drawn

[section.beam]
width = "30 cm"
height = "50 cm"
concrete = "C25"
steel = "bars"
cover = "3 cm"
ties = { diameter = "8 mm", spacing = "15 cm" }
top = "4 x 20 mm"
bottom = "4 x 20 mm"

# Slabs and walls; reinforcement per metre on each face.
[slab.floor]
thickness = "16 cm"
concrete = "C25"
steel = "bars"
as_top = "4 cm2/m"
as_bottom = "4 cm2/m"

[wall.brick]
thickness = "24 cm"
density = "1800 kg/m3"
strength = "5 N/mm2"
modulus = "3 GPa"

# Rows are named by letters, frames by numbers; column C-A1-0 stands at row A and frame 1 in the ground storey.
[grid]
rows = { A = "0 m", B = "5 m", C = "10 m" }
frames = { 1 = "0 m", 2 = "5 m", 3 = "10 m" }

[storeys]
count = 3
height = "3.2 m"   # or heights = ["4 m", "3 m", "3 m"] from the ground upwards
load = "1 kN/m2"   # dead load on each floor beside the members' own weight

# Members. `at` takes names or patterns of grid points, * and ?; `storeys` takes 0, "1..2", a list, or "all".
# A later rule replaces an earlier one where both apply; `except` leaves places out.
[[columns]]
section = "column"

[[beams]]
section = "beam"

[[slabs]]
panel = "floor"

[[walls]]
panel = "brick"
at = "A1A2"
storeys = 0
opening = [{ left = "1 m", width = "1.2 m", height = "2.1 m" }]

# [[override]]                      # single members that differ
# members = ["C-B2-0"]
# section = "column"

# What is done before the first charge.
[preparation]
removed = ["W-*-0"]

# [[preparation.weaken]]
# members = ["C-A*-0"]
# at = "1 m"                        # from the member's start
# cut_bars = 0.5
# cut_concrete = "20 %"

# Charges, stage by stage.
[[stage]]
name = "Front row"
time = "0 s"

[[stage.charge]]
members = ["C-A*-0"]
position = "1.2 m"          # middle of the destroyed length, from the member's start (the column's foot)
destroyed_length = "1.6 m"
residual_bars = 0.1         # share of the bars that stays
transition_damage = 0.2     # strength lost beside the destroyed length
scatter = "1 ms"            # standard deviation of the firing time

[[stage]]
name = "Middle row"
time = "0.5 s"

[[stage.charge]]
members = ["C-B*-0"]
position = "0.9 m"
destroyed_length = "1 m"
residual_bars = 0.1
transition_damage = 0.2
scatter = "1 ms"

# [[cable]]                         # a pulling cable
# name = "winch"
# member = "C-A2-2"
# position = "1.5 m"
# anchor = ["-40 m", "5 m", "0 m"]
# stiffness = "2 MN/m"
# pretension = "50 kN"
# strength = "400 kN"

# What is wanted; the run says whether it was reached.
[criteria]
mechanism = "topple"    # topple, fold, vertical, progressive, partial, stands
azimuth = "180 deg"     # direction of fall: 0 towards +x, 90 deg towards +y
azimuth_tolerance = "20 deg"
debris_reach = "12 m"   # beyond the footprint
# stands_between_stages = true

[analysis]
duration = "5 s"
frame_rate = "60 Hz"
seed = 1
)toml";
}

}  // namespace topple::product
