#include "fem/mesh.h"

#include <string>

#include "base/error.h"
#include "fem/element.h"

namespace topple::fem {

Mesh make_grid(const std::vector<double>& x, const std::vector<double>& y, const std::vector<double>& z) {
  Mesh mesh;
  const int nx = static_cast<int>(x.size()), ny = static_cast<int>(y.size()), nz = static_cast<int>(z.size());
  for (const double c : z)
    for (const double b : y)
      for (const double a : x) mesh.nodes.push_back({a, b, c});
  const auto at = [&](int i, int j, int k) { return i + nx * (j + ny * k); };
  for (int k = 0; k + 1 < nz; ++k)
    for (int j = 0; j + 1 < ny; ++j)
      for (int i = 0; i + 1 < nx; ++i)
        mesh.hexes.push_back({{at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k), at(i, j, k + 1),
                               at(i + 1, j, k + 1), at(i + 1, j + 1, k + 1), at(i, j + 1, k + 1)},
                              0,
                              1.0});
  return mesh;
}

void check_mesh(const Mesh& mesh) {
  const int count = static_cast<int>(mesh.nodes.size());
  const auto complain = [](const std::string& what) { throw InputError("E651", what); };
  const auto exists = [&](int n) { return n >= 0 && n < count; };
  for (size_t e = 0; e < mesh.hexes.size(); ++e) {
    std::array<Vec3, 8> at;
    for (size_t i = 0; i < 8; ++i) {
      if (!exists(mesh.hexes[e].node[i]))
        complain("hexahedron " + std::to_string(e) + " has a node that does not exist");
      at[i] = mesh.nodes[static_cast<size_t>(mesh.hexes[e].node[i])];
    }
    if (!(mesh.hexes[e].fill > 0 && mesh.hexes[e].fill <= 1))
      complain("hexahedron " + std::to_string(e) + " must be filled by more than 0 and at most 1");
    if (!(calc_smallest_jacobian(at) > 0))
      complain("hexahedron " + std::to_string(e) + " is turned inside out or flat at one of its integration points");
  }
  for (size_t e = 0; e < mesh.bars.size(); ++e) {
    const Truss& bar = mesh.bars[e];
    if (!exists(bar.node[0]) || !exists(bar.node[1]))
      complain("bar " + std::to_string(e) + " has a node that does not exist");
    const Vec3 along = mesh.nodes[static_cast<size_t>(bar.node[1])] - mesh.nodes[static_cast<size_t>(bar.node[0])];
    if (!(norm(along) > 0) || !(bar.area > 0)) complain("bar " + std::to_string(e) + " has no length or no area");
  }
}

}  // namespace topple::fem
