#pragma once
/// Mesh of one zone of a member: bricks on a grid with lines through the bars' places, longitudinal bars and ties as
/// bars that share their nodes; docs/theory/solid.md. x along the member from 0, y and z from the section's centre.

#include <vector>

#include "fem/system.h"
#include "material/solid_concrete.h"
#include "nearfield/rcc.h"

namespace topple::nearfield {

struct SolidMeshInput {
  double length = 0;           // of the mesh along x [m]
  double across = 0;           // largest element in the section [m]
  std::vector<double> size;    // largest element along x, part by part from 0 [m]
  std::vector<double> to;      // end of each part, rising; the last one is `length` [m]
  double crushing_length = 0;  // over which crushing localises where elements are shorter; 0: each element's own [m]
  double foundation = 0;       // depth of an elastic block under x = 0, wider by half of it on all sides; 0: none [m]
  double slip_length = 0;  // length of the bars within the foundation over which they are free; 0: held at x = 0 [m]
};

/// A mesh with its laws. Every law of concrete belongs to one length of elements along x.
struct SolidMesh {
  fem::Model model;                               // without links and controls
  std::vector<double> x, y, z;                    // lines
  std::vector<int> bar_of;                        // of each truss: bar of the section, -1: tie
  std::vector<material::SolidConcrete> concrete;  // of each solid law
  std::vector<int> bedding;                       // nodes at the bottom of the foundation
  std::vector<int> anchors;                       // nodes in the foundation at which free bars end
  int node(int i, int j, int k) const { return i + static_cast<int>(x.size()) * (j + static_cast<int>(y.size()) * k); }
};

/// Throws InputError: what check_zone refuses, elements too long for softening, elements that bars fill.
SolidMesh make_solid_mesh(const ZoneInput&, const SolidMeshInput&);

}  // namespace topple::nearfield
