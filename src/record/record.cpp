#include "record/record.h"

#include <algorithm>
#include <stdexcept>

namespace topple::record {

std::string_view name_of(Status status) {
  switch (status) {
    case Status::Info:
      return "info";
    case Status::Good:
      return "good";
    case Status::Warning:
      return "warning";
    case Status::Bad:
      return "bad";
    case Status::NotJudged:
      return "not_judged";
  }
  throw std::logic_error("record: unknown status");
}

Pose pose_at(const Record& r, std::size_t frame, std::size_t body) {
  const float* p = &r.position[3 * (frame * r.bodies.size() + body)];
  const float* q = &r.orientation[4 * (frame * r.bodies.size() + body)];
  return {{p[0], p[1], p[2]}, normalized(Quat{q[0], q[1], q[2], q[3]})};
}

BoxShape shape_at(const Record& r, std::size_t frame, std::size_t body, std::size_t shape) {
  BoxShape box = r.bodies[body].shapes[shape];
  const int b = static_cast<int>(body), s = static_cast<int>(shape);
  auto end = std::lower_bound(r.crushed_ends.begin(), r.crushed_ends.end(), b,
                              [](const CrushedEnd& e, int wanted) { return e.body < wanted; });
  for (; end != r.crushed_ends.end() && end->body == b; ++end) {
    if (end->shape != s) continue;
    const auto row = static_cast<std::size_t>(end - r.crushed_ends.begin());
    const double half = 0.5 * r.crushed_length[frame * r.crushed_ends.size() + row];
    if (half == 0) continue;
    box.half[end->axis] -= half;
    box.X_BS.p -= (half * end->side) * to_matrix(box.X_BS.q).column(end->axis);
  }
  return box;
}

}  // namespace topple::record
