/// Joints at one instant: reactions from the accelerations, and the joints closed before the first step
/// (docs/theory/multibody.md, eq. 7).

#include <algorithm>
#include <cmath>

#include "mbs/joint_rows.h"
#include "mbs/system.h"

namespace topple::mbs {

void System::calc_reactions() {
  if (clusters_due) {
    build_clusters();
    clusters_due = true;  // the next step does it with all that follows from it
  }
  const State& s = state;
  const auto moving = [&](int b) { return b >= 0 && !fixed[static_cast<size_t>(b)]; };
  reaction_force.assign(joints.size(), {});
  reaction_moment.assign(joints.size(), {});
  body_reaction.assign(B, {});
  body_reaction_turn.assign(B, {});
  for (JointCluster& c : clusters) {
    read_cluster(c, kDependent);
    note_dependence(c, c.dependent);
    if (!c.is_plain && was_singular(c)) {
      // in the play about a singular position the reaction of an instant says nothing of those within a step
      constexpr double near = 1e-8;  // pivot over diagonal, geometry alone
      const int usual = c.dependent;
      read_cluster(c, near);
      if (c.dependent == usual) read_cluster(c, kDependent);
    }
    for (size_t i = 0; i < c.joints.size(); ++i) {
      const size_t joint = static_cast<size_t>(c.joints[i]);
      const CompiledJoint& j = joints[joint];
      const size_t at = static_cast<size_t>(c.matrix.first_row(static_cast<int>(i)));
      // accelerations without joints, with the velocities of now
      JointMotion v, a;
      const auto read = [&](int body, Vec3& velocity, Vec3& spin, Vec3& acceleration, Vec3& spin_up) {
        if (!moving(body)) return;
        const size_t b = static_cast<size_t>(body);
        velocity = calc_velocity(b), spin = calc_angular_velocity(b);
        acceleration = s.body[b].inverse_mass * force[b] + model.gravity;
        const Vec3 L = s.R[b] * (s.body[b].inertia * transpose_times(s.R[b], spin));
        spin_up = world_inverse_inertia[b] * (torque[b] - cross(spin, L));
      };
      read(j.parent, v.v_parent, v.w_parent, a.v_parent, a.w_parent);
      read(j.child, v.v_child, v.w_child, a.v_child, a.w_child);
      double bias[6];
      calc_joint_bias(j, calc_joint_frames(s, j), v, bias);
      for (int r = 0; r < j.rows; ++r) {
        const JointRow& row = joint_rows[at + static_cast<size_t>(r)];
        joint_rhs[at + static_cast<size_t>(r)] =
            -(dot(row.line, a.v_child - a.v_parent) + dot(row.turn_child, a.w_child) +
              dot(row.turn_parent, a.w_parent) + (r < j.lines ? 1 : c.length) * bias[r]);
      }
    }
    c.matrix.solve(joint_rhs.data());
    for (size_t i = 0; i < c.joints.size(); ++i) {
      const size_t joint = static_cast<size_t>(c.joints[i]);
      const CompiledJoint& j = joints[joint];
      const size_t at = static_cast<size_t>(c.matrix.first_row(static_cast<int>(i)));
      for (int r = 0; r < j.rows; ++r) {
        const JointRow& row = joint_rows[at + static_cast<size_t>(r)];
        const double f = joint_rhs[at + static_cast<size_t>(r)];
        reaction_force[joint] += f * row.line;
        if (r >= j.lines) reaction_moment[joint] += f * row.turn_child;
        if (moving(j.child)) body_reaction_turn[static_cast<size_t>(j.child)] += f * row.turn_child;
        if (moving(j.parent)) body_reaction_turn[static_cast<size_t>(j.parent)] += f * row.turn_parent;
      }
      if (moving(j.child)) body_reaction[static_cast<size_t>(j.child)] += reaction_force[joint];
      if (moving(j.parent)) body_reaction[static_cast<size_t>(j.parent)] -= reaction_force[joint];
    }
  }
}

void System::close_joints() {
  if (clusters_due) {
    build_clusters();
    clusters_due = true;  // the next step does it with all that follows from it
  }
  State& s = state;
  const auto moving = [&](int b) { return b >= 0 && !fixed[static_cast<size_t>(b)]; };
  for (JointCluster& c : clusters) {
    const size_t n = static_cast<size_t>(c.matrix.rows());
    // what an impulse x along the rows does to bodies
    const auto spread = [&](auto&& on_body) {
      for (size_t i = 0; i < c.joints.size(); ++i) {
        const CompiledJoint& j = joints[static_cast<size_t>(c.joints[i])];
        const size_t at = static_cast<size_t>(c.matrix.first_row(static_cast<int>(i)));
        Vec3 line, turn_child, turn_parent;
        for (size_t r = at; r < at + static_cast<size_t>(j.rows); ++r) {
          line += joint_rhs[r] * joint_rows[r].line;
          turn_child += joint_rhs[r] * joint_rows[r].turn_child;
          turn_parent += joint_rhs[r] * joint_rows[r].turn_parent;
        }
        if (moving(j.child)) on_body(static_cast<size_t>(j.child), line, turn_child);
        if (moving(j.parent)) on_body(static_cast<size_t>(j.parent), -line, turn_parent);
      }
    };
    for (int round = 0; round < 20; ++round) {
      read_cluster(c, kDependent);
      double open = 0;
      for (size_t r = 0; r < n; ++r) joint_rhs[r] = -joint_gaps[r];
      if (c.dependent > 0) c.matrix.project(joint_rhs.data());
      for (size_t r = 0; r < n; ++r) open = std::max(open, std::abs(joint_rhs[r]));
      if (open < c.tolerance) break;
      c.matrix.solve(joint_rhs.data());
      spread([&](size_t b, const Vec3& line, const Vec3& turn) {
        s.p[b] += s.body[b].inverse_mass * line;
        s.q[b] = normalized(exp_rotation(world_inverse_inertia[b] * turn) * s.q[b]);
        s.R[b] = to_matrix(s.q[b]);
        s.L[b] = s.R[b] * (s.body[b].inertia * transpose_times(s.R[b], s.w[b]));
      });
    }
    double fastest = 0, worst = 0;
    for (size_t i = 0; i < c.joints.size(); ++i) {
      const CompiledJoint& j = joints[static_cast<size_t>(c.joints[i])];
      const size_t at = static_cast<size_t>(c.matrix.first_row(static_cast<int>(i)));
      Vec3 vc, wc, vp, wp;
      if (moving(j.child)) vc = s.v[static_cast<size_t>(j.child)], wc = s.w[static_cast<size_t>(j.child)];
      if (moving(j.parent)) vp = s.v[static_cast<size_t>(j.parent)], wp = s.w[static_cast<size_t>(j.parent)];
      fastest = std::max({fastest, norm(vc), norm(vp), c.length * norm(wc), c.length * norm(wp)});
      for (size_t r = at; r < at + static_cast<size_t>(j.rows); ++r) {
        const JointRow& row = joint_rows[r];
        joint_rhs[r] = -(dot(row.line, vc - vp) + dot(row.turn_child, wc) + dot(row.turn_parent, wp));
      }
    }
    if (c.dependent > 0) c.matrix.project(joint_rhs.data());
    for (size_t i = 0; i < c.joints.size(); ++i) {
      const CompiledJoint& j = joints[static_cast<size_t>(c.joints[i])];
      const size_t at = static_cast<size_t>(c.matrix.first_row(static_cast<int>(i)));
      double along2 = 0, about2 = 0;  // of its point, of its axes over the length
      for (int r = 0; r < j.rows; ++r) {
        const double off = joint_rhs[at + static_cast<size_t>(r)];
        (r < j.lines ? along2 : about2) += off * off;
      }
      worst = std::max({worst, std::sqrt(along2), std::sqrt(about2)});
    }
    if (!(worst > 1e-12 * fastest)) continue;
    if (worst > 1e-9 * fastest) note_speed(c, worst);
    c.matrix.solve(joint_rhs.data());
    spread([&](size_t b, const Vec3& line, const Vec3& turn) {
      s.v[b] += s.body[b].inverse_mass * line;
      s.L[b] += turn;
      s.w[b] += world_inverse_inertia[b] * turn;
    });
  }
  update_angles();
}

}  // namespace topple::mbs
