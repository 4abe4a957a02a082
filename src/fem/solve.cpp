#include "fem/solve.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

namespace topple::fem {

namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Columns of remembered steps and of what they changed in the residual.
struct Memory {
  std::vector<std::vector<double>> step, change;

  void add(size_t limit, const std::vector<double>& x, const std::vector<double>& x_before,
           const std::vector<double>& r, const std::vector<double>& r_before) {
    if (step.size() == limit) step.erase(step.begin()), change.erase(change.begin());
    std::vector<double> dx(x.size()), dr(x.size());
    for (size_t i = 0; i < x.size(); ++i) dx[i] = x[i] - x_before[i], dr[i] = r[i] - r_before[i];
    step.push_back(std::move(dx)), change.push_back(std::move(dr));
  }
  /// Weights that make |r - Σ w change| smallest; columns too alike to tell get none.
  Eigen::VectorXd find_weights(const std::vector<double>& r, const std::vector<double>& length) const {
    const auto n = static_cast<Eigen::Index>(r.size()), m = static_cast<Eigen::Index>(change.size());
    Eigen::MatrixXd A(n, m);
    Eigen::VectorXd b(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double w = 1 / length[static_cast<size_t>(i)];
      b(i) = w * r[static_cast<size_t>(i)];
      for (Eigen::Index j = 0; j < m; ++j) A(i, j) = w * change[static_cast<size_t>(j)][static_cast<size_t>(i)];
    }
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(A);
    qr.setThreshold(1e-8);
    return qr.solve(b);
  }
};

}  // namespace

Solver::Solver(const System& system)
    : system_(&system), state_(system.begin()), cholesky_(system.pattern()), K_(system.pattern()) {
  State now;
  response_ = system.evaluate(state_, state_.q, now, nullptr, {});
  for (int c = 0; c < system.controls(); ++c) last_.controls.push_back({false, 0});
}

double Solver::control(int c) const { return state_.q[static_cast<size_t>(system_->first_control() + c)]; }
double Solver::control_force(int c) const { return response_.force[static_cast<size_t>(system_->first_control() + c)]; }

StepSummary Solver::step(const Loading& loading, const SolveOptions& options) {
  StepSummary out;
  const System& sys = *system_;
  const auto n = static_cast<size_t>(sys.unknowns()), first = static_cast<size_t>(sys.first_control());
  std::vector<char> held(n, 0);
  std::vector<double> external(n), length(n), move(n, 0.0);
  for (size_t i = 0; i < n; ++i) {
    external[i] = loading.load_factor * sys.load()[i];
    length[i] = sys.length_of(static_cast<int>(i));
  }
  for (size_t c = 0; c < loading.controls.size(); ++c) {
    const Drive& d = loading.controls[c];
    held[first + c] = d.prescribed;
    if (d.prescribed)
      move[first + c] = d.value - state_.q[first + c];
    else
      external[first + c] += d.value;
  }

  // This step over the last one.
  double moved = 0, matched = 0;
  for (size_t i = first; i < n; ++i) {
    const double before = i - first < increment_drive_.size() ? increment_drive_[i - first] : 0;
    const double wanted = loading.controls[i - first].value - last_.controls[i - first].value;
    moved += before * before / (length[i] * length[i]), matched += before * wanted / (length[i] * length[i]);
  }
  const double step_ratio = !increment_.empty() && moved > 0 && matched > 0 ? matched / moved : 0;

  State now;
  Response response;
  double share = options.secant_share;
  const auto evaluate = [&](const std::vector<double>& q, bool stiff) {
    const auto start = Clock::now();
    response = sys.evaluate(state_, q, now, stiff ? &K_ : nullptr, {share, step_ratio, options.threads});
    out.element_time += seconds_since(start);
  };
  std::vector<double> r(n);
  const auto calc_residual = [&] {
    double sum = 0;
    for (size_t i = 0; i < n; ++i) {
      r[i] = held[i] ? 0 : external[i] - response.force[i];
      sum += r[i] * r[i] / (length[i] * length[i]);
    }
    double outside = 0;
    for (size_t i = 0; i < n; ++i) outside += external[i] * external[i] / (length[i] * length[i]);
    const double scale = std::sqrt(response.scale * response.scale + outside);
    return scale > 0 ? std::sqrt(sum) / scale : 0;
  };
  // Factors what evaluate(..., true) assembled; a matrix that is not positive is made again with more of the secant.
  const auto factor = [&](const std::vector<double>& q, std::vector<double>* push) {
    for (;;) {
      if (push) {
        // displacements still to be prescribed, as forces on the others
        const std::vector<double> Km = multiply(K_, move);
        for (size_t i = 0; i < n; ++i) (*push)[i] = held[i] ? 0 : -Km[i];
      }
      for (size_t j = 0; j < n; ++j)
        for (auto k = static_cast<size_t>(K_.start[j]); k < static_cast<size_t>(K_.start[j + 1]); ++k) {
          const auto i = static_cast<size_t>(K_.row[k]);
          if (i != j && (held[i] || held[j])) K_.value[k] = 0;
          if (i == j && held[i]) K_.value[k] = 1;
        }
      const auto start = Clock::now();
      const bool positive = cholesky_.factor(K_);
      out.factor_time += seconds_since(start);
      ++out.factorisations;
      if (positive) return true;
      if (share >= 1) return false;
      share = share < 0.5 ? 0.5 : 1;
      evaluate(q, true);
    }
  };
  const auto solve = [&](const std::vector<double>& b) {
    const auto start = Clock::now();
    std::vector<double> x = cholesky_.solve(b);
    out.solve_time += seconds_since(start);
    return x;
  };

  const bool again = options.extrapolate && step_ratio > 0;
  // Begin: the last increment again, or the linear answer.
  std::vector<double> q = state_.q;
  bool fresh = false;
  if (again) {
    for (size_t i = 0; i < n; ++i) q[i] += step_ratio * increment_[i];
    for (size_t i = first; i < n; ++i)
      if (held[i]) q[i] = loading.controls[i - first].value;
  } else {
    evaluate(q, true);
    out.residual = calc_residual();
    std::vector<double> push(n);
    if (!factor(q, &push)) return out;
    for (size_t i = 0; i < n; ++i) push[i] += r[i];
    const std::vector<double> dx = solve(push);
    for (size_t i = 0; i < n; ++i) q[i] += held[i] ? move[i] : dx[i];
    fresh = true;
  }

  evaluate(q, options.refresh == 1 || !fresh);
  bool assembled = options.refresh == 1 || !fresh;
  out.residual = calc_residual();
  Memory memory;
  int since = assembled ? options.refresh : 0;
  for (out.iterations = 1;; ++out.iterations) {
    if (!std::isfinite(out.residual)) return out;
    if (out.residual <= options.tolerance && response.converged) break;
    if (out.iterations > options.iterations) return out;
    if (since >= options.refresh) {
      if (!assembled) evaluate(q, true);
      if (!factor(q, nullptr)) return out;
      since = 0;
    }
    ++since;
    assembled = false;
    std::vector<double> b = r, shift(n, 0.0);
    if (options.memory > 0 && !memory.step.empty()) {
      const Eigen::VectorXd w = memory.find_weights(r, length);
      for (size_t j = 0; j < memory.step.size(); ++j)
        for (size_t i = 0; i < n; ++i) {
          b[i] -= w(static_cast<Eigen::Index>(j)) * memory.change[j][i];
          shift[i] -= w(static_cast<Eigen::Index>(j)) * memory.step[j][i];
        }
    }
    std::vector<double> dx = solve(b);
    for (size_t i = 0; i < n; ++i) dx[i] = held[i] ? 0 : dx[i] + shift[i];

    // Line search: shorter while the residual grows too much.
    const std::vector<double> q_before = q, r_before = r;
    const double before = out.residual;
    const bool next_assembled = since >= options.refresh;
    double length_of_step = 1;
    for (int trial = 0;; ++trial) {
      for (size_t i = 0; i < n; ++i) q[i] = q_before[i] + length_of_step * dx[i];
      evaluate(q, next_assembled);
      out.residual = calc_residual();
      const double allowed = options.memory > 0 ? 2 * before : before * (1 - 1e-4 * length_of_step);
      if (std::isfinite(out.residual) && out.residual <= std::max(allowed, options.tolerance)) break;
      if (trial == 4) break;
      length_of_step *= 0.5;
    }
    assembled = next_assembled;
    if (options.memory > 0) memory.add(static_cast<size_t>(options.memory), q, q_before, r, r_before);
  }

  if (sys.extrapolates()) {
    const auto start = Clock::now();
    const double off = sys.finish(state_, response, now, options.threads);
    out.element_time += seconds_since(start);
    out.lag = off < 0 ? std::numeric_limits<double>::infinity() : off / std::max(response.scale, 1e-300);
    if (!(out.lag <= options.largest_lag)) return out;
  }
  if (sys.model().smooth) sys.model().smooth(sys, now);
  out.converged = true;
  // Work of this step.
  for (size_t i = 0; i < n; ++i) {
    const double f_now = held[i] ? response.force[i] : external[i];
    double f_before = last_.load_factor * sys.load()[i];
    if (i >= first)
      f_before = held[i] || last_.controls[i - first].prescribed ? response_.force[i]
                                                                 : f_before + last_.controls[i - first].value;
    external_ += 0.5 * (f_now + f_before) * (q[i] - state_.q[i]);
  }
  const Mesh& mesh = sys.model().mesh;
  for (size_t e = 0; e < mesh.hexes.size(); ++e)
    for (size_t p = 0; p < kPoints; ++p) {
      double work = 0;
      for (size_t k = 0; k < 6; ++k)
        work += 0.5 * (response.stress[e][p][k] + response_.stress[e][p][k]) *
                (response.strain[e][p][k] - response_.strain[e][p][k]);
      internal_ += work * sys.volumes(static_cast<int>(e))[p];
    }
  for (size_t t = 0; t < mesh.bars.size(); ++t)
    internal_ += 0.5 * (response.bar_stress[t] + response_.bar_stress[t]) *
                 (response.bar_strain[t] - response_.bar_strain[t]) * mesh.bars[t].area *
                 sys.bar_length(static_cast<int>(t));
  increment_.resize(n);
  for (size_t i = 0; i < n; ++i) increment_[i] = q[i] - state_.q[i];
  increment_drive_.resize(loading.controls.size());
  for (size_t c = 0; c < loading.controls.size(); ++c)
    increment_drive_[c] = loading.controls[c].value - last_.controls[c].value;
  state_ = std::move(now);
  response_ = std::move(response);
  last_ = loading;
  return out;
}

MarchSummary march(Solver& solver, const Loading& target, const MarchOptions& options,
                   const std::function<bool(double)>& accepted, const Progress& progress,
                   const std::function<std::string(double)>& describe) {
  MarchSummary out;
  Loading from = solver.loading();
  const System& sys = solver.system();
  for (int c = 0; c < sys.controls(); ++c) {
    Drive& d = from.controls[static_cast<size_t>(c)];
    const bool prescribed = target.controls[static_cast<size_t>(c)].prescribed;
    d = {prescribed, prescribed ? solver.control(c) : solver.control_force(c)};
  }
  solver.restart(from);
  double step = options.first;
  SolveOptions allowed = options.solve;
  while (out.reached < 1) {
    if (progress.is_cancelled()) {
      out.cancelled = true;
      out.ending = "cancelled at " + describe(out.reached);
      return out;
    }
    const double to = out.reached + step > 1 - 1e-9 ? 1 : out.reached + step;
    Loading loading = from;
    loading.load_factor += to * (target.load_factor - from.load_factor);
    for (size_t c = 0; c < loading.controls.size(); ++c)
      loading.controls[c].value += to * (target.controls[c].value - from.controls[c].value);
    const StepSummary s = solver.step(loading, allowed);
    out.iterations += s.iterations, out.factorisations += s.factorisations;
    out.element_time += s.element_time, out.factor_time += s.factor_time, out.solve_time += s.solve_time;
    out.residual = s.residual;
    if (s.converged) {
      out.reached = to;
      ++out.steps;
      if (progress.report) progress.report(out.reached, 1);
      if (!accepted(to)) {
        out.ending = "ended at " + describe(to);
        return out;
      }
      out.largest_lag = std::max(out.largest_lag, s.lag);
      const bool easy = s.iterations <= options.solve.iterations / 4 && s.lag <= 0.4 * options.solve.largest_lag;
      if (easy) step = std::min(options.largest, 1.5 * step);
      if (s.iterations > options.solve.iterations / 2 || s.lag > 0.8 * options.solve.largest_lag) step *= 0.7;
      step = std::max(step, options.smallest);
      if (s.lag <= options.solve.largest_lag) allowed.largest_lag = options.solve.largest_lag;
    } else {
      ++out.failed;
      step *= 0.4;
      if (step < options.smallest && s.residual <= options.solve.tolerance && allowed.largest_lag < options.jump_lag) {
        // A jump of the structure: no shorter step makes the extrapolation better.
        allowed.largest_lag = options.jump_lag;
        step = options.smallest;
      } else if (step < options.smallest) {
        out.ending =
            fmt::format("did not converge at {}, last residual {:.2g} of the element forces", describe(to), s.residual);
        if (std::isinf(s.lag))
          out.ending += ", a point of the solid found no stress";
        else if (s.lag > options.solve.largest_lag)
          out.ending += fmt::format(", extrapolated history off by {:.2g} of them", s.lag);
        return out;
      }
    }
  }
  out.complete = true;
  out.ending = "complete";
  return out;
}

}  // namespace topple::fem
