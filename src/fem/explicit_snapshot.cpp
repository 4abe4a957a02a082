// The state as bytes.
#include <cstring>
#include <type_traits>

#include "base/error.h"
#include "fem/explicit_inside.h"

namespace topple::fem {

namespace {

constexpr std::uint64_t kMark = 0x7470'6578'0000'0013;  // name and version of the layout

class Writer {
 public:
  std::vector<std::byte> bytes;
  template <class T>
  void value(const T& x) {
    static_assert(std::is_trivially_copyable_v<T>);
    const auto* from = reinterpret_cast<const std::byte*>(&x);
    bytes.insert(bytes.end(), from, from + sizeof(T));
  }
  template <class T, class A>
  void list(const std::vector<T, A>& v) {
    static_assert(std::is_trivially_copyable_v<T>);
    value(static_cast<std::uint64_t>(v.size()));
    const auto* from = reinterpret_cast<const std::byte*>(v.data());
    bytes.insert(bytes.end(), from, from + v.size() * sizeof(T));
  }
};

class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : bytes_(bytes) {}
  template <class T>
  void value(T& x) {
    static_assert(std::is_trivially_copyable_v<T>);
    take(&x, sizeof(T));
  }
  template <class T, class A>
  void list(std::vector<T, A>& v) {
    std::uint64_t count = 0;
    value(count);
    if (count > bytes_.size() / sizeof(T)) fail();
    v.resize(count);
    take(v.data(), count * sizeof(T));
  }
  [[noreturn]] static void fail() {
    throw InputError("E643", "this is not a snapshot of this model and its options",
                     "start again, or take the plan, options and program that wrote it");
  }
  bool is_empty() const { return bytes_.empty(); }

 private:
  void take(void* to, size_t count) {
    if (count > bytes_.size()) fail();
    if (count > 0) std::memcpy(to, bytes_.data(), count);
    bytes_ = bytes_.subspan(count);
  }
  std::span<const std::byte> bytes_;
};

/// One list of members for writing and reading.
template <class Archive, class State>
void pass_state(Archive& archive, State& s) {
  archive.value(s.steps), archive.value(s.begins), archive.list(s.rows), archive.list(s.elements),
      archive.list(s.cracks), archive.list(s.live), archive.list(s.flags);
  archive.list(s.pushes), archive.list(s.pushed), archive.list(s.grounded), archive.list(s.uses), archive.value(s.sums);
  archive.list(s.particles), archive.list(s.particle_pushes), archive.list(s.particle_makes);
  archive.list(s.touches), archive.value(s.ground_touching), archive.value(s.ground_work),
      archive.value(s.surface_work), archive.list(s.held), archive.value(s.held_work);
  archive.list(s.ground_forces), archive.list(s.debris_forces), archive.list(s.touchdowns), archive.list(s.removals);
  archive.list(s.whole_mass), archive.list(s.debris_mass);
  archive.value(s.removed_internal), archive.value(s.removed_kinetic), archive.value(s.removed_gravity);
  archive.list(s.bars), archive.list(s.releases), archive.value(s.bar_work);
  auto& c = s.contact;
  archive.list(c.gone), archive.list(c.near), archive.list(c.near_particles);
  archive.list(c.boxes), archive.list(c.room), archive.list(c.travel), archive.list(c.motion),
      archive.list(c.particle_speed);
  archive.list(c.removed), archive.value(c.fresh);
  archive.value(c.knocked), archive.value(c.since), archive.value(c.touching), archive.value(c.debris),
      archive.value(c.searches);
}

/// What tells one model and its options from others.
std::array<double, 8> describe(const ExplicitSystem::Inside& in) {
  double sum = 0;
  for (size_t e = 0; e < in.element_mass.size(); ++e) sum += static_cast<double>(e % 97 + 1) * in.element_mass[e];
  return {static_cast<double>(in.model.nodes.size()),
          static_cast<double>(in.model.elements.size()),
          in.h,
          sum,
          static_cast<double>(in.chunks.W),
          static_cast<double>(in.chunks.chunks.size()),  // their size goes by the machine
          static_cast<double>(in.model.grounds.size()),
          static_cast<double>(in.debris_steps)};
}

}  // namespace

std::vector<std::byte> ExplicitSystem::write_snapshot() const {
  const Inside& in = *inside_;
  Writer out;
  out.value(kMark), out.value(describe(in));
  pass_state(out, in.s);
  out.value(static_cast<std::uint64_t>(in.s.contact.pairs.size()));
  for (const ContactPair& pair : in.s.contact.pairs)
    out.value(pair.a), out.value(pair.b), out.value(pair.moved), out.value(pair.until), out.value(pair.free),
        out.list(pair.candidates);
  out.list(in.start), out.value(in.start_energy), out.value(in.started);
  return std::move(out.bytes);
}

void ExplicitSystem::read_snapshot(std::span<const std::byte> bytes) {
  Inside& in = *inside_;
  Reader from(bytes);
  std::uint64_t mark = 0;
  std::array<double, 8> description{};
  from.value(mark), from.value(description);
  if (mark != kMark || description != describe(in)) Reader::fail();
  ExplicitState s;
  pass_state(from, s);
  std::uint64_t pairs = 0;
  from.value(pairs);
  for (std::uint64_t i = 0; i < pairs; ++i) {
    ContactPair& pair = s.contact.pairs.emplace_back();
    from.value(pair.a), from.value(pair.b), from.value(pair.moved), from.value(pair.until), from.value(pair.free);
    from.list(pair.candidates);
  }
  std::vector<Vec3> start;
  double start_energy = 0;
  bool started = false;
  from.list(start), from.value(start_energy), from.value(started);
  if (!from.is_empty() || start.size() != in.start.size() || s.rows.size() != in.s.rows.size() ||
      s.elements.size() != in.s.elements.size() || s.cracks.size() != in.s.cracks.size() ||
      s.bars.size() != in.s.bars.size() || s.releases.size() != in.s.releases.size())
    Reader::fail();
  in.contact_faces.clear();  // of another state
  in.s = std::move(s), in.start = std::move(start), in.start_energy = start_energy, in.started = started;
  in.restore_laws(in.s);
}

}  // namespace topple::fem
