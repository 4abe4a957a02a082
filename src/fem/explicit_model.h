#pragma once
/// What an explicit calculation works on, constant while it runs: nodes, hexahedra, materials, supports, loads, ground.
/// Knows no building. docs/theory/explicit.md.

#include <array>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "base/linalg.h"

namespace topple::fem {

inline constexpr int kMostYieldPoints = 12;  // NOLINT(readability-identifier-naming)

/// Uniaxial yield stresses at a plastic strain; in between and beyond, straight lines (the last value stays).
struct YieldPoint {
  double strain = 0;       // equivalent plastic strain, the first 0, rising
  double tension = 0;      // > 0 [Pa]
  double compression = 0;  // magnitude, > 0 [Pa]
};

/// Isotropic elastic-plastic: von Mises whose yield stress goes linearly with the pressure from the tensile one at
/// -tension/3 to the compressive one at compression/3, eq. 12 there.
struct ExplicitMaterial {
  std::string name;
  double density = 0;  // [kg/m³]
  double E = 0;        // [Pa]
  double nu = 0;
  std::vector<YieldPoint> yield;  // empty: elastic; at most kMostYieldPoints
  /// Largest mean tension over the tensile yield stress, largest pressure over the compressive one; infinite: none.
  double tension_cutoff = std::numeric_limits<double>::infinity();
  double compression_cutoff = std::numeric_limits<double>::infinity();
  /// Plastic strain below which cracks close and open again, on the line to the stress at which they opened (eq. 12a
  /// there); what is pulled apart beyond it stays so. 0: no crack closes.
  double crack_strain = 0;
  /// Plastic strains at which an element goes, in pure tension and in pure compression; infinite: never.
  double tension_limit = std::numeric_limits<double>::infinity();
  double compression_limit = std::numeric_limits<double>::infinity();
};

struct ExplicitElement {
  std::array<int, 8> node{};  // corners as in fem::Hex: (-,-,-) (+,-,-) (+,+,-) (-,+,-), then the same at ζ = +1
  int material = 0;
  int part = 0;            // the caller's; sums are made for each part
  double mass_factor = 1;  // on the density, e.g. for a volume that the mesh does not meet exactly
};

/// Components of a node that are held (velocity 0).
struct ExplicitSupport {
  int node = 0;
  bool x = true, y = true, z = true;
};

struct NodalForce {
  int node = 0;
  Vec3 force;  // constant in W [N]
};

/// Rigid half-space below a plane.
struct ExplicitGround {
  Vec3 point{0, 0, 0};
  Vec3 normal{0, 0, 1};  // unit, outwards
  double friction = 0.5;
};

/// A slender bar between two places of the mesh: a force along the line between them, from the beginning of its release
/// on. Straight it yields, hardens and tears; shortened it buckles, and bears nothing on its way back until it is
/// straight (eq. 26 there).
struct ExplicitBar {
  struct End {
    std::array<int, 4> node{-1, -1, -1, -1};  // the first negative: a place that is held
    std::array<double, 4> weight{};           // of the nodes' places, sum 1
    Vec3 place;                               // in W, if held [m]
  };
  End a, b;
  double stiffness = 0;            // of the straight bar [N/m]
  double yield = 0, rupture = 0;   // forces when its plastic elongation begins and when it tears [N]
  double tears_at = 0;             // plastic elongation [m]
  std::vector<double> shortening;  // rising from 0 [m]
  std::vector<double> buckling;    // largest force pushed so far together, magnitude [N] (shortening)
};

/// What loses its hold within some milliseconds, once it is told to (ExplicitSystem::release): yield stresses of some
/// materials fall linearly to nothing, then their elements are taken away.
struct ExplicitRelease {
  double duration = 0;                        // [s]
  std::vector<int> elements;                  // that are taken away ...
  std::vector<int> materials;                 // ... and theirs, which no other elements have
  std::vector<std::pair<int, int>> weakened;  // materials, and whose yield stresses they have once it is over
  std::vector<int> bars;                      // that bear from its beginning on
};

struct ExplicitModel {
  std::vector<Vec3> nodes;  // [m]
  std::vector<ExplicitElement> elements;
  std::vector<ExplicitMaterial> materials;
  std::vector<double> extra_mass;         // at nodes, with weight and inertia; empty: none [kg] (nodes)
  std::vector<ExplicitSupport> supports;  // several of one node add up
  std::vector<NodalForce> forces;
  std::vector<ExplicitGround> grounds;
  std::vector<ExplicitBar> bars;
  std::vector<ExplicitRelease> releases;
  Vec3 gravity{0, 0, -9.81};  // [m/s²]
};

/// Throws InputError: nodes or materials that do not exist, elements turned inside out, values out of range; a
/// softening steeper than three shear moduli; releases whose materials others have, or whose successors are not alike.
void check_explicit_model(const ExplicitModel&);

/// Volume of the hexahedron [m³], eq. 3 there.
double calc_hex_volume(const std::array<Vec3, 8>&);

/// Largest step at which the element alone is stable, without bulk viscosity [s].
double calc_element_step(const std::array<Vec3, 8>&, const ExplicitMaterial&, double mass_factor = 1);

/// What a mesh is like, for reports.
struct ExplicitMeshSummary {
  int nodes = 0, elements = 0;
  double mass = 0;           // with extra masses [kg]
  Vec3 p_WBcm;               // centre of mass [m]
  double smallest_edge = 0;  // [m]
  int smallest_edge_element = -1;
  double largest_aspect = 0;  // longest over shortest edge of an element
  double critical_step = 0;   // of the worst element [s]
  int critical_element = -1;
};
ExplicitMeshSummary calc_mesh_summary(const ExplicitModel&);

}  // namespace topple::fem
