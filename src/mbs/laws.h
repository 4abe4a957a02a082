#pragma once
/// Laws of zones as a model has them. Models share them: a copy of one costs nothing for its laws, and each law is
/// checked and compiled once.

#include <iterator>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace topple::mbs {

struct CompiledLaw;

inline constexpr double kUnlimited = std::numeric_limits<double>::infinity();

/// Magnitude of a force against a displacement that only grows; linear between points, constant after the last.
struct Curve {
  std::vector<double> x;  // rising from 0
  std::vector<double> f;  // >= 0
};

/// Limit moments of one axis against plastic rotation, one row for each normal force (tension positive).
/// K forces, J rotations; outside the range of forces the limit is 0.
struct MomentFamily {
  std::vector<double> normal_force;      // rising [N] (K)
  std::vector<double> plastic_rotation;  // rising from 0 [rad] (J)
  std::vector<double> positive;          // limit for moments > 0 [N·m] (K x J)
  std::vector<double> negative;          // magnitude of the limit for moments < 0 [N·m] (K x J)
  // plastic elongation along the axis that comes with plastic rotation > 0 and < 0; both or none [m] (K x J)
  std::vector<double> elongation_positive, elongation_negative;
};

/// Limits of what a zone can transmit: an rcc in the form of the multibody system (docs/theory/zones.md).
/// Axes: x along the member from a to b, y and z across. An empty curve or family means unlimited (elastic).
struct ZoneLaw {
  std::string name;
  MomentFamily moment_y, moment_z;
  double biaxial_exponent = 1.5;         // (|My|/Ly)^p + (|Mz|/Lz)^p <= 1
  double rotation_ratio = 1;             // what of the edges a rotation about z strains over one about y
  double damage_share = 0;               // share of the inelastic rotation that is recovered on unloading, 0..1
  double rupture_rotation = kUnlimited;  // plastic rotation at which the element breaks altogether [rad]
  double rupture_rotation_pressed = 0;   // the same while its normal force presses, if that is more [rad]
  Curve compression;                     // limit against plastic shortening [m] -> [N]
  Curve tension;                         // limit against plastic elongation [m] -> [N]
  bool buckles = false;                  // shortened, it pulls only once it is straight again: slender bars
  double crush_length = kUnlimited;      // plastic shortening at which the element breaks [m]
  bool keeps_length = false;  // breaks there also where the element's crush_through is more: a weak length of a member
  double rupture_elongation = kUnlimited;             // plastic elongation at which it breaks [m]
  double shear_y = kUnlimited, shear_z = kUnlimited;  // limits without normal force [N]
  double shear_friction = 0;                          // further limit per newton of compression
  double slip_softening = kUnlimited;  // slip over which the shear limits fall to their friction part [m]
  double slip_rupture = kUnlimited;    // slip at which the element breaks [m]
  double torsion = kUnlimited;         // [N·m]
  double twist_rupture = kUnlimited;   // [rad]
};

/// A law that does not change any more. Threads may use copies of it at the same time.
class SharedLaw {
 public:
  SharedLaw(ZoneLaw law = {});  // NOLINT(google-explicit-constructor): a law is one that may be shared
  const ZoneLaw& operator*() const;
  const ZoneLaw* operator->() const { return &**this; }
  /// Made when it is first asked for.
  std::shared_ptr<const CompiledLaw> compile() const;
  /// Whether somebody has found that nothing is wrong with it.
  bool is_checked() const;
  void note_checked() const;
  /// The same for all copies, and no other's while one of them lives.
  const void* identity() const { return made_.get(); }

 private:
  struct Made;
  std::shared_ptr<Made> made_;
};

/// Laws by number.
class Laws {
 public:
  class Iterator {
   public:
    using iterator_category = std::forward_iterator_tag;  // NOLINT(readability-identifier-naming)
    using value_type = ZoneLaw;                           // NOLINT(readability-identifier-naming)
    using difference_type = std::ptrdiff_t;               // NOLINT(readability-identifier-naming)
    using pointer = const ZoneLaw*;                       // NOLINT(readability-identifier-naming)
    using reference = const ZoneLaw&;                     // NOLINT(readability-identifier-naming)
    Iterator() = default;
    explicit Iterator(const SharedLaw* at) : at_(at) {}
    reference operator*() const { return **at_; }
    pointer operator->() const { return &**at_; }
    Iterator& operator++() { return ++at_, *this; }
    Iterator operator++(int) { return Iterator(at_++); }
    friend bool operator==(const Iterator&, const Iterator&) = default;

   private:
    const SharedLaw* at_ = nullptr;
  };
  size_t size() const { return laws_.size(); }
  bool empty() const { return laws_.empty(); }
  const ZoneLaw& operator[](size_t i) const { return *laws_[i]; }
  const SharedLaw& shared(size_t i) const { return laws_[i]; }
  Iterator begin() const { return Iterator(laws_.data()); }
  Iterator end() const { return Iterator(laws_.data() + laws_.size()); }
  void push_back(SharedLaw law) { laws_.push_back(std::move(law)); }
  void set(size_t i, SharedLaw law) { laws_[i] = std::move(law); }
  /// Another law in the place of one: change(ZoneLaw&) is given a copy.
  template <class F>
  void edit(size_t i, F&& change) {
    ZoneLaw law = *laws_[i];
    change(law);
    set(i, std::move(law));
  }

 private:
  std::vector<SharedLaw> laws_;
};

}  // namespace topple::mbs
