// The state as bytes.
#include "base/archive.h"
#include "fem/explicit_inside.h"

namespace topple::fem {

namespace {

constexpr std::uint64_t kMark = 0x7470'6578'0000'0013;  // name and version of the layout

/// One list of members for writing and reading.
template <class Archive, class State>
void pass_state(Archive& archive, State& s) {
  archive(s.steps), archive(s.begins), archive(s.rows), archive(s.elements), archive(s.cracks), archive(s.live),
      archive(s.flags);
  archive(s.pushes), archive(s.pushed), archive(s.grounded), archive(s.uses), archive(s.sums);
  archive(s.particles), archive(s.particle_pushes), archive(s.particle_makes);
  archive(s.touches), archive(s.ground_touching), archive(s.ground_work), archive(s.surface_work), archive(s.held),
      archive(s.held_work);
  archive(s.ground_forces), archive(s.debris_forces), archive(s.touchdowns), archive(s.removals);
  archive(s.whole_mass), archive(s.debris_mass);
  archive(s.removed_internal), archive(s.removed_kinetic), archive(s.removed_gravity);
  archive(s.bars), archive(s.releases), archive(s.bar_work);
  auto& c = s.contact;
  archive(c.gone), archive(c.near), archive(c.near_particles);
  archive(c.boxes), archive(c.room), archive(c.travel), archive(c.motion), archive(c.particle_speed);
  archive(c.removed), archive(c.fresh);
  archive(c.knocked), archive(c.since), archive(c.touching), archive(c.debris), archive(c.searches);
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
  BasicArchiveWriter<std::vector<std::byte>> out;
  out(kMark), out(describe(in));
  pass_state(out, in.s);
  out(static_cast<std::uint64_t>(in.s.contact.pairs.size()));
  for (const ContactPair& pair : in.s.contact.pairs)
    out(pair.a), out(pair.b), out(pair.moved), out(pair.until), out(pair.free), out(pair.candidates);
  out(in.start), out(in.start_energy), out(in.started);
  return std::move(out.bytes);
}

void ExplicitSystem::read_snapshot(std::span<const std::byte> bytes) {
  Inside& in = *inside_;
  ArchiveReader from(bytes, "E643", "this is not a snapshot of this model and its options",
                     "start again, or take the plan, options and program that wrote it");
  std::uint64_t mark = 0;
  std::array<double, 8> description{};
  from(mark), from(description);
  if (mark != kMark || description != describe(in)) from.refuse("it is of others");
  ExplicitState s;
  pass_state(from, s);
  std::uint64_t pairs = 0;
  from(pairs);
  for (std::uint64_t i = 0; i < pairs; ++i) {
    ContactPair& pair = s.contact.pairs.emplace_back();
    from(pair.a), from(pair.b), from(pair.moved), from(pair.until), from(pair.free);
    from(pair.candidates);
  }
  std::vector<Vec3> start;
  double start_energy = 0;
  bool started = false;
  from(start), from(start_energy), from(started);
  if (!from.is_done() || start.size() != in.start.size() || s.rows.size() != in.s.rows.size() ||
      s.elements.size() != in.s.elements.size() || s.cracks.size() != in.s.cracks.size() ||
      s.bars.size() != in.s.bars.size() || s.releases.size() != in.s.releases.size())
    from.refuse("its lists have other lengths");
  in.contact_faces.clear();  // of another state
  in.s = std::move(s), in.start = std::move(start), in.start_energy = start_energy, in.started = started;
  in.restore_laws(in.s);
}

}  // namespace topple::fem
