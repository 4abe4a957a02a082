#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <unistd.h>

#include <bit>
#include <chrono>
#include <filesystem>
#include <limits>
#include <random>
#include <thread>

#include "../base/own_folder.h"
#include "base/error.h"
#include "base/file.h"
#include "base/utf8.h"
#include "record/record.h"
#include "sample.h"

namespace topple::record {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::ThrowsMessage;

// Equality of bits: NaN equals itself and -0 differs from 0.
bool same(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }
bool same(float a, float b) { return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b); }
bool same(const Vec3& a, const Vec3& b) { return same(a.x, b.x) && same(a.y, b.y) && same(a.z, b.z); }
bool same(const Quat& a, const Quat& b) { return same(a.w, b.w) && same(a.x, b.x) && same(a.y, b.y) && same(a.z, b.z); }
bool same(const std::array<double, 2>& a, const std::array<double, 2>& b) {
  return same(a[0], b[0]) && same(a[1], b[1]);
}
bool same(const BoxShape& a, const BoxShape& b) {
  return same(a.X_BS.p, b.X_BS.p) && same(a.X_BS.q, b.X_BS.q) && same(a.half, b.half) && a.material == b.material &&
         a.part == b.part;
}
template <class T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const T& x, const T& y) { return same(x, y); });
}
void expect_same(const Record& a, const Record& b) {
  const Provenance &p = a.provenance, &q = b.provenance;
  EXPECT_EQ(p.title, q.title);
  EXPECT_EQ(p.plan_path, q.plan_path);
  EXPECT_EQ(p.plan_text, q.plan_text);
  EXPECT_EQ(p.plan_sha256, q.plan_sha256);
  EXPECT_EQ(p.program_version, q.program_version);
  EXPECT_EQ(p.engine, q.engine);
  EXPECT_EQ(p.machine, q.machine);
  EXPECT_EQ(p.created, q.created);
  EXPECT_EQ(p.seed, q.seed);
  EXPECT_TRUE(same(p.step, q.step));
  EXPECT_TRUE(same(p.wall_time, q.wall_time));
  EXPECT_EQ(p.threads, q.threads);

  EXPECT_EQ(a.counts.bodies, b.counts.bodies);
  EXPECT_EQ(a.counts.revolute_joints, b.counts.revolute_joints);
  EXPECT_EQ(a.counts.rigid_joints, b.counts.rigid_joints);
  EXPECT_EQ(a.counts.force_elements, b.counts.force_elements);
  EXPECT_EQ(a.counts.cables, b.counts.cables);
  EXPECT_TRUE(same(a.counts.mass, b.counts.mass));

  ASSERT_EQ(a.plan_values.size(), b.plan_values.size());
  for (std::size_t i = 0; i < a.plan_values.size(); ++i) {
    EXPECT_EQ(a.plan_values[i].group, b.plan_values[i].group);
    EXPECT_EQ(a.plan_values[i].key, b.plan_values[i].key);
    EXPECT_EQ(a.plan_values[i].value, b.plan_values[i].value);
  }
  ASSERT_EQ(a.bodies.size(), b.bodies.size());
  for (std::size_t i = 0; i < a.bodies.size(); ++i) {
    EXPECT_EQ(a.bodies[i].name, b.bodies[i].name);
    EXPECT_EQ(a.bodies[i].kind, b.bodies[i].kind);
    EXPECT_EQ(a.bodies[i].storey, b.bodies[i].storey);
    EXPECT_TRUE(same(a.bodies[i].mass, b.bodies[i].mass));
    EXPECT_EQ(a.bodies[i].fixed, b.bodies[i].fixed);
    EXPECT_EQ(a.bodies[i].belongs, b.bodies[i].belongs);
    EXPECT_TRUE(same(a.bodies[i].shapes, b.bodies[i].shapes)) << i;
  }
  ASSERT_EQ(a.zones.size(), b.zones.size());
  for (std::size_t i = 0; i < a.zones.size(); ++i) {
    EXPECT_EQ(a.zones[i].name, b.zones[i].name);
    EXPECT_EQ(a.zones[i].member, b.zones[i].member);
    EXPECT_EQ(a.zones[i].subsystem, b.zones[i].subsystem);
    EXPECT_EQ(a.zones[i].body_a, b.zones[i].body_a);
    EXPECT_EQ(a.zones[i].body_b, b.zones[i].body_b);
    EXPECT_TRUE(same(a.zones[i].p_W, b.zones[i].p_W));
  }
  ASSERT_EQ(a.neighbours.size(), b.neighbours.size());
  for (std::size_t i = 0; i < a.neighbours.size(); ++i) {
    EXPECT_EQ(a.neighbours[i].name, b.neighbours[i].name);
    EXPECT_TRUE(same(a.neighbours[i].footprint, b.neighbours[i].footprint));
    EXPECT_EQ(a.neighbours[i].is_utility, b.neighbours[i].is_utility);
  }
  EXPECT_TRUE(same(a.building_outline, b.building_outline));
  EXPECT_TRUE(same(a.time, b.time));
  EXPECT_TRUE(same(a.position, b.position));
  EXPECT_TRUE(same(a.orientation, b.orientation));
  EXPECT_EQ(a.zone_state, b.zone_state);
  EXPECT_EQ(a.crushed_ends, b.crushed_ends);
  EXPECT_EQ(a.crushed_length, b.crushed_length);
  EXPECT_TRUE(same(a.zone_utilisation, b.zone_utilisation));
  ASSERT_EQ(a.series.size(), b.series.size());
  for (std::size_t i = 0; i < a.series.size(); ++i) {
    EXPECT_EQ(a.series[i].id, b.series[i].id);
    EXPECT_EQ(a.series[i].title, b.series[i].title);
    EXPECT_EQ(a.series[i].unit, b.series[i].unit);
    EXPECT_EQ(a.series[i].group, b.series[i].group);
    EXPECT_TRUE(same(a.series[i].value, b.series[i].value));
  }
  ASSERT_EQ(a.outputs.size(), b.outputs.size());
  for (std::size_t i = 0; i < a.outputs.size(); ++i) {
    EXPECT_EQ(a.outputs[i].name, b.outputs[i].name);
    EXPECT_EQ(a.outputs[i].quantity, b.outputs[i].quantity);
    EXPECT_EQ(a.outputs[i].unit, b.outputs[i].unit);
    EXPECT_EQ(a.outputs[i].frame, b.outputs[i].frame);
    EXPECT_EQ(a.outputs[i].columns, b.outputs[i].columns);
    EXPECT_TRUE(same(a.outputs[i].time, b.outputs[i].time)) << i;
    EXPECT_TRUE(same(a.outputs[i].value, b.outputs[i].value)) << i;
  }
  ASSERT_EQ(a.events.size(), b.events.size());
  for (std::size_t i = 0; i < a.events.size(); ++i) {
    EXPECT_TRUE(same(a.events[i].time, b.events[i].time));
    EXPECT_EQ(a.events[i].kind, b.events[i].kind);
    EXPECT_EQ(a.events[i].subject, b.events[i].subject);
    EXPECT_EQ(a.events[i].text, b.events[i].text);
  }
  ASSERT_EQ(a.findings.size(), b.findings.size());
  for (std::size_t i = 0; i < a.findings.size(); ++i) {
    EXPECT_EQ(a.findings[i].id, b.findings[i].id);
    EXPECT_EQ(a.findings[i].heading, b.findings[i].heading);
    EXPECT_EQ(a.findings[i].title, b.findings[i].title);
    EXPECT_EQ(a.findings[i].text, b.findings[i].text);
    EXPECT_TRUE(same(a.findings[i].value, b.findings[i].value));
    EXPECT_EQ(a.findings[i].unit, b.findings[i].unit);
    EXPECT_EQ(a.findings[i].status, b.findings[i].status);
  }
  EXPECT_EQ(a.not_modelled, b.not_modelled);
  EXPECT_EQ(a.ending, b.ending);
  EXPECT_EQ(a.ending_text, b.ending_text);
}

class Hdf5 : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_ / name; }
  std::string code_of_reading(const std::string& name) const {
    try {
      (void)read_hdf5(path(name));
      return "none";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(path(name)));
      return error.diagnostics().at(0).code;
    }
  }

  OwnFolder folder_;
};

TEST_F(Hdf5, BringsEveryFieldBackBitForBit) {
  const Record sample = make_sample();
  write_hdf5(sample, path("record.h5"));
  expect_same(read_hdf5(path("record.h5")), sample);
}

TEST_F(Hdf5, KeepsAnEmptyRecord) {
  write_hdf5({}, path("record.h5"));
  expect_same(read_hdf5(path("record.h5")), {});
}

TEST_F(Hdf5, KeepsBodiesWithoutFramesAndFramesWithoutBodies) {
  Record no_frames = make_sample();
  no_frames.time.clear();
  no_frames.position.clear();
  no_frames.orientation.clear();
  no_frames.zone_state.clear();
  no_frames.zone_utilisation.clear();
  no_frames.crushed_length.clear();
  for (Series& series : no_frames.series) series.value.clear();
  write_hdf5(no_frames, path("a.h5"));
  expect_same(read_hdf5(path("a.h5")), no_frames);

  Record no_bodies;
  no_bodies.time = {0, 0.5, 2};
  write_hdf5(no_bodies, path("b.h5"));
  expect_same(read_hdf5(path("b.h5")), no_bodies);
}

TEST_F(Hdf5, KeepsTextsOfEverySize) {
  Record r;
  r.provenance.plan_text = std::string(300000, 'x') + "\n";
  r.provenance.title = std::string("a\0b", 3);
  r.not_modelled = {"", std::string(5000, 'y'), "z"};
  write_hdf5(r, path("record.h5"));
  expect_same(read_hdf5(path("record.h5")), r);
}

TEST_F(Hdf5, WritesEqualRecordsAsEqualFiles) {
  write_hdf5(make_sample(), path("a.h5"));
  // file formats count seconds: a time in the file would show
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  write_hdf5(make_sample(), path("b.h5"));
  EXPECT_TRUE(read_file(path("a.h5")) == read_file(path("b.h5")));
}

TEST_F(Hdf5, PacksLargeDatasets) {
  Record r;
  r.time.resize(5000);
  for (std::size_t i = 0; i < r.time.size(); ++i) r.time[i] = static_cast<double>(i);
  r.bodies.resize(20);
  r.position.assign(5000 * 20 * 3, 1.5F);
  r.orientation.assign(5000 * 20 * 4, 0.5F);
  write_hdf5(r, path("record.h5"));
  // 2.8 MB of equal poses
  EXPECT_LT(fs::file_size(path("record.h5")), 150000u);
  expect_same(read_hdf5(path("record.h5")), r);
}

std::string read_attribute(hid_t file, const char* object, const char* name) {
  const hid_t id = H5Aopen_by_name(file, object, name, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t type = H5Aget_type(id);
  std::string text(H5Tget_size(type), '\0');
  H5Aread(id, type, text.data());
  H5Tclose(type);
  H5Aclose(id);
  return text;
}

TEST_F(Hdf5, SaysWhatUtilisationIs) {
  Record r = make_sample();
  for (const char* engine : {"native", "finite elements"}) {
    r.provenance.engine = engine;
    write_hdf5(r, path("record.h5"));
    const hid_t file = H5Fopen(path("record.h5").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    ASSERT_GE(file, 0);
    EXPECT_THAT(
        read_attribute(file, "frames/zone_utilisation", "meaning"),
        testing::StartsWith(engine == std::string("native") ? "demand over capacity" : "stress over first yield"));
    H5Fclose(file);
    expect_same(read_hdf5(path("record.h5")), r);
  }
}

TEST_F(Hdf5, NamesUnitsAndFrames) {
  write_hdf5(make_sample(), path("record.h5"));
  const hid_t file = H5Fopen(path("record.h5").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  ASSERT_GE(file, 0);
  const auto attribute = [&](const char* object, const char* name) { return read_attribute(file, object, name); };
  EXPECT_EQ(attribute("/", "format"), "topple-record");
  EXPECT_EQ(attribute("frames/position", "unit"), "m");
  EXPECT_EQ(attribute("frames/position", "frame"), "world");
  EXPECT_EQ(attribute("shapes/centre", "frame"), "body");
  EXPECT_EQ(attribute("bodies/mass", "unit"), "kg");
  EXPECT_EQ(attribute("outputs/tilt", "quantity"), "orientation of body größe");
  EXPECT_EQ(attribute("outputs/tilt", "columns"), "w x y z");
  EXPECT_EQ(attribute("outputs/reaction [top]", "unit"), "N");
  EXPECT_EQ(attribute("outputs/reaction [top]", "frame"), "F");
  EXPECT_EQ(attribute("outputs/reaction [top]/value", "frame"), "F");
  EXPECT_EQ(attribute("outputs/y long/time", "unit"), "s");
  const hid_t set = H5Dopen2(file, "frames/position", H5P_DEFAULT), space = H5Dget_space(set);
  hsize_t shape[3] = {};
  ASSERT_EQ(H5Sget_simple_extent_ndims(space), 3);
  H5Sget_simple_extent_dims(space, shape, nullptr);
  EXPECT_THAT(shape, testing::ElementsAre(700, 5, 3));
  H5Sclose(space);
  H5Dclose(set);
  H5Fclose(file);
}

TEST_F(Hdf5, HasADescriptionOfEveryDataset) {
  write_hdf5({}, path("record.h5"));
  std::vector<std::string> names;
  const hid_t file = H5Fopen(path("record.h5").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const auto add = [](hid_t, const char* name, const H5O_info_t* info, void* found) -> herr_t {
    if (info->type == H5O_TYPE_DATASET) static_cast<std::vector<std::string>*>(found)->emplace_back(name);
    return 0;
  };
  ASSERT_GE(H5Ovisit(file, H5_INDEX_NAME, H5_ITER_INC, add, &names), 0);
  H5Fclose(file);
  EXPECT_GT(names.size(), 50u);
  const std::string text = read_file(std::string(TOPPLE_SOURCE_DIR) + "/docs/record.md");
  for (const std::string& name : names) {
    // a table of the page names its first column in full and the others by their last part
    const std::string last = name.substr(name.rfind('/') + 1);
    EXPECT_TRUE(text.find('`' + name + '`') != std::string::npos || text.find('`' + last + '`') != std::string::npos)
        << name << " is not in docs/record.md";
  }
}

TEST_F(Hdf5, RefusesFilesThatAreNoRecords) {
  EXPECT_EQ(code_of_reading("missing.h5"), "E701");
  replace_file(path("empty.h5"), "");
  EXPECT_EQ(code_of_reading("empty.h5"), "E702");
  replace_file(path("text.h5"), "title = \"a plan\"\n");
  EXPECT_EQ(code_of_reading("text.h5"), "E702");
  const hid_t file = H5Fcreate(path("other.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  H5Fclose(file);
  EXPECT_EQ(code_of_reading("other.h5"), "E702");
}

TEST_F(Hdf5, RefusesATruncatedFileAtEveryLength) {
  write_hdf5(make_sample(), path("record.h5"));
  const std::string bytes = read_file(path("record.h5"));
  for (std::size_t i = 0; i < 40; ++i) {
    replace_file(path("cut.h5"), bytes.substr(0, bytes.size() * i / 40));
    EXPECT_EQ(code_of_reading("cut.h5"), "E702") << i;
  }
  replace_file(path("cut.h5"), bytes.substr(0, bytes.size() - 1));
  EXPECT_EQ(code_of_reading("cut.h5"), "E702");
}

TEST_F(Hdf5, RefusesAMissingDataset) {
  write_hdf5(make_sample(), path("record.h5"));
  const hid_t file = H5Fopen(path("record.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  H5Ldelete(file, "zones/body_a", H5P_DEFAULT);
  H5Fclose(file);
  EXPECT_THAT([&] { (void)read_hdf5(path("record.h5")); }, ThrowsMessage<InputError>(HasSubstr("zones/body_a")));
}

/// Puts numbers over a dataset of a file.
void overwrite(const std::string& path, const char* name, hid_t type, const void* data) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), set = H5Dopen2(file, name, H5P_DEFAULT);
  ASSERT_GE(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data), 0);
  H5Dclose(set);
  H5Fclose(file);
}

TEST_F(Hdf5, RefusesContradictions) {
  const auto refused_after = [&](const char* name, hid_t type, const auto& data) {
    write_hdf5(make_sample(), path("record.h5"));
    overwrite(path("record.h5"), name, type, data.data());
    return code_of_reading("record.h5") == "E704";
  };
  EXPECT_TRUE(refused_after("zones/body_b", H5T_NATIVE_INT, std::vector{0, 1, 5}));
  EXPECT_TRUE(refused_after("zones/body_a", H5T_NATIVE_INT, std::vector{0, -2, 1}));
  EXPECT_TRUE(refused_after("bodies/beside", H5T_NATIVE_UINT8, std::vector<std::uint8_t>{0, 0, 3, 0, 0}));
  EXPECT_TRUE(refused_after("shapes/body", H5T_NATIVE_INT, std::vector{1, 2, 2, 5}));
  EXPECT_TRUE(refused_after("shapes/body", H5T_NATIVE_INT, std::vector{2, 1, 2, 4}));
  EXPECT_TRUE(refused_after("shapes/body", H5T_NATIVE_INT, std::vector{-1, 1, 2, 4}));
  EXPECT_TRUE(refused_after("findings/status", H5T_NATIVE_UINT8, std::vector<std::uint8_t>{0, 5, 0, 0}));
  EXPECT_TRUE(refused_after("outputs/reaction [top]/time", H5T_NATIVE_DOUBLE, std::vector<double>{1, 1}));
  EXPECT_TRUE(refused_after("crushed_ends/body", H5T_NATIVE_INT, std::vector{2, 1}));
  EXPECT_TRUE(refused_after("crushed_ends/body", H5T_NATIVE_INT, std::vector{1, 5}));
  EXPECT_TRUE(refused_after("crushed_ends/shape", H5T_NATIVE_INT, std::vector{0, 2}));
  EXPECT_TRUE(refused_after("crushed_ends/axis", H5T_NATIVE_INT, std::vector{2, 3}));
  EXPECT_TRUE(refused_after("crushed_ends/side", H5T_NATIVE_INT, std::vector{-1, 0}));
  EXPECT_TRUE(refused_after("frames/time", H5T_NATIVE_DOUBLE, std::vector<double>(700, 1)));
  EXPECT_TRUE(refused_after("frames/zone_state", H5T_NATIVE_UINT8, std::vector<std::uint8_t>(2100, 6)));
}

TEST_F(Hdf5, RefusesATableOfUnequalColumns) {
  write_hdf5(make_sample(), path("record.h5"));
  const hid_t file = H5Fopen(path("record.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  H5Ldelete(file, "bodies/mass", H5P_DEFAULT);
  const hsize_t four = 4;
  const hid_t space = H5Screate_simple(1, &four, nullptr);
  H5Dclose(H5Dcreate2(file, "bodies/mass", H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  H5Sclose(space);
  H5Fclose(file);
  EXPECT_EQ(code_of_reading("record.h5"), "E704");
}

TEST_F(Hdf5, ReadsRecordsWithoutOutputs) {
  write_hdf5(make_sample(), path("record.h5"));
  const hid_t file = H5Fopen(path("record.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  H5Ldelete(file, "outputs", H5P_DEFAULT);
  H5Fclose(file);
  Record expected = make_sample();
  expected.outputs.clear();
  expect_same(read_hdf5(path("record.h5")), expected);
}

TEST_F(Hdf5, ReadsRecordsThatDoNotSayWhatStandsBeside) {
  write_hdf5(make_sample(), path("record.h5"));
  const hid_t file = H5Fopen(path("record.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  H5Ldelete(file, "bodies/beside", H5P_DEFAULT);
  H5Fclose(file);
  Record expected = make_sample();
  for (BodyInfo& body : expected.bodies) body.belongs = Belonging::Unknown;
  expect_same(read_hdf5(path("record.h5")), expected);
}

TEST_F(Hdf5, ReadsRecordsOfBeforeEndsReceded) {
  write_hdf5(make_sample(), path("record.h5"));
  const hid_t file = H5Fopen(path("record.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  H5Ldelete(file, "crushed_ends", H5P_DEFAULT);
  H5Ldelete(file, "frames/crushed_length", H5P_DEFAULT);
  H5Fclose(file);
  Record expected = make_sample();
  expected.crushed_ends.clear(), expected.crushed_length.clear();
  expect_same(read_hdf5(path("record.h5")), expected);
}

TEST_F(Hdf5, RefusesOutputsThatDoNotFit) {
  Record wrong = make_sample();
  wrong.outputs[1].value.pop_back();
  EXPECT_THROW(write_hdf5(wrong, path("record.h5")), std::logic_error);
  wrong = make_sample();
  wrong.outputs[1].name = "a/b";
  EXPECT_THROW(write_hdf5(wrong, path("record.h5")), std::logic_error);
  write_hdf5(make_sample(), path("record.h5"));
  const hid_t file = H5Fopen(path("record.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  H5Ldelete(file, "outputs/reaction [top]/time", H5P_DEFAULT);
  H5Lcopy(file, "outputs/tilt/time", file, "outputs/reaction [top]/time", H5P_DEFAULT, H5P_DEFAULT);
  H5Fclose(file);
  EXPECT_EQ(code_of_reading("record.h5"), "E704");
}

TEST_F(Hdf5, KeepsWhatIsSaidOfOutputsAtAnyLength) {
  Record r = make_sample();
  r.outputs[0].quantity = "position of " + std::string(2000, 'B');
  r.outputs[1].frame = "body " + std::string(50000, 'C');
  write_hdf5(r, path("record.h5"));
  expect_same(read_hdf5(path("record.h5")), r);
  // what the format cannot hold ends at a whole character
  std::string longest = "of";
  while (longest.size() < 200000) longest += "ü€";
  r.outputs[0].quantity = longest;
  write_hdf5(r, path("record.h5"));
  const std::string read = read_hdf5(path("record.h5")).outputs[0].quantity;
  EXPECT_GT(read.size(), 50000U);
  EXPECT_TRUE(longest.starts_with(read) && is_utf8(read));
}

TEST_F(Hdf5, RefusesTimesThatAreNotFinite) {
  Record r = make_sample();
  r.time.back() = std::numeric_limits<double>::infinity();
  write_hdf5(r, path("record.h5"));
  EXPECT_EQ(code_of_reading("record.h5"), "E704");
  r = make_sample();
  r.outputs[1].time.back() = std::numeric_limits<double>::infinity();
  write_hdf5(r, path("record.h5"));
  EXPECT_EQ(code_of_reading("record.h5"), "E704");
}

TEST_F(Hdf5, RefusesADatasetLargerThanItsFile) {
  write_hdf5(make_sample(), path("record.h5"));
  const hid_t file = H5Fopen(path("record.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  H5Ldelete(file, "frames/time", H5P_DEFAULT);
  const hsize_t huge = hsize_t{1} << 50, chunk = 1000;
  const hid_t space = H5Screate_simple(1, &huge, nullptr), creation = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_chunk(creation, 1, &chunk);
  H5Dclose(H5Dcreate2(file, "frames/time", H5T_IEEE_F64LE, space, H5P_DEFAULT, creation, H5P_DEFAULT));
  H5Pclose(creation);
  H5Sclose(space);
  H5Fclose(file);
  EXPECT_EQ(code_of_reading("record.h5"), "E704");
}

TEST_F(Hdf5, RefusesANewerVersion) {
  write_hdf5(make_sample(), path("record.h5"));
  const hid_t file = H5Fopen(path("record.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const hid_t version = H5Aopen_by_name(file, "/", "version", H5P_DEFAULT, H5P_DEFAULT);
  const int next = 2;
  H5Awrite(version, H5T_NATIVE_INT, &next);
  H5Aclose(version);
  H5Fclose(file);
  EXPECT_EQ(code_of_reading("record.h5"), "E703");
}

TEST_F(Hdf5, NoticesDamagedPoses) {
  write_hdf5(make_sample(), path("record.h5"));
  const hid_t file = H5Fopen(path("record.h5").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t set = H5Dopen2(file, "frames/position", H5P_DEFAULT);
  const hsize_t origin[3] = {0, 0, 0};
  unsigned mask = 0;
  haddr_t address = 0;
  hsize_t size = 0;
  ASSERT_GE(H5Dget_chunk_info_by_coord(set, origin, &mask, &address, &size), 0);
  H5Dclose(set);
  H5Fclose(file);
  std::string bytes = read_file(path("record.h5"));
  bytes[address + size / 2] ^= 1;
  replace_file(path("record.h5"), bytes);
  EXPECT_EQ(code_of_reading("record.h5"), "E702");
}

TEST_F(Hdf5, NamesThePathThatCannotBeWritten) {
  replace_file(path("plain"), "x");
  EXPECT_THAT([&] { write_hdf5(make_sample(), path("plain/record.h5")); },
              ThrowsMessage<std::runtime_error>(HasSubstr(path("plain/record.h5"))));
  EXPECT_THAT([&] { write_hdf5(make_sample(), "/proc/topple/record.h5"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("/proc/topple/record.h5")));
}

TEST_F(Hdf5, MakesMissingFoldersAndLeavesNothingBeside) {
  write_hdf5({}, path("a/b/record.h5"));
  EXPECT_EQ(std::distance(fs::directory_iterator(path("a/b")), {}), 1);
}

TEST_F(Hdf5, LeavesTheOldFileWhenTheRecordDoesNotFitTogether) {
  write_hdf5(make_sample(), path("record.h5"));
  const std::string before = read_file(path("record.h5"));
  Record wrong = make_sample();
  wrong.position.pop_back();
  EXPECT_THROW(write_hdf5(wrong, path("record.h5")), std::logic_error);
  wrong = make_sample();
  wrong.series[1].value.push_back(1);
  EXPECT_THROW(write_hdf5(wrong, path("record.h5")), std::logic_error);
  EXPECT_TRUE(read_file(path("record.h5")) == before);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), {}), 1);
}

TEST_F(Hdf5, ServesSeveralThreads) {
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      const std::string name = path(std::to_string(t) + ".h5");
      for (int k = 0; k < 5; ++k) {
        write_hdf5(make_sample(), name);
        EXPECT_EQ(read_hdf5(name).time.size(), 700u);
      }
    });
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace topple::record
