#include "uncertainty/alpha.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "uncertainty/facets.h"
#include "uncertainty/goal.h"
#include "uncertainty/groups.h"
#include "uncertainty/kink_search.h"
#include "uncertainty/levels.h"
#include "uncertainty/line_search.h"
#include "uncertainty/local_search.h"
#include "uncertainty/starts.h"

namespace topple::uncertainty {
namespace {

/// The state of one optimisation.
class Optimisation {
 public:
  Optimisation(const Space& space, Asker& asker, const AlphaOptions& options)
      : space_(space), asker_(asker), options_(options), levels_(check_levels(options.levels)) {
    for (const double a : levels_) regions_.push_back(make_region(space, a));
    for (const auto& r : regions_) boxes_.push_back(r.box);
  }

  AlphaResult run() {
    explore();
    search_groups();
    check_faces(false);
    if (has_line_searches() && has_room_for_lines()) search_lines(false);
    search_from_best(false);
    if (options_.budget > 0) spread(limit_share(1));
    if (has_many_inputs() || !edges_.empty()) recheck(false);
    if (has_many_inputs()) { restart_until_settled(budget() / 5); }
    return search_on(true);
  }

  AlphaResult go_on() {
    note_new();
    unfinished_ = false;
    recheck(false);
    return search_on(false);
  }

  AlphaResult spread_on(int count) {
    note_new();
    unfinished_ = false;
    new_from_ = asker_.asked();
    const std::vector<double> before = calc_bounds();
    spread(count / count_spread());
    if (!has_many_inputs()) search_dispersed();
    recheck(false);
    note_round(before);
    if (options_.search_classes) recheck(true);
    ++rounds_;
    return conclude();
  }

 private:
  using Key = std::vector<int>;

  /// Rounds from other places, then classes, to the end.
  AlphaResult search_on(bool is_first) {
    const int limit = asker_.limit();
    if (options_.search_classes) {
      // as much for each bound, later for each that is open
      const std::vector<Goal> goals = make_goals(true);
      const auto open = std::count_if(goals.begin(), goals.end(), [&](const Goal& goal) {
        const Candidate best = find_best(goal);
        return is_first || (best.sample >= 0 && !regions_[goal.level].axes.empty() && !is_converged(goal, best));
      });
      const auto all = static_cast<double>(open) + static_cast<double>(make_goals(false).size());
      asker_.set_limit(limit - static_cast<int>(asker_.rest() * static_cast<double>(open) / std::max(all, 1.0)));
    }
    // lines and searches along kinks at the best places that there will be
    const bool has_last_steps = has_line_searches() || !kinked_.empty();
    if (has_last_steps) asker_.set_limit(asker_.limit() - asker_.rest() / 10);
    for (int idle = 0; asker_.can_go_on() && idle < (has_valleys() ? 2 : 1) * options_.patience;) {
      const std::vector<double> before = calc_bounds();
      if (rounds_ > 0) spread(limit_share(0.25));
      if (!has_many_inputs()) scan(), share_optima();
      for (int k = 0; k < 2; ++k) restart_faces(true);
      const bool has_starts = search_dispersed();
      join_groups();
      recheck(false);
      idle = note_round(before) ? 0 : idle + 1;
      if (idle >= options_.patience && !unfinished_) is_done_ = true;
      ++rounds_;
      // no sample is left that stands out among its neighbours
      if (idle >= options_.patience && !has_starts) break;
    }
    if (has_many_inputs()) {
      restart_until_settled(0);
      recheck(false);
      unfinished_ = unfinished_ || asker_.rest() == 0;
    }
    asker_.set_limit(limit);
    if (has_last_steps) {
      if (has_line_searches()) search_lines(false);
      recheck(false);
    }
    if (options_.search_classes) {
      if (is_first && options_.before_classes && !make_goals(true).empty()) {
        facets_ = options_.before_classes();
        note_new();
        recheck(false);
      }
      if (is_first) locate_facets(), search_from_best(true);
      recheck(true);
    }
    return conclude();
  }

  AlphaResult conclude() {
    const bool is_cut = unfinished_;
    if (is_done_ && !has_many_inputs()) unfinished_ = !is_all_settled();
    show(true);
    AlphaResult result = collect();
    result.can_go_on = is_cut;
    result.ending = asker_.is_cancelled()      ? Ending::Cancelled
                    : !unfinished_             ? Ending::Complete
                    : is_cut || !asker_.rest() ? Ending::LimitReached
                                               : Ending::NotConverged;
    return result;
  }

  void ask(const std::vector<Point>& points) {
    const auto indices = asker_.ask(points);
    unfinished_ = unfinished_ || std::count(indices.begin(), indices.end(), -1) > 0;
    note_new();
    show(false);
  }

  /// Tells the watcher, each time that the archive has grown by a tenth: collecting costs a pass over it.
  void show(bool last) {
    if (!options_.watch || (!last && asker_.asked() < shown_ + std::max(8, shown_ / 10))) return;
    shown_ = asker_.asked();
    options_.watch(collect(), asker_.archive());
  }

  /// Keeps for every sample in how many levels it lies.
  void note_new() {
    const auto& samples = asker_.archive().samples();
    for (std::size_t i = depth_.size(); i < samples.size(); ++i)
      depth_.push_back(count_levels(space_, levels_, boxes_, samples[i].x));
  }

  void explore() {
    std::vector<Point> points = {calc_centre(space_)};
    const auto add = [&](Point x, const Region& r) {
      if (!space_.has_interaction() || r.contains(x)) points.push_back(std::move(x));
    };
    for (const auto& r : regions_) {
      if (options_.budget > 0 && 6 * points.size() > static_cast<std::size_t>(options_.budget)) break;
      for (const int i : r.axes)
        for (const double end : {r.box.lower[i], r.box.upper[i]}) {
          Point x = calc_centre(space_);
          x[i] = end;
          add(std::move(x), r);
        }
    }
    ask(points);
    points.clear();
    if (options_.lines > 0 && has_room_for_lines()) join_lines();
    // a small limit must leave something for the searches
    std::size_t corners = 0;
    for (const auto& r : regions_) {
      const int n = static_cast<int>(r.axes.size());
      if (n == 0 || n > std::min(options_.corner_inputs, 20)) continue;
      corners += std::size_t{1} << n;
      if (corners > static_cast<std::size_t>(budget()) / 3) break;
      for (auto& x : make_corners(r.box)) add(std::move(x), r);
    }
    ask(points);
    space_points_.assign(levels_.size(), 0);
    if (options_.budget == 0) spread(limit_share(1));
  }

  /// Spread points of a level, the first time.
  int count_spread(std::size_t level) const {
    const int given = level == 0 ? options_.space_points : options_.inner_points;
    const int n = static_cast<int>(regions_.front().axes.size());
    return level > 0 && regions_[level].axes.empty() ? 0 : given > 0 ? given : (level == 0 ? 80 : 20) * n;
  }
  double count_spread() const {
    double whole = 0;
    for (std::size_t k = 0; k < regions_.size(); ++k) whole += count_spread(k);
    return std::max(whole, 1.0);
  }

  /// Spread points, `share` of the first time's number: a sequence over the inputs that have a width, continued. Where
  /// interaction leaves little of a box, it goes on until that has its number, or 20 times as many were tried.
  void spread(double share) {
    std::vector<Point> points;
    const auto& axes = regions_.front().axes;
    const int n = static_cast<int>(axes.size());
    for (std::size_t k = 0; n > 0 && k < regions_.size(); ++k) {
      const int count = static_cast<int>(std::ceil(share * count_spread(k)));
      for (int allowed = 0, pass = 0; allowed < count && pass < (space_.has_interaction() ? 20 : 1); ++pass) {
        for (const auto& u : make_sobol_points(n, next_spread_, count, options_.seed)) {
          Point fractions(space_.inputs.size(), 0.0);
          for (int i = 0; i < n; ++i) fractions[axes[i]] = u[i];
          Point x = place_in(regions_[k].box, fractions);
          ++next_spread_;
          if (space_.has_interaction() && !regions_[k].contains(x)) continue;
          points.push_back(std::move(x));
          if (++allowed == count) break;
        }
      }
    }
    ask(points);
    for (const auto& x : points)
      if (asker_.archive().find(x) >= 0)
        for (int k = 0; k < count_levels(space_, levels_, boxes_, x); ++k) ++space_points_[k];
  }
  /// The share that leaves two thirds of the runs to others.
  double limit_share(double share) const { return share * std::min(1.0, budget() / 3.0 / count_spread()); }
  int budget() const { return options_.budget > 0 ? options_.budget : asker_.limit(); }

  /// Along every axis from the best sample of each goal: the ends of the cut and places between. Finds other basins of
  /// mappings whose inputs act on their own.
  void scan() {
    std::vector<Point> points;
    Random random(options_.seed + 7919 * static_cast<std::uint64_t>(rounds_ + 1));
    std::set<std::pair<int, int>> done;  // sample and level
    for (const Goal& goal : make_goals(false)) {
      const Candidate best = find_best(goal);
      if (best.sample < 0 || !done.insert({best.sample, goal.level}).second) continue;
      const Region& r = regions_[goal.level];
      for (const int i : r.axes)
        for (int k = -1; k < 3; ++k) {
          Point x = asker_.archive()[best.sample].x;
          const double t = k < 0 ? 0 : k == 2 ? 1 : 0.5 * (k + random.next());
          x[i] = r.box.lower[i] + t * (r.box.upper[i] - r.box.lower[i]);
          x = clip(r.box, std::move(x));
          if (!space_.has_interaction() || r.contains(x)) points.push_back(std::move(x));
        }
    }
    ask(points);
  }

  /// Lines through the middle of the inputs along every axis, and for each goal the best place of every line at once:
  /// where inputs act on their own, that lies in the basin of its bound.
  void join_lines() {
    std::vector<Point> points;
    const Point centre = calc_centre(space_);
    const Region& support = regions_.front();
    const auto at = [&](int i, double value) {
      Point x = centre;
      x[i] = value;
      return x;
    };
    const int steps = 2 * options_.lines;
    for (const int i : support.axes)
      for (int k = 1; k < steps; ++k) {
        Point x = at(i, support.box.lower[i] + k * support.scale[i] / steps);
        if (!space_.has_interaction() || support.contains(x)) points.push_back(std::move(x));
      }
    ask(points);
    std::vector<Point> joined;
    for (const Goal& goal : make_goals(false)) {
      const Region& r = regions_[goal.level];
      Point x = centre;
      for (const int i : r.axes) {
        double best = value_of(goal, asker_.archive().find(centre));
        const auto look = [&](const Point& y) {
          if (!r.contains(y)) return;
          if (const double v = value_of(goal, asker_.archive().find(y)); v < best) best = v, x[i] = y[i];
        };
        for (int k = 1; k < steps; ++k) look(at(i, support.box.lower[i] + k * support.scale[i] / steps));
        for (const auto& other : regions_)
          for (const double end : {other.box.lower[i], other.box.upper[i]}) look(at(i, end));
      }
      if (!space_.has_interaction() || r.contains(x)) joined.push_back(std::move(x));
    }
    ask(joined);
  }

  // ---- groups of inputs whose functions add up

  /// Of outputs that are such sums, for each bound: searches in each group from its best places, and then of all groups
  /// together what came out best. Fewer inputs have few basins.
  void search_groups() {
    constexpr int least_inputs = 6, starts = 4, least_runs = 150;  // runs: of an output, for each input
    const int n = static_cast<int>(regions_.front().axes.size()), limit = asker_.limit(), reserve = asker_.rest() / 2;
    if (n < least_inputs || has_many_inputs() || space_.has_interaction() || options_.budget > 0) return;
    const bool was_unfinished = std::exchange(unfinished_, false);
    for (int output = 0, others = asker_.outputs() - static_cast<int>(options_.passive_outputs.size());
         output < asker_.outputs(); ++output) {
      if (std::count(options_.passive_outputs.begin(), options_.passive_outputs.end(), output) > 0) continue;
      // half of the runs that are left, shared by all outputs
      const int own = (limit - reserve - asker_.asked()) / std::max(1, others--);
      if (own < least_runs * n) break;
      asker_.set_limit(asker_.asked() + own);
      GroupSearch search(space_, asker_, regions_, output, 1e-7 * width_of(output), options_.seed);
      if (!search.find()) {
        depth_.resize(static_cast<std::size_t>(asker_.asked()), 0);  // what was run for that is no start of searches
        continue;
      }
      groups_.emplace(output, search.groups());
      ask(search.compose());
      const auto from = search.list_starts(starts);
      std::vector<Point> points;
      for (const auto& start : from) points.push_back(start.x);
      ask(points);
      std::vector<Running> all;
      for (const auto& start : from) {
        const Goal goal{output, start.level, start.sign};
        const int at = asker_.archive().find(start.x);
        const std::vector<int>& wide = regions_[start.level].axes;
        std::vector<int> axes = search.groups()[start.group];
        std::erase_if(axes, [&](int i) { return std::count(wide.begin(), wide.end(), i) == 0; });
        if (at < 0 || axes.empty()) continue;
        all.push_back({goal, make_model_search(goal, {value_of(goal, at), at}, 0.1, 1, &axes)}),
            all.back().of_group = true;
      }
      advance(all);
      asker_.set_limit(limit);
      ask(search.compose());
    }
    asker_.set_limit(limit), unfinished_ = was_unfinished;
  }

  /// The best samples with one group's inputs where another search ended.
  void join_groups() {
    std::vector<Point> points;
    for (const Goal& goal : make_goals(false)) {
      const auto groups = groups_.find(goal.output);
      const Candidate best = find_best(goal);
      if (groups == groups_.end() || best.sample < 0) continue;
      for (const Optimum& o : optima_[side_of(goal)]) {
        const Point y = clip(regions_[goal.level].box, asker_.archive()[o.sample].x);
        for (const std::vector<int>& group : groups->second) {
          points.push_back(asker_.archive()[best.sample].x);
          for (const int i : group) points.back()[i] = y[i];
        }
      }
    }
    if (!points.empty()) ask(points);
  }

  // ---- lines through best samples

  /// Whether lines through the middle take no more than a tenth of all runs. With fewer runs the spread ones tell more,
  /// and lines come last.
  bool has_room_for_lines() const {
    return 20 * options_.lines * static_cast<int>(regions_.front().axes.size()) <= budget();
  }
  bool has_line_searches() const { return options_.lines > 0 && !has_many_inputs(); }

  std::unique_ptr<LocalSearch> make_line_search(const Goal& goal, const Candidate& start) {
    LineSearch::Options o;
    o.places = options_.lines;
    o.least_gain = least_line_gain * width_of(goal.output);
    // where bounds of the other cuts lie, and ends of searches
    const Region& r = regions_[goal.level];
    std::vector<int> others;
    for (int level = 0; level < static_cast<int>(levels_.size()); ++level)
      if (level != goal.level)
        if (const Candidate best = find_best({goal.output, level, goal.sign, goal.outcome}); best.sample >= 0)
          others.push_back(best.sample);
    for (const Optimum& end : optima_[side_of(goal)]) others.push_back(end.sample);
    const Point& x = asker_.archive()[start.sample].x;
    for (const int i : r.axes) {
      std::vector<double> places;
      for (const int sample : others) {
        const double at = asker_.archive()[sample].x[i];
        const auto is_near = [&](double p) { return std::abs(p - at) < 0.01 * r.scale[i]; };
        if (at < r.box.lower[i] || at > r.box.upper[i] || is_near(x[i]) || is_near(r.box.lower[i]) ||
            is_near(r.box.upper[i]) || std::any_of(places.begin(), places.end(), is_near))
          continue;
        places.push_back(at);
        if (static_cast<int>(places.size()) >= most_line_places) break;
      }
      o.more.push_back(std::move(places));
    }
    ++searches_;
    return std::make_unique<LineSearch>(r, x, tell_of(goal, start.sample), o);
  }

  /// Whether lines through the best sample, or through one that is near, led to no better basin.
  bool is_scanned(const Goal& goal, const Candidate& best) const {
    if (!has_line_searches() || is_open(goal.level)) return true;
    const auto found = scanned_.find(key_of(goal));
    if (found == scanned_.end() || best.sample < 0) return false;
    const Region& r = regions_[goal.level];
    const Point& x = asker_.archive()[best.sample].x;
    return std::any_of(found->second.begin(), found->second.end(), [&](int sample) {
      const Point& y = asker_.archive()[sample].x;
      return std::all_of(r.axes.begin(), r.axes.end(), [&](int i) {
        return std::abs(x[i] - y[i]) <= std::min(0.03 * r.scale[i], 0.1 * (r.box.upper[i] - r.box.lower[i]));
      });
    });
  }

  /// Lines through the best samples that had none.
  bool search_lines(bool of_classes) {
    std::vector<Running> all;
    for (const Goal& goal : make_goals(of_classes)) {
      const Candidate best = find_best(goal);
      if (regions_[goal.level].axes.empty() || best.sample < 0 || is_scanned(goal, best)) continue;
      all.push_back({goal, make_line_search(goal, best)});
    }
    const bool has_any = !all.empty();
    advance(all);
    return has_any;
  }

  double value_of(const Goal& goal, int sample) const {
    if (sample < 0) return infinite;
    const Result& r = asker_.archive()[sample].result;
    if (r.state != Result::State::Done || (goal.outcome != any_class && r.outcome != goal.outcome)) return infinite;
    return goal.sign * r.values[goal.output];
  }

  Told tell_of(const Goal& goal, int sample) const {
    return {value_of(goal, sample), sample < 0 ? failed_outcome : outcome_of(asker_.archive()[sample].result)};
  }

  Candidate find_best(const Goal& goal) const {
    Candidate best;
    for (int i = 0; i < static_cast<int>(depth_.size()); ++i)
      if (depth_[i] > goal.level)
        if (const double v = value_of(goal, i); v < best.value) best = {v, i};
    return best;
  }

  /// The best samples of the cut that keep a distance from each other, from where searches for this goal began and from
  /// its known optima.
  std::vector<Candidate> find_starts(const Goal& goal, int count) {
    std::vector<Candidate> all;
    for (int i = 0; i < static_cast<int>(depth_.size()); ++i)
      if (depth_[i] > goal.level)
        if (const double v = value_of(goal, i); v < infinite) all.push_back({v, i});
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.value < b.value; });
    const Region& r = regions_[goal.level];
    const auto add_place = [&](std::vector<double>& list, int sample) {
      for (const int i : r.axes) list.push_back(asker_.archive()[sample].x[i] / (r.box.upper[i] - r.box.lower[i]));
    };
    RankedPlaces places{r.axes.size(), {}};
    for (const Candidate& c : all) add_place(places.at, c.sample);
    std::vector<double> taken;
    for (const int sample : starts_[key_of(goal)]) add_place(taken, sample);
    for (const Optimum& o : optima_[side_of(goal)])
      if (is_optimum_of(o, goal)) add_place(taken, o.sample);
    std::vector<Candidate> starts;
    for (const bool only_bottoms : {true, false}) {
      if (only_bottoms ? has_many_inputs() : (new_from_ > 0 || rounds_ >= options_.patience) && !has_many_inputs())
        continue;
      const auto is_allowed = [&](std::size_t k) {
        return all[k].sample >= new_from_ && (!only_bottoms || places.is_bottom(k));
      };
      for (const std::size_t k :
           choose_apart(places, taken, 0.2 * std::pow(0.7, rounds_), count - starts.size(), is_allowed)) {
        starts.push_back(all[k]);
        starts_[key_of(goal)].push_back(all[k].sample);
      }
    }
    return starts;
  }

  /// Best values of all goals, classes apart.
  std::vector<double> calc_bounds() const {
    std::vector<double> values;
    for (const Goal& goal : make_goals(false)) values.push_back(find_best(goal).value);
    return values;
  }
  /// Counts for each goal the rounds in a row that gained nothing; whether this one gained anything.
  bool note_round(const std::vector<double>& before) {
    const std::vector<Goal> goals = make_goals(false);
    const std::vector<double> now = calc_bounds();
    if (now.size() != before.size()) return true;
    bool is_better = false;
    for (std::size_t k = 0; k < now.size(); ++k) {
      const bool gains = now[k] < before[k] - 1e-4 * width_of(goals[k].output);
      int& idle = idle_rounds_[key_of(goals[k])];
      idle = gains ? 0 : idle + 1;
      is_better = is_better || gains;
    }
    return is_better;
  }

  /// Width of an output over all samples.
  double width_of(int output) const {
    double low = infinite, high = -infinite;
    for (const auto& s : asker_.archive().samples())
      if (s.result.state == Result::State::Done) {
        low = std::min(low, s.result.values[output]);
        high = std::max(high, s.result.values[output]);
      }
    return high > low ? high - low : 0;
  }

  /// A local optimum: other starts keep a distance from it, and it is tried in the other cuts.
  void note_end(const Goal& goal, int sample) {
    if (goal.outcome != any_class) return;
    std::vector<Optimum>& all = optima_[side_of(goal)];
    if (std::none_of(all.begin(), all.end(),
                     [&](const Optimum& o) { return o.sample == sample && o.level == goal.level; }))
      all.push_back({sample, goal.level});
  }

  /// What is an optimum of a wide cut is one of a narrow one as well, and the other way round where no end of the
  /// narrow one holds it.
  bool is_optimum_of(const Optimum& o, const Goal& goal) const {
    const Region& r = regions_[o.level];
    if (goal.outcome != any_class || depth_[o.sample] <= goal.level || r.axes != regions_[goal.level].axes)
      return false;
    const Point& x = asker_.archive()[o.sample].x;
    return o.level <= goal.level || (!space_.has_interaction() && std::all_of(r.axes.begin(), r.axes.end(), [&](int i) {
             const double least = 1e-6 * r.scale[i];
             return x[i] > r.box.lower[i] + least && x[i] < r.box.upper[i] - least;
           }));
  }

  /// Where an output has kinks that bound it on this side, no model search tells that nothing better is near.
  bool has_kinks(const Goal& goal) const { return kinked_.contains(side_of(goal)); }
  void note_kinks(const Goal& goal) {
    if (!kinked_.insert(side_of(goal)).second) return;
    for (const auto& [key, end] : ends_)
      if (is_of_side(key, goal)) edges_.try_emplace(key, infinite).first->second = end;
    forget_ends(goal);
  }

  /// Where values fall ever more steeply towards another outcome, no model search beside one tells that nothing better
  /// is near.
  bool is_steep(const Goal& goal) const { return steep_.contains({goal.output, goal.sign > 0, goal.outcome}); }
  /// Of an outcome, and of all runs where these were searched.
  void note_steep(Goal goal, int outcome) {
    for (const int of : {goal.outcome, outcome}) {
      goal.outcome = of;
      if (steep_.insert({goal.output, goal.sign > 0, of}).second)
        std::erase_if(ends_, [&](const auto& e) { return is_of_side(e.first, goal) && e.first[3] == of; });
    }
  }

  /// Of bounds in an outcome, beside another one: to look once is enough.
  Key key_of(const Goal& g, const Point& beside) const {
    const int i = asker_.archive().find(beside);
    return {g.output, i < 0 ? failed_outcome : outcome_of(asker_.archive()[i].result), g.sign > 0, g.outcome};
  }

  /// Whether searches for a bound ended at places of different values, or would have.
  bool has_valleys() const {
    return has_shallow_valleys_ || std::any_of(optima_.begin(), optima_.end(), [this](const auto& of) {
             const auto& [key, all] = of;
             const double least = 1e-3 * width_of(key.first);
             const auto value = [&, output = key.first](const Optimum& o) {
               return asker_.archive()[o.sample].result.values[output];
             };
             for (const Optimum& a : all)
               for (const Optimum& b : all)
                 if (depth_[a.sample] == depth_[b.sample] && std::abs(value(a) - value(b)) > least) return true;
             return false;
           });
  }

  /// Local optima of each cut, clipped, in the others: what is an optimum of a wide cut may be missed in a narrow one
  /// and the other way round.
  void share_optima() {
    std::vector<Point> points;
    for (const auto& [key, all] : optima_)
      for (const Optimum& o : all)
        for (const Region& r : regions_) {
          Point x = clip(r.box, asker_.archive()[o.sample].x);
          if (!space_.has_interaction() || r.contains(x)) points.push_back(std::move(x));
        }
    ask(points);
  }

  std::vector<Goal> make_goals(bool of_classes) const {
    std::vector<Goal> goals;
    std::set<int> classes = {any_class};
    if (of_classes) {
      classes.clear();
      for (const auto& s : asker_.archive().samples())
        if (s.result.state == Result::State::Done) classes.insert(s.result.outcome);
      if (classes.size() < 2) return goals;
    }
    for (const int c : classes)
      for (int level = 0; level < static_cast<int>(levels_.size()); ++level)
        for (int output = 0; output < asker_.outputs(); ++output)
          for (const double sign : {1.0, -1.0})
            if (std::count(options_.passive_outputs.begin(), options_.passive_outputs.end(), output) == 0)
              goals.push_back({output, level, sign, c});
    return goals;
  }

  struct Running {
    Goal goal;
    std::unique_ptr<LocalSearch> search;
    bool over_faces = false;
    bool of_restart = false;  // refines where a search over the faces ended
    bool may_stop = false;    // where that is vain
    bool has_stopped = false;
    bool of_group = false;  // varies the inputs of one alone
    double start = search ? search->value() : infinite;
  };

  /// Whether a search from another place ended, or will end, where nothing is to be found any more: beside a known
  /// optimum, or in a valley that will stay worse than the best place.
  bool is_vain(const Running& r) {
    const Point& x = r.search->best();
    const Region& region = regions_[r.goal.level];
    for (const Optimum& o : optima_[side_of(r.goal)]) {
      if (!is_optimum_of(o, r.goal) || value_of(r.goal, o.sample) > r.search->value()) continue;
      const Point& y = asker_.archive()[o.sample].x;
      if (x != y && std::all_of(region.axes.begin(), region.axes.end(), [&](int i) {
            return std::abs(x[i] - y[i]) < near_optimum * (region.box.upper[i] - region.box.lower[i]);
          }))
        return true;
    }
    const double outlook = static_cast<const ModelSearch&>(*r.search).calc_outlook();
    const bool is_shallow =
        std::isfinite(outlook) && outlook > find_best(r.goal).value + 1e-3 * width_of(r.goal.output);
    has_shallow_valleys_ = has_shallow_valleys_ || is_shallow;
    return is_shallow;
  }

  ///   axes  inputs that it varies; null: all of the cut
  std::unique_ptr<LocalSearch> make_model_search(const Goal& goal, const Candidate& start, double radius, int probes,
                                                 const std::vector<int>* axes = nullptr) {
    ModelSearch::Options o;
    o.radius = radius;
    o.probes = probes;
    o.tolerance = (axes ? group_tolerance : options_.tolerance) * width_of(goal.output);
    if (seeks_edges()) o.edge = 1e-3;
    o.doubts_edges = !has_kinks(goal);
    if (!is_steep(goal)) o.looks_steep = [this, goal](const Point& x) { return !gentle_.contains(key_of(goal, x)); };
    o.seed = options_.seed + ++searches_;
    Region region = regions_[goal.level];
    if (axes) region.axes = *axes;
    const Point& from = asker_.archive()[start.sample].x;
    auto search = std::make_unique<ModelSearch>(region, from, tell_of(goal, start.sample), o);
    // runs nearby, the nearest last
    std::vector<std::pair<double, int>> near;
    for (int i = 0; i < asker_.asked() && goal.outcome != any_class; ++i) {
      const Point& x = asker_.archive()[i].x;
      const double distance = calc_offset(x, from, region.axes, region.scale);
      if (i != start.sample && distance < 2 * radius && region.contains(x)) near.emplace_back(-distance, i);
    }
    std::sort(near.begin(), near.end());
    for (const auto& [distance, i] : near) search->remember(asker_.archive()[i].x, tell_of(goal, i));
    if (goal.outcome != any_class) search->adopt(planes_[{search->outcome(), region.axes}]);
    return search;
  }

  /// Whether kinks are followed: along constraints and for many inputs the planes would take too many runs.
  bool seeks_edges() const { return !has_many_inputs() && !space_.has_interaction(); }
  std::unique_ptr<LocalSearch> make_kink_search(const Goal& goal, const Candidate& start) {
    KinkSearch::Options o;
    o.tolerance = least_edge_gain * width_of(goal.output);
    constexpr double radii[] = {0.03, 0.2, 0.003};
    o.radius = radii[in_vain_[key_of(goal)] % 3];
    o.seed = options_.seed + ++searches_;
    return std::make_unique<KinkSearch>(regions_[goal.level], asker_.archive()[start.sample].x,
                                        tell_of(goal, start.sample), o);
  }

  FaceSearch::Options make_face_options(const Goal& goal) {
    FaceSearch::Options o;
    o.least_gain = 10 * options_.tolerance * width_of(goal.output);
    o.seed = options_.seed + ++searches_;
    return o;
  }

  std::unique_ptr<LocalSearch> make_evolution(const Goal& goal, const Candidate& start) {
    EvolutionSearch::Options o;
    o.seed = options_.seed + ++searches_;
    return std::make_unique<EvolutionSearch>(regions_[goal.level], asker_.archive()[start.sample].x,
                                             tell_of(goal, start.sample), o);
  }

  /// All searches side by side: each batch holds what every one of them asks next.
  void advance(std::vector<Running>& all) {
    while (asker_.can_go_on()) {
      std::vector<Point> points;
      for (const auto& r : all)
        if (!r.search->is_done() && !r.has_stopped)
          points.insert(points.end(), r.search->pending().begin(), r.search->pending().end());
      if (points.empty()) break;
      ask(points);
      for (auto& r : all) {
        if (r.search->is_done() || r.has_stopped) continue;
        std::vector<Told> told;
        bool complete = true;
        for (const auto& x : r.search->pending()) {
          const int i = asker_.archive().find(x);
          complete = complete && i >= 0;
          told.push_back(tell_of(r.goal, i));
        }
        // a search that was cut off by the limit or a cancellation must not conclude from what is missing
        if (complete) r.search->tell(told);
        r.has_stopped = complete && r.may_stop && !r.search->is_done() && is_vain(r);
      }
    }
    for (const auto& r : all) {
      const auto* model = dynamic_cast<const ModelSearch*>(r.search.get());
      if (model && model->is_steep())
        note_steep(r.goal, model->outcome());
      else if (model && model->beside() && model->is_done() && r.goal.outcome != any_class)
        gentle_.insert(key_of(r.goal, *model->beside()));
      if (model && model->is_wavy()) wavy_.insert(side_of(r.goal));
      if (r.has_stopped) {
        if (const int at = asker_.archive().find(r.search->best()); at >= 0) starts_[key_of(r.goal)].push_back(at);
        continue;
      }
      if (!r.search->is_done()) unfinished_ = true;
      if (r.of_group) continue;
      const bool is_kink = dynamic_cast<const KinkSearch*>(r.search.get()) != nullptr;
      if (is_kink && r.search->is_done() && !r.search->is_converged()) {
        // goes on from there, unless it moves no more
        const bool moves = r.search->value() < r.start - 1e-5 * width_of(r.goal.output);
        const bool is_over = !moves && ++in_vain_[key_of(r.goal)] > most_in_vain;
        double& end = (is_over ? given_up_ : edges_).try_emplace(key_of(r.goal), infinite).first->second;
        end = std::min(end, r.search->value());
      }
      if (model && model->is_at_jump())
        jumps_[r.goal.output].add(model->get_side());
      else if (model)
        note_planes(*model, regions_[r.goal.level].axes);
      if (!r.search->is_converged()) continue;
      if (dynamic_cast<const LineSearch*>(r.search.get()) != nullptr) {
        if (const int at = asker_.archive().find(r.search->best()); at >= 0) scanned_[key_of(r.goal)].push_back(at);
        continue;
      }
      if (r.over_faces) {
        note_faces(r.goal, static_cast<const FaceSearch&>(*r.search));
        continue;
      }
      if (r.of_restart) {
        Faces& f = faces_[key_of(r.goal)];
        f.last = r.search->value(), f.last_at = r.search->best();
      }
      if (const int at = asker_.archive().find(r.search->best()); at >= 0 && !has_many_inputs()) note_end(r.goal, at);
      const bool is_kinked = model && model->is_at_edge() && !model->has_met_walls() && !has_many_inputs();
      const bool is_free = is_off_constraints(regions_[r.goal.level], r.search->best());
      if (is_kinked && is_free) note_kinks(r.goal);
      if (is_steep(r.goal) && (!model || model->has_met_walls())) continue;
      const bool is_open = has_kinks(r.goal) ? model || !is_free : is_kinked;
      const bool is_doubtful = model && model->is_doubtful() && r.goal.outcome != any_class;
      for (auto* noted : {is_open ? &edges_ : &ends_, is_doubtful ? &doubts_ : &sure_ends_}) {
        double& end = noted->try_emplace(key_of(r.goal), infinite).first->second;
        end = std::min(end, r.search->value());
      }
    }
    all.clear();
  }

  /// The boundary of an outcome is the same for all outputs, and for levels in which the same inputs vary.
  void note_planes(const ModelSearch& search, const std::vector<int>& axes) {
    std::vector<Boundary::Plane>& known = planes_[{search.outcome(), axes}];
    for (const auto& p : search.boundary().planes()) {
      std::erase_if(known, [&p](const Boundary::Plane& q) { return q.side.a == p.side.a && q.side.b == p.side.b; });
      known.push_back(p);
    }
    constexpr long most = 60;
    if (std::ssize(known) > most) known.erase(known.begin(), known.end() - most);
  }

  /// Of outcomes that are convex what bounds them is located before anything is searched for in them. Where an output
  /// is linear there as well, that ends the search for its bounds.
  void locate_facets() {
    const Region& support = regions_.front();
    if (!seeks_edges() || support.axes.size() < 2) return;
    std::map<int, std::vector<Goal>> goals;
    for (const Goal& goal : make_goals(true))
      if (regions_[goal.level].axes == support.axes && find_best(goal).sample >= 0) goals[goal.outcome].push_back(goal);
    for (const auto& [outcome, of_outcome] : goals)
      if (!facets_.has_bends) locate_facets(outcome, of_outcome);
  }

  void locate_facets(int outcome, const std::vector<Goal>& goals) {
    FacetSearch search(
        regions_.front(), asker_, [outcome](const Result& r) { return outcome_of(r) == outcome; },
        facets_.planes[outcome]);
    const std::vector<FacetSearch::LinearFit> fits = search.fit_outputs();
    if (fits.empty()) return;
    std::vector<FacetSearch::Goal> wanted;
    for (const Goal& goal : goals) {
      wanted.push_back({regions_[goal.level], fits[goal.output].slope});
      for (double& s : wanted.back().slope) s *= goal.sign;
    }
    search.run(wanted, asker_.rest() / 2);
    facets_.has_bends = search.has_bend();
    if (search.is_polyhedral()) {
      std::vector<Boundary::Plane>& known = planes_[{outcome, regions_.front().axes}];
      for (Boundary::Plane& p : search.list_planes()) known.push_back(std::move(p));
      for (std::size_t k = 0; k < goals.size(); ++k) {
        const FacetSearch::LinearFit& fit = fits[goals[k].output];
        const double close = 1e-5 * width_of(goals[k].output);
        if (fit.largest_error > 1e-3 * close) continue;
        const auto least = search.confirm(wanted[k]);
        note_new();
        const Candidate best = find_best(goals[k]);
        if (!least || best.value > *least + goals[k].sign * fit.at_zero + close) continue;
        double& end = ends_.try_emplace(key_of(goals[k]), infinite).first->second;
        end = std::min(end, best.value);
      }
    }
    note_new();
  }

  /// Sides of jumps that were found in one cut, in all of them.
  void share_jumps() {
    std::vector<Point> points;
    for (auto& [output, jumps] : jumps_)
      for (const JumpSide& side : jumps.take_new())
        for (const Region& r : regions_)
          for (Point& x : find_places(r, side)) points.push_back(std::move(x));
    if (!points.empty()) ask(points);
  }

  static Key key_of(const Goal& g) { return {g.output, g.level, g.sign > 0, g.outcome}; }
  static bool is_of_side(const Key& key, const Goal& g) { return key[0] == g.output && key[2] == (g.sign > 0); }
  /// Of all levels and outcomes.
  void forget_ends(const Goal& goal) {
    std::erase_if(ends_, [&goal](const auto& e) { return is_of_side(e.first, goal); });
  }

  /// Whether a value is noted for this goal that is as good as the best one.
  bool is_noted(const std::map<Key, double>& values, const Goal& goal, const Candidate& best) const {
    const auto end = values.find(key_of(goal));
    return end != values.end() && end->second <= best.value + 2 * options_.tolerance * width_of(goal.output);
  }
  /// Whether a search has converged there.
  bool is_converged(const Goal& goal, const Candidate& best) const { return is_noted(ends_, goal, best); }
  /// What a bound is marked with.
  bool is_settled(const Goal& goal, const Candidate& best) const {
    if (!is_converged(goal, best) || (is_noted(doubts_, goal, best) && !is_noted(sure_ends_, goal, best))) return false;
    if (!is_open(goal.level)) return is_scanned(goal, best) && is_explored(goal);
    return is_checked(goal, best) && (goal.outcome != any_class || is_confirmed(goal, best));
  }

  /// Where values vary within much less than what lies between spread runs, rounds must have gained nothing.
  bool is_explored(const Goal& goal) const {
    if (goal.outcome != any_class || has_kinks(goal) || !wavy_.contains(side_of(goal))) return true;
    const auto idle = idle_rounds_.find(key_of(goal));
    return idle != idle_rounds_.end() && idle->second >= options_.patience;
  }

  bool is_all_settled() const {
    for (const bool of_classes : {false, true})
      for (const Goal& goal : make_goals(of_classes && options_.search_classes)) {
        const Candidate best = find_best(goal);
        if (best.sample >= 0 && !regions_[goal.level].axes.empty() && !is_settled(goal, best)) return false;
      }
    return true;
  }

  // ---- more inputs than all corners can be run of

  bool has_many_inputs() const { return is_open(0); }
  /// Whether the corners of a level's cut are left to searches.
  bool is_open(int level) const { return static_cast<int>(regions_[level].axes.size()) > options_.corner_inputs; }

  void note_faces(const Goal& goal, const FaceSearch& search) {
    Faces& f = faces_[key_of(goal)];
    f.end = std::min(f.end, search.value());
    if (search.is_paired()) f.paired = std::min(f.paired, search.value());
    if (search.is_foretold()) f.foretold = std::min(f.foretold, search.value());
    f.last = search.value(), f.last_at = search.best();
  }

  /// Whether restarts have shown that a better bound is unlikely.
  bool is_confirmed(const Goal& goal, const Candidate& best) const {
    const auto at = faces_.find(key_of(goal));
    if (at == faces_.end()) return false;
    const Faces& f = at->second;
    const double close = best.value + 1e-4 * width_of(goal.output);
    if (f.best > close || f.idle < options_.restarts) return false;
    // the more searches ended elsewhere, the more are asked for
    return f.foretold <= close ||
           (f.again >= options_.again && f.again * f.idle >= options_.restarts * (f.again + 3 * f.elsewhere));
  }

  bool is_checked(const Goal& goal, const Candidate& best) const {
    const auto f = faces_.find(key_of(goal));
    return f != faces_.end() && f->second.end <= best.value + 20 * options_.tolerance * width_of(goal.output);
  }

  /// Best samples of one level at the same place in the cuts of the others, by fractions and as they are.
  void share_between_levels(bool of_classes) {
    std::vector<Point> points;
    for (const Goal& goal : make_goals(of_classes)) {
      const Candidate best = find_best(goal);
      if (best.sample < 0 || !is_open(goal.level)) continue;
      const Point& x = asker_.archive()[best.sample].x;
      const Box& from = regions_[goal.level].box;
      for (std::size_t k = 0; k < regions_.size(); ++k) {
        if (static_cast<int>(k) == goal.level || !is_open(static_cast<int>(k))) continue;
        const Region& r = regions_[k];
        Point y = x;
        for (const int i : r.axes)
          y[i] = x[i] == from.lower[i]   ? r.box.lower[i]
                 : x[i] == from.upper[i] ? r.box.upper[i]
                                         : r.box.lower[i] + (x[i] - from.lower[i]) / (from.upper[i] - from.lower[i]) *
                                                                (r.box.upper[i] - r.box.lower[i]);
        for (Point p : {clip(r.box, std::move(y)), clip(r.box, x)})
          if (!space_.has_interaction() || r.contains(p)) points.push_back(std::move(p));
      }
    }
    ask(points);
  }

  /// From every best sample at which no search over the faces has ended, until there is none.
  void check_faces(bool of_classes) {
    std::set<std::pair<Key, int>> tried;
    while (has_many_inputs() && asker_.can_go_on()) {
      share_between_levels(of_classes);
      std::vector<Running> all;
      const std::vector<Goal> goals = make_goals(of_classes);
      std::size_t pairs = 0;
      for (const Goal& goal : goals) {
        const Candidate best = find_best(goal);
        if (!is_open(goal.level) || best.sample < 0 || is_checked(goal, best)) continue;
        if (!tried.insert({key_of(goal), best.sample}).second) continue;
        FaceSearch::Options o = make_face_options(goal);
        o.wide_axes = regions_[goal.level].axes;
        // all pairs for all goals must leave something for others
        const std::size_t n = regions_[goal.level].axes.size();
        o.pairs = best.value < faces_[key_of(goal)].paired - 1e-4 * width_of(goal.output) &&
                  (pairs += n * (n - 1) / 2) < static_cast<std::size_t>(asker_.rest()) / 2;
        all.push_back({goal,
                       std::make_unique<FaceSearch>(regions_[goal.level], asker_.archive()[best.sample].x,
                                                    tell_of(goal, best.sample), o),
                       true});
      }
      if (all.empty()) break;
      advance(all);
    }
  }

  /// Inputs whose value at the best sample is no end of the cut.
  std::vector<int> list_inner_axes(const Goal& goal) const {
    std::vector<int> inner;
    const Region& r = regions_[goal.level];
    const Point& x = asker_.archive()[find_best(goal).sample].x;
    for (const int i : r.axes)
      if (x[i] != r.box.lower[i] && x[i] != r.box.upper[i]) inner.push_back(i);
    return inner;
  }

  /// Another place in a cut for a restart: a good sample that is far from others, the best one with a third of its
  /// coordinates moved, random ends, a random place.
  Point choose_restart(const Goal& goal, const Candidate& best, int kind, Random& random) {
    const Region& r = regions_[goal.level];
    if (kind == 0)
      if (const auto starts = find_starts(goal, 1); !starts.empty()) return asker_.archive()[starts[0].sample].x;
    Point x = asker_.archive()[best.sample].x;
    for (const int i : r.axes) {
      const double low = r.box.lower[i], high = r.box.upper[i];
      if (kind == 1 && random.next() > 1.0 / 3) continue;
      if (kind == 3 || (kind == 1 && x[i] != low && x[i] != high))
        x[i] = random.next(low, high);
      else
        x[i] = (kind == 1 ? x[i] == low : random.next() < 0.5) ? high : low;
    }
    // towards the centre until interaction allows it
    const Point centre = calc_centre(space_);
    for (int k = 0; k < 8 && space_.has_interaction() && !r.contains(x); ++k)
      for (std::size_t i = 0; i < x.size(); ++i) x[i] += 0.3 * (centre[i] - x[i]);
    return !space_.has_interaction() || r.contains(x) ? x : asker_.archive()[best.sample].x;
  }

  /// A search over the faces from another place for every goal, or for those that are not confirmed; false if there are
  /// none.
  bool restart_faces(bool of_all) {
    std::vector<std::pair<Goal, Point>> starts;
    std::vector<Point> points;
    if (!has_many_inputs() || !asker_.can_go_on()) return false;
    const int kind = restart_rounds_ % 4;
    Random random(options_.seed + 104729 * static_cast<size_t>(++restart_rounds_));
    for (const Goal& goal : make_goals(false)) {
      const Candidate best = find_best(goal);
      if (!is_open(goal.level) || best.sample < 0 || (!of_all && is_confirmed(goal, best))) continue;
      points.push_back(choose_restart(goal, best, kind, random));
      starts.push_back({goal, points.back()});
    }
    if (starts.empty()) return false;
    ask(points);
    std::vector<Running> all;
    for (const auto& [goal, x] : starts) {
      faces_[key_of(goal)].last = infinite;
      const int sample = asker_.archive().find(x);
      if (sample < 0 || !std::isfinite(value_of(goal, sample))) continue;
      FaceSearch::Options o = make_face_options(goal);
      o.wide_axes = list_inner_axes(goal);
      all.push_back({goal, std::make_unique<FaceSearch>(regions_[goal.level], x, tell_of(goal, sample), o), true});
    }
    restarts_ += static_cast<int>(all.size());
    advance(all);
    // a place inside that is nearly as good as the best one is no more than a start
    std::vector<Running> refined;
    for (const auto& [goal, x] : starts) {
      const Faces& f = faces_[key_of(goal)];
      const Candidate best = find_best(goal);
      const int sample = std::isfinite(f.last) ? asker_.archive().find(f.last_at) : -1;
      if (sample < 0 || list_inner_axes(goal).empty() || f.last > best.value + 0.05 * width_of(goal.output) ||
          is_there(goal, best, f.last, f.last_at))
        continue;
      refined.push_back({goal, make_model_search(goal, {f.last, sample}, 0.05, 1), false, true});
    }
    advance(refined);
    std::vector<std::pair<double, Point>> ends;
    for (const auto& [goal, x] : starts) ends.push_back({faces_[key_of(goal)].last, faces_[key_of(goal)].last_at});
    check_faces(false);
    for (std::size_t k = 0; k < starts.size(); ++k)
      count_restart(starts[k].first, kind != 1, ends[k].first, ends[k].second);
    return true;
  }

  /// Whether a search ended at the best sample or at one that is as good.
  bool is_there(const Goal& goal, const Candidate& best, double end, const Point& at) const {
    const double width = width_of(goal.output);
    if (end <= best.value + 1e-4 * width) return true;
    const Region& r = regions_[goal.level];
    const Point& x = asker_.archive()[best.sample].x;
    return end <= best.value + 1e-2 * width && std::all_of(r.axes.begin(), r.axes.end(), [&](int i) {
             return std::abs(at[i] - x[i]) <= 0.1 * (r.box.upper[i] - r.box.lower[i]);
           });
  }

  void count_restart(const Goal& goal, bool is_independent, double end, const Point& at) {
    Faces& f = faces_[key_of(goal)];
    const Candidate best = find_best(goal);
    const double width = width_of(goal.output);
    if (best.value < f.best - 1e-4 * width) f.best = best.value, f.idle = f.again = f.elsewhere = 0;
    ++f.idle;
    if (is_independent && std::isfinite(end)) ++(is_there(goal, best, end, at) ? f.again : f.elsewhere);
  }

  /// Restarts for what is not confirmed, as long as so many runs are left.
  void restart_until_settled(int reserve) {
    for (int vain = 0; asker_.rest() > reserve && vain < 8;) {
      const int before = asker_.asked();
      if (!restart_faces(false)) return;
      vain = asker_.asked() > before ? 0 : vain + 1;
    }
  }

  void search_from_best(bool of_classes) {
    std::vector<Running> all;
    int level = 0;
    for (const Goal& goal : make_goals(of_classes)) {
      if (options_.budget > 0 && goal.level > std::exchange(level, goal.level)) advance(all), share_optima();
      const Candidate best = find_best(goal);
      if (regions_[goal.level].axes.empty() || best.sample < 0 || (of_classes && is_converged(goal, best))) continue;
      if (!of_classes) starts_[key_of(goal)].push_back(best.sample);
      all.push_back({goal, make_model_search(goal, best, 0.1, of_classes ? 3 : 8)});
    }
    advance(all);
  }

  /// Model searches from other good places; in the first round evolution from the best.
  bool search_dispersed() {
    std::vector<Running> all;
    bool has_starts = false;
    for (const Goal& goal : make_goals(false)) {
      if (regions_[goal.level].axes.empty()) continue;
      for (const auto& start : find_starts(goal, has_many_inputs() ? 1 : options_.starts))
        all.push_back({goal, make_model_search(goal, start, 0.1, 1), false, false, !has_many_inputs()}),
            has_starts = true;
      if (const Candidate best = find_best(goal); best.sample >= 0 && rounds_ == 0 && !has_many_inputs())
        for (int k = 0; k < options_.evolutions; ++k) all.push_back({goal, make_evolution(goal, best)});
    }
    std::vector<std::pair<Goal, std::size_t>> known;  // optima before
    for (const Goal& goal : make_goals(false)) known.push_back({goal, optima_[side_of(goal)].size()});
    advance(all);
    // an end at a kink that is nearly as good as the best one may be a better valley
    for (const auto& [goal, count] : known) {
      if (!has_kinks(goal)) continue;
      const Candidate best = find_best(goal);
      const std::vector<Optimum>& ends = optima_[side_of(goal)];
      for (std::size_t k = count; k < ends.size(); ++k)
        if (const double v = value_of(goal, ends[k].sample); ends[k].level == goal.level &&
                                                             ends[k].sample != best.sample &&
                                                             v < best.value + 0.02 * width_of(goal.output))
          all.push_back({goal, make_kink_search(goal, {v, ends[k].sample})});
    }
    advance(all);
    return has_starts;
  }

  /// Every sample against every cut: a best one that no search ended at is a new start, until nothing changes.
  void recheck(bool of_classes) {
    std::set<std::pair<Key, int>> tried;
    std::map<Key, std::pair<double, int>> in_vain;  // best value when it was last searched from, turns without gain
    while (asker_.can_go_on()) {
      check_faces(of_classes);
      share_jumps();
      std::vector<Running> all;
      for (const Goal& goal : make_goals(of_classes)) {
        const Candidate best = find_best(goal);
        if (regions_[goal.level].axes.empty() || best.sample < 0) continue;
        const bool is_at_end = is_converged(goal, best) || is_noted(given_up_, goal, best);
        if (is_at_end && is_scanned(goal, best)) continue;
        if (!tried.insert({key_of(goal), is_at_end ? -1 - best.sample : best.sample}).second) continue;
        auto& [last, turns] = in_vain.try_emplace(key_of(goal), infinite, 0).first->second;
        turns = last - best.value > 2 * options_.tolerance * width_of(goal.output) ? 0 : turns + 1;
        last = best.value;
        if (turns > most_in_vain) continue;
        if (is_at_end) {
          all.push_back({goal, make_line_search(goal, best)});
          continue;
        }
        const auto edge = edges_.find(key_of(goal));
        const bool is_at_edge =
            edge != edges_.end() && edge->second <= best.value + least_edge_gain * width_of(goal.output);
        all.push_back({goal, is_at_edge ? make_kink_search(goal, best)
                                        : make_model_search(goal, best, 0.05, of_classes ? 3 : 8)});
      }
      if (all.empty()) break;
      ++rechecks_;
      advance(all);
    }
  }

  AlphaResult collect() const {
    AlphaResult result = read_archive(space_, asker_.archive(), levels_, space_points_);
    const auto mark = [this](std::vector<OutputBounds>& outputs, int outcome) {
      for (int o = 0; o < static_cast<int>(outputs.size()); ++o)
        for (int k = 0; k < static_cast<int>(levels_.size()); ++k) {
          auto& b = outputs[o].levels[k];
          const bool point = regions_[k].axes.empty();
          b.lower.converged =
              b.lower.sample >= 0 && (point || is_settled({o, k, 1, outcome}, {b.lower.value, b.lower.sample}));
          b.upper.converged =
              b.upper.sample >= 0 && (point || is_settled({o, k, -1, outcome}, {-b.upper.value, b.upper.sample}));
        }
    };
    mark(result.outputs, any_class);
    for (auto& c : result.classes) mark(c.outputs, result.classes.size() == 1 ? any_class : c.outcome);
    result.run = asker_.run();
    result.batches = asker_.batches();
    result.searches = static_cast<int>(searches_);
    result.rounds = rounds_;
    result.rechecks = rechecks_;
    result.restarts = restarts_;
    return result;
  }

  const Space& space_;
  Asker& asker_;
  const AlphaOptions& options_;
  std::vector<double> levels_;
  std::vector<Region> regions_;
  std::vector<Box> boxes_;
  std::vector<int> depth_;         // per sample: in how many levels it lies
  std::vector<int> space_points_;  // per level
  // of the boundaries of outcomes, by outcome and inputs that vary, latest last
  std::map<std::pair<int, std::vector<int>>, std::vector<Boundary::Plane>> planes_;
  Facets facets_;                             // found before
  std::map<int, Jumps> jumps_;                // by output
  std::map<Key, double> ends_;                // best value at which a search converged
  std::map<Key, double> doubts_, sure_ends_;  // at which a doubtful one did, and one that is not
  std::set<std::pair<int, bool>> kinked_;     // output and sign
  std::map<Key, double> given_up_;            // at which searches along kinks neither ended nor gained any more
  std::map<Key, int> in_vain_;                // searches along kinks that did not end, nor gain
  std::map<Key, double> edges_;               // at which one stopped before a kink
  std::map<Key, std::vector<int>> starts_;    // samples from which searches began, or at which they stopped
  std::map<std::pair<int, bool>, std::vector<Optimum>> optima_;  // by output and sign
  std::set<std::pair<int, bool>> wavy_;                          // the same: values vary within little
  std::set<Key> steep_;                                          // output, sign, outcome: beside another one
  std::set<Key> gentle_;                                         // of bounds that were looked at for that and are not
  std::map<Key, int> idle_rounds_;                               // in a row, that gained nothing
  bool has_shallow_valleys_ = false;                             // that searches were stopped in
  std::map<int, std::vector<std::vector<int>>> groups_;          // by output, of inputs whose functions add up
  std::map<Key, Faces> faces_;
  std::map<Key, std::vector<int>> scanned_;  // samples through which lines led to no better basin
  int next_spread_ = 1;
  int new_from_ = 0;  // older samples are no starts
  std::uint64_t searches_ = 0;
  int rechecks_ = 0, rounds_ = 0, shown_ = 0, restarts_ = 0, restart_rounds_ = 0;
  bool unfinished_ = false;
  bool is_done_ = false;  // but for rounds that only make surer
};

}  // namespace

struct AlphaSearch::Parts {
  Optimisation optimisation;
};

AlphaSearch::AlphaSearch(const Space& space, Asker& asker, const AlphaOptions& options) {
  check_space(space);
  parts_ = std::make_unique<Parts>(Parts{Optimisation(space, asker, options)});
}
AlphaSearch::~AlphaSearch() = default;
AlphaResult AlphaSearch::run() { return parts_->optimisation.run(); }
AlphaResult AlphaSearch::go_on() { return parts_->optimisation.go_on(); }
AlphaResult AlphaSearch::spread_on(int count) { return parts_->optimisation.spread_on(count); }

}  // namespace topple::uncertainty
