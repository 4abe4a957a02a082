#include "uncertainty/cut_program.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "uncertainty/linear.h"
#include "uncertainty/random.h"

namespace topple::uncertainty {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double least_width = 1e-9;  // of the support: nearer places are one
constexpr long most_planes = 200;     // the latest

/// Orthonormal directions along which all `rows` stay as they are, by Householder's reflections.
std::vector<std::vector<double>> find_free_directions(const std::vector<std::vector<double>>& rows, std::size_t n) {
  std::vector<std::vector<double>> reflections;  // I - 2 h h'
  const auto reflect = [](const std::vector<double>& h, std::vector<double>& v) {
    const double part = 2 * dot(h, v);
    for (std::size_t i = 0; i < v.size(); ++i) v[i] -= part * h[i];
  };
  for (std::vector<double> r : rows) {
    for (const auto& h : reflections) reflect(h, r);
    const std::size_t rank = reflections.size();
    std::fill(r.begin(), r.begin() + static_cast<long>(rank), 0.0);
    const double length = std::sqrt(dot(r, r));
    if (length < 1e-12) continue;  // follows from the others
    r[rank] += r[rank] < 0 ? -length : length;
    const double size = std::sqrt(dot(r, r));
    for (double& c : r) c /= size;
    reflections.push_back(std::move(r));
    if (reflections.size() == n) break;
  }
  std::vector<std::vector<double>> free;
  for (std::size_t k = reflections.size(); k < n; ++k) {
    free.emplace_back(n, 0.0);
    free.back()[k] = 1;
    for (std::size_t j = reflections.size(); j-- > 0;) reflect(reflections[j], free.back());
  }
  return free;
}

}  // namespace

double Quadratic::operator()(const std::vector<double>& v) const {
  const std::size_t n = v.size();
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) {
    double row = 0;
    for (std::size_t j = 0; j < n; ++j) row += hessian[i * n + j] * v[j];
    sum += v[i] * (slope[i] + 0.5 * row);
  }
  return sum;
}

std::vector<double> minimise(const Quadratic& q, const std::vector<HalfSpace>& planes, const std::vector<double>& lower,
                             const std::vector<double>& upper, std::vector<double> start) {
  const std::size_t n = start.size();
  std::vector<HalfSpace> rows = planes;
  for (std::size_t i = 0; i < n; ++i)
    for (const double sign : {-1.0, 1.0}) {
      HalfSpace h;
      h.a.assign(n, 0.0);
      h.a[i] = sign;
      h.b = sign > 0 ? upper[i] : -lower[i];
      rows.push_back(std::move(h));
    }
  std::vector<double> v = std::move(start);
  std::vector<std::size_t> active;
  double unit = 0;
  for (std::size_t i = 0; i < n; ++i) {
    unit = std::max(unit, std::abs(q.slope[i]));
    for (std::size_t j = 0; j < n; ++j) unit = std::max(unit, std::abs(q.hessian[i * n + j]) * (upper[j] - lower[j]));
  }
  if (!(unit > 0)) return v;
  for (int step = 0; step < 200; ++step) {
    std::vector<double> slope = q.slope;
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j) slope[i] += q.hessian[i * n + j] * v[j];
    std::vector<std::vector<double>> held;
    for (const std::size_t r : active) held.push_back(rows[r].a);
    const auto free = find_free_directions(held, n);
    const std::size_t m = free.size();
    std::vector<double> reduced(m);
    double largest = 0;
    for (std::size_t k = 0; k < m; ++k) {
      reduced[k] = dot(free[k], slope);
      largest = std::max(largest, std::abs(reduced[k]));
    }
    if (largest < 1e-11 * unit) {
      if (active.empty()) return v;
      // multipliers: slope + Σ λ a = 0
      const std::size_t a = active.size();
      std::vector<std::vector<double>> A(a, std::vector<double>(a));
      std::vector<double> multipliers(a);
      for (std::size_t i = 0; i < a; ++i) {
        multipliers[i] = -dot(held[i], slope);
        for (std::size_t j = 0; j < a; ++j) A[i][j] = dot(held[i], held[j]);
      }
      if (!solve(A, multipliers)) return v;
      std::size_t worst = a;
      for (std::size_t i = 0; i < a; ++i) {
        if (multipliers[i] >= -1e-10 * unit) continue;
        // the most negative one; later the first, which cannot go round in circles
        if (worst == a || (step < 100 ? multipliers[i] < multipliers[worst] : active[i] < active[worst])) worst = i;
      }
      if (worst == a) return v;
      active.erase(active.begin() + static_cast<long>(worst));
      continue;
    }
    // Newton's step in the free directions, or straight down where q does not bend upwards
    std::vector<double> way(m);
    {
      std::vector<std::vector<double>> H(m, std::vector<double>(m));
      for (std::size_t k = 0; k < m; ++k)
        for (std::size_t l = 0; l < m; ++l)
          for (std::size_t i = 0; i < n; ++i)
            for (std::size_t j = 0; j < n; ++j) H[k][l] += free[k][i] * q.hessian[i * n + j] * free[l][j];
      // Cholesky tells whether it does
      std::vector<std::vector<double>> L = H;
      bool bends_up = true;
      for (std::size_t k = 0; k < m && bends_up; ++k) {
        for (std::size_t l = 0; l < k; ++l) L[k][k] -= L[k][l] * L[k][l];
        bends_up = L[k][k] > 1e-9 * unit;
        if (!bends_up) break;
        L[k][k] = std::sqrt(L[k][k]);
        for (std::size_t r = k + 1; r < m; ++r) {
          for (std::size_t l = 0; l < k; ++l) L[r][k] -= L[r][l] * L[k][l];
          L[r][k] /= L[k][k];
        }
      }
      for (std::size_t k = 0; k < m; ++k) way[k] = -reduced[k];
      if (bends_up && !solve(H, way)) bends_up = false;
      if (!bends_up)
        for (std::size_t k = 0; k < m; ++k) way[k] = -reduced[k];
    }
    std::vector<double> p(n, 0.0);
    for (std::size_t k = 0; k < m; ++k)
      for (std::size_t i = 0; i < n; ++i) p[i] += way[k] * free[k][i];
    double bend = 0;
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j) bend += p[i] * q.hessian[i * n + j] * p[j];
    const double down = dot(slope, p), length = std::sqrt(dot(p, p));
    double t = bend > 0 ? -down / bend : infinite;
    std::size_t blocking = rows.size();
    for (std::size_t r = 0; r < rows.size(); ++r) {
      if (std::find(active.begin(), active.end(), r) != active.end()) continue;
      const double rate = dot(rows[r].a, p);
      if (rate <= 1e-12 * length) continue;
      const double until = std::max(0.0, rows[r].b - dot(rows[r].a, v)) / rate;
      if (until < t) t = until, blocking = r;
    }
    if (!std::isfinite(t)) return v;
    for (std::size_t i = 0; i < n; ++i) v[i] += t * p[i];
    if (blocking < rows.size()) active.push_back(blocking);
  }
  return v;
}

CutProgram::CutProgram(const Space& space, double alpha, std::vector<double> scale, std::vector<int> axes)
    : space_(space),
      alpha_(alpha),
      box_(make_box(space, alpha)),
      scale_(std::move(scale)),
      axes_(std::move(axes)),
      centre_(calc_centre(space)) {}

std::vector<double> CutProgram::find_way(const Point& from, const Point& to) const {
  std::vector<double> v(axes_.size());
  for (std::size_t k = 0; k < v.size(); ++k) v[k] = (to[axes_[k]] - from[axes_[k]]) / scale_[axes_[k]];
  return v;
}

Point CutProgram::move(const Point& base, const std::vector<double>& v) const {
  Point x = base;
  for (std::size_t k = 0; k < axes_.size(); ++k) x[axes_[k]] += v[k] * scale_[axes_[k]];
  return clip(box_, std::move(x));
}

/// The place itself where it belongs to the cut, a hair towards the centre, or on the way from `base`.
Point CutProgram::pull(const Point& base, Point x) const {
  if (contains(x)) return x;
  for (double part = 1e-15; part < 1e-8; part *= 10) {
    Point y = x;
    for (const int i : axes_) y[i] += part * (centre_[i] - x[i]);
    y = clip(box_, std::move(y));
    if (contains(y)) return y;
  }
  return bisect(base, std::move(x), [this](const Point& y) { return contains(y); }).first;
}

/// The half space that supports the cut at an end of it, where it ends in a plane there: by places on that plane beside
/// the way, which need no slopes of what ties the inputs.
std::optional<HalfSpace> CutProgram::find_face(const Point& end) const {
  const std::size_t n = axes_.size();
  const std::vector<double> at = find_way(centre_, end);
  const double length = std::sqrt(dot(at, at));
  if (!(length > 0)) return {};
  std::vector<double> way = at;
  for (double& c : way) c /= length;
  double round_off = 1e-13;
  for (const int i : axes_) round_off = std::max(round_off, 1e-15 * std::abs(end[i]) / scale_[i]);
  const auto tangents = find_free_directions({way}, n);
  for (const double r : {1e-2, 1e-3, 1e-4}) {
    HalfSpace h{way, 0};
    bool is_straight = true;
    for (const auto& t : tangents) {
      double off[2];
      for (const int side : {0, 1}) {
        const auto place = [&](double along) {
          Point x = end;
          for (std::size_t k = 0; k < n; ++k)
            x[axes_[k]] += scale_[axes_[k]] * ((side == 0 ? -r : r) * t[k] + along * way[k]);
          return x;
        };
        double low = -std::min(10 * r, length), high = 10 * r;
        is_straight = is_straight && contains(place(low)) && !contains(place(high)) && box_.contains(place(high));
        for (int halving = 0; halving < 60 && is_straight; ++halving)
          (contains(place(0.5 * (low + high))) ? low : high) = 0.5 * (low + high);
        off[side] = low;
      }
      is_straight = is_straight && std::abs(off[0] + off[1]) < round_off;
      if (!is_straight) break;
      for (std::size_t k = 0; k < n; ++k) h.a[k] -= 0.5 * (off[1] - off[0]) / r * t[k];
    }
    if (!is_straight) continue;
    const double size = std::sqrt(dot(h.a, h.a));
    for (double& a : h.a) a /= size;
    h.b = dot(h.a, at);
    return h;
  }
  return {};
}

/// The half space that supports the cut where the way from its centre to x leaves it; the last place inside is kept.
std::optional<HalfSpace> CutProgram::find_support(const Point& x) {
  const auto ends = bisect(
      centre_, x, [this](const Point& y) { return contains(y); }, 60);
  const Point &in = ends.first, &out = ends.second;
  inside_.push_back(find_way(centre_, in));
  if (std::ssize(inside_) > most_planes) inside_.erase(inside_.begin() + 6 * std::ssize(axes_));
  if (auto face = find_face(in)) return face;
  std::function<double(const Point&)> g;
  for (const auto& c : space_.constraints)
    if (!(c(out) <= 0)) {
      g = c;
      break;
    }
  if (!g && space_.joint) g = [this](const Point& y) { return alpha_ - space_.joint(y); };
  if (!g) return {};
  const auto calc_slope = [&](int i, double step) {
    Point y = in;
    y[i] = in[i] + step * scale_[i];
    const double above = g(y);
    y[i] = in[i] - step * scale_[i];
    return (above - g(y)) / (2 * step);
  };
  HalfSpace h;
  double largest = 0, square = 0;
  for (const int i : axes_) {
    h.a.push_back(calc_slope(i, 1e-7));  // near, since there are kinks
    largest = std::max(largest, std::abs(h.a.back()));
  }
  for (std::size_t k = 0; k < h.a.size(); ++k) {
    // of what is straight for far the round-off is small
    const double near = h.a[k];
    for (const double step : {1e-2, 1e-3, 1e-4, 1e-5})
      if (const double far = calc_slope(axes_[k], step);
          std::abs(far - near) <= 1e-6 * std::abs(near) + 1e-8 * largest) {
        h.a[k] = far;
        break;
      }
    square += h.a[k] * h.a[k];
  }
  if (!(square > 0) || !std::isfinite(square)) return {};
  for (double& a : h.a) a /= std::sqrt(square);
  h.b = dot(h.a, find_way(centre_, in));
  return h;
}

/// Places where the cut ends along the axes and between them, which no half space that supports it leaves out.
void CutProgram::look_around() {
  Random random(1);
  for (std::size_t turn = 0; turn < 6 * axes_.size(); ++turn) {
    Point y = centre_;
    for (std::size_t k = 0; k < axes_.size(); ++k) {
      const double along = turn / 2 == k ? (turn % 2 == 0 ? -1 : 1) : 0;
      y[axes_[k]] += scale_[axes_[k]] * (turn < 2 * axes_.size() ? along : random.next(-1, 1));
    }
    y = clip(box_, std::move(y));
    inside_.push_back(
        find_way(centre_, bisect(centre_, std::move(y), [this](const Point& x) { return contains(x); }).first));
  }
}

/// Adds a half space that supports the cut and leaves x out, or one that is a guess. False where there is none that
/// keeps `base`.
bool CutProgram::cut_off(const Point& x, const Point& base) {
  if (inside_.empty()) look_around();
  const std::vector<double> from = find_way(centre_, base), to = find_way(centre_, x);
  const auto calc_beyond = [](const HalfSpace& h, const std::vector<double>& v) { return dot(h.a, v) - h.b; };
  // by its round-off a half space is moved out
  const auto supports = [&](HalfSpace& h) {
    double beyond = std::max(0.0, calc_beyond(h, from));
    for (const auto& v : inside_) beyond = std::max(beyond, calc_beyond(h, v));
    h.b += beyond;
    return beyond <= 1e-7 && calc_beyond(h, to) > 0.1 * least_width;
  };
  std::optional<HalfSpace> first = find_support(x);
  if (!first) return false;
  HalfSpace moved = *first;
  if (supports(moved)) {
    planes_.push_back(std::move(moved));
    return true;
  }
  // at an edge slopes tell nothing of either side: there are places of one side alone beside it
  Random random(1);
  for (const double part : {1e-6, 1e-6, 1e-5, 1e-5, 1e-4, 1e-4, 1e-3, 1e-3, 1e-2, 1e-2}) {
    Point y = x;
    for (const int i : axes_) y[i] += part * random.next(-1, 1) * scale_[i];
    if (contains(y)) continue;
    std::optional<HalfSpace> h = find_support(y);
    if (!h || !supports(*h)) continue;
    planes_.push_back(std::move(*h));
    return true;
  }
  if (calc_beyond(*first, from) > least_width) return false;
  planes_.push_back(std::move(*first));
  return true;
}

Point CutProgram::find_place(const Point& base, const Quadratic& q, double reach, const std::vector<HalfSpace>& sides,
                             const std::vector<double>& start) {
  const std::size_t n = axes_.size();
  const std::vector<double> from = find_way(centre_, base);
  // planes that cut off a place of the cut: it is not convex there
  std::erase_if(planes_, [&](const HalfSpace& h) { return dot(h.a, from) > h.b + least_width; });
  if (std::ssize(planes_) > most_planes) planes_.erase(planes_.begin(), planes_.end() - most_planes);
  std::vector<double> lower(n), upper(n);
  for (std::size_t k = 0; k < n; ++k) {
    const int i = axes_[k];
    lower[k] = std::min(0.0, std::max(-reach, (box_.lower[i] - base[i]) / scale_[i]));
    upper[k] = std::max(0.0, std::min(reach, (box_.upper[i] - base[i]) / scale_[i]));
  }
  Point x = base;
  for (int round = 0; round < 100; ++round) {
    std::vector<HalfSpace> planes = planes_;
    for (HalfSpace& h : planes) h.b -= dot(h.a, from);
    planes.insert(planes.end(), sides.begin(), sides.end());
    double part = 1;
    for (HalfSpace& h : planes) {
      h.b = std::max(0.0, h.b);
      if (const double at = dot(h.a, start); at > h.b) part = std::min(part, h.b / at);
    }
    std::vector<double> v = start;
    for (std::size_t k = 0; k < n; ++k) {
      if (v[k] > upper[k]) part = std::min(part, upper[k] / v[k]);
      if (v[k] < lower[k]) part = std::min(part, lower[k] / v[k]);
    }
    for (double& c : v) c *= part;
    v = minimise(q, planes, lower, upper, std::move(v));
    x = move(base, v);
    Point pulled = pull(base, x);
    double off = 0;
    for (const double c : find_way(x, pulled)) off = std::max(off, std::abs(c));
    if (off < least_width) return pulled;
    if (!cut_off(x, base)) return pulled;
  }
  return pull(base, x);
}

Point CutProgram::minimise_from(const Point& base, const Quadratic& q, double reach,
                                const std::vector<HalfSpace>& sides) {
  const std::size_t n = axes_.size();
  Random random(1);
  Point best = base;
  double least = 0;
  for (std::size_t turn = 0; turn <= 2 * n; ++turn) {
    std::vector<double> start(n, 0.0);
    if (turn > 0)
      for (double& c : start) c = reach * random.next(-1, 1);
    Point x = find_place(base, q, reach, sides, start);
    if (const double value = q(find_way(base, x)); value < least) least = value, best = std::move(x);
  }
  return best;
}

Point CutProgram::project_from(const Point& base, const Point& target, double reach) {
  const std::size_t n = axes_.size();
  Quadratic q{find_way(target, base), std::vector<double>(n * n, 0.0)};
  for (std::size_t k = 0; k < n; ++k) q.hessian[k * n + k] = 1;
  return find_place(base, q, reach, {}, std::vector<double>(n, 0.0));
}

/// By bisection of the level. Whether the cut at a level reaches the half spaces within the box is a linear programme,
/// in which all half spaces may be left by the same least length; those that support the cut are found as they are
/// needed, and hold for higher levels too.
Point find_most_possible(const Space& space, const std::vector<double>& scale, const std::vector<int>& axes,
                         const Point& base, double reach, const std::vector<HalfSpace>& sides) {
  const std::size_t n = axes.size();
  const auto find_place = [&](CutProgram& cut) -> std::optional<Point> {
    Quadratic q{std::vector<double>(n + 1, 0.0), std::vector<double>((n + 1) * (n + 1), 0.0)};
    q.slope[n] = 1;
    std::vector<double> lower(n + 1), upper(n + 1);
    for (std::size_t k = 0; k < n; ++k) {
      const int i = axes[k];
      lower[k] = std::max(-reach, (cut.box_.lower[i] - base[i]) / scale[i]);
      upper[k] = std::min(reach, (cut.box_.upper[i] - base[i]) / scale[i]);
      if (!(lower[k] <= upper[k])) return {};
    }
    if (!space.has_interaction() && sides.size() == 1) {
      // the box's corner that lies deepest
      const HalfSpace& side = sides.front();
      std::vector<double> v(n);
      for (std::size_t k = 0; k < n; ++k)
        v[k] = side.a[k] > 0 ? lower[k] : side.a[k] < 0 ? upper[k] : std::clamp(0.0, lower[k], upper[k]);
      if (dot(side.a, v) > side.b) return {};
      return cut.move(base, v);
    }
    lower[n] = -1;
    for (int round = 0; round < 100; ++round) {
      std::vector<double> v(n + 1, 0.0);
      for (std::size_t k = 0; k < n; ++k) v[k] = std::clamp(0.0, lower[k], upper[k]);
      std::vector<HalfSpace> rows = sides;
      for (const HalfSpace& h : cut.planes_) {
        rows.push_back(h);
        rows.back().b -= dot(h.a, cut.find_way(cut.centre_, base));
      }
      v[n] = lower[n];
      for (HalfSpace& h : rows) {
        double at = -h.b;
        for (std::size_t k = 0; k < n; ++k) at += h.a[k] * v[k];
        v[n] = std::max(v[n], at);
        h.a.push_back(-1);
      }
      upper[n] = v[n];
      v = minimise(q, rows, lower, upper, std::move(v));
      if (v[n] > 1e-12) return {};
      const Point x = cut.move(base, v);
      if (cut.contains(x)) return x;
      if (!cut.cut_off(x, cut.centre_)) return {};
    }
    return {};
  };
  Point best = base;
  double low = calc_membership(space, base), high = 1;
  std::vector<HalfSpace> kept;
  while (high - low > 1e-7) {
    const double alpha = 0.5 * (low + high);
    CutProgram cut(space, alpha, scale, axes);
    cut.planes_ = kept;
    if (auto x = find_place(cut)) {
      low = alpha, best = std::move(*x);
      kept = std::move(cut.planes_);
    } else {
      high = alpha;
    }
  }
  return best;
}

}  // namespace topple::uncertainty
