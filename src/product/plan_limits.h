#pragma once
/// What a plan can hold, for those who read one and those who make one.

#include "product/table_reader.h"

namespace topple::product::limits {

inline constexpr size_t lines = 500;  // of each direction of the grid
inline constexpr Range line_offset{-1000, 1000};
inline constexpr double line_spacing = 0.3;  // at least [m]
inline constexpr Range storey_height{1, 50};
inline constexpr Range section_size{0.05, 10}, panel_thickness{0.03, 3};
inline constexpr Range bar_diameter{4 * unit::mm, 80 * unit::mm};
inline constexpr Range tie_diameter{2 * unit::mm, 40 * unit::mm}, tie_spacing{10 * unit::mm, 2};
inline constexpr int bars = 100;                   // of one kind
inline constexpr double least_peak_strain = 1.05;  // of concrete, over fc / Ec, below which no curve rises to fc
inline constexpr Range site{-10e3, 10e3};          // coordinates around it [m]
inline constexpr size_t corners = 200;             // of a footprint
inline constexpr size_t neighbours = 1000;
inline constexpr double footprint = 0.01;  // at least [m²]

// of [analysis], and of what a command line puts in their place
inline constexpr Range duration{0.01, 600}, step{1e-7, 0.01}, frame_rate{1, 1000};
inline constexpr Range destroyed_length{0.01, 100};
inline constexpr Range residual_concrete{0, 0.95};
inline constexpr Range cable_stiffness{0, 1e12, true}, cable_pretension{0, 1e9};

}  // namespace topple::product::limits
