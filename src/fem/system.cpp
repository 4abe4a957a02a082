#include "fem/system.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>

#include "base/error.h"
#include "base/parallel.h"

namespace topple::fem {

namespace {

using Strains = Eigen::Matrix<double, 6, 24>;
using Stiffness24 = Eigen::Matrix<double, 24, 24>;

constexpr size_t kChunk = 16;  // elements of one piece of a threaded loop

/// Shape of an element up to round-off, so that equal elements share their strain matrices.
std::vector<long long> make_key(const std::array<Vec3, 8>& nodes, double lateral) {
  double size = 0;
  for (const Vec3& n : nodes) size = std::max(size, norm(n - nodes[0]));
  std::vector<long long> key;
  for (const Vec3& n : nodes)
    for (int k = 0; k < 3; ++k) key.push_back(std::llround((n[k] - nodes[0][k]) / size * 1e10));
  // size to ten digits
  const double decade = std::floor(std::log10(size));
  key.push_back(static_cast<long long>(decade));
  key.push_back(std::llround(size / std::pow(10.0, decade) * 1e10));
  key.push_back(std::llround(lateral * 1e12));
  return key;
}

}  // namespace

System::Map System::make_map(const std::vector<int>& nodal) const {
  Map map;
  bool plain = true;
  for (const int d : nodal) {
    const auto& links = of_nodal_[static_cast<size_t>(d)];
    plain = plain && links.size() == 1 && links[0].factor == 1;
    for (const Share& l : links) map.unknown.push_back(l.unknown);
  }
  if (plain) {
    std::vector<int> sorted = map.unknown;
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end()) return map;
  }
  std::sort(map.unknown.begin(), map.unknown.end());
  map.unknown.erase(std::unique(map.unknown.begin(), map.unknown.end()), map.unknown.end());
  const size_t n = map.unknown.size();
  map.T.assign(nodal.size() * n, 0.0);
  for (size_t r = 0; r < nodal.size(); ++r)
    for (const Share& l : of_nodal_[static_cast<size_t>(nodal[r])]) {
      const auto c = std::lower_bound(map.unknown.begin(), map.unknown.end(), l.unknown) - map.unknown.begin();
      map.T[r * n + static_cast<size_t>(c)] += l.factor;
    }
  return map;
}

System::System(Model model) : model_(std::move(model)) {
  const auto complain = [](const std::string& what) { throw InputError("E654", what); };
  const Mesh& mesh = model_.mesh;
  check_mesh(mesh);
  const int nodal = 3 * static_cast<int>(mesh.nodes.size()), count = controls();
  for (const Hex& h : mesh.hexes)
    if (h.law < 0 || h.law >= static_cast<int>(model_.solids.size())) complain("a hexahedron's law does not exist");
  for (const Truss& t : mesh.bars)
    if (t.law < 0 || t.law >= static_cast<int>(model_.steels.size())) complain("a bar's law does not exist");
  if (!model_.load.empty() && static_cast<int>(model_.load.size()) != nodal)
    complain("loads are given for " + std::to_string(model_.load.size()) + " of " + std::to_string(nodal) +
             " nodal displacements");
  for (const double l : model_.control_length)
    if (!(l > 0)) complain("the length of a control must be positive");
  for (const auto& [d, links] : model_.links) {
    if (d < 0 || d >= nodal) complain("a link is given for a node that does not exist");
    for (const Link& l : links)
      if (l.control < 0 || l.control >= count) complain("a link follows a control that does not exist");
  }

  of_nodal_.resize(static_cast<size_t>(nodal));
  const int free = nodal - static_cast<int>(model_.links.size());
  unknowns_ = free + count;
  int next = 0;
  for (int d = 0; d < nodal; ++d) {
    auto& mine = of_nodal_[static_cast<size_t>(d)];
    const auto linked = model_.links.find(d);
    if (linked == model_.links.end()) {
      mine.push_back({next++, 1.0});
    } else {
      for (const Link& l : linked->second) mine.push_back({free + l.control, l.factor});
    }
  }
  length_.assign(static_cast<size_t>(unknowns_), 1.0);
  for (int c = 0; c < count; ++c)
    length_[static_cast<size_t>(free + c)] = model_.control_length[static_cast<size_t>(c)];
  load_.assign(static_cast<size_t>(unknowns_), 0.0);
  for (size_t d = 0; d < model_.load.size(); ++d)
    for (const Share& l : of_nodal_[d]) load_[static_cast<size_t>(l.unknown)] += l.factor * model_.load[d];

  std::map<std::vector<long long>, int> known;
  for (const Hex& h : mesh.hexes) {
    std::array<Vec3, 8> at;
    std::vector<int> dofs;
    for (size_t i = 0; i < 8; ++i) {
      at[i] = mesh.nodes[static_cast<size_t>(h.node[i])];
      for (int k = 0; k < 3; ++k) dofs.push_back(3 * h.node[i] + k);
    }
    const SolidLaw& law = *model_.solids[static_cast<size_t>(h.law)];
    const auto [place, is_new] = known.try_emplace(make_key(at, law.lateral()), static_cast<int>(shapes_.size()));
    if (is_new) shapes_.push_back(make_hex_shape(at, law.lateral()));
    shape_of_.push_back(place->second);
    history_of_.push_back(history_size_);
    history_size_ += static_cast<size_t>(kPoints * law.size());
    maps_.push_back(make_map(dofs));
  }
  for (const Truss& t : mesh.bars) {
    std::vector<int> dofs;
    for (const int n : t.node)
      for (int k = 0; k < 3; ++k) dofs.push_back(3 * n + k);
    maps_.push_back(make_map(dofs));
    bar_length_.push_back(
        norm(mesh.nodes[static_cast<size_t>(t.node[1])] - mesh.nodes[static_cast<size_t>(t.node[0])]));
  }

  std::vector<std::vector<int>> groups;
  for (const Map& m : maps_) groups.push_back(m.unknown);
  pattern_ = make_pattern(unknowns_, groups);
  for (Map& m : maps_)
    for (size_t i = 0; i < m.unknown.size(); ++i)
      for (size_t j = 0; j <= i; ++j) m.entry.push_back(find_entry(pattern_, m.unknown[i], m.unknown[j]));
}

State System::begin() const {
  State s;
  s.q.assign(static_cast<size_t>(unknowns_), 0.0);
  s.solids.assign(history_size_, 0.0);
  for (size_t e = 0; e < history_of_.size(); ++e) {
    const SolidLaw& law = *model_.solids[static_cast<size_t>(model_.mesh.hexes[e].law)];
    for (size_t p = 0; p < kPoints; ++p)
      law.begin(s.solids.data() + history_of_[e] + p * static_cast<size_t>(law.size()));
  }
  s.bars.resize(model_.mesh.bars.size());
  return s;
}

std::vector<Vec3> System::calc_displacements(const std::vector<double>& q) const {
  std::vector<Vec3> u(model_.mesh.nodes.size());
  for (size_t d = 0; d < of_nodal_.size(); ++d)
    for (const Share& l : of_nodal_[d])
      u[d / 3][static_cast<int>(d % 3)] += l.factor * q[static_cast<size_t>(l.unknown)];
  return u;
}

std::array<double, kPoints> System::volumes(int hex) const {
  std::array<double, kPoints> v = shapes_[static_cast<size_t>(shape_of_[static_cast<size_t>(hex)])].volume;
  for (double& w : v) w *= model_.mesh.hexes[static_cast<size_t>(hex)].fill;
  return v;
}

bool System::extrapolates() const {
  return std::any_of(model_.solids.begin(), model_.solids.end(), [](const auto& law) { return law->extrapolates(); });
}

double System::finish(const State& old, const Response& response, State& now, int threads) const {
  const Mesh& mesh = model_.mesh;
  const size_t E = mesh.hexes.size();
  std::vector<std::array<double, 24>> off(E);
  std::vector<char> failed(E, 0);
  const size_t chunks = (E + kChunk - 1) / kChunk;
  // never cancelled within
  (void)parallel_for(chunks, threads, [&](size_t c) {
    for (size_t e = c * kChunk; e < std::min(E, (c + 1) * kChunk); ++e) {
      const Hex& hex = mesh.hexes[e];
      const SolidLaw& law = *model_.solids[static_cast<size_t>(hex.law)];
      off[e].fill(0);
      if (!law.extrapolates()) continue;
      const HexShape& shape = shapes_[static_cast<size_t>(shape_of_[e])];
      Eigen::Map<Eigen::Matrix<double, 24, 1>> f(off[e].data());
      for (size_t p = 0; p < kPoints; ++p) {
        const size_t at = history_of_[e] + p * static_cast<size_t>(law.size());
        Voigt stress;
        if (!law.finish(old.solids.data() + at, response.strain[e][p], now.solids.data() + at, stress)) failed[e] = 1;
        Eigen::Matrix<double, 6, 1> d;
        for (int k = 0; k < 6; ++k)
          d(k) = stress[static_cast<size_t>(k)] - response.stress[e][p][static_cast<size_t>(k)];
        f.noalias() += Eigen::Map<const Strains>(shape.B[p].data()).transpose() * (hex.fill * shape.volume[p] * d);
      }
    }
  });
  if (std::any_of(failed.begin(), failed.end(), [](char f) { return f != 0; })) return -1;
  std::vector<double> sum(static_cast<size_t>(unknowns_), 0.0);
  for (size_t e = 0; e < E; ++e) {
    const Map& map = maps_[e];
    const size_t n = map.unknown.size();
    for (size_t r = 0; r < 24; ++r)
      for (size_t c = 0; c < n; ++c)
        if (map.T.empty() ? c == r : map.T[r * n + c] != 0)
          sum[static_cast<size_t>(map.unknown[c])] += (map.T.empty() ? 1 : map.T[r * n + c]) * off[e][r];
  }
  double squares = 0;
  for (size_t i = 0; i < sum.size(); ++i) squares += sum[i] * sum[i] / (length_[i] * length_[i]);
  return std::sqrt(squares);
}

const double* System::history(const State& s, int hex, int point) const {
  const size_t e = static_cast<size_t>(hex);
  const SolidLaw& law = *model_.solids[static_cast<size_t>(model_.mesh.hexes[e].law)];
  return s.solids.data() + history_of_[e] + static_cast<size_t>(point * law.size());
}

double* System::history(State& s, int hex, int point) const {
  return const_cast<double*>(history(static_cast<const State&>(s), hex, point));
}

Response System::evaluate(const State& old, const std::vector<double>& q, State& now, SparseMatrix* K,
                          const Look& look) const {
  const Mesh& mesh = model_.mesh;
  const size_t E = mesh.hexes.size(), T = mesh.bars.size();
  const std::vector<Vec3> u = calc_displacements(q);
  Response out;
  out.force.assign(static_cast<size_t>(unknowns_), 0.0);
  out.stress.resize(E), out.strain.resize(E);
  out.bar_stress.resize(T), out.bar_strain.resize(T);
  now.q = q;
  now.solids.resize(history_size_);
  now.bars = old.bars;
  const bool stiff = K != nullptr;
  std::vector<std::array<double, 24>> forces(E);
  std::vector<char> failed(E, 0);
  std::vector<double> lower;  // element stiffness in its own unknowns, as Map::entry
  std::vector<size_t> first(E + 1, 0);
  if (stiff) {
    for (size_t e = 0; e < E; ++e) first[e + 1] = first[e] + maps_[e].entry.size();
    lower.resize(first[E]);
  }

  const auto look_at = [&](size_t e) {
    const Hex& hex = mesh.hexes[e];
    const SolidLaw& law = *model_.solids[static_cast<size_t>(hex.law)];
    const HexShape& shape = shapes_[static_cast<size_t>(shape_of_[e])];
    const size_t size = static_cast<size_t>(law.size());
    Eigen::Matrix<double, 24, 1> d;
    for (int i = 0; i < 8; ++i)
      for (int k = 0; k < 3; ++k) d(3 * i + k) = u[static_cast<size_t>(hex.node[static_cast<size_t>(i)])][k];
    Eigen::Matrix<double, 24, 1> f = Eigen::Matrix<double, 24, 1>::Zero();
    Stiffness24 S;
    if (stiff) S.setZero();
    for (size_t p = 0; p < kPoints; ++p) {
      const Eigen::Map<const Strains> B(shape.B[p].data());
      Eigen::Map<Eigen::Matrix<double, 6, 1>> strain(out.strain[e][p].data());
      strain.noalias() = B * d;
      const size_t at = history_of_[e] + p * size;
      const PointResponse r =
          law.advance(old.solids.data() + at, out.strain[e][p], look.step_ratio, now.solids.data() + at);
      if (!r.converged) failed[e] = 1;
      out.stress[e][p] = r.stress;
      const double w = hex.fill * shape.volume[p];
      const Eigen::Map<const Eigen::Matrix<double, 6, 1>> stress(r.stress.data());
      f.noalias() += B.transpose() * (w * stress);
      if (!stiff) continue;
      const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> tangent(r.tangent.data()),
          secant(r.secant.data());
      const double share = look.secant_share;
      Eigen::Matrix<double, 6, 6> C = w * share * secant;
      if (share < 1) C += 0.5 * w * (1 - share) * (tangent + tangent.transpose());
      const Strains CB = C * B;
      S.noalias() += B.transpose() * CB;
    }
    for (int i = 0; i < 24; ++i) forces[e][static_cast<size_t>(i)] = f(i);
    if (!stiff) return;
    const Map& map = maps_[e];
    const Eigen::Index n = static_cast<Eigen::Index>(map.unknown.size());
    double* to = lower.data() + first[e];
    if (map.T.empty()) {
      for (Eigen::Index i = 0; i < n; ++i)
        for (Eigen::Index j = 0; j <= i; ++j) *to++ = S(i, j);
    } else {
      const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> M(map.T.data(), 24,
                                                                                                       n);
      const Eigen::MatrixXd reduced = M.transpose() * S * M;
      for (Eigen::Index i = 0; i < n; ++i)
        for (Eigen::Index j = 0; j <= i; ++j) *to++ = reduced(i, j);
    }
  };
  const size_t chunks = (E + kChunk - 1) / kChunk;
  // never cancelled within
  (void)parallel_for(chunks, look.threads, [&](size_t c) {
    for (size_t e = c * kChunk; e < std::min(E, (c + 1) * kChunk); ++e) look_at(e);
  });

  // Sums in the order of the elements, whoever made them.
  if (stiff) std::fill(K->value.begin(), K->value.end(), 0.0);
  const auto add_force = [&](const Map& map, const double* f, size_t rows) {
    const size_t n = map.unknown.size();
    for (size_t r = 0; r < rows; ++r) {
      out.scale += f[r] * f[r];
      if (map.T.empty())
        out.force[static_cast<size_t>(map.unknown[r])] += f[r];
      else
        for (size_t c = 0; c < n; ++c) out.force[static_cast<size_t>(map.unknown[c])] += map.T[r * n + c] * f[r];
    }
  };
  for (size_t e = 0; e < E; ++e) {
    add_force(maps_[e], forces[e].data(), 24);
    if (failed[e]) out.converged = false;
    if (!stiff) continue;
    const double* from = lower.data() + first[e];
    for (const int entry : maps_[e].entry) K->value[static_cast<size_t>(entry)] += *from++;
  }
  const auto add_stiffness = [&](const Map& map, const Eigen::MatrixXd& S) {
    Eigen::MatrixXd reduced = S;
    if (!map.T.empty()) {
      const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> M(
          map.T.data(), S.rows(), static_cast<Eigen::Index>(map.unknown.size()));
      reduced = M.transpose() * S * M;
    }
    size_t k = 0;
    for (Eigen::Index i = 0; i < reduced.rows(); ++i)
      for (Eigen::Index j = 0; j <= i; ++j) K->value[static_cast<size_t>(map.entry[k++])] += reduced(i, j);
  };
  for (size_t t = 0; t < T; ++t) {
    const Truss& bar = mesh.bars[t];
    const auto a = static_cast<size_t>(bar.node[0]), b = static_cast<size_t>(bar.node[1]);
    const double length = bar_length_[t];
    const Vec3 along = (1 / length) * (mesh.nodes[b] - mesh.nodes[a]);
    const double strain = dot(along, u[b] - u[a]) / length;
    const material::Steel& steel = model_.steels[static_cast<size_t>(bar.law)];
    const material::SteelResponse r = material::advance(steel, now.bars[t], strain);
    out.bar_stress[t] = r.stress, out.bar_strain[t] = strain;
    const double N = bar.area * r.stress;
    const double f[6] = {-N * along.x, -N * along.y, -N * along.z, N * along.x, N * along.y, N * along.z};
    add_force(maps_[E + t], f, 6);
    if (!stiff) continue;
    // The secant of a bar from its stress-free strain; no less than what keeps the matrix positive.
    const double elastic = strain - now.bars[t].plastic;
    const double secant = r.stress != 0 && elastic * r.stress > 0 ? r.stress / elastic : steel.Es;
    const double E_t = std::max(
        1e-6 * steel.Es, look.secant_share * (now.bars[t].ruptured ? 0 : secant) + (1 - look.secant_share) * r.tangent);
    Eigen::Matrix<double, 6, 1> v;
    v << -along.x, -along.y, -along.z, along.x, along.y, along.z;
    add_stiffness(maps_[E + t], bar.area * E_t / length * v * v.transpose());
  }
  out.scale = std::sqrt(out.scale);
  return out;
}

}  // namespace topple::fem
