#pragma once
/// Forces between points and segments of the outer surface and debris particles, and their work.

#include <functional>

#include "fem/contact_search.h"
#include "fem/explicit_system.h"

namespace topple::fem {

struct ExplicitState;

/// Looks for candidates where something has moved enough; adds the time it takes [s].
void search_contact(const ContactSetup&, ExplicitState&, double h, double& seconds);
/// Forces of all candidates that touch.
void press_surfaces(const ContactSetup&, const ExplicitOptions&, double h, ExplicitState&,
                    const std::function<void(std::uint32_t row, const Vec3&)>& push);
/// Work of the last step's forces.
void book_surfaces(const ContactSetup&, double h, ExplicitState&);
/// An element has gone: its neighbours' faces are outside now.
void mark_changed(const ContactSetup&, ContactState&, int element);

}  // namespace topple::fem
