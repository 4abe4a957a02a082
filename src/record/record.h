#pragma once
/// What one run leaves behind. S frames in time, B bodies, Z zones.

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "base/linalg.h"

namespace topple::record {

struct BoxShape {
  Pose X_BS;              // centre of the box in the body's frame
  Vec3 half;              // half edges [m]
  std::string material;   // "concrete", "masonry", "ground"; chooses the colour
  std::string part = {};  // as BodyInfo::kind: what it is of a body that carries slabs and walls; empty: not known
};

/// Whether a body is of a structure that charges act on (of any if there are none), or of one beside it.
enum class Belonging : std::uint8_t { Building = 0, Beside = 1, Unknown = 2 };

struct BodyInfo {
  std::string name;  // unique, e.g. "C-A1-0"
  std::string kind;  // "column", "beam", "slab", "wall", "node", "stump"
  int storey = 0;
  double mass = 0;     // at the start [kg]
  bool fixed = false;  // belongs to the ground
  std::vector<BoxShape> shapes;
  Belonging belongs = Belonging::Building;  // Unknown: read from a record of an earlier version
};

/// An end of a box that recedes as its member is crushed.
struct CrushedEnd {
  int body = 0, shape = 0;  // index into Record::bodies, and into that body's shapes
  int axis = 0;             // of the box: 0 x, 1 y, 2 z
  int side = 1;             // of that axis: 1 or -1
  auto operator<=>(const CrushedEnd&) const = default;
};

enum class ZoneState : std::uint8_t { Elastic = 0, Yielded = 1, Softening = 2, Broken = 3, Fired = 4, Crushed = 5 };

struct ZoneInfo {
  std::string name;              // e.g. "C-D1-0/foot"
  std::string member;            // e.g. "C-D1-0"
  std::string subsystem;         // "revolute joint + rotational element", "six-component element", "rigid joint"
  int body_a = -1, body_b = -1;  // indices into bodies, -1 the ground
  Vec3 p_W;                      // place at the start [m]
};

struct Event {
  double time = 0;      // [s]
  std::string kind;     // "stage", "charge", "yield", "softening", "crushing", "rupture", "release", "touchdown",
                        // "contact", "rest", "cable", "failure"
  std::string subject;  // member or zone
  std::string text;     // a sentence
};

/// A plotted quantity over the frames.
struct Series {
  std::string id;             // "tilt_angle", "ground_force", "mass_centre_height", "energy_kinetic", ...
  std::string title;          // for people, "Tilt angle"
  std::string unit;           // of the values as stored, SI: "rad", "N", "m", "J"
  std::string group;          // series of one group share a plot: "angle", "force", "energy", "height"
  std::vector<double> value;  // (S)
};

/// A quantity that a multibody model asked for, sampled at a rate of its own. T samples, C columns.
struct Output {
  std::string name;                  // unique; also that of its file
  std::string quantity;              // for people: "position of body link1"
  std::string unit, frame;           // SI; "world", or "F" of the joint or element
  std::vector<std::string> columns;  // "x", "y", "z", or one word          (C)
  std::vector<double> time;          // strictly rising [s]                 (T)
  std::vector<double> value;         // NaN: the engine does not say        (T x C)
};

/// NotJudged: kept so far, but what still moved when the run ended may change that.
enum class Status { Info, Good, Warning, Bad, NotJudged };
/// "info", "good", "warning", "bad", "not_judged": the words in files.
std::string_view name_of(Status);

/// One line of the answer, in the order shown to the user.
struct Finding {
  std::string id;       // stable, "mechanism"
  std::string heading;  // section it stands under, e.g. "Mechanism"
  std::string title;    // "Mechanism"
  std::string text;     // a sentence with its numbers and units
  double value = 0;     // the number behind it, SI; NaN when there is none
  std::string unit;
  Status status = Status::Info;
};

struct Provenance {
  std::string title;  // of the plan
  std::string plan_path, plan_text, plan_sha256;
  std::string program_version, engine, machine, created;  // created: ISO 8601, UTC
  std::uint64_t seed = 0;
  double step = 0;       // [s]
  double wall_time = 0;  // of the computation [s]
  int threads = 1;
};

struct Counts {
  int bodies = 0, revolute_joints = 0, rigid_joints = 0, force_elements = 0, cables = 0;
  double mass = 0;  // [kg]
};

/// A key value of the plan shown beside the result, in the units of the plan.
struct KeyValue {
  std::string group, key, value;
};

struct Neighbour {
  std::string name;
  std::vector<std::array<double, 2>> footprint;  // [m]
  bool is_utility = false;
};

struct Record {
  Provenance provenance;
  Counts counts;
  std::vector<KeyValue> plan_values;
  std::vector<BodyInfo> bodies;
  std::vector<ZoneInfo> zones;
  std::vector<CrushedEnd> crushed_ends;  // in rising order
  std::vector<Neighbour> neighbours;
  std::vector<std::array<double, 2>> building_outline;  // before the first charge, counter-clockwise [m]
  // towards which tilts count positive, from +x counter-clockwise; NaN: not known [rad]
  double fall_azimuth = std::numeric_limits<double>::quiet_NaN();

  std::vector<double> time;              // strictly rising [s]              (S)
  std::vector<float> position;           // p_WB of the frame of each body [m] (S x B x 3)
  std::vector<float> orientation;        // unit quaternion w x y z         (S x B x 4)
  std::vector<std::uint8_t> zone_state;  // ZoneState                       (S x Z)
  // demand over capacity, 1 at most of zones that are not elastic; of finite elements stress over first yield stress
  std::vector<float> zone_utilisation;  // (S x Z)
  std::vector<float> crushed_length;    // by which each crushed end has receded, never falling [m] (S x C)
  std::vector<Series> series;
  std::vector<Output> outputs;  // read back in the order of their names
  std::vector<Event> events;
  std::vector<Finding> findings;
  std::vector<std::string> not_modelled;

  std::string ending;       // "at_rest", "time_limit", "cancelled", "failed"; "under_way": it goes on
  std::string ending_text;  // a sentence
};

/// A body in W at a frame.
Pose pose_at(const Record&, std::size_t frame, std::size_t body);
/// A shape of a body as crushing has left it at a frame.
BoxShape shape_at(const Record&, std::size_t frame, std::size_t body, std::size_t shape);

/// Writes one HDF5 file (beside, then renamed). Throws std::runtime_error with the path if it cannot.
void write_hdf5(const Record&, const std::string& path);
/// Reads it back; InputError for files that are not such a record.
Record read_hdf5(const std::string& path);
/// Writes series.csv, events.csv, bodies.csv and findings.csv into a folder.
void write_csv(const Record&, const std::string& folder);
/// Writes outputs/NAME.csv of each output into a folder.
void write_output_csv(const Record&, const std::string& folder);
/// The record as the JSON that the report page reads (docs/record.md, "Report data"). Poses are base64 of little-endian
/// float32.
std::string to_report_json(const Record&);
/// One self-contained HTML page: `bundle` is the built page with the marker <!--TOPPLE-DATA-->.
void write_report(const Record&, const std::string& bundle, const std::string& path);

}  // namespace topple::record
