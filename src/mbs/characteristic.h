#pragma once
/// Scalar laws of springs, dampers and load tables at work: value, slope and integral, all exact for the three kinds.

#include <vector>

#include "mbs/model.h"

namespace topple::mbs {

/// A law laid out for evaluation.
struct CompiledCharacteristic {
  Characteristic::Kind kind = Characteristic::Kind::Linear;
  double rate = 0;              // Linear
  std::vector<double> c;        // Polynomial: coefficients, lowest first
  std::vector<double> x, f;     // Table
  std::vector<double> area;     // Table: integral from x[0] to x[i]
  double area_at_zero = 0;      // Table: integral from x[0] to 0
  bool is_zero = true;          // 0 everywhere: nothing to evaluate
  bool has_bound_slope = true;  // false: a polynomial of second degree or more
};

CompiledCharacteristic compile_characteristic(const Characteristic&);

double calc_force(const CompiledCharacteristic&, double x);
/// What round-off may make of it.
double calc_round_off(const CompiledCharacteristic&, double x);
/// Derivative; at a corner of a table that of the side towards larger x.
double calc_slope(const CompiledCharacteristic&, double x);
/// Integral of the law from 0 to x: the energy that a spring stores.
double calc_integral(const CompiledCharacteristic&, double x);
/// Mean between from and to, which may be either way round but differ.
double calc_mean(const CompiledCharacteristic&, double from, double to);
/// Largest slope, of a polynomial between `from` and `to`, of the others anywhere; 0 if the law only falls.
double find_steepest(const CompiledCharacteristic&, double from, double to);

/// How far from x0 an energy can stretch the law, downwards and upwards, at most to where its magnitude reaches
/// `strength`; the law's whole range where nothing stops it.
struct Reach {
  double from, to;
};
Reach find_reach(const CompiledCharacteristic&, double x0, double energy, double strength);

/// Stiffness of the chord from 0 to the smallest deformation at which the force has changed by `force`; the largest
/// slope if it never does.
double find_chord(const CompiledCharacteristic&, double force);

}  // namespace topple::mbs
