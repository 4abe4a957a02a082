/// The commands of a session (docs/protocol.md).

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "base/file.h"
#include "base/hash.h"
#include "collapse/branch_plan.h"
#include "collapse/edit_json.h"
#include "server/judged_branch.h"
#include "server/session.h"

namespace topple::server {

using collapse::Branch;
using collapse::check_keys;
using collapse::read_flag;
using collapse::read_integer;
using collapse::read_number;
using collapse::read_text;
using collapse::Steering;

namespace {

constexpr int kMostIds = 1 << 30;
constexpr int kMostCompared = 10000;  // instants
constexpr std::size_t kMostFrames = 4000, kMostFrameBytes = std::size_t{32} << 20;

bool has(const Json& command, const char* key) {
  const auto it = command.find(key);
  return it != command.end() && !it->is_null();
}

std::vector<std::string> command_words() {
  std::vector<std::string> words = collapse::edit_words();
  for (const char* w :
       {"run",          "pause",        "step",           "speed",         "rewind",           "live",
        "undo",         "branch",       "rename",         "switch",        "compare",          "scene",
        "frames",       "findings",     "series",         "zone",          "member",           "log",
        "plan.apply",   "plan.save",    "plan.text",      "plan.check",    "plan.import",      "ping",
        "session.list", "session.open", "session.attach", "session.close", "session.continue", "study.start",
        "study.list",   "study.watch",  "study.unwatch",  "study.cancel",  "study.play"})
    words.emplace_back(w);
  return words;
}

}  // namespace

Steering& Session::core() const {
  if (!steering_ && phase_ == Phase::Failed && failure_kind_ != "plan")
    throw InputError(failure_code_, failure_, "apply the plan again when that is mended");
  if (!steering_)
    throw InputError("E930", phase_ == Phase::Failed ? "the plan cannot be run as it is" : "the model is being built",
                     phase_ == Phase::Failed ? "mend the plan's text and apply it" : "wait for the phase \"paused\"");
  return steering_->steering();
}

Branch& Session::branch_of(const Json& command) const {
  return has(command, "branch") ? core().branch(read_integer(command, "branch", 1, kMostIds)) : core().active();
}

std::optional<Json> Session::perform(const Task& task) {
  const Json& command = task.command;
  Client& client = *task.client;
  const std::string word = read_text(command, "command");
  if (word == "run" || word == "pause" || word == "step" || word == "speed" || word == "rewind" || word == "live")
    return run_clock(word, command);
  if (word == "plan.apply" && !steering_) {
    check_keys(command, {"text", "name"});
    std::vector<Diagnostic> warnings;
    const product::Plan plan = product::read_plan(read_text(command, "text"), plan_.path, warnings);
    phase_ = Phase::Building;
    publish_state(true);
    try {
      build(plan);
    } catch (const InputError& e) {
      fail_to_build("plan", e);
      throw;
    } catch (const std::exception& e) {
      fail_to_build("failed", InputError("E940", e.what()));
      throw;
    }
    checked_plan_ = plan;
    diagnostics_ = warnings;
    for (const auto& c : watchers()) welcome(c);
    return Json{{"branch", 1}};
  }
  if (word == "session.continue") return go_on_from_log(command);
  if (collapse::LoggedSteering::is_action(word)) return change(word, command);
  if (word == "scene") {
    check_keys(command, {});
    return Json{{"scene", make_scene(branch_of(command))}};
  }
  if (word == "frames") return send_frames(client, command);
  if (word == "series") return read_series(command);
  if (word == "compare") {
    check_keys(command, {"a", "b", "frames"});
    const int count = has(command, "frames") ? read_integer(command, "frames", 2, kMostCompared) : kMostCompared;
    answer_from_records(task, {read_integer(command, "a", 1, kMostIds), read_integer(command, "b", 1, kMostIds)},
                        [count](const JudgedBranches& b) { return compare(b->front(), b->back(), count); });
    return std::nullopt;
  }
  if (word == "zone") return watch_zone(client, command);
  if (word == "member") {
    check_keys(command, {"member"});
    const product::Plan& plan = branch_of(command).run().model().plan();
    const int index = plan.find_member(read_text(command, "member"));
    // joints and pieces between members are none
    return Json{
        {"member", index < 0 ? Json(nullptr) : describe_member(plan, plan.members[static_cast<std::size_t>(index)])}};
  }
  if (word == "findings") {
    check_keys(command, {});
    answer_from_records(task, {branch_of(command).id},
                        [](const JudgedBranches& b) { return describe_findings(b->front()); });
    return std::nullopt;
  }
  if (word == "log") {
    check_keys(command, {"from"});
    const std::vector<std::string> lines = log_lines();
    const std::size_t from =
        has(command, "from") ? static_cast<std::size_t>(read_integer(command, "from", 0, kMostIds)) : 0;
    Json entries = Json::array();
    for (std::size_t i = from; i < lines.size(); ++i) entries.push_back(Json::parse(lines[i]));
    return Json{{"entries", std::move(entries)}};
  }
  if (word == "plan.text") {
    check_keys(command, {"edits"});
    if (!steering_) return Json{{"text", plan_.text}, {"sha256", calc_sha256(plan_.text)}, {"path", plan_.path}};
    const Branch& branch = branch_of(command);
    const collapse::LiveModel& live = branch.run().model();
    collapse::BranchPlan plan{live.plan().text, {}, {}};
    if (read_flag(command, "edits", false)) plan = collapse::write_branch_plan(live, branch.sample);
    return Json{{"text", plan.text},
                {"sha256", calc_sha256(plan.text)},
                {"path", plan_.path},
                {"taken", plan.taken},
                {"left_out", plan.left_out}};
  }
  if (word == "plan.save") return save_plan(command);
  const std::string near = nearest_name(word, command_words());
  throw InputError("E911", "there is no command \"" + word + "\"",
                   near.empty() ? "" : "did you mean \"" + near + "\"?");
}

Json Session::run_clock(const std::string& word, const Json& command) {
  Steering& s = core();
  if (has(command, "branch") && read_integer(command, "branch", 1, kMostIds) != s.active().id)
    throw InputError("E930", "the clock is that of the active branch", "switch to the branch first");
  const auto place = [&] {
    Json out{{"time", s.cursor_time()}};
    if (!s.cursor().is_live) out["frame"] = s.cursor().frame;
    publish_state(true);
    return out;
  };
  const auto start = [&] {
    if (phase_ == Phase::Failed || !s.active().run().has_begun())
      throw InputError("E930", "the branch cannot go on: " + failure_);
    if (s.active().run().has_ended())
      throw InputError("E930", "the branch has ended", "rewind, and branch or edit there");
    speed_start_ = rate_start_ = Clock::now();
    speed_time_ = rate_time_ = s.active().frontier();
    rate_ = 0;
    phase_ = Phase::Running;
    publish_state(true);
  };
  if (word == "run") {
    check_keys(command, {"until"});
    std::optional<double> until;
    if (has(command, "until")) until = read_number(command, "until");
    if (until && !(*until > s.active().frontier()))
      throw InputError(
          "E912", fmt::format("\"until\" must be later than {:.6g} s, where the branch is", s.active().frontier()));
    start();
    until_ = until;
    frames_left_ = steps_left_ = -1;
    return Json::object();
  }
  if (word == "step") {
    check_keys(command, {"frames", "steps"});
    if (has(command, "frames") && has(command, "steps")) throw InputError("E912", "step wants either frames or steps");
    const int steps = has(command, "steps") ? read_integer(command, "steps", 1, 1000000) : -1;
    const int frames = has(command, "frames") ? read_integer(command, "frames", 1, 100000) : steps > 0 ? -1 : 1;
    start();
    until_.reset();
    frames_left_ = frames;
    steps_left_ = steps;
    return Json::object();
  }
  if (word == "pause") {
    check_keys(command, {});
    pause();
    return {{"time", s.active().frontier()}};
  }
  if (word == "speed") {
    check_keys(command, {"factor"});
    speed_.reset();
    if (has(command, "factor")) {
      const double factor = read_number(command, "factor");
      if (!(factor >= 1e-4 && factor <= 1e4)) throw InputError("E912", "\"factor\" must be 0.0001 to 10000, or null");
      speed_ = factor;
    }
    speed_start_ = Clock::now();
    speed_time_ = s.active().frontier();
    publish_state(true);
    return Json::object();
  }
  if (word == "rewind") {
    check_keys(command, {"time", "frame"});
    if (has(command, "time") == has(command, "frame"))
      throw InputError("E912", "rewind wants either a time or a frame");
    if (has(command, "time"))
      s.rewind(read_number(command, "time"));
    else
      s.rewind_to_frame(static_cast<std::size_t>(read_integer(command, "frame", 0, kMostIds)));
    return place();
  }
  check_keys(command, {});
  s.go_live();
  return place();
}

Json Session::change(const std::string& word, Json command) {
  Steering& s = core();
  const bool is_edit = collapse::is_edit(word);
  if ((is_edit || word == "undo" || word == "branch") && has(command, "branch")) {
    if (read_integer(command, "branch", 1, kMostIds) != s.active().id)
      throw InputError("E930", "edits act on the active branch", "switch to the branch first");
    command.erase("branch");
  }
  const bool was_running = phase_ == Phase::Running;
  const collapse::Cursor cursor = s.cursor();
  if (word == "branch" && has(command, "time")) s.rewind(read_number(command, "time"));
  if (word == "switch" || word == "plan.apply" || word == "sample") pause();
  if (word == "plan.apply") {
    phase_ = Phase::Building;
    publish_state(true);
  }
  const int before = s.active().id;
  Steering::Made made;
  try {
    made = steering_->perform(command);
  } catch (...) {
    if (cursor.is_live)
      s.go_live();
    else
      s.rewind_to_frame(cursor.frame);
    if (!was_running || word == "plan.apply") settle_phase();
    if (was_running && word != "plan.apply") phase_ = Phase::Running;
    publish_state(true);
    throw;
  }
  if (word == "plan.apply" || word == "sample") {
    begin_branch();
  } else if (word != "rename") {
    settle_phase();
    if (was_running && word != "switch" && phase_ == Phase::Paused) phase_ = Phase::Running;
    if (s.active().id != before) {
      speed_start_ = rate_start_ = Clock::now();
      speed_time_ = rate_time_ = s.active().frontier();
      frames_left_ = steps_left_ = -1;
    }
    publish_frame(true);
    publish_state(true);
  }
  Json out{{"branch", made.branch->id}};
  if (is_edit) out["edit"] = {{"kind", word}, {"time", made.time}, {"text", made.text}};
  return out;
}

Json Session::send_frames(Client& client, const Json& command) const {
  check_keys(command, {"from", "count", "stride"});
  const Branch& b = branch_of(command);
  const auto from = static_cast<std::size_t>(read_integer(command, "from", 0, kMostIds));
  const auto count = static_cast<std::size_t>(read_integer(command, "count", 1, static_cast<int>(kMostFrames)));
  const auto stride = has(command, "stride") ? static_cast<std::size_t>(read_integer(command, "stride", 1, 100000)) : 1;
  const auto outlet = client.outlet();
  std::size_t sent = 0, bytes = 0;
  for (std::size_t f = from; f < b.frames() && sent < count && outlet; f += stride) {
    auto body = make_frame(b, f);
    bytes += body->bytes.size();
    const bool is_last = sent + 1 == count || f + stride >= b.frames() || bytes > kMostFrameBytes;
    (void)outlet->offer(std::move(body), kAskedFrame | (is_last ? kLastFrame : 0U));
    ++sent;
    if (is_last) break;
  }
  return {{"count", sent}, {"next", from + sent * stride}};
}

Json Session::read_series(const Json& command) const {
  check_keys(command, {"from"});
  const Branch& b = branch_of(command);
  const std::size_t from =
      has(command, "from") ? static_cast<std::size_t>(read_integer(command, "from", 0, kMostIds)) : 0;
  Json out{{"from", from}, {"time", Json::array()}, {"series", Json::array()}};
  for (const record::Series& s : b.run().record().series)
    out["series"].push_back({{"id", s.id}, {"value", Json::array()}});
  for (std::size_t f = from; f < b.frames(); ++f) {
    const auto [piece, row] = b.find_frame(f);
    const record::Record& r = piece->run->record();
    out["time"].push_back(r.time[row]);
    for (std::size_t i = 0; i < r.series.size(); ++i)
      out["series"][i]["value"].push_back(number(r.series[i].value[row]));
  }
  return out;
}

Json Session::watch_zone(Client& client, const Json& command) const {
  check_keys(command, {"zone"});
  client.zone = -1;
  if (!has(command, "zone")) return {{"zone", nullptr}};
  const Branch& b = branch_of(command);
  const std::string name = read_text(command, "zone");
  const std::vector<record::ZoneInfo>& zones = b.run().record().zones;
  const auto it = std::find_if(zones.begin(), zones.end(), [&](const record::ZoneInfo& z) { return z.name == name; });
  if (it == zones.end()) throw InputError("E920", "there is no zone \"" + name + "\"");
  const auto zone = static_cast<std::size_t>(it - zones.begin());
  const collapse::LiveModel& live = b.run().model();
  const int law = live.law_of_zone(zone);
  Json out{{"zone", name}};
  out["law"] = law < 0 ? Json(nullptr) : describe_law(live.model().laws[static_cast<std::size_t>(law)]);
  out["member"] = it->member;
  // the path so far comes as the first event
  client.zone_branch = b.id;
  client.zone_frame = 0;
  client.zone = static_cast<int>(zone);
  return out;
}

Json Session::save_plan(const Json& command) {
  check_keys(command, {"text", "base_sha256", "force", "path"});
  const std::string text = read_text(command, "text");
  std::string path = plan_.path;
  if (path.empty()) {
    // a plan from a template or from the page gets a name in the folder
    const std::string name = read_text(command, "path");
    const bool is_plain = !name.empty() && name.size() <= 80 && name.ends_with(".toml") && name.front() != '.' &&
                          std::all_of(name.begin(), name.end(), [](unsigned char c) {
                            return std::isalnum(c) || c == '-' || c == '_' || c == '.' || c == ' ';
                          });
    if (!is_plain)
      throw InputError("E912", "\"path\" must be the name of a file, such as mill.toml",
                       "letters, digits, blanks, -, _ and .");
    path = (std::filesystem::path(setting_.plans) / name).string();
    if (std::filesystem::exists(path) && !read_flag(command, "force", false))
      throw InputError("E941", name + " exists already", "give another name");
  } else {
    std::string disk;
    try {
      disk = read_file(path);
    } catch (const std::exception&) {
      // gone: it is written anew
      disk.clear();
    }
    const std::string sha = calc_sha256(disk);
    if (!disk.empty() && sha != read_text(command, "base_sha256", "") && !read_flag(command, "force", false)) {
      Diagnostic d;
      d.code = "E941";
      d.message = std::filesystem::path(path).filename().string() +
                  (has(command, "base_sha256") ? " has changed on the disk since"
                                               : " is on the disk, and no \"base_sha256\" says which one was read");
      d.help = "look at the difference; force writes over it";
      throw Conflict({d}, sha, disk);
    }
  }
  replace_file(path, text);
  plan_.path = path;
  plan_.text = text;
  file_sha256_ = calc_sha256(text);
  tell({{"type", "plan_changed"}, {"sha256", file_sha256_}});
  return {{"sha256", file_sha256_}, {"path", path}};
}

}  // namespace topple::server
