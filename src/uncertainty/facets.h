#pragma once
/// Outcomes that planes bound, convex ones: each plane is located so sharply that it holds all over the cut, and what
/// is best within all of them follows (docs/theory/uncertainty.md, section 3).

#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "uncertainty/archive.h"
#include "uncertainty/boundary.h"
#include "uncertainty/local_search.h"

namespace topple::uncertainty {

class FacetSearch {
 public:
  /// What is wanted of a place: the least slope·x in a cut, x by widths of the supports along the axes of the support;
  /// without slopes the largest membership.
  struct Goal {
    Region region;
    std::vector<double> slope;
  };
  /// at_zero + slope·x, x as in goals.
  struct LinearFit {
    std::vector<double> slope;
    double at_zero = 0;
    double largest_error = 0;  // at one of the points
  };

  /// `support` has no interaction; `planes`: that were found before. All references outlive it.
  FacetSearch(const Region& support, Asker& asker, std::function<bool(const Result&)> is_inside,
              const std::vector<Boundary::Plane>& planes = {});
  /// Of each output over all runs of the outcome that are known, by least squares; none if these are too few.
  std::vector<LinearFit> fit_outputs() const;
  /// Runs the best place of each goal within the planes, and where one is of another outcome locates the plane that is
  /// missing, until all are of the outcome, so many points were asked for, or it shows that no planes bound it.
  /// Nothing, where there are too few for a plane.
  void run(const std::vector<Goal>& goals, int most_asked);
  /// The least slope·x within the planes, where places behind those that bound it are of other outcomes; none if one is
  /// not, nothing is left within the planes, or not all of them could be run.
  std::optional<double> confirm(const Goal&);
  std::vector<Boundary::Plane> list_planes() const;
  /// Whether the best places of all goals belong to the outcome.
  bool is_complete() const { return is_complete_; }
  bool is_polyhedral() const { return is_polyhedral_; }
  /// Whether that is so because the boundary bends.
  bool has_bend() const { return has_bend_; }

 private:
  using Place = std::vector<double>;    // by widths, along the axes
  using Way = std::pair<Place, Place>;  // from inside to outside
  struct Facet {
    HalfSpace side;             // from the zero point
    double error = 0;           // as a part of the distance from the nearest of
    std::vector<Place> pivots;  // places through which it goes
  };
  struct Aim {
    Place anchor;                // inside, in front of the boundary
    std::vector<Place> targets;  // behind it, two for each tangent
    std::vector<bool> inside;    // which of them are inside nevertheless
  };
  Point to_point(const Place&) const;
  Place to_place(const Point&) const;
  std::vector<int> list_samples() const;
  std::optional<std::vector<bool>> ask(const std::vector<Place>&);
  std::optional<Place> find_best(const Goal&, double off) const;
  Place find_most_possible(double off) const;
  Place find_inner(const Goal&, const Place& out) const;
  bool close_in(std::vector<Goal>, double off);
  bool cross(std::vector<Way>&, double width);
  void shorten(Way&);
  Way move_aside(const Way&);
  bool explain(const Place& crossing);
  static void turn(Facet&);
  static double calc_error(const Facet&, const Place&);
  bool locate(const Way&);
  std::optional<Aim> aim(const Way&, double radius);
  std::optional<Facet> find_facet(const Way&, double radius);
  bool reaches_behind(const std::vector<double>& normal, const std::vector<Place>& crossings, double radius);
  bool is_straight(const std::vector<Way>&, const Place& middle, double radius, double width);
  void review();

  const Region& support_;
  Asker& asker_;
  std::function<bool(const Result&)> is_inside_;
  std::vector<Place> members_;  // places of the outcome
  Place lower_, upper_;
  std::vector<Facet> facets_;
  int most_asked_ = 0, asked_ = 0, dropped_ = 0, failed_ = 0;
  double missed_ = 0;  // at the last radius, as a part of it
  bool is_polyhedral_ = true, has_bend_ = false, is_lost_ = false, is_complete_ = false;
};

}  // namespace topple::uncertainty
