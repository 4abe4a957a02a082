#include "record/hdf5.h"

#include <hdf5.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iterator>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/file.h"

namespace topple::record {

namespace {

constexpr std::string_view format_name = "topple-record";
constexpr std::int32_t format_version = 1;
constexpr std::size_t most_attribute_bytes = 60000;  // of a text; the format's own limit is 64 KiB with its head

/// What the library answers with a negative number; the callers turn it into their own words.
struct LibraryError {
  std::string subject;
};

/// An open object of the library; closes it.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t), const std::string& subject) : id_(id), close_(close) {
    if (id < 0) throw LibraryError{subject};
  }
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
  Handle& operator=(Handle&&) = delete;
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

void demand(herr_t answer, const std::string& subject) {
  if (answer < 0) throw LibraryError{subject};
}

/// One caller of the library at a time, which does not print its own error stack meanwhile.
class Session {
 public:
  Session() : lock_(mutex()) {
    H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session() { H5Eset_auto2(H5E_DEFAULT, print_, data_); }

 private:
  static std::mutex& mutex() {
    static std::mutex only;
    return only;
  }
  std::lock_guard<std::mutex> lock_;
  H5E_auto2_t print_ = nullptr;
  void* data_ = nullptr;
};

// ---------------------------------------------------------------------------------------------------------------------
// How a value of the record lies in the file: its number type, the numbers that one value takes, and the copy.

template <class T>
struct Cell {
  using Number = T;
  static constexpr std::size_t count = 1;
  static void pack(const T& value, Number* out) { *out = value; }
  static void unpack(const Number* in, T& value) { value = *in; }
};
template <>
struct Cell<bool> {
  using Number = std::uint8_t;
  static constexpr std::size_t count = 1;
  static void pack(bool value, Number* out) { *out = value ? 1 : 0; }
  static void unpack(const Number* in, bool& value) { value = *in != 0; }
};
template <>
struct Cell<Status> {
  using Number = std::uint8_t;
  static constexpr std::size_t count = 1;
  static void pack(Status value, Number* out) { *out = static_cast<Number>(value); }
  static void unpack(const Number* in, Status& value) { value = static_cast<Status>(*in); }
};
template <>
struct Cell<Belonging> {
  using Number = std::uint8_t;
  static constexpr std::size_t count = 1;
  static void pack(Belonging value, Number* out) { *out = static_cast<Number>(value); }
  static void unpack(const Number* in, Belonging& value) { value = static_cast<Belonging>(*in); }
};
template <>
struct Cell<Vec3> {
  using Number = double;
  static constexpr std::size_t count = 3;
  static void pack(const Vec3& v, Number* out) { out[0] = v.x, out[1] = v.y, out[2] = v.z; }
  static void unpack(const Number* in, Vec3& v) { v = {in[0], in[1], in[2]}; }
};
template <>
struct Cell<Quat> {
  using Number = double;
  static constexpr std::size_t count = 4;
  static void pack(const Quat& q, Number* out) { out[0] = q.w, out[1] = q.x, out[2] = q.y, out[3] = q.z; }
  static void unpack(const Number* in, Quat& q) { q = {in[0], in[1], in[2], in[3]}; }
};
template <>
struct Cell<std::array<double, 2>> {
  using Number = double;
  static constexpr std::size_t count = 2;
  static void pack(const std::array<double, 2>& p, Number* out) { out[0] = p[0], out[1] = p[1]; }
  static void unpack(const Number* in, std::array<double, 2>& p) { p = {in[0], in[1]}; }
};

template <class Number>
hid_t file_type() {
  if constexpr (std::is_same_v<Number, double>) return H5T_IEEE_F64LE;
  if constexpr (std::is_same_v<Number, float>) return H5T_IEEE_F32LE;
  if constexpr (std::is_same_v<Number, std::uint64_t>) return H5T_STD_U64LE;
  if constexpr (std::is_same_v<Number, int>) return H5T_STD_I32LE;
  if constexpr (std::is_same_v<Number, std::uint8_t>) return H5T_STD_U8LE;
}
template <class Number>
hid_t memory_type() {
  if constexpr (std::is_same_v<Number, double>) return H5T_NATIVE_DOUBLE;
  if constexpr (std::is_same_v<Number, float>) return H5T_NATIVE_FLOAT;
  if constexpr (std::is_same_v<Number, std::uint64_t>) return H5T_NATIVE_UINT64;
  if constexpr (std::is_same_v<Number, int>) return H5T_NATIVE_INT;
  if constexpr (std::is_same_v<Number, std::uint8_t>) return H5T_NATIVE_UINT8;
}

/// Text of a fixed number of bytes in UTF-8, filled up with zeros.
Handle text_type(std::size_t bytes, const std::string& subject) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose, subject);
  demand(H5Tset_size(type, std::max<std::size_t>(bytes, 1)), subject);
  demand(H5Tset_strpad(type, H5T_STR_NULLPAD), subject);
  demand(H5Tset_cset(type, H5T_CSET_UTF8), subject);
  return type;
}

/// What stands beside the numbers.
struct About {
  std::string_view unit = "", frame = "", meaning = "";
};

using Shape = std::vector<hsize_t>;

std::size_t size_of(const Shape& shape) {
  std::size_t size = 1;
  for (const hsize_t n : shape) size *= static_cast<std::size_t>(n);
  return size;
}

// ---------------------------------------------------------------------------------------------------------------------

/// Puts datasets into a file in memory.
class Writer {
 public:
  Writer() : file_(make_file()) {
    const Handle root(H5Gopen2(file_, "/", H5P_DEFAULT), H5Gclose, "/");
    put_text_attribute(root, "format", format_name);
    const Handle space(H5Screate(H5S_SCALAR), H5Sclose, "version");
    const Handle version(H5Acreate2(root, "version", H5T_STD_I32LE, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         "version");
    demand(H5Awrite(version, H5T_NATIVE_INT, &format_version), "version");
  }

  std::string bytes() const {
    demand(H5Fflush(file_, H5F_SCOPE_LOCAL), "flush");
    const ssize_t size = H5Fget_file_image(file_, nullptr, 0);
    if (size < 0) throw LibraryError{"image"};
    std::string image(static_cast<std::size_t>(size), '\0');
    if (H5Fget_file_image(file_, image.data(), image.size()) != size) throw LibraryError{"image"};
    return image;
  }

  template <class T>
  void scalar(const std::string& name, T& value, const About& about) {
    if constexpr (std::is_same_v<T, std::string>) {
      const Handle type = text_type(value.size(), name);
      put(name, type, type, {}, value.c_str(), std::max<std::size_t>(value.size(), 1), about);
    } else {
      typename Cell<T>::Number number;
      Cell<T>::pack(value, &number);
      put(name, file_type<typename Cell<T>::Number>(), memory_type<typename Cell<T>::Number>(), {}, &number,
          sizeof number, about);
    }
  }

  /// Whether a group is to be there.
  static bool has(const std::string&) { return true; }

  template <class Number>
  void block(const std::string& name, std::vector<Number>& values, const Shape& shape, const About& about) {
    if (values.size() != size_of(shape))
      throw std::logic_error("record: " + name + " has " + std::to_string(values.size()) + " values instead of " +
                             std::to_string(size_of(shape)));
    put(name, file_type<Number>(), memory_type<Number>(), shape, values.data(), values.size() * sizeof(Number), about);
  }

  template <class Row, class Project>
  void column(const std::string& name, std::vector<Row>& rows, Project project, const About& about) {
    using T = std::remove_cvref_t<decltype(std::invoke(project, rows[0]))>;
    const hsize_t count = rows.size();
    if constexpr (std::is_same_v<T, std::string>) {
      std::size_t width = 1;
      for (Row& row : rows) width = std::max(width, std::invoke(project, row).size());
      std::string cells(width * rows.size(), '\0');
      for (std::size_t i = 0; i < rows.size(); ++i) std::invoke(project, rows[i]).copy(cells.data() + i * width, width);
      const Handle type = text_type(width, name);
      put(name, type, type, {count}, cells.data(), cells.size(), about);
    } else {
      using Number = typename Cell<T>::Number;
      std::vector<Number> numbers(rows.size() * Cell<T>::count);
      for (std::size_t i = 0; i < rows.size(); ++i)
        Cell<T>::pack(std::invoke(project, rows[i]), numbers.data() + i * Cell<T>::count);
      Shape shape = {count};
      if (Cell<T>::count > 1) shape.push_back(Cell<T>::count);
      put(name, file_type<Number>(), memory_type<Number>(), shape, numbers.data(), numbers.size() * sizeof(Number),
          about);
    }
  }
  /// The column that sets the number of rows when reading.
  template <class Row, class Project>
  void first_column(const std::string& name, std::vector<Row>& rows, Project project, const About& about) {
    column(name, rows, project, about);
  }

  void group_text(const std::string& group, const std::string& name, const std::string& text) {
    const Handle id(H5Gopen2(file_, group.c_str(), H5P_DEFAULT), H5Gclose, group);
    put_text_attribute(id, name, text);
  }

 private:
  static Handle make_file() {
    const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "file");
    demand(H5Pset_fapl_core(access, std::size_t{1} << 20, false), "file");
    return {H5Fcreate("record", H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose, "file"};
  }

  /// As many whole characters of it as an attribute takes.
  static std::string_view shorten(std::string_view text) {
    if (text.size() <= most_attribute_bytes) return text;
    std::size_t end = most_attribute_bytes;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0U) == 0x80U) --end;
    return text.substr(0, end);
  }

  static void put_text_attribute(hid_t object, const std::string& name, std::string_view text) {
    text = shorten(text);
    const Handle type = text_type(text.size(), name);
    const Handle space(H5Screate(H5S_SCALAR), H5Sclose, name);
    const Handle attribute(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose, name);
    demand(H5Awrite(attribute, type, text.data()), name);
  }

  void put(const std::string& name, hid_t type, hid_t in_memory, const Shape& shape, const void* data,
           std::size_t bytes, const About& about) {
    const Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose, name);
    demand(H5Pset_create_intermediate_group(links, 1), name);
    const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, name);
    demand(H5Pset_obj_track_times(creation, false), name);  // equal records are equal files
    const Handle space(
        shape.empty() ? H5Screate(H5S_SCALAR) : H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr),
        H5Sclose, name);
    constexpr std::size_t worth_packing = 4096, chunk_bytes = std::size_t{1} << 18;
    if (!shape.empty() && bytes >= worth_packing) {
      // whole rows, about a quarter of a megabyte
      Shape chunk = shape;
      const std::size_t row = bytes / static_cast<std::size_t>(shape[0]);
      chunk[0] = std::clamp<hsize_t>(chunk_bytes / std::max<std::size_t>(row, 1), 1, shape[0]);
      demand(H5Pset_chunk(creation, static_cast<int>(chunk.size()), chunk.data()), name);
      demand(H5Pset_shuffle(creation), name);
      demand(H5Pset_deflate(creation, 4), name);
      demand(H5Pset_fletcher32(creation), name);
    }
    const Handle set(H5Dcreate2(file_, name.c_str(), type, space, links, creation, H5P_DEFAULT), H5Dclose, name);
    if (bytes > 0) demand(H5Dwrite(set, in_memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, data), name);
    if (!about.unit.empty()) put_text_attribute(set, "unit", about.unit);
    if (!about.frame.empty()) put_text_attribute(set, "frame", about.frame);
    if (!about.meaning.empty()) put_text_attribute(set, "meaning", about.meaning);
  }

  Handle file_;
};

// ---------------------------------------------------------------------------------------------------------------------

/// Takes datasets out of the bytes of a file.
class Reader {
 public:
  Reader(std::string& bytes, std::string path) : path_(std::move(path)), file_bytes_(bytes.size()), file_(open(bytes)) {
    const Handle root(H5Gopen2(file_, "/", H5P_DEFAULT), H5Gclose, "/");
    if (text_attribute(root, "format") != format_name) throw LibraryError{"format"};
    const Handle version(H5Aopen(root, "version", H5P_DEFAULT), H5Aclose, "version");
    const Handle space(H5Aget_space(version), H5Sclose, "version");
    int number = 0;
    if (H5Sget_simple_extent_npoints(space) != 1) throw LibraryError{"version"};
    demand(H5Aread(version, H5T_NATIVE_INT, &number), "version");
    if (number != format_version)
      throw InputError("E703",
                       path_ + " is a record of version " + std::to_string(number) + "; this program reads version " +
                           std::to_string(format_version),
                       "read it with the program that wrote it, or run the plan again");
  }

  template <class T>
  void scalar(const std::string& name, T& value, const About&) {
    const Set set = open_set(name);
    if (!set.shape.empty()) damaged(name + " is not a single value");
    if constexpr (std::is_same_v<T, std::string>) {
      std::vector<std::string> one(1);
      read_texts(name, set, one, std::identity{});
      value = one[0];
    } else {
      typename Cell<T>::Number number;
      demand(H5Dread(set.id, memory_type<typename Cell<T>::Number>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, &number), name);
      Cell<T>::unpack(&number, value);
    }
  }

  template <class Number>
  void block(const std::string& name, std::vector<Number>& values, const Shape& shape, const About&) {
    const Set set = open_set(name);
    if (set.shape != shape) damaged(name + " has another shape than the tables it belongs to");
    read_numbers(name, set, values);
  }

  template <class Row, class Project>
  void column(const std::string& name, std::vector<Row>& rows, Project project, const About&) {
    const Set set = open_set(name);
    if (set.shape.empty() || set.shape[0] != rows.size()) damaged(name + " has another length than its table");
    fill(name, set, rows, project);
  }
  template <class Row, class Project>
  void first_column(const std::string& name, std::vector<Row>& rows, Project project, const About&) {
    const Set set = open_set(name);
    if (set.shape.empty()) damaged(name + " is not a list");
    rows.resize(static_cast<std::size_t>(set.shape[0]));
    fill(name, set, rows, project);
  }

  bool has(const std::string& group) const { return H5Lexists(file_, group.c_str(), H5P_DEFAULT) > 0; }

  /// Names of the groups in a group, none if it is not there.
  std::vector<std::string> groups_in(const std::string& group) {
    if (!has(group)) return {};
    const Handle id(H5Gopen2(file_, group.c_str(), H5P_DEFAULT), H5Gclose, group);
    H5G_info_t info;
    demand(H5Gget_info(id, &info), group);
    std::vector<std::string> names;
    for (hsize_t i = 0; i < info.nlinks; ++i) {
      std::string name(256, '\0');
      const ssize_t size =
          H5Lget_name_by_idx(id, ".", H5_INDEX_NAME, H5_ITER_INC, i, name.data(), name.size(), H5P_DEFAULT);
      if (size <= 0 || static_cast<std::size_t>(size) >= name.size()) throw LibraryError{group};
      names.push_back(name.substr(0, static_cast<std::size_t>(size)));
    }
    return names;
  }
  std::string group_text(const std::string& group, const std::string& name) {
    const Handle id(H5Gopen2(file_, group.c_str(), H5P_DEFAULT), H5Gclose, group);
    return text_attribute(id, name);
  }
  /// Numbers of a dataset whose first length is `rows`.
  template <class Number>
  void rows_of(const std::string& name, std::vector<Number>& values, std::size_t rows, std::size_t columns) {
    const Set set = open_set(name);
    const Shape shape = columns == 1 ? Shape{rows} : Shape{rows, columns};
    if (set.shape != shape) damaged(name + " has another shape than the table it belongs to");
    read_numbers(name, set, values);
  }

  [[noreturn]] void damaged(const std::string& what) const {
    throw InputError("E704", path_ + " is a damaged record: " + what, "run the plan again");
  }

 private:
  struct Set {
    Handle id;
    Handle type;
    Shape shape;
  };

  static Handle open(std::string& bytes) {
    if (H5open() < 0 || bytes.empty()) throw LibraryError{"file"};
    const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "file");
    demand(H5Pset_fapl_core(access, std::size_t{1} << 20, false), "file");
    demand(H5Pset_file_image(access, bytes.data(), bytes.size()), "file");
    return {H5Fopen("record", H5F_ACC_RDONLY, access), H5Fclose, "file"};
  }

  static std::string text_attribute(hid_t object, const std::string& name) {
    const Handle attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose, name);
    const Handle type(H5Aget_type(attribute), H5Tclose, name);
    const Handle space(H5Aget_space(attribute), H5Sclose, name);
    const std::size_t size = H5Tget_size(type);
    if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0 || size == 0 || size > most_attribute_bytes ||
        H5Sget_simple_extent_npoints(space) != 1)
      throw LibraryError{name};
    std::string text(size, '\0');
    demand(H5Aread(attribute, type, text.data()), name);
    return without_padding(text);
  }

  static std::string without_padding(std::string_view text) {
    return std::string(text.substr(0, text.find_last_not_of('\0') + 1));
  }

  /// Opens a dataset and looks whether its size can be true.
  Set open_set(const std::string& name) {
    Handle id(H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose, name);
    const Handle space(H5Dget_space(id), H5Sclose, name);
    Handle type(H5Dget_type(id), H5Tclose, name);
    const int rank = H5Sget_simple_extent_ndims(space);
    if (rank < 0 || rank > 3 || H5Sget_simple_extent_type(space) == H5S_NULL) damaged(name + " has no shape");
    Shape shape(static_cast<std::size_t>(rank));
    if (rank > 0) demand(H5Sget_simple_extent_dims(space, shape.data(), nullptr), name);
    // deflate packs a thousandfold at most: what claims to be larger is not believed
    constexpr std::size_t most_packed = 1100;
    const std::size_t stored = static_cast<std::size_t>(H5Dget_storage_size(id)), each = H5Tget_size(type);
    std::size_t whole = std::max<std::size_t>(each, 1);
    bool believed = stored <= file_bytes_;
    for (const hsize_t n : shape)
      believed = believed && n <= most_packed * file_bytes_ &&
                 !__builtin_mul_overflow(whole, static_cast<std::size_t>(n), &whole);
    believed = believed && whole <= most_packed * stored;
    if (!believed) damaged(name + " claims more data than the file can hold");
    return {std::move(id), std::move(type), std::move(shape)};
  }

  template <class Number>
  void read_numbers(const std::string& name, const Set& set, std::vector<Number>& values) {
    if (H5Tequal(set.type, file_type<Number>()) <= 0) damaged(name + " holds another type of number");
    values.resize(size_of(set.shape));
    if (!values.empty())
      demand(H5Dread(set.id, memory_type<Number>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), name);
  }

  template <class Row, class Project>
  void read_texts(const std::string& name, const Set& set, std::vector<Row>& rows, Project project) {
    if (H5Tget_class(set.type) != H5T_STRING || H5Tis_variable_str(set.type) != 0)
      damaged(name + " holds no text of fixed length");
    const std::size_t width = H5Tget_size(set.type);
    std::string cells(width * rows.size(), '\0');
    if (!cells.empty()) demand(H5Dread(set.id, set.type, H5S_ALL, H5S_ALL, H5P_DEFAULT, cells.data()), name);
    for (std::size_t i = 0; i < rows.size(); ++i)
      std::invoke(project, rows[i]) = without_padding(std::string_view(cells).substr(i * width, width));
  }

  template <class Row, class Project>
  void fill(const std::string& name, const Set& set, std::vector<Row>& rows, Project project) {
    using T = std::remove_cvref_t<decltype(std::invoke(project, rows[0]))>;
    if constexpr (std::is_same_v<T, std::string>) {
      if (set.shape.size() != 1) damaged(name + " has another shape than its table");
      read_texts(name, set, rows, project);
    } else {
      constexpr std::size_t width = Cell<T>::count;
      if (set.shape.size() != (width > 1 ? 2U : 1U) || size_of(set.shape) != rows.size() * width)
        damaged(name + " has another shape than its table");
      std::vector<typename Cell<T>::Number> numbers;
      read_numbers(name, set, numbers);
      for (std::size_t i = 0; i < rows.size(); ++i)
        Cell<T>::unpack(numbers.data() + i * width, std::invoke(project, rows[i]));
    }
  }

  std::string path_;
  std::size_t file_bytes_;
  Handle file_;
};

// ---------------------------------------------------------------------------------------------------------------------

/// Lists inside lists lie flat in the file, with the row that each belongs to.
template <class T>
struct Owned {
  int owner = 0;
  T value;
};

using ShapeRow = Owned<BoxShape>;
using CornerRow = Owned<std::array<double, 2>>;

/// The record's nested lists, flat.
struct Flat {
  std::vector<ShapeRow> shapes;
  std::vector<CornerRow> corners;
  std::vector<double> series;  // (Q x S)
};

template <class Parent, class Item>
std::vector<Owned<Item>> flatten(const std::vector<Parent>& parents, std::vector<Item> Parent::*items) {
  std::vector<Owned<Item>> flat;
  for (std::size_t i = 0; i < parents.size(); ++i)
    for (const Item& item : parents[i].*items) flat.push_back({static_cast<int>(i), item});
  return flat;
}

/// False if an owner is missing or the owners do not rise.
template <class Parent, class Item>
[[nodiscard]] bool unflatten(const std::vector<Owned<Item>>& flat, std::vector<Parent>& parents,
                             std::vector<Item> Parent::*items) {
  int last = 0;
  for (const Owned<Item>& one : flat) {
    if (one.owner < last || static_cast<std::size_t>(one.owner) >= parents.size()) return false;
    (parents[static_cast<std::size_t>(one.owner)].*items).push_back(one.value);
    last = one.owner;
  }
  return true;
}

/// Every dataset of the file, in both directions; docs/record.md is its description.
template <class Archive>
void transfer(Archive& a, Record& r, Flat& flat) {
  Provenance& p = r.provenance;
  a.scalar("provenance/title", p.title, {});
  a.scalar("provenance/plan_path", p.plan_path, {});
  a.scalar("provenance/plan_text", p.plan_text, {});
  a.scalar("provenance/plan_sha256", p.plan_sha256, {});
  a.scalar("provenance/program_version", p.program_version, {});
  a.scalar("provenance/engine", p.engine, {});
  a.scalar("provenance/machine", p.machine, {});
  a.scalar("provenance/created", p.created, {});
  a.scalar("provenance/seed", p.seed, {});
  a.scalar("provenance/step", p.step, {.unit = "s"});
  a.scalar("provenance/wall_time", p.wall_time, {.unit = "s"});
  a.scalar("provenance/threads", p.threads, {});

  Counts& c = r.counts;
  a.scalar("counts/bodies", c.bodies, {});
  a.scalar("counts/revolute_joints", c.revolute_joints, {});
  a.scalar("counts/rigid_joints", c.rigid_joints, {});
  a.scalar("counts/force_elements", c.force_elements, {});
  a.scalar("counts/cables", c.cables, {});
  a.scalar("counts/mass", c.mass, {.unit = "kg"});

  a.first_column("plan_values/group", r.plan_values, &KeyValue::group, {});
  a.column("plan_values/key", r.plan_values, &KeyValue::key, {});
  a.column("plan_values/value", r.plan_values, &KeyValue::value, {});

  a.first_column("bodies/name", r.bodies, &BodyInfo::name, {});
  a.column("bodies/kind", r.bodies, &BodyInfo::kind, {});
  a.column("bodies/storey", r.bodies, &BodyInfo::storey, {});
  a.column("bodies/mass", r.bodies, &BodyInfo::mass, {.unit = "kg"});
  a.column("bodies/fixed", r.bodies, &BodyInfo::fixed, {.meaning = "1: belongs to the ground"});
  if (a.has("bodies/beside"))  // not in records of earlier versions
    a.column("bodies/beside", r.bodies, &BodyInfo::belongs,
             {.meaning = "0: of a structure that charges act on, 1: of one beside it, 2: not known"});
  else
    for (BodyInfo& body : r.bodies) body.belongs = Belonging::Unknown;

  a.first_column("shapes/body", flat.shapes, &ShapeRow::owner, {.meaning = "row of bodies"});
  a.column("shapes/centre", flat.shapes, [](auto& row) -> auto& { return row.value.X_BS.p; },
           {.unit = "m", .frame = "body"});
  a.column("shapes/orientation", flat.shapes, [](auto& row) -> auto& { return row.value.X_BS.q; },
           {.frame = "body", .meaning = "unit quaternion w x y z"});
  a.column("shapes/half", flat.shapes, [](auto& row) -> auto& { return row.value.half; },
           {.unit = "m", .frame = "shape", .meaning = "half edges"});
  a.column("shapes/material", flat.shapes, [](auto& row) -> auto& { return row.value.material; }, {});
  if (a.has("shapes/part"))  // not in records of earlier versions
    a.column("shapes/part", flat.shapes, [](auto& row) -> auto& { return row.value.part; }, {});

  a.first_column("zones/name", r.zones, &ZoneInfo::name, {});
  a.column("zones/member", r.zones, &ZoneInfo::member, {});
  a.column("zones/subsystem", r.zones, &ZoneInfo::subsystem, {});
  a.column("zones/body_a", r.zones, &ZoneInfo::body_a, {.meaning = "row of bodies, -1 the ground"});
  a.column("zones/body_b", r.zones, &ZoneInfo::body_b, {.meaning = "row of bodies, -1 the ground"});
  a.column("zones/position", r.zones, &ZoneInfo::p_W, {.unit = "m", .frame = "world", .meaning = "at the start"});

  // not in records of before members were crushed through
  const bool knows_crushing = a.has("crushed_ends");
  if (knows_crushing) {
    a.first_column("crushed_ends/body", r.crushed_ends, &CrushedEnd::body, {.meaning = "row of bodies"});
    a.column("crushed_ends/shape", r.crushed_ends, &CrushedEnd::shape, {.meaning = "of that body's shapes, from 0"});
    a.column("crushed_ends/axis", r.crushed_ends, &CrushedEnd::axis, {.frame = "shape", .meaning = "0 x, 1 y, 2 z"});
    a.column("crushed_ends/side", r.crushed_ends, &CrushedEnd::side, {.meaning = "end of the axis: 1 or -1"});
  }

  a.first_column("neighbours/name", r.neighbours, &Neighbour::name, {});
  a.column("neighbours/is_utility", r.neighbours, &Neighbour::is_utility, {});
  a.first_column("neighbour_corners/neighbour", flat.corners, &CornerRow::owner, {.meaning = "row of neighbours"});
  a.column("neighbour_corners/position", flat.corners, &CornerRow::value, {.unit = "m", .frame = "world"});
  a.first_column("building_outline", r.building_outline, std::identity{},
                 {.unit = "m", .frame = "world", .meaning = "counter-clockwise"});
  if (a.has("fall_azimuth"))  // not in records of earlier versions
    a.scalar("fall_azimuth", r.fall_azimuth,
             {.unit = "rad", .meaning = "towards which tilts count positive, from +x counter-clockwise; NaN: none"});

  a.first_column("frames/time", r.time, std::identity{}, {.unit = "s"});
  const hsize_t frames = r.time.size(), bodies = r.bodies.size(), zones = r.zones.size();
  a.block("frames/position", r.position, {frames, bodies, 3},
          {.unit = "m", .frame = "world", .meaning = "origin of the body's frame"});
  a.block("frames/orientation", r.orientation, {frames, bodies, 4},
          {.frame = "world", .meaning = "unit quaternion w x y z of the body's frame"});
  a.block("frames/zone_state", r.zone_state, {frames, zones},
          {.meaning = "0 elastic, 1 yielded, 2 softening, 3 broken, 4 fired, 5 crushed (a stub that a charge left)"});
  a.block("frames/zone_utilisation", r.zone_utilisation, {frames, zones},
          {.meaning = p.engine == "finite elements"
                          ? "stress over first yield stress at its pressure, largest of the zone's elements, 1 at most"
                          : "demand over capacity, 1 at most of zones that are not elastic"});
  if (knows_crushing)
    a.block("frames/crushed_length", r.crushed_length, {frames, r.crushed_ends.size()},
            {.unit = "m", .meaning = "by which a crushed end has receded"});

  a.first_column("series/id", r.series, &Series::id, {});
  a.column("series/title", r.series, &Series::title, {});
  a.column("series/unit", r.series, &Series::unit, {});
  a.column("series/group", r.series, &Series::group, {});
  a.block("series/value", flat.series, {r.series.size(), frames}, {.meaning = "one row per series, see series/unit"});

  a.first_column("events/time", r.events, &Event::time, {.unit = "s"});
  a.column("events/kind", r.events, &Event::kind, {});
  a.column("events/subject", r.events, &Event::subject, {});
  a.column("events/text", r.events, &Event::text, {});

  a.first_column("findings/id", r.findings, &Finding::id, {});
  a.column("findings/heading", r.findings, &Finding::heading, {});
  a.column("findings/title", r.findings, &Finding::title, {});
  a.column("findings/text", r.findings, &Finding::text, {});
  a.column("findings/value", r.findings, &Finding::value, {.meaning = "see findings/unit; NaN: no number"});
  a.column("findings/unit", r.findings, &Finding::unit, {});
  a.column("findings/status", r.findings, &Finding::status,
           {.meaning = "0 info, 1 good, 2 warning, 3 bad, 4 not judged"});

  a.first_column("not_modelled", r.not_modelled, std::identity{}, {});
  a.scalar("ending/kind", r.ending, {});
  a.scalar("ending/text", r.ending_text, {});
}

constexpr const char* kOutputs = "outputs";

/// A group for each output, named by it.
void write_outputs(Writer& w, Record& r) {
  for (Output& o : r.outputs) {
    if (o.name.empty() || o.name == "." || o.name.find('/') != std::string::npos)
      throw std::logic_error("record: an output cannot be called \"" + o.name + "\"");
    const std::string group = std::string(kOutputs) + "/" + o.name;
    const std::size_t rows = o.time.size(), columns = o.columns.size();
    w.block(group + "/time", o.time, {rows}, {.unit = "s"});
    w.block(group + "/value", o.value, columns == 1 ? Shape{rows} : Shape{rows, columns},
            {.unit = o.unit, .frame = o.frame});
    std::string names;
    for (const std::string& c : o.columns) names += (names.empty() ? "" : " ") + c;
    w.group_text(group, "quantity", o.quantity);
    w.group_text(group, "unit", o.unit);
    w.group_text(group, "frame", o.frame);
    w.group_text(group, "columns", names);
  }
}

void read_outputs(Reader& reader, Record& r) {
  for (const std::string& name : reader.groups_in(kOutputs)) {
    const std::string group = std::string(kOutputs) + "/" + name;
    Output o;
    o.name = name;
    o.quantity = reader.group_text(group, "quantity");
    o.unit = reader.group_text(group, "unit");
    o.frame = reader.group_text(group, "frame");
    std::istringstream columns(reader.group_text(group, "columns"));
    o.columns = {std::istream_iterator<std::string>(columns), {}};
    reader.first_column(group + "/time", o.time, std::identity{}, {});
    reader.rows_of(group + "/value", o.value, o.time.size(), o.columns.size());
    for (std::size_t i = 1; i < o.time.size(); ++i)
      if (!(o.time[i] > o.time[i - 1])) reader.damaged(group + "/time does not rise");
    for (const double t : o.time)
      if (!std::isfinite(t)) reader.damaged(group + "/time has a value that is not finite");
    r.outputs.push_back(std::move(o));
  }
}

/// What the shapes of the datasets do not show.
void check_contents(const Reader& reader, const Record& r) {
  for (std::size_t i = 1; i < r.time.size(); ++i)
    if (!(r.time[i] > r.time[i - 1])) reader.damaged("frames/time does not rise");
  for (const double t : r.time)
    if (!std::isfinite(t)) reader.damaged("frames/time has a value that is not finite");
  for (const BodyInfo& body : r.bodies)
    if (body.belongs > Belonging::Unknown) reader.damaged("bodies/beside has an unknown value");
  const int bodies = static_cast<int>(r.bodies.size());
  for (const ZoneInfo& zone : r.zones)
    for (const int body : {zone.body_a, zone.body_b})
      if (body < -1 || body >= bodies) reader.damaged("zone " + zone.name + " names a body that is not there");
  for (std::size_t c = 0; c < r.crushed_ends.size(); ++c) {
    const CrushedEnd& end = r.crushed_ends[c];
    if (c > 0 && end < r.crushed_ends[c - 1]) reader.damaged("crushed_ends do not rise");
    if (end.body < 0 || end.body >= bodies || end.shape < 0 ||
        static_cast<std::size_t>(end.shape) >= r.bodies[static_cast<std::size_t>(end.body)].shapes.size() ||
        end.axis < 0 || end.axis > 2 || std::abs(end.side) != 1)
      reader.damaged("crushed_ends names a shape that is not there");
  }
  for (const std::uint8_t state : r.zone_state)
    if (state > static_cast<std::uint8_t>(ZoneState::Crushed)) reader.damaged("frames/zone_state has an unknown state");
  for (const Finding& finding : r.findings)
    if (finding.status > Status::NotJudged) reader.damaged("findings/status has an unknown status");
}

}  // namespace

std::string to_hdf5(const Record& record) {
  Record r = record;
  Flat flat{flatten(r.bodies, &BodyInfo::shapes), flatten(r.neighbours, &Neighbour::footprint), {}};
  for (const Series& series : r.series) {
    if (series.value.size() != r.time.size())
      throw std::logic_error("record: series " + series.id + " has " + std::to_string(series.value.size()) +
                             " values for " + std::to_string(r.time.size()) + " frames");
    flat.series.insert(flat.series.end(), series.value.begin(), series.value.end());
  }
  try {
    const Session session;
    Writer writer;
    transfer(writer, r, flat);
    write_outputs(writer, r);
    return writer.bytes();
  } catch (const LibraryError& error) { throw std::runtime_error("the HDF5 library refuses " + error.subject); }
}

void write_hdf5(const Record& record, const std::string& path) {
  std::string bytes;
  try {
    bytes = to_hdf5(record);
  } catch (const std::runtime_error& error) { throw std::runtime_error("cannot write " + path + ": " + error.what()); }
  replace_file(path, bytes);
}

Record read_hdf5(const std::string& path) {
  std::string bytes = read_file(path);
  if (!bytes.starts_with("\x89HDF\r\n\x1a\n"))
    throw InputError("E702", path + " is not a topple record", "give the record.h5 that `topple run` wrote");
  Record r;
  Flat flat;
  try {
    const Session session;
    Reader reader(bytes, path);
    transfer(reader, r, flat);
    if (!unflatten(flat.shapes, r.bodies, &BodyInfo::shapes)) reader.damaged("shapes/body does not fit the bodies");
    if (!unflatten(flat.corners, r.neighbours, &Neighbour::footprint))
      reader.damaged("neighbour_corners/neighbour does not fit the neighbours");
    for (std::size_t i = 0; i < r.series.size(); ++i) {
      const auto begin = flat.series.begin() + static_cast<std::ptrdiff_t>(i * r.time.size());
      r.series[i].value.assign(begin, begin + static_cast<std::ptrdiff_t>(r.time.size()));
    }
    read_outputs(reader, r);
    check_contents(reader, r);
  } catch (const LibraryError& error) {
    throw InputError("E702", path + " is not a complete topple record (looking for \"" + error.subject + "\")",
                     "give the record.h5 that `topple run` wrote");
  }
  return r;
}

}  // namespace topple::record
