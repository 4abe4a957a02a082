#pragma once
/// Values as bytes, for this program on this machine: whole numbers, numbers and structs as they lie in memory, lists
/// with their length in front. The same calls, in the same order, write and read.

#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/error.h"

namespace topple {

/// Bytes: a string, or a vector of bytes.
template <class Bytes>
class BasicArchiveWriter {
 public:
  template <class T>
  void operator()(const T& x) {
    static_assert(std::is_trivially_copyable_v<T>);
    append(&x, sizeof x);
  }
  template <class T, class A>
  void operator()(const std::vector<T, A>& x) {
    (*this)(x.size());
    if constexpr (std::is_trivially_copyable_v<T>) {
      append(x.data(), x.size() * sizeof(T));
    } else {
      for (const T& item : x) (*this)(item);
    }
  }
  void operator()(const std::vector<bool>& x) {
    (*this)(x.size());
    for (const bool b : x) (*this)(b);
  }
  void operator()(const std::string& x) {
    (*this)(x.size());
    append(x.data(), x.size());
  }
  template <class A, class B>
  void operator()(const std::pair<A, B>& x) {
    (*this)(x.first), (*this)(x.second);
  }
  Bytes bytes;

 private:
  void append(const void* from, size_t size) {
    const auto* begin = static_cast<const typename Bytes::value_type*>(from);
    if (size > 0) bytes.insert(bytes.end(), begin, begin + size);
  }
};
using ArchiveWriter = BasicArchiveWriter<std::string>;

class ArchiveReader {
 public:
  /// The bytes must outlive it. Where they end too early it throws InputError with this code.
  ///   what, hint  the file, or what they are not then; and what to do without them
  ArchiveReader(std::span<const std::byte> bytes, std::string code, std::string what, std::string hint = {})
      : bytes_(bytes), code_(std::move(code)), what_(std::move(what)), hint_(std::move(hint)) {}
  template <class T>
  void operator()(T& x) {
    static_assert(std::is_trivially_copyable_v<T>);
    take(&x, sizeof x);
  }
  template <class T, class A>
  void operator()(std::vector<T, A>& x) {
    if constexpr (std::is_trivially_copyable_v<T>) {
      x.resize(take_count(sizeof(T)));
      take(x.data(), x.size() * sizeof(T));
    } else {
      x.clear();
      x.resize(take_count(1));
      for (T& item : x) (*this)(item);
    }
  }
  void operator()(std::vector<bool>& x) {
    x.resize(take_count(1));
    for (size_t i = 0; i < x.size(); ++i) {
      bool b = false;
      (*this)(b);
      x[i] = b;
    }
  }
  void operator()(std::string& x) {
    x.resize(take_count(1));
    take(x.data(), x.size());
  }
  template <class A, class B>
  void operator()(std::pair<A, B>& x) {
    (*this)(x.first), (*this)(x.second);
  }
  bool is_done() const { return at_ == bytes_.size(); }
  [[noreturn]] void refuse(const std::string& why) const { throw InputError(code_, what_ + ": " + why, hint_); }

 protected:
  /// Length of a list of items of so many bytes at least.
  size_t take_count(size_t size) {
    size_t count = 0;
    (*this)(count);
    if (count > (bytes_.size() - at_) / size) fail();
    return count;
  }

 private:
  void take(void* to, size_t size) {
    if (size > bytes_.size() - at_) fail();
    if (size > 0) std::memcpy(to, bytes_.data() + at_, size);
    at_ += size;
  }
  [[noreturn]] void fail() const { refuse("it is cut off"); }

  std::span<const std::byte> bytes_;
  std::string code_, what_, hint_;
  size_t at_ = 0;
};

}  // namespace topple
