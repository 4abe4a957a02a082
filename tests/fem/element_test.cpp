#include "fem/element.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "fem/solve.h"

namespace topple::fem {
namespace {

Solver solve(const System& system, const Loading& loading) {
  Solver solver(system);
  const StepSummary s = solver.step(loading, {});
  EXPECT_TRUE(s.converged) << s.residual;
  return solver;
}

const std::array<Vec3, 8> odd{
    {{0, 0, 0}, {1.1, 0.1, -0.1}, {1, 0.9, 0.1}, {-0.1, 1.2, 0}, {0.1, 0, 1}, {1, 0, 1.2}, {1.2, 1.1, 0.9}, {0, 1, 1}}};

Eigen::Matrix<double, 24, 24> make_stiffness(const std::array<Vec3, 8>& nodes, double nu, double lateral) {
  const HexShape shape = make_hex_shape(nodes, lateral);
  const Matrix6 C = make_elastic_matrix(1, nu);
  const Eigen::Map<const Eigen::Matrix<double, 6, 6>> elastic(C.data());
  Eigen::Matrix<double, 24, 24> K = Eigen::Matrix<double, 24, 24>::Zero();
  for (size_t p = 0; p < kPoints; ++p) {
    const Eigen::Map<const Eigen::Matrix<double, 6, 24>> B(shape.B[p].data());
    K += shape.volume[p] * B.transpose() * elastic * B;
  }
  return K;
}

TEST(Hex, HasSixRigidModesAndNoOtherWithoutEnergy) {
  for (const double lateral : {0.0, 0.25, 0.5}) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 24, 24>> modes(make_stiffness(odd, 0.25, lateral));
    // round-off of a matrix of entries near 1
    EXPECT_LT(std::abs(modes.eigenvalues()(5)), 1e-13) << lateral;
    EXPECT_GT(modes.eigenvalues()(6), 1e-3) << lateral;
  }
}

TEST(Hex, DoesNotDependOnTheFrame) {
  const Quat q = normalized({0.8, 0.3, -0.2, 0.4});
  const Mat3 R = to_matrix(q);
  std::array<Vec3, 8> turned;
  for (size_t i = 0; i < 8; ++i) turned[i] = R * odd[i];
  const auto a = Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 24, 24>>(make_stiffness(odd, 0.3, 0.3)),
             b = Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 24, 24>>(make_stiffness(turned, 0.3, 0.3));
  EXPECT_LT((a.eigenvalues() - b.eigenvalues()).cwiseAbs().maxCoeff(), 1e-13);
}

// MacNeal & Harder (1985), patch of seven hexahedra: any linear field gives constant stresses.
Mesh make_patch() {
  Mesh m;
  for (int i = 0; i < 8; ++i) m.nodes.push_back({i & 1 ? 1.0 : 0.0, i & 2 ? 1.0 : 0.0, i & 4 ? 1.0 : 0.0});
  const double inner[8][3] = {{.249, .342, .192}, {.826, .288, .288}, {.850, .649, .263}, {.273, .750, .230},
                              {.320, .186, .643}, {.677, .305, .683}, {.788, .693, .644}, {.165, .745, .702}};
  for (const auto& n : inner) m.nodes.push_back({n[0], n[1], n[2]});
  const int o[8] = {0, 1, 3, 2, 4, 5, 7, 6};  // outer nodes in the order of a hexahedron
  const auto in = [](int i) { return 8 + i; };
  m.hexes.push_back({{in(0), in(1), in(2), in(3), in(4), in(5), in(6), in(7)}, 0});
  const int face[6][4] = {{0, 1, 2, 3}, {4, 7, 6, 5}, {0, 4, 5, 1}, {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 4, 0}};
  for (const auto& f : face)
    m.hexes.push_back({{o[f[0]], o[f[1]], o[f[2]], o[f[3]], in(f[0]), in(f[1]), in(f[2]), in(f[3])}, 0});
  return m;
}

TEST(HexReference, PassesThePatchTestOfMacNealAndHarder) {
  for (const double lateral : {0.0, 0.25, 0.5}) {
    const Matrix6 C = make_elastic_matrix(1e6, 0.25);
    struct None {};
    Model model;
    model.mesh = make_patch();
    model.solids.push_back(wrap_law(
        [C](const None&, const Voigt& e, None&) {
          PointResponse r;
          for (size_t i = 0; i < 6; ++i)
            for (size_t j = 0; j < 6; ++j) r.stress[i] += C[6 * i + j] * e[j];
          r.tangent = r.secant = C;
          return r;
        },
        None{}, lateral));
    const auto field = [](const Vec3& n, int k) {
      const double sum = n.x + n.y + n.z;
      return 0.5e-3 * (sum + n[k]);
    };
    // control k moves the outer nodes by the field's part k
    for (int k = 0; k < 3; ++k) model.control_length.push_back(1);
    for (int i = 0; i < 8; ++i)
      for (int k = 0; k < 3; ++k)
        model.links[3 * i + k] = {{k, 1e3 * field(model.mesh.nodes[static_cast<size_t>(i)], k)}};
    const System system(model);
    const Solver s = solve(system, {{{true, 1e-3}, {true, 1e-3}, {true, 1e-3}}, 0});
    const std::vector<Vec3> u = system.calc_displacements(s.state().q);
    for (size_t i = 8; i < 16; ++i)
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(u[i][k], field(model.mesh.nodes[i], k), 1e-15);
    for (const auto& element : s.response().stress)
      for (const Voigt& stress : element)
        for (size_t k = 0; k < 6; ++k)
          EXPECT_NEAR(stress[k], k < 3 ? 2000 : 400, 1e-7);  // round-off; ν near 0.5 costs four digits
  }
}

TEST(Hex, FeelsNothingOfAnInfinitesimalRotation) {
  const HexShape shape = make_hex_shape(odd, 0.3);
  const Vec3 turn{0.3, -0.7, 0.4};
  Eigen::Matrix<double, 24, 1> u;
  for (int i = 0; i < 8; ++i) {
    const Vec3 v = cross(turn, odd[static_cast<size_t>(i)]) + Vec3{1, 2, 3};
    for (int k = 0; k < 3; ++k) u(3 * i + k) = v[k];
  }
  for (const auto& B : shape.B) EXPECT_LT((Eigen::Map<const Eigen::Matrix<double, 6, 24>>(B.data()) * u).norm(), 1e-14);
}

// MacNeal & Harder (1985), slender beam 6 x 0.2 x 0.1 of six elements; tip loads of 1. Published answers 3e-5
// (extension), 0.1081 (bending in the plane of 0.2), 0.4321 (out of plane), 0.03208 (twist, beam of 0.1 x 0.2).
enum class Shape { Regular, Trapezoid, Parallelogram };
struct BeamResult {
  double extension, in_plane, out_of_plane, twist;
};
BeamResult run_beam(Shape shape, int along) {
  const double L = 6, h = 0.2, t = 0.1;
  std::vector<double> x;
  for (int i = 0; i <= along; ++i) x.push_back(L * i / along);
  Model model;
  model.mesh = make_grid(x, {0, h}, {0, t});
  // slanted by 45 degrees in the plane
  const int n = along + 1;
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 2; ++j)
      for (int i = 1; i < along; ++i) {
        double shift = 0;
        if (shape == Shape::Parallelogram) shift = j == 0 ? -0.5 * h : 0.5 * h;
        if (shape == Shape::Trapezoid) shift = (i % 2 == 1) == (j == 0) ? -0.5 * h : 0.5 * h;
        model.mesh.nodes[static_cast<size_t>(i + n * (j + 2 * k))].x += shift;
      }
  model.solids.push_back(make_elastic(1e7, 0.3));
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 2; ++j)
      for (int c = 0; c < 3; ++c) model.links[3 * (n * (j + 2 * k)) + c] = {};
  const auto run = [&](const auto& load, const auto& read) {
    Model loaded = model;
    loaded.load.assign(3 * loaded.mesh.nodes.size(), 0);
    for (int k = 0; k < 2; ++k)
      for (int j = 0; j < 2; ++j) load(loaded.load, 3 * (along + n * (j + 2 * k)), j, k);
    const System system(loaded);
    const Solver s = solve(system, {{}, 1});
    const std::vector<Vec3> u = system.calc_displacements(s.state().q);
    double sum = 0;
    for (int k = 0; k < 2; ++k)
      for (int j = 0; j < 2; ++j) sum += 0.25 * read(u[static_cast<size_t>(along + n * (j + 2 * k))], j, k);
    return sum;
  };
  const auto uniform = [&](int c) {
    return run([c](std::vector<double>& f, int d, int, int) { f[static_cast<size_t>(d + c)] = 0.25; },
               [c](const Vec3& u, int, int) { return u[c]; });
  };
  // a unit torque as two couples, shared so that the end does not change its shape
  const double share = 1 / (h * h + t * t);
  const double twist = run(
      [&](std::vector<double>& f, int d, int j, int k) {
        f[static_cast<size_t>(d + 1)] = (k == 0 ? 1 : -1) * 0.5 * t * share;
        f[static_cast<size_t>(d + 2)] = (j == 0 ? -1 : 1) * 0.5 * h * share;
      },
      [&](const Vec3& u, int j, int k) {
        return 0.5 * ((k == 0 ? 1 : -1) * u.y / (0.5 * t) + (j == 0 ? -1 : 1) * u.z / (0.5 * h));
      });
  return {uniform(0), uniform(1), uniform(2), twist};
}

TEST(HexReference, SlenderBeamOfMacNealAndHarder) {
  // Bricks: all four within 10 % with one element over the section, where a plain brick gives 0.1 of the bending.
  const BeamResult regular = run_beam(Shape::Regular, 6);
  EXPECT_NEAR(regular.extension, 3e-5, 0.02 * 3e-5);  // the clamp holds the sides of the first element
  EXPECT_NEAR(regular.in_plane, 0.1081, 0.02 * 0.1081);
  EXPECT_NEAR(regular.out_of_plane, 0.4321, 0.02 * 0.4321);
  EXPECT_NEAR(regular.twist, 0.03208, 0.10 * 0.03208);
  // Slanted: an element that passes the patch test cannot bend as a trapezoid (MacNeal 1987); as a parallelogram it
  // can.
  const BeamResult six = run_beam(Shape::Parallelogram, 6), many = run_beam(Shape::Parallelogram, 24);
  EXPECT_GT(six.in_plane / 0.1081, 0.6);
  EXPECT_GT(six.out_of_plane / 0.4321, 0.55);
  EXPECT_NEAR(many.in_plane / 0.1081, 1, 0.05);
  EXPECT_NEAR(many.out_of_plane / 0.4321, 1, 0.07);
  double last = 0;
  for (const int along : {6, 12, 24}) {
    const BeamResult r = run_beam(Shape::Trapezoid, along);
    EXPECT_NEAR(r.extension / 3e-5, 1, 0.02);
    EXPECT_GT(r.in_plane, 1.8 * last);
    EXPECT_LT(r.in_plane, 0.1081);
    last = r.in_plane;
  }
}

}  // namespace
}  // namespace topple::fem
