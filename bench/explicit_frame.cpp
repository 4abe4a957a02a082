#include "explicit_frame.h"

namespace topple::bench {

using fem::ExplicitModel;

ExplicitModel make_explicit_frame(int bays_x, int bays_y, int storeys) {
  ExplicitModel model;
  fem::ExplicitMaterial concrete;
  concrete.name = "concrete", concrete.density = 2450, concrete.E = 27e9, concrete.nu = 0.2;
  concrete.yield = {{0, 5e6, 25e6}, {0.01, 6e6, 26e6}, {0.1, 4e6, 15e6}};
  concrete.tension_limit = 0.3, concrete.compression_limit = 0.5;
  model.materials = {concrete, concrete};
  constexpr int kBay = 12, kStorey = 7;
  const int nx = bays_x * kBay + 2, ny = bays_y * kBay + 2, nz = storeys * kStorey;
  std::vector<int> node(static_cast<size_t>((nx + 1) * (ny + 1) * (nz + 1)), -1);
  const auto node_at = [&](int i, int j, int k) {
    int& n = node[static_cast<size_t>((k * (ny + 1) + j) * (nx + 1) + i)];
    if (n < 0) {
      n = static_cast<int>(model.nodes.size());
      model.nodes.push_back({0.4 * i, 0.4 * j, 0.4 * k});
    }
    return n;
  };
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        const bool slab = k % kStorey == kStorey - 1, column = i % kBay < 2 && j % kBay < 2;
        if (!slab && !column) continue;
        fem::ExplicitElement e;
        e.node = {
            node_at(i, j, k),     node_at(i + 1, j, k),     node_at(i + 1, j + 1, k),     node_at(i, j + 1, k),
            node_at(i, j, k + 1), node_at(i + 1, j, k + 1), node_at(i + 1, j + 1, k + 1), node_at(i, j + 1, k + 1)};
        e.material = slab ? 0 : 1;
        model.elements.push_back(e);
      }
  model.grounds = {fem::ExplicitGround{}};
  return model;
}

}  // namespace topple::bench
