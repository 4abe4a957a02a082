#pragma once
/// What topple study prints of a study.

#include <cstdio>

#include "study/manager.h"

namespace topple::apps {

/// Verdict, outcomes, outputs, drivers, boxes, runs to look at, failures.
void print_study(std::FILE*, const study::Problem&, const study::StudyResult&);

}  // namespace topple::apps
