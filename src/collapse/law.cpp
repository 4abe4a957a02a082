#include "collapse/law.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/error.h"
#include "base/parallel.h"
#include "base/unit.h"

namespace topple::collapse {

namespace {

/// Limit moment and plastic elongation against plastic rotation at one normal force.
struct Row {
  std::vector<double> rotation, moment, elongation;
  double largest() const { return *std::max_element(moment.begin(), moment.end()); }
};

/// Values of a row at rotations that are asked for in rising order, constant beyond its ends.
class Reader {
 public:
  explicit Reader(const Row& row, std::vector<double> Row::*values = &Row::moment)
      : Reader(row.rotation, row.*values) {}
  Reader(const std::vector<double>& rotation, const std::vector<double>& values) : x_(rotation), m_(values) {}
  double operator()(double phi) {
    while (i_ < x_.size() && x_[i_] < phi) ++i_;
    if (phi <= x_.front()) return m_.front();
    if (i_ >= x_.size()) return m_.back();
    const double s = (phi - x_[i_ - 1]) / (x_[i_] - x_[i_ - 1]);
    return m_[i_ - 1] + s * (m_[i_] - m_[i_ - 1]);
  }
  /// The row's own rotation that follows the one asked for last, infinite behind its end.
  double find_next(double phi) const {
    size_t i = i_;
    while (i < x_.size() && x_[i] <= phi) ++i;
    return i < x_.size() ? x_[i] : std::numeric_limits<double>::infinity();
  }

 private:
  const std::vector<double>&x_, &m_;
  size_t i_ = 0;
};

/// Values of a row at rotations that rise.
std::vector<double> sample(const Row& row, const std::vector<double>& rotation, std::vector<double> Row::*values) {
  std::vector<double> out;
  out.reserve(rotation.size());
  Reader at(row, values);
  for (const double phi : rotation) out.push_back(at(phi));
  return out;
}

/// Moment of a row, constant beyond its ends.
///   above  its first rotation that is not below
double calc_moment(const Row& row, double phi, size_t above) {
  const std::vector<double>&x = row.rotation, &m = row.moment;
  if (phi <= x.front()) return m.front();
  if (above == x.size()) return m.back();
  return m[above - 1] + (phi - x[above - 1]) / (x[above] - x[above - 1]) * (m[above] - m[above - 1]);
}

/// All rotations of some rows below `last`, rising, and `last`.
std::vector<double> merge_rotations(const std::vector<const Row*>& rows, double last) {
  std::vector<double> all{0};
  for (const Row* r : rows)
    for (const double x : r->rotation)
      if (x < last) all.push_back(x);
  std::sort(all.begin(), all.end());
  const double close = 1e-6 * last;
  all.erase(std::unique(all.begin(), all.end(), [close](double a, double b) { return b - a < close; }), all.end());
  if (last - all.back() < close && all.size() > 1) all.pop_back();
  all.push_back(last);
  return all;
}

/// The two forces of a family beside a normal force, and values between them.
class BetweenForces {
 public:
  BetweenForces(const nearfield::MomentFamily& family, double N) {
    const std::vector<double>& forces = family.normal_force;
    const auto above = std::upper_bound(forces.begin(), forces.end(), N);
    k_ = std::clamp<size_t>(static_cast<size_t>(above - forces.begin()), 1, forces.size() - 1);
    share_ = (N - forces[k_ - 1]) / (forces[k_] - forces[k_ - 1]);
  }
  /// Of rows of J values the j-th.
  double mix(const std::vector<double>& v, size_t J = 1, size_t j = 0) const {
    const double below = v[(k_ - 1) * J + j], above = v[k_ * J + j];
    return share_ <= 0 ? below : share_ >= 1 ? above : (1 - share_) * below + share_ * above;
  }

 private:
  size_t k_;
  double share_;
};

/// The row of a family at a normal force with the rotation of the element's spring taken out: what is left adds up with
/// the element to the family again. Plastic rotation that begins at first yield at the earliest: where the row is
/// softer than the element, it turns under the yield moment to where the row yields.
Row make_row(const nearfield::MomentFamily& family, double N, double EI, double length, PlasticFrom from) {
  const size_t J = family.rotation.size();
  const BetweenForces at(family, N);
  std::vector<double> M(J);
  for (size_t j = 0; j < J; ++j) M[j] = at.mix(family.moment, J, j);
  const double yield_moment = at.mix(family.yield_moment), yield_rotation = at.mix(family.yield_rotation);
  const double stiffness = EI / length, plastic_at_yield = yield_rotation - yield_moment / stiffness;
  const auto plastic = [&](size_t j) { return family.rotation[j] - M[j] / stiffness; };
  std::vector<double> u(J, 0.0);
  if (!family.elongation.empty())
    for (size_t j = 0; j < J; ++j) u[j] = at.mix(family.elongation, J, j);
  const auto elongation_at = [&](double rotation) { return Reader(family.rotation, u)(rotation); };
  Row row;
  const auto add = [&row](double rotation, double moment, double elongation) {
    if (!row.rotation.empty() && !(rotation > row.rotation.back() + 1e-9)) return;
    row.rotation.push_back(rotation);
    row.moment.push_back(moment);
    row.elongation.push_back(elongation);
  };
  double u_begin = 0;  // where plastic rotation begins
  size_t last_elastic = 0;
  for (size_t j = 1; j < J; ++j)
    if (plastic(j) <= 0) last_elastic = j;
  if (from == PlasticFrom::Yield && plastic_at_yield > 0 && yield_moment > 0) {
    u_begin = elongation_at(yield_moment / stiffness);
    add(0, yield_moment, 0);
    add(plastic_at_yield, yield_moment, elongation_at(yield_rotation) - u_begin);
    while (last_elastic + 1 < J && family.rotation[last_elastic + 1] <= yield_rotation) ++last_elastic;
  } else {
    double start = M[last_elastic];
    if (last_elastic + 1 < J) {
      const double p0 = plastic(last_elastic), p1 = plastic(last_elastic + 1);
      if (p0 < 0 && p1 > 0) start += (M[last_elastic + 1] - M[last_elastic]) * -p0 / (p1 - p0);
    }
    // a limit of nothing would be a zone that no longer carries its normal force
    if (start <= 0 && J > 1) start = M[1];
    u_begin = elongation_at(start / stiffness);
    add(0, from == PlasticFrom::Yield ? std::max(start, yield_moment) : start, 0);
  }
  for (size_t j = last_elastic + 1; j < J; ++j) add(plastic(j), M[j], u[j] - u_begin);
  return row;
}

/// Rows at the forces of a family, and between them wherever the mean of two neighbours departs by more than
/// `tolerance` of the largest moment from the row between them: the family's curves are mixed at equal rotation, the
/// law's at equal plastic rotation.
std::map<double, Row> make_rows(const nearfield::MomentFamily& family, double EI, double length, PlasticFrom begin,
                                double tolerance) {
  std::map<double, Row> rows;
  for (const double N : family.normal_force) rows.emplace(N, make_row(family, N, EI, length, begin));
  const auto departs = [tolerance](const Row& a, const Row& b, const Row& middle) {
    const double most = tolerance * middle.largest();
    Reader from(a), to(b), at(middle);
    // all three are straight between their own rotations
    for (double phi = 0; std::isfinite(phi);
         phi = std::min({from.find_next(phi), to.find_next(phi), at.find_next(phi)}))
      if (std::abs(0.5 * (from(phi) + to(phi)) - at(phi)) > most) return true;
    return false;
  };
  const auto refine = [&](const auto& self, double from, double to, int depth) -> void {
    if (depth == 0) return;
    const double N = 0.5 * (from + to);
    Row middle = make_row(family, N, EI, length, begin);
    if (!departs(rows.at(from), rows.at(to), middle)) return;
    rows.emplace(N, std::move(middle));
    self(self, from, N, depth - 1);
    self(self, N, to, depth - 1);
  };
  // Not beside the first and the last row, which have no moment.
  for (size_t k = 2; k + 1 < family.normal_force.size(); ++k)
    refine(refine, family.normal_force[k - 1], family.normal_force[k], 2);
  return rows;
}

/// Values at a normal force between rows, at rotations that rise; 0 outside.
std::vector<double> sample(const std::map<double, Row>& rows, double N, const std::vector<double>& rotation,
                           std::vector<double> Row::*values) {
  if (N < rows.begin()->first || N > rows.rbegin()->first) return std::vector<double>(rotation.size(), 0.0);
  const auto above = rows.lower_bound(N);
  std::vector<double> out = sample(above->second, rotation, values);
  if (above->first == N) return out;
  const auto below = std::prev(above);
  const double s = (N - below->first) / (above->first - below->first);
  const std::vector<double> other = sample(below->second, rotation, values);
  for (size_t j = 0; j < out.size(); ++j) out[j] = (1 - s) * other[j] + s * out[j];
  return out;
}

/// Rotations between which no row departs from its chord by more than `tolerance` of its largest moment, from 0 to
/// `last`: every interval is cut where a row departs most (Ramer, Douglas & Peucker, all rows at once).
std::vector<double> find_rotations(const std::vector<const Row*>& rows, double last, double tolerance) {
  const std::vector<double> all = merge_rotations(rows, last);
  // Rows as shares of their largest moment. Between its own rotations a row is straight, so it departs most from a
  // chord beside one of them.
  struct Bend {
    size_t at;  // into all rotations
    size_t row;
    double share;
  };
  struct Shares {
    const Row* row;
    double most;
  };
  std::vector<Shares> shares;
  std::vector<Bend> found;
  for (const Row* r : rows) {
    const double most = r->largest();
    if (!(most > 0)) continue;
    shares.push_back({r, most});
    Reader at(*r);
    size_t j = 0, next = 0;
    for (const double x : r->rotation) {
      while (j + 1 < all.size() && all[j] < x) ++j;
      for (size_t i = std::max(next, all[j] == x || j == 0 ? j : j - 1); i <= j; next = ++i)
        found.push_back({i, shares.size() - 1, at(all[i]) / most});
    }
  }
  // by rotation, so that those of an interval lie side by side
  std::vector<size_t> first_bend(all.size() + 1, 0);
  for (const Bend& bend : found) ++first_bend[bend.at + 1];
  for (size_t i = 0; i < all.size(); ++i) first_bend[i + 1] += first_bend[i];
  std::vector<Bend> bends(found.size());
  std::vector<size_t> place(first_bend.begin(), first_bend.end() - 1);
  for (const Bend& bend : found) bends[place[bend.at]++] = bend;
  // points that are kept, with the shares of all rows there and each row's first rotation that is not below
  struct Point {
    size_t at;
    std::vector<double> share;
    std::vector<size_t> above;
  };
  std::vector<Point> points;
  const auto keep = [&](size_t at, const Point* begin, const Point* end) {
    Point to{at, std::vector<double>(shares.size()), std::vector<size_t>(shares.size())};
    for (size_t r = 0; r < shares.size(); ++r) {
      const std::vector<double>& x = shares[r].row->rotation;
      const auto from = x.begin() + static_cast<std::ptrdiff_t>(begin ? begin->above[r] : 0);
      const auto until = end ? x.begin() + static_cast<std::ptrdiff_t>(end->above[r]) : x.end();
      to.above[r] = static_cast<size_t>(std::lower_bound(from, until, all[at]) - x.begin());
      to.share[r] = calc_moment(*shares[r].row, all[at], to.above[r]) / shares[r].most;
    }
    points.push_back(std::move(to));
    return points.size() - 1;
  };
  const size_t first = keep(0, nullptr, nullptr), last_point = keep(all.size() - 1, nullptr, nullptr);
  std::vector<std::pair<size_t, size_t>> open{{first, last_point}};
  std::vector<double> slope(shares.size());
  while (!open.empty()) {
    const auto [begin, end] = open.back();
    open.pop_back();
    const Point &from = points[begin], &to = points[end];
    const size_t a = from.at, b = to.at;
    for (size_t r = 0; r < shares.size(); ++r) slope[r] = (to.share[r] - from.share[r]) / (all[b] - all[a]);
    double worst = tolerance;
    size_t where = 0, of = 0;
    for (size_t i = first_bend[a + 1]; i < first_bend[b]; ++i) {
      const Bend& bend = bends[i];
      const double off = std::abs(bend.share - from.share[bend.row] - slope[bend.row] * (all[bend.at] - all[a]));
      // of equal ones that of the first row
      if (off > worst || (off == worst && bend.row < of)) worst = off, where = bend.at, of = bend.row;
    }
    if (where == 0) continue;
    const size_t middle = keep(where, &from, &to);
    open.emplace_back(begin, middle);
    open.emplace_back(middle, end);
  }
  std::vector<double> out;
  for (const Point& p : points) out.push_back(all[p.at]);
  std::sort(out.begin(), out.end());
  return out;
}

/// Rows of both directions on one grid of forces and one of rotations, up to the largest one.
mbs::MomentFamily make_family(const nearfield::MomentFamily& positive, const nearfield::MomentFamily& negative,
                              double EI, double length, double largest, PlasticFrom begin) {
  // Of a row's largest moment, between rotations and between forces.
  constexpr double between_rotations = 0.0075, between_forces = 0.015;
  const bool same = positive.moment == negative.moment && positive.normal_force == negative.normal_force;
  const std::map<double, Row> pos = make_rows(positive, EI, length, begin, between_forces);
  const std::map<double, Row> other =
      same ? std::map<double, Row>() : make_rows(negative, EI, length, begin, between_forces);
  const std::map<double, Row>& neg = same ? pos : other;
  mbs::MomentFamily out;
  std::vector<const Row*> rows;
  double end = 0;
  for (const auto* some : {&pos, &other}) {
    for (const auto& [N, row] : *some) {
      rows.push_back(&row);
      end = std::max(end, row.rotation.back());
      out.normal_force.push_back(N);
    }
  }
  out.plastic_rotation = find_rotations(rows, std::clamp(end, 1e-3, largest), between_rotations);
  std::sort(out.normal_force.begin(), out.normal_force.end());
  const double span = out.normal_force.back() - out.normal_force.front();
  out.normal_force.erase(std::unique(out.normal_force.begin(), out.normal_force.end(),
                                     [span](double a, double b) { return b - a < 1e-9 * span; }),
                         out.normal_force.end());
  const size_t values = out.normal_force.size() * out.plastic_rotation.size();
  const auto append = [values](std::vector<double>& to, const std::vector<double>& from) {
    to.reserve(values);
    for (const double m : from) to.push_back(std::max(0.0, m));
  };
  const bool elongates = !positive.elongation.empty() && !negative.elongation.empty();
  const auto append_elongation = [&](std::vector<double>& to, const std::map<double, Row>& from, double N) {
    const std::vector<double> u = sample(from, N, out.plastic_rotation, &Row::elongation);
    to.reserve(values);
    to.insert(to.end(), u.begin(), u.end());
  };
  for (const double N : out.normal_force) {
    append(out.positive, sample(pos, N, out.plastic_rotation, &Row::moment));
    if (!same) append(out.negative, sample(neg, N, out.plastic_rotation, &Row::moment));
    if (elongates) append_elongation(out.elongation_positive, pos, N);
    if (elongates && !same) append_elongation(out.elongation_negative, neg, N);
  }
  if (same) out.negative = out.positive, out.elongation_negative = out.elongation_positive;
  return out;
}

mbs::Curve make_curve(const nearfield::AxialCurve& from) {
  mbs::Curve out;
  for (size_t i = 0; i < from.displacement.size(); ++i) {
    const double x = i == 0 ? 0 : from.displacement[i];
    if (i > 0 && !(x > out.x.back())) continue;
    out.x.push_back(x);
    out.f.push_back(std::max(0.0, from.force[i]));
  }
  return out;
}

constexpr double kMeets = 1e-3;  // of a weak length, over which both its ends come to bear

/// Continues a zone's curve behind its length with the mean force of being crushed, for what is crushed then is the
/// next zone of the member.
void append_mean_force(double length, mbs::Curve& c) {
  constexpr double rise = 0.05;  // of the length, from what is left of one zone to the mean of the others
  double work = 0;
  for (size_t i = 0; i + 1 < c.x.size(); ++i) work += 0.5 * (c.f[i] + c.f[i + 1]) * (c.x[i + 1] - c.x[i]);
  const double span = c.x.back();
  if (!(span > 0 && span <= length)) return;
  c.x.push_back((1 + rise) * length);
  c.f.push_back(work / span);
}

/// Constant moments between a compressive and a tensile capacity, falling to nothing at both.
mbs::MomentFamily make_flat_family(double compression, double tension, double positive, double negative, double last) {
  mbs::MomentFamily out;
  const double scale = std::max({compression, tension, 1.0});
  out.normal_force = {-std::max(compression, 1e-6 * scale), 0, std::max(tension, 1e-6 * scale)};
  out.plastic_rotation = {0, last};
  out.positive = {0, 0, positive, positive, 0, 0};
  out.negative = {0, 0, negative, negative, 0, 0};
  return out;
}

}  // namespace

double calc_zone_length(const product::Section& section, const product::Concrete& concrete, const product::Steel& steel,
                        double depth, double clear_length, const Knowledge& k) {
  double diameter = 0;
  for (const product::Bar& bar : section.bars) diameter = std::max(diameter, bar.diameter);
  const double wanted =
      std::max(k.zone_length_by_depth * depth,
               k.zone_length_by_span * 0.5 * clear_length + k.zone_length_by_bar * (steel.fy / unit::MPa) * diameter);
  // a zone that is longer than this would release more than the crushing energy at once
  const double longest = nearfield::kLongestZoneShare * nearfield::calc_largest_zone_length(concrete);
  return std::min({wanted, k.zone_length_at_most * clear_length, longest});
}

void append_bytes(std::string& to, double v) {
  char bytes[sizeof v];
  std::memcpy(bytes, &v, sizeof v);
  to.append(bytes, sizeof v);
}

double calc_flange_breadth(double half_gap, double span) {
  const double zero_moments = 0.7 * span;
  return std::min({0.2 * half_gap + 0.1 * zero_moments, 0.2 * zero_moments, half_gap});
}

int ZoneLibrary::request(const nearfield::ZoneInput& in) {
  std::string key;
  const auto put = [&key](double v) { append_bytes(key, v); };
  const product::Section& s = in.section;
  for (double v : {s.width, s.height, s.cover, s.tie_diameter, s.tie_spacing}) put(v);
  put(s.tie_legs_y), put(s.tie_legs_z);
  put(static_cast<double>(s.bars.size()));
  for (const product::Bar& b : s.bars) put(b.y), put(b.z), put(b.area), put(b.diameter);
  const product::Concrete& c = in.concrete;
  for (double v : {c.fc, c.fct, c.Ec, c.eps_c1, c.Gf, c.Gcl}) put(v);
  for (double v : {in.steel.fy, in.steel.fu, in.steel.Es, in.steel.eps_u}) put(v);
  const nearfield::Flange& flange = in.flange;
  put(flange.breadth);
  if (flange.breadth > 0)
    for (double v : {flange.thickness, flange.top.depth, flange.top.area, flange.bottom.depth, flange.bottom.area,
                     flange.steel.fy, flange.steel.fu, flange.steel.Es, flange.steel.eps_u})
      put(v);
  for (double v : {in.length, in.cut_bars, in.cut_concrete, in.concrete_loss, in.free_bars}) put(v);
  key += in.cover_lost ? 'c' : '-';
  const auto [found, is_new] = numbers_.emplace(std::move(key), static_cast<int>(inputs_.size()));
  if (is_new) {
    inputs_.push_back(in);
    keys_.push_back(&found->first);
  }
  return found->second;
}

void ZoneLibrary::compute(int threads) {
  const size_t done = rccs_.size();
  rccs_.resize(inputs_.size());
  const bool finished = parallel_for(inputs_.size() - done, threads, [&](size_t i) {
    const size_t zone = done + i;
    if (known_)
      if (const auto found = known_->zones.find(*keys_[zone]); found != known_->zones.end()) {
        rccs_[zone] = found->second;
        return;
      }
    rccs_[zone] = std::make_shared<const nearfield::Rcc>(nearfield::make_rcc(inputs_[zone]));
  });
  if (!finished) rccs_.resize(done);
}

void ZoneLibrary::collect(KnownCurves& to) const {
  for (size_t i = 0; i < rccs_.size(); ++i) to.zones.emplace(*keys_[i], rccs_[i]);
}

mbs::ZoneLaw make_zone_law(const nearfield::Rcc& rcc, double EI_y, double EI_z, const std::string& name,
                           const Knowledge& k, PlasticFrom begin, Bending bending) {
  mbs::ZoneLaw law;
  law.name = name;
  const auto is_same = [](const nearfield::MomentFamily& a, const nearfield::MomentFamily& b) {
    return a.normal_force == b.normal_force && a.rotation == b.rotation && a.moment == b.moment &&
           a.elongation == b.elongation && a.yield_rotation == b.yield_rotation && a.yield_moment == b.yield_moment;
  };
  if (bending != Bending::Z)
    law.moment_y = make_family(rcc.y_pos, rcc.y_neg, EI_y, rcc.length, k.zone_rupture_rotation, begin);
  if (bending == Bending::Both && EI_y == EI_z && is_same(rcc.y_pos, rcc.z_pos) && is_same(rcc.y_neg, rcc.z_neg))
    law.moment_z = law.moment_y;
  else if (bending != Bending::Y)
    law.moment_z = make_family(rcc.z_pos, rcc.z_neg, EI_z, rcc.length, k.zone_rupture_rotation, begin);
  const double share = k.zone_elongation_share;
  for (mbs::MomentFamily* f : {&law.moment_y, &law.moment_z})
    for (std::vector<double>* u : {&f->elongation_positive, &f->elongation_negative}) {
      if (share == 0) u->clear();
      for (double& v : *u) v *= share;
    }
  law.biaxial_exponent = k.zone_biaxial_exponent;
  if (rcc.EI_y > 0 && rcc.EI_z > 0) law.rotation_ratio = std::sqrt(rcc.EI_z / rcc.EI_y);  // of the radii of inertia
  law.damage_share = rcc.damage_share;
  // the last rotation of a family is where nothing of the moment is left
  for (const mbs::MomentFamily* f : {&law.moment_y, &law.moment_z})
    if (!f->plastic_rotation.empty())
      law.rupture_rotation = std::isfinite(law.rupture_rotation)
                                 ? std::max(law.rupture_rotation, f->plastic_rotation.back())
                                 : f->plastic_rotation.back();
  if (k.zone_rupture_rotation_pressed > k.zone_rupture_rotation)
    law.rupture_rotation_pressed = k.zone_rupture_rotation_pressed;
  law.compression = make_curve(rcc.compression);
  law.tension = make_curve(rcc.tension);
  law.crush_length = rcc.length;
  append_mean_force(rcc.length, law.compression);
  law.rupture_elongation = law.tension.x.back();
  law.shear_y = rcc.shear_y;
  law.shear_z = rcc.shear_z;
  law.shear_friction = rcc.shear_friction;
  law.slip_softening = k.zone_slip_softening;
  law.slip_rupture = k.zone_slip_rupture;
  law.torsion = rcc.torsion;
  law.twist_rupture = k.zone_twist_rupture;
  return law;
}

mbs::Cracking make_cracking(const nearfield::MomentFamily& positive, const nearfield::MomentFamily& negative,
                            double zone_length, double normal_force, double EI, double EI_at_yield, double length) {
  // a line from nothing would be no longer one of the uncracked section, and one up to first yield none of a cracked
  // one
  constexpr double least = 0.02, most = 0.98;
  mbs::Cracking out;
  if (!(EI > EI_at_yield)) return out;
  double share = 0;
  for (size_t side : {0UL, 1UL}) {
    const nearfield::MomentFamily& family = side == 0 ? positive : negative;
    const size_t J = family.rotation.size();
    const BetweenForces at(family, normal_force);
    std::vector<double> M(J);
    for (size_t j = 0; j < J; ++j) M[j] = at.mix(family.moment, J, j);
    Reader moment(family.rotation, M);
    const double M_y = at.mix(family.yield_moment), phi_y = at.mix(family.yield_rotation);
    double work = 0;  // of the section's curve up to first yield
    for (size_t j = 0; j + 1 < J && family.rotation[j] < phi_y; ++j) {
      const double end = std::min(family.rotation[j + 1], phi_y);
      work += 0.5 * (end - family.rotation[j]) * (M[j] + moment(end));
    }
    // an uncracked line and a straight one from there to first yield that take as much
    const double kink = phi_y - M_y * zone_length / EI;
    if (!(M_y > 0 && kink > 0)) return {};
    const double r = std::clamp((2 * work / M_y - phi_y) / kink, least, most);
    // along the member, whose moment falls linearly to its point of inflection
    out.begin[side] = 3 * r / (2 + r) * M_y;
    out.end[side] = M_y;
    share += 0.5 * (1 - r) * (1 + 0.5 * r);
  }
  out.flexibility = share * length * (1 / EI_at_yield - 1 / EI);
  return out;
}

double calc_crack_rotation(const mbs::Cracking& c, double moment) {
  if (c.flexibility == 0) return 0;
  if (moment >= c.end[0]) return c.flexibility * moment;
  return mbs::calc_crack_rotation(c, 0, std::max(moment, c.begin[0]));
}

mbs::ZoneLaw make_partial_law(mbs::ZoneLaw weak, double length, double thickness, const mbs::ZoneLaw& beside) {
  weak.slip_rupture = std::max(weak.slip_rupture, thickness);
  mbs::Curve& c = weak.compression;
  // the mean force of what is crushed zone after zone holds as far as the length goes
  const auto after = static_cast<size_t>(std::lower_bound(c.x.begin(), c.x.end(), length) - c.x.begin());
  double last = c.f.back();
  if (after > 0 && after < c.x.size())
    last = std::lerp(c.f[after - 1], c.f[after], (length - c.x[after - 1]) / (c.x[after] - c.x[after - 1]));
  c.x.resize(after), c.f.resize(after);
  c.x.push_back(length), c.f.push_back(last);
  const double begin = (1 + kMeets) * length;
  for (size_t i = 0; i < beside.compression.x.size(); ++i) {
    c.x.push_back(begin + beside.compression.x[i]);
    c.f.push_back(beside.compression.f[i]);
  }
  weak.crush_length = length, weak.keeps_length = true;
  return weak;
}

mbs::ZoneLaw make_cage_law(const nearfield::ResidualCage& cage, double destroyed_length, const std::string& name,
                           const Knowledge& k) {
  mbs::ZoneLaw law;
  law.name = name;
  law.compression = make_curve(cage.compression);
  law.tension = make_curve(cage.tension);
  const double compression = law.compression.f.front();
  const double tension = *std::max_element(law.tension.f.begin(), law.tension.f.end());
  law.rupture_rotation = k.charge_cage_rupture_rotation;
  law.moment_y = make_flat_family(compression, tension, cage.moment_y, cage.moment_y, law.rupture_rotation);
  law.moment_z = make_flat_family(compression, tension, cage.moment_z, cage.moment_z, law.rupture_rotation);
  law.biaxial_exponent = k.zone_biaxial_exponent;
  law.buckles = true;
  law.crush_length = destroyed_length;
  law.rupture_elongation = law.tension.x.back();
  law.shear_y = law.shear_z = cage.shear;
  law.slip_rupture = destroyed_length;
  law.torsion = cage.shear * 0.5 * destroyed_length;
  law.twist_rupture = k.charge_cage_rupture_rotation;
  return law;
}

mbs::SharedLaw scale_lever(const mbs::SharedLaw& one, const Lever& lever) {
  if (lever == Lever{}) return one;
  mbs::ZoneLaw law = *one;
  for (const auto& [family, share] : {std::pair{&law.moment_y, lever.moment_y}, {&law.moment_z, lever.moment_z}}) {
    for (std::vector<double>* moments : {&family->positive, &family->negative})
      for (double& m : *moments) m *= share;
    for (double& phi : family->plastic_rotation) phi /= lever.rotation;
  }
  law.rupture_rotation /= lever.rotation, law.rupture_rotation_pressed /= lever.rotation;
  return law;
}

mbs::Cracking scale_lever(mbs::Cracking c, double moment, double rotation) {
  for (int side : {0, 1}) c.begin[side] *= moment, c.end[side] *= moment;
  c.flexibility /= moment * rotation;
  return c;
}

mbs::ZoneLaw make_slab_law(const nearfield::PanelRcc& rcc, double width, double kept, const std::string& name,
                           const Knowledge& k) {
  mbs::ZoneLaw law;
  law.name = name;
  const double w = width * kept;
  const double compression = rcc.compression * w, tension = rcc.tension * w;
  const double last = std::max(rcc.ultimate_rotation, 1e-6);
  // a positive moment about y pulls at the top
  law.moment_y = make_flat_family(compression, tension, rcc.moment_neg * w, rcc.moment_pos * w, last);
  law.moment_z = make_flat_family(compression, tension, 0.25 * tension * width, 0.25 * tension * width, last);
  law.biaxial_exponent = k.zone_biaxial_exponent;
  law.rupture_rotation = last;
  const double torn = std::max(rcc.elongation_at_rupture * k.slab_elongation_lengths, 1e-6);
  law.tension = {{0, torn}, {tension, tension}};
  law.rupture_elongation = torn;
  law.compression = {{0, 1}, {compression, compression}};
  law.shear_y = rcc.shear_in_plane * w;
  law.shear_z = rcc.shear_out_of_plane * w;
  law.slip_softening = k.zone_slip_softening;
  law.slip_rupture = k.zone_slip_rupture;
  // a line in torsion yields with both faces at once
  law.torsion = (rcc.moment_pos + rcc.moment_neg) * w;
  law.twist_rupture = k.zone_twist_rupture;
  return law;
}

mbs::ZoneLaw make_wall_law(const nearfield::PanelRcc& rcc, double width, double height, double kept,
                           const std::string& name, const Knowledge& k) {
  mbs::ZoneLaw law;
  law.name = name;
  const double w = width * kept;
  const double compression = rcc.compression * w, tension = rcc.tension * w;
  const double last = std::max(rcc.ultimate_rotation, 1e-6);
  const double across = std::max(rcc.moment_pos, rcc.moment_neg) * w;
  law.moment_y = make_flat_family(compression, tension, across, across, last);
  law.moment_z = make_flat_family(compression, tension, 0.25 * tension * width, 0.25 * tension * width, last);
  law.biaxial_exponent = k.zone_biaxial_exponent;
  law.rupture_rotation = std::max(last, k.zone_slip_rupture / height);
  const double torn = std::max(rcc.elongation_at_rupture * k.slab_elongation_lengths, 1e-6);
  law.tension = {{0, torn}, {tension, tension}};
  law.rupture_elongation = torn;
  law.compression = {{0, 1}, {compression, compression}};
  law.crush_length = k.wall_crush_share * height;
  law.shear_y = rcc.shear_in_plane * w;
  law.shear_z = rcc.shear_out_of_plane * w;
  law.slip_softening = k.zone_slip_softening;
  law.slip_rupture = k.zone_slip_rupture;
  law.twist_rupture = k.zone_twist_rupture;
  return law;
}

}  // namespace topple::collapse
