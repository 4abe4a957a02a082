#include "nearfield/solid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "base/error.h"
#include "base/unit.h"
#include "fem/cut.h"
#include "fem/solve.h"
#include "material/solid_concrete.h"
#include "nearfield/column.h"
#include "nearfield/solid_mesh.h"

namespace topple::nearfield {

namespace {

constexpr double kMostAcross = 100;  // elements over the shorter side: more do not fit into any memory

double choose_size(const ZoneInput& in, const SolidOptions& options) {
  if (!(options.element_size >= 0) || !std::isfinite(options.element_size))
    throw InputError("E616", "the size of elements must not be negative");
  if (!(options.crushing_length >= 0) || !std::isfinite(options.crushing_length))
    throw InputError("E616", "the length of crushing must not be negative");
  if (!(options.largest_lag > 0)) throw InputError("E616", "the largest lag must be positive");
  if (!(options.largest_rotation > 0) || options.steps < 1)
    throw InputError("E616", "a march needs a positive largest rotation and at least one step");
  if (options.largest_rotation > std::numbers::pi)
    throw InputError("E616", fmt::format("a largest rotation of {:g} rad is more than half a turn, {:.4g} rad",
                                         options.largest_rotation, std::numbers::pi));
  const double side = std::min(in.section.width, in.section.height);
  if (options.element_size > 0 && options.element_size < side / kMostAcross)
    throw InputError("E616",
                     fmt::format("elements of {:g} m are too small: at least {:g} m, {} across the shorter side",
                                 options.element_size, side / kMostAcross, kMostAcross));
  return options.element_size > 0 ? options.element_size : 0.1 * side;
}

/// Middle of the elements nearest to `place`.
double find_middle(const std::vector<double>& x, double place) {
  double best = 0.5 * (x[0] + x[1]);
  for (size_t i = 0; i + 1 < x.size(); ++i) {
    const double m = 0.5 * (x[i] + x[i + 1]);
    if (std::abs(m - place) < std::abs(best - place) - 1e-12) best = m;
  }
  return best;
}

SolidState make_state(const SolidMesh& mesh, const fem::Solver& solver, double cut_at) {
  SolidState out;
  const fem::System& system = solver.system();
  const fem::Mesh& m = system.model().mesh;
  out.cut_at = cut_at;
  const fem::Cut cut = fem::make_cut(system, solver.response(), {{cut_at, 0, 0}, {1, 0, 0}});
  out.cut_force = cut.force, out.cut_moment = cut.moment;
  for (const fem::CutPoint& p : cut.points) out.cut.push_back({p.at.y, p.at.z, p.area, p.stress[0]});
  for (const fem::CutBar& b : cut.bars)
    if (mesh.bar_of[static_cast<size_t>(b.bar)] >= 0)
      out.bars.push_back({b.at.y, b.at.z, b.stress, solver.response().bar_strain[static_cast<size_t>(b.bar)]});
  for (size_t e = 0; e < m.hexes.size(); ++e) {
    double crack = 0, crushing = 0;
    const auto kind = static_cast<size_t>(m.hexes[e].law);  // beyond the concretes: the elastic foundation
    for (int p = 0; p < fem::kPoints && kind < mesh.concrete.size(); ++p) {
      const material::SolidConcrete& law = mesh.concrete[kind];
      const auto& state = *reinterpret_cast<const material::SolidConcreteState*>(
          system.history(solver.state(), static_cast<int>(e), p));
      crack = std::max(crack, material::calc_crack_width(law, state));
      crushing = std::max(crushing, material::calc_crushing(law, state));
    }
    out.crack_width.push_back(crack), out.crushing.push_back(crushing);
  }
  out.bar_stress = solver.response().bar_stress;
  out.displacement = system.calc_displacements(solver.state().q);
  return out;
}

/// A model with its controls, and which of them is read.
struct Problem {
  SolidMesh mesh;
  int driven = 0, axial = 0, cross = -1;  // controls
  double sign = 1;                        // of the driven control
  double scale = 1;                       // control's displacement for a rotation of 1
  double spring = 0;                      // on the driven control: the P-Δ effect
  double cut_at = 0;
  double fy = 0, eps_c1 = 0,
         edge = 0;  // of first yield: steel, concrete, distance of the compressed edge over the length
  bool ends_without_moment = true;
  std::string name;
};

SolidMarch run(const Problem& problem, fem::Loading loading, double N, const SolidOptions& options,
               const Progress& progress) {
  SolidMarch out;
  const fem::System system(problem.mesh.model);
  fem::Solver solver(system);
  out.mesh = system.model().mesh;
  out.degrees_of_freedom = system.unknowns();

  std::vector<double> path = options.path;
  if (path.empty()) path.push_back(options.largest_rotation);
  double whole = 0, at = 0;
  for (const double p : path) whole += std::abs(p - at), at = p;
  double walked = 0, origin = 0;  // rotation at which N is carried without moment
  std::vector<char> taken(options.pictures.size(), 0);
  const auto record = [&] {
    const double rotation = problem.sign * solver.control(problem.driven) / problem.scale - origin;
    out.rotation.push_back(rotation);
    out.moment.push_back(problem.sign *
                         (solver.control_force(problem.driven) + problem.spring * solver.control(problem.driven)));
    out.cross_moment.push_back(problem.cross >= 0 ? solver.control_force(problem.cross) : 0);
    out.elongation.push_back(solver.control(problem.axial));
    for (size_t i = 0; i < taken.size(); ++i) {
      if (taken[i] || rotation < options.pictures[i] * (1 - 1e-9)) continue;
      taken[i] = 1;
      out.states.push_back(make_state(problem.mesh, solver, problem.cut_at));
      out.states.back().rotation = rotation, out.states.back().moment = out.moment.back(),
      out.states.back().elongation = out.elongation.back();
    }
  };
  const auto add = [&](const fem::MarchSummary& s) {
    out.steps += s.steps, out.failed_steps += s.failed, out.iterations += s.iterations;
    out.element_time += s.element_time, out.factor_time += s.factor_time, out.solve_time += s.solve_time;
    out.largest_lag = std::max(out.largest_lag, s.largest_lag);
    out.ending = s.ending;
    return s.complete;
  };
  fem::MarchOptions march_options;
  march_options.solve.threads = options.threads;
  march_options.solve.tolerance = 1e-4;
  march_options.solve.largest_lag = options.largest_lag;
  // The normal force first.
  if (N != 0) {
    fem::Loading normal = loading;
    for (fem::Drive& d : normal.controls) d = {false, 0};
    normal.controls[static_cast<size_t>(problem.axial)].value = N;
    march_options.first = march_options.largest = 0.1;
    Progress quiet;
    quiet.cancel = progress.cancel;
    const auto describe = [&](double part) { return fmt::format("N = {:.4g} MN", part * N / 1e6); };
    if (!add(fem::march(
            solver, normal, march_options, [](double) { return true; }, quiet, describe)))
      return out;
    loading.controls[static_cast<size_t>(problem.axial)] = {false, N};
    origin = problem.sign * solver.control(problem.driven) / problem.scale;
    if (problem.cross >= 0) loading.controls[static_cast<size_t>(problem.cross)].value = solver.control(problem.cross);
  }
  record();
  const auto has_yielded = [&](const fem::Solver& now) {
    const fem::Mesh& m = now.system().model().mesh;
    for (size_t b = 0; b < m.bars.size(); ++b)
      if (problem.mesh.bar_of[b] >= 0 && now.response().bar_stress[b] >= problem.fy * (1 - 1e-9)) return true;
    const double shortening = std::abs(now.control(problem.driven)) * problem.edge - now.control(problem.axial);
    return problem.edge > 0 && shortening >= problem.eps_c1 * problem.mesh.x.back();
  };
  const auto note_yield = [&] { out.yield_rotation = out.rotation.back(), out.yield_moment = out.moment.back(); };
  const double external = solver.external_work(), internal = solver.internal_work();

  double peak = 0;
  bool lost = false;
  for (size_t turn = 0; turn < path.size() && !lost; ++turn) {
    const double from = problem.sign * solver.control(problem.driven) / problem.scale - origin, to = path[turn];
    loading.controls[static_cast<size_t>(problem.driven)] = {true, problem.sign * problem.scale * (origin + to)};
    const double step = 1.0 / options.steps;
    march_options.first = std::min(step, 2e-5 / std::abs(to - from));
    march_options.largest = step;
    march_options.smallest = std::min(1e-2 * step, march_options.first);
    Progress part;
    part.cancel = progress.cancel;
    if (progress.report)
      part.report = [&](double done, double) { progress.report(walked + done * std::abs(to - from), whole); };
    const auto describe = [&](double share) {
      return fmt::format("{} = {:.5g}", problem.name, from + share * (to - from));
    };
    const bool done = add(fem::march(
        solver, loading, march_options,
        [&](double) {
          record();
          if (turn > 0) return true;
          const double M = out.moment.back();
          if (!(out.yield_rotation > 0) && has_yielded(solver)) note_yield();
          peak = std::max(peak, M);
          lost = problem.ends_without_moment && peak > 0 && M <= 0;
          return !lost;
        },
        part, describe));
    out.external_work = solver.external_work() - external, out.internal_work = solver.internal_work() - internal;
    if (!done && !lost) break;
    walked += std::abs(to - from);
    out.complete = lost || turn + 1 == path.size();
  }
  if (lost) out.ending = fmt::format("no moment left at {} = {:.5g}", problem.name, out.rotation.back());
  // The third sign of yield can only be seen from the end.
  for (size_t j = 1; j < out.moment.size(); ++j) {
    if (out.yield_rotation > 0 && out.rotation[j] >= out.yield_rotation) break;
    if (out.moment[j] < 0.75 * peak) continue;
    const double w = (0.75 * peak - out.moment[j - 1]) / (out.moment[j] - out.moment[j - 1]);
    out.yield_moment = 0.75 * peak;
    out.yield_rotation = out.rotation[j - 1] + w * (out.rotation[j] - out.rotation[j - 1]);
    break;
  }
  return out;
}

/// Both ends plane; the left one stands, the right one has its place along x and two rotations as controls 0, 1, 2.
Problem make_zone_problem(const ZoneInput& in, double axis_angle, int direction, const SolidOptions& options) {
  Problem out;
  const double size = choose_size(in, options);
  SolidMeshInput wanted;
  wanted.length = in.length, wanted.across = size, wanted.size = {size}, wanted.to = {in.length};
  wanted.crushing_length = options.crushing_length > 0 ? options.crushing_length : in.length;
  out.mesh = make_solid_mesh(in, wanted);
  fem::Model& model = out.mesh.model;
  const int last = static_cast<int>(out.mesh.x.size()) - 1, ny = static_cast<int>(out.mesh.y.size()),
            nz = static_cast<int>(out.mesh.z.size());
  const double c = std::cos(axis_angle), s = std::sin(axis_angle);
  const double arm = 0.5 * std::max(in.section.width, in.section.height);
  model.control_length = {1, arm, arm};
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j) {
      const double y = out.mesh.y[static_cast<size_t>(j)], z = out.mesh.z[static_cast<size_t>(k)];
      model.links[3 * out.mesh.node(0, j, k)] = {};
      model.links[3 * out.mesh.node(last, j, k)] = {{0, 1}, {1, c * z - s * y}, {2, -s * z - c * y}};
    }
  // The left section may widen about its middle but not move or turn in its plane.
  const int j = ny / 2, k = nz / 2, middle = out.mesh.node(0, j, k);
  model.links[3 * middle + 1] = {};
  model.links[3 * middle + 2] = {};
  model.links[3 * out.mesh.node(0, 0, k) + 2] = {};
  out.axial = 0, out.driven = 1, out.cross = 2, out.sign = direction;
  out.cut_at = find_middle(out.mesh.x, 0.5 * in.length);
  out.name = "φ";
  out.fy = in.steel.fy, out.eps_c1 = in.concrete.eps_c1;
  out.edge = 0.5 * (std::abs(c) * in.section.height + std::abs(s) * in.section.width);
  return out;
}

}  // namespace

SolidMarch march_solid(const ZoneInput& in, double N, double axis_angle, int direction, const SolidOptions& options,
                       const Progress& progress) {
  if (direction != 1 && direction != -1) throw InputError("E616", "the direction of a rotation must be 1 or -1");
  const Problem problem = make_zone_problem(in, axis_angle, direction, options);
  return run(problem, {{{false, 0}, {true, 0}, {true, 0}}, 0}, N, options, progress);
}

SolidMarch march_solid_axially(const ZoneInput& in, int direction, const SolidOptions& options,
                               const Progress& progress) {
  if (direction != 1 && direction != -1) throw InputError("E616", "the direction of an elongation must be 1 or -1");
  Problem problem = make_zone_problem(in, 0, direction, options);
  problem.driven = 0, problem.cross = -1, problem.scale = in.length, problem.edge = 0;
  problem.name = "shortening over length";
  return run(problem, {{{true, 0}, {true, 0}, {true, 0}}, 0}, 0, options, progress);
}

SolidFamily make_solid_family(const ZoneInput& in, const std::vector<double>& normal_forces,
                              const std::vector<double>& rotations, double axis_angle, int direction,
                              const SolidOptions& options, const Progress& progress) {
  const auto rises = [](const std::vector<double>& v) {
    return !v.empty() && std::adjacent_find(v.begin(), v.end(), std::greater_equal<>()) == v.end();
  };
  if (!rises(normal_forces)) throw InputError("E616", "the normal forces of a family must rise");
  if (!rises(rotations) || rotations.front() != 0 || rotations.size() < 2)
    throw InputError("E616", "the rotations of a family must rise from 0");
  SolidFamily out;
  out.family.normal_force = normal_forces, out.family.rotation = rotations;
  SolidOptions to_the_end = options;
  to_the_end.largest_rotation = rotations.back(), to_the_end.path.clear();
  for (size_t k = 0; k < normal_forces.size(); ++k) {
    Progress part;
    part.cancel = progress.cancel;
    if (progress.report)
      part.report = [&](double done, double whole) {
        progress.report(static_cast<double>(k) + done / whole, static_cast<double>(normal_forces.size()));
      };
    out.marches.push_back(march_solid(in, normal_forces[k], axis_angle, direction, to_the_end, part));
    const SolidMarch& m = out.marches.back();
    size_t j = 1;
    for (const double r : rotations) {
      while (j < m.rotation.size() && m.rotation[j] < r * (1 - 1e-12)) ++j;
      double M = 0;
      if (r > 0 && j < m.rotation.size()) {
        const double w = (r - m.rotation[j - 1]) / (m.rotation[j] - m.rotation[j - 1]);
        M = std::max(0.0, (1 - w) * m.moment[j - 1] + w * m.moment[j]);
      }
      out.family.moment.push_back(M);
    }
    out.family.yield_rotation.push_back(m.yield_rotation), out.family.yield_moment.push_back(m.yield_moment);
  }
  return out;
}

AxialCurve make_axial_curve(const SolidMarch& m, double EA, double length) {
  AxialCurve out;
  const double peak = *std::max_element(m.moment.begin(), m.moment.end());
  double offset = 0;
  for (size_t j = 1; j < m.moment.size(); ++j) {
    const double plastic = length * m.rotation[j] - m.moment[j] * length / EA;
    if (out.displacement.empty()) {
      if (m.moment[j] < 0.75 * peak) continue;
      offset = plastic;
    } else if (plastic - offset <= out.displacement.back()) {
      continue;
    }
    out.displacement.push_back(plastic - offset), out.force.push_back(std::max(0.0, m.moment[j]));
  }
  return out;
}

double calc_slip_length(const ZoneInput& in) {
  double most = 0;
  for (const product::Bar& b : in.section.bars) most = std::max(most, b.diameter);
  return 0.022 * in.steel.fy / unit::MPa * most;
}

SolidMarch march_cantilever(const CantileverInput& in, const SolidOptions& options, const Progress& progress) {
  if (!(in.length > 0) || !std::isfinite(in.length))
    throw InputError("E616", "the length of a cantilever must be positive");
  Problem problem;
  ZoneInput zone = in.zone;
  zone.length = in.length;
  const double size = choose_size(zone, options);
  // Finer in the part where it will yield, twice as long above.
  const double fine = std::min(in.length, 1.5 * zone.section.height);
  SolidMeshInput wanted;
  wanted.length = in.length, wanted.across = size, wanted.size = {size}, wanted.to = {in.length};
  if (fine < 0.8 * in.length) wanted.size = {size, 2 * size}, wanted.to = {fine, in.length};
  const double hinge = in.zone.length > 0 ? in.zone.length : calc_hinge_length(in.zone, in.length);
  wanted.crushing_length = options.crushing_length > 0 ? options.crushing_length : hinge;
  if (in.founded) wanted.foundation = std::max(zone.section.width, zone.section.height);
  if (in.bars_slip) wanted.slip_length = calc_slip_length(zone);
  problem.mesh = make_solid_mesh(zone, wanted);
  fem::Model& model = problem.mesh.model;
  const int last = static_cast<int>(problem.mesh.x.size()) - 1, ny = static_cast<int>(problem.mesh.y.size()),
            nz = static_cast<int>(problem.mesh.z.size());
  // Controls: sideways and along the member at the top, and its rotation.
  model.control_length = {1, 1, 0.5 * zone.section.height};
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j) {
      const int foot = 3 * problem.mesh.node(0, j, k), top = 3 * problem.mesh.node(last, j, k);
      if (!(wanted.foundation > 0))
        for (int d = 0; d < 3; ++d) model.links[foot + d] = {};
      model.links[top] = {{1, 1}, {2, problem.mesh.z[static_cast<size_t>(k)]}};
      model.links[top + 1] = {};
      model.links[top + 2] = {{0, 1}};
    }
  for (const int b : problem.mesh.bedding)
    for (int d = 0; d < 3; ++d) model.links[3 * b + d] = {};
  for (const int a : problem.mesh.anchors)
    for (int d = 0; d < 3; ++d) model.links[3 * a + d] = {};
  problem.spring = in.N / in.length;
  problem.axial = 1, problem.driven = 0, problem.sign = 1, problem.scale = in.length, problem.fy = zone.steel.fy;
  problem.cut_at = find_middle(problem.mesh.x, 0);
  problem.name = "drift";
  return run(problem, {{{true, 0}, {false, 0}, {false, 0}}, 0}, in.N, options, progress);
}

}  // namespace topple::nearfield
