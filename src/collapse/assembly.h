#pragma once
/// Rigid parts of the building: boxes along W's axes with their masses, before and after pieces are cut out.

#include <functional>
#include <string>
#include <vector>

#include "collapse/knowledge.h"
#include "mbs/model.h"
#include "product/plan.h"
#include "record/record.h"

namespace topple::collapse {

/// Box of a member, edges along W's axes at the start, but for a turn about z.
struct Part {
  Vec3 centre, half;  // in W [m]
  double mass = 0;    // [kg]
  int member = -1;    // index into Plan::members
  std::string material = "concrete";
  double turn = 0;       // about W's z [rad]
  bool is_solid = true;  // false: weight only, nothing that touches or is drawn
};

/// Parts that form one rigid body.
struct Assembly {
  std::string name, kind;
  int storey = 0;
  bool fixed = false;
  std::vector<Part> parts;

  double mass() const {
    double m = 0;
    for (const Part& p : parts) m += p.mass;
    return m;
  }
};

Part make_part(const Vec3& low, const Vec3& high, double mass, int member, const std::string& material = "concrete");

/// Body with its frame in the centre of mass and along W; contact shapes lie contact.gap inside the parts.
mbs::Body make_body(const Assembly&, const Knowledge&);

/// The parts as they are drawn, in the frame of a body at p_WB along W.
std::vector<record::BoxShape> make_shapes(const Assembly&, const Vec3& p_WB, const product::Plan&);

constexpr double kSliver = 0.01;  // shorter pieces of a member go with a cut beside them [m]

/// Takes the length [from, to] along W's axis `axis` (0..2) out of the parts of a member and returns what was taken. A
/// hundredth of a metre is left of a body that would vanish.
///   applies  which of the member's parts; none given: all
std::vector<Part> cut_member(Assembly&, int member, int axis, double from, double to,
                             const std::function<bool(const Part&)>& applies = {});

/// Boxes of a wall around its openings. `mass` is shared by volume.
///   along_x  whether the wall runs along x; clear_a, clear_b  from the axis to the faces of the columns at its ends
///   [m]
std::vector<Part> make_wall_parts(const product::Member&, int index, double thickness, double mass, bool along_x,
                                  double clear_a, double clear_b, const std::string& material);

}  // namespace topple::collapse
