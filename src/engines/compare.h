#pragma once
/// One model on several engines: how far they are apart and how long they take.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engines/engine.h"
#include "mbs/model.h"
#include "mbs/solver.h"

namespace topple::engines {

/// The largest difference of something from the first engine.
struct Difference {
  double value = 0;  // [m] or [rad]
  int body = -1;     // of the model; -1: none differs
  double time = 0;   // [s]
};

/// What one engine made of the model. T frames that it has in common with the first, B bodies.
struct EngineRun {
  std::string name, version;
  std::vector<Unsupported> unsupported;  // not empty: nothing was run
  mbs::Summary summary;
  int broken = 0;                    // elements, springs, bushings and cables that broke, joints that were released
  Difference position, orientation;  // of bodies [m, rad]
  Difference height;                 // of the centre of all moving mass [m]
  std::vector<Difference> body_position, body_orientation;     // largest of each body (B)
  std::vector<double> time;                                    // [s] (T)
  std::vector<double> position_at, orientation_at, height_at;  // largest then [m, rad, m] (T)
  std::vector<int> position_body, orientation_body;            // of which body (T)
  bool has_run() const { return unsupported.empty(); }
};

struct Comparison {
  double step = 0;              // of engines with fixed steps, a whole share of `interval` [s]
  double interval = 0;          // between the instants compared [s]
  std::vector<EngineRun> runs;  // in the order of the engines
};

/// Runs the model on each engine in turn and compares at the same instants; the first that can take the model is what
/// the others are compared with. Bodies that never move do not count.
///   options  duration, step (0: the native engine's choice), equilibrium; frames at frame_interval
///   report   called before each run with the engine's name; may be empty
/// Engines that cannot take the model are not run; the reader of the result decides what that means.
/// Throws InputError if check_model does.
Comparison compare(const mbs::Model&, mbs::Options, const std::vector<std::unique_ptr<Engine>>&,
                   const std::function<void(const std::string&)>& report = {});

/// The differences over time as a table (RFC 4180): one row for each engine but the first and instant.
std::string to_csv(const mbs::Model&, const Comparison&);
/// The largest difference in position over time, logarithmic, as one SVG picture that needs nothing else; empty if
/// there is nothing to draw.
std::string to_svg(const mbs::Model&, const Comparison&);

}  // namespace topple::engines
