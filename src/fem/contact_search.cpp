#include "fem/contact_search.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>

#include "fem/explicit_inside.h"
#include "fem/segment_contact.h"

namespace topple::fem {

namespace {

constexpr size_t kGroup = 64;  // elements
constexpr int kLook = 16;      // steps between looks at what has moved

Vec3 place(const ExplicitState& s, std::uint32_t row) {
  const double* r = s.rows.data() + 8 * static_cast<size_t>(row);
  return {r[0], r[1], r[2]};
}
Vec3 speed(const ExplicitState& s, std::uint32_t row) {
  const double* r = s.rows.data() + 8 * static_cast<size_t>(row);
  return {r[4], r[5], r[6]};
}
bool has_mass(const ExplicitState& s, std::uint32_t row) { return s.rows[8 * size_t{row} + kernel::kNodeMass] > 0; }

struct Box {
  Vec3 low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
  void add(const Vec3& p, double r) {
    for (int c = 0; c < 3; ++c) low[c] = std::min(low[c], p[c] - r), high[c] = std::max(high[c], p[c] + r);
  }
  bool is_empty() const { return low.x > high.x; }
  bool meets(const Box& b) const {
    return low.x <= b.high.x && b.low.x <= high.x && low.y <= b.high.y && b.low.y <= high.y && low.z <= b.high.z &&
           b.low.z <= high.z;
  }
  bool has(const Vec3& p, double r) const {
    return p.x >= low.x - r && p.x <= high.x + r && p.y >= low.y - r && p.y <= high.y + r && p.z >= low.z - r &&
           p.z <= high.z + r;
  }
};

/// A face as the search sees it.
struct Face {
  std::uint32_t number = 0;
  Vec3 centre, normal;
  Vec3 along, across;  // ξ and η of a point from the middle by scalar products
  double radius = 0, depth = 0;
};
struct Point {
  ContactPoint point;
  Vec3 p;
  double radius = 0;
};
/// The outside of a group.
struct Skin {
  std::vector<Face> faces;
  std::vector<Point> points;
  Box box;  // of the faces
};

class Search {
 public:
  Search(const ContactSetup& setup, ExplicitState& state)
      : setup_(setup), s_(state), groups_(static_cast<std::uint32_t>(setup.group_starts.size() - 1)), skins_(groups_) {}

  void look(double h) {
    ContactState& c = s_.contact;
    const size_t objects = groups_ + s_.particles.size();
    const size_t known = c.speed.size();
    c.travel.resize(objects, 0), c.speed.resize(objects), c.spread.resize(objects, 0);
    const std::vector<Vec3> before = c.speed;
    const double elapsed = kLook * h;
    for (std::uint32_t o = 0; o < objects; ++o) {
      const double spread = c.spread[o];
      measure(o);
      if (o >= known) continue;
      c.spread[o] = std::max(spread, c.spread[o]);
      c.travel[o] += (std::max(norm(before[o]), norm(c.speed[o])) + c.spread[o]) * elapsed;
    }
    for (ContactPair& pair : c.pairs) {
      const double apart = std::max(norm(c.speed[pair.a] - c.speed[pair.b]), norm(before[pair.a] - before[pair.b]));
      pair.slack -= (apart + c.spread[pair.a] + c.spread[pair.b]) * elapsed;
    }
    // deviations were held at the larger of both ends of the interval; from here on they are the present ones
    for (std::uint32_t o = 0; o < objects; ++o) measure(o);
    bool box = c.fresh || s_.particles.size() != c.boxed_particles;
    for (const double t : c.travel) box = box || t > 0.5 * setup_.reach;
    if (box) make_pairs();
    for (ContactPair& pair : c.pairs) {
      const bool changed = c.changed[pair.b] != 0 || (pair.a < groups_ && c.changed[pair.a] != 0);
      if (pair.slack >= 0 && !changed) continue;
      find_candidates(pair);
      pair.slack = setup_.margin;
      ++c.searches;
    }
    std::fill(c.changed.begin(), c.changed.end(), 0);
    c.any_changed = false;
    c.fresh = false;
  }

 private:
  void measure(std::uint32_t o) {
    ContactState& c = s_.contact;
    if (o >= groups_) {
      c.speed[o] = s_.particles[o - groups_].v, c.spread[o] = 0;
      return;
    }
    Vec3 mean;
    int count = 0;
    for (std::uint32_t i = setup_.node_starts[o]; i < setup_.node_starts[o + 1]; ++i)
      if (has_mass(s_, setup_.node_rows[i])) mean += speed(s_, setup_.node_rows[i]), ++count;
    if (count > 0) mean *= 1.0 / count;
    double square = 0;
    for (std::uint32_t i = setup_.node_starts[o]; i < setup_.node_starts[o + 1]; ++i)
      if (has_mass(s_, setup_.node_rows[i])) {
        const Vec3 d = speed(s_, setup_.node_rows[i]) - mean;
        square = std::max(square, dot(d, d));
      }
    c.speed[o] = mean, c.spread[o] = std::sqrt(square);
  }

  void make_pairs() {
    ContactState& c = s_.contact;
    struct Object {
      Box box;
      std::uint32_t id;
    };
    std::vector<Object> objects;
    for (std::uint32_t g = 0; g < groups_; ++g) {
      Object o{{}, g};
      for (std::uint32_t i = setup_.node_starts[g]; i < setup_.node_starts[g + 1]; ++i)
        if (has_mass(s_, setup_.node_rows[i])) o.box.add(place(s_, setup_.node_rows[i]), 0.5 * setup_.reach);
      if (!o.box.is_empty()) objects.push_back(o);
    }
    for (size_t i = 0; i < s_.particles.size(); ++i) {
      Object o{{}, groups_ + static_cast<std::uint32_t>(i)};
      o.box.add(s_.particles[i].p, s_.particles[i].full_radius + 0.5 * setup_.reach);
      objects.push_back(o);
    }
    std::sort(objects.begin(), objects.end(), [](const Object& a, const Object& b) {
      return a.box.low.x < b.box.low.x || (a.box.low.x == b.box.low.x && a.id < b.id);
    });
    std::vector<std::array<std::uint32_t, 2>> met;  // larger number first
    c.particle_pairs.clear();
    for (size_t i = 0; i < objects.size(); ++i) {
      if (objects[i].id < groups_) met.push_back({objects[i].id, objects[i].id});
      for (size_t j = i + 1; j < objects.size() && objects[j].box.low.x <= objects[i].box.high.x; ++j) {
        if (!objects[i].box.meets(objects[j].box)) continue;
        const std::uint32_t a = std::max(objects[i].id, objects[j].id), b = std::min(objects[i].id, objects[j].id);
        if (b >= groups_)
          c.particle_pairs.push_back({b - groups_, a - groups_});
        else
          met.push_back({a, b});
      }
    }
    std::sort(met.begin(), met.end());
    std::sort(c.particle_pairs.begin(), c.particle_pairs.end());
    std::vector<ContactPair> pairs(met.size());
    size_t old = 0;
    for (size_t i = 0; i < met.size(); ++i) {
      ContactPair& pair = pairs[i];
      while (old < c.pairs.size() && std::array{c.pairs[old].a, c.pairs[old].b} < met[i]) ++old;
      if (old < c.pairs.size() && c.pairs[old].a == met[i][0] && c.pairs[old].b == met[i][1])
        pair = std::move(c.pairs[old]);
      else
        pair.a = met[i][0], pair.b = met[i][1];
    }
    c.pairs = std::move(pairs);
    c.boxed_particles = static_cast<std::uint32_t>(s_.particles.size());
    std::fill(c.travel.begin(), c.travel.end(), 0.0);
  }

  const Skin& skin_of(std::uint32_t g) {
    if (skins_[g]) return *skins_[g];
    Skin& skin = skins_[g].emplace();
    for (std::uint32_t i = setup_.group_starts[g]; i < setup_.group_starts[g + 1]; ++i) {
      const size_t e = static_cast<size_t>(setup_.order[i]);
      if (s_.contact.gone[e] != 0) continue;
      for (size_t f = 0; f < 6; ++f) {
        const int beside = setup_.surface.neighbour[e][f];
        if (beside >= 0 && s_.contact.gone[static_cast<size_t>(beside)] == 0) continue;
        Vec3 x[4], far;
        for (size_t k = 0; k < 4; ++k) {
          x[k] = place(s_, setup_.rows_of_element[e][static_cast<size_t>(kFaces[f][k])]);
          far += 0.25 * place(s_, setup_.rows_of_element[e][static_cast<size_t>(kFaces[f ^ 1][k])]);
        }
        Face face;
        face.number = static_cast<std::uint32_t>(6 * e + f);
        face.centre = 0.25 * (x[0] + x[1] + x[2] + x[3]);
        const Vec3 n = cross(x[2] - x[0], x[3] - x[1]);
        face.normal = (1 / std::max(norm(n), 1e-300)) * n;
        const Vec3 a = 0.25 * (x[1] + x[2] - x[0] - x[3]), b = 0.25 * (x[2] + x[3] - x[0] - x[1]);
        const double area = std::max(dot(cross(a, b), face.normal), 1e-300);
        face.along = (1 / area) * cross(b, face.normal), face.across = (1 / area) * cross(face.normal, a);
        for (const Vec3& p : x) face.radius = std::max(face.radius, norm(p - face.centre)), skin.box.add(p, 0);
        face.depth = kFaceDepth * std::max(0.0, dot(face.normal, face.centre - far));
        skin.faces.push_back(face);
        skin.points.push_back({{ContactPoint::Centre, face.number}, face.centre, 0});
      }
    }
    for (std::uint32_t i = setup_.node_starts[g]; i < setup_.node_starts[g + 1]; ++i) {
      const std::uint32_t row = setup_.node_rows[i];
      // eight elements around a node hide it
      if (setup_.owner[row] != g || s_.uses[row] == 0 || s_.uses[row] >= 8) continue;
      skin.points.push_back({{ContactPoint::Node, row}, place(s_, row), 0});
    }
    return skin;
  }

  bool are_joined(const ContactPoint& point, std::uint32_t face) const {
    const auto& rows = setup_.rows_of_element[face / 6];
    if (point.kind == ContactPoint::Node) return std::find(rows.begin(), rows.end(), point.index) != rows.end();
    if (point.kind == ContactPoint::Debris) return false;
    for (const int corner : kFaces[point.index % 6]) {
      const std::uint32_t row = setup_.rows_of_element[point.index / 6][static_cast<size_t>(corner)];
      if (std::find(rows.begin(), rows.end(), row) != rows.end()) return true;
    }
    return false;
  }

  void match(const std::vector<Point>& points, const Skin& skin, std::vector<ContactCandidate>& found) const {
    if (skin.faces.empty()) return;
    for (const Point& q : points) {
      const double near = setup_.margin + q.radius;
      if (!skin.box.has(q.p, near)) continue;
      for (const Face& face : skin.faces) {
        const Vec3 d = q.p - face.centre;
        const double height = dot(d, face.normal), reach = face.radius + near;
        if (height > near || height < -(face.depth + setup_.margin) ||
            dot(d, d) > reach * reach + face.depth * face.depth)
          continue;
        // beside the face by more than the margin, or what an uneven one may hide
        constexpr double kUneven = 0.1;
        if (std::abs(dot(d, face.along)) > 1 + kUneven + near * norm(face.along) ||
            std::abs(dot(d, face.across)) > 1 + kUneven + near * norm(face.across))
          continue;
        if (!are_joined(q.point, face.number)) found.push_back({q.point, face.number});
      }
    }
  }

  void find_candidates(ContactPair& pair) {
    pair.candidates.clear();
    const Skin& b = skin_of(pair.b);
    if (pair.a >= groups_) {
      const std::uint32_t i = pair.a - groups_;
      match({{{ContactPoint::Debris, i}, s_.particles[i].p, s_.particles[i].full_radius}}, b, pair.candidates);
      return;
    }
    if (pair.a == pair.b) {
      match(b.points, b, pair.candidates);
      return;
    }
    const Skin& a = skin_of(pair.a);
    match(a.points, b, pair.candidates);
    match(b.points, a, pair.candidates);
  }

  const ContactSetup& setup_;
  ExplicitState& s_;
  std::uint32_t groups_;
  std::vector<std::optional<Skin>> skins_;
};

}  // namespace

ContactSetup make_contact_setup(const ExplicitModel& model, const ExplicitChunks& chunks, double margin, bool enabled) {
  ContactSetup setup;
  setup.enabled = enabled;
  setup.surface = make_outer_surface(model);
  setup.margin = margin;
  const size_t E = model.elements.size();
  setup.rows_of_element.resize(E);
  double size = 0;
  for (size_t e = 0; e < E; ++e) {
    std::array<Vec3, 8> x;
    for (size_t i = 0; i < 8; ++i) {
      const size_t n = static_cast<size_t>(model.elements[e].node[i]);
      setup.rows_of_element[e][i] = chunks.row_of_node[n];
      x[i] = model.nodes[n];
    }
    size += std::cbrt(calc_hex_volume(x)) / static_cast<double>(E);
  }
  setup.reach = std::max(2 * margin, size);
  setup.order = chunks.order;
  setup.group_of_element.resize(E);
  constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();
  setup.owner.assign(model.nodes.size(), kNobody);
  std::vector<std::uint32_t> seen(model.nodes.size(), kNobody);
  size_t first = 0;
  setup.node_starts.push_back(0);
  for (const ElementChunk& chunk : chunks.chunks) {
    size_t count = 0;
    for (size_t slot = chunk.first_block * chunks.W; slot < (chunk.first_block + chunk.blocks) * chunks.W; ++slot)
      count += chunks.element_of_slot[slot] >= 0 ? 1 : 0;
    for (size_t at = first; at < first + count; at += kGroup) {
      const auto group = static_cast<std::uint32_t>(setup.group_starts.size());
      setup.group_starts.push_back(static_cast<std::uint32_t>(at));
      for (size_t i = at; i < std::min(first + count, at + kGroup); ++i) {
        const size_t e = static_cast<size_t>(setup.order[i]);
        setup.group_of_element[e] = group;
        for (const std::uint32_t row : setup.rows_of_element[e]) {
          if (setup.owner[row] == kNobody) setup.owner[row] = group;
          if (seen[row] == group) continue;
          seen[row] = group;
          setup.node_rows.push_back(row);
        }
      }
      setup.node_starts.push_back(static_cast<std::uint32_t>(setup.node_rows.size()));
    }
    first += count;
  }
  setup.group_starts.push_back(static_cast<std::uint32_t>(E));
  return setup;
}

void search_contact(const ContactSetup& setup, ExplicitState& state, double h, double& seconds) {
  ContactState& c = state.contact;
  if (c.gone.empty()) c.gone.assign(setup.rows_of_element.size(), 0);
  if (c.changed.empty()) c.changed.assign(setup.group_starts.size() - 1, 0);
  if (!c.fresh && --c.countdown > 0) return;
  const auto start = std::chrono::steady_clock::now();
  c.countdown = kLook;
  Search(setup, state).look(h);
  seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void mark_changed(const ContactSetup& setup, ContactState& c, int element) {
  if (c.gone.empty()) c.gone.assign(setup.rows_of_element.size(), 0);
  if (c.changed.empty()) c.changed.assign(setup.group_starts.size() - 1, 0);
  const size_t e = static_cast<size_t>(element);
  c.gone[e] = 1;
  c.changed[setup.group_of_element[e]] = 1;
  for (const int beside : setup.surface.neighbour[e])
    if (beside >= 0) c.changed[setup.group_of_element[static_cast<size_t>(beside)]] = 1;
  for (const std::uint32_t row : setup.rows_of_element[e]) c.changed[setup.owner[row]] = 1;
  c.any_changed = true;
}

}  // namespace topple::fem
