#include "mbs/snapshot.h"

#include "base/archive.h"
#include "base/hash.h"
#include "mbs/model_json.h"
#include "mbs/system.h"

namespace topple::mbs {

namespace {

struct Writer : BasicArchiveWriter<std::vector<std::byte>> {
  using BasicArchiveWriter::operator();
  template <class T>
  void operator()(const LaneArray<T>& x) {
    (*this)(x.size());
    for (size_t i = 0; i < x.size(); ++i) (*this)(x[i]);
  }
};

struct Reader : ArchiveReader {
  explicit Reader(const std::vector<std::byte>& bytes)
      : ArchiveReader(bytes, "E620", "these bytes are not a snapshot of this model") {}
  using ArchiveReader::operator();
  template <class T>
  void operator()(LaneArray<T>& x) {
    x.resize(take_count(sizeof(T)));
    for (size_t i = 0; i < x.size(); ++i) {
      T item;
      (*this)(item);
      x[i] = item;
    }
  }
};

/// Every member of the state and what the next step takes over from this one.
template <class Archive, class S, class C>
void visit(Archive& ar, S& s, C& sys) {
  ar(s.step_index), ar(s.time), ar(s.step), ar(s.time_base), ar(s.index_base), ar(s.last_kick), ar(s.review_times),
      ar(s.live_elements), ar(s.live_at_review), ar(s.set_step_doubted), ar(s.first_kick), ar(s.has_rest),
      ar(s.next_event), ar(s.waiting), ar(s.trigger_values);
  ar(s.body), ar(s.p), ar(s.v), ar(s.L), ar(s.w), ar(s.q), ar(s.R), ar(s.p_offset);
  ar(s.shapes), ar(s.crushed_boxes), ar(s.ground_points), ar(s.touched_ground), ar(s.ground_clear), ar(s.ground_box),
      ar(s.force_parts);
  ar(s.element), ar(s.rotational), ar(s.joint), ar(s.cable);
  ar(s.spring), ar(s.torsion), ar(s.bushing), ar(s.load);
  ar(s.pairs), ar(s.pair_due), ar(s.held_pairs), ar(s.pair_clock), ar(s.pair_fast), ar(s.clock), ar(s.is_fast),
      ar(s.travel), ar(s.search_velocity), ar(s.allowance), ar(s.tied_to_ground), ar(s.search_due), ar(s.links_due),
      ar(s.touched_pairs);
  ar(s.touching.steps), ar(s.touching.body), ar(s.touching.group), ar(s.touching.rows), ar(s.touching.a),
      ar(s.touching.b), ar(s.touching.groups), ar(s.touching.points), ar(s.touching.share), ar(s.touching.together),
      ar(s.touching.held), ar(s.touching.jointed_pairs), ar(s.touching.held_block), ar(s.touching.held_fields),
      ar(s.touching.jointed_clusters), ar(s.touching.meetings), ar(s.touching.meeting_rows),
      ar(s.touching.joint_answers);
  ar(s.removed), ar(s.contact_energy), ar(s.stick_energy), ar(s.contact_loss), ar(s.contact_loss_power),
      ar(s.friction_work), ar(s.friction_power), ar(s.total_at_start), ar(s.stored_at_start);
  ar(s.gravity_at_start), ar(s.largest_residual), ar(s.released), ar(s.largest_drift), ar(s.quiet_steps);
  ar(sys.force), ar(sys.torque), ar(sys.joint_force), ar(sys.joint_torque), ar(sys.element_history);
  ar(sys.ground_reaction), ar(sys.ground_contact), ar(sys.body_contacts);
}

constexpr std::uint64_t kMagic = 0x46534e41504f54ULL;  // "TOPANSF"

/// What of the system's scratch the next step takes over, under the same names.
struct Carried {
  LaneArray<Vec3> force, torque, joint_force, joint_torque;
  std::vector<double> element_history;
  Vec3 ground_reaction, ground_contact;
  int body_contacts = 0;
};

/// A fingerprint of the model and the step.
const std::string& identity_of(System& system) {
  if (system.identity.empty())
    system.identity = calc_sha256(to_json(system.model) + std::to_string(system.summary.step));
  return system.identity;
}

}  // namespace

namespace {

void write_state(Writer& w, System& system) {
  system.save_elements();
  visit(w, system.state, system);
}

void read_state(Reader& r, System& system) {
  State state;
  Carried carried;
  visit(r, state, carried);
  if (!r.is_done()) r.refuse("they are too many");
  system.state = std::move(state);
  system.force = std::move(carried.force);
  system.torque = std::move(carried.torque);
  system.joint_force = std::move(carried.joint_force);
  system.joint_torque = std::move(carried.joint_torque);
  system.adopt_step();
  system.restore_elements(carried.element_history);
  system.ground_reaction = carried.ground_reaction;
  system.ground_contact = carried.ground_contact;
  system.body_contacts = carried.body_contacts;
  system.clusters_due = true;
  system.contact.boxes.clear();
  system.contact.search.has_links = false;
  system.started = true;
  system.trouble.clear();
}

}  // namespace

std::vector<std::byte> write_state(System& system) {
  Writer w;
  write_state(w, system);
  return std::move(w.bytes);
}

void read_state(const std::vector<std::byte>& bytes, System& system) {
  Reader r(bytes);
  read_state(r, system);
}

std::vector<std::byte> write_snapshot(System& system) {
  Writer w;
  w(kMagic);
  const std::string& identity = identity_of(system);
  w(identity);
  w(system.joint_notes);
  const Summary& s = system.summary;
  w(s.notes);
  w(s.shortest_step), w(s.step_needed), w(s.highest_frequency);
  write_state(w, system);
  return std::move(w.bytes);
}

void read_snapshot(const std::vector<std::byte>& bytes, System& system) {
  Reader r(bytes);
  std::uint64_t magic = 0;
  std::string identity;
  r(magic);
  if (magic != kMagic) r.refuse("they are of another kind");
  r(identity);
  if (identity != identity_of(system)) r.refuse("they are of another model or step");
  std::vector<std::pair<int, int>> joint_notes;
  Summary s = system.summary;
  std::vector<std::string> notes;
  r(joint_notes), r(notes);
  r(s.shortest_step), r(s.step_needed), r(s.highest_frequency);
  read_state(r, system);
  s.notes = std::move(notes);
  system.summary = std::move(s);
  system.joint_notes = std::move(joint_notes);
}

}  // namespace topple::mbs
