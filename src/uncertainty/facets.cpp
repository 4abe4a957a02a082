#include "uncertainty/facets.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "uncertainty/cut_program.h"
#include "uncertainty/linear.h"

namespace topple::uncertainty {
namespace {

// lengths by widths of the supports
constexpr double largest_radius = 0.02, smallest_radius = 5e-5;  // of places by which a plane is found
constexpr double sharp = 1e-9;                                   // how far a crossing is known
constexpr double coarse = 3e-4, fine = 1e-5;                     // and those around it, as parts of the radius
constexpr double shrinking = 0.25;
constexpr double flat = 1e-3;               // likewise: how far the outcome may reach beyond it
constexpr double margins[] = {1e-5, 1e-7};  // that the best places keep off planes, one after the other
constexpr double inner_margins[] = {1e-3, 1e-4};
constexpr double known_to = 2e-6;          // planes at a best place
constexpr double beyond[] = {1e-3, 0.02};  // where planes are looked behind
constexpr std::size_t most_places = 60;    // of goals, at a time
constexpr double aside = 0.2;              // of a way: how far another one ends beside it
constexpr double least_turn = 0.02;        // of facets, 1 - cos
constexpr int least_asked = 40;            // for each axis: with fewer no plane is located
constexpr int most_aims = 4;               // directions in which a boundary is met
constexpr int most_failed = 2;             // ways of which no plane was found
constexpr int most_dropped = 3;            // planes that left out what is known

/// a + t (b - a)
std::vector<double> blend(const std::vector<double>& a, const std::vector<double>& b, double t) {
  std::vector<double> x = a;
  for (std::size_t k = 0; k < x.size(); ++k) x[k] += t * (b[k] - a[k]);
  return x;
}

double calc_length(const std::vector<double>& a, const std::vector<double>& b) {
  double square = 0;
  for (std::size_t k = 0; k < a.size(); ++k) square += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(square);
}

/// The unit vector from a to b.
std::vector<double> calc_direction(const std::vector<double>& a, const std::vector<double>& b) {
  const double length = calc_length(a, b);
  std::vector<double> direction(a.size());
  for (std::size_t k = 0; k < a.size(); ++k) direction[k] = (b[k] - a[k]) / length;
  return direction;
}

/// Unit vectors across a unit vector and each other; the first one is oblique to the axes.
std::vector<std::vector<double>> make_tangents(const std::vector<double>& direction) {
  const std::size_t n = direction.size();
  std::vector<std::vector<double>> all = {direction};
  for (std::size_t turn = 0; turn <= n && all.size() < n; ++turn) {
    std::vector<double> t(n, 0.0);
    if (turn > 0) t[turn - 1] = 1;
    for (std::size_t k = 0; turn == 0 && k < n; ++k) t[k] = (k % 2 == 0 ? 1 : -1) * (1 + 0.3 * static_cast<double>(k));
    for (const auto& other : all) {
      const double along = dot(t, other);
      for (std::size_t k = 0; k < n; ++k) t[k] -= along * other[k];
    }
    const double length = std::sqrt(dot(t, t));
    if (length < 0.1) continue;
    for (double& v : t) v /= length;
    all.push_back(std::move(t));
  }
  all.erase(all.begin());
  return all;
}

/// The plane through n places, seen from one inside; empty if there is none.
std::vector<double> fit_normal(const std::vector<std::vector<double>>& places, const std::vector<double>& inside,
                               double scale) {
  const std::size_t n = inside.size();
  std::vector<std::vector<double>> A;
  std::vector<double> normal(n, 1.0);
  for (std::size_t k = 0; k < n; ++k) {
    A.emplace_back();
    for (std::size_t j = 0; j < n; ++j) A.back().push_back((places[k][j] - inside[j]) / scale);
  }
  if (!solve(A, normal)) return {};
  const double length = std::sqrt(dot(normal, normal));
  if (!(length > 0) || !std::isfinite(length)) return {};
  for (double& v : normal) v /= length;
  return normal;
}

}  // namespace

FacetSearch::FacetSearch(const Region& support, Asker& asker, std::function<bool(const Result&)> is_inside,
                         const std::vector<Boundary::Plane>& planes)
    : support_(support), asker_(asker), is_inside_(std::move(is_inside)) {
  for (const int i : list_samples()) members_.push_back(to_place(asker.archive()[i].x));
  lower_ = to_place(support_.box.lower), upper_ = to_place(support_.box.upper);
  for (const Boundary::Plane& p : planes) facets_.push_back({p.side, p.error, {to_place(p.at)}});
  review();
}

/// Of the outcome, in the support.
std::vector<int> FacetSearch::list_samples() const {
  std::vector<int> samples;
  for (int i = 0; i < asker_.asked(); ++i)
    if (is_inside_(asker_.archive()[i].result) && support_.box.contains(asker_.archive()[i].x)) samples.push_back(i);
  return samples;
}

std::vector<Boundary::Plane> FacetSearch::list_planes() const {
  std::vector<Boundary::Plane> planes;
  for (const Facet& f : facets_) planes.push_back({f.side, to_point(f.pivots.back()), 0, f.error});
  return planes;
}

double FacetSearch::calc_error(const Facet& f, const Place& x) {
  double nearest = calc_length(f.pivots.front(), x);
  for (const Place& p : f.pivots) nearest = std::min(nearest, calc_length(p, x));
  return f.error * nearest;
}

Point FacetSearch::to_point(const Place& v) const {
  Point x = support_.box.lower;
  for (std::size_t k = 0; k < v.size(); ++k) x[support_.axes[k]] = v[k] * support_.scale[support_.axes[k]];
  return clip(support_.box, std::move(x));
}

FacetSearch::Place FacetSearch::to_place(const Point& x) const {
  Place v;
  for (const int i : support_.axes) v.push_back(x[i] / support_.scale[i]);
  return v;
}

/// Which places are of the outcome; none if not all of them could be run.
std::optional<std::vector<bool>> FacetSearch::ask(const std::vector<Place>& places) {
  asked_ += static_cast<int>(places.size());
  if (asked_ > most_asked_) return std::nullopt;
  std::vector<Point> points;
  for (const Place& v : places) points.push_back(to_point(v));
  std::vector<bool> inside;
  for (const int i : asker_.ask(points)) {
    if (i < 0) return std::nullopt;
    inside.push_back(is_inside_(asker_.archive()[i].result));
    if (inside.back()) members_.push_back(places[inside.size() - 1]);
  }
  return inside;
}

/// The best place so far off the planes; none if they leave nothing of the cut.
std::optional<FacetSearch::Place> FacetSearch::find_best(const Goal& goal, double off) const {
  if (goal.slope.empty()) return find_most_possible(off);
  if (facets_.empty()) {
    const Place lower = to_place(goal.region.box.lower);
    Place best = to_place(goal.region.box.upper);
    for (std::size_t k = 0; k < best.size(); ++k)
      if (goal.slope[k] >= 0) best[k] = lower[k];
    return best;
  }
  JumpSide side{support_.axes, {}, goal.slope};
  for (const Facet& f : facets_) side.in.push_back(f.side);
  const std::vector<Point> places = find_places(goal.region, side, std::span(&off, 1));
  if (places.size() < 2) return std::nullopt;
  return to_place(places.back());
}

FacetSearch::Place FacetSearch::find_most_possible(double off) const {
  const Space& space = *support_.space;
  if (facets_.empty()) return to_place(calc_centre(space));
  const Place* base = &members_.front();
  double most = -1;
  for (const Place& m : members_)
    if (const double mu = calc_membership(space, to_point(m)); mu > most) base = &m, most = mu;
  std::vector<HalfSpace> sides;
  for (const Facet& f : facets_) sides.push_back({f.side.a, f.side.b - dot(f.side.a, *base) - off});
  return to_place(uncertainty::find_most_possible(space, support_.scale, support_.axes, to_point(*base), 1, sides));
}

/// Of the members in the cut one that is near to a place outside and far from the planes; empty if there is none.
FacetSearch::Place FacetSearch::find_inner(const Goal& goal, const Place& out) const {
  const Place lower = to_place(goal.region.box.lower), upper = to_place(goal.region.box.upper);
  const Place* best = nullptr;
  double most = 0;
  for (const Place& m : members_) {
    double depth = 0.5;
    for (std::size_t k = 0; k < m.size(); ++k)
      if (m[k] < lower[k] || m[k] > upper[k]) depth = 0;
    for (const Facet& f : facets_) depth = std::min(depth, f.side.b - dot(f.side.a, m));
    const double merit = depth / (0.05 + calc_length(m, out));
    if (merit > most) best = &m, most = merit;
  }
  return best ? *best : Place{};
}

/// Bisects ways side by side until they are so short.
bool FacetSearch::cross(std::vector<Way>& ways, double width) {
  for (;;) {
    std::vector<Place> middles;
    std::vector<Way*> of;
    for (Way& way : ways)
      if (calc_length(way.first, way.second) > width) {
        middles.push_back(blend(way.first, way.second, 0.5));
        of.push_back(&way);
      }
    if (middles.empty()) return true;
    const auto inside = ask(middles);
    if (!inside) return false;
    for (std::size_t k = 0; k < of.size(); ++k) ((*inside)[k] ? of[k]->first : of[k]->second) = std::move(middles[k]);
  }
}

/// Takes a place near the end that is inside for the beginning.
void FacetSearch::shorten(Way& way) {
  const double length = calc_length(way.first, way.second);
  std::vector<Place> places;
  for (const double part : {1e-5 / length, 1e-3 / length})
    if (part < 0.1) places.push_back(blend(way.second, way.first, part));
  if (places.empty()) return;
  const auto inside = ask(places);
  for (std::size_t k = 0; inside && k < places.size(); ++k)
    if ((*inside)[k]) {
      way.first = places[k];
      return;
    }
}

/// Whether a plane that is known passes there, but for its error: lets it go through that place as well.
bool FacetSearch::explain(const Place& crossing) {
  Facet* nearest = nullptr;
  double least = 0;
  for (Facet& f : facets_) {
    const double off = std::abs(dot(f.side.a, crossing) - f.side.b);
    if (off <= 3 * calc_error(f, crossing) + margins[1] && (nearest == nullptr || off < least))
      nearest = &f, least = off;
  }
  if (nearest == nullptr) return false;
  std::vector<Place>& pivots = nearest->pivots;
  std::erase_if(pivots, [&crossing](const Place& p) { return calc_length(p, crossing) < smallest_radius; });
  if (pivots.size() >= crossing.size()) pivots.erase(pivots.begin());
  pivots.push_back(crossing);
  turn(*nearest);
  return true;
}

/// As little as lets it go through its pivots.
void FacetSearch::turn(Facet& f) {
  const Place& last = f.pivots.back();
  std::vector<Place> ways;
  for (std::size_t k = 0; k + 1 < f.pivots.size(); ++k) {
    ways.push_back(f.pivots[k]);
    for (std::size_t j = 0; j < last.size(); ++j) ways.back()[j] -= last[j];
  }
  std::vector<std::vector<double>> A;
  std::vector<double> parts;
  for (const Place& a : ways) {
    A.emplace_back();
    for (const Place& b : ways) A.back().push_back(dot(a, b));
    parts.push_back(dot(a, f.side.a));
  }
  if (!ways.empty() && solve(A, parts)) {
    std::vector<double> normal = f.side.a;
    for (std::size_t k = 0; k < ways.size(); ++k)
      for (std::size_t j = 0; j < normal.size(); ++j) normal[j] -= parts[k] * ways[k][j];
    const double length = std::sqrt(dot(normal, normal));
    // pivots that nearly lie on a line tell of no turn
    if (std::abs(length - 1) < 0.01) {
      for (double& v : normal) v /= length;
      f.side.a = std::move(normal);
    }
  }
  f.side.b = dot(f.side.a, last);
}

/// The way to a place beside its end; the same way if all of them are inside.
FacetSearch::Way FacetSearch::move_aside(const Way& way) {
  const auto& [in, out] = way;
  const double length = calc_length(in, out);
  std::vector<Place> places;
  for (const auto& t : make_tangents(calc_direction(in, out)))
    for (const double sign : {1.0, -1.0}) {
      places.push_back(out);
      for (std::size_t k = 0; k < in.size(); ++k)
        places.back()[k] = std::clamp(out[k] + sign * aside * length * t[k], lower_[k], upper_[k]);
    }
  const auto inside = ask(places);
  const auto at = inside ? std::find(inside->begin(), inside->end(), false) - inside->begin() : 0;
  return inside && at < std::ssize(places) ? Way{in, places[static_cast<std::size_t>(at)]} : way;
}

/// Finds where a way crosses the boundary, and the plane there; false where there is none.
bool FacetSearch::locate(const Way& given) {
  std::vector<Way> way = {given};
  if (!facets_.empty()) shorten(way.front());
  if (!cross(way, sharp)) return false;
  const Way crossing = {given.first, way.front().second};
  if (explain(crossing.second)) return true;
  missed_ = 0, is_lost_ = false;
  for (double radius = std::min(largest_radius, 0.5 * calc_length(crossing.first, crossing.second));
       radius > smallest_radius && is_polyhedral_ && !is_lost_; radius *= shrinking)
    if (auto facet = find_facet(crossing, radius)) {
      // planes that are turned by little touch the same bend
      has_bend_ = std::any_of(facets_.begin(), facets_.end(),
                              [&](const Facet& f) { return 1 - dot(f.side.a, facet->side.a) < least_turn; });
      is_polyhedral_ = !has_bend_;
      facets_.push_back(std::move(*facet));
      review();
      return true;
    }
  ++failed_;
  return false;
}

/// Ways across the boundary around the end of a given one, as it is met; none where they cannot be told.
std::optional<FacetSearch::Aim> FacetSearch::aim(const Way& way, double radius) {
  const Place &in = way.first, &out = way.second;
  const std::size_t n = in.size();
  std::vector<double> direction = calc_direction(in, out);
  Aim aim{blend(out, in, std::min(1.0, radius / calc_length(in, out))), {}, {}};
  Place& anchor = aim.anchor;
  // a way needs an end that is outside; it goes as far as the support does
  const auto make_target = [&](const std::vector<double>& tangent, double sign) {
    Place x = out;
    for (std::size_t k = 0; k < n; ++k) x[k] += radius * (3 * direction[k] + 2 * sign * tangent[k]);
    double part = 1;
    for (std::size_t k = 0; k < n; ++k)
      if (const double step = x[k] - anchor[k]; step != 0)
        part = std::min(part, std::max(0.0, ((step > 0 ? upper_[k] : lower_[k]) - anchor[k]) / step));
    return blend(anchor, x, part);
  };
  for (int turn = 0; turn < most_aims; ++turn) {
    const std::vector<std::vector<double>> tangents = make_tangents(direction);
    aim.targets.clear();
    for (const auto& t : tangents)
      for (const double sign : {1.0, -1.0}) aim.targets.push_back(make_target(t, sign));
    std::vector<Place> asked = aim.targets;
    asked.push_back(anchor);
    const auto told = ask(asked);
    if (!told || !told->back()) return std::nullopt;
    std::vector<bool>& inside = aim.inside;
    inside.assign(told->begin(), told->end() - 1);
    if (std::find(inside.begin(), inside.end(), true) == inside.end()) break;
    // what is inside on one side tells that the plane is met aslant
    std::vector<double> turned = direction;
    for (std::size_t t = 0; t < tangents.size(); ++t)
      for (std::size_t k = 0; k < n; ++k)
        turned[k] += (static_cast<double>(inside[2 * t + 1]) - static_cast<double>(inside[2 * t])) * tangents[t][k];
    const double size = std::sqrt(dot(turned, turned));
    for (std::size_t k = 0; k < n; ++k) {
      direction[k] = turned[k] / size;
      anchor[k] = std::clamp(out[k] - radius * direction[k], lower_[k], upper_[k]);
    }
  }
  return aim;
}

/// The plane through the end of a way and crossings around it; none where it has an edge or bends there.
std::optional<FacetSearch::Facet> FacetSearch::find_facet(const Way& way, double radius) {
  const auto aimed = aim(way, radius);
  if (!aimed) return std::nullopt;
  const auto& [anchor, targets, inside] = *aimed;
  if (inside[0] || inside[1]) return std::nullopt;
  const Place& out = way.second;
  // along the first tangent to both sides
  std::vector<Way> ways = {{anchor, targets[0]}, {anchor, targets[1]}};
  for (const double width : {coarse, fine})
    if (!cross(ways, width * radius) || !is_straight(ways, out, radius, width)) return std::nullopt;
  for (std::size_t t = 2; t < targets.size(); t += 2) {
    if (inside[t] && inside[t + 1]) return std::nullopt;
    ways.emplace_back(anchor, targets[inside[t] ? t + 1 : t]);
  }
  if (!cross(ways, fine * radius)) return std::nullopt;
  std::vector<Place> crossings = {out};
  for (const auto& [a, b] : ways) crossings.push_back(blend(a, b, 0.5));
  // the second one checks
  std::rotate(crossings.begin() + 2, crossings.begin() + 3, crossings.end());
  Facet facet{{fit_normal(crossings, anchor, radius), 0}, 2 * fine, {out}};
  if (facet.side.a.empty() || reaches_behind(facet.side.a, crossings, radius)) return std::nullopt;
  facet.side.b = dot(facet.side.a, out);
  return facet;
}

/// Between places of different facets the outcome reaches beyond the plane through all of them.
bool FacetSearch::reaches_behind(const std::vector<double>& normal, const std::vector<Place>& crossings,
                                 double radius) {
  std::vector<Place> behind;
  Place middle(normal.size(), 0.0);
  for (std::size_t k = 0; k < crossings.size(); ++k) {
    for (std::size_t j = 0; j < middle.size(); ++j)
      middle[j] += crossings[k][j] / static_cast<double>(crossings.size());
    for (std::size_t m = 0; m < k; ++m) behind.push_back(blend(crossings[k], crossings[m], 0.5));
  }
  behind.push_back(std::move(middle));
  for (Place& x : behind)
    for (std::size_t j = 0; j < x.size(); ++j) x[j] += flat * radius * normal[j];
  const auto inside = ask(behind);
  return !inside || std::find(inside->begin(), inside->end(), true) != inside->end();
}

/// Whether two crossings and the one between them lie on a line. What misses it by a part of the radius that falls with
/// the radius is a bend, and no edge.
bool FacetSearch::is_straight(const std::vector<Way>& ways, const Place& middle, double radius, double width) {
  const Place a = blend(ways[0].first, ways[0].second, 0.5), b = blend(ways[1].first, ways[1].second, 0.5);
  std::vector<double> along = b, off = middle;
  for (std::size_t k = 0; k < a.size(); ++k) along[k] -= a[k], off[k] -= a[k];
  const double square = dot(along, along);
  if (!(square > 0)) return false;
  const double part = dot(off, along) / square;
  for (std::size_t k = 0; k < a.size(); ++k) off[k] -= part * along[k];
  const double miss = std::sqrt(dot(off, off)) / radius;
  if (miss <= 3 * width) return true;
  const double ratio = missed_ > 0 ? miss / missed_ / shrinking : 0;
  if (ratio > 0.7 && ratio < 1.4) is_polyhedral_ = false, has_bend_ = true;
  // it is an edge that was crossed
  is_lost_ = missed_ > 0.1 && miss > 0.7 * missed_;
  missed_ = miss;
  return false;
}

/// Drops planes that leave out what is known.
void FacetSearch::review() {
  const auto before = std::ssize(facets_);
  std::erase_if(facets_, [this](const Facet& f) {
    return std::any_of(members_.begin(), members_.end(),
                       [&](const Place& m) { return dot(f.side.a, m) - f.side.b > calc_error(f, m) + 2 * margins[0]; });
  });
  dropped_ += static_cast<int>(before - std::ssize(facets_));
  if (dropped_ >= most_dropped) is_polyhedral_ = false;
}

/// Until the best places so far off the planes are of the outcome; false where some are not.
bool FacetSearch::close_in(std::vector<Goal> goals, double off) {
  const std::size_t most_turns = goals.size() * (lower_.size() + 1);
  bool is_complete = true;
  for (std::size_t turn = 0; turn < most_turns && is_polyhedral_ && failed_ < most_failed; ++turn) {
    std::vector<Place> places;
    std::vector<Goal> open, others;
    for (Goal& goal : goals) {
      if (places.size() >= most_places) {
        others.push_back(std::move(goal));
      } else if (auto best = find_best(goal, off)) {
        places.push_back(std::move(*best));
        open.push_back(std::move(goal));
      }
    }
    if (places.empty()) return is_complete;
    const auto inside = ask(places);
    if (!inside) return false;
    review();
    const auto first = static_cast<std::size_t>(std::find(inside->begin(), inside->end(), false) - inside->begin());
    goals.clear();
    for (std::size_t k = 0; k < open.size(); ++k)
      if (!(*inside)[k]) goals.push_back(std::move(open[k]));
    if (!goals.empty() && is_polyhedral_) {
      const Way way = {find_inner(goals.front(), places[first]), places[first]};
      if (way.first.empty() || !(locate(way) || (is_lost_ && locate(move_aside(way)))))
        goals.erase(goals.begin()), is_complete = false;
    }
    // others have their turn
    if (!goals.empty()) std::rotate(goals.begin(), goals.begin() + 1, goals.end());
    goals.insert(goals.end(), std::make_move_iterator(others.begin()), std::make_move_iterator(others.end()));
    if (goals.empty()) return is_complete && is_polyhedral_;
  }
  return false;
}

void FacetSearch::run(const std::vector<Goal>& goals, int most_asked) {
  if (most_asked < least_asked * std::ssize(lower_)) return;
  most_asked_ = most_asked;
  is_complete_ = close_in(goals, margins[0]) && close_in(goals, margins[1]);
  if (facets_.empty() || !is_polyhedral_) return;
  // from these slopes can be told, where the outcome is narrow
  std::vector<Place> places;
  for (const Goal& goal : goals)
    for (const double off : inner_margins)
      if (auto best = find_best(goal, off)) places.push_back(std::move(*best));
  (void)ask(places);
  review();
}

std::optional<double> FacetSearch::confirm(const Goal& goal) {
  const auto best = find_best(goal, 0.1 * margins[1]);
  if (!best || !is_polyhedral_) return std::nullopt;
  const Place lower = to_place(goal.region.box.lower), upper = to_place(goal.region.box.upper);
  std::vector<Place> places;
  for (const Facet& f : facets_) {
    const double distance = f.side.b - dot(f.side.a, *best);
    if (distance > beyond[1]) continue;
    if (calc_error(f, *best) > known_to) return std::nullopt;
    // behind this plane and no other one
    std::vector<HalfSpace> others;
    for (const Facet& g : facets_)
      if (&g != &f) others.push_back({g.side.a, g.side.b - margins[0]});
    for (const double way : beyond) {
      if (distance > 0.1 * way) continue;
      Place x = *best;
      for (std::size_t k = 0; k < x.size(); ++k) x[k] += way * f.side.a[k];
      x = project(others, lower, upper, x);
      if (dot(f.side.a, x) - f.side.b > 0.1 * way) places.push_back(std::move(x));
    }
  }
  most_asked_ = asked_ + static_cast<int>(places.size());
  const auto inside = ask(places);
  if (!inside || std::find(inside->begin(), inside->end(), true) != inside->end()) return std::nullopt;
  return dot(goal.slope, *best);
}

std::vector<FacetSearch::LinearFit> FacetSearch::fit_outputs() const {
  const std::vector<int> samples = list_samples();
  const std::size_t n = lower_.size() + 1;
  if (samples.size() < 2 * n) return {};
  const Place middle = blend(lower_, upper_, 0.5);  // from there the sums lose least
  std::vector<std::vector<double>> rows, A(n, std::vector<double>(n, 0.0));
  for (const int i : samples) {
    std::vector<double>& row = rows.emplace_back(1, 1.0);
    const Place x = to_place(asker_.archive()[i].x);
    for (std::size_t k = 0; k + 1 < n; ++k) row.push_back(x[k] - middle[k]);
    for (std::size_t p = 0; p < n; ++p)
      for (std::size_t q = 0; q < n; ++q) A[p][q] += row[p] * row[q];
  }
  std::vector<LinearFit> fits;
  for (int output = 0; output < asker_.outputs(); ++output) {
    const auto value_of = [&](std::size_t m) { return asker_.archive()[samples[m]].result.values[output]; };
    std::vector<std::vector<double>> sums = A;
    std::vector<double> b(n, 0.0);
    for (std::size_t m = 0; m < rows.size(); ++m)
      for (std::size_t p = 0; p < n; ++p) b[p] += rows[m][p] * value_of(m);
    if (!solve(sums, b)) return {};
    LinearFit& fit = fits.emplace_back();
    fit.slope.assign(b.begin() + 1, b.end());
    fit.at_zero = b[0] - dot(fit.slope, middle);
    for (std::size_t m = 0; m < rows.size(); ++m)
      fit.largest_error = std::max(fit.largest_error, std::abs(dot(rows[m], b) - value_of(m)));
  }
  return fits;
}

}  // namespace topple::uncertainty
