// topple worker: takes runs out of a store and does them, until no study is open.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "base/error.h"
#include "commands.h"
#include "refusal.h"
#include "study/evaluator.h"
#include "study/pool.h"
#include "study_model.h"
#include "terminal.h"

namespace topple::apps {

int run_worker(const Arguments& a, const std::atomic<bool>& cancel) {
  const auto complain = [&a](const InputError& e) {
    for (const Diagnostic& d : e.diagnostics()) std::fputs(render(d, "", has_colour(stderr)).c_str(), stderr);
    if (a.json) print_refusal(e.diagnostics());
    return kBadInput;
  };
  StudyPlace place;
  bool is_for_one = false;  // of several on a server
  study::PoolOptions options;
  double idle = 0;
  try {
    place = find_place(a.input);
    if (!a.study.name.empty()) {
      if (!study::is_server(place.store))
        throw InputError("E801", "--name: only a study on a server has a name", "leave it out");
      place.name = a.study.name;
    }
    is_for_one = study::is_server(place.store) && !place.name.empty();
    options = make_pool_options(a.study);
    options.jobs = std::max(1, options.jobs);
    idle = read_seconds(a.study.idle, "--idle", 0);
  } catch (const InputError& e) { return complain(e); }
  try {
    study::Store store(place.store, &cancel, options.patience);
    const auto find_study = [&] {
      std::optional<study::StudyRow> row = store.find_study(place.name);
      if (!row)
        throw InputError("E820",
                         fmt::format("there is no study \"{}\" in {}", place.name, study::hide_password(place.store)));
      return *row;
    };
    if (is_for_one) {
      const study::StudyRow row = find_study();
      options.models = {row.model};
      if (const study::Problem problem = read_problem(row); problem.whole)
        options.models.push_back(study::calc_model_hash(*problem.whole));
    }
    const study::RunnerFactories factories = make_factories();
    study::Pool pool(place.store, factories, options);
    ProgressLine line;
    std::string told;  // what was wrong with the last answer that was refused
    std::string why = "interrupted; its runs went back to the store";
    while (!cancel) {
      pool.wait_for_news(0.5);
      pool.check();
      if (const std::string refusal = pool.get_refusal(); refusal != told) {
        told = refusal;
        line.clear();
        const study::Refusal r = study::read_refusal(refusal);
        std::fputs(render(r.diagnostic, to_printable(r.line), has_colour(stderr)).c_str(), stderr);
        std::fputs("The study it belongs to stops.\n", stderr);
      }
      line.say(fmt::format("{} done, {} running", pool.finished(), pool.running()));
      if (pool.running() > 0) continue;
      if (idle > 0 && pool.calc_idle_time() > idle) {
        why = "there was no work";
        break;
      }
      if (is_for_one && find_study().state == "finished") {
        why = "the study is finished";
        break;
      }
      if (const auto [all, open] = store.count_studies(); all > 0 && open == 0) {
        why = "every study is finished";
        break;
      }
    }
    pool.stop();
    pool.join();
    if (pool.has_kept()) why = "interrupted; the store is away: its runs go to others when their leases run out";
    line.clear();
    std::string others;
    if (pool.refused() > 0) others += fmt::format(", {} not understood", pool.refused());
    if (pool.too_late() > 0) others += fmt::format(", {} came too late", pool.too_late());
    std::fprintf(stderr, "%ld runs done here%s; %s\n", pool.finished(), others.c_str(), why.c_str());
    if (a.json)
      std::printf("%s\n", dump(nlohmann::ordered_json{{"exit_code", kOk},
                                                      {"done", pool.finished()},
                                                      {"refused", pool.refused()},
                                                      {"too_late", pool.too_late()},
                                                      {"ending", why}})
                              .c_str());
    return kOk;
  } catch (const InputError& e) { return complain(e); } catch (const study::ConnectionLost& e) {
    std::fprintf(stderr, "topple: the store is away: %s\n", e.what());
    if (a.json) print_failure(std::string("the store is away: ") + e.what());
    return kRunFailed;
  }
}

}  // namespace topple::apps
