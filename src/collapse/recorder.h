#pragma once
/// Turns an engine's frames and happenings into a record.

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "base/archive.h"
#include "collapse/manager.h"
#include "collapse/mechanism.h"
#include "collapse/run.h"
#include "collapse/vibration.h"
#include "mbs/crushed_boxes.h"

namespace topple::collapse {

/// Forces on the ground are means over so long: single peaks of rigid parts on rigid ground mean nothing [s].
inline constexpr double kForceWindow = 0.05;

/// Mean force over a window.
struct MeanForce {
  double force = 0;   // [N]
  double time = 0;    // middle of the window [s]
  double window = 0;  // kForceWindow, or the interval between frames there if that is more [s]
};
/// The largest mean over a window of a force whose impulse since the start is known at some times, on straight lines
/// between. All 0 with fewer than two.
MeanForce find_largest_mean(const std::vector<double>& time, const std::vector<double>& impulse);

/// State of the zones at one frame, for the margins.
struct ZoneFrame {
  double time = 0;
  double utilisation = 0;  // largest of the zones that no charge has acted on and that are not broken
  int zone = -1;           // index into Record::zones
  int yielded = 0, broken = 0;
};

class Recorder {
 public:
  /// `map` must belong to the model; for a bare model see describe_model.
  Recorder(const mbs::Model&, const ModelMap&, const Knowledge&, record::Record&, const RunCallbacks&);

  /// Keeps the velocities of the bodies at all frames, which find_shaking needs; before the first frame.
  void keep_speeds() { keeps_speeds_ = true; }
  void add_frame(const mbs::View&);
  void add_happening(const mbs::Happening&);
  void add_event(record::Event);
  /// One that is known beforehand: the callback is told of it in its turn.
  void add_coming_event(record::Event);
  /// Series and events are complete after this.
  void finish();
  /// Goes on where another recorder of the same bodies was at a time; its frames and events stay there.
  void follow(const Recorder& before, double until);
  /// Takes a view for the last frame, which it is not recorded as.
  void look(const mbs::View&);
  double last_time() const { return last_time_; }  // of the last frame [s]
  /// Takes over the first frames of another recorder of the same bodies, and its events up to a time. Debris is that of
  /// this one's map.
  void append(const Recorder& from, size_t frames, double until);
  /// Frames, events, samples of outputs and what else is known so far, for going on in another process with a recorder
  /// of the same model.
  void write(ArchiveWriter&) const;
  void read(ArchiveReader&);

  /// Of a structure of the map, the heaviest unless said otherwise.
  const std::vector<BlockFrame>& block_frames(size_t structure = 0) const { return block_[structure]; }
  /// At each frame that of the structure whose block is farthest from its place, with the fastest part of all.
  ///   counts  which structures are looked at, one at least; empty: all (structures)
  std::vector<BlockFrame> farthest_block_frames(const std::vector<bool>& counts = {}) const;
  const std::vector<ZoneFrame>& zone_frames() const { return zone_frames_; }
  double first_touchdown() const { return first_.time; }  // of an upper body; NaN if none [s]
  /// Of its upper bodies, rising; those of the block alone (Touchdown::is_of_block) or of all [s].
  std::vector<double> upper_touchdowns(size_t structure, bool of_block) const;
  std::string first_touchdown_body() const {
    return first_.body < 0 ? std::string() : map_.bodies[static_cast<size_t>(first_.body)].name;
  }
  double first_touchdown_kinetic() const { return first_.kinetic; }         // energy of all that moves [J]
  const std::vector<Touchdown>& touchdowns() const { return touchdowns_; }  // one of each moving part, as they happen
  const Speeds& speeds() const { return speeds_; }                          // empty unless kept
  double start_reaction_error() const { return reaction_error_; }  // |reaction - weight| / weight at the first frame
  /// Of the ground on what moves, along its normal, from the balance of momentum; loads of the model are part of it.
  MeanForce find_largest_ground_force() const { return find_largest_mean(record_.time, impulse_); }
  /// Plastic shortening of a zone at the last frame; that of a stub never falls [m].
  double shortening_of(int zone) const {
    return zone < 0 || static_cast<size_t>(zone) >= shortening_.size() ? 0 : shortening_[static_cast<size_t>(zone)];
  }

 private:
  template <class Io, class R>
  static void pass(Io&, R&);
  /// To the callback.
  void tell_coming(double until);
  record::Series& series(size_t i) { return record_.series[i]; }
  std::vector<BlockFrame> calc_blocks(const mbs::View&);
  /// Ends of what is drawn that recede as members are crushed.
  void find_crushed_ends();
  void let_ends_recede(const mbs::View&);
  /// As they were in another recorder at a time; ends that it does not have keep their lengths.
  void take_crushed_ends(const Recorder& from, double until);
  void put_crushed_ends();
  void put_pose(const Pose&);
  void put_debris(double time);
  const ZoneEntry& entry_of(int element) const;
  /// The stub that a zone is, if it is shortened beyond its strength and holds together.
  const StubEntry* find_crushed_stub(size_t zone, const mbs::View&) const;

  const mbs::Model& model_;
  const ModelMap& map_;
  const Knowledge& k_;
  record::Record& record_;
  const RunCallbacks& callbacks_;
  std::vector<record::Event> coming_;  // not told yet, in the order of time
  std::vector<Pose> start_;
  std::vector<std::vector<BlockFrame>> block_;  // of each structure
  std::vector<double> apart_since_;             // of upper bodies that came down before their block; else infinite (B)
  std::vector<std::uint8_t> is_of_block_;       // at the last frame, or one of pieces (B); empty: not known
  std::vector<ZoneFrame> zone_frames_;
  std::vector<double> shortening_;        // of the last frame
  std::vector<mbs::CrushedBox> crushed_;  // of the last frame, as Record::crushed_ends; shapes as drawn
  std::vector<int> fixed_joints_;
  std::vector<std::pair<double, int>> stages_told_;  // when, which
  std::vector<std::uint8_t> states_before_;          // of the zones at the last frame of the recorder followed
  std::vector<Vec3> last_v_;                         // of the bodies at the last frame
  double last_time_ = 0;
  std::vector<Touchdown> touchdowns_;
  Touchdown first_{std::numeric_limits<double>::quiet_NaN()};  // of an upper body
  bool keeps_speeds_ = false;
  Speeds speeds_;
  double reaction_error_ = 0;
  double impulse_until_now_ = 0;       // of the ground, until the last view [N·s]
  std::vector<double> impulse_;        // at each frame
  std::vector<double> contacts_told_;  // when [s]
};

/// Where blasted concrete is: it falls freely onto the ground.
Pose calc_debris_pose(const DebrisEntry&, double gravity, double time);

/// Entries for a model that comes from a file.
ModelMap describe_model(const mbs::Model&);

}  // namespace topple::collapse
