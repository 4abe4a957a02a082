/// What the summary tells about bodies that contact did not keep apart.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mbs/system.h"

namespace topple::mbs {

namespace {

constexpr size_t kMostNoted = 6;     // pairs of bodies
constexpr double kMostSunken = 0.5;  // share of the thinner shape that they may overlap by

std::string name_of(const Model& model, size_t b) {
  const std::string& name = model.bodies[b].name;
  return name.empty() ? "number " + std::to_string(b) : "\"" + name + "\"";
}

}  // namespace

double System::thickness_of(const CompiledShape& shape) const {
  switch (shape.kind) {
    case Shape::Kind::Box:
      return 2 * std::min({shape.half.x, shape.half.y, shape.half.z});
    case Shape::Kind::Sphere:
      return 2 * shape.radius;
    case Shape::Kind::Hull:
      return hulls[static_cast<size_t>(shape.hull)].thickness;
    case Shape::Kind::Plane:
      break;
  }
  return kUnlimited;
}

void System::note_lost_contact(const PairDue& due, double depth, double interval) {
  const size_t a = static_cast<size_t>(due.a), b = static_cast<size_t>(due.b);
  const CompiledShape &shape_a = state.shapes[static_cast<size_t>(due.shape_a)],
                      &shape_b = state.shapes[static_cast<size_t>(due.shape_b)];
  const double thickness = std::min(thickness_of(shape_a), thickness_of(shape_b));
  const double way = norm(Vec3(state.v[a]) - Vec3(state.v[b])) * interval;
  const bool is_sunken = depth > kMostSunken * thickness;
  if (!is_sunken && way <= std::max(thickness, -depth)) return;
  const std::pair<int, int> pair{std::min(due.a, due.b), std::max(due.a, due.b)};
  if (noted_pairs.size() >= kMostNoted || std::find(noted_pairs.begin(), noted_pairs.end(), pair) != noted_pairs.end())
    return;
  noted_pairs.push_back(pair);
  const std::string bodies = fmt::format("bodies {} and {}: ", name_of(model, static_cast<size_t>(pair.first)),
                                         name_of(model, static_cast<size_t>(pair.second)));
  // told before a snapshot
  std::vector<std::string>& notes = summary.notes;
  if (std::any_of(notes.begin(), notes.end(), [&](const std::string& note) { return note.starts_with(bodies); }))
    return;
  notes.push_back(bodies +
                  (is_sunken ? fmt::format("one has sunk {:.3g} m into the other at {:.4g} s, half of the "
                                           "{:.3g} m of the thinner one, and contact may let it through; stiffer "
                                           "contact (a pair's \"stiffness\", \"contact_frequency\") keeps them apart",
                                           depth, state.time, thickness)
                             : fmt::format("they move {:.3g} m against each other from one look for contact to the "
                                           "next at {:.4g} s, and the thinner one has {:.3g} m: they may pass through "
                                           "each other; a shorter step tells",
                                           way, state.time, thickness)));
}

}  // namespace topple::mbs
