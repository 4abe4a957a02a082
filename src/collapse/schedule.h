#pragma once
/// When each charge of a plan fires.

#include <cstdint>
#include <vector>

#include "collapse/knowledge.h"
#include "product/plan.h"

namespace topple::collapse {

/// Standard normal number of a stream: the sum of twelve uniform numbers less six. Only additions of 53-bit fractions
/// of a SplitMix64 sequence, so every machine and library gives the same bits. Lies in (-6, 6).
double calc_normal(std::uint64_t seed, std::uint64_t stream);

struct Firing {
  int stage = 0, charge = 0;  // indices into the plan
  double time = 0;            // with its scatter [s]
  bool fails = false;
};

/// Every charge with its time: stage time + delay + scatter, cut off at charge.scatter_limit deviations and never
/// before the stage's time. In order of time; equal times in order of the plan. Failing charges are listed too.
std::vector<Firing> make_schedule(const product::Plan&, const Knowledge&);

}  // namespace topple::collapse
