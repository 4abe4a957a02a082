#pragma once
/// Boxes that get shorter as the member that they belong to is crushed (docs/theory/contact.md).

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "mbs/model.h"

namespace topple::mbs {

/// A box that a zone element shortens.
struct CrushedBox {
  int element = 0;
  int body = -1;           // left to the caller
  int shape = 0;           // of the body, as given to find_crushed_boxes
  bool is_member = false;  // the element's axis goes through it
  int axis = 0;            // of the box, along x of F
  int end = 0;             // of that axis, the one that recedes: 1 or -1
  double begin = 0;        // shortening of the element before which the box keeps its length [m]
  double most = 0;         // by which it can get shorter [m]
  double taken = 0;        // by which it is shorter [m]
};

/// Appends the boxes of a body that lie along an element and reach its far end as it is crushed. Crushing eats at the
/// end towards the other body: of what stands on `a` the top, of what hangs on `b` the foot. An element of one station
/// has its member on the side of b.
///   marker    F on a or M on b, in the body's frame
///   is_b      the body is b
///   stations  places along x of F [m]
void find_crushed_boxes(int element, const Pose& marker, bool is_b, std::span<const double> stations,
                        std::span<const Shape> shapes, std::vector<CrushedBox>& boxes);

/// Shortens a box to what an element's shortening leaves of it; whether that changed anything. A box keeps kRubble.
///   shortening  of the element by crushing [m]
bool shorten_box(double shortening, CrushedBox&, Vec3& p_BS, const Mat3& R_BS, Vec3& half);

/// How much of the members of zone elements is crushed, on a and on b [m].
///   is_on_b  whether a box belongs to the element's body b
template <class IsOnB>
std::vector<std::array<double, 2>> calc_crushed(std::span<const CrushedBox> boxes, size_t elements, IsOnB is_on_b) {
  std::vector<std::array<double, 2>> crushed(elements, {0, 0});
  for (const CrushedBox& box : boxes) {
    double& end = crushed[static_cast<size_t>(box.element)][is_on_b(box) ? 1 : 0];
    if (box.taken > 0) end = std::max(end, box.begin + box.taken);
  }
  return crushed;
}

/// Length that a box keeps when all of it has been crushed [m].
inline constexpr double kRubble = 0.02;

}  // namespace topple::mbs
