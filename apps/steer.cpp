// topple steer: the server of the steering page.

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "apps/demo_plan.h"
#include "base/error.h"
#include "base/file.h"
#include "base/hash.h"
#include "base/words.h"
#include "browser.h"
#include "commands.h"
#include "results.h"
#include "server/server.h"

namespace topple::apps {

namespace {

namespace fs = std::filesystem;

std::uint16_t read_port(const std::string& text) {
  if (text.empty()) return 0;
  char* end = nullptr;
  const long port = std::strtol(text.c_str(), &end, 10);
  if (*end != '\0' || port < 1 || port > 65535)
    throw InputError("E801", "--port \"" + text + "\" is no port", "1 to 65535; without --port a free one is taken");
  return static_cast<std::uint16_t>(port);
}

/// Says whether there is an earlier session of a plan to go on with.
void tell_of_earlier_session(const server::HubOptions& options, const server::SessionPlan& plan) {
  const auto earlier =
      collapse::find_earlier_log(server::log_path(options.session.folder, plan.path), calc_sha256(plan.text),
                                 options.session.knowledge, options.session.steering.run);
  if (earlier)
    std::fprintf(stderr, "%s holds an earlier session of this plan (%s, computed to %.3f s). %s\n",
                 earlier->path.c_str(), count_words(earlier->actions, "action").c_str(), earlier->time,
                 plan.goes_on ? "It goes on from there." : "The page offers to go on with it; so does --continue.");
  else if (plan.goes_on)
    std::fprintf(stderr, "There is no earlier session of this plan, as it is now, in %s: it begins anew.\n",
                 options.session.folder.c_str());
}

}  // namespace

int steer(const Arguments& a, const std::atomic<bool>& cancel) {
  std::string text;
  try {
    const std::uint16_t port = read_port(a.port);
    if (a.goes_on && a.input.empty())
      throw InputError("E801", "--continue needs the plan whose session goes on", "topple steer plan.toml --continue");
    server::HubOptions options;
    options.session.knowledge = load_knowledge(a);
    if (!a.knowledge.empty()) options.session.rules = read_file(a.knowledge);
    options.session.steering.run = make_plan_options(a);
    options.session.folder = fs::absolute(a.output.empty() ? "steer" : a.output).string();
    const fs::path plan = a.input.empty() ? fs::path() : fs::absolute(a.input);
    options.plans = (a.input.empty() ? fs::current_path() : plan.parent_path()).string();
    for (const auto& [name, page] :
         {std::pair{"steer.html", &options.page}, {"report.html", &options.report}, {"study.html", &options.study}})
      if (auto bundle = find_bundle(name)) *page = std::move(*bundle);
    options.demo = {"Storehouse in Weida, 1998", "", kDemoPlan};
    if (options.page.empty())
      std::fprintf(stderr,
                   "The steering page is not built (run `npm ci && npm run build` in web/); the protocol is served all "
                   "the same.\n");
    server::SessionPlan first;
    if (!a.input.empty()) {
      text = read_file(plan.string());
      first = {a.input, plan.string(), text, a.goes_on};
    }
    // logs and studies lie there
    if (!a.output.empty() || !a.input.empty()) make_folder(options.session.folder, {});
    if (!a.input.empty()) tell_of_earlier_session(options, first);
    const std::string folder = options.session.folder;
    server::Hub hub(std::move(options));
    server::ServerOptions serving;
    serving.port = port;
    const server::Server server(hub, serving);
    if (!a.input.empty()) hub.open(std::move(first));
    if (a.json)
      std::printf("%s\n", nlohmann::ordered_json{{"url", server.url()}, {"folder", folder}}
                              .dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace)
                              .c_str());
    else
      std::printf("%s\n", server.url().c_str());
    std::fflush(stdout);
    std::fprintf(stderr,
                 "Open this address; it works on this machine only and for this start only. Ctrl-C ends the server.\n");
    if (!a.no_open) open_browser(server.url());
    while (!cancel.load(std::memory_order_relaxed)) std::this_thread::sleep_for(std::chrono::milliseconds(100));
    std::fprintf(stderr, "The server ends.\n");
    return kOk;
  } catch (const InputError& e) { return refuse(e, {}, text, a.json); }
}

}  // namespace topple::apps
