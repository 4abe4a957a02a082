#pragma once
/// The simulation manager: plan and knowledge in, special multibody system out (docs/theory/manager.md).

#include <limits>
#include <string>
#include <vector>

#include "collapse/knowledge.h"
#include "collapse/schedule.h"
#include "mbs/model.h"
#include "product/plan.h"
#include "record/record.h"

namespace topple::collapse {

/// What a body of the model is in the plan.
struct BodyEntry {
  std::string name, kind;  // as in record::BodyInfo
  int storey = 0;
  bool is_upper = false;                 // belongs to the upper block of its structure: everything that moves but the
                                         // ground storey's columns and walls, and a shaft below its lowest mouth
  std::vector<record::BoxShape> shapes;  // members as built, in B
  int structure = 0;                     // index into ModelMap::structures; -1: no charge acts on it
  double volume = 0;                     // of its material, without what charges throw out [m³]
};

/// What a connection of the model is in the plan.
struct ZoneEntry {
  std::string name, member, subsystem;  // as in record::ZoneInfo
  int body_a = -1, body_b = -1;
  Vec3 p_W;
  double firing_time = std::numeric_limits<double>::infinity();     // of the charge that acts on it [s]
  double weakening_time = std::numeric_limits<double>::infinity();  // of one that leaves part of the concrete [s]
};

/// What an event of the model is in the plan.
struct EventEntry {
  int stage = 0, charge = 0;  // indices into the plan
  std::string member;
  double time = 0;            // [s]
  double debris_mass = 0;     // dropped from the model [kg]
  double kept = 0;            // share of the concrete that stays
  bool is_aftermath = false;  // the concrete leaving, after the charge itself
  std::string note;           // of an event that is no charge: what is told of it
};

/// A length of a member that a charge destroys; it leaves the model when the charge fires.
struct DebrisEntry {
  std::string member;
  int storey = 0;
  double mass = 0;    // [kg]
  Vec3 centre, half;  // box before that, along W's axes but for ... [m]
  double time = 0;    // [s]
  double turn = 0;    // ... its turn about W's z [rad]
  double volume = 0;  // of its material; boxes of a ring overlap [m³]
};

/// A ground-storey column as a hinge for the block above it.
struct GroundColumn {
  std::string member;
  Vec3 p_foot, p_top;              // zone I and zone II, in W [m]
  bool is_fired = false;           // a charge on it fires in this plan
  double normal_force = 0;         // estimate under dead load, tension positive [N]
  mbs::RotationalElement element;  // of zone II
  int body = -1;                   // that it carries
};

/// What stands by itself, joined to nothing else but the ground, and is judged by itself.
struct StructureEntry {
  std::string name;  // of a shaft, or of the first of its members
  double mass = 0;   // that moves [kg]
};

/// What a charge leaves of a ground column under its joint, once the concrete is thrown out.
struct StubEntry {
  std::string member;
  int zone = -1;      // index into the record's zones
  double time = 0;    // from which it is one [s]
  double length = 0;  // [m]
  double peak = 0;    // shortening at its compressive strength [m]
};

struct ModelNote {
  std::string title, text;  // a sentence or two
};

/// What a beam or slab bears of its dead load at the most, with hinges at both ends and in the middle of its span.
struct SpanMargin {
  std::string member;
  double margin = 0;  // capacity over demand
};

/// Ties between plan and model. B bodies, E zone elements, R rotational elements, J joints.
struct ModelMap {
  std::vector<BodyEntry> bodies;       // (B)
  std::vector<ZoneEntry> elements;     // (E)
  std::vector<ZoneEntry> rotationals;  // (R)
  std::vector<ZoneEntry> joints;       // (J)
  std::vector<EventEntry> events;      // as Model::events
  std::vector<DebrisEntry> debris;
  std::vector<StubEntry> stubs;
  std::vector<GroundColumn> ground_columns;
  std::vector<SpanMargin> spans;               // beams along x and slabs between them; the lowest first
  std::vector<StructureEntry> structures{{}};  // that charges act on, or all if none does; the heaviest first
  std::vector<std::string> stages;             // a line for each stage of the plan
  std::vector<Firing> schedule;                // failing charges included
  std::vector<ModelNote> notes;                // what the manager had to decide
  std::vector<ModelNote> remarks;              // what of the plan's charges has no effect
  Vec3 fall_direction{-1, 0, 0};  // planned, horizontal unit vector; away from the remaining supports if unplanned
  Vec3 hinge_axis{0, -1, 0};      // rotation about it by a positive angle leans towards fall_direction
  bool is_direction_planned = false;
  bool hinge_about_y = true;        // heads of ground columns turn about W's y, else about its x
  double ground_storey_height = 0;  // [m]
  double mass = 0;                  // of all bodies [kg]
  double moving_mass = 0;           // without fixed ones [kg]
  std::vector<std::string> note_texts() const;
  size_t count_weak_spans() const;  // that bear less than their dead load
};

/// A warning (W513) where a span bears less than its dead load, at the member that bears least of it.
std::vector<Diagnostic> complain_of_spans(const product::Plan&, const ModelMap&);

/// Whether the grid's x is nearer to a horizontal direction than its y; x also where both are as near, to round-off.
bool is_along_x(const Vec3&);

/// About which axis of the grid the heads of ground columns turn: that of the fall, or the other one.
enum class Heads { OfTheFall, Across };

/// Builds the model. Throws InputError for plans that cannot be built, naming the member.
///   threads  for the resistance curves; the model does not depend on it
mbs::Model make_model(const product::Plan&, const Knowledge&, ModelMap& map, int threads = 1, Heads = Heads::OfTheFall);

/// Mass of everything that stands before the first charge: members and floor loads [kg].
double calc_standing_mass(const product::Plan&);

}  // namespace topple::collapse
