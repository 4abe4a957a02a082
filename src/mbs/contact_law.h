#pragma once
/// What the surfaces of two bodies do at a touching point (docs/theory/contact.md).

#include "mbs/model.h"

namespace topple::mbs {

/// Force at a depth δ that grows at the rate u, for a spring of rate k and the mass m felt at the point:
///   f = mean k δ + clamp(c u, -band k δ, most k δ),   c = 2 zeta sqrt(k m), or `damping` where that is >= 0
struct ContactLaw {
  double mean = 1;
  double band = 0, most = 0;
  double zeta = 0;
  double friction = 0;
  double stiffness = 0;  // of a point; 0: from masses and the contact frequency [N/m]
  double damping = -1;   // [N·s/m]
  bool touches = true;
};

/// The law whose single impact returns the share `restitution` (0 to 1) of the speed; the least it can return is 0.25
/// %.
ContactLaw make_contact_law(double restitution, double friction);

/// The law of a pair with rules of its own.
ContactLaw make_contact_law(const Contact::Pair&);

/// Restitution of a single impact under a law with the ratio `lower` of the parting branch to the approaching one and
/// the dashpot `zeta` (eq. 2); zeta > 0, 0 <= lower < 1.
double calc_restitution(double lower, double zeta);

}  // namespace topple::mbs
