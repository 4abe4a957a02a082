#include "study/insights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "study/permissible.h"

namespace topple::study {
namespace {

using json = nlohmann::ordered_json;

constexpr int least_rows = 32, most_rows = 256;
constexpr std::size_t least_spread = 30;               // of fewer points shares tell next to nothing
constexpr int least_knowing = 20, most_knowing = 250;  // runs per input
constexpr int least_with_bounds = 600;  // runs for boxes: of fewer, bounds in them are of a handful of points
constexpr int least_in_boxes = 50;      // runs per input

int count_axes(const uncertainty::Space& space) {
  int n = 0;
  for (const auto& f : space.inputs) n += f.width() > 0;
  return n;
}

uncertainty::SensitivityOptions make_options(const Problem& p, const Budget& b) {
  uncertainty::SensitivityOptions o;
  o.rows = b.rows;
  o.seed = p.seed;
  return o;
}

double number(const json& j) { return j.is_null() ? std::numeric_limits<double>::quiet_NaN() : j.get<double>(); }

json bounds_json(const std::vector<uncertainty::OutputBounds>& outputs) {
  json list = json::array();
  for (const auto& o : outputs) {
    json levels = json::array();
    for (const auto& l : o.levels)
      levels.push_back({l.alpha, l.lower.value, l.lower.sample, l.lower.converged, l.upper.value, l.upper.sample,
                        l.upper.converged});
    list.push_back(levels);
  }
  return list;
}

std::vector<uncertainty::OutputBounds> read_bounds(const json& j) {
  std::vector<uncertainty::OutputBounds> outputs;
  for (const json& levels : j) {
    outputs.emplace_back();
    for (const json& l : levels)
      outputs.back().levels.push_back(
          {l.at(0), {number(l.at(1)), l.at(2), l.at(3)}, {number(l.at(4)), l.at(5), l.at(6)}});
  }
  return outputs;
}

}  // namespace

Budget calc_budget(const Problem& p, int limit) {
  Budget b;
  b.limit = limit;
  // of ten runs four are for boxes where they are wanted; of the rest two or three for drivers, one for the boundaries
  // of outcomes and one for outcomes with an input known
  const int rest = p.permissible.empty() ? limit : limit - 2 * limit / 5;
  const int n = static_cast<int>(p.space.inputs.size()), axes = count_axes(p.space);
  if (p.has_drivers && axes > 0) {
    const int rows = std::min(most_rows, rest / 5 / (n + 2));
    if (rows >= least_rows && !p.space.has_interaction())
      b.rows = rows;
    else
      b.spread = std::min(3 * rest / 10, most_rows * (n + 2));
    const int each = std::min(most_knowing, rest / 10 / axes);
    b.knowing = each >= least_knowing ? each : 0;
  }
  b.outcomes = rest;
  b.requirement = (limit - rest) / 4;
  const int in_boxes = (limit - rest) / 6;
  if (limit - rest >= least_with_bounds && in_boxes >= least_in_boxes * axes) b.in_boxes = in_boxes;
  // possibilities take what they need of that, but for a half
  b.possibilities = rest - b.knowing * axes / 2;
  b.bounds = rest - b.knowing * axes - rest / 10;
  if (!p.limits.empty()) b.of_limit = std::min(rest / 20, rest / 8 / static_cast<int>(p.limits.size()));
  return b;
}

std::vector<Point> make_spread_points(const Problem& p, const Budget& b) {
  const uncertainty::Space& space = p.space;
  std::vector<Point> points;
  if (b.rows > 0) {
    const std::vector<Point> all = uncertainty::make_driver_points(space, make_options(p, b));
    const std::size_t row = space.inputs.size() + 2;
    for (std::size_t k = 0; k + 1 < all.size(); k += row) points.push_back(all[k]), points.push_back(all[k + 1]);
    return points;
  }
  // the sequence with which the search of bounds begins, so that nothing is run for one of them alone
  std::vector<std::size_t> axes;
  for (std::size_t i = 0; i < space.inputs.size(); ++i)
    if (space.inputs[i].width() > 0) axes.push_back(i);
  const uncertainty::Box box = uncertainty::make_box(space, 0);
  for (const Point& u : uncertainty::make_sobol_points(static_cast<int>(axes.size()), 1, b.spread, p.seed)) {
    Point fractions(space.inputs.size(), 0.0);
    for (std::size_t k = 0; k < axes.size(); ++k) fractions[axes[k]] = u[k];
    Point x = uncertainty::place_in(box, fractions);
    if (uncertainty::is_in_cut(space, box, 0, x)) points.push_back(std::move(x));
  }
  return points;
}

std::vector<int> find_spread_samples(const Problem& p, const Budget& b, const uncertainty::Archive& archive) {
  std::vector<int> samples;
  if (b.rows == 0 && b.spread == 0) return samples;
  for (const Point& x : make_spread_points(p, b))
    if (const int i = archive.find(x); i >= 0) samples.push_back(i);
  return samples;
}

void ask_for_drivers(const Problem& p, const Budget& b, uncertainty::Asker& asker) {
  if (b.rows > 0)
    asker.ask(uncertainty::make_driver_points(p.space, make_options(p, b)));
  else if (b.spread > 0)
    asker.ask(make_spread_points(p, b));
}

namespace {

/// Of inputs that are free of each other one explains at least what no other one has a part in. Bins do not see what is
/// narrower than they are.
void raise_to_bound(std::vector<uncertainty::Driver>& all) {
  for (uncertainty::Driver& d : all) {
    double others = 0, squares = 0;
    for (const uncertainty::Driver& o : all)
      if (&o != &d) others += o.total, squares += o.total_error * o.total_error;
    const double bound = 1 - others, error = std::sqrt(squares);
    const bool may_be = bound - 2 * error <= d.total + 2 * d.total_error;
    if (may_be && bound - 2 * error > d.first + d.first_error) d.first = std::min(bound, 1.0), d.first_error = error;
    // and no more than it does with the others
    if (d.first - d.total > 2 * std::hypot(d.first_error, d.total_error))
      d.first = d.total, d.first_error = d.total_error;
  }
}

}  // namespace

void read_drivers(Insights& out, const Problem& p, const Budget& b, const uncertainty::Archive& archive) {
  out.source = Insights::Source::None;
  if (b.rows > 0) {
    // answers out of the archive; a point that is not there is not run
    const Progress quiet;
    uncertainty::Asker asker([](auto, auto) {}, quiet, &archive, b.limit);
    bool is_complete = true;
    for (const Point& x : uncertainty::make_driver_points(p.space, make_options(p, b)))
      is_complete = is_complete && archive.find(x) >= 0;
    if (is_complete) {
      out.drivers = uncertainty::find_drivers(p.space, asker, make_options(p, b));
      out.source = Insights::Source::Design;
    }
  }
  const std::vector<int> samples = find_spread_samples(p, b, archive);
  if (samples.size() < least_spread) return;
  uncertainty::Sensitivity by_bins = uncertainty::read_drivers(p.space, archive, samples);
  if (out.source == Insights::Source::None) {
    out.drivers = std::move(by_bins);
    out.source = Insights::Source::Spread;
    return;
  }
  // Two estimates of one share: the firmer one. Of an outcome that of more runs where they contradict each other: rows
  // that miss a rare outcome have a small error as well.
  constexpr double never = std::numeric_limits<double>::infinity(), least_apart = 0.1, errors_apart = 2;
  const auto choose = [](std::vector<uncertainty::Driver>& mine, const std::vector<uncertainty::Driver>& other,
                         double least) {
    for (std::size_t i = 0; i < std::min(mine.size(), other.size()); ++i) {
      const double errors = std::hypot(mine[i].first_error, other[i].first_error);
      const bool is_other = std::abs(other[i].first - mine[i].first) > std::max(least, errors_apart * errors);
      if (is_other || other[i].first_error < mine[i].first_error)
        mine[i].first = other[i].first, mine[i].first_error = other[i].first_error;
    }
  };
  for (std::size_t o = 0; o < std::min(out.drivers.outputs.size(), by_bins.outputs.size()); ++o)
    choose(out.drivers.outputs[o], by_bins.outputs[o], never);
  for (auto& c : out.drivers.outcomes)
    for (const auto& d : by_bins.outcomes)
      if (c.outcome == d.outcome) choose(c.inputs, d.inputs, least_apart);
  if (p.space.has_interaction()) return;
  for (auto& inputs : out.drivers.outputs) raise_to_bound(inputs);
  for (auto& c : out.drivers.outcomes) raise_to_bound(c.inputs);
}

namespace {

/// What boxes are ranked by: the output that a requirement limits first, else the first one.
int find_ranking_output(const Permissible& permissible, const std::vector<std::string>& outputs) {
  if (permissible.limits.empty()) return 0;
  const auto at = std::find(outputs.begin(), outputs.end(), permissible.limits.front().output);
  return at == outputs.end() ? 0 : static_cast<int>(at - outputs.begin());
}

}  // namespace

void find_boxes(Insights& out, const Problem& p, const Budget& b, uncertainty::Asker& asker,
                const std::vector<double>& levels, const std::vector<std::string>& outputs,
                const std::vector<std::string>& outcomes) {
  // nothing keeps a requirement, and no output has a name
  if (std::ranges::none_of(asker.archive().samples(),
                           [](const auto& s) { return s.result.state == uncertainty::Result::State::Done; }))
    return;
  const Permissible permissible = read_permissible(p.permissible, p);
  const uncertainty::Requirement requirement = make_requirement(permissible, outputs, outcomes);
  const int runs = b.limit - b.outcomes - b.in_boxes, axes = std::max(1, count_axes(p.space));
  uncertainty::DesignOptions o;
  o.space_points = std::min(200 * axes, std::max(1, runs / 4));
  o.fresh = std::clamp((runs + b.in_boxes) / 12, 20, 149);
  o.rerun_limit = runs + b.in_boxes < least_with_bounds ? 0 : std::min(2000, runs / 12);
  // a box that nothing is left to check is of no use
  o.k_max = std::clamp(runs / (o.fresh + o.rerun_limit + 50 * axes), 2, 6);
  o.levels = levels;
  o.ranking_output = find_ranking_output(permissible, outputs);
  o.seed = p.seed;
  if (out.has_boxes) o.tried = 0;
  for (const uncertainty::PermissibleBox& one : out.boxes.boxes) o.tried = std::max(o.tried, one.tries);
  out.boxes = uncertainty::find_permissible_boxes(p.space, asker, requirement, o);
  out.has_boxes = true;
}

void finish_boxes(Insights& in, const Problem& p, uncertainty::Asker& asker, const std::vector<double>& levels,
                  const std::vector<std::string>& outputs, const std::vector<std::string>& outcomes) {
  if (!in.has_boxes) return;
  uncertainty::DesignOptions o;
  o.levels = levels;
  o.seed = p.seed;
  const Permissible permissible = read_permissible(p.permissible, p);
  o.ranking_output = find_ranking_output(permissible, outputs);
  const uncertainty::Requirement requirement = make_requirement(permissible, outputs, outcomes);
  uncertainty::analyse_on(p.space, in.boxes.boxes, requirement, asker, o);
}

bool is_share_known(const uncertainty::Driver& d) { return d.first > d.first_error; }

json to_json(const Insights& in) {
  json j = json::object();
  json& knowing = j["knowing"] = json::array();
  for (const uncertainty::Fixed& f : in.knowing) {
    json classes = json::array();
    for (const uncertainty::Possibility& c : f.classes)
      classes.push_back({c.outcome, c.possibility, c.resolution, c.sample, c.above, c.converged});
    knowing.push_back({{"input", f.input}, {"classes", classes}});
  }
  if (!in.has_boxes) return j;
  const uncertainty::DesignResult& d = in.boxes;
  json& boxes = j["boxes"];
  boxes = {{"permissible", d.permissible},
           {"forbidden", d.forbidden},
           {"failed", d.failed},
           {"fraction", d.fraction},
           {"fraction_error", d.fraction_error},
           {"spread", d.spread},
           {"ending", static_cast<int>(d.ending)},
           {"list", json::array()}};
  for (const uncertainty::PermissibleBox& b : d.boxes) {
    json inputs = json::array();
    for (const auto& f : b.inputs) inputs.push_back({f.support().left, f.centre(), f.support().right});
    boxes["list"].push_back({{"lower", b.box.lower},
                             {"upper", b.box.upper},
                             {"inputs", inputs},
                             {"group", b.group},
                             {"centre", b.centre},
                             {"volume", b.volume},
                             {"samples", b.samples},
                             {"broken", b.broken},
                             {"fresh", b.fresh},
                             {"tries", b.tries},
                             {"violating", b.violating},
                             {"distance", b.distance},
                             {"robustness", b.robustness},
                             {"kept", b.kept},
                             {"outputs", bounds_json(b.outputs)}});
  }
  return j;
}

void read_json(Insights& out, const json& j) {
  for (const json& f : j.value("knowing", json::array())) {
    uncertainty::Fixed fixed;
    fixed.input = f.at("input");
    for (const json& c : f.at("classes"))
      fixed.classes.push_back({c.at(0), number(c.at(1)), number(c.at(2)), c.at(3), c.at(4), c.at(5)});
    out.knowing.push_back(std::move(fixed));
  }
  out.has_boxes = j.contains("boxes");
  if (!out.has_boxes) return;
  const json& boxes = j["boxes"];
  uncertainty::DesignResult& d = out.boxes;
  d.permissible = boxes.at("permissible");
  d.forbidden = boxes.at("forbidden");
  d.failed = boxes.at("failed");
  d.fraction = boxes.at("fraction");
  d.fraction_error = boxes.at("fraction_error");
  d.spread = boxes.value("spread", 0);
  d.ending = static_cast<uncertainty::Ending>(boxes.at("ending").get<int>());
  for (const json& one : boxes.at("list")) {
    uncertainty::PermissibleBox b;
    b.box = {one.at("lower").get<Point>(), one.at("upper").get<Point>()};
    for (const json& f : one.at("inputs")) b.inputs.push_back(uncertainty::make_triangular(f.at(0), f.at(1), f.at(2)));
    b.group = one.at("group");
    b.centre = one.at("centre");
    b.volume = one.at("volume");
    b.samples = one.at("samples");
    b.broken = one.value("broken", -1);
    b.fresh = one.at("fresh");
    b.tries = one.at("tries");
    b.violating = one.at("violating");
    b.distance = one.at("distance");
    const json& robustness = one.at("robustness");
    b.robustness = robustness.is_null() ? std::numeric_limits<double>::infinity() : robustness.get<double>();
    b.kept = one.at("kept");
    b.outputs = read_bounds(one.at("outputs"));
    d.boxes.push_back(std::move(b));
  }
}

}  // namespace topple::study
