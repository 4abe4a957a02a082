// topple demo: the storehouse of Weida, built in.

#include <cstdio>
#include <filesystem>

#include "apps/demo_plan.h"
#include "base/file.h"
#include "browser.h"
#include "commands.h"
#include "results.h"

namespace topple::apps {

namespace fs = std::filesystem;

int run_demo(const Arguments& typed, const std::atomic<bool>& cancel) {
  Arguments a = typed;
  if (a.output.empty()) a.output = "storehouse";
  make_folder(a.output);
  const std::string plan = (fs::path(a.output) / "plan.toml").string();
  if (!fs::exists(plan)) {
    replace_file(plan, kDemoPlan);
  } else if (read_file(plan) != kDemoPlan) {
    std::fprintf(stderr, "%s is not the demo's plan any more and is left as it is.\nRun it with: topple run %s -o %s\n",
                 plan.c_str(), plan.c_str(), a.output.c_str());
    if (a.json)
      print_refusal({{Severity::Error,
                      "E802",
                      {},
                      1,
                      plan + " is not the demo's plan any more and is left as it is",
                      "give another folder to -o"}});
    return kBadInput;
  }
  std::FILE* out = a.json ? stderr : stdout;
  std::fprintf(
      out,
      "A storehouse of reinforced concrete in Weida, blasted in 1998: rows A and B go first, row C 4 s later.\n\n");
  std::fflush(out);
  a.input = plan;
  const int code = run_plan_file(a, cancel);
  if (code != kOk && code != kCriterionViolated) return code;
  const std::string page = (fs::path(a.output) / "report.html").string();
  const bool has_page = fs::exists(page);
  std::fprintf(out, "\nWhat next\n");
  if (has_page)
    std::fprintf(out, "  open %s in a browser: the collapse, its findings, plots and events\n", page.c_str());
  std::fprintf(out,
               "  topple steer %s: watch it come down, stop it, change the plan\n"
               "  change a delay or a charge in %s, then: topple run %s -o %s\n"
               "  topple new plan.toml: a commented plan of your own to begin with\n",
               plan.c_str(), plan.c_str(), plan.c_str(), (fs::path(a.output) / "changed").string().c_str());
  if (a.open && has_page) open_browser(fs::absolute(page).string());
  return code;
}

}  // namespace topple::apps
