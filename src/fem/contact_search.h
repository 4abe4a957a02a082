#pragma once
/// Points of the outer surface against segments (faces) of it, and debris particles: who may touch whom before the next
/// look. Groups of neighbouring elements are looked at first; pairs of groups are looked through again when they have
/// moved against each other by the search margin, debris at each look (docs/theory/explicit.md, "Contact").

#include <array>
#include <compare>
#include <cstdint>
#include <vector>

#include "base/linalg.h"
#include "fem/contact_cells.h"
#include "fem/contact_skin.h"
#include "fem/explicit_chunks.h"
#include "fem/outer_surface.h"
#include "fem/particle.h"

namespace topple::fem {

/// How far a point may be behind a face, over the thickness of the element there, and still be pushed out.
inline constexpr double kFaceDepth = 0.4;

/// A point of the surface: a node, the centre of a face, or a particle.
struct ContactPoint {
  enum Kind : std::uint32_t { Node, Centre, Debris };
  Kind kind = Node;
  std::uint32_t index = 0;  // row of a node; 6 element + face; particle
  friend auto operator<=>(const ContactPoint&, const ContactPoint&) = default;
};

/// A point that may touch a face.
struct ContactCandidate {
  ContactPoint point;
  std::uint32_t face = 0;  // 6 element + face
  friend auto operator<=>(const ContactCandidate&, const ContactCandidate&) = default;
};

/// A candidate of a pair.
struct FoundCandidate {
  ContactCandidate candidate;
  float free = -1;  // not near before twice what the pair has moved and the path ahead are more than this [m]
};

/// A candidate that may touch before the next look, with the rows of its face's corners.
struct NearCandidate {
  ContactCandidate candidate;
  std::array<std::uint32_t, 4> rows{};
};

/// Constant.
struct ContactSetup {
  OuterSurface surface;
  std::vector<std::array<std::uint32_t, 8>> rows_of_element;
  std::vector<std::uint32_t> group_starts;  // into order
  std::vector<int> order;                   // elements
  std::vector<std::uint32_t> group_of_element;
  std::vector<std::uint32_t> node_starts, node_rows;  // of each group
  std::vector<std::uint32_t> owner;                   // of rows: the lowest group that has it
  double margin = 0;                                  // [m]
  double reach = 0;                                   // of groups' boxes [m]
  bool enabled = true;
};
ContactSetup make_contact_setup(const ExplicitModel&, const ExplicitChunks&, double margin, bool enabled);

/// The outside of a group. Which faces there are holds as long as its surface does not change, where they are for a
/// look.
struct GroupFaces {
  bool is_stale = true;
  std::vector<std::uint32_t> numbers;  // 6 element + face
  lanes::FaceCorners corners;
  lanes::Skin skin;
  std::vector<ContactPoint> points;
  lanes::Places places;  // of these
};
using ContactFaces = std::vector<GroupFaces>;

/// What is outside of a group since elements beside it have gone.
struct GroupNews {
  std::uint32_t group = 0;
  std::vector<std::uint32_t> numbers;  // of faces, in order
  lanes::FaceCorners corners;
  lanes::Skin skin;
  std::vector<ContactPoint> points;  // in order
  lanes::Places places;              // of these
  ContactBox box;                    // of all
};

/// Two groups that are near each other, and what was found between them.
struct ContactPair {
  std::uint32_t a = 0, b = 0;  // a >= b
  // since they were looked through, how far they have moved against each other, and may until it is to be done again
  // [m]
  float moved = 0, until = -1;
  float free = -1;  // least of the candidates'
  std::vector<FoundCandidate> candidates;
};

/// Touches of a step: their number, power at the speeds before it [W], and what is in their springs [J].
struct TouchSums {
  long long count = 0;
  double normal = 0, friction = 0, stored = 0;
  TouchSums& operator+=(const TouchSums& of) {
    count += of.count, normal += of.normal, friction += of.friction, stored += of.stored;
    return *this;
  }
};

struct ContactState {
  std::vector<unsigned char> gone;     // elements
  std::vector<std::uint32_t> removed;  // elements that have gone since the last look
  std::vector<ContactPair> pairs;      // in the order of a, then b
  // what may touch before the next look, in order
  std::vector<NearCandidate> near;
  std::vector<ParticlePair> near_particles;
  std::vector<ContactBox> boxes;           // of groups, with their room around them
  std::vector<double> room;                // at least half the reach, more for what is fast [m]
  std::vector<double> travel;              // of a group since the boxes were made [m]
  std::vector<lanes::GroupMotion> motion;  // of groups at the last look
  std::vector<Vec3> particle_speed;        // at the last look
  bool fresh = true;                       // no boxes yet
  bool knocked = false;                    // debris has gained more speed than the last look reckons with
  int since = 0;                           // steps since the last look
  std::uint64_t look = 0;                  // which found what is near, like no other; 0: not known
  TouchSums touching;                      // of surfaces in the last step
  TouchSums debris;  // of debris at its last forces; power of impulses over a step, 0 where there are none
  long long searches = 0;
};

}  // namespace topple::fem
