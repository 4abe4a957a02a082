#pragma once
/// Meshes and materials of the tests of explicit dynamics.

#include <cmath>
#include <functional>
#include <vector>

#include "fem/explicit_system.h"
#include "fem/mesh.h"

namespace topple::fem {

inline std::vector<double> divide(double from, double to, int parts) {
  std::vector<double> x;
  for (int i = 0; i <= parts; ++i) x.push_back(from + (to - from) * i / parts);
  return x;
}

inline ExplicitMaterial make_explicit_elastic(double density, double E, double nu) {
  ExplicitMaterial m;
  m.name = "elastic", m.density = density, m.E = E, m.nu = nu;
  return m;
}

/// Adds a brick of nx x ny x nz elements between two corners.
inline void add_brick(ExplicitModel& model, const Vec3& low, const Vec3& high, int nx, int ny, int nz, int material = 0,
                      int part = 0) {
  const Mesh grid = make_grid(divide(low.x, high.x, nx), divide(low.y, high.y, ny), divide(low.z, high.z, nz));
  const int first = static_cast<int>(model.nodes.size());
  model.nodes.insert(model.nodes.end(), grid.nodes.begin(), grid.nodes.end());
  for (const Hex& hex : grid.hexes) {
    ExplicitElement e;
    for (size_t i = 0; i < 8; ++i) e.node[i] = first + hex.node[i];
    e.material = material, e.part = part;
    model.elements.push_back(e);
  }
}

inline std::vector<int> find_nodes(const ExplicitModel& model, const std::function<bool(const Vec3&)>& is_wanted) {
  std::vector<int> found;
  for (size_t n = 0; n < model.nodes.size(); ++n)
    if (is_wanted(model.nodes[n])) found.push_back(static_cast<int>(n));
  return found;
}

/// Kinetic energy by speeds of half a step ago [J].
inline double calc_kinetic(const ExplicitSystem& system, int nodes) {
  double sum = 0;
  for (int n = 0; n < nodes; ++n) sum += 0.5 * system.node_mass(n) * dot(system.v(n), system.v(n));
  return sum;
}

}  // namespace topple::fem
