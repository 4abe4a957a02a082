#include "server/frame.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace topple::server {

namespace {

template <class Bytes>
void put(Bytes& out, std::size_t& at, std::uint64_t value, int size) {
  for (int i = 0; i < size; ++i) out[at++] = static_cast<std::uint8_t>(value >> (8 * i) & 255U);
}

void put_floats(std::vector<std::uint8_t>& out, std::size_t& at, const float* values, std::size_t n) {
  if constexpr (std::endian::native == std::endian::little) {
    if (n > 0) std::memcpy(out.data() + at, values, 4 * n);
    at += 4 * n;
  } else {
    for (std::size_t i = 0; i < n; ++i) put(out, at, std::bit_cast<std::uint32_t>(values[i]), 4);
  }
}

}  // namespace

FrameBody make_frame_body(const record::Record& r, std::size_t row, std::size_t bodies,
                          const std::vector<Pose>& others) {
  FrameBody f;
  const std::size_t B = r.bodies.size(), Z = r.zones.size(), V = r.series.size();
  f.time = r.time[row];
  const std::size_t shown = bodies + others.size();
  f.bodies = static_cast<std::uint32_t>(shown);
  f.zones = static_cast<std::uint32_t>(Z);
  f.series = static_cast<std::uint32_t>(V);
  const std::size_t C = r.crushed_ends.size();
  const float* length = r.crushed_length.data() + row * C;
  f.crushed = static_cast<std::uint32_t>(std::count_if(length, length + C, [](float x) { return x != 0; }));
  f.bytes.resize(28 * shown + 4 * V + 5 * Z + 12 * f.crushed);
  std::size_t at = 0;
  for (std::size_t b = 0; b < bodies; ++b) {
    put_floats(f.bytes, at, &r.position[3 * (row * B + b)], 3);
    put_floats(f.bytes, at, &r.orientation[4 * (row * B + b)], 4);
  }
  for (const Pose& X : others)
    for (const double c : {X.p.x, X.p.y, X.p.z, X.q.w, X.q.x, X.q.y, X.q.z}) {
      const auto value = static_cast<float>(c);
      put_floats(f.bytes, at, &value, 1);
    }
  for (const record::Series& s : r.series) {
    const float value = static_cast<float>(s.value[row]);
    put_floats(f.bytes, at, &value, 1);
  }
  put_floats(f.bytes, at, r.zone_utilisation.data() + row * Z, Z);
  for (std::size_t c = 0; c < C; ++c) {
    if (length[c] == 0) continue;
    const record::CrushedEnd& end = r.crushed_ends[c];
    put(f.bytes, at, static_cast<std::uint32_t>(end.body), 4),
        put(f.bytes, at, static_cast<std::uint32_t>(end.shape), 2);
    put(f.bytes, at, static_cast<std::uint32_t>(end.axis), 1), put(f.bytes, at, end.side > 0 ? 1 : 0, 1);
    put_floats(f.bytes, at, length + c, 1);
  }
  if (Z > 0) std::memcpy(f.bytes.data() + at, r.zone_state.data() + row * Z, Z);
  return f;
}

std::array<std::uint8_t, kFrameHeader> make_frame_header(const FrameBody& f, unsigned flags, std::uint32_t sequence) {
  std::array<std::uint8_t, kFrameHeader> h{'T', 'P', 'L', 'F'};
  std::size_t at = 4;
  put(h, at, 1, 2), put(h, at, flags, 2);
  put(h, at, f.session, 4), put(h, at, f.branch, 4), put(h, at, sequence, 4), put(h, at, f.frame, 4);
  put(h, at, std::bit_cast<std::uint64_t>(f.time), 8);
  put(h, at, f.bodies, 4), put(h, at, f.zones, 4), put(h, at, f.series, 4), put(h, at, f.crushed, 4);
  return h;
}

}  // namespace topple::server
