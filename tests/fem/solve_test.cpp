#include "fem/solve.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "base/error.h"
#include "fem/cut.h"

namespace topple::fem {
namespace {

constexpr double pi = 3.14159265358979323846;

int node_at(const Mesh& mesh, const Vec3& p) {
  size_t best = 0;
  for (size_t i = 0; i < mesh.nodes.size(); ++i)
    if (norm(mesh.nodes[i] - p) < norm(mesh.nodes[best] - p)) best = i;
  return static_cast<int>(best);
}

std::vector<double> divide(double a, double b, int n) {
  std::vector<double> x;
  for (int i = 0; i <= n; ++i) x.push_back(a + (b - a) * i / n);
  return x;
}

/// Quarter of a ring between radii, plane strain or one element thick and free to thin.
Mesh make_ring(const std::vector<double>& radius, int around, double thickness) {
  Mesh mesh = make_grid(radius, divide(0, pi / 2, around), {0, thickness});
  for (Vec3& n : mesh.nodes) n = {n.x * std::cos(n.y), n.x * std::sin(n.y), n.z};
  for (Vec3& n : mesh.nodes) {
    if (std::abs(n.x) < 1e-12) n.x = 0;
    if (std::abs(n.y) < 1e-12) n.y = 0;
  }
  return mesh;
}

// MacNeal & Harder (1985), thick cylinder, plane strain, unit pressure: closed form of Lamé.
TEST(SolveReference, ThickCylinderDoesNotLockNearIncompressibility) {
  for (const double nu : {0.3, 0.49, 0.499, 0.4999}) {
    Model model;
    model.mesh = make_ring({3, 3.5, 4.2, 5.2, 6.75, 9}, 9, 1);
    model.solids.push_back(make_elastic(1000, nu));
    model.control_length = {1};
    double tributary = 0;
    for (size_t i = 0; i < model.mesh.nodes.size(); ++i) {
      const Vec3& n = model.mesh.nodes[i];
      const int d = 3 * static_cast<int>(i);
      model.links[d + 2] = {};
      const double r = std::hypot(n.x, n.y);
      if (std::abs(r - 3) < 1e-9) {
        model.links[d] = {{0, n.x / r}}, model.links[d + 1] = {{0, n.y / r}};
        ++tributary;
      }
      if (n.x == 0) model.links[d] = {};
      if (n.y == 0) model.links[d + 1] = {};
    }
    const System system(model);
    Solver solver(system);
    // the pressure on a polygon of nine sides: the force on all nodes along their radii
    const double chord = 2 * 3 * std::sin(pi / 36);
    const double force = 9 * chord * std::cos(pi / 36);
    ASSERT_TRUE(solver.step({{{false, force}}, 0}, {}).converged);
    const double exact = (1 + nu) * 9.0 / (1000 * (81.0 - 9)) * (81.0 / 3 + (1 - 2 * nu) * 3);
    // five elements over a field that falls with 1/r²: published values of good elements are 0.98 to 1.00
    EXPECT_NEAR(solver.control(0) / exact, 1, 0.02) << nu;
  }
}

// Limit pressure of a thick tube, plane strain, perfectly plastic: 2/√3 σ_y ln(b/a).
TEST(SolveReference, ThickCylinderReachesItsPlasticLimit) {
  J2Input in;
  in.E = 200e9, in.nu = 0.3, in.yield = 250e6;
  for (const int over : {4, 8}) {
    Model model;
    model.mesh = make_ring(divide(1, 2, over), 3 * over, 0.2);
    model.solids.push_back(make_j2(in));
    model.control_length = {1};
    for (size_t i = 0; i < model.mesh.nodes.size(); ++i) {
      const Vec3& n = model.mesh.nodes[i];
      const int d = 3 * static_cast<int>(i);
      model.links[d + 2] = {};
      const double r = std::hypot(n.x, n.y);
      if (std::abs(r - 1) < 1e-9) model.links[d] = {{0, n.x / r}}, model.links[d + 1] = {{0, n.y / r}};
      if (n.x == 0) model.links[d] = {};
      if (n.y == 0) model.links[d + 1] = {};
    }
    const System system(model);
    Solver solver(system);
    MarchOptions options;
    options.first = options.largest = 0.1;
    const MarchSummary s = march(
        solver, {{{true, 0.01}}, 0}, options, [](double) { return true; }, {}, [](double) { return "u"; });
    ASSERT_TRUE(s.complete) << s.ending;
    const double step = pi / 2 / (3 * over), perimeter = 3 * over * 2 * std::sin(step / 2) * std::cos(step / 2);
    const double pressure = solver.control_force(0) / (0.2 * perimeter),
                 limit = 2 / std::sqrt(3.0) * in.yield * std::log(2.0);
    EXPECT_NEAR(pressure / limit, 1, over == 4 ? 0.02 : 0.006) << over;
    EXPECT_NEAR(solver.internal_work() / solver.external_work(), 1, 1e-4);
  }
}

// NAFEMS LE1: σ_yy at D is 92.7 MPa.
TEST(SolveReference, EllipticMembraneOfNafems) {
  double at_D[3];
  const int meshes[3] = {8, 16, 32};
  for (int m = 0; m < 3; ++m) {
    const int n = meshes[m];
    const double t = 0.01;  // thin beside the elements, so that the state is plane
    Model model;
    model.mesh = make_grid(divide(0, 1, n), divide(0, pi / 2, 2 * n), {0, t});
    for (Vec3& p : model.mesh.nodes) {
      const double s = p.x, a = 2 + s * 1.25, b = 1 + s * 1.75;
      p = {a * std::cos(p.y), b * std::sin(p.y), p.z};
    }
    const auto at = [&](int i, int j, int k) { return i + (n + 1) * (j + (2 * n + 1) * k); };
    for (int k = 0; k < 2; ++k)
      for (int i = 0; i <= n; ++i) {
        model.links[3 * at(i, 0, k) + 1] = {};
        model.links[3 * at(i, 2 * n, k)] = {};
      }
    for (int j = 0; j <= 2 * n; ++j)
      for (int i = 0; i <= n; ++i) model.links[3 * at(i, j, 0) + 2] = {};
    model.load.assign(3 * model.mesh.nodes.size(), 0);
    for (int j = 0; j < 2 * n; ++j) {
      const Vec3 side =
          model.mesh.nodes[static_cast<size_t>(at(n, j + 1, 0))] - model.mesh.nodes[static_cast<size_t>(at(n, j, 0))];
      const Vec3 force = 10e6 * t * 0.25 * Vec3{side.y, -side.x, 0};
      for (int k = 0; k < 2; ++k)
        for (int jj = j; jj <= j + 1; ++jj)
          for (int c = 0; c < 2; ++c) model.load[static_cast<size_t>(3 * at(n, jj, k) + c)] += force[c];
    }
    model.solids.push_back(make_elastic(210e9, 0.3));
    const System system(model);
    Solver solver(system);
    ASSERT_TRUE(solver.step({{}, 1}, {}).converged);
    // the first element's corner towards D, extrapolated from its points
    const auto& stress = solver.response().stress[0];
    const double s3 = std::sqrt(3.0), in = 0.5 * (1 + s3), out = 0.5 * (1 - s3);
    const auto mean = [&](size_t a, size_t b) { return 0.5 * (stress[a][1] + stress[b][1]); };
    at_D[m] = in * in * mean(0, 4) + in * out * (mean(1, 5) + mean(2, 6)) + out * out * mean(3, 7);
  }
  std::printf("  LE1: %.2f %.2f %.2f MPa\n", at_D[0] / 1e6, at_D[1] / 1e6, at_D[2] / 1e6);
  EXPECT_NEAR(at_D[1], 92.7e6, 0.02 * 92.7e6);
  EXPECT_NEAR(at_D[2], 92.7e6, 0.01 * 92.7e6);
}

/// A bar along x, its left end on rollers, its right end driven by control 0 along x.
Model make_pulled_bar(std::shared_ptr<const SolidLaw> law, int n) {
  Model model;
  model.mesh = make_grid(divide(0, 1, n), divide(0, 0.2, 2), divide(0, 0.1, 2));
  model.solids.push_back(std::move(law));
  model.control_length = {1};
  for (size_t i = 0; i < model.mesh.nodes.size(); ++i) {
    const Vec3& p = model.mesh.nodes[i];
    const int d = 3 * static_cast<int>(i);
    if (p.x == 0) model.links[d] = {};
    if (p.x == 1) model.links[d] = {{0, 1}};
    if (p.y == 0) model.links[d + 1] = {};
    if (p.z == 0) model.links[d + 2] = {};
  }
  return model;
}

TEST(Solve, J2BarHardensAndUnloads) {
  J2Input in;
  in.E = 200e9, in.nu = 0.3, in.yield = 250e6, in.hardening = 2e9;
  const System system(make_pulled_bar(make_j2(in), 3));
  Solver solver(system);
  SolveOptions options;
  options.tolerance = 1e-10;
  const double area = 0.02, slope = in.E * in.hardening / (in.E + in.hardening), eps_y = in.yield / in.E;
  const auto stress_at = [&](double u) {
    EXPECT_TRUE(solver.step({{{true, u}}, 0}, options).converged);
    return solver.control_force(0) / area;
  };
  EXPECT_NEAR(stress_at(1e-3), in.E * 1e-3, 1e-3);
  const double top = stress_at(0.02);
  EXPECT_NEAR(top, in.yield + slope * (0.02 - eps_y), 10);
  EXPECT_NEAR(stress_at(0.019), top - in.E * 1e-3, 10);
  // yields again in compression at the hardened stress
  const double back = 0.02 - 2 * top / in.E;
  EXPECT_NEAR(stress_at(back - 0.01), -(top + slope * 0.01), 10);
  // what was put in is elastic energy plus σ_y dε_p; trapezoids of two big steps are off by their kinks
  EXPECT_NEAR(solver.external_work() / solver.internal_work(), 1, 1e-9);
}

TEST(Solve, ConvergesQuadraticallyWithJ2) {
  J2Input in;
  in.E = 200e9, in.nu = 0.3, in.yield = 250e6, in.hardening = 2e9;
  Model model = make_pulled_bar(make_j2(in), 6);
  // clamped at the left: stresses vary
  for (size_t i = 0; i < model.mesh.nodes.size(); ++i)
    if (model.mesh.nodes[i].x == 0)
      for (int k = 0; k < 3; ++k) model.links[3 * static_cast<int>(i) + k] = {};
  const System system(model);
  Solver solver(system);
  SolveOptions options;
  options.tolerance = 1e-10;
  const StepSummary s = solver.step({{{true, 0.01}}, 0}, options);
  EXPECT_TRUE(s.converged);
  EXPECT_LE(s.iterations, 9);
}

TEST(Solve, RemembersSecantsWhereTheMatrixIsNotTheTangent) {
  J2Input in;
  in.E = 200e9, in.nu = 0.3, in.yield = 250e6, in.hardening = 20e9;
  Model model = make_pulled_bar(make_j2(in), 6);
  for (size_t i = 0; i < model.mesh.nodes.size(); ++i)
    if (model.mesh.nodes[i].x == 0)
      for (int k = 0; k < 3; ++k) model.links[3 * static_cast<int>(i) + k] = {};
  const System system(model);
  SolveOptions tangent, elastic;
  tangent.tolerance = elastic.tolerance = 1e-7;
  elastic.secant_share = 1, elastic.memory = 8, elastic.refresh = 1000;
  Solver a(system), b(system);
  const Loading pull{{{true, 0.005}}, 0};
  ASSERT_TRUE(a.step(pull, tangent).converged);
  const StepSummary s = b.step(pull, elastic);
  ASSERT_TRUE(s.converged) << s.residual;
  EXPECT_LE(s.factorisations, 2);
  EXPECT_NEAR(b.control_force(0) / a.control_force(0), 1, 1e-6);
}

TEST(Solve, BarsShareTheLoadWithTheSolid) {
  Model model = make_pulled_bar(make_elastic(30e9, 0), 4);
  model.steels.push_back(material::make_steel({500e6, 600e6, 200e9, 0.1, 0, 0}));
  for (int i = 0; i < 4; ++i)
    model.mesh.bars.push_back(
        {{node_at(model.mesh, {0.25 * i, 0.1, 0.05}), node_at(model.mesh, {0.25 * (i + 1), 0.1, 0.05})}, 1e-3, 0});
  const System system(model);
  Solver solver(system);
  SolveOptions options;
  options.tolerance = 1e-9;
  ASSERT_TRUE(solver.step({{{true, 1e-3}}, 0}, options).converged);
  EXPECT_NEAR(solver.control_force(0), 30e9 * 0.02 * 1e-3 + 200e9 * 1e-3 * 1e-3, 1);
  ASSERT_TRUE(solver.step({{{true, 0.02}}, 0}, options).converged);
  const double hardening = 100e6 / (0.1 - 0.0025);
  EXPECT_NEAR(solver.control_force(0), 30e9 * 0.02 * 0.02 + 1e-3 * (500e6 + hardening * 0.0175), 10);
  const Cut cut = make_cut(system, solver.response(), {{0.4, 0, 0}, {1, 0, 0}});
  EXPECT_EQ(cut.bars.size(), 1u);
  EXPECT_NEAR(cut.force.x, solver.control_force(0), 10);
}

// A clamped bar under a force and a moment at a rigid end, sliced straight and askew: what is cut balances what is
// applied.
class CutOf : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Meshes, CutOf, testing::Values(8, 40));
TEST_P(CutOf, BalancesTheAppliedForces) {
  Model model;
  const int along = GetParam();
  model.mesh = make_grid(divide(0, 1, along), divide(-0.1, 0.1, 4), divide(-0.05, 0.05, 4));
  model.solids.push_back(make_elastic(30e9, 0.2));
  // controls: displacement along x y z, rotation about x y z of the right end
  model.control_length = {1, 1, 1, 0.1, 0.1, 0.1};
  for (size_t i = 0; i < model.mesh.nodes.size(); ++i) {
    const Vec3& p = model.mesh.nodes[i];
    const int d = 3 * static_cast<int>(i);
    if (p.x == 0)
      for (int k = 0; k < 3; ++k) model.links[d + k] = {};
    if (p.x == 1) {
      model.links[d] = {{0, 1}, {4, p.z}, {5, -p.y}};
      model.links[d + 1] = {{1, 1}, {3, -p.z}};
      model.links[d + 2] = {{2, 1}, {3, p.y}};
    }
  }
  const System system(model);
  Solver solver(system);
  const double F[6] = {1000, 200, -300, 10, 20, -30};
  Loading loading;
  for (const double f : F) loading.controls.push_back({false, f});
  SolveOptions options;
  options.tolerance = 1e-11;
  ASSERT_TRUE(solver.step(loading, options).converged);
  // bending moments grow by the lever arm of the shear forces
  const double x = 0.4375;  // middle of an element in both meshes
  const Cut cut = make_cut(system, solver.response(), {{x, 0, 0}, {1, 0, 0}});
  EXPECT_NEAR(cut.area, 0.02, 1e-12);
  EXPECT_EQ(cut.points.size(), 16u);
  const double expected[6] = {F[0], F[1], F[2], F[3], F[4] - (1 - x) * F[2], F[5] + (1 - x) * F[1]};
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(cut.force[k], expected[k], 1e-6) << k;
    // torsion and bending: exact at the middle for what the nodes feel
    EXPECT_NEAR(cut.moment[k], expected[3 + k], k == 0 ? 1.5 : 0.05) << k;
  }
  // An inclined plane: the elements' moments do not vary along the bar, the plane's share of a shear force is off by
  // what they vary over an element, so the error of N is at most the slope times V, and falls with the elements'
  // length.
  const Vec3 n = (1 / std::sqrt(1.0 + 0.16)) * Vec3{1, 0.4, 0};
  const Cut askew = make_cut(system, solver.response(), {{x, 0, 0}, n});
  EXPECT_NEAR(askew.area, 0.02 * std::sqrt(1.16), 1e-12);
  std::printf("  askew %g %g\n", askew.force.x - F[0], askew.moment.y - expected[4]);
  EXPECT_NEAR(askew.force.x, F[0], 0.4 * F[1] * (along == 8 ? 1.01 : 0.2));
  EXPECT_NEAR(askew.moment.y, expected[4], 2);
}

TEST(SolveReplay, SameBitsAtAnyNumberOfThreads) {
  J2Input in;
  in.E = 200e9, in.nu = 0.3, in.yield = 250e6, in.hardening = 2e9;
  Model model = make_pulled_bar(make_j2(in), 20);
  for (size_t i = 0; i < model.mesh.nodes.size(); ++i)
    if (model.mesh.nodes[i].x == 0)
      for (int k = 0; k < 3; ++k) model.links[3 * static_cast<int>(i) + k] = {};
  const System system(model);
  std::vector<double> first;
  for (const int threads : {1, 2, 4}) {
    Solver solver(system);
    SolveOptions options;
    options.threads = threads;
    ASSERT_TRUE(solver.step({{{true, 0.01}}, 0}, options).converged);
    if (threads == 1)
      first = solver.state().q;
    else
      EXPECT_EQ(first, solver.state().q);
  }
}

TEST(March, SaysWhereItFailedAndObeysCancel) {
  J2Input in;
  in.E = 200e9, in.nu = 0.3, in.yield = 250e6;
  const System system(make_pulled_bar(make_j2(in), 2));
  const auto describe = [](double t) { return "F = " + std::to_string(static_cast<int>(t * 10)); };
  {
    // twice the plastic limit: no equilibrium from half of the way on
    Solver solver(system);
    const MarchSummary s = march(
        solver, {{{false, 2 * 250e6 * 0.02}}, 0}, {}, [](double) { return true; }, {}, describe);
    EXPECT_FALSE(s.complete);
    EXPECT_NEAR(s.reached, 0.5, 1e-3);
    EXPECT_EQ(s.ending.find("did not converge at F = "), 0u) << s.ending;
    EXPECT_NE(s.ending.find("last residual"), std::string::npos) << s.ending;
  }
  Solver solver(system);
  std::atomic<bool> cancel = true;
  Progress progress;
  progress.cancel = &cancel;
  const MarchSummary s = march(
      solver, {{{true, 0.1}}, 0}, {}, [](double) { return true; }, progress, describe);
  EXPECT_TRUE(s.cancelled);
  EXPECT_EQ(s.steps, 0);
}

TEST(System, RefusesUnsoundModels) {
  Model model = make_pulled_bar(make_elastic(1, 0), 1);
  model.mesh.hexes[0].law = 3;
  EXPECT_THROW(System{model}, InputError);
  model = make_pulled_bar(make_elastic(1, 0), 1);
  std::swap(model.mesh.hexes[0].node[0], model.mesh.hexes[0].node[1]);
  EXPECT_THROW(System{model}, InputError);
  EXPECT_THROW(make_elastic(1, 0.5), InputError);
  EXPECT_THROW(make_j2({}), InputError);
}

}  // namespace
}  // namespace topple::fem
