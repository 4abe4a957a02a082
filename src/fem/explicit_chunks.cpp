#include "fem/explicit_chunks.h"

#include <unistd.h>

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <span>

namespace topple::fem {

namespace {

/// What the second cache of a core holds [bytes]; 0 where the system does not tell.
size_t second_cache() {
#if defined(_SC_LEVEL2_CACHE_SIZE)
  return static_cast<size_t>(std::max(0L, sysconf(_SC_LEVEL2_CACHE_SIZE)));
#else
  return 0;
#endif
}

/// Sorts elements so that any run of them is compact: halves along the longest side, whole chunks first.
class Bisection {
 public:
  Bisection(const std::vector<Vec3>& centres, size_t chunk) : centres_(centres), chunk_(chunk) {}
  void sort(int* first, int* last) const {
    const size_t count = static_cast<size_t>(last - first);
    if (count < 2) return;
    Vec3 low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
    for (const int* e = first; e != last; ++e)
      for (int c = 0; c < 3; ++c) {
        const double x = centres_[static_cast<size_t>(*e)][c];
        low[c] = std::min(low[c], x), high[c] = std::max(high[c], x);
      }
    int axis = 0;
    for (int c = 1; c < 3; ++c)
      if (high[c] - low[c] > high[axis] - low[axis]) axis = c;
    size_t half = count / 2;
    if (count > chunk_) half = std::max<size_t>(1, (half + chunk_ / 2) / chunk_) * chunk_;
    int* middle = first + half;
    std::nth_element(first, middle, last, [&](int a, int b) {
      const double xa = centres_[static_cast<size_t>(a)][axis], xb = centres_[static_cast<size_t>(b)][axis];
      return xa < xb || (xa == xb && a < b);
    });
    sort(first, middle);
    sort(middle, last);
  }

 private:
  const std::vector<Vec3>& centres_;
  size_t chunk_;
};

/// Elements of which each has the face ζ = +1 of the one before as its face ζ = -1.
using Strip = std::vector<int>;

/// Puts elements in strips, along those of their axes that make long ones, and turns them so that it is ζ.
std::vector<Strip> find_strips(const ExplicitModel& model, std::span<const int> elements,
                               std::vector<std::uint8_t>& turn_of_element) {
  using Key = std::array<int, 4>;
  constexpr size_t kNone = std::numeric_limits<size_t>::max();
  const auto face = [&](size_t i, int turn, size_t first) {
    const auto node = turn_corners(model.elements[static_cast<size_t>(elements[i])].node, turn);
    return Key{node[first], node[first + 1], node[first + 2], node[first + 3]};
  };
  const size_t count = elements.size();
  std::array<std::vector<size_t>, 3> next;
  std::array<size_t, 3> links{};
  for (int turn = 0; turn < 3; ++turn) {
    std::map<Key, size_t> low;
    for (size_t i = 0; i < count; ++i) low[face(i, turn, 0)] = i;
    std::vector<size_t>& to = next[static_cast<size_t>(turn)];
    to.assign(count, kNone);
    for (size_t i = 0; i < count; ++i)
      if (const auto found = low.find(face(i, turn, 4)); found != low.end())
        to[i] = found->second, ++links[static_cast<size_t>(turn)];
  }
  std::array<int, 3> turns{0, 1, 2};
  std::stable_sort(turns.begin(), turns.end(),
                   [&](int a, int b) { return links[static_cast<size_t>(a)] > links[static_cast<size_t>(b)]; });

  std::vector<Strip> strips;
  std::vector<std::uint8_t> used(count, 0);
  const auto take = [&](int turn, size_t least) {
    const std::vector<size_t>& to = next[static_cast<size_t>(turn)];
    std::vector<std::uint8_t> follows(count, 0), seen = used;
    for (size_t i = 0; i < count; ++i)
      if (used[i] == 0 && to[i] != kNone) follows[to[i]] = 1;
    for (const bool rings : {false, true})  // which have no beginning
      for (size_t i = 0; i < count; ++i) {
        if (seen[i] != 0 || (follows[i] != 0 && !rings)) continue;
        std::vector<size_t> line;
        for (size_t at = i; at != kNone && seen[at] == 0; at = to[at]) line.push_back(at), seen[at] = 1;
        if (line.size() < least) continue;
        Strip& strip = strips.emplace_back();
        for (const size_t at : line) {
          used[at] = 1;
          strip.push_back(elements[at]);
          turn_of_element[static_cast<size_t>(elements[at])] = static_cast<std::uint8_t>(turn);
        }
      }
  };
  constexpr size_t kLeast = 4;
  for (const int turn : turns) take(turn, kLeast);
  take(turns[0], 1);
  return strips;
}

/// Calls add(blocks of a group) for groups of `lanes` strips of one length, until all are used up; the last one may
/// have fewer lanes. Neighbours go to different groups where they can, so that a block's forces meet few common nodes.
template <class Add>
void pack_strips(std::vector<Strip> strips, size_t lanes, const Add& add) {
  const auto part = [](const Strip& strip, size_t first, size_t last) {
    return Strip(strip.begin() + static_cast<std::ptrdiff_t>(first), strip.begin() + static_cast<std::ptrdiff_t>(last));
  };
  while (!strips.empty()) {
    std::stable_sort(strips.begin(), strips.end(), [](const Strip& a, const Strip& b) { return a.size() > b.size(); });
    if (strips.size() < lanes && strips[0].size() > 1) {
      const size_t size = strips[0].size();
      strips.push_back(part(strips[0], size / 2, size));
      strips[0].resize(size / 2);
      continue;
    }
    if (strips.size() < lanes) {
      add(strips);
      return;
    }
    const size_t length = strips[lanes - 1].size();
    size_t count = lanes;
    while (count < strips.size() && strips[count].size() == length) ++count;
    const size_t groups = count / lanes;
    for (size_t k = 0; k < groups; ++k) {
      std::vector<Strip> group;
      for (size_t l = 0; l < lanes; ++l) group.push_back(part(strips[l * groups + k], 0, length));
      add(group);
    }
    std::vector<Strip> rest;
    for (size_t i = 0; i < strips.size(); ++i) {
      const size_t first = i < groups * lanes ? length : 0;
      if (strips[i].size() > first) rest.push_back(part(strips[i], first, strips[i].size()));
    }
    strips = std::move(rest);
  }
}

}  // namespace

std::array<int, 8> turn_corners(const std::array<int, 8>& node, int turn) {
  constexpr std::array<std::array<size_t, 8>, 3> kCorner = {
      {{0, 1, 2, 3, 4, 5, 6, 7}, {0, 3, 7, 4, 1, 2, 6, 5}, {0, 4, 5, 1, 3, 7, 6, 2}}};
  std::array<int, 8> turned{};
  for (size_t i = 0; i < 8; ++i) turned[i] = node[kCorner[static_cast<size_t>(turn)][i]];
  return turned;
}

size_t choose_chunk(const ExplicitModel& model) {
  // larger ones share fewer nodes; a small model still has some for each thread, and what is asked for ahead for the
  // next chunk is to stay in the second cache beside this one's, some 0.5 kB an element
  constexpr size_t kLargeCache = 3UL << 19;
  const size_t most = second_cache() >= kLargeCache ? 2000 : 1000;
  return std::clamp<size_t>(model.elements.size() / 32, 1000, most);
}

ExplicitChunks make_chunks(const ExplicitModel& model, size_t lanes, size_t elements_a_chunk) {
  ExplicitChunks c;
  c.W = lanes;
  const size_t E = model.elements.size(), N = model.nodes.size();
  std::vector<Vec3> centres(E);
  for (size_t e = 0; e < E; ++e) {
    for (const int n : model.elements[e].node) centres[e] += model.nodes[static_cast<size_t>(n)];
  }
  c.order.resize(E);
  std::iota(c.order.begin(), c.order.end(), 0);
  c.slot_of_element.resize(E), c.turn_of_element.assign(E, 0);
  Bisection(centres, elements_a_chunk).sort(c.order.data(), c.order.data() + E);
  std::vector<std::pair<size_t, size_t>> ranges;  // of order, chunk after chunk
  for (size_t i = 0; i < E; i += elements_a_chunk) ranges.emplace_back(i, std::min(E, i + elements_a_chunk));

  // which nodes are one chunk's alone
  constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max(), kSeveral = kNobody - 1;
  std::vector<std::uint32_t> owner(N, kNobody);
  for (size_t k = 0; k < ranges.size(); ++k)
    for (size_t i = ranges[k].first; i < ranges[k].second; ++i)
      for (const int n : model.elements[static_cast<size_t>(c.order[i])].node) {
        std::uint32_t& o = owner[static_cast<size_t>(n)];
        if (o == kNobody)
          o = static_cast<std::uint32_t>(k);
        else if (o != k)
          o = kSeveral;
      }
  constexpr std::uint32_t kUnset = kNobody;
  c.row_of_node.assign(N, kUnset);
  std::vector<std::uint32_t> copied(N, kNobody);  // the last chunk with a copy
  const auto add_row = [&](int n) {
    c.row_of_node[static_cast<size_t>(n)] = static_cast<std::uint32_t>(c.node_of_row.size());
    c.node_of_row.push_back(n);
  };
  for (size_t k = 0; k < ranges.size(); ++k) {
    ElementChunk chunk;
    chunk.first_row = c.node_of_row.size();
    for (size_t i = ranges[k].first; i < ranges[k].second; ++i)
      for (const int n : model.elements[static_cast<size_t>(c.order[i])].node)
        if (owner[static_cast<size_t>(n)] == k && c.row_of_node[static_cast<size_t>(n)] == kUnset) add_row(n);
    chunk.own = c.node_of_row.size() - chunk.first_row;
    // copies of the others
    for (size_t i = ranges[k].first; i < ranges[k].second; ++i)
      for (const int n : model.elements[static_cast<size_t>(c.order[i])].node) {
        if (owner[static_cast<size_t>(n)] != kSeveral || copied[static_cast<size_t>(n)] == k) continue;
        copied[static_cast<size_t>(n)] = static_cast<std::uint32_t>(k);
        c.node_of_row.push_back(n);
      }
    c.chunks.push_back(chunk);
  }
  c.first_shared_row = c.node_of_row.size();
  for (const int e : c.order)
    for (const int n : model.elements[static_cast<size_t>(e)].node)
      if (c.row_of_node[static_cast<size_t>(n)] == kUnset) add_row(n);
  for (size_t n = 0; n < N; ++n)
    if (c.row_of_node[n] == kUnset) add_row(static_cast<int>(n));

  // slots and the chunk's own numbers of nodes
  std::vector<std::uint32_t> place(N, kUnset);
  std::vector<std::uint32_t> count(c.node_of_row.size() - c.first_shared_row + 1, 0);
  for (size_t k = 0; k < ranges.size(); ++k) {
    ElementChunk& chunk = c.chunks[k];
    const size_t elements = ranges[k].second - ranges[k].first;
    chunk.first_block = c.element_of_slot.size() / c.W;
    chunk.first_shared = c.shared_rows.size();
    for (size_t i = 0; i < elements; ++i)
      for (const int n : model.elements[static_cast<size_t>(c.order[ranges[k].first + i])].node) {
        std::uint32_t& at = place[static_cast<size_t>(n)];
        const std::uint32_t row = c.row_of_node[static_cast<size_t>(n)];
        if (at != kUnset) continue;
        if (row < c.first_shared_row) {
          at = row - static_cast<std::uint32_t>(chunk.first_row);
        } else {
          at = static_cast<std::uint32_t>(chunk.own + c.shared_rows.size() - chunk.first_shared);
          c.shared_rows.push_back(row);
          ++count[row - c.first_shared_row];
        }
      }
    chunk.shared = c.shared_rows.size() - chunk.first_shared;
    c.most_nodes = std::max(c.most_nodes, chunk.own + chunk.shared);
    if (kernel::kNodeFields * c.most_nodes > std::numeric_limits<std::uint16_t>::max())
      return make_chunks(model, lanes, elements_a_chunk / 2);
    // blocks of one material, in strips
    std::vector<int> sorted(c.order.begin() + static_cast<std::ptrdiff_t>(ranges[k].first),
                            c.order.begin() + static_cast<std::ptrdiff_t>(ranges[k].second));
    const auto material_of = [&](int e) { return model.elements[static_cast<size_t>(e)].material; };
    std::stable_sort(sorted.begin(), sorted.end(), [&](int a, int b) { return material_of(a) < material_of(b); });
    for (size_t first = 0; first < elements;) {
      size_t last = first;
      while (last < elements && material_of(sorted[last]) == material_of(sorted[first])) ++last;
      const std::span<const int> same(sorted.data() + first, last - first);
      pack_strips(find_strips(model, same, c.turn_of_element), c.W, [&](const std::vector<Strip>& group) {
        for (size_t i = 0; i < group[0].size(); ++i) {
          const size_t block = c.material_of_block.size();
          c.material_of_block.push_back(static_cast<std::uint16_t>(material_of(sorted[first])));
          c.joined.push_back(i > 0 ? 1 : 0);
          c.element_of_slot.resize((block + 1) * c.W, -1);
          c.corners.resize((block + 1) * 8 * c.W);
          for (size_t l = 0; l < c.W; ++l) {
            const size_t e = static_cast<size_t>(group[l < group.size() ? l : 0][i]);
            if (l < group.size()) {
              c.element_of_slot[block * c.W + l] = static_cast<int>(e);
              c.slot_of_element[e] = static_cast<std::uint32_t>(block * c.W + l);
            }
            const auto node = turn_corners(model.elements[e].node, c.turn_of_element[e]);
            for (size_t j = 0; j < 8; ++j)
              c.corners[(block * 8 + j) * c.W + l] =
                  static_cast<std::uint16_t>(kernel::kNodeFields * place[static_cast<size_t>(node[j])]);
          }
        }
      });
      first = last;
    }
    chunk.blocks = c.material_of_block.size() - chunk.first_block;
    for (size_t i = 0; i < elements; ++i)
      for (const int n : model.elements[static_cast<size_t>(c.order[ranges[k].first + i])].node)
        place[static_cast<size_t>(n)] = kUnset;
  }
  c.starts.assign(c.node_of_row.size() - c.first_shared_row + 1, 0);
  for (size_t i = 0; i + 1 < c.starts.size(); ++i) c.starts[i + 1] = c.starts[i] + count[i];
  c.entries.resize(c.shared_rows.size());
  std::vector<std::uint32_t> next(c.starts.begin(), c.starts.end() - 1);
  for (size_t i = 0; i < c.shared_rows.size(); ++i)
    c.entries[next[c.shared_rows[i] - c.first_shared_row]++] = static_cast<std::uint32_t>(i);
  return c;
}

}  // namespace topple::fem
