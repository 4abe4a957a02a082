#include "uncertainty/sensitivity.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include "base/error.h"
#include "uncertainty/cut_program.h"
#include "uncertainty/local_search.h"
#include "uncertainty/measures.h"

namespace topple::uncertainty {
namespace {

/// Values of one quantity over the design: rows of A, B, and A with one column from B.
struct Columns {
  std::vector<double> a, b;
  std::vector<std::vector<double>> mixed;  // per input
};

/// What rounding may make of values of size 1 that are sums or statistics of some hundred numbers, and the part of a
/// variance.
constexpr double rounding_of_values = 64 * std::numeric_limits<double>::epsilon(), rounding = 1e-28;

/// Takes off a common value and the common size of what is left: then sizes do not matter, neither for squares nor for
/// rounding. Values that differ by no more than rounding become 0. By powers of 2 first, which keep every bit.
void normalise(const std::vector<std::vector<double>*>& columns) {
  double largest = 0;
  for (const auto* c : columns)
    for (const double v : *c) largest = std::max(largest, std::abs(v));
  if (!(largest > 0)) return;
  const int exponent = std::ilogb(largest) + 1;
  const double reference = std::ldexp(columns.front()->front(), -exponent);
  double size = 0;
  for (auto* c : columns)
    for (double& v : *c) v = std::ldexp(v, -exponent) - reference, size = std::max(size, std::abs(v));
  const bool is_constant = size <= rounding_of_values;
  for (auto* c : columns)
    for (double& v : *c) v = is_constant ? 0 : v / size;
}

/// Indices from the rows [first, last), in parts of the variance `whole`; 0: in parts of that of these rows.
void calc_indices(const Columns& c, std::size_t first, std::size_t last, double whole, std::vector<double>& one,
                  std::vector<double>& total) {
  double mean = 0, square = 0;
  const double count = static_cast<double>(last - first);
  for (std::size_t k = first; k < last; ++k) mean += c.a[k] + c.b[k];
  mean /= 2 * count;
  for (std::size_t k = first; k < last; ++k)
    square += (c.a[k] - mean) * (c.a[k] - mean) + (c.b[k] - mean) * (c.b[k] - mean);
  const double variance = whole > 0 ? whole : square / (2 * count);
  one.assign(c.mixed.size(), 0.0);
  total.assign(c.mixed.size(), 0.0);
  if (!(variance > rounding)) return;
  for (std::size_t i = 0; i < c.mixed.size(); ++i) {
    double u = 0, t = 0;
    for (std::size_t k = first; k < last; ++k) {
      u += (c.b[k] - mean) * (c.mixed[i][k] - c.a[k]);
      t += (c.a[k] - c.mixed[i][k]) * (c.a[k] - c.mixed[i][k]);
    }
    one[i] = u / count / variance;
    total[i] = 0.5 * t / count / variance;
  }
}

/// Of the rows in which an input changes something: how many they are, and what one of them changes (squares).
struct Rows {
  std::size_t count = 0;
  double one = 0;
};
Rows count_rows(const Columns& c) {
  double sum = 0, squares = 0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < c.a.size(); ++k) {
    double change = 0;
    for (const auto& m : c.mixed) change += (c.a[k] - m[k]) * (c.a[k] - m[k]);
    sum += change, squares += change * change, count += change > 0;
  }
  // none: one would change what is normalised by 1 at most
  return sum > 0 ? Rows{count, squares / sum} : Rows{0, 1};
}

double calc_variance(const std::vector<std::vector<double>*>& columns) {
  double mean = 0, square = 0, count = 0;
  for (const auto* column : columns)
    for (const double v : *column) mean += v, ++count;
  mean /= count;
  for (const auto* column : columns)
    for (const double v : *column) square += (v - mean) * (v - mean);
  return square / count;
}

std::vector<Driver> calc_drivers(Columns c) {
  constexpr std::size_t blocks = 8;
  constexpr std::size_t few_rows = 4 * blocks;
  std::vector<Driver> drivers(c.mixed.size());
  std::vector<double> one, total;
  if (c.a.size() < 2) return drivers;
  std::vector<std::vector<double>*> columns = {&c.a, &c.b};
  for (auto& m : c.mixed) columns.push_back(&m);
  normalise(columns);
  // Where few rows tell all, as of a rare outcome, A and B may have missed it, blocks without it have a share of 0 and
  // those with it one of their own variance. All columns know more of the variance, and one row more or less is an
  // error.
  const Rows rows = count_rows(c);
  const double of_all = calc_variance(columns);
  const bool are_few = rows.count < std::min(few_rows, c.a.size()) && of_all > rounding;
  const double variance = are_few ? of_all : 0;
  calc_indices(c, 0, c.a.size(), variance, one, total);
  for (std::size_t i = 0; i < drivers.size(); ++i) drivers[i].first = one[i], drivers[i].total = total[i];
  if (c.a.size() < 2 * blocks) return drivers;
  std::vector<std::vector<double>> ones, totals;
  for (std::size_t b = 0; b < blocks; ++b) {
    calc_indices(c, b * c.a.size() / blocks, (b + 1) * c.a.size() / blocks, variance, one, total);
    ones.push_back(one), totals.push_back(total);
  }
  const auto error = [&](const std::vector<std::vector<double>>& of_block, std::size_t i) {
    double mean = 0, sum = 0;
    for (const auto& b : of_block) mean += b[i] / blocks;
    for (const auto& b : of_block) sum += (b[i] - mean) * (b[i] - mean);
    return std::sqrt(sum / (blocks - 1) / blocks);
  };
  const double row = are_few ? rows.one / (static_cast<double>(c.a.size()) * variance) : 0;
  for (std::size_t i = 0; i < drivers.size(); ++i) {
    drivers[i].first_error = std::hypot(error(ones, i), row);
    drivers[i].total_error = std::hypot(error(totals, i), row / 2);
  }
  return drivers;
}

/// Values in the order of one input, with their mean and variance.
struct Ordered {
  std::vector<double> y;
  double mean = 0, variance = 0;
};

/// Share of a variance by one input: what is left inside bins of that input. The bin's mean takes 1/size of its
/// variance if samples are independent, and almost nothing if they are spread evenly: the share is the middle of both
/// cases, and half their distance is part of its error, beside the scatter over bins.
Driver calc_share_by_bins(const Ordered& o, std::size_t bins) {
  const std::size_t count = o.y.size();
  struct Bin {
    double weight, inside, whole;  // part of the samples; variance about the bin's mean and about that of all
  };
  std::vector<Bin> list;
  double rest = 0, doubt = 0;
  for (std::size_t b = 0; b < bins; ++b) {
    const std::size_t first = b * count / bins, last = (b + 1) * count / bins;
    const double size = static_cast<double>(last - first);
    double middle = 0;
    for (std::size_t k = first; k < last; ++k) middle += o.y[k] / size;
    Bin bin{size / static_cast<double>(count), 0, 0};
    for (std::size_t k = first; k < last; ++k) {
      bin.inside += (o.y[k] - middle) * (o.y[k] - middle) / size;
      bin.whole += (o.y[k] - o.mean) * (o.y[k] - o.mean) / size;
    }
    const double independent = bin.inside * size / (size - 1);
    doubt += 0.5 * bin.weight * (independent - bin.inside);
    bin.inside = 0.5 * (bin.inside + independent);
    rest += bin.weight * bin.inside;
    list.push_back(bin);
  }
  Driver d{0, std::numeric_limits<double>::quiet_NaN(), 0, std::numeric_limits<double>::quiet_NaN()};
  d.first = 1 - rest / o.variance;
  // inside - (1 - S) whole is 0 in the mean; its scatter over the bins is that of the share
  double sum = 0;
  for (const Bin& b : list) sum += std::pow(b.weight * (b.inside - (1 - d.first) * b.whole) / o.variance, 2);
  const double many = static_cast<double>(bins);
  d.first_error = std::hypot(std::sqrt(sum * many / (many - 1)), doubt / o.variance);
  return d;
}

/// The mean of three shares: of about as many bins as there are samples in each, one less and one more. Spread points
/// may line up with bins of one number: how far the shares lie apart is part of the error.
Driver calc_share(const std::vector<double>& x, std::vector<double> y) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::size_t count = x.size(), bins = static_cast<std::size_t>(std::sqrt(static_cast<double>(count)));
  if (bins < 3) return {nan, nan, nan, nan};
  normalise({&y});
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return x[a] < x[b]; });
  Ordered o;
  for (const std::size_t k : order) o.y.push_back(y[k]);
  for (const double v : y) o.mean += v / static_cast<double>(count);
  for (const double v : y) o.variance += (v - o.mean) * (v - o.mean) / static_cast<double>(count - 1);
  Driver d{0, nan, 0, nan};
  if (!(o.variance > rounding)) return d;
  const Driver shares[] = {calc_share_by_bins(o, bins - 1), calc_share_by_bins(o, bins),
                           calc_share_by_bins(o, bins + 1)};
  for (const Driver& s : shares) d.first += s.first / 3, d.first_error += s.first_error / 3;
  double apart = 0;
  for (const Driver& s : shares) apart += (s.first - d.first) * (s.first - d.first) / 2;
  d.first_error = std::hypot(d.first_error, std::sqrt(apart));
  return d;
}

}  // namespace

Sensitivity read_drivers(const Space& space, const Archive& archive, const std::vector<int>& samples) {
  Sensitivity s;
  const std::size_t n = space.inputs.size();
  std::vector<int> done;
  std::set<int> outcomes;
  std::size_t outputs = 0;
  for (const int i : samples) {
    outcomes.insert(outcome_of(archive[i].result));
    if (archive[i].result.state != Result::State::Done) continue;
    done.push_back(i);
    outputs = archive[i].result.values.size();
  }
  s.rows = static_cast<int>(samples.size());
  s.rows_used = static_cast<int>(done.size());
  const auto collect = [&](const std::vector<int>& list, const auto& value) {
    std::vector<Driver> drivers;
    std::vector<double> x(list.size()), y;
    for (const int i : list) y.push_back(value(archive[i].result));
    for (std::size_t k = 0; k < n; ++k) {
      for (std::size_t j = 0; j < list.size(); ++j) x[j] = archive[list[j]].x[k];
      const bool is_fuzzy = space.inputs[k].width() > 0;
      drivers.push_back(is_fuzzy ? calc_share(x, y) : Driver{});
    }
    return drivers;
  };
  for (std::size_t o = 0; o < outputs; ++o)
    s.outputs.push_back(collect(done, [o](const Result& r) { return r.values[o]; }));
  for (const int outcome : outcomes) {
    OutcomeDrivers d;
    d.outcome = outcome;
    for (const int i : samples) d.share += outcome_of(archive[i].result) == outcome;
    d.share /= static_cast<double>(samples.size());
    d.inputs = collect(samples, [outcome](const Result& r) { return outcome_of(r) == outcome ? 1.0 : 0.0; });
    s.outcomes.push_back(std::move(d));
  }
  return s;
}

std::vector<Rank> calc_ranks(const std::vector<Driver>& drivers) {
  std::vector<Rank> ranks;
  for (const Driver& d : drivers) {
    Rank r{1, static_cast<int>(drivers.size())};
    for (const Driver& other : drivers) {
      const double apart = 2 * std::hypot(d.first_error, other.first_error);
      r.best += other.first - d.first > apart;
      r.worst -= d.first - other.first > apart;
    }
    ranks.push_back(r);
  }
  return ranks;
}

namespace {

/// Within planes of an outcome the places of a space with an input known that are most possible, a little off the
/// planes and less so.
std::vector<Point> find_most_possible(const Space& known, const Space& space,
                                      const std::vector<Boundary::Plane>& planes) {
  const Region support = make_region(space, 0), slice = make_region(known, 0);
  const Point corner = slice.box.lower;
  std::vector<Point> places;
  for (const double margin : {1e-5, 1e-7}) {
    std::vector<HalfSpace> sides;
    for (const Boundary::Plane& p : planes) {
      HalfSpace side{{}, p.side.b - margin};
      for (std::size_t k = 0; k < support.axes.size(); ++k) {
        const int i = support.axes[k];
        side.b -= p.side.a[k] * corner[i] / support.scale[i];
        if (std::find(slice.axes.begin(), slice.axes.end(), i) != slice.axes.end()) side.a.push_back(p.side.a[k]);
      }
      sides.push_back(std::move(side));
    }
    places.push_back(uncertainty::find_most_possible(known, support.scale, slice.axes, corner, 1, sides));
  }
  return places;
}

}  // namespace

std::vector<Fixed> find_outcomes_of_knowing(const Space& space, Asker& asker, const PossibilityOptions& options,
                                            int limit, const std::vector<Fixed>& earlier, const Facets& facets) {
  check_space(space);
  std::vector<Fixed> effects;
  const int whole_limit = asker.limit();
  for (int i = 0; i < space.size() && !asker.is_cancelled(); ++i) {
    if (!(space.inputs[i].width() > 0)) continue;  // it is known
    const double core = space.inputs[i].centre();
    Space known = space;
    known.inputs[i] = FuzzyNumber(core);
    asker.set_limit(std::min(whole_limit, asker.asked() + limit));
    // of each class the samples that would be the most possible ones there
    std::map<int, std::vector<std::pair<double, int>>> best;
    std::map<int, std::pair<double, int>> most;  // of all samples
    for (int k = 0; k < asker.asked(); ++k) {
      Point x = asker.archive()[k].x;
      x[i] = core;
      const int outcome = outcome_of(asker.archive()[k].result);
      best[outcome].emplace_back(-calc_membership(known, x), k);
      auto& top = most.try_emplace(outcome, -1.0, -1).first->second;
      if (const double mu = calc_membership(space, asker.archive()[k].x); mu > top.first) top = {mu, k};
    }
    std::vector<Point> points = {calc_centre(known)};
    const auto add = [&](Point x) {
      x[i] = core;
      if (!space.has_interaction() || calc_membership(known, x) > 0) points.push_back(std::move(x));
    };
    // the search from the best of them finds more than all of them do; where none is of the class, others may be
    const std::size_t each = std::clamp<std::size_t>(static_cast<std::size_t>(limit) / (4 * best.size() + 1), 2,
                                                     4 * static_cast<std::size_t>(space.size()));
    for (auto& [outcome, list] : best) {
      std::stable_sort(list.begin(), list.end());
      for (std::size_t k = 0; k < std::min(each, list.size()); ++k) add(asker.archive()[list[k].second].x);
      const std::size_t others = list.size() > each ? std::min(each, list.size() - each) : 0;
      for (std::size_t k = 0; k < others; ++k)
        add(asker.archive()[list[each + k * (list.size() - each) / others].second].x);
    }
    // where a class is most possible with all inputs fuzzy it often is so here, farther out
    for (const auto& [outcome, top] : most)
      if (top.first < 1)
        for (Point& x : make_ray(space, asker.archive()[top.second].x, 9)) add(std::move(x));
    for (const auto& [outcome, planes] : facets.planes)
      for (Point& x : find_most_possible(known, space, planes))
        if (calc_membership(known, x) > 0) add(std::move(x));
    asker.ask(points);
    Fixed f;
    f.input = i;
    PossibilityOptions o = options;
    for (const Fixed& before : earlier)
      if (before.input == i) o.known = before.classes;
    f.classes = find_possibilities(known, asker, o).classes;
    effects.push_back(std::move(f));
  }
  asker.set_limit(whole_limit);
  return effects;
}

std::vector<Point> make_driver_points(const Space& space, const SensitivityOptions& options) {
  const std::size_t n = space.inputs.size();
  const Box box = make_box(space, options.alpha);
  std::vector<Point> points;
  for (const auto& u : make_sobol_points(static_cast<int>(2 * n), 1, options.rows, options.seed + 2)) {
    const Point a = place_in(box, Point(u.begin(), u.begin() + static_cast<long>(n)));
    const Point b = place_in(box, Point(u.begin() + static_cast<long>(n), u.end()));
    points.push_back(a);
    points.push_back(b);
    for (std::size_t i = 0; i < n; ++i) {
      points.push_back(a);
      points.back()[i] = b[i];
    }
  }
  return points;
}

Sensitivity find_drivers(const Space& space, Asker& asker, const SensitivityOptions& options) {
  check_space(space);
  if (space.has_interaction())
    throw InputError("E811", "sensitivity: indices need inputs that vary on their own; there is interaction",
                     "use the effect of knowing each input instead");
  if (options.rows < 16) throw InputError("E811", fmt::format("sensitivity: {} rows; at least 16", options.rows));
  const std::size_t n = space.inputs.size();
  const auto indices = asker.ask(make_driver_points(space, options));
  Sensitivity s;
  // rows that ran, and those in which nothing failed
  std::vector<std::size_t> ran, clean;
  std::set<int> outcomes;
  for (std::size_t row = 0; row < static_cast<std::size_t>(options.rows); ++row) {
    bool all = true, done = true;
    for (std::size_t k = 0; k < n + 2; ++k) {
      const int i = indices[row * (n + 2) + k];
      all = all && i >= 0;
      if (i < 0) break;
      done = done && asker.archive()[i].result.state == Result::State::Done;
      outcomes.insert(outcome_of(asker.archive()[i].result));
    }
    if (!all) continue;
    ran.push_back(row);
    if (done) clean.push_back(row);
  }
  s.rows = static_cast<int>(ran.size());
  s.rows_used = static_cast<int>(clean.size());
  const auto collect = [&](const std::vector<std::size_t>& rows, const auto& value) {
    Columns c;
    c.mixed.resize(n);
    for (const std::size_t row : rows) {
      const auto at = [&](std::size_t k) { return value(asker.archive()[indices[row * (n + 2) + k]].result); };
      c.a.push_back(at(0));
      c.b.push_back(at(1));
      for (std::size_t i = 0; i < n; ++i) c.mixed[i].push_back(at(2 + i));
    }
    return c;
  };
  if (!clean.empty())
    for (int o = 0; o < asker.outputs(); ++o)
      s.outputs.push_back(calc_drivers(collect(clean, [o](const Result& r) { return r.values[o]; })));
  for (const int outcome : outcomes) {
    const Columns c = collect(ran, [outcome](const Result& r) { return outcome_of(r) == outcome ? 1.0 : 0.0; });
    OutcomeDrivers d;
    d.outcome = outcome;
    for (std::size_t k = 0; k < c.a.size(); ++k) d.share += (c.a[k] + c.b[k]) / (2.0 * static_cast<double>(c.a.size()));
    d.inputs = calc_drivers(c);
    s.outcomes.push_back(std::move(d));
  }
  return s;
}

std::vector<Fixed> find_effects_of_knowing(const Space& space, Asker& asker, const AlphaResult& all,
                                           const AlphaOptions& options, int limit) {
  check_space(space);
  std::vector<Fixed> effects;
  const int whole_limit = asker.limit();
  for (int i = 0; i < space.size() && !asker.is_cancelled(); ++i) {
    Space known = space;
    known.inputs[i] = FuzzyNumber(space.inputs[i].centre());
    asker.set_limit(std::min(whole_limit, asker.asked() + limit));
    AlphaOptions o = options;
    o.patience = 1;
    o.search_classes = false;
    o.watch = nullptr;
    const AlphaResult r = optimise(known, asker, o);
    Fixed f;
    f.input = i;
    for (std::size_t k = 0; k < all.outputs.size(); ++k) {
      const bool has = k < r.outputs.size() && all.outputs[k].levels[0].lower.sample >= 0;
      const FuzzyNumber before = has ? make_number(all.outputs[k]) : FuzzyNumber();
      const FuzzyNumber after = has ? make_number(r.outputs[k]) : FuzzyNumber();
      const double entropy = calc_entropy(before);
      f.width.push_back(before.width() > 0 ? after.width() / before.width() : 0);
      f.entropy.push_back(entropy > 0 ? calc_entropy(after) / entropy : 0);
    }
    PossibilityOptions p;
    p.seed = options.seed;
    for (auto& c : find_possibilities(known, asker, p).classes)
      if (c.possibility > 0) f.classes.push_back(c);
    effects.push_back(std::move(f));
  }
  asker.set_limit(whole_limit);
  return effects;
}

}  // namespace topple::uncertainty
