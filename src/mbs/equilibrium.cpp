/// Dead-load equilibrium by Newton's method with the elastic stiffness, joints by the augmented Lagrangian; and the
/// stiffest mode by Lanczos' method (docs/theory/multibody.md, eq. 8 to 10). With stiffness_factor.h
/// the one place of the module that sees sparse matrices.

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Sparse>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

#include "mbs/acceleration.h"
#include "mbs/contact_kernel.h"
#include "mbs/joint_rows.h"
#include "mbs/sparse_kernel.h"
#include "mbs/stiffness_factor.h"
#include "mbs/system.h"
#include "mbs/zone_limits.h"

namespace topple::mbs {

namespace {

constexpr double kOverestimate = 1.01;   // of the highest frequency: the iteration stops a little below
constexpr double kHeld = 1e6;            // inertia of what joints hold, over that of the heaviest body
constexpr double kTouchingSafety = 0.9;  // of the limit of stability that what touches asks for

using Sparse = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;
using Vector = Eigen::VectorXd;

/// A row of a kinematic matrix: how fast one deformation grows with the velocities of two bodies.
struct KinematicRow {
  int a = -1, b = -1;  // place among the free bodies, -1 for held ones
  Vec3 va, wa, vb, wb;
};

/// Which coordinate of a free body is which unknown: all six, or x, z and the turn about y.
struct Unknowns {
  explicit constexpr Unknowns(bool is_planar) : each(is_planar ? 3 : 6), stride(is_planar ? 2 : 1) {}
  int each, stride;
  constexpr int at(int place, int unknown) const { return each * place + unknown; }
  /// Of the body's coordinates x y z, about x y z.
  constexpr int coordinate(int unknown) const { return stride * unknown; }
};

/// Of the same two bodies.
KinematicRow sum_of(const KinematicRow& r, const KinematicRow& s) {
  return {r.a, r.b, r.va + s.va, r.wa + s.wa, r.vb + s.vb, r.wb + s.wb};
}

void add_outer(const KinematicRow& r, double k, const Unknowns& u, Triplets& out) {
  const int body[2] = {r.a, r.b};
  const Vec3 part[2][2] = {{r.va, r.wa}, {r.vb, r.wb}};
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j) {
      if (body[i] < 0 || body[j] < 0) continue;
      for (int m = 0; m < u.each; ++m)
        for (int n = 0; n < u.each; ++n) {
          const int c = u.coordinate(m), d = u.coordinate(n);
          const double value = k * part[i][c / 3][c % 3] * part[j][d / 3][d % 3];
          out.emplace_back(u.at(body[i], m), u.at(body[j], n), value);  // zeros too: the pattern never changes
        }
    }
}

/// A symmetric matrix between free bodies, added up block by block. Its pattern is that of the pairs of bodies, zeros
/// included, so it never changes with the numbers.
class PairMatrix {
 public:
  using Block = double[12][12];  // by columns; both bodies' coordinates: x y z, about x y z

  PairMatrix(int bodies, const Unknowns& u) : u_(u), near_(static_cast<size_t>(bodies)) {}
  /// First all pairs of places, -1 for held bodies ...
  void join(int a, int b) {
    for (const auto& [x, y] : {std::pair{a, a}, {a, b}, {b, a}, {b, b}})
      if (x >= 0 && y >= 0) near_[static_cast<size_t>(x)].push_back(y);
  }
  /// ... then what is between them.
  void lay_out() {
    const int bodies = static_cast<int>(near_.size()), each = u_.each;
    for (std::vector<int>& list : near_) {
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
      first_.push_back(static_cast<std::uint32_t>(rows_.size()));
      rows_.insert(rows_.end(), list.begin(), list.end());
    }
    first_.push_back(static_cast<std::uint32_t>(rows_.size()));
    const int columns = each * bodies;
    matrix_.resize(columns, columns);
    size_t count = 0;
    for (const std::vector<int>& list : near_) count += list.size() * static_cast<size_t>(each * each);
    matrix_.resizeNonZeros(static_cast<Eigen::Index>(count));
    int* outer = matrix_.outerIndexPtr();
    int at = 0;
    for (int column = 0; column < columns; ++column) {
      outer[column] = at;
      for (const int row : near_[static_cast<size_t>(column / each)])
        for (int m = 0; m < each; ++m) matrix_.innerIndexPtr()[at++] = u_.at(row, m);
    }
    outer[columns] = at;
    std::fill_n(matrix_.valuePtr(), count, 0.0);
  }
  void add(int a, int b, const Block& sum) { u_.each == 6 ? add_blocks<6>(a, b, sum) : add_blocks<3>(a, b, sum); }
  /// Hands the matrix over, which a return value would copy.
  void move_to(Sparse& other) { other.swap(matrix_); }
  /// Times a vector, in the order in which Sparse sums.
  void times(const Vector& x, Vector& y) const {
    y.setZero(x.size());
    kernel::add_product({static_cast<size_t>(u_.each), near_.size(), first_.data(), rows_.data(), matrix_.valuePtr(),
                         x.data(), y.data()});
  }

 private:
  template <int Each>
  void add_blocks(int a, int b, const Block& sum) {
    constexpr Unknowns u(Each == 3);
    const int body[2] = {a, b};
    for (int j = 0; j < 2; ++j) {
      if (body[j] < 0) continue;
      const std::vector<int>& list = near_[static_cast<size_t>(body[j])];
      double* const columns = matrix_.valuePtr() + matrix_.outerIndexPtr()[u.at(body[j], 0)];
      for (int i = 0; i < 2; ++i) {
        if (body[i] < 0) continue;
        const auto place = std::lower_bound(list.begin(), list.end(), body[i]) - list.begin();
        double* to = columns + Each * place;
        for (int n = 0; n < Each; ++n, to += Each * list.size())
          for (int m = 0; m < Each; ++m) to[m] += sum[6 * j + u.coordinate(n)][6 * i + u.coordinate(m)];
      }
    }
  }

  Unknowns u_;
  std::vector<std::vector<int>> near_;  // of each body, those whose rows its columns have
  std::vector<std::uint32_t> first_;    // the same, one after the other
  std::vector<int> rows_;
  Sparse matrix_;
};

/// Adds the outer products of rows of the same two bodies, at most six, each times its k.
void add_outer(const KinematicRow* rows, const double* k, size_t count, PairMatrix::Block& sum) {
  double x[kernel::kMostOuterProducts][12];
  for (size_t r = 0; r < count; ++r) {
    const Vec3* part[4] = {&rows[r].va, &rows[r].wa, &rows[r].vb, &rows[r].wb};
    for (int i = 0; i < 12; ++i) x[r][i] = (*part[i / 3])[i % 3];
  }
  kernel::add_outer_products(&x[0][0], k, count, &sum[0][0]);
}

/// Upper bound of the frequencies with which the points that touch swing their bodies [rad/s].
double find_touching_frequency(const State& s) {
  const Touching& t = s.touching;
  if (t.group.empty()) return 0;
  const size_t W = kernel::lanes();
  std::vector<double> stiffness(t.body.size(), 0.0), held(t.body.size(), 0.0);
  for (const ContactGroup& g : t.group) {
    const size_t block = g.slot / W, place = g.slot % W;
    const double mean = t.groups[(block * kernel::kGroupFields + kernel::kMean) * W + place];
    double sum = 0;
    for (size_t i = 0; i < static_cast<size_t>(g.count); ++i)
      sum += t.points[((t.rows[block] + i) * kernel::kPointFields + kernel::kPointStiffness) * W + place];
    // Gershgorin's bound: a partner that moves counts once more
    const double bound = (g.a == 0 || g.b == 0 ? 1 : 2) * mean * sum;
    const auto add = [&](int body, double mobility) {
      if (mobility > 0)
        held[static_cast<size_t>(body)] += bound * mobility;
      else
        stiffness[static_cast<size_t>(body)] += bound;
    };
    add(g.a, g.mobility_a), add(g.b, g.mobility_b);
  }
  double most = 0;
  for (size_t i = 1; i < t.body.size(); ++i)  // the first is the ground
    most = std::max(most, stiffness[i] * s.body[static_cast<size_t>(t.body[i])].inverse_mass);
  // bodies of a mechanism feel each other's points
  std::vector<double> together(t.held.size(), 0.0);
  for (const JointedPair& p : t.jointed_pairs)
    if (const int place = t.held[static_cast<size_t>(p.from)].place; place >= 0)
      together[static_cast<size_t>(p.to)] += p.coupling * held[static_cast<size_t>(place)];
  for (const double omega2 : together) most = std::max(most, omega2);
  return std::sqrt(3 * most);  // a flat box rocks with the square root of 3 times what lifts it
}

}  // namespace

/// Assembles what both solvers below need.
class Assembly {
 public:
  explicit Assembly(const System& s) : s_(s), unknowns_(s.model.is_planar), place_(s.B, -1) {
    for (size_t b = 0; b < s.B; ++b)
      if (!s.fixed[b]) {
        place_[b] = static_cast<int>(free_.size());
        free_.push_back(static_cast<int>(b));
      }
  }
  int count() const { return unknowns_.each * static_cast<int>(free_.size()); }
  const Unknowns& unknowns() const { return unknowns_; }
  const std::vector<int>& free_bodies() const { return free_; }
  int place(int body) const { return body < 0 ? -1 : place_[static_cast<size_t>(body)]; }

  /// Six rows of an element, in its axes at its middle; a member's are of its chord, for small rotations against it.
  void element_rows(const CompiledElement& e, KinematicRow rows[6]) const {
    const Span span = e.zone.span();
    const ElementGeometry g = s_.measure_zone(e);
    const double slope = span.is_member() ? span.length() / g.length : 1;
    for (int i = 0; i < 6; ++i) {
      const Vec3 axis = g.axes.column(i % 3);
      KinematicRow r{place(e.a), place(e.b), {}, -axis, {}, axis};
      if (i < 3) {
        const double share = i == 0 ? 1 : slope;
        r.va = -share * axis;
        r.vb = share * axis;
        r.wa = -share * cross(g.p_a - centre(e.a), axis);
        r.wb = share * cross(g.p_b - centre(e.b), axis);
        // the rotations of both ends, with the levers of the stations
        if (i > 0 && span.is_member()) {
          const Vec3 about = cross(g.axes.column(0), axis);
          r.wa += span.a * about;
          r.wb -= span.b * about;
        }
      }
      rows[i] = r;
    }
  }
  /// Constraint rows of a joint, and how far each is from closed.
  int joint_rows(const CompiledJoint& j, KinematicRow rows[6], double gap[6]) const {
    const JointFrames f = calc_joint_frames(s_.state, j);
    JointRow held[6];
    calc_joint_gaps(j, f, gap);
    calc_joint_rows(j, f, held);
    for (int i = 0; i < j.rows; ++i)
      rows[i] = {place(j.parent), place(j.child), -held[i].line, held[i].turn_parent, held[i].line, held[i].turn_child};
    return j.rows;
  }
  KinematicRow rotational_row(const CompiledJoint& j) const {
    const Vec3 axis = (s_.rotation_of(j.parent) * j.R_PF).column(2);
    return {place(j.parent), place(j.child), {}, -axis, {}, axis};
  }
  /// Of stations beside the elastic one [rad/(N·m)].
  struct Flexibility {
    std::vector<std::array<std::array<double, 2>, 2>> element, rotational;  // [axis][station]
  };
  /// Of a zone's stations about an axis: what is given, or what has cracked for good.
  static std::array<double, 2> flexibility_of(const ZoneState& z, int axis, const Flexibility* given,
                                              decltype(Flexibility::element) Flexibility::*list, size_t i) {
    if (given != nullptr) return (given->*list)[i][static_cast<size_t>(axis)];
    return {z.station[0].crack[axis], z.station[1].crack[axis]};
  }
  /// Stiffness of all live elements: at rest, or that of fast motion, which the springs behind the dampers add to.
  /// `force_scale` is that of the forces, for springs; those of fast motion have the largest slope that is foreseen, if
  /// wanted.
  ///   added  to the stations' flexibility; null: what has cracked
  PairMatrix make_stiffness(bool fast, double force_scale = 1, bool foreseen = true,
                            const Flexibility* added = nullptr) const {
    const std::vector<StiffRow> springs = s_.calc_spring_stiffness(fast && foreseen, force_scale);
    PairMatrix sum(static_cast<int>(free_.size()), unknowns_);
    const auto each_element = [&](auto&& f) {
      for (size_t i = 0; i < s_.elements.size(); ++i)
        if (s_.state.element[i].live) f(i, s_.elements[i], s_.state.element[i].share);
    };
    const auto each_row = [&](auto&& f) {
      for (size_t i = 0; i < s_.rotationals.size(); ++i) {
        if (!s_.state.rotational[i].live) continue;
        const CompiledRotational& r = s_.rotationals[i];
        const CompiledJoint& j = s_.joints[static_cast<size_t>(r.joint)];
        const double factor = fast ? 1 + r.zone.viscous : 1;
        double plane[3];  // about z; the station is at the marker, so nothing couples
        soften_plane(r.zone, 1, 1, flexibility_of(s_.state.rotational[i], 1, added, &Flexibility::rotational, i).data(),
                     plane);
        f(rotational_row(j), factor * plane[2]);
      }
      for (const StiffRow& r : springs)
        f(KinematicRow{place(r.a), place(r.b), -r.row.line, -r.row.turn_a, r.row.line, r.row.turn_b}, r.stiffness);
    };
    each_element([&](size_t, const CompiledElement& e, double) { sum.join(place(e.a), place(e.b)); });
    each_row([&](const KinematicRow& r, double) { sum.join(r.a, r.b); });
    sum.lay_out();
    each_element([&](size_t i, const CompiledElement& e, double share) {
      const double factor = fast ? 1 + e.zone.viscous : 1;
      KinematicRow rows[6];
      element_rows(e, rows);
      PairMatrix::Block block = {};
      double stiffness[6];
      for (int k = 0; k < 6; ++k) stiffness[k] = factor * share * e.zone.stiffness[k];
      for (int q = 0; q < 2; ++q) {
        const auto cracked = flexibility_of(s_.state.element[i], q, added, &Flexibility::element, i);
        if (cracked[0] == 0 && cracked[1] == 0) continue;
        const int shear = q == 0 ? 2 : 1, bend = q == 0 ? 4 : 5;
        double plane[3];
        soften_plane(e.zone, share, q, cracked.data(), plane);
        for (double& k : plane) k *= factor;
        stiffness[shear] = plane[0] - plane[1], stiffness[bend] = plane[2] - plane[1];
        const KinematicRow both = sum_of(rows[shear], rows[bend]);
        add_outer(&both, &plane[1], 1, block);
      }
      add_outer(rows, stiffness, 6, block);
      sum.add(rows[0].a, rows[0].b, block);
    });
    each_row([&](const KinematicRow& r, double stiffness) {
      PairMatrix::Block block = {};
      add_outer(&r, &stiffness, 1, block);
      sum.add(r.a, r.b, block);
    });
    return sum;
  }

  /// Masses and inertias (in W, of the free bodies) with the joints' rows, each as inertia against its motion.
  Sparse make_held_mass(const std::vector<Mat3>& inertia) const {
    Triplets t;
    double mass = 0, turning = 0;
    for (size_t i = 0; i < free_.size(); ++i) {
      const double m = s_.state.body[static_cast<size_t>(free_[i])].mass;
      for (int k = 0; k < unknowns_.each; ++k)
        for (int l = 0; l < unknowns_.each; ++l) {
          const int c = unknowns_.coordinate(k), d = unknowns_.coordinate(l);
          if ((c < 3) != (d < 3)) continue;
          const double value = c < 3 ? (c == d ? m : 0) : inertia[i](c - 3, d - 3);
          t.emplace_back(unknowns_.at(static_cast<int>(i), k), unknowns_.at(static_cast<int>(i), l), value);
          (c < 3 ? mass : turning) = std::max(c < 3 ? mass : turning, value);
        }
    }
    for (size_t j = 0; j < s_.joints.size(); ++j) {
      if (!s_.state.joint[j].live) continue;
      KinematicRow rows[6];
      double gap[6];
      const int count = joint_rows(s_.joints[j], rows, gap);
      for (int i = 0; i < count; ++i)
        add_outer(rows[i], kHeld * (i < s_.joints[j].lines ? mass : turning), unknowns_, t);
    }
    Sparse M(this->count(), this->count());
    M.setFromTriplets(t.begin(), t.end());
    return M;
  }

 private:
  Vec3 centre(int body) const { return body < 0 ? Vec3{} : s_.state.p[static_cast<size_t>(body)]; }
  const System& s_;
  Unknowns unknowns_;
  std::vector<int> place_, free_;
};

/// Largest eigenvalue of M⁻¹ K by Lanczos' method in the inner product of M.
///   accelerate(x, y)  y = M⁻¹ x; weigh(x, y)  y = M x
template <class Accelerate, class Weigh>
double find_largest_eigenvalue(const PairMatrix& K, Eigen::Index n, Accelerate&& accelerate, Weigh&& weigh) {
  constexpr int most = 80;
  Vector x(n), before = Vector::Zero(n), f(n), next(n), weighed(n);
  // a start that no mode is orthogonal to by symmetry
  std::uint64_t seed = 88172645463325252ULL;
  for (Eigen::Index i = 0; i < n; ++i) {
    seed ^= seed << 13, seed ^= seed >> 7, seed ^= seed << 17;
    x[i] = static_cast<double>(seed >> 11) * 0x1p-53 - 0.5;
  }
  std::vector<double> diagonal, beside;
  weigh(x, weighed);
  double found = 0, norm2 = x.dot(weighed);
  for (int round = 0; round < most && norm2 > 0; ++round) {
    const double norm = std::sqrt(norm2);
    if (round > 0) beside.push_back(norm);
    x /= norm;
    K.times(x, f);
    diagonal.push_back(x.dot(f));
    accelerate(f, next);
    next -= diagonal.back() * x;
    if (round > 0) next -= norm * before;
    before.swap(x);
    x.swap(next);
    weigh(x, weighed);
    norm2 = x.dot(weighed);
    const bool exhausted = !(norm2 > 1e-20 * diagonal.back() * diagonal.back());
    if (round % 4 != 3 && round + 1 != n && !exhausted) continue;
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
    solver.computeFromTridiagonal(Eigen::Map<const Vector>(diagonal.data(), static_cast<Eigen::Index>(diagonal.size())),
                                  Eigen::Map<const Vector>(beside.data(), static_cast<Eigen::Index>(beside.size())),
                                  Eigen::EigenvaluesOnly);
    const double largest = solver.eigenvalues().maxCoeff();
    // it only grows, and quickly
    if (exhausted || round + 1 == n || (round > 12 && largest - found < 1e-4 * largest)) return largest;
    found = largest;
  }
  return found;
}

double System::find_highest_frequency(bool is_present) const {
  const Assembly assembly(*this);
  const int n = assembly.count();
  if (n == 0) return 0;
  const Unknowns& u = assembly.unknowns();
  std::vector<Mat3> inertia(assembly.free_bodies().size()), inverse_inertia(inertia.size());
  for (size_t i = 0; i < inertia.size(); ++i) {
    const size_t b = static_cast<size_t>(assembly.free_bodies()[i]);
    const Mat3 R = state.R[b];
    inertia[i] = R * state.body[b].inertia * transpose(R);
    inverse_inertia[i] = R * state.body[b].inverse_inertia * transpose(R);
  }
  const auto scale = [&](const Vector& x, bool inverse, Vector& y) {
    for (size_t i = 0; i < inertia.size(); ++i) {
      const BodyConstants& body = state.body[static_cast<size_t>(assembly.free_bodies()[i])];
      const double m = inverse ? body.inverse_mass : body.mass;
      const Mat3& I = inverse ? inverse_inertia[i] : inertia[i];
      const double* from = x.data() + u.each * static_cast<Eigen::Index>(i);
      double* to = y.data() + u.each * static_cast<Eigen::Index>(i);
      if (u.each == 6) {
        const Vec3 w = I * Vec3{from[3], from[4], from[5]};
        to[0] = m * from[0], to[1] = m * from[1], to[2] = m * from[2];
        to[3] = w.x, to[4] = w.y, to[5] = w.z;
      } else {
        to[0] = m * from[0], to[1] = m * from[1];
        to[2] = (I * Vec3{0, from[2], 0}).y;
      }
    }
  };
  double omega2 = 0;
  if (!is_present) {
    omega2 = find_largest_eigenvalue(
        assembly.make_stiffness(true), n, [&](const Vector& x, Vector& y) { scale(x, true, y); },
        [&](const Vector& x, Vector& y) { scale(x, false, y); });
  } else {
    // inertia against what joints hold, so large that nothing of it moves
    const Sparse M = assembly.make_held_mass(inertia);
    StiffnessFactor factor;
    factor.factorise(M);
    omega2 = find_largest_eigenvalue(
        assembly.make_stiffness(true, 1, false), n, [&](const Vector& x, Vector& y) { y = factor.solve(x); },
        [&](const Vector& x, Vector& y) { y = M * x; });
  }
  return kOverestimate * std::sqrt(std::max(0.0, omega2));
}

double System::calc_step_limit() const {
  // a flat box on four corners rocks with the square root of 12 times what one of them would give its mass
  const double touching = std::sqrt(12.0) * calc_contact_frequency();
  const double fastest = std::sqrt(highest_frequency * highest_frequency + touching * touching);
  return fastest > 0 ? 2 / fastest : 1e-3 / options.step_safety;
}

double System::find_fastest_spin() const {
  double fastest = 0;
  for (size_t b = 0; b < B; ++b)
    if (!fixed[b]) fastest = std::max(fastest, norm(state.w[b]));
  return fastest;
}

double System::calc_own_step() const {
  const double share = options.step_share, step_of_limit = share * options.step_safety * calc_step_limit();
  // steps in which bodies meet or part shall not change their energy much (docs/theory/contact.md)
  const double corner = calc_contact_frequency();
  double h = corner > 0 ? std::min(step_of_limit, share * kContactAngle / corner) : step_of_limit;
  if (options.most_turn > 0) {
    const double fastest = find_fastest_spin();
    if (h * fastest > share * options.most_turn) h = share * options.most_turn / fastest;
  }
  if (options.least_steps > 0 && options.duration > 0) h = std::min(h, share * options.duration / options.least_steps);
  return h;
}

void System::set_step(double h) {
  if (h == step && h > 0) return;
  if (!(options.duration <= kMostSteps * h) && trouble.empty())
    trouble = fmt::format(
        "the fastest mode has {:.4g} rad/s and contact {:.4g} rad/s, and {:.6g} s in steps of {:.3g} s are more steps "
        "than the {:g} that a run may take",
        highest_frequency, calc_contact_frequency(), options.duration, h, kMostSteps);
  state.time_base = state.time;
  state.index_base = state.step_index;
  state.step = h;
  adopt_step();
}

void System::adopt_step() {
  step = state.step;
  contact_interval = calc_contact_interval();
  summary.shortest_step = summary.shortest_step > 0 ? std::min(summary.shortest_step, step) : step;
  const double relaxation = 1 - std::exp(-step * model.damping_frequency);
  for (CompiledRotational& r : rotationals) r.zone.relaxation = relaxation;
  for (size_t e = 0; e < elements.size(); ++e) {
    elements[e].zone.relaxation = relaxation;
    const size_t slot = slot_of(e);
    if (slot != Lanes::kNoSlot) lanes->set(slot, kernel::kRelaxation, relaxation);
  }
}

void System::review_step() {
  std::vector<double>& due = state.review_times;
  const bool is_due = std::any_of(due.begin(), due.end(), [&](double t) { return t <= state.time; });
  if (!is_due && 4 * state.live_elements >= 3 * state.live_at_review) {
    constexpr double too_far = 4;  // 16 times the error of most_turn
    if (options.step <= 0 && options.most_turn > 0 && step * find_fastest_spin() > too_far * options.most_turn)
      set_step(calc_own_step());
    // many shapes that touch at once are stiffer together than the four corners of calc_step_limit; a step that changes
    // in the midst of an impact changes its energy, so only where stability asks for it
    if (options.step > 0 || state.touching.steps != 1) return;
    const double touching = find_touching_frequency(state);
    if (step * touching > 2 * kTouchingSafety)
      set_step(2 * kTouchingSafety / std::hypot(find_highest_frequency(), touching));
    return;
  }
  due.erase(std::remove_if(due.begin(), due.end(), [&](double t) { return t <= state.time; }), due.end());
  state.live_at_review = state.live_elements;
  highest_frequency = find_highest_frequency();
  double longest = 0;
  const bool is_too_long = !bears_set_step(longest);
  if (is_too_long && state.set_step_doubted)
    summary.step_needed = summary.step_needed > 0 ? std::min(summary.step_needed, longest) : longest;
  else if (is_too_long)
    due.push_back(state.time);  // what an event leaves between two steps lasts for one; the next step looks again
  state.set_step_doubted = is_too_long;
  summary.highest_frequency = std::max(summary.highest_frequency, highest_frequency);
  if (options.step <= 0) set_step(calc_own_step());
}

bool System::bears_set_step(double& longest) {
  const auto bears = [this] { return step * highest_frequency <= 2 * kOverestimate; };
  if (options.step <= 0 || bears()) return true;
  highest_frequency = find_highest_frequency(true);
  longest = 2 * kOverestimate / highest_frequency;
  return bears();
}

void System::choose_step() {
  highest_frequency = find_highest_frequency();
  state.live_elements = state.live_at_review = E;
  set_step(options.step > 0 ? options.step : calc_own_step());
  if (double longest = 0; !bears_set_step(longest)) {
    char words[160];
    std::snprintf(words, sizeof words,
                  "the fastest mode has %.4g rad/s and needs a step below %.3g s, and the step is %.3g s", 2 / longest,
                  longest, step);
    trouble = words;
  }
  note_fast_dampers();
  summary.step = step;
  summary.highest_frequency = highest_frequency;
}

std::shared_ptr<StiffnessFactor> make_stiffness_factor() { return std::make_shared<StiffnessFactor>(); }

namespace {

/// The dead-load equilibrium by Newton's method, joints by multipliers that each iteration corrects.
class DeadLoad {
 public:
  explicit DeadLoad(System& s)
      : s_(s),
        assembly_(s),
        u_(assembly_.unknowns()),
        virgin_(s.state.element),
        virgin_rotational_(s.state.rotational),
        factor_(s.stiffness_factor ? s.stiffness_factor : make_stiffness_factor()),
        multiplier_(s.joints.size()),
        pushed_back_(Vector::Zero(6 * static_cast<Eigen::Index>(s.joints.size()))) {}

  bool is_needed() const { return assembly_.count() > 0; }
  /// Puts bodies and joints into the equilibrium. False: there is none, and the message says why.
  bool find(std::string& message);

 private:
  /// A free body that hangs on nothing, -1 if there is none.
  int find_loose_body() const;
  /// What gravity and constant loads push with; 1 if that is nothing [N].
  double calc_weight() const;
  /// Root mean square of the distances of joints from the centres of mass and of the radii of gyration [m].
  double calc_length() const;
  /// Of the stiffness with joints held by the penalty. False: a mechanism.
  bool factorise(std::string& message);
  /// What reactions of joints hold bodies with that turn, where it holds: a body that hangs swings back.
  void add_hanging(Triplets&) const;
  /// Evaluates all forces where the bodies are now; multipliers and joints' forces follow their gaps.
  void find_unbalanced();
  void move(const Vector& by);
  /// Shortens a way on which a body would turn by more than most_turn_.
  void shorten(Vector& way) const;
  /// Of free bodies, and the joints' multipliers.
  struct Place {
    std::vector<Vec3> p;
    std::vector<Quat> q;
    std::vector<std::array<double, 6>> multiplier;
  };
  Place find_place() const;
  void go_back(const Place&);
  /// Moves by the accelerated step; where the last one led away, from where that began.
  void move_accelerated();
  void find_most_loaded();
  /// Of the last evaluation: tangents where they lead nearer, else secants, which go there slowly but surely.
  void find_cracks(bool by_tangents);
  /// What is unbalanced, over the weight. Iterations leave forces in balance however far joints are open, so what would
  /// close them counts, too, by a hundredth.
  double calc_left() const {
    return std::max(unbalanced_, 0.01 * hold_ * std::max(0.0, gap_left_ - open_gap_) / weight_);
  }
  std::string describe_failure(bool has_diverged);
  /// What the most loaded element would bear without limits.
  std::string tell_most_loaded() const;
  enum class End { Found, None, Diverged, Mechanism };
  /// Tells of the joint that is widest open where an equilibrium was found all the same.
  void note_open_joint();
  /// Iterates from where the bodies are.
  End search(double good_enough, std::string& message);
  /// Where there is no equilibrium: the loads without limits of elements that crack under them.
  void find_cracked_loads(double good_enough);

  /// Zones forget what they were asked.
  void make_virgin() { s_.state.element = virgin_, s_.state.rotational = virgin_rotational_; }

  System& s_;
  const Assembly assembly_;
  const Unknowns& u_;
  const std::vector<ZoneState> virgin_, virgin_rotational_;
  double weight_ = 1, penalty_ = 1;
  double length_ = 1;              // of what turns: makes rotations lengths, torques forces [m]
  double open_gap_ = -1;           // need not close: repeated constraints meet but for the last digits [m]
  double hold_ = 0;                // stiffness by which an open joint counts as a force [N/m]
  double share_ = 1;               // of an iteration's way that is gone
  double most_turn_ = kUnlimited;  // of a body in an iteration [rad]
  bool hangs_ = false;             // reactions of joints count as stiffness
  const std::shared_ptr<StiffnessFactor> factor_;
  Sparse first_;  // stiffness at the start, once
  Assembly::Flexibility cracks_;
  bool has_cracks_ = false;
  std::vector<std::array<double, 6>> multiplier_;
  Vector pushed_back_;                    // what multipliers changed by last (6 per joint)
  Vector pushed_;                         // unbalanced, and gaps pushed back
  double unbalanced_ = 0, gap_left_ = 0;  // over the weight; [m], angles times length_
  bool is_balanced_ = false;              // forces were, and joints open
  size_t most_unbalanced_ = 0;            // body
  size_t most_open_ = 0;                  // joint, by its gap
  double widest_ = 0;                     // that [m or rad]
  std::vector<Overload> overloads_;       // without limits, the largest first
  bool measures_loads_ = false;           // laws have no limits
  size_t most_loaded_ = 0;                // element, without limits
  double most_load_ = 0;
  Acceleration acceleration_;
  Place begun_;  // of the last accelerated step
  Vector begun_step_, begun_pushed_;
};

int DeadLoad::find_loose_body() const {
  std::vector<int> root(s_.B + 1);
  for (size_t i = 0; i <= s_.B; ++i) root[i] = static_cast<int>(i);
  const auto find = [&](int x) {
    while (root[static_cast<size_t>(x)] != x)
      x = root[static_cast<size_t>(x)] = root[static_cast<size_t>(root[static_cast<size_t>(x)])];
    return x;
  };
  const auto node = [&](int b) { return b < 0 || s_.fixed[static_cast<size_t>(b)] ? static_cast<int>(s_.B) : b; };
  const auto join = [&](int a, int b) { root[static_cast<size_t>(find(node(a)))] = find(node(b)); };
  for (const CompiledElement& e : s_.elements) join(e.a, e.b);
  for (const CompiledJoint& j : s_.joints) join(j.parent, j.child);
  for (const CompiledSpring& k : s_.forces.springs) join(k.a, k.b);
  for (const CompiledBushing& k : s_.forces.bushings) join(k.a, k.b);
  for (const Cable& k : s_.model.cables) join(k.a.index, k.b.index);
  for (const int b : assembly_.free_bodies())
    if (find(b) != find(static_cast<int>(s_.B))) return b;
  return -1;
}

double DeadLoad::calc_weight() const {
  double weight = 0;
  for (const int b : assembly_.free_bodies())
    weight += s_.state.body[static_cast<size_t>(b)].mass * norm(s_.model.gravity);
  for (size_t i = 0; i < s_.forces.loads.size(); ++i)
    if (s_.state.load[i].begin <= 0)
      weight += norm(s_.forces.loads[i].force) *
                (s_.forces.loads[i].is_constant ? 1 : std::abs(calc_force(s_.forces.loads[i].factor, 0)));
  return weight == 0 ? 1 : weight;
}

double DeadLoad::calc_length() const {
  double sum = 0;
  int count = 0;
  for (const int b : assembly_.free_bodies()) sum += s_.state.body[static_cast<size_t>(b)].gyration2, ++count;
  for (const CompiledJoint& j : s_.joints) {
    const JointFrames f = calc_joint_frames(s_.state, j);
    for (const bool is_child : {false, true})
      if (assembly_.place(is_child ? j.child : j.parent) >= 0) {
        const Vec3 lever = is_child ? f.lever_child : f.lever_parent;
        sum += dot(lever, lever), ++count;
      }
  }
  return count > 0 && sum > 0 ? std::sqrt(sum / count) : 1;
}

bool DeadLoad::factorise(std::string& message) {
  const int n = assembly_.count();
  Sparse K;
  if (first_.rows() > 0)
    K.swap(first_);
  else
    assembly_.make_stiffness(false, weight_, true, &cracks_).move_to(K);
  if (!s_.joints.empty()) {
    Triplets t;
    for (const CompiledJoint& j : s_.joints) {
      KinematicRow rows[6];
      double gap[6];
      const int count = assembly_.joint_rows(j, rows, gap);
      for (int i = 0; i < count; ++i) add_outer(rows[i], penalty_ * (i < j.lines ? 1 : length_ * length_), u_, t);
    }
    if (hangs_) add_hanging(t);
    Sparse P(n, n);
    P.setFromTriplets(t.begin(), t.end());
    K += P;
  }
  const bool is_regular = factor_->factorise(K);
  if (!is_regular) {
    // a pivot of exactly nothing is found as one that is nearly so
    Sparse ridge(n, n);
    ridge.setIdentity();
    K += (1e-15 * K.diagonal().cwiseAbs().maxCoeff()) * ridge;
  }
  if (!is_regular && !factor_->factorise(K)) {
    message = "the stiffness matrix of the dead-load equilibrium could not be factorised: the model is a mechanism";
    return false;
  }
  const Vector& D = factor_->diagonal();
  Eigen::Index worst = 0;
  const double least = D.minCoeff(&worst);
  if (is_regular && least > 1e-13 * D.maxCoeff()) return true;
  const Eigen::Index unknown = factor_->unknown_of(worst);
  message = "body \"" +
            s_.model.bodies[static_cast<size_t>(assembly_.free_bodies()[static_cast<size_t>(unknown / u_.each)])].name +
            "\" can move without resistance: the model is a mechanism and has no dead-load equilibrium";
  return false;
}

void DeadLoad::add_hanging(Triplets& out) const {
  // a force f at the lever r from the mass centre brings (θ x r) x f on a turn θ: as stiff as r·f about r x f, and as
  // (r·f + |r||f|)/2 about r/|r| - f/|f|; what would push on is left out
  for (size_t j = 0; j < s_.joints.size(); ++j) {
    const CompiledJoint& joint = s_.joints[j];
    const JointFrames frames = calc_joint_frames(s_.state, joint);
    for (const bool is_child : {false, true}) {
      const int place = assembly_.place(is_child ? joint.child : joint.parent);
      if (place < 0) continue;
      const Vec3 r = is_child ? frames.lever_child : frames.lever_parent;
      const Vec3 f = (is_child ? 1.0 : -1.0) * s_.state.joint[j].force;
      const double size = norm(r) * norm(f), along = dot(r, f);
      if (!(size > 0) || !std::isfinite(size)) continue;
      const auto add = [&](const Vec3& axis, double k) {
        if (k > 0 && norm(axis) > 0) add_outer({-1, place, {}, {}, {}, (1 / norm(axis)) * axis}, k, u_, out);
      };
      add(cross(r, f), along);
      add((1 / norm(r)) * r - (1 / norm(f)) * f, 0.5 * (along + size));
    }
  }
}

void DeadLoad::find_unbalanced() {
  s_.ground_reaction = {};
  s_.update_angles();
  s_.evaluate_elements_fully(0);
  s_.evaluate_rotationals(0);
  s_.evaluate_cables(true);
  s_.evaluate_springs(true);
  s_.evaluate_loads(true);
  Vector r(assembly_.count());
  for (size_t i = 0; i < assembly_.free_bodies().size(); ++i) {
    const size_t b = static_cast<size_t>(assembly_.free_bodies()[i]);
    const Vec3 f = s_.force[b] + s_.state.body[b].mass * s_.model.gravity, t = s_.torque[b];
    for (int k = 0; k < u_.each; ++k) {
      const int c = u_.coordinate(k);
      r[u_.at(static_cast<int>(i), k)] = c < 3 ? f[c] : t[c - 3];
    }
  }
  pushed_ = r;
  gap_left_ = 0;
  for (size_t j = 0; j < s_.joints.size(); ++j) {
    KinematicRow rows[6];
    double gap[6];
    const int count = assembly_.joint_rows(s_.joints[j], rows, gap);
    JointState& js = s_.state.joint[j];
    js.force = js.moment = {};
    for (int i = 0; i < count; ++i) {
      const KinematicRow& row = rows[i];
      double& held = multiplier_[j][static_cast<size_t>(i)];
      const double turns = i < s_.joints[j].lines ? 1 : length_, penalty = penalty_ * turns * turns;
      held -= share_ * penalty * gap[i];
      pushed_back_[static_cast<Eigen::Index>(6 * j) + i] = -share_ * penalty * gap[i];
      if (const double open = std::isfinite(gap[i]) ? turns * std::abs(gap[i]) : kUnlimited; open > gap_left_)
        gap_left_ = open, most_open_ = j, widest_ = std::abs(gap[i]);
      const auto load = [&](Vector& on, double f) {
        for (int k = 0; k < u_.each; ++k) {
          const int c = u_.coordinate(k);
          if (row.a >= 0) on[u_.at(row.a, k)] += f * (c < 3 ? row.va[c] : row.wa[c - 3]);
          if (row.b >= 0) on[u_.at(row.b, k)] += f * (c < 3 ? row.vb[c] : row.wb[c - 3]);
        }
      };
      load(r, held);
      load(pushed_, held - penalty * gap[i]);
      js.force += held * row.vb;
      if (i >= s_.joints[j].lines) js.moment += held * row.wb;
    }
  }
  constexpr double wider = 10;  // than at the start
  if (open_gap_ < 0) open_gap_ = wider * gap_left_;
  Eigen::Index most = 0;
  for (Eigen::Index i = 0; i < r.size(); ++i)
    if (u_.coordinate(static_cast<int>(i % u_.each)) >= 3) r[i] /= length_;
  r.cwiseAbs().maxCoeff(&most);
  // a largest one does not see what is no number
  unbalanced_ = r.allFinite() ? r.lpNorm<Eigen::Infinity>() / weight_ : kUnlimited;
  most_unbalanced_ = static_cast<size_t>(assembly_.free_bodies()[static_cast<size_t>(most / u_.each)]);
}

void DeadLoad::move(const Vector& by) {
  for (size_t i = 0; i < assembly_.free_bodies().size(); ++i) {
    const size_t b = static_cast<size_t>(assembly_.free_bodies()[i]);
    Vec3 moved, turned;
    for (int k = 0; k < u_.each; ++k) {
      const int c = u_.coordinate(k);
      (c < 3 ? moved[c] : turned[c - 3]) = by[u_.at(static_cast<int>(i), k)];
    }
    s_.state.p[b] += moved;
    s_.state.q[b] = normalized(exp_rotation(turned) * s_.state.q[b]);
    s_.state.R[b] = to_matrix(s_.state.q[b]);
  }
}

void DeadLoad::shorten(Vector& way) const {
  double most = 0;
  for (Eigen::Index i = 0; i < way.size(); ++i)
    if (u_.coordinate(static_cast<int>(i % u_.each)) >= 3) most = std::max(most, std::abs(way[i]));
  if (most > most_turn_) way *= most_turn_ / most;
}

DeadLoad::Place DeadLoad::find_place() const {
  Place place;
  for (const int b : assembly_.free_bodies()) {
    place.p.push_back(s_.state.p[static_cast<size_t>(b)]);
    place.q.push_back(s_.state.q[static_cast<size_t>(b)]);
  }
  place.multiplier = multiplier_;
  return place;
}

void DeadLoad::go_back(const Place& place) {
  for (size_t i = 0; i < assembly_.free_bodies().size(); ++i) {
    const size_t b = static_cast<size_t>(assembly_.free_bodies()[i]);
    s_.state.p[b] = place.p[i];
    s_.state.q[b] = place.q[i];
    s_.state.R[b] = to_matrix(place.q[i]);
  }
  multiplier_ = place.multiplier;
}

void DeadLoad::move_accelerated() {
  Vector step(assembly_.count() + pushed_back_.size());
  step << share_ * factor_->solve(pushed_), pushed_back_;
  if (acceleration_.accepts(step, pushed_)) {
    begun_ = find_place(), begun_step_ = step, begun_pushed_ = pushed_;
  } else {
    go_back(begun_);
    step = begun_step_, pushed_ = begun_pushed_;
  }
  const Vector way = acceleration_.improve(step, pushed_);
  // joints' reactions follow; of that the step itself has been done
  const Vector more = (way - step).tail(pushed_back_.size());
  for (size_t j = 0; j < multiplier_.size(); ++j)
    for (size_t i = 0; i < 6; ++i) multiplier_[j][i] += more[static_cast<Eigen::Index>(6 * j + i)];
  move(way.head(assembly_.count()));
}

void DeadLoad::find_most_loaded() {
  most_load_ = 0;
  overloads_.clear();
  for (size_t i = 0; i < s_.elements.size(); ++i) {
    const double used = calc_utilisation(s_.elements[i].zone, s_.laws, 0, s_.state.element[i]);
    if (used > most_load_) most_load_ = used, most_loaded_ = i;
    if (used > 1) overloads_.push_back({i, used});
  }
  std::stable_sort(overloads_.begin(), overloads_.end(),
                   [](const Overload& a, const Overload& b) { return a.used > b.used; });
}

void DeadLoad::find_cracks(bool by_tangents) {
  has_cracks_ = false;
  const auto copy = [&](const std::vector<ZoneState>& from, auto& to) {
    to.resize(from.size());
    for (size_t i = 0; i < from.size(); ++i)
      for (size_t q = 0; q < 2; ++q)
        for (size_t s = 0; s < 2; ++s) {
          const StationState& st = from[i].station[s];
          to[i][q][s] = by_tangents ? st.tangent[q] : st.crack[q];
          has_cracks_ = has_cracks_ || st.crack[q] > 0;
        }
  };
  copy(s_.state.element, cracks_.element);
  copy(s_.state.rotational, cracks_.rotational);
}

std::string DeadLoad::describe_failure(bool has_diverged) {
  char words[240];
  std::snprintf(words, sizeof words, "no dead-load equilibrium after %d iterations: the largest unbalanced force ",
                s_.summary.equilibrium_iterations);
  std::string message = words;
  if (has_diverged) {
    message += "grew without bound";
  } else if (unbalanced_ < calc_left()) {
    message =
        fmt::format("no dead-load equilibrium after {} iterations: a gap of {:.2g} m or rad is left in joint \"{}\"",
                    s_.summary.equilibrium_iterations, widest_, s_.model.joints[most_open_].name.substr(0, 60));
  } else {
    std::snprintf(words, sizeof words, "is %.2g times the weight", unbalanced_);
    message = message + words + ", of body \"" + s_.model.bodies[most_unbalanced_].name.substr(0, 60) + "\"";
  }
  return message;
}

std::string DeadLoad::tell_most_loaded() const {
  if (!(most_load_ > 0)) return {};
  constexpr double countless = 100;  // hardly any capacity is left
  char words[120];
  if (most_load_ < countless)
    std::snprintf(words, sizeof words, "\" would be loaded to %.0f %% of its capacity", 100 * most_load_);
  else
    std::snprintf(words, sizeof words, "\" would be loaded to more than %.0f times its capacity", countless);
  return "; without limits element \"" + s_.model.elements[most_loaded_].name.substr(0, 60) + words;
}

bool DeadLoad::find(std::string& message) {
  if (const int b = find_loose_body(); b >= 0) {
    message =
        "body \"" + s_.model.bodies[static_cast<size_t>(b)].name +
        "\" is not connected to the ground by any element, joint, spring, bushing or cable: there is no dead-load "
        "equilibrium";
    return false;
  }
  weight_ = calc_weight();
  length_ = calc_length();
  // joints as stiff as the stiffest body is held: more would turn round-off of places into larger forces
  {
    assembly_.make_stiffness(false, weight_).move_to(first_);
    penalty_ = 0;
    for (Eigen::Index i = 0; i < first_.rows(); ++i)
      penalty_ = std::max(
          penalty_, first_.coeff(i, i) / (u_.coordinate(static_cast<int>(i % u_.each)) < 3 ? 1 : length_ * length_));
    if (!(penalty_ > 0)) penalty_ = weight_ / length_;
  }
  // places are known to round-off only, and the stiffest spring turns that into a force
  double extent = length_;
  for (const int b : assembly_.free_bodies()) extent = std::max(extent, norm(s_.state.p[static_cast<size_t>(b)]));
  // where joints alone hold: the weight opens them by a thousandth at first
  penalty_ = std::max(penalty_, 1e3 * weight_ / extent);
  hold_ = penalty_;
  const double good_enough = std::max(1e-8, 1e-15 * penalty_ * extent / weight_);

  const Place begun = find_place();
  const std::vector<JointState> joints = s_.state.joint;  // their angles
  const auto begin_again = [&] {
    go_back(begun);
    make_virgin();
    s_.state.joint = joints;
    pushed_back_.setZero();
    acceleration_ = {};
    most_load_ = 0;
    overloads_.clear();
  };
  End end = End::Diverged;
  // what gravity bends further than its springs alone tell overshoots: then on shorter ways
  for (const double share : {1.0, 0.5, 0.2, 0.05}) {
    share_ = share;
    if (share < 1) begin_again();
    end = search(good_enough, message);
    if (end != End::Diverged) break;
  }
  if (end == End::Found || end == End::Mechanism) return end == End::Found;
  const bool has_limits = std::any_of(s_.model.elements.begin(), s_.model.elements.end(),
                                      [](const ZoneElement& e) { return !e.stations.empty(); }) ||
                          !s_.model.rotational_elements.empty();
  // by that stiffness joints on short levers close slowly
  if (end == End::None && !s_.joints.empty() && (is_balanced_ || !has_limits)) {
    const bool was_balanced = is_balanced_;
    const int iterations = s_.summary.equilibrium_iterations;
    const double residual = s_.summary.equilibrium_residual, first = penalty_;
    std::string other;
    share_ = 1;
    for (const double stiffer : {1e2, 1e4, 1e6}) {
      penalty_ = stiffer * first;
      begin_again();
      if (search(good_enough, other) == End::Found) return true;
    }
    // constraints that all but repeat others need not close: the run lets go of them
    penalty_ = first, hold_ = 0;
    if (was_balanced) {
      begin_again();
      if (search(good_enough, other) == End::Found) {
        note_open_joint();
        return true;
      }
    }
    s_.summary.equilibrium_iterations = iterations;
    s_.summary.equilibrium_residual = residual;
  }
  // what turns far, where nothing has limits: on short turns
  if (!has_limits) {
    most_turn_ = 0.2;
    for (const bool hangs : {true, false})
      for (const double share : {1.0, 0.3, 0.1, 0.03}) {
        share_ = share, hangs_ = hangs;
        begin_again();
        end = search(good_enough, message);
        if (end == End::Found) return true;
      }
  }
  const auto cracks = [](const auto& x) {
    return x.zone.cracking[0].flexibility > 0 || x.zone.cracking[1].flexibility > 0;
  };
  if (std::any_of(s_.elements.begin(), s_.elements.end(), cracks) ||
      std::any_of(s_.rotationals.begin(), s_.rotationals.end(), cracks)) {
    begin_again();
    find_cracked_loads(good_enough);
  }
  s_.summary.overloads = overloads_;
  message += tell_most_loaded();
  return false;
}

void DeadLoad::find_cracked_loads(double good_enough) {
  const int iterations = s_.summary.equilibrium_iterations;
  const double residual = s_.summary.equilibrium_residual;
  CompiledLaws other;
  const auto endless = SharedLaw().compile();
  for (size_t i = 0; i < s_.laws.size(); ++i) other.push_back(endless);
  std::swap(s_.laws, other);
  share_ = 1;
  measures_loads_ = true;
  std::string message;
  const bool is_found = search(good_enough, message) == End::Found;
  std::swap(s_.laws, other);
  if (is_found) find_most_loaded();
  s_.summary.equilibrium_iterations = iterations;
  s_.summary.equilibrium_residual = residual;
}

void DeadLoad::note_open_joint() {
  s_.summary.notes.push_back(fmt::format(
      "the equilibrium leaves a gap of {:.2g} m or rad in joint \"{}\", which the first step closes: it is that "
      "of constraints that all but repeat others, or of a joint on so short a lever that the forces that the "
      "run begins with are wrong",
      widest_, s_.model.joints[most_open_].name.substr(0, 60)));
}

DeadLoad::End DeadLoad::search(double good_enough, std::string& message) {
  is_balanced_ = false;
  // first without limits, so that an overloaded element can be named; then with them
  s_.ignores_limits = !measures_loads_;
  constexpr int most = 400;
  constexpr int fresh = 12;  // most iterations with a stiffness of their own; then the last one serves
  constexpr int fresh_by_cracks = 60;
  constexpr int patience = 8;            // slow rounds before the stiffness stays and steps are accelerated
  constexpr int most_accelerated = 400;  // then on as before, from where that began
  constexpr double thrown = 1e3;  // of the weight is unbalanced: a pivot that vanishes there tells of no mechanism
  constexpr double quick = 0.03;  // of the unbalanced force is left after an iteration with a stiffness that still fits
  int idle = 0, factorised = 0, secants = 0, slow = 0;
  bool by_tangents = false;
  double best = 1e300, last_unbalanced = 0, last_finite = 0;
  bool has_diverged = false;
  enum class Steps { Plain, Accelerated, PlainAgain } steps = Steps::Plain;
  int accelerated = 0;
  Place slow_place;
  for (int round = 0, all = 0;; ++all) {
    make_virgin();
    find_unbalanced();
    s_.summary.equilibrium_iterations = all;
    s_.summary.equilibrium_residual = unbalanced_;
    if (std::isfinite(unbalanced_)) {
      last_finite = unbalanced_;
    } else if (steps != Steps::Accelerated) {
      s_.summary.equilibrium_residual = unbalanced_ = last_finite;
      has_diverged = true;
      break;
    }
    if (s_.ignores_limits && ((unbalanced_ < 1e-6 && gap_left_ < 1e-6 * length_) || round == most / 2)) {
      find_most_loaded();
      s_.ignores_limits = false;
      steps = Steps::Plain;
      slow = accelerated = 0, acceleration_ = {};
      ++round;
      continue;
    }
    if (measures_loads_ && unbalanced_ < 1e-6 && gap_left_ < 1e-6 * length_) return End::Found;
    is_balanced_ = is_balanced_ || (!s_.ignores_limits && unbalanced_ < good_enough && calc_left() >= good_enough);
    if (!s_.ignores_limits && unbalanced_ < 1e-11 && gap_left_ < 1e-11 * length_) break;
    // round-off ends the improvement of very stiff models earlier
    const double left = calc_left();
    idle = left < 0.5 * best ? 0 : idle + 1;
    best = std::min(best, left);
    if (round == most || (idle > 2 && left < good_enough)) break;
    if (steps == Steps::Accelerated) {
      if (++accelerated < most_accelerated && (std::isfinite(unbalanced_) || !acceleration_.is_plain())) {
        move_accelerated();
        continue;
      }
      go_back(slow_place);
      steps = Steps::PlainAgain;
      continue;
    }
    if (unbalanced_ > 0.5 * last_unbalanced) {
      ++slow;
      if (by_tangents) secants = 4;
    }
    if (steps == Steps::Plain && slow == patience) {
      steps = Steps::Accelerated;
      slow_place = find_place();
    }
    by_tangents = secants == 0 && steps != Steps::Accelerated;
    find_cracks(by_tangents);
    secants = std::max(0, secants - 1);
    s_.state.element = virgin_;
    if (factorised == 0 || steps == Steps::Accelerated ||
        (factorised < (has_cracks_ ? fresh_by_cracks : fresh) && unbalanced_ > good_enough &&
         unbalanced_ > quick * last_unbalanced)) {
      ++factorised;
      if (!factorise(message)) {
        if (unbalanced_ <= thrown) return End::Mechanism;
        message = describe_failure(true);
        return End::Diverged;
      }
    }
    last_unbalanced = unbalanced_;
    if (steps == Steps::Accelerated) {
      move_accelerated();
    } else {
      Vector way = share_ * factor_->solve(pushed_);
      shorten(way);
      move(way);
    }
    ++round;
  }
  if (!has_diverged && calc_left() < good_enough) return End::Found;
  constexpr double boundless = 1e6;
  has_diverged = has_diverged || !(unbalanced_ < boundless);
  message = describe_failure(has_diverged);
  return has_diverged ? End::Diverged : End::None;
}

}  // namespace

bool System::find_equilibrium(std::string& message) {
  DeadLoad load(*this);
  if (!load.is_needed()) return true;
  const auto report = std::exchange(options.on_happening, nullptr);
  const auto put_at_rest = [this](bool held) {
    for (CompiledElement& e : elements) e.zone.is_at_rest = held;
    for (CompiledRotational& r : rotationals) r.zone.is_at_rest = held;
  };
  put_at_rest(true);
  const bool is_found = load.find(message) && !find_overload(message);
  put_at_rest(false);
  options.on_happening = report;
  ignores_limits = false;
  if (!is_found) return false;
  for (auto* list : {&state.element, &state.rotational})
    for (ZoneState& z : *list) z.plastic = z.damping = 0;
  for (size_t b = 0; b < B; ++b) state.v[b] = state.w[b] = state.L[b] = {};
  return true;
}

}  // namespace topple::mbs
