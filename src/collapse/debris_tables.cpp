#include "collapse/debris_tables.h"

#include <fmt/format.h>

#include "collapse/outcome.h"

namespace topple::collapse {

std::string make_height_table(const record::Record& r, double cell) {
  std::string out = "x [m],y [m],height [m]\r\n";
  if (r.time.empty()) return out;
  for (const Heap::Column& c : calc_heap(find_moving_boxes(r, r.time.size() - 1), cell).columns)
    out += fmt::format("{},{},{}\r\n", (static_cast<double>(c.i) + 0.5) * cell, (static_cast<double>(c.j) + 0.5) * cell,
                       c.height);
  return out;
}

std::string make_outline_table(const record::Record& r) {
  std::string out = "share,x [m],y [m]\r\n";
  if (r.time.empty()) return out;
  for (const double share : {0.5, 0.9, 0.95, 1.0})
    for (const Point2& p : calc_share_outline(r, r.time.size() - 1, share))
      out += fmt::format("{},{},{}\r\n", share, p[0] + 0.0, p[1] + 0.0);
  return out;
}

}  // namespace topple::collapse
