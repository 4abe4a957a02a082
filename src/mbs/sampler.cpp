#include "mbs/sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace topple::mbs {

double Sampler::next() const {
  double earliest = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < next_.size(); ++i) earliest = std::min(earliest, instant(i));
  return earliest;
}

void Sampler::take(const View& view, double early) {
  for (size_t i = 0; i < next_.size(); ++i) {
    if (view.time < instant(i) - early) continue;
    (*samplings_)[i].on_sample(view);
    // instants closer together than the steps are passed over
    next_[i] = std::max(next_[i] + 1, std::floor((view.time + early) / (*samplings_)[i].interval));
    if (view.time >= instant(i) - early) next_[i] += 1;
  }
}

}  // namespace topple::mbs
