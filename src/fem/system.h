#pragma once
/// A model of finite elements and its equations: which displacements are unknown, forces and stiffness of all elements.
/// docs/theory/fem.md (7) to (10).

#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "fem/element.h"
#include "fem/law.h"
#include "fem/mesh.h"
#include "fem/sparse.h"
#include "material/steel.h"

namespace topple::fem {

/// A share of a nodal displacement that follows a control.
struct Link {
  int control = 0;
  double factor = 1;  // displacement per unit of the control: 1, or a lever arm [m]
};

class System;
struct State;

/// What is given. A nodal displacement (3 * node + axis) that stands in `links` is the sum of its links, fixed if there
/// are none; all others are free. Controls are displacements or rotations of masters, such as a rigid end section.
struct Model {
  Mesh mesh;
  std::vector<std::shared_ptr<const SolidLaw>> solids;
  std::vector<material::Steel> steels;
  std::map<int, std::vector<Link>> links;
  std::vector<double> control_length;  // 1 for a displacement, a length for a rotation: makes residuals comparable [m]
  /// Called with the histories of an accepted step, for laws whose points look at each other; may be empty.
  std::function<void(const System&, State&)> smooth;
  std::vector<double> load;  // forces on nodal displacements at load factor 1, empty: none [N] (3 nodes)
};

/// Displacements and history. E hexahedra, T bars.
struct State {
  std::vector<double> q;                   // free displacements, then controls  [m, rad]
  std::vector<double> solids;              // histories, one point after the other
  std::vector<material::SteelState> bars;  // (T)
};

/// What one look at all elements gives.
struct Response {
  std::vector<double> force;                       // internal force on each unknown (q)
  std::vector<std::array<Voigt, kPoints>> stress;  // (E) [Pa]
  std::vector<std::array<Voigt, kPoints>> strain;  // (E)
  std::vector<double> bar_stress, bar_strain;      // (T) [Pa]
  bool converged = true;                           // every law found its stress
  double scale = 0;                                // root of the sum of squares of all element forces [N]
};

/// How elements are looked at.
struct Look {
  double secant_share =
      0;                  // of the stiffness; 0: the symmetric part of the tangent, 1: the secant, between them a blend
  double step_ratio = 1;  // see SolidLaw::advance
  int threads = 1;        // 0: all of the machine
};

class System {
 public:
  /// Throws InputError: unsound mesh, links or laws that do not exist.
  explicit System(Model);

  const Model& model() const { return model_; }
  int unknowns() const { return unknowns_; }
  int controls() const { return static_cast<int>(model_.control_length.size()); }
  int first_control() const { return unknowns_ - controls(); }
  const SparseMatrix& pattern() const { return pattern_; }
  const std::vector<double>& load() const { return load_; }  // on each unknown at load factor 1 [N]
  /// Length that makes an unknown's force comparable: 1 for displacements.
  double length_of(int unknown) const { return length_[static_cast<size_t>(unknown)]; }

  State begin() const;
  /// Displacement of every node.
  std::vector<Vec3> calc_displacements(const std::vector<double>& q) const;
  /// Forces, stresses and the new history at displacements `q`, from the history in `old`; `K`, if asked for, gets the
  /// stiffness. The same bits at any number of threads.
  Response evaluate(const State& old, const std::vector<double>& q, State& now, SparseMatrix* K, const Look&) const;
  /// Histories of laws that extrapolate, at accepted strains. Returns the largest force [N] on any unknown by which the
  /// extrapolated stresses were off, as root of the sum of squares; negative: a law found no history.
  double finish(const State& old, const Response&, State& now, int threads) const;
  /// Whether any law extrapolates.
  bool extrapolates() const;
  /// Volumes of the integration points of an element, what is there of them [m³].
  std::array<double, kPoints> volumes(int hex) const;
  double bar_length(int bar) const { return bar_length_[static_cast<size_t>(bar)]; }
  /// History of a point.
  const double* history(const State&, int hex, int point) const;
  double* history(State&, int hex, int point) const;

 private:
  struct Share {
    int unknown = 0;
    double factor = 1;
  };
  struct Map {
    std::vector<int> unknown;  // that the element touches
    std::vector<double> T;     // nodal = T * unknown, row by row; empty: the unknowns themselves in order
    std::vector<int> entry;    // into the matrix, lower triangle row by row of the element's unknowns
  };
  Map make_map(const std::vector<int>& nodal) const;

  Model model_;
  int unknowns_ = 0;
  std::vector<std::vector<Share>> of_nodal_;  // what each nodal displacement is made of
  std::vector<double> length_, load_;
  std::vector<HexShape> shapes_;
  std::vector<int> shape_of_;       // (E)
  std::vector<size_t> history_of_;  // first number of an element's history (E)
  size_t history_size_ = 0;
  std::vector<double> bar_length_;
  std::vector<Map> maps_;  // hexahedra, then bars
  SparseMatrix pattern_;
};

}  // namespace topple::fem
