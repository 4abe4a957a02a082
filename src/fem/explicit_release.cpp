// What loses its hold within some milliseconds, and the bars that are left of it.
#include <algorithm>
#include <cmath>

#include "fem/explicit_inside.h"

namespace topple::fem {

namespace {

/// Yield stresses times a factor > 0.
kernel::Law scale_strength(const kernel::Law& law, double factor) {
  kernel::Law out = law;
  for (int i = 0; i < law.points; ++i) {
    out.tension[i] *= factor, out.tension_slope[i] *= factor;
    out.compression[i] *= factor, out.compression_slope[i] *= factor;
  }
  return out;
}

/// Largest force when pushed together by so much [N].
double calc_buckling(const ExplicitBar& bar, double shortening) {
  const auto next = std::upper_bound(bar.shortening.begin(), bar.shortening.end(), shortening);
  const size_t i = static_cast<size_t>(next - bar.shortening.begin());
  if (i == bar.shortening.size()) return bar.buckling.back();
  const double share = (shortening - bar.shortening[i - 1]) / (bar.shortening[i] - bar.shortening[i - 1]);
  return bar.buckling[i - 1] + share * (bar.buckling[i] - bar.buckling[i - 1]);
}

/// Force of a bar that is longer by so much than it began; eq. 26.
void stretch(const ExplicitBar& bar, double elongation, BarState& state) {
  const double k = bar.stiffness, straight = elongation - state.stretched;
  if (straight >= 0) {
    state.bent = 0;
    state.force = k * straight;
    const double hardening = bar.tears_at > 0 ? (bar.rupture - bar.yield) / bar.tears_at : 0;
    if (state.force > bar.yield + hardening * state.stretched) {
      state.stretched = (k * elongation - bar.yield) / (k + hardening);
      state.force = bar.yield + hardening * state.stretched;
    }
    if (state.stretched > bar.tears_at) state.phase = 2, state.force = 0;
    return;
  }
  const double most = calc_buckling(bar, -straight);
  state.force = std::min(0.0, k * (straight - state.bent));
  if (state.force < -most) {
    state.force = -most;
    state.bent = straight + most / k;
  }
}

}  // namespace

void ExplicitSystem::Inside::end_releases(ExplicitState& state) {
  for (size_t i = 0; i < model.releases.size(); ++i) {
    ReleaseState& release = state.releases[i];
    if (release.begun < 0 || release.is_over != 0) continue;
    if (static_cast<double>(state.steps - release.begun) * h < model.releases[i].duration - 0.5 * h) continue;
    release.is_over = 1;
    for (const int e : model.releases[i].elements) remove_element(state, e, RemovalCause::Charge);
    weaken_laws(i);
  }
}

void ExplicitSystem::Inside::weaken_laws(size_t release) {
  for (const auto& [from, to] : model.releases[release].weakened)
    laws[static_cast<size_t>(from)] = first_laws[static_cast<size_t>(to)];
}

void ExplicitSystem::Inside::restore_laws(const ExplicitState& state) {
  laws = first_laws;
  for (size_t i = 0; i < state.releases.size(); ++i)
    if (state.releases[i].is_over != 0) weaken_laws(i);
  fade_laws(state);
}

void ExplicitSystem::Inside::fade_laws(const ExplicitState& state) {
  for (size_t i = 0; i < model.releases.size(); ++i) {
    const ReleaseState& release = state.releases[i];
    if (release.begun < 0 || release.is_over != 0) continue;
    const ExplicitRelease& of = model.releases[i];
    const double passed = static_cast<double>(state.steps - release.begun) * h;
    // a step longer, so that something is left until they go
    const double left = 1 - passed / (of.duration + h);
    for (const int m : of.materials)
      laws[static_cast<size_t>(m)] = scale_strength(first_laws[static_cast<size_t>(m)], left);
  }
}

void ExplicitSystem::Inside::press_bars(ExplicitState& state) const {
  for (size_t i = 0; i < model.bars.size(); ++i) {
    BarState& now = state.bars[i];
    if (now.phase != 1) continue;
    const ExplicitBar& bar = model.bars[i];
    const auto is_lost = [&](const ExplicitBar::End& end) {
      return end.node[0] >= 0 && std::any_of(end.node.begin(), end.node.end(), [&](int n) {
               return state.uses[chunks.row_of_node[static_cast<size_t>(n)]] == 0;
             });
    };
    if (is_lost(bar.a) || is_lost(bar.b)) now.phase = 2;
    const Vec3 along = calc_end(state, bar.b, kernel::kPlace) - calc_end(state, bar.a, kernel::kPlace);
    const double length = norm(along);
    if (!(now.length > 0)) now.length = length;
    if (now.phase == 1) stretch(bar, length - now.length, now);
    if (now.phase != 1) {
      now.force = 0, now.pull = now.before = {};
      continue;
    }
    now.pull = length > 0 ? (-now.force / length) * along : Vec3{};
    now.before = calc_end(state, bar.b, kernel::kSpeed) - calc_end(state, bar.a, kernel::kSpeed);
    const auto push_end = [&](const ExplicitBar::End& end, double sign) {
      if (end.node[0] < 0) return;
      for (size_t k = 0; k < 4; ++k)
        push(state, chunks.row_of_node[static_cast<size_t>(end.node[k])], (sign * end.weight[k]) * now.pull);
    };
    push_end(bar.a, -1), push_end(bar.b, 1);
  }
}

Vec3 ExplicitSystem::Inside::calc_end(const ExplicitState& state, const ExplicitBar::End& end, int field) const {
  if (end.node[0] < 0) return field == kernel::kPlace ? end.place : Vec3{};
  Vec3 sum;
  for (size_t k = 0; k < 4; ++k) sum += end.weight[k] * vector_at(row(state, end.node[k]) + field);
  return sum;
}

void ExplicitSystem::Inside::book_bars(ExplicitState& state) const {
  for (size_t i = 0; i < model.bars.size(); ++i) {
    const BarState& bar = state.bars[i];
    if (bar.phase != 1) continue;
    const Vec3 now =
        calc_end(state, model.bars[i].b, kernel::kSpeed) - calc_end(state, model.bars[i].a, kernel::kSpeed);
    state.bar_work += 0.5 * h * dot(bar.pull, bar.before + now);
  }
}

void ExplicitSystem::Inside::restart_bars(ExplicitState& state) const {
  state.bar_work = 0;
  for (size_t i = 0; i < model.bars.size(); ++i)
    state.bar_work -= 0.5 * state.bars[i].force * state.bars[i].force / model.bars[i].stiffness;
}

}  // namespace topple::fem
