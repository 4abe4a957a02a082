#pragma once
/// Fuzzy cluster design: which boxes of inputs keep a requirement (docs/theory/uncertainty.md, section 7).

#include <cstdint>
#include <functional>
#include <vector>

#include "uncertainty/alpha.h"
#include "uncertainty/cluster.h"

namespace topple::uncertainty {

/// What a run must keep: at least 0 is permissible. Its size is the distance to the constraint (for a class alone: 1
/// and -1). Not asked for failed runs, which are never permissible.
using Requirement = std::function<double(const Result&)>;

struct DesignOptions {
  Clustering clustering = Clustering::Medoids;
  int k_max = 6;
  int space_points = 0;      // spread over the support beside what the archive holds; 0: 200 per input
  int cluster_points = 500;  // of each set that are grouped; the others count for the boxes alone
  double edge = 5e-3;        // how near a box may come to a violating run, part of the support's width
  double smallest = 1e-3;  // part of the support's volume below which boxes of up to three inputs are not kept; of more
                           // inputs none with a smaller mean side (see calc_smallest)
  int rounds = 300;        // of growing and checking a box, at most
  int fresh = 149;         // new random points that must all pass
  double confidence = 0.95;  // of the stated bound
  int ranking_output = 0;    // whose robustness ranks the boxes
  int rerun_limit = 2000;    // points of the fuzzy analysis of one box, at most; 0: none, and no robustness
  int growth_points = 0;     // runs that a group must have for its box to be grown; with fewer the box comes from the
                             // runs that are there and its trials alone; 0: 100 times the square of the inputs' number
  std::vector<double> levels = {0, 0.25, 0.5, 0.75, 1};
  std::uint64_t seed = 1;
  int tried = -1;  // most tries for a box in an earlier search on these runs; its points are not drawn again. -1: none
};

/// Part of the support's volume below which boxes with as many sides as this one are not kept.
double calc_smallest(double smallest, const Box&);

/// A box of inputs, inside which no run violated the requirement.
struct PermissibleBox {
  Box box;
  int group = 0;                    // of the permissible samples
  int centre = -1;                  // sample in the middle of the group: the core
  std::vector<FuzzyNumber> inputs;  // triangles: support = box, core = centre
  double volume = 0;                // part of the support's volume
  int samples = 0;                  // runs inside
  int broken = 0;                   // of them violate, 0 where it is kept; -1: not known
  int fresh = 0;                    // independent random points that passed, last time
  std::vector<Point> fresh_points;  // those
  int tries = 0;                    // how often so many were tried, violations before the last included
  double violating = 1;  // with the confidence, at most this part of the box violates: 1 - (6 β/(π tries)²)^(1/fresh)
  double distance = 0;   // least requirement inside over its range in all runs; 0 without a range
  double robustness = 0;              // entropies of the inputs over that of the ranking output
  std::vector<OutputBounds> outputs;  // of the fuzzy analysis on these inputs
  bool kept = false;                  // verified, large enough, and no violation in the fuzzy analysis
};

struct DesignResult {
  std::vector<PermissibleBox> boxes;               // ranked, those not kept behind
  int permissible = 0, forbidden = 0, failed = 0;  // samples
  double fraction = 0;                             // permissible part of the support, from the spread points
  int spread = 0;                                  // how many those are
  double fraction_error =
      0;  // its standard error for independent points, one kept and one not counted besides (Laplace)
  Grouping permissible_groups, forbidden_groups;
  std::vector<int> permissible_samples, forbidden_samples;  // that were grouped, as samples of the archive
  Ending ending = Ending::Complete;
};

/// Counts and measures boxes anew by all runs of an archive, and ranks them. A box that has passed at its fresh points
/// but in which another run violates shrinks to what that leaves; it is not kept if that is less than half of it.
///   options  edge, smallest, confidence, ranking_output, levels, seed
void review_boxes(const Space&, std::vector<PermissibleBox>&, const Requirement&, const Archive&, const DesignOptions&);

/// The same, and bounds of outputs in boxes whose searches have not ended are searched for on, as far as runs are left.
void analyse_on(const Space&, std::vector<PermissibleBox>&, const Requirement&, Asker&, const DesignOptions&);

/// Uses and fills the asker's archive. Throws InputError E804 (space), E809 (options out of range).
DesignResult find_permissible_boxes(const Space&, Asker&, const Requirement&, const DesignOptions&);

}  // namespace topple::uncertainty
