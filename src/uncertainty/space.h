#pragma once
/// The space of the inputs: fuzzy numbers, what ties them together, cuts as boxes, points that fill them.

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "uncertainty/fuzzy_number.h"
#include "uncertainty/mapping.h"

namespace topple::uncertainty {

/// n fuzzy inputs. Without interaction μ(x) = min_i μ_i(x_i). What follows from other inputs by a formula is no input:
/// it belongs into the mapping (`with_derived`).
struct Space {
  std::vector<FuzzyNumber> inputs;
  /// Interaction by constraints: x counts if every g(x) <= 0. Cheap to evaluate; the centre must satisfy them.
  std::vector<std::function<double(const Point&)>> constraints;
  /// Interaction by a joint membership function in [0, 1], 1 at the centre: μ(x) = min(min_i μ_i(x_i), joint(x)).
  std::function<double(const Point&)> joint;

  int size() const { return static_cast<int>(inputs.size()); }
  bool has_interaction() const { return !constraints.empty() || joint; }
};

/// Throws InputError E804: no inputs, or a centre that a constraint or the joint membership refuses.
void check_space(const Space&);

/// The middle of the cores.
Point calc_centre(const Space&);
/// Widths of the supports, one per input.
std::vector<double> calc_scale(const Space&);
/// Whether the constraints hold.
bool is_allowed(const Space&, const Point&);
/// μ(x); 0 where a constraint does not hold.
double calc_membership(const Space&, const Point&);

/// Lower and upper end per input.
struct Box {
  Point lower, upper;
  bool contains(const Point&) const;
};
double calc_volume(const Box&);
/// Moves each coordinate to the nearest value inside.
Point clip(const Box&, Point);

/// The cut of the inputs at alpha, without interaction.
Box make_box(const Space&, double alpha);
/// The largest distance along one of `axes`, by widths `scale`.
double calc_offset(const Point& a, const Point& b, const std::vector<int>& axes, const std::vector<double>& scale);
/// Whether x belongs to the cut at alpha, whose box is given: with interaction.
bool is_in_cut(const Space&, const Box&, double alpha, const Point& x);

/// The last place that counts on the way to `out`, which does not, from `in`, which does, and the first behind it.
std::pair<Point, Point> bisect(Point in, Point out, const std::function<bool(const Point&)>& counts, int halvings = 40);

/// `count` points of a Sobol sequence in [0, 1)^n from its `first` point on, shifted by the seed (modulo 1).
std::vector<Point> make_sobol_points(int n, int first, int count, std::uint64_t seed);
/// Fractions of the box.
Point place_in(const Box&, const Point& fractions);
/// All 2^n corners.
std::vector<Point> make_corners(const Box&);

/// A mapping that appends to each point variables that follow from it before the model sees it: full interaction.
/// The model's points have n + derived.size() coordinates. Checked here at the centre and, up to n = 12, at the corners
/// of the support; throws InputError E806 if a derived variable is not finite there (outside the formula's range).
Evaluate with_derived(const Space&, std::vector<std::function<double(const Point&)>> derived, Evaluate model);

}  // namespace topple::uncertainty
