#include "study/confirmation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace topple::study {

namespace {

using State = Confirmation::State;
using uncertainty::AlphaResult;
using uncertainty::Bound;
using uncertainty::Result;

constexpr int kSpread = 8;  // samples spread over all runs

/// Adds samples one by one, each as far as possible from those before it, by widths of the inputs.
void add_spread(const uncertainty::Space& space, const uncertainty::Archive& archive, std::vector<int>& chosen) {
  const std::vector<double> scale = uncertainty::calc_scale(space);
  const auto distance2 = [&](const uncertainty::Point& a, const uncertainty::Point& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
      if (scale[i] > 0) sum += (a[i] - b[i]) * (a[i] - b[i]) / (scale[i] * scale[i]);
    return sum;
  };
  std::vector<double> nearest(archive.size(), std::numeric_limits<double>::infinity());
  const auto note = [&](int sample) {
    for (std::size_t i = 0; i < nearest.size(); ++i)
      nearest[i] = std::min(nearest[i], distance2(archive.samples()[i].x, archive[sample].x));
  };
  for (const int sample : chosen) note(sample);
  for (int k = 0; k < kSpread; ++k) {
    int farthest = -1;
    for (std::size_t i = 0; i < nearest.size(); ++i)
      if (archive.samples()[i].result.state == Result::State::Done && nearest[i] > 0 &&
          (farthest < 0 || nearest[i] > nearest[static_cast<std::size_t>(farthest)]))
        farthest = static_cast<int>(i);
    if (farthest < 0) return;
    chosen.push_back(farthest);
    note(farthest);
  }
}

}  // namespace

std::string to_text(State s) {
  switch (s) {
    case State::Confirmed:
      return "confirmed";
    case State::Exceeded:
      return "exceeded";
    case State::NotReached:
      return "not reached";
    case State::NotRun:
      break;
  }
  return "not run";
}

std::vector<int> choose_confirmation(const uncertainty::Space& space, const AlphaResult& r, int limit) {
  std::vector<int> chosen;
  std::set<int> known;
  const auto add = [&](int sample) {
    if (sample >= 0 && r.archive[sample].result.state == Result::State::Done && known.insert(sample).second)
      chosen.push_back(sample);
  };
  add(r.archive.find(uncertainty::calc_centre(space)));
  for (const auto& c : r.classes) add(c.sample);
  add_spread(space, r.archive, chosen);
  known.insert(chosen.begin(), chosen.end());
  std::size_t levels = 0;
  for (const auto& o : r.outputs) levels = std::max(levels, o.levels.size());
  for (std::size_t l = 0; l < levels; ++l)
    for (const auto& o : r.outputs)
      if (l < o.levels.size()) add(o.levels[l].lower.sample), add(o.levels[l].upper.sample);
  if (static_cast<int>(chosen.size()) > limit) chosen.resize(static_cast<std::size_t>(std::max(0, limit)));
  return chosen;
}

Confirmation judge_confirmation(const uncertainty::Space& space, const AlphaResult& r,
                                std::vector<Confirmation::Run> runs, int limit) {
  Confirmation out;
  out.limit = limit;
  for (Confirmation::Run& run : runs) run.membership = uncertainty::calc_membership(space, r.archive[run.sample].x);
  out.runs = std::move(runs);
  const auto find = [&out](int sample) -> const Confirmation::Run* {
    for (const Confirmation::Run& run : out.runs)
      if (run.sample == sample && run.whole.state != Result::State::NotRun) return &run;
    return nullptr;
  };
  for (std::size_t o = 0; o < r.outputs.size(); ++o) {
    const auto& levels = r.outputs[o].levels;
    if (levels.empty()) continue;
    const double slack = confirmation_tolerance * (levels.front().upper.value - levels.front().lower.value);
    for (std::size_t l = 0; l < levels.size(); ++l) {
      const uncertainty::Box box = uncertainty::make_box(space, levels[l].alpha);
      for (const bool is_upper : {false, true}) {
        const Bound& bound = is_upper ? levels[l].upper : levels[l].lower;
        Confirmation::Bound b;
        b.output = static_cast<int>(o), b.level = static_cast<int>(l), b.is_upper = is_upper;
        b.whole = std::nan("");
        const double sign = is_upper ? 1 : -1;
        for (const Confirmation::Run& run : out.runs) {
          if (run.whole.state != Result::State::Done || o >= run.whole.values.size()) continue;
          if (!uncertainty::is_in_cut(space, box, levels[l].alpha, r.archive[run.sample].x)) continue;
          const double value = run.whole.values[o];
          if (!std::isfinite(b.whole) || sign * value > sign * b.whole) b.whole = value;
        }
        if (bound.sample >= 0 && std::isfinite(b.whole)) {
          const double beyond = sign * (b.whole - bound.value);
          if (beyond > slack)
            b.state = State::Exceeded;  // whichever run does
          else if (const Confirmation::Run* run = find(bound.sample); run && run->whole.state == Result::State::Done)
            b.state = beyond < -slack ? State::NotReached : State::Confirmed;
        }
        out.bounds.push_back(b);
      }
    }
  }
  for (const auto& c : r.classes) {
    if (c.outcome == uncertainty::failed_outcome) continue;
    Confirmation::Outcome found;
    found.outcome = c.outcome, found.sample = c.sample;
    if (const Confirmation::Run* run = find(c.sample)) {
      found.whole = uncertainty::outcome_of(run->whole);
      found.state = found.whole == c.outcome ? State::Confirmed : State::NotReached;
    }
    out.outcomes.push_back(found);
  }
  return out;
}

}  // namespace topple::study
