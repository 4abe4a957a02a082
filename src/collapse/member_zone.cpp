#include "collapse/member_zone.h"

#include "base/error.h"
#include "collapse/builder.h"
#include "mbs/solver.h"

namespace topple::collapse {

MemberZone find_member_zone(const product::Plan& plan, const Knowledge& knowledge, int index, bool at_end,
                            int threads) {
  const product::Member& m = plan.members[static_cast<size_t>(index)];
  const bool is_column = m.kind == product::MemberKind::Column;
  if (!is_column && m.kind != product::MemberKind::Beam)
    throw InputError("E624", m.name + " is neither a column nor a beam", "zones with resistance curves are in those");
  if (m.removed) throw InputError("E624", m.name + " is taken out in the preparation");
  ModelMap map;
  Builder builder(plan, knowledge, map, threads);
  builder.build();
  const MemberZones& zones = builder.zones.at(index);
  const size_t which = at_end ? 1 : 0;
  MemberZone out;
  out.name = m.name + ", " + (is_column ? (at_end ? "top" : "foot") : (at_end ? "end" : "start"));
  out.input = builder.library.input(zones.station[which].zone);
  out.normal_force = zones.normal_force;
  // a ground column's top is a joint; its foot has the same force and the shaft's weight
  const int element = zones.element[which] >= 0 ? zones.element[which] : zones.element[0];
  mbs::Simulation simulation(builder.model, {});
  out.is_estimate = element < 0 || !simulation.find_equilibrium(out.message);
  if (!out.is_estimate) out.normal_force = -simulation.calc_view().element_force[static_cast<size_t>(element)].x;
  return out;
}

}  // namespace topple::collapse
