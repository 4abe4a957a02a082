#include "mbs/characteristic.h"

#include <algorithm>
#include <cmath>

namespace topple::mbs {

namespace {

/// Interval of a table that holds x, which lies within its ends.
size_t find_interval(const std::vector<double>& x, double at) {
  const auto after = std::upper_bound(x.begin(), x.end(), at);
  const size_t i = static_cast<size_t>(after - x.begin());
  return std::clamp<size_t>(i, 1, x.size() - 1) - 1;
}

/// Integral of a table from its first point to x.
double calc_area(const CompiledCharacteristic& c, double at) {
  if (at <= c.x.front()) return c.f.front() * (at - c.x.front());
  if (at >= c.x.back()) return c.area.back() + c.f.back() * (at - c.x.back());
  const size_t i = find_interval(c.x, at);
  const double d = at - c.x[i], slope = (c.f[i + 1] - c.f[i]) / (c.x[i + 1] - c.x[i]);
  return c.area[i] + d * (c.f[i] + 0.5 * slope * d);
}

}  // namespace

CompiledCharacteristic compile_characteristic(const Characteristic& from) {
  CompiledCharacteristic c;
  c.kind = from.kind;
  switch (from.kind) {
    case Characteristic::Kind::Linear:
      c.rate = from.rate;
      c.is_zero = from.rate == 0;
      break;
    case Characteristic::Kind::Polynomial:
      c.c = from.coefficients;
      while (!c.c.empty() && c.c.back() == 0) c.c.pop_back();
      c.is_zero = c.c.empty();
      c.has_bound_slope = c.c.size() <= 2;
      break;
    case Characteristic::Kind::Table:
      c.x = from.x;
      c.f = from.f;
      c.area.assign(c.x.size(), 0);
      for (size_t i = 1; i < c.x.size(); ++i)
        c.area[i] = c.area[i - 1] + 0.5 * (c.f[i] + c.f[i - 1]) * (c.x[i] - c.x[i - 1]);
      c.is_zero = std::all_of(c.f.begin(), c.f.end(), [](double f) { return f == 0; });
      c.area_at_zero = c.x.empty() ? 0 : calc_area(c, 0);
      break;
  }
  return c;
}

double calc_force(const CompiledCharacteristic& c, double x) {
  switch (c.kind) {
    case Characteristic::Kind::Linear:
      return c.rate * x;
    case Characteristic::Kind::Polynomial: {
      double f = 0;
      for (size_t i = c.c.size(); i-- > 0;) f = f * x + c.c[i];
      return f;
    }
    case Characteristic::Kind::Table: {
      if (c.is_zero) return 0;
      if (x <= c.x.front()) return c.f.front();
      if (x >= c.x.back()) return c.f.back();
      const size_t i = find_interval(c.x, x);
      return c.f[i] + (x - c.x[i]) / (c.x[i + 1] - c.x[i]) * (c.f[i + 1] - c.f[i]);
    }
  }
  return 0;
}

double calc_round_off(const CompiledCharacteristic& c, double x) {
  constexpr double share = 1e-15;
  switch (c.kind) {
    case Characteristic::Kind::Linear:
      return share * std::abs(c.rate * x);
    case Characteristic::Kind::Polynomial: {
      double sum = 0;
      for (size_t i = c.c.size(); i-- > 0;) sum = sum * std::abs(x) + std::abs(c.c[i]);
      return share * sum;
    }
    case Characteristic::Kind::Table: {
      if (c.is_zero) return 0;
      const size_t i = find_interval(c.x, x);
      return share * std::max(std::abs(c.f[i]), std::abs(c.f[i + 1]));
    }
  }
  return 0;
}

double calc_slope(const CompiledCharacteristic& c, double x) {
  switch (c.kind) {
    case Characteristic::Kind::Linear:
      return c.rate;
    case Characteristic::Kind::Polynomial: {
      double s = 0;
      for (size_t i = c.c.size(); i-- > 1;) s = s * x + static_cast<double>(i) * c.c[i];
      return s;
    }
    case Characteristic::Kind::Table: {
      if (c.is_zero || x < c.x.front() || x >= c.x.back()) return 0;
      const size_t i = find_interval(c.x, x);
      return (c.f[i + 1] - c.f[i]) / (c.x[i + 1] - c.x[i]);
    }
  }
  return 0;
}

double calc_integral(const CompiledCharacteristic& c, double x) {
  switch (c.kind) {
    case Characteristic::Kind::Linear:
      return 0.5 * c.rate * x * x;
    case Characteristic::Kind::Polynomial: {
      double e = 0;
      for (size_t i = c.c.size(); i-- > 0;) e = (e + c.c[i] / static_cast<double>(i + 1)) * x;
      return e;
    }
    case Characteristic::Kind::Table:
      return c.is_zero ? 0 : calc_area(c, x) - c.area_at_zero;
  }
  return 0;
}

double calc_mean(const CompiledCharacteristic& c, double from, double to) {
  if (c.kind == Characteristic::Kind::Table && !c.is_zero) {
    // within one interval the middle is the mean, without the round-off of a difference of integrals
    const double low = std::min(from, to), high = std::max(from, to);
    const auto after = std::upper_bound(c.x.begin(), c.x.end(), low);
    if (after == c.x.end() || *after >= high) return calc_force(c, 0.5 * (low + high));
  }
  return (calc_integral(c, to) - calc_integral(c, from)) / (to - from);
}

double find_steepest(const CompiledCharacteristic& c, double from, double to) {
  double most = 0;
  switch (c.kind) {
    case Characteristic::Kind::Linear:
      return std::max(0.0, c.rate);
    case Characteristic::Kind::Polynomial: {
      // the slope of a cubic is largest at an end or at its vertex; 64 places between serve higher degrees
      constexpr int places = 64;
      for (int i = 0; i <= places; ++i) most = std::max(most, calc_slope(c, from + (to - from) * i / places));
      return most;
    }
    case Characteristic::Kind::Table:
      for (size_t i = 1; i < c.x.size(); ++i) most = std::max(most, (c.f[i] - c.f[i - 1]) / (c.x[i] - c.x[i - 1]));
      return most;
  }
  return most;
}

Reach find_reach(const CompiledCharacteristic& c, double x0, double energy, double strength) {
  const double stored = calc_integral(c, x0);
  const auto is_inside = [&](double x) {
    return calc_integral(c, x) - stored <= energy && std::abs(calc_force(c, x)) <= strength;
  };
  const auto find_end = [&](double sign) {
    double inside = 0, step = 1e-30;  // 300 doublings span every length
    for (int i = 0; i < 300 && is_inside(x0 + sign * step); ++i) inside = step, step *= 2;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (inside + step);
      (is_inside(x0 + sign * middle) ? inside : step) = middle;
    }
    return x0 + sign * step;
  };
  return {find_end(-1), find_end(1)};
}

double find_chord(const CompiledCharacteristic& c, double force) {
  if (c.kind == Characteristic::Kind::Linear) return std::max(0.0, c.rate);
  const double rest = calc_force(c, 0);
  double x = 1e-30;
  for (int i = 0; i < 300; ++i, x *= 2)
    if (std::max(calc_force(c, x) - rest, rest - calc_force(c, -x)) >= force) return force / x;
  return find_steepest(c, 0, 0);
}

}  // namespace topple::mbs
