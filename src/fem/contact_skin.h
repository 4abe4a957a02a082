#pragma once
/// The outside of a group of elements as a contact search sees it, many faces at a time in SIMD lanes.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/aligned.h"
#include "fem/contact_cells.h"
#include "fem/particle.h"

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
  AlignedVector<double> boxes;  // of runs' faces and what is behind them (runs, rounded up to 8, x 6 x 8)
  ContactBox box;               // of the faces
  size_t runs() const { return (count + kFaceRun - 1) / kFaceRun; }
  ContactBox run_box(size_t run) const {
    const double* at = boxes.data() + run / 8 * 6 * 8 + run % 8;
    return {{at[0], at[8], at[16]}, {at[24], at[32], at[40]}};
  }
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
    for (size_t c = 0; c < 3; ++c) at[c * kFaceRun] = p[static_cast<int>(c)];
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
/// How far a ball (a point: radius 0) and a face may move against each other until they may touch.
double calc_gap(const SkinFace&, const Vec3& p, double radius);
/// A group of nodes as a body that moves and turns: v = speed + turning x (p - place), and by how much nodes deviate.
struct GroupMotion {
  Vec3 place, speed, turning;  // means [m, m/s], about the mean place [rad/s]
  double spread = 0;           // largest deviation [m/s]
  double reach = 0;            // largest distance from the mean place [m]
  double most = 0;             // largest speed [m/s]
  Vec3 speed_at(const Vec3& p) const { return speed + cross(turning, p - place); }
};
/// Of nodes with mass, and the box around them.
GroupMotion measure_motion(const double* rows, std::span<const std::uint32_t> nodes, ContactBox& box);
/// How far something may get until a later look, against the faces of a group.
struct Ahead {
  double time = 0;   // until then [s]
  double least = 0;  // beyond what speeds tell [m]
  GroupMotion faces;
  /// At twice the present speeds, against faces that it may touch: those beside p, whose distance a turn does not
  /// change.
  double calc_path(const Vec3& p, const Vec3& v) const {
    return 2 * time * (norm(v - faces.speed_at(p)) + faces.spread) + least;
  }
  /// Of the faces alone.
  double calc_path() const { return 2 * time * faces.most + least; }
};
/// Appends balls and those faces of a run that they may touch until then.
void find_near_faces(const Skin&, size_t run, const Particle*, std::span<const std::uint32_t> balls, const Ahead&,
                     std::vector<std::array<std::uint32_t, 2>>& found);
/// Numbers of points no further than `near` out of a box along any axis; in order.
void find_points(const Places&, const ContactBox&, double near, std::vector<std::uint32_t>& found);

}  // namespace topple::fem::lanes
