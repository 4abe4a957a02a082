#include "engines/simbody.h"

#ifndef TOPPLE_WITH_SIMBODY

namespace topple::engines {

std::string simbody_version() { return {}; }
std::unique_ptr<Engine> make_simbody_engine(const Accuracy&) { return nullptr; }

}  // namespace topple::engines

#else

#include <algorithm>
#include <exception>
#include <memory>
#include <string>
#include <utility>

#include "engines/articulation.h"
#include "engines/course.h"
#include "engines/ground.h"
#include "engines/requirements.h"
#include "engines/simbody_system.h"
#include "engines/ties.h"
#include "mbs/joint_notes.h"

namespace topple::engines {

namespace {

constexpr double kDefaultAccuracy = 1e-9;
constexpr double kFixedStepAccuracy = 1e-5;  // Verlet's method iterates velocities to a tenth of it

simbody::Three to_three(const Vec3& v) { return {v.x, v.y, v.z}; }
Vec3 to_vec3(const simbody::Three& v) { return {v[0], v[1], v[2]}; }

simbody::Frame to_frame(const Pose& X) {
  const Mat3 R = to_matrix(normalized(X.q));
  simbody::Frame f{to_three(X.p), {}};
  for (int i = 0; i < 9; ++i) f.R[static_cast<size_t>(i)] = R(i / 3, i % 3);
  return f;
}

Pose to_pose(const simbody::Frame& f) {
  Mat3 R;
  for (int i = 0; i < 9; ++i) R(i / 3, i % 3) = f.R[static_cast<size_t>(i)];
  return {to_vec3(f.p), to_quat(R)};
}

simbody::Kind to_kind(mbs::Joint::Kind kind) {
  using Kind = mbs::Joint::Kind;
  switch (kind) {
    case Kind::Fixed:
      return simbody::Kind::Fixed;
    case Kind::Revolute:
      return simbody::Kind::Revolute;
    case Kind::Spherical:
      return simbody::Kind::Spherical;
    case Kind::Universal:
      return simbody::Kind::Universal;
    case Kind::Prismatic:
      return simbody::Kind::Prismatic;
    case Kind::Cylindrical:
      return simbody::Kind::Cylindrical;
    case Kind::Distance:
      return simbody::Kind::Distance;
  }
  return simbody::Kind::Free;
}

/// A model in Simbody's terms, for one set of live joints and masses.
class Built {
 public:
  Built(const Course& course, const Ground& ground, const simbody::Settings& settings)
      : course_(course),
        ground_(ground),
        model_(course.model()),
        articulation_(make_articulation(model_, course.joint_live())),
        mobilizer_(model_.bodies.size(), -1),
        motion_(course.motion()) {
    leave_out_idle_loops();
    const simbody::Description description = describe();
    const Forces& forces = course.forces();
    simbody::PowerFunction power;
    if (forces.has_power() || ground.is_there())
      power = [this, &forces](double time, const std::vector<simbody::BodyMotion>& m) -> simbody::Three {
        read(m);
        const Power p = forces.calc_power(time, motion_);
        double contact = 0;
        wrench_.assign(model_.bodies.size(), {});
        ground_.calc(motion_, course_.bodies(), wrench_, contact);
        return {p.damping, p.loads, contact};
      };
    system_ = std::make_unique<simbody::System>(
        description,
        [this, &forces](double time, const std::vector<simbody::BodyMotion>& m, std::vector<simbody::Wrench>& on) {
          read(m);
          forces.calc(time, motion_, wrench_);
          double power_of_contact = 0;
          ground_.calc(motion_, course_.bodies(), wrench_, power_of_contact);
          on.resize(m.size());
          for (size_t i = 0; i < on.size(); ++i) {
            const Wrench& w = wrench_[static_cast<size_t>(articulation_.branches[i].body)];
            on[i] = {to_three(w.force), to_three(w.torque)};
          }
        },
        power, settings);
    std::vector<simbody::BodyMotion> start;
    const Motion& now = course.motion();
    for (const Branch& b : articulation_.branches) {
      const size_t i = static_cast<size_t>(b.body);
      start.push_back({to_frame(now.X_WB[i]), to_three(now.v_WB[i]), to_three(now.w_WB[i])});
    }
    system_->start(course.time(), start);
  }

  simbody::System& system() { return *system_; }
  /// Joints that are no constraints because others hold the same; their reactions are zero.
  const std::vector<int>& left_out() const { return left_out_; }

  const Motion& motion() {
    read(system_->motion());
    return motion_;
  }

  Touch calc_touch() {
    double power = 0;
    wrench_.assign(model_.bodies.size(), {});
    return {-ground_.calc(motion(), course_.bodies(), wrench_, power), 0};
  }

  Reactions find_reactions() {
    const size_t J = model_.joints.size();
    Reactions r{std::vector<Vec3>(J), std::vector<Vec3>(J)};
    std::vector<simbody::Wrench> at_mobilizer, at_closure;
    system_->find_reactions(at_mobilizer, at_closure);
    read(system_->motion());
    for (size_t i = 0; i < articulation_.branches.size(); ++i) {
      const Branch& b = articulation_.branches[i];
      if (b.joint < 0) continue;
      const size_t index = static_cast<size_t>(b.joint);
      const Vec3 force = to_vec3(at_mobilizer[i].force), moment = to_vec3(at_mobilizer[i].torque);
      r.force[index] = force;
      r.moment[index] = moment;
      if (!b.reversed) continue;
      // so far that of the child on the parent, at the origin of F
      const mbs::Joint& j = model_.joints[index];
      const auto place = [&](mbs::BodyId id, const Vec3& p) {
        return id == mbs::kGround ? p : motion_.X_WB[static_cast<size_t>(id.index)] * p;
      };
      const Vec3 lever = place(j.child, j.X_CM.p) - place(j.parent, j.X_PF.p);
      r.force[index] = -force;
      r.moment[index] = cross(lever, force) - moment;
    }
    for (size_t i = 0; i < articulation_.loops.size(); ++i) {
      const size_t index = static_cast<size_t>(articulation_.loops[i]);
      r.force[index] = to_vec3(at_closure[i].force);
      r.moment[index] = to_vec3(at_closure[i].torque);
    }
    return r;
  }

 private:
  /// A frame of the model's body in Simbody's: fixed bodies are parts of the ground.
  Pose frame_on(mbs::BodyId id, const Pose& X_BF) const {
    if (id == mbs::kGround || !model_.bodies[static_cast<size_t>(id.index)].fixed) return X_BF;
    return model_.bodies[static_cast<size_t>(id.index)].X_WB * X_BF;
  }
  int mobilizer_of(int body) const { return is_ground(model_, body) ? -1 : mobilizer_[static_cast<size_t>(body)]; }

  /// Simbody gives up where no constraint holds anything.
  void leave_out_idle_loops() {
    std::vector<double> distance(model_.joints.size());
    for (size_t j = 0; j < distance.size(); ++j) distance[j] = course_.distance(j);
    left_out_ = find_idle_loops(model_, articulation_, distance);
    std::erase_if(articulation_.loops,
                  [&](int loop) { return std::binary_search(left_out_.begin(), left_out_.end(), loop); });
  }

  simbody::Description describe() {
    simbody::Description d;
    d.gravity = to_three(model_.gravity);
    for (const Branch& b : articulation_.branches) {
      simbody::Mobilizer m;
      const BodyNow& now = course_.bodies()[static_cast<size_t>(b.body)];
      const Mat3& I = now.inertia;
      m.inboard = mobilizer_of(b.inboard);
      m.mass = now.mass;
      m.centre = to_three(now.p_BBcm);
      m.inertia = {I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)};
      if (b.joint >= 0) {
        const mbs::Joint& j = model_.joints[static_cast<size_t>(b.joint)];
        m.kind = to_kind(j.kind);
        m.reversed = b.reversed;
        const Pose on_parent = frame_on(j.parent, j.X_PF), on_child = frame_on(j.child, j.X_CM);
        m.inboard_frame = to_frame(b.reversed ? on_child : on_parent);
        m.outboard_frame = to_frame(b.reversed ? on_parent : on_child);
      }
      mobilizer_[static_cast<size_t>(b.body)] = static_cast<int>(d.mobilizers.size());
      d.mobilizers.push_back(m);
    }
    for (const int loop : articulation_.loops) {
      const mbs::Joint& j = model_.joints[static_cast<size_t>(loop)];
      d.closures.push_back({to_kind(j.kind), mobilizer_of(j.parent.index), mobilizer_of(j.child.index),
                            to_frame(frame_on(j.parent, j.X_PF)), to_frame(frame_on(j.child, j.X_CM)),
                            course_.distance(static_cast<size_t>(loop))});
    }
    return d;
  }

  void read(const std::vector<simbody::BodyMotion>& m) {
    for (size_t i = 0; i < m.size(); ++i) {
      const size_t b = static_cast<size_t>(articulation_.branches[i].body);
      motion_.X_WB[b] = to_pose(m[i].X);
      motion_.v_WB[b] = to_vec3(m[i].v);
      motion_.w_WB[b] = to_vec3(m[i].w);
    }
  }

  const Course& course_;
  const Ground& ground_;
  const mbs::Model& model_;
  Articulation articulation_;
  std::vector<int> left_out_;
  std::vector<int> mobilizer_;  // of each body (B)
  Motion motion_;               // places of fixed bodies stay
  std::vector<Wrench> wrench_;
  std::unique_ptr<simbody::System> system_;
};

/// Whether anything depends on what happened at accepted states or comes suddenly, so that these must not lie far
/// apart.
bool has_history(const mbs::Model& m) {
  if (can_touch_ground(m)) return true;
  const auto breaks = [](const auto& list, auto strength) {
    return std::any_of(list.begin(), list.end(), [&](const auto& x) { return strength(x) < mbs::kUnlimited; });
  };
  if (!m.elements.empty() || !m.rotational_elements.empty()) return true;
  for (const mbs::Event& e : m.events)
    if (!e.triggers.empty()) return true;
  return breaks(m.cables, [](const auto& c) { return c.strength; }) ||
         breaks(m.springs, [](const auto& s) { return std::min(s.tension_strength, s.compression_strength); }) ||
         breaks(m.rotational_springs, [](const auto& s) { return s.strength; }) ||
         breaks(m.bushings, [](const auto& b) { return *std::min_element(b.strength, b.strength + 6); }) ||
         breaks(m.joints, [](const auto& j) {
           return std::min({j.tension_limit, j.shear_limit, j.moment_limit, j.rotation_limit});
         });
}

class SimbodyEngine : public Engine {
 public:
  explicit SimbodyEngine(const Accuracy& accuracy) : accuracy_(accuracy) {}
  std::string name() const override { return "simbody"; }
  std::string version() const override { return simbody_version(); }

  std::vector<Unsupported> find_unsupported(const mbs::Model& model, const mbs::Options& options) const override {
    std::vector<Unsupported> out = find_impossible_inertias(model);
    for (Unsupported& u : find_opening_joints(model, options)) out.push_back(std::move(u));
    for (Unsupported& u : find_planes(model)) out.push_back(std::move(u));
    if (can_touch_bodies(model)) out.push_back({"contact.bodies", "contact between bodies"});
    for (size_t i = 0; i < model.contact.pairs.size() && can_touch_ground(model); ++i)
      if (model.contact.pairs[i].touches && model.contact.pairs[i].b == mbs::kGround)
        out.push_back({"contact.pairs[" + std::to_string(i) + "]", "rules of its own for a body on the ground"});
    return out;
  }

 protected:
  mbs::Summary solve(const mbs::Model& model, const mbs::Options& options) const override {
    Course course(model, options);
    simbody::Settings settings;
    if (options.step > 0 && !(accuracy_.relative > 0)) settings.step = options.step;
    settings.accuracy = accuracy_.relative > 0 ? accuracy_.relative
                        : settings.step > 0    ? kFixedStepAccuracy
                                               : kDefaultAccuracy;
    if (!course.start(settings.step, true)) return course.finish(0);
    long steps = 0;
    try {
      if (settings.step == 0 && has_history(model)) settings.longest_step = choose_step(model, options);
      Ground ground(model, course.bodies(), settings.step);
      if (ground.is_there()) {
        ground.advance(course.motion(), find_ties(model, course.forces(), course.joint_live()).is_grounded);
        course.note("contact with the ground is of springs and dampers at corners, not the native engine's");
      }
      Work before;
      bool is_first = true;
      while (!course.is_over()) run_as_built(course, ground, settings, is_first, before, steps);
    } catch (const std::exception& e) { course.fail(e.what()); }
    return course.finish(steps);
  }

 private:
  /// Until the end or until the system must be built anew.
  static void run_as_built(Course& course, Ground& ground, const simbody::Settings& settings, bool& is_first,
                           Work& before, long& steps) {
    using Verdict = Course::Verdict;
    Built built(course, ground, settings);
    if (!built.left_out().empty())
      course.note(mbs::list_joints(course.model(), built.left_out()) +
                  ": others hold the same wherever the bodies go; left out, with reactions of 0");
    simbody::System& system = built.system();
    std::vector<unsigned char> is_held;
    const auto find_held = [&] {
      if (ground.is_there()) is_held = find_ties(course.model(), course.forces(), course.joint_live()).is_grounded;
    };
    const auto sum = [&](const simbody::Three& w) {
      return Work{before.damping + w[0], before.loads + w[1], before.contact + w[2]};
    };
    const auto accept = [&] {
      const Touch touch = ground.is_there() ? built.calc_touch() : Touch{};
      const Verdict v = course.accept(system.time(), built.motion(), sum(system.work()), touch,
                                      [&] { return built.find_reactions(); });
      if (v != Verdict::GoOn) find_held();
      if (v == Verdict::Rebuild) ground.update_shapes(course.bodies());
      if (ground.is_there()) ground.advance(built.motion(), is_held);
      return v;
    };
    find_held();
    Verdict verdict = is_first ? accept() : Verdict::GoOn;
    is_first = false;
    while (verdict == Verdict::GoOn || verdict == Verdict::ForcesJumped) {
      if (verdict == Verdict::ForcesJumped) system.invalidate_forces();
      system.advance(course.next_stop());
      ++steps;
      verdict = accept();
    }
    before = sum(system.work());
  }

  Accuracy accuracy_;
};

}  // namespace

std::string simbody_version() { return simbody::version(); }

std::unique_ptr<Engine> make_simbody_engine(const Accuracy& accuracy) {
  return std::make_unique<SimbodyEngine>(accuracy);
}

}  // namespace topple::engines

#endif
