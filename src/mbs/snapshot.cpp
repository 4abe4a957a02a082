#include "mbs/snapshot.h"

#include <cstring>
#include <type_traits>

#include "base/error.h"
#include "mbs/system.h"

namespace topple::mbs {

namespace {

class Writer {
 public:
  template <class T>
  void operator()(const T& x) {
    static_assert(std::is_trivially_copyable_v<T>);
    append(&x, sizeof x);
  }
  template <class T>
  void operator()(const std::vector<T>& x) {
    static_assert(std::is_trivially_copyable_v<T>);
    (*this)(x.size());
    append(x.data(), x.size() * sizeof(T));
  }
  std::vector<std::byte> bytes;

 private:
  void append(const void* from, size_t size) {
    const auto* p = static_cast<const std::byte*>(from);
    bytes.insert(bytes.end(), p, p + size);
  }
};

class Reader {
 public:
  explicit Reader(const std::vector<std::byte>& bytes) : bytes_(bytes) {}
  template <class T>
  void operator()(T& x) {
    take(&x, sizeof x);
  }
  template <class T>
  void operator()(std::vector<T>& x) {
    size_t size = 0;
    (*this)(size);
    if (size > (bytes_.size() - at_) / sizeof(T)) fail();
    x.resize(size);
    take(x.data(), size * sizeof(T));
  }
  bool is_at_end() const { return at_ == bytes_.size(); }
  [[noreturn]] static void fail() { throw InputError("E620", "these bytes are not a snapshot of this model"); }

 private:
  void take(void* to, size_t size) {
    if (size > bytes_.size() - at_) fail();
    if (size > 0) std::memcpy(to, bytes_.data() + at_, size);
    at_ += size;
  }
  const std::vector<std::byte>& bytes_;
  size_t at_ = 0;
};

/// Every member of the state and what the next step takes over from this one.
template <class Archive, class S, class Sys>
void visit(Archive& ar, S& s, Sys& sys) {
  ar(s.step_index), ar(s.time), ar(s.first_kick), ar(s.next_event);
  ar(s.body), ar(s.p), ar(s.v), ar(s.L), ar(s.w), ar(s.q), ar(s.R), ar(s.p_offset);
  ar(s.shapes), ar(s.ground_points), ar(s.touched_ground), ar(s.contact_count);
  ar(s.element), ar(s.rotational), ar(s.joint), ar(s.cable);
  ar(s.pairs), ar(s.p_at_search), ar(s.tied_to_ground), ar(s.search_due), ar(s.last_search), ar(s.touched_pairs);
  ar(s.removed), ar(s.friction), ar(s.contact_energy), ar(s.contact_work), ar(s.contact_power), ar(s.total_at_start);
  ar(s.gravity_at_start), ar(s.largest_residual), ar(s.released), ar(s.largest_drift), ar(s.quiet_steps);
  ar(sys.force), ar(sys.torque), ar(sys.contact_force), ar(sys.contact_torque), ar(sys.joint_force),
      ar(sys.joint_torque), ar(sys.element_force);
  ar(sys.ground_reaction), ar(sys.ground_contact), ar(sys.body_contacts);
}

constexpr std::uint64_t kMagic = 0x31534e41504f54ULL;  // "TOPANS1"

}  // namespace

std::vector<std::byte> write_snapshot(const System& system) {
  Writer w;
  w(kMagic);
  w(system.B), w(system.elements.size()), w(system.joints.size()), w(system.step);
  visit(w, system.state, system);
  return std::move(w.bytes);
}

void read_snapshot(const std::vector<std::byte>& bytes, System& system) {
  Reader r(bytes);
  std::uint64_t magic = 0;
  size_t bodies = 0, elements = 0, joints = 0;
  double step = 0;
  r(magic), r(bodies), r(elements), r(joints), r(step);
  if (magic != kMagic || bodies != system.B || elements != system.elements.size() || joints != system.joints.size() ||
      step != system.step)
    Reader::fail();
  State state;
  visit(r, state, system);
  if (!r.is_at_end()) Reader::fail();
  system.state = std::move(state);
  system.clusters_due = true;
}

}  // namespace topple::mbs
