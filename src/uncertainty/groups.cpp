#include "uncertainty/groups.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "uncertainty/random.h"

namespace topple::uncertainty {

namespace {

constexpr int support_places = 24, inner_places = 12;  // spread over a group, for each of its inputs
constexpr double bottom = 0.3, apart = 0.2;  // of a cut's widths: around a bottom, and between places to begin at
constexpr std::size_t most_inputs = 4;       // of a group whose basins so few places find

}  // namespace

GroupSearch::GroupSearch(const Space& space, Asker& asker, const std::vector<Region>& levels, int output,
                         double tolerance, std::uint64_t seed)
    : asker_(asker),
      levels_(levels),
      output_(output),
      tolerance_(tolerance),
      seed_(seed),
      centre_(calc_centre(space)),
      together_(levels.front().axes.size()) {}

double GroupSearch::value_at(const Point& x) const {
  const int i = asker_.archive().find(x);
  if (i < 0 || asker_.archive()[i].result.state != Result::State::Done) return std::numeric_limits<double>::quiet_NaN();
  return asker_.archive()[i].result.values[output_];
}

void GroupSearch::join_by_corners() {
  const Region& support = levels_.front();
  const std::size_t n = support.axes.size();
  std::vector<double> value;
  for (const Point& x : make_corners(support.box)) {
    value.push_back(value_at(x));
    has_failed_ = has_failed_ || !std::isfinite(value.back());
  }
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = a + 1; b < n; ++b) {
      const std::size_t A = std::size_t{1} << a, B = std::size_t{1} << b;
      for (std::size_t c = 0; c < value.size(); ++c)
        if (!(c & A) && !(c & B) && std::abs(value[c] - value[c | A] - value[c | B] + value[c | A | B]) > tolerance_)
          together_.join_under_lower(static_cast<int>(a), static_cast<int>(b));
    }
}

/// Inputs of different groups so far, moved off the centre alone and together: what is even or periodic shows at no
/// corner.
void GroupSearch::join_by_pairs() {
  const Region& support = levels_.front();
  const int n = static_cast<int>(support.axes.size());
  struct Pair {
    int a, b;
    Point x, y, both;
  };
  std::vector<Pair> pairs;
  std::vector<Point> points = {centre_};
  for (const double first : {0.37, 0.87})
    for (int a = 0; a < n; ++a)
      for (int b = a + 1; b < n; ++b) {
        if (together_.find(a) == together_.find(b)) continue;
        // multiples of the golden section are nowhere near each other
        const auto place = [&](int axis) {
          constexpr double golden = 0.618033988749895;
          const int i = support.axes[axis];
          const double part = first + golden * (axis + 1);
          return support.box.lower[i] + (0.1 + 0.8 * (part - std::floor(part))) * support.scale[i];
        };
        Pair p{a, b, centre_, centre_, centre_};
        p.x[support.axes[a]] = p.both[support.axes[a]] = place(a);
        p.y[support.axes[b]] = p.both[support.axes[b]] = place(b);
        for (const Point* point : {&p.x, &p.y, &p.both}) points.push_back(*point);
        pairs.push_back(std::move(p));
      }
  asker_.ask(points);
  for (const Pair& p : pairs) {
    const double mixed = value_at(centre_) - value_at(p.x) - value_at(p.y) + value_at(p.both);
    has_failed_ = has_failed_ || !std::isfinite(mixed);
    if (!(std::abs(mixed) <= tolerance_)) together_.join_under_lower(p.a, p.b);
  }
}

void GroupSearch::list_groups() {
  groups_.clear();
  const std::vector<int>& axes = levels_.front().axes;
  std::vector<std::vector<int>> of_leader(axes.size());
  for (std::size_t a = 0; a < axes.size(); ++a)
    of_leader[static_cast<std::size_t>(together_.find(static_cast<int>(a)))].push_back(axes[a]);
  for (std::vector<int>& group : of_leader)
    if (!group.empty()) groups_.push_back(std::move(group));
}

void GroupSearch::spread() {
  std::vector<Point> points;
  for (const std::vector<int>& group : groups_)
    for (const Region& r : levels_) {
      if (r.axes.empty()) continue;
      Box box{centre_, centre_};
      for (const int i : group) box.lower[i] = r.box.lower[i], box.upper[i] = r.box.upper[i];
      for (Point& x : make_corners(box)) points.push_back(std::move(x));
      const int n = static_cast<int>(group.size());
      const int count = (&r == &levels_.front() ? support_places : inner_places) * n;
      for (const Point& u : make_sobol_points(n, 1, count, seed_ + group.front())) {
        Point fractions(centre_.size(), 0.0);
        for (int k = 0; k < n; ++k) fractions[group[k]] = u[k];
        points.push_back(place_in(box, fractions));
      }
    }
  asker_.ask(points);
}

bool GroupSearch::is_sum() const {
  constexpr int tests = 8;
  const Region& support = levels_.front();
  std::vector<Point> points;  // of each test one for each group, then all of them together
  Random random(seed_);
  for (int t = 0; t < tests; ++t) {
    Point all = centre_;
    for (const std::vector<int>& group : groups_) {
      Point x = centre_;
      for (const int i : group) all[i] = x[i] = random.next(support.box.lower[i], support.box.upper[i]);
      points.push_back(std::move(x));
    }
    points.push_back(std::move(all));
  }
  asker_.ask(points);
  const double at_centre = value_at(centre_);
  const std::size_t each = groups_.size() + 1;
  for (std::size_t t = 0; t < points.size(); t += each) {
    double sum = at_centre;
    for (std::size_t g = 0; g < groups_.size(); ++g) sum += value_at(points[t + g]) - at_centre;
    if (!(std::abs(value_at(points[t + groups_.size()]) - sum) <= static_cast<double>(each) * tolerance_)) return false;
  }
  return true;
}

bool GroupSearch::find() {
  join_by_corners();
  list_groups();
  if (has_failed_ || groups_.size() < 2) return false;
  join_by_pairs();
  list_groups();
  const auto has_many = [](const std::vector<int>& group) { return group.size() > most_inputs; };
  if (has_failed_ || groups_.size() == levels_.front().axes.size() ||
      std::any_of(groups_.begin(), groups_.end(), has_many))
    return false;
  if (!is_sum()) return false;
  spread();
  return true;
}

std::vector<Point> GroupSearch::list_best(const Point& base, std::size_t group, int level, double sign,
                                          std::size_t count) const {
  const std::vector<int>& inputs = groups_[group];
  const Region& r = levels_[level];
  std::vector<std::pair<double, int>> known;
  const auto& samples = asker_.archive().samples();
  for (std::size_t s = 0; s < samples.size(); ++s) {
    const Point& x = samples[s].x;
    bool is_of_group = samples[s].result.state == Result::State::Done;
    for (std::size_t i = 0; i < x.size() && is_of_group; ++i)
      is_of_group = std::count(inputs.begin(), inputs.end(), static_cast<int>(i)) > 0
                        ? x[i] >= r.box.lower[i] && x[i] <= r.box.upper[i]
                        : x[i] == base[i];
    if (is_of_group) known.push_back({sign * samples[s].result.values[output_], static_cast<int>(s)});
  }
  std::sort(known.begin(), known.end());
  const auto is_near = [&](const Point& x, const Point& y, double part) {
    return std::all_of(inputs.begin(), inputs.end(),
                       [&](int i) { return std::abs(x[i] - y[i]) <= part * (r.box.upper[i] - r.box.lower[i]); });
  };
  // bottoms first: what has no better place near it
  std::vector<Point> best;
  for (const bool of_bottoms : {true, false})
    for (std::size_t k = 0; k < known.size() && best.size() < count; ++k) {
      const Point& x = samples[static_cast<std::size_t>(known[k].second)].x;
      const auto is_near_known = [&](const auto& other) {
        return is_near(x, samples[static_cast<std::size_t>(other.second)].x, bottom);
      };
      if (of_bottoms && std::any_of(known.begin(), known.begin() + static_cast<std::ptrdiff_t>(k), is_near_known))
        continue;
      if (std::none_of(best.begin(), best.end(), [&](const Point& y) { return is_near(x, y, apart); }))
        best.push_back(x);
    }
  return best;
}

template <class Function>
void GroupSearch::each_side(Function f) const {
  std::size_t side = 0;
  for (std::size_t level = 0; level < levels_.size(); ++level)
    for (const double sign : {1.0, -1.0})
      if (!levels_[level].axes.empty()) f(side++, static_cast<int>(level), sign);
}

std::vector<Point> GroupSearch::compose() {
  std::vector<Point> next;
  each_side([&](std::size_t side, int level, double sign) {
    const Point& base = composed_.empty() ? centre_ : composed_[side];
    next.push_back(base);
    for (std::size_t g = 0; g < groups_.size(); ++g)
      if (const std::vector<Point> best = list_best(base, g, level, sign, 1); !best.empty())
        for (const int i : groups_[g]) next.back()[i] = best.front()[i];
  });
  return composed_ = next;
}

std::vector<GroupSearch::Start> GroupSearch::list_starts(std::size_t count) const {
  std::vector<Start> starts;
  each_side([&](std::size_t side, int level, double sign) {
    for (std::size_t g = 0; g < groups_.size(); ++g)
      for (const Point& best : list_best(centre_, g, level, sign, count)) {
        starts.push_back({level, sign, g, composed_[side]});
        for (const int i : groups_[g]) starts.back().x[i] = best[i];
      }
  });
  return starts;
}

}  // namespace topple::uncertainty
