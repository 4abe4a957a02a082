#pragma once
/// Local searches that ask for points and are told their values, so that many of them advance side by side and every
/// batch for the model is wide (docs/theory/uncertainty.md, section 3).

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "uncertainty/boundary.h"
#include "uncertainty/cut_program.h"
#include "uncertainty/jump.h"
#include "uncertainty/random.h"
#include "uncertainty/space.h"
#include "uncertainty/wall.h"

namespace topple::uncertainty {

/// Where a search may go: the cut at alpha of a space that outlives it.
struct Region {
  const Space* space = nullptr;
  double alpha = 0;
  Box box;
  std::vector<double> scale;  // widths of the supports
  std::vector<int> axes;      // inputs whose cut has a width

  bool contains(const Point& x) const { return is_in_cut(*space, box, alpha, x); }
};
Region make_region(const Space&, double alpha);
/// The point between `from`, which lies in the region, and `to` that is nearest to `to` and still inside.
Point pull_inside(const Region&, const Point& from, Point to);

/// What a search is told of a point.
struct Told {
  double value = 0;  // infinite where the point must not count
  int outcome = 0;   // class of what happened there: the value may jump between classes
};

/// Looks for a minimum from a start. Protocol: evaluate `pending()`, call `tell` with what came out, in
/// the same order, until `is_done()`.
class LocalSearch {
 public:
  virtual ~LocalSearch() = default;
  const std::vector<Point>& pending() const { return pending_; }
  virtual void tell(std::span<const Told> told) = 0;
  bool is_done() const { return pending_.empty(); }
  /// Whether it ended because its model shows nothing better near; never for one without a model.
  bool is_converged() const { return converged_; }
  const Point& best() const { return best_; }
  double value() const { return value_; }

 protected:
  LocalSearch(Point start, const Told& at_start)
      : best_(std::move(start)), value_(at_start.value), outcome_(at_start.outcome) {}
  std::vector<Point> pending_;
  Point best_;
  double value_;
  int outcome_;  // class of the best point
  bool converged_ = false;
};

/// Newton steps on a quadratic model inside the cut: slopes and curvatures from a star of points around the best one,
/// mixed curvatures from points between the free axes; several step lengths are tried at once. The star shrinks until
/// the model promises less than the tolerance. Where another outcome begins, its boundary is located as a plane and the
/// step is kept on this side of it, unless the values beyond are better.
class ModelSearch : public LocalSearch {
 public:
  struct Options {
    double radius = 0.1;        // of the first star, as a part of the support's width
    double tolerance = 1e-8;    // of the value, absolute; decides when it has converged
    double smallest = 1e-5;     // radius at which it ends anyway
    double edge = 0;            // the same where no other outcome was met
    bool doubts_edges = false;  // a nearer star tells kinks from narrow valleys
    // whether to look for values that fall ever more steeply towards this place of another outcome
    std::function<bool(const Point&)> looks_steep;
    int iterations = 60;     // at most
    int probes = 8;          // of the boundary of another outcome, at most
    std::uint64_t seed = 1;  // for the subproblem under constraints
  };
  ModelSearch(Region region, Point start, const Told& at_start, const Options& options);
  void tell(std::span<const Told> told) override;
  /// A place that is known already: it may tell of slopes and boundaries near the start.
  void remember(const Point& x, const Told& told);
  /// Planes of the boundary that were found before; behind all that is remembered.
  void adopt(const std::vector<Boundary::Plane>& planes) { boundary_.adopt(planes, best_, radius_, list_insides()); }
  const Boundary& boundary() const { return boundary_; }
  int outcome() const { return outcome_; }
  /// Whether it ended where the mapping is not smooth: the radius became too small, or curvatures grew as it did.
  bool is_at_edge() const { return at_edge_; }
  /// Whether it ended where the mapping is smooth, but only within much less than its first star.
  bool is_wavy() const { return converged_ && !at_edge_ && (is_bend_checked_ || is_edge_checked_); }
  /// Whether it ended along a boundary by short steps, where a longer way would promise more.
  bool is_doubtful() const { return is_doubtful_; }
  /// Whether values fall ever more steeply towards the outcome that it ended beside, as roots do: stars tell nothing
  /// there.
  bool is_steep() const { return is_steep_; }
  /// The place of another outcome towards which it looked for that, and that it ended beside.
  const std::optional<Point>& beside() const { return beside_; }
  /// What it may come to, as its gains shrink; -infinity as long as they do not.
  double calc_outlook() const;
  bool has_met_walls() const { return has_met_walls_; }
  /// Whether its boundary is that of a jump of the value, of which outcomes do not tell.
  bool is_at_jump() const { return jump_ > 0; }
  /// Where that is, and what is known of it: planes and slopes about the best point.
  JumpSide get_side() const;

 private:
  struct Axis {
    int input = 0;
    double a = 0, b = 0;       // offsets of the star's two points, 0: none
    int at_a = -1, at_b = -1;  // among the pending points
    double slope = 0, curvature = 0;
    double reach = 0, before = 0, reach_before = 0;  // of the star; curvature and reach of the star before
    bool free = false, known = false;
  };
  struct Pair {
    int i = 0, j = 0;                   // axes
    double di = 0, dj = 0;              // offsets
    int at = -1, at_i = -1, at_j = -1;  // pending points of both and of each
  };
  struct Place {
    Point x;
    double value = 0;
  };
  /// The model about a place.
  struct Model {
    Place at;
    std::vector<double> slope, hessian;  // (axes), (axes x axes)
  };
  Point moved(const std::vector<double>& step) const;
  double calc_model(const std::vector<double>& step) const;
  std::vector<double> find_step(bool mixed, double push = 0) const;
  std::vector<double> find_walled_step(double distance) const;
  std::vector<double> find_sided_step(const std::vector<HalfSpace>& sides);
  void note(std::span<const Told> told);
  bool is_bent() const;
  bool is_blind() const;
  bool is_blocked(std::span<const Told> told) const;
  int most_probes() const;
  bool ask_probe();
  std::vector<double> to_widths(const std::vector<double>& step) const;
  std::vector<double> find_step_to(const Point&) const;
  Quadratic calc_quadratic() const;
  Point slide(const std::vector<double>& from, std::vector<double> u, double reach) const;
  void descend(std::vector<double>& step) const;
  void ask_around_constraints();
  void read_aside(std::span<const Told> told);
  void ask_inner();
  void read_inner(std::span<const Told> told);
  Boundary::Places list_insides() const;
  Boundary::Places list_walls() const;
  void find_allowed_step(std::vector<double>& step);
  bool is_beyond(const Point&, double value) const;
  std::vector<Told> split_at_jump(std::span<const Told> told) const;
  bool look_steep();
  void look_back(std::span<const Told> told);
  void approach(const Told& told);
  void look_for_jump(double least);
  void ask_middle();
  void read_section(const Told& told);
  void stay_before_jump();
  bool widen_star();
  void conclude_star();
  void ask_star();
  void read_star(std::span<const Told> told);
  void ask_trials();
  void finish_iteration();

  Region region_;
  Options options_;
  Random random_;
  CutProgram program_;
  std::vector<Axis> axes_;
  std::vector<Pair> pairs_;
  std::vector<int> aside_;        // pending points beside constraints
  std::vector<double> together_;  // sum of the star's gains  (axes)
  std::vector<double> hessian_;   // axes x axes
  double radius_, trust_;
  double promised_ = 0;
  bool is_bound_ = false;              // by a located boundary
  double along_ = 1, last_along_ = 1;  // part of what is promised that a located boundary leaves: the least, the last
  int iteration_ = 0, probes_ = 0;
  bool at_edge_ = false, has_met_walls_ = false;
  bool is_bend_checked_ = false;  // with a nearer star
  bool is_edge_checked_ = false;  // by another iteration at its radius
  double last_gain_ = 0, earlier_gain_ = 0;
  bool is_doubtful_ = false, is_steep_ = false;
  std::optional<Point> beside_;
  double first_slope_ = 0;  // of the value, on the way to the other outcome
  enum class Stage { Star, Inner, Probe, Trial, Section, Back, Approach } stage_ = Stage::Star;
  std::vector<Point> walls_;    // places of other outcomes, latest last
  Place inner_;                 // about which slopes are looked for that the star does not tell
  std::vector<Place> insides_;  // of the best point's outcome
  std::vector<Point> tried_;    // places from which the boundary was looked for, since the best point moved
  Boundary boundary_;           // near the best point
  std::optional<WallProbe> wall_;
  double jump_ = 0;      // of the value, at which this side ends; 0: none is known
  Model side_;           // tells which places lie beyond it
  bool is_wide_ = true;  // the star is as wide as the jump lets
  int jumps_ = 0;        // that were met
  Place near_, far_;     // between which a jump is looked for
  double rise_ = 0;      // of the value, when that began
  int section_ = 0;
  Point next_;  // best of this iteration
  double next_value_ = 0;
  int next_outcome_ = 0;
};

/// A modified evolution strategy: children in a box around the parent, which moves to the best of them and grows after
/// a success and shrinks after a failure. For values without slopes.
class EvolutionSearch : public LocalSearch {
 public:
  struct Options {
    int children = 8;        // per generation
    int generations = 20;    // at most
    double width = 0.35;     // half width of the first box, as a part of the cut
    double smallest = 0.02;  // half width at which it ends
    std::uint64_t seed = 1;
  };
  EvolutionSearch(Region region, Point start, const Told& at_start, const Options& options);
  void tell(std::span<const Told> told) override;

 private:
  void ask();
  Region region_;
  Options options_;
  Random random_;
  double width_;
  int generation_ = 0;
};

/// Moves from end to end of the cut, for cuts with too many corners to run them all. Around the best point a star along
/// the axes: ends, the vertex of a parabola through three places and, once nothing else helps, places between. What
/// improves alone is tried together. Where no axis improves any more, all pairs of moves to other ends and valleys are
/// run; they make a model of all combinations, whose best ones are tried. On mappings whose inputs act alone or in
/// pairs this finds the best combination.
class FaceSearch : public LocalSearch {
 public:
  struct Options {
    std::vector<int> wide_axes;  // inputs of which places between are run as well
    bool pairs = false;          // of moves
    double least_gain = 0;       // of the value, absolute: less is no gain
    int trials = 6;              // combinations that the model of the pairs proposes
    int iterations = 40;         // at most
    std::uint64_t seed = 1;
  };
  FaceSearch(Region region, Point start, const Told& at_start, const Options& options);
  void tell(std::span<const Told> told) override;
  /// Whether pairs were run around the best point, or a model that foretold it.
  bool is_paired() const { return paired_; }
  /// Whether the best point is a corner, and the model of the pairs foretold what came of all its proposals.
  bool is_foretold() const { return foretells_ && converged_; }

 private:
  struct Place {
    double at = 0, value = 0;
  };
  struct Axis {
    int input = 0;
    std::vector<Place> places;  // known ones around the best point, itself left out
    std::vector<Place> moves;   // of pairs
  };
  struct Asked {
    int axis = 0;
    double at = 0;
  };
  /// Which move each axis makes, 0: none; with the value that the model of the pairs foretells.
  struct Combination {
    double value = 0;
    std::vector<int> moves;
    auto operator<=>(const Combination&) const = default;
  };
  void ask_star(bool wide);
  void ask_vertices();
  void ask_together();
  void ask_pairs();
  void ask_foretold();
  void conclude();
  bool add(const Point&);
  void choose_moves(Axis&) const;
  std::vector<Combination> minimise_pairs() const;

  Region region_;
  Options options_;
  std::vector<Axis> axes_;
  std::vector<Asked> asked_;
  std::vector<int> first_;                  // of the moves of each axis, all moves counted; their number at the end
  std::vector<double> mixed_;               // beyond the sum of both moves  (moves x moves)
  std::vector<std::pair<int, int>> pairs_;  // of moves, pending
  std::vector<double> foretold_;            // values of the pending points
  enum class Stage { Star, Wide, Vertex, Together, Pairs, Foretold } stage_ = Stage::Star;
  Point next_;
  double next_value_ = 0;
  int next_outcome_ = 0, iteration_ = 0, pairings_ = 0;
  bool is_wide_ = false, paired_ = false, foretells_ = false;
};

}  // namespace topple::uncertainty
