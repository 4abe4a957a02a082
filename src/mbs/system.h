#pragma once
/// Inside of the native engine: the compiled model (constant) and the state (changes in time), kept apart.
/// B bodies, E zone elements, R rotational elements, J joints, C cables, P contact pairs.

#include <cstddef>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mbs/block_cholesky.h"
#include "mbs/contact.h"
#include "mbs/crushed_boxes.h"
#include "mbs/forces.h"
#include "mbs/hull.h"
#include "mbs/lane_array.h"
#include "mbs/lanes.h"
#include "mbs/model.h"
#include "mbs/solver.h"
#include "mbs/zone.h"

namespace topple::mbs {

/// One rigid body's constants; a ReplaceBody event makes them part of the state.
struct BodyConstants {
  double mass = 0, inverse_mass = 0;
  Mat3 inertia, inverse_inertia;    // in B; in a plane hard to turn out of it
  double gyration2 = 0;             // square of the radius of gyration, of a mean axis of its own [m²]
  double radius = 0;                // of the sphere about the centre of mass that holds all shapes [m]
  int first_shape = 0, shapes = 0;  // into State::shapes
  double contact_stretch = 1;       // of the square of a contact's frequency by far points (contact.md)
};

struct CompiledElement {
  int a = -1, b = -1;
  Vec3 p_AF, p_BM;
  Quat q_AF, q_BM;
  ZoneParameters zone;
};

struct CompiledJoint {
  Joint::Kind kind = Joint::Kind::Fixed;
  int parent = -1, child = -1;
  Vec3 p_PF, p_CM;
  Mat3 R_PF, R_CM;
  int lines = 3, rows = 6;  // lines of action, and with the rotations
  double length = 0;        // between the origins, of a distance joint [m]
  double tension_limit, shear_limit, moment_limit, rotation_limit;
  int rotational = -1;  // element about its axis
};

/// Rotational element: a zone whose only elastic component is the rotation about z, its normal force the joint's.
struct CompiledRotational {
  int joint = -1;
  int axial_element = -1;  // that takes its elongation
  ZoneParameters zone;
};

struct JointState {
  bool live = true;
  Vec3 force, moment;  // reaction on the child at the joint, in W [N, N·m]
  double angle = 0;    // of a revolute or cylindrical joint, continuous [rad]
  double ended = 0;    // when it was released; by its own limits half a step before [s]
  // the angle is followed from here as long as it is near: no arc tangent at each step
  double known_angle = 0, known_cosine = 1, known_sine = 0;
  unsigned char repeating = 0;  // rows that repeat those of other joints, bit r for row r
  bool is_examined = false;     // repeating is known
  // What the linear step did not know of the last one: of a joint between bodies that have no other an impulse
  // [N·s, N·m·s], of others the rates that it left open [m/s], those of rotations times the cluster's length.
  double curvature[6] = {};
};

/// An event that fires in this step.
struct DueEvent {
  int index = 0;    // into Model::events
  double time = 0;  // its own, or when its trigger's limit was passed [s]
};

struct CableState {
  bool live = true;
  double rest_length = 0, force = 0, energy = 0, plastic = 0;
};

/// What contact alone and dampers alone gave a body at the last step, about its centre, in W [N, N·m].
struct ForceParts {
  Vec3 contact, contact_torque, damping, damping_torque;
};

/// Everything that changes in time. Plain data: a copy is a snapshot.
struct State {
  long step_index = 0;
  double time = 0;
  bool first_kick = true;
  // the step follows the live model
  double step = 0;       // [s]
  double time_base = 0;  // when it was set [s]
  long index_base = 0;   // and at which step
  double last_kick = 0;  // step of the kick before [s]
  std::vector<double> review_times;
  size_t live_elements = 0, live_at_review = 0;
  bool set_step_doubted = false;  // it was too long at the last review
  bool has_rest = false;          // bodies have had a rest of an impulse (F7), which the next reactions of joints undo
  size_t next_event = 0;
  std::vector<int> waiting;  // events whose time has come and that wait for a trigger, in the order of the model
  std::vector<double> trigger_values;  // at the step before, of the triggers of those that wait, in their order
  // bodies (B)
  std::vector<BodyConstants> body;
  LaneArray<Vec3> p, v, L;  // place; velocity and angular momentum about the centre at the last half step
  LaneArray<Vec3> w;        // angular velocity at the last half step, in W
  LaneArray<Quat> q;
  LaneArray<Mat3> R;
  std::vector<Vec3> p_offset;  // of the present centre of mass in the frame of the model's body
  std::vector<CompiledShape> shapes;
  std::vector<CrushedBox> crushed_boxes;  // by element; `shape` is into `shapes`
  std::vector<GroundPoint> ground_points;
  LaneArray<GroundBox> ground_box;  // (B)
  std::vector<unsigned char> touched_ground;
  std::vector<unsigned char> ground_clear;  // no point touches the ground or remembers that it did (B)
  std::vector<ForceParts> force_parts;      // of System::replaceable, else nothing (B)
  // connections
  std::vector<ZoneState> element;     // (E + R)
  std::vector<ZoneState> rotational;  // not live and without a reason once its joint is loosened (R)
  std::vector<JointState> joint;
  std::vector<CableState> cable;
  std::vector<SpringState> spring, torsion;  // spring-dampers, rotational springs
  std::vector<BushingState> bushing;
  std::vector<LoadState> load;
  // contact pairs
  std::vector<PairState> pairs;
  std::vector<PairDue> pair_due;
  std::vector<HeldPair> held_pairs;
  std::vector<double> pair_clock;        // no pair is due before its clock comes to this (P) [m]
  std::vector<unsigned char> pair_fast;  // that is the second clock (P)
  double clock[2] = {0, 0};              // ways of the fastest slow body and of the fastest body, added up [m]
  std::vector<unsigned char> is_fast;    // whether a body counts for the second clock only (B)
  std::vector<double>
      travel;            // way of each body's farthest point since the last search, at most, as seen from ... (B) [m]
  Vec3 search_velocity;  // ... a frame that moves so [m/s]
  std::vector<double> allowance;  // the way at which a body asks for a new search (B) [m]
  std::vector<unsigned char> tied_to_ground;
  bool search_due = true;
  bool links_due = true;  // some link has ended since they were looked at
  Touching touching;
  std::vector<long> touched_pairs;  // a * B + b, sorted
  // ledger [J]
  double removed = 0, contact_energy = 0, stick_energy = 0;
  double contact_loss = 0, contact_loss_power = 0;  // by the dashpots of contacts [J, W]
  double friction_work = 0, friction_power = 0;     // of the friction forces on the bodies [J, W]
  double total_at_start = 0, stored_at_start = 0;   // of it in springs and contacts [J]
  double gravity_at_start = 0, largest_residual = 0, released = 0;
  double largest_drift = 0;
  long quiet_steps = 0;
};

/// Of a quantity that was `before` a step ago and is `now`, in steps: how long ago it passed the limit, 0 if it was
/// beyond it all the time.
double find_passing(double before, double now, double limit);

/// One constraint: direction of a force on the child (opposite on the parent) and the torques on both.
struct JointRow {
  Vec3 line, turn_child, turn_parent;
};

/// Pivot over diagonal of a row that repeats others, geometry alone: it stands at 1e-6 of what they hold.
inline constexpr double kDependent = 1e-12;

/// One list of joints that share moving bodies, solved together. Rotations count with the length: their rows are
/// multiplied by it, so that all rows are lengths.
struct JointCluster {
  /// A joint at a moving body: place in `joints`, and on which side the body is.
  struct Meeting {
    int place = 0;
    bool is_child = false;
  };
  std::vector<int> joints;           // in the order of elimination
  std::vector<int> bodies;           // moving ones
  std::vector<int> first_meeting;    // of each body, and one more
  std::vector<Meeting> meetings;     // by body, places rising
  double length = 1, tolerance = 0;  // [m]
  std::vector<int> repeating;        // rows that repeat others for good
  int dependent = 0;                 // rows that do so now
  bool is_plain = false;             // no row was near to doing so when it was read last
  bool is_pair = false;              // one joint, moved by the kernel
  double open = 0;                   // widest gap [m, rad]
  BlockCholesky matrix;              // J M⁻¹ Jᵀ
  BlockCholesky geometry;            // J Jᵀ, where rows may depend on others
};

/// The polyhedron of a box that was shortened.
struct ShortHull {
  Vec3 half;  // of that box [m]
  Hull hull;
};

class StiffnessFactor;  // of the dead-load equilibrium: its pattern, order of elimination and factor
std::shared_ptr<StiffnessFactor> make_stiffness_factor();

class System {
 public:
  ///   width       lanes in a block, 0: as many as the machine has
  ///   has_moment  a state is read next, which brings its step
  System(const Model& model, const Options& options, size_t width = 0, bool has_moment = false);

  const Model model;
  Options options;
  State state;

  double step = 0;
  double highest_frequency = 0;

  bool find_equilibrium(std::string& message);
  bool advance_step();
  /// Forces where the bodies are, nothing having moved.
  void evaluate_forces();
  // a step in parts, the kernel's work between them: advance_together()
  void prepare_step();
  void finish_motion();
  void begin_forces();
  void push_bodies(double h);
  void finish_forces(double h);
  /// Of a planar model.
  void drop_forces_across();
  bool is_finite() const;
  /// Goes over to a lane of a batch.
  void join_batch(Lanes& batch, size_t lane);
  const View& calc_view();
  void look();  // into the view
  void see();   // as look(), after calc_reactions
  Summary summary;

  // constant after compilation
  size_t B = 0;
  // (E + R): behind those of the model one for each rotational element, of six components between the frames of its
  // joint, that lives from when the joint is loosened
  std::vector<CompiledElement> elements;
  size_t E = 0;
  CompiledLaws laws;
  std::vector<CompiledJoint> joints;
  std::vector<CompiledRotational> rotationals;
  ForceElements forces;
  std::vector<Hull> hulls;
  std::vector<Shape> hull_shapes;        // what each was made of
  std::map<int, ShortHull> short_hulls;  // of shapes that are shorter than those; scratch
  std::vector<size_t> event_order;
  std::vector<ContactLaw> contact_laws;  // of the ground, of bodies, and of each of Contact::pairs
  std::vector<int> ground_law;           // of each body, into contact_laws (B)
  std::vector<PairRule> pair_rules;      // sorted
  std::vector<unsigned char> fixed;
  std::vector<unsigned char> jointed;       // 1: the model joins it to what does not move, 2: to a body that does (B)
  std::vector<std::vector<int>> incidence;  // elements of each body: 2 * element + side

  bool ignores_limits = false;  // elements stay elastic (equilibrium's first phase)
  bool started = false;         // forces at the start are there

  /// Where the equilibrium keeps its factors; null: a new one. Samples that follow each other on one thread may share
  /// one, so that the order of elimination is looked for once.
  std::shared_ptr<StiffnessFactor> stiffness_factor;

  // where bodies and elements lie for the kernel; of this run, or shared with the samples of a batch
  std::unique_ptr<Lanes> own_lanes;
  Lanes* lanes = nullptr;
  size_t lane = 0;

  // scratch
  std::vector<double> element_history;
  LaneArray<Vec3> force, torque;              // applied on bodies (B)
  LaneArray<Vec3> joint_force, joint_torque;  // of the joints on bodies, of the step before (B)
  std::vector<Vec3> p_before;
  std::vector<Quat> q_before;
  std::vector<Mat3> R_before, world_inverse_inertia;  // of jointed bodies (B)
  std::vector<unsigned char> in_cluster;              // (B)
  std::vector<int> cluster_of;                        // of those (B)
  std::vector<JointCluster> clusters;
  bool clusters_due = true;
  std::vector<std::pair<int, int>> joint_notes;  // first joint and situation of those made
  std::vector<std::pair<int, int>> noted_pairs;  // bodies of which a note says that contact did not keep them apart
  std::vector<size_t> turned_over;               // elements past half a turn
  /// Notes an element whose rotation vector has just changed over to the other side.
  void note_turned_over(size_t element, const Six& deformation, const ZoneState& before);
  std::vector<std::uint32_t> pair_slot;   // of each joint (J)
  std::vector<int> paired;                // joints that have one
  std::vector<unsigned char> joint_over;  // passes a limit, of those (J)
  bool joint_sums_due = true;             // those of bodies without joints are to be cleared
  std::string identity;                   // of the model, for snapshots
  std::vector<JointRow> joint_rows;
  std::vector<double> joint_gaps, joint_rhs, joint_impulse, joint_linear, joint_answer, joint_change;
  std::vector<double> joint_unforeseen, joint_rate, joint_left, joint_left_before;  // as rates of the rows
  std::vector<Vec3> v_before, L_before, w_before;                                   // of jointed bodies (B)
  std::vector<Vec3> joint_spin;                         // of jointed bodies in the middle of the step (B)
  std::vector<Vec3> reaction_force, reaction_moment;    // at the time of the positions, of a view, in W (J)
  std::vector<Vec3> body_reaction, body_reaction_turn;  // their sums on bodies (B)
  Vec3 ground_reaction, ground_contact;
  int body_contacts = 0;
  size_t other_on_ground = 0;          // moving bodies with shapes that are not the kernel's on the ground
  int contact_interval = 1;            // steps from one look for touching points to the next
  std::string trouble;                 // why the run cannot go on; empty: nothing
  std::vector<DueEvent> due_events;    // of this step
  std::vector<size_t> begun_elements;  // in it
  std::vector<size_t> replaceable;     // bodies that events replace, sorted
  ContactScratch contact;
  View view;

  void say(const Happening& h) const {
    if (options.on_happening) options.on_happening(h);
  }

  // parts, one file each
  void compile();
  /// What the kernel reads of all bodies of a run or a sample at once.
  void set_lane_values(double kick, double h);
  /// Of the elastic system as it is now, with what the dampers add [rad/s].
  ///   is_present  joints hold and springs have the slopes of now; else joints are left out and slopes are the largest
  ///               that are foreseen, which is quicker and gives no less
  double find_highest_frequency(bool is_present = false) const;
  /// Longest stable step for the highest frequency and contact [s].
  double calc_step_limit() const;
  /// The engine's own, without Options::step [s].
  double calc_own_step() const;
  void choose_step();
  double find_fastest_spin() const;  // of what moves [rad/s]
  /// Whether the fastest mode bears the step that was set; else how long one it bears. Joints count.
  bool bears_set_step(double& longest);
  /// After events, and when a quarter of the elements is gone: a step for the model as it is now.
  void review_step();
  void set_step(double h);
  /// What follows from the step of the state.
  void adopt_step();
  /// Time over which the forces act before the next motion [s].
  double kick_time() const { return state.first_kick ? 0.5 * step : 0.5 * (state.last_kick + step); }
  /// Forces at the start, and the ledger set to zero there.
  void evaluate_start();
  void start();
  void fire_events();
  void act(const DueEvent&);
  /// Adds the waiting events whose trigger holds to those due and takes them off the list (triggers.cpp).
  void find_triggered(std::vector<DueEvent>& due);
  /// When a trigger of an event that holds has passed its limit, between this step and the one before.
  double find_passing_time(const Event&, const Trigger&, double before, double now) const;
  double calc_component(const Quantity&, int component);
  // springs, bushings, loads (forces.cpp, dampers.cpp, loads.cpp); at rest nothing breaks and no time passes
  void compile_forces();
  void compile_loads();
  void evaluate_springs(bool at_rest);
  void evaluate_bushing(size_t bushing, bool at_rest);
  void evaluate_loads(bool at_rest);
  /// Share of a load's force in the next kick.
  double find_load_factor(const CompiledLoad&, LoadState&);
  /// Integral of a load's factor, which runs either way [s].
  double calc_load_impulse(const CompiledLoad&, const LoadState&, double from, double to) const;
  /// What the last kick lacks where the step has changed after its forces were taken [s].
  double calc_owed_impulse(const CompiledLoad&, LoadState&) const;
  /// Of its presence now.
  double calc_load_factor(const CompiledLoad&, const LoadState&) const;
  /// Puts loads as of now in the place of those that give the impulse of a step; whether any of them is another.
  bool take_loads_as_they_are();
  void evaluate_dampers();
  /// As look(), with the pulls that dampers have at the velocities of the start: what moves the bodies then is already
  /// that of the end of the first half step.
  void look_at_start();
  void find_damper_bounds();
  void add_damper(int a, int b, const ForceRow&, const CompiledCharacteristic& law, ComponentState&, double& damping,
                  const std::string& name);
  /// Notes the damper that lags most behind the step, if one does by much.
  void note_fast_dampers();
  /// A law that has become too stiff for the step makes it shorter, or ends the run if the step is set.
  void watch_stiffness(int a, int b, const ForceRow&, double slope, const char* kind, const std::string& name);
  double measure_spring(const CompiledSpring&, ForceRow&) const;
  double measure_torsion(const CompiledTorsion&, ForceRow&) const;
  FrameDeformation measure_bushing(size_t bushing) const;
  ElementGeometry measure_zone(const CompiledElement&) const;
  FrameDeformation measure_frames(int a, int b, const Vec3& p_AF, const Quat& q_AF, const Vec3& p_BM,
                                  const Quat& q_BM) const;
  /// A force and a moment of a on b, given in F at M's origin: x y z [N], and conjugate to the rotation vector [N·m].
  void load_frames(int a, int b, const FrameDeformation&, const double f[6]);
  void find_bushing_rows(const CompiledBushing&, const FrameDeformation&, ForceRow rows[6]) const;
  /// Stiffness of all live springs: the present tangent, or for the step the largest that is foreseen.
  ///   force_scale  at which a law that starts flat is looked at for a stiffness in its stead [N, N·m]
  std::vector<StiffRow> calc_spring_stiffness(bool fast, double force_scale) const;
  /// Whether a spring or bushing carries more than its strength; then says which.
  bool find_overload(std::string& message) const;
  /// A force and a torque about the centre on a body; on the ground it counts as its reaction.
  void load_body(int body, const Vec3& force, const Vec3& torque);
  void pull(int a, int b, const ForceRow&, double f);
  double calc_inverse_mass(int body, const Vec3& line, const Vec3& turn) const;
  /// Rate of a row with the velocities of the last half step.
  double calc_row_rate(int a, int b, const ForceRow&) const;
  void remove_spring(size_t, double time);
  void remove_torsion(size_t, double time);
  void remove_bushing(size_t, double time);
  // endings.cpp
  /// When a force ends: steps ago; and the time of its pull that the bodies have not had yet, counted from the middle
  /// of the last step, where the last kick ended [s].
  struct Ending {
    double ago = 0, rest = 0;
  };
  Ending find_ending(double time) const;
  /// When a quantity passed a limit, from its value at the step before and now; now if it was beyond it then.
  Ending find_ending(double before, double now, double limit) const;
  /// rest  as Ending::rest, of the force that the impulse is of
  void impel(int body, const Vec3& impulse, const Vec3& turn, double rest);
  /// What bodies have had at once since the events of this step began, about their centres of now [N s, N m s, s].
  struct Impelled {
    size_t body;
    Vec3 impulse, turn;
    double rest;
  };
  std::vector<Impelled> impelled;
  std::vector<std::pair<size_t, Vec3>> recentred;  // bodies replaced in it, from the old centre to the new one
  /// Ends the pull of a row at the deformation x; returns what its spring stored then [J].
  double end_row(int a, int b, const ForceRow&, const CompiledCharacteristic& spring,
                 const CompiledCharacteristic& damper, ComponentState&, double x, const Ending&, double& damping);
  double end_spring(size_t, const Ending&);
  double end_torsion(size_t, const Ending&);
  double end_along(SpringState&, int a, int b, const ForceRow&, const CompiledCharacteristic& spring,
                   const CompiledCharacteristic& damper, double x, const Ending&);
  double end_bushing(size_t, const Ending&);
  double end_cable(size_t, const Vec3& p_A, const Vec3& p_B, const Ending&);
  /// Evaluates what is about to go for the last time, and gives its bodies the rest.
  void end_element(size_t, const Ending&);
  void end_rotational(size_t, const Ending&);
  void end_joint(size_t, const Ending&);
  void end_pull(int a, int b, const Vec3& on_a, const Vec3& torque_a, const Vec3& torque_b, const Ending&);
  void apply_load(size_t, double time);
  void remove_load(size_t, double time);
  double calc_last_load_change() const;
  void add_energy_of_forces(Energy&) const;
  void view_forces(View&) const;
  Vec3 calc_point(int body, const Vec3& p) const;
  // elements (elements.cpp)
  /// Whether nothing of the bodies' motion ever leaves their planes.
  bool keeps_planes() const;
  /// In which plane an element between two markers stays for good.
  kernel::Plane find_plane(int a, int b, const Pose& X_AF, const Pose& X_BM) const;
  /// What the kernel does with a slot: nothing, a spring inside its bounds, a zone that may flow or one at its limits.
  enum class Work : unsigned char { None, Springs, MayFlow, Flows };
  Work find_work(size_t slot) const;
  /// Whether slots of like work no longer lie side by side.
  bool is_work_scattered() const;
  size_t slot_of(size_t element) const;
  void kill_slot(size_t element);
  /// Gives every live element a slot: by plane and number of stations, those at their limits first, then
  /// those that may flow, each in their order.
  void lay_out_elements();
  /// From the state of the zones to the slots, and back.
  /// Markers and constants are written only if they may have changed.
  void pack_element(size_t element, bool has_moved = true);
  /// Gives elements that begin to live their places in the lanes.
  void add_slots(const std::vector<size_t>& elements);
  void pack_crack_bounds(size_t slot, const ZoneState&);
  /// Where a spring is without force, what of its deformations is elastic, and where its cracks grow.
  void pack_spring_constants(size_t element, size_t slot, bool flows);
  /// Of a zone in lanes what follows it through deformations, cracks and damage, its limits aside.
  void pack_springs(size_t element, size_t slot, bool flows);
  void unpack_element(size_t element);
  void pack_elements();
  void unpack_elements();
  void evaluate_element(size_t element, double h);
  void evaluate_outside(size_t slot);
  /// As elongate_zone, wherever the element's state is.
  void elongate_element(size_t e, double by);
  /// The element bears no more compression from now on [N].
  void limit_element(size_t e, double compression);
  void evaluate_elements_fully(double h);
  void evaluate_elements();
  /// For the kernel: cells of a zone that flows, around a normal force [N].
  void write_cells(size_t slot, double axial);
  /// For the kernel: lets the cracks of a zone that flows grow at a deformation; false if they do not.
  bool grow_cracks(size_t slot, const double* deformation, size_t stride);
  /// For the kernel: lets those of a spring grow; see kernel::FlowWriter.
  kernel::SpringCracks crack_spring(size_t slot, const double* deformation, size_t stride, double* spring);
  /// Writes to the constants of a slot what its spring has become.
  void keep_spring(size_t slot);
  void sum_element_forces();
  Vec3 calc_element_reaction() const;
  void save_slot(size_t slot, std::vector<double>& to) const;
  const double* restore_slot(size_t slot, const double* from);
  /// The slots of all live elements, for snapshots.
  void save_elements();
  void restore_elements(const std::vector<double>& history);
  void pack_body(size_t body);
  void evaluate_rotationals(double h);
  void evaluate_rotational(size_t rotational, double h);
  /// Rotation of a rotational element's joint, or of what has taken over from it; of one that is gone as it was [rad].
  double calc_hinge_rotation(size_t rotational) const;
  void remove_rotational(size_t rotational, const Ending& ending);
  /// Breaks a live zone; what it stores counts as removed.
  void take_away(ZoneState&);
  double calc_cable_length(size_t cable) const;
  /// Whether a rotational element has taken over from its joint and still holds.
  bool is_loose(size_t rotational) const { return state.element[E + rotational].live; }
  /// The same whether it still holds or not.
  bool was_loosened(size_t rotational) const {
    const ZoneState& z = state.rotational[rotational];
    return !z.live && z.reason == BreakReason::None;
  }
  /// Lets the joint's rotational element take over; one whose element has broken stays a joint.
  void loosen_joint(size_t j);
  /// Takes a joint out of the constraints.
  void drop_joint(size_t j);
  void evaluate_cables(bool at_rest);
  void evaluate_contact(double h);
  void compile_contact();
  /// Of a body on one point at the mean rate, the highest of all laws [rad/s].
  double calc_contact_frequency() const;
  /// Counts the ways of bodies since the last search, and searches anew where they ask for it.
  void add_travel(double h);
  /// Bodies whose shapes are near each other, and who is tied to the ground.
  void find_pairs();
  bool is_grounded(int body) const;
  void list_grounded_links();
  void find_links();
  /// Makes pairs of held ones whose links have ended.
  void release_pairs();
  /// Which of a pair is the first, whose faces are preferred: what is fixed, heavier, larger, lower. It does not hang
  /// on what else there is, nor on the order of the model where those tell both apart.
  bool comes_first(int body, int shape, int other_body, int other_shape) const;
  PairDue make_pair_due(const HeldPair&) const;
  void find_fast_bodies();
  void find_bounds();
  void choose_search_velocity();
  void drop_pairs_of(size_t b);
  /// Law of two bodies, into contact_laws.
  int find_pair_law(int a, int b) const;
  void find_ground_points(double h);
  /// Whether the kernel has what a body and the ground do to each other: of one box, where bodies do not touch each
  /// other.
  bool is_ground_box(size_t body) const;
  void pack_ground_box(size_t body);
  void count_other_bodies();
  /// Tells of boxes that the kernel has found to touch the ground (its slots).
  void note_landing(std::uint32_t slot);
  void say_landing(size_t b, double approach) const;
  /// Whether something else touches anything.
  bool has_other_contacts() const { return model.contact.bodies || other_on_ground > 0; }
  void find_pair_points(double h);
  void add_contact_point(const Vec3& at, double depth, double stiffness, double unseen);
  /// Counts a group of a body; its place among those touched.
  int touch(size_t body);
  /// Makes the points from `first` on a group. Each takes over the friction spring of the nearest one of the step
  /// before.
  void add_contact_group(size_t a, size_t b, const Vec3& n, size_t first, int law, double stiffness, StickRange&);
  // contact_together.cpp
  /// Groups between the same two bodies that move, or one and the ground, bodies that joints make one counting as one.
  void find_together();
  /// How easily the dashpots of such groups move what they act on.
  void match_dashpots();
  // contact_joints.cpp
  void begin_holding();
  int read_meetings(JointCluster&);
  /// What joints leave of a body's mobility, into ContactScratch::mobility; -1: none hold it.
  int find_mobility(size_t body);
  /// Speed along an axis of a point of a body per force there; the lever is from the centre of mass [1/kg].
  double calc_mobility_along(size_t body, int mobility, const Vec3& lever, const Vec3& axis) const;
  /// By what points far from the centre of mass raise the square of a contact's frequency, 1 or more (contact.md).
  double calc_contact_stretch(const BodyConstants&) const;
  /// Stiffness of the points from `first` on by what joints leave of the mobility of the two bodies, and what their
  /// group shall know of it. False: none hold them.
  bool fit_points(size_t a, size_t b, const Vec3& n, size_t first, const ContactLaw&, ContactGroup&);
  /// Hands that on to the last group.
  void keep_mobility(const ContactGroup& fitted);
  /// Couples touched bodies that joints hold, once all groups are known.
  void hold_contacts();
  void fill_held_blocks();
  /// Keeps the forces of the step that ends, which the joints have answered.
  void keep_forces();
  /// What joints answer to the forces known so far beyond their answer in the step before.
  void foresee_joints(double h);
  /// Adds that to the speeds, and takes from what forces of contact change what joints take.
  void hold_changes(double h);
  /// Gives every group found a slot of the kernel.
  void fill_contact_blocks();
  /// Steps from one look for touching points to the next.
  int calc_contact_interval() const;
  /// Whether the next evaluation looks for touching points, rather than moving those of the one before.
  bool is_look_due() const {
    return state.touching.steps == 0 || state.touching.steps >= contact_interval ||
           (clusters_due && !state.touching.held.empty());
  }
  /// Finds the touching points; between looks they move with their bodies.
  void find_contacts(double h);
  /// As a step of h ends; none on the ground, where corners stay what they are.
  Earnings calc_earnings(const ContactGroup&, double h) const;
  Earnings calc_energies(const ContactGroup&, double h) const;  // the same of any group
  /// Takes away what springs of a body's contacts store half a step of h before now [J].
  double take_pressed(size_t body, double h);
  /// The same of a box that the kernel has on the ground.
  double calc_pressed_box(size_t body, double h) const;
  /// Forces at the points found, on the bodies and in the ledger.
  void resolve_contacts(double h, bool follows);
  /// Moves a body from its pose at the beginning of the step to the end of it.
  void drift(size_t body, double h, const Vec3& p0, const Quat& q0, const Mat3& R0);
  void build_clusters();
  /// With what the kernel reads of bodies in clusters and out of them.
  void rebuild_clusters();
  /// Reads the joints of a cluster at the present poses: rows, gaps, matrix and its factor; rows below the tolerance
  /// count as dependent.
  void read_cluster(JointCluster&, double tolerance);
  void predict_cluster(const JointCluster&, double h);
  void apply_impulses(const JointCluster&, const std::vector<double>& impulse);
  double find_gaps(const JointCluster&, double h);
  bool close_cluster(JointCluster&, double h, bool from_before);
  bool pull_together(JointCluster&, double h);
  void solve_cluster(JointCluster&, double h);
  void solve_joints(double h);
  /// Gives joints that share no moving body with others to the kernel, and takes what it made of them.
  void pack_pairs();
  void pack_pair(size_t joint, const JointCluster&);
  void take_pairs(double h);
  /// The limit of a joint that its reaction passes, none: no name [N, N·m].
  struct JointOverload {
    const char* what = nullptr;
    double load = 0, limit = 0;
  };
  JointOverload find_joint_overload(size_t joint) const;
  void check_joints();
  /// Closes the joints and makes the velocities agree with them, before the first step.
  void close_joints();
  /// Reactions at the time of the positions, from the accelerations.
  void calc_reactions();
  void update_angle(size_t joint, const Mat3& F, const Mat3& M);
  void update_angle(size_t joint, double cosine, double sine);
  void update_angles();
  /// Tells once for each cluster that rows repeat others, that more do for a while than `usual`, or that a step did not
  /// close all joints.
  void note_dependence(const JointCluster&, int usual);
  void note_open(const JointCluster&);
  /// Tells once for each cluster of a step in which a body turns so far [rad] that it could not be closed; that is no
  /// singular position.
  void note_turn(const JointCluster&, double turn);
  /// The run has failed where joints are open by far.
  void stop_if_lost(const JointCluster&);
  void note_speed(const JointCluster&, double speed);
  /// True the first time for a cluster and a situation.
  bool note_once(const JointCluster&, int situation);
  /// Tells once of two bodies that one has sunk into the other by more than half of the thinner one, or that they move
  /// by more than that one's thickness between two looks.
  ///   depth     of the deepest point, or minus the gap [m]
  ///   interval  time between looks [s]
  void note_lost_contact(const PairDue&, double depth, double interval);
  /// The same of a body that has sunk into the ground.
  void note_sunk(size_t body, const CompiledShape&, double depth);
  /// Of boxes that the kernel has on the ground.
  void note_sunk_boxes();
  /// Of bodies that overlap, and of such that reach below the ground, where contact begins.
  void note_overlaps_at_start();
  /// At the end of a run that touched something in a set step that is too long for it.
  void note_swing_of_contact();
  /// Of the shape at its thinnest, infinite for a plane [m].
  double thickness_of(const CompiledShape&) const;
  /// Whether more rows were told to depend on others than do now, or to do so for a while.
  bool was_singular(const JointCluster&) const;
  void break_element(size_t e, BreakReason reason);
  /// Says once that a zone has yielded.
  ///   zone  elements, then rotational elements
  void tell_yield(size_t zone, ZoneState&);
  /// Of those that have in lanes, where nobody was told; their states are unpacked.
  void tell_yields();
  void release_joint(size_t j, const char* reason);
  void release_joint(size_t j, double time);  // by an event
  void replace_body(size_t b, const Body& replacement, const Ending&);
  /// Polyhedra of the model and of what events put in place of bodies.
  void compile_hulls();
  int find_hull(const Shape&) const;
  /// The polyhedron of a shape as it is now; null where it needs none.
  const Hull* hull_of(int shape);
  /// Appends a body's shapes in its frame.
  void append_shapes(const Body&, BodyConstants&);
  /// Appends those of a body's shapes, as given, that its elements shorten.
  void find_crushed_boxes_of(size_t b, const Body&);
  void forget_crushed_boxes_of(size_t b);
  /// Tells shapes their places in the list once it has changed.
  void number_crushed_boxes();
  /// As short as an element's shortening leaves it [m].
  void shorten_shape(CrushedBox&, double shortening);
  /// How much of its boxes is gone with a weak length that was crushed through; 0: none was [m].
  double calc_crushed_through(size_t element) const;
  /// The end of a member that a surface with this normal out of body b meets head on; null: of other shapes, and where
  /// nothing is left of it, none.
  const CrushedBox* find_met_end(size_t b, int shape, const Vec3& outward) const;
  /// What it bears [N]; unlimited for none.
  ///   way  by which it comes nearer until points are looked for again [m]
  double calc_end_bearing(const CrushedBox*, double way) const;
  /// Crushes the weaker of two ends that meet, or one that meets something, as far as it bears less than what presses
  /// there: its box gets shorter and the points come out by as much, which is returned [m].
  ///   b      B: the ground
  ///   n      from a to b
  ///   first  of the points
  ///   h      the step [s]
  double crush_ends(size_t a, int shape_a, size_t b, int shape_b, const Vec3& n, const ContactLaw&, size_t first,
                    double h);
  /// Boxes as short as the elements along them are now.
  void shorten_boxes();
  int count_corners(const CompiledShape&) const;
  void layout_shapes();
  /// A link between bodies has ended, or may have.
  void mark_links_due() { state.links_due = true; }
  Mat3 rotation_of(int body) const { return body < 0 ? Mat3::identity() : state.R[static_cast<size_t>(body)]; }
  Vec3 centre_of(int body) const { return body < 0 ? Vec3{} : state.p[static_cast<size_t>(body)]; }
  Pose pose_of(int body) const {
    return body < 0 ? Pose{} : Pose{state.p[static_cast<size_t>(body)], state.q[static_cast<size_t>(body)]};
  }
  Energy calc_energy() const;
  /// Velocities at the time of the positions, half a step after the stored ones.
  Vec3 calc_velocity(size_t body) const;
  Vec3 calc_angular_velocity(size_t body) const;
  /// With these forces of the joints instead of those of the step before.
  Vec3 calc_velocity(size_t body, const Vec3& from_joints) const;
  Vec3 calc_angular_velocity(size_t body, const Vec3& from_joints) const;
  Mat3 calc_world_inverse_inertia(size_t body) const;
};

/// One step of all systems that share lanes: one run of its own, or samples of a batch (null where a lane is idle).
void advance_together(Lanes&, std::span<System* const> systems);

}  // namespace topple::mbs
