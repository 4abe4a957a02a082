/// Ideal joints in the step: impulses along the joints' own rows that bring each joint together at the end of the step
/// (docs/theory/multibody.md, eq. 5 and 6). Joints that share moving bodies form a cluster and are solved together.

#include <algorithm>
#include <cmath>
#include <utility>

#include "mbs/joint_rows.h"
#include "mbs/system.h"

namespace topple::mbs {

namespace {

constexpr double kSuspicious = 1e-8;  // pivot over diagonal that asks for a look at the geometry
constexpr int kMostRounds = 12;

int other_root(std::vector<int>& parent, int x) {
  while (parent[static_cast<size_t>(x)] != x) {
    parent[static_cast<size_t>(x)] = parent[static_cast<size_t>(parent[static_cast<size_t>(x)])];
    x = parent[static_cast<size_t>(x)];
  }
  return x;
}

/// A cluster's length, tolerance and the layout of its matrix, joints put in the order of elimination.
void lay_out(System& s, JointCluster& c) {
  const auto moving = [&](int b) { return b >= 0 && !s.fixed[static_cast<size_t>(b)]; };
  std::vector<std::vector<int>> at(s.B);
  const auto gather = [&] {
    for (const int b : c.bodies) at[static_cast<size_t>(b)].clear();
    for (size_t i = 0; i < c.joints.size(); ++i) {
      const CompiledJoint& j = s.joints[static_cast<size_t>(c.joints[i])];
      for (const int b : {j.parent, j.child})
        if (moving(b)) at[static_cast<size_t>(b)].push_back(static_cast<int>(i));
    }
  };
  const auto links = [&] {
    std::vector<std::pair<int, int>> pairs;
    for (const int b : c.bodies) {
      const std::vector<int>& list = at[static_cast<size_t>(b)];
      for (size_t i = 0; i < list.size(); ++i)
        for (size_t k = 0; k < i; ++k) pairs.push_back({list[k], list[i]});
    }
    return pairs;
  };
  gather();
  std::vector<int> ordered;
  for (const int place : find_elimination_order(static_cast<int>(c.joints.size()), links()))
    ordered.push_back(c.joints[static_cast<size_t>(place)]);
  c.joints = std::move(ordered);
  gather();
  std::vector<int> sizes;
  for (const int index : c.joints) sizes.push_back(s.joints[static_cast<size_t>(index)].rows);
  c.matrix.analyse(sizes, links());
  c.geometry = c.matrix;

  c.first_meeting.clear();
  c.meetings.clear();
  double sum = 0, extent = 0;
  for (const int b : c.bodies) {
    const size_t body = static_cast<size_t>(b);
    c.first_meeting.push_back(static_cast<int>(c.meetings.size()));
    for (const int place : at[body]) {
      const CompiledJoint& j = s.joints[static_cast<size_t>(c.joints[static_cast<size_t>(place)])];
      const bool is_child = j.child == b;
      const Vec3 lever = (is_child ? j.p_CM : j.p_PF) - s.state.p_offset[body];
      sum += s.state.body[body].gyration2 + dot(lever, lever);
      extent = std::max(extent, norm(s.model.bodies[body].X_WB.p) + norm(lever));
      c.meetings.push_back({place, is_child});
    }
  }
  c.first_meeting.push_back(static_cast<int>(c.meetings.size()));
  c.length = std::sqrt(sum / static_cast<double>(c.meetings.size()));
  c.tolerance = std::max(1e-12 * c.length, 0x1p-46 * extent);  // 2^-46: some roundings of places this far out
}

Vec3 turn_of(const JointRow& row, bool child) { return child ? row.turn_child : row.turn_parent; }

/// J K Jᵀ of a cluster's rows, K the inverse masses and inertias of its bodies.
template <class InverseMass, class InverseInertia>
void fill_matrix(const System& s, const JointCluster& c, BlockCholesky& matrix, InverseMass inverse_mass,
                 InverseInertia inverse_inertia) {
  matrix.clear();
  for (size_t k = 0; k < c.bodies.size(); ++k) {
    const size_t b = static_cast<size_t>(c.bodies[k]);
    const Mat3& W = inverse_inertia(b);
    const double both = inverse_mass(b);
    for (int y = c.first_meeting[k]; y < c.first_meeting[k + 1]; ++y) {
      const JointCluster::Meeting my = c.meetings[static_cast<size_t>(y)];
      const CompiledJoint& jy = s.joints[static_cast<size_t>(c.joints[static_cast<size_t>(my.place)])];
      const JointRow* rows_y = &s.joint_rows[static_cast<size_t>(matrix.first_row(my.place))];
      Vec3 turned[6];
      for (int n = 0; n < jy.rows; ++n) turned[n] = W * turn_of(rows_y[n], my.is_child);
      for (int x = y; x < c.first_meeting[k + 1]; ++x) {
        const JointCluster::Meeting mx = c.meetings[static_cast<size_t>(x)];
        const CompiledJoint& jx = s.joints[static_cast<size_t>(c.joints[static_cast<size_t>(mx.place)])];
        const JointRow* rows_x = &s.joint_rows[static_cast<size_t>(matrix.first_row(mx.place))];
        const double w = mx.is_child == my.is_child ? both : -both;
        double* A = matrix.block(mx.place, my.place);
        for (int m = 0; m < jx.rows; ++m) {
          const Vec3 turn = turn_of(rows_x[m], mx.is_child);
          for (int n = 0; n < (x == y ? m + 1 : jy.rows); ++n) {
            double sum = dot(turn, turned[n]);
            if (m < jx.lines && n < jy.lines) sum += w * dot(rows_x[m].line, rows_y[n].line);
            A[m * jy.rows + n] += sum;
          }
        }
      }
    }
  }
}

/// Rows that repeat others for good are remembered with the joints.
void read_repeating(const System& s, JointCluster& c) {
  c.repeating.clear();
  for (size_t i = 0; i < c.joints.size(); ++i)
    for (int r = 0; r < 6; ++r)
      if (s.state.joint[static_cast<size_t>(c.joints[i])].repeating >> r & 1)
        c.repeating.push_back(c.matrix.first_row(static_cast<int>(i)) + r);
}

void write_repeating(System& s, const JointCluster& c) {
  size_t next = 0;
  for (size_t i = 0; i < c.joints.size(); ++i) {
    JointState& js = s.state.joint[static_cast<size_t>(c.joints[i])];
    js.is_examined = true;
    js.repeating = 0;
    const int first = c.matrix.first_row(static_cast<int>(i));
    const int rows = s.joints[static_cast<size_t>(c.joints[i])].rows;
    for (; next < c.repeating.size() && c.repeating[next] < first + rows; ++next)
      js.repeating = static_cast<unsigned char>(js.repeating | 1 << (c.repeating[next] - first));
  }
}

/// Which rows depend on others now, whatever the masses.
std::vector<int> examine(const System& s, const JointCluster& c) {
  const size_t n = static_cast<size_t>(c.matrix.rows()), width = 6 * c.bodies.size();
  std::vector<double> matrix(n * width, 0);
  for (size_t k = 0; k < c.bodies.size(); ++k)
    for (int y = c.first_meeting[k]; y < c.first_meeting[k + 1]; ++y) {
      const JointCluster::Meeting m = c.meetings[static_cast<size_t>(y)];
      const size_t first = static_cast<size_t>(c.matrix.first_row(m.place));
      const int rows = s.joints[static_cast<size_t>(c.joints[static_cast<size_t>(m.place)])].rows;
      for (size_t r = first; r < first + static_cast<size_t>(rows); ++r) {
        const Vec3 line = m.is_child ? s.joint_rows[r].line : -s.joint_rows[r].line;
        const Vec3 turn = 1 / c.length * turn_of(s.joint_rows[r], m.is_child);
        for (int i = 0; i < 3; ++i) {
          matrix[r * width + 6 * k + static_cast<size_t>(i)] = line[i];
          matrix[r * width + 6 * k + 3 + static_cast<size_t>(i)] = turn[i];
        }
      }
    }
  return find_dependent_rows(static_cast<int>(n), static_cast<int>(width), matrix, std::sqrt(kDependent));
}

/// Largest motion that a unit vector of the null space of the geometry's matrix makes: 0 if its rows do depend.
double find_independence(const System& s, const JointCluster& c) {
  const std::vector<double>& null = c.geometry.null_space();
  const size_t n = static_cast<size_t>(c.matrix.rows());
  double most2 = 0;
  for (size_t v = 0; v < null.size(); v += n) {
    double sum2 = 0;
    for (size_t k = 0; k < c.bodies.size(); ++k) {
      Vec3 line, turn;
      for (int y = c.first_meeting[k]; y < c.first_meeting[k + 1]; ++y) {
        const JointCluster::Meeting m = c.meetings[static_cast<size_t>(y)];
        const size_t first = static_cast<size_t>(c.matrix.first_row(m.place));
        const int rows = s.joints[static_cast<size_t>(c.joints[static_cast<size_t>(m.place)])].rows;
        for (size_t r = first; r < first + static_cast<size_t>(rows); ++r) {
          line += (m.is_child ? null[v + r] : -null[v + r]) * s.joint_rows[r].line;
          turn += null[v + r] / c.length * turn_of(s.joint_rows[r], m.is_child);
        }
      }
      sum2 += dot(line, line) + dot(turn, turn);
    }
    most2 = std::max(most2, sum2);
  }
  return std::sqrt(most2);
}

}  // namespace

void System::build_clusters() {
  clusters.clear();
  in_cluster.assign(B, 0);
  joint_sums_due = true;
  joint_spin.assign(B, {});
  for (std::vector<Vec3>* x : {&v_before, &L_before, &w_before}) x->resize(B);
  std::vector<int> root(B);
  for (size_t b = 0; b < B; ++b) root[b] = static_cast<int>(b);
  const auto moving = [&](int b) { return b >= 0 && !fixed[static_cast<size_t>(b)]; };
  for (size_t j = 0; j < joints.size(); ++j)
    if (state.joint[j].live && moving(joints[j].parent) && moving(joints[j].child))
      root[static_cast<size_t>(other_root(root, joints[j].parent))] = other_root(root, joints[j].child);
  cluster_of.assign(B, -1);
  std::vector<int> cluster_at(B, -1);  // of each root
  size_t most_rows = 0;
  for (size_t j = 0; j < joints.size(); ++j) {
    if (!state.joint[j].live) continue;
    const int any = moving(joints[j].child) ? joints[j].child : joints[j].parent;
    if (!moving(any)) continue;
    int& c = cluster_at[static_cast<size_t>(other_root(root, any))];
    if (c < 0) {
      c = static_cast<int>(clusters.size());
      clusters.emplace_back();
    }
    JointCluster& cluster = clusters[static_cast<size_t>(c)];
    cluster.joints.push_back(static_cast<int>(j));
    for (const int b : {joints[j].parent, joints[j].child})
      if (moving(b) && !in_cluster[static_cast<size_t>(b)]) {
        in_cluster[static_cast<size_t>(b)] = 1;
        cluster_of[static_cast<size_t>(b)] = c;
        cluster.bodies.push_back(b);
      }
  }
  for (JointCluster& c : clusters) {
    lay_out(*this, c);
    most_rows = std::max(most_rows, static_cast<size_t>(c.matrix.rows()));
  }
  pack_pairs();
  joint_rows.resize(most_rows);
  for (std::vector<double>* x : {&joint_gaps, &joint_rhs, &joint_impulse, &joint_linear, &joint_answer, &joint_change,
                                 &joint_unforeseen, &joint_left_before, &joint_rate})
    x->resize(most_rows);
  clusters_due = false;
}

void System::rebuild_clusters() {
  build_clusters();
  for (size_t b = 0; b < B; ++b) pack_body(b);
}

void System::read_cluster(JointCluster& c, double tolerance) {
  for (size_t i = 0; i < c.joints.size(); ++i) {
    const CompiledJoint& j = joints[static_cast<size_t>(c.joints[i])];
    const size_t at = static_cast<size_t>(c.matrix.first_row(static_cast<int>(i)));
    const JointFrames f = calc_joint_frames(state, j);
    calc_joint_gaps(j, f, &joint_gaps[at]);
    calc_joint_rows(j, f, &joint_rows[at]);
    for (size_t r = at + static_cast<size_t>(j.lines); r < at + static_cast<size_t>(j.rows); ++r) {
      joint_gaps[r] *= c.length;
      joint_rows[r].turn_child *= c.length;
      joint_rows[r].turn_parent *= c.length;
    }
  }
  for (const int b : c.bodies)
    world_inverse_inertia[static_cast<size_t>(b)] = calc_world_inverse_inertia(static_cast<size_t>(b));
  const auto by_mass = [&] {
    fill_matrix(
        *this, c, c.matrix, [&](size_t b) { return state.body[b].inverse_mass; },
        [&](size_t b) -> const Mat3& { return world_inverse_inertia[b]; });
  };
  const auto by_geometry = [&] {
    // whether rows depend on others is a matter of geometry; small masses and inertias would blur it
    const Mat3 turn = 1 / (c.length * c.length) * Mat3::identity();
    fill_matrix(
        *this, c, c.geometry, [](size_t) { return 1.0; }, [&](size_t) -> const Mat3& { return turn; });
  };
  const bool is_examined = state.joint[static_cast<size_t>(c.joints[0])].is_examined;
  c.is_plain = false;
  if (is_examined) read_repeating(*this, c);
  if ((!is_examined || c.repeating.empty()) && tolerance <= kDependent) {
    by_mass();
    c.is_plain = c.matrix.factorise(kSuspicious);
    if (c.is_plain) {
      c.dependent = 0;
      if (!is_examined) write_repeating(*this, c);
      return;
    }
  }
  if (!is_examined) {
    c.repeating = examine(*this, c);
    write_repeating(*this, c);
  }
  by_geometry();
  c.dependent = c.geometry.factorise_dependent(tolerance, c.repeating);
  if (is_examined && !c.repeating.empty() && tolerance <= kDependent &&
      find_independence(*this, c) > std::sqrt(kDependent)) {
    // no longer so, as after a start in a singular position
    c.repeating = examine(*this, c);
    write_repeating(*this, c);
    by_geometry();
    c.dependent = c.geometry.factorise_dependent(tolerance, c.repeating);
  }
  // keep to the rows that repeat others most clearly
  if (tolerance <= kDependent && c.dependent == static_cast<int>(c.repeating.size())) {
    const std::vector<int> chosen = c.geometry.choose_dependent();
    if (chosen != c.repeating) {
      c.repeating = chosen;
      write_repeating(*this, c);
      by_geometry();
      c.dependent = c.geometry.factorise_dependent(tolerance, c.repeating);
    }
  }
  by_mass();
  c.matrix.factorise_like(c.geometry);
}

/// Spins in the middle of the step if there were no joints, and from them the right-hand side whose impulses close the
/// joints to second order.
void System::predict_cluster(const JointCluster& c, double h) {
  const State& s = state;
  const auto moving = [&](int b) { return b >= 0 && !fixed[static_cast<size_t>(b)]; };
  for (const int body : c.bodies) {
    const size_t b = static_cast<size_t>(body);
    const Mat3& W = world_inverse_inertia[b];
    const Vec3 w0 = W * s.L[b];
    joint_spin[b] = w0 - (0.5 * h) * (W * cross(w0, s.L[b]));
  }
  for (size_t i = 0; i < c.joints.size(); ++i) {
    const CompiledJoint& j = joints[static_cast<size_t>(c.joints[i])];
    const size_t at = static_cast<size_t>(c.matrix.first_row(static_cast<int>(i)));
    JointMotion now, before;
    if (moving(j.child)) {
      const size_t b = static_cast<size_t>(j.child);
      now.v_child = before.v_child = s.v[b];
      now.w_child = joint_spin[b], before.w_child = s.w[b];
    }
    if (moving(j.parent)) {
      const size_t b = static_cast<size_t>(j.parent);
      now.v_parent = before.v_parent = s.v[b];
      now.w_parent = joint_spin[b], before.w_parent = s.w[b];
    }
    double bias[6];
    calc_joint_bias(j, calc_joint_frames(s, j), before, bias);
    for (int r = 0; r < j.rows; ++r) {
      const size_t at_r = at + static_cast<size_t>(r);
      const JointRow& row = joint_rows[at_r];
      const double rate = dot(row.line, now.v_child - now.v_parent) + dot(row.turn_child, now.w_child) +
                          dot(row.turn_parent, now.w_parent);
      joint_rhs[at_r] = -(rate + joint_gaps[at_r] / h + 0.5 * h * (r < j.lines ? 1 : c.length) * bias[r]);
    }
  }
}

void System::apply_impulses(const JointCluster& c, const std::vector<double>& impulse) {
  State& s = state;
  const auto moving = [&](int b) { return b >= 0 && !fixed[static_cast<size_t>(b)]; };
  for (size_t i = 0; i < c.joints.size(); ++i) {
    const CompiledJoint& j = joints[static_cast<size_t>(c.joints[i])];
    const size_t at = static_cast<size_t>(c.matrix.first_row(static_cast<int>(i)));
    Vec3 line, turn_child, turn_parent;
    for (size_t r = at; r < at + static_cast<size_t>(j.rows); ++r) {
      line += impulse[r] * joint_rows[r].line;
      turn_child += impulse[r] * joint_rows[r].turn_child;
      turn_parent += impulse[r] * joint_rows[r].turn_parent;
    }
    if (moving(j.child)) {
      const size_t b = static_cast<size_t>(j.child);
      s.v[b] += s.body[b].inverse_mass * line;
      s.L[b] += turn_child;
    }
    if (moving(j.parent)) {
      const size_t b = static_cast<size_t>(j.parent);
      s.v[b] -= s.body[b].inverse_mass * line;
      s.L[b] += turn_parent;
    }
  }
}

/// Moves the bodies to the end of the step; the velocities that would close what is open there, in joint_rhs. Returns
/// the widest gap of any row.
double System::find_gaps(const JointCluster& c, double h) {
  for (const int body : c.bodies) {
    const size_t b = static_cast<size_t>(body);
    drift(b, h, p_before[b], q_before[b], R_before[b]);
  }
  double open = 0;
  for (size_t i = 0; i < c.joints.size(); ++i) {
    const CompiledJoint& j = joints[static_cast<size_t>(c.joints[i])];
    const size_t at = static_cast<size_t>(c.matrix.first_row(static_cast<int>(i)));
    double gaps[6];
    calc_joint_gaps(j, calc_joint_frames(state, j), gaps);
    for (int r = 0; r < j.rows; ++r) {
      open = std::max(open, std::abs(gaps[r]));
      joint_rhs[at + static_cast<size_t>(r)] = -gaps[r] * (r < j.lines ? 1 : c.length) / h;
    }
  }
  if (c.dependent > 0) c.matrix.project(joint_rhs.data());
  return open;
}

bool System::close_cluster(JointCluster& c, double h, bool from_before) {
  const size_t n = static_cast<size_t>(c.matrix.rows());
  // The part of the last step that the linear one does not know is kept as rates. Impulses along the axes of that step
  // would turn a light body between heavy ones by what little of them lies across it now.
  const bool by_rates = c.joints.size() > 1;
  const auto each_row = [&](auto&& f) {
    for (size_t i = 0; i < c.joints.size(); ++i) {
      const size_t joint = static_cast<size_t>(c.joints[i]);
      const size_t at = static_cast<size_t>(c.matrix.first_row(static_cast<int>(i)));
      for (int r = 0; r < joints[joint].rows; ++r)
        f(at + static_cast<size_t>(r), from_before ? state.joint[joint].curvature[r] : 0,
          r < joints[joint].lines ? 1 : c.length);
    }
  };
  predict_cluster(c, h);
  if (by_rates) each_row([&](size_t row, double before, double) { joint_rhs[row] += joint_unforeseen[row] = before; });
  c.matrix.solve(joint_rhs.data());
  each_row([&](size_t row, double before, double scale) {
    joint_linear[row] = joint_rhs[row];
    if (!by_rates) joint_rhs[row] += before / scale;
    joint_impulse[row] = joint_rhs[row];
  });
  for (int round = 0; round < kMostRounds; ++round) {
    apply_impulses(c, joint_rhs);
    c.open = find_gaps(c, h);
    double left = 0;
    for (size_t r = 0; r < n; ++r) left = std::max(left, std::abs(joint_rhs[r]));
    if (left * h < c.tolerance) return true;
    if (!std::isfinite(left)) return false;
    joint_left.assign(joint_rhs.begin(), joint_rhs.begin() + static_cast<std::ptrdiff_t>(n));
    c.matrix.solve(joint_rhs.data());
    // where one direction answers otherwise than the matrix says, as it does near singular positions, a secant finds it
    double above = 0, below = 0;
    if (round > 0) {
      for (size_t r = 0; r < n; ++r) {
        const double change = joint_rhs[r] - joint_answer[r];
        above += change * joint_rhs[r], below += change * change;
      }
    }
    const double share = below > 0 ? above / below : 0;
    for (size_t r = 0; r < n; ++r) {
      const double answer = joint_rhs[r], rate = joint_left[r];
      joint_rhs[r] -= share * (joint_change[r] + answer - joint_answer[r]);
      joint_answer[r] = answer;
      joint_change[r] = joint_rhs[r];
      joint_impulse[r] += joint_rhs[r];
      if (!by_rates) continue;
      joint_rate[r] = rate - share * (joint_rate[r] + rate - joint_left_before[r]);
      joint_left_before[r] = rate;
      joint_unforeseen[r] += joint_rate[r];
    }
  }
  return false;
}

/// Closes what a direction that was left out has opened, along rows of the end of the step: bars that are stretched
/// straight hold to second order only. False if that is not enough.
bool System::pull_together(JointCluster& c, double h) {
  constexpr int most_rounds = 40;
  const size_t n = static_cast<size_t>(c.matrix.rows());
  for (int round = 0; round < most_rounds; ++round) {
    read_cluster(c, kDependent);
    for (size_t r = 0; r < n; ++r) joint_rhs[r] = -joint_gaps[r] / h;
    if (c.dependent > 0) c.matrix.project(joint_rhs.data());
    double left = 0;
    for (size_t r = 0; r < n; ++r) left = std::max(left, std::abs(joint_rhs[r]));
    if (left * h < c.tolerance) return true;
    if (!std::isfinite(left)) return false;
    c.matrix.solve(joint_rhs.data());
    for (size_t r = 0; r < n; ++r) joint_impulse[r] += joint_rhs[r];
    apply_impulses(c, joint_rhs);
    c.open = find_gaps(c, h);
  }
  return false;
}

void System::solve_cluster(JointCluster& c, double h) {
  State& s = state;
  double turn = 0;  // largest in a step
  for (const int body : c.bodies) {
    const size_t b = static_cast<size_t>(body);
    p_before[b] = s.p[b], q_before[b] = s.q[b], R_before[b] = s.R[b];
    v_before[b] = s.v[b], L_before[b] = s.L[b], w_before[b] = s.w[b];
    turn = std::max(turn, h * norm(w_before[b]));
  }
  const auto restore = [&] {
    for (const int body : c.bodies) {
      const size_t b = static_cast<size_t>(body);
      s.p[b] = p_before[b], s.q[b] = q_before[b], s.R[b] = R_before[b];
      s.v[b] = v_before[b], s.L[b] = L_before[b], s.w[b] = w_before[b];
    }
  };
  read_cluster(c, kDependent);
  const int usual = c.dependent;
  note_dependence(c, usual);
  const bool regular = close_cluster(c, h, true);
  bool closed = regular;
  // a direction that comes and goes within the step, at a singular position, is left out of it; not most of what holds
  constexpr double most_left_out = 0.25;
  bool turns_too_far = false;
  for (double share = 0; share < 10 && !closed; share = share == 0 ? 0.5 : 2 * share) {
    const double left_out = share * share * turn * turn;
    turns_too_far = left_out > most_left_out;
    if (turns_too_far) break;
    restore();
    read_cluster(c, std::max(kDependent, left_out));
    closed = close_cluster(c, h, false);
  }
  if (turns_too_far)
    note_turn(c, turn);
  else if (!regular)
    note_dependence(c, usual);
  // a branch of a mechanism that goes on has gaps of a higher order than its way
  constexpr double share_of_way = 0.01;
  const bool is_pulled =
      !closed || (c.dependent > 0 && c.open > std::max(10 * c.tolerance, share_of_way * turn * turn * c.length));
  if (is_pulled) closed = pull_together(c, h);
  if (!closed) note_open(c);
  s.largest_drift = std::max(s.largest_drift, c.open);
  stop_if_lost(c);
  // reactions
  const double per_time = 1 / kick_time();
  const auto moving = [&](int b) { return b >= 0 && !fixed[static_cast<size_t>(b)]; };
  for (const int b : c.bodies) joint_force[static_cast<size_t>(b)] = joint_torque[static_cast<size_t>(b)] = Vec3{};
  for (size_t i = 0; i < c.joints.size(); ++i) {
    const size_t joint = static_cast<size_t>(c.joints[i]);
    const CompiledJoint& j = joints[joint];
    JointState& js = s.joint[joint];
    const size_t at = static_cast<size_t>(c.matrix.first_row(static_cast<int>(i)));
    js.force = js.moment = {};
    Vec3 turn_child, turn_parent;
    for (int r = 0; r < j.rows; ++r) {
      const size_t row = at + static_cast<size_t>(r);
      const double f = per_time * joint_impulse[row];
      js.force += f * joint_rows[row].line;
      if (r >= j.lines) js.moment += f * joint_rows[row].turn_child;
      turn_child += f * joint_rows[row].turn_child;
      turn_parent += f * joint_rows[row].turn_parent;
      const double of_one = (joint_impulse[row] - joint_linear[row]) * (r < j.lines ? 1 : c.length);
      js.curvature[r] = !regular || is_pulled ? 0 : c.joints.size() > 1 ? joint_unforeseen[row] : of_one;
    }
    if (moving(j.child)) {
      joint_force[static_cast<size_t>(j.child)] += js.force;
      joint_torque[static_cast<size_t>(j.child)] += turn_child;
    }
    if (moving(j.parent)) {
      joint_force[static_cast<size_t>(j.parent)] -= js.force;
      joint_torque[static_cast<size_t>(j.parent)] += turn_parent;
    }
    if (j.kind == Joint::Kind::Revolute || j.kind == Joint::Kind::Cylindrical) {
      const JointFrames f = calc_joint_frames(s, j);
      update_angle(joint, f.F, f.M);
    }
  }
}

void System::solve_joints(double h) {
  take_pairs(h);
  for (JointCluster& c : clusters)
    if (!c.is_pair) solve_cluster(c, h);
}

void System::update_angle(size_t joint, const Mat3& F, const Mat3& M) {
  if (joints[joint].kind != Joint::Kind::Revolute && joints[joint].kind != Joint::Kind::Cylindrical) return;
  update_angle(joint, dot(M.column(0), F.column(0)), dot(M.column(0), F.column(1)));
}

void System::update_angle(size_t joint, double cosine, double sine) {
  JointState& js = state.joint[joint];
  const double turned = sine * js.known_cosine - cosine * js.known_sine;  // sine of the angle since then
  constexpr double near = 1.0 / 32;
  if (std::abs(turned) < near && cosine * js.known_cosine + sine * js.known_sine > 0) {
    // arc sine; the first term left out is 1e-19
    const double t2 = turned * turned;
    js.angle =
        js.known_angle +
        turned * (1 + t2 * (1.0 / 6 + t2 * (3.0 / 40 + t2 * (15.0 / 336 + t2 * (105.0 / 3456 + t2 * 945.0 / 42240)))));
    return;
  }
  constexpr double turn = 2 * 3.14159265358979323846;
  const double angle = std::atan2(sine, cosine);
  js.angle = angle + turn * std::round((js.angle - angle) / turn);
  js.known_angle = js.angle, js.known_cosine = cosine, js.known_sine = sine;
}

void System::update_angles() {
  for (size_t i = 0; i < joints.size(); ++i) {
    if (!state.joint[i].live) continue;
    const CompiledJoint& j = joints[i];
    update_angle(i, rotation_of(j.parent) * j.R_PF, rotation_of(j.child) * j.R_CM);
  }
}

System::JointOverload System::find_joint_overload(size_t i) const {
  const CompiledJoint& j = joints[i];
  const JointState& js = state.joint[i];
  Vec3 axis = (rotation_of(j.parent) * j.R_PF).column(0);
  if (j.kind == Joint::Kind::Distance) {
    const Vec3 line = calc_joint_frames(state, j).gap;
    axis = (1 / norm(line)) * line;
  }
  const double along = dot(axis, js.force), across2 = dot(js.force, js.force) - along * along;
  if (-along > j.tension_limit) return {"tension", -along, j.tension_limit};
  if (across2 > j.shear_limit * j.shear_limit) return {"shear", std::sqrt(across2), j.shear_limit};
  if (dot(js.moment, js.moment) > j.moment_limit * j.moment_limit) return {"moment", norm(js.moment), j.moment_limit};
  return {};
}

void System::check_joints() {
  for (size_t i = 0; i < joints.size(); ++i) {
    const CompiledJoint& j = joints[i];
    JointState& js = state.joint[i];
    if (!js.live) continue;
    if (pair_slot[i] != Lanes::kNoSlot && !joint_over[i] && !(std::abs(js.angle) > j.rotation_limit)) continue;
    // a rest, which joints have held too, is no force
    if (const JointOverload over = state.has_rest ? JointOverload{} : find_joint_overload(i); over.what != nullptr) {
      release_joint(i, over.what);
    } else if (std::abs(js.angle) > j.rotation_limit &&
               (j.rotational < 0 || state.rotational[static_cast<size_t>(j.rotational)].live)) {
      // a joint whose rotational element has broken turns freely
      release_joint(i, "rotation");
    }
  }
}

void System::drop_joint(size_t i) {
  JointState& js = state.joint[i];
  js.live = false;
  js.ended = state.time - 0.5 * state.last_kick;
  js.force = js.moment = {};
  for (JointState& other : state.joint) {
    // of what they are joined to now nothing is known
    other.is_examined = false;
    std::fill(std::begin(other.curvature), std::end(other.curvature), 0.0);
  }
  clusters_due = true;
  mark_links_due();
}

void System::loosen_joint(size_t i) {
  const size_t r = static_cast<size_t>(joints[i].rotational);
  ZoneState& z = state.rotational[r];
  if (!state.joint[i].live || !z.live) return;  // one that turns freely stays a joint
  const Mat3 F = rotation_of(joints[i].parent) * joints[i].R_PF;
  const Vec3 f = transpose_times(F, state.joint[i].force), m = transpose_times(F, state.joint[i].moment);
  drop_joint(i);
  free_zone(elements[E + r].zone, {{-f.x, -f.y, -f.z, -m.x, -m.y, 0}}, z);
  state.element[E + r] = std::exchange(z, {});
  z.live = false;
  begun_elements.push_back(E + r);
}

void System::release_joint(size_t i, double time) {
  const Ending ending = find_ending(time);
  end_joint(i, ending);
  if (const int r = joints[i].rotational; r >= 0) {
    if (is_loose(static_cast<size_t>(r))) {
      unpack_element(E + static_cast<size_t>(r));
      end_element(E + static_cast<size_t>(r), ending);
      pack_element(E + static_cast<size_t>(r));
    } else {
      end_rotational(static_cast<size_t>(r), ending);
    }
  }
  release_joint(i, "released");
  state.joint[i].ended = time;
}

void System::release_joint(size_t i, const char* reason) {
  const size_t r = static_cast<size_t>(joints[i].rotational);
  const bool is_loosened = joints[i].rotational >= 0 && is_loose(r);
  const bool has_element = is_loosened || (joints[i].rotational >= 0 && state.rotational[r].live);
  if (!state.joint[i].live && !has_element) return;  // neither it nor what has taken over from it
  if (joints[i].rotational >= 0 && state.joint[i].live) state.rotational[r].deformation[5] = state.joint[i].angle;
  drop_joint(i);
  if (is_loosened) {
    unpack_element(E + r);
    break_zone(state.element[E + r], BreakReason::Removed);
    pack_element(E + r);
  } else if (has_element) {
    break_zone(state.rotational[r], BreakReason::Removed);
  }
  say({Happening::Kind::JointReleased, state.time, static_cast<int>(i), -1, reason, 0});
}

}  // namespace topple::mbs
