#include "collapse/law.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/error.h"
#include "base/parallel.h"
#include "base/unit.h"

namespace topple::collapse {

namespace {

/// Limit moment against plastic rotation at one normal force.
struct Row {
  std::vector<double> rotation, moment;
  double at(double phi) const {
    if (phi <= rotation.front()) return moment.front();
    if (phi >= rotation.back()) return moment.back();
    const size_t i = static_cast<size_t>(std::upper_bound(rotation.begin(), rotation.end(), phi) - rotation.begin());
    const double s = (phi - rotation[i - 1]) / (rotation[i] - rotation[i - 1]);
    return moment[i - 1] + s * (moment[i] - moment[i - 1]);
  }
};

/// One row of a family with the elastic rotation taken out. The elastic part is that of the member's element, or of the
/// row's own secant to first yield where that is softer, so that the plastic rotation begins at first yield.
Row make_row(const nearfield::MomentFamily& family, size_t k, double EI, double length) {
  const size_t J = family.rotation.size();
  const double* M = &family.moment[k * J];
  const double yield_moment = family.yield_moment[k], yield_rotation = family.yield_rotation[k];
  double stiffness = EI / length;
  if (yield_moment > 0 && yield_rotation > 0) stiffness = std::min(stiffness, yield_moment / yield_rotation);
  const auto plastic = [&](size_t j) { return family.rotation[j] - M[j] / stiffness; };
  size_t last_elastic = 0;
  for (size_t j = 1; j < J; ++j)
    if (plastic(j) <= 0) last_elastic = j;
  Row row;
  double start = M[last_elastic];
  if (last_elastic + 1 < J) {
    const double p0 = plastic(last_elastic), p1 = plastic(last_elastic + 1);
    if (p0 < 0 && p1 > 0) start += (M[last_elastic + 1] - M[last_elastic]) * -p0 / (p1 - p0);
  }
  row.rotation.push_back(0);
  row.moment.push_back(std::max(start, yield_moment));
  for (size_t j = last_elastic + 1; j < J; ++j) {
    const double p = plastic(j);
    if (p <= row.rotation.back() + 1e-9) continue;
    row.rotation.push_back(p);
    row.moment.push_back(M[j]);
  }
  return row;
}

/// Value at a normal force between rows; 0 outside.
double interpolate(const std::vector<double>& force, const std::vector<Row>& rows, double N, double phi) {
  if (N < force.front() || N > force.back()) return 0;
  const size_t k = std::clamp<size_t>(
      static_cast<size_t>(std::upper_bound(force.begin(), force.end(), N) - force.begin()), 1, force.size() - 1);
  const double s = (N - force[k - 1]) / (force[k] - force[k - 1]);
  return (1 - s) * rows[k - 1].at(phi) + s * rows[k].at(phi);
}

/// Rotation at which the last of the rows ends.
double find_end(const std::vector<Row>& positive, const std::vector<Row>& negative) {
  double end = 0;
  for (const auto* rows : {&positive, &negative})
    for (const Row& r : *rows) end = std::max(end, r.rotation.back());
  return end;
}

/// Rows of both directions on one grid of rotations up to the largest one, densest near yield.
mbs::MomentFamily make_family(const nearfield::MomentFamily& positive, const nearfield::MomentFamily& negative,
                              double EI, double length, double largest) {
  constexpr int points = 40;
  constexpr double ratio = 1.15;
  mbs::MomentFamily out;
  std::vector<Row> pos, neg;
  for (size_t k = 0; k < positive.normal_force.size(); ++k) pos.push_back(make_row(positive, k, EI, length));
  for (size_t k = 0; k < negative.normal_force.size(); ++k) neg.push_back(make_row(negative, k, EI, length));
  const double last = std::clamp(find_end(pos, neg), 1e-3, largest);
  for (int j = 0; j < points; ++j)
    out.plastic_rotation.push_back(last * (std::pow(ratio, j) - 1) / (std::pow(ratio, points - 1) - 1));
  out.normal_force = positive.normal_force;
  out.normal_force.insert(out.normal_force.end(), negative.normal_force.begin(), negative.normal_force.end());
  std::sort(out.normal_force.begin(), out.normal_force.end());
  const double span = out.normal_force.back() - out.normal_force.front();
  out.normal_force.erase(std::unique(out.normal_force.begin(), out.normal_force.end(),
                                     [span](double a, double b) { return b - a < 1e-9 * span; }),
                         out.normal_force.end());
  for (double N : out.normal_force)
    for (double phi : out.plastic_rotation) {
      out.positive.push_back(std::max(0.0, interpolate(positive.normal_force, pos, N, phi)));
      out.negative.push_back(std::max(0.0, interpolate(negative.normal_force, neg, N, phi)));
    }
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
  const double longest = 0.9 * nearfield::calc_largest_zone_length(concrete);
  return std::min({wanted, k.zone_length_at_most * clear_length, longest});
}

int ZoneLibrary::request(const nearfield::ZoneInput& in) {
  std::string key;
  const auto put = [&key](double v) {
    char text[32];
    std::snprintf(text, sizeof text, "%a,", v);
    key += text;
  };
  const product::Section& s = in.section;
  for (double v : {s.width, s.height, s.cover, s.tie_diameter, s.tie_spacing}) put(v);
  put(s.tie_legs_y), put(s.tie_legs_z);
  for (const product::Bar& b : s.bars) put(b.y), put(b.z), put(b.area), put(b.diameter);
  key += '|';
  const product::Concrete& c = in.concrete;
  for (double v : {c.fc, c.fct, c.Ec, c.eps_c1, c.Gf, c.Gcl}) put(v);
  for (double v : {in.steel.fy, in.steel.fu, in.steel.Es, in.steel.eps_u}) put(v);
  for (double v : {in.length, in.cut_bars, in.cut_concrete, in.concrete_loss}) put(v);
  key += in.cover_lost ? 'c' : '-';
  const auto [found, is_new] = known_.emplace(key, static_cast<int>(inputs_.size()));
  if (is_new) inputs_.push_back(in);
  return found->second;
}

void ZoneLibrary::compute(int threads) {
  const size_t done = rccs_.size();
  rccs_.resize(inputs_.size());
  const bool finished = parallel_for(inputs_.size() - done, threads,
                                     [&](size_t i) { rccs_[done + i] = nearfield::make_rcc(inputs_[done + i]); });
  if (!finished) rccs_.resize(done);
}

mbs::ZoneLaw make_zone_law(const nearfield::Rcc& rcc, double EI_y, double EI_z, const std::string& name,
                           const Knowledge& k) {
  mbs::ZoneLaw law;
  law.name = name;
  law.moment_y = make_family(rcc.y_pos, rcc.y_neg, EI_y, rcc.length, k.zone_rupture_rotation);
  law.moment_z = make_family(rcc.z_pos, rcc.z_neg, EI_z, rcc.length, k.zone_rupture_rotation);
  law.biaxial_exponent = k.zone_biaxial_exponent;
  law.damage_share = rcc.damage_share;
  // the last rotation of a family is where nothing of the moment is left
  law.rupture_rotation = std::max(law.moment_y.plastic_rotation.back(), law.moment_z.plastic_rotation.back());
  law.compression = make_curve(rcc.compression);
  law.tension = make_curve(rcc.tension);
  law.crush_length = rcc.length;
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
  law.crush_length = destroyed_length;
  law.rupture_elongation = law.tension.x.back();
  law.shear_y = law.shear_z = cage.shear;
  law.slip_rupture = destroyed_length;
  law.torsion = cage.shear * 0.5 * destroyed_length;
  law.twist_rupture = k.charge_cage_rupture_rotation;
  return law;
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
