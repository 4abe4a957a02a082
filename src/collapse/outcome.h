#pragma once
/// Numbers of a finished run that findings and studies share.

#include <array>
#include <atomic>
#include <limits>
#include <vector>

#include "collapse/debris.h"
#include "collapse/recorder.h"

namespace topple::collapse {

/// First and last firing of a stage.
struct StageTimes {
  size_t stage = 0;            // index into the plan's
  double first = 0, last = 0;  // [s]
};
/// Of the stages that fire at all, rising; with `all`, charges that fail count as if they fired.
std::vector<StageTimes> find_stage_times(const ModelMap&, bool all = false);

/// How each structure of the map came down, or how things stand in a run that goes on. There is at least one frame.
std::vector<Mechanism> judge_structures(const product::Plan&, const mbs::Model&, const ModelMap&, const Knowledge&,
                                        const Recorder&, const mbs::Summary&, bool is_under_way = false,
                                        bool is_cancelled = false);
/// One verdict on all of them.
Mechanism judge_run(const std::vector<Mechanism>& verdicts, const ModelMap&, const Knowledge&, const Recorder&);

/// What else a run that is over might have been called: see there. None where structures stand apart.
std::vector<NearVerdict> find_near_verdicts(const product::Plan&, const mbs::Model&, const ModelMap&, const Knowledge&,
                                            const Recorder&, const mbs::Summary&);

/// Whether the upper block is where it was: calc_away.
bool stands(const BlockFrame&, const Knowledge&);
/// The last frame not after a time.
size_t find_frame(const std::vector<BlockFrame>&, double time);

/// Outline of the model as it stands at the start, seen from above.
Polygon calc_building_outline(const mbs::Model&, const ModelMap&);

/// From where the reach of a part counts: the building's outline, or where the part stood if that is beside it.
Polygon find_start_outline(const record::Record&, size_t body);

/// Whether a part that stood beside the building is where it was, and no debris.
bool stays_beside(const record::Record&, size_t body, size_t frame);

/// Boxes of all bodies that can move, as crushing has left them, without those that stay beside the building.
std::vector<PlacedBox> find_moving_boxes(const record::Record&, size_t frame);

/// The heap of all parts that can move, on a grid of 0.25 m.
Heap find_heap(const record::Record&, size_t frame);

/// Between the way it fell and an azimuth, 0 to π; of separate structures that of the one that is farthest off. NaN
/// where nothing fell to any side [rad].
double calc_deviation(const Mechanism&, double azimuth);
double calc_deviation(double found, double azimuth);

inline constexpr double kOnGround = 0.1;  // height of what lies on the ground or on what lies there [m]

/// How far the staves of a shaft's body reach beyond its ring, or lie within it, at the most; of other bodies 0 [m].
double calc_stave_error(const record::BodyInfo&);

/// What comes how near to an area, seen from above, and how low it comes there.
struct Approach {
  double least = std::numeric_limits<double>::infinity(), when = 0;  // distance in plan; 0: over it [m, s]
  size_t body = 0;
  double lowest = std::numeric_limits<double>::infinity(), lowest_when = 0;  // height over its area [m, s]
  size_t lowest_body = 0;
};
/// Of all frames until the first part is down on the area (kOnGround), or until `cancel` is set.
Approach find_approach(const record::Record&, const Polygon& area, const std::atomic<bool>* cancel = nullptr);

/// How far parts lie beyond the building's footprint, the convex outline of what stood before the first charge.
struct Reach {
  std::array<double, 4> side{};       // along -x, +x, -y, +y beyond the box around it; 0: not beyond [m]
  std::array<double, 4> side_most{};  // the same, within which 95 % of the mass lie [m]
  double largest = 0;                 // distance in plan of the farthest point from it [m]
  double most_mass = 0;               // distance in plan from it within which 95 % of the mass lie [m]
  int farthest = -1;                  // body, -1: no moving one
  Polygon outline;                    // around all parts, convex, counter-clockwise
  double area = 0;                    // of the outline [m²]
};
Reach calc_reach(const record::Record&, size_t frame);

/// A part that was still moving in the last frame, unless it sways with a structure that finally stands, or one of a
/// structure whose verdict is not final.
struct OpenPart {
  size_t body = 0;
  double speed = 0;  // over the last interval between frames [m/s]
  // that it may still go: (v²/2 + g z) / (μ g), as if it slid until nothing is left, and, where the verdict is not
  // final, the z by which it may topple before [m]
  double way = 0;
};
inline constexpr double kStill = 0.2;  // speed below which a part counts as lying [m/s]
///   verdicts  on the structures of the map
///   friction  on the ground
std::vector<OpenPart> find_open_parts(const record::Record&, const ModelMap&, const std::vector<Mechanism>& verdicts,
                                      double gravity, double friction);

/// Convex outline of the moving parts that lie nearest to the footprint and hold at least `share` of the mass.
Polygon calc_share_outline(const record::Record&, size_t frame, double share);

}  // namespace topple::collapse
