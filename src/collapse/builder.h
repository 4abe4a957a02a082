#pragma once
/// Inside of make_model: bodies first (manager.cpp), then connections (connections.cpp), then events (charges.cpp).

#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "collapse/assembly.h"
#include "collapse/condense.h"
#include "collapse/law.h"
#include "collapse/manager.h"
#include "nearfield/ring.h"

namespace topple::collapse {

/// A place on the grid in the floor above a storey.
struct GridPoint {
  int row = 0, frame = 0, storey = 0;
  auto operator<=>(const GridPoint&) const = default;
};

/// Where inelastic rotation gathers in a member.
struct MemberStation {
  double at = 0;     // from the member's start [m]
  int zone = -1;     // as prepared, in the library
  int damaged = -1;  // beside a fired charge; -1 if none is near
};

/// Columns and beams: what their force elements are made of.
struct MemberZones {
  double clear_length = 0;  // between the faces of the joints [m]
  double clear_start = 0;   // from the member's start to the face [m]
  double normal_force = 0;  // estimate under dead load, tension positive [N]
  std::array<MemberStation, 2> station;
  std::array<Lever, 2> lever;  // of each station of a ground column that turns above its stump
  int element[2] = {-1, -1};   // of each station; the same twice for a whole member
  int rotational = -1;         // of station 1 of a ground column
};

/// The station that is nearer to a place along the member [m]; the first one where both are as near, to round-off.
inline int find_nearer_station(const MemberZones& z, double at) {
  return std::abs(at - z.station[1].at) < std::abs(at - z.station[0].at) - 1e-9 ? 1 : 0;
}

/// Whether a charge destroys a member as far as a station; a piece between them that is no longer than those that
/// cut_member takes along goes too.
inline bool reaches_station(const product::Charge& c, const MemberStation& station) {
  return std::abs(c.position - station.at) < 0.5 * c.destroyed_length + kSliver;
}

/// Sectors of a shaft that hold together at a level, about their own centroid.
struct ShaftElement {
  nearfield::RingInput ring;        // angles from its azimuth
  nearfield::RingProperties whole;  // of it
  double azimuth = 0;               // of local y, a principal axis of it [rad]
  int stage = -1, charge = -1;      // that destroys it; -1: it stays
  int element = -1;                 // in the model
};

/// A level at which a shaft may break.
struct ShaftJoint {
  double at = 0;               // above the foot [m]
  double length = 0;           // of the shaft whose elasticity it has [m]
  double height = 0;           // of a mouth or cut, 0: neither [m]
  int below = -1, above = -1;  // assemblies, -1: the ground
  std::vector<ShaftElement> elements;
};

/// What charges that fire leave of a shaft's ring at a level.
struct MouthLeft {
  double angle = 0;            // [rad]
  double azimuth = 0;          // away from its centroid [rad]
  bool has_direction = false;  // its centroid lies off the axis
};
/// None where no charge fires.
std::optional<MouthLeft> find_mouth_left(const product::Plan&, int member, double at);

struct ShaftModel {
  double azimuth = 0;              // from which angles of sectors count, towards the fall [rad]
  std::vector<ShaftJoint> joints;  // rising
};

/// What a builder knows so far; a copy of it can be built on.
struct BuilderState {
  explicit BuilderState(const KnownCurves* curves = nullptr) : library(curves) {}

  mbs::Model model;
  ZoneLibrary library;
  std::vector<Diagnostic> complaints;

  std::map<GridPoint, int> columns, x_beams, y_beams, slabs, x_walls, y_walls;  // members; beams, walls and slabs at
                                                                                // their lower row and frame
  std::vector<Assembly> assemblies;
  std::map<GridPoint, int> node_body;    // assembly that holds the joint of beams and columns
  std::map<int, int> own_body;           // member -> assembly: shafts of the ground storey, x beams, walls
  std::map<int, int> stump_body;         // member -> assembly
  std::map<int, double> lowest_charge;   // column -> centre of its lowest charge that fires [m]
  std::map<GridPoint, double> core_low;  // underside of the joint in W [m]
  std::map<int, MemberZones> zones;      // columns and beams
  std::map<std::tuple<int, double, double, Lever, Bending>, mbs::LawId> laws;
  std::map<std::tuple<int, double, double, Bending>, mbs::SharedLaw> whole_laws;  // of which levers take shares
  std::map<int, ShaftModel> shafts;                                               // by member
  std::map<int, double> volume_per_mass;  // member: of its material over the mass of its parts, floor loads included
  bool hinge_about_y = true;
  Heads heads = Heads::OfTheFall;
  // of charges, which may be laid out anew while the model runs: laws are never taken out, so that their ids stay
  std::map<std::array<int, 3>, int> partial_zones;  // stage, charge and station -> zone of a length that keeps concrete
  std::map<std::tuple<int, double, double, double>, mbs::LawId> cage_laws;  // by element, length, bars and place
  std::map<std::tuple<int, double, double, std::string>, mbs::LawId> hinge_laws;
};

struct Builder : BuilderState {
  const product::Plan& plan;
  const Knowledge& k;
  ModelMap& map;
  int threads;
  const Condensation* condensation = nullptr;  // connects what stands for all; null: everything
  const KnownCurves* known = nullptr;
  KnownCurves* made = nullptr;  // takes the curves and laws that were made

  Builder(const product::Plan& p, const Knowledge& knowledge, ModelMap& m, int t, const KnownCurves* curves = nullptr)
      : BuilderState(curves), plan(p), k(knowledge), map(m), threads(t), known(curves) {}
  /// Goes on from another one's state; plan and map must be those of it, or copies with additions.
  Builder(BuilderState state, const product::Plan& p, const Knowledge& knowledge, ModelMap& m)
      : BuilderState(std::move(state)), plan(p), k(knowledge), map(m), threads(1) {}
  /// Everything but the events.
  void build();

  // bodies
  void find_direction();
  void index_members();
  void make_columns();
  void make_loose_nodes();
  void make_beams();
  void complain_of_charges_in_joints();
  double mass_of_slab(const GridPoint&, int index) const;  // with its floor load [kg]
  void make_slabs();
  void make_walls();
  void make_shaft(int member);
  void finish_bodies();
  /// Of its material [m³].
  double volume_of(const Part&) const;
  double volume_of(const Assembly&) const;
  Vec3 half_of_node(const GridPoint&) const;
  int node_at(const GridPoint&) const;
  void complain_of_joint(const Assembly&);
  int find_at(const std::map<GridPoint, int>&, const GridPoint&) const;
  int add_assembly(Assembly);
  void put_on_nodes(const std::vector<Part>& parts, int axis, double middle, int node_a, int node_b);

  // connections
  void estimate_normal_forces();
  void request_zones();
  /// Of a ground column that turns above its stump over this share of its clear length.
  void set_lever(MemberZones&, double share) const;
  void request_station(int member, int which);
  /// What of the slabs beside a beam along x works with it.
  nearfield::Flange find_flange(const GridPoint&, int beam) const;
  void connect_ground_column(const GridPoint&, int member);
  void connect_column(const GridPoint&, int member);
  void connect_x_beam(const GridPoint&, int member);
  void connect_y_beam(const GridPoint&, int member);
  nearfield::PanelRcc make_rcc_of_panel(int member) const;
  void connect_slab(const GridPoint&, int member);
  void connect_wall(const GridPoint&, int member, bool along_x);
  void join_wall(int member, const nearfield::PanelRcc&, const Vec3& base, double low, double high, double width,
                 int floor);
  void connect_shaft(int member);
  void note_mouth(const product::Member&, const product::Shaft&, const ShaftModel&, const ShaftJoint&);
  const product::Charge& charge_of(const ShaftElement&) const;
  void connect_cables();
  /// Of beams along x, and of slabs that span between them.
  void find_span_margins();
  /// Which bodies stand by themselves, on which of these charges act, and what is their upper block.
  void find_structures();
  /// Whether a frame's members are connected; whether those to the next frame are.
  bool has_frame(int frame) const;
  bool has_link(int frame) const;
  void connect_cable(const product::Cable&);
  /// Of a member; EI of a section at first yield, and before it cracks.
  struct Stiffness {
    double EA = 0, GA = 0, GJ = 0, EI_y = 0, EI_z = 0, uncracked_EI_y = 0, uncracked_EI_z = 0;
  };
  Stiffness calc_stiffness(const MemberZones&) const;
  /// How a member's ends crack about y and z that are as stiff as EI over these lengths [m].
  std::array<mbs::Cracking, 2> calc_cracking(const MemberZones&, const Stiffness&, double length_y,
                                             double length_z) const;
  /// One that is known keeps its name.
  mbs::SharedLaw make_law(int zone, const Stiffness&, const std::string& name, Bending, const Lever& = {});
  mbs::LawId law_of(int zone, const Stiffness&, const std::string& member, Bending = Bending::Both, const Lever& = {});
  /// A condensed model stays in its plane, so that members of a frame bend about one axis alone.
  Bending bending_of_column() const { return condensation ? Bending::Z : Bending::Both; }
  Bending bending_of_x_beam() const { return condensation ? Bending::Y : Bending::Both; }
  /// Law of a rotational element: bending about the hinge axis is that about z of its frame.
  mbs::SharedLaw make_hinge_law(int zone, const Stiffness&, const std::string& name, const Lever& = {});
  mbs::LawId hinge_law_of(int zone, const Stiffness&, const std::string& name, const Lever& = {});
  ///   length  of the stub [m]
  mbs::LawId stub_law_of(int zone, const Stiffness&, int member, double length);
  /// What a charge leaves of a member where some of its concrete stays.
  mbs::LawId partial_law_of(const Firing&, const MemberZones&, size_t station);
  /// The limits of an element, or a rotational one, go over to those of a law as its charge fires.
  mbs::Action make_switch(mbs::LawId law, double stiffness_share = 1) const {
    mbs::Action act;
    act.kind = mbs::Action::Kind::SwitchLaw;
    act.ramp = k.charge_release_time;
    act.law = law;
    act.stiffness_share = stiffness_share;
    return act;
  }
  void make_stub(const product::Charge&, const MemberZones&, mbs::Event& event, mbs::Event& lighter);
  Pose frame_in(int body, const Vec3& p_W, const Mat3& R_WF) const;
  mbs::ElementId add_element(const std::string& name, int member, int a, int b, const Vec3& p_W, const Mat3& R_WF,
                             const Vec3& translational, const Vec3& rotational, std::vector<mbs::Station> stations,
                             const std::array<mbs::Cracking, 2>& = {});
  std::vector<mbs::Station> order_stations(const MemberZones&, const Stiffness&, const std::string& member,
                                           Bending = Bending::Both);

  // events
  /// Adds the events of charges to model and map, in order of the schedule.
  void add_events(std::vector<Firing> schedule);
  /// Charges that fire, in order of time; those of a member in one instant in an order that is not the plan's.
  std::vector<Firing> order_firings() const;
  const product::Charge& charge_of(const Firing& f) const {
    return plan.stages[static_cast<size_t>(f.stage)].charges[static_cast<size_t>(f.charge)];
  }
  /// Takes resistance away from the sector of a shaft: limits now, what is left of nothing when the ramp is over.
  void fire_shaft(const Firing&, mbs::Event& event, mbs::Event& lighter);

  const product::Member& member(int i) const { return plan.members[static_cast<size_t>(i)]; }
  const product::Section& section_of(int i) const { return plan.sections[static_cast<size_t>(member(i).section)]; }
  const product::Concrete& concrete_of(const product::Section& s) const {
    return plan.concretes[static_cast<size_t>(s.concrete)];
  }
  const product::Steel& steel_of(const product::Section& s) const { return plan.steels[static_cast<size_t>(s.steel)]; }
  const product::Panel& panel_of(int i) const { return plan.panels[static_cast<size_t>(member(i).panel)]; }
  std::string material_of(const product::Panel& p) const { return p.concrete >= 0 ? "concrete" : "masonry"; }
  double kept_of(int panel_member) const;
  /// A wall that is one body with the beam under it, in a condensed model.
  bool is_cast_on_beam(int wall) const;
  void complain(int member, const std::string& what, const std::string& help = {});
  /// At the place of the charge on it there, if there is one; the member's otherwise.
  void complain_of_charge(int member, double position, const std::string& what, const std::string& help = {});
};

/// Axes of the members' frames as columns of R_WF: x along the member.
Mat3 column_axes();
Mat3 x_beam_axes();
Mat3 y_beam_axes();

}  // namespace topple::collapse
