// topple replay: an action log once more, without a server.

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/file.h"
#include "base/words.h"
#include "collapse/action_log.h"
#include "commands.h"
#include "product/plan_sampler.h"
#include "results.h"
#include "terminal.h"

namespace topple::apps {

int replay_log(const Arguments& a, const std::atomic<bool>& cancel) {
  std::string text;
  std::FILE* out = a.json ? stderr : stdout;
  bool is_new = false;
  const char* then = "Nothing was written.";
  try {
    text = read_file(a.input);
    const collapse::Knowledge knowledge = load_knowledge(a);
    collapse::SteeringOptions options;
    options.run = make_plan_options(a);
    is_new = !std::filesystem::exists(a.output);
    make_folder(a.output);
    ProgressLine line;
    Progress progress;
    progress.cancel = &cancel;
    progress.report = [&](double done, double whole) {
      line.say(fmt::format("{:.0f} % of the log done again", 100 * done / whole));
    };
    const collapse::ReplayResult r = collapse::replay(
        text, a.input, knowledge, options,
        [](const product::Plan& plan, const std::vector<double>& inputs) {
          return product::make_sample(product::make_sampler(plan), inputs);
        },
        progress);
    line.clear();
    if (progress.is_cancelled()) {
      std::fprintf(stderr, "Cancelled.\n");
      if (a.json) print_failure("cancelled");
      return kRunFailed;
    }
    if (r.was_cut) std::fprintf(stderr, "The last line of the log has no end and is left out.\n");
    nlohmann::ordered_json branches = nlohmann::ordered_json::array();
    const collapse::Steering& s = r.steering->steering();
    bool failed_report = false;
    for (const auto& b : s.branches()) {
      if (b->frames() == 0) continue;
      if (progress.is_cancelled()) {
        std::fprintf(stderr, "Cancelled.\n");
        if (a.json) print_failure("cancelled");
        return kRunFailed;
      }
      Arguments place = a;
      place.output = (std::filesystem::path(a.output) / fmt::format("branch-{}", b->id)).string();
      make_folder(place.output);
      then = "What was written before is kept.";
      const record::Record record = s.make_record(*b);
      const Files files = write_files(record, place, failed_report);
      branches.push_back({{"id", b->id},
                          {"name", b->name},
                          {"time", b->frontier()},
                          {"steps", b->steps()},
                          {"ending", record.ending}});
      for (const auto& [what, path] : files) branches.back()["files"][what] = path;
      std::fprintf(out, "Branch %d \"%s\" to %.3f s, %s: %s\n", b->id, b->name.c_str(), b->frontier(),
                   count_words(std::ssize(b->edits), "edit").c_str(), place.output.c_str());
    }
    std::fprintf(out, "%s done again.\n", count_words(r.actions, "action").c_str());
    if (a.json)
      std::printf("%s\n",
                  dump(nlohmann::ordered_json{
                           {"exit_code", kOk}, {"actions", r.actions}, {"was_cut", r.was_cut}, {"branches", branches}})
                      .c_str());
    return kOk;
  } catch (const InputError& e) {
    std::error_code ignored;
    if (is_new) std::filesystem::remove(a.output, ignored);  // what holds something stays
    return refuse(e, {}, text, a.json, then);
  }
}

}  // namespace topple::apps
