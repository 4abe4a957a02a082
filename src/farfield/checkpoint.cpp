#include "farfield/checkpoint.h"

#include <algorithm>

#include "base/checkpoint.h"

namespace topple::farfield {

namespace {

constexpr const char* kKind = "topple-fe-checkpoint-7";

/// The parts of a view that the finite elements fill.
template <class Io, class View>
void pass_view(Io& io, View& v) {
  io(v.time), io(v.X_WB), io(v.centre), io(v.v_WB), io(v.w_WB), io(v.mass), io(v.element_state), io(v.utilisation),
      io(v.rotation);
  io(v.shortening), io(v.joint_force), io(v.joint_moment), io(v.joint_released);
  io(v.ground_force), io(v.contact_force_ground), io(v.body_contacts), io(v.energy);
}

template <class Io, class Happening>
void pass_happening(Io& io, Happening& h) {
  io(h.kind), io(h.time), io(h.index), io(h.other), io(h.reason), io(h.speed), io(h.landing);
}

template <class Io, class State>
void pass_state(Io& io, State& s) {
  io(s.next_frame), io(s.offset), io(s.quiet_since), io(s.swings_since), io(s.swing.most_speed), io(s.swing.path),
      io(s.swing.has_turned), io(s.swing.is_short), io(s.next_firing), io(s.is_settling), io(s.zone_state),
      io(s.has_touched);
  io(s.skipped), io(s.unsettled), io(s.relaxation.converged), io(s.relaxation.steps), io(s.relaxation.residual);
  io(s.relaxation.settlement), io(s.relaxation.text), io(s.ledger), io(s.energy_error), io(s.released), io(s.wall_time);
  io(s.early_damage.landing), io(s.early_damage.is_damaged), io(s.has_fragments), io(s.fragments_time),
      io(s.fragments.damaged_strain), io(s.fragments.reach);
  io(s.fragments.zones), io(s.fragments.fragments);
}

}  // namespace

bool Swing::has_passed(const Vec3& place) const {
  if (path.empty()) return false;
  const Vec3 way = place - path.front();
  return std::any_of(path.begin(), path.end(),
                     [&](const Vec3& p) { return dot(p - path.front(), way) >= dot(way, way); });
}

void write_checkpoint(const std::string& path, const std::string& key, const RunState& s,
                      const std::vector<std::byte>& system) {
  write_checkpoint_file(path, kKind, key, [&](ArchiveWriter& out) {
    pass_state(out, s);
    out(s.shown.size());
    for (const auto& entry : s.shown) {
      out(entry.index());
      if (const mbs::View* v = std::get_if<mbs::View>(&entry))
        pass_view(out, *v);
      else
        pass_happening(out, std::get<mbs::Happening>(entry));
    }
    out(s.foot_forces);
    out(system);
  });
}

RunState read_checkpoint(const std::string& path, const std::string& key, std::vector<std::byte>& system) {
  CheckpointFile file(path, kKind, key, "plan, mesh, step or version");
  ArchiveReader& in = file.contents();
  RunState s;
  pass_state(in, s);
  size_t count = 0;
  in(count);
  for (size_t i = 0; i < count; ++i) {
    size_t kind = 0;
    in(kind);
    if (kind == 0) {
      mbs::View v;
      pass_view(in, v);
      s.shown.emplace_back(std::move(v));
    } else {
      mbs::Happening h;
      pass_happening(in, h);
      s.shown.emplace_back(std::move(h));
    }
  }
  in(s.foot_forces);
  in(system);
  file.close();
  return s;
}

}  // namespace topple::farfield
