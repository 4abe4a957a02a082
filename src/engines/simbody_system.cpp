#ifdef TOPPLE_WITH_SIMBODY

#include "engines/simbody_system.h"

#include <Simbody.h>

#include <algorithm>
#include <utility>

namespace topple::engines::simbody {

namespace {

using SimTK::MobilizedBody;
using SimTK::MobilizedBodyIndex;

SimTK::Vec3 to_simbody(const Three& v) { return {v[0], v[1], v[2]}; }
Three from_simbody(const SimTK::Vec3& v) { return {v[0], v[1], v[2]}; }

SimTK::Transform to_simbody(const Frame& f) {
  const auto& R = f.R;
  return {SimTK::Rotation(SimTK::Mat33(R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8]), true), to_simbody(f.p)};
}

/// A joint's frame as Simbody's mobilizer wants it: its slider moves along x, ours along z.
SimTK::Transform joint_frame(Kind kind, const Frame& f) {
  const auto& R = f.R;
  if (kind != Kind::Prismatic) return to_simbody(f);
  return {SimTK::Rotation(SimTK::Mat33(R[2], R[0], R[1], R[5], R[3], R[4], R[8], R[6], R[7]), true), to_simbody(f.p)};
}

Frame from_simbody(const SimTK::Transform& X) {
  Frame f;
  f.p = from_simbody(X.p());
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) f.R[static_cast<size_t>(3 * i + k)] = X.R()[i][k];
  return f;
}

void read_motion(const SimTK::SimbodyMatterSubsystem& matter, const std::vector<MobilizedBodyIndex>& bodies,
                 const SimTK::State& s, std::vector<BodyMotion>& out) {
  out.resize(bodies.size());
  for (size_t i = 0; i < bodies.size(); ++i) {
    const MobilizedBody& b = matter.getMobilizedBody(bodies[i]);
    const SimTK::SpatialVec& V = b.getBodyVelocity(s);
    out[i] = {from_simbody(b.getBodyTransform(s)), from_simbody(V[1]), from_simbody(V[0])};
  }
}

/// Forces from outside, and their work as auxiliary variables.
class OutsideForces : public SimTK::Force::Custom::Implementation {
 public:
  OutsideForces(ForceFunction force, PowerFunction power, const SimTK::SimbodyMatterSubsystem& matter,
                const SimTK::GeneralForceSubsystem& subsystem, const std::vector<MobilizedBodyIndex>& bodies)
      : force_(std::move(force)), power_(std::move(power)), matter_(matter), subsystem_(subsystem), bodies_(bodies) {}

  void calcForce(const SimTK::State& s, SimTK::Vector_<SimTK::SpatialVec>& on_body, SimTK::Vector_<SimTK::Vec3>&,
                 SimTK::Vector&) const override {
    read_motion(matter_, bodies_, s, motion_);
    force_(s.getTime(), motion_, wrench_);
    for (size_t i = 0; i < bodies_.size(); ++i)
      on_body[bodies_[i]] += SimTK::SpatialVec(to_simbody(wrench_[i].torque), to_simbody(wrench_[i].force));
  }
  SimTK::Real calcPotentialEnergy(const SimTK::State&) const override { return 0; }
  bool dependsOnlyOnPositions() const override { return false; }
  void realizeTopology(SimTK::State& s) const override {
    if (power_) first_ = subsystem_.allocateZ(s, SimTK::Vector(3, 0.0));
  }
  void realizeAcceleration(const SimTK::State& s) const override {
    if (!power_) return;
    read_motion(matter_, bodies_, s, motion_);
    const Three p = power_(s.getTime(), motion_);
    SimTK::Vector& rate = subsystem_.updZDot(s);
    rate[first_] = p[0];
    rate[first_ + 1] = p[1];
    rate[first_ + 2] = p[2];
  }
  Three work_of(const SimTK::State& s) const {
    if (!power_) return {0, 0, 0};
    const SimTK::Vector& z = subsystem_.getZ(s);
    return {z[first_], z[first_ + 1], z[first_ + 2]};
  }

 private:
  ForceFunction force_;
  PowerFunction power_;
  const SimTK::SimbodyMatterSubsystem& matter_;
  const SimTK::GeneralForceSubsystem& subsystem_;
  const std::vector<MobilizedBodyIndex>& bodies_;
  mutable SimTK::ZIndex first_;
  mutable std::vector<BodyMotion> motion_;
  mutable std::vector<Wrench> wrench_;
};

}  // namespace

struct System::Inside {
  explicit Inside(const Description& d) : description(d), matter(system), forces(system) {}

  Description description;
  SimTK::MultibodySystem system;
  SimTK::SimbodyMatterSubsystem matter;
  SimTK::GeneralForceSubsystem forces;
  std::vector<MobilizedBodyIndex> bodies;
  std::vector<std::vector<SimTK::ConstraintIndex>> constraints;  // of each closure
  OutsideForces* outside = nullptr;                              // the system's
  std::unique_ptr<SimTK::Integrator> integrator;
  std::vector<BodyMotion> motion;

  MobilizedBodyIndex index_of(int mobilizer) const {
    return mobilizer < 0 ? MobilizedBodyIndex(0) : bodies[static_cast<size_t>(mobilizer)];
  }
  void add(const Mobilizer&);
  void add(const Closure&);
  void read() {
    const SimTK::State& s = integrator->getAdvancedState();
    system.realize(s, SimTK::Stage::Velocity);
    read_motion(matter, bodies, s, motion);
  }
};

void System::Inside::add(const Mobilizer& m) {
  const auto& J = m.inertia;
  const SimTK::Inertia central(SimTK::Vec3(J[0], J[1], J[2]), SimTK::Vec3(J[3], J[4], J[5]));
  const SimTK::Vec3 centre = to_simbody(m.centre);
  const SimTK::Body::Rigid body(SimTK::MassProperties(m.mass, centre, central.shiftFromMassCenter(centre, m.mass)));
  MobilizedBody& inboard = matter.updMobilizedBody(index_of(m.inboard));
  const SimTK::Transform F = joint_frame(m.kind, m.inboard_frame), M = joint_frame(m.kind, m.outboard_frame);
  const auto make = [&]() -> MobilizedBodyIndex {
    switch (m.kind) {
      case Kind::Fixed:
        return MobilizedBody::Weld(inboard, F, body, M).getMobilizedBodyIndex();
      case Kind::Revolute:
        return MobilizedBody::Pin(inboard, F, body, M).getMobilizedBodyIndex();
      case Kind::Spherical:
        return MobilizedBody::Ball(inboard, F, body, M).getMobilizedBodyIndex();
      case Kind::Universal:
        return MobilizedBody::Universal(inboard, F, body, M,
                                        m.reversed ? MobilizedBody::Reverse : MobilizedBody::Forward)
            .getMobilizedBodyIndex();
      case Kind::Prismatic:
        return MobilizedBody::Slider(inboard, F, body, M).getMobilizedBodyIndex();
      case Kind::Cylindrical:
        return MobilizedBody::Cylinder(inboard, F, body, M).getMobilizedBodyIndex();
      case Kind::Distance:  // closes loops only
      case Kind::Free:
        break;
    }
    return MobilizedBody::Free(inboard, F, body, M).getMobilizedBodyIndex();
  };
  bodies.push_back(make());
}

void System::Inside::add(const Closure& c) {
  using SimTK::Constraint;
  MobilizedBody& P = matter.updMobilizedBody(index_of(c.parent));
  MobilizedBody& C = matter.updMobilizedBody(index_of(c.child));
  const SimTK::Transform F = to_simbody(c.parent_frame), M = to_simbody(c.child_frame);
  std::vector<SimTK::ConstraintIndex> list;
  const auto keep = [&](const Constraint& x) { list.push_back(x.getConstraintIndex()); };
  const auto hold_axis = [&] {  // z of M at right angles to x and y of F
    keep(Constraint::ConstantAngle(P, F.x(), C, M.z()));
    keep(Constraint::ConstantAngle(P, F.y(), C, M.z()));
  };
  const auto hold_on_axis = [&] {  // origin of M on z of F
    keep(Constraint::PointInPlane(P, F.x(), SimTK::dot(F.x(), F.p()), C, M.p()));
    keep(Constraint::PointInPlane(P, F.y(), SimTK::dot(F.y(), F.p()), C, M.p()));
  };
  switch (c.kind) {
    case Kind::Fixed:
      keep(Constraint::Weld(P, F, C, M));
      break;
    case Kind::Revolute:
      keep(Constraint::Ball(P, F.p(), C, M.p()));
      hold_axis();
      break;
    case Kind::Spherical:
      keep(Constraint::Ball(P, F.p(), C, M.p()));
      break;
    case Kind::Universal:
      keep(Constraint::Ball(P, F.p(), C, M.p()));
      keep(Constraint::ConstantAngle(P, F.x(), C, M.y()));
      break;
    case Kind::Prismatic:
      keep(Constraint::ConstantOrientation(P, F.R(), C, M.R()));
      hold_on_axis();
      break;
    case Kind::Cylindrical:
      hold_axis();
      hold_on_axis();
      break;
    case Kind::Distance:
      keep(Constraint::Rod(P, F.p(), C, M.p(), c.distance));
      break;
    case Kind::Free:
      break;
  }
  constraints.push_back(list);
}

System::System(const Description& d, ForceFunction force, PowerFunction power, const Settings& settings)
    : inside_(std::make_unique<Inside>(d)) {
  Inside& in = *inside_;
  const SimTK::Force::UniformGravity gravity(in.forces, in.matter, to_simbody(d.gravity));
  in.bodies.reserve(d.mobilizers.size());  // others keep a reference
  for (const Mobilizer& m : d.mobilizers) in.add(m);
  for (const Closure& c : d.closures) in.add(c);
  in.outside = new OutsideForces(std::move(force), std::move(power), in.matter, in.forces, in.bodies);
  const SimTK::Force::Custom outside(in.forces, in.outside);  // owns it now
  in.system.realizeTopology();
  if (settings.step > 0) {
    in.integrator = std::make_unique<SimTK::VerletIntegrator>(in.system, settings.step);
  } else {
    in.integrator = std::make_unique<SimTK::RungeKuttaMersonIntegrator>(in.system);
    if (settings.longest_step > 0) in.integrator->setMaximumStepSize(settings.longest_step);
  }
  in.integrator->setAccuracy(settings.accuracy);
  in.integrator->setConstraintTolerance(std::min(1e-10, 0.1 * settings.accuracy));
  in.integrator->setProjectEveryStep(true);
  in.integrator->setAllowInterpolation(false);
  in.integrator->setReturnEveryInternalStep(true);
}

System::~System() = default;

void System::start(double time, const std::vector<BodyMotion>& motion) {
  Inside& in = *inside_;
  SimTK::State s = in.system.getDefaultState();
  in.system.realizeModel(s);
  s.setTime(time);
  s.updZWeights() = 1e-12;  // the ledger is not to choose the steps
  const std::vector<Mobilizer>& mobilizers = in.description.mobilizers;
  const auto pose_of = [&](int i) { return i < 0 ? SimTK::Transform() : to_simbody(motion[static_cast<size_t>(i)].X); };
  const auto spin_of = [&](int i) { return i < 0 ? SimTK::Vec3(0) : to_simbody(motion[static_cast<size_t>(i)].w); };
  const auto velocity_of = [&](int i, const SimTK::Vec3& p) {
    if (i < 0) return SimTK::Vec3(0);
    const BodyMotion& m = motion[static_cast<size_t>(i)];
    return to_simbody(m.v) + SimTK::cross(to_simbody(m.w), p - to_simbody(m.X.p));
  };
  const auto frames_of = [&](size_t i) {
    const Mobilizer& m = mobilizers[i];
    return std::make_pair(pose_of(m.inboard) * joint_frame(m.kind, m.inboard_frame),
                          pose_of(static_cast<int>(i)) * joint_frame(m.kind, m.outboard_frame));
  };
  for (size_t i = 0; i < mobilizers.size(); ++i) {
    const auto [F, M] = frames_of(i);
    in.matter.getMobilizedBody(in.bodies[i]).setQToFitTransform(s, ~F * M);
  }
  in.system.realize(s, SimTK::Stage::Position);
  for (size_t i = 0; i < mobilizers.size(); ++i) {
    const auto [F, M] = frames_of(i);
    const int inboard = mobilizers[i].inboard, body = static_cast<int>(i);
    const SimTK::Vec3 w_F = spin_of(inboard), w = spin_of(body) - w_F;
    const SimTK::Vec3 v = velocity_of(body, M.p()) - velocity_of(inboard, F.p()) - SimTK::cross(w_F, M.p() - F.p());
    in.matter.getMobilizedBody(in.bodies[i]).setUToFitVelocity(s, SimTK::SpatialVec(~F.R() * w, ~F.R() * v));
  }
  in.integrator->initialize(s);
  in.read();
}

double System::advance(double until) {
  const double before = time();
  // it says where it stands before it moves at first
  while (!(time() > before)) (void)inside_->integrator->stepTo(until);
  inside_->read();
  return time();
}

double System::time() const { return inside_->integrator->getAdvancedTime(); }
const std::vector<BodyMotion>& System::motion() const { return inside_->motion; }

void System::invalidate_forces() {
  inside_->integrator->getAdvancedState().invalidateAllCacheAtOrAbove(SimTK::Stage::Dynamics);
}

Three System::work() const { return inside_->outside->work_of(inside_->integrator->getAdvancedState()); }

void System::find_reactions(std::vector<Wrench>& mobilizers, std::vector<Wrench>& closures) const {
  const Inside& in = *inside_;
  const SimTK::State& s = in.integrator->getAdvancedState();
  in.system.realize(s, SimTK::Stage::Acceleration);
  mobilizers.resize(in.bodies.size());
  for (size_t i = 0; i < in.bodies.size(); ++i) {
    const SimTK::SpatialVec at_M = in.matter.getMobilizedBody(in.bodies[i]).findMobilizerReactionOnBodyAtMInGround(s);
    mobilizers[i] = {from_simbody(at_M[1]), from_simbody(at_M[0])};
  }
  closures.assign(in.constraints.size(), {});
  for (size_t i = 0; i < in.constraints.size(); ++i) {
    const MobilizedBodyIndex child = in.index_of(in.description.closures[i].child);
    const SimTK::Transform& X = in.matter.getMobilizedBody(child).getBodyTransform(s);
    const SimTK::Vec3 p_M = X * to_simbody(in.description.closures[i].child_frame.p);
    SimTK::Vec3 force(0), moment(0);
    for (const SimTK::ConstraintIndex index : in.constraints[i]) {
      const SimTK::Constraint& c = in.matter.getConstraint(index);
      const SimTK::Vector_<SimTK::SpatialVec> on = c.getConstrainedBodyForcesAsVector(s);
      for (SimTK::ConstrainedBodyIndex k(0); k < c.getNumConstrainedBodies(); ++k) {
        if (c.getMobilizedBodyFromConstrainedBody(k).getMobilizedBodyIndex() != child) continue;
        // Simbody's constraint forces stand on the other side of the equation of motion
        force -= on[k][1];
        moment -= on[k][0] - SimTK::cross(p_M - X.p(), on[k][1]);
      }
    }
    closures[i] = {from_simbody(force), from_simbody(moment)};
  }
}

std::string version() {
  int major = 0, minor = 0, build = 0;
  SimTK_version_simbody(&major, &minor, &build);
  return std::to_string(major) + "." + std::to_string(minor) + (build > 0 ? "." + std::to_string(build) : "");
}

}  // namespace topple::engines::simbody

#endif
