#include "engines/mujoco.h"

#ifndef TOPPLE_WITH_MUJOCO

namespace topple::engines {

std::string mujoco_version() { return {}; }
std::unique_ptr<Engine> make_mujoco_engine() { return nullptr; }

}  // namespace topple::engines

#else

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <map>
#include <mutex>
#include <stdexcept>
#include <vector>

#include "engines/articulation.h"
#include "engines/course.h"
#include "engines/mjcf.h"
#include "engines/requirements.h"

namespace topple::engines {

namespace {

/// MuJoCo's handlers of errors and warnings are the process's; these act for threads that are inside a run alone. Its
/// own would end the process, or write to a file.
thread_local bool is_inside = false;
thread_local std::string last_warning;

void on_error(const char* message) {
  if (is_inside) throw std::runtime_error(std::string("MuJoCo: ") + message);
  std::fprintf(stderr, "MuJoCo: %s\n", message);
  std::abort();
}

void on_warning(const char* message) { last_warning = message; }

struct Inside {
  Inside() {
    static std::once_flag once;
    std::call_once(once, [] {
      mju_user_error = on_error;
      mju_user_warning = on_warning;
    });
    is_inside = true;
    last_warning.clear();
  }
  ~Inside() { is_inside = false; }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;
};

struct Delete {
  void operator()(mjModel* m) const { mj_deleteModel(m); }
  void operator()(mjData* d) const { mj_deleteData(d); }
};

std::unique_ptr<mjModel, Delete> load(const std::string& text) {
  static std::mutex mutex;  // the library keeps the last model it has read
  const std::lock_guard<std::mutex> lock(mutex);
  const auto vfs = std::make_unique<mjVFS>();
  mj_defaultVFS(vfs.get());
  if (mj_makeEmptyFileVFS(vfs.get(), "model.xml", static_cast<int>(text.size())) != 0)
    throw std::runtime_error("MuJoCo: no memory for the model's text");
  std::memcpy(vfs->filedata[mj_findFileVFS(vfs.get(), "model.xml")], text.data(), text.size());
  char error[1000] = "";
  std::unique_ptr<mjModel, Delete> m(mj_loadXML("model.xml", vfs.get(), error, sizeof error));
  mj_deleteVFS(vfs.get());
  mj_freeLastXML();
  if (!m) throw std::runtime_error(std::string("MuJoCo does not take the model: ") + error);
  return m;
}

Vec3 to_vec3(const mjtNum* v) { return {v[0], v[1], v[2]}; }

/// Row `index` of an array whose rows are `width` wide.
template <class Number>
Number* row_of(Number* array, int width, int index) {
  return array + static_cast<std::ptrdiff_t>(width) * index;
}

using Pair = std::pair<int, int>;  // of shapes, by numbers that do not change

/// Overlap that two shapes have when they may touch for the first time is allowed: it carries no force, shrinks as they
/// part and never grows again.
class Overlaps {
 public:
  /// Pairs may touch that could not.
  void expect_new() { is_new_ = true; }
  /// The pairs that overlap now, and by how much [m].
  void update(const std::map<Pair, double>& now) {
    for (auto at = allowed_.begin(); at != allowed_.end();) {
      const auto found = now.find(at->first);
      if (found == now.end()) {
        at = allowed_.erase(at);
        continue;
      }
      at->second = std::min(at->second, found->second);
      ++at;
    }
    // those that overlapped before touch already, and others begin from nothing
    for (const auto& [pair, depth] : now) allowed_.emplace(pair, is_new_ ? depth : 0);
    is_new_ = false;
  }
  double allowed(const Pair& p) const {
    const auto at = allowed_.find(p);
    return at == allowed_.end() ? 0 : at->second;
  }

 private:
  std::map<Pair, double> allowed_;  // of all pairs that overlap [m]
  bool is_new_ = true;
};

/// A model as MuJoCo's, for one set of live joints and masses.
class Built {
 public:
  Built(const Course& course, Overlaps& overlaps, double step)
      : course_(course),
        overlaps_(overlaps),
        model_(course.model()),
        articulation_(make_articulation(model_, course.joint_live())) {
    const Ties ties = find_present_ties();
    touches_ = can_touch_ground(model_) || can_touch_bodies(model_);
    const Mjcf mjcf = make_mjcf(course, articulation_, ties, step);
    m_ = load(mjcf.text);
    d_.reset(mj_makeData(m_.get()));
    if (!d_) throw std::runtime_error("MuJoCo: no memory for the state");
    motion_ = course.motion();
    body_.assign(model_.bodies.size(), -1);
    for (const Branch& b : articulation_.branches)
      body_[static_cast<size_t>(b.body)] = find(mjOBJ_BODY, "b" + std::to_string(b.body));
    reaction_at_.assign(model_.joints.size(), {});
    for (const Branch& b : articulation_.branches) {
      set_speed(b);
      if (b.joint >= 0) reaction_at_[static_cast<size_t>(b.joint)] = {body_[static_cast<size_t>(b.body)], b.reversed};
    }
    for (size_t i = 0; i < articulation_.loops.size(); ++i) {
      const mbs::Joint& j = model_.joints[static_cast<size_t>(articulation_.loops[i])];
      if (mjcf.twin_of_loop[i] < 0) continue;
      const bool reversed = is_ground(model_, j.child.index);
      const Branch b{reversed ? j.parent.index : j.child.index, reversed ? j.child.index : j.parent.index,
                     articulation_.loops[i], reversed};
      set_speed(b);
      reaction_at_[static_cast<size_t>(b.joint)] = {find(mjOBJ_BODY, "t" + std::to_string(mjcf.twin_of_loop[i])),
                                                    reversed};
    }
    read_excluded(ties);
    read_shapes();
    update_ties();
    const size_t nv = static_cast<size_t>(m_->nv);
    q_.resize(static_cast<size_t>(m_->nq));
    v_.resize(nv);
    for (auto& k : v_stage_) k.resize(nv);
    for (auto& k : a_stage_) k.resize(nv);
    mean_.resize(nv);
    look();
  }

  const Motion& motion() const { return motion_; }
  const Work& work() const { return work_; }
  const Touch& touch() const { return touch_; }
  bool touches() const { return touches_; }

  /// One step of size h from `time`, positions and velocities known (look()). Empty, or why it failed.
  std::string advance(double time, double h) {
    if (touches_) {
      push(time);
      const Power before = power(time);
      mju_copy(v_.data(), d_->qvel, m_->nv);
      mj_step2(m_.get(), d_.get());
      read_contacts();
      mju_addTo(v_.data(), d_->qvel, m_->nv);
      work_.contact += 0.5 * h * mju_dot(v_.data(), d_->qfrc_constraint, m_->nv);
      look();
      const Power after = power(time + h);
      work_.damping += 0.5 * h * (before.damping + after.damping);
      work_.loads += 0.5 * h * (before.loads + after.loads);
    } else {
      advance_runge_kutta(time, h);
    }
    return find_failure();
  }

  Reactions find_reactions(double time) {
    push(time);
    mj_forwardSkip(m_.get(), d_.get(), mjSTAGE_VEL, 1);
    mj_rnePostConstraint(m_.get(), d_.get());
    const size_t J = model_.joints.size();
    Reactions r{std::vector<Vec3>(J), std::vector<Vec3>(J)};
    for (size_t i = 0; i < articulation_.loops.size(); ++i) correct_for_loop(i, r);
    for (size_t i = 0; i < J; ++i) {
      const auto [body, reversed] = reaction_at_[i];
      if (body < 0 || !course_.joint_live()[i]) continue;
      const mjtNum* at_centre = row_of(d_->cfrc_int, 6, body);
      const Vec3 c = to_vec3(row_of(d_->subtree_com, 3, m_->body_rootid[body]));
      const Vec3 p = place_of(model_.joints[i].child, model_.joints[i].X_CM.p);
      const Vec3 force = to_vec3(at_centre + 3), moment = to_vec3(at_centre) - cross(p - c, force);
      r.force[i] = reversed ? -force : force;
      r.moment[i] = reversed ? -moment : moment;
    }
    return r;
  }

  /// Contacts that are possible now.
  void update_ties() {
    if (!touches_) return;
    overlaps_.expect_new();
    const Ties ties = find_present_ties();
    const bool ground = model_.contact.ground, bodies = model_.contact.bodies;
    for (size_t b = 0; b < model_.bodies.size(); ++b)
      for (size_t i = 0; i < course_.bodies()[b].shapes.size(); ++i) {
        const int g = find(mjOBJ_GEOM, "g" + std::to_string(b) + "." + std::to_string(i));
        const bool fixed = model_.bodies[b].fixed;
        m_->geom_contype[g] = bodies ? kBodyBit : 0;
        m_->geom_conaffinity[g] =
            fixed ? 0 : (bodies ? kBodyBit : 0) | (ground && !ties.is_grounded[b] ? kGroundBit : 0);
      }
    // the list is sorted and stays so: a pair that may touch again is replaced by the one before it
    for (size_t e = 0; e < excluded_.size(); ++e)
      if (!std::binary_search(ties.pairs.begin(), ties.pairs.end(), excluded_[e]))
        m_->exclude_signature[e] = e > 0 ? m_->exclude_signature[e - 1] : 0;
  }

 private:
  int find(int type, const std::string& name) const {
    const int id = mj_name2id(m_.get(), type, name.c_str());
    if (id < 0) throw std::runtime_error("MuJoCo's model has no \"" + name + "\"");
    return id;
  }

  Ties find_present_ties() const { return find_ties(model_, course_.forces(), course_.joint_live()); }

  /// Numbers of shapes: 4096 for each body, and a new set for each time that it was replaced.
  void read_shapes() {
    shape_of_.assign(static_cast<size_t>(m_->ngeom), -1);
    for (size_t b = 0; b < model_.bodies.size(); ++b)
      for (size_t i = 0; i < course_.bodies()[b].shapes.size(); ++i) {
        const int g = find(mjOBJ_GEOM, "g" + std::to_string(b) + "." + std::to_string(i));
        shape_of_[static_cast<size_t>(g)] =
            static_cast<int>(4096 * b + (512 * static_cast<size_t>(course_.bodies()[b].replaced) + i) % 4096);
      }
  }

  /// The pairs behind MuJoCo's sorted list of bodies that do not touch: (first + 1) << 16 | (second + 1).
  void read_excluded(const Ties& ties) {
    std::vector<std::pair<int, std::pair<int, int> > > known;
    for (const auto& pair : ties.pairs) {
      const int a = mj_name2id(m_.get(), mjOBJ_BODY, ("b" + std::to_string(pair.first)).c_str());
      const int b = mj_name2id(m_.get(), mjOBJ_BODY, ("b" + std::to_string(pair.second)).c_str());
      if (a >= 0 && b >= 0) known.emplace_back((std::min(a, b) + 1) << 16 | (std::max(a, b) + 1), pair);
    }
    std::sort(known.begin(), known.end());
    for (int e = 0; e < m_->nexclude; ++e) {
      const auto at =
          std::lower_bound(known.begin(), known.end(), std::pair(m_->exclude_signature[e], std::pair(-1, -1)));
      if (at == known.end() || at->first != m_->exclude_signature[e])
        throw std::runtime_error("MuJoCo's list of bodies that do not touch is not as expected");
      excluded_.push_back(at->second);
    }
  }

  /// What MuJoCo's sum of forces along the tree lacks: tendons, and half of what it takes a weld's rotational rows for.
  void correct_for_loop(size_t number, Reactions& r) {
    const size_t index = static_cast<size_t>(articulation_.loops[number]);
    const mbs::Joint& j = model_.joints[index];
    const int equality = find(mjOBJ_EQUALITY, "e" + std::to_string(index));
    int row = 0;
    while (row < d_->nefc && !(d_->efc_type[row] == mjCNSTR_EQUALITY && d_->efc_id[row] == equality)) ++row;
    if (row == d_->nefc) return;
    const mjtNum* f = d_->efc_force + row;
    if (j.kind == mbs::Joint::Kind::Distance) {
      const Vec3 p_F = place_of(j.parent, j.X_PF.p), p_M = place_of(j.child, j.X_CM.p);
      r.force[index] = (f[0] / norm(p_M - p_F)) * (p_M - p_F);
      add_external(mujoco_body(j.child), r.force[index], p_M, {});
      add_external(mujoco_body(j.parent), -r.force[index], p_F, {});
      return;
    }
    const int twin = reaction_at_[index].body, body = mujoco_body(reaction_at_[index].reversed ? j.parent : j.child);
    const mjtNum* q = row_of(d_->xquat, 4, body);
    const Vec3 taken = to_vec3(f + 3), torque = 0.5 * (to_matrix({q[0], q[1], q[2], q[3]}) * taken);
    add_external(body, {}, {}, torque - taken);
    add_external(twin, {}, {}, taken - torque);
  }
  int mujoco_body(mbs::BodyId id) const {
    return is_ground(model_, id.index) ? 0 : body_[static_cast<size_t>(id.index)];
  }
  /// A further force at a point p on a body, and a torque, in the sums along the tree.
  void add_external(int body, const Vec3& force, const Vec3& p, const Vec3& torque) {
    for (int b = body; b > 0; b = m_->body_parentid[b]) {
      const Vec3 moment = torque + cross(p - to_vec3(row_of(d_->subtree_com, 3, m_->body_rootid[b])), force);
      for (int k = 0; k < 3; ++k) {
        d_->cfrc_int[6 * b + k] -= moment[k];
        d_->cfrc_int[6 * b + 3 + k] -= force[k];
      }
    }
  }

  Vec3 place_of(mbs::BodyId id, const Vec3& p) const {
    return id == mbs::kGround ? p : motion_.X_WB[static_cast<size_t>(id.index)] * p;
  }

  /// Speeds of the joints of a branch, those of a twin too, from the motion at the start.
  void set_speed(const Branch& b) {
    const size_t body = static_cast<size_t>(b.body);
    const Vec3 w = motion_.w_WB[body], v = motion_.v_WB[body];
    const Mat3 R = to_matrix(motion_.X_WB[body].q);
    const auto put = [&](int joint, const Vec3& x) {
      for (int k = 0; k < 3; ++k) d_->qvel[m_->jnt_dofadr[joint] + k] = x[k];
    };
    if (b.joint < 0) {
      const int free = find(mjOBJ_JOINT, "f" + std::to_string(b.body));
      put(free, v);
      const Vec3 in_body = transpose_times(R, w);
      for (int k = 0; k < 3; ++k) d_->qvel[m_->jnt_dofadr[free] + 3 + k] = in_body[k];
      return;
    }
    const mbs::Joint& j = model_.joints[static_cast<size_t>(b.joint)];
    const Vec3 p = place_of(b.reversed ? j.parent : j.child, b.reversed ? j.X_PF.p : j.X_CM.p);
    Vec3 w_rel = w, v_rel = v + cross(w, p - motion_.X_WB[body].p);
    if (!is_ground(model_, b.inboard)) {
      const size_t in = static_cast<size_t>(b.inboard);
      w_rel -= motion_.w_WB[in];
      v_rel -= motion_.v_WB[in] + cross(motion_.w_WB[in], p - motion_.X_WB[in].p);
    }
    const std::string name = "j" + std::to_string(b.joint) + ".";
    const auto axis = [&](int joint) { return R * to_vec3(row_of(m_->jnt_axis, 3, joint)); };
    for (const char* number : {"0", "1"}) {
      const int joint = mj_name2id(m_.get(), mjOBJ_JOINT, (name + number).c_str());
      if (joint < 0) break;
      if (m_->jnt_type[joint] == mjJNT_BALL)
        put(joint, transpose_times(R, w_rel));
      else
        d_->qvel[m_->jnt_dofadr[joint]] = dot(axis(joint), m_->jnt_type[joint] == mjJNT_SLIDE ? v_rel : w_rel);
    }
  }

  /// Positions and velocities of the bodies at MuJoCo's coordinates.
  void look() {
    if (!touches_) {
      mj_step1(m_.get(), d_.get());
      return read();
    }
    // the parts of mj_step1, with a look at the contacts before constraints are made of them
    mj_checkPos(m_.get(), d_.get());
    mj_checkVel(m_.get(), d_.get());
    mj_kinematics(m_.get(), d_.get());
    mj_comPos(m_.get(), d_.get());
    mj_tendon(m_.get(), d_.get());
    mj_crb(m_.get(), d_.get());
    mj_factorM(m_.get(), d_.get());
    mj_collision(m_.get(), d_.get());
    forgive_overlaps();
    mj_makeConstraint(m_.get(), d_.get());
    mj_transmission(m_.get(), d_.get());
    mj_projectConstraint(m_.get(), d_.get());
    mj_fwdVelocity(m_.get(), d_.get());
    read();
  }

  void forgive_overlaps() {
    std::map<Pair, double> deepest;
    for (int i = 0; i < d_->ncon; ++i) {
      const mjContact& c = d_->contact[i];
      double& depth = deepest[pair_of(c)];
      depth = std::max(depth, -c.dist);
    }
    overlaps_.update(deepest);
    for (int i = 0; i < d_->ncon; ++i) {
      mjContact& c = d_->contact[i];
      c.dist += overlaps_.allowed(pair_of(c));
      if (c.dist >= c.includemargin) c.exclude = 1;
    }
  }
  Pair pair_of(const mjContact& c) const {
    const int a = shape_of_[static_cast<size_t>(c.geom1)], b = shape_of_[static_cast<size_t>(c.geom2)];
    return {std::min(a, b), std::max(a, b)};
  }
  void read() {
    for (const Branch& b : articulation_.branches) {
      const size_t i = static_cast<size_t>(b.body);
      const int id = body_[i];
      const mjtNum* q = row_of(d_->xquat, 4, id);
      motion_.X_WB[i] = {to_vec3(row_of(d_->xpos, 3, id)), {q[0], q[1], q[2], q[3]}};
      mjtNum v[6];
      mj_objectVelocity(m_.get(), d_.get(), mjOBJ_XBODY, id, v, 0);
      motion_.w_WB[i] = to_vec3(v);
      motion_.v_WB[i] = to_vec3(v + 3);
    }
  }

  /// Forces of the elements at the motion.
  void push(double time) {
    course_.forces().calc(time, motion_, wrench_);
    for (const Branch& b : articulation_.branches) {
      const size_t i = static_cast<size_t>(b.body);
      const int id = body_[i];
      const Wrench& w = wrench_[i];
      if (b.joint < 0) {
        // at the free joint itself: MuJoCo brings Cartesian forces there through a row for each body, full length
        const Vec3 in_body = transpose_times(to_matrix(motion_.X_WB[i].q), w.torque);
        mjtNum* at = d_->qfrc_applied + m_->body_dofadr[id];
        for (int k = 0; k < 3; ++k) {
          at[k] = w.force[k];
          at[3 + k] = in_body[k];
        }
        continue;
      }
      const Vec3 torque = w.torque - cross(to_vec3(row_of(d_->xipos, 3, id)) - motion_.X_WB[i].p, w.force);
      for (int k = 0; k < 3; ++k) {
        d_->xfrc_applied[6 * id + k] = w.force[k];
        d_->xfrc_applied[6 * id + 3 + k] = torque[k];
      }
    }
  }
  Power power(double time) const {
    return course_.forces().has_power() ? course_.forces().calc_power(time, motion_) : Power{};
  }

  /// The classical method of fourth order as mj_step does it, but with the forces of each stage.
  void advance_runge_kutta(double time, double h) {
    static constexpr double kWhen[4] = {0, 0.5, 0.5, 1}, kWeight[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
    const int nv = m_->nv;
    mju_copy(q_.data(), d_->qpos, m_->nq);
    mju_copy(v_.data(), d_->qvel, nv);
    const auto go = [&](const std::vector<mjtNum>& speed, double time_of) {
      mju_copy(d_->qpos, q_.data(), m_->nq);
      mj_integratePos(m_.get(), d_->qpos, speed.data(), time_of);
    };
    for (size_t s = 0; s < 4; ++s) {
      if (s > 0) {
        go(v_stage_[s - 1], kWhen[s] * h);
        mju_addScl(d_->qvel, v_.data(), a_stage_[s - 1].data(), kWhen[s] * h, nv);
        mj_fwdPosition(m_.get(), d_.get());
        mj_fwdVelocity(m_.get(), d_.get());
        read();
      }
      push(time + kWhen[s] * h);
      const Power p = power(time + kWhen[s] * h);
      work_.damping += kWeight[s] * h * p.damping;
      work_.loads += kWeight[s] * h * p.loads;
      mj_forwardSkip(m_.get(), d_.get(), mjSTAGE_VEL, 1);
      mju_copy(v_stage_[s].data(), d_->qvel, nv);
      mju_copy(a_stage_[s].data(), d_->qacc, nv);
    }
    mju_zero(mean_.data(), nv);
    for (size_t s = 0; s < 4; ++s) mju_addToScl(mean_.data(), v_stage_[s].data(), kWeight[s], nv);
    go(mean_, h);
    mju_copy(d_->qvel, v_.data(), nv);
    for (size_t s = 0; s < 4; ++s) mju_addToScl(d_->qvel, a_stage_[s].data(), kWeight[s] * h, nv);
    look();
  }

  void read_contacts() {
    touch_ = {};
    for (int i = 0; i < d_->ncon; ++i) {
      const mjContact& c = d_->contact[i];
      if (c.efc_address < 0) continue;
      const int a = m_->body_weldid[m_->geom_bodyid[c.geom1]], b = m_->body_weldid[m_->geom_bodyid[c.geom2]];
      if (a != 0 && b != 0) {
        ++touch_.body_contacts;
        continue;
      }
      mjtNum f[6], world[3];
      mj_contactForce(m_.get(), d_.get(), i, f);
      mju_rotVecMatT(world, f, c.frame);  // on the second geom
      touch_.on_ground += (b == 0 ? 1 : -1) * to_vec3(world);
    }
  }

  /// MuJoCo resets the state by itself when numbers get bad, and leaves out what its lists cannot hold.
  std::string find_failure() const {
    static constexpr struct {
      int kind;
      const char* what;
    } bad[] = {{mjWARN_BADQPOS, "a coordinate"}, {mjWARN_BADQVEL, "a velocity"}, {mjWARN_BADQACC, "an acceleration"}};
    for (const auto& b : bad)
      if (d_->warning[b.kind].number > 0)
        return "MuJoCo found " + std::string(b.what) + " that is not finite or beyond 1e10, number " +
               std::to_string(d_->warning[b.kind].lastinfo) + ", and reset its state";
    if (d_->warning[mjWARN_CONTACTFULL].number > 0) return "MuJoCo's list of contacts is full";
    if (d_->warning[mjWARN_CNSTRFULL].number > 0) return "MuJoCo's list of constraints is full";
    for (int i = 0; i < m_->nv; ++i)
      if (!std::isfinite(d_->qvel[i])) return "velocity number " + std::to_string(i) + " is no longer finite";
    return {};
  }

  struct Place {
    int body = -1;
    bool reversed = false;
  };

  const Course& course_;
  Overlaps& overlaps_;
  const mbs::Model& model_;
  Articulation articulation_;
  std::unique_ptr<mjModel, Delete> m_;
  std::unique_ptr<mjData, Delete> d_;
  std::vector<int> body_;                       // MuJoCo's, of each body; -1: fixed (B)
  std::vector<Place> reaction_at_;              // MuJoCo's body that a joint moves (J)
  std::vector<std::pair<int, int> > excluded_;  // bodies of the model, in the order of MuJoCo's list
  Motion motion_;
  Work work_;
  Touch touch_;
  bool touches_ = false;
  std::vector<int> shape_of_;  // number of the shape behind each geom; -1: the ground
  std::vector<Wrench> wrench_;
  std::vector<mjtNum> q_, v_, v_stage_[4], a_stage_[4], mean_;
};

Work sum(const Work& a, const Work& b) { return {a.damping + b.damping, a.loads + b.loads, a.contact + b.contact}; }

/// Bodies of less mass or inertia than MuJoCo takes, of a body in loops of joints for each of its twins.
std::vector<Unsupported> find_small_bodies(const mbs::Model& model) {
  std::vector<Unsupported> out;
  std::vector<double> copies(model.bodies.size(), 1);  // at most
  for (const mbs::Joint& j : model.joints)
    for (const mbs::BodyId id : {j.parent, j.child})
      if (!is_ground(model, id.index)) ++copies[static_cast<size_t>(id.index)];
  const auto look = [&](size_t body, const mbs::Body& b, const std::string& place) {
    const double least = copies[body] * mjMINVAL;
    if (!(b.mass > least))
      out.push_back({place, fmt::format("a mass of {:g} kg; above {:g} kg it can", b.mass, least)});
    const double moment = calc_principal_moments(b.inertia).x;
    if (!(moment > least))
      out.push_back({place, fmt::format("a principal moment of {:g} kg·m²; above {:g} kg·m² it can", moment, least)});
  };
  for (size_t i = 0; i < model.bodies.size(); ++i)
    if (!model.bodies[i].fixed) look(i, model.bodies[i], place_of("bodies", i, model.bodies[i].name));
  for (size_t i = 0; i < model.events.size(); ++i)
    for (const mbs::Action& a : model.events[i].actions)
      if (a.kind == mbs::Action::Kind::ReplaceBody)
        look(static_cast<size_t>(a.body.index), a.replacement,
             place_of("events", i, model.events[i].name) + ".replacement");
  return out;
}

class MujocoEngine : public Engine {
 public:
  std::string name() const override { return "mujoco"; }
  std::string version() const override { return mujoco_version(); }

  std::vector<Unsupported> find_unsupported(const mbs::Model& model, const mbs::Options& options) const override {
    std::vector<Unsupported> out = find_impossible_inertias(model);
    for (Unsupported& u : find_opening_joints(model, options)) out.push_back(std::move(u));
    for (Unsupported& u : find_planes(model)) out.push_back(std::move(u));
    for (Unsupported& u : find_small_bodies(model)) out.push_back(std::move(u));
    for (size_t i = 0; i < model.contact.pairs.size(); ++i)
      if (model.contact.pairs[i].touches)
        out.push_back({"contact.pairs[" + std::to_string(i) + "]", "rules of its own for a pair of bodies"});
    return out;
  }

 protected:
  mbs::Summary solve(const mbs::Model& model, const mbs::Options& options) const override {
    Course course(model, options);
    const Inside inside;
    if (!course.start(choose_step(model, options))) return course.finish(0);
    long steps = 0;
    try {
      Work before;
      Overlaps overlaps;
      while (!course.is_over()) run_as_built(course, overlaps, before, steps);
    } catch (const std::exception& e) { course.fail(e.what()); }
    return course.finish(steps);
  }

 private:
  /// Until the end or until the model must be built anew.
  static void run_as_built(Course& course, Overlaps& overlaps, Work& before, long& steps) {
    using Verdict = Course::Verdict;
    const double h = course.step();
    Built built(course, overlaps, h);
    if (built.touches())
      course.note(
          "contact is MuJoCo's own: soft, with friction and restitution like topple's; what slides fast is thrown up, "
          "without restitution, too");
    const auto accept = [&] {
      const double time = static_cast<double>(steps) * h;
      return course.accept(time, built.motion(), sum(before, built.work()), built.touch(),
                           [&] { return built.find_reactions(time); });
    };
    Verdict verdict = steps == 0 ? accept() : Verdict::GoOn;
    while (verdict == Verdict::GoOn || verdict == Verdict::ForcesJumped) {
      if (verdict == Verdict::ForcesJumped) built.update_ties();
      const std::string failure = built.advance(static_cast<double>(steps) * h, h);
      ++steps;
      if (!failure.empty()) return course.fail(failure);
      verdict = accept();
    }
    before = sum(before, built.work());
  }
};

}  // namespace

std::string mujoco_version() {
  const int v = mj_version();  // 222 for 2.2.2
  return std::to_string(v / 100) + "." + std::to_string(v / 10 % 10) + "." + std::to_string(v % 10);
}

std::unique_ptr<Engine> make_mujoco_engine() { return std::make_unique<MujocoEngine>(); }

}  // namespace topple::engines

#endif
