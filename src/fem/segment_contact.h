#pragma once
/// Forces between points and segments of the outer surface and debris particles, and their work.

#include "fem/contact_search.h"
#include "fem/explicit_system.h"

namespace topple {
class Team;
}

namespace topple::fem {

struct ExplicitState;

/// Looks for candidates where something has moved enough; adds the time it takes [s]. `faces` are kept from look to
/// look.
void search_contact(const ContactSetup&, ExplicitState&, ContactFaces& faces, double h, Team&, double& seconds);
/// Whether a piece of debris of [first, last) has been knocked away faster than a look reckons with, so that the next
/// step is to look.
bool is_knocked(const ContactSetup&, const ExplicitState&, double h, size_t first, size_t last);
/// Forces of all candidates that touch.
void press_surfaces(ExplicitSystem::Inside&, ExplicitState&);
/// Work of the last step's forces.
void book_surfaces(const ExplicitSystem::Inside&, ExplicitState&);
/// An element has gone: its neighbours' faces are outside now.
void mark_changed(const ContactSetup&, ContactState&, int element);

}  // namespace topple::fem
