#pragma once
/// Fuzzy numbers as nests of alpha-cuts (docs/theory/uncertainty.md, section 1).

#include <string>
#include <utility>
#include <vector>

namespace topple::uncertainty {

/// The values that are possible to at least the degree alpha: [left, right].
struct AlphaCut {
  double alpha = 0;
  double left = 0, right = 0;
  friend bool operator==(const AlphaCut&, const AlphaCut&) = default;
};

/// A convex, normalised membership function μ(x). Between its cuts both branches are straight.
class FuzzyNumber {
 public:
  /// The crisp number 0.
  FuzzyNumber() : FuzzyNumber(0.0) {}
  /// A crisp number.
  explicit FuzzyNumber(double value) : cuts_{{0, value, value}, {1, value, value}} {}
  /// From cuts with alpha rising from 0 to 1, each inside the one before; two of one alpha make a step of μ.
  /// Throws InputError E801: fewer than two cuts, numbers that are not finite, alpha not from 0 to 1 or falling, left
  /// above right, cuts that are not nested.
  explicit FuzzyNumber(std::vector<AlphaCut> cuts);

  const std::vector<AlphaCut>& cuts() const { return cuts_; }
  AlphaCut support() const { return cuts_.front(); }
  AlphaCut core() const { return cuts_.back(); }
  /// Middle of the core.
  double centre() const { return 0.5 * (cuts_.back().left + cuts_.back().right); }
  double width() const { return cuts_.front().right - cuts_.front().left; }
  /// The cut at alpha in [0, 1]; at a step of μ the wider one. Throws InputError E802 for any other alpha.
  AlphaCut cut(double alpha) const;
  /// μ(x), 0 outside the support; at a step of μ the upper value.
  double membership(double x) const;

 private:
  std::vector<AlphaCut> cuts_;
};

/// ⟨left, core, right⟩. Throws InputError E801 unless left <= core <= right.
FuzzyNumber make_triangular(double left, double core, double right);
/// ⟨left, core from, core to, right⟩. Throws InputError E801 unless they rise.
FuzzyNumber make_trapezoidal(double left, double core_left, double core_right, double right);
/// From the corners (x, μ) of the membership function, x rising, μ from 0 up to 1 and down to 0; upright edges (equal
/// x) and level ones are allowed. Throws InputError E801: fewer than three corners, x that falls, μ outside [0, 1], not
/// starting or ending at 0, not reaching 1, rising after it has fallen.
FuzzyNumber make_polygonal(const std::vector<std::pair<double, double>>& corners);

}  // namespace topple::uncertainty
