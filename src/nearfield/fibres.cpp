#include "nearfield/fibres.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "nearfield/section_kernel.h"

namespace topple::nearfield {

namespace {

/// A share of the areas that is left; something must stay for the arithmetic.
double left_over(double lost) { return std::max(0.0, 1 - lost); }

struct Frame {
  double depth = 0, breadth = 0;            // along the gradient and across it
  double core_depth = 0, core_breadth = 0;  // between the centre lines of the ties
};

Frame make_frame(const ZoneInput& in, Axis axis) {
  const product::Section& s = in.section;
  const double edge = 2 * (s.cover + 0.5 * s.tie_diameter);
  Frame f;
  f.depth = axis == Axis::Y ? s.height : s.width;
  f.breadth = axis == Axis::Y ? s.width : s.height;
  f.core_depth = f.depth - edge;
  f.core_breadth = f.breadth - edge;
  return f;
}

/// Layers from `from` to `to`.
///   cover_area  of a layer between two places [m²]
template <typename F>
void add_layers(Fibres& out, int count, double from, double to, double core_breadth, F cover_area) {
  const double t = (to - from) / count;
  for (int i = 0; i < count; ++i) {
    out.at.push_back(from + (i + 0.5) * t);
    out.core_area.push_back(t * core_breadth);
    out.cover_area.push_back(cover_area(from + i * t, t));
  }
}

/// A bar in a slab, which does not let it buckle.
material::Steel make_flange_bar(const product::Steel& s) {
  material::SteelInput steel;
  steel.fy = s.fy, steel.fu = s.fu, steel.Es = s.Es, steel.eps_u = s.eps_u;
  return material::make_steel(steel);
}

}  // namespace

material::ConcreteInput make_concrete_input(const ZoneInput& in) {
  const double kept = std::max(0.01, left_over(in.concrete_loss));
  material::ConcreteInput c;
  c.fc = kept * in.concrete.fc;
  c.fct = kept * in.concrete.fct;
  c.Ec = kept * in.concrete.Ec;
  c.eps_c1 = in.concrete.eps_c1;
  c.Gf = kept * in.concrete.Gf;
  c.Gcl = kept * in.concrete.Gcl;
  c.l_eq = in.length;
  return c;
}

double calc_tie_stress(const ZoneInput& in) {
  const product::Section& s = in.section;
  if (in.cover_lost || s.tie_diameter <= 0 || s.tie_spacing <= 0) return 0;
  const double edge = 2 * (s.cover + 0.5 * s.tie_diameter), b = s.width - edge, h = s.height - edge;
  if (b <= 0 || h <= 0 || s.tie_spacing >= 2 * std::min(b, h)) return 0;
  const double bar = 0.25 * 3.14159265358979323846 * s.tie_diameter * s.tie_diameter;
  const double ratio_y = s.tie_legs_y * bar / (s.tie_spacing * h), ratio_z = s.tie_legs_z * bar / (s.tie_spacing * b);
  // Arches between held bars: legs along z stand side by side along the width, and the other way round.
  const double gaps = 2 * b * b / std::max(1, s.tie_legs_z - 1) + 2 * h * h / std::max(1, s.tie_legs_y - 1);
  const double in_plane = std::max(0.0, 1 - gaps / (6 * b * h));
  const double along = (1 - s.tie_spacing / (2 * b)) * (1 - s.tie_spacing / (2 * h));
  return in_plane * along * std::min(ratio_y, ratio_z) * in.steel.fy;
}

material::Steel make_bar(const ZoneInput& in, double diameter) {
  material::SteelInput steel;
  steel.fy = in.steel.fy, steel.fu = in.steel.fu, steel.Es = in.steel.Es, steel.eps_u = in.steel.eps_u;
  // Without ties bars are free over the whole zone.
  const double spacing = in.section.tie_spacing;
  steel.free_length = spacing > 0 && in.section.tie_diameter > 0 ? std::min(spacing, in.length) : in.length;
  if (in.free_bars > 0) steel.free_length = in.free_bars;
  steel.diameter = diameter;
  return material::make_steel(steel);
}

Fibres make_fibres(const ZoneInput& in, Axis axis) {
  const Frame f = make_frame(in, axis);
  Fibres out;
  out.half_depth = 0.5 * f.depth;
  if (in.cover_lost && f.core_depth > 0 && f.core_breadth > 0) out.lost = 0.5 * (f.depth - f.core_depth);
  material::ConcreteInput plain = make_concrete_input(in);
  out.cover = material::make_concrete(plain);
  out.core = material::make_concrete(material::confine(plain, {calc_tie_stress(in)}));

  const double kept = in.concrete_loss >= 1 ? 0 : left_over(in.cut_concrete);
  out.kept = kept;
  const double cover_kept = in.cover_lost ? 0 : kept;
  constexpr int core_layers = 32, cover_layers = 4;
  const bool has_flange = axis == Axis::Y && in.flange.breadth > 0;
  const auto cover = [&](double breadth) {
    return [&, breadth](double from, double t) {
      double area = t * cover_kept * breadth;
      if (has_flange)
        area += std::clamp(from + t - (0.5 * f.depth - in.flange.thickness), 0.0, t) * cover_kept * in.flange.breadth;
      return area;
    };
  };
  if (f.core_depth > 0 && f.core_breadth > 0) {
    const double a = 0.5 * f.depth, c = 0.5 * f.core_depth;
    if (cover_kept > 0) add_layers(out, cover_layers, -a, -c, 0, cover(f.breadth));
    add_layers(out, core_layers, -c, c, kept * f.core_breadth, cover(f.breadth - f.core_breadth));
    if (cover_kept > 0) add_layers(out, cover_layers, c, a, 0, cover(f.breadth));
  } else {
    add_layers(out, core_layers, -0.5 * f.depth, 0.5 * f.depth, 0, cover(f.breadth));
  }

  std::vector<double> diameters;
  const double bars_kept = left_over(in.cut_bars);
  for (const product::Bar& bar : in.section.bars) {
    const double at = axis == Axis::Y ? bar.z : bar.y;
    size_t row = 0;
    while (row < out.bar_at.size() && !(std::abs(out.bar_at[row] - at) < 1e-9 && diameters[row] == bar.diameter)) ++row;
    if (row == out.bar_at.size()) {
      out.bar_at.push_back(at);
      out.bar_area.push_back(0);
      out.bar_law.push_back(make_bar(in, bar.diameter));
      diameters.push_back(bar.diameter);
    }
    out.bar_area[row] += bars_kept * bar.area;
    out.bar_row.push_back(row);
  }
  if (has_flange)
    for (const Flange::Bars& bars : {in.flange.top, in.flange.bottom}) {
      if (!(bars.area > 0)) continue;
      out.bar_at.push_back(0.5 * f.depth - bars.depth);
      out.bar_area.push_back(bars_kept * bars.area);
      out.bar_law.push_back(make_flange_bar(in.flange.steel));
    }
  return out;
}

namespace {

struct Point {
  double at = 0, across = 0;
};

/// Area and centroid of what a convex polygon has between `from` and `to` along `at`.
struct Strip {
  double area = 0, across = 0;
};
Strip cut_strip(std::vector<Point> polygon, double from, double to) {
  for (const double side : {1.0, -1.0}) {  // keep at >= from, then at <= to
    const double limit = side > 0 ? from : to;
    std::vector<Point> kept;
    for (size_t i = 0; i < polygon.size(); ++i) {
      const Point &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      const double da = side * (a.at - limit), db = side * (b.at - limit);
      if (da >= 0) kept.push_back(a);
      if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
        const double s = da / (da - db);
        kept.push_back({a.at + s * (b.at - a.at), a.across + s * (b.across - a.across)});
      }
    }
    polygon = std::move(kept);
  }
  double area = 0, moment = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Point &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double cross = a.at * b.across - b.at * a.across;
    area += 0.5 * cross, moment += cross * (a.across + b.across) / 6;
  }
  if (std::abs(area) < 1e-12) return {};
  return {std::abs(area), moment / area};
}

}  // namespace

Fibres make_fibres(const ZoneInput& in, double angle) {
  // Materials and losses are those of bending about y; bars come one by one.
  Fibres out = make_fibres(in, Axis::Y);
  const Frame f = make_frame(in, Axis::Y);
  const double c = std::cos(angle), s = std::sin(angle);
  const auto place = [&](double y, double z) { return Point{z * c - y * s, -z * s - y * c}; };
  const auto corners = [&](double breadth, double depth) {
    std::vector<Point> p;
    for (const auto& [i, j] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
      p.push_back(place(0.5 * i * breadth, 0.5 * j * depth));
    return p;
  };
  const auto extent = [](const std::vector<Point>& p) {
    double most = 0;
    for (const Point& q : p) most = std::max(most, q.at);
    return most;
  };
  const bool has_core = f.core_depth > 0 && f.core_breadth > 0;
  const std::vector<Point> whole = corners(f.breadth, f.depth);
  const std::vector<Point> core = has_core ? corners(f.core_breadth, f.core_depth) : std::vector<Point>{};
  const double outer = extent(whole), inner = has_core ? extent(core) : outer;
  const double kept = in.concrete_loss >= 1 ? 0 : left_over(in.cut_concrete);
  out.kept = kept;
  const double cover_kept = in.cover_lost ? 0 : kept;
  out.half_depth = outer;
  out.lost = in.cover_lost ? outer - inner : 0;
  for (auto* v : {&out.at, &out.core_area, &out.cover_area}) v->clear();
  const auto add_strips = [&](int count, double from, double to) {
    const double t = (to - from) / count;
    for (int i = 0; i < count; ++i) {
      const double a = from + i * t, b = from + (i + 1) * t;
      const Strip w = cut_strip(whole, a, b), k = has_core ? cut_strip(core, a, b) : Strip{};
      const double beside = w.area - k.area;
      out.at.push_back(0.5 * (a + b));
      out.core_area.push_back(kept * k.area), out.core_across.push_back(k.across);
      out.cover_area.push_back(beside > 1e-12 ? cover_kept * beside : 0);
      out.cover_across.push_back(beside > 1e-12 ? (w.area * w.across - k.area * k.across) / beside : 0);
    }
  };
  constexpr int core_layers = 32, cover_layers = 4;
  if (has_core) add_strips(cover_layers, -outer, -inner);
  add_strips(core_layers, -inner, inner);
  if (has_core) add_strips(cover_layers, inner, outer);

  out.bar_at.clear(), out.bar_area.clear(), out.bar_law.clear(), out.bar_row.clear();
  for (const product::Bar& bar : in.section.bars) {
    const Point p = place(bar.y, bar.z);
    out.bar_at.push_back(p.at), out.bar_across.push_back(p.across);
    out.bar_area.push_back(left_over(in.cut_bars) * bar.area);
    out.bar_law.push_back(make_bar(in, bar.diameter));
  }
  return out;
}

namespace {

material::SteelResponse calc_bar(const Fibres& f, const BarStates& bars, size_t i, double eps) {
  return material::calc_response(f.bar_law[i], bars.empty() ? material::SteelState{} : bars[i], eps);
}

}  // namespace

double calc_cross_moment(const Fibres& f, double eps_0, double kappa, const BarStates& bars) {
  double M = 0;
  for (size_t i = 0; i < f.at.size(); ++i) {
    const double eps = eps_0 + kappa * f.at[i];
    if (f.core_area[i] > 0) M += f.core_area[i] * f.core_across[i] * material::calc_envelope(f.core, eps).stress;
    if (f.cover_area[i] > 0) M += f.cover_area[i] * f.cover_across[i] * material::calc_envelope(f.cover, eps).stress;
  }
  const bool displaces = has_concrete(f);
  for (size_t i = 0; i < f.bar_at.size(); ++i) {
    const double eps = eps_0 + kappa * f.bar_at[i];
    double stress = calc_bar(f, bars, i, eps).stress;
    if (displaces) stress -= f.kept * material::calc_envelope(f.core, eps).stress;
    M += f.bar_area[i] * f.bar_across[i] * stress;
  }
  return M;
}

bool has_concrete(const Fibres& f) { return !f.at.empty() && f.core_area[f.at.size() / 2] > 0; }

Resultants calc_resultants(const Fibres& f, double eps_0, double kappa, const BarStates& bars) {
  Resultants r;
  const auto add = [&](double at, double force, double stiffness) {
    r.N += force, r.M += force * at;
    r.dN += stiffness, r.dM += stiffness * at, r.dM_kappa += stiffness * at * at;
  };
  const size_t layers = f.at.size();
  for (size_t i = 0; i < layers; ++i) {
    const double eps = eps_0 + kappa * f.at[i];
    if (f.core_area[i] > 0) {
      const material::Response a = material::calc_envelope(f.core, eps);
      add(f.at[i], f.core_area[i] * a.stress, f.core_area[i] * a.tangent);
    }
    if (f.cover_area[i] > 0) {
      const material::Response a = material::calc_envelope(f.cover, eps);
      add(f.at[i], f.cover_area[i] * a.stress, f.cover_area[i] * a.tangent);
    }
  }
  const size_t rows = f.bar_at.size();
  const bool displaces = has_concrete(f);
  for (size_t i = 0; i < rows; ++i) {
    const double eps = eps_0 + kappa * f.bar_at[i];
    const material::SteelResponse s = calc_bar(f, bars, i, eps);
    double stress = s.stress, tangent = s.tangent;
    if (displaces) {  // the bar stands where the layers have counted concrete
      const material::Response a = material::calc_envelope(f.core, eps);
      stress -= f.kept * a.stress, tangent -= f.kept * a.tangent;
    }
    add(f.bar_at[i], f.bar_area[i] * stress, f.bar_area[i] * tangent);
  }
  return r;
}

namespace {

/// Scale of forces for tolerances [N].
double calc_force_scale(const Fibres& f) {
  double scale = 0;
  for (size_t i = 0; i < f.at.size(); ++i) scale += f.core_area[i] * f.core.fc + f.cover_area[i] * f.cover.fc;
  for (size_t i = 0; i < f.bar_at.size(); ++i) scale += f.bar_area[i] * f.bar_law[i].fy;
  return scale;
}

struct Search {
  double N = 0, tolerance = 0;
};

/// Newton's method between two strains with equilibrium between them, bisection where it leaves or stalls.
///   e, r  one of them and its resultants; then those of equilibrium
void close_in(const PackedSection& f, const Search& search, double kappa, double other, double& e, Resultants& r) {
  double low = std::min(e, other), high = std::max(e, other), residual = r.N - search.N;
  for (int i = 0; i < 80; ++i) {
    double next = r.dN > 0 ? e - residual / r.dN : low - 1;
    if (!(next > low && next < high) || i % 6 == 5) next = 0.5 * (low + high);
    e = next;
    r = calc_resultants(f, e, kappa);
    residual = r.N - search.N;
    if (std::abs(residual) <= search.tolerance || high - low < 1e-13) break;
    (residual > 0 ? high : low) = e;
  }
}

/// The search of find_equilibrium, also giving the resultants there.
bool find(const PackedSection& f, const Search& search, double kappa, double& eps_0, Resultants& at) {
  constexpr double largest_strain = 0.6, largest_step = 2e-3, closest_step = 5e-5;
  double e = eps_0;
  Resultants r = calc_resultants(f, e, kappa);
  double residual = r.N - search.N;
  const auto done = [&] { return std::abs(residual) <= search.tolerance; };
  const auto accept = [&] {
    eps_0 = e, at = r;
    return true;
  };
  if (done()) return accept();
  // Close to equilibrium on a stable branch Newton's method is there in two steps.
  if (r.dN > 0) {
    double near = e, left = residual;
    Resultants there = r;
    for (int i = 0; i < 3; ++i) {
      const double step = -left / there.dN;
      if (std::abs(step) > closest_step) break;
      near += step;
      there = calc_resultants(f, near, kappa);
      const double before = left;
      left = there.N - search.N;
      if (!(there.dN > 0) || std::abs(left) > 0.5 * std::abs(before)) break;
      e = near, r = there, residual = left;
      if (done()) return accept();
    }
  }
  // Too much internal tension: the section shortens; too little: it lengthens. A bracket is found on the way.
  const double direction = residual > 0 ? -1 : 1;
  const auto crossed = [&] { return residual * direction > 0; };
  double step = 0, other = e;
  for (int i = 0; !crossed(); ++i) {
    const double newton = r.dN > 0 ? 1.05 * std::abs(residual) / r.dN : largest_step;
    step = std::min(std::max(newton, 1.5 * step), largest_step * (1 + 0.2 * i));
    const bool was_stable = r.dN > 0;
    other = e;
    e += direction * step;
    if (std::abs(e) > largest_strain || i > 400) return false;
    r = calc_resultants(f, e, kappa);
    residual = r.N - search.N;
    if (done()) return accept();
    if (crossed() || !was_stable || r.dN > 0) continue;
    // The step went over an extreme of N: equilibrium may lie just before it.
    const double beyond = e;
    const Resultants r_beyond = r;
    double stable = other, unstable = beyond;
    for (int k = 0; k < 24 && !crossed(); ++k) {
      e = 0.5 * (stable + unstable);
      r = calc_resultants(f, e, kappa);
      residual = r.N - search.N;
      if (done()) return accept();
      (r.dN > 0 ? stable : unstable) = e;
    }
    if (!crossed()) e = beyond, r = r_beyond, residual = r.N - search.N;
  }
  close_in(f, search, kappa, other, e, r);
  return accept();
}

constexpr double kBracket = 1.15;  // ratio of the strains between which a hill is looked for

/// The strain and the force of the hill of a compression between two strains, by golden section.
///   force  at a compressive strain
template <typename F>
Peak find_top(double a, double b, const F& force) {
  const double g = 0.6180339887498949;
  double c = b - g * (b - a), d = a + g * (b - a), Fc = force(c), Fd = force(d);
  for (int i = 0; i < 30; ++i) {
    if (Fc > Fd) {
      b = d, d = c, Fd = Fc, c = b - g * (b - a), Fc = force(c);
    } else {
      a = c, c = d, Fc = Fd, d = a + g * (b - a), Fd = force(d);
    }
  }
  const double strain = 0.5 * (a + b);
  return {force(strain), strain};
}

/// The first even strain that bears a compression, on the way from none. A cover that softens leaves two hills where
/// ties make the core bear more behind it, and the search above steps from one onto the other.
bool find_evenly(const PackedSection& f, const Search& search, double eps_c1, double& eps_0, Resultants& at) {
  constexpr double largest_strain = 0.3;
  double step = 0.05 * eps_c1, before = 0;
  Resultants last = calc_resultants(f, 0, 0);
  for (double e = -step; e > -largest_strain; e -= step) {
    Resultants r = calc_resultants(f, e, 0);
    double reached = e;
    if (r.N > search.N && last.dN > 0 && r.dN <= 0) {  // over the top of a hill
      reached = -find_top(-before, -e, [&](double strain) { return -calc_resultants(f, -strain, 0).N; }).strain;
      r = calc_resultants(f, reached, 0);
    }
    if (r.N <= search.N) {
      close_in(f, search, 0, before, reached, r);
      eps_0 = reached, at = r;
      return true;
    }
    last = reached == e ? r : calc_resultants(f, e, 0);
    before = e;
    if (-e > 3 * eps_c1) step *= 1.05;
  }
  return false;
}

/// Strains at which the force may have a sharp hill.
std::vector<double> list_bends(const Fibres& f) {
  std::vector<double> bends{f.cover.eps_c1, f.core.eps_c1};
  for (const material::Steel& law : f.bar_law) bends.push_back(law.eps_y);
  std::erase_if(bends, [](double bend) { return !(bend > 0); });
  return bends;
}

}  // namespace

bool find_equilibrium(const Fibres& f, double N, double kappa, double& eps_0, const BarStates& bars) {
  Resultants r;
  PackedSection packed = pack_section(f);
  set_bars(packed, bars.data(), bars.size());
  return find(packed, {N, 1e-9 * calc_force_scale(f)}, kappa, eps_0, r);
}

BarStates March::bars_at(size_t point) const {
  const size_t rows = bars.size() / eps_0.size();
  const auto first = bars.begin() + static_cast<std::ptrdiff_t>(point * rows);
  return {first, first + static_cast<std::ptrdiff_t>(rows)};
}

Peak find_crushing(const Fibres& f) {
  const PackedSection packed = pack_section(f);
  const auto force = [&](double e) { return -calc_resultants(packed, -e, 0).N; };
  Peak best;
  for (double e = 1e-5; e < 0.3; e *= kBracket)
    if (const double F = force(e); F > best.force) best = {F, e};
  if (best.strain <= 0) return {};
  if (const Peak top = find_top(best.strain / kBracket, best.strain * kBracket, force); top.force > best.force)
    best = top;
  const auto take = [&best](const Peak& p) {
    if (p.force > best.force * (1 + 1e-9)) best = p;
  };
  // the sharp hill of the cover or of the bars may lie between two strains of the grid
  for (const double bend : list_bends(f)) {
    take({force(bend), bend});
    take(find_top(bend / kBracket, bend * kBracket, force));
  }
  return best;
}

std::vector<Peak> find_hills_before(const Fibres& f, const Peak& crushing) {
  const PackedSection packed = pack_section(f);
  const auto force = [&](double e) { return -calc_resultants(packed, -e, 0).N; };
  const auto is_top = [&](const Peak& p) {
    return force(p.strain * (1 - 1e-3)) < p.force && force(p.strain * (1 + 1e-3)) < p.force;
  };
  std::vector<Peak> tops;
  for (const double bend : list_bends(f)) {
    for (const Peak& top : {Peak{force(bend), bend}, find_top(bend / kBracket, bend * kBracket, force)})
      if (top.strain < crushing.strain * (1 - 1e-2) && is_top(top)) tops.push_back(top);
  }
  std::sort(tops.begin(), tops.end(), [](const Peak& a, const Peak& b) { return a.strain < b.strain; });
  tops.push_back(crushing);
  std::vector<Peak> out;
  for (std::size_t i = 0; i + 1 < tops.size(); ++i) {
    if (tops[i + 1].strain < tops[i].strain * (1 + 1e-2)) continue;  // the same hill
    const Peak low = find_top(tops[i].strain, tops[i + 1].strain, [&](double e) { return -force(e); });
    out.push_back(tops[i]);
    out.push_back({-low.force, low.strain});
  }
  return out;
}

March march_curvature(const Fibres& f, double N, int direction, const std::vector<double>& kappa) {
  March out;
  out.moment.assign(kappa.size(), 0.0);
  const Search search{N, 1e-7 * calc_force_scale(f)};
  PackedSection packed = pack_section(f);
  double eps_0 = 0;
  Resultants r;
  bool is_found = find(packed, search, 0, eps_0, r);
  // not found, or not before the first hill that there may be
  if (N < 0 && has_concrete(f) && !(is_found && eps_0 > -0.9 * std::min(f.cover.eps_c1, f.core.eps_c1))) {
    double first = 0;
    Resultants there;
    if (find_evenly(packed, search, f.cover.eps_c1, first, there) && (!is_found || first > eps_0 + 1e-9))
      eps_0 = first, r = there, is_found = true;
  }
  if (!is_found) return out;

  // An unsymmetric section bends under N alone: start where M = 0, or at no curvature if it carries N with a moment
  // only.
  double origin = 0;
  const double moment_scale = calc_force_scale(f) * f.half_depth;
  if (std::abs(r.M) > 1e-9 * moment_scale) {
    const double even_eps_0 = eps_0;
    const Resultants even = r;
    double k0 = 0, M0 = r.M, k1 = (r.M > 0 ? -1 : 1) * 1e-5 / f.half_depth;
    for (int i = 0; i < 40; ++i) {
      Resultants r1;
      double e1 = eps_0;
      if (!find(packed, search, k1, e1, r1)) {
        k1 = 0.5 * (k0 + k1);
        if (std::abs(k1 - k0) < 1e-9 / f.half_depth) break;
        continue;
      }
      eps_0 = e1, origin = k1, r = r1;
      if (std::abs(r1.M) <= 1e-9 * moment_scale) break;
      const double slope = (r1.M - M0) / (k1 - k0);
      double step = slope > 0 ? -r1.M / slope : (r1.M > 0 ? -1 : 1) * 1e-4 / f.half_depth;
      step = std::clamp(step, -5e-4 / f.half_depth, 5e-4 / f.half_depth);
      k0 = k1, M0 = r1.M, k1 += step;
    }
    out.is_balanced = std::abs(r.M) <= 1e-4 * moment_scale;
    if (!out.is_balanced) origin = 0, eps_0 = even_eps_0, r = even;
  }

  out.origin = origin;
  out.eps_0.reserve(kappa.size());
  const size_t rows = f.bar_at.size();
  out.bars.reserve(kappa.size() * rows);
  BarStates bars(rows);
  const auto accept = [&](double e, double k) {
    out.eps_0.push_back(e);
    ++out.last;
    for (size_t i = 0; i < rows; ++i) material::advance(f.bar_law[i], bars[i], e + k * f.bar_at[i]);
    set_bars(packed, bars.data(), rows);
    out.bars.insert(out.bars.end(), bars.begin(), bars.end());
  };
  accept(eps_0, origin);

  // First yield: steel in tension, or the compressive strain of the peak at the edge of the concrete that is there.
  const auto yields = [&](double e, double k) {
    for (size_t i = 0; i < f.bar_at.size(); ++i)
      if (f.bar_area[i] > 0 && e + k * f.bar_at[i] > f.bar_law[i].eps_y) return true;
    return f.kept > 0 && e - std::abs(k) * (f.half_depth - f.lost) < -f.cover.eps_c1;
  };
  bool yielded = false;
  double previous_eps = eps_0, previous_slope = 0, previous_step = 1;
  // From the last point in small steps, if there is an equilibrium at all; bars that are strained on the way know of
  // it.
  const auto creep = [&](double from, double to, double start, double& e) {
    constexpr int steps = 64;
    e = start;
    if (!find(packed, search, to, e, r)) return false;
    e = previous_eps;
    for (int i = 1; i <= steps; ++i) {
      const double k = from + (to - from) * i / steps;
      if (!find(packed, search, k, e, r)) return false;
      for (size_t b = 0; b < rows; ++b) material::advance(f.bar_law[b], bars[b], e + k * f.bar_at[b]);
      set_bars(packed, bars.data(), rows);
    }
    return true;
  };
  for (size_t j = 1; j < kappa.size(); ++j) {
    const double k = origin + direction * kappa[j], step = kappa[j] - kappa[j - 1];
    // Warm start along the tangent and its last change while the branch is far from its end. Near it, where dN is
    // small, they lead anywhere.
    const double slope = r.dN > 0 ? -r.dM / r.dN : 0, ahead = direction * step;
    double led = previous_eps;
    if (r.dN > 0) led += ahead * (slope + (j > 1 ? 0.5 * ahead * (slope - previous_slope) / previous_step : 0));
    const bool is_far = std::abs(led - previous_eps) > std::max(1e-4, step * f.half_depth);
    double e = is_far ? previous_eps : led;
    const double other = is_far ? led : previous_eps;
    if (!find(packed, search, k, e, r) &&
        !(led != previous_eps && creep(origin + direction * kappa[j - 1], k, other, e)))
      break;
    out.moment[j] = std::max(0.0, direction * r.M);
    accept(e, k);
    if (!yielded && yields(e, k)) {
      // Bisection between the last two points, the strain taken linearly.
      double low = 0, high = 1;
      for (int i = 0; i < 30; ++i) {
        const double s = 0.5 * (low + high);
        const bool y = yields(previous_eps + s * (e - previous_eps), k - direction * (1 - s) * step);
        (y ? high : low) = s;
      }
      yielded = true;
      out.yield_kappa = kappa[j - 1] + high * step;
      out.yield_moment = out.moment[j - 1] + high * (out.moment[j] - out.moment[j - 1]);
    }
    previous_slope = slope, previous_step = ahead;
    previous_eps = e;
  }
  if (!out.is_balanced) {
    out.yield_kappa = out.yield_moment = 0;  // no moment is that of an elastic zone
    return out;
  }
  const double peak = *std::max_element(out.moment.begin(), out.moment.end());
  for (size_t j = 1; j < kappa.size() && peak > 0; ++j) {
    if (out.moment[j] < 0.75 * peak) continue;
    const double s = (0.75 * peak - out.moment[j - 1]) / (out.moment[j] - out.moment[j - 1]);
    const double at = kappa[j - 1] + s * (kappa[j] - kappa[j - 1]);
    if (!yielded || at < out.yield_kappa) out.yield_kappa = at, out.yield_moment = 0.75 * peak;
    break;
  }
  return out;
}

}  // namespace topple::nearfield
