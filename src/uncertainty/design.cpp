#include "uncertainty/design.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "base/error.h"
#include "uncertainty/box_growth.h"
#include "uncertainty/measures.h"
#include "uncertainty/random.h"

namespace topple::uncertainty {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

void check_options(const DesignOptions& o) {
  const auto demand = [](bool good, const char* text) {
    if (!good) throw InputError("E809", fmt::format("cluster design: {}", text));
  };
  demand(o.k_max >= 2, "k_max is at least 2");
  demand(o.cluster_points >= 10 && o.cluster_points <= 5000, "cluster_points lies between 10 and 5000");
  demand(o.edge > 0 && o.edge < 0.5, "edge lies between 0 and 0.5");
  demand(o.fresh >= 1, "fresh is at least 1");
  demand(o.confidence > 0 && o.confidence < 1, "confidence lies between 0 and 1");
}

/// At most this part of a box violates whose fresh points have all passed: shares of 1 - confidence for every try that
/// could come, 6/(π T)² for the T-th, add up to all of it.
double bound_violating(const PermissibleBox& b, double confidence) {
  const double share = 6 / std::pow(std::numbers::pi * b.tries, 2);
  return 1 - std::pow((1 - confidence) * share, 1.0 / b.fresh);
}

std::vector<FuzzyNumber> make_inputs(const Box& box, const Point& core) {
  std::vector<FuzzyNumber> inputs;
  for (std::size_t i = 0; i < core.size(); ++i) inputs.push_back(make_triangular(box.lower[i], core[i], box.upper[i]));
  return inputs;
}

/// Part of the support's volume.
double calc_part(const Box& box, const Box& support) {
  double part = 1;
  for (std::size_t i = 0; i < box.lower.size(); ++i)
    if (support.upper[i] > support.lower[i])
      part *= (box.upper[i] - box.lower[i]) / (support.upper[i] - support.lower[i]);
  return part;
}

/// The inputs of a box with what ties them together; the degree of the joint membership does not count in a box.
Space make_inner(const Space& space, const std::vector<FuzzyNumber>& inputs) {
  Space inner{inputs, space.constraints, {}};
  if (space.joint)
    inner.constraints.emplace_back([joint = space.joint](const Point& x) {
      const double mu = joint(x);
      return mu > 0 ? -mu : 1.0;
    });
  return inner;
}

/// The box as fuzzy input, with at most so many runs.
void analyse(const Space& space, Asker& asker, const DesignOptions& options, PermissibleBox& b, int runs) {
  const Space inner = make_inner(space, b.inputs);
  AlphaOptions o = make_thrifty_options();
  o.levels = options.levels;
  o.seed = options.seed;
  // fewer runs end no search, and points spread over the box tell more of it
  constexpr int least_searching = 20;  // runs for each output and input
  runs = std::min(runs, asker.rest());
  if (runs > 0 && runs >= least_searching * asker.outputs() * static_cast<int>(b.inputs.size())) o.budget = runs;
  const int limit = asker.limit();
  asker.set_limit(std::min(limit, asker.asked() + runs));
  b.outputs = optimise(inner, asker, o).outputs;
  asker.set_limit(limit);
}

bool has_open_bounds(const PermissibleBox& b) {
  return std::ranges::any_of(b.outputs, [](const OutputBounds& o) {
    return std::ranges::any_of(o.levels, [](const LevelBounds& l) { return !l.lower.converged || !l.upper.converged; });
  });
}

class Design {
 public:
  Design(const Space& space, Asker& asker, const Requirement& requirement, const DesignOptions& options)
      : space_(space), asker_(asker), requirement_(requirement), options_(options), support_(make_box(space, 0)) {
    for (int i = 0; i < space.size(); ++i)
      if (support_.upper[i] > support_.lower[i]) axes_.push_back(i);
    smallest_ = calc_smallest(options.smallest, support_);
  }

  DesignResult run() {
    spread();
    const std::vector<int> good = find_samples(true), bad = find_samples(false);
    result_.permissible_samples = thin(good), result_.forbidden_samples = thin(bad);
    result_.permissible_groups = group(result_.permissible_samples);
    result_.forbidden_groups = group(result_.forbidden_samples);
    std::vector<int> centres;
    for (std::size_t g = 0; g < result_.permissible_groups.centre.size(); ++g) centres.push_back(find_start(g, bad));
    const int n = static_cast<int>(axes_.size());
    const int wanted = options_.growth_points > 0 ? options_.growth_points : 100 * n * n;
    for (std::size_t g = 0; g < centres.size(); ++g) {
      const int share = asker_.rest() / static_cast<int>(centres.size() - g);
      // growing may take more than there is; what it has learnt then serves a choice
      const int end = asker_.asked() + share;
      int tries = std::max(options_.tried, 0);
      const bool grows = share >= wanted;
      if (!grows || !grow(static_cast<int>(g), centres[g], 7 * share / 10, tries))
        choose(static_cast<int>(g), centres[g], std::max(0, end - asker_.asked()), tries, grows);
    }
    for (PermissibleBox& b : boxes_) result_.boxes.push_back(std::move(b));
    review_boxes(space_, result_.boxes, requirement_, asker_.archive(), options_);
    for (int i = 0; i < asker_.asked(); ++i) {
      if (!is_possible(i)) continue;
      const double m = margin_of(i);
      ++(m == -infinite ? result_.failed : m >= 0 ? result_.permissible : result_.forbidden);
    }
    result_.ending = asker_.is_cancelled() ? Ending::Cancelled
                     : asker_.rest() == 0  ? Ending::LimitReached
                                           : Ending::Complete;
    return std::move(result_);
  }

 private:
  /// The requirement at a sample, -infinite where the run failed.
  double margin_of(int sample) {
    while (static_cast<int>(margins_.size()) <= sample) {
      const Result& r = asker_.archive()[static_cast<int>(margins_.size())].result;
      const double m = r.state == Result::State::Done ? requirement_(r) : -infinite;
      margins_.push_back(std::isnan(m) ? -infinite : m);
    }
    return margins_[sample];
  }
  bool is_good(int sample) { return sample >= 0 && margin_of(sample) >= 0; }
  /// Whether a point counts: in the support, and nothing that ties the inputs excludes it.
  bool is_possible(const Point& x) const { return is_in_cut(space_, support_, 0, x); }
  bool is_possible(int sample) {
    while (static_cast<int>(possible_.size()) <= sample)
      possible_.push_back(is_possible(asker_.archive()[static_cast<int>(possible_.size())].x));
    return possible_[sample];
  }
  bool is_violating(int sample) { return is_possible(sample) && !is_good(sample); }

  std::vector<int> find_samples(bool good) {
    std::vector<int> found;
    for (int i = 0; i < asker_.asked(); ++i)
      if (is_possible(i) && is_good(i) == good) found.push_back(i);
    return found;
  }

  /// The sample of a group of permissible runs at which a box begins: its medoid, unless a violating run lies within
  /// `edge` of it, where no box has room; then the one that is farthest from all violating runs.
  int find_start(std::size_t g, const std::vector<int>& bad) const {
    const Grouping& groups = result_.permissible_groups;
    const auto clearance_of = [&](int sample) {
      double least = infinite;
      for (const int other : bad) {
        double apart = 0;  // along the axis along which they are farthest, of the support's width
        for (const int i : axes_)
          apart = std::max(apart, std::abs(asker_.archive()[sample].x[i] - asker_.archive()[other].x[i]) /
                                      (support_.upper[i] - support_.lower[i]));
        least = std::min(least, apart);
      }
      return least;
    };
    int start = result_.permissible_samples[static_cast<std::size_t>(groups.centre[g])];
    double most = clearance_of(start);
    if (most > options_.edge) return start;
    for (std::size_t k = 0; k < result_.permissible_samples.size(); ++k) {
      if (groups.group[k] != static_cast<int>(g)) continue;
      if (const double clearance = clearance_of(result_.permissible_samples[k]); clearance > most)
        most = clearance, start = result_.permissible_samples[k];
    }
    return start;
  }

  void spread() {
    const int n = static_cast<int>(axes_.size());
    const int count = options_.space_points > 0 ? options_.space_points : 200 * n;
    std::vector<Point> points;
    if (n == 0) points.push_back(calc_centre(space_));
    for (const auto& u : n == 0 ? std::vector<Point>{} : make_sobol_points(n, 1, count, options_.seed + 1)) {
      Point fractions(space_.inputs.size(), 0.0);
      for (int i = 0; i < n; ++i) fractions[axes_[i]] = u[i];
      Point x = place_in(support_, fractions);
      if (is_possible(x)) points.push_back(std::move(x));
    }
    int done = 0, good = 0;
    for (const int i : asker_.ask(points)) {
      done += i >= 0;
      good += is_good(i);
    }
    if (done > 0) {
      result_.fraction = static_cast<double>(good) / done;
      result_.spread = done;
      const double p = (good + 1.0) / (done + 2);  // four of four are no certainty
      result_.fraction_error = std::sqrt(p * (1 - p) / (done + 2));
    }
  }

  /// At most `cluster_points` of them, evenly picked.
  std::vector<int> thin(const std::vector<int>& all) const {
    const std::size_t limit = static_cast<std::size_t>(options_.cluster_points);
    if (all.size() <= limit) return all;
    std::vector<int> some;
    for (std::size_t k = 0; k < limit; ++k) some.push_back(all[k * all.size() / limit]);
    return some;
  }

  Grouping group(const std::vector<int>& samples) const {
    std::vector<Point> points;
    for (const int s : samples) {
      Point u;
      for (const int i : axes_)
        u.push_back((asker_.archive()[s].x[i] - support_.lower[i]) / (support_.upper[i] - support_.lower[i]));
      points.push_back(std::move(u));
    }
    return find_groups(points, options_.clustering, options_.k_max);
  }

  /// Points that do not count violate nothing and are not run.
  std::vector<Verdict> judge(const std::vector<Point>& points) {
    std::vector<Verdict> verdicts(points.size(), Verdict::Permissible);
    std::vector<Point> counting;
    std::vector<std::size_t> place;
    for (std::size_t k = 0; k < points.size(); ++k)
      if (!space_.has_interaction() || is_possible(points[k])) counting.push_back(points[k]), place.push_back(k);
    const std::vector<int> samples = asker_.ask(counting);
    for (std::size_t k = 0; k < samples.size(); ++k)
      if (!is_good(samples[k])) verdicts[place[k]] = samples[k] < 0 ? Verdict::NotRun : Verdict::Violating;
    return verdicts;
  }

  /// Of a group's points, others where it is searched again.
  std::uint64_t seed_of(int g, bool again) const {
    const std::uint64_t searches = (options_.tried < 0 ? 0 : 2) + (again ? 1 : 0);
    return options_.seed + 104729 * static_cast<std::uint64_t>(g + 1) + 15485863 * searches;
  }

  /// True if the box is kept, or that of another group.
  ///   tries  of this group so far
  bool grow(int g, int centre, int share, int& tries) {
    const int limit = asker_.limit();
    asker_.set_limit(std::min(limit, asker_.asked() + share));
    PermissibleBox b;
    b.group = g, b.centre = centre;
    const Point middle = asker_.archive()[centre].x;
    BoxGrowth growth(
        support_, middle, [this](const std::vector<Point>& points) { return judge(points); },
        [this](const Point& x) { return is_possible(x); },
        {options_.edge, smallest_, options_.rounds, seed_of(g, false)});
    for (int seen = 0; !b.kept;) {
      for (; seen < asker_.asked(); ++seen)
        if (is_violating(seen)) growth.add_violating(asker_.archive()[seen].x);
      const bool grown = growth.grow();
      b.box = growth.box();
      b.volume = growth.calc_part();
      if (!grown) break;
      b.tries = ++tries;
      const auto fresh = growth.make_random_points(options_.fresh);
      if (!growth.check(fresh)) {
        if (!asker_.can_go_on()) break;
        continue;
      }
      b.fresh_points = fresh;
      b.fresh = static_cast<int>(fresh.size());
      b.inputs = make_inputs(b.box, middle);
      if (options_.rerun_limit > 0) analyse(space_, asker_, options_, b, options_.rerun_limit);
      b.kept = !has_violation(b.box) && !asker_.is_cancelled();
      if (!asker_.can_go_on()) break;
    }
    asker_.set_limit(limit);
    if (is_known(b.box)) return true;
    if (!b.kept) return false;
    b.violating = bound_violating(b, options_.confidence);
    boxes_.push_back(std::move(b));
    return true;
  }

  /// With few runs: the largest box that keeps out what is known to violate, tried at its corners and at fresh points;
  /// what violates there is kept out of the next one, by a distance that grows as runs are spent.
  ///   again  after one that was grown in vain
  void choose(int g, int centre, int share, int tries, bool again) {
    PermissibleBox b, broken;  // broken: passed at its fresh points, and a later run violates
    b.group = g, b.centre = centre;
    const Point middle = asker_.archive()[centre].x;
    b.box = {middle, middle};
    const int limit = asker_.limit(), end = asker_.asked() + share;
    asker_.set_limit(std::min(limit, end));
    b.tries = tries;
    Random random(seed_of(g, again));
    Front front(middle);
    constexpr double coarse = 0.05, widest = 0.15;  // of the support's widths
    BoxGrowth corners(
        support_, middle, [this](const std::vector<Point>& points) { return judge(points); },
        [this](const Point& x) { return is_possible(x); }, {coarse, smallest_, options_.rounds, 1});
    const int start = asker_.asked();
    for (int seen = 0, last = -1; !b.kept && asker_.can_go_on();) {
      // nothing was found that could be run: nor will it be
      if (last == asker_.asked()) break;
      last = asker_.asked();
      for (; seen < asker_.asked(); ++seen)
        if (is_violating(seen)) front.add(asker_.archive()[seen].x);
      const double spent = std::min(1.0, (asker_.asked() - start) / std::max(1.0, double(share - options_.fresh)));
      for (double margin = options_.edge + widest * spent * spent;; margin = std::max(options_.edge, 0.5 * margin)) {
        b.box = find_largest_box(support_, front, margin, 4, options_.seed + static_cast<std::uint64_t>(b.tries));
        b.volume = calc_part(b.box, support_);
        if (b.volume >= smallest_ || margin <= options_.edge) break;
      }
      if (b.volume < smallest_ || asker_.rest() < options_.fresh) break;
      // with very few runs all of them are for fresh points
      if (axes_.size() <= most_corner_axes && (12 << axes_.size()) <= share) {
        // first to learn where the boundary is, then to come to an end
        const Box whole = b.box;
        const bool is_good = spent < 0.5 ? check_corners(b.box, corners) : shrink_to_corners(b.box, middle);
        if (is_good) spread_out(b.box, whole);
        b.volume = calc_part(b.box, support_);
        if (!is_good) continue;
        if (b.volume < smallest_ || asker_.rest() < options_.fresh) break;
      }
      ++b.tries;
      constexpr int at_once = 8;
      b.fresh = 0, b.fresh_points.clear();
      bool good = true;
      while (good && static_cast<int>(b.fresh_points.size()) < options_.fresh) {
        const int wanted = std::min(at_once, options_.fresh - static_cast<int>(b.fresh_points.size()));
        const auto points = make_random_points(b.box, wanted, random);
        good = !points.empty();
        for (const Verdict v : judge(points)) good = good && v == Verdict::Permissible;
        b.fresh_points.insert(b.fresh_points.end(), points.begin(), points.end());
      }
      if (!good) {
        b.fresh_points.clear();
        continue;
      }
      b.fresh = static_cast<int>(b.fresh_points.size());
      b.inputs = make_inputs(b.box, middle);
      // half of what is left, so that another box can be tried if the analysis finds a violation
      if (options_.rerun_limit > 0)
        analyse(space_, asker_, options_, b, std::min(options_.rerun_limit, asker_.rest() / 2));
      b.kept = !has_violation(b.box) && !asker_.is_cancelled();
      if (!b.kept) broken = b;
    }
    asker_.set_limit(limit);
    if (!b.kept && !broken.fresh_points.empty()) {
      broken.tries = b.tries;
      b = std::move(broken);
    }
    if (is_known(b.box)) return;
    if (b.fresh > 0) b.violating = bound_violating(b, options_.confidence);
    boxes_.push_back(std::move(b));
  }

  static constexpr std::size_t most_corner_axes = 6;
  std::vector<Point> make_corners_of(const Box& box) const {
    std::vector<Point> points(std::size_t{1} << axes_.size(), box.lower);
    for (std::size_t k = 0; k < points.size(); ++k)
      for (std::size_t i = 0; i < axes_.size(); ++i)
        if (k >> i & 1) points[k][axes_[i]] = box.upper[axes_[i]];
    return points;
  }

  /// Whether all corners of a box keep the requirement; looks for the boundary on the way in from some that do not.
  bool check_corners(const Box& box, BoxGrowth& search) {
    std::vector<Point> points = make_corners_of(box), broken;
    std::erase_if(points, [this](const Point& x) { return !is_possible(x); });
    const std::vector<Verdict> verdicts = judge(points);
    for (std::size_t k = 0; k < points.size(); ++k)
      if (verdicts[k] == Verdict::Violating) broken.push_back(points[k]);
    constexpr std::size_t most = 3;
    if (broken.size() > most) {
      for (std::size_t k = 0; k < most; ++k) broken[k] = broken[k * broken.size() / most];
      broken.resize(most);
    }
    if (!broken.empty()) search.check(broken);
    return std::all_of(verdicts.begin(), verdicts.end(), [](Verdict v) { return v == Verdict::Permissible; });
  }

  /// Shrinks a box towards a place inside until all its corners keep the requirement, step by step those that did not.
  /// False if little is left of it, or runs are used up.
  bool shrink_to_corners(Box& box, const Point& inside) {
    const Box whole = box;
    constexpr double step = 0.06, least = 0.3;
    std::vector<std::size_t> broken;
    bool is_checked = false;
    for (double part = 1; part > least; part -= is_checked ? 0 : step) {
      for (const int i : axes_) {
        box.lower[i] = inside[i] + part * (whole.lower[i] - inside[i]);
        box.upper[i] = inside[i] + part * (whole.upper[i] - inside[i]);
      }
      const std::vector<Point> all = make_corners_of(box);
      std::vector<std::size_t> which = broken;
      if (which.empty())
        for (std::size_t k = 0; k < all.size(); ++k) which.push_back(k);
      std::vector<Point> points;
      std::erase_if(which, [&](std::size_t k) { return !is_possible(all[k]); });
      for (const std::size_t k : which) points.push_back(all[k]);
      const std::vector<Verdict> verdicts = judge(points);
      const bool was_all = broken.empty();
      broken.clear();
      for (std::size_t k = 0; k < points.size(); ++k) {
        if (verdicts[k] == Verdict::NotRun) return false;
        if (verdicts[k] == Verdict::Violating) broken.push_back(which[k]);
      }
      if (broken.empty() && was_all) return true;
      is_checked = broken.empty();  // the others at this size
    }
    return false;
  }

  /// Moves faces that shrank for the sake of others back towards the whole box, each as far as its corners keep the
  /// requirement; runs for the fresh points are left over.
  void spread_out(Box& box, const Box& whole) {
    for (const double share : {1.0, 0.5, 0.25})
      for (const int i : axes_)
        for (const bool upper : {false, true}) {
          if (asker_.rest() < options_.fresh + (1 << axes_.size())) return;
          Box wider = box;
          double& face = (upper ? wider.upper : wider.lower)[i];
          const double way = (upper ? whole.upper : whole.lower)[i] - face;
          const double width = support_.upper[i] - support_.lower[i];
          if (std::abs(share * way) < options_.edge * width) continue;
          face += share * way;
          if (is_near_violation(wider)) continue;
          std::vector<Point> points = make_corners_of(wider);
          std::erase_if(points, [&](const Point& x) { return x[i] != face || !is_possible(x); });
          const std::vector<Verdict> verdicts = judge(points);
          if (std::all_of(verdicts.begin(), verdicts.end(), [](Verdict v) { return v == Verdict::Permissible; }))
            box = std::move(wider);
        }
  }

  /// Whether a known run violates that is in a box or nearer to it than a box may come.
  bool is_near_violation(Box box) {
    for (const int i : axes_) {
      const double margin = options_.edge * (support_.upper[i] - support_.lower[i]) * (1 - 1e-9);
      box.lower[i] -= margin, box.upper[i] += margin;
    }
    return has_violation(box);
  }

  std::vector<Point> make_random_points(const Box& box, int count, Random& random) const {
    std::vector<Point> points;
    for (int attempt = 0; static_cast<int>(points.size()) < count && attempt < 1000 * count; ++attempt) {
      Point x = box.lower;
      for (const int i : axes_) x[i] = random.next(box.lower[i], box.upper[i]);
      if (is_possible(x)) points.push_back(std::move(x));
    }
    return points;
  }

  /// Whether another group gave the same box.
  bool is_known(const Box& box) const {
    return std::any_of(boxes_.begin(), boxes_.end(), [&](const PermissibleBox& other) {
      for (const int i : axes_) {
        const double near = options_.edge * (support_.upper[i] - support_.lower[i]);
        if (std::abs(other.box.lower[i] - box.lower[i]) > near || std::abs(other.box.upper[i] - box.upper[i]) > near)
          return false;
      }
      return true;
    });
  }

  bool has_violation(const Box& box) {
    for (int i = 0; i < asker_.asked(); ++i)
      if (box.contains(asker_.archive()[i].x) && is_violating(i)) return true;
    return false;
  }

  const Space& space_;
  Asker& asker_;
  const Requirement& requirement_;
  const DesignOptions& options_;
  double smallest_ = 0;  // part of the support's volume
  Box support_;
  std::vector<int> axes_;
  std::vector<double> margins_;
  std::vector<bool> possible_;  // of samples, as far as they were asked for
  std::vector<PermissibleBox> boxes_;
  DesignResult result_;
};

}  // namespace

namespace {

/// What all runs say of boxes.
class Review {
 public:
  Review(const Space& space, const Requirement& requirement, const Archive& archive, const DesignOptions& options)
      : space_(space), archive_(archive), options_(options), support_(make_box(space, 0)) {
    smallest_ = calc_smallest(options.smallest, support_);
    for (const Sample& s : archive.samples()) {
      possible_.push_back(is_in_cut(space, support_, 0, s.x));
      if (!possible_.back()) {
        margins_.push_back(-infinite);
        continue;
      }
      const double m = s.result.state == Result::State::Done ? requirement(s.result) : -infinite;
      margins_.push_back(std::isnan(m) ? -infinite : m);
      if (margins_.back() == -infinite) continue;
      low_ = std::min(low_, m), high_ = std::max(high_, m);
      const auto& values = s.result.values;
      least_.resize(values.size(), infinite), most_.resize(values.size(), -infinite);
      for (std::size_t o = 0; o < values.size(); ++o)
        least_[o] = std::min(least_[o], values[o]), most_[o] = std::max(most_[o], values[o]);
    }
  }

  void measure(PermissibleBox& b) const {
    count(b);
    if (b.broken > 0 && !b.fresh_points.empty()) {
      b.kept = shrink(b);
      count(b);
    }
    b.kept = b.kept && b.broken == 0;
    double nearest = infinite;
    for (std::size_t i = 0; i < margins_.size(); ++i)
      if (is_inside(b, i)) nearest = std::min(nearest, margins_[i]);
    b.distance = high_ > low_ && nearest < infinite ? std::max(nearest, 0.0) / (high_ - low_) : 0;
    b.robustness = 0;
    const std::size_t o = static_cast<std::size_t>(options_.ranking_output);
    if (!b.kept || o >= b.outputs.size() || b.outputs[o].levels.empty()) return;
    std::vector<double> entropies;
    for (std::size_t i = 0; i < b.inputs.size(); ++i)
      if (const double width = support_.upper[i] - support_.lower[i]; width > 0)
        entropies.push_back(calc_entropy(b.inputs[i], width));
    const double reference = most_[o] > least_[o] ? most_[o] - least_[o] : 1;
    b.robustness = calc_robustness(entropies, calc_entropy(make_number(b.outputs[o]), reference));
  }

 private:
  /// Whether a run counts and lies in the box.
  bool is_inside(const PermissibleBox& b, std::size_t sample) const {
    return possible_[sample] && b.box.contains(archive_[static_cast<int>(sample)].x);
  }

  void count(PermissibleBox& b) const {
    b.samples = b.broken = 0;
    for (std::size_t i = 0; i < margins_.size(); ++i)
      if (is_inside(b, i)) ++b.samples, b.broken += !(margins_[i] >= 0);
  }

  /// To what violations leave. Those of its fresh points that stay inside are as independent of the smaller box. False
  /// if it loses more than half of itself or of them.
  bool shrink(PermissibleBox& b) const {
    const Point& core = archive_[b.centre].x;
    Front front(core);
    for (std::size_t i = 0; i < margins_.size(); ++i)
      if (!(margins_[i] >= 0) && is_inside(b, i)) front.add(archive_[static_cast<int>(i)].x);
    const Box box = find_largest_box(b.box, front, options_.edge, 8, options_.seed);
    const double volume = calc_part(box, support_);
    std::vector<Point> fresh = b.fresh_points;
    std::erase_if(fresh, [&box](const Point& x) { return !box.contains(x); });
    if (volume < std::max(smallest_, 0.5 * b.volume) || 2 * fresh.size() < b.fresh_points.size()) return false;
    b.box = box;
    b.volume = volume;
    b.inputs = make_inputs(box, core);
    b.fresh_points = std::move(fresh);
    b.fresh = static_cast<int>(b.fresh_points.size());
    b.violating = bound_violating(b, options_.confidence);
    if (!b.outputs.empty()) b.outputs = read_archive(make_inner(space_, b.inputs), archive_, options_.levels).outputs;
    return true;
  }

  const Space& space_;
  const Archive& archive_;
  const DesignOptions& options_;
  double smallest_ = 0;  // part of the support's volume
  const Box support_;
  std::vector<double> margins_;  // of samples, -infinite where the run failed
  std::vector<bool> possible_;   // whether they count: nothing that ties the inputs excludes them
  double low_ = infinite, high_ = -infinite;
  std::vector<double> least_, most_;  // of each output over all runs
};

}  // namespace

void review_boxes(const Space& space, std::vector<PermissibleBox>& boxes, const Requirement& requirement,
                  const Archive& archive, const DesignOptions& options) {
  const Review review(space, requirement, archive, options);
  for (PermissibleBox& b : boxes) review.measure(b);
  // places by robustness and by distance are added, those that are alike share one; the larger volume decides a tie
  constexpr double alike = 0.02;  // of the robustness, and of the range of the requirement
  const auto count_better = [&boxes](const auto& is_better) {
    return std::count_if(boxes.begin(), boxes.end(), [&](const PermissibleBox& o) { return o.kept && is_better(o); });
  };
  std::vector<std::pair<long, std::size_t>> order;
  for (std::size_t k = 0; k < boxes.size(); ++k) {
    const PermissibleBox& b = boxes[k];
    order.emplace_back(count_better([&b](const PermissibleBox& o) {
                         return o.robustness > (1 + alike) * b.robustness;
                       }) + count_better([&b](const PermissibleBox& o) { return o.distance > b.distance + alike; }),
                       k);
  }
  std::stable_sort(order.begin(), order.end(), [&boxes](const auto& a, const auto& b) {
    const auto &p = boxes[a.second], &q = boxes[b.second];
    if (p.kept != q.kept) return p.kept;
    return a.first != b.first ? a.first < b.first : p.volume > q.volume;
  });
  std::vector<PermissibleBox> ordered;
  for (const auto& [places, k] : order) ordered.push_back(std::move(boxes[k]));
  boxes = std::move(ordered);
}

void analyse_on(const Space& space, std::vector<PermissibleBox>& boxes, const Requirement& requirement, Asker& asker,
                const DesignOptions& options) {
  constexpr int turns = 3;  // as long as runs inside violate
  review_boxes(space, boxes, requirement, asker.archive(), options);
  for (int turn = 0; turn < turns && asker.can_go_on(); ++turn) {
    const int before = asker.asked();
    const auto is_open = [](const PermissibleBox& b) { return b.kept && has_open_bounds(b); };
    auto open = std::ranges::count_if(boxes, is_open);
    for (PermissibleBox& b : boxes)
      if (is_open(b)) analyse(space, asker, options, b, --open > 0 ? (asker.rest() + 1) / 2 : asker.rest());
    if (asker.asked() == before) break;
    review_boxes(space, boxes, requirement, asker.archive(), options);
  }
}

double calc_smallest(double smallest, const Box& box) {
  int sides = 0;
  for (std::size_t i = 0; i < box.lower.size(); ++i) sides += box.upper[i] > box.lower[i] ? 1 : 0;
  constexpr double few = 3;
  return std::pow(smallest, std::max(1.0, sides / few));
}

DesignResult find_permissible_boxes(const Space& space, Asker& asker, const Requirement& requirement,
                                    const DesignOptions& options) {
  check_space(space);
  check_options(options);
  return Design(space, asker, requirement, options).run();
}

}  // namespace topple::uncertainty
