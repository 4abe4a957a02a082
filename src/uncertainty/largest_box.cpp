#include "uncertainty/largest_box.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "uncertainty/random.h"

namespace topple::uncertainty {
namespace {

/// All in coordinates that make `outer` the unit cube; axes without a width are left out.
class Grower {
 public:
  Grower(Point seed, std::vector<Point> bad, double margin)
      : seed_(std::move(seed)), bad_(std::move(bad)), margin_(margin), n_(seed_.size()) {}

  struct Cube {
    Point low, high;
    double log_volume() const {
      double sum = 0;
      for (std::size_t i = 0; i < low.size(); ++i) sum += std::log(std::max(high[i] - low[i], 1e-12));
      return sum;
    }
  };

  Cube whole() const { return {Point(n_, 0.0), Point(n_, 1.0)}; }

  bool holds(const Cube& c, const Point& p) const {
    for (std::size_t i = 0; i < n_; ++i)
      if (p[i] <= c.low[i] - near() || p[i] >= c.high[i] + near()) return false;
    return true;
  }

  /// Cuts until no bad point is left, each time for the bad point nearest to the seed on the axis that loses least;
  /// `spread` > 0 makes the losses random. False if the seed cannot be kept.
  bool cut(Cube& c, double spread, Random& random) const {
    std::vector<const Point*> inside;
    for (const auto& p : bad_)
      if (holds(c, p)) inside.push_back(&p);
    while (!inside.empty()) {
      const Point* nearest = nullptr;
      double least = std::numeric_limits<double>::infinity();
      for (const Point* p : inside) {
        double distance = 0;
        for (std::size_t i = 0; i < n_; ++i) distance = std::max(distance, std::abs((*p)[i] - seed_[i]));
        if (distance < least) least = distance, nearest = p;
      }
      int axis = -1;
      double least_loss = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < n_; ++i) {
        const double p = (*nearest)[i];
        double rest = 0;
        if (p - margin_ >= seed_[i])
          rest = p - margin_ - c.low[i];
        else if (p + margin_ <= seed_[i])
          rest = c.high[i] - p - margin_;
        else
          continue;
        const double loss = -std::log(std::max(rest / std::max(c.high[i] - c.low[i], 1e-300), 1e-12)) *
                            (spread > 0 ? std::exp(spread * random.next(-1, 1)) : 1);
        if (loss < least_loss) least_loss = loss, axis = static_cast<int>(i);
      }
      if (axis < 0) return false;
      const double p = (*nearest)[axis];
      (p > seed_[axis] ? c.high : c.low)[axis] = p > seed_[axis] ? p - margin_ : p + margin_;
      std::erase_if(inside, [&](const Point* q) { return !holds(c, *q); });
    }
    return true;
  }

  /// Where a face stops on its way out, and where it would stop if the first `skip` bad points did not count.
  double find_stop(const Cube& c, std::size_t axis, bool upper, int skip) const {
    std::vector<double> stops;
    for (const auto& p : bad_) {
      bool beside = true;
      for (std::size_t i = 0; i < n_ && beside; ++i)
        beside = i == axis || (p[i] > c.low[i] - near() && p[i] < c.high[i] + near());
      if (!beside) continue;
      const double stop = upper ? p[axis] - margin_ : -(p[axis] + margin_);
      if (stop >= (upper ? c.high[axis] : -c.low[axis]) - 2e-12) stops.push_back(stop);
    }
    std::sort(stops.begin(), stops.end());
    const double edge = upper ? 1 : 0;
    const double stop = static_cast<std::size_t>(skip) < stops.size() ? stops[skip] : (upper ? 1.0 : 0.0);
    return upper ? std::min(stop, edge) : static_cast<std::size_t>(skip) < stops.size() ? std::max(-stop, edge) : edge;
  }

  void grow(Cube& c) const {
    for (bool any = true; any;) {
      any = false;
      for (std::size_t i = 0; i < n_; ++i)
        for (const bool upper : {false, true}) {
          double& face = (upper ? c.high : c.low)[i];
          const double stop = find_stop(c, i, upper, 0);
          if (upper ? stop > face + 1e-12 : stop < face - 1e-12) face = stop, any = true;
        }
    }
  }

  /// Pushes single faces past some of what stops them and cuts anew elsewhere, as long as the volume grows.
  void exchange(Cube& c, Random& random) const {
    double volume = c.log_volume();
    for (bool any = true; any;) {
      any = false;
      for (std::size_t i = 0; i < n_; ++i)
        for (const bool upper : {false, true})
          for (const int skip : {1, 2, 4, 8, 16, 64}) {
            Cube wide = c;
            const double stop = find_stop(c, i, upper, skip);
            (upper ? wide.high : wide.low)[i] = stop;
            if (!cut_elsewhere(wide, i, random)) continue;
            grow(wide);
            if (const double v = wide.log_volume(); v > volume + 1e-12) c = wide, volume = v, any = true;
          }
    }
  }

  /// A face drawn at the margin must not count as too near by round-off.
  double near() const { return margin_ - 1e-12; }

 private:
  /// Like cut, but leaves one axis alone where it can.
  bool cut_elsewhere(Cube& c, std::size_t kept, Random& random) const {
    std::vector<const Point*> inside;
    for (const auto& p : bad_)
      if (holds(c, p)) inside.push_back(&p);
    for (const Point* p : inside) {
      if (!holds(c, *p)) continue;
      int axis = -1;
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < n_; ++i) {
        if (i == kept) continue;
        double rest = 0;
        if ((*p)[i] - margin_ >= seed_[i])
          rest = (*p)[i] - margin_ - c.low[i];
        else if ((*p)[i] + margin_ <= seed_[i])
          rest = c.high[i] - (*p)[i] - margin_;
        else
          continue;
        const double loss = -std::log(std::max(rest / std::max(c.high[i] - c.low[i], 1e-300), 1e-12));
        if (loss < least) least = loss, axis = static_cast<int>(i);
      }
      if (axis < 0) return cut(c, 0, random);
      (((*p)[axis] > seed_[axis]) ? c.high : c.low)[axis] =
          (*p)[axis] > seed_[axis] ? (*p)[axis] - margin_ : (*p)[axis] + margin_;
    }
    return true;
  }

  Point seed_;
  std::vector<Point> bad_;
  double margin_;
  std::size_t n_;
};

}  // namespace

bool Front::is_behind(const Point& far, const Point& near) const {
  for (std::size_t i = 0; i < seed_.size(); ++i)
    if (near[i] < std::min(far[i], seed_[i]) || near[i] > std::max(far[i], seed_[i])) return false;
  return true;
}

void Front::add(const Point& p) {
  for (const auto& q : points_)
    if (is_behind(p, q)) return;
  std::erase_if(points_, [&](const Point& q) { return is_behind(q, p); });
  points_.push_back(p);
}

Box find_largest_box(const Box& outer, const Front& front, double margin, int starts, std::uint64_t random_seed) {
  const Point& seed = front.seed();
  std::vector<std::size_t> axes;
  for (std::size_t i = 0; i < seed.size(); ++i)
    if (outer.upper[i] > outer.lower[i]) axes.push_back(i);
  const auto scaled = [&](const Point& x) {
    Point u;
    for (const std::size_t i : axes) u.push_back((x[i] - outer.lower[i]) / (outer.upper[i] - outer.lower[i]));
    return u;
  };
  std::vector<Point> scaled_bad;
  for (const auto& p : front.points())
    if (outer.contains(p)) scaled_bad.push_back(scaled(p));
  const Grower grower(scaled(seed), std::move(scaled_bad), margin);
  Random random(random_seed);
  Grower::Cube best;
  double volume = -std::numeric_limits<double>::infinity();
  for (int k = 0; k < std::max(starts, 1); ++k) {
    Grower::Cube c = grower.whole();
    if (!grower.cut(c, k == 0 ? 0 : 1.5, random)) continue;
    grower.grow(c);
    grower.exchange(c, random);
    if (const double v = c.log_volume(); v > volume) best = c, volume = v;
  }
  Box box{seed, seed};
  for (std::size_t i = 0; i < seed.size(); ++i)
    if (outer.upper[i] == outer.lower[i]) box.lower[i] = box.upper[i] = outer.lower[i];
  if (best.low.empty()) return box;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const std::size_t i = axes[k];
    const double width = outer.upper[i] - outer.lower[i];
    // the edge of the outer box exactly
    box.lower[i] = best.low[k] <= 0 ? outer.lower[i] : std::min(outer.lower[i] + best.low[k] * width, seed[i]);
    box.upper[i] = best.high[k] >= 1 ? outer.upper[i] : std::max(outer.lower[i] + best.high[k] * width, seed[i]);
  }
  return box;
}

}  // namespace topple::uncertainty
