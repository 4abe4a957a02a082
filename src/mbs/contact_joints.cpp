/// Bodies in contact that joints hold (docs/theory/contact.md, "Bodies that joints hold"): what joints leave of their
/// mobility, and how they feel each other's contacts.

#include <algorithm>
#include <cmath>

#include "mbs/contact_kernel.h"
#include "mbs/joint_rows.h"
#include "mbs/system.h"

namespace topple::mbs {

namespace {

// along a line a corner of a free box moves at most so much more easily than its centre: 1 + 3 + 3 of a plate
constexpr double kCornerOverCentre = 7;
constexpr double kRidge = 1e-9;  // of the trace, so that what joints hold altogether has a factor

/// Lower factor of a symmetric 6 x 6 matrix, its rotations measured with a length, with a ridge.
struct Factor {
  double L[36] = {};
  double scale[6];

  Factor(const double* A, double length) {
    double trace = 0;
    for (size_t i = 0; i < 6; ++i) {
      scale[i] = i < 3 ? 1 : length;
      trace += scale[i] * scale[i] * A[7 * i];
    }
    for (size_t i = 0; i < 6; ++i)
      for (size_t j = 0; j <= i; ++j) {
        double sum = scale[i] * scale[j] * A[6 * i + j] + (i == j ? kRidge * trace : 0);
        for (size_t k = 0; k < j; ++k) sum -= L[6 * i + k] * L[6 * j + k];
        L[6 * i + j] = i == j ? std::sqrt(std::max(sum, kRidge * trace)) : L[7 * j] > 0 ? sum / L[7 * j] : 0;
      }
  }
  /// x = L⁻¹ x
  void solve(double* x, size_t stride) const {
    for (size_t i = 0; i < 6; ++i) {
      double sum = x[i * stride];
      for (size_t k = 0; k < i; ++k) sum -= L[6 * i + k] * x[k * stride];
      x[i * stride] = L[7 * i] > 0 ? sum / L[7 * i] : 0;
    }
  }
};

/// Of the norm of L⁻¹ D L⁻ᵀ, which is 1 where two bodies move as one: no less than that, and at most 1.
double calc_coupling(const Factor& to, const Factor& from, const double* between) {
  double x[36];
  for (size_t i = 0; i < 6; ++i)
    for (size_t j = 0; j < 6; ++j) x[6 * i + j] = to.scale[i] * from.scale[j] * between[6 * i + j];
  for (size_t j = 0; j < 6; ++j) to.solve(x + j, 6);
  for (size_t i = 0; i < 6; ++i) from.solve(x + 6 * i, 1);
  double sum = 0;
  for (const double value : x) sum += value * value;
  return std::min(1.0, std::sqrt(sum));
}

}  // namespace

void System::begin_holding() {
  // a joint that has just been released holds nothing in the step to come
  if (clusters_due && !joints.empty()) rebuild_clusters();
  contact.mobility.clear();
  contact.mobility_of.clear();
  Touching& t = state.touching;
  t.jointed_clusters.clear(), t.meetings.clear(), t.meeting_rows.clear();
}

/// Lays out how forces on a cluster's bodies move its joints apart; its place in Touching::jointed_clusters.
int System::read_meetings(JointCluster& c) {
  Touching& t = state.touching;
  read_cluster(c, kDependent);
  const size_t first_rate = t.jointed_clusters.empty() ? 0
                                                       : t.jointed_clusters.back().first_rate +
                                                             static_cast<size_t>(t.jointed_clusters.back().rows);
  JointedCluster& to = t.jointed_clusters.emplace_back();
  to.rows = c.matrix.rows(), to.first_rate = first_rate;
  to.first_meeting = t.meetings.size();
  for (size_t k = 0; k < c.bodies.size(); ++k) {
    const size_t b = static_cast<size_t>(c.bodies[k]);
    const Mat3& W = world_inverse_inertia[b];
    const double inverse_mass = state.body[b].inverse_mass;
    for (int y = c.first_meeting[k]; y < c.first_meeting[k + 1]; ++y) {
      const JointCluster::Meeting meeting = c.meetings[static_cast<size_t>(y)];
      const int rows = joints[static_cast<size_t>(c.joints[static_cast<size_t>(meeting.place)])].rows;
      const JointMeeting m{c.bodies[k], c.matrix.first_row(meeting.place), rows, t.meeting_rows.size()};
      t.meetings.push_back(m);
      t.meeting_rows.resize(m.at + 6 * static_cast<size_t>(rows));
      for (int r = 0; r < rows; ++r) {
        const JointRow& row = joint_rows[static_cast<size_t>(m.first_row + r)];
        const Vec3 line = (meeting.is_child ? inverse_mass : -inverse_mass) * row.line;
        const Vec3 turn = W * (meeting.is_child ? row.turn_child : row.turn_parent);
        double* at = &t.meeting_rows[m.at + static_cast<size_t>(r)];
        for (int i = 0; i < 3; ++i) {
          at[static_cast<size_t>(i * rows)] = line[i];
          at[static_cast<size_t>((3 + i) * rows)] = turn[i];
        }
      }
    }
  }
  to.last_meeting = t.meetings.size();
  return static_cast<int>(t.jointed_clusters.size()) - 1;
}

int System::find_mobility(size_t b) {
  if (b >= B || !jointed[b] || !in_cluster[b]) return -1;
  if (contact.mobility_of.empty()) {
    contact.mobility_of.assign(B, -1);
    contact.read_clusters.assign(clusters.size(), -1);
  }
  int& at = contact.mobility_of[b];
  if (at >= 0) return at;
  at = static_cast<int>(contact.mobility.size());
  JointedMobility& m = contact.mobility.emplace_back();
  const size_t cluster = static_cast<size_t>(cluster_of[b]);
  JointCluster& c = clusters[cluster];
  int& read = contact.read_clusters[cluster];
  if (read < 0) read = read_meetings(c);
  m.body = static_cast<int>(b), m.cluster = read;
  const size_t n = static_cast<size_t>(c.matrix.rows());
  const Mat3& W = world_inverse_inertia[b];
  const double inverse_mass = state.body[b].inverse_mass;
  m.rows.assign(6 * n, 0);
  const Touching& t = state.touching;
  const JointedCluster& of = t.jointed_clusters[static_cast<size_t>(read)];
  for (size_t y = of.first_meeting; y < of.last_meeting; ++y) {
    const JointMeeting& meeting = t.meetings[y];
    if (meeting.body != m.body) continue;
    const size_t rows = static_cast<size_t>(meeting.rows);
    for (size_t i = 0; i < 6; ++i)
      for (size_t r = 0; r < rows; ++r)
        m.rows[i * n + static_cast<size_t>(meeting.first_row) + r] += t.meeting_rows[meeting.at + i * rows + r];
  }
  m.answers = m.rows;
  for (size_t i = 0; i < 6; ++i) {
    if (c.dependent > 0) c.matrix.project(&m.answers[i * n]);
    c.matrix.solve(&m.answers[i * n]);
  }
  for (size_t i = 0; i < 6; ++i)
    for (size_t j = 0; j <= i; ++j) {
      double sum = 0, other = 0;
      for (size_t r = 0; r < n; ++r) {
        sum += m.rows[i * n + r] * m.answers[j * n + r];
        other += m.rows[j * n + r] * m.answers[i * n + r];
      }
      m.less[6 * i + j] = m.less[6 * j + i] = 0.5 * (sum + other);
    }
  for (size_t i = 0; i < 6; ++i)
    for (size_t j = 0; j < 6; ++j) {
      const double own = i < 3 && j < 3     ? (i == j ? inverse_mass : 0)
                         : i >= 3 && j >= 3 ? W(static_cast<int>(i) - 3, static_cast<int>(j) - 3)
                                            : 0;
      m.left[6 * i + j] = own - m.less[6 * i + j];
    }
  return at;
}

double System::calc_mobility_along(size_t b, int mobility, const Vec3& lever, const Vec3& axis) const {
  if (b >= B || fixed[b]) return 0;
  const Vec3 turn = cross(lever, axis);
  if (mobility < 0) return calc_inverse_mass(static_cast<int>(b), axis, turn);
  const double e[6] = {axis.x, axis.y, axis.z, turn.x, turn.y, turn.z};
  const double* D = contact.mobility[static_cast<size_t>(mobility)].left;
  double sum = 0;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) sum += e[i] * D[6 * i + j] * e[j];
  return std::max(0.0, sum);
}

bool System::fit_points(size_t a, size_t b, const Vec3& n, size_t first, const ContactLaw& law, ContactGroup& g) {
  const size_t body[2] = {a, b};
  const int mobility[2] = {find_mobility(a), find_mobility(b)};
  if (mobility[0] < 0 && mobility[1] < 0) return false;
  const auto is_moving = [&](size_t i) { return body[i] < B && !fixed[body[i]]; };
  const auto along = [&](size_t i, const Vec3& lever, const Vec3& axis) {
    return is_moving(i) ? calc_mobility_along(body[i], mobility[i], lever, axis) : 0;
  };
  double least = 0, normal = 0, across = 0, own[2] = {0, 0};
  for (size_t i = 0; i < 2; ++i) {
    if (!is_moving(i)) continue;
    least += kernel::kLeastMobility * state.body[body[i]].inverse_mass;
    own[i] = std::max(along(i, {}, n), kernel::kLeastMobility * state.body[body[i]].inverse_mass);
  }
  normal = std::max(own[0] + own[1], least);
  const Vec3 apart = is_moving(1) ? Vec3(state.p[a]) - Vec3(state.p[b]) : Vec3{};
  for (size_t p = first; p < contact.point.size(); ++p) {
    const Vec3 lever[2] = {contact.point[p].at, contact.point[p].at + apart};
    double at_point = 0, all = 0;
    for (size_t i = 0; i < 2; ++i) {
      const double here = along(i, lever[i], n);
      own[i] = std::max(own[i], here / kCornerOverCentre);
      at_point += here;
      for (const Vec3& axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) all += along(i, lever[i], axis);
    }
    normal = std::max(normal, at_point / kCornerOverCentre);
    across = std::max(across, (all - at_point) / kCornerOverCentre);
  }
  g.mobility_a = mobility[0] < 0 ? 0 : own[0], g.mobility_b = mobility[1] < 0 ? 0 : own[1];
  if (law.stiffness > 0) {
    g.stiffness = g.stick = law.stiffness;
    return true;
  }
  // in the place of 1/(m_a⁻¹ + m_b⁻¹), by which the points have theirs
  const double frequency2 = model.contact.contact_frequency * model.contact.contact_frequency;
  double inverse_mass = 0;
  for (size_t i = 0; i < 2; ++i)
    if (is_moving(i)) inverse_mass += state.body[body[i]].inverse_mass;
  for (size_t p = first; p < contact.point.size(); ++p) contact.point[p].stiffness *= inverse_mass / normal;
  g.stiffness = frequency2 / normal;
  g.stick = frequency2 / std::max(normal, across);
  return true;
}

void System::keep_mobility(const ContactGroup& fitted) {
  ContactGroup& g = state.touching.group.back();
  g.stick = fitted.stick;
  g.mobility_a = fitted.mobility_a, g.mobility_b = fitted.mobility_b;
}

void System::hold_contacts() {
  Touching& t = state.touching;
  t.held.clear();
  t.jointed_pairs.clear();
  t.held_block.clear();
  t.joint_answers.clear();
  for (size_t i = 1; i < t.body.size(); ++i)
    if (jointed[static_cast<size_t>(t.body[i])]) {
      JointedBody& h = t.held.emplace_back();
      h.body = t.body[i], h.place = static_cast<int>(i);
    }
  if (t.held.empty()) return;

  // pairs of those in one cluster
  contact.first_of_cluster.assign(t.jointed_clusters.size(), -1);
  contact.next_of_cluster.assign(t.held.size(), -1);
  std::vector<int> mobility(t.held.size());
  for (size_t i = t.held.size(); i-- > 0;) {
    JointedBody& h = t.held[i];
    mobility[i] = find_mobility(static_cast<size_t>(h.body));
    if (mobility[i] < 0) continue;
    const JointedMobility& m = contact.mobility[static_cast<size_t>(mobility[i])];
    h.cluster = m.cluster;
    h.first_answer = t.joint_answers.size();
    t.joint_answers.insert(t.joint_answers.end(), m.answers.begin(), m.answers.end());
    int& first = contact.first_of_cluster[static_cast<size_t>(m.cluster)];
    contact.next_of_cluster[i] = first;
    first = static_cast<int>(i);
  }
  std::vector<Factor> factors;  // of a cluster's bodies
  for (const int first : contact.first_of_cluster) {
    if (first < 0) continue;
    const auto next = [&](int i) { return contact.next_of_cluster[static_cast<size_t>(i)]; };
    const auto mobility_of = [&](int i) -> const JointedMobility& {
      return contact.mobility[static_cast<size_t>(mobility[static_cast<size_t>(i)])];
    };
    const auto factor_of = [&](int i) {
      const size_t b = static_cast<size_t>(t.held[static_cast<size_t>(i)].body);
      return Factor(mobility_of(i).left, std::sqrt(state.body[b].gyration2));
    };
    factors.clear();
    for (int i = first; i >= 0; i = next(i)) factors.push_back(factor_of(i));
    size_t rank_i = 0;
    for (int i = first; i >= 0; i = next(i), ++rank_i) {
      size_t rank_j = 0;
      for (int j = first; j >= 0; j = next(j), ++rank_j) {
        JointedPair& p = t.jointed_pairs.emplace_back();
        p.to = i, p.from = j;
        const JointedMobility &to = mobility_of(i), &from = mobility_of(j);
        if (i == j) {
          std::copy(std::begin(to.less), std::end(to.less), p.less);
          continue;
        }
        const size_t n = to.rows.size() / 6;
        double between[36];
        for (size_t x = 0; x < 6; ++x)
          for (size_t y = 0; y < 6; ++y) {
            double sum = 0;
            for (size_t r = 0; r < n; ++r) sum += to.rows[x * n + r] * from.answers[y * n + r];
            p.less[6 * x + y] = sum;
            between[6 * x + y] = -sum;
          }
        p.coupling = calc_coupling(factors[rank_i], factors[rank_j], between);
      }
    }
  }
}

void System::fill_held_blocks() {
  Touching& t = state.touching;
  // the groups of bodies that feel each other share their mass
  const auto place_of = [&](int held) { return t.held[static_cast<size_t>(held)].place; };
  for (const JointedPair& p : t.jointed_pairs)
    if (p.to != p.from)
      t.share[static_cast<size_t>(place_of(p.to))] +=
          p.coupling * contact.groups[static_cast<size_t>(place_of(p.from))];
  const size_t W = kernel::lanes();
  size_t blocks = 0;
  const auto write = [&](const ContactGroup& g, int touched, size_t side) {
    if (touched == 0) return;
    const int mobility = find_mobility(static_cast<size_t>(t.body[static_cast<size_t>(touched)]));
    if (mobility < 0) return;
    if (t.held_block.empty()) t.held_block.assign(t.rows.size() - 1, -1);
    int& block = t.held_block[g.slot / W];
    if (block < 0) {
      block = static_cast<int>(blocks++);
      t.held_fields.resize(blocks * kernel::kHeldFields * W);
      std::fill(t.held_fields.end() - static_cast<std::ptrdiff_t>(kernel::kHeldFields * W), t.held_fields.end(), 0.0);
    }
    double* to = t.held_fields.data() +
                 (static_cast<size_t>(block) * kernel::kHeldFields + side * kernel::kHeldBody) * W + g.slot % W;
    const double* C = contact.mobility[static_cast<size_t>(mobility)].less;
    const auto put = [&](int i, int j) { *to = C[6 * i + j], to += W; };
    for (int i = 0; i < 3; ++i)
      for (int j = i; j < 3; ++j) put(i, j);
    for (int i = 0; i < 3; ++i)
      for (int j = 3; j < 6; ++j) put(i, j);
    for (int i = 3; i < 6; ++i)
      for (int j = i; j < 6; ++j) put(i, j);
  };
  if (t.jointed_pairs.empty()) return;
  for (const ContactGroup& g : t.group) write(g, g.a, 0), write(g, g.b, 1);
}

void System::keep_forces() {
  if (!model.contact.ground && !model.contact.bodies) return;
  contact.force_before.resize(B), contact.torque_before.resize(B);
  for (const JointCluster& c : clusters)
    for (const int body : c.bodies) {
      const size_t b = static_cast<size_t>(body);
      contact.force_before[b] = force[b], contact.torque_before[b] = torque[b];
    }
}

void System::foresee_joints(double h) {
  Touching& t = state.touching;
  std::vector<double>& rates = contact.joint_rates;
  rates.clear();
  for (const JointedCluster& c : t.jointed_clusters) {
    rates.resize(c.first_rate + static_cast<size_t>(c.rows), 0.0);
    for (size_t y = c.first_meeting; y < c.last_meeting; ++y) {
      const JointMeeting& m = t.meetings[y];
      const size_t b = static_cast<size_t>(m.body), rows = static_cast<size_t>(m.rows);
      const Vec3 push = contact.force_before[b] - Vec3(force[b]), turn = contact.torque_before[b] - Vec3(torque[b]);
      double less[6] = {push.x, push.y, push.z, turn.x, turn.y, turn.z};
      if (model.is_planar) less[1] = less[3] = less[5] = 0;
      double* of_joint = &rates[c.first_rate + static_cast<size_t>(m.first_row)];
      for (size_t i = 0; i < 6; ++i)
        for (size_t r = 0; r < rows; ++r) of_joint[r] += less[i] * t.meeting_rows[m.at + i * rows + r];
    }
  }
  for (JointedBody& held : t.held) {
    held.more_v = held.more_w = {};
    if (held.cluster < 0) continue;
    const JointedCluster& c = t.jointed_clusters[static_cast<size_t>(held.cluster)];
    const size_t n = static_cast<size_t>(c.rows);
    const double *answers = &t.joint_answers[held.first_answer], *rate = &rates[c.first_rate];
    const auto sum = [&](size_t i) {
      double all = 0;
      for (size_t r = 0; r < n; ++r) all += answers[i * n + r] * rate[r];
      return h * all;
    };
    held.more_v = {sum(0), sum(1), sum(2)};
    held.more_w = {sum(3), sum(4), sum(5)};
  }
}

void System::hold_changes(double h) {
  // joints' forces are those of the step before
  const Touching& t = state.touching;
  for (const JointedBody& held : t.held) {
    double* change = contact.changes.data() + static_cast<size_t>(held.place) * kernel::kWrenchRow;
    for (int i = 0; i < 3; ++i) change[i] += held.more_v[i], change[3 + i] += held.more_w[i];
  }
  for (const JointedPair& p : t.jointed_pairs) {
    const size_t to = static_cast<size_t>(t.held[static_cast<size_t>(p.to)].place),
                 from = static_cast<size_t>(t.held[static_cast<size_t>(p.from)].place);
    const double* sum = contact.sums.data() + from * kernel::kWrenchRow;
    double* change = contact.changes.data() + to * kernel::kWrenchRow;
    for (int i = 0; i < 6; ++i) {
      double less = 0;
      for (int j = 0; j < 6; ++j) less += p.less[6 * i + j] * sum[j];
      change[i] -= h * less;
    }
  }
}

}  // namespace topple::mbs
