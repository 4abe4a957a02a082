#include "record/provenance.h"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <ctime>

namespace topple::record {

std::string now_utc() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

std::string machine_words() {
  utsname u{};
  return uname(&u) == 0 ? fmt::format("{} {}", u.sysname, u.machine) : "unknown";
}

}  // namespace topple::record
