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

inline constexpr size_t kSkinFields = 15;  // of a face, its middle first

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
