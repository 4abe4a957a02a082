#include "nearfield/column.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/unit.h"
#include "nearfield/zone.h"

namespace topple::nearfield {

namespace {

/// Curvature of the sections above the hinge: the march up to first yield, then along the secant of first yield. What
/// goes beyond stands for itself in the hinge.
class ElasticBranch {
 public:
  ElasticBranch(const March& march, const std::vector<double>& kappa) {
    for (size_t j = 0; j < kappa.size() && static_cast<int>(j) <= march.last; ++j) {
      if (j > 0 && (kappa[j] >= march.yield_kappa || march.moment[j] <= moment_.back())) break;
      moment_.push_back(march.moment[j]), kappa_.push_back(kappa[j]);
    }
    if (march.yield_moment > moment_.back()) moment_.push_back(march.yield_moment), kappa_.push_back(march.yield_kappa);
    flexibility_ = kappa_.back() / moment_.back();
  }
  double calc_kappa(double M) const {
    const double m = std::abs(M);
    double k = m * flexibility_;
    if (m < moment_.back()) {
      const size_t i = static_cast<size_t>(std::upper_bound(moment_.begin(), moment_.end(), m) - moment_.begin());
      k = kappa_[i - 1] + (kappa_[i] - kappa_[i - 1]) * (m - moment_[i - 1]) / (moment_[i] - moment_[i - 1]);
    }
    return std::copysign(k, M);
  }
  double flexibility() const { return flexibility_; }

 private:
  std::vector<double> moment_, kappa_;
  double flexibility_ = 0;
};

double find_thickest_bar(const ZoneInput& in) {
  double most = 0;
  for (const product::Bar& b : in.section.bars) most = std::max(most, b.diameter);
  return most;
}

/// Sezen & Moehle 2004, docs/theory/rcc.md (30); ductility is displacement over that at first yield.
double calc_shear_limit(const ColumnInput& in, double ductility) {
  const product::Section& s = in.zone.section;
  const double depth = in.axis == Axis::Y ? s.height : s.width;
  const int legs = in.axis == Axis::Y ? s.tie_legs_z : s.tie_legs_y;
  double d = 0;  // of the outermost bars
  for (const product::Bar& b : s.bars) d = std::max(d, 0.5 * depth + std::abs(in.axis == Axis::Y ? b.z : b.y));
  if (d <= 0) d = 0.8 * depth;
  const material::ConcreteInput c = make_concrete_input(in.zone);
  const double root = 0.5 * std::sqrt(c.fc / unit::MPa) * unit::MPa, area = (1 - in.zone.cut_concrete) * s.area();
  const double k = std::clamp(1.15 - 0.075 * ductility, 0.7, 1.0), slenderness = std::clamp(in.height / d, 2.0, 4.0);
  const bool tied = s.tie_diameter > 0 && s.tie_spacing > 0;
  const double leg = 0.25 * 3.14159265358979323846 * s.tie_diameter * s.tie_diameter;
  const double ties = tied ? legs * leg * in.zone.steel.fy * d / s.tie_spacing : 0;
  const double concrete = root / slenderness * std::sqrt(1 + in.compression / (root * area)) * 0.8 * area;
  return k * (ties + concrete);
}

void check_column(const ColumnInput& in) {
  const auto complain = [&](const std::string& what, const std::string& help = {}) {
    throw InputError("E615", "column of section '" + in.zone.section.name + "': " + what, help);
  };
  if (!(in.height > 0) || !std::isfinite(in.height)) complain("the height must be positive");
  if (!(in.compression >= 0) || !std::isfinite(in.compression))
    complain("the vertical load must not be negative", "compression is positive here");
  if (!(in.largest_drift > 0 && in.largest_drift <= 0.5)) complain("the largest drift must lie between 0 and 0.5");
  if (in.zone.length >= in.height) complain("the plastic hinge is longer than the column");
}

}  // namespace

double calc_hinge_length(const ZoneInput& in, double height) {
  return 0.08 * height + 0.022 * in.steel.fy / unit::MPa * find_thickest_bar(in);
}

ColumnEnvelope push_column(const ColumnInput& asked) {
  ColumnInput in = asked;
  if (!(in.zone.length > 0)) in.zone.length = calc_hinge_length(in.zone, in.height);
  check_column(in);
  check_zone(in.zone);
  const Fibres f = make_fibres(in.zone, in.axis);
  const double L = in.height, P = in.compression, hinge = in.zone.length;
  if (P >= find_crushing(f).force)
    throw InputError("E615",
                     "column of section '" + in.zone.section.name + "': the load exceeds what the section carries");

  // Curvatures up to where the hinge alone gives the largest drift.
  const double yield_strain = in.zone.steel.fy / in.zone.steel.Es;
  const double small = 0.01 * yield_strain / f.half_depth, large = 1.5 * in.largest_drift / hinge + 100 * small;
  std::vector<double> kappa{0};
  for (double k = small; k < large; k = std::max(1.03 * k, k + small)) kappa.push_back(k);
  const March march = march_curvature(f, -P, 1, kappa);
  ColumnEnvelope out;
  if (march.last < 1 || !(march.yield_moment > 0)) {
    out.ending = ColumnEnding::LostCompression;
    return out;
  }
  const ElasticBranch branch(march, kappa);

  // Shear stiffness falls with that of bending.
  const Rcc whole = make_rcc(in.zone);
  const double EI = in.axis == Axis::Y ? whole.EI_y : whole.EI_z;
  const double GA = whole.GA * std::min(1.0, 1 / (branch.flexibility() * EI));

  const double bar = find_thickest_bar(in.zone), bond = std::sqrt(in.zone.concrete.fc / unit::MPa) * unit::MPa;
  double outermost = 0;
  for (const double at : f.bar_at) outermost = std::max(outermost, at);

  constexpr int slices = 80;
  const double dx = L / slices;
  double yield_drift = 0, F = 0;
  for (int j = 1; j <= march.last; ++j) {
    const size_t i = static_cast<size_t>(j);
    const double M = march.moment[i];
    if (!(M > 0)) {
      out.ending = ColumnEnding::LostMoment;
      break;
    }
    ColumnPoint p;
    p.foot_moment = M, p.kappa = kappa[i];
    const double elastic = branch.calc_kappa(M), plastic = std::max(0.0, kappa[i] - elastic) * hinge;
    // Elastic slip of bars that hold in bond over f_s d_b / (4 u): θ = κ f_s d_b / (8 u).
    double slip = 0;
    if (in.bars_slip && outermost > 0) {
      const double strain = march.eps_0[i] + (march.origin + kappa[i]) * outermost;
      slip = elastic * std::clamp(in.zone.steel.Es * strain, 0.0, in.zone.steel.fy) * bar / (8 * bond);
    }
    // The deflection is integrated from the foot up; what the moment misses at the top by is linear in F but for
    // cracking.
    const auto deflect = [&](double push) {
      const double sliding = push / GA;
      double slope = slip, w = 0, k0 = branch.calc_kappa(M);
      for (int n = 1; n <= slices; ++n) {
        const double x = n * dx, turned = plastic * std::clamp((x - 0.5 * hinge) / dx, 0.0, 1.0);
        const double ahead = w + (slope + 0.5 * k0 * dx + turned + sliding) * dx;
        const double k1 = branch.calc_kappa(M - push * x - P * ahead);
        // trapezium of curvature, the plastic rotation in the hinge's middle
        w += (slope + (2 * k0 + k1) / 6 * dx + turned + sliding) * dx;
        slope += 0.5 * (k0 + k1) * dx, k0 = k1;
      }
      return w;
    };
    // Secants from the last force on.
    double w = deflect(F), miss = M - F * L - P * w, before = F, missed = miss;
    F += miss / L;
    bool settled = false;
    for (int iteration = 0; iteration < 60 && !settled; ++iteration) {
      w = deflect(F), miss = M - F * L - P * w;
      settled = std::abs(miss) <= 1e-9 * M;
      if (settled || miss == missed) break;
      const double next = F - miss * (F - before) / (miss - missed);
      before = F, missed = miss, F = next;
    }
    if (!settled) {
      out.converged = false;
      break;
    }
    p.drift = w / L, p.force = F;
    p.slip = slip * L, p.shear = p.force / GA * L;
    if (kappa[i] <= march.yield_kappa) yield_drift = p.drift;
    p.shear_limit = calc_shear_limit(in, yield_drift > 0 ? p.drift / yield_drift : 1);
    if (out.shear_from < 0 && p.force > p.shear_limit) out.shear_from = p.drift;
    out.largest_force = std::max(out.largest_force, p.force);
    if (out.points.empty() && !(p.force > 0 && p.drift > 0)) {
      out.ending = ColumnEnding::Buckles;
      break;
    }
    out.points.push_back(p);
    if (p.drift >= in.largest_drift) break;
    if (j == march.last && march.last + 1 < static_cast<int>(kappa.size())) out.ending = ColumnEnding::LostCompression;
  }
  out.yield_drift = yield_drift;
  return out;
}

double calc_force_at(const ColumnEnvelope& e, double drift) {
  double before = 0, force = 0;
  for (const ColumnPoint& p : e.points) {
    if (p.drift >= drift && p.drift > before) return force + (p.force - force) * (drift - before) / (p.drift - before);
    before = p.drift, force = p.force;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace topple::nearfield
