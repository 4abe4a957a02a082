#pragma once
/// The mapping model of a plan with [fuzzy]: a sample of its values in, what the collapse does out.

#include <atomic>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "collapse/knowledge.h"
#include "product/plan.h"
#include "uncertainty/space.h"

namespace topple::study {

struct PlanMappingOptions {
  double after = 0;  // simulated after the last stage's time, if it does not come to rest before; 0: find_after [s]
  std::vector<double> tilt_times{0.5, 1, 1.7};  // of outputs, after the last stage's time; those until `after` [s]
  double tilt_interval = 0.1;                   // of the trajectory [s]
  int directions = 24;                          // in which the debris outline is taken, from W's x counter-clockwise
  double frame_rate = 0;                        // at which runs are looked at; 0: the plan's [1/s]
  bool condensed = false;                       // like frames as one (collapse/condense.h)
  bool lanes = false;  // samples of one build in the lanes of one batch; slower than one by one (docs/plan-mapping.md)
  int threads = 1;     // 0: all of the machine
  double step_share = 1;     // of the engine's own step, for studies of convergence
  bool passes_quiet = true;  // condensed runs go on at once to the next stage when nothing happens
  bool full_law = false;     // no zone in lanes, to check them; slow
  /// Screening of ground vibration at each neighbour, where the plan has the site's law; not of condensed runs.
  bool vibration = true;
  /// Reach of parts across the frames; not of condensed runs, in which nothing falls sideways.
  bool sideways = true;
  /// Numbers of findings: height and volume of the heap, reach of debris, deviation of the fall, clearances; of
  /// condensed runs and those without `sideways` the height alone. Stores of earlier versions have runs without.
  bool findings = true;
  bool class_open = true;  // whether a run's class may become another; stores of earlier versions have runs without
};

/// How long samples of a plan are simulated after its last stage: what its fuzzy.search says, or until its analysis
/// ends [s].
double find_after(const product::Plan&);
/// Whether runs of the plan tell a screening of ground vibration.
bool has_screening(const product::Plan&, const PlanMappingOptions&);
/// Whether runs tell how far parts lie across the frames.
bool has_sides(const PlanMappingOptions&);
/// Whether runs tell how far debris reaches to any side, its volume, and how near it comes to neighbours.
bool has_clearances(const PlanMappingOptions&);
/// Output with the clearance of a neighbour: "clearance_workshop" of "Workshop".
std::string name_of_clearance(const product::Plan&, size_t neighbour);
/// Output with the upper end of the screening band at a neighbour: "vibration_workshop" of "Workshop".
std::string name_of_screening(const product::Plan&, size_t neighbour);

/// Where the processors' time of samples went, summed over threads [s].
struct PlanMappingTimes {
  double plans = 0;       // samples to plans
  double models = 0;      // plans to models, with all resistance curves
  double equilibria = 0;  // compiling, dead load
  double standing = 0;    // steps before the last stage
  double falling = 0;     // steps behind it
  double outputs = 0;     // frames and what is read off them
};

/// A quantity of the mapping. Values are SI.
struct PlanQuantity {
  std::string name, symbol;  // unit for people
  double unit = 1;           // SI value of one of it
  bool is_searched = true;   // runs are spent on its bounds; else they are those of the runs that there are
};

/// Output that is 1 where a run ended before its class was final, else 0.
inline constexpr const char* kClassOpen = "class_open";
/// way_left of parts that nothing brings to rest [m].
inline constexpr double kUnlimited = 1e4;

/// Outcome classes: those of collapse::Mechanism, and "early" where the building does not stand until its last stage
/// and the plan asks it to.
const std::vector<std::string>& plan_outcomes();

/// A plan, ready to be sampled. Constant: several threads may evaluate it.
class PlanMapping {
 public:
  /// Throws InputError if the plan has no fuzzy values, a charge that fires when its runs are over, or options outside
  /// their range.
  PlanMapping(const product::Plan&, const collapse::Knowledge&, PlanMappingOptions);
  ~PlanMapping();
  PlanMapping(PlanMapping&&) noexcept;

  const uncertainty::Space& space() const;
  const std::vector<PlanQuantity>& inputs() const;
  /// tilt_T towards the planned fall at each of tilt_times; touchdown: of the upper block's first part, after the last
  /// stage's time, and `after` if there is none by then; tilt and energy in motion then (at the end without one) and at
  /// most; reach of parts beyond the footprint to each side (has_sides) and of 95 % of the mass, at the end;
  /// rear_share: drop of the rear edge over that of the front edge; utilisation: largest use of a zone's resistance
  /// before the last stage (the margin is its inverse), 1 if it did not stand until then; class_open: 1 where the run
  /// ended before its class was final, else 0;
  /// heap_height at the end; has_clearances: heap_volume, debris_reach as the plan's criterion has it, clearance_NAME
  /// of each neighbour as its finding has it, azimuth_deviation of the fall from the planned azimuth, where there is
  /// one (π/2 where nothing fell to any side), and way_left, the longest way that a part which still moved at the end
  /// may go on, at most kUnlimited; vibration_NAME: upper end of
  /// the screening band at a neighbour by what has touched down at the end of the run.
  const std::vector<PlanQuantity>& outputs() const;
  /// The trajectory is the tilt at these times after the last stage's [s], then how far parts extend from W's origin
  /// towards each of `directions` at the end [m].
  const std::vector<double>& trajectory_times() const;

  /// As uncertainty::Evaluate. A sample that is no plan, finds no equilibrium or diverges is Failed with its text;
  /// after a cancellation the rest is NotRun. A point's result has the same bits alone, in any batch and on any thread.
  void evaluate(std::span<const uncertainty::Point> batch, std::span<uncertainty::Result> out,
                const std::atomic<bool>* cancel = nullptr, PlanMappingTimes* times = nullptr) const;

 private:
  struct Impl;
  /// No charge may fire when its run is over. Throws InputError E407.
  static void check_firing(const product::Plan&, const Impl&);
  std::unique_ptr<const Impl> impl_;
};

}  // namespace topple::study
