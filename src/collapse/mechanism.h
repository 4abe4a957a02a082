#pragma once
/// How it came down: classes of collapse from the motion of the upper block (docs/theory/findings.md, section 1).

#include <optional>
#include <string>
#include <vector>

#include "base/linalg.h"
#include "collapse/debris.h"
#include "collapse/knowledge.h"

namespace topple::collapse {

/// Motion of a structure's upper block at one frame. The block is the largest group of upper bodies that are still
/// connected.
struct BlockFrame {
  /// Of what belongs together, since the start.
  struct Motion {
    Quat rotation;      // mass-weighted mean
    Vec3 displacement;  // of the mass centre [m]
    double above = 0;   // height of the mass centre at the start [m]
  };

  double time = 0;       // [s]
  Quat rotation;         // as Motion has it, of the block
  Vec3 displacement;     //
  double above = 0;      //
  Motion pieces;         // of all upper bodies
  Vec3 standing;         // displacement of the pieces in their place if they are most of it, else of all pieces [m]
  double in_place = 1;   // share of the upper mass that belongs to pieces in their place
  double connected = 1;  // mass of the block over the mass of all upper bodies that have not fallen off before
  double apart = 0;      // share of the upper mass that has (Recorder::apart_since_)
  double moved = 0;      // share of all moving mass of the structure that has gone farther than it may, to any side
  double down = 0;       // share of it that has come down
  double forward = 0;    // share of the upper mass that turned by more than mechanism.fold_rotation about the axis
  double backward = 0;   // the same against it
  double left = 0;       // the same about the horizontal axis across it, to the left of the fall
  double right = 0;      // and to its right
  double height = 0;     // of the mass centre of all moving mass of the structure [m]
  Vec3 centre;           // that mass centre [m]
  double fastest = 0;    // largest speed of an upper body [m/s]
  double beside = 0;     // of the mass of what no charge acts on, the share that has come down
};

struct MechanismInput {
  std::vector<BlockFrame> frames;
  double last_charge = 0;                          // [s]
  double touchdown = 0;                            // that decides (find_deciding_touchdown); NaN if there was none [s]
  bool is_later_touchdown = false;                 // others were before it
  std::vector<double> touchdowns, all_touchdowns;  // of bodies of the block, and of all upper ones, rising [s]
  Vec3 fall_direction{-1, 0, 0};                   // planned, or expected
  bool is_direction_planned = false;
  std::optional<double> direction_tolerance;  // [rad]; not given: the rule's
  Polygon outline;                            // of the upper block seen from above, from its mass centre; convex [m]
  double foot = 0;                            // height of the upper block's underside at the start [m]
  double storey_height = 0;                   // of the ground storey [m]
  bool came_to_rest = false;
  bool is_under_way = false;  // the run goes on, or was cancelled; for the words
  bool is_cancelled = false;
};

/// Where one of several structures fell.
struct Fall {
  std::string structure;
  double time = 0, azimuth = 0;  // as those of its Mechanism
  bool is_azimuth_of_lean = false;
};

struct Mechanism {
  std::string name;  // "topple", "fold", "vertical", "progressive", "partial", "aborted", "wrong direction", "stands"
  std::string text;  // a sentence with its numbers
  double time = 0;   // of judgement: the touchdown that decides, else the end [s]
  bool has_touchdown = false;
  double tilt = 0;        // then, towards the direction [rad]
  double rear_share = 0;  // then, drop of the rear edge over that of the front edge
  double foot_share = 0;  // the same at the block's underside, which rotation about a foot does not bring down
  double connected = 1;   // then, mass of the block over the mass of all upper bodies
  double drop = 0;        // then, of the block's mass centre [m]
  double moved = 0;       // at the end, share of the moving mass that has come down
  // the way the block leans then, if it topples; else the way the mass centre moved, NaN below half a metre [rad]
  double azimuth = 0;
  bool is_azimuth_of_lean = false;
  Vec3 run;                 // of the mass centre until the end, horizontal [m]
  std::vector<Fall> falls;  // of structures that stand apart, where there are several
  // at rest, or so far down that what is still to come does not change the name, or swaying less than it did
  bool is_final = false;
  bool may_swing_back = false;  // it only leans, and still moves
};

/// Rotation about the axis that leans by a positive angle towards the direction [rad].
double calc_tilt(const Quat& rotation, const Vec3& fall_direction);

/// Of the mass centre of what is to stand: the block or, where that is less than mechanism.coherent_share of the upper
/// mass, `standing`.
Vec3 find_displacement(const BlockFrame&, const Knowledge&);

/// How far what find_displacement() finds is from its place: below 1 it stands. Of its way down over
/// stands.displacement, and its way to a side over that or, if more, over stands.drift of its height, the larger; NaN
/// if it is nowhere.
double calc_away(const BlockFrame&, const Knowledge&);

/// Sets `touchdown`: the first of the block, or else of any upper body, by which the block, or all of it where it is in
/// pieces, has come down by stands.displacement: what falls off a building that still stands does not decide.
void find_deciding_touchdown(MechanismInput&, const Knowledge&);

/// Judges frames; there is at least one.
Mechanism judge_mechanism(const MechanismInput&, const Knowledge&);

/// A verdict that would have been, had little been otherwise.
struct NearVerdict {
  Mechanism as;
  double later = 0;  // judged by so much later, negative: earlier; 0: by another bound [s]
  std::string rule;  // whose bound, and how often its value
  double times = 1;
};

/// Other verdicts near one at a touchdown or at rest, each name once: judged up to 0.1 s earlier or later, as frames
/// tell, nearest first; else with the bound of one rule a tenth lower or higher.
std::vector<NearVerdict> find_near_verdicts(const MechanismInput&, const Knowledge&);

/// What was found of structures that stand apart, one verdict for all: "wrong direction" if one falls there, else that
/// in which all agree, else "partial". Numbers are those of the one that falls in the wrong direction, else of the
/// first.
///   names, verdicts, masses  of the structures, as long as each other
Mechanism join_mechanisms(const std::vector<std::string>& names, const std::vector<Mechanism>& verdicts,
                          const std::vector<double>& masses);

}  // namespace topple::collapse
