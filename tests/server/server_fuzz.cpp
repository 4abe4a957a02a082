/// Throws mutated messages, paths and plans at a hub for some seconds. Deterministic but for when it ends; it must come
/// to its end, every command must be answered once, and the run must still be there.
///   server_fuzz SECONDS [SEED]

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>

#include "../collapse/plans.h"
#include "base/file.h"
#include "server/hub.h"

namespace {

namespace fs = std::filesystem;
using namespace topple;
using server::Json;

class Counter : public server::Outlet {
 public:
  void send(std::shared_ptr<const std::string> text) override {
    // whatever is sent must be JSON
    if (Json::parse(*text, nullptr, false).is_discarded()) std::abort();
  }
  bool offer(std::shared_ptr<const server::FrameBody>, unsigned) override { return true; }
  void answered() override { ++count; }
  std::atomic<long> count{0};
};

using Random = std::mt19937_64;

std::string mutate(std::string text, Random& random, const std::vector<std::string>& words) {
  const auto pick = [&](std::size_t n) { return static_cast<std::size_t>(random() % std::max<std::size_t>(n, 1)); };
  for (std::size_t n = 1 + pick(4); n > 0; --n) {
    const std::size_t at = pick(text.size() + 1);
    switch (pick(7)) {
      case 0:
        text.insert(at, 1, static_cast<char>(random()));
        break;
      case 1:
        if (at < text.size()) text[at] = static_cast<char>(text[at] ^ (1 << pick(8)));
        break;
      case 2:
        if (at < text.size()) text.erase(at, 1 + pick(8));
        break;
      case 3:
        text.insert(at, words[pick(words.size())]);
        break;
      case 4: {
        const std::string piece = text.substr(at, pick(40));
        text.insert(pick(text.size() + 1), piece);
        break;
      }
      case 5: {
        // a number for another one
        const std::size_t digit = text.find_first_of("0123456789", at);
        if (digit != std::string::npos) text.replace(digit, 1, words[pick(words.size())]);
        break;
      }
      default:
        text.resize(at);
    }
  }
  return text;
}

}  // namespace

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 10;
  Random random(argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1);
  const fs::path folder = fs::temp_directory_path() / ("topple-fuzz-" + std::to_string(getpid()));
  fs::create_directories(folder);
  const std::string plan =
      collapse::house(collapse::charge("C-A*-0", "0.1 s") + collapse::charge("C-B*-0", "0.2 s"), "0.3 s");
  const std::vector<std::string> words{
      "-1",      "0",   "1e308",  "1e-308",     "9999999999999999999", "null", "true", "[]", "{}",  "\"\"", "\xff",
      "\\u0000", "../", "nan",    "\"branch\"", "\"frame\"",           "[[",   "]]",   "\"", "'''", "= ",   "\n",
      "m",       "s",   "C-A1-0", "[fuzzy]\n"};
  const std::vector<std::string> messages{
      R"({"id": 1, "command": "run", "until": 0.2})",
      R"({"id": 1, "command": "pause"})",
      R"({"id": 1, "command": "step", "frames": 2})",
      R"({"id": 1, "command": "rewind", "time": 0.1})",
      R"({"id": 1, "command": "rewind", "frame": 3})",
      R"({"id": 1, "command": "live"})",
      R"({"id": 1, "command": "fire", "charge": 3})",
      R"({"id": 1, "command": "set_delay", "stage": 1, "time": 0.25})",
      R"({"id": 1, "command": "add_charge", "member": "C-B2-1", "position": 1, "destroyed_length": 0.6, "time": 0.2})",
      R"({"id": 1, "command": "add_pre_cut", "member": "C-B1-0", "at": 2.4, "cut_bars": 0.5})",
      R"({"id": 1, "command": "add_cable", "member": "C-A2-1", "position": 1.5, "anchor": [-15, 4, 0], "stiffness": 2e6, "pretension": 5e4})",
      R"({"id": 1, "command": "set_friction", "ground": 0.2, "bodies": 0.3, "in_place": true})",
      R"({"id": 1, "command": "undo"})",
      R"({"id": 1, "command": "branch", "name": "a"})",
      R"({"id": 1, "command": "rename", "branch": 1, "name": "b"})",
      R"({"id": 1, "command": "switch", "branch": 1})",
      R"({"id": 1, "command": "compare", "a": 1, "b": 1, "frames": 20})",
      R"({"id": 1, "command": "frames", "from": 0, "count": 10, "stride": 2})",
      R"({"id": 1, "command": "series", "from": 2})",
      R"({"id": 1, "command": "zone", "zone": "C-A1-0/foot"})",
      R"({"id": 1, "command": "log", "from": 1})",
      R"({"id": 1, "command": "plan.text"})",
      R"({"id": 1, "command": "plan.save", "text": "x", "base_sha256": ""})",
      R"({"id": 1, "command": "findings"})",
      R"({"id": 1, "command": "scene"})",
      R"({"id": 1, "command": "session.list"})",
      R"({"id": 1, "command": "session.open", "path": "a.toml"})",
      R"({"id": 1, "command": "study.list"})"};
  const std::vector<std::string> paths{"/api/sessions/1/branches/1/findings", "/api/sessions/1/log", "/api/plans",
                                       "/api/studies/1/results.json", "/"};
  long sent = 0, refused_plans = 0, read_plans = 0;
  const auto outlet = std::make_shared<Counter>();
  {
    server::HubOptions options;
    options.session.knowledge = collapse::default_knowledge();
    options.session.steering.run.program_version = "fuzz";
    options.session.folder = (folder / "out").string();
    options.plans = folder.string();
    options.most_sessions = 2;
    server::Hub hub(options);
    hub.open({"plan", "", plan});
    const auto client = hub.connect(outlet, "", std::nullopt);
    long id = 1;
    const auto begin = std::chrono::steady_clock::now();
    while (std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() < seconds) {
      for (int i = 0; i < 20; ++i) {
        std::string text = messages[random() % messages.size()];
        text.replace(text.find('1'), 1, std::to_string(++id));
        // half of them are as they should be, so that the run goes on
        if (random() % 2 == 0) text = mutate(text, random, words);
        hub.receive(client, text);
        ++sent;
      }
      hub.get(mutate(paths[random() % paths.size()], random, words), [](server::Reply) {});
      try {
        std::vector<Diagnostic> warnings;
        (void)product::read_plan(mutate(plan, random, words), "plan", warnings);
        ++read_plans;
      } catch (const InputError&) { ++refused_plans; }
      while (outlet->count < sent - 200 &&
             std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() < seconds + 60)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    for (int i = 0; i < 60000 && outlet->count < sent; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    client->detach(outlet.get());
  }
  fs::remove_all(folder);
  std::printf("%ld messages, %ld answered; %ld plans read, %ld refused\n", sent, outlet->count.load(), read_plans,
              refused_plans);
  return outlet->count == sent ? 0 : 1;
}
