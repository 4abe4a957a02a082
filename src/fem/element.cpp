#include "fem/element.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace topple::fem {

namespace {

using Eigen::Matrix3d;
using Matrix38 = Eigen::Matrix<double, 3, 8>;
using Matrix83 = Eigen::Matrix<double, 8, 3>;
using Strains = Eigen::Matrix<double, 6, 24>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Modes = Eigen::Matrix<double, 6, 21>;

constexpr double sign_xi[8] = {-1, 1, 1, -1, -1, 1, 1, -1};
constexpr double sign_eta[8] = {-1, -1, 1, 1, -1, -1, 1, 1};
constexpr double sign_zeta[8] = {-1, -1, -1, -1, 1, 1, 1, 1};

Matrix83 calc_derivatives(double xi, double eta, double zeta) {
  Matrix83 d;
  for (int i = 0; i < 8; ++i) {
    const double a = 1 + sign_xi[i] * xi, b = 1 + sign_eta[i] * eta, c = 1 + sign_zeta[i] * zeta;
    d(i, 0) = 0.125 * sign_xi[i] * b * c;
    d(i, 1) = 0.125 * sign_eta[i] * a * c;
    d(i, 2) = 0.125 * sign_zeta[i] * a * b;
  }
  return d;
}

Matrix38 to_matrix(const std::array<Vec3, 8>& nodes) {
  Matrix38 x;
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < 3; ++k) x(k, i) = nodes[static_cast<size_t>(i)][k];
  return x;
}

/// Strains in natural components (covariant, engineering shear) to strains in W: ε_W = A E Aᵀ with A = J0^-T.
Matrix6d make_strain_map(const Matrix3d& A) {
  constexpr int a[6] = {0, 1, 2, 0, 1, 2}, b[6] = {0, 1, 2, 1, 2, 0};
  Matrix6d T;
  for (int I = 0; I < 6; ++I)
    for (int J = 0; J < 6; ++J) {
      const double s =
          J < 3 ? A(a[I], a[J]) * A(b[I], a[J]) : 0.5 * (A(a[I], a[J]) * A(b[I], b[J]) + A(a[I], b[J]) * A(b[I], a[J]));
      T(I, J) = I < 3 ? s : 2 * s;
    }
  return T;
}

/// Strains that displacements lack, in natural components, (3): all normal ones linear in their own direction and
/// bilinear, all shear ones linear in their plane and bilinear with the third direction.
Modes make_modes(double xi, double eta, double zeta) {
  Modes M = Modes::Zero();
  int m = 0;
  const double own[3] = {xi, eta, zeta};
  for (int k = 0; k < 3; ++k) {
    const double a = own[k], b = own[(k + 1) % 3], c = own[(k + 2) % 3];
    for (const double v : {a, a * b, a * c}) M(k, m++) = v;
    for (const double v : {a, b, a * c, b * c}) M(3 + k, m++) = v;
  }
  return M;
}

}  // namespace

Vec3 find_natural_point(int point) {
  const double a = 1 / std::sqrt(3.0);
  return {point & 1 ? a : -a, point & 2 ? a : -a, point & 4 ? a : -a};
}

std::array<double, 8> calc_shape_functions(const Vec3& n) {
  std::array<double, 8> out;
  for (size_t i = 0; i < 8; ++i)
    out[i] = 0.125 * (1 + sign_xi[i] * n.x) * (1 + sign_eta[i] * n.y) * (1 + sign_zeta[i] * n.z);
  return out;
}

double calc_smallest_jacobian(const std::array<Vec3, 8>& nodes) {
  const Matrix38 x = to_matrix(nodes);
  double smallest = 0, largest = 0;
  for (int p = 0; p < kPoints; ++p) {
    const Vec3 n = find_natural_point(p);
    const double J = (x * calc_derivatives(n.x, n.y, n.z)).determinant();
    smallest = p == 0 ? J : std::min(smallest, J);
    largest = std::max(largest, std::abs(J));
  }
  return largest > 0 ? smallest / largest : 0;
}

HexShape make_hex_shape(const std::array<Vec3, 8>& nodes, double lateral) {
  const Matrix38 x = to_matrix(nodes);
  const Matrix3d J0 = x * calc_derivatives(0, 0, 0);
  const Matrix6d T0 = make_strain_map(J0.inverse().transpose());
  const double j0 = J0.determinant();
  // Elasticity that shares out the assumed strains; its modulus does not matter, ν = 0.5 is approached, (4).
  const double nu = std::min(lateral, 0.49999);
  Matrix6d C = Matrix6d::Zero();
  C.topLeftCorner<3, 3>().setConstant(nu / (1 - 2 * nu));
  for (int i = 0; i < 3; ++i) C(i, i) += 1, C(i + 3, i + 3) = 0.5;

  HexShape out;
  std::array<Strains, kPoints> B;
  std::array<Modes, kPoints> G;
  Eigen::Matrix<double, 21, 21> H = Eigen::Matrix<double, 21, 21>::Zero();
  Eigen::Matrix<double, 21, 24> Q = Eigen::Matrix<double, 21, 24>::Zero();
  for (size_t p = 0; p < kPoints; ++p) {
    const Vec3 n = find_natural_point(static_cast<int>(p));
    const Matrix83 d = calc_derivatives(n.x, n.y, n.z);
    const Matrix3d J = x * d;
    const double w = J.determinant();
    const Matrix83 g = d * J.inverse();
    B[p].setZero();
    for (int i = 0; i < 8; ++i) {
      constexpr int a[3] = {0, 1, 2}, b[3] = {1, 2, 0};
      for (int k = 0; k < 3; ++k) {
        B[p](k, 3 * i + k) = g(i, k);
        B[p](3 + k, 3 * i + a[k]) = g(i, b[k]);
        B[p](3 + k, 3 * i + b[k]) = g(i, a[k]);
      }
    }
    G[p] = j0 / w * T0 * make_modes(n.x, n.y, n.z);
    H += w * G[p].transpose() * C * G[p];
    Q += w * G[p].transpose() * C * B[p];
    out.volume[p] = w;
  }
  const Eigen::Matrix<double, 21, 24> share = H.ldlt().solve(Q);
  for (size_t p = 0; p < kPoints; ++p) Eigen::Map<Strains>(out.B[p].data()) = B[p] - G[p] * share;
  return out;
}

}  // namespace topple::fem
