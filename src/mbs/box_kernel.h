#pragma once
/// Touching points of two boxes (docs/theory/contact.md), a pair in each SIMD lane. Same promises as kernel.h: a lane's
/// bits do not depend on the others.

#include <cstddef>

#include "mbs/kernel.h"

namespace topple::mbs::kernel {

// Field numbers are constants, and named so.
// NOLINTBEGIN(readability-identifier-naming)

/// A box in W, in a row.
enum BoxField : int {
  kBoxPlace = 0,   // centre (3) [m]
  kBoxAxes = 3,    // columns of its rotation (3 x 3)
  kBoxHalf = 12,   // half edges (3) [m]
  kBoxReach = 15,  // radius of the sphere around it [m]
  kBoxFields = 16
};

/// What is found of a pair.
enum BoxAnswer : int {
  kGap = 0,        // without points: the boxes are at least this far apart; negative: they overlap [m]
  kBoxNormal = 1,  // unit, from the first to the second (3)
  kBoxPlaces = 4,  // which places have points: sum of 2^place
  kBoxPoints = 5,  // kMostBoxPoints places, each kBoxPointFields
  kMostBoxPoints = 12,
  kBoxPointFields = 5,  // halfway between the surfaces (3) [m]; depth, 0: no point [m]; weight
  kBoxAnswerFields = kBoxPoints + kMostBoxPoints * kBoxPointFields
};
// NOLINTEND(readability-identifier-naming)

struct BoxJob {
  size_t blocks = 0;
  const double* boxes;         // kBoxFields each
  const std::uint32_t *a, *b;  // which of them (W a block)
  double* answers;             // kBoxAnswerFields a block
};

void find_box_contacts(const BoxJob&);
/// The same with one lane at a time in the same instruction set.
void find_box_contacts_singly(const BoxJob&);

}  // namespace topple::mbs::kernel
