#include "uncertainty/possibility.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "uncertainty/boundary.h"
#include "uncertainty/cut_program.h"
#include "uncertainty/facets.h"
#include "uncertainty/linear.h"
#include "uncertainty/random.h"
#include "uncertainty/starts.h"
#include "uncertainty/wall.h"

namespace topple::uncertainty {
namespace {

/// A place by its distance t = 1 - α from the core and its position w in [-1, 1]^n in the box of that cut. With
/// max |w_i| = 1 the membership is 1 - t.
struct Ray {
  Point w;
};

Point calc_place(const Space& space, const Ray& ray, double t) {
  const Box box = make_box(space, std::clamp(1 - t, 0.0, 1.0));
  Point x(ray.w.size());
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] = ray.w[i] <= -1  ? box.lower[i]
           : ray.w[i] >= 1 ? box.upper[i]
                           : box.lower[i] + 0.5 * (ray.w[i] + 1) * (box.upper[i] - box.lower[i]);
  return clip(box, std::move(x));
}

Ray find_ray(const Space& space, const Point& x, double t) {
  const Box box = make_box(space, std::clamp(1 - t, 0.0, 1.0));
  Ray ray{Point(x.size(), 0.0)};
  for (std::size_t i = 0; i < x.size(); ++i)
    if (const double width = box.upper[i] - box.lower[i]; width > 0)
      ray.w[i] = std::clamp(2 * (x[i] - box.lower[i]) / width - 1, -1.0, 1.0);
  return ray;
}

/// Scaled so that the largest coordinate is 1 in size.
Ray to_surface(Ray ray) {
  double largest = 0;
  for (const double w : ray.w) largest = std::max(largest, std::abs(w));
  if (largest > 0)
    for (double& w : ray.w) w /= largest;
  return ray;
}

/// A bisection on one ray between a place of the class and, nearer to the core, one of another class.
struct Bracket {
  Ray ray;
  double in = 1, out = 0;
};

/// Runs that are more possible.
int count_above(const Space& space, const Archive& archive, double possibility) {
  return static_cast<int>(std::count_if(archive.samples().begin(), archive.samples().end(),
                                        [&](const Sample& s) { return calc_membership(space, s.x) > possibility; }));
}

std::vector<int> find_axes(const Space& space) {
  std::vector<int> axes;
  for (int i = 0; i < space.size(); ++i)
    if (space.inputs[i].width() > 0) axes.push_back(i);
  return axes;
}

/// The search for one class; every step names points for the common batch and then reads the archive.
class Climb {
 public:
  Climb(const Space& space, int outcome, const PossibilityOptions& options)
      : space_(space),
        outcome_(outcome),
        options_(options),
        random_(options.seed + 31 * static_cast<size_t>(outcome + 2)),
        support_(make_box(space, 0)),
        scale_(calc_scale(space)),
        centre_(calc_centre(space)),
        axes_(find_axes(space)),
        boundary_(scale_, axes_, 0.03) {
    if (space.has_interaction()) cut_.emplace(space, 0, scale_, axes_);
  }

  bool is_done() const { return stage_ == Stage::Done; }
  const std::vector<Boundary::Plane>& facets() const { return facets_; }
  Possibility result(const Archive& archive) const {
    const Summit s = find_highest();
    return {outcome_,   s.mu,     std::min(s.resolution, 1 - s.mu), s.sample, count_above(space_, archive, s.mu),
            converged_, summits_, static_cast<int>(archive.size())};
  }
  /// Where nothing better than what is known has turned up, new islands are all there is to do.
  void take_known(const Archive& archive, const Possibility& known) {
    refresh(archive);
    summits_ = known.summits;
    if (!known.converged || best_ > known.possibility + options_.tolerance) return;
    resolution_ = known.resolution;
    converged_ = best_ >= 1 || static_cast<std::size_t>(known.seen) == archive.size();
    stage_ = converged_ ? Stage::Done : Stage::Ways;
  }

  /// Where planes bound the class, these, and from them its most possible place; false where it bends.
  bool locate_facets(Asker& asker) {
    refresh(asker.archive());
    if (stage_ != Stage::Start || space_.has_interaction() || axes_.size() < 2 || axes_.size() > most_facet_axes ||
        sample_ < 0 || best_ >= 1)
      return true;
    const Region support = make_region(space_, 0);
    const auto before = options_.facets.planes.find(outcome_);
    FacetSearch search(
        support, asker, [this](const Result& r) { return options_.classify(r) == outcome_; },
        before == options_.facets.planes.end() ? std::vector<Boundary::Plane>() : before->second);
    search.run({{support, {}}}, asker.rest() / 8);
    refresh(asker.archive());
    if (search.is_polyhedral()) facets_ = search.list_planes();
    is_bounded_ = search.is_polyhedral() && search.is_complete();
    return !search.has_bend();
  }

  /// Takes notice of new samples.
  void refresh(const Archive& archive) {
    for (; seen_ < static_cast<int>(archive.size()); ++seen_) {
      ours_.push_back(options_.classify(archive[seen_].result) == outcome_);
      if (!ours_.back()) continue;
      const Point& x = archive[seen_].x;
      if (support_.contains(x)) {
        const double mu = calc_membership(space_, x);
        if (highest_ && mu <= highest_->mu && std::find(asked_.begin(), asked_.end(), x) == asked_.end()) continue;
        // on a plateau of a joint membership the one from which the way up may be short
        const bool is_nearer = cut_ && sample_ >= 0 && mu == best_ && calc_distance(x) < calc_distance(best_x_);
        if (mu > best_ || sample_ < 0 || is_nearer) best_ = mu, sample_ = seen_, best_x_ = x;
      } else if (sample_ < 0) {
        Point moved = clip(support_, x);
        if (const double mu = calc_membership(space_, moved); mu > beside_) beside_ = mu, best_x_ = std::move(moved);
      }
    }
  }

  /// Points to be run for the next step; none if there is nothing left to do.
  ///   rest  runs that are left for all classes
  std::vector<Point> ask(const Archive& archive, int rest) {
    rest_ = rest;
    refresh(archive);
    for (;;) {
      std::vector<Point> points;
      switch (stage_) {
        case Stage::Start:
          begin();
          break;
        case Stage::Bisect:
          points = ask_section();
          break;
        case Stage::Wall:
          points = ask_wall(archive);
          break;
        case Stage::Lead:
          points = ask_along_wall(archive);
          break;
        case Stage::Look:
          points = ask_look();
          break;
        case Stage::Move:
          points = ask_moved(archive);
          break;
        case Stage::Ways:
          points = ask_ways(archive);
          break;
        case Stage::Done:
          return {};
      }
      if (highest_) asked_ = points;
      if (!points.empty()) return points;
    }
  }

  /// After the points were run.
  void tell(const Archive& archive) {
    const double before = best_;
    const Point from = best_x_;
    const bool had_sample = sample_ >= 0;
    refresh(archive);
    switch (stage_) {
      case Stage::Bisect:
        if (narrow(archive)) leave_bisection();
        break;
      case Stage::Wall: {
        std::vector<bool> inside;
        for (const Point& x : wall_->pending()) inside.push_back(is_ours(archive, x));
        wall_->tell(inside);
        if (wall_->is_done()) keep_wall(archive);
        break;
      }
      case Stage::Lead:
        learn(archive, best_ - before, best_x_ != from);
        break;
      case Stage::Look:
        if (best_ > before || (sample_ >= 0 && !had_sample)) {
          stage_ = Stage::Start;
        } else {
          stage_ = Stage::Move;
        }
        break;
      case Stage::Move:
        stage_ = best_ > before || (sample_ >= 0 && !had_sample) ? Stage::Start : Stage::Ways;
        break;
      case Stage::Ways:
        if (best_ > before) {
          stage_ = Stage::Start, are_bottoms_found_ = false;
        } else {
          leave_connected(archive);
        }
        break;
      case Stage::Start:
      case Stage::Done:
        break;
    }
  }

 private:
  enum class Stage { Start, Bisect, Wall, Lead, Look, Move, Ways, Done };
  /// The most possible place of an island of the class.
  struct Summit {
    double mu = 0;
    int sample = -1;
    Point x;
    double resolution = 1;
  };

  bool is_ours(const Archive& archive, const Point& x) const {
    const int i = archive.find(x);
    return i >= 0 && ours_[i];
  }

  void begin() {
    if (best_ >= 1 || axes_.empty() || round_++ >= options_.rounds) {
      settle_on(find_highest());
      converged_ = best_ >= 1;
      stage_ = Stage::Done;
      return;
    }
    const double t = 1 - best_;
    bracket_ = {find_ray(space_, best_x_, t), t, 0};
    stage_ = Stage::Bisect;
  }

  static constexpr int sections = 8;
  double at_section(int k) const { return bracket_.out + (bracket_.in - bracket_.out) * k / sections; }
  bool is_narrow() const { return bracket_.in - bracket_.out <= 0.5 * options_.tolerance; }

  std::vector<Point> ask_section() {
    std::vector<Point> points;
    if (is_narrow()) {
      leave_bisection();
      return points;
    }
    const bool from_core = bracket_.out == 0;
    for (int k = from_core ? 0 : 1; k <= (from_core ? sections : sections - 1); ++k)
      add(points, calc_place(space_, bracket_.ray, at_section(k)));
    if (points.empty()) leave_bisection();
    return points;
  }

  /// Keeps the section in which the class begins, seen from the core. True when it is narrow.
  bool narrow(const Archive& archive) {
    const bool from_core = bracket_.out == 0;
    int k = from_core ? 0 : 1;
    while (k < sections && !is_ours(archive, calc_place(space_, bracket_.ray, at_section(k)))) ++k;
    const bool found = k < sections || !from_core || is_ours(archive, calc_place(space_, bracket_.ray, bracket_.in));
    const double in = at_section(k);
    bracket_.out = k == 0 || !found ? in : at_section(k - 1);
    bracket_.in = in;
    return is_narrow();
  }

  void leave_bisection() {
    resolution_ = bracket_.in - bracket_.out;
    if (axes_.size() < 2 || sample_ < 0 || walled_ == best_) {
      look_around();
      return;
    }
    stage_ = Stage::Wall;
    reach_ = largest_reach / 2, promised_ = 1, leads_ = 0, walled_from_ = best_;
    wall_.reset(), boundary_.clear(), tried_.clear(), turns_ = 0;
    if (!facets_.empty()) boundary_.adopt(facets_, best_x_, reach_, {});
  }

  Boundary::Places find_places(const Archive& archive, bool ours) const {
    Boundary::Places places;
    for (int i = 0; i < seen_; ++i)
      if (const Point& x = archive[i].x; ours_[i] == ours && boundary_.calc_offset(x, best_x_) < 3 * reach_ &&
                                         (!ours || calc_membership(space_, x) > 0))
        places.push_back(&x);
    return places;
  }

  void keep_wall(const Archive& archive) {
    stage_ = Stage::Lead;
    // it was another plane that stopped it
    if (boundary_.keep(*wall_, best_x_, reach_, find_places(archive, true))) reach_ = largest_reach / 2;
  }

  /// The nearest run of another class above, where there is one that no plane explains.
  std::pair<int, bool> find_beyond(const Archive& archive) const {
    int nearest = -1;
    double least = 0;
    bool is_explained = true;
    for (int at = 0; at < seen_; ++at) {
      const Point& x = archive[at].x;
      if (ours_[at] || !(calc_membership(space_, x) > best_)) continue;
      if (std::find(tried_.begin(), tried_.end(), at) != tried_.end()) continue;
      const double distance = boundary_.calc_offset(x, best_x_);
      const bool lies_beyond = distance > 2 * reach_ || boundary_.explains(x, reach_);
      if (nearest < 0 || (lies_beyond == is_explained ? distance < least : !lies_beyond))
        least = distance, nearest = at, is_explained = lies_beyond;
    }
    return {nearest, is_explained};
  }

  /// The boundary of the class near the best place as a plane.
  std::vector<Point> ask_wall(const Archive& archive) {
    if (!wall_) {
      const auto [nearest, is_explained] = find_beyond(archive);
      const bool promises_nothing = reach_ < 0.004 && promised_ < 0.1 * options_.tolerance;
      const bool is_given_up = is_hopeless(archive);
      if (nearest < 0 || promises_nothing || is_given_up || (is_explained && is_bounded_) || reach_ < smallest_reach ||
          leads_++ >= most_leads) {
        const bool is_higher = best_ > walled_from_ + options_.tolerance;
        walled_ = best_;
        stage_ = Stage::Start;
        if (!is_higher || is_given_up) look_around();
        return {};
      }
      tried_.push_back(nearest);
      WallProbe::Project project;
      if (cut_)
        project = [this](const Point& from, const Point& to) { return cut_->project_from(from, to, 10 * reach_); };
      const bool has_edges = boundary_.has_edges();
      const Point inside =
          has_edges
              ? boundary_.find_inner(best_x_, reach_, find_places(archive, true), find_places(archive, false)).first
              : best_x_;
      wall_.emplace(
          support_, scale_, axes_, inside, archive[nearest].x, reach_,
          [this](const Point& x) { return calc_membership(space_, x) > 0; }, std::move(project), has_edges ? 4 : 0);
      if (wall_->is_done()) keep_wall(archive);
    }
    return wall_->pending();
  }

  /// What is most possible on this side of the plane, and a little farther inside: a class may bend away.
  std::vector<Point> ask_along_wall(const Archive& archive) {
    std::vector<Point> points;
    promised_ = 0;
    if (wall_->found()) {
      // all planes; the latest alone, since a class may not be convex
      for (const bool latest :
           boundary_.planes().size() > 1 ? std::vector<bool>{false, true} : std::vector<bool>{true}) {
        for (const double part : {0.0, 0.01, 0.03, 0.1, 0.3}) {
          const std::vector<HalfSpace> sides =
              latest ? boundary_.see_latest(best_x_, part * reach_) : boundary_.see(best_x_, part * reach_);
          Point x = find_most_possible(space_, scale_, axes_, best_x_, 2 * reach_, sides);
          if (part == 0 && !(latest && boundary_.planes().size() > 1)) promised_ = calc_membership(space_, x) - best_;
          const bool is_flat = cut_ && !(promised_ > 0);
          if (is_flat) x = find_nearest_to_centre(sides.back());
          for (const double way : {1.0, 0.5, 0.25}) {
            Point y = best_x_;
            for (const int i : axes_) y[i] += way * (x[i] - best_x_[i]);
            const double mu = calc_membership(space_, y);
            if (is_flat ? mu >= best_ : mu > best_) add(points, clip(support_, std::move(y)));
          }
        }
      }
    }
    if (points.empty()) learn(archive, 0, false);
    return points;
  }

  /// Of a half space that is seen from the best place: on a plateau the way up begins there.
  Point find_nearest_to_centre(const HalfSpace& side) const {
    const std::size_t n = axes_.size();
    Quadratic q{std::vector<double>(n), std::vector<double>(n * n, 0.0)};
    std::vector<double> lower(n), upper(n);
    for (std::size_t k = 0; k < n; ++k) {
      const int i = axes_[k];
      q.slope[k] = (best_x_[i] - centre_[i]) / scale_[i];
      q.hessian[k * n + k] = 1;
      lower[k] = std::max(-2 * reach_, (support_.lower[i] - best_x_[i]) / scale_[i]);
      upper[k] = std::min(2 * reach_, (support_.upper[i] - best_x_[i]) / scale_[i]);
    }
    const HalfSpace own{side.a, std::max(side.b, 0.0)};
    const std::vector<double> v = minimise(q, {own}, lower, upper, std::vector<double>(n, 0.0));
    Point x = best_x_;
    for (std::size_t k = 0; k < n; ++k) x[axes_[k]] += v[k] * scale_[axes_[k]];
    return clip(support_, std::move(x));
  }

  /// Goes on farther or nearer, by what has come of what the plane promised.
  void learn(const Archive& archive, double gained, bool moved) {
    const double part = promised_ > 0 ? gained / promised_ : moved ? 1 : 0;
    // what stopped it may be another plane
    const bool is_new = part <= 0.5 && boundary_.has_edges() &&
                        turns_ < (boundary_.is_turned() ? std::ssize(axes_) : 2) && !find_beyond(archive).second;
    turns_ = is_new ? turns_ + 1 : 0;
    if (moved || !is_new) tried_.clear();
    if (!is_new) reach_ = std::min(largest_reach, reach_ * (part > 0.5 ? 1.2 : part > 0.2 ? 0.5 : 0.25));
    wall_.reset();
    stage_ = Stage::Wall;
  }

  /// Above what was found: corners and axes of the cut that would be the next better one, places spread in it, places
  /// near the best one.
  std::vector<Point> ask_look() {
    const double t = std::max(1 - best_ - options_.tolerance, 0.0);
    const int n = static_cast<int>(axes_.size());
    std::vector<Point> points;
    const auto add_ray = [&](const Ray& r, double at) { add(points, calc_place(space_, r, at)); };
    Ray ray{Point(space_.inputs.size(), 0.0)};
    for (std::size_t k = 0; n <= 8 && k < std::size_t{1} << n; ++k) {
      for (int i = 0; i < n; ++i) ray.w[axes_[i]] = k >> i & 1 ? 1 : -1;
      add_ray(ray, t);
    }
    for (int i = 0; i < n; ++i)
      for (const double end : {-1.0, 1.0}) {
        ray.w.assign(ray.w.size(), 0.0);
        ray.w[axes_[i]] = end;
        add_ray(ray, t);
      }
    for (const auto& u : make_sobol_points(n, 1 + 20 * n * round_, 20 * n, options_.seed)) {
      for (int i = 0; i < n; ++i) ray.w[axes_[i]] = 2 * u[i] - 1;
      add_ray(ray, t);
    }
    const Ray here = to_surface(find_ray(space_, best_x_, 1 - best_));
    for (const double reach : {0.5, 0.2, 0.05, 0.01})
      for (int k = 0; k < 8; ++k) {
        Ray r = here;
        for (const int i : axes_) r.w[i] = std::clamp(r.w[i] + reach * random_.next(-1, 1), -1.0, 1.0);
        // a free axis changed, the surface kept: the nearest better cut
        add_ray(k % 2 == 0 ? to_surface(r) : r, t);
      }
    if (points.empty()) stage_ = Stage::Move;
    return points;
  }

  /// Runs of the class elsewhere, pulled into the cut that would be the next better one, and the best ones with one
  /// input anywhere in it: other islands of the class; and more spread points.
  std::vector<Point> ask_moved(const Archive& archive) {
    const int n = static_cast<int>(axes_.size());
    const double above = std::min(best_ + options_.tolerance, 1.0);
    const Box box = make_box(space_, above);
    CutProgram cut(space_, above, scale_, axes_);
    const auto pull = [&](const Point& x) {
      Point inside = clip(box, x);
      return !cut_ || is_in_cut(space_, box, above, inside) ? inside : cut.project_from(centre_, inside, 1);
    };
    std::vector<std::pair<double, int>> ours;
    for (int i = 0; i < seen_; ++i)
      if (ours_[i]) ours.emplace_back(-calc_membership(space_, archive[i].x), i);
    std::stable_sort(ours.begin(), ours.end());
    std::vector<Point> points;
    // the best ones, and as many of the others
    const std::size_t most = 10 * static_cast<std::size_t>(n), rest = ours.size() > most ? ours.size() - most : 0;
    for (std::size_t k = 0; k < std::min(most, ours.size()); ++k) add(points, pull(archive[ours[k].second].x));
    for (std::size_t k = 0; k < std::min(most, rest); ++k)
      add(points, pull(archive[ours[most + k * rest / std::min(most, rest)].second].x));
    constexpr int parts = 8;
    const std::size_t others = std::min<std::size_t>(2, ours.size() / 4);
    for (std::size_t k = 0; k <= others && k < ours.size(); ++k) {
      const Point x = pull(archive[ours[k * (ours.size() - 1) / 4].second].x);
      for (const int i : axes_)
        for (int part = 0; part < parts; ++part) {
          Point y = x;
          y[i] = box.lower[i] + (part + random_.next()) / parts * (box.upper[i] - box.lower[i]);
          add(points, std::move(y));
        }
    }
    const int spread = options_.spread * n;
    for (const auto& u : make_sobol_points(n, 1 + spread * round_, spread, options_.seed + 1)) {
      Point fractions(space_.inputs.size(), 0.0);
      for (int i = 0; i < n; ++i) fractions[axes_[i]] = u[i];
      add(points, place_in(box, fractions));
    }
    if (points.empty()) stage_ = Stage::Ways;
    return points;
  }

  Summit find_highest() const {
    return highest_ && highest_->mu >= best_ ? *highest_ : Summit{best_, sample_, best_x_, resolution_};
  }
  void settle_on(Summit s) { best_ = s.mu, sample_ = s.sample, best_x_ = std::move(s.x), resolution_ = s.resolution; }

  /// Whether the climb of an island is not worth its runs: it has arrived at what is known, or what is missing is more
  /// than came of those it had.
  bool is_hopeless(const Archive& archive) const {
    if (!highest_ || best_ > highest_->mu) return false;
    const int n = static_cast<int>(axes_.size()), spent = seen_ - island_.seen;
    return spent > runs_of_climb * n || (spent > 25 * n && best_ + 5 * (best_ - island_.mu) < highest_->mu) ||
           is_near(best_x_, highest_->x) ||
           std::any_of(summits_.begin(), summits_.end(), [&](int at) { return is_near(best_x_, archive[at].x); });
  }
  bool is_near(const Point& x, const Point& y) const { return boundary_.calc_offset(x, y) < least_apart; }
  /// Climbs that led to the best place: the class is bent and not in pieces.
  auto count_vain(const Archive& archive) const {
    return std::count_if(summits_.begin(), summits_.end(), [&](int at) { return is_near(archive[at].x, best_x_); });
  }

  static constexpr int parts_of_way = 8;
  Point calc_on_way(const Point& from, const Point& to, int part) const {
    Point x = from;
    for (const int i : axes_) x[i] += (to[i] - from[i]) * part / parts_of_way;
    return x;
  }
  /// To where ways are looked at: the best place, then the summits of other islands.
  const Point& find_target(const Archive& archive) const {
    return target_ == 0 ? best_x_ : archive[summits_[target_ - 1]].x;
  }

  /// Straight ways from runs that have no more possible one of the class around them. Membership falls nowhere below
  /// that of their lower end, so where a way lies in the class, its run is on the island of what it leads to.
  std::vector<Point> ask_ways(const Archive& archive) {
    if (!are_bottoms_found_) find_bottoms(archive);
    while (!islands_.empty() && target_ <= summits_.size()) {
      std::vector<Point> points;
      for (const int at : islands_)
        for (int part = 1; part < parts_of_way; ++part)
          add(points, calc_on_way(archive[at].x, find_target(archive), part));
      if (!points.empty()) return points;
      leave_connected(archive);
    }
    const bool is_dear = rest_ < runs_of_ways + runs_of_climb * static_cast<int>(axes_.size());
    if (islands_.empty() || climbed_ >= options_.islands || is_dear || count_vain(archive) >= most_vain) {
      converged_ = sample_ >= 0, stage_ = Stage::Done;
    } else {
      highest_ = find_highest();
      const int at = islands_.front();
      islands_.erase(islands_.begin());
      settle_on({calc_membership(space_, archive[at].x), at, archive[at].x, 1});
      island_ = {best_, seen_};
      ++climbed_;
      stage_ = Stage::Start;
    }
    return {};
  }

  /// Runs from which climbs may begin.
  void find_bottoms(const Archive& archive) {
    are_bottoms_found_ = true, islands_.clear(), target_ = 0;
    if (sample_ < 0 || options_.islands == 0 || is_bounded_ || axes_.size() < 2 || rest_ < runs_of_ways) return;
    if (count_vain(archive) >= most_vain) return;
    std::vector<std::pair<double, int>> ours;
    for (int i = 0; i < seen_; ++i)
      if (ours_[i] && support_.contains(archive[i].x)) ours.emplace_back(-calc_membership(space_, archive[i].x), i);
    std::stable_sort(ours.begin(), ours.end());
    if (constexpr std::size_t most = 2000; ours.size() > most) {
      for (std::size_t k = 0; k < most; ++k) ours[k] = ours[k * ours.size() / most];
      ours.resize(most);
    }
    RankedPlaces places{axes_.size(), {}};
    std::vector<double> taken, others;
    const auto append = [&](std::vector<double>& to, const Point& x) {
      for (const int i : axes_) to.push_back(x[i] / scale_[i]);
    };
    for (const auto& [mu, at] : ours) append(places.at, archive[at].x);
    for (int i = 0; i < seen_; ++i)
      if (!ours_[i] && support_.contains(archive[i].x)) append(others, archive[i].x);
    append(taken, best_x_);
    for (const int at : summits_) append(taken, archive[at].x);
    for (const std::size_t k : choose_apart(places, taken, least_apart, most_ways,
                                            [&](std::size_t at) { return !is_linked(places, at, others); }))
      islands_.push_back(ours[k].second);
  }

  /// Whether one of the nearest better places is a neighbour: no run of another class lies in the ball between them.
  static bool is_linked(const RankedPlaces& places, std::size_t k, const std::vector<double>& others) {
    const std::size_t n = places.n;
    const auto calc_square = [n](const double* a, const double* b) {
      double square = 0;
      for (std::size_t i = 0; i < n; ++i) square += (a[i] - b[i]) * (a[i] - b[i]);
      return square;
    };
    const double* here = &places.at[k * n];
    std::vector<std::pair<double, std::size_t>> better;
    for (std::size_t j = 0; j < k; ++j) better.emplace_back(calc_square(&places.at[j * n], here), j);
    const std::size_t count = std::min(most_links, better.size());
    std::partial_sort(better.begin(), better.begin() + static_cast<std::ptrdiff_t>(count), better.end());
    for (std::size_t l = 0; l < count; ++l) {
      const double* there = &places.at[better[l].second * n];
      bool is_between = false;
      for (std::size_t o = 0; o + n <= others.size() && !is_between; o += n)
        is_between = calc_square(&others[o], here) + calc_square(&others[o], there) < better[l].first;
      if (!is_between) return true;
    }
    return false;
  }

  /// Keeps those from which the way to the target leaves the class; then comes the next target.
  void leave_connected(const Archive& archive) {
    const Point& to = find_target(archive);
    std::erase_if(islands_, [&](int at) {
      for (int part = 1; part < parts_of_way; ++part)
        if (const int i = archive.find(calc_on_way(archive[at].x, to, part)); i >= 0 && !ours_[i]) return false;
      return true;
    });
    ++target_;
  }

  /// Behind a climb: of an island that stays below what is known come other ones.
  void look_around() {
    stage_ = Stage::Look;
    if (!highest_) return;
    if (best_ > highest_->mu) {
      are_bottoms_found_ = false;
    } else {
      summits_.push_back(sample_);
      settle_on(*highest_);
      stage_ = Stage::Ways;
    }
    highest_.reset();
  }

  /// From the centre, by widths.
  double calc_distance(const Point& x) const {
    double square = 0;
    for (const int i : axes_) square += std::pow((x[i] - centre_[i]) / scale_[i], 2);
    return std::sqrt(square);
  }

  void add(std::vector<Point>& points, Point x) const {
    if (!space_.has_interaction() || calc_membership(space_, x) > 0) points.push_back(std::move(x));
  }

  const Space& space_;
  int outcome_;
  const PossibilityOptions& options_;
  Random random_;
  Box support_;
  Point scale_, centre_;  // widths of the supports, middle of the cores
  std::vector<int> axes_;
  Stage stage_ = Stage::Start;
  Bracket bracket_;
  Point best_x_;
  double best_ = 0, resolution_ = 1;
  double beside_ = -1;  // largest μ of runs outside the support, moved there, as long as none lies inside
  int sample_ = -1, seen_ = 0, round_ = 0;
  std::vector<bool> ours_;  // which of the samples seen are of the class
  bool converged_ = false;
  std::optional<CutProgram> cut_;  // the support, with interaction
  std::optional<WallProbe> wall_;
  std::vector<Boundary::Plane> facets_;  // of a class that planes bound
  bool is_bounded_ = false;              // by them, where it was most possible
  Boundary boundary_;                    // near the best place
  std::vector<int> tried_;               // runs from which planes were looked for, since it moved
  static constexpr double largest_reach = 0.2, smallest_reach = 1e-4;  // of a plane, by widths
  static constexpr int most_leads = 30;
  static constexpr std::size_t most_facet_axes = 8;
  double reach_ = 0, promised_ = 0;
  double walled_ = -1, walled_from_ = 0;  // possibility at which walls have led no further; at which they began
  int leads_ = 0, turns_ = 0;             // turns: leads in a row that met another plane
  // other islands of the class: what is known while one is climbed, what was asked for last, where it began
  std::optional<Summit> highest_;
  std::vector<Point> asked_;
  struct {
    double mu = 0;
    int seen = 0;
  } island_;
  std::vector<int> islands_, summits_;  // samples: where climbs may begin, where they ended
  std::size_t target_ = 0;
  int climbed_ = 0, rest_ = 0;
  bool are_bottoms_found_ = false;
  static constexpr double least_apart = 0.02;  // of where ways begin, by widths
  static constexpr std::size_t most_links = 5;
  static constexpr int most_vain = 2;
  static constexpr std::size_t most_ways = 12;
  static constexpr int runs_of_ways = 2 * most_ways * (parts_of_way - 1);  // for which there is to be room
  static constexpr int runs_of_climb = 100;                                // of an island, per input, at most
};

}  // namespace

PossibilityResult find_possibilities(const Space& space, Asker& asker, const PossibilityOptions& options) {
  check_space(space);
  if (asker.asked() == 0) asker.ask({calc_centre(space)});
  std::map<int, Climb> climbs;
  int seen = 0;
  const auto note_classes = [&] {
    for (; seen < asker.asked(); ++seen) {
      const int c = options.classify(asker.archive()[seen].result);
      if (std::find(options.skipped.begin(), options.skipped.end(), c) == options.skipped.end())
        climbs.try_emplace(c, space, c, options);
    }
  };
  note_classes();
  for (const Possibility& p : options.known)
    if (const auto climb = climbs.find(p.outcome); climb != climbs.end()) climb->second.take_known(asker.archive(), p);
  PossibilityResult result;
  result.facets = options.facets;
  for (auto& [c, climb] : climbs)
    if (!result.facets.has_bends) result.facets.has_bends = !climb.locate_facets(asker);
  note_classes();
  for (;;) {
    std::vector<Point> points;
    std::vector<Climb*> asking;
    for (auto& [c, climb] : climbs) {
      const auto more = climb.ask(asker.archive(), asker.rest());
      if (more.empty()) continue;
      asking.push_back(&climb);
      points.insert(points.end(), more.begin(), more.end());
    }
    if (asking.empty()) break;
    const auto indices = asker.ask(points);
    if (std::count(indices.begin(), indices.end(), -1) > 0) {
      result.ending = asker.is_cancelled() ? Ending::Cancelled : Ending::LimitReached;
      break;
    }
    for (auto* climb : asking) climb->tell(asker.archive());
    note_classes();
  }
  for (auto& [c, climb] : climbs) {
    climb.refresh(asker.archive());
    result.classes.push_back(climb.result(asker.archive()));
    if (!climb.facets().empty()) result.facets.planes[c] = climb.facets();
  }
  return result;
}

Possibility read_possibility(const Space& space, const Archive& archive, int outcome, const Classify& classify) {
  Possibility p;
  p.outcome = outcome;
  const Box support = make_box(space, 0);
  for (int i = 0; i < static_cast<int>(archive.size()); ++i) {
    if (classify(archive[i].result) != outcome || !support.contains(archive[i].x)) continue;
    const double mu = calc_membership(space, archive[i].x);
    if (mu > p.possibility || p.sample < 0) p.possibility = mu, p.sample = i;
  }
  p.above = count_above(space, archive, p.possibility);
  p.converged = p.possibility >= 1;
  p.resolution = 1 - p.possibility;
  return p;
}

std::vector<Possibility> read_possibilities(const Space& space, const Archive& archive,
                                            const std::vector<Possibility>& known, const Classify& classify) {
  const Box support = make_box(space, 0);
  std::set<int> classes;
  for (const Sample& s : archive.samples())
    if (is_in_cut(space, support, 0, s.x)) classes.insert(classify(s.result));
  std::vector<Possibility> all;
  for (const int c : classes) {
    Possibility& seen = all.emplace_back(read_possibility(space, archive, c, classify));
    for (const Possibility& k : known)
      if (k.outcome == c && seen.possibility <= k.possibility + PossibilityOptions{}.tolerance)
        seen.resolution = k.resolution, seen.converged = k.converged || seen.converged, seen.summits = k.summits,
        seen.seen = k.seen;
  }
  return all;
}

std::vector<Point> make_ray(const Space& space, const Point& x, int count) {
  const double from = 1 - std::clamp(calc_membership(space, x), 0.0, 1.0);
  const Ray ray = find_ray(space, x, from);
  std::vector<Point> points;
  for (int k = 0; k < count; ++k) {
    const double t = from + (1 - from) * k / std::max(1, count - 1);
    points.push_back(t > 0 ? calc_place(space, ray, t) : x);
  }
  return points;
}

double calc_possibility_of(const PossibilityResult& r, const std::vector<int>& outcomes) {
  double most = 0;
  for (const auto& p : r.classes)
    if (std::find(outcomes.begin(), outcomes.end(), p.outcome) != outcomes.end()) most = std::max(most, p.possibility);
  return most;
}

bool is_necessity_converged(const PossibilityResult& r, int outcome) {
  return calc_necessity(r, outcome) <= 0 || std::all_of(r.classes.begin(), r.classes.end(), [outcome](const auto& p) {
           return p.outcome == outcome || p.converged;
         });
}

double calc_necessity(const PossibilityResult& r, int outcome) {
  double most = 0;
  for (const auto& p : r.classes)
    if (p.outcome != outcome) most = std::max(most, p.possibility);
  return 1 - most;
}

}  // namespace topple::uncertainty
