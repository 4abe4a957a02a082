#pragma once
/// Grows a box around a point inside a set that only runs can tell (docs/theory/uncertainty.md, section 7).

#include <cstdint>
#include <functional>
#include <set>
#include <vector>

#include "uncertainty/largest_box.h"
#include "uncertainty/random.h"
#include "uncertainty/space.h"

namespace topple::uncertainty {

enum class Verdict { Permissible, Violating, NotRun };

class BoxGrowth {
 public:
  struct Options {
    double edge = 5e-3;      // how near a box may come to a violating run, part of the outer box's width
    double smallest = 1e-3;  // part of the outer box's volume below which it gives up
    int rounds = 300;        // of every kind, at most, over all calls
    std::uint64_t seed = 1;
  };
  using Judge = std::function<std::vector<Verdict>(const std::vector<Point>&)>;
  using Allow = std::function<bool(const Point&)>;

  /// `seed` is permissible. `allow` tells without a run whether a point counts at all (interaction).
  BoxGrowth(const Box& outer, const Point& seed, Judge, Allow, const Options&);

  /// A violating point that is known; grow() keeps it out.
  void add_violating(const Point& x) { front_.add(x); }
  /// Next box whose corners, faces and some inner points all pass. False if there is none above the smallest volume, or
  /// runs or rounds are used up.
  bool grow();
  /// Runs points of the box; for those that violate it looks for the place nearest to the seed where they do, and keeps
  /// that out from then on. True if all pass.
  bool check(const std::vector<Point>&);
  /// Independent points inside.
  std::vector<Point> make_random_points(int count) { return make_random_points(box_, count); }
  const Box& box() const { return box_; }
  double calc_part() const;  // volume over that of the outer box

 private:
  std::vector<Point> make_random_points(const Box&, int count);
  std::vector<Point> make_check_points(const Box&);
  std::vector<Point> make_corners_of(const Box&, const std::set<std::vector<bool>>& which) const;
  bool grow_from_outside();
  bool settle();
  bool improve(double first_step);
  bool is_clear(const Box&) const;
  void note_critical(const Point& violating);

  Box outer_, box_;
  Judge judge_;
  Allow allow_;
  Options options_;
  Front front_;
  Random random_;
  std::vector<int> axes_;
  std::set<std::vector<bool>> critical_;  // corners in whose direction something violated; true: upper
  int round_ = 0;
  bool settled_ = false, stopped_ = false;
};

}  // namespace topple::uncertainty
