#include "server/hub.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <filesystem>

#include "base/file.h"
#include "base/hash.h"
#include "collapse/branch_plan.h"
#include "collapse/edit_json.h"
#include "product/document.h"
#include "product/import.h"
#include "product/templates.h"
#include "record/hdf5.h"
#include "record/page.h"
#include "server/server.h"

namespace topple::server {

namespace fs = std::filesystem;
using collapse::check_keys;
using collapse::read_flag;
using collapse::read_integer;
using collapse::read_text;

namespace {

constexpr double kRemembered = 600;  // a client without a connection [s]
constexpr std::size_t kMostPlans = 500, kMostStudies = 16;
constexpr std::size_t kMostText = std::size_t{2} << 20;
constexpr int kMostIds = 1 << 30;

bool has(const Json& command, const char* key) {
  const auto it = command.find(key);
  return it != command.end() && !it->is_null();
}

std::vector<std::string> split(const std::string& path) {
  std::vector<std::string> parts;
  for (std::size_t at = 1; at <= path.size();) {
    const std::size_t end = std::min(path.find('/', at), path.size());
    parts.push_back(path.substr(at, end - at));
    at = end + 1;
  }
  return parts;
}

std::optional<int> read_id(const std::string& text) {
  int id = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), id);
  if (fault != std::errc() || end != text.data() + text.size() || id < 1) return std::nullopt;
  return id;
}

/// Lines before the first table, where the keys of the plan itself stand.
std::string find_head(const std::string& text) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t word = text.find_first_not_of(" \t", at);
    if (word != std::string::npos && text[word] == '[') return text.substr(0, at);
    at = std::min(text.find('\n', at), text.size() - 1) + 1;
  }
  return text;
}

/// Of a plan that may have errors; empty: none that can be read.
std::string read_title(std::string text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
  // the whole where a value of the head has lines that begin as tables do
  for (const std::string& part : {find_head(text), text}) {
    try {
      const product::Node root = product::parse_document(part, "");
      const product::Entry* title = root.find("title");
      return title != nullptr && title->value.kind == product::Node::Kind::String ? title->value.text : "";
    } catch (const InputError&) {
      // no TOML
    }
  }
  return {};
}

Reply make_nothing(const std::string& what) { return make_error_reply(404, "E903", what); }

}  // namespace

Reply make_error_reply(int status, const std::string& code, const std::string& message, const std::string& help) {
  Reply r;
  r.status = status;
  r.body = dump({{"error", {{"code", code}, {"message", message}, {"help", help}}}});
  return r;
}

Hub::Hub(HubOptions options) : options_(std::move(options)) {
  options_.session.plans = options_.plans;
  errand_thread_ = std::thread([this] { work_errands(); });
}

Hub::~Hub() { close(); }

void Hub::close() {
  {
    const std::lock_guard lock(errand_mutex_);
    closing_ = true;
  }
  errand_wakes_.notify_all();
  if (errand_thread_.joinable()) errand_thread_.join();
  std::map<int, std::shared_ptr<Session>> sessions;
  std::map<int, std::shared_ptr<StudyTask>> studies;
  {
    const std::lock_guard lock(mutex_);
    sessions.swap(sessions_);
    studies.swap(studies_);
  }
  sessions.clear();
  studies.clear();
  errands_.clear();
}

void Hub::run_errand(std::function<void()> work) {
  {
    const std::lock_guard lock(errand_mutex_);
    errands_.push_back(std::move(work));
  }
  errand_wakes_.notify_one();
}

void Hub::work_errands() {
  for (;;) {
    std::function<void()> work;
    {
      std::unique_lock lock(errand_mutex_);
      errand_wakes_.wait(lock, [this] { return closing_ || !errands_.empty(); });
      if (closing_) return;
      work = std::move(errands_.front());
      errands_.pop_front();
    }
    work();
  }
}

std::shared_ptr<Session> Hub::find_session(int id) const {
  const std::lock_guard lock(mutex_);
  const auto it = sessions_.find(id);
  return it == sessions_.end() ? nullptr : it->second;
}

std::shared_ptr<StudyTask> Hub::find_study(int id) const {
  const std::lock_guard lock(mutex_);
  const auto it = studies_.find(id);
  return it == studies_.end() ? nullptr : it->second;
}

std::vector<std::shared_ptr<Client>> Hub::all_clients() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<Client>> list;
  for (const auto& [token, c] : clients_) list.push_back(c);
  return list;
}

int Hub::open(SessionPlan plan) {
  int id = 0;
  {
    const std::lock_guard lock(mutex_);
    if (sessions_.size() >= options_.most_sessions)
      throw InputError("E905", fmt::format("{} sessions are open, which is the limit", sessions_.size()), "close one");
    id = ++last_session_;
    sessions_[id] = std::make_shared<Session>(id, std::move(plan), options_.session);
  }
  tell_sessions();
  return id;
}

Json Hub::list_sessions() const {
  Json list = Json::array();
  const std::lock_guard lock(mutex_);
  for (const auto& [id, s] : sessions_) list.push_back(s->brief());
  return list;
}

Json Hub::list_plans() const {
  Json list = Json::array();
  std::error_code fault;
  std::vector<fs::path> found;
  fs::recursive_directory_iterator it(options_.plans, fs::directory_options::skip_permission_denied, fault), end;
  for (; !fault && it != end && found.size() < kMostPlans; it.increment(fault)) {
    if (it.depth() >= 2) it.disable_recursion_pending();
    const std::string name = it->path().filename().string();
    if (name.starts_with(".") || name == "node_modules") {
      it.disable_recursion_pending();
      continue;
    }
    std::error_code ignored;
    if (it->path().extension() == ".toml" && it->is_regular_file(ignored) && !it->is_symlink(ignored))
      found.push_back(it->path());
  }
  std::sort(found.begin(), found.end());
  for (const fs::path& p : found) {
    std::string title;
    try {
      title = read_title(read_file(p.string()));
    } catch (const std::exception&) { continue; }
    list.push_back({{"path", fs::relative(p, options_.plans, fault).string()}, {"title", title.substr(0, 200)}});
  }
  return {{"folder", options_.plans}, {"plans", std::move(list)}};
}

Json Hub::list_templates() const {
  Json list = Json::array();
  for (const product::Template& t : product::templates())
    list.push_back({{"name", t.name}, {"title", t.title}, {"description", t.description}, {"text", t.text}});
  Json all{{"templates", std::move(list)}, {"demo", nullptr}};
  if (!options_.demo.text.empty()) all["demo"] = {{"title", options_.demo.title}};
  return all;
}

SessionPlan Hub::read_plan_of(const Json& command) const {
  check_keys(command, {"path", "text", "title", "template", "demo"});
  const bool is_demo = read_flag(command, "demo", false);
  const int ways = has(command, "path") + has(command, "text") + has(command, "template") + is_demo;
  if (ways > 1 || (has(command, "title") && !has(command, "text")))
    throw InputError("E912",
                     "session.open wants one of \"path\", \"text\" (with \"title\"), \"template\" and \"demo\"");
  if (is_demo) {
    if (options_.demo.text.empty()) throw InputError("E920", "there is no demo here");
    return options_.demo;
  }
  if (has(command, "path")) {
    const std::string name = read_text(command, "path");
    const fs::path relative(name);
    const bool is_inside = !relative.is_absolute() && relative.extension() == ".toml" &&
                           name.find('\0') == std::string::npos &&
                           std::none_of(relative.begin(), relative.end(),
                                        [](const fs::path& part) { return part == ".." || part == "."; });
    if (!is_inside)
      throw InputError("E904", "plans are named as in /api/plans", "relative to the folder of the first plan");
    std::error_code fault;
    const fs::path root = fs::weakly_canonical(options_.plans, fault),
                   whole = fs::weakly_canonical(root / relative, fault);
    const auto [end, nothing] = std::mismatch(root.begin(), root.end(), whole.begin(), whole.end());
    if (fault || end != root.end()) throw InputError("E904", "the plan lies outside the folder of plans");
    return {name, whole.string(), read_file(whole.string())};
  }
  if (has(command, "template")) {
    const std::string name = read_text(command, "template");
    const product::Template& t = product::find_template(name);
    return {t.title, "", t.text};
  }
  const std::string text = read_text(command, "text");
  if (text.size() > kMostText) throw InputError("E904", "the plan is too long");
  return {read_text(command, "title", "plan"), "", text};
}

void Hub::tell_sessions() {
  const auto text = std::make_shared<const std::string>(dump({{"type", "sessions"}, {"sessions", list_sessions()}}));
  for (const auto& c : all_clients()) c->send(text);
}

void Hub::say_bye(const std::string& reason) {
  const auto text = std::make_shared<const std::string>(dump({{"type", "bye"}, {"reason", reason}}));
  for (const auto& c : all_clients()) c->send(text);
}

void Hub::forget_old_clients() {
  std::vector<std::shared_ptr<Client>> old;
  const std::lock_guard lock(mutex_);
  for (auto it = clients_.begin(); it != clients_.end();) {
    if (it->second->calc_absence() > kRemembered) {
      old.push_back(it->second);
      it = clients_.erase(it);
    } else {
      ++it;
    }
  }
}

std::shared_ptr<Client> Hub::connect(std::shared_ptr<Outlet> outlet, const std::string& resume,
                                     std::optional<long> after) {
  forget_old_clients();
  std::shared_ptr<Client> client;
  std::shared_ptr<Session> session;
  bool is_back = false;
  {
    const std::lock_guard lock(mutex_);
    if (const auto it = clients_.find(resume); it != clients_.end()) {
      client = it->second;
      is_back = true;
    } else {
      client = std::make_shared<Client>(make_token());
      clients_[client->token()] = client;
    }
    if (const auto it = sessions_.find(client->session); it != sessions_.end()) {
      session = it->second;
    } else {
      is_back = false;  // its events were those of a session that is gone
      if (!sessions_.empty()) session = sessions_.begin()->second;
    }
  }
  // commands that come before hello are of it, too
  if (session) client->session = session->id();
  client->attach(std::move(outlet));
  if (!session) {
    client->send(std::make_shared<const std::string>(
        dump({{"type", "hello"},
              {"protocol", 1},
              {"program", "topple " + options_.session.steering.run.program_version},
              {"resume", client->token()},
              {"seq", 0},
              {"session", nullptr},
              {"scene", nullptr},
              {"plan", nullptr}})));
    return client;
  }
  session->ask([client, is_back, after](Session& s) { s.welcome(client, is_back ? after : std::nullopt); });
  return client;
}

void Hub::disconnect(const std::shared_ptr<Client>& client, const Outlet* outlet) { client->detach(outlet); }

void Hub::receive(const std::shared_ptr<Client>& client, const std::string& text) {
  const auto refuse = [&](Json id, const InputError& e) {
    client->send(std::make_shared<const std::string>(dump(make_error(std::move(id), describe_error(e)))));
    if (const auto o = client->outlet()) o->answered();
  };
  Json command;
  try {
    command = collapse::parse_command(text);
  } catch (const InputError& e) { return refuse(nullptr, e); } catch (const std::exception&) {
    command = Json(Json::value_t::discarded);
  }
  if (!command.is_object()) return refuse(nullptr, InputError("E910", "a message must be a JSON object"));
  const auto it = command.find("id");
  const bool has_id = it != command.end() && it->is_number_integer() &&
                      (!it->is_number_unsigned() || it->get<std::uint64_t>() <= (std::uint64_t{1} << 53)) &&
                      it->get<std::int64_t>() >= 0;
  if (!has_id) return refuse(nullptr, InputError("E910", "a command needs an \"id\": a whole number from 0"));
  const auto id = it->get<std::int64_t>();
  if (!client->begin(id)) return;
  try {
    const std::string word = read_text(command, "command");
    if (auto result = perform(client, word, command)) {
      client->answer(id, dump(make_ack(id, std::move(*result))));
      return;
    }
    if (word == "plan.import") return import_plan(client, id, command);
    const int number = has(command, "session") ? read_integer(command, "session", 1, kMostIds) : client->session.load();
    const auto session = find_session(number);
    if (!session)
      throw InputError("E920", number > 0 ? fmt::format("there is no session {}", number) : "no session is open",
                       "session.list shows those that are open");
    if (word == "plan.check") {
      check_keys(command, {"text"});
      const std::string plan_text = read_text(command, "text");
      const std::string name = session->brief()["path"];
      run_errand([client, id, plan_text, name] {
        Json result{{"title", nullptr}, {"notes", Json::array()}, {"removes_support", nullptr}};
        try {
          std::vector<Diagnostic> warnings;
          const product::Plan plan = product::read_plan(plan_text, name.empty() ? "plan" : name, warnings);
          result["diagnostics"] = describe_diagnostics(warnings);
          result["title"] = plan.title;
          bool removes = false;
          for (const product::Stage& s : plan.stages)
            for (const product::Charge& c : s.charges) removes = removes || !c.fails;
          for (const product::Member& m : plan.members) removes = removes || m.removed || !m.weakenings.empty();
          result["removes_support"] = removes;
          if (!removes) result["notes"].push_back("Nothing removes a support: the building will stand.");
        } catch (const InputError& e) {
          result["diagnostics"] = describe_diagnostics(e.diagnostics());
        } catch (const std::exception& e) {
          client->answer(id, dump(make_error(id, describe_error(InputError("E904", e.what())))));
          return;
        }
        client->answer(id, dump(make_ack(id, std::move(result))));
      });
      return;
    }
    if (word == "study.start") return start_study(client, id, command, session);
    if (word == "study.play") return play_sample(client, id, command, session);
    if (word == "sample") throw InputError("E911", "there is no command \"sample\"", "did you mean \"study.play\"?");
    session->post(client, id, command);
  } catch (const InputError& e) {
    client->answer(id, dump(make_error(id, describe_error(e))));
  } catch (const std::exception& e) {
    client->answer(id, dump(make_error(id, describe_error(InputError("E940", e.what())))));
  }
}

void Hub::import_plan(const std::shared_ptr<Client>& client, std::int64_t id, const Json& command) {
  check_keys(command, {"name", "text", "unit"});
  const std::string name = read_text(command, "name"), text = read_text(command, "text");
  const double unit = has(command, "unit") ? collapse::read_number(command, "unit") : 0;
  if (!(unit >= 0)) throw InputError("E912", "\"unit\" must be > 0 m, or left out");
  std::string kind = fs::path(name).extension().string();
  std::transform(kind.begin(), kind.end(), kind.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (kind != ".ifc" && kind != ".dxf")
    throw InputError("E114", name + " is neither .ifc nor .dxf", "give a building (IFC) or a site (DXF)");
  if (kind == ".ifc" && unit > 0) throw InputError("E912", "\"unit\" is for drawings; an IFC file names its own");
  run_errand([client, id, name, text, unit, is_building = kind == ".ifc"] {
    try {
      const product::Import made = is_building ? product::make_plan_text(product::read_ifc(text, name), name)
                                               : product::make_site_text(text, name, unit);
      client->answer(id, dump(make_ack(id, {{"text", made.text},
                                            {"taken", made.report.taken},
                                            {"guessed", made.report.guessed},
                                            {"missing", made.report.missing}})));
    } catch (const InputError& e) {
      client->answer(id, dump(make_error(id, describe_error(e))));
    } catch (const std::exception& e) {
      client->answer(id, dump(make_error(id, describe_error(InputError("E904", e.what())))));
    }
  });
}

std::optional<Json> Hub::perform(const std::shared_ptr<Client>& client, const std::string& word, const Json& command) {
  if (word == "ping") {
    check_keys(command, {});
    return Json{{"time", std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count()}};
  }
  if (word == "session.list") {
    check_keys(command, {});
    return Json{{"sessions", list_sessions()}};
  }
  if (word == "session.open" || word == "session.attach") {
    int id = 0;
    if (word == "session.open") {
      id = open(read_plan_of(command));
    } else {
      check_keys(command, {});
      id = read_integer(command, "session", 1, kMostIds);
    }
    const auto session = find_session(id);
    if (!session) throw InputError("E920", fmt::format("there is no session {}", id));
    if (const auto before = find_session(client->session)) before->leave(client.get());
    client->zone = -1;
    client->session = id;
    session->ask([client](Session& s) { s.welcome(client); });
    return Json{{"session", id}};
  }
  if (word == "session.close") {
    check_keys(command, {});
    const int id = has(command, "session") ? read_integer(command, "session", 1, kMostIds) : client->session.load();
    std::shared_ptr<Session> closed;
    {
      const std::lock_guard lock(mutex_);
      const auto it = sessions_.find(id);
      if (it == sessions_.end()) throw InputError("E920", fmt::format("there is no session {}", id));
      closed = std::move(it->second);
      sessions_.erase(it);
    }
    const auto bye = std::make_shared<const std::string>(
        dump({{"type", "bye"}, {"session", id}, {"reason", "the session was closed"}}));
    for (const auto& c : all_clients())
      if (c->session == id) c->send(bye);
    // its thread ends with the step under way
    run_errand([closed]() mutable { closed.reset(); });
    closed.reset();
    tell_sessions();
    return Json{{"session", id}};
  }
  if (word == "study.list") {
    check_keys(command, {});
    Json list = Json::array();
    const std::lock_guard lock(mutex_);
    for (const auto& [id, s] : studies_) list.push_back(s->describe());
    return Json{{"studies", std::move(list)}};
  }
  if (word == "study.watch" || word == "study.unwatch" || word == "study.cancel") {
    check_keys(command, {"study"});
    const int id = read_integer(command, "study", 1, kMostIds);
    const auto study = find_study(id);
    if (!study) throw InputError("E920", fmt::format("there is no study {}", id));
    if (word == "study.cancel") {
      study->cancel();
      return Json{{"study", study->describe()}};
    }
    const std::lock_guard lock(mutex_);
    auto& list = study_watchers_[id];
    std::erase_if(list, [&](const auto& weak) { return weak.expired() || weak.lock() == client; });
    if (word == "study.unwatch") return Json::object();
    list.push_back(client);
    return Json{{"study", study->describe()}, {"samples", study->samples()}};
  }
  return std::nullopt;
}

void Hub::tell_study(int id, const Json& state, const Json& samples) {
  std::vector<std::shared_ptr<Client>> list;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& weak : study_watchers_[id])
      if (auto c = weak.lock()) list.push_back(std::move(c));
  }
  if (list.empty()) return;
  const auto text =
      std::make_shared<const std::string>(dump({{"type", "study"}, {"study", state}, {"samples", samples}}));
  for (const auto& c : list) c->send(text);
}

void Hub::start_study(const std::shared_ptr<Client>& client, std::int64_t id, const Json& command,
                      const std::shared_ptr<Session>& session) {
  check_keys(command, {"samples", "seed", "edits"});
  const bool with_edits = read_flag(command, "edits", true);
  StudySetting setting;
  setting.samples = has(command, "samples") ? read_integer(command, "samples", 2, 1000000) : 300;
  setting.seed = static_cast<std::uint64_t>(has(command, "seed") ? read_integer(command, "seed", 0, kMostIds) : 1);
  setting.jobs = options_.study_jobs;
  setting.rules = options_.session.rules;
  setting.version = options_.session.steering.run.program_version;
  session->ask(
      [this, client, id, setting, with_edits](Session& s) {
        if (s.steering() == nullptr) {
          client->answer(id,
                         dump(make_error(id, describe_error(InputError("E930", "there is no plan that can be run")))));
          return;
        }
        // of the active branch: the plan it began from, with its edits
        const collapse::LiveModel& live = s.steering()->steering().active().run().model();
        collapse::BranchPlan branch;
        if (with_edits)
          branch = collapse::write_branch_plan(live);
        else
          branch.text = live.plan().text;
        const std::string path = live.plan().path;
        run_errand([this, client, id, setting, branch, path]() mutable {
          const std::string& text = branch.text;
          try {
            std::vector<Diagnostic> warnings;
            const product::Plan plan = product::read_plan(text, path, warnings);
            int number = 0;
            std::shared_ptr<StudyTask> ended;  // let go without the lock: it waits for its thread
            {
              const std::lock_guard lock(mutex_);
              if (studies_.size() >= kMostStudies) {
                const auto oldest = std::find_if(studies_.begin(), studies_.end(), [](const auto& one) {
                  return one.second->describe()["state"] != "running";
                });
                if (oldest == studies_.end())
                  throw InputError("E905", fmt::format("{} studies are running", kMostStudies),
                                   "cancel one, or wait until one has ended");
                ended = std::move(oldest->second);
                study_watchers_.erase(oldest->first);
                studies_.erase(oldest);
              }
              number = ++last_study_;
            }
            ended.reset();
            // the same plan, limit and seed go on where they were
            setting.folder = (fs::path(options_.session.folder) /
                              ("study-" + calc_sha256(text + std::to_string(setting.seed)).substr(0, 12)))
                                 .string();
            auto study = std::make_shared<StudyTask>(
                number, plan, setting,
                [this, number](const Json& state, const Json& samples) { tell_study(number, state, samples); });
            {
              const std::lock_guard lock(mutex_);
              studies_[number] = study;
              study_watchers_[number].push_back(client);
            }
            client->answer(id, dump(make_ack(id, {{"study", number},
                                                  {"taken", branch.taken},
                                                  {"left_out", branch.left_out},
                                                  {"state", study->describe()}})));
          } catch (const InputError& e) {
            client->answer(id, dump(make_error(id, describe_error(e))));
          } catch (const std::exception& e) {
            client->answer(id, dump(make_error(id, describe_error(InputError("E940", e.what())))));
          }
        });
      },
      client, id);
}

void Hub::play_sample(const std::shared_ptr<Client>& client, std::int64_t id, const Json& command,
                      const std::shared_ptr<Session>& session) {
  check_keys(command, {"study", "sample", "name"});
  const int number = read_integer(command, "study", 1, kMostIds);
  const auto study = find_study(number);
  if (!study) throw InputError("E920", fmt::format("there is no study {}", number));
  const int sample = read_integer(command, "sample", 0, kMostIds);
  const std::vector<double> inputs = study->inputs_of(sample);
  Json action{{"command", "sample"},
              {"name", read_text(command, "name", fmt::format("sample {} of study {}", sample, number))},
              {"inputs", inputs},
              {"words", study->words_of(sample)}};
  // of the plan that the study was of
  action["text"] = study->plan().text;
  session->post(client, id, std::move(action));
}

Reply Hub::write_record(const JudgedBranch& judged, const std::string& what) const {
  const record::Record& r = judged.record;
  if (what == "record.json") return {200, "application/json", record::to_report_json(r), ""};
  if (what == "report.html")
    return {200, "text/html; charset=utf-8", record::make_page(record::to_report_json(r), options_.report),
            "report.html"};
  if (what == "findings") return {200, "application/json", dump(describe_findings(judged)), ""};
  return {200, "application/x-hdf5", record::to_hdf5(r), "record.h5"};
}

void Hub::get(const std::string& path, std::function<void(Reply)> answer) {
  if (path == "/" || path.empty()) {
    if (options_.page.empty())
      return answer(
          make_error_reply(404, "E903", "the steering page is not built", "run `npm ci && npm run build` in web/"));
    return answer({200, "text/html; charset=utf-8", options_.page, ""});
  }
  const std::vector<std::string> parts = split(path);
  const std::size_t n = parts.size();
  if (parts[0] != "api" || n < 2) return answer(make_nothing("there is nothing at " + path));
  if (n == 2 && parts[1] == "server")
    return answer({200, "application/json",
                   dump({{"protocol", 1},
                         {"program", "topple"},
                         {"version", options_.session.steering.run.program_version},
                         {"limits", {{"message", kMostText}, {"sessions", options_.most_sessions}}},
                         {"sessions", list_sessions()}}),
                   ""});
  if (n == 2 && parts[1] == "templates") return answer({200, "application/json", dump(list_templates()), ""});
  if (n == 2 && parts[1] == "sessions")
    return answer({200, "application/json", dump({{"sessions", list_sessions()}}), ""});
  if (n == 2 && parts[1] == "plans")
    return run_errand([this, answer = std::move(answer)] {
      answer({200, "application/json", dump(list_plans()), ""});
    });
  if (n == 4 && parts[1] == "studies") {
    const auto id = read_id(parts[2]);
    const auto study = id ? find_study(*id) : nullptr;
    if (!study) return answer(make_nothing("there is no such study"));
    const bool is_page = parts[3] == "study.html";
    if (parts[3] != "results.json" && !is_page) return answer(make_nothing("there is nothing at " + path));
    if (is_page && options_.study.empty())
      return answer(
          make_error_reply(404, "E903", "the page of studies is not built", "run `npm ci && npm run build` in web/"));
    return run_errand([this, study, is_page, answer = std::move(answer)] {
      try {
        if (is_page)
          return answer(
              {200, "text/html; charset=utf-8", record::make_page(study->page_json(), options_.study), "study.html"});
        answer({200, "application/json", study->results_json(), ""});
      } catch (const std::exception& e) { answer(make_nothing(e.what())); }
    });
  }
  if (parts[1] != "sessions" || n < 3) return answer(make_nothing("there is nothing at " + path));
  const auto id = read_id(parts[2]);
  const auto session = id ? find_session(*id) : nullptr;
  if (!session) return answer(make_nothing("there is no such session"));
  const auto in_session = [&](std::function<Reply(Session&)> make) {
    session->ask([make = std::move(make), answer = std::move(answer)](Session& s) {
      try {
        answer(make(s));
      } catch (const InputError& e) {
        const std::string& code = e.first_error().code;
        answer(make_error_reply(code == "E920" ? 404 : 409, code, e.first_error().message));
      }
    });
  };
  if (n == 3) return in_session([](Session& s) { return Reply{200, "application/json", dump(s.describe()), ""}; });
  if (n == 4 && parts[3] == "plan")
    return in_session([](Session& s) {
      std::string text = s.plan().text;
      try {
        if (!s.plan().path.empty()) text = read_file(s.plan().path);
      } catch (const std::exception&) {
        // gone: as it was read
      }
      return Reply{200, "text/plain; charset=utf-8", text, ""};
    });
  if (n == 4 && parts[3] == "log")
    return in_session([](Session& s) {
      std::string text;
      for (const std::string& line : s.log_lines()) text += line + "\n";
      return Reply{200, "application/jsonl", text, "steer.jsonl"};
    });
  const auto branch = n == 6 && parts[3] == "branches" ? read_id(parts[4]) : std::nullopt;
  if (!branch) return answer(make_nothing("there is nothing at " + path));
  const std::string& what = parts[5];
  if (what == "plan")
    return in_session([b = *branch](Session& s) {
      if (s.steering() == nullptr) throw InputError("E930", "the model is being built");
      return Reply{200, "text/plain; charset=utf-8", s.steering()->steering().branch(b).run().model().plan().text, ""};
    });
  if (what != "findings" && what != "record.json" && what != "record.h5" && what != "report.html")
    return answer(make_nothing("there is nothing at " + path));
  if (what == "report.html" && options_.report.empty())
    return answer(
        make_error_reply(404, "E903", "the report page is not built", "run `npm ci && npm run build` in web/"));
  // the record is copied in the session's thread, judged in that of its records, written elsewhere
  session->ask([this, b = *branch, what, answer = std::move(answer)](Session& s) {
    RecordRequest request;
    request.branches = {b};
    request.refuse = [answer](const InputError& e) {
      const std::string& code = e.first_error().code;
      answer(make_error_reply(code == "E920" ? 404 : 409, code, e.first_error().message));
    };
    request.use = [this, what, answer](const JudgedBranches& judged) {
      run_errand([this, judged, what, answer] {
        try {
          answer(write_record(judged->front(), what));
        } catch (const std::exception& e) { answer(make_error_reply(500, "E940", e.what())); }
      });
    };
    s.want_records(std::move(request));
  });
}

}  // namespace topple::server
