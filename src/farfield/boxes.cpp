#include "farfield/boxes.h"

#include <algorithm>
#include <cmath>

#include "collapse/assembly.h"

namespace topple::farfield {

namespace {

using product::Member;
using product::MemberKind;

/// Half the extent of the column at a grid point of a storey along an axis; 0 without one [m].
double calc_half_column(const product::Plan& plan, int storey, int row, int frame, int axis) {
  for (const Member& m : plan.members) {
    if (m.kind != MemberKind::Column || m.removed || m.storey != storey || m.row_a != row || m.frame_a != frame)
      continue;
    const product::Section& s = plan.sections[static_cast<size_t>(m.section)];
    return 0.5 * (axis == 0 ? s.width : s.height);
  }
  return 0;
}

}  // namespace

int axis_of(const Member& m) { return m.kind == MemberKind::Column ? 2 : m.row_a != m.row_b ? 0 : 1; }

std::vector<Box> make_boxes(const product::Plan& plan) {
  std::vector<Box> boxes;
  for (size_t i = 0; i < plan.members.size(); ++i) {
    const Member& m = plan.members[i];
    if (m.removed) continue;
    const int index = static_cast<int>(i);
    Vec3 half;
    switch (m.kind) {
      case MemberKind::Column: {
        const product::Section& s = plan.sections[static_cast<size_t>(m.section)];
        half = {0.5 * s.width, 0.5 * s.height, 0};
        boxes.push_back({m.start - half, m.end + half, index, 0, {}});
        break;
      }
      case MemberKind::Beam: {
        const product::Section& s = plan.sections[static_cast<size_t>(m.section)];
        half = {0.5 * s.width, 0.5 * s.width, 0.5 * s.height};
        half[axis_of(m)] = 0;
        Box box{m.start - half, m.end + half, index, 1, {}};
        // the ends lie on grid points, inside columns or beams across
        box.is_soft[axis_of(m)][0] = box.is_soft[axis_of(m)][1] = true;
        boxes.push_back(box);
        break;
      }
      case MemberKind::Slab: {
        half.z = 0.5 * plan.panels[static_cast<size_t>(m.panel)].thickness;
        boxes.push_back({m.start - half, m.end + half, index, 2, {}});
        break;
      }
      case MemberKind::Wall: {
        const int axis = axis_of(m);
        for (const collapse::Part& p :
             collapse::make_wall_parts(m, index, plan.panels[static_cast<size_t>(m.panel)].thickness, 1, axis == 0,
                                       calc_half_column(plan, m.storey, m.row_a, m.frame_a, axis),
                                       calc_half_column(plan, m.storey, m.row_b, m.frame_b, axis), "concrete"))
          boxes.push_back({p.centre - p.half, p.centre + p.half, index, 3, {}});
        break;
      }
      case MemberKind::Shaft:
        throw InputError(std::vector<Diagnostic>{{Severity::Error, "E675", m.where, 1,
                                                  m.name + ": shafts are not modelled in finite elements",
                                                  "topple run shows its collapse"}});
    }
  }
  // an edge that lies inside a beam or a column, or where another box of its kind goes on, needs no line
  for (Box& box : boxes) {
    if (box.rank == 0 || box.rank == 3) continue;
    for (int axis = 0; axis < 2; ++axis)
      for (int side = 0; side < 2; ++side) {
        if (box.rank == 1 && axis != axis_of(plan.members[static_cast<size_t>(box.member)])) continue;
        const double at = side == 0 ? box.low[axis] : box.high[axis];
        const int across = 1 - axis;
        bool is_covered = false;
        for (const Box& other : boxes) {
          if (&other == &box || other.rank >= 2) continue;
          is_covered |= other.low[axis] < at - 1e-6 && other.high[axis] > at + 1e-6 &&
                        other.low[across] < box.high[across] - 1e-6 && other.high[across] > box.low[across] + 1e-6 &&
                        other.low.z < box.high.z - 1e-6 && other.high.z > box.low.z + 1e-6;
        }
        box.is_soft[axis][side] = is_covered;
      }
  }
  return boxes;
}

std::vector<DestroyedLength> find_destroyed_lengths(const product::Plan& plan) {
  std::vector<DestroyedLength> lengths;
  for (size_t s = 0; s < plan.stages.size(); ++s)
    for (size_t c = 0; c < plan.stages[s].charges.size(); ++c) {
      const product::Charge& charge = plan.stages[s].charges[c];
      const Member& m = plan.members[static_cast<size_t>(charge.member)];
      if (charge.residual_concrete > 0 && !charge.fails)
        throw InputError(std::vector<Diagnostic>{
            {Severity::Error, "E675", charge.where, 1,
             m.name + ": in finite elements a charge takes all concrete of its length (residual_concrete)",
             "topple run knows what stays"}});
      const int axis = axis_of(m);
      const double middle = m.start[axis] + charge.position, half = 0.5 * charge.destroyed_length;
      lengths.push_back({static_cast<int>(s), static_cast<int>(c), charge.member, axis,
                         std::max(m.start[axis], middle - half), std::min(m.end[axis], middle + half)});
    }
  return lengths;
}

}  // namespace topple::farfield
