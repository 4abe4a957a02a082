#include "nearfield/solid_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "base/error.h"
#include "material/solid_concrete.h"
#include "nearfield/fibres.h"
#include "nearfield/zone.h"

namespace topple::nearfield {

namespace {

constexpr double pi = 3.14159265358979323846;

/// Concrete as the elements ask for it: extrapolated within a step (IMPL-EX), its history found when it is accepted.
class ConcreteLaw final : public fem::SolidLaw {
 public:
  explicit ConcreteLaw(const material::SolidConcrete& c) : concrete_(c) {}
  int size() const override { return static_cast<int>(sizeof(State) / sizeof(double)); }
  fem::PointResponse advance(const double* old, const fem::Voigt& strain, double step_ratio,
                             double* now) const override {
    const State& before = *reinterpret_cast<const State*>(old);
    const material::SolidUpdate u = material::calc_implex(concrete_, before, strain, step_ratio);
    std::copy(old, old + size(), now);
    return {u.response.stress, u.response.tangent, u.response.secant, u.converged};
  }
  bool extrapolates() const override { return true; }
  bool finish(const double* old, const fem::Voigt& strain, double* now, fem::Voigt& stress) const override {
    const material::SolidUpdate u =
        material::advance(concrete_, *reinterpret_cast<const State*>(old), strain, *reinterpret_cast<State*>(now));
    stress = u.response.stress;
    return u.converged;
  }
  double lateral() const override { return 0; }

 private:
  using State = material::SolidConcreteState;
  static_assert(std::is_trivially_copyable_v<State> && sizeof(State) % sizeof(double) == 0);
  material::SolidConcrete concrete_;
};

/// Crushing looks at the mean over `length` along the member: every point's largest compressive strain, and its growth,
/// become the mean over the part of that length around it that lies within the member; docs/theory/solid.md (4).
class CrushingAverage {
 public:
  CrushingAverage(const std::vector<double>& x, int lines, double length) : lines_(lines) {
    const size_t rows = x.size() - 1;
    const double whole = x.back() - x.front(), window = std::min(length, whole);
    for (size_t i = 0; i < rows; ++i)
      for (int side = 0; side < 2; ++side) {
        const double at = place(x, i, side);
        const double from = std::clamp(at - 0.5 * window, x.front(), x.back() - window), to = from + window;
        std::vector<double> w(2 * rows);
        for (size_t r = 0; r < rows; ++r)
          for (size_t s = 0; s < 2; ++s) {
            // each point stands for its half of the element
            const double middle = 0.5 * (x[r] + x[r + 1]), a = s == 0 ? x[r] : middle, b = s == 0 ? middle : x[r + 1];
            w[2 * r + s] = std::max(0.0, std::min(b, to) - std::max(a, from)) / window;
          }
        weights_.push_back(std::move(w));
      }
  }
  /// Elements are in rows along x, one row after the other.
  void operator()(const fem::System& system, fem::State& state) const {
    const size_t n = weights_.size();
    std::vector<double> compression(n), step(n);
    for (int line = 0; line < lines_; ++line)
      for (int across = 0; across < 4; ++across) {
        const auto at = [&](size_t i) {
          const int hex = line * static_cast<int>(n / 2) + static_cast<int>(i / 2);
          const int point = 2 * across + static_cast<int>(i % 2);  // bit 0 is the sign of ξ, along x
          return reinterpret_cast<material::SolidConcreteState*>(system.history(state, hex, point));
        };
        for (size_t i = 0; i < n; ++i) compression[i] = at(i)->compression, step[i] = at(i)->compression_step;
        for (size_t i = 0; i < n; ++i) {
          double c = 0, s = 0;
          for (size_t j = 0; j < n; ++j) c += weights_[i][j] * compression[j], s += weights_[i][j] * step[j];
          at(i)->compression = c, at(i)->compression_step = s;
        }
      }
  }

 private:
  static double place(const std::vector<double>& x, size_t i, int side) {
    const double half = 0.5 * (x[i + 1] - x[i]);
    return x[i] + half * (1 + (side == 0 ? -1 : 1) / std::sqrt(3.0));
  }
  int lines_ = 0;
  std::vector<std::vector<double>> weights_;  // of each point along a line on all others
};

/// Lines from `from` to `to` through all of `through`, no two farther apart than `size`. Lines closer than a quarter
/// of it are one, in their middle.
std::vector<double> make_lines(double from, double to, std::vector<double> through, double size) {
  std::sort(through.begin(), through.end());
  std::vector<double> fixed{from};
  for (size_t i = 0; i < through.size();) {
    size_t end = i;
    double sum = 0;
    while (end < through.size() && through[end] - through[i] < 0.25 * size) sum += through[end++];
    const double at = sum / static_cast<double>(end - i);
    if (at - fixed.back() > 1e-9 && to - at > 1e-9) fixed.push_back(at);
    i = end;
  }
  fixed.push_back(to);
  std::vector<double> out;
  for (size_t i = 0; i + 1 < fixed.size(); ++i) {
    const double gap = fixed[i + 1] - fixed[i];
    const int n = std::max(1, static_cast<int>(std::ceil(gap / size - 1e-9)));
    for (int k = 0; k < n; ++k) out.push_back(fixed[i] + gap * k / n);
  }
  out.push_back(to);
  return out;
}

/// Distances that double from `first` on until `end`.
std::vector<double> make_growing(double first, double end) {
  std::vector<double> out;
  double at = first, step = first;
  while (at < end - 0.5 * step) out.push_back(at), step *= 2, at += step;
  out.push_back(end);
  return out;
}

/// An elastic block under the foot that shares its nodes.
void add_foundation(SolidMesh& mesh, double depth, double size, double E, double nu) {
  fem::Mesh& m = mesh.model.mesh;
  const auto widen = [&](const std::vector<double>& lines) {
    std::vector<double> out = lines;
    for (const double d : make_growing(size, 0.5 * depth)) {
      out.insert(out.begin(), lines.front() - d);
      out.push_back(lines.back() + d);
    }
    return out;
  };
  const std::vector<double> y = widen(mesh.y), z = widen(mesh.z);
  std::vector<double> x{0};
  for (const double d : make_growing(size, depth)) x.insert(x.begin(), -d);
  const int top = static_cast<int>(x.size()) - 1, off_y = static_cast<int>(y.size() - mesh.y.size()) / 2,
            off_z = static_cast<int>(z.size() - mesh.z.size()) / 2;
  const fem::Mesh block = fem::make_grid(x, y, z);
  std::vector<int> index;
  size_t n = 0;
  for (int k = 0; k < static_cast<int>(z.size()); ++k)
    for (int j = 0; j < static_cast<int>(y.size()); ++j)
      for (int i = 0; i <= top; ++i, ++n) {
        const int jj = j - off_y, kk = k - off_z;
        const bool shared = i == top && jj >= 0 && jj < static_cast<int>(mesh.y.size()) && kk >= 0 &&
                            kk < static_cast<int>(mesh.z.size());
        index.push_back(shared ? mesh.node(0, jj, kk) : static_cast<int>(m.nodes.size()));
        if (!shared) m.nodes.push_back(block.nodes[n]);
        if (i == 0) mesh.bedding.push_back(index.back());
      }
  const int law = static_cast<int>(mesh.model.solids.size());
  mesh.model.solids.push_back(fem::make_elastic(E, nu));
  for (fem::Hex hex : block.hexes) {
    for (int& i : hex.node) i = index[static_cast<size_t>(i)];
    hex.law = law;
    m.hexes.push_back(hex);
  }
}

int nearest(const std::vector<double>& lines, double at) {
  size_t best = 0;
  for (size_t i = 0; i < lines.size(); ++i)
    if (std::abs(lines[i] - at) < std::abs(lines[best] - at)) best = i;
  return static_cast<int>(best);
}

}  // namespace

SolidMesh make_solid_mesh(const ZoneInput& in, const SolidMeshInput& wanted) {
  check_zone(in);
  const product::Section& s = in.section;
  const auto complain = [&](const std::string& what, const std::string& help = {}) {
    throw InputError("E615", "section '" + s.name + "': " + what, help);
  };
  if (in.concrete_loss >= 1 || in.cut_concrete >= 1) complain("no concrete is left for a solid model");
  SolidMesh out;

  // Without its cover the member ends at the centre line of its ties.
  const double lost = in.cover_lost ? s.cover + 0.5 * s.tie_diameter : 0;
  const double half_y = 0.5 * s.width - lost, half_z = 0.5 * s.height - lost;
  if (!(half_y > 0) || !(half_z > 0)) complain("nothing is left within the ties");
  std::vector<double> at_y, at_z;
  for (const product::Bar& bar : s.bars) at_y.push_back(bar.y), at_z.push_back(bar.z);
  out.y = make_lines(-half_y, half_y, at_y, wanted.across);
  out.z = make_lines(-half_z, half_z, at_z, wanted.across);

  // As many ties as whole spacings come nearest to the length, each in the middle of its share; their area makes up for
  // what the spacing was changed.
  const bool tied = !in.cover_lost && s.tie_diameter > 0 && s.tie_spacing > 0 && !s.bars.empty();
  std::vector<double> at_x;
  double tie_share = 1;
  if (tied) {
    const int n = std::max(1, static_cast<int>(std::lround(wanted.length / s.tie_spacing)));
    for (int i = 0; i < n; ++i) at_x.push_back((i + 0.5) * wanted.length / n);
    tie_share = wanted.length / n / s.tie_spacing;
  }
  double from = 0;
  for (size_t part = 0; part < wanted.to.size(); ++part) {
    const double to = part + 1 == wanted.to.size() ? wanted.length : wanted.to[part];
    std::vector<double> within;
    for (const double x : at_x)
      if (x > from + 0.25 * wanted.size[part] && x < to - 0.25 * wanted.size[part]) within.push_back(x);
    const std::vector<double> lines = make_lines(from, to, within, wanted.size[part]);
    out.x.insert(out.x.end(), lines.begin() + (part > 0 ? 1 : 0), lines.end());
    from = to;
  }

  fem::Mesh& mesh = out.model.mesh;
  mesh = fem::make_grid(out.x, out.y, out.z);
  const int nx = static_cast<int>(out.x.size()), ny = static_cast<int>(out.y.size()),
            nz = static_cast<int>(out.z.size());

  if (wanted.crushing_length > 0)
    out.model.smooth = CrushingAverage(out.x, (ny - 1) * (nz - 1), wanted.crushing_length);

  // One law for each length of elements.
  const material::ConcreteInput plain = make_concrete_input(in);
  std::map<long long, int> law_of;
  for (fem::Hex& hex : mesh.hexes) {
    const double l = mesh.nodes[static_cast<size_t>(hex.node[1])].x - mesh.nodes[static_cast<size_t>(hex.node[0])].x;
    const auto [place, is_new] = law_of.try_emplace(std::llround(l * 1e9), static_cast<int>(out.model.solids.size()));
    hex.law = place->second;
    hex.fill = 1 - in.cut_concrete;
    if (!is_new) continue;
    material::SolidConcreteInput input;
    input.uniaxial = plain;
    input.uniaxial.l_eq = std::max(l, wanted.crushing_length);
    input.l_eq_tension = l;
    out.concrete.push_back(material::make_solid_concrete(input));
    out.model.solids.push_back(std::make_shared<ConcreteLaw>(out.concrete.back()));
  }

  // Longitudinal bars; each takes its place in the elements around it.
  const auto element_at = [&](int i, int j, int k) -> fem::Hex& {
    return mesh.hexes[static_cast<size_t>(i + (nx - 1) * (j + (ny - 1) * k))];
  };
  std::map<double, int> steel_of;
  for (size_t b = 0; b < s.bars.size(); ++b) {
    const product::Bar& bar = s.bars[b];
    const double area = (1 - in.cut_bars) * bar.area;
    if (!(area > 0)) continue;
    const auto [place, is_new] = steel_of.try_emplace(bar.diameter, static_cast<int>(out.model.steels.size()));
    if (is_new) out.model.steels.push_back(make_bar(in, bar.diameter));
    const int j = nearest(out.y, bar.y), k = nearest(out.z, bar.z);
    for (int i = 0; i + 1 < nx; ++i) {
      int start = out.node(i, j, k);
      if (i == 0 && wanted.slip_length > 0) {
        start = static_cast<int>(mesh.nodes.size());
        const Vec3 foot = mesh.nodes[static_cast<size_t>(out.node(0, j, k))];
        mesh.nodes.push_back({foot.x - wanted.slip_length, foot.y, foot.z});
        out.anchors.push_back(start);
      }
      mesh.bars.push_back({{start, out.node(i + 1, j, k)}, area, place->second});
      out.bar_of.push_back(static_cast<int>(b));
      std::vector<fem::Hex*> around;
      for (const int jj : {j - 1, j})
        for (const int kk : {k - 1, k})
          if (jj >= 0 && jj + 1 < ny && kk >= 0 && kk + 1 < nz) around.push_back(&element_at(i, jj, kk));
      for (fem::Hex* hex : around) {
        const Vec3 d = mesh.nodes[static_cast<size_t>(hex->node[6])] - mesh.nodes[static_cast<size_t>(hex->node[0])];
        hex->fill -= (1 - in.cut_concrete) * area / static_cast<double>(around.size()) / (d.y * d.z);
        if (!(hex->fill > 0.05)) complain("bars fill an element of the mesh", "use larger elements");
      }
    }
  }

  if (tied) {
    // Loops through the axes of the outer bars, inner legs at the lines nearest to equal distances.
    double y_most = 0, z_most = 0;
    for (const product::Bar& bar : s.bars)
      y_most = std::max(y_most, std::abs(bar.y)), z_most = std::max(z_most, std::abs(bar.z));
    const int steel = static_cast<int>(out.model.steels.size());
    material::SteelInput tie;
    tie.fy = in.steel.fy, tie.fu = in.steel.fu, tie.Es = in.steel.Es, tie.eps_u = in.steel.eps_u;
    out.model.steels.push_back(material::make_steel(tie));
    const double area = tie_share * 0.25 * pi * s.tie_diameter * s.tie_diameter;
    const int j0 = nearest(out.y, -y_most), j1 = nearest(out.y, y_most), k0 = nearest(out.z, -z_most),
              k1 = nearest(out.z, z_most);
    const auto add = [&](int a, int b) {
      mesh.bars.push_back({{a, b}, area, steel});
      out.bar_of.push_back(-1);
    };
    // Lines on which legs run: the outer ones and the inner ones, nearest to a bar.
    const auto make_legs = [](const std::vector<double>& lines, int first, int last, int legs) {
      std::vector<int> at{first};
      for (int l = 1; l + 1 < legs; ++l)
        at.push_back(nearest(
            lines, lines[static_cast<size_t>(first)] +
                       (lines[static_cast<size_t>(last)] - lines[static_cast<size_t>(first)]) * l / (legs - 1)));
      at.push_back(last);
      return at;
    };
    for (const double x : at_x) {
      const int i = nearest(out.x, x);
      if (i == 0 || i + 1 == nx) continue;
      for (const int k : make_legs(out.z, k0, k1, s.tie_legs_y))
        for (int j = j0; j < j1; ++j) add(out.node(i, j, k), out.node(i, j + 1, k));
      for (const int j : make_legs(out.y, j0, j1, s.tie_legs_z))
        for (int k = k0; k < k1; ++k) add(out.node(i, j, k), out.node(i, j, k + 1));
    }
  }
  if (wanted.foundation > 0) add_foundation(out, wanted.foundation, wanted.across, plain.Ec, out.concrete.front().nu);
  return out;
}

}  // namespace topple::nearfield
