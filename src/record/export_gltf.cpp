#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/bytes.h"
#include "base/file.h"
#include "record/export.h"

namespace topple::record {

namespace {

using json = nlohmann::ordered_json;

// Numbers of the glTF 2.0 specification.
constexpr int kFloat = 5126, kUnsignedShort = 5123, kVertices = 34962, kIndices = 34963, kLineLoop = 2;
constexpr std::uint32_t kMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

json to_list(const Vec3& v) { return {v.x, v.y, v.z}; }
json to_list(const Quat& q) { return {q.x, q.y, q.z, q.w}; }

/// The document and its one buffer, filled view by view.
class Document {
 public:
  json root{{"asset", {{"version", "2.0"}, {"generator", "topple"}}}};

  /// Begins a buffer view; accessors added next lie in it.
  void begin_view(int target) {
    json view{{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", 0}};
    if (target != 0) view["target"] = target;
    root["bufferViews"].push_back(std::move(view));
  }
  template <class Number>
  int add(const std::vector<Number>& values, int component_type, const char* type, std::size_t components,
          bool with_bounds) {
    json& view = root["bufferViews"].back();
    const std::size_t begin = view["byteOffset"];
    json accessor{{"bufferView", root["bufferViews"].size() - 1},
                  {"byteOffset", bytes_.size() - begin},
                  {"componentType", component_type},
                  {"count", values.size() / components},
                  {"type", type}};
    if (with_bounds) {
      std::vector<Number> low(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(components)), high = low;
      for (std::size_t i = 0; i < values.size(); ++i) {
        low[i % components] = std::min(low[i % components], values[i]);
        high[i % components] = std::max(high[i % components], values[i]);
      }
      accessor["min"] = low;
      accessor["max"] = high;
    }
    for (const Number value : values) append_little_endian(bytes_, value);
    while (bytes_.size() % 4 != 0) bytes_.push_back(0);
    view["byteLength"] = bytes_.size() - begin;
    root["accessors"].push_back(std::move(accessor));
    return static_cast<int>(root["accessors"].size()) - 1;
  }
  /// Appends to a list of the document; its place there.
  int put(const char* list, json item) {
    root[list].push_back(std::move(item));
    return static_cast<int>(root[list].size()) - 1;
  }
  std::string to_binary() {
    root["buffers"] = json::array({{{"byteLength", bytes_.size()}}});
    std::string text = root.dump(-1, ' ', false, json::error_handler_t::replace);
    while (text.size() % 4 != 0) text += ' ';
    if (12 + 8 + text.size() + 8 + bytes_.size() > std::numeric_limits<std::uint32_t>::max())
      throw std::runtime_error("a file of glTF holds 4 GB at most; export fewer frames (--frame-rate)");
    std::vector<std::uint8_t> out;
    const auto word = [&out](std::size_t value) { append_little_endian(out, static_cast<std::uint32_t>(value)); };
    word(kMagic), word(2), word(12 + 8 + text.size() + 8 + bytes_.size());
    word(text.size()), word(kJsonChunk);
    out.insert(out.end(), text.begin(), text.end());
    word(bytes_.size()), word(kBinaryChunk);
    out.insert(out.end(), bytes_.begin(), bytes_.end());
    return {out.begin(), out.end()};
  }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// A cube from -1 to 1 with a normal on each of its faces, in one mesh for each material.
class Cubes {
 public:
  explicit Cubes(Document& document) : document_(document) {
    std::vector<float> points, normals;
    std::vector<std::uint16_t> indices;
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {-1, 1}) {
        const auto first = static_cast<std::uint16_t>(points.size() / 3);
        for (const auto& [a, b] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
          std::array<int, 3> p{}, n{};
          p[axis] = n[axis] = side;
          p[(axis + 1) % 3] = a * side;  // counter-clockwise from outside on both sides
          p[(axis + 2) % 3] = b;
          for (const int x : p) points.push_back(static_cast<float>(x));
          for (const int x : n) normals.push_back(static_cast<float>(x));
        }
        for (const int i : {0, 1, 2, 0, 2, 3}) indices.push_back(static_cast<std::uint16_t>(first + i));
      }
    document_.begin_view(kVertices);
    points_ = document_.add(points, kFloat, "VEC3", 3, true);
    document_.begin_view(kVertices);
    normals_ = document_.add(normals, kFloat, "VEC3", 3, false);
    document_.begin_view(kIndices);
    indices_ = document_.add(indices, kUnsignedShort, "SCALAR", 1, false);
  }
  int mesh_of(const std::string& material) {
    const auto known = mesh_.find(material);
    if (known != mesh_.end()) return known->second;
    std::array<double, 4> colour{0.62, 0.62, 0.60, 1};
    if (material == "masonry") colour = {0.60, 0.32, 0.24, 1};
    if (material == "ground") colour = {0.45, 0.42, 0.36, 1};
    const int index = document_.put(
        "materials",
        {{"name", material},
         {"pbrMetallicRoughness", {{"baseColorFactor", colour}, {"metallicFactor", 0}, {"roughnessFactor", 0.9}}}});
    const json primitive{
        {"attributes", {{"POSITION", points_}, {"NORMAL", normals_}}}, {"indices", indices_}, {"material", index}};
    return mesh_[material] = document_.put("meshes", {{"name", material}, {"primitives", json::array({primitive})}});
  }

 private:
  Document& document_;
  int points_ = 0, normals_ = 0, indices_ = 0;
  std::map<std::string, int> mesh_;
};

/// Poses of one body in all frames. Where a pose is not finite the one before stays; quaternions are of unit length and
/// next to each other on the sphere, so that programs that mix them turn the short way.
struct Path {
  std::vector<float> place, turn;  // x y z; x y z w
  Pose start;
  bool moves = false;
};
Path find_path(const Record& r, std::size_t body) {
  Path path;
  Pose last;
  const std::size_t B = r.bodies.size();
  for (std::size_t s = 0; s < r.time.size(); ++s) {
    const float* p = &r.position[3 * (s * B + body)];
    const float* q = &r.orientation[4 * (s * B + body)];
    const double square = double{q[0]} * q[0] + double{q[1]} * q[1] + double{q[2]} * q[2] + double{q[3]} * q[3];
    if (std::isfinite(p[0] + p[1] + p[2]) && std::isfinite(square) && square > 1e-12) {
      Pose now = pose_at(r, s, body);
      const Quat& a = last.q;
      if (a.w * now.q.w + a.x * now.q.x + a.y * now.q.y + a.z * now.q.z < 0)
        now.q = {-now.q.w, -now.q.x, -now.q.y, -now.q.z};
      path.moves |= s > 0 && !(now == last);
      last = now;
    }
    if (s == 0) path.start = last;
    for (int i = 0; i < 3; ++i) path.place.push_back(static_cast<float>(last.p[i]));
    for (const double x : {last.q.x, last.q.y, last.q.z, last.q.w}) path.turn.push_back(static_cast<float>(x));
  }
  return path;
}

/// A box on its body as its member is crushed.
struct Crushing {
  std::vector<float> centre, half;  // (frames x 3)
  bool happens = false;
};

Crushing find_crushing(const Record& r, std::size_t body, std::size_t shape) {
  Crushing out;
  // what is crushed stays so
  const Vec3 whole = r.bodies[body].shapes[shape].half;
  if (shape_at(r, r.time.size() - 1, body, shape).half == whole) return out;
  out.happens = true;
  for (std::size_t s = 0; s < r.time.size(); ++s) {
    const BoxShape box = shape_at(r, s, body, shape);
    for (int i = 0; i < 3; ++i) {
      out.centre.push_back(static_cast<float>(box.X_BS.p[i]));
      out.half.push_back(static_cast<float>(box.half[i]));
    }
  }
  return out;
}

/// The outlines on the ground as loops of lines.
void add_outlines(Document& d, const Record& r, json& children) {
  const auto add = [&](const std::string& name, const std::vector<std::array<double, 2>>& outline) {
    if (outline.size() < 3) return;
    std::vector<float> points;
    for (const auto& p : outline)
      for (const double x : {p[0], p[1], 0.0}) points.push_back(static_cast<float>(x));
    d.begin_view(kVertices);
    const json primitive{{"attributes", {{"POSITION", d.add(points, kFloat, "VEC3", 3, true)}}}, {"mode", kLineLoop}};
    const int mesh = d.put("meshes", {{"name", name}, {"primitives", json::array({primitive})}});
    children.push_back(d.put("nodes", {{"name", name}, {"mesh", mesh}}));
  };
  add("building outline", r.building_outline);
  for (const Neighbour& n : r.neighbours) add(n.name, n.footprint);
}

}  // namespace

std::string to_gltf(const Record& r) {
  Document d;
  const double half_turn = std::sqrt(0.5);
  d.root["scene"] = 0;
  d.root["scenes"] = json::array({{{"name", "building"}, {"nodes", json::array({0})}}});
  // z up becomes y up
  d.put("nodes", {{"name", "world"}, {"rotation", {-half_turn, 0, 0, half_turn}}});
  json children = json::array();
  Cubes cubes(d);
  std::vector<std::pair<int, Path>> moving;
  std::vector<std::pair<int, Crushing>> crushed;
  for (std::size_t b = 0; b < r.bodies.size(); ++b) {
    const BodyInfo& body = r.bodies[b];
    if (r.time.empty()) continue;
    Path path = find_path(r, b);
    json shapes = json::array();
    for (std::size_t i = 0; i < body.shapes.size(); ++i) {
      const BoxShape s = shape_at(r, 0, b, i);
      const int node = d.put("nodes", {{"mesh", cubes.mesh_of(s.material)},
                                       {"translation", to_list(s.X_BS.p)},
                                       {"rotation", to_list(normalized(s.X_BS.q))},
                                       {"scale", to_list(s.half)}});
      shapes.push_back(node);
      Crushing crushing = find_crushing(r, b, i);
      if (crushing.happens) crushed.emplace_back(node, std::move(crushing));
    }
    const int node = d.put("nodes", {{"name", body.name},
                                     {"translation", to_list(path.start.p)},
                                     {"rotation", to_list(path.start.q)},
                                     {"extras", {{"kind", body.kind}, {"storey", body.storey}, {"mass", body.mass}}}});
    if (!shapes.empty()) d.root["nodes"][static_cast<size_t>(node)]["children"] = std::move(shapes);
    children.push_back(node);
    if (path.moves) moving.emplace_back(node, std::move(path));
  }
  add_outlines(d, r, children);
  if (!children.empty()) d.root["nodes"][0]["children"] = std::move(children);
  if (!moving.empty() || !crushed.empty()) {
    std::vector<float> time;
    for (const double t : r.time) time.push_back(static_cast<float>(t - r.time.front()));
    d.begin_view(0);
    const int input = d.add(time, kFloat, "SCALAR", 1, true);
    json samplers = json::array(), channels = json::array();
    const auto add = [&](int node, const char* what, int output) {
      channels.push_back({{"sampler", samplers.size()}, {"target", {{"node", node}, {"path", what}}}});
      samplers.push_back({{"input", input}, {"output", output}, {"interpolation", "LINEAR"}});
    };
    d.begin_view(0);
    for (const auto& [node, path] : moving) {
      add(node, "translation", d.add(path.place, kFloat, "VEC3", 3, false));
      add(node, "rotation", d.add(path.turn, kFloat, "VEC4", 4, false));
    }
    for (const auto& [node, crushing] : crushed) {
      add(node, "translation", d.add(crushing.centre, kFloat, "VEC3", 3, false));
      add(node, "scale", d.add(crushing.half, kFloat, "VEC3", 3, false));
    }
    d.put("animations", {{"name", "collapse"}, {"samplers", std::move(samplers)}, {"channels", std::move(channels)}});
  }
  return d.to_binary();
}

std::vector<std::string> export_gltf(const Record& r, const std::string& folder) {
  const std::string path = (std::filesystem::path(folder) / "record.glb").string();
  replace_file(path, to_gltf(r));
  return {path};
}

}  // namespace topple::record
