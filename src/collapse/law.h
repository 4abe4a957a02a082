#pragma once
/// Resistance characteristic curves in the form of the multibody system (docs/theory/manager.md, section 3).

#include <map>
#include <string>
#include <vector>

#include "collapse/knowledge.h"
#include "mbs/model.h"
#include "nearfield/rcc.h"

namespace topple::collapse {

/// Length of the zone at a member's end [m].
///   depth  of the section in the plane of bending [m]; clear_length  between the faces of the joints [m]
double calc_zone_length(const product::Section&, const product::Concrete&, const product::Steel&, double depth,
                        double clear_length, const Knowledge&);

/// Computes each distinct zone once, on several threads.
class ZoneLibrary {
 public:
  /// Notes a zone; equal inputs give equal numbers.
  int request(const nearfield::ZoneInput&);
  /// Computes what was requested since the last call. Throws InputError.
  void compute(int threads);
  const nearfield::Rcc& rcc(int zone) const { return rccs_[static_cast<size_t>(zone)]; }
  const nearfield::ZoneInput& input(int zone) const { return inputs_[static_cast<size_t>(zone)]; }
  size_t size() const { return inputs_.size(); }

 private:
  std::map<std::string, int> known_;
  std::vector<nearfield::ZoneInput> inputs_;
  std::vector<nearfield::Rcc> rccs_;
};

/// Where a zone's plastic rotation begins: at first yield, so that a building at rest does not yield, or where the
/// curve leaves the element's line, so that an element with the stiffness of the uncracked section follows all of it.
enum class PlasticFrom { Yield, Cracking };

/// Law of a zone whose element carries the elasticity of the member with the bending stiffnesses EI [N·m²]: what an
/// elastic zone of the same length would turn is taken out of the rotations, docs/theory/manager.md (1).
mbs::ZoneLaw make_zone_law(const nearfield::Rcc&, double EI_y, double EI_z, const std::string& name, const Knowledge&,
                           PlasticFrom = PlasticFrom::Yield);

/// Law of the bars that a charge leaves; nothing at all if there are none.
mbs::ZoneLaw make_cage_law(const nearfield::ResidualCage&, double destroyed_length, const std::string& name,
                           const Knowledge&);

/// Law of a slab's hinge line. Axes: x across the line, z up.
///   width  of the hinge line [m]
mbs::ZoneLaw make_slab_law(const nearfield::PanelRcc&, double width, double kept, const std::string& name,
                           const Knowledge&);

/// Law of the joint between a wall and the beam above it. Axes: x up, y along the wall.
///   width  net length of the wall without its openings [m]; height  clear [m]
mbs::ZoneLaw make_wall_law(const nearfield::PanelRcc&, double width, double height, double kept,
                           const std::string& name, const Knowledge&);

}  // namespace topple::collapse
