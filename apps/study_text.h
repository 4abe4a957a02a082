#pragma once
/// What topple study prints of a study.

#include <cstdio>
#include <string>

#include "study/manager.h"

namespace topple::apps {

/// Done, running, failed, rate, what is left, and bounds so far in the units of the results.
std::string describe_state(const study::Problem&, const study::StudyState&);

/// Verdict, outcomes, outputs, drivers, boxes, runs to look at, failures.
void print_study(std::FILE*, const study::Problem&, const study::StudyResult&);

}  // namespace topple::apps
