#pragma once
/// Stress and stiffness of a solid at one point, as the elements ask for it; elasticity and J2 plasticity.
/// Voigt xx yy zz xy yz zx, engineering shear; positive in tension.

#include <array>
#include <cstring>
#include <memory>
#include <type_traits>

namespace topple::fem {

using Voigt = std::array<double, 6>;
using Matrix6 = std::array<double, 36>;  // row by row; symmetric where it is a secant

struct PointResponse {
  Voigt stress{};     // [Pa]
  Matrix6 tangent{};  // dσ/dε of the algorithm, not always symmetric or positive [Pa]
  Matrix6 secant{};   // symmetric, positive [Pa]
  bool converged = true;
};

/// A law is constant; its history lives in `size` doubles for each point, zero at the start unless begin() says more.
class SolidLaw {
 public:
  virtual ~SolidLaw() = default;
  /// Numbers of history at one point.
  virtual int size() const = 0;
  virtual void begin(double* state) const { std::memset(state, 0, sizeof(double) * static_cast<size_t>(size())); }
  /// From the last accepted history and the total strain to the response and the new history; no other effect.
  ///   step_ratio  this step over the last one, for laws that extrapolate their history (IMPL-EX); such a law leaves
  ///   the
  ///               new history to finish()
  virtual PointResponse advance(const double* old, const Voigt& strain, double step_ratio, double* now) const = 0;
  /// Whether advance() extrapolates.
  virtual bool extrapolates() const { return false; }
  /// The new history of an extrapolating law at an accepted strain, and the stress that goes with it. False: none
  /// found.
  virtual bool finish(const double* /*old*/, const Voigt& /*strain*/, double* /*now*/, Voigt& /*stress*/) const {
    return true;
  }
  /// Poisson number of assumed strains, see make_hex_shape.
  virtual double lateral() const = 0;
};

/// Fits a law written as  advance(params, old, strain, now)  with a trivially copyable history.
template <class State, class Advance>
class WrappedLaw final : public SolidLaw {
 public:
  WrappedLaw(Advance advance, State start, double lateral) : advance_(advance), start_(start), lateral_(lateral) {
    static_assert(std::is_trivially_copyable_v<State>);
  }
  int size() const override { return static_cast<int>((sizeof(State) + sizeof(double) - 1) / sizeof(double)); }
  void begin(double* state) const override { std::memcpy(state, &start_, sizeof(State)); }
  PointResponse advance(const double* old, const Voigt& strain, double /*step_ratio*/, double* now) const override {
    State before, after;
    std::memcpy(static_cast<void*>(&before), old, sizeof(State));
    after = before;
    const PointResponse response = advance_(before, strain, after);
    std::memcpy(now, &after, sizeof(State));
    return response;
  }
  double lateral() const override { return lateral_; }

 private:
  Advance advance_;
  State start_;
  double lateral_;
};
template <class State, class Advance>
std::shared_ptr<const SolidLaw> wrap_law(Advance advance, State start, double lateral) {
  return std::make_shared<WrappedLaw<State, Advance>>(advance, start, lateral);
}

/// Throws InputError: E <= 0 or ν outside of (-1, 0.5).
std::shared_ptr<const SolidLaw> make_elastic(double E, double nu);

/// Von Mises with linear isotropic hardening, return map of Simo & Hughes (1998), box 3.2. The history is the plastic
/// strain (6) and the equivalent plastic strain.
struct J2Input {
  double E = 0, nu = 0;  // [Pa], [-]
  double yield = 0;      // [Pa]
  double hardening = 0;  // dσ_y / d equivalent plastic strain [Pa]
  double lateral = 0.5;  // see make_hex_shape: plastic flow keeps the volume
};
/// Throws InputError: values out of range.
std::shared_ptr<const SolidLaw> make_j2(const J2Input&);

Matrix6 make_elastic_matrix(double E, double nu);

}  // namespace topple::fem
