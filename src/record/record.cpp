#include "record/record.h"

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
  }
  throw std::logic_error("record: unknown status");
}

Pose pose_at(const Record& r, std::size_t frame, std::size_t body) {
  const float* p = &r.position[3 * (frame * r.bodies.size() + body)];
  const float* q = &r.orientation[4 * (frame * r.bodies.size() + body)];
  return {{p[0], p[1], p[2]}, normalized(Quat{q[0], q[1], q[2], q[3]})};
}

}  // namespace topple::record
