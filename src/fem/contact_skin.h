#pragma once
/// The outside of a group of elements as a contact search sees it, many faces at a time in SIMD lanes.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/aligned.h"
#include "fem/contact_cells.h"

namespace topple::fem::lanes {

/// Faces that follow one another, which lie close together.
inline constexpr size_t kFaceRun = 8;

/// Rows of the corners of faces side by side, then of those of the faces opposite (F, filled up to whole runs).
using FaceCorners = std::array<std::vector<std::uint32_t>, 8>;
/// Fills the last run with its last face.
void fill_runs(FaceCorners&);

inline constexpr size_t kSkinFields = 16;  // of a face, in the order of SkinFace
/// A face as it is seen whether a point may touch it: unit vectors, those in its plane towards ξ and η with half the
/// width along them; how far behind it counts, and how far its corners are to either side of its plane.
struct SkinFace {
  Vec3 centre, normal, along, across;
  double wide = 0, high = 0, depth = 0, uneven = 0;
};

/// F faces in runs, R runs.
struct Skin {
  size_t count = 0;             // F
  AlignedVector<double> faces;  // fields of a run side by side (R x fields x kFaceRun)
  AlignedVector<double> boxes;  // of all that may be near a run (runs, rounded up to 8, x 6 x 8)
  ContactBox box;               // of the faces
  Vec3 centre(size_t i) const {
    const double* at = faces.data() + i / kFaceRun * kSkinFields * kFaceRun + i % kFaceRun;
    return {at[0], at[kFaceRun], at[2 * kFaceRun]};
  }
  SkinFace face(size_t i) const {
    const double* at = faces.data() + i / kFaceRun * kSkinFields * kFaceRun + i % kFaceRun;
    const auto field = [&](size_t f) { return at[f * kFaceRun]; };
    const auto vector = [&](size_t f) { return Vec3{field(f), field(f + 1), field(f + 2)}; };
    return {vector(0), vector(3), vector(6), vector(9), field(12), field(13), field(14), field(15)};
  }
};

/// Points in runs of kFaceRun.
struct Places {
  size_t count = 0;
  AlignedVector<double> runs;  // x y z of a run side by side
  void clear() { count = 0, runs.clear(); }
  void add(const Vec3& p) {
    if (count % kFaceRun == 0) runs.resize(runs.size() + 3 * kFaceRun, 1e300);  // in no box
    double* at = runs.data() + count / kFaceRun * 3 * kFaceRun + count % kFaceRun;
    for (int c = 0; c < 3; ++c) at[c * static_cast<int>(kFaceRun)] = p[c];
    ++count;
  }
  Vec3 operator[](size_t i) const {
    const double* at = runs.data() + i / kFaceRun * 3 * kFaceRun + i % kFaceRun;
    return {at[0], at[kFaceRun], at[2 * kFaceRun]};
  }
};

/// Of `count` faces; `rows`: kNodeFields a node. `depth` is how far behind a face counts, over the thickness of its
/// element.
void make_skin(const double* rows, double depth, const FaceCorners&, size_t count, Skin&);

/// Numbers of faces that a point may be nearer to than `near`, or behind by no more than their depth and
/// `margin`; in order.
void find_faces(const Skin&, const Vec3& p, double near, double margin, std::vector<std::uint32_t>& found);
/// Numbers of points no further than `near` out of a box along any axis; in order.
void find_points(const Places&, const ContactBox&, double near, std::vector<std::uint32_t>& found);

}  // namespace topple::fem::lanes
