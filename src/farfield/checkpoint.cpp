#include "farfield/checkpoint.h"

#include <algorithm>
#include <cstring>
#include <type_traits>

#include "base/error.h"
#include "base/file.h"
#include "base/hash.h"

namespace topple::farfield {

namespace {

constexpr char kMagic[] = "topple-fe-checkpoint-7";

class Writer {
 public:
  template <class T>
  void operator()(const T& x) {
    static_assert(std::is_trivially_copyable_v<T>);
    append(&x, sizeof x);
  }
  template <class T>
  void operator()(const std::vector<T>& x) {
    static_assert(std::is_trivially_copyable_v<T>);
    (*this)(x.size());
    append(x.data(), x.size() * sizeof(T));
  }
  void operator()(const std::vector<bool>& x) {
    (*this)(x.size());
    for (const bool b : x) (*this)(b);
  }
  void operator()(const std::string& x) {
    (*this)(x.size());
    append(x.data(), x.size());
  }
  std::string bytes;

 private:
  void append(const void* from, size_t size) {
    if (size > 0) bytes.append(static_cast<const char*>(from), size);
  }
};

class Reader {
 public:
  Reader(const std::string& bytes, const std::string& path) : bytes_(bytes), path_(path) {}
  template <class T>
  void operator()(T& x) {
    static_assert(std::is_trivially_copyable_v<T>);
    take(&x, sizeof x);
  }
  template <class T>
  void operator()(std::vector<T>& x) {
    x.resize(take_count(sizeof(T)));
    take(x.data(), x.size() * sizeof(T));
  }
  void operator()(std::vector<bool>& x) {
    x.resize(take_count(1));
    for (size_t i = 0; i < x.size(); ++i) {
      bool b = false;
      (*this)(b);
      x[i] = b;
    }
  }
  void operator()(std::string& x) {
    x.resize(take_count(1));
    take(x.data(), x.size());
  }
  [[noreturn]] void fail(const std::string& why) const {
    throw InputError("E674", path_ + ": " + why, "start without --resume");
  }
  bool is_done() const { return at_ == bytes_.size(); }

 private:
  size_t take_count(size_t size) {
    size_t count = 0;
    (*this)(count);
    if (count > (bytes_.size() - at_) / size) fail("the checkpoint is cut off");
    return count;
  }
  void take(void* to, size_t size) {
    if (size > bytes_.size() - at_) fail("the checkpoint is cut off");
    if (size > 0) std::memcpy(to, bytes_.data() + at_, size);
    at_ += size;
  }
  const std::string& bytes_;
  const std::string& path_;
  size_t at_ = 0;
};

/// The parts of a view that the finite elements fill.
template <class Io, class View>
void pass_view(Io& io, View& v) {
  io(v.time), io(v.X_WB), io(v.centre), io(v.v_WB), io(v.w_WB), io(v.mass), io(v.element_state), io(v.utilisation),
      io(v.rotation);
  io(v.shortening), io(v.joint_force), io(v.joint_moment), io(v.joint_released);
  io(v.ground_force), io(v.contact_force_ground), io(v.body_contacts), io(v.energy);
}

template <class Io, class Happening>
void pass_happening(Io& io, Happening& h) {
  io(h.kind), io(h.time), io(h.index), io(h.other), io(h.reason), io(h.speed), io(h.landing);
}

template <class Io, class State>
void pass_state(Io& io, State& s) {
  io(s.next_frame), io(s.offset), io(s.quiet_since), io(s.swings_since), io(s.swing.most_speed), io(s.swing.path),
      io(s.swing.has_turned), io(s.swing.is_short), io(s.next_firing), io(s.is_settling), io(s.zone_state),
      io(s.has_touched);
  io(s.skipped), io(s.unsettled), io(s.relaxation.converged), io(s.relaxation.steps), io(s.relaxation.residual);
  io(s.relaxation.settlement), io(s.relaxation.text), io(s.ledger), io(s.energy_error), io(s.released), io(s.wall_time);
  io(s.early_damage.landing), io(s.early_damage.is_damaged), io(s.has_fragments), io(s.fragments_time),
      io(s.fragments.damaged_strain), io(s.fragments.reach);
  io(s.fragments.zones), io(s.fragments.fragments);
}

}  // namespace

bool Swing::has_passed(const Vec3& place) const {
  if (path.empty()) return false;
  const Vec3 way = place - path.front();
  return std::any_of(path.begin(), path.end(),
                     [&](const Vec3& p) { return dot(p - path.front(), way) >= dot(way, way); });
}

void write_checkpoint(const std::string& path, const std::string& key, const RunState& s,
                      const std::vector<std::byte>& system) {
  Writer out;
  out(std::string(kMagic));
  out(key);
  pass_state(out, s);
  out(s.shown.size());
  for (const auto& entry : s.shown) {
    out(entry.index());
    if (const mbs::View* v = std::get_if<mbs::View>(&entry))
      pass_view(out, *v);
    else
      pass_happening(out, std::get<mbs::Happening>(entry));
  }
  out(s.foot_forces.size());
  for (const std::vector<double>& f : s.foot_forces) out(f);
  out(system);
  replace_file(path, out.bytes + calc_sha256(out.bytes));
}

RunState read_checkpoint(const std::string& path, const std::string& key, std::vector<std::byte>& system) {
  std::string bytes = read_file(path);
  Reader in(bytes, path);
  std::string magic, found;
  if (bytes.size() < sizeof kMagic + sizeof(size_t)) in.fail("this is not a checkpoint");
  in(magic);
  if (magic != kMagic) in.fail("this is not a checkpoint of this version");
  constexpr size_t kHash = 64;  // digits of calc_sha256 at the end
  if (bytes.size() < kHash) in.fail("the checkpoint is cut off");
  const std::string hash = bytes.substr(bytes.size() - kHash);
  bytes.resize(bytes.size() - kHash);
  if (calc_sha256(bytes) != hash) in.fail("the checkpoint is cut off or damaged");
  in(found);
  if (found != key) in.fail("the checkpoint is of another plan, mesh, step or version");
  RunState s;
  pass_state(in, s);
  size_t count = 0;
  in(count);
  for (size_t i = 0; i < count; ++i) {
    size_t kind = 0;
    in(kind);
    if (kind == 0) {
      mbs::View v;
      pass_view(in, v);
      s.shown.emplace_back(std::move(v));
    } else {
      mbs::Happening h;
      pass_happening(in, h);
      s.shown.emplace_back(std::move(h));
    }
  }
  in(count);
  for (size_t i = 0; i < count; ++i) in(s.foot_forces.emplace_back());
  in(system);
  if (!in.is_done()) in.fail("the checkpoint is longer than it should be");
  return s;
}

}  // namespace topple::farfield
