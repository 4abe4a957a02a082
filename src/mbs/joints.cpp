/// Ideal joints: impulses at the joints' own directions that bring each joint together at the end of the step
/// (docs/theory/multibody.md, eq. 5 to 7). Joints that share moving bodies are solved together, densely.

#include <algorithm>
#include <cmath>

#include "mbs/system.h"

namespace topple::mbs {

namespace {

int other_root(std::vector<int>& parent, int x) {
  while (parent[static_cast<size_t>(x)] != x) {
    parent[static_cast<size_t>(x)] = parent[static_cast<size_t>(parent[static_cast<size_t>(x)])];
    x = parent[static_cast<size_t>(x)];
  }
  return x;
}

struct Frames {
  Vec3 p_F, p_M, lever_parent, lever_child;
  Mat3 F, M;
};

Frames frames_of(const State& s, const CompiledJoint& j) {
  Frames f;
  f.p_F = j.p_PF;
  f.p_M = j.p_CM;
  if (j.parent >= 0) {
    const size_t b = static_cast<size_t>(j.parent);
    f.lever_parent = s.R[b] * (j.p_PF - s.p_offset[b]);
    f.p_F = s.p[b] + f.lever_parent;
    f.F = s.R[b] * j.R_PF;
  } else {
    f.F = j.R_PF;
  }
  if (j.child >= 0) {
    const size_t b = static_cast<size_t>(j.child);
    f.lever_child = s.R[b] * (j.p_CM - s.p_offset[b]);
    f.p_M = s.p[b] + f.lever_child;
    f.M = s.R[b] * j.R_CM;
  } else {
    f.M = j.R_CM;
  }
  return f;
}

/// How far the joint is from closed: j.rows values, lengths and angles.
void violation(const CompiledJoint& j, const Frames& f, double* out) {
  const Vec3 gap = f.p_M - f.p_F;
  out[0] = gap.x, out[1] = gap.y, out[2] = gap.z;
  if (j.kind == Joint::Kind::Fixed) {
    // rotation vector between the frames from the skew part: exact to third order, and only small angles occur
    const Vec3 r = 0.5 * (cross(f.F.column(0), f.M.column(0)) + cross(f.F.column(1), f.M.column(1)) +
                          cross(f.F.column(2), f.M.column(2)));
    out[3] = r.x, out[4] = r.y, out[5] = r.z;
  } else {
    out[3] = dot(f.M.column(2), f.F.column(0));
    out[4] = dot(f.M.column(2), f.F.column(1));
  }
}

}  // namespace

void System::build_clusters() {
  clusters.clear();
  in_cluster.assign(B, 0);
  joint_force.resize(B);
  joint_torque.resize(B);
  std::vector<int> root(B);
  for (size_t b = 0; b < B; ++b) root[b] = static_cast<int>(b);
  const auto moving = [&](int b) { return b >= 0 && !fixed[static_cast<size_t>(b)]; };
  for (size_t j = 0; j < joints.size(); ++j)
    if (state.joint[j].live && moving(joints[j].parent) && moving(joints[j].child))
      root[static_cast<size_t>(other_root(root, joints[j].parent))] = other_root(root, joints[j].child);
  std::vector<int> cluster_of(B, -1);
  for (size_t j = 0; j < joints.size(); ++j) {
    if (!state.joint[j].live) continue;
    const int any = moving(joints[j].child) ? joints[j].child : joints[j].parent;
    if (!moving(any)) continue;
    int& c = cluster_of[static_cast<size_t>(other_root(root, any))];
    if (c < 0) {
      c = static_cast<int>(clusters.size());
      clusters.emplace_back();
    }
    JointCluster& cluster = clusters[static_cast<size_t>(c)];
    cluster.joints.push_back(static_cast<int>(j));
    cluster.rows += joints[j].rows;
    for (const int b : {joints[j].parent, joints[j].child})
      if (moving(b) && !in_cluster[static_cast<size_t>(b)]) {
        in_cluster[static_cast<size_t>(b)] = 1;
        cluster.bodies.push_back(b);
      }
  }
  clusters_due = false;
}

void System::solve_joints(double h) {
  State& s = state;
  const double impulse_time = kick_time();
  joint_force.fill({});
  joint_torque.fill({});
  for (const JointCluster& cluster : clusters) {
    const size_t n = static_cast<size_t>(cluster.rows);
    std::vector<JointRow>& rows = joint_rows;
    rows.resize(n);
    std::vector<double>&A = joint_matrix, &rhs = joint_rhs, &total = joint_impulse;
    A.assign(n * n, 0);
    rhs.assign(n, 0);
    total.assign(n, 0);
    // rows at the beginning of the step
    size_t at = 0;
    for (const int index : cluster.joints) {
      const CompiledJoint& j = joints[static_cast<size_t>(index)];
      const Frames f = frames_of(s, j);
      violation(j, f, &rhs[at]);
      for (int i = 0; i < 3; ++i) {
        Vec3 e;
        e[i] = 1;
        rows[at + static_cast<size_t>(i)] = {e, cross(f.lever_child, e), -cross(f.lever_parent, e)};
      }
      if (j.kind == Joint::Kind::Fixed) {
        for (int i = 0; i < 3; ++i) {
          Vec3 e;
          e[i] = 1;
          rows[at + 3 + static_cast<size_t>(i)] = {{}, e, -e};
        }
      } else {
        for (int i = 0; i < 2; ++i) {
          const Vec3 a = cross(f.M.column(2), f.F.column(i));
          rows[at + 3 + static_cast<size_t>(i)] = {{}, a, -a};
        }
      }
      at += static_cast<size_t>(j.rows);
    }
    for (const int b : cluster.bodies)
      world_inverse_inertia[static_cast<size_t>(b)] = calc_world_inverse_inertia(static_cast<size_t>(b));
    // A = J M^-1 J^T, joint by joint where they share a moving body
    size_t at_i = 0;
    for (const int index_i : cluster.joints) {
      const CompiledJoint& ji = joints[static_cast<size_t>(index_i)];
      size_t at_k = 0;
      for (const int index_k : cluster.joints) {
        if (at_k > at_i) break;  // the lower triangle is enough
        const CompiledJoint& jk = joints[static_cast<size_t>(index_k)];
        for (const int side_i : {0, 1}) {
          const int b = side_i == 0 ? ji.parent : ji.child;
          if (b < 0 || fixed[static_cast<size_t>(b)]) continue;
          for (const int side_k : {0, 1}) {
            if (b != (side_k == 0 ? jk.parent : jk.child)) continue;
            const Mat3& W = world_inverse_inertia[static_cast<size_t>(b)];
            const double w = s.body[static_cast<size_t>(b)].inverse_mass * (side_i == side_k ? 1 : -1);
            for (int c = 0; c < jk.rows; ++c) {
              const JointRow& rc = rows[at_k + static_cast<size_t>(c)];
              const Vec3 Wt = W * (side_k == 0 ? rc.turn_parent : rc.turn_child);
              for (int r = at_k == at_i ? c : 0; r < ji.rows; ++r) {
                const JointRow& rr = rows[at_i + static_cast<size_t>(r)];
                A[(at_i + static_cast<size_t>(r)) * n + at_k + static_cast<size_t>(c)] +=
                    w * dot(rr.line, rc.line) + dot(side_i == 0 ? rr.turn_parent : rr.turn_child, Wt);
              }
            }
          }
        }
        at_k += static_cast<size_t>(jk.rows);
      }
      at_i += static_cast<size_t>(ji.rows);
    }
    // Cholesky; a direction that the others already hold gets no impulse of its own
    for (size_t k = 0; k < n; ++k) {
      const double diagonal = A[k * n + k];
      double pivot = diagonal;
      for (size_t i = 0; i < k; ++i) pivot -= A[k * n + i] * A[k * n + i];
      const bool redundant = pivot <= 1e-11 * diagonal;
      const double root = redundant ? 0 : std::sqrt(pivot);
      A[k * n + k] = root;
      for (size_t r = k + 1; r < n; ++r) {
        double sum = A[r * n + k];
        for (size_t i = 0; i < k; ++i) sum -= A[r * n + i] * A[k * n + i];
        A[r * n + k] = redundant ? 0 : sum / root;
      }
    }
    const auto solve = [&](std::vector<double>& x) {
      for (size_t r = 0; r < n; ++r) {
        double sum = x[r];
        for (size_t i = 0; i < r; ++i) sum -= A[r * n + i] * x[i];
        x[r] = A[r * n + r] > 0 ? sum / A[r * n + r] : 0;
      }
      for (size_t r = n; r-- > 0;) {
        double sum = x[r];
        for (size_t i = r + 1; i < n; ++i) sum -= A[i * n + r] * x[i];
        x[r] = A[r * n + r] > 0 ? sum / A[r * n + r] : 0;
      }
    };
    const auto apply = [&](const std::vector<double>& impulse) {
      size_t row = 0;
      for (const int index : cluster.joints) {
        const CompiledJoint& j = joints[static_cast<size_t>(index)];
        Vec3 line, turn_child, turn_parent;
        for (int r = 0; r < j.rows; ++r, ++row) {
          line += impulse[row] * rows[row].line;
          turn_child += impulse[row] * rows[row].turn_child;
          turn_parent += impulse[row] * rows[row].turn_parent;
        }
        if (j.child >= 0 && !fixed[static_cast<size_t>(j.child)]) {
          const size_t b = static_cast<size_t>(j.child);
          s.v[b] += s.body[b].inverse_mass * line;
          s.L[b] += turn_child;
        }
        if (j.parent >= 0 && !fixed[static_cast<size_t>(j.parent)]) {
          const size_t b = static_cast<size_t>(j.parent);
          s.v[b] -= s.body[b].inverse_mass * line;
          s.L[b] += turn_parent;
        }
      }
    };
    // first: velocities that close the joints to first order, spins taken at the present orientation
    at = 0;
    for (const int index : cluster.joints) {
      const CompiledJoint& j = joints[static_cast<size_t>(index)];
      Vec3 vc, wc, vp, wp;
      if (j.child >= 0) {
        const size_t b = static_cast<size_t>(j.child);
        vc = s.v[b];
        wc = world_inverse_inertia[b] * s.L[b];
      }
      if (j.parent >= 0) {
        const size_t b = static_cast<size_t>(j.parent);
        vp = s.v[b];
        wp = world_inverse_inertia[b] * s.L[b];
      }
      for (int r = 0; r < j.rows; ++r, ++at) {
        const JointRow& row = rows[at];
        rhs[at] = -(dot(row.line, vc - vp) + dot(row.turn_child, wc) + dot(row.turn_parent, wp) + rhs[at] / h);
      }
    }
    double drift_left = 0;
    for (int round = 0; round < 6; ++round) {
      solve(rhs);
      for (size_t r = 0; r < n; ++r) total[r] += rhs[r];
      apply(rhs);
      for (const int b : cluster.bodies)
        drift(static_cast<size_t>(b), h, p_before[static_cast<size_t>(b)], q_before[static_cast<size_t>(b)],
              R_before[static_cast<size_t>(b)]);
      at = 0;
      drift_left = 0;
      for (const int index : cluster.joints) {
        const CompiledJoint& j = joints[static_cast<size_t>(index)];
        violation(j, frames_of(s, j), &rhs[at]);
        for (int r = 0; r < j.rows; ++r, ++at) {
          drift_left = std::max(drift_left, std::abs(rhs[at]));
          rhs[at] = -rhs[at] / h;
        }
      }
      if (drift_left < 1e-11) break;
    }
    s.largest_drift = std::max(s.largest_drift, drift_left);
    // reactions
    at = 0;
    for (const int index : cluster.joints) {
      const CompiledJoint& j = joints[static_cast<size_t>(index)];
      JointState& js = s.joint[static_cast<size_t>(index)];
      js.force = js.moment = {};
      Vec3 turn_parent, turn_child;
      for (int r = 0; r < j.rows; ++r, ++at) {
        const double f = total[at] / impulse_time;
        js.force += f * rows[at].line;
        if (r >= 3) js.moment += f * rows[at].turn_child;
        turn_child += f * rows[at].turn_child;
        turn_parent += f * rows[at].turn_parent;
      }
      if (j.child >= 0) {
        joint_force[static_cast<size_t>(j.child)] += js.force;
        joint_torque[static_cast<size_t>(j.child)] += turn_child;
      }
      if (j.parent >= 0) {
        joint_force[static_cast<size_t>(j.parent)] -= js.force;
        joint_torque[static_cast<size_t>(j.parent)] += turn_parent;
      }
    }
  }
}

void System::check_joints() {
  for (size_t i = 0; i < joints.size(); ++i) {
    const CompiledJoint& j = joints[i];
    JointState& js = state.joint[i];
    if (!js.live) continue;
    if (j.kind == Joint::Kind::Revolute && j.rotational < 0) js.angle = calc_angle(j, js.angle);
    const Mat3 F = rotation_of(j.parent) * j.R_PF;
    const double along = dot(F.column(0), js.force);
    const double across2 = dot(js.force, js.force) - along * along;
    if (-along > j.tension_limit) {
      release_joint(i, "tension");
    } else if (across2 > j.shear_limit * j.shear_limit) {
      release_joint(i, "shear");
    } else if (dot(js.moment, js.moment) > j.moment_limit * j.moment_limit) {
      release_joint(i, "moment");
    } else if (std::abs(js.angle) > j.rotation_limit) {
      release_joint(i, "rotation");
    }
  }
}

void System::release_joint(size_t i, const char* reason) {
  JointState& js = state.joint[i];
  if (!js.live) return;
  js.live = false;
  js.force = js.moment = {};
  if (const int r = joints[i].rotational; r >= 0 && state.rotational[static_cast<size_t>(r)].live)
    break_zone(state.rotational[static_cast<size_t>(r)], BreakReason::Removed);
  clusters_due = true;
  mark_search_due();
  say({Happening::Kind::JointReleased, state.time, static_cast<int>(i), -1, reason, 0});
}

}  // namespace topple::mbs
