#include "farfield/rubble.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "collapse/debris.h"
#include "collapse/outcome.h"

namespace topple::farfield {

using record::Status;

void judge_rubble(const product::Plan& plan, const fem::ExplicitModel& model,
                  const std::vector<fem::DebrisParticle>& rubble, record::Record& r) {
  using collapse::calc_distance;
  if (rubble.empty()) return;
  const auto find = [&r](const std::string& id) {
    const auto at =
        std::find_if(r.findings.begin(), r.findings.end(), [&](const record::Finding& f) { return f.id == id; });
    return at == r.findings.end() ? nullptr : &*at;
  };
  for (const product::Neighbour& n : plan.neighbours) {
    record::Finding* clearance = find("clearance." + n.name);
    if (clearance == nullptr) continue;
    double least = std::numeric_limits<double>::infinity(), mass = 0;
    for (const fem::DebrisParticle& d : rubble) {
      const double apart = std::max(0.0, calc_distance(Point2{d.p.x, d.p.y}, n.footprint) - d.radius);
      least = std::min(least, apart);
      if (apart <= 0 || apart < n.clearance.value_or(0)) mass += d.mass;
    }
    if (!(mass > 0)) continue;
    clearance->text +=
        least > 0 ? fmt::format(" Rubble lies {:.1f} m from it at the end, {:.0f} kg of it nearer than the limit.",
                                least, mass)
                  : fmt::format(" Rubble lies on it at the end, {:.0f} kg of it there or nearer than the limit.", mass);
    clearance->value = std::min(clearance->value, least);
    clearance->status = n.clearance ? Status::Bad : Status::Warning;
  }
  record::Finding* reach = find("debris.reach");
  if (reach == nullptr) return;
  const double limit = plan.criteria.debris_reach.value_or(std::numeric_limits<double>::infinity());
  double farthest = 0, beyond = 0;
  int body = -1;
  Polygon outline;
  for (const fem::DebrisParticle& d : rubble) {
    // of its own structure, as that of parts
    if (const int part = model.elements[static_cast<size_t>(d.element)].part; part != body)
      body = part, outline = collapse::find_start_outline(r, static_cast<size_t>(part));
    if (outline.empty()) continue;
    const double apart = calc_distance(Point2{d.p.x, d.p.y}, outline) + d.radius;
    farthest = std::max(farthest, apart);
    if (apart > limit) beyond += d.mass;
  }
  reach->text +=
      fmt::format(" Rubble, which these numbers leave out, lies up to {:.1f} m from the footprint.", farthest);
  record::Finding* asked = find("criterion.debris_reach");
  if (asked == nullptr || !(beyond > 0)) return;
  asked->text += fmt::format(" Rubble lies up to {:.1f} m from the footprint, {:.0f} kg of it beyond the limit.",
                             farthest, beyond);
  asked->value = std::max(asked->value, farthest);
  asked->status = Status::Bad;
}

}  // namespace topple::farfield
