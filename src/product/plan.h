#pragma once
/// The product model: a building with its reinforcement, its preparation, its blasting plan and its site.
/// Everything is SI and resolved: patterns are expanded, overrides are applied, every member stands on its own.
/// W is z-up; its origin lies on the ground at grid row offset 0, frame offset 0; x runs from the first row to the last
/// (the planned fall is usually towards -x), y along the frames.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/linalg.h"
#include "product/fuzzy_plan.h"

namespace topple::product {

struct Concrete {
  std::string name;
  double fc = 0;       // compressive strength, positive           [Pa]
  double fct = 0;      // tensile strength; 1.40 MPa ((fc/MPa - 8)/10)^(2/3) unless given   [Pa]
  double Ec = 0;       // modulus of elasticity                    [Pa]
  double eps_c1 = 0;   // strain at the peak, positive             [-]
  double Gf = 0;       // fracture energy in tension               [J/m²]
  double Gcl = 0;      // crushing energy in compression           [J/m²]
  double density = 0;  //                                          [kg/m³]
};

struct Steel {
  std::string name;
  double fy = 0;     // yield stress       [Pa]
  double fu = 0;     // tensile strength   [Pa]
  double Es = 0;     // modulus            [Pa]
  double eps_u = 0;  // strain at rupture  [-]
};

/// One longitudinal bar at (y, z) from the section's centre.
struct Bar {
  double y = 0, z = 0;  // [m]
  double area = 0;      // [m²]
  double diameter = 0;  // [m]
};

/// Rectangular section. Member frame: x along the member; for columns y, z are W's x and y; for beams z is up and
/// y is horizontal.
struct Section {
  std::string name;
  double width = 0;               // along local y [m]
  double height = 0;              // along local z [m]
  int concrete = -1, steel = -1;  // indices into Plan::concretes, Plan::steels
  std::vector<Bar> bars;
  double cover = 0;                    // clear cover to the ties [m]
  double tie_diameter = 0;             // [m]
  double tie_spacing = 0;              // [m]
  int tie_legs_y = 2, tie_legs_z = 2;  // legs resisting shear along y and along z

  double area() const { return width * height; }
  double steel_area() const {
    double a = 0;
    for (const Bar& b : bars) a += b.area;
    return a;
  }
};

/// Slab or wall build-up with reinforcement per metre on each face.
struct Panel {
  std::string name;
  double thickness = 0;              // [m]
  int concrete = -1;                 // index, or -1 for masonry (then density, strength and modulus below count)
  int steel = -1;                    // index, or -1 when unreinforced
  double density = 0;                // [kg/m³]
  double strength = 0;               // compressive strength [Pa]
  double modulus = 0;                // [Pa]
  double as_top = 0, as_bottom = 0;  // reinforcement per metre on each face, in the direction of the span [m²/m]
  double cover = 0;                  // [m]
};

enum class MemberKind { Column, Beam, Slab, Wall, Shaft };
/// "column", "beam", "slab", "wall", "shaft".
const char* name_of(MemberKind);

/// Upright shaft of rings (chimney, tower): outer diameter and thickness change linearly from the foot to the top.
struct Shaft {
  double diameter_foot = 0, diameter_top = 0;    // outer [m]
  double thickness_foot = 0, thickness_top = 0;  // [m]
  int concrete = -1;                  // index, or -1 for masonry (then density, strength and modulus below count)
  int steel = -1;                     // index, or -1 when unreinforced
  double density = 0;                 // [kg/m³]
  double strength = 0;                // compressive strength [Pa]
  double modulus = 0;                 // [Pa]
  double as_outer = 0, as_inner = 0;  // upright bars per metre of each face's circumference [m²/m]
  double bar_diameter = 0;            // of the upright bars [m]
  double hoop_diameter = 0, hoop_spacing = 0;  // 0: none [m]
  double cover = 0;                            // of the upright bars [m]
  double lining_thickness = 0;                 // inside the shell, weight only [m]
  double lining_density = 0;                   // [kg/m³]
  /// Mass that the shaft carries at a height, weight only: platforms, tanks.
  struct Load {
    double at = 0;    // above the foot [m]
    double mass = 0;  // [kg]
  };
  std::vector<Load> loads;
  double joint_spacing = 0;  // between places where it may break; 0: chosen [m]

  /// Outer radius and thickness at a share of the height, 0 at the foot.
  double outer(double share) const { return 0.5 * (diameter_foot + share * (diameter_top - diameter_foot)); }
  double thickness(double share) const { return thickness_foot + share * (thickness_top - thickness_foot); }
};

/// Hole in a wall: from its left end (as seen along start -> end) and above the floor.
struct Opening {
  double left = 0, sill = 0, width = 0, height = 0;  // [m]
};

/// What was done to a member before the first charge.
struct Weakening {
  double at = 0;            // distance from the member's start [m]
  double cut_bars = 0;      // fraction of bars cut, 0..1
  double cut_concrete = 0;  // fraction of the section's area taken out, 0..1
  // shafts only: the sector that the fractions count in
  double azimuth = 0;  // of its middle in W, 0 = +x, counter-clockwise [rad]
  double opening = 0;  // its angle, 2 pi: all around [rad]
  double height = 0;   // [m]
};

/// Names: C-A1-0 column at row A, frame 1, storey 0. B-A1A2-3 beam from A1 to A2 under the floor above storey 3.
/// S-A1B2-3 slab with corners A1 and B2 above storey 3. W-A1A2-0 wall from A1 to A2 in storey 0. Shafts have the
/// plan's names and stand off the grid.
struct Member {
  std::string name;
  MemberKind kind = MemberKind::Column;
  int storey = 0;
  int row_a = 0, frame_a = 0, row_b = 0, frame_b = 0;  // grid indices of both ends (columns: equal)
  Vec3 start, end;    // axis in W [m]; columns foot -> top of the storey; beams node -> node at mid-height of the beam;
                      // slabs opposite corners at mid-thickness; walls lower corners on the floor
  double height = 0;  // walls: clear height [m]
  int section = -1;   // columns, beams: index into Plan::sections
  int panel = -1;     // slabs, walls: index into Plan::panels
  int shaft = -1;     // shafts: index into Plan::shafts; start and end are foot and top
  std::vector<Opening> openings;
  std::vector<Weakening> weakenings;
  bool removed = false;  // taken out before the first charge
  SourcePosition where;
};

struct Charge {
  int member = -1;               // index into Plan::members
  double position = 0;           // centre of the destroyed length, from the member's start [m]
  double destroyed_length = 0;   // h_d [m]
  double residual_bars = 0;      // fraction of the bars left standing, 0..1
  double residual_concrete = 0;  // fraction of the concrete left standing; 0: the charge destroys all of it
  double transition_damage = 0;  // loss of concrete strength in the zones next to the destroyed length, 0..1
  double delay = 0;              // after the stage's time [s]
  double scatter = 0;            // standard deviation of the firing time [s]
  bool fails = false;            // what if it does not fire
  // shafts only: the sector that is destroyed
  double azimuth = 0;  // of its middle in W, 0 = +x, counter-clockwise [rad]
  double opening = 0;  // its angle, 2 pi: all around [rad]
  SourcePosition where;
};

/// Whether a charge on it may leave part of the concrete (Charge::residual_concrete): its end has a zone of its own.
inline bool can_keep_concrete(const Member& m) {
  return (m.kind == MemberKind::Column && m.storey == 0) || (m.kind == MemberKind::Beam && m.row_a != m.row_b);
}

struct Stage {
  std::string name;
  double time = 0;  // nominal, rising from stage to stage [s]
  std::vector<Charge> charges;
  SourcePosition where;
};

struct Cable {
  std::string name;
  int member = -1;        // the member pulled
  double position = 0;    // from its start [m]
  Vec3 anchor;            // in W [m]
  double stiffness = 0;   // [N/m]
  double pretension = 0;  // [N]
  double strength = 0;    // breaks above [N]
  SourcePosition where;
};

struct Ground {
  double friction = 0.6;
  double restitution = 0.1;
};

/// Lines of DIN 4150-3, Table 1.
enum class BuildingClass { Unknown, Commercial, Residential, Sensitive };

/// How the site shakes when something falls on it, from the user: v = velocity (E / energy)^energy_exponent
/// (r / distance)^-distance_exponent, between v / factor and v * factor.
struct VibrationLaw {
  double velocity = 0;         // peak particle velocity at the foundation [m/s]
  double energy = 0;           // of the touchdown that gives it [J]
  double distance = 0;         // at which [m]
  double energy_exponent = 0;  // > 0
  double distance_exponent = 0;
  double factor = 1;                             // >= 1
  double low_frequency = 0, high_frequency = 0;  // between which the ground answers [Hz]
  double window = 0.25;                          // touchdowns within it add up [s]
  double least_distance = 1;                     // nearer ones count as if there [m]
  std::string source;                            // where the numbers come from, in words
};

/// Something beside the building that must not be reached. Corners counter-clockwise in W's xy plane.
struct Neighbour {
  std::string name;
  std::vector<std::array<double, 2>> footprint;  // [m]
  std::optional<double> clearance;               // least distance of debris that is asked for [m]
  double vibration_limit = 0;                    // peak particle velocity, 0: none given [m/s]
  BuildingClass building_class = BuildingClass::Unknown;
  bool is_utility = false;
  SourcePosition where;
};

/// What the planner wants. Unset: not asked.
struct Criteria {
  std::optional<std::string> mechanism;     // "topple", "vertical", "stands", ...
  std::optional<double> azimuth;            // direction of fall in W, 0 = +x, counter-clockwise [rad]
  std::optional<double> azimuth_tolerance;  // [rad]
  std::optional<double> debris_reach;       // beyond the footprint, at most [m]
  std::optional<bool> stands_between_stages;
  SourcePosition where;
};

struct Analysis {
  double duration = 0;     // simulated time [s]
  double step = 0;         // 0: chosen from the stiffest element [s]
  double frame_rate = 60;  // poses kept per second of simulated time [1/s]
  double gravity = 9.81;   // [m/s²]
  std::uint64_t seed = 1;  // of the scatter of the firing times
};

struct Plan {
  std::string title;
  std::string path;  // as given
  std::string text;  // the file's bytes
  std::vector<Concrete> concretes;
  std::vector<Steel> steels;
  std::vector<Section> sections;
  std::vector<Panel> panels;
  std::vector<Shaft> shafts;
  std::vector<std::string> row_names;    // along x
  std::vector<double> row_offsets;       // x of each row [m]
  std::vector<std::string> frame_names;  // along y
  std::vector<double> frame_offsets;     // y of each frame [m]
  std::vector<double> storey_heights;    // floor to floor [m]
  std::vector<double> storey_loads;      // dead load beside the members' own weight, on the floor above [kg/m²]
  std::vector<Member> members;
  std::vector<Stage> stages;
  std::vector<Cable> cables;
  Ground ground;
  std::vector<Neighbour> neighbours;
  std::optional<VibrationLaw> vibration;
  Criteria criteria;
  Analysis analysis;
  FuzzyPlan fuzzy;  // empty unless the plan has [fuzzy]; its other values are the plan's own

  /// Height of the top of storey s above the ground [m].
  double level(int storey) const {
    double z = 0;
    for (int i = 0; i <= storey; ++i) z += storey_heights[static_cast<size_t>(i)];
    return z;
  }
  /// Index of a member, -1 if there is none of that name.
  int find_member(const std::string& name) const;
};

/// Reads and checks a plan. Every complaint is collected; throws InputError if one of them is an error.
/// `warnings` receives the others. `name` stands in the messages for the file.
Plan read_plan(const std::string& text, const std::string& name, std::vector<Diagnostic>& warnings);
/// Reads a file; an unreadable one is an InputError. `text_out` receives its bytes (for rendering of messages), also on
/// error.
Plan read_plan_file(const std::string& path, std::vector<Diagnostic>& warnings, std::string& text_out);

/// Whether the sector of a shaft goes all around, to round-off.
bool is_all_around(double opening);
/// Whether a direction lies in the sector of a shaft, all angles in W [rad]. One that goes all around has all of them.
bool is_in_sector(double angle, double azimuth, double opening);

/// Mass of a member's own material without openings [kg]; pieces that members share are counted once (docs/plan.md).
/// The plan's members must be in the order of read_plan.
double calc_mass(const Plan&, const Member&);
/// Mass of a shaft between two shares of its height, with its lining and what it carries there [kg].
double calc_shaft_mass(const Plan&, const Shaft&, double height, double from, double to);

}  // namespace topple::product
