#pragma once
/// Resistance characteristic curves in the form of the multibody system (docs/theory/manager.md, section 3).

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "collapse/knowledge.h"
#include "mbs/model.h"
#include "nearfield/rcc.h"

namespace topple::collapse {

/// Length of the zone at a member's end [m].
///   depth  of the section in the plane of bending [m]; clear_length  between the faces of the joints [m]
double calc_zone_length(const product::Section&, const product::Concrete&, const product::Steel&, double depth,
                        double clear_length, const Knowledge&);

/// Effective breadth of a slab on one side of a beam's web, EN 1992-1-1, 5.3.2.1, as of an inner span [m].
///   half_gap  half of the clear distance to the next beam [m]; span  clear, of the beam [m]
double calc_flange_breadth(double half_gap, double span);

/// Curves and laws by all the numbers that they follow from: what many models of one plan share.
struct KnownCurves {
  std::map<std::string, std::shared_ptr<const nearfield::Rcc>> zones;
  std::map<std::string, mbs::SharedLaw> laws;
  /// A law and its multiple, by the law's identity and the factor.
  struct Multiple {
    mbs::SharedLaw one, many;
  };
  std::map<std::pair<const void*, double>, Multiple> multiples;
};

/// Computes each distinct zone once, on several threads.
class ZoneLibrary {
 public:
  /// `known` is looked at before a curve is made; may be null.
  explicit ZoneLibrary(const KnownCurves* known = nullptr) : known_(known) {}
  /// Notes a zone; equal inputs give equal numbers.
  int request(const nearfield::ZoneInput&);
  /// Computes what was requested since the last call. Throws InputError.
  void compute(int threads);
  const nearfield::Rcc& rcc(int zone) const { return *rccs_[static_cast<size_t>(zone)]; }
  const nearfield::ZoneInput& input(int zone) const { return inputs_[static_cast<size_t>(zone)]; }
  size_t size() const { return inputs_.size(); }
  void collect(KnownCurves&) const;
  /// The numbers that a zone follows from.
  const std::string& key(int zone) const { return *keys_[static_cast<size_t>(zone)]; }

 private:
  const KnownCurves* known_;
  std::map<std::string, int> numbers_;
  std::vector<const std::string*> keys_;
  std::vector<nearfield::ZoneInput> inputs_;
  std::vector<std::shared_ptr<const nearfield::Rcc>> rccs_;
};

/// Appends the bytes of a number.
void append_bytes(std::string& to, double v);

/// Where a zone's plastic rotation begins: at first yield, so that a building at rest does not yield, or where the
/// curve leaves the element's line, so that an element with the stiffness of the uncracked section follows all of it.
enum class PlasticFrom { Yield, Cracking };

/// Axes whose bending a law resists; about the other one it is elastic.
enum class Bending { Both, Y, Z };

/// Law of a zone whose element carries the elasticity of the member with the bending stiffnesses EI [N·m²]: what an
/// elastic zone of the same length would turn is taken out of the rotations, docs/theory/manager.md (1).
mbs::ZoneLaw make_zone_law(const nearfield::Rcc&, double EI_y, double EI_z, const std::string& name, const Knowledge&,
                           PlasticFrom = PlasticFrom::Yield, Bending = Bending::Both);

/// How the end of a member cracks under a normal force [N], docs/theory/manager.md (1a): families of a zone of this
/// length for moments > 0 and < 0, bending stiffness EI of the uncracked section and at first yield [N·m²], and the
/// length over which an end is as stiff as EI [m].
mbs::Cracking make_cracking(const nearfield::MomentFamily& positive, const nearfield::MomentFamily& negative,
                            double zone_length, double normal_force, double EI, double EI_at_yield, double length);
/// Rotation that cracks add at a moment > 0 that grows for the first time [rad].
double calc_crack_rotation(const mbs::Cracking&, double moment);

/// What a zone's moments about y and z are times, and its rotations over (docs/theory/manager.md (1d)).
struct Lever {
  double moment_y = 1, moment_z = 1, rotation = 1;
  auto operator<=>(const Lever&) const = default;
};

/// The law of a zone that bends with this lever. What is not bending stays.
mbs::SharedLaw scale_lever(const mbs::SharedLaw&, const Lever&);
///   moment, rotation  of the lever, about the axis of the cracks
mbs::Cracking scale_lever(mbs::Cracking, double moment, double rotation);

/// The law of a length that a charge did not wholly destroy. The zone breaks when it is crushed through; behind that
/// its curve is that of the ends which meet then.
///   weak  of what is left of the length;  length  destroyed [m];  thickness  of the member, from whose ends it is off
///   when it has slid so far [m];  beside  of the member as it was there
mbs::ZoneLaw make_partial_law(mbs::ZoneLaw weak, double length, double thickness, const mbs::ZoneLaw& beside);

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
