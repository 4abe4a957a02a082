#pragma once
/// Rubble: what elements that have gone left behind, which moves as balls.

#include <vector>

#include "fem/explicit_system.h"
#include "product/plan.h"
#include "record/record.h"

namespace topple::farfield {

/// Tells in the findings on reach and on neighbours where rubble lies at the end, which no part of the record stands
/// for, and that it breaks the limits that it does.
///   model  of the elements that the rubble was; their part is a body of the record
void judge_rubble(const product::Plan&, const fem::ExplicitModel& model, const std::vector<fem::DebrisParticle>&,
                  record::Record&);

}  // namespace topple::farfield
