#include "collapse/action_log.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "base/error.h"
#include "base/hash.h"
#include "collapse/edit_json.h"
#include "record/provenance.h"

namespace topple::collapse {

namespace {

using Json = nlohmann::ordered_json;

std::string dump(const Json& j) { return j.dump(-1, ' ', false, Json::error_handler_t::replace); }

/// The values of the rules, so that a log made with others is not taken for the same.
std::string calc_rules_hash(const Knowledge& k) {
  std::string text;
  for (const Rule& r : k.rules) text += fmt::format("{}={:.17g};", r.id, r.value);
  return calc_sha256(text);
}

product::Plan read_quietly(const std::string& text, const std::string& path) {
  std::vector<Diagnostic> warnings;
  return product::read_plan(text, path, warnings);
}

int open_new(std::string& path) {
  const std::filesystem::path wanted(path);
  for (int n = 1; n < 100000; ++n) {
    const std::string name =
        n == 1
            ? path
            : (wanted.parent_path() / (wanted.stem().string() + "-" + std::to_string(n) + wanted.extension().string()))
                  .string();
    const int file = open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0644);
    if (file >= 0) {
      path = name;
      return file;
    }
    if (errno != EEXIST) break;
  }
  throw std::runtime_error(path + ": the action log cannot be written: " + std::strerror(errno));
}

}  // namespace

LoggedSteering::LoggedSteering(const product::Plan& plan, const Knowledge& k, SteeringOptions options,
                               SteeringCallbacks callbacks, const std::string& path, SamplePlan sample_plan)
    : k_(k), plan_(plan), sample_plan_(std::move(sample_plan)), path_(path) {
  const Json header{{"topple_log", 1},
                    {"program", "topple " + options.run.program_version},
                    {"created", record::now_utc()},
                    {"plan_path", plan.path},
                    {"plan_sha256", calc_sha256(plan.text)},
                    {"plan_text", plan.text},
                    {"rules_sha256", calc_rules_hash(k)},
                    {"frame_rate", options.run.frame_rate},
                    {"duration", options.run.duration},
                    {"step", options.run.step}};
  steering_ = std::make_unique<Steering>(k, std::move(options), std::move(callbacks));
  steering_->add_root(plan, "main");
  if (!path_.empty()) file_ = open_new(path_);
  write(header);
}

LoggedSteering::~LoggedSteering() {
  if (file_ >= 0) close(file_);
}

void LoggedSteering::write(const Json& entry) {
  const std::string line = dump(entry);
  if (file_ >= 0) {
    const std::string whole = line + "\n";
    size_t done = 0;
    while (done < whole.size()) {
      const ssize_t n = ::write(file_, whole.data() + done, whole.size() - done);
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) throw std::runtime_error(path_ + ": the action log cannot be written: " + std::strerror(errno));
      done += static_cast<size_t>(n);
    }
  }
  lines_.push_back(line);
  if (on_line) on_line(line);
}

bool LoggedSteering::is_action(const std::string& c) {
  return is_edit(c) || c == "branch" || c == "rename" || c == "switch" || c == "undo" || c == "plan.apply" ||
         c == "sample";
}

Steering::Made LoggedSteering::perform(const Json& command) {
  Steering& s = *steering_;
  const std::string word = read_text(command, "command");
  const int id = s.active().id;
  const long step = s.active().run().has_begun() ? s.cursor_step() : 0;
  const double time = s.active().run().has_begun() ? s.cursor_time() : 0;
  const Cursor cursor = s.cursor();
  Steering::Made made;
  if (is_edit(word)) {
    made = s.edit(read_edit(command), read_text(command, "name", ""), read_flag(command, "in_place", false));
  } else if (word == "branch") {
    check_keys(command, {"name", "time"});
    made = s.fork(read_text(command, "name", ""));
  } else if (word == "undo") {
    check_keys(command, {});
    made = s.undo();
  } else if (word == "rename") {
    check_keys(command, {"name"});
    const int which = command.contains("branch") ? read_integer(command, "branch", 1, 1 << 30) : id;
    s.rename(which, read_text(command, "name"));
    made.branch = &s.branch(which);
  } else if (word == "switch") {
    check_keys(command, {});
    note_reached();
    s.switch_to(read_integer(command, "branch", 1, 1 << 30));
    made.branch = &s.active();
  } else if (word == "plan.apply") {
    check_keys(command, {"text", "name"});
    made.branch = &s.add_root(read_quietly(read_text(command, "text"), plan_.path), read_text(command, "name", ""));
    made.text = "the plan from its start";
  } else if (word == "sample") {
    check_keys(command, {"name", "inputs", "words", "text"});
    if (!sample_plan_) throw InputError("E930", "samples cannot be played here");
    std::vector<double> inputs;
    if (!command.contains("inputs") || !command["inputs"].is_array())
      throw InputError("E912", "\"inputs\" must be numbers");
    for (const Json& x : command["inputs"]) inputs.push_back(x.is_number() ? x.get<double>() : std::nan(""));
    made.branch = &s.add_root(sample_plan_(read_quietly(read_text(command, "text"), plan_.path), inputs),
                              read_text(command, "name", ""));
    made.branch->sample = read_text(command, "words", "");
    made.text = "a sample from its start";
  } else {
    throw InputError("E911", "\"" + word + "\" is not an action");
  }
  Json entry{{"seq", ++seq_}, {"action", word}, {"branch", id}, {"step", step}, {"time", time}};
  if (!cursor.is_live) entry["frame"] = cursor.frame;
  entry["made"] = made.branch->id;
  entry["command"] = command;
  for (const char* key : {"id", "session"}) entry["command"].erase(key);
  write(entry);
  return made;
}

void LoggedSteering::note_reached() {
  const Branch& b = steering_->active();
  if (!b.run().has_begun()) return;
  const auto it = reached_.find(b.id);
  if (it != reached_.end() && it->second == b.steps()) return;
  reached_[b.id] = b.steps();
  write({{"seq", ++seq_}, {"action", "reached"}, {"branch", b.id}, {"step", b.steps()}, {"time", b.frontier()}});
}

ReplayResult replay(const std::string& log, const std::string& name, const Knowledge& k, SteeringOptions options,
                    const SamplePlan& sample_plan, const Progress& progress) {
  ReplayResult result;
  size_t at = 0;
  int line = 0;
  const auto fail = [&](const std::string& code, const std::string& message, const std::string& help = {}) {
    Diagnostic d;
    d.code = code;
    d.where = {name, line, 1};
    d.message = message;
    d.help = help;
    throw InputError({d});
  };
  while (at < log.size()) {
    const size_t end = log.find('\n', at);
    if (end == std::string::npos) {
      result.was_cut = true;
      break;
    }
    const std::string text = log.substr(at, end - at);
    at = end + 1;
    ++line;
    const Json entry = Json::parse(text, nullptr, false);
    if (!entry.is_object()) fail("E942", "this line is not a JSON object", "an action log is written by topple steer");
    try {
      if (line == 1) {
        if (!entry.contains("topple_log")) fail("E942", "this is not an action log of topple steer");
        if (entry.at("topple_log") != 1) fail("E942", "this program reads action logs of version 1");
        const std::string program = entry.at("program");
        if (program != "topple " + options.run.program_version)
          fail("E943", "the log was written by " + program, "only the same version gives the same bits");
        if (entry.at("rules_sha256") != calc_rules_hash(k))
          fail("E943", "the log was made with other knowledge rules", "give them with --knowledge");
        const std::string plan_text = entry.at("plan_text");
        if (calc_sha256(plan_text) != entry.at("plan_sha256").get<std::string>())
          fail("E942", "the plan in the log is not the one that its hash says");
        options.run.frame_rate = entry.at("frame_rate");
        options.run.duration = entry.at("duration");
        options.run.step = entry.at("step");
        result.steering = std::make_unique<LoggedSteering>(read_quietly(plan_text, entry.at("plan_path")), k, options,
                                                           SteeringCallbacks{}, "", sample_plan);
        continue;
      }
      Steering& s = result.steering->steering();
      const std::string action = entry.at("action");
      Branch& b = s.branch(entry.at("branch"));
      const long step = entry.at("step");
      if (s.active().id != b.id) s.switch_to(b.id);
      s.begin(b);
      if (entry.contains("frame")) {
        // the cursor was in the past; nothing beyond its frame is needed
        const size_t frame = entry.at("frame");
        while (b.frames() <= frame && s.advance())
          if (progress.is_cancelled()) return result;
        s.rewind_to_frame(frame);
      } else {
        while (b.steps() < step && s.advance())
          if (progress.is_cancelled()) return result;
        s.go_live();
      }
      if (progress.report) progress.report(static_cast<double>(at), static_cast<double>(log.size()));
      if (s.cursor_step() != step) fail("E943", fmt::format("branch {} does not come to step {} again", b.id, step));
      if (action != "reached") {
        const Steering::Made made = result.steering->perform(entry.at("command"));
        if (made.branch->id != entry.at("made").get<int>()) fail("E943", "the action makes another branch than it did");
      }
      ++result.actions;
    } catch (const Json::exception& e) { fail("E942", std::string("this line lacks something: ") + e.what()); }
  }
  if (result.steering == nullptr) {
    line = 1;
    fail("E942", "there is no whole line in the log");
  }
  return result;
}

}  // namespace topple::collapse
