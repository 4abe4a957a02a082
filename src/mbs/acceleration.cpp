#include "mbs/acceleration.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace topple::mbs {

namespace {

constexpr size_t kMost = 40;          // changes that are remembered
constexpr double kDependent = 1e-10;  // share of a change's square that is new; below it is round-off
constexpr double kLedAway = 2;        // over the shortest step so far
constexpr double kShorter = 1.0 / 8;  // what may be added then
constexpr double kLonger = 2;         // and after what did not

}  // namespace

Acceleration::Change& Acceleration::Change::operator-=(const Change& c) {
  step -= c.step, pushed -= c.pushed, way -= c.way, way_pushed -= c.way_pushed;
  return *this;
}

Acceleration::Change& Acceleration::Change::operator*=(double by) {
  step *= by, pushed *= by, way *= by, way_pushed *= by;
  return *this;
}

Acceleration::Change Acceleration::Change::times(double by) const {
  Change c = *this;
  c *= by;
  return c;
}

bool Acceleration::accepts(const Vector& step, const Vector& pushed) {
  const double size = std::sqrt(std::abs(dot(step, pushed)));
  if (added_ != 0 && !(size <= kLedAway * least_)) {
    longest_ = std::max(1.0, kShorter * added_);
    added_ = 0;
    changes_.clear();
    last_ = {};
    return false;
  }
  if (added_ > 0) longest_ = std::max(longest_, kLonger * added_);
  least_ = std::min(least_, size);
  return true;
}

Acceleration::Vector Acceleration::improve(const Vector& step, const Vector& pushed) {
  if (last_.step.size() > 0) {
    if (changes_.size() == kMost) changes_.erase(changes_.begin());
    Change c{step - last_.step, pushed - last_.pushed, last_.way + step - last_.step,
             last_.way_pushed + pushed - last_.pushed};
    const double whole = dot(c.step, c.pushed);
    for (int twice = 0; twice < 2; ++twice)  // once leaves round-off of what was large
      for (const Change& e : changes_) c -= e.times(dot(e.step, c.pushed));
    const double left = dot(c.step, c.pushed);
    if (left > kDependent * whole) {
      c *= 1 / std::sqrt(left);
      changes_.push_back(std::move(c));
    }
  }
  Vector added = Vector::Zero(step.size()), added_pushed = Vector::Zero(pushed.size());
  for (const Change& e : changes_) {
    const double along = dot(e.step, pushed);
    added -= along * e.way;
    added_pushed -= along * e.way_pushed;
  }
  added_ = std::sqrt(std::abs(dot(added, added_pushed) / dot(step, pushed)));
  if (added_ > longest_) {
    const double share = longest_ / added_;
    added *= share, added_pushed *= share;
    added_ = longest_;
  }
  last_ = {step, pushed, step + added, pushed + added_pushed};
  return last_.way;
}

}  // namespace topple::mbs
