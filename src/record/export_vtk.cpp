#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <regex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/bytes.h"
#include "base/file.h"
#include "record/export.h"

namespace topple::record {

namespace {

// Cell types of VTK.
constexpr std::uint8_t kVertex = 1, kPolyLine = 4, kHexahedron = 12;

template <class Number>
constexpr std::string_view type_name();
template <>
constexpr std::string_view type_name<float>() {
  return "Float32";
}
template <>
constexpr std::string_view type_name<double>() {
  return "Float64";
}
template <>
constexpr std::string_view type_name<std::int32_t>() {
  return "Int32";
}
template <>
constexpr std::string_view type_name<std::uint8_t>() {
  return "UInt8";
}

/// One array of a VTU file: the bytes behind their number (UInt32), as base64.
template <class Number>
std::string data_array(std::string_view name, const std::vector<Number>& values, int components = 1) {
  std::vector<std::uint8_t> bytes;
  append_little_endian(bytes, static_cast<std::uint32_t>(values.size() * sizeof(Number)));
  for (const Number value : values) append_little_endian(bytes, value);
  return fmt::format(R"(<DataArray type="{}" Name="{}" NumberOfComponents="{}" format="binary">{}</DataArray>)"
                     "\n",
                     type_name<Number>(), name, components, encode_base64(bytes));
}

/// An unstructured grid as it grows.
struct Grid {
  std::vector<float> points;  // x y z of each
  std::vector<std::int32_t> connectivity, offsets;
  std::vector<std::uint8_t> types;
  std::string point_data, cell_data;

  std::int32_t add_point(const Vec3& p) {
    for (int i = 0; i < 3; ++i) points.push_back(static_cast<float>(p[i]));
    return static_cast<std::int32_t>(points.size() / 3 - 1);
  }
  void end_cell(std::uint8_t type) {
    offsets.push_back(static_cast<std::int32_t>(connectivity.size()));
    types.push_back(type);
  }
  std::string to_vtu() const {
    return "<?xml version=\"1.0\"?>\n"
           "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt32\">\n" +
           fmt::format("<UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n", points.size() / 3,
                       types.size()) +
           "<Points>\n" + data_array("Points", points, 3) + "</Points>\n<Cells>\n" +
           data_array("connectivity", connectivity) + data_array("offsets", offsets) + data_array("types", types) +
           "</Cells>\n<PointData>\n" + point_data + "</PointData>\n<CellData>\n" + cell_data +
           "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
  }
};

std::uint8_t code_of(const std::string& word, std::span<const std::string_view> words) {
  return static_cast<std::uint8_t>(std::find(words.begin(), words.end(), word) - words.begin() + 1) %
         static_cast<std::uint8_t>(words.size() + 1);
}

/// Corners of a box in the order of VTK's hexahedron, in half edges.
constexpr std::array<Vec3, 8> kCorners{
    {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}}};

/// Every box of every body at a frame.
std::string make_parts(const Record& r, std::size_t frame) {
  static constexpr std::array<std::string_view, 7> kinds{"column", "beam", "slab", "wall", "node", "stump", "debris"};
  static constexpr std::array<std::string_view, 3> materials{"concrete", "masonry", "ground"};
  Grid grid;
  std::vector<float> moved;
  std::vector<std::int32_t> bodies, storeys;
  std::vector<std::uint8_t> kind, material, fixed;
  std::vector<double> mass;
  for (std::size_t b = 0; b < r.bodies.size(); ++b) {
    const BodyInfo& body = r.bodies[b];
    const Pose X_WB = pose_at(r, frame, b), X_WB0 = pose_at(r, 0, b);
    for (std::size_t k = 0; k < body.shapes.size(); ++k) {
      const BoxShape shape = shape_at(r, frame, b, k);
      for (const Vec3& c : kCorners) {
        const Vec3 p_B = shape.X_BS * Vec3{c.x * shape.half.x, c.y * shape.half.y, c.z * shape.half.z};
        const Vec3 p_W = X_WB * p_B, u = p_W - X_WB0 * p_B;
        grid.connectivity.push_back(grid.add_point(p_W));
        for (int i = 0; i < 3; ++i) moved.push_back(static_cast<float>(u[i]));
      }
      grid.end_cell(kHexahedron);
      bodies.push_back(static_cast<std::int32_t>(b));
      storeys.push_back(body.storey);
      kind.push_back(code_of(body.kind, kinds));
      material.push_back(code_of(shape.material, materials));
      fixed.push_back(body.fixed ? 1 : 0);
      mass.push_back(body.mass);
    }
  }
  grid.point_data = data_array("displacement", moved, 3);
  grid.cell_data = data_array("body", bodies) + data_array("storey", storeys) + data_array("kind", kind) +
                   data_array("material", material) + data_array("fixed", fixed) + data_array("mass", mass);
  return grid.to_vtu();
}

/// Every zone at a frame, where the body that it belongs to has taken it.
std::string make_zones(const Record& r, std::size_t frame) {
  Grid grid;
  const std::size_t Z = r.zones.size();
  std::vector<std::int32_t> index;
  for (std::size_t z = 0; z < Z; ++z) {
    const ZoneInfo& zone = r.zones[z];
    const int on = zone.body_b >= 0 ? zone.body_b : zone.body_a;
    Vec3 p = zone.p_W;
    if (on >= 0) {
      const auto b = static_cast<std::size_t>(on);
      p = pose_at(r, frame, b) * (inverse(pose_at(r, 0, b)) * p);
    }
    grid.connectivity.push_back(grid.add_point(p));
    grid.end_cell(kVertex);
    index.push_back(static_cast<std::int32_t>(z));
  }
  const auto row = [frame, Z](const auto& all) {
    const auto from = all.begin() + static_cast<std::ptrdiff_t>(frame * Z);
    return std::vector(from, from + static_cast<std::ptrdiff_t>(Z));
  };
  grid.cell_data = data_array("zone", index) + data_array("state", row(r.zone_state)) +
                   data_array("utilisation", row(r.zone_utilisation));
  return grid.to_vtu();
}

/// Outlines on the ground, closed: neighbours from 0, the building -1.
std::string make_site(const Record& r) {
  Grid grid;
  std::vector<std::int32_t> neighbour;
  std::vector<std::uint8_t> is_utility;
  const auto add = [&](const std::vector<std::array<double, 2>>& outline, int index, bool utility) {
    if (outline.empty()) return;
    const std::int32_t first = grid.add_point({outline[0][0], outline[0][1], 0});
    grid.connectivity.push_back(first);
    for (std::size_t i = 1; i < outline.size(); ++i)
      grid.connectivity.push_back(grid.add_point({outline[i][0], outline[i][1], 0}));
    if (outline.size() > 1) grid.connectivity.push_back(first);
    grid.end_cell(outline.size() > 1 ? kPolyLine : kVertex);
    neighbour.push_back(index);
    is_utility.push_back(utility ? 1 : 0);
  };
  add(r.building_outline, -1, false);
  for (std::size_t n = 0; n < r.neighbours.size(); ++n)
    add(r.neighbours[n].footprint, static_cast<int>(n), r.neighbours[n].is_utility);
  grid.cell_data = data_array("neighbour", neighbour) + data_array("is_utility", is_utility);
  return grid.to_vtu();
}

/// Files of an export, which may have had more frames, and the folder if nothing else is in it.
void remove_earlier(const std::filesystem::path& where) {
  static const std::regex name("((parts|zones)_[0-9]{5,}|site)\\.vtu");
  std::error_code ignored;
  std::filesystem::remove(where / "record.pvd", ignored);
  std::vector<std::filesystem::path> files;
  for (std::filesystem::directory_iterator at(where / "vtk", ignored), end; !ignored && at != end;
       at.increment(ignored))
    if (std::regex_match(at->path().filename().string(), name)) files.push_back(at->path());
  for (const auto& file : files) std::filesystem::remove(file, ignored);
  std::filesystem::remove(where / "vtk", ignored);
}

}  // namespace

std::vector<std::string> export_vtk(const Record& r, const std::string& folder,
                                    const std::function<bool()>& is_cancelled) {
  const std::filesystem::path where(folder);
  remove_earlier(where);
  std::vector<std::string> paths{(where / "record.pvd").string()};
  std::string list;
  const auto put = [&](const std::string& name, const std::string& text) {
    paths.push_back((where / "vtk" / name).string());
    replace_file(paths.back(), text);
  };
  try {
    put("site.vtu", make_site(r));
    for (std::size_t s = 0; s < r.time.size(); ++s) {
      if (is_cancelled && is_cancelled()) {
        remove_earlier(where);
        return {};
      }
      const std::string parts = fmt::format("parts_{:05}.vtu", s), zones = fmt::format("zones_{:05}.vtu", s);
      put(parts, make_parts(r, s));
      put(zones, make_zones(r, s));
      for (int part = 0; const std::string& name : {parts, zones, std::string("site.vtu")})
        list +=
            fmt::format("<DataSet timestep=\"{}\" group=\"\" part=\"{}\" file=\"vtk/{}\"/>\n", r.time[s], part++, name);
    }
    replace_file(paths.front(),
                 "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n"
                 "<Collection>\n" +
                     list + "</Collection>\n</VTKFile>\n");
  } catch (...) {  // e.g. a full disk: half of an export is none
    remove_earlier(where);
    throw;
  }
  return paths;
}

}  // namespace topple::record
