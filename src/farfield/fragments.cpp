#include "farfield/fragments.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "base/disjoint_sets.h"
#include "base/unit.h"
#include "record/told.h"

namespace topple::farfield {

namespace {

/// Pairs of elements that share a face.
std::vector<std::pair<int, int>> find_neighbours(const fem::ExplicitModel& fe) {
  constexpr size_t face[6][4] = {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4}, {3, 2, 6, 7}, {0, 3, 7, 4}, {1, 2, 6, 5}};
  std::vector<std::pair<std::array<int, 4>, int>> faces;
  faces.reserve(6 * fe.elements.size());
  for (size_t e = 0; e < fe.elements.size(); ++e)
    for (const auto& f : face) {
      std::array<int, 4> key;
      for (size_t i = 0; i < 4; ++i) key[i] = fe.elements[e].node[f[i]];
      std::sort(key.begin(), key.end());
      faces.emplace_back(key, static_cast<int>(e));
    }
  std::sort(faces.begin(), faces.end());
  std::vector<std::pair<int, int>> pairs;
  for (size_t i = 0; i + 1 < faces.size(); ++i)
    if (faces[i].first == faces[i + 1].first) pairs.emplace_back(faces[i].second, faces[i + 1].second);
  return pairs;
}

bool is_damaged(const fem::ExplicitSystem& system, size_t element) {
  const int e = static_cast<int>(element);
  return !system.is_alive(e) || system.plastic_strain(e) >= kDamagedStrain;
}

/// It lies in a stump, which only what lands on it breaks, or landing parts made it what it is.
bool is_of_landing(const DamageZone& z) { return z.stump >= 0.5 || z.landed >= 0.5; }

}  // namespace

void EarlyDamage::note(const fem::ExplicitSystem& system, size_t elements) {
  if (landing >= 0) return;
  is_damaged.resize(elements);
  for (size_t e = 0; e < elements; ++e) is_damaged[e] = farfield::is_damaged(system, e) ? 1 : 0;
}

Fragments find_fragments(const product::Plan& plan, const Whole& whole, const fem::ExplicitSystem& system,
                         const std::vector<record::ZoneInfo>& zones, double size, const EarlyDamage& before_landing) {
  const fem::ExplicitModel& fe = whole.fe;
  const size_t E = fe.elements.size();
  Fragments out;
  out.reach = 2 * size;
  enum class State { Sound, Damaged, Charged };
  std::vector<State> state(E, State::Sound);
  for (size_t e = 0; e < E; ++e)
    if (is_damaged(system, e)) state[e] = State::Damaged;
  std::vector<unsigned char> is_early = before_landing.is_damaged;
  is_early.resize(E, before_landing.landing < 0 ? 1 : 0);
  for (const fem::Removal& r : system.removals()) {
    if (r.cause == fem::RemovalCause::Charge) state[static_cast<size_t>(r.element)] = State::Charged;
    if (r.time < before_landing.landing) is_early[static_cast<size_t>(r.element)] = 1;
  }
  DisjointSets pieces(E);
  for (const auto& [a, b] : find_neighbours(fe)) {
    if (state[static_cast<size_t>(a)] != state[static_cast<size_t>(b)]) continue;
    pieces.join_under_lower(a, b);
  }
  std::map<int, std::vector<int>> groups;
  for (size_t e = 0; e < E; ++e)
    if (state[e] != State::Charged) groups[pieces.find(static_cast<int>(e))].push_back(static_cast<int>(e));

  std::vector<double> volume(E);
  double damaged_volume = 0, whole_mass = 0;
  const auto mass_of = [&](int e) {
    const fem::ExplicitElement& element = fe.elements[static_cast<size_t>(e)];
    return volume[static_cast<size_t>(e)] * element.mass_factor *
           fe.materials[static_cast<size_t>(element.material)].density;
  };
  for (size_t e = 0; e < E; ++e) {
    std::array<Vec3, 8> p;
    for (size_t i = 0; i < 8; ++i) p[i] = fe.nodes[static_cast<size_t>(fe.elements[e].node[i])];
    volume[e] = fem::calc_hex_volume(p);
    whole_mass += mass_of(static_cast<int>(e));
    if (state[e] == State::Damaged) damaged_volume += volume[e];
  }
  std::map<int, int> body_elements;
  for (const fem::ExplicitElement& e : fe.elements) ++body_elements[e.part];
  for (const auto& [root, elements] : groups) {
    if (state[static_cast<size_t>(root)] == State::Sound) {
      Fragment f;
      std::map<int, int> inside;
      for (const int e : elements) {
        const double m = mass_of(e);
        f.mass += m;
        f.p_W += m * whole.grid.cells[static_cast<size_t>(e)].centre;
        ++inside[fe.elements[static_cast<size_t>(e)].part];
      }
      f.p_W *= 1 / f.mass;
      f.elements = static_cast<int>(elements.size());
      for (const auto& [body, n] : inside) f.bodies += 2 * n >= body_elements[body];
      if (f.mass >= 1e-3 * whole_mass) out.fragments.push_back(f);
      continue;
    }
    DamageZone z;
    std::map<int, double> members;
    double all = 0;
    for (const int e : elements) {
      const double v = volume[static_cast<size_t>(e)];
      members[whole.grid.cells[static_cast<size_t>(e)].member] += v;
      all += v;
      z.stump += whole.is_stump[static_cast<size_t>(e)] != 0 ? v : 0;
      z.landed += is_early[static_cast<size_t>(e)] != 0 ? 0 : v;
      z.p_W += v * whole.grid.cells[static_cast<size_t>(e)].centre;
      z.gone += !system.is_alive(e);
    }
    z.p_W *= 1 / all;
    z.elements = static_cast<int>(elements.size());
    z.share = all / damaged_volume;
    z.landed *= 1 / all, z.stump *= 1 / all;
    double most = 0;
    for (const auto& [member, v] : members)
      if (v > most) most = v, z.member = member;
    const product::Member& m = plan.members[static_cast<size_t>(z.member)];
    if (m.kind != product::MemberKind::Slab) {
      const int axis = axis_of(m);
      z.at = z.p_W[axis] - m.start[axis];
      z.from = std::numeric_limits<double>::infinity(), z.to = -z.from;
      for (const int e : elements) {
        const double at = whole.grid.cells[static_cast<size_t>(e)].centre[axis] - m.start[axis];
        z.from = std::min(z.from, at), z.to = std::max(z.to, at);
      }
    }
    double least = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < zones.size(); ++i) {
      if (zones[i].member != m.name) continue;
      const double d = norm(zones[i].p_W - z.p_W);
      if (d < least) least = d, z.zone = static_cast<int>(i);
    }
    z.distance = least;
    out.zones.push_back(z);
  }
  std::stable_sort(out.zones.begin(), out.zones.end(),
                   [](const DamageZone& a, const DamageZone& b) { return a.share > b.share; });
  std::stable_sort(out.fragments.begin(), out.fragments.end(),
                   [](const Fragment& a, const Fragment& b) { return a.mass > b.mass; });
  return out;
}

void add_fragment_findings(const product::Plan& plan, const Fragments& f, double when, record::Record& r) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  constexpr size_t most = 12;  // zones that get a line of their own
  const auto add = [&r](const std::string& id, const std::string& title, const std::string& text, double value,
                        const char* unit, record::Status status) {
    record::add_finding(r, {id, "Zones and fragments", title, text, value, unit, status});
  };
  if (f.zones.empty()) {
    add("farfield.zones", "Zones of accumulated damage",
        fmt::format("None at {:.2f} s: no element has {:.0f} % plastic strain.", when, 100 * f.damaged_strain), 0, "1",
        record::Status::Info);
  } else {
    const auto is_expected = [&](const DamageZone& z) { return z.zone >= 0 && z.distance <= f.reach; };
    const auto is_landed = [&](const DamageZone& z) { return is_of_landing(z) && !is_expected(z); };
    const auto expected = std::count_if(f.zones.begin(), f.zones.end(), is_expected);
    const auto landed = std::count_if(f.zones.begin(), f.zones.end(), is_landed);
    double share = 0, landed_share = 0;
    for (const DamageZone& z : f.zones)
      share += is_expected(z) ? z.share : 0, landed_share += is_landed(z) ? z.share : 0;
    std::string text = fmt::format(
        "At {:.2f} s damage ({:.0f} % plastic strain and more) has gathered in {} zones; {} of them, with "
        "{:.0f} % of the damaged volume, lie within {:.1f} m of a zone of the multibody model.",
        when, 100 * f.damaged_strain, f.zones.size(), expected, 100 * share, f.reach);
    if (landed > 0)
      text += fmt::format(" Of the others {}, with {:.0f} %, lie in stumps or broke once parts had landed.", landed,
                          100 * landed_share);
    add("farfield.zones", "Zones of accumulated damage", text, share, "1",
        share >= 0.5 * (1 - landed_share) ? record::Status::Good : record::Status::Warning);
  }
  for (size_t i = 0; i < std::min(most, f.zones.size()); ++i) {
    const DamageZone& z = f.zones[i];
    const product::Member& m = plan.members[static_cast<size_t>(z.member)];
    const std::string where = m.kind == product::MemberKind::Slab
                                  ? fmt::format("({:.1f}, {:.1f}, {:.1f}) m", z.p_W.x, z.p_W.y, z.p_W.z)
                                  : fmt::format("{:.2f} m from its start ({:.2f} to {:.2f} m)", z.at, z.from, z.to);
    std::string text;
    if (z.zone >= 0 && z.distance <= f.reach)
      text = fmt::format("Zone expected at {}, found {} away, at {}", r.zones[static_cast<size_t>(z.zone)].name,
                         fmt::format("{:.2f} m", z.distance), where);
    else if (is_of_landing(z))
      text = z.stump >= 0.5 ? fmt::format("Found at {}; it lies in a stump, which bears nothing", where)
                            : fmt::format("Found at {}; it broke once parts had landed", where);
    else if (z.zone >= 0)
      text = fmt::format(
          "Found at {}; the nearest zone of the multibody model, {}, lies {:.2f} m away: a cut here would "
          "follow the damage",
          where, r.zones[static_cast<size_t>(z.zone)].name, z.distance);
    else
      text = fmt::format("Found at {}; the multibody model has no zone in this member", where);
    add(fmt::format("farfield.zone.{}", i + 1), m.name,
        fmt::format("{}; {} elements, {} gone, {:.0f} % of the damaged volume.", text, z.elements, z.gone,
                    100 * z.share),
        z.zone >= 0 ? z.distance : none, "m",
        z.zone >= 0 && z.distance <= f.reach ? record::Status::Good
        : is_of_landing(z)                   ? record::Status::Info
                                             : record::Status::Warning);
  }
  double mass = 0;
  std::string list;
  for (size_t i = 0; i < f.fragments.size(); ++i) {
    mass += f.fragments[i].mass;
    if (i >= 5) continue;
    const double t = f.fragments[i].mass / unit::t;
    const int bodies = f.fragments[i].bodies;
    list += i ? ", " : "";
    list += bodies == 1 ? fmt::format("{:.1f} t (1 body of the multibody model)", t)
                        : fmt::format("{:.1f} t ({} bodies of the multibody model)", t, bodies);
  }
  add("farfield.fragments", "Rigid fragments",
      f.fragments.empty()
          ? std::string("None is left of a thousandth of the mass.")
          : fmt::format("{} sound parts of a thousandth of the mass or more hold {:.1f} t: {}{}.", f.fragments.size(),
                        mass / unit::t, list, f.fragments.size() > 5 ? ", and smaller ones" : ""),
      static_cast<double>(f.fragments.size()), "1", record::Status::Info);
}

}  // namespace topple::farfield
