#include "uncertainty/box_growth.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace topple::uncertainty {
namespace {

constexpr int sections = 8;

}  // namespace

BoxGrowth::BoxGrowth(const Box& outer, const Point& seed, Judge judge, Allow allow, const Options& options)
    : outer_(outer),
      box_{seed, seed},
      judge_(std::move(judge)),
      allow_(std::move(allow)),
      options_(options),
      front_(seed),
      random_(options.seed) {
  for (std::size_t i = 0; i < seed.size(); ++i)
    if (outer.upper[i] > outer.lower[i]) axes_.push_back(static_cast<int>(i));
}

double BoxGrowth::calc_part() const {
  double part = 1;
  for (const int i : axes_) part *= (box_.upper[i] - box_.lower[i]) / (outer_.upper[i] - outer_.lower[i]);
  return part;
}

std::vector<Point> BoxGrowth::make_random_points(const Box& box, int count) {
  std::vector<Point> points;
  for (int k = 0; k < count; ++k)
    for (int attempt = 0; attempt < 1000; ++attempt) {
      Point x = box.lower;
      for (const int i : axes_) x[i] = random_.next(box.lower[i], box.upper[i]);
      if (!allow_(x)) continue;
      points.push_back(std::move(x));
      break;
    }
  return points;
}

std::vector<Point> BoxGrowth::make_corners_of(const Box& box, const std::set<std::vector<bool>>& which) const {
  std::vector<Point> points;
  for (const auto& corner : which) {
    Point x = box.lower;
    for (std::size_t k = 0; k < axes_.size(); ++k)
      if (corner[k]) x[axes_[k]] = box.upper[axes_[k]];
    if (allow_(x)) points.push_back(std::move(x));
  }
  return points;
}

/// Corners (beyond 6 inputs the critical ones and 64 at random), middles of the faces, the middle, a few inside.
std::vector<Point> BoxGrowth::make_check_points(const Box& box) {
  const std::size_t n = axes_.size();
  std::set<std::vector<bool>> corners = critical_;
  for (std::size_t k = 0; k < (n <= 6 ? std::size_t{1} << n : 64); ++k) {
    std::vector<bool> corner(n);
    for (std::size_t i = 0; i < n; ++i) corner[i] = n <= 6 ? (k >> i & 1) != 0 : random_.next() < 0.5;
    corners.insert(corner);
  }
  std::vector<Point> points = make_corners_of(box, corners);
  Point middle = box.lower;
  for (const int i : axes_) middle[i] = 0.5 * (box.lower[i] + box.upper[i]);
  if (allow_(middle)) points.push_back(middle);
  for (const int i : axes_)
    for (const double face : {box.lower[i], box.upper[i]}) {
      Point x = middle;
      x[i] = face;
      if (allow_(x)) points.push_back(std::move(x));
    }
  for (auto& x : make_random_points(box, 8)) points.push_back(std::move(x));
  return points;
}

void BoxGrowth::note_critical(const Point& violating) {
  std::vector<bool> corner;
  for (const int i : axes_) corner.push_back(violating[i] > front_.seed()[i]);
  if (critical_.size() < 256) critical_.insert(std::move(corner));
}

bool BoxGrowth::check(const std::vector<Point>& points) {
  const auto verdicts = judge_(points);
  Front violating(front_.seed());
  for (std::size_t k = 0; k < points.size(); ++k) {
    stopped_ = stopped_ || verdicts[k] == Verdict::NotRun;
    if (verdicts[k] == Verdict::Violating) violating.add(points[k]);
  }
  std::vector<Point> outer = violating.points();
  if (outer.empty()) return !stopped_;
  constexpr std::size_t most = 12;  // bisections at once
  if (outer.size() > most) {
    for (std::size_t k = 0; k < most; ++k) outer[k] = outer[k * outer.size() / most];
    outer.resize(most);
  }
  std::vector<Point> inner(outer.size(), front_.seed());
  for (double part = 1; part > options_.edge && !stopped_; part /= sections) {
    std::vector<Point> places;
    for (std::size_t k = 0; k < outer.size(); ++k)
      for (int s = 1; s < sections; ++s) {
        Point x = inner[k];
        for (std::size_t i = 0; i < x.size(); ++i) x[i] += (outer[k][i] - inner[k][i]) * s / sections;
        places.push_back(std::move(x));
      }
    const auto found = judge_(places);
    for (std::size_t k = 0; k < outer.size(); ++k) {
      // the violating place nearest to the seed
      const std::size_t first = k * (sections - 1);
      int s = 0;
      while (s < sections - 1 && found[first + s] == Verdict::Permissible) ++s;
      if (s < sections - 1 && found[first + s] == Verdict::NotRun) stopped_ = true;
      if (s < sections - 1 && found[first + s] == Verdict::Violating) outer[k] = places[first + s];
      if (s > 0) inner[k] = places[first + s - 1];
    }
  }
  for (const auto& x : outer) {
    note_critical(x);
    front_.add(x);
  }
  return false;
}

bool BoxGrowth::is_clear(const Box& box) const {
  for (const auto& p : front_.points()) {
    bool inside = true;
    for (const int i : axes_) {
      const double margin = options_.edge * (outer_.upper[i] - outer_.lower[i]) * (1 - 1e-9);
      inside = inside && p[i] > box.lower[i] - margin && p[i] < box.upper[i] + margin;
    }
    if (inside) return false;
  }
  return true;
}

/// The largest box that the known violations leave, again and again, until its check points pass. Few inputs only: the
/// violations must hem it in.
bool BoxGrowth::grow_from_outside() {
  const int last = axes_.size() <= 2 ? options_.rounds : round_ + 2;
  while (round_ < std::min(last, options_.rounds) && !stopped_) {
    box_ = find_largest_box(outer_, front_, options_.edge, round_ % 16 == 0 ? 8 : 2,
                            options_.seed + static_cast<std::uint64_t>(round_));
    ++round_;
    if (calc_part() < options_.smallest) return false;
    if (check(make_check_points(box_))) return true;
  }
  return false;
}

/// Shrinks the box towards the seed until its critical corners pass.
bool BoxGrowth::settle() {
  const Box whole = box_;
  const Point& seed = front_.seed();
  const auto shrunk = [&](double t) {
    Box b = whole;
    for (const int i : axes_) {
      b.lower[i] = seed[i] + t * (whole.lower[i] - seed[i]);
      b.upper[i] = seed[i] + t * (whole.upper[i] - seed[i]);
    }
    return b;
  };
  // whose corners fail at full size is followed on its way in; the others are looked at again at the end
  std::vector<Point> points = make_check_points(whole);
  auto verdicts = judge_(points);
  for (std::size_t k = 0; k < points.size(); ++k) {
    stopped_ = stopped_ || verdicts[k] == Verdict::NotRun;
    if (verdicts[k] == Verdict::Violating) note_critical(points[k]), front_.add(points[k]);
  }
  double low = 0, high = 1;
  for (int level = 0; level < 2 && !stopped_; ++level) {
    points.clear();
    std::vector<std::size_t> end;
    for (int s = 1; s <= sections; ++s) {
      for (auto& x : make_corners_of(shrunk(low + (high - low) * s / sections), critical_))
        points.push_back(std::move(x));
      end.push_back(points.size());
    }
    verdicts = judge_(points);
    std::size_t k = 0;
    int good = 0;
    for (; good < sections; ++good) {
      while (k < end[good] && verdicts[k] == Verdict::Permissible) ++k;
      if (k < end[good]) break;
    }
    for (k = 0; k < points.size(); ++k) {
      stopped_ = stopped_ || verdicts[k] == Verdict::NotRun;
      if (verdicts[k] == Verdict::Violating) front_.add(points[k]);
    }
    const double width = high - low;
    high = low + width * std::min(good + 1, sections) / sections;
    low += width * good / sections;
  }
  box_ = shrunk(low);
  // keep a distance from what is known by now
  if (!is_clear(box_)) box_ = find_largest_box(box_, front_, options_.edge, 4, options_.seed);
  return !stopped_;
}

/// Moves faces out, alone or while another one moves in a little, as long as the volume grows and no violation is met.
/// Only the corners are run in whose direction something has violated before; all check points when nothing moves any
/// more.
bool BoxGrowth::improve(double step) {
  const int n = static_cast<int>(axes_.size());
  const Point& seed = front_.seed();
  struct Move {
    double gain;
    Box box;
  };
  while (step >= options_.edge && round_ < options_.rounds && !stopped_) {
    ++round_;
    std::vector<Move> moves;
    const auto add = [&](int out, int in, double ratio) {
      const int i = axes_[out / 2];
      const bool upper = out % 2 == 1;
      const double whole = outer_.upper[i] - outer_.lower[i], width = box_.upper[i] - box_.lower[i];
      Box b = box_;
      double& face = (upper ? b.upper : b.lower)[i];
      face = upper ? std::min(face + step * whole, outer_.upper[i]) : std::max(face - step * whole, outer_.lower[i]);
      const double grown = (b.upper[i] - b.lower[i]) / std::max(width, 1e-3 * options_.edge * whole);
      if (!(grown > 1 + 1e-9)) return;
      double gain = std::log(grown);
      if (in >= 0) {
        const int j = axes_[in / 2];
        const double before = b.upper[j] - b.lower[j];
        const double part = std::exp(-ratio * gain);
        double& other = (in % 2 == 1 ? b.upper : b.lower)[j];
        other += (in % 2 == 1 ? -1 : 1) * (1 - part) * before;
        other = in % 2 == 1 ? std::max(other, seed[j]) : std::min(other, seed[j]);
        gain += std::log(std::max((b.upper[j] - b.lower[j]) / before, 1e-12));
      }
      if (gain > 1e-9 && is_clear(b)) moves.push_back({gain, std::move(b)});
    };
    for (int out = 0; out < 2 * n; ++out) add(out, -1, 0);
    std::vector<std::pair<int, int>> pairs;
    for (int out = 0; out < 2 * n; ++out)
      for (int in = 0; in < 2 * n; ++in)
        if (in != out) pairs.emplace_back(out, in);
    for (int k = 0; k < static_cast<int>(pairs.size()) && k < 40; ++k) {
      const auto other = k + static_cast<std::size_t>(random_.next() * static_cast<double>(pairs.size() - k));
      std::swap(pairs[k], pairs[other]);
      for (const double ratio : {0.5, 0.85}) add(pairs[k].first, pairs[k].second, ratio);
    }
    std::stable_sort(moves.begin(), moves.end(), [](const Move& a, const Move& b) { return a.gain > b.gain; });
    // the critical corners of some moves at a time, the most promising first
    bool moved = false;
    for (std::size_t first = 0; first < moves.size() && !moved && !stopped_;) {
      std::vector<Point> points;
      std::vector<std::size_t> begin;
      std::size_t last = first;
      for (; last < moves.size() && points.size() < 64; ++last) {
        begin.push_back(points.size());
        if (!is_clear(moves[last].box)) continue;
        for (auto& x : make_corners_of(moves[last].box, critical_)) points.push_back(std::move(x));
      }
      begin.push_back(points.size());
      const auto verdicts = judge_(points);
      for (std::size_t k = 0; k < points.size(); ++k) {
        stopped_ = stopped_ || verdicts[k] == Verdict::NotRun;
        if (verdicts[k] == Verdict::Violating) front_.add(points[k]);
      }
      for (std::size_t m = first; m < last && !moved && !stopped_; ++m) {
        const auto is_permissible = [](Verdict v) { return v == Verdict::Permissible; };
        if (!is_clear(moves[m].box) ||
            !std::all_of(verdicts.begin() + begin[m - first], verdicts.begin() + begin[m - first + 1], is_permissible))
          continue;
        box_ = moves[m].box;
        moved = true;
      }
      first = last;
    }
    if (moved) continue;
    // the others now and then: what fails there is cut off, and becomes critical
    const auto checks = make_check_points(box_);
    const auto verdicts = judge_(checks);
    bool pass = true;
    for (std::size_t k = 0; k < checks.size(); ++k) {
      stopped_ = stopped_ || verdicts[k] == Verdict::NotRun;
      pass = pass && verdicts[k] == Verdict::Permissible;
      if (verdicts[k] == Verdict::Violating) note_critical(checks[k]), front_.add(checks[k]);
    }
    if (pass)
      step *= 0.5;
    else if (!is_clear(box_))
      box_ = find_largest_box(box_, front_, options_.edge, 2, options_.seed + static_cast<std::uint64_t>(round_));
  }
  return !stopped_;
}

bool BoxGrowth::grow() {
  if (axes_.empty()) return !stopped_;
  if (!settled_) {
    if (grow_from_outside()) return true;
    if (stopped_ || axes_.size() <= 2 || round_ >= options_.rounds) return false;
    settled_ = true;
    if (!settle() || !improve(0.1)) return false;
  } else {
    // violated inside: cut that off and look again nearby
    if (!is_clear(box_)) box_ = find_largest_box(box_, front_, options_.edge, 4, options_.seed);
    if (!improve(8 * options_.edge)) return false;
  }
  while (calc_part() >= options_.smallest && round_ < options_.rounds && !stopped_) {
    ++round_;
    if (is_clear(box_) && check(make_check_points(box_))) return true;
    if (!is_clear(box_)) box_ = find_largest_box(box_, front_, options_.edge, 4, options_.seed);
  }
  return false;
}

}  // namespace topple::uncertainty
