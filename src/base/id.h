#pragma once
/// Strong indices: a body's and a joint's do not compile in each other's place.

namespace topple {

template <class Tag>
struct Id {
  int index = -1;
  constexpr bool is_valid() const { return index >= 0; }
  friend constexpr bool operator==(Id, Id) = default;
};

}  // namespace topple
