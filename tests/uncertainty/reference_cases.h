#pragma once
/// Mappings with exact answers. The numbers were computed independently, to the digits written here.

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "uncertainty/alpha.h"

namespace topple::uncertainty::cases {

inline constexpr double pi = std::numbers::pi;

/// Intervals of one output at alpha = 0, 0.25, 0.5, 0.75.
struct Intervals {
  double at[4][2];
};

struct Case {
  std::string name;
  std::vector<FuzzyNumber> inputs;
  Evaluate model;
  std::vector<Intervals> outputs;
  double tolerance;  // part of the width of the support
};

inline double calc_fct(double fc) { return 1.40 * std::pow((fc - 8) / 10, 2.0 / 3); }  // the paper's equation (1)

inline double calc_borehole(const Point& x) {
  const double rw = x[0], r = x[1], Tu = x[2], Hu = x[3], Tl = x[4], Hl = x[5], L = x[6], Kw = x[7];
  const double ln = std::log(r / rw);
  return 2 * pi * Tu * (Hu - Hl) / (ln * (1 + 2 * L * Tu / (ln * rw * rw * Kw) + Tu / Tl));
}

inline Result calc_jump(const Point& x) {
  const double R = x[0] * x[1] / 100;
  Result r;
  r.state = Result::State::Done;
  r.outcome = R < 8 ? 1 : 0;
  r.values = {R - 8 - (R < 8 ? 10 : 0)};
  return r;
}

inline std::vector<FuzzyNumber> make_jump_inputs() {
  return {make_triangular(10, 25, 45), make_triangular(33.6, 64, 88)};
}

inline std::vector<Case> make_all() {
  const auto values = [](auto f) { return make_evaluate_values(f); };
  const FuzzyNumber angle = make_triangular(-pi, 0, pi), fc = make_triangular(10, 25, 45);
  std::vector<Case> all;
  all.push_back({"dependent",
                 {fc},
                 values([](const Point& x) { return std::vector{x[0] / calc_fct(x[0])}; }),
                 {{{{12.531505, 20.885841}, {12.531505, 14.203524}, {12.531505, 12.934836}, {12.531505, 12.668099}}}},
                 1e-6});
  all.push_back({"repeated",
                 {make_triangular(1, 2, 4), make_triangular(2, 3, 5)},
                 values([](const Point& x) { return std::vector{x[0] * x[1] / (x[0] + x[1])}; }),
                 {{{{.666667, 2.222222}, {.803571, 1.968750}, {.937500, 1.714286}, {1.069444, 1.458333}}}},
                 1e-6});
  all.push_back({"ishigami",
                 {angle, angle, angle},
                 values([](const Point& x) {
                   const double s = std::sin(x[1]);
                   return std::vector{std::sin(x[0]) + 7 * s * s + 0.1 * std::pow(x[2], 4) * std::sin(x[0])};
                 }),
                 {{{{-10.740909, 17.740909}, {-4.082085, 11.082085}, {-1.608807, 8.608807}, {-.734012, 4.234012}}}},
                 1e-6});
  all.push_back(
      {"borehole",
       {make_triangular(.05, .1, .15), make_triangular(100, 25050, 50000), make_triangular(63070, 89335, 115600),
        make_triangular(990, 1050, 1110), make_triangular(63.1, 89.55, 116), make_triangular(700, 760, 820),
        make_triangular(1120, 1400, 1680), make_triangular(9855, 10950, 12045)},
       values([](const Point& x) { return std::vector{calc_borehole(x)}; }),
       {{{{7.819676, 309.575588}, {15.404223, 221.229012}, {27.365257, 155.528914}, {45.225276, 106.658952}}}},
       1e-6});
  all.push_back({"jump",
                 make_jump_inputs(),
                 make_evaluate(calc_jump),
                 {{{{-14.64, 31.6}, {-12.335, 24.8}, {.54, 18.6}, {3.985, 13}}}},
                 1e-4});
  all.push_back({"function",
                 {make_triangular(.05, .1, .2), make_triangular(1.6, 2, 2.6)},
                 values([](const Point& x) {
                   const auto f = [&x](double t) { return std::exp(-x[0] * t) * std::cos(x[1] * t); };
                   return std::vector{f(1.7), f(4)};
                 }),
                 {{{{-.918512, -.205161}, {-.899200, -.386531}, {-.880293, -.557179}, {-.858419, -.704318}}},
                  {{{-.818731, .813151}, {-.778801, .677087}, {-.722182, .450678}, {-.478286, .177060}}}},
                 1e-6});
  const FuzzyNumber wide = make_triangular(-5.12, .5, 5.12);
  all.push_back({"rastrigin",
                 {wide, wide},
                 values([](const Point& x) {
                   double sum = 20;
                   for (const double v : x) sum += v * v - 10 * std::cos(2 * pi * v);
                   return std::vector{sum};
                 }),
                 {{{{0, 80.706580}, {0, 64.624882}, {0, 52.563682}, {0, 44.522918}}}},
                 1e-4});
  all.push_back({"inner minimum",
                 {make_triangular(-1, 1.5, 3), make_triangular(0, 1, 2)},
                 values([](const Point& x) { return std::vector{(x[0] - 1) * (x[0] - 1) + x[1]}; }),
                 {{{{0, 6}, {.25, 4.390625}, {.5, 3.0625}, {.75, 2.015625}}}},
                 1e-6});
  return all;
}

}  // namespace topple::uncertainty::cases
