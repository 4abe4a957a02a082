#pragma once
/// Points of the outer surface against segments (faces) of it, and debris particles: who may touch whom. Groups of
/// neighbouring elements are looked at first; pairs of groups are looked through again when they have moved against
/// each other by the search margin (docs/theory/explicit.md, "Contact").

#include <array>
#include <cstdint>
#include <vector>

#include "base/linalg.h"
#include "fem/explicit_chunks.h"
#include "fem/outer_surface.h"

namespace topple::fem {

/// How far a point may be behind a face, over the thickness of the element there, and still be pushed out.
inline constexpr double kFaceDepth = 0.4;

/// A point of the surface: a node, the centre of a face, or a particle.
struct ContactPoint {
  enum Kind : std::uint32_t { Node, Centre, Debris };
  Kind kind = Node;
  std::uint32_t index = 0;  // row of a node; 6 element + face; particle
  friend bool operator==(const ContactPoint&, const ContactPoint&) = default;
};

/// A point that may touch a face.
struct ContactCandidate {
  ContactPoint point;
  std::uint32_t face = 0;  // 6 element + face
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

/// Two groups (or a particle and a group) that are near each other, and what was found between them.
struct ContactPair {
  std::uint32_t a = 0, b = 0;  // objects: groups, then particles; a >= b
  double slack = -1;           // what they may still move against each other until they are looked through [m]
  std::vector<ContactCandidate> candidates;
};

/// A touch of the last step, for the ledger.
struct SurfaceTouch {
  ContactPoint point;
  std::uint32_t face = 0;   // none for two particles
  std::uint32_t other = 0;  // particle + 1 where two touch, 0: a face
  double weights[4] = {0, 0, 0, 0};
  Vec3 normal_force, friction, before;
  double stored = 0, depth = 0;
};

struct ContactState {
  std::vector<unsigned char> gone;  // elements
  std::vector<std::array<std::uint32_t, 2>> particle_pairs;
  std::vector<ContactPair> pairs;
  std::vector<double> travel;          // of an object since the boxes were made [m]
  std::vector<Vec3> speed;             // mean, of an object, at the last look
  std::vector<double> spread;          // largest deviation from it
  std::vector<unsigned char> changed;  // groups whose surface has changed
  bool any_changed = false;
  bool fresh = true;  // no boxes yet
  int countdown = 0;  // steps until the next look
  std::vector<SurfaceTouch> touches;
  std::uint32_t boxed_particles = 0;
  long long searches = 0;
};

}  // namespace topple::fem
