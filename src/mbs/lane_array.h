#pragma once
/// Arrays of vectors, quaternions and matrices in blocks of W lanes, as the kernel reads them: component c of item i is
/// at
/// ((i >> shift) * D + c) * W + lane, where the lane is i modulo W in a run of its own (neighbouring items side by
/// side) and that of the sample in a batch (shift 0: the same item of all samples side by side).

#include <cstddef>
#include <type_traits>

#include "base/aligned.h"
#include "base/linalg.h"

namespace topple::mbs {

/// Layout of T as D doubles in a row.
template <class T>
struct Components;
template <>
struct Components<Vec3> {
  static constexpr size_t D = 3;
};
template <>
struct Components<Quat> {
  static constexpr size_t D = 4;
};
template <>
struct Components<Mat3> {
  static constexpr size_t D = 9;
};

/// Where the items of an array lie.
struct LaneLayout {
  size_t W = 1;      // lanes of a block, a power of two
  size_t shift = 0;  // log2 of the items in a block
  size_t lane = 0;   // of the sample
  size_t blocks(size_t items) const { return (items + (size_t{1} << shift) - 1) >> shift; }
  /// Place of component c of item i.
  size_t at(size_t i, size_t c, size_t D) const {
    return ((i >> shift) * D + c) * W + (i & ((size_t{1} << shift) - 1)) + lane;
  }
};

template <class T>
class LaneArray {
 public:
  static constexpr size_t D = Components<T>::D;
  static_assert(sizeof(T) == D * sizeof(double) && std::is_trivially_copyable_v<T>);

  /// Stands for an item: reads as T, writes through.
  class Item {
   public:
    Item(double* at, size_t W) : at_(at), W_(W) {}
    Item(const Item&) = default;
    operator T() const { return load(at_, W_); }
    const Item& operator=(const T& x) const {
      double c[D];
      __builtin_memcpy(c, &x, sizeof x);
      for (size_t i = 0; i < D; ++i) at_[i * W_] = c[i];
      return *this;
    }
    // through a copy, so that x may be *this
    const Item& operator=(const Item& x) const {  // NOLINT(bugprone-unhandled-self-assignment)
      return *this = T(x);
    }
    const Item& operator+=(const T& x) const { return *this = T(*this) + x; }
    const Item& operator-=(const T& x) const { return *this = T(*this) - x; }

   private:
    double* at_;
    size_t W_;
  };

  LaneArray() = default;
  LaneArray(const LaneArray& other) { *this = other; }
  LaneArray(LaneArray&& other) noexcept { *this = other; }
  /// Takes the values; they stay where they are if the size is right, and get a plain layout otherwise.
  LaneArray& operator=(const LaneArray& other) {
    if (this == &other) return *this;
    resize(other.size_);
    for (size_t i = 0; i < size_; ++i) (*this)[i] = other[i];
    return *this;
  }
  LaneArray& operator=(LaneArray&& other) noexcept { return *this = other; }
  ~LaneArray() = default;

  /// N items of its own.
  void assign(size_t n, const T& x, const LaneLayout& layout = {}) {
    layout_ = layout;
    size_ = n;
    own_.assign(layout.blocks(n) * D * layout.W, 0);
    data_ = own_.data();
    fill(x);
  }
  void resize(size_t n) {
    if (n != size_) assign(n, T{});
  }
  /// Moves to a store of others.
  void attach(double* store, const LaneLayout& layout) {
    const LaneArray before(*this);
    own_ = {};
    data_ = store;
    layout_ = layout;
    for (size_t i = 0; i < size_; ++i) (*this)[i] = before[i];
  }
  void fill(const T& x) {
    for (size_t i = 0; i < size_; ++i) (*this)[i] = x;
  }

  T operator[](size_t i) const { return load(data_ + layout_.at(i, 0, D), layout_.W); }
  Item operator[](size_t i) { return {data_ + layout_.at(i, 0, D), layout_.W}; }
  size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }

 private:
  static T load(const double* at, size_t W) {
    double c[D];
    for (size_t i = 0; i < D; ++i) c[i] = at[i * W];
    T x;
    __builtin_memcpy(&x, c, sizeof x);
    return x;
  }
  AlignedVector<double> own_;
  double* data_ = nullptr;
  size_t size_ = 0;
  LaneLayout layout_;
};

}  // namespace topple::mbs
