/// What a span can bear at the most, where the model has no hinge (docs/theory/manager.md, section 7).

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "collapse/builder.h"

namespace topple::collapse {

using product::Member;

namespace {

/// Largest moment of a family without normal force, linear between the forces beside it [N·m].
double calc_largest_moment(const nearfield::MomentFamily& f) {
  const size_t K = f.normal_force.size(), J = f.rotation.size();
  if (K == 0 || J == 0) return 0;
  const auto at = [&](size_t k) {
    const auto row = f.moment.begin() + static_cast<std::ptrdiff_t>(k * J);
    return *std::max_element(row, row + static_cast<std::ptrdiff_t>(J));
  };
  const auto above = std::lower_bound(f.normal_force.begin(), f.normal_force.end(), 0.0) - f.normal_force.begin();
  const size_t high = std::min(static_cast<size_t>(above), K - 1), low = high > 0 ? high - 1 : 0;
  const double from = f.normal_force[low], to = f.normal_force[high];
  if (to <= 0 || from >= 0 || high == low) return at(high);
  return at(low) + (at(high) - at(low)) * -from / (to - from);
}

}  // namespace

void Builder::find_span_margins() {
  // hinges at both ends and in the middle under an even load, each with its largest moment: an upper bound
  const auto add = [&](int index, double weight, double span, double sagging, double hogging) {
    if (weight > 0 && span > 0) map.spans.push_back({member(index).name, (sagging + hogging) / (weight * span / 8)});
  };
  const double g = plan.analysis.gravity;
  for (const auto& [at, index] : x_beams) {
    // a wall that is cast on it makes both a deep beam
    const int wall = find_at(x_walls, {at.row, at.frame, at.storey + 1});
    if (wall >= 0 && is_cast_on_beam(wall)) continue;
    const MemberZones& z = zones.at(index);
    double sagging = 0, hogging = 0;
    for (const MemberStation& s : z.station) {
      const nearfield::Rcc& rcc = library.rcc(s.zone);
      sagging = std::max(sagging, calc_largest_moment(rcc.y_neg));
      hogging += 0.5 * calc_largest_moment(rcc.y_pos);
    }
    add(index, g * assemblies[static_cast<size_t>(own_body.at(index))].mass(), z.clear_length, sagging, hogging);
  }
  for (const auto& [at, index] : slabs) {
    double span = std::abs(member(index).end.y - member(index).start.y);
    bool is_between_beams = true;
    for (int side : {0, 1}) {
      const int beam = find_at(x_beams, {at.row, at.frame + side, at.storey});
      is_between_beams &= beam >= 0;
      if (beam >= 0) span -= 0.5 * section_of(beam).width;
    }
    if (!is_between_beams) continue;  // its strips have zones at their ends
    const nearfield::PanelRcc rcc = make_rcc_of_panel(index);
    const Vec3 size = member(index).end - member(index).start;
    const double kept = kept_of(index);
    add(index, g * mass_of_slab(at, index) / std::abs(size.x * size.y) * span, span, kept * rcc.moment_pos,
        kept * rcc.moment_neg);
  }
  std::stable_sort(map.spans.begin(), map.spans.end(),
                   [](const SpanMargin& a, const SpanMargin& b) { return a.margin < b.margin; });
}

size_t ModelMap::count_weak_spans() const {
  return static_cast<size_t>(
      std::count_if(spans.begin(), spans.end(), [](const SpanMargin& s) { return s.margin < 1; }));
}

std::vector<Diagnostic> complain_of_spans(const product::Plan& plan, const ModelMap& map) {
  const size_t weak = map.count_weak_spans();
  if (weak == 0) return {};
  const SpanMargin& least = map.spans.front();
  const auto member = std::find_if(plan.members.begin(), plan.members.end(),
                                   [&least](const Member& m) { return m.name == least.member; });
  return {
      {Severity::Warning, "W513", member == plan.members.end() ? SourcePosition{} : member->where, 1,
       fmt::format("{}: with hinges at both ends and in the middle it bears {:.2f} times its dead load at the most, "
                   "and could not stand (so with {} of {} spans)",
                   least.member, least.margin, weak, map.spans.size()),
       "check its bars and loads; the model has no hinges there and does not see it"}};
}

}  // namespace topple::collapse
