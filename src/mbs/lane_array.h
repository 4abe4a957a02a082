#pragma once
/// Arrays of vectors, quaternions and matrices whose components can lie side by side with those of other samples:
/// component c of item i of lane l is data[(i * D + c) * lanes + l]. With one lane they are plain arrays.

#include <array>
#include <cstddef>
#include <type_traits>
#include <vector>

#include "base/linalg.h"

namespace topple::mbs {

/// Layout of T as D doubles in a row.
template <class T>
struct Components;
template <>
struct Components<double> {
  static constexpr size_t D = 1;
};
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

template <class T>
class LaneArray {
 public:
  static constexpr size_t D = Components<T>::D;
  static_assert(sizeof(T) == D * sizeof(double) && std::is_trivially_copyable_v<T>);

  /// Stands for an item: reads as T, writes through.
  class Item {
   public:
    Item(double* at, size_t lanes) : at_(at), lanes_(lanes) {}
    Item(const Item&) = default;
    operator T() const { return load(at_, lanes_); }
    const Item& operator=(const T& x) const {
      const double* from = reinterpret_cast<const double*>(&x);
      for (size_t c = 0; c < D; ++c) at_[c * lanes_] = from[c];
      return *this;
    }
    const Item& operator=(const Item& x) const { return *this = T(x); }
    const Item& operator+=(const T& x) const { return *this = T(*this) + x; }
    const Item& operator-=(const T& x) const { return *this = T(*this) - x; }

   private:
    double* at_;
    size_t lanes_;
  };

  LaneArray() = default;
  LaneArray(const LaneArray& other) { *this = other; }
  LaneArray(LaneArray&& other) noexcept { *this = std::move(other); }
  /// Takes the values, not the place: a copy has one lane.
  LaneArray& operator=(const LaneArray& other) {
    if (this == &other) return *this;
    std::vector<double> values(other.size_ * D);
    for (size_t i = 0; i < other.size_ * D; ++i) values[i] = other.data_[i * other.lanes_];
    own(std::move(values), other.size_);
    return *this;
  }
  LaneArray& operator=(LaneArray&& other) noexcept {
    if (this == &other) return *this;
    const bool owns = other.data_ == other.own_.data();
    own_ = std::move(other.own_);
    data_ = owns ? own_.data() : other.data_;
    size_ = other.size_, lanes_ = other.lanes_;
    other.size_ = 0, other.data_ = nullptr;
    return *this;
  }
  ~LaneArray() = default;

  /// N items of its own.
  void assign(size_t n, const T& x) {
    std::vector<double> values(n * D);
    own(std::move(values), n);
    fill(x);
  }
  void resize(size_t n) {
    if (n != size_) assign(n, T{});
  }
  /// One lane of a store of others; what was here is copied there.
  void attach(double* first, size_t lanes) {
    for (size_t i = 0; i < size_ * D; ++i) first[i * lanes] = data_[i * lanes_];
    data_ = first, lanes_ = lanes;
    own_ = {};
  }
  void fill(const T& x) {
    for (size_t i = 0; i < size_; ++i) (*this)[i] = x;
  }

  T operator[](size_t i) const { return load(data_ + i * D * lanes_, lanes_); }
  Item operator[](size_t i) { return {data_ + i * D * lanes_, lanes_}; }
  size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  size_t lanes() const { return lanes_; }
  double* data() { return data_; }
  const double* data() const { return data_; }

 private:
  static T load(const double* at, size_t lanes) {
    std::array<double, D> c;
    for (size_t i = 0; i < D; ++i) c[i] = at[i * lanes];
    T x;
    __builtin_memcpy(&x, c.data(), sizeof x);
    return x;
  }
  void own(std::vector<double>&& values, size_t n) {
    own_ = std::move(values);
    data_ = own_.data();
    size_ = n, lanes_ = 1;
  }
  std::vector<double> own_;
  double* data_ = nullptr;
  size_t size_ = 0, lanes_ = 1;
};

}  // namespace topple::mbs
