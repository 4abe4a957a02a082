#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "explicit_mesh.h"

namespace topple::fem {
namespace {

/// A portal: columns of 0.4 x 0.4 and 3.2 m, a beam of 0.4 x 0.4 over 4 m, the right column half as wide in x.
ExplicitModel make_portal() {
  ExplicitModel model;
  model.materials = {make_explicit_elastic(2500, 30e9, 0.2)};
  const std::vector<double> x = divide(0, 4, 40), y = divide(0, 0.4, 4), z = divide(0, 3.2, 32);
  const Mesh grid = make_grid(x, y, z);
  std::vector<int> number(grid.nodes.size(), -1);
  for (const Hex& hex : grid.hexes) {
    const Vec3 c = 0.5 * (grid.nodes[static_cast<size_t>(hex.node[0])] + grid.nodes[static_cast<size_t>(hex.node[6])]);
    if (c.x > 0.4 && c.x < 3.8 && c.z < 2.8) continue;
    ExplicitElement e;
    for (size_t i = 0; i < 8; ++i) {
      int& n = number[static_cast<size_t>(hex.node[i])];
      if (n < 0) {
        n = static_cast<int>(model.nodes.size());
        model.nodes.push_back(grid.nodes[static_cast<size_t>(hex.node[i])]);
      }
      e.node[i] = n;
    }
    model.elements.push_back(e);
  }
  for (const int n : find_nodes(model, [](const Vec3& p) { return p.z == 0; }))
    model.supports.push_back({n, true, true, true});
  return model;
}

/// Displacements of all nodes by CalculiX with its elements of eight nodes and incompatible modes.
std::vector<Vec3> solve_by_calculix(const ExplicitModel& model, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  std::ofstream out(folder / "portal.inp");
  out.precision(12);
  out << "*NODE, NSET=ALL\n";
  for (size_t n = 0; n < model.nodes.size(); ++n)
    out << n + 1 << ", " << model.nodes[n].x << ", " << model.nodes[n].y << ", " << model.nodes[n].z << '\n';
  out << "*ELEMENT, TYPE=C3D8I, ELSET=E\n";
  for (size_t e = 0; e < model.elements.size(); ++e) {
    out << e + 1;
    for (const int n : model.elements[e].node) out << ", " << n + 1;
    out << '\n';
  }
  out << "*BOUNDARY\n";
  for (const ExplicitSupport& s : model.supports) out << s.node + 1 << ", 1, 3\n";
  const ExplicitMaterial& m = model.materials[0];
  out << "*MATERIAL, NAME=M\n*ELASTIC\n"
      << m.E << ", " << m.nu << "\n*DENSITY\n"
      << m.density << "\n*SOLID SECTION, ELSET=E, MATERIAL=M\n*STEP\n*STATIC\n*DLOAD\nE, GRAV, 9.81, 0, 0, -1\n"
      << "*NODE PRINT, NSET=ALL\nU\n*END STEP\n";
  out.close();
  const std::string command = "cd '" + folder.string() + "' && OMP_NUM_THREADS=1 ccx -i portal > log.txt 2>&1";
  if (std::system(command.c_str()) != 0) return {};
  std::ifstream in(folder / "portal.dat");
  std::vector<Vec3> u(model.nodes.size(), Vec3{1e9, 1e9, 1e9});
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    size_t n = 0;
    Vec3 v;
    if (words >> n >> v.x >> v.y >> v.z && n >= 1 && n <= u.size()) u[n - 1] = v;
  }
  return u;
}

TEST(ExplicitFrameReference, AgreesWithCalculixUnderDeadLoad) {
  if (std::system("command -v ccx > /dev/null 2>&1") != 0) GTEST_SKIP() << "CalculiX (ccx) is not installed";
  const ExplicitModel model = make_portal();
  const auto expected =
      solve_by_calculix(model, std::filesystem::path(testing::TempDir()) / "topple_explicit_calculix");
  ASSERT_EQ(expected.size(), model.nodes.size()) << "ccx failed, see portal/log.txt in the temporary folder";
  ExplicitSystem system(model, {});
  RelaxationOptions options;
  options.tolerance = 1e-4;
  const RelaxationSummary summary = system.relax(options);
  ASSERT_TRUE(summary.converged) << summary.text;
  RecordProperty("steps", summary.steps);
  double largest = 0, difference = 0;
  for (size_t n = 0; n < expected.size(); ++n) {
    const Vec3 u = system.p(static_cast<int>(n)) - model.nodes[n];
    largest = std::max(largest, norm(expected[n]));
    difference = std::max(difference, norm(u - expected[n]));
  }
  RecordProperty("difference_ppm", static_cast<int>(1e6 * difference / largest));
  // both are right to the square of the element over the depth, (1/4)²/12: half a percent
  EXPECT_GT(largest, 1e-4);
  EXPECT_LT(difference, 5e-3 * largest);
}

}  // namespace
}  // namespace topple::fem
