#include "record/export.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "../base/own_folder.h"
#include "base/bytes.h"
#include "base/file.h"
#include "sample.h"

namespace topple::record {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string read(const OwnFolder& folder, const std::string& name) { return read_file(folder / name); }

/// Two bodies of three boxes in all, of which one moves and turns; one zone between them.
Record make_two() {
  Record r;
  r.bodies = {{"C-A1-0", "column", 0, 1500, false, {{{{0, 0, 0.5}, {}}, {0.2, 0.25, 1.5}, "concrete"}}},
              {"W",
               "wall",
               1,
               900,
               false,
               {{{{1, 0, 0}, exp_rotation({0, 0, 0.5})}, {1, 0.1, 1.2}, "masonry"},
                {{{-1, 0, 0}, {}}, {0.5, 0.1, 1.2}, "concrete"}}},
              {"S", "stump", 0, 10, true, {{{}, {0.1, 0.1, 0.1}, "concrete"}}}};
  r.zones = {{"C-A1-0/top", "C-A1-0", "six-component element", 0, 1, {0.5, 0.25, 3}}};
  r.building_outline = {{0, 0}, {18.5, 0}, {18.5, 12.25}, {0, 12.25}};
  r.neighbours = {{"Mill Street 4", {{30, 0}, {40, 0}, {40, 8}}, false}, {"main", {{-5, 0}, {-5, 9}}, true}};
  const Quat turned[] = {{}, exp_rotation({0.3, 0.4, 0}), exp_rotation({0, 1, 0.2}), exp_rotation({0, 3, 0.2})};
  for (int s = 0; s < 4; ++s) {
    r.time.push_back(0.5 + 0.25 * s);
    const Pose poses[] = {{{0, 0, 1}, {}}, {{1.0 * s, 2, 3 - 0.1 * s * s}, turned[s]}, {{0, 0, 0}, {}}};
    for (const Pose& X : poses) {
      for (int k = 0; k < 3; ++k) r.position.push_back(static_cast<float>(X.p[k]));
      // the sign of a quaternion is free
      const double sign = s == 2 ? -1 : 1;
      for (const double q : {X.q.w, X.q.x, X.q.y, X.q.z}) r.orientation.push_back(static_cast<float>(sign * q));
    }
    r.zone_state.push_back(static_cast<std::uint8_t>(s / 2 * 3));
    r.zone_utilisation.push_back(0.25F * static_cast<float>(s));
  }
  r.series = {{"tilt_angle", "Tilt angle", "rad", "angle", {0, 1, 2, 3}}};
  r.ending = "at_rest";
  return r;
}

std::vector<std::uint8_t> decode_base64(const std::string& text) {
  static const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<std::uint8_t> out;
  std::uint32_t word = 0;
  int bits = 0;
  for (const char c : text) {
    if (c == '=') break;
    word = word << 6 | static_cast<std::uint32_t>(digits.find(c));
    if ((bits += 6) >= 8) out.push_back(static_cast<std::uint8_t>(word >> (bits -= 8) & 255U));
  }
  return out;
}

/// The numbers of one array of a VTU file, after its header of four bytes.
template <class Number>
std::vector<Number> read_array(const std::string& vtu, const std::string& name) {
  const std::regex array("<DataArray [^>]*Name=\"" + name + "\"[^>]*>([^<]*)<");
  std::smatch found;
  if (!std::regex_search(vtu, found, array)) return {};
  const auto bytes = decode_base64(found[1]);
  std::uint32_t size = 0;
  std::memcpy(&size, bytes.data(), 4);
  EXPECT_EQ(size, bytes.size() - 4);
  std::vector<Number> values(size / sizeof(Number));
  std::memcpy(values.data(), bytes.data() + 4, size);
  return values;
}

TEST(Base64, KnowsTheVectorsOfItsStandard) {
  // RFC 4648, section 10
  const std::string words[] = {"", "f", "fo", "foo", "foob", "fooba", "foobar"};
  const std::string coded[] = {"", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"};
  for (int i = 0; i < 7; ++i)
    EXPECT_EQ(encode_base64(std::vector<std::uint8_t>(words[i].begin(), words[i].end())), coded[i]);
}

TEST(ExportVtk, PlacesEveryCornerWhereTheRecordHasIt) {
  const OwnFolder folder;
  const Record r = make_two();
  const auto paths = export_vtk(r, folder.str());
  EXPECT_EQ(paths.size(), 1 + 1 + 2 * r.time.size());
  for (std::size_t s = 0; s < r.time.size(); ++s) {
    const std::string vtu = read(folder, "vtk/parts_0000" + std::to_string(s) + ".vtu");
    const auto points = read_array<float>(vtu, "Points"), moved = read_array<float>(vtu, "displacement");
    ASSERT_EQ(points.size(), 4 * 8 * 3U);
    std::size_t i = 0;
    for (std::size_t b = 0; b < r.bodies.size(); ++b)
      for (const BoxShape& shape : r.bodies[b].shapes) {
        // the set of corners, by the signs along the box's own axes
        std::vector<int> seen;
        for (int corner = 0; corner < 8; ++corner, i += 3) {
          const Vec3 p_W{points[i], points[i + 1], points[i + 2]};
          const Vec3 p_S = inverse(pose_at(r, s, b) * shape.X_BS) * p_W;
          for (int k = 0; k < 3; ++k) EXPECT_NEAR(std::abs(p_S[k]), shape.half[k], 2e-6);  // float32 of some metres
          seen.push_back((p_S.x > 0) + 2 * (p_S.y > 0) + 4 * (p_S.z > 0));
          const Vec3 start = pose_at(r, 0, b) * (shape.X_BS * p_S);
          for (int k = 0; k < 3; ++k) EXPECT_NEAR(moved[i + static_cast<std::size_t>(k)], p_W[k] - start[k], 4e-6);
        }
        EXPECT_EQ(seen,
                  (std::vector<int>{0, 1, 3, 2, 4, 5, 7, 6}));  // VTK_HEXAHEDRON: around the bottom, around the top
      }
    EXPECT_EQ(read_array<std::uint8_t>(vtu, "types"), (std::vector<std::uint8_t>(4, 12)));
    EXPECT_EQ(read_array<std::int32_t>(vtu, "offsets"), (std::vector<std::int32_t>{8, 16, 24, 32}));
    EXPECT_EQ(read_array<std::int32_t>(vtu, "body"), (std::vector<std::int32_t>{0, 1, 1, 2}));
    EXPECT_EQ(read_array<std::uint8_t>(vtu, "kind"), (std::vector<std::uint8_t>{1, 4, 4, 6}));
    EXPECT_EQ(read_array<std::uint8_t>(vtu, "material"), (std::vector<std::uint8_t>{1, 2, 1, 1}));
    EXPECT_EQ(read_array<std::uint8_t>(vtu, "fixed"), (std::vector<std::uint8_t>{0, 0, 0, 1}));
    EXPECT_EQ(read_array<double>(vtu, "mass"), (std::vector<double>{1500, 900, 900, 10}));
  }
}

/// The column's foot recedes by 0.4 m in frame 2 and by 0.6 m in frame 3, an end of the wall's second box never.
Record make_crushed() {
  Record r = make_two();
  r.crushed_ends = {{0, 0, 2, -1}, {1, 1, 0, 1}};
  r.crushed_length = {0, 0, 0, 0, 0.4F, 0, 0.6F, 0};
  return r;
}

TEST(CrushedEnds, TakeTheirPartOfABox) {
  Record r = make_crushed();
  const BoxShape& whole = r.bodies[0].shapes[0];
  EXPECT_EQ(shape_at(r, 1, 0, 0).half, whole.half);
  const BoxShape box = shape_at(r, 2, 0, 0);
  EXPECT_NEAR(box.half.z, 1.3, 1e-7);
  EXPECT_NEAR(box.X_BS.p.z + box.half.z, 2, 1e-7) << "the top stays";
  EXPECT_EQ(box.half.x, whole.half.x);
  EXPECT_EQ(shape_at(r, 3, 1, 1).X_BS.p, r.bodies[1].shapes[1].X_BS.p);
  // a turned box, both of its ends
  r.crushed_ends = {{1, 0, 0, -1}, {1, 0, 0, 1}};
  r.crushed_length = {0, 0, 0, 0, 0.4F, 0, 0.6F, 0.2F};
  const BoxShape turned = shape_at(r, 3, 1, 0);
  EXPECT_NEAR(turned.half.x, 0.6, 1e-7);
  EXPECT_NEAR(norm(turned.X_BS.p - Vec3{1 + 0.2 * std::cos(0.5), 0.2 * std::sin(0.5), 0}), 0, 1e-7);
}

TEST(ExportVtk, LeavesNoFramesOfAnEarlierExport) {
  const OwnFolder folder;
  const Record r = make_two();
  const auto paths = export_vtk(r, folder.str());
  const fs::path last = fs::path(paths.back()), own = last.parent_path() / "parts_of_mine.vtu";
  std::ofstream(own) << "mine";
  export_vtk(keep_frames(r, 1e6), folder.str());
  EXPECT_FALSE(fs::exists(last));
  EXPECT_TRUE(fs::exists(own));
  // what is cancelled between two frames leaves nothing
  int asked = 0;
  EXPECT_TRUE(export_vtk(r, folder.str(), [&] { return ++asked > 2; }).empty());
  EXPECT_EQ(asked, 3);
  EXPECT_FALSE(fs::exists(folder.path() / "record.pvd"));
  EXPECT_EQ(std::distance(fs::directory_iterator(last.parent_path()), {}), 1) << "but the file of another";
}

TEST(ExportVtk, LeavesNothingOnAFullDisk) {
  const OwnFolder folder;
  Record r = make_sample();
  export_vtk(r, folder.str());
  const auto size = std::filesystem::file_size(folder / "vtk/site.vtu"),
             parts = std::filesystem::file_size(folder / "vtk/parts_00000.vtu");
  ASSERT_GT(parts, size + 1);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{size, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(export_vtk(r, folder.str()), std::runtime_error);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 0);
}

TEST(ExportGltf, HasANodeForBodiesWithoutBoxes) {
  Record r = make_two();
  r.bodies[1].shapes.clear();
  const std::string glb = to_gltf(r);
  const std::size_t length = *reinterpret_cast<const std::uint32_t*>(glb.data() + 12);
  const auto j = nlohmann::json::parse(glb.substr(20, length));
  int found = 0;
  for (const auto& node : j["nodes"])
    if (node.value("name", "") == r.bodies[1].name) {
      ++found;
      EXPECT_FALSE(node.contains("mesh"));
      EXPECT_FALSE(node.contains("children"));
      EXPECT_EQ(node["extras"]["mass"], r.bodies[1].mass);
    }
  EXPECT_EQ(found, 1);
}

TEST(ExportVtk, DrawsWhatCrushingLeaves) {
  const OwnFolder folder;
  export_vtk(make_crushed(), folder.str());
  const auto points = read_array<float>(read(folder, "vtk/parts_00003.vtu"), "Points");
  std::vector<float> z;
  for (std::size_t corner = 0; corner < 8; ++corner) z.push_back(points[3 * corner + 2]);
  EXPECT_NEAR(*std::min_element(z.begin(), z.end()), 0.6, 1e-6);
  EXPECT_NEAR(*std::max_element(z.begin(), z.end()), 3, 1e-6);
}

TEST(ExportVtk, ListsEveryFrameAtItsTimeAndZonesMoveWithTheirBody) {
  const OwnFolder folder;
  const Record r = make_two();
  export_vtk(r, folder.str());
  const std::string pvd = read(folder, "record.pvd");
  const std::regex entry("timestep=\"([^\"]*)\" group=\"\" part=\"([0-9])\" file=\"([^\"]*)\"");
  std::size_t n = 0;
  for (std::sregex_iterator i(pvd.begin(), pvd.end(), entry), end; i != end; ++i, ++n) {
    EXPECT_EQ(std::stod((*i)[1]), r.time[n / 3]);
    EXPECT_TRUE(fs::is_regular_file(folder.path() / (*i)[3].str())) << (*i)[3];
  }
  EXPECT_EQ(n, 3 * r.time.size());
  const std::string zones = read(folder, "vtk/zones_00003.vtu");
  const auto p = read_array<float>(zones, "Points");
  // body W at frame 3: its zone stood at (0.5, 0.25, 3) when W stood at (0, 2, 3)
  const Vec3 expected = pose_at(r, 3, 1) * Vec3{0.5, -1.75, 0};
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(p[static_cast<std::size_t>(k)], expected[k], 2e-6);
  EXPECT_EQ(read_array<std::uint8_t>(zones, "state"), std::vector<std::uint8_t>{3});
  EXPECT_EQ(read_array<float>(zones, "utilisation"), std::vector<float>{0.75F});
  const std::string site = read(folder, "vtk/site.vtu");
  EXPECT_EQ(read_array<std::int32_t>(site, "neighbour"), (std::vector<std::int32_t>{-1, 0, 1}));
  EXPECT_EQ(read_array<std::int32_t>(site, "offsets"), (std::vector<std::int32_t>{5, 9, 12}));
}

/// The two chunks of a binary glTF file.
struct Glb {
  json root;
  std::string buffer;
  explicit Glb(const std::string& bytes) {
    const auto word = [&bytes](std::size_t at) {
      std::uint32_t value = 0;
      std::memcpy(&value, bytes.data() + at, 4);
      return value;
    };
    EXPECT_EQ(word(0), 0x46546C67U);
    EXPECT_EQ(word(8), bytes.size());
    const std::size_t size = word(12);
    root = json::parse(bytes.substr(20, size));
    buffer = bytes.substr(28 + size);
    EXPECT_EQ(word(20 + size), buffer.size());
  }
  std::vector<float> floats(const json& index) const {
    const json& a = root["accessors"].at(index.get<std::size_t>());
    const std::size_t width = a["type"] == "SCALAR" ? 1 : a["type"] == "VEC3" ? 3 : 4;
    std::vector<float> values(a["count"].get<std::size_t>() * width);
    const std::size_t at = root["bufferViews"].at(a["bufferView"].get<std::size_t>())["byteOffset"].get<std::size_t>() +
                           a["byteOffset"].get<std::size_t>();
    EXPECT_LE(at + 4 * values.size(), buffer.size());
    std::memcpy(values.data(), buffer.data() + at, 4 * values.size());
    return values;
  }
};

TEST(ExportGltf, MovesWhatMovesAndTurnsTheShortWay) {
  const Record r = make_two();
  const Glb glb(to_gltf(r));
  const json& animation = glb.root["animations"][0];
  ASSERT_EQ(animation["channels"].size(), 2U);  // only W moves
  for (const json& channel : animation["channels"]) {
    const json& sampler = animation["samplers"].at(channel["sampler"].get<std::size_t>());
    EXPECT_EQ(glb.root["nodes"].at(channel["target"]["node"].get<std::size_t>())["name"], "W");
    EXPECT_EQ(glb.floats(sampler["input"]), (std::vector<float>{0, 0.25F, 0.5F, 0.75F}));
    const auto values = glb.floats(sampler["output"]);
    if (channel["target"]["path"] == "translation") {
      for (std::size_t s = 0; s < 4; ++s)
        for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(values[3 * s + k], r.position[(3 * s + 1) * 3 + k]);
      continue;
    }
    for (std::size_t s = 0; s < 4; ++s) {
      const float* q = &values[4 * s];
      EXPECT_NEAR(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], 1, 1e-6);
      const Mat3 R = to_matrix(normalized({q[3], q[0], q[1], q[2]})), expected = to_matrix(pose_at(r, s, 1).q);
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(R(i, k), expected(i, k), 1e-6);
      if (s > 0) { EXPECT_GT(q[0] * q[-4] + q[1] * q[-3] + q[2] * q[-2] + q[3] * q[-1], 0); }
    }
  }
}

TEST(ExportGltf, ShortensWhatIsCrushed) {
  const Glb glb(to_gltf(make_crushed()));
  const json& animation = glb.root["animations"][0];
  ASSERT_EQ(animation["channels"].size(), 4U);
  std::size_t column = 0;
  for (const json& node : glb.root["nodes"])
    if (node.value("name", "") == "C-A1-0") column = node["children"][0].get<std::size_t>();
  for (std::size_t i : {2U, 3U}) {
    const json& channel = animation["channels"][i];
    EXPECT_EQ(channel["target"]["node"], column);
    const auto values = glb.floats(animation["samplers"].at(channel["sampler"].get<std::size_t>())["output"]);
    const bool is_scale = channel["target"]["path"] == "scale";
    EXPECT_NEAR(values[3 * 3 + 2], is_scale ? 1.2 : 0.8, 1e-6);
    EXPECT_NEAR(values[3 * 1 + 2], is_scale ? 1.5 : 0.5, 1e-6);
  }
}

TEST(ExportGltf, HoldsTheLastPoseWhereOneIsNotANumber) {
  Record r = make_two();
  for (std::size_t k = 0; k < 3; ++k) r.position[(3 * 2 + 1) * 3 + k] = std::nanf("");
  for (std::size_t k = 0; k < 4; ++k) r.orientation[(3 * 3 + 1) * 4 + k] = 0;
  const Glb glb(to_gltf(r));
  const auto place = glb.floats(glb.root["animations"][0]["samplers"][0]["output"]);
  for (std::size_t s : {2U, 3U})
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(place[3 * s + k], place[3 + k]);
}

TEST(ExportGltf, WritesEvenAnEmptyRecord) {
  const Glb glb(to_gltf(Record{}));
  EXPECT_FALSE(glb.root.contains("animations"));
  EXPECT_EQ(glb.root["nodes"].size(), 1U);
}

TEST(ExportJson, HoldsTheRecordAsPlainNumbers) {
  const OwnFolder folder;
  const Record r = make_two();
  export_json(r, folder.str());
  const json j = json::parse(read(folder, "record.json"));
  EXPECT_EQ(j["format"], "topple-record-json");
  ASSERT_EQ(j["position"].size(), 4U);
  ASSERT_EQ(j["position"][3].size(), 3U);
  EXPECT_EQ(j["position"][3][1], (json{3, 2, 2.1}));  // the shortest digits of the float
  EXPECT_EQ(j["orientation"][0][1], (json{1, 0, 0, 0}));
  EXPECT_EQ(j["zone_state"], (json{{0}, {0}, {3}, {3}}));
  EXPECT_EQ(j["zone_utilisation"][3][0], 0.75);
  EXPECT_EQ(j["bodies"][1]["shapes"].size(), 2U);
}

TEST(ExportJson, ListsTheEndsThatRecede) {
  const OwnFolder folder;
  export_json(make_crushed(), folder.str());
  const json j = json::parse(read(folder, "record.json"));
  EXPECT_EQ(j["crushed_ends"],
            (json{{{"body", 0}, {"shape", 0}, {"axis", 2}, {"side", -1}, {"length", {0, 0, 0.4, 0.6}}}}));
}

TEST(ExportJson, TakesAwkwardRecords) {
  const OwnFolder folder;
  export_json(make_sample(), folder.str());
  const json j = json::parse(read(folder, "record.json"));
  EXPECT_TRUE(j["position"][0][1][1].is_null());  // a NaN
  EXPECT_EQ(j["events"].size(), 3U);
}

TEST(ExportCsv, HoldsOneLinePerFrameAndBodyAndEachChangeOfAZone) {
  const OwnFolder folder;
  const auto paths = export_csv(make_two(), folder.str());
  EXPECT_EQ(paths.size(), 6U);
  std::istringstream poses(read(folder, "poses.csv"));
  std::vector<std::string> lines;
  for (std::string line; std::getline(poses, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 1 + 4 * 3U);
  EXPECT_EQ(lines[0], "time [s],body,x [m],y [m],z [m],qw,qx,qy,qz\r");
  EXPECT_EQ(lines[2], "0.5,W,0,2,3,1,0,0,0\r");
  EXPECT_EQ(read(folder, "zones.csv"),
            "time [s],zone,member,subsystem,state,utilisation\r\n"
            "0.5,C-A1-0/top,C-A1-0,six-component element,elastic,0\r\n"
            "1,C-A1-0/top,C-A1-0,six-component element,broken,0.5\r\n");
}

TEST(KeepFrames, KeepsFirstAndLastAndTheInterval) {
  const Record r = make_sample();  // every 16 ms
  const Record kept = keep_frames(r, 0.032);
  EXPECT_EQ(kept.time.size(), 351U);
  EXPECT_EQ(kept.time.front(), r.time.front());
  EXPECT_EQ(kept.time[1], r.time[2]);
  EXPECT_EQ(kept.time.back(), r.time.back());
  for (std::size_t b = 0; b < r.bodies.size(); ++b) EXPECT_EQ(pose_at(kept, 100, b), pose_at(r, 200, b));
  EXPECT_EQ(kept.series[0].value[100], r.series[0].value[200]);
  EXPECT_EQ(kept.crushed_length[100 * 2 + 1], r.crushed_length[200 * 2 + 1]);
  EXPECT_EQ(kept.zone_state[100 * 3 + 1], r.zone_state[200 * 3 + 1]);
  EXPECT_EQ(keep_frames(r, 0).time, r.time);
}

}  // namespace
}  // namespace topple::record
