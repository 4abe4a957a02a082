#pragma once
/// Forces between points and segments of the outer surface and debris particles, and their work.

#include "fem/contact_search.h"
#include "fem/explicit_system.h"

namespace topple {
class Team;
}

namespace topple::fem {

struct ExplicitState;

/// Penalty rate of a touch over the mass it feels and the step squared: a node takes part in up to ten.
inline constexpr double kTouchRate = 0.03;  // NOLINT(readability-identifier-naming)

/// Looks for candidates where something has moved enough; adds to the timing.
void search_contact(ExplicitSystem::Inside&, ExplicitState&);
/// Whether a piece of debris of [first, last) has been knocked away faster than a look reckons with, so that its next
/// step is to look.
bool is_knocked(const ExplicitSystem::Inside&, const ExplicitState&, size_t first, size_t last);
/// Forces of all candidates that touch, those of debris only when asked for.
void press_surfaces(ExplicitSystem::Inside&, ExplicitState&, bool debris);
/// Work of the last step's forces.
void book_surfaces(const ExplicitSystem::Inside&, ExplicitState&);
/// An element has gone: its neighbours' faces are outside now.
void mark_changed(const ContactSetup&, ContactState&, int element);

}  // namespace topple::fem
