#include "server/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "base/file.h"
#include "base/hash.h"
#include "collapse/edit_json.h"
#include "product/plan_sampler.h"
#include "study/plan_mapping.h"

namespace topple::server {

using collapse::Branch;
using collapse::Steering;

namespace {

constexpr std::size_t kMostEvents = 4096;
constexpr double kFrameInterval = 1.0 / 60, kStateInterval = 0.1, kReachedInterval = 1, kLookInterval = 1;  // [s]

double since(std::chrono::steady_clock::time_point t) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - t).count();
}

/// Of a study's sample, which ends as long after its last stage as runs of the study do.
product::Plan make_sample_plan(const product::Plan& base, const std::vector<double>& inputs) {
  product::Plan plan = product::make_sample(product::make_sampler(base), inputs);
  plan.analysis.duration = (plan.stages.empty() ? 0 : plan.stages.back().time) + study::find_after(base);
  return plan;
}

}  // namespace

std::string log_path(const std::string& folder, const std::string& plan_path) {
  if (folder.empty()) return {};
  const std::string stem = plan_path.empty() ? "plan" : std::filesystem::path(plan_path).stem().string();
  return (std::filesystem::path(folder) / (stem + ".steer.jsonl")).string();
}

Session::Session(int id, SessionPlan plan, const SessionSetting& setting)
    : id_(id), plan_(std::move(plan)), setting_(setting) {
  const auto now = Clock::now();
  last_state_ = last_frame_ = last_reached_ = last_look_ = rate_start_ = speed_start_ = command_at_ = now;
  file_sha256_ = calc_sha256(plan_.text);
  brief_ = {{"id", id_}, {"title", plan_.title}, {"path", plan_.path}, {"phase", phase_word()}};
  records_.emplace([this] {
    ask([](Session& s) {
      if (s.steering_) s.records_->serve(s.core());
    });
  });
  thread_ = std::thread([this] { work(); });
}

Session::~Session() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  wakes_.notify_all();
  thread_.join();
  records_.reset();
  const Json over = describe_error(InputError("E920", "the session was closed"));
  for (const Task& t : tasks_)
    if (t.client) t.client->answer(t.id, dump(make_error(t.id, over)));
}

void Session::post(std::shared_ptr<Client> client, std::int64_t id, Json command) {
  {
    const std::lock_guard lock(mutex_);
    tasks_.push_back({std::move(client), id, std::move(command), {}});
  }
  wakes_.notify_all();
}

Json Session::brief() const {
  const std::lock_guard lock(mutex_);
  return brief_;
}

void Session::ask(std::function<void(Session&)> call, std::shared_ptr<Client> client, std::int64_t id) {
  {
    const std::lock_guard lock(mutex_);
    tasks_.push_back({std::move(client), id, {}, std::move(call)});
  }
  wakes_.notify_all();
}

std::vector<std::shared_ptr<Client>> Session::watchers() const {
  const std::lock_guard lock(watch_mutex_);
  std::vector<std::shared_ptr<Client>> list;
  for (const auto& weak : clients_)
    if (auto c = weak.lock()) list.push_back(std::move(c));
  return list;
}

void Session::tell(Json event) {
  std::vector<std::shared_ptr<Client>> list;
  std::shared_ptr<const std::string> text;
  {
    const std::lock_guard lock(watch_mutex_);
    Json whole{{"type", event["type"]}, {"session", id_}, {"seq", ++seq_}};
    for (auto& [key, value] : event.items())
      if (key != "type") whole[key] = std::move(value);
    text = std::make_shared<const std::string>(dump(whole));
    events_.emplace_back(seq_, text);
    if (events_.size() > kMostEvents) events_.pop_front();
    for (const auto& weak : clients_)
      if (auto c = weak.lock()) list.push_back(std::move(c));
  }
  for (const auto& c : list) c->send(text);
}

void Session::tell_branch(const Branch& b) {
  tell({{"type", "branch"},
        {"branch", describe_branch(steering_->steering(), b, b.run().record().provenance.plan_sha256)}});
}

void Session::leave(const Client* client) {
  const std::lock_guard lock(watch_mutex_);
  std::erase_if(clients_, [client](const auto& weak) {
    const auto c = weak.lock();
    return !c || c.get() == client;
  });
}

void Session::welcome(const std::shared_ptr<Client>& client, std::optional<long> after) {
  leave(client.get());
  client->session = id_;
  const std::lock_guard lock(watch_mutex_);
  const bool is_known =
      after && *after <= seq_ && (events_.empty() ? *after == seq_ : *after >= events_.front().first - 1);
  Json hello =
      is_known ? Json{{"type", "resumed"}, {"session", id_}, {"seq", seq_}, {"from", *after}} : make_hello(*client);
  client->send(std::make_shared<const std::string>(dump(hello)));
  if (is_known)
    for (const auto& [seq, text] : events_)
      if (seq > *after) client->send(text);
  clients_.push_back(client);
}

Json Session::make_hello(const Client& client) const {
  Json hello{
      {"type", "hello"},          {"protocol", 1}, {"program", "topple " + setting_.steering.run.program_version},
      {"resume", client.token()}, {"seq", seq_},   {"session", describe()}};
  hello["scene"] = nullptr;
  hello["frame"] = nullptr;
  if (steering_) {
    const Branch& b = steering_->steering().active();
    hello["scene"] = make_scene(b);
    if (b.frames() > 0) hello["frame"] = 0;
  }
  hello["plan"] = {{"text", plan_.text}, {"path", plan_.path}, {"sha256", calc_sha256(plan_.text)}};
  hello["limits"] = {
      {"message", 2 << 20}, {"frames", 4000}, {"frame_rate", 60}, {"snapshots", setting_.steering.moment_bytes}};
  hello["state"] = last_state_told_;
  return hello;
}

std::string Session::phase_word() const {
  switch (phase_) {
    case Phase::Building:
      return "building";
    case Phase::Equilibrium:
      return "equilibrium";
    case Phase::Paused:
      return "paused";
    case Phase::Running:
      return "running";
    case Phase::Finished:
      return "finished";
    case Phase::Failed:
      return "failed";
  }
  return "";
}

Json Session::describe() const {
  Json j{{"id", id_},
         {"title", steering_ ? steering_->steering().active().run().model().plan().title : plan_.title},
         {"path", plan_.path},
         {"phase", phase_word()}};
  j["active"] = steering_ ? Json(steering_->steering().active().id) : Json(nullptr);
  j["cursor"] =
      steering_ && !steering_->steering().cursor().is_live ? Json(steering_->steering().cursor_time()) : Json(nullptr);
  j["speed"] = speed_ ? Json(*speed_) : Json(nullptr);
  j["fuzzy"] = checked_plan_ && !checked_plan_->fuzzy.inputs.empty();
  j["log"] = steering_ ? steering_->path() : "";
  j["earlier"] = nullptr;
  if (earlier_ && is_untouched())
    j["earlier"] = {{"log", std::filesystem::path(earlier_->path).filename().string()},
                    {"created", earlier_->created},
                    {"actions", earlier_->actions},
                    {"branches", earlier_->branches},
                    {"time", earlier_->time}};
  Json& branches = j["branches"] = Json::array();
  if (steering_)
    for (const auto& b : steering_->steering().branches())
      branches.push_back(describe_branch(steering_->steering(), *b, b->run().record().provenance.plan_sha256));
  j["diagnostics"] = describe_diagnostics(diagnostics_);
  return j;
}

void Session::want_records(RecordRequest request) {
  try {
    const Steering& s = core();
    records_->ask(std::move(request));
    records_->serve(s);
  } catch (const InputError& e) { request.refuse(e); }
}

void Session::answer_from_records(const Task& task, std::vector<int> branches,
                                  std::function<Json(const JudgedBranches&)> make) {
  RecordRequest request;
  request.branches = std::move(branches);
  request.refuse = [client = task.client, id = task.id](const InputError& e) {
    client->answer(id, dump(make_error(id, describe_error(e))));
  };
  request.use = [client = task.client, id = task.id, make = std::move(make)](const JudgedBranches& judged) {
    std::string text;
    try {
      text = dump(make_ack(id, make(judged)));
    } catch (const std::exception& e) { text = dump(make_error(id, describe_error(InputError("E940", e.what())))); }
    client->answer(id, std::move(text));
  };
  want_records(std::move(request));
}

std::vector<std::string> Session::log_lines() const {
  return steering_ ? steering_->lines() : std::vector<std::string>{};
}

namespace {

/// Bodies of a piece's record that are those of the branch, and poses of the branch's others: charges may have been
/// added since, whose debris is the branch's alone.
std::pair<std::size_t, std::vector<Pose>> find_bodies(const Branch& b, const collapse::Piece& piece, double time) {
  if (piece.run.get() == &b.run()) return {piece.run->record().bodies.size(), {}};
  const collapse::LiveModel& live = b.run().model();
  std::vector<Pose> debris;
  for (const collapse::DebrisEntry& d : live.map().debris)
    debris.push_back(collapse::calc_debris_pose(d, norm(live.model().gravity), time));
  return {live.model().bodies.size(), std::move(debris)};
}

}  // namespace

std::shared_ptr<FrameBody> Session::make_frame(const Branch& b, std::size_t frame) const {
  const auto [piece, row] = b.find_frame(frame);
  const record::Record& r = piece->run->record();
  const auto [bodies, debris] = find_bodies(b, *piece, r.time[row]);
  auto body = std::make_shared<FrameBody>(make_frame_body(r, row, bodies, debris));
  body->session = static_cast<std::uint32_t>(id_);
  body->branch = static_cast<std::uint32_t>(b.id);
  body->frame = static_cast<std::uint32_t>(frame);
  return body;
}

Json Session::make_scene(const Branch& b) const {
  const record::Record& own = b.run().record();
  if (b.frames() == 0) return describe_scene(own, own, 0, {});
  const collapse::Piece& first = *b.find_frame(0).first;
  const auto [bodies, debris] = find_bodies(b, first, first.run->record().time[0]);
  return describe_scene(own, first.run->record(), bodies, debris);
}

void Session::send_frame(const std::shared_ptr<const FrameBody>& body) {
  for (const auto& c : watchers())
    if (const auto o = c->outlet()) (void)o->offer(body, kLiveFrame);
}

void Session::publish_frame(bool is_due) {
  if (!steering_) return;
  const Branch& b = steering_->steering().active();
  const std::size_t n = b.frames();
  if (n == 0 || (frame_branch_ == b.id && frame_starts_ == b.starts && frame_sent_ == n)) return;
  if (!is_due && since(last_frame_) < kFrameInterval) return;
  last_frame_ = Clock::now();
  frame_sent_ = n;
  frame_branch_ = b.id;
  frame_starts_ = b.starts;
  if (!watchers().empty()) send_frame(make_frame(b, n - 1));
}

void Session::publish_state(bool is_due) {
  if (!is_due && since(last_state_) < kStateInterval) return;
  Json s{{"type", "state"}, {"phase", phase_word()}};
  double time = 0;
  if (steering_) {
    const Steering& core = steering_->steering();
    const Branch& b = core.active();
    const double duration = b.run().model().plan().analysis.duration;
    time = b.frontier();
    s["branch"] = b.id;
    s["time"] = time;
    s["frames"] = b.frames();
    s["cursor"] = core.cursor().is_live ? Json(nullptr) : Json(core.cursor_time());
    s["duration"] = duration;
    const double wall = since(rate_start_);
    if (wall > 0.5) {
      rate_ = phase_ == Phase::Running && time > rate_time_ ? (time - rate_time_) / wall : 0;
      rate_time_ = time;
      rate_start_ = Clock::now();
    }
    const bool has_rate = phase_ == Phase::Running && rate_ > 0;
    s["real_time_factor"] = has_rate ? Json(rate_) : Json(nullptr);
    s["eta"] = has_rate ? Json(std::max(0.0, duration - time) / rate_) : Json(nullptr);
    s["ending"] = nullptr;
    if (b.run().has_ended()) s["ending"] = describe_branch(core, b, "")["ending"];
  } else {
    for (const char* key : {"branch", "time", "frames", "cursor", "duration", "real_time_factor", "eta"})
      s[key] = nullptr;
    s["ending"] = nullptr;
  }
  if (!failure_.empty()) s["ending"] = {{"kind", failure_kind_}, {"text", failure_}};
  if (!failure_.empty() && !failure_code_.empty()) s["ending"]["code"] = failure_code_;
  s["speed"] = speed_ ? Json(*speed_) : Json(nullptr);
  s["progress"] = progress_ ? Json(*progress_) : Json(nullptr);
  last_state_ = Clock::now();
  if (s == last_state_told_) return;
  last_state_told_ = s;
  {
    const std::lock_guard lock(mutex_);
    brief_["phase"] = phase_word();
    if (steering_) brief_["title"] = steering_->steering().active().run().model().plan().title;
  }
  tell(std::move(s));
}

void Session::publish_zones() {
  if (!steering_) return;
  const Branch& b = steering_->steering().active();
  for (const auto& c : watchers()) {
    if (c->zone < 0 || c->zone_branch != b.id || c->zone_frame >= b.frames()) continue;
    if (!c->outlet()) continue;  // it may come back, and hears then what it missed
    Json points = Json::array();
    const auto zone = static_cast<std::size_t>(c->zone.load());
    for (std::size_t f = c->zone_frame; f < b.frames(); ++f) {
      const auto [piece, row] = b.find_frame(f);
      const collapse::LiveRun& run = *piece->run;
      const record::Record& r = run.record();
      const std::size_t Z = r.zones.size(),
                        E = run.model().model().elements.size() + run.model().model().rotational_elements.size();
      if (zone >= Z) continue;
      Json point{r.time[row]};
      for (std::size_t i = 0; i < collapse::kZonePath; ++i)
        point.push_back(zone < E && !run.zone_path().empty()
                            ? number(run.zone_path()[(row * E + zone) * collapse::kZonePath + i])
                            : Json(nullptr));
      point.push_back(number(r.zone_utilisation[row * Z + zone]));
      point.push_back(r.zone_state[row * Z + zone]);
      points.push_back(std::move(point));
    }
    c->zone_frame = b.frames();
    const Json event{{"type", "zone"},
                     {"session", id_},
                     {"branch", b.id},
                     {"zone", b.run().record().zones[zone].name},
                     {"points", points}};
    c->send(std::make_shared<const std::string>(dump(event)));
  }
}

void Session::look_at_file() {
  if (plan_.path.empty() || since(last_look_) < kLookInterval) return;
  last_look_ = Clock::now();
  try {
    const std::string sha = calc_sha256(read_file(plan_.path));
    if (sha == file_sha256_) return;
    file_sha256_ = sha;
    tell({{"type", "plan_changed"}, {"sha256", sha}});
  } catch (const std::exception&) {
    // it may be under way to its place
  }
}

collapse::SteeringCallbacks Session::make_callbacks() {
  collapse::SteeringCallbacks callbacks;
  callbacks.on_branch = [this](const Branch& b) {
    if (steering_) tell_branch(b);
  };
  callbacks.on_event = [this](const Branch& b, const record::Event& e) {
    if (steering_) tell({{"type", "happenings"}, {"branch", b.id}, {"events", {describe_event(e)}}});
  };
  callbacks.on_frame = [this](const Branch&, std::size_t) { publish_frame(false); };
  return callbacks;
}

void Session::build(const product::Plan& plan) {
  const std::string path = log_path(setting_.folder, plan_.path);
  std::error_code ignored;
  if (!path.empty()) std::filesystem::create_directories(setting_.folder, ignored);
  if (!path.empty() && !earlier_)
    earlier_ = collapse::find_earlier_log(path, calc_sha256(plan.text), setting_.knowledge, setting_.steering.run);
  steering_ = std::make_unique<collapse::LoggedSteering>(plan, setting_.knowledge, setting_.steering, make_callbacks(),
                                                         path, make_sample_plan);
  steering_->on_line = [this](const std::string& line) { tell({{"type", "log"}, {"entry", Json::parse(line)}}); };
  begin_branch();
}

bool Session::is_untouched() const {
  return steering_ != nullptr && steering_->lines().size() == 1 && steering_->steering().active().steps() == 0;
}

void Session::build_from_log(const std::string& path) {
  const std::string text = read_file(path);
  Progress progress;
  progress.cancel = &closing_;
  progress.report = [this](double done, double whole) {
    progress_ = whole > 0 ? done / whole : 0;
    publish_state(false);
  };
  collapse::ReplayResult again;
  try {
    again =
        collapse::replay(text, std::filesystem::path(path).filename().string(), setting_.knowledge, setting_.steering,
                         make_sample_plan, progress, make_callbacks(), log_path(setting_.folder, plan_.path));
  } catch (...) {
    progress_.reset();
    throw;
  }
  progress_.reset();
  steering_ = std::move(again.steering);
  steering_->steering().go_live();
  steering_->on_line = [this](const std::string& line) { tell({{"type", "log"}, {"entry", Json::parse(line)}}); };
  earlier_.reset();
  begin_branch();
}

Json Session::go_on_from_log(const Json& command) {
  collapse::check_keys(command, {});
  (void)core();
  if (!earlier_) throw InputError("E930", "there is no earlier session of this plan to go on with");
  if (!is_untouched())
    throw InputError("E930", "this session has begun already", "start again, and go on before anything else");
  // the log that this session has begun holds nothing
  const std::string own = steering_->path(), path = earlier_->path;
  phase_ = Phase::Building;
  records_->cancel();
  steering_.reset();
  std::error_code ignored;
  if (!own.empty()) std::filesystem::remove(own, ignored);
  publish_state(true);
  try {
    build_from_log(path);
  } catch (...) {
    earlier_.reset();
    build(*checked_plan_);
    for (const auto& c : watchers()) welcome(c);
    throw;
  }
  for (const auto& c : watchers()) welcome(c);
  return {{"branch", core().active().id}, {"time", core().active().frontier()}};
}

void Session::begin_branch() {
  Branch& b = core().active();
  phase_ = Phase::Equilibrium;
  failure_.clear();
  publish_state(true);
  core().begin(b);
  settle_phase();
  publish_frame(true);
  publish_state(true);
}

/// Paused, or what the active branch's end says.
void Session::settle_phase() {
  const collapse::LiveRun& run = core().active().run();
  phase_ = Phase::Paused;
  failure_.clear();
  if (!run.has_ended()) return;
  const mbs::Summary s = run.summary();
  using Ending = mbs::Summary::Ending;
  phase_ = Phase::Finished;
  if (s.ending != Ending::NoEquilibrium && s.ending != Ending::Diverged) return;
  phase_ = Phase::Failed;
  failure_kind_ = s.ending == Ending::Diverged ? "diverged" : "no_equilibrium";
  failure_code_.clear();
  failure_ = s.message;
}

void Session::fail_to_build(const char* kind, const InputError& why) {
  steering_.reset();
  phase_ = Phase::Failed;
  failure_kind_ = kind;
  failure_code_ = why.first_error().code;
  failure_ = why.first_error().message;
  diagnostics_ = why.diagnostics();
  publish_state(true);
}

void Session::pause() {
  until_.reset();
  frames_left_ = steps_left_ = -1;
  if (phase_ != Phase::Running) return;
  settle_phase();
  steering_->note_reached();
  publish_frame(true);
  publish_zones();
  publish_state(true);
}

void Session::advance_chunk() {
  Steering& s = core();
  const auto begin = Clock::now();
  double wait = 0;  // until the speed that is asked for allows the next step [s]
  while (phase_ == Phase::Running) {
    if (speed_) {
      const double allowed = speed_time_ + *speed_ * since(speed_start_);
      wait = (s.active().frontier() - allowed) / *speed_;
      if (wait > 0) break;
    }
    const std::size_t frames = s.active().frames();
    const bool goes_on = s.advance();
    const bool has_frame = s.active().frames() != frames;
    if (has_frame && frames_left_ > 0) --frames_left_;
    if (steps_left_ > 0) --steps_left_;
    if (!goes_on || frames_left_ == 0 || steps_left_ == 0 || (until_ && s.active().frontier() >= *until_)) {
      if (!goes_on) tell_branch(s.active());
      pause();
      return;
    }
    if (since(begin) >= setting_.chunk) break;
  }
  publish_frame(false);
  publish_state(false);
  if (since(last_reached_) >= kReachedInterval) {
    last_reached_ = Clock::now();
    steering_->note_reached();
  }
  if (wait > 0) {
    std::unique_lock lock(mutex_);
    if (tasks_.empty() && !closing_) wakes_.wait_for(lock, std::chrono::duration<double>(std::min(0.02, wait)));
  }
}

void Session::work() {
  try {
    publish_state(true);
    std::vector<Diagnostic> warnings;
    checked_plan_ = product::read_plan(plan_.text, plan_.path.empty() ? plan_.title : plan_.path, warnings);
    diagnostics_ = warnings;
    build(*checked_plan_);
    if (plan_.goes_on && earlier_) {
      try {
        (void)go_on_from_log(Json::object());
      } catch (const InputError& e) { diagnostics_.push_back(e.first_error()); }
    }
  } catch (const InputError& e) { fail_to_build("plan", e); } catch (const std::exception& e) {
    fail_to_build("failed", InputError("E940", e.what()));
  }
  for (auto last_zones = Clock::now();;) {
    std::deque<Task> tasks;
    {
      std::unique_lock lock(mutex_);
      if (tasks_.empty() && !closing_ && phase_ != Phase::Running)
        wakes_.wait_for(lock, std::chrono::duration<double>(kLookInterval));
      if (closing_) break;
      tasks.swap(tasks_);
    }
    for (Task& t : tasks) {
      if (t.call) {
        t.call(*this);
        continue;
      }
      Json answer;
      try {
        std::optional<Json> result = perform(t);
        if (!result) continue;
        answer = make_ack(t.id, std::move(*result));
      } catch (const Conflict& e) {
        answer = make_error(t.id, describe_error(e));
        answer["error"]["sha256"] = e.sha256;
        answer["error"]["text"] = e.text;
      } catch (const InputError& e) { answer = make_error(t.id, describe_error(e)); } catch (const std::exception& e) {
        answer = make_error(t.id, describe_error(InputError("E940", e.what())));
      }
      t.client->answer(t.id, dump(answer));
    }
    try {
      if (phase_ == Phase::Running) advance_chunk();
    } catch (const std::exception& e) {
      phase_ = Phase::Failed;
      failure_kind_ = "failed";
      failure_code_ = "E940";
      failure_ = e.what();
      publish_state(true);
    }
    if (since(last_zones) > kStateInterval) {
      last_zones = Clock::now();
      publish_zones();
    }
    look_at_file();
  }
  // how far it came, for the log
  if (steering_) {
    try {
      steering_->note_reached();
    } catch (const std::exception&) {
      // the disk may be full; the session ends anyway
    }
  }
}

}  // namespace topple::server
