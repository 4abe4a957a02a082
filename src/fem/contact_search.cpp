#include "fem/contact_search.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "base/team.h"
#include "fem/contact_balls.h"
#include "fem/contact_cells.h"
#include "fem/explicit_inside.h"
#include "fem/segment_contact.h"

namespace topple::fem {

namespace {

constexpr size_t kGroup = 64;  // elements
constexpr int kLook = 16;      // steps between looks at what has moved
constexpr size_t kHidden = 8;  // elements around a node that hide it
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
/// Of the margin: how far impacts between two looks may carry something beyond what its speed tells.
constexpr double kLeastShare = 1.0 / 8;

Vec3 place(const ExplicitState& s, std::uint32_t row) {
  const double* r = s.rows.data() + 8 * static_cast<size_t>(row);
  return {r[0], r[1], r[2]};
}

/// Calls body(i) for all i below count, `run` of them a task.
template <class Body>
void for_all(size_t count, size_t run, Team& team, const Body& body) {
  team.run((count + run - 1) / run, [&](size_t task) {
    for (size_t i = task * run; i < std::min(count, (task + 1) * run); ++i) body(i);
  });
}

class Search {
 public:
  Search(const ContactSetup& setup, ExplicitState& state, ContactFaces& faces, double h, Team& team)
      : setup_(setup),
        s_(state),
        faces_(faces),
        h_(h),
        team_(team),
        groups_(static_cast<std::uint32_t>(setup.group_starts.size() - 1)) {}

  /// After so much time since the last look, for as much as is ahead until the next one.
  void look(double elapsed, double ahead) {
    book_motion(elapsed);
    ContactState& c = s_.contact;
    bool stale = c.fresh;
    for (size_t o = 0; o < c.room.size(); ++o) stale = stale || c.travel[o] > kRoomShare * c.room[o];
    if (stale) make_pairs();
    list_news();
    Pairs pairs = list_pairs(elapsed, ahead);
    std::vector<double> reach(s_.particles.size());
    for_all(reach.size(), 1024, team_,
            [&](size_t i) { reach[i] = s_.particles[i].radius + 0.5 * calc_path(2 * norm(s_.particles[i].v), ahead); });
    const BallCells balls(s_.particles, reach, team_);
    make_skins(pairs, balls, ahead);
    for_all(pairs.due.size(), 64, team_, [&](size_t i) { find_candidates(*pairs.due[i]); });
    for_all(pairs.grown.size(), 64, team_, [&](size_t i) { add_candidates(pairs.grown[i]); });
    c.searches += static_cast<long long>(pairs.due.size());
    pairs.active.insert(pairs.active.end(), pairs.due.begin(), pairs.due.end());
    for (const Grown& of : pairs.grown)
      if (of.is_active || of.pair->free < 0) pairs.active.push_back(of.pair);
    find_near(pairs.active, ahead);
    find_near_faces(balls, ahead);
    find_near_particles(balls, ahead);
    c.removed.clear();
    c.fresh = false;
  }

 private:
  /// Boxes are made anew when something has travelled by this share of the room around it, which is enough for so many
  /// steps.
  static constexpr double kRoomShare = 0.8;
  static constexpr int kBoxSteps = 640;

  /// How far groups may have moved since the last look, at the larger of the speeds at both ends.
  void book_motion(double elapsed) {
    ContactState& c = s_.contact;
    std::vector<lanes::GroupMotion> motion(groups_);
    boxes_.resize(groups_);
    for_all(groups_, 64, team_, [&](size_t g) {
      const auto nodes =
          std::span(setup_.node_rows).subspan(setup_.node_starts[g], setup_.node_starts[g + 1] - setup_.node_starts[g]);
      motion[g] = lanes::measure_motion(s_.rows.data(), nodes, boxes_[g]);
    });
    if (c.fresh) c.motion = motion, c.travel.assign(groups_, 0);
    for (size_t g = 0; g < groups_; ++g) c.travel[g] += std::max(c.motion[g].most, motion[g].most) * elapsed;
    before_ = std::exchange(c.motion, std::move(motion));
    c.particle_speed.resize(s_.particles.size());
    for (size_t i = 0; i < s_.particles.size(); ++i) c.particle_speed[i] = s_.particles[i].v;
  }

  void make_pairs() {
    ContactState& c = s_.contact;
    c.boxes.resize(groups_), c.room.resize(groups_);
    ContactBox bounds;
    for (size_t g = 0; g < groups_; ++g) {
      c.room[g] = std::max(0.5 * setup_.reach, kBoxSteps * h_ * c.motion[g].most);
      c.boxes[g] = boxes_[g].widened(c.room[g]);
      bounds.add(c.boxes[g]);
    }
    const ContactCells cells(c.boxes, bounds, 2 * setup_.reach);
    // the larger number first
    constexpr size_t kRun = 128;
    std::vector<std::vector<std::array<std::uint32_t, 2>>> found((groups_ + kRun - 1) / kRun);
    team_.run(found.size(), [&](size_t run) {
      std::vector<std::uint32_t> before;
      for (size_t i = run * kRun; i < std::min<size_t>(groups_, (run + 1) * kRun); ++i) {
        const auto a = static_cast<std::uint32_t>(i);
        cells.find_before(c.boxes, a, before);
        for (const std::uint32_t b : before) found[run].push_back({a, b});
        if (!c.boxes[a].is_empty()) found[run].push_back({a, a});
      }
    });
    const std::vector<std::array<std::uint32_t, 2>> met = join(found);
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
    std::fill(c.travel.begin(), c.travel.end(), 0.0);
  }

  /// How fast points of bodies that turn may come nearer to each other, at most, without what deviates [m/s]. Both
  /// turn about a place of the body that reaches less far; turning together does not change how far they are apart.
  static double calc_approach(const lanes::GroupMotion& a, const lanes::GroupMotion& b) {
    const lanes::GroupMotion& near = a.reach < b.reach ? a : b;
    return norm(a.speed_at(near.place) - b.speed_at(near.place)) + norm(a.turning - b.turning) * near.reach;
  }
  /// How fast groups of a pair may come nearer to each other [m/s].
  double calc_pace(const ContactPair& pair) const {
    const lanes::GroupMotion &a = s_.contact.motion[pair.a], &b = s_.contact.motion[pair.b];
    return calc_approach(a, b) + a.spread + b.spread;
  }
  /// How far what moves at a pace may get until the next look, with a share of the margin for impacts in between.
  double calc_path(double pace, double ahead) const { return 2 * ahead * pace + kLeastShare * setup_.margin; }

  /// What has come to the outside since the last look, by group.
  void list_news() {
    const ContactState& c = s_.contact;
    news_.clear(), news_of_.assign(groups_, kNone);
    const auto news_of = [&](std::uint32_t group) -> GroupNews& {
      if (news_of_[group] == kNone) {
        news_of_[group] = static_cast<std::uint32_t>(news_.size());
        news_.emplace_back().group = group;
      }
      return news_[news_of_[group]];
    };
    std::vector<std::uint32_t> rows;  // of nodes, once for each element that has gone
    for (const std::uint32_t e : c.removed) {
      faces_[setup_.group_of_element[e]].is_stale = true;
      rows.insert(rows.end(), setup_.rows_of_element[e].begin(), setup_.rows_of_element[e].end());
      for (const int beside : setup_.surface.neighbour[e]) {
        if (beside < 0 || c.gone[static_cast<size_t>(beside)] != 0) continue;
        const auto b = static_cast<size_t>(beside);
        const auto& around = setup_.surface.neighbour[b];
        const auto f = std::find(around.begin(), around.end(), static_cast<int>(e)) - around.begin();
        faces_[setup_.group_of_element[b]].is_stale = true;
        news_of(setup_.group_of_element[b])
            .numbers.push_back(static_cast<std::uint32_t>(6 * b + static_cast<size_t>(f)));
      }
    }
    std::sort(rows.begin(), rows.end());
    for (size_t i = 0, next = 0; i < rows.size(); i = next) {
      while (next < rows.size() && rows[next] == rows[i]) ++next;
      const size_t now = s_.uses[rows[i]];
      if (now > 0 && now < kHidden && now + (next - i) >= kHidden)
        news_of(setup_.owner[rows[i]]).points.push_back({ContactPoint::Node, rows[i]});
    }
    for_all(news_.size(), 8, team_, [&](size_t i) {
      GroupNews& news = news_[i];
      std::sort(news.numbers.begin(), news.numbers.end());
      for (const std::uint32_t face : news.numbers) {
        add_corners(face, news.corners);
        news.points.push_back({ContactPoint::Centre, face});
      }
      if (!news.numbers.empty()) lanes::fill_runs(news.corners);
      lanes::make_skin(s_.rows.data(), kFaceDepth, news.corners, news.numbers.size(), news.skin);
      news.box = news.skin.box;
      const size_t nodes = news.points.size() - news.numbers.size();
      for (size_t k = 0; k < nodes; ++k) {
        news.places.add(place(s_, news.points[k].index));
        news.box.add(news.places[k], 0);
      }
      for (size_t k = 0; k < news.numbers.size(); ++k) news.places.add(news.skin.centre(k));
    });
  }
  const GroupNews* find_news(std::uint32_t group) const {
    return news_of_[group] == kNone ? nullptr : &news_[news_of_[group]];
  }

  /// A pair to which candidates come since something of a or b is outside now.
  struct Grown {
    ContactPair* pair = nullptr;
    bool of_a = false, of_b = false;  // near the other one
    bool is_active = false;
  };
  struct Pairs {
    std::vector<ContactPair*> due;  // to be looked through
    std::vector<Grown> grown;
    std::vector<ContactPair*> active;  // others with candidates that may be near
  };
  Grown find_grown(ContactPair& pair) const {
    Grown out{&pair};
    if (pair.until > static_cast<float>(setup_.margin)) return out;  // too far apart to have been looked through
    const auto is_near = [&](const GroupNews* news, std::uint32_t other) {
      return news != nullptr && news->box.calc_gap(boxes_[other]) <= setup_.margin;
    };
    out.of_a = is_near(find_news(pair.a), pair.b), out.of_b = pair.a != pair.b && is_near(find_news(pair.b), pair.a);
    return out;
  }
  /// Those that are further apart than the margin need not be looked through until they have moved by that.
  Pairs list_pairs(double elapsed, double ahead) {
    ContactState& c = s_.contact;
    constexpr size_t kRun = 4096;
    std::vector<Pairs> found((c.pairs.size() + kRun - 1) / kRun);
    for_all(c.pairs.size(), kRun, team_, [&](size_t i) {
      ContactPair& pair = c.pairs[i];
      const lanes::GroupMotion &a = c.motion[pair.a], &b = c.motion[pair.b];
      const lanes::GroupMotion &a_before = before_[pair.a], &b_before = before_[pair.b];
      const double pace = std::max(calc_approach(a, b), calc_approach(a_before, b_before)) +
                          std::max(a.spread, a_before.spread) + std::max(b.spread, b_before.spread);
      pair.moved += static_cast<float>(pace * elapsed);
      Pairs& lists = found[i / kRun];
      if (pair.moved + pace * ahead <= pair.until) {
        // at more than the pace, as it may be larger than at present
        Grown grown = find_grown(pair);
        grown.is_active = !pair.candidates.empty() && 2 * pair.moved + calc_path(pace, ahead) > pair.free;
        if (grown.of_a || grown.of_b)
          lists.grown.push_back(grown);
        else if (grown.is_active)
          lists.active.push_back(&pair);
        return;
      }
      pair.moved = 0;
      const double gap = boxes_[pair.a].calc_gap(boxes_[pair.b]);
      if (gap > setup_.margin)
        pair.candidates.clear(), pair.until = static_cast<float>(gap);
      else
        lists.due.push_back(&pair);
    });
    Pairs all;
    for (const Pairs& lists : found) {
      all.due.insert(all.due.end(), lists.due.begin(), lists.due.end());
      all.grown.insert(all.grown.end(), lists.grown.begin(), lists.grown.end());
      all.active.insert(all.active.end(), lists.active.begin(), lists.active.end());
    }
    return all;
  }

  /// What may touch within `ahead`, at twice the present speeds and a share of the margin for impacts in between.
  void find_near(const std::vector<ContactPair*>& active, double ahead) {
    constexpr size_t kRun = 512;
    std::vector<std::vector<ContactCandidate>> found((active.size() + kRun - 1) / kRun);
    team_.run(found.size(), [&](size_t run) {
      struct Due {
        ContactPair* pair;
        FoundCandidate* of;
        double path;
      };
      static thread_local std::vector<Due> due;
      due.clear();
      for (size_t i = run * kRun; i < std::min(active.size(), (run + 1) * kRun); ++i) {
        ContactPair& pair = *active[i];
        const double path = calc_path(calc_pace(pair), ahead);
        pair.free = std::numeric_limits<float>::infinity();
        for (FoundCandidate& of : pair.candidates)
          // near no sooner than the pair has moved by half of what is free: faces turn
          if (2 * pair.moved + path > of.free)
            due.push_back({&pair, &of, path});
          else
            pair.free = std::min(pair.free, of.free);
      }
      static thread_local lanes::FaceCorners corners;
      static thread_local lanes::Skin skin;
      constexpr size_t kBatch = 32;  // faces whose corners, all over memory, are asked for before they are seen
      for (size_t first = 0; first < due.size(); first += kBatch) {
        const size_t count = std::min(kBatch, due.size() - first);
        for (auto& rows : corners) rows.clear();
        for (size_t i = first; i < first + count; ++i) {
          if (i + kBatch < due.size()) hwy::Prefetch(&setup_.rows_of_element[due[i + kBatch].of->candidate.face / 6]);
          add_corners(due[i].of->candidate.face, corners);
          for (const auto& rows : corners) hwy::Prefetch(s_.rows.data() + kernel::kNodeFields * size_t{rows.back()});
        }
        lanes::fill_runs(corners);
        lanes::make_skin(s_.rows.data(), kFaceDepth, corners, count, skin);
        for (size_t i = 0; i < count; ++i) {
          const auto& [pair, of, path] = due[first + i];
          const double gap = find_gap(of->candidate, skin.face(i));
          if (gap < path) found[run].push_back(of->candidate);
          of->free = static_cast<float>(2 * pair->moved + gap);
          pair->free = std::min(pair->free, of->free);
        }
      }
    });
    std::vector<NearCandidate>& near = s_.contact.near;
    near.clear();
    for (const auto& list : found)
      for (const ContactCandidate& candidate : list) near.push_back({candidate, rows_of(candidate.face)});
    std::sort(near.begin(), near.end(),
              [](const NearCandidate& a, const NearCandidate& b) { return a.candidate < b.candidate; });
  }

  lanes::Ahead calc_ahead(size_t g, double ahead) const {
    return {ahead, kLeastShare * setup_.margin, s_.contact.motion[g]};
  }
  /// Faces near particles; in order behind what is near otherwise.
  void find_near_faces(const BallCells& balls, double ahead) const {
    constexpr size_t kRun = 8;
    std::vector<std::vector<std::array<std::uint32_t, 2>>> found((groups_ + kRun - 1) / kRun);
    for_all(groups_, kRun, team_, [&](size_t g) {
      if (meets_[g] == 0) return;
      static thread_local std::vector<std::uint32_t> near_by;
      const GroupFaces& faces = faces_[g];
      const lanes::Ahead until = calc_ahead(g, ahead);
      auto& list = found[g / kRun];
      size_t first = list.size();
      for (size_t run = 0; run < faces.skin.runs(); ++run) {
        balls.find_in_box(faces.skin.run_box(run).widened(until.calc_path()), near_by);
        lanes::find_near_faces(faces.skin, run, s_.particles.data(), near_by, until, list);
      }
      for (; first < list.size(); ++first) list[first][1] = faces.numbers[list[first][1]];
    });
    for (const auto& [ball, face] : sort_pairs(found, s_.particles.size()))
      s_.contact.near.push_back({{{ContactPoint::Debris, ball}, face}, rows_of(face)});
  }
  void find_near_particles(const BallCells& cells, double ahead) const {
    const double least = kLeastShare * setup_.margin;
    std::vector<std::vector<ParticlePair>> found(cells.tasks());
    team_.run(found.size(), [&](size_t task) {
      cells.find_pairs(task, found[task]);
      std::erase_if(found[task], [&](const ParticlePair& pair) {
        const Particle &a = s_.particles[pair[0]], &b = s_.particles[pair[1]];
        return !(norm(a.p - b.p) < a.radius + b.radius + least + 2 * ahead * norm(a.v - b.v));
      });
    });
    s_.contact.near_particles = sort_pairs(found, s_.particles.size());
  }
  template <class T>
  static std::vector<T> join(const std::vector<std::vector<T>>& lists) {
    std::vector<T> all;
    for (const auto& list : lists) all.insert(all.end(), list.begin(), list.end());
    return all;
  }

  /// How far a point and a face may move against each other until they may touch.
  double find_gap(const ContactCandidate& candidate, const lanes::SkinFace& face) const {
    const ContactPoint& point = candidate.point;
    const auto is_gone = [&](std::uint32_t number) { return s_.contact.gone[number / 6] != 0; };
    const bool is_node = point.kind == ContactPoint::Node;
    if (is_gone(candidate.face) || (is_node ? s_.uses[point.index] == 0 : is_gone(point.index)))
      return std::numeric_limits<double>::infinity();
    Vec3 p;
    if (is_node)
      p = place(s_, point.index);
    else
      for (const Vec3& x : corners_of(point.index)) p += 0.25 * x;
    return lanes::calc_gap(face, p, 0);
  }

  std::array<std::uint32_t, 4> rows_of(std::uint32_t face) const {
    std::array<std::uint32_t, 4> rows{};
    for (size_t k = 0; k < 4; ++k) rows[k] = setup_.rows_of_element[face / 6][static_cast<size_t>(kFaces[face % 6][k])];
    return rows;
  }
  std::array<Vec3, 4> corners_of(std::uint32_t face) const {
    std::array<Vec3, 4> x;
    const std::array<std::uint32_t, 4> rows = rows_of(face);
    for (size_t k = 0; k < 4; ++k) x[k] = place(s_, rows[k]);
    return x;
  }

  void make_skins(const Pairs& pairs, const BallCells& balls, double ahead) {
    std::vector<bool> wanted(groups_, false);  // with points
    for (const ContactPair* pair : pairs.due) wanted[pair->a] = wanted[pair->b] = true;
    for (const Grown& of : pairs.grown) {
      if (of.of_a) wanted[of.pair->b] = true;
      if (of.of_b) wanted[of.pair->a] = true;
    }
    meets_.resize(groups_);
    for_all(groups_, 8, team_, [&](size_t i) {
      const auto g = static_cast<std::uint32_t>(i);
      const lanes::Ahead until = calc_ahead(g, ahead);
      meets_[g] = balls.has_in_box(boxes_[g].widened(until.calc_path())) ? 1 : 0;
      if (meets_[g] != 0 || wanted[g]) make_skin(g, wanted[g]);
    });
  }
  /// Rows of a face and of the one opposite.
  void add_corners(std::uint32_t face, lanes::FaceCorners& corners) const {
    const std::array<std::uint32_t, 8>& rows = setup_.rows_of_element[face / 6];
    for (size_t k = 0; k < 4; ++k) {
      corners[k].push_back(rows[static_cast<size_t>(kFaces[face % 6][k])]);
      corners[4 + k].push_back(rows[static_cast<size_t>(kFaces[(face % 6) ^ 1][k])]);
    }
  }
  /// Faces of a group that are outside.
  void list_faces(std::uint32_t g, GroupFaces& faces) const {
    faces.numbers.clear();
    for (auto& rows : faces.corners) rows.clear();
    for (std::uint32_t i = setup_.group_starts[g]; i < setup_.group_starts[g + 1]; ++i) {
      const size_t e = static_cast<size_t>(setup_.order[i]);
      if (s_.contact.gone[e] != 0) continue;
      for (size_t f = 0; f < 6; ++f) {
        const int beside = setup_.surface.neighbour[e][f];
        if (beside >= 0 && s_.contact.gone[static_cast<size_t>(beside)] == 0) continue;
        faces.numbers.push_back(static_cast<std::uint32_t>(6 * e + f));
        add_corners(faces.numbers.back(), faces.corners);
      }
    }
    lanes::fill_runs(faces.corners);
    faces.is_stale = false;
  }
  void make_skin(std::uint32_t g, bool has_points) const {
    GroupFaces& faces = faces_[g];
    if (faces.is_stale) list_faces(g, faces);
    lanes::make_skin(s_.rows.data(), kFaceDepth, faces.corners, faces.numbers.size(), faces.skin);
    if (!has_points) return;
    faces.points.clear(), faces.places.clear();
    const auto add = [&faces](const ContactPoint& point, const Vec3& p) {
      faces.points.push_back(point), faces.places.add(p);
    };
    for (size_t i = 0; i < faces.numbers.size(); ++i)
      add({ContactPoint::Centre, faces.numbers[i]}, faces.skin.centre(i));
    for (std::uint32_t i = setup_.node_starts[g]; i < setup_.node_starts[g + 1]; ++i) {
      const std::uint32_t row = setup_.node_rows[i];
      if (setup_.owner[row] != g || s_.uses[row] == 0 || s_.uses[row] >= kHidden) continue;
      add({ContactPoint::Node, row}, place(s_, row));
    }
  }

  bool are_joined(const ContactPoint& point, std::uint32_t face) const {
    const auto& rows = setup_.rows_of_element[face / 6];
    if (point.kind == ContactPoint::Node) return std::find(rows.begin(), rows.end(), point.index) != rows.end();
    for (const int corner : kFaces[point.index % 6]) {
      const std::uint32_t row = setup_.rows_of_element[point.index / 6][static_cast<size_t>(corner)];
      if (std::find(rows.begin(), rows.end(), row) != rows.end()) return true;
    }
    return false;
  }

  /// Of groups or of what is new of them: all points near all faces, but for those points that are not to be.
  template <class Points, class Faces, class Passes>
  void match(const Points& of, const Faces& faces, std::vector<FoundCandidate>& found, const Passes& passes) const {
    static thread_local std::vector<std::uint32_t> points, near_by;
    lanes::find_points(of.places, faces.skin.box, setup_.margin, points);
    for (const std::uint32_t i : points) {
      if (passes(of.points[i])) continue;
      lanes::find_faces(faces.skin, of.places[i], setup_.margin, setup_.margin, near_by);
      for (const std::uint32_t k : near_by)
        if (!are_joined(of.points[i], faces.numbers[k])) found.push_back({{of.points[i], faces.numbers[k]}, -1});
    }
  }

  /// Candidates of a pair, and how far its groups may move against each other until it is looked through again.
  void find_candidates(ContactPair& pair) const {
    pair.candidates.clear();
    pair.moved = 0, pair.until = static_cast<float>(setup_.margin), pair.free = -1;
    const GroupFaces &a = faces_[pair.a], &b = faces_[pair.b];
    const auto none = [](const ContactPoint&) { return false; };
    match(a, b, pair.candidates, none);
    if (pair.a != pair.b) match(b, a, pair.candidates, none);
  }

  /// Candidates of a pair that are new, as its others still hold.
  void add_candidates(const Grown& of) const {
    ContactPair& pair = *of.pair;
    const size_t before = pair.candidates.size();
    const GroupNews *news_a = find_news(pair.a), *news_b = find_news(pair.b);
    // points that are new with all faces, the others with faces that are new
    const auto add = [&](const GroupNews& news, const GroupNews* other_news, const GroupFaces& other) {
      match(news, other, pair.candidates, [](const ContactPoint&) { return false; });
      match(other, news, pair.candidates, [&](const ContactPoint& point) {
        return other_news != nullptr &&
               std::find(other_news->points.begin(), other_news->points.end(), point) != other_news->points.end();
      });
    };
    if (of.of_a) add(*news_a, news_b, faces_[pair.b]);
    if (of.of_b) add(*news_b, news_a, faces_[pair.a]);
    if (pair.candidates.size() > before) pair.free = -1;
  }

  const ContactSetup& setup_;
  ExplicitState& s_;
  ContactFaces& faces_;
  double h_;
  Team& team_;
  std::uint32_t groups_;
  std::vector<ContactBox> boxes_;           // of groups, as they are
  std::vector<lanes::GroupMotion> before_;  // of groups at the last look
  std::vector<unsigned char> meets_;        // groups: particles may be near its faces
  std::vector<GroupNews> news_;
  std::vector<std::uint32_t> news_of_;  // of groups; kNone: nothing
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
  setup.owner.assign(chunks.node_of_row.size(), kNone);
  std::vector<std::uint32_t> seen(chunks.node_of_row.size(), kNone);
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
          if (setup.owner[row] == kNone) setup.owner[row] = group;
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

/// Steps between looks, which are where debris stands at the time of the nodes.
static int calc_look(const ExplicitSystem::Inside& in) {
  return (kLook + in.debris_steps - 1) / in.debris_steps * in.debris_steps;
}

void search_contact(ExplicitSystem::Inside& in, ExplicitState& state) {
  const ContactSetup& setup = in.contact;
  ContactState& c = state.contact;
  if (c.gone.empty()) c.gone.assign(setup.rows_of_element.size(), 0);
  if (!c.fresh) {
    ++c.since;
    if (!in.pushes_debris(state) || (c.since < kLook && !c.knocked)) return;
  }
  const auto start = std::chrono::steady_clock::now();
  in.contact_faces.resize(setup.group_starts.size() - 1);
  Search(setup, state, in.contact_faces, in.h, *in.team).look(c.since * in.h, calc_look(in) * in.h);
  c.since = 0, c.knocked = false;
  static std::atomic<std::uint64_t> looks = 0;
  c.look = ++looks;
  in.timing.search += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

bool is_knocked(const ExplicitSystem::Inside& in, const ExplicitState& state, size_t first, size_t last) {
  const ContactState& c = state.contact;
  const double most = kLeastShare * in.contact.margin / (calc_look(in) * in.h);
  for (size_t i = first; i < last && i < c.particle_speed.size(); ++i) {
    const Vec3 gain = state.particles[i].v - c.particle_speed[i];
    if (dot(gain, gain) > most * most) return true;
  }
  return false;
}

void mark_changed(const ContactSetup& setup, ContactState& c, int element) {
  if (c.gone.empty()) c.gone.assign(setup.rows_of_element.size(), 0);
  c.gone[static_cast<size_t>(element)] = 1;
  c.removed.push_back(static_cast<std::uint32_t>(element));
}

}  // namespace topple::fem
