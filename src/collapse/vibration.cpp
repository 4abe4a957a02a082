#include "collapse/vibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/interpolate.h"
#include "base/unit.h"

namespace topple::collapse {

namespace {

/// A row of the table: up to 10 Hz, at 50 Hz, at 100 Hz and above, linear between [mm/s].
struct Row {
  const char* name;
  int line;
  double low, middle, high;
};
Row row_of(product::BuildingClass c) {
  switch (c) {
    case product::BuildingClass::Commercial:
      return {"commercial and industrial buildings", 1, 20, 40, 50};
    case product::BuildingClass::Residential:
      return {"residential buildings", 2, 5, 15, 20};
    case product::BuildingClass::Sensitive:
      return {"buildings that are sensitive and worth preserving", 3, 3, 8, 10};
    case product::BuildingClass::Unknown:
      break;
  }
  return {"", 0, 0, 0, 0};
}

/// A box of a body's own material, no longer than kPieceLength, and the place of its middle.
struct Cell {
  size_t body = 0;
  double mass = 0;  // [kg]
  Pose X_BC;
  Vec3 half;
};

std::vector<Cell> make_cells(const record::Record& r, size_t bodies) {
  std::vector<Cell> out;
  for (size_t b = 0; b < bodies; ++b) {
    const record::BodyInfo& body = r.bodies[b];
    if (body.fixed) continue;
    double volume = 0;
    for (const record::BoxShape& s : body.shapes) volume += s.half.x * s.half.y * s.half.z;
    for (const record::BoxShape& s : body.shapes) {
      const double mass = body.mass * s.half.x * s.half.y * s.half.z / volume;
      int n[3];
      for (int c = 0; c < 3; ++c) n[c] = std::max(1, static_cast<int>(std::ceil(2 * s.half[c] / kPieceLength - 1e-9)));
      const Vec3 half{s.half.x / n[0], s.half.y / n[1], s.half.z / n[2]};
      for (int i = 0; i < n[0]; ++i)
        for (int j = 0; j < n[1]; ++j)
          for (int k = 0; k < n[2]; ++k) {
            const Vec3 middle{(2 * i + 1) * half.x - s.half.x, (2 * j + 1) * half.y - s.half.y,
                              (2 * k + 1) * half.z - s.half.z};
            out.push_back({b, mass / (n[0] * n[1] * n[2]), {s.X_BS * middle, s.X_BS.q}, half});
          }
    }
  }
  return out;
}

/// What cells lose, where they are and how much that counts.
class Losses {
 public:
  Losses(const product::VibrationLaw& law, const record::Record& r, const Speeds& speeds, const Vec3& gravity,
         const Polygon& footprint)
      : law_(law),
        r_(r),
        speeds_(speeds),
        gravity_(gravity),
        footprint_(footprint),
        bodies_(r.time.empty() ? 0 : speeds.velocity.size() / (3 * r.time.size())),
        cells_(make_cells(r, bodies_)) {}

  /// The loss of the interval that ends with a frame, as if at the law's distance.
  ///   tell  takes body, share of the loss, distance and what the share counts
  template <class Tell>
  double weigh(size_t frame, double loss, const Tell& tell) {
    const std::vector<double> before = energy_at(frame - 1), now = energy_at(frame);
    const double sign = loss < 0 ? -1 : 1;
    std::vector<double> own(cells_.size());
    double all = 0;
    for (size_t i = 0; i < cells_.size(); ++i)
      all += own[i] = cells_[i].mass * std::max(0.0, sign * (before[i] - now[i]));
    // of what is lost though no part loses any, such as the work of cables
    if (!(all > 0))
      for (size_t i = 0; i < cells_.size(); ++i) all += own[i] = cells_[i].mass;
    double sum = 0;
    for (size_t i = 0; i < cells_.size(); ++i) {
      if (!(own[i] > 0)) continue;
      const double r = std::min(distance_at(frame - 1, i), distance_at(frame, i)), share = loss * own[i] / all;
      const double counts = share * std::pow(law_.distance / r, law_.distance_exponent / law_.energy_exponent);
      sum += counts;
      tell(cells_[i].body, share, r, counts);
    }
    return sum;
  }

 private:
  Vec3 vector_at(const std::vector<float>& list, size_t frame, size_t body) const {
    const float* x = &list[3 * (frame * bodies_ + body)];
    return {x[0], x[1], x[2]};
  }

  /// Kinetic and potential energy of cells, each as a point [J/kg].
  std::vector<double> energy_at(size_t frame) {
    if (energy_frame_ == frame) return energy_;
    std::vector<double> out(cells_.size());
    Pose X_WB;
    Mat3 R_WB;
    Vec3 velocity, spin;
    for (size_t i = 0; i < cells_.size(); ++i) {
      const Cell& c = cells_[i];
      if (i == 0 || c.body != cells_[i - 1].body) {
        X_WB = record::pose_at(r_, frame, c.body), R_WB = to_matrix(X_WB.q);
        velocity = vector_at(speeds_.velocity, frame, c.body), spin = vector_at(speeds_.spin, frame, c.body);
      }
      const Vec3 lever = R_WB * c.X_BC.p, v = velocity + cross(spin, lever);
      out[i] = 0.5 * dot(v, v) - dot(gravity_, X_WB.p + lever);
    }
    energy_frame_ = frame;
    return energy_ = out;
  }

  /// Of a cell's outline; at least the law's least.
  double distance_at(size_t frame, size_t cell) {
    auto& known = distance_[frame % 2];
    if (known.frame != frame) known.frame = frame, known.r.assign(cells_.size(), -1);
    if (known.r[cell] < 0) {
      const Cell& c = cells_[cell];
      known.r[cell] =
          std::max(calc_distance(calc_outline({record::pose_at(r_, frame, c.body) * c.X_BC, c.half}), footprint_),
                   law_.least_distance);
    }
    return known.r[cell];
  }

  const product::VibrationLaw& law_;
  const record::Record& r_;
  const Speeds& speeds_;
  const Vec3 gravity_;
  const Polygon& footprint_;
  size_t bodies_;
  std::vector<Cell> cells_;
  size_t energy_frame_ = static_cast<size_t>(-1);
  std::vector<double> energy_;
  struct Known {
    size_t frame = static_cast<size_t>(-1);
    std::vector<double> r;  // [m]
  };
  Known distance_[2];
};

/// Where a window of a length may begin and end so that a sum on straight lines between frames is largest.
struct Window {
  double begin = 0, end = 0;  // [s]
  double sum = 0;
};
Window find_largest(const std::vector<double>& time, const std::vector<double>& sum, double length, size_t first) {
  constexpr double rounding = 1e-9;  // [s]
  Window out;
  const auto take = [&](double begin, double end, double value) {
    if (value > out.sum) out = {begin, end, value};
  };
  for (size_t j = first; j < time.size(); ++j) {
    // between frames, and of a whole interval that is longer than the window
    for (size_t i = j; i-- > 0;) {
      if (time[j] - time[i] > length + rounding && i + 1 < j) break;
      take(time[i], time[j], sum[j] - sum[i]);
    }
    const double begin = time[j] - length, end = time[j] + length;
    if (begin > time.front()) take(begin, time[j], sum[j] - interpolate(time, sum, begin));
    if (end < time.back()) take(time[j], end, interpolate(time, sum, end) - sum[j]);
  }
  return out;
}

}  // namespace

std::vector<double> calc_lost_energy(const record::Record& r, double restitution) {
  std::vector<double> out(r.time.size(), 0);
  // where they give back all, they take nothing that could tell of them
  const double brought = restitution < 1 ? 1 / (1 - restitution * restitution) : 1;
  for (const char* id : {"energy_elastic", "energy_contact", "energy_plastic", "energy_damping", "energy_friction",
                         "energy_contact_loss"})
    for (const record::Series& s : r.series)
      if (s.id == id)
        for (size_t i = 0; i < out.size(); ++i) out[i] += (s.id == "energy_contact_loss" ? brought : 1) * s.value[i];
  return out;
}

double calc_velocity(const product::VibrationLaw& law, double energy, double distance) {
  return law.velocity * std::pow(energy / law.energy, law.energy_exponent) *
         std::pow(law.distance / std::max(distance, law.least_distance), law.distance_exponent);
}

Shaking find_shaking(const product::VibrationLaw& law, const record::Record& r, const Speeds& speeds,
                     const Vec3& gravity, double restitution, const Polygon& footprint) {
  Shaking out;
  const size_t S = r.time.size();
  if (S < 2) return out;
  (void)speeds.velocity.at(0);  // throws where the recorder was not asked to keep them
  const std::vector<double> lost = calc_lost_energy(r, restitution);
  Losses losses(law, r, speeds, gravity, footprint);
  const auto nobody = [](size_t, double, double, double) {};
  std::vector<double> weighed(S, 0);
  for (size_t k = 1; k < S; ++k) {
    const double loss = lost[k] - lost[k - 1];
    weighed[k] = weighed[k - 1] + (loss == 0 ? 0 : losses.weigh(k, loss, nobody));
  }
  const auto to_velocity = [&law](double sum) {
    return law.velocity * std::pow(std::max(sum, 0.0) / law.energy, law.energy_exponent);
  };
  const Window largest = find_largest(r.time, weighed, law.window, 1);
  out.velocity = to_velocity(largest.sum);
  out.end_velocity = to_velocity(find_largest(r.time, weighed, law.window, S - 1).sum);
  if (!(out.velocity > 0)) return out;
  out.time = largest.end, out.window = largest.end - largest.begin;
  out.energy = interpolate(r.time, lost, largest.end) - interpolate(r.time, lost, largest.begin);
  // whose share counts most, and where the most of it was
  std::vector<double> counts(r.bodies.size(), 0), most(r.bodies.size(), 0), where(r.bodies.size(), 0);
  for (size_t k = 1; k < S; ++k) {
    const double within = std::min(r.time[k], largest.end) - std::max(r.time[k - 1], largest.begin);
    if (!(within > 0)) continue;
    losses.weigh(k, (lost[k] - lost[k - 1]) * within / (r.time[k] - r.time[k - 1]),
                 [&](size_t body, double, double distance, double weight) {
                   counts[body] += weight;
                   if (weight > most[body]) most[body] = weight, where[body] = distance;
                 });
  }
  const auto leader = std::max_element(counts.begin(), counts.end());
  out.body = static_cast<int>(leader - counts.begin());
  out.distance = where[static_cast<size_t>(out.body)];
  return out;
}

double calc_vibration_limit(product::BuildingClass c, double frequency) {
  const Row row = row_of(c);
  const double f = std::min(frequency, 100.0);
  const double limit = f <= 10   ? row.low
                       : f <= 50 ? row.low + (row.middle - row.low) * (f - 10) / 40
                                 : row.middle + (row.high - row.middle) * (f - 50) / 50;
  return limit * unit::mm;
}

std::string describe_vibration_limit(product::BuildingClass c) {
  const Row row = row_of(c);
  return fmt::format("{} (line {}): {:g} mm/s up to 10 Hz, rising to {:g} at 50 Hz and {:g} at 100 Hz", row.name,
                     row.line, row.low, row.middle, row.high);
}

}  // namespace topple::collapse
