// topple doctor: what is installed, and whether it calculates what is known.

#include <fmt/format.h>
#include <hdf5.h>
#include <sqlite3.h>
#include <unistd.h>
#ifdef TOPPLE_POSTGRESQL
#include <libpq-fe.h>
#endif

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string_view>
#include <thread>

#include "commands.h"
#include "engines/engine.h"
#include "fem/explicit_kernel.h"
#include "mbs/kernel.h"
#include "nearfield/section_kernel.h"
#include "program.h"
#include "record/provenance.h"
#include "results.h"
#include "self_check.h"

namespace topple::apps {

namespace fs = std::filesystem;
using json = nlohmann::ordered_json;

namespace {

/// Something that may be there: version and place, empty if it is not; and what it is for.
struct Part {
  std::string name, version, what_for;
};

/// Where a program would be found; empty if nowhere.
std::string find_program(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::string_view rest = path == nullptr ? "" : path;
  while (!rest.empty()) {
    const size_t end = std::min(rest.find(':'), rest.size());
    const fs::path file = fs::path(rest.substr(0, end)) / name;
    std::error_code ignored;
    if (fs::is_regular_file(file, ignored) && access(file.c_str(), X_OK) == 0) return file.string();
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return {};
}

std::string hdf5_version() {
  unsigned major = 0, minor = 0, release = 0;
  H5get_libversion(&major, &minor, &release);
  return fmt::format("{}.{}.{}", major, minor, release);
}

std::vector<Part> list_engine_parts() {
  std::vector<Part> out;
  for (const engines::EngineInfo& e : engines::list_engines())
    out.push_back({e.name, e.version,
                   e.is_available() ? e.name == "native" ? "multibody models, the default" : "a second opinion on them"
                                    : "built in where " + e.package + " is installed when topple is built"});
  return out;
}

std::vector<Part> list_libraries() {
  std::string postgresql;
#ifdef TOPPLE_POSTGRESQL
  const int v = PQlibVersion();
  postgresql = fmt::format("{}.{}", v / 10000, v % 10000);
#endif
  return {{"hdf5", hdf5_version(), "records"},
          {"sqlite", sqlite3_libversion(), "studies on one machine"},
          {"postgresql client", postgresql, "studies on many machines"}};
}

std::vector<Part> list_pages() {
  std::vector<Part> out;
  for (const auto& [name, what] : {std::pair{"report.html", "run, report, demo"},
                                   {"compare.html", "compare"},
                                   {"study.html", "study"},
                                   {"steer.html", "steer"}})
    out.push_back({name, find_bundle(name) ? "found" : "", std::string("page of topple ") + what});
  return out;
}

std::vector<Part> list_programs() {
  return {{"xdg-open", find_program("xdg-open"), "opens pages (steer, demo --open)"},
          {"chromium", find_program("chromium"), "prints pages, makes the gallery, tests; any browser shows them"},
          {"psql", find_program("psql"), "looks into a study's server by hand"}};
}

std::string describe_compiler() {
#if defined(__clang__)
  return "Clang " __clang_version__;
#elif defined(__GNUC__)
  return "GCC " __VERSION__;
#else
  return "unknown";
#endif
}

struct Lane {
  std::string what, target;
  size_t doubles;  // that one instruction works on
};
std::vector<Lane> list_lanes() {
  return {{"multibody elements", mbs::kernel::target_name(), mbs::kernel::lanes()},
          {"sections", nearfield::section_kernel_target(), 8},
          {"finite elements", fem::kernel::target_name(), fem::kernel::lanes()}};
}

void print(const char* heading, const std::vector<Part>& parts) {
  size_t name = 0, version = 0;
  for (const Part& p : parts)
    name = std::max(name, p.name.size()), version = std::max(version, p.version.empty() ? 9 : p.version.size());
  std::printf("\n%s\n", heading);
  for (const Part& p : parts)
    std::printf("  %s\n", fmt::format("{:<{}}  {:<{}}  {}", p.name, name, p.version.empty() ? "not there" : p.version,
                                      version, p.what_for)
                              .c_str());
}

json to_json(const std::vector<Part>& parts) {
  json out = json::array();
  for (const Part& p : parts)
    out.push_back(
        {{"name", p.name}, {"version", p.version.empty() ? json(nullptr) : json(p.version)}, {"what_for", p.what_for}});
  return out;
}

/// A folder that goes away with it.
class Scratch {
 public:
  Scratch() {
    const char* parent = std::getenv("TMPDIR");
    std::string name = (fs::path(parent == nullptr ? "/tmp" : parent) / "topple-doctor-XXXXXX").string();
    if (mkdtemp(name.data()) != nullptr) path_ = name;
  }
  ~Scratch() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  /// Nowhere if it could not be made: the checks that need it fail.
  fs::path path() const { return path_.empty() ? fs::path("/dev/null/topple-doctor") : path_; }

 private:
  fs::path path_;
};

}  // namespace

int examine(const Arguments& a, const std::atomic<bool>& cancel) {
  const auto cores = std::thread::hardware_concurrency();
  const char* build =
#ifdef NDEBUG
      "optimised";
#else
      "with assertions";
#endif
  if (!a.json) {
    std::printf("topple %s, built %s by %s\n", program_version().c_str(), build, describe_compiler().c_str());
    std::printf("%s, %u cores\n", record::machine_words().c_str(), cores);
    print("Engines", list_engine_parts());
    print("Libraries", list_libraries());
    print("Pages", list_pages());
    print("Programs (none is needed)", list_programs());
    std::printf("\nVector instructions in use\n");
    for (const Lane& l : list_lanes())
      std::printf("  %s\n", fmt::format("{:<18}  {}, {} numbers at a time", l.what, l.target, l.doubles).c_str());
    std::printf("\nSelf-check\n");
    std::fflush(stdout);
  }
  const Scratch scratch;
  const std::vector<SelfCheckCase> cases = make_self_checks(scratch.path());
  const std::vector<SelfCheck> checks = run_self_checks(cases, cancel);
  const bool is_cancelled = checks.size() < cases.size(), ok = !is_cancelled && all_ok(checks);
  const int code = ok ? kOk : kRunFailed;
  if (a.json) {
    json out{{"exit_code", code},
             {"cancelled", is_cancelled},
             {"version", program_version()},
             {"build", build},
             {"compiler", describe_compiler()},
             {"machine", record::machine_words()},
             {"cores", cores},
             {"engines", to_json(list_engine_parts())},
             {"libraries", to_json(list_libraries())},
             {"pages", to_json(list_pages())},
             {"programs", to_json(list_programs())},
             {"lanes", json::array()},
             {"checks", json::array()}};
    for (const Lane& l : list_lanes())
      out["lanes"].push_back({{"what", l.what}, {"target", l.target}, {"doubles", l.doubles}});
    for (const SelfCheck& c : checks) {
      json numbers = json::array();
      for (const CheckedNumber& n : c.numbers)
        numbers.push_back({{"what", n.what},
                           {"unit", n.unit},
                           {"expected", n.expected},
                           {"got", std::isfinite(n.got) ? json(n.got) : json(nullptr)},
                           {"tolerance", n.tolerance},
                           {"ok", n.is_ok()}});
      out["checks"].push_back({{"name", c.name},
                               {"source", c.source},
                               {"ok", c.is_ok()},
                               {"failure", c.failure},
                               {"seconds", c.seconds},
                               {"numbers", std::move(numbers)}});
    }
    std::printf("%s\n", dump(out).c_str());
    return code;
  }
  std::fputs(to_text(checks).c_str(), stdout);
  double seconds = 0;
  size_t failed = 0;
  for (const SelfCheck& c : checks) seconds += c.seconds, failed += !c.is_ok();
  if (is_cancelled)
    std::printf("\nCancelled: %zu of %zu checks were done; nothing is said of the others.\n", checks.size(),
                cases.size());
  if (ok)
    std::printf("\nAll %zu checks are ok (%.1f s).\n", checks.size(), seconds);
  else if (failed > 0)
    std::printf("\n%zu of %zu checks FAILED (%.1f s): do not trust results of this installation.\n", failed,
                checks.size(), seconds);
  return code;
}

}  // namespace topple::apps
