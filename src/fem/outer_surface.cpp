#include "fem/outer_surface.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"

namespace topple::fem {

OuterSurface make_outer_surface(const ExplicitModel& model) {
  struct Side {
    std::array<int, 4> nodes;  // rising
    std::uint32_t face;
  };
  std::vector<Side> sides;
  sides.reserve(6 * model.elements.size());
  for (size_t e = 0; e < model.elements.size(); ++e)
    for (size_t f = 0; f < 6; ++f) {
      Side s;
      for (size_t i = 0; i < 4; ++i) s.nodes[i] = model.elements[e].node[static_cast<size_t>(kFaces[f][i])];
      std::sort(s.nodes.begin(), s.nodes.end());
      s.face = static_cast<std::uint32_t>(6 * e + f);
      sides.push_back(s);
    }
  std::sort(sides.begin(), sides.end(),
            [](const Side& a, const Side& b) { return a.nodes != b.nodes ? a.nodes < b.nodes : a.face < b.face; });
  OuterSurface surface;
  surface.neighbour.assign(model.elements.size(), {-1, -1, -1, -1, -1, -1});
  for (size_t i = 0; i + 1 < sides.size(); ++i) {
    if (sides[i].nodes != sides[i + 1].nodes) continue;
    const std::uint32_t a = sides[i].face, b = sides[i + 1].face;
    if (i + 2 < sides.size() && sides[i + 2].nodes == sides[i].nodes)
      throw InputError("E642", fmt::format("elements {}, {} and {} share a face", a / 6, b / 6, sides[i + 2].face / 6));
    surface.neighbour[a / 6][a % 6] = static_cast<int>(b / 6);
    surface.neighbour[b / 6][b % 6] = static_cast<int>(a / 6);
  }
  return surface;
}

}  // namespace topple::fem
