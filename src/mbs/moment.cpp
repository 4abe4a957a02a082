#include "mbs/moment.h"

namespace topple::mbs {

namespace {

template <class Io, class S>
void pass_summary(Io& io, S& s) {
  io(s.ending), io(s.message), io(s.time), io(s.step), io(s.shortest_step), io(s.step_needed), io(s.steps),
      io(s.highest_frequency), io(s.equilibrium_iterations), io(s.equilibrium_residual), io(s.overloads),
      io(s.energy_error), io(s.joint_drift), io(s.notes), io(s.wall_time);
}

template <class Io, class C>
void pass_course(Io& io, C& c) {
  io(c.frame), io(c.shown), io(c.softened), io(c.quiet_since), io(c.plastic_then), io(c.is_quiet), io(c.doubted),
      io(c.readings), io(c.last_residual), io(c.sampled), io(c.seconds);
}

template <class Io, class M>
void pass_moment(Io& io, M& m) {
  io(m.time), io(m.next_time), io(m.steps), io(m.state), io(m.joint_notes), io(m.noted_pairs), io(m.counts),
      io(m.fired), io(m.laws);
  pass_course(io, m.course);
  pass_summary(io, m.summary);
}

}  // namespace

void write_moment(const Moment& m, ArchiveWriter& out) { pass_moment(out, m); }
void read_moment(ArchiveReader& in, Moment& m) { pass_moment(in, m); }

}  // namespace topple::mbs
