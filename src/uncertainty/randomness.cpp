#include "uncertainty/randomness.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "uncertainty/random.h"
#include "uncertainty/space.h"

namespace topple::uncertainty {
namespace {

/// Output of the runs that did not fail.
std::vector<double> pick(std::span<const Result> runs, int output) {
  std::vector<double> values;
  for (const auto& r : runs)
    if (r.state == Result::State::Done) values.push_back(r.values.at(static_cast<std::size_t>(output)));
  return values;
}

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

double calc_mean(const std::vector<double>& v) {
  if (v.empty()) return nan;
  double sum = 0;
  for (const double x : v) sum += x;
  return sum / static_cast<double>(v.size());
}

}  // namespace

double calc_normal_quantile(double u) {
  if (!(u > 0 && u < 1))
    return u == 0 ? -std::numeric_limits<double>::infinity() : u == 1 ? std::numeric_limits<double>::infinity() : nan;
  // the tail below 1/2, by Newton's method on ln Φ, whose slope never vanishes
  const double p = std::min(u, 1 - u);
  double x = -std::sqrt(std::max(-2 * std::log(2 * p), 0.0)) * 0.9;
  for (int k = 0; k < 60; ++k) {
    const double cdf = 0.5 * std::erfc(-x / std::numbers::sqrt2);
    const double density = std::exp(-0.5 * x * x) / std::sqrt(2 * std::numbers::pi);
    const double step = cdf / density * std::log(cdf / p);
    x -= step;
    if (std::abs(step) < 1e-15 * std::max(1.0, std::abs(x))) break;
  }
  return u < 0.5 ? x : -x;
}

Quantile make_normal() {
  return [](double u, std::span<const double> p) { return p[0] + p[1] * calc_normal_quantile(u); };
}

Quantile make_lognormal() {
  return [](double u, std::span<const double> p) {
    const double variance = std::log1p((p[1] / p[0]) * (p[1] / p[0]));
    return p[0] * std::exp(-0.5 * variance + std::sqrt(variance) * calc_normal_quantile(u));
  };
}

Quantile make_uniform() {
  return [](double u, std::span<const double> p) { return p[0] + u * (p[1] - p[0]); };
}

Quantile make_gumbel() {
  return [](double u, std::span<const double> p) {
    const double scale = p[1] * std::sqrt(6.0) / std::numbers::pi;
    return p[0] - scale * (std::numbers::egamma + std::log(-std::log(u)));
  };
}

Quantile make_weibull() {
  return [](double u, std::span<const double> p) { return p[0] * std::pow(-std::log1p(-u), 1 / p[1]); };
}

Statistic make_probability(int outcome) {
  return [outcome](std::span<const Result> runs) {
    const auto count =
        std::count_if(runs.begin(), runs.end(), [&](const Result& r) { return outcome_of(r) == outcome; });
    return static_cast<double>(count) / static_cast<double>(runs.size());
  };
}

Statistic make_share(int output, Side side, double limit) {
  return [=](std::span<const Result> runs) {
    const auto values = pick(runs, output);
    const auto count = std::count_if(values.begin(), values.end(), [&](double v) {
      switch (side) {
        case Side::Above:
          return v > limit;
        case Side::AtLeast:
          return v >= limit;
        case Side::Below:
          return v < limit;
        case Side::AtMost:
          return v <= limit;
      }
      return false;
    });
    return static_cast<double>(count) / static_cast<double>(runs.size());
  };
}

Statistic make_mean(int output) {
  return [=](std::span<const Result> runs) { return calc_mean(pick(runs, output)); };
}

Statistic make_deviation(int output) {
  return [=](std::span<const Result> runs) {
    const auto values = pick(runs, output);
    if (values.size() < 2) return nan;
    const double mean = calc_mean(values);
    double sum = 0;
    for (const double v : values) sum += (v - mean) * (v - mean);
    return std::sqrt(sum / static_cast<double>(values.size() - 1));
  };
}

Statistic make_quantile(int output, double q) {
  return [=](std::span<const Result> runs) {
    auto values = pick(runs, output);
    if (values.empty()) return nan;
    std::sort(values.begin(), values.end());
    // beyond the middle of the outer strata nothing is known, as where runs have failed
    const double last = static_cast<double>(values.size() - 1), at = q * static_cast<double>(values.size()) - 0.5;
    constexpr double round_off = 1e-9;
    if (!(at >= -round_off && at <= last + round_off)) return nan;
    const double place = std::clamp(at, 0.0, last);
    const auto below = static_cast<std::size_t>(std::floor(place));
    const double part = place - std::floor(place);
    return part > 0 ? values[below] + part * (values[below + 1] - values[below]) : values[below];
  };
}

namespace {

/// Ranks of a column of numbers, from 0.
std::vector<int> rank(const std::vector<double>& column) {
  std::vector<int> order(column.size()), ranks(column.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return column[a] < column[b]; });
  for (std::size_t k = 0; k < order.size(); ++k) ranks[order[k]] = static_cast<int>(k);
  return ranks;
}

using Ranks = std::vector<std::vector<int>>;  // of each column

/// Correlations of the columns' normal scores.
std::vector<std::vector<double>> correlate(const Ranks& ranks, const std::vector<double>& scores) {
  double all = 0;
  for (const double z : scores) all += z * z;
  std::vector<std::vector<double>> c(ranks.size(), std::vector<double>(ranks.size(), 1));
  for (std::size_t i = 0; i < ranks.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      double sum = 0;
      for (std::size_t k = 0; k < scores.size(); ++k) sum += scores[ranks[i][k]] * scores[ranks[j][k]];
      c[i][j] = c[j][i] = sum / all;
    }
  return c;
}

double find_largest_of_others(const std::vector<std::vector<double>>& c) {
  double largest = 0;
  for (std::size_t i = 0; i < c.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) largest = std::max(largest, std::abs(c[i][j]));
  return largest;
}

/// The columns in the order of their scores times the inverse of the correlation's Cholesky factor; empty where there
/// is none.
Ranks reorder(const Ranks& ranks, const std::vector<double>& scores, std::vector<std::vector<double>> c) {
  const std::size_t n = ranks.size();
  for (std::size_t j = 0; j < n; ++j)
    for (std::size_t i = j; i < n; ++i) {
      for (std::size_t k = 0; k < j; ++k) c[i][j] -= c[i][k] * c[j][k];
      if (i == j && !(c[j][j] > 1e-6)) return {};
      c[i][j] = i == j ? std::sqrt(c[j][j]) : c[i][j] / c[j][j];
    }
  std::vector<std::vector<double>> columns;
  Ranks out;
  for (std::size_t i = 0; i < n; ++i) {
    std::vector<double> y(scores.size());
    for (std::size_t k = 0; k < y.size(); ++k) {
      y[k] = scores[ranks[i][k]];
      for (std::size_t j = 0; j < i; ++j) y[k] -= c[i][j] * columns[j][k];
      y[k] /= c[i][i];
    }
    out.push_back(rank(y));
    columns.push_back(std::move(y));
  }
  return out;
}

}  // namespace

std::vector<Point> make_strata(int n, int count, std::uint64_t seed) {
  std::vector<Point> points = make_sobol_points(n, 1, count, seed);
  Ranks ranks;
  for (int i = 0; i < n; ++i) {
    std::vector<double> column;
    for (const Point& x : points) column.push_back(x[i]);
    ranks.push_back(rank(column));
  }
  std::vector<double> scores;
  for (int k = 0; k < count; ++k) scores.push_back(calc_normal_quantile((k + 0.5) / count));
  std::vector<std::vector<double>> c = correlate(ranks, scores);
  constexpr int most_passes = 20;
  for (int pass = 0; pass < most_passes; ++pass) {
    Ranks other = reorder(ranks, scores, c);
    if (other.empty()) break;
    const auto now = correlate(other, scores);
    if (!(find_largest_of_others(now) < find_largest_of_others(c))) break;
    ranks = std::move(other), c = now;
  }
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < count; ++k) points[k][i] = (ranks[i][k] + 0.5) / count;
  return points;
}

Evaluate with_monte_carlo(int outer_size, std::vector<RandomVariable> variables, Evaluate model,
                          std::vector<Statistic> statistics, const MonteCarloOptions& options) {
  if (options.samples < 1) throw InputError("E810", fmt::format("Monte Carlo: {} samples", options.samples));
  if (variables.empty()) throw InputError("E810", "Monte Carlo: there is no random variable");
  for (const auto& v : variables)
    for (const int p : v.parameters)
      if (p < 0 || p >= outer_size)
        throw InputError("E810", fmt::format("Monte Carlo: parameter {} of {} outer coordinates", p, outer_size));
  const int m = static_cast<int>(variables.size());
  std::vector<Point> numbers;
  if (options.spread) {
    numbers = make_strata(m, options.samples, options.seed);
  } else {
    Random random(options.seed);
    numbers.assign(options.samples, Point(m));
    for (auto& u : numbers)
      for (double& v : u) v = std::max(random.next(), 0x1p-54);  // quantiles at 0 are not finite
  }
  return [=, variables = std::move(variables), model = std::move(model), statistics = std::move(statistics),
          numbers = std::move(numbers)](std::span<const Point> batch, std::span<Result> out) {
    const std::size_t each = numbers.size();
    const std::size_t sets = std::max<std::size_t>(1, static_cast<std::size_t>(std::max(options.batch, 1)) / each);
    const auto parameters_of = [&](const RandomVariable& v, const Point& x) {
      std::vector<double> p;
      for (const int i : v.parameters) p.push_back(x[i]);
      return p;
    };
    const auto find_fault = [&](const Point& x) -> std::string {
      for (const RandomVariable& v : variables)
        if (v.find_fault)
          if (std::string fault = v.find_fault(parameters_of(v, x)); !fault.empty()) return fault;
      return {};
    };
    for (std::size_t first = 0; first < batch.size(); first += sets) {
      const std::size_t last = std::min(first + sets, batch.size());
      std::vector<Point> inner;
      std::vector<std::size_t> run;  // outer points whose inner points these are
      for (std::size_t k = first; k < last; ++k) {
        out[k] = {};
        if (std::string fault = find_fault(batch[k]); !fault.empty()) {
          out[k].state = Result::State::Failed;
          out[k].text = std::move(fault);
          continue;
        }
        run.push_back(k);
        std::vector<std::vector<double>> parameters;
        for (const RandomVariable& v : variables) parameters.push_back(parameters_of(v, batch[k]));
        for (const auto& u : numbers) {
          Point x = batch[k];
          for (int v = 0; v < m; ++v) x.push_back(variables[v].quantile(u[v], parameters[v]));
          inner.push_back(std::move(x));
        }
      }
      std::vector<Result> results(inner.size());
      if (!inner.empty()) model(inner, results);
      for (std::size_t i = 0; i < run.size(); ++i) {
        Result& o = out[run[i]];
        const std::span<const Result> runs(results.data() + i * each, each);
        const auto is = [&](Result::State s) {
          return std::count_if(runs.begin(), runs.end(), [s](const Result& r) { return r.state == s; });
        };
        if (is(Result::State::NotRun) > 0) continue;
        const auto failed = static_cast<double>(is(Result::State::Failed)), all = static_cast<double>(each);
        if (failed == all || failed > options.most_failed * all + 1e-9) {
          const auto why =
              std::find_if(runs.begin(), runs.end(), [](const Result& r) { return r.state == Result::State::Failed; });
          o.state = Result::State::Failed;
          o.text = fmt::format("{} of {} inner runs failed: {}", failed, each, why->text);
          continue;
        }
        o.state = Result::State::Done;
        for (const auto& s : statistics) o.values.push_back(s(runs));
        o.values.push_back(failed / all);
      }
    }
  };
}

}  // namespace topple::uncertainty
