#include "fem/explicit_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/error.h"

namespace topple::fem {

namespace {

/// Edges of a hexahedron, four along each of ξ, η, ζ.
constexpr int kEdges[12][2] = {{0, 1}, {3, 2}, {4, 5}, {7, 6}, {0, 3}, {1, 2},
                               {4, 7}, {5, 6}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};

/// Modal amplitudes of ξ η ζ ηζ ζξ ξη times 8, and the derivatives of 64 volumes by them (explicit.md, eq. 1 to 4).
struct HexGradients {
  Vec3 a, b, c;
  double volume64 = 0;
};
HexGradients calc_gradients(const std::array<Vec3, 8>& x) {
  const auto sum = [&](std::array<int, 8> sign) {
    Vec3 s;
    for (size_t i = 0; i < 8; ++i) s += static_cast<double>(sign[i]) * x[i];
    return s;
  };
  const Vec3 a = sum({-1, 1, 1, -1, -1, 1, 1, -1}), b = sum({-1, -1, 1, 1, -1, -1, 1, 1}),
             c = sum({-1, -1, -1, -1, 1, 1, 1, 1}), d = sum({1, 1, -1, -1, -1, -1, 1, 1}),
             e = sum({1, -1, -1, 1, -1, 1, 1, -1}), f = sum({1, -1, 1, -1, 1, -1, 1, -1});
  HexGradients g;
  g.a = cross(b, c) + (1.0 / 3) * cross(f, e);
  g.b = cross(c, a) + (1.0 / 3) * cross(d, f);
  g.c = cross(a, b) + (1.0 / 3) * cross(e, d);
  g.volume64 = dot(a, g.a) + (1.0 / 3) * dot(d, cross(c, e) + cross(f, b));
  return g;
}

std::array<Vec3, 8> corners_of(const ExplicitModel& model, const ExplicitElement& element) {
  std::array<Vec3, 8> x;
  for (size_t i = 0; i < 8; ++i) x[i] = model.nodes[static_cast<size_t>(element.node[i])];
  return x;
}

void check_material(const ExplicitMaterial& m, size_t index, std::vector<Diagnostic>& errors) {
  const auto complain = [&](const std::string& what, const std::string& help = {}) {
    errors.push_back({Severity::Error, "E640", {}, 1, fmt::format("material {} ({}): {}", index, m.name, what), help});
  };
  if (!(m.density > 0)) complain(fmt::format("density {} is not positive", m.density));
  if (!(m.E > 0)) complain(fmt::format("E {} is not positive", m.E));
  if (!(m.nu > -1 && m.nu < 0.5)) complain(fmt::format("nu {} is outside of -1 to 0.5", m.nu));
  if (!(m.tension_limit > 0 && m.compression_limit > 0)) complain("plastic strains of removal must be positive");
  if (!(m.tension_cutoff > 0)) complain("tension_cutoff must be positive");
  if (!(m.crack_strain >= 0)) complain("crack_strain must not be negative");
  if (!(m.compression_cutoff > 0)) complain("compression_cutoff must be positive");
  if (m.yield.size() > kMostYieldPoints)
    complain(fmt::format("{} yield points; at most {}", m.yield.size(), kMostYieldPoints));
  for (size_t i = 0; i < m.yield.size(); ++i) {
    const YieldPoint& y = m.yield[i];
    if (!(y.tension > 0 && y.compression > 0)) complain(fmt::format("yield point {}: stresses must be positive", i));
    if (i == 0 ? y.strain != 0 : !(y.strain > m.yield[i - 1].strain))
      complain(fmt::format("yield point {}: strains must rise from 0", i));
    if (i == 0 || !(y.strain > m.yield[i - 1].strain)) continue;
    const double width = y.strain - m.yield[i - 1].strain, shear3 = 1.5 * m.E / (1 + m.nu);
    const double slope =
        std::min(y.tension - m.yield[i - 1].tension, y.compression - m.yield[i - 1].compression) / width;
    if (slope < -0.9 * shear3)
      complain(fmt::format("yield point {}: it softens by {:.3g} Pa, more than 0.9 of three shear moduli ({:.3g} Pa)",
                           i, -slope, shear3),
               "take larger plastic strains, or smaller elements");
  }
}

using Complain = std::function<void(const std::string&, const std::string&)>;

void check_bars(const ExplicitModel& model, const Complain& complain) {
  const int N = static_cast<int>(model.nodes.size());
  for (size_t i = 0; i < model.bars.size(); ++i) {
    const ExplicitBar& bar = model.bars[i];
    for (const ExplicitBar::End* end : {&bar.a, &bar.b}) {
      bool known = end->node[0] < 0;
      double sum = 0;
      for (const double w : end->weight) sum += w;
      if (!known) {
        known = std::abs(sum - 1) < 1e-9;
        for (const int n : end->node) known = known && n >= 0 && n < N;
      }
      if (!known) complain(fmt::format("bar {}: its ends need four nodes with weights of sum 1", i), "");
    }
    if (bar.a.node[0] < 0 && bar.b.node[0] < 0) complain(fmt::format("bar {}: both ends are held", i), "");
    if (!(bar.stiffness > 0) || !(bar.yield >= 0) || !(bar.rupture >= bar.yield) || !(bar.tears_at >= 0))
      complain(fmt::format("bar {}: stiffness {} N/m, yield {} N, rupture {} N, torn at {} m", i, bar.stiffness,
                           bar.yield, bar.rupture, bar.tears_at),
               "stiffness is positive, and it yields before it tears");
    const bool pairs = !bar.shortening.empty() && bar.shortening.size() == bar.buckling.size();
    if (!pairs || bar.shortening.front() != 0 ||
        std::adjacent_find(bar.shortening.begin(), bar.shortening.end(), std::greater_equal<>()) !=
            bar.shortening.end() ||
        !std::all_of(bar.buckling.begin(), bar.buckling.end(), [](double f) { return f >= 0; }))
      complain(fmt::format("bar {}: its buckling force is not one of a shortening that rises from 0", i), "");
  }
}

void check_releases(const ExplicitModel& model, const Complain& complain) {
  const auto is_of = [](int i, size_t size) { return i >= 0 && i < static_cast<int>(size); };
  std::vector<int> release_of(model.materials.size(), -1);
  for (size_t r = 0; r < model.releases.size(); ++r) {
    const ExplicitRelease& release = model.releases[r];
    if (!(release.duration >= 0) || !std::isfinite(release.duration))
      complain(fmt::format("release {}: its duration, {} s, is not possible", r, release.duration), "");
    for (const int b : release.bars)
      if (!is_of(b, model.bars.size())) complain(fmt::format("release {}: no bar {}", r, b), "");
    for (const int e : release.elements)
      if (!is_of(e, model.elements.size())) complain(fmt::format("release {}: no element {}", r, e), "");
    for (const int m : release.materials)
      if (is_of(m, model.materials.size()))
        release_of[static_cast<size_t>(m)] = static_cast<int>(r);
      else
        complain(fmt::format("release {}: no material {}", r, m), "");
    for (const auto& [from, to] : release.weakened) {
      if (!is_of(from, model.materials.size()) || !is_of(to, model.materials.size())) {
        complain(fmt::format("release {}: no material {} or {}", r, from, to), "");
        continue;
      }
      const ExplicitMaterial& a = model.materials[static_cast<size_t>(from)];
      const ExplicitMaterial& b = model.materials[static_cast<size_t>(to)];
      if (a.E != b.E || a.nu != b.nu || a.density != b.density)
        complain(fmt::format("release {}: material {} is not as elastic and heavy as {}", r, to, from), "");
    }
  }
  std::vector<int> taken(model.elements.size(), -1);
  for (size_t r = 0; r < model.releases.size(); ++r)
    for (const int e : model.releases[r].elements)
      if (is_of(e, model.elements.size())) taken[static_cast<size_t>(e)] = static_cast<int>(r);
  for (size_t e = 0; e < model.elements.size(); ++e) {
    const int m = model.elements[e].material;
    if (is_of(m, model.materials.size()) && release_of[static_cast<size_t>(m)] >= 0 &&
        release_of[static_cast<size_t>(m)] != taken[e])
      complain(fmt::format("element {} has material {} of release {}, which does not take it away", e, m,
                           release_of[static_cast<size_t>(m)]),
               "");
  }
}

}  // namespace

double calc_hex_volume(const std::array<Vec3, 8>& x) { return calc_gradients(x).volume64 / 64; }

double calc_element_step(const std::array<Vec3, 8>& x, const ExplicitMaterial& m, double mass_factor) {
  const HexGradients g = calc_gradients(x);
  const double lambda = m.E * m.nu / ((1 + m.nu) * (1 - 2 * m.nu)), mu = m.E / (2 * (1 + m.nu));
  const double aa = dot(g.a, g.a), bb = dot(g.b, g.b), cc = dot(g.c, g.c);
  const double stiff = std::max(lambda, 0.0) * (aa + bb + cc) + 2 * mu * std::max({aa, bb, cc});
  // 4 m V over the stiffness, both in units of 64 volumes
  return std::sqrt(4 * m.density * mass_factor * g.volume64 / 64 * g.volume64 / stiff);
}

void check_explicit_model(const ExplicitModel& model) {
  std::vector<Diagnostic> errors;
  const auto complain = [&](const std::string& what, const std::string& help = {}) {
    if (errors.size() < 20) errors.push_back({Severity::Error, "E641", {}, 1, what, help});
  };
  const int N = static_cast<int>(model.nodes.size()), M = static_cast<int>(model.materials.size());
  for (size_t i = 0; i < model.materials.size(); ++i) check_material(model.materials[i], i, errors);
  if (model.elements.empty()) complain("the mesh has no elements");
  for (size_t e = 0; e < model.elements.size(); ++e) {
    const ExplicitElement& element = model.elements[e];
    bool known = true;
    for (const int n : element.node) known = known && n >= 0 && n < N;
    if (!known) {
      complain(fmt::format("element {}: a node that does not exist", e));
      continue;
    }
    if (element.material < 0 || element.material >= M)
      complain(fmt::format("element {}: no material {}", e, element.material));
    if (element.part < 0) complain(fmt::format("element {}: part {} is negative", e, element.part));
    if (!(element.mass_factor > 0)) complain(fmt::format("element {}: mass_factor must be positive", e));
    const auto x = corners_of(model, element);
    if (!(calc_hex_volume(x) > 0))
      complain(fmt::format("element {}: turned inside out, or flat", e), "see the order of corners");
  }
  for (const Vec3& p : model.nodes)
    if (!is_finite(p)) complain("a node is not at a finite place");
  if (!model.extra_mass.empty() && model.extra_mass.size() != model.nodes.size())
    complain(fmt::format("{} extra masses for {} nodes", model.extra_mass.size(), N));
  for (const double m : model.extra_mass)
    if (!(m >= 0)) complain("an extra mass is negative");
  for (const ExplicitSupport& s : model.supports)
    if (s.node < 0 || s.node >= N) complain(fmt::format("a support at node {}, which does not exist", s.node));
  for (const NodalForce& f : model.forces)
    if (f.node < 0 || f.node >= N || !is_finite(f.force))
      complain(fmt::format("a force at node {} is not possible", f.node));
  check_bars(model, complain);
  check_releases(model, complain);
  if (model.grounds.size() > 4) complain(fmt::format("{} grounds; at most 4", model.grounds.size()));
  for (const ExplicitGround& g : model.grounds) {
    if (!(std::abs(norm(g.normal) - 1) < 1e-9)) complain("a ground's normal is not of length 1");
    if (!(g.friction >= 0)) complain("a ground's friction is negative");
  }
  if (!errors.empty()) throw InputError(errors);
}

ExplicitMeshSummary calc_mesh_summary(const ExplicitModel& model) {
  ExplicitMeshSummary s;
  s.nodes = static_cast<int>(model.nodes.size()), s.elements = static_cast<int>(model.elements.size());
  s.smallest_edge = s.critical_step = std::numeric_limits<double>::infinity();
  for (size_t e = 0; e < model.elements.size(); ++e) {
    const ExplicitElement& element = model.elements[e];
    const ExplicitMaterial& material = model.materials[static_cast<size_t>(element.material)];
    const auto x = corners_of(model, element);
    double least = std::numeric_limits<double>::infinity(), most = 0;
    for (const auto& edge : kEdges) {
      const double length = norm(x[static_cast<size_t>(edge[1])] - x[static_cast<size_t>(edge[0])]);
      least = std::min(least, length), most = std::max(most, length);
    }
    if (least < s.smallest_edge) s.smallest_edge = least, s.smallest_edge_element = static_cast<int>(e);
    s.largest_aspect = std::max(s.largest_aspect, most / least);
    const double step = calc_element_step(x, material, element.mass_factor);
    if (step < s.critical_step) s.critical_step = step, s.critical_element = static_cast<int>(e);
    const double mass = material.density * element.mass_factor * calc_hex_volume(x);
    s.mass += mass;
    for (const Vec3& p : x) s.p_WBcm += (mass / 8) * p;
  }
  for (size_t n = 0; n < model.extra_mass.size(); ++n)
    s.mass += model.extra_mass[n], s.p_WBcm += model.extra_mass[n] * model.nodes[n];
  if (s.mass > 0) s.p_WBcm *= 1 / s.mass;
  return s;
}

}  // namespace topple::fem
